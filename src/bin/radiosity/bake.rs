//! `radiosity bake`: from a scene file to radiosity at vertices, a report and a picture.

pub mod bands;
pub mod files;
pub mod preview;
pub mod settings;

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::{Args, ValueEnum};
use files::Files;
use radiosity::bake::Outcome;
use radiosity::bands::Bands;
use radiosity::work::{Journal, JournalPart, is_first, with_journal};
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, Rgb, Scene, Sky, kept_mesh};
use settings::Adjustment;

use crate::args::{self, DeviceOptions, MeasureOptions, Parsed, SHARE, Stop, give, value};
use crate::light::warn_of_failure;
use crate::report::Report;
use crate::scene_options::{Input, SceneOptions};
use crate::{interrupt, progress};

/// Bakes the radiosity of a scene at the vertices of a mesh
#[derive(Args)]
#[command(after_help = "\
Without --error, --error-each, --time, --gather and --set a bake goes to an error of 5 %. The \
error of radiosity is estimated, as a share: a root mean square over the area that reflects, less \
the tail. \
Ctrl-C or SIGTERM stops the bake and writes what there is; a second one ends the program at \
once.")]
pub struct Bake {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj", required = true)]
    scene: Option<PathBuf>,
    /// Bake until the estimated error of reflected radiosity is below this share [default: 0.05]
    #[arg(long, value_name = "SHARE", value_parser = value::<f64>(SHARE))]
    #[arg(conflicts_with = "error_each")]
    error: Option<f64>,
    /// Bake until the estimated error of each group of the scene is below this share
    #[arg(long, value_name = "SHARE", value_parser = value::<f64>(SHARE))]
    error_each: Option<f64>,
    #[command(flatten)]
    measure: MeasureOptions,
    /// Limit of time: bake to the error that it permits or, with an error, until that is reached
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "state")]
    time: Option<Duration>,
    /// Vertices that gather the solved light: none; needed, where elements are split since light is
    /// not linear on them; all, of elements that are all split once
    #[arg(long, value_name = "WHICH", hide_possible_values = true)]
    gather: Option<Gather>,
    /// Light at the file's own vertices, in their order, and nothing split: the error is that of
    /// the vertices alone
    #[arg(long, conflicts_with_all = ["error_each", "time", "gather", "bands", "pixel_gather"])]
    keep_mesh: bool,
    /// Set a setting of the library, as rays=512; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = settings::adjustment)]
    set: Vec<Adjustment>,
    /// Print the settings for --set and the options that are not listed here, and exit
    #[arg(long, exclusive = true)]
    list_settings: bool,
    /// Light in bands too, for the materials in this file: STEM.bands.ply and, where bands have
    /// wavelengths, STEM.bands.exr and .png
    #[arg(long, value_name = "FILE.json", hide = true)]
    bands: Option<PathBuf>,
    /// Keep what was computed in this file while the bake runs, and resume from the file where it
    /// exists: the files are those of a bake that was not interrupted; not with --time
    #[arg(long, value_name = "FILE", hide = true)]
    state: Option<PathBuf>,
    /// Write STEM.ply and .glb again whenever the light is better, while the bake goes on
    #[arg(long, hide = true, conflicts_with = "keep_mesh")]
    preview: bool,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    reading: SceneOptions,
    #[command(flatten)]
    device: DeviceOptions,
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
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub enum Gather {
    None,
    Needed,
    All,
}

