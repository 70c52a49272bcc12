//! `radiosity light-map`: the irradiance of a scene's surfaces in a texture.

mod files;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use clap::Args;
use files::{BINDINGS, Bind, FORMATS, Format, print_layout};
use radiosity::light_map::{Atlas, Coordinates, LayoutSettings, LightMap, Maps, Resolution};
use radiosity::verify::Estimate;
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, Rgb, Scene, Sky};

use crate::args::{
    self, DeviceOptions, List, MeasureOptions, Names, Output, SHARE, Stop, one_of, some_of, value,
};
use crate::bake::files::SAMPLES;
use crate::camera_option::CameraOption;
use crate::scene_options::{Input, SceneOptions};
use crate::viewer_options::ViewerOptions;
use crate::{progress, standard};

/// Maximum number of texels along a side where the error asked for says how many.
const MAX_PIXELS: u32 = 2048;

/// Share of the error asked for that may be lost between texels: it leaves 0.6 for the light, since
/// squares add up. Plain choice: as many texels again would leave more than paths cost.
const BETWEEN_TEXELS: f64 = 0.8;

/// Pixels of the picture.
const PICTURE: [u32; 2] = [768, 512];

const COORDINATES: Names<Coordinates> =
    &[("auto", Coordinates::Auto), ("file", Coordinates::Given), ("new", Coordinates::Unwrapped)];

/// Bakes the irradiance of the surfaces of a scene in a texture
#[derive(Args)]
#[command(after_help = "\
Writes STEM.exr, irradiance in W/m² and which texels gathered, and STEM.glb, the scene with its \
coordinates in the map as TEXCOORD_1 and the map's radiosity as an image. Surfaces that reflect on \
both sides have texels for each; --sides front makes them one-sided. Ctrl-C stops the command, \
which then writes a map of fewer texels where one is done. STEM is the scene's path with \
.light-map as its ending unless --out gives another.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Error of the bake, and of the map between texels, as a share [default: 0.05]
    #[arg(long, value_name = "SHARE", value_parser = value::<f64>(SHARE))]
    #[arg(overrides_with = "error_each")]
    error: Option<f64>,
    /// The same for each group of the scene
    #[arg(long, value_name = "SHARE", value_parser = value::<f64>(SHARE))]
    #[arg(overrides_with = "error")]
    error_each: Option<f64>,
    /// Texels along a side of the map [default: a power of two, 64 to 2048, that suits the error]
    #[arg(long, value_name = "PIXELS", group = "resolution")]
    #[arg(value_parser = value::<u32>("a whole number of pixels"))]
    size: Option<u32>,
    /// Edge of a texel on the surfaces, scene unit
    #[arg(long, value_name = "SIZE", group = "resolution")]
    #[arg(value_parser = value::<f64>("a length"))]
    texel: Option<f64>,
    /// Texels a metre
    #[arg(long, value_name = "TEXELS", group = "resolution")]
    #[arg(value_parser = value::<f64>("a number of texels"))]
    density: Option<f64>,
    /// Spread surfaces over maps of so many texels along a side, as many as needed: STEM.1.exr …;
    /// with --texel or --density
    #[arg(long, value_name = "PIXELS", requires = "resolution", conflicts_with = "size")]
    #[arg(value_parser = value::<u32>("a whole number of pixels"))]
    atlas: Option<u32>,
    /// A map for each group, with coordinates of its own: STEM.GROUP.exr …; with --size, --texel or
    /// --density
    #[arg(long, requires = "resolution", conflicts_with = "atlas")]
    each_group: bool,
    /// Texels between charts and the borders of maps, filled from the charts: 2^n for n smaller
    /// images (mipmaps)
    #[arg(long, value_name = "TEXELS", default_value_t = 3)]
    padding: u32,
    /// Print the size of maps, and what they take, and end before the bake
    #[arg(long)]
    dry_run: bool,
    /// Texture coordinates: file, those of the file, in [0, 1] and with no texel in two triangles;
    /// new, charts for all smooth surfaces; auto, those of the file where they can be used
    #[arg(long, value_name = "WHICH", default_value = "auto", value_parser = one_of(COORDINATES))]
    coordinates: Coordinates,
    /// Write STEM.directional.exr: how irradiance changes with the normal, b = (x, y, z) of E + b ·
    /// (n' − n), for normal maps
    #[arg(long)]
    directional: bool,
    /// How the file of a glTF scene names the map, in which all else stays as it is: extras, of
    /// primitives, for programs that set the map themselves; emissive, of materials that show the
    /// scene's radiosity; occlusion, of materials, as brightness; none, for a file as those of OBJ
    /// scenes [default: extras]
    #[arg(long, value_name = "HOW", value_parser = one_of(BINDINGS))]
    bind: Option<Bind>,
    /// Write STEM.radiosity.exr: what surfaces emit and reflect, without textures
    #[arg(long)]
    radiosity: bool,
    #[command(flatten)]
    output: Output,
    /// Files: exr; glb; ktx2, with a common exponent (E5B9G9R9); rgbm, STEM.rgbm.png; json, what
    /// the maps are; ply, the scene cut to pieces of two texels with the light of the map, for
    /// `radiosity verify`; png, a picture of that
    #[arg(long = "write", value_name = "FORMATS", value_parser = some_of(FORMATS))]
    #[arg(default_value = "exr,glb")]
    formats: List<Format>,
    #[command(flatten)]
    camera: CameraOption,
    #[command(flatten)]
    viewer: ViewerOptions,
    #[command(flatten)]
    measure: MeasureOptions,
    #[command(flatten)]
    reading: SceneOptions,
    #[command(flatten)]
    device: DeviceOptions,
}

