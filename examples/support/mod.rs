//! What the examples share: the whole path from a scene file to the files that come out.
// Each example uses a part of it.
#![allow(dead_code)]

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use radiosity::{
    Backend, BakeProgress, BakeResult, BakeSettings, BakeTarget, Camera, Error, ErrorEstimate,
    ErrorKind, GatherProgress, GatherSettings, Progress, RadianceImage, RefinementSettings, Report,
    Scene, Seconds, VertexMesh, load_obj, write_exr, write_ply, write_png,
};
use serde_json::{Value, json};

/// What is asked of a bake.
pub struct Bake {
    pub scene: PathBuf,
    /// Path of the output without its ending.
    pub out: PathBuf,
    pub goal: Goal,
    /// Settings made by hand, in their order.
    pub changes: Vec<Change>,
    pub camera: Option<Camera>,
    pub image: (u32, u32),
    /// Whether the pixels of the image gather.
    pub pixel_gather: bool,
    /// Whether to write the elements' own values too.
    pub elements: bool,
    pub device: Choice,
}

/// A setting made by hand.
pub type Change = Box<dyn Fn(&mut BakeSettings)>;

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// As far as fixed settings do, whose vertices gather or do not.
    Plain { gather: bool },
    /// Until the error is estimated to be below this.
    Error(f64),
    /// As far as these seconds allow.
    Seconds(f64),
}

/// Who makes rows.
#[derive(Clone, Debug, PartialEq)]
pub enum Choice {
    /// HemicubeRows on the adapter of this name, or the best.
    Gpu(Option<String>),
    /// RayScene on the CPU, as many a row as the hemicube's top face has pixels.
    Cpu,
}

impl Choice {
    pub fn open(&self) -> Result<Backend, Error> {
        match self {
            Choice::Gpu(name) => Backend::gpu(name.as_deref()),
            Choice::Cpu => Ok(Backend::Cpu),
        }
    }
}

/// Lines of sight along a pixel's side.
const SAMPLES: u32 = 4;

impl Bake {
    pub fn new(scene: impl Into<PathBuf>) -> Bake {
        let scene = scene.into();
        Bake {
            out: scene.with_extension(""),
            scene,
            goal: Goal::Plain { gather: false },
            changes: vec![],
            camera: None,
            image: (512, 512),
            pixel_gather: false,
            elements: false,
            device: Choice::Gpu(None),
        }
    }

    /// From the scene file to STEM.ply, STEM.json and, with a camera, STEM.exr and STEM.png.
    pub fn run(&self) -> Result<Report, Error> {
        let start = Instant::now();
        writable(&self.out)?;
        let (width, height) = self.image;
        self.camera.iter().try_for_each(|c| c.check(width, height, SAMPLES))?;
        let mut scene = load_obj(&self.scene)?;
        scene.check_winding();
        for warning in scene.warnings() {
            eprintln!("warning: {warning}");
        }
        let (warnings, triangles) = (scene.warnings().to_vec(), scene.triangles().len());
        let load = start.elapsed().as_secs_f64();
        let opening = Instant::now();
        let device = self.device.open()?;
        let open = opening.elapsed().as_secs_f64();
        let baked = self.bake(scene, &device)?;
        let writing = Instant::now();
        let mut surface = baked.light.surface.clone();
        surface.comments = comments(&baked);
        write_ply(self.out.with_added_extension("ply"), &surface)?;
        if self.elements {
            let flat = VertexMesh::per_element(&baked.mesh, &baked.solution.radiosity);
            write_ply(self.out.with_added_extension("elements.ply"), &flat)?;
        }
        if let Some(camera) = self.camera {
            let image = match self.pixel_gather {
                true => self.gathered_image(&camera, &baked, &device)?,
                false => camera.image(&surface, width, height, SAMPLES)?,
            };
            write_exr(self.out.with_added_extension("exr"), &image)?;
            write_png(self.out.with_added_extension("png"), &image)?;
        }
        let s = baked.timings;
        let report = Report {
            scene: self.scene.display().to_string(),
            adapter: device.adapter(),
            goal: self.goal.to_json(),
            settings: settings(&baked.settings),
            triangles,
            shot_elements: baked.mesh.element_count(),
            elements: baked.light.mesh.element_count(),
            vertices: surface.positions.len(),
            shots: baked.solution.shots,
            hemicubes: baked.hemicubes,
            hemicubes_by_resolution: baked.hemicubes_by_resolution,
            gathers: baked.light.gathers,
            gather_change: baked.light.change,
            gather_stop: match baked.settings.gather {
                Some(_) => baked.light.stop.to_string(),
                None => "none".into(),
            },
            near_moved: baked.mean_near_correction,
            stop: baked.solution.stop.to_string(),
            ledger: baked.solution.ledger,
            certificate: baked.estimate,
            seconds: Seconds {
                load,
                open,
                mesh: s.mesh,
                draw: s.draw,
                reduce: s.reduce,
                readback: s.readback,
                solve: s.solve,
                vertices: s.vertices,
                certificate: s.estimate,
                write: writing.elapsed().as_secs_f64(),
                total: start.elapsed().as_secs_f64(),
            },
            warnings,
        };
        report.write(self.out.with_added_extension("json"))?;
        Ok(report)
    }

