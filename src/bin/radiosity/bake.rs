//! `radiosity bake`: from a scene file to radiosity at vertices, a report and a picture.

pub mod bands;
pub mod files;
pub mod settings;

use std::cell::Cell;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use files::Files;
use lexopt::prelude::*;
use radiosity::backend::AdapterKind;
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, Rgb, Scene, Sky, Solver};
use settings::{Adjustment, Setting};

use crate::args::{self, Device, Stop, adapter_kind};
use crate::report::Report;
use crate::scene_options::SceneOptions;
use crate::{interrupt, progress};

pub const USAGE: &str = "\
usage: radiosity bake SCENE.obj [--out STEM] [--error X | --error-each X] [--time SECONDS]
            [--gather none|needed|all] [settings] [--camera ex,ey,ez,tx,ty,tz,vfov_deg]
            [--exposure X] [--image W,H] [--pixel-gather] [--write FORMATS]
            [--elements] [--bands FILE.json] [--adapter NAME | --cpu]
            [--adapter-kind KIND]

Writes STEM.ply (radiosity at vertices, and how far it may be off), STEM.glb (the same for viewers
of glTF), STEM.json (a report) and a picture, STEM.exr (linear radiance) and STEM.png. STEM is the
scene without its ending, unless given.

How far to go:
  --error X         until the estimated error of the vertices' reflected radiosity is below this
                    share, root mean square over the area that reflects: 0.02 for 2 %
  --error-each X    the same for each group of the scene, however small
  --time SECONDS    as exact as these seconds allow; with an error, until that is reached, but no
                    longer
  --gather WHICH    without either: vertices that gather the settled light: none, needed (elements
                    are split where the light is not linear in them), or all (of elements that are
                    all split once more) [none]

Settings, each chosen by what is asked for unless set by hand; in brackets those of --gather none:
  --element-size X  longest edge of an element that light is shot on, scene unit [diagonal / 32]
  --contacts N      levels that elements are split which other surfaces touch [3]
  --hemicube N      pixels along an edge of a hemicube's top face, even, for patches that shoot
                    much; a half or a quarter of them for dim ones, but no less than 16 [128]
  --full-share F    a patch shoots much from this share of the emitted light on; with 0 all do
  --near R          closed forms for receivers within R patch diameters; -1 for none [1]
  --viewpoints TOL  see a patch from its parts too, and go down to the elements where more than
                    this share of its light lands on other triangles by them; four times the
                    hemicubes or more [not done]
  --rotations K     hemicubes a viewpoint, each turned further, averaged [1]
  --unshot F        stop at this share of unshot flux [0.0001]
  --solver NAME     how light is spread: shooting, overshoot, jacobi, gauss-seidel, gmres or direct
                    [gmres where reflectance is near one, else shooting]
  --shots N         stop after this many shots, or steps of another solver
  --row-memory MB   memory for form-factor rows that are kept [1024]
  --patch-tolerance X  how much of its light a patch may send wrong for being large; 0 makes all
                    patches as small as they can be [0.004]
  --patch-level N   the smallest patches are 4^N elements [0]
  --ambient         add the light not yet shot, spread evenly; the files say so
Of vertices that gather:
  --gather-size X   longest edge of the elements whose corners gather first, scene unit
  --gather-contacts N  levels that these are split which other surfaces touch
  --rays N          rays a vertex gathers with
  --noise T         up to 16 times as many rays where they disagree by this share; inf for never
  --mesh-error E    split until elements are off by this share of their light, by prediction
  --curve T         split once more, without a gather, where parabolas bend by more; inf for nowhere
  --smallest X      length that light seldom changes below; elements are split down to an eighth
  --max-elements N  elements there may be [524288; of large scenes 20 a triangle, up to 4 million]
  --sweeps N        times that all vertices gather, the last time what they found before