/// How far off what a map shows is, and by what.
pub struct Shown {
    /// What is lost of the light between texels.
    between: Estimate,
    /// Error of the light at texels.
    of_light: f64,
}

impl Shown {
    fn total(&self) -> f64 {
        libm::hypot(self.between.value, self.of_light)
    }
}

/// The light of a bake at the texels of `atlas`, unless Ctrl-C stopped either.
fn gather(atlas: Atlas, baked: &BakeResult, device: &Backend) -> Result<LightMap, Stop> {
    args::end()?;
    let map =
        progress::of_count("texels", |report| LightMap::of_bake(atlas, baked, device, report))?;
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
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        self.camera.find(&self.scene, PICTURE, SAMPLES)?;
        self.viewer.check()?;
        self.binding()?;
        let endings = args::names(FORMATS);
        let stem = standard::stem(&self.scene).with_added_extension("light-map");
        self.output.name(stem, &endings)?;
        let start = Instant::now();
        self.reading.texture_coordinates = true;
        let Input { scene, .. } = self.reading.read(&self.scene)?;
        let load = start.elapsed().as_secs_f64();
        let atlas = self.first_atlas(scene)?;
        let layout = start.elapsed().as_secs_f64();
        if self.dry_run {
            print_layout(&atlas);
            return Ok(());
        }
        let device = self.device.open()?;
        let open = start.elapsed().as_secs_f64();
        let mut baked = progress::of_bake(|_, report| {
            let measure = |settings: &mut BakeSettings| settings.measure = self.measure.measure();
            self.target().bake_with(atlas.scene().clone(), &device, measure, report)
        })?;
        let bake = start.elapsed().as_secs_f64();
        let (map, shown) = self.map(atlas, &baked, &device)?;
        let directional = self.directional(&map, &baked, &device)?;
        let texels = start.elapsed().as_secs_f64();
        if self.reading.sky.is_default() {
            // As in the picture of a bake.
            baked.light.surface.sky = Sky::default();
        }
        self.write(&map, &baked, shown.as_ref(), directional.as_ref())?;
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
        let is_reached = self.print_shown(shown);
        args::end_at(is_reached)
    }

    /// How far to bake.
    fn target(&self) -> BakeTarget {
        match self.error_each {
            Some(error) => BakeTarget::ErrorEach(error),
            None => BakeTarget::Error(self.error()),
        }
    }

    /// The error asked for.
    fn error(&self) -> f64 {
        self.error.or(self.error_each).unwrap_or(0.05)
    }

    /// The number of texels; none for as many as the error takes.
    fn resolution(&self) -> Option<Resolution> {
        let size = self.size.map(Resolution::Pixels);
        let of_metre = |texels: f64| 1.0 / (self.reading.unit * texels);
        let texel = self.texel.or(self.density.map(of_metre));
        size.or(texel.map(Resolution::TexelSize))
    }

    /// Lays out the surfaces of `scene`: in the fewest texels that they have room in, unless their
    /// number was given. Tells where the file's coordinates do not do.
    fn first_atlas(&self, scene: Scene) -> Result<Atlas, Error> {
        let scene = Arc::new(scene);
        let atlas = progress::of_stage("laying out surfaces", || match self.resolution() {
            Some(resolution) => Atlas::with_settings(scene, &self.layout(resolution)),
            None => Atlas::in_fewest_texels(scene, &self.layout(Resolution::Pixels(MAX_PIXELS))),
        })?;
        if let Some(unusable) = atlas.unusable() {
            eprintln!("note: surfaces are laid out anew, since texture coordinates are {unusable}");
        }
        Ok(atlas)
    }

    fn layout(&self, resolution: Resolution) -> LayoutSettings {
        let mut settings = LayoutSettings::new(resolution);
        (settings.coordinates, settings.padding) = (self.coordinates, self.padding);
        settings.maps = match self.atlas {
            Some(side) => Maps::Pages(side),
            None if self.each_group => Maps::EachGroup,
            None => Maps::One,
        };
        settings
    }

    /// How irradiance changes with the normal, if that is asked for.
    fn directional(
        &self,
        map: &LightMap,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<Option<[Vec<Rgb>; 3]>, Stop> {
        if !self.directional {
            return Ok(None);
        }
        args::end()?;
        let changes = progress::of_count("texels with tilted normals", |report| {
            map.directional(baked, device, report)
        })?;
        changes.map(Some).ok_or(Stop::Interrupted)
    }

    /// The map of `baked`, corrected by paths, and how far off it is; with as many texels as that
    /// takes, unless their number was given. Ctrl-C leaves the last that was done.
    fn map(
        &self,
        atlas: Atlas,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<(LightMap, Option<Shown>), Stop> {
        let (mut map, between) = self.resolved_map(atlas, baked, device)?;
        let Some(between) = between else { return Ok((map, None)) };
        // A quarter of the error, or of what is lost between texels if that is more: it adds 3 % to
        // the whole, and paths cost by the square.
        let left = (self.error().powi(2) - between.value.powi(2)).max(0.0).sqrt();
        let left = left.max(0.25 * self.error().max(between.value));
        let of_light = match args::end() {
            Ok(()) => progress::of_count("paths", |report| map.correct(baked, left, report))?,
            Err(_) => None,
        };
        let of_light = of_light.unwrap_or_else(|| baked.estimate.of_light());
        Ok((map, Some(Shown { between, of_light })))
    }

    /// The map of `baked`, and how much of its light is lost between texels; with as many texels as
    /// that takes, unless their number was given. Ctrl-C leaves the last that was done.
    fn resolved_map(
        &self,
        mut atlas: Atlas,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<(LightMap, Option<Estimate>), Stop> {
        let between = BETWEEN_TEXELS * self.error();
        let mut coarser: Option<(LightMap, Estimate)> = None;
        loop {
            let (scene, pixels) = (atlas.scene().clone(), atlas.width().max(atlas.height()));
            let map = gather(atlas, baked, device);
            let measured = map.and_then(|map| Ok((self.shown_error(&map, baked, device)?, map)));
            let (shown, map) = match (measured, coarser.take()) {
                (Err(Stop::Interrupted), Some((map, shown))) => return Ok((map, Some(shown))),
                (measured, _) => measured?,
            };
            let Some(shown) = shown.filter(|_| self.resolution().is_none()) else {
                return Ok((map, shown));
            };
            if shown.value <= between || pixels >= MAX_PIXELS {
                return Ok((map, Some(shown)));
            }
            let lost = 100.0 * shown.value;
            eprintln!("{pixels} texels along a side lose {lost:.2} % of the light between them");
            // The error falls no faster than texels become small.
            let times = libm::exp2(libm::log2(shown.value / between).floor().max(1.0));
            let pixels = (f64::from(pixels) * times).min(f64::from(MAX_PIXELS));
            coarser = Some((map, shown));
            atlas = progress::of_stage("laying out surfaces", || {
                Atlas::with_settings(scene, &self.layout(Resolution::Pixels(pixels as u32)))
            })?;
        }
    }

    /// How much of the light is lost between texels; none where nothing is to be measured.
    fn shown_error(
        &self,
        map: &LightMap,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<Option<Estimate>, Stop> {
        args::end()?;
        let shown = progress::of_count("points to measure the map", |report| {
            map.shown_error(baked, device, report)
        })?;
        args::end()?;
        Ok(shown)
    }

    /// Says whether the map shows what was asked for, and gives it.
    fn print_shown(&self, shown: Option<Shown>) -> bool {
        let Some(shown) = shown else { return true };
        // In the digits that it was asked in.
        let asked = (100.0 * self.error()) as f32;
        let is_reached = shown.total() <= self.error();
        let remedy = match () {
            () if is_reached => "",
            () if shown.between.value > shown.of_light => "; more texels (--size) would do",
            () => "; paths at texels are too few",
        };
        let [total, between, of_light, noise] =
            [shown.total(), shown.between.value, shown.of_light, shown.between.standard_error]
                .map(|x| 100.0 * x);
        say!(
            "{asked} % {}: the map shows radiosity that is off by {total:.2} %: {between:.2} ± \
             {noise:.2} % between texels, {of_light:.2} % of the light{remedy}",
            if is_reached { "reached" } else { "missed" }
        );
        is_reached
    }
}
