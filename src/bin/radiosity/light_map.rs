//! `radiosity light-map`: the irradiance of a scene's surfaces in a texture.

use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use lexopt::prelude::*;
use radiosity::io::{
    ToneCurve, write_light_map_exr, write_light_map_glb, write_light_map_radiosity,
    write_ply_with_tone, write_png_with_tone,
};
use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::verify::Estimate;
use radiosity::{Backend, BakeResult, BakeTarget, Camera, Error, ErrorKind, Scene};

use crate::args::{self, Device, Stop};
use crate::bake::files::{SAMPLES, camera};
use crate::scene_options::SceneOptions;
use crate::{interrupt, progress};

pub const USAGE: &str = "\
usage: radiosity light-map SCENE.obj [--error X | --error-each X] [--size PIXELS | --texel SIZE]
            [--coordinates auto|file|new] [--radiosity] [--out STEM] [--write FORMATS]
            [--camera ex,ey,ez,tx,ty,tz,vfov_deg] [--adapter NAME | --cpu]

Bakes a scene and gathers its light at the texels of a light map. Writes STEM.exr (irradiance in
W/m², linear, and the texels that gathered) and STEM.glb (the scene with its
places in the map as TEXCOORD_1, and the map's radiosity in the colours of an image). STEM is the
scene without its ending and with .light-map, unless given.

  --error X         how far the bake, and what the map shows, may be off: see `radiosity bake
                    --help` [0.05]. The last line says whether the map was measured to be so
  --error-each X    the same for each group of the scene, however small
  --size PIXELS     texels along a side of the map. Without, 64 to 2048, a power of two: as many
                    as it takes for what is shown, between texels too, to be as exact as asked
  --texel SIZE      edge of a texel on the surfaces, scene unit
  --coordinates auto  the texture coordinates of the file, where they are within [0, 1] and no two
                    triangles share a texel; else new ones. That is the default
  --coordinates file  those of the file, or an error that says why a light map cannot have them
  --coordinates new   new ones: charts for all smooth surfaces
  --radiosity       write STEM.radiosity.exr too: what surfaces emit and reflect, without textures
  --out STEM        where the files go, and how they begin; a folder takes files of the scene's name
  --write FORMATS   some of exr, glb, ply, png, with commas between them [exr,glb]. STEM.ply has
                    the scene cut to texels, each with the light that the map shows, as `radiosity
                    verify` takes it; STEM.png is a picture of that
  --camera ...      of the picture: eye, target, vertical field of view in degrees; three more
                    numbers are the direction up [0,1,0]
  --adapter NAME, --cpu, --strict, --max-reflectance, --emit, --transmit, --sky, --zenith, --sun,
  --sun-at, --up, --north, --sides, --specular   as in `radiosity bake`

Surfaces that reflect on both sides have texels for each; --sides front makes them one-sided.
Ctrl-C ends it, and nothing is written but a map of fewer texels, if one was done.";

/// Texels along a side where the error asked for says how many: the fewest and the most.
const PIXELS: RangeInclusive<u32> = 64..=2048;

/// Pixels of the picture.
const PICTURE: (u32, u32) = (768, 512);

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Format {
    Exr,
    Glb,
    Ply,
    Png,
}

const FORMATS: [(&str, Format); 4] =
    [("exr", Format::Exr), ("glb", Format::Glb), ("ply", Format::Ply), ("png", Format::Png)];

/// What is asked of the command.
struct Options {
    scene: PathBuf,
    reading: SceneOptions,
    target: BakeTarget,
    /// None for as many texels as it takes.
    resolution: Option<Resolution>,
    coordinates: Coordinates,
    radiosity: bool,
    stem: PathBuf,
    formats: Vec<Format>,
    camera: Option<Camera>,
    device: Device,
}

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    args::check_writable(&options.stem)?;
    let start = Instant::now();
    let scene = progress::of_reading(&options.scene, || {
        Ok::<_, Error>(options.reading.load(&options.scene)?.resolve_sides())
    })?;
    options.reading.print_warnings(&scene);
    let load = start.elapsed().as_secs_f64();
    let atlas = options.first_atlas(scene)?;
    let layout = start.elapsed().as_secs_f64();
    let device = progress::of_stage("opening the device", || options.device.open())?;
    let open = start.elapsed().as_secs_f64();
    interrupt::catch();
    let goal = || 1e-4;
    let baked = progress::of_bake(goal, |report| {
        options.target.bake(atlas.scene().clone(), &device, report)
    })?;
    let bake = start.elapsed().as_secs_f64();
    let (map, shown) = options.map(atlas, &baked, &device)?;
    let texels = start.elapsed().as_secs_f64();
    options.write(&map, &baked)?;
    print_map(&map, &baked);
    let total = start.elapsed().as_secs_f64();
    say!(
        "seconds    load {load:.2}, layout {:.2}, open {:.2}, bake {:.2}, texels {:.2}, write \
         {:.2}, total {total:.2}",
        layout - load,
        open - layout,
        bake - open,
        texels - bake,
        total - texels
    );
    progress::print_written();
    options.print_shown(shown, &baked);
    Ok(())
}