Files and devices:
  --strict          refuse what would be repaired in the file
  --max-reflectance X  what a reflectance of 1 or more becomes [0.98]
  --bands FILE.json the light in these bands too, at the same vertices: STEM.bands.ply and, where
                    bands have wavelengths, .exr and .png in the colours that they add up to
  --emit MATERIAL=r,g,b  this material emits this radiance; may be repeated
  --transmit MATERIAL=r,g,b  this material is translucent: of the light on either side, this share
                    leaves diffusely from the other, instead of being reflected; may be repeated
  --sky r,g,b       radiance of a uniform sky around the scene, or none [1 if nothing emits]
  --sky WHICH       a sky above the horizon: overcast; cie1 to cie15, those of the CIE; or
                    perez:CLEARNESS,BRIGHTNESS; or a picture around the scene, FILE.exr or .hdr
  --zenith r,g,b    radiance of that sky straight up, or what a picture is multiplied with [1]
  --sun x,y,z=E     a sun; x,y,z is the direction towards the sun, and E, or r,g,b, the irradiance
                    of what faces it, W/m²
  --sun-at LATITUDE,LONGITUDE,TIME=E  the same by place (degrees north and east) and time, as
                    2026-06-21T12:00:00+02:00
  --up x,y,z        away from the ground, for skies [+y or +z, whichever seems to be]
  --north x,y,z     where north is, for --sun-at [-z; +y where +z is up]
  --luminaire FILE@x,y,z[:AIM[:C0]][*SCALE]  a lamp whose light an IESNA LM-63 (.ies) or EULUMDAT
                    (.ldt) file has, at x,y,z; aiming along x,y,z [down], with C = 0° towards x,y,z
                    [+x]; times a number or r,g,b [1]; may be repeated
  --luminaires LIST.json  many: a list of {\"file\": \"a.ies\", \"at\": [x, y, z]}, perhaps
                    with \"aim\", \"c0\" and \"scale\"; files lie in its folder
  --metres-per-unit M  of the scene's unit, for luminaires: 0.001 for millimetres [1]
  --sides WHICH     sides of surfaces that reflect: auto, those that light can reach, however they
                    are wound, front or both [auto]
  --specular WHICH  what the light that is spread takes mirrors and glass for: clear, it passes
                    glass straight on, and mirrors are their diffuse part; diffuse, both are their
                    diffuse part; or black. Pictures show them as such. ignore takes all for
                    diffuse [clear]
  --state FILE      write the state of the solve there now and then, and go on from it if it is
                    there: what is killed loses its last moments only; not with --time, which
                    solves many times
  --out STEM        where the files go, and how they begin [the scene without its ending]; a folder
                    takes files of the scene's name
  --write FORMATS   only these: some of ply, glb, json, exr, png and csv, which is of --bands
                    alone, with commas between them [all but csv]
  --camera ...      eye, target, vertical field of view in degrees; three more numbers are the
                    direction up [0,1,0]; the report names the camera that is chosen otherwise
  --exposure X      what radiance is multiplied with for the colours of PNG, GLB and PLY, before
                    highlights are rolled off; the report names the one that is chosen otherwise
  --image W,H       size of the picture in pixels [512,512]
  --pixel-gather    every pixel of the picture gathers the settled light for itself
  --elements        write STEM.elements.ply too: each element with its own value, not smoothed
  --adapter NAME    a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --adapter-kind KIND  choose between hemicubes, rays on the device and rays on the CPU as on a
                    discrete, an integrated or a software adapter [what the driver says]
  --cpu             rays on the CPU alone, K N squared a row that much light goes along; done
                    unasked where they are the fastest: on software adapters, for gathers and for
                    many triangles at few pixels

Ctrl-C or SIGTERM stops the bake, and what there is is written; again, it ends at once.";

/// What an error is given as.
const SHARE: &str = "a share, such as 0.1 for 10 %";

/// What a time is given as.
const SECONDS: &str = "seconds above 0, such as 10";

/// What is said of a scene that stays dark, and what to do about it.
const DARK: (&str, &str) = (
    "no light reaches any surface",
    "nothing emits, and no opening lets a sky in; name a material that emits with --emit \
     MATERIAL=r,g,b, or look at which way surfaces face",
);

/// The same where all surfaces are black.
const BLACK: (&str, &str) =
    ("no surface reflects or emits anything", "give materials a `Kd`, or --emit MATERIAL=r,g,b");

/// What is asked of a bake.
pub struct Bake {
    pub scene: PathBuf,
    reading: SceneOptions,
    pub target: Target,
    /// When to stop before the error is reached, since the bake began.
    limit: Option<Duration>,
    /// Settings made by hand, in their order.
    adjustments: Vec<Adjustment>,
    /// What materials are in bands.
    bands: Option<PathBuf>,
    files: Files,
    device: Device,
    /// What is chosen as on an adapter of this kind; as on its own, with none.
    kind: Option<AdapterKind>,
}

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// As far as fixed settings do.
    Settings(Gather),
    /// Until the error is estimated to be below this share.
    Error(f64),
    /// The same for each group.
    ErrorEach(f64),
    /// As far as these seconds allow.
    Seconds(f64),
}