    fn bake(&self, scene: Scene, device: &Backend) -> Result<BakeResult, Error> {
        let bar = bar();
        let told = |stage: &BakeProgress| {
            show(&bar, stage);
            ControlFlow::Continue(())
        };
        let overrides = |settings: &mut BakeSettings| {
            for change in &self.changes {
                change(settings);
            }
        };
        let baked = match self.goal {
            Goal::Error(error) => {
                BakeTarget::Error(error).bake_with(scene, device, overrides, told)
            }
            Goal::Seconds(seconds) => {
                BakeTarget::seconds(seconds)?.bake_with(scene, device, overrides, told)
            }
            Goal::Plain { gather } => {
                let mut settings = match gather {
                    true => BakeSettings::gathering(&scene),
                    false => BakeSettings::elements_only(&scene),
                };
                overrides(&mut settings);
                settings.bake(scene, device, told)
            }
        };
        bar.finish_and_clear();
        baked
    }

    /// The picture, each pixel of which gathers what the vertices know, or else the elements.
    fn gathered_image(
        &self,
        camera: &Camera,
        baked: &BakeResult,
        device: &Backend,
    ) -> Result<RadianceImage, Error> {
        let rays = baked.settings.gather.as_ref().map_or(2048, |gather| gather.rays);
        let mut gather = device.gather(&baked.light.mesh, rays)?;
        let ((width, height), bar) = (self.image, bar());
        let image = camera.gathered_image(
            &baked.light,
            &mut *gather,
            width,
            height,
            SAMPLES,
            |done, of| {
                bar.set_position((1000 * done / of) as u64);
                bar.set_message(format!("picture, {done} of {of} pixels"));
                ControlFlow::Continue(())
            },
        )?;
        bar.finish_and_clear();
        Ok(image.expect("nobody stopped it"))
    }
}

impl Goal {
    fn to_json(self) -> Value {
        match self {
            Goal::Plain { .. } => json!(null),
            Goal::Error(error) => json!({ "error": error }),
            Goal::Seconds(seconds) => json!({ "seconds": seconds }),
        }
    }
}

fn comments(baked: &BakeResult) -> Vec<String> {
    let mut comments = vec![];
    if baked.settings.solve.ambient {
        comments.push("ambient term of the unshot light added to the elements".into());
    }
    let ErrorEstimate { total, samples: places, .. } = baked.estimate;
    comments.push(format!(
        "estimated error {:.3} % of radiosity, RMS over area, at {places} places; vertices have \
         their own",
        100.0 * total
    ));
    comments
}

fn settings(settings: &BakeSettings) -> Vec<(String, Value)> {
    let solve = &settings.solve;
    let solver = &solve.solver;
    let mut all = vec![
        ("element_size", json!(solve.element_size)),
        ("contacts", json!(solve.contact_levels)),
        ("hemicube", json!(solve.hemicube_resolution)),
        ("full_share", json!(solve.full_resolution_share)),
        ("near", json!(solve.near_reach)),
        ("viewpoints", json!(solve.viewpoint_tolerance)),
        ("rotations", json!(solve.rotations.get())),
        ("solver", json!((!solve.gmres_if_bright).then(|| solver.method.to_string()))),
        ("unshot", json!(solver.unshot)),
        ("shots", json!(solver.max_steps)),
        ("row_memory", json!(solver.row_memory)),
        ("patch_tolerance", json!(solver.patch_tolerance)),
        ("patch_level", json!(solver.min_patch_level)),
        ("ambient", json!(solve.ambient)),
        ("gather", json!(if settings.gather.is_some() { "needed" } else { "none" })),
    ];
    if let Some(gather) = &settings.gather {
        let GatherSettings { element_size, contact_levels, rays, noise_tolerance, .. } = gather;
        let RefinementSettings { tolerance, smallest, curve, elements, everywhere, sweeps } =
            &gather.refinement;
        all.extend([
            ("gather_size", json!(element_size)),
            ("gather_contacts", json!(contact_levels)),
            ("rays", json!(rays)),
            // JSON has no infinity: null where there are never more rays.
            ("noise", json!(noise_tolerance)),
            ("bend", json!(tolerance)),
            ("smallest", json!(smallest)),
            // JSON has no infinity: null where nothing is split for its curve.
            ("curve", json!(curve)),
            ("max_elements", json!(elements)),
            ("gather_levels", json!(everywhere)),
            ("sweeps", json!(sweeps)),
        ]);
    }
    all.into_iter().map(|(name, value)| (name.into(), value)).collect()
}