/// An error, in words.
fn said(shown: &Estimate) -> String {
    let [value, standard_error] = [shown.value, shown.standard_error].map(|x| 100.0 * x);
    format!("radiosity that is off by {value:.2} ± {standard_error:.2} %")
}

/// The light of a bake at the texels of `atlas`, unless Ctrl-C stopped either.
fn gather(atlas: Atlas, baked: &BakeResult, device: &Backend) -> Result<LightMap, Stop> {
    args::end()?;
    let map = progress::of_count("texels", |report| {
        LightMap::of_bake(atlas, baked, device, |done, of| {
            _ = report(done, of);
            interrupt::flow()
        })
    })?;
    map.ok_or(Stop::Interrupted)
}

/// Tells how large the map is, and how exact.
fn print_map(map: &LightMap, baked: &BakeResult) {
    let atlas = &map.atlas;
    let charts = match atlas.charts() {
        Some(charts) => format!("{charts} charts"),
        None => "coordinates of the file".into(),
    };
    let (width, height) = (atlas.width(), atlas.height());
    let gathered = map.gathered.iter().filter(|&&gathered| gathered).count();
    let (covered, texel) = (100.0 * map.coverage(), atlas.texel_size());
    say!(
        "light map  {width} × {height} texels of about {texel:.4}, {charts}, {covered:.1} % \
         covered, {gathered} gathered"
    );
    let total = 100.0 * baked.estimate.total;
    say!(
        "bake       {} vertices, {} gathers, error about {total:.2} %: {}",
        baked.light.surface.positions.len(),
        baked.light.gather_count,
        baked.outcome
    );
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        const SHARE: &str = "a share, such as 0.1 for 10 %";
        let (mut scenes, mut stem) = (vec![], None);
        let mut options = Options {
            scene: PathBuf::new(),
            reading: SceneOptions::default(),
            target: BakeTarget::Error(0.05),
            resolution: None,
            coordinates: Coordinates::Auto,
            radiosity: false,
            stem: PathBuf::new(),
            formats: vec![Format::Exr, Format::Glb],
            camera: None,
            device: Device::Gpu(None),
        };
        options.reading.with_texture_coordinates();
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("error") => {
                    options.target = BakeTarget::Error(args::value(parser, "error", SHARE)?);
                }
                Long("error-each") => {
                    let error = args::value(parser, "error-each", SHARE)?;
                    options.target = BakeTarget::ErrorEach(error);
                }
                Long("size") => {
                    let pixels = args::value(parser, "size", "a whole number of pixels")?;
                    options.resolution = Some(Resolution::Pixels(pixels));
                }
                Long("texel") => {
                    let size = args::value(parser, "texel", "a length")?;
                    options.resolution = Some(Resolution::TexelSize(size));
                }
                Long("coordinates") => options.coordinates = coordinates(parser)?,
                Long("radiosity") => options.radiosity = true,
                Long("out") => stem = Some(parser.value()?.into()),
                Long("write") => options.formats = args::formats(parser, &FORMATS)?,
                Long("camera") => options.camera = Some(camera(parser)?),
                Long("adapter") => options.device = Device::named(parser)?,
                Long("cpu") => options.device = Device::Cpu,
                Long(name) => {
                    let name = name.to_string();
                    if !options.reading.option(&name, parser)? {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                Value(path) => scenes.push(path.into()),
                Short(_) => return Err(arg.unexpected().into()),
            }
        }
        options.scene = args::only_scene(scenes)?;
        options.stem =
            args::stem(stem, options.scene.with_extension("light-map"), &args::names(&FORMATS));
        if let Some(camera) = &options.camera {
            camera.check(PICTURE.0, PICTURE.1, SAMPLES)?;
        }
        Ok(options)
    }

    /// Lays out the surfaces of `scene`: in the fewest texels that they have room in, unless their
    /// number was given. Tells where the file's coordinates do not do.
    fn first_atlas(&self, scene: Scene) -> Result<Atlas, Error> {
        let scene = Arc::new(scene);
        let atlas = progress::of_stage("laying out surfaces", || {
            if let Some(resolution) = self.resolution {
                return self.atlas(scene, resolution);
            }
            let mut pixels = *PIXELS.start();
            loop {
                match self.atlas(scene.clone(), Resolution::Pixels(pixels)) {
                    Err(e) if e.kind() == ErrorKind::Setting && pixels < *PIXELS.end() => {
                        pixels *= 2;
                    }
                    atlas => return atlas,
                }
            }
        })?;
        if let Some(unusable) = atlas.unusable() {
            eprintln!("note: surfaces are laid out anew, since texture coordinates are {unusable}");
        }
        Ok(atlas)
    }

    fn atlas(&self, scene: Arc<Scene>, resolution: Resolution) -> Result<Atlas, Error> {
        Atlas::new(scene, resolution, self.coordinates)
    }

    /// The map of `baked`, and how far off it was measured to be; with as many texels as that
    /// takes, unless their number was given. Ctrl-C leaves the last that was done.
    fn map(
        &self,
        mut atlas: Atlas,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<(LightMap, Option<Estimate>), Stop> {
        let mut coarser: Option<(LightMap, Estimate)> = None;
        loop {
            let (scene, pixels) = (atlas.scene().clone(), atlas.width().max(atlas.height()));
            let map = gather(atlas, baked, device);
            let measured = map.and_then(|map| Ok((self.shown_error(&map, baked, device)?, map)));
            let (shown, map) = match (measured, coarser.take()) {
                (Err(Stop::Interrupted), Some((map, shown))) => return Ok((map, Some(shown))),
                (measured, _) => measured?,
            };
            let Some(shown) = shown.filter(|_| self.resolution.is_none()) else {
                return Ok((map, shown));
            };
            // What the light itself is off by is for no texel to mend.
            let is_enough = shown.value <= self.error() || baked.estimate.of_light() > self.error();
            if is_enough || pixels >= *PIXELS.end() {
                return Ok((map, Some(shown)));
            }
            eprintln!("{pixels} texels along a side show {}", said(&shown));
            // The error falls no faster than texels become small.
            let times = (shown.value / self.error()).log2().floor().max(1.0).exp2();
            let pixels = (f64::from(pixels) * times).min(f64::from(*PIXELS.end()));
            coarser = Some((map, shown));
            atlas = progress::of_stage("laying out surfaces", || {
                self.atlas(scene, Resolution::Pixels(pixels as u32))
            })?;
        }
    }

    /// How far off what `map` shows is; none where nothing is to be measured.
    fn shown_error(
        &self,
        map: &LightMap,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<Option<Estimate>, Stop> {
        args::end()?;
        let shown = progress::of_count("points to measure the map", |report| {
            map.shown_error(baked, device, |done, of| {
                _ = report(done, of);
                interrupt::flow()
            })
        })?;
        args::end()?;
        Ok(shown)
    }

    /// The error asked for.
    fn error(&self) -> f64 {
        match self.target {
            BakeTarget::Error(error) | BakeTarget::ErrorEach(error) => error,
            _ => f64::INFINITY,
        }
    }

    /// Says whether the map shows what was asked for.
    fn print_shown(&self, shown: Option<Estimate>, baked: &BakeResult) {
        let Some(shown) = shown else { return };
        // In the digits that it was asked in.
        let asked = (100.0 * self.error()) as f32;
        let of_light = baked.estimate.of_light();
        if shown.value <= self.error() {
            say!("{asked} % reached: the map shows {}", said(&shown));
        } else {
            let remedy = match of_light > self.error() {
                true => format!("{:.2} % is the light that texels gather", 100.0 * of_light),
                false => "more texels (--size) would do".into(),
            };
            say!("{asked} % missed: the map shows {}; {remedy}", said(&shown));
        }
    }

    fn path(&self, ending: &str) -> PathBuf {
        self.stem.with_added_extension(ending)
    }

    fn write(&self, map: &LightMap, baked: &BakeResult) -> Result<(), Error> {
        let writes = |format: Format| self.formats.contains(&format);
        let tone = ToneCurve::fit(&baked.light.surface.radiosity);
        if writes(Format::Exr) {
            progress::of_writing(&self.path("exr"), |path| write_light_map_exr(path, map))?;
        }
        if self.radiosity {
            let path = self.path("radiosity.exr");
            progress::of_writing(&path, |path| write_light_map_radiosity(path, map))?;
        }
        if writes(Format::Glb) {
            progress::of_writing(&self.path("glb"), |path| write_light_map_glb(path, map, &tone))?;
        }
        if !writes(Format::Ply) && !writes(Format::Png) {
            return Ok(());
        }
        let surface = progress::of_stage("cutting the scene to texels", || map.surface())?;
        if writes(Format::Ply) {
            progress::of_writing(&self.path("ply"), |path| {
                write_ply_with_tone(path, &surface, &tone)
            })?;
        }
        if writes(Format::Png) {
            let (width, height) = PICTURE;
            let aspect = f64::from(width) / f64::from(height);
            let camera = self.camera.unwrap_or_else(|| Camera::framing(&baked.light, aspect));
            let image = camera.image(&surface, width, height, SAMPLES)?;
            let tone = ToneCurve::fit_image(&image);
            progress::of_writing(&self.path("png"), |path| {
                write_png_with_tone(path, &image, &tone)
            })?;
        }
        Ok(())
    }
}

/// Which texture coordinates the map has, by name.
fn coordinates(parser: &mut lexopt::Parser) -> Result<Coordinates, Stop> {
    let text = parser.value()?.string()?;
    match text.as_str() {
        "auto" => Ok(Coordinates::Auto),
        "file" => Ok(Coordinates::Given),
        "new" => Ok(Coordinates::Unwrapped),
        _ => Err(args::wrong_value("coordinates", &text, "auto, file or new")),
    }
}