/// Which vertices gather.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gather {
    None,
    Needed,
    All,
}

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let report = Bake::parse(parser)?.run()?;
    say!("{}", report.table());
    args::end()
}

impl Bake {
    fn parse(parser: &mut lexopt::Parser) -> Result<Bake, Stop> {
        let mut scenes = vec![];
        let (mut error, mut error_each, mut seconds) = (None, None, None);
        let (mut gather, mut state) = (None, false);
        let mut bake = Bake {
            scene: PathBuf::new(),
            reading: SceneOptions::default(),
            target: Target::Settings(Gather::None),
            limit: None,
            adjustments: vec![],
            bands: None,
            files: Files::new(),
            device: Device::Gpu(None),
            kind: None,
        };
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("error") => error = Some(args::value(parser, "error", SHARE)?),
                Long("error-each") => error_each = Some(args::value(parser, "error-each", SHARE)?),
                Long("time") => seconds = Some(args::value(parser, "time", SECONDS)?),
                Long("gather") => {
                    gather = Some(args::value(parser, "gather", "one of none, needed, all")?);
                }
                Long("ambient") => bake.adjustments.push(Box::new(|s| s.solve.ambient = true)),
                Long("state") => {
                    let path = PathBuf::from(parser.value()?);
                    state = true;
                    bake.adjustments
                        .push(Box::new(move |s| s.solve.checkpoint = Some(path.clone())));
                }
                Long("bands") => bake.bands = Some(parser.value()?.into()),
                Long("adapter") => bake.device = Device::named(parser)?,
                Long("adapter-kind") => bake.kind = Some(adapter_kind(parser)?),
                Long("cpu") => bake.device = Device::Cpu,
                Long(name) => {
                    let name = name.to_string();
                    if let Some(setting) = Setting::named(&name) {
                        bake.adjustments.push(setting.adjustment(parser)?);
                    } else if !bake.reading.option(&name, parser)?
                        && !bake.files.option(&name, parser)?
                    {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                Value(path) => scenes.push(path.into()),
                Short(_) => return Err(arg.unexpected().into()),
            }
        }
        bake.set_target(error, error_each, seconds)?;
        if state && seconds.is_some() {
            return Err(Stop::usage("--state is for one solve, --time for many: use --error"));
        }
        if let Some(gather) = gather {
            bake.set_gather(gather);
        }
        bake.scene = args::only_scene(scenes)?;
        bake.files = bake.files.named_after(&bake.scene);
        Ok(bake)
    }