impl Bake {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        match self.scene.take() {
            Some(scene) if !self.list_settings => {
                let report = self.bake_file(&scene)?;
                say!("{}", report.table());
                args::end_at(!matches!(report.baked.outcome, Outcome::Missed(_)))
            }
            _ => {
                settings::print();
                Ok(())
            }
        }
    }

    /// How far to go.
    fn target(&self) -> Target {
        match (self.error, self.error_each, self.time) {
            (Some(error), ..) => Target::Error(error),
            (None, Some(error), _) => Target::ErrorEach(error),
            (None, None, Some(time)) => Target::Seconds(time.as_secs_f64()),
            (None, None, None) => match self.gather {
                None if self.set.is_empty() || self.keep_mesh => Target::Error(0.05),
                gather => Target::Settings(gather.unwrap_or(Gather::None)),
            },
        }
    }

    /// The time after which a bake to an error stops.
    fn limit(&self) -> Option<Duration> {
        self.time.filter(|_| self.error.is_some() || self.error_each.is_some())
    }

    /// Makes the settings that options name, after all others were chosen.
    fn adjust(&self, settings: &mut BakeSettings) {
        settings.measure = self.measure.measure();
        self.set.iter().for_each(|adjustment| adjustment(settings));
        match (self.gather, &mut settings.gather) {
            (Some(Gather::None), gather) => *gather = None,
            (Some(Gather::Needed), Some(gather)) => gather.refinement.initial_subdivisions = 0,
            (Some(Gather::All), Some(gather)) => gather.refinement.initial_subdivisions = 1,
            _ => {}
        }
    }

    /// From the scene file to all files that are asked for.
    fn bake_file(mut self, path: &Path) -> Result<Report, Stop> {
        let start = Instant::now();
        self.files.name_after(path, &self.reading, self.keep_mesh)?;
        if self.preview {
            self.files.check_preview()?;
        }
        let Input { scene, luminaires, mut warnings, .. } = self.reading.read(path)?;
        let bands = self.bands.as_ref().map(|path| bands::read_and_warn(path, &scene));
        let bands = bands.transpose()?;
        // Once for the bake and the vertices.
        let scene = Arc::new(if self.keep_mesh { scene.resolve_sides() } else { scene });
        let triangles = scene.triangles().len();
        let opening = Instant::now();
        let device = self.device.open()?;
        let baking = Instant::now();
        let mut state = self.state(&scene, bands.as_ref(), &device)?;
        let light = with_journal(&mut state, || {
            // Otherwise the bake drops the scene once it is cut.
            let kept = self.keep_mesh.then(|| scene.clone());
            let previewed = Some(&self.files).filter(|_| self.preview && is_first());
            let mut baked = preview::during(previewed, |preview| {
                progress::of_bake(|unshot_goal, report| {
                    self.bake(scene, &device, start, unshot_goal, &mut |progress| {
                        preview(progress);
                        report(progress)
                    })
                })
            })?;
            if let Some(scene) = kept {
                baked = self.on_kept_mesh(&baked, scene, &device)?;
            }
            let band_light = bands::light(bands.as_ref(), &baked)?;
            Ok::<_, Stop>((baked, band_light))
        });
        if let Some(Err(error)) = state.map(Journal::finish) {
            progress::add_unwritten(&error);
        }
        let (mut baked, band_light) = light?;
        let stopped = interrupt::stopped();
        warnings.extend(warn_of_failure(&baked));
        warn_of_darkness(&baked);
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
            scene: path.display().to_string(),
            sky,
            luminaires,
            adapter: device.adapter(),
            target: self.target(),
            limit: self.limit(),
            triangles,
            load: (opening - start).as_secs_f64(),
            open: (baking - opening).as_secs_f64(),
            write: writing.elapsed().as_secs_f64(),
            total: start.elapsed().as_secs_f64(),
            warnings,
            picture,
            stopped,
            bands: band_light,
            baked,
        };
        self.files.write_report(report.to_json());
        Ok(report)
    }

    /// The state that the bake goes on from and adds to, if it is to have one: in the first of
    /// several processes.
    fn state(
        &self,
        scene: &Scene,
        bands: Option<&Bands>,
        device: &Backend,
    ) -> Result<Option<Journal>, Stop> {
        let Some(path) = self.state.as_ref().filter(|_| is_first()) else { return Ok(None) };
        args::check_writable(path)?;
        let mut settings = BakeSettings::for_error(0.05, scene);
        self.adjust(&mut settings);
        let adapter = device.adapter();
        let part = |name: &str, text: String| JournalPart {
            name: name.into(),
            hash: xxhash_rust::xxh3::xxh3_64(text.as_bytes()),
        };
        let target = (self.target(), self.keep_mesh, bands);
        let parts = [
            part("version of the program", env!("CARGO_PKG_VERSION").into()),
            part("scene or light", format!("{}", scene.fingerprint())),
            part("target or settings", format!("{target:?} {settings:?}")),
            part("device", format!("{:?} {}", adapter.kind, adapter.name)),
        ];
        let reading = || Journal::open(path, &parts);
        Ok(Some(progress::of_reading(path, reading)?))
    }

    /// The light of a bake at the vertices of `scene`.
    fn on_kept_mesh(
        &self,
        baked: &BakeResult,
        scene: Arc<Scene>,
        device: &Backend,
    ) -> Result<BakeResult, Stop> {
        let error = self.error.unwrap_or(0.05);
        let kept = progress::of_count("vertices, then paths", |report| {
            baked.on_kept_mesh(scene, error, device, report)
        })?;
        kept.ok_or(Stop::Interrupted)
    }

    /// The bake itself, of a program that began at `start`; `unshot_goal` is set to the share of
    /// unshot light that it goes down to.
    fn bake(
        &self,
        scene: Arc<Scene>,
        device: &Backend,
        start: Instant,
        unshot_goal: &Cell<f64>,
        progress: progress::OfBake,
    ) -> Result<BakeResult, Error> {
        let overrides = |settings: &mut BakeSettings| {
            self.adjust(settings);
            unshot_goal.set(settings.solve.solver.unshot);
        };
        // What reading took is part of the time.
        let left =
            |time: Duration| time.saturating_sub(start.elapsed()).max(Duration::from_millis(1));
        let target = match (self.target(), self.limit().map(left)) {
            (Target::Error(error), None) if self.keep_mesh => {
                BakeTarget::Error(kept_mesh::error_of_bake(error))
            }
            (Target::Error(error), None) => BakeTarget::Error(error),
            (Target::Error(error), Some(time)) => {
                BakeTarget::Within { error, each_group: false, time }
            }
            (Target::ErrorEach(error), None) => BakeTarget::ErrorEach(error),
            (Target::ErrorEach(error), Some(time)) => {
                BakeTarget::Within { error, each_group: true, time }
            }
            (Target::Seconds(_), _) => BakeTarget::Time(left(self.time.unwrap_or_default())),
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

/// Prints why all is dark, if it is.
fn warn_of_darkness(baked: &BakeResult) {
    if baked.light.surface.radiosity.iter().any(|&b| b != Rgb::ZERO) {
        return;
    }
    let scene = baked.mesh.scene();
    let reflects = |t: usize| scene.material(t).reflectance != Rgb::ZERO;
    eprintln!(
        "warning: {}",
        match (0..scene.triangles().len()).any(reflects) {
            true => {
                "no light reaches any surface: nothing emits, and no opening lets a sky in; name \
                 a material that emits with --emit MATERIAL=r,g,b, or look at which way surfaces \
                 face"
            }
            false => {
                "no surface reflects or emits anything: give materials a `Kd`, or --emit \
                 MATERIAL=r,g,b"
            }
        }
    );
}

/// Seconds above 0.
fn seconds(text: &str) -> Parsed<Duration> {
    let time = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    let time = time.filter(|time| !time.is_zero());
    time.ok_or_else(|| give("seconds above 0, such as 10"))
}