/// A 32nd of the diagonal of the scene's bounding box.
pub fn default_element_size(scene: &Scene) -> f64 {
    BakeSettings::elements_only(scene).solve.element_size
}

/// Refuses an output that could not be written before any work is done for it.
pub fn writable(out: &Path) -> Result<(), Error> {
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let probe = folder.join(format!(".radiosity-{}", std::process::id()));
    let result = std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe));
    result.map_err(|e| {
        let place = format!("output folder {}", folder.display());
        let remedy = "choose a folder that exists and can be written";
        Error::new(ErrorKind::File, place, e.to_string(), remedy).with_source(e)
    })
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {msg}") {
        bar.set_style(style);
    }
    bar
}

/// The bar fills with the vertices of a level, or while shooting with the share that is shot.
fn show(bar: &ProgressBar, stage: &BakeProgress) {
    match stage {
        BakeProgress::Shooting(Progress { shots, rows_made, unshot_share, elapsed, .. }) => {
            bar.set_position((1000.0 * (1.0 - unshot_share).clamp(0.0, 1.0)) as u64);
            bar.set_message(format!(
                "shooting, {:.3} % unshot, {shots} shots, {rows_made} hemicubes, {:.1} s",
                100.0 * unshot_share,
                elapsed.as_secs_f64()
            ));
        }
        BakeProgress::Gathering(GatherProgress { sweep, level, elements, gathered, of }) => {
            bar.set_position((1000 * gathered / of.max(&1)) as u64);
            bar.set_message(format!(
                "gathering, sweep {}, split {level} times, {gathered} of {of} vertices, \
                 {elements} elements",
                sweep + 1
            ));
        }
        BakeProgress::Estimating { samples, of } => {
            bar.set_position((1000 * samples / of.max(&1)) as u64);
            bar.set_message(format!("estimating the error, {samples} of {of} points"));
        }
        BakeProgress::Estimated(estimate) => {
            bar.println(format!("estimated error {:.2} %", 100.0 * estimate.total));
        }
        BakeProgress::DeviceFailed(error) => {
            bar.println(format!("rays on the CPU go on: {error}"));
        }
        _ => {}
    }
}

/// A small table of what was done.
pub fn table(report: &Report) -> String {
    let [name, kind, driver] = &report.adapter;
    let s = report.seconds;
    let share = |c: radiosity::Rgb| {
        let whole = report.ledger.emitted.element_sum();
        if whole > 0.0 { 100.0 * c.element_sum() / whole } else { 0.0 }
    };
    let (ledger, c) = (report.ledger, report.certificate);
    [
        format!("adapter    {name} ({kind}), {driver}"),
        format!(
            "mesh       {} triangles, {} elements that shot, {} in the end, {} vertices",
            report.triangles, report.shot_elements, report.elements, report.vertices
        ),
        format!(
            "shooting   {} shots, {} hemicubes, {}",
            report.shots, report.hemicubes, report.stop
        ),
        format!(
            "gathering  {} places, {}, changed the vertices by {:.2} %",
            report.gathers,
            report.gather_stop,
            100.0 * report.gather_change
        ),
        format!(
            "light      absorbed {:.2} %, left {:.2} %, met backs {:.2} %, unshot {:.2} %",
            share(ledger.absorbed),
            share(ledger.escaped),
            share(ledger.backface_loss),
            share(ledger.unshot)
        ),
        format!(
            "error      about {:.2} %: mesh {:.2}, sampling {:.2}, truncation {:.2}, unshot {:.2}",
            100.0 * c.total,
            100.0 * c.mesh,
            100.0 * c.sampling,
            100.0 * c.truncation,
            100.0 * c.unshot
        ),
        format!(
            "seconds    load {:.2}, open {:.2}, mesh {:.2}, draw {:.2}, reduce {:.2}, \
             read back {:.2}, solve {:.2}, vertices {:.2}, error {:.2}, write {:.2}, total {:.2}",
            s.load,
            s.open,
            s.mesh,
            s.draw,
            s.reduce,
            s.readback,
            s.solve,
            s.vertices,
            s.certificate,
            s.write,
            s.total
        ),
    ]
    .join("\n")
}