    /// Says how far to go: until an error is reached, for some seconds, or the former and no longer
    /// than the latter.
    fn set_target(
        &mut self,
        error: Option<f64>,
        error_each: Option<f64>,
        seconds: Option<f64>,
    ) -> Result<(), Stop> {
        let limit = |seconds: f64| {
            let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero());
            time.ok_or_else(|| args::wrong_value("time", &seconds.to_string(), SECONDS))
        };
        let limit = seconds.map(limit).transpose()?;
        (self.target, self.limit) = match (error, error_each, seconds) {
            (Some(_), Some(_), _) => {
                let found = "--error is for the whole and --error-each for each group: give one";
                return Err(Stop::usage(found));
            }
            (Some(error), None, _) => (Target::Error(error), limit),
            (None, Some(error), _) => (Target::ErrorEach(error), limit),
            (None, None, Some(seconds)) => (Target::Seconds(seconds), None),
            (None, None, None) => return Ok(()),
        };
        Ok(())
    }

    /// Says which vertices gather, whatever else is asked for.
    fn set_gather(&mut self, choice: Gather) {
        if let Target::Settings(gather) = &mut self.target {
            *gather = choice;
        }
        self.adjustments.push(Box::new(move |settings| match (choice, &mut settings.gather) {
            (Gather::None, gather) => *gather = None,
            (Gather::Needed, Some(gather)) => gather.refinement.initial_subdivisions = 0,
            (Gather::All, Some(gather)) => gather.refinement.initial_subdivisions = 1,
            (_, None) => {}
        }));
    }

    /// From the scene file to all files that are asked for.
    fn run(self) -> Result<Report, Error> {
        let start = Instant::now();
        self.files.check()?;
        let name = self.scene.display().to_string();
        let scene = progress::of_reading(&self.scene, || {
            Ok::<_, Error>(self.reading.load(&self.scene)?.resolve_sides())
        })?;
        let mut warnings = self.reading.print_warnings(&scene);
        let bands = self.bands.as_ref().map(|path| bands::read_and_warn(path, &scene));
        let bands = bands.transpose()?;
        let triangles = scene.triangles().len();
        let load = start.elapsed().as_secs_f64();
        let opening = Instant::now();
        let device = progress::of_stage("opening the device", || self.device.open())?;
        let device = match (device, self.kind) {
            (Backend::Gpu(gpu), Some(kind)) => Backend::Gpu(gpu.assuming(kind)),
            (device, _) => device,
        };
        let open = opening.elapsed().as_secs_f64();
        let unshot_goal = Cell::new(Solver::default().unshot);
        interrupt::catch();
        let mut baked = progress::of_bake(
            || unshot_goal.get(),
            |report| self.bake(scene, &device, &unshot_goal, report),
        )?;
        let band_light = match &bands {
            Some(bands) => bands::light(bands, &baked)?,
            None => None,
        };
        let stopped = interrupt::stopped();
        if let Some(error) = &baked.device_failure {
            warnings.push(format!("rays on the CPU took the place of the device: {error}"));
            warnings.last().iter().for_each(|warning| eprintln!("warning: {warning}"));
        }
        if baked.light.surface.radiosity.iter().all(|&b| b == Rgb::ZERO) {
            let scene = baked.mesh.scene();
            let reflects = |t: usize| scene.material(t).reflectance != Rgb::ZERO;
            let is_black = !(0..scene.triangles().len()).any(reflects);
            let (found, remedy) = if is_black { BLACK } else { DARK };
            eprintln!("warning: {found}: {remedy}");
        }
        let sky = self.reading.sky.words(baked.mesh.scene());
        if self.reading.sky.is_default() {
            // White things would not be seen before the sky that was chosen to light them.
            baked.light.surface.sky = Sky::default();
        }
        let writing = Instant::now();
        let picture = self.files.write(&baked, &device)?;
        if let Some(light) = &band_light {
            self.files.write_bands(light, &baked, picture)?;
        }
        let report = Report {
            scene: name,
            sky,
            luminaires: self.reading.luminaires,
            adapter: device.adapter(),
            target: self.target,
            limit: self.limit,
            triangles,
            load,
            open,
            write: writing.elapsed().as_secs_f64(),
            total: start.elapsed().as_secs_f64(),
            warnings,
            picture,
            stopped,
            bands: band_light,
            baked,
        };
        self.files.write_report(&report.to_json())?;
        Ok(report)
    }

    /// The bake itself; `unshot_goal` is set to the share of unshot light that it goes down to.
    fn bake(
        &self,
        scene: Scene,
        device: &Backend,
        unshot_goal: &Cell<f64>,
        progress: progress::OfBake,
    ) -> Result<BakeResult, Error> {
        let overrides = |settings: &mut BakeSettings| {
            for adjustment in &self.adjustments {
                adjustment(settings);
            }
            unshot_goal.set(settings.solve.solver.unshot);
        };
        let target = match (self.target, self.limit) {
            (Target::Error(error), None) => BakeTarget::Error(error),
            (Target::Error(error), Some(time)) => {
                BakeTarget::Within { error, each_group: false, time }
            }
            (Target::ErrorEach(error), None) => BakeTarget::ErrorEach(error),
            (Target::ErrorEach(error), Some(time)) => {
                BakeTarget::Within { error, each_group: true, time }
            }
            (Target::Seconds(seconds), _) => BakeTarget::seconds(seconds)?,
            (Target::Settings(gather), _) => {
                let mut settings = match gather {
                    Gather::None => BakeSettings::elements_only(&scene),
                    Gather::Needed | Gather::All => BakeSettings::gathering(&scene),
                };
                overrides(&mut settings);
                return settings.bake(scene, device, progress);
            }
        };
        target.bake_with(scene, device, overrides, progress)
    }
}

impl std::str::FromStr for Gather {
    type Err = ();

    fn from_str(name: &str) -> Result<Gather, ()> {
        match name {
            "none" => Ok(Gather::None),
            "needed" => Ok(Gather::Needed),
            "all" => Ok(Gather::All),
            _ => Err(()),
        }
    }
}
