//! What the examples share: the whole path from a scene file to the files that come out.
// Each example uses a part of it.
#![allow(dead_code)]

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use radiosity::{
    Camera, Error, ErrorKind, FormFactors, Gather, GatherProgress, GatheredRadiosity, Gathering,
    Go, Gpu, HemicubeGather, Hemicubes, Mesh, NearRepair, NodeId, Progress, RadianceImage, RayCast,
    RayGather, Report, Rgb, Row, Scene, Seconds, Shooting, VertexRadiosity, Viewpoints, load_obj,
    write_exr, write_ply, write_png,
};
use serde_json::json;

/// Settings of a bake.
#[derive(Clone, Debug)]
pub struct Bake {
    pub scene: PathBuf,
    /// Path of the output without its ending.
    pub out: PathBuf,
    /// Longest element edge, scene unit; by default a share of the scene's diagonal.
    pub element_size: Option<f64>,
    /// Levels that elements are split which others touch.
    pub contacts: u32,
    /// Which vertices gather.
    pub gather: Gathers,
    /// Elements are split where sides bend by more than this share.
    pub bend: f64,
    /// Longest edge of an element that is not split any more, scene unit; by default a share of the
    /// element size.
    pub smallest: Option<f64>,
    /// How many elements there may be.
    pub max_elements: usize,
    /// Whether the light not yet shot is added, spread evenly.
    pub ambient: bool,
    pub hemicube: u32,
    /// Receivers within this many patch diameters get closed forms; below 0 none.
    pub near: f64,
    /// Patches whose parts disagree by more than this share of light are seen from finer parts; with
    /// none, each only from its centroid.
    pub viewpoints: Option<f64>,
    /// Hemicubes a viewpoint.
    pub rotations: NonZeroU32,
    pub shooting: Shooting,
    pub camera: Option<Camera>,
    pub image: (u32, u32),
    /// Whether the pixels of the image gather.
    pub pixel_gather: bool,
    /// Whether to write the elements' own values too.
    pub elements: bool,
    pub device: Device,
}

/// Which vertices look at the settled light for themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gathers {
    /// None: vertices get what the elements around them have.
    None,
    /// Those of the mesh, and more where the light between them bends.
    Needed,
    /// As needed, after splitting every element once.
    All,
}

/// Element size over that of the smallest that gathering makes.
const SMALLEST: f64 = 24.0;

/// Hemicubes that gather have this share of the pixels along an edge of those that shoot.
const GATHER_PIXELS: u32 = 2;

/// Lines of sight along a pixel's side.
const SAMPLES: u32 = 4;

/// Who makes rows.
#[derive(Clone, Debug, PartialEq)]
pub enum Device {
    /// Hemicubes on the adapter of this name, or the best.
    Gpu(Option<String>),
    /// Rays on the CPU, as many a row as the hemicube's top face has pixels.
    Cpu,
}

impl Bake {
    pub fn new(scene: impl Into<PathBuf>) -> Bake {
        let scene = scene.into();
        Bake {
            out: scene.with_extension(""),
            scene,
            element_size: None,
            contacts: 3,
            gather: Gathers::None,
            bend: 0.02,
            smallest: None,
            max_elements: 1 << 19,
            ambient: false,
            hemicube: 128,
            near: 1.0,
            viewpoints: None,
            rotations: NonZeroU32::MIN,
            shooting: Shooting { unshot: 1e-4, ..Shooting::default() },
            camera: None,
            image: (512, 512),
            pixel_gather: false,
            elements: false,
            device: Device::Gpu(None),
        }
    }

    /// From the scene file to STEM.ply, STEM.json and, with a camera, STEM.exr and STEM.png.
    pub fn run(&self) -> Result<Report, Error> {
        let mut clock = Clock::start();
        let mut seconds = Seconds::default();
        writable(&self.out)?;
        let (width, height) = self.image;
        self.camera.iter().try_for_each(|c| c.check(width, height, SAMPLES))?;
        let scene = load_obj(&self.scene)?;
        for warning in scene.warnings() {
            eprintln!("warning: {warning}");
        }
        let warnings = scene.warnings().to_vec();
        seconds.load = clock.lap();

        let by_default = || match self.gather {
            Gathers::None => default_element_size(&scene),
            _ => 1.6 * default_element_size(&scene),
        };
        let element_size = self.element_size.unwrap_or_else(by_default);
        let mesh = Mesh::new(scene, element_size)?.split_at_contacts(self.contacts);
        self.gathering(&mesh).check()?;
        let maker = Maker::new(&self.device, &mesh, self.hemicube, self.rotations)?;
        let near = NearRepair::new(maker, &mesh, self.near);
        let levels = if self.viewpoints.is_some() { u32::MAX } else { 0 };
        let mut rows = Viewpoints::new(near, self.viewpoints.unwrap_or(1.0), levels);
        seconds.mesh = clock.lap();

        let bar = bar();
        let solution = self.shooting.solve(&mesh, &mut rows, |p| {
            show(&bar, p, self.shooting.unshot);
            Go::Continue(())
        })?;
        bar.finish_and_clear();
        let (near, maker) = (rows.inner(), rows.inner().inner());
        (seconds.draw, seconds.reduce, seconds.readback) = maker.stages();
        seconds.solve = clock.lap() - maker.seconds;

        let mut radiosity = solution.radiosity;
        let mut comments = vec![];
        if self.ambient {
            let [r, g, b] = solution.ledger.add_ambient(&mesh, &mut radiosity).to_array();
            comments.push(format!(
                "ambient term of the unshot light added: reflectance times {r:e} {g:e} {b:e} W/m2"
            ));
        }
        let gathered = self.gathered(&mesh, &radiosity, maker)?;
        let mut surface = match &gathered {
            Some(gathered) => gathered.surface.clone(),
            None => VertexRadiosity::new(&mesh, &radiosity),
        };
        surface.comments = comments;
        seconds.vertices = clock.lap();

        write_ply(self.out.with_added_extension("ply"), &surface)?;
        if self.elements {
            let flat = VertexRadiosity::flat(&mesh, &radiosity);
            write_ply(self.out.with_added_extension("elements.ply"), &flat)?;
        }
        if let Some(camera) = self.camera {
            let image = match self.pixel_gather {
                true => {
                    self.gathered_image(&camera, &mesh, &radiosity, gathered.as_ref(), maker)?
                }
                false => camera.image(&surface, width, height, SAMPLES)?,
            };
            write_exr(self.out.with_added_extension("exr"), &image)?;
            write_png(self.out.with_added_extension("png"), &image)?;
        }
        seconds.write = clock.lap();
        seconds.total = clock.total();

        let report = Report {
            scene: self.scene.display().to_string(),
            adapter: maker.adapter(),
            settings: vec![
                ("element_size".into(), json!(element_size)),
                ("hemicube".into(), json!(self.hemicube)),
                ("near".into(), json!(self.near)),
                ("viewpoints".into(), json!(self.viewpoints)),
                ("rotations".into(), json!(self.rotations.get())),
                ("unshot".into(), json!(self.shooting.unshot)),
                ("shots".into(), json!(self.shooting.shots)),
                ("row_memory".into(), json!(self.shooting.row_memory)),
                ("patch_tolerance".into(), json!(self.shooting.tolerance)),
                ("patch_level".into(), json!(self.shooting.level)),
                ("contacts".into(), json!(self.contacts)),
                ("gather".into(), json!(format!("{:?}", self.gather).to_lowercase())),
                ("bend".into(), json!(self.bend)),
                ("smallest".into(), json!(self.smallest)),
                ("max_elements".into(), json!(self.max_elements)),
                ("pixel_gather".into(), json!(self.pixel_gather)),
                ("ambient".into(), json!(self.ambient)),
            ],
            triangles: mesh.scene().triangles().len(),
            shot_elements: mesh.element_count(),
            elements: gathered.as_ref().map_or(&mesh, |g| &g.mesh).element_count(),
            vertices: surface.positions.len(),
            shots: solution.shots,
            hemicubes: (solution.rows_made + rows.extra()) * u64::from(self.rotations.get()),
            gathers: gathered.as_ref().map_or(0, |g| g.gathers),
            gather_change: gathered.as_ref().map_or(0.0, |g| g.change),
            gather_stop: gathered.as_ref().map_or("none".into(), |g| g.stop.to_string()),
            near_moved: near.moved(),
            stop: solution.stop.to_string(),
            ledger: solution.ledger,
            seconds,
            warnings,
        };
        report.write(self.out.with_added_extension("json"))?;
        Ok(report)
    }
}

/// A 32nd of the diagonal of the scene's bounding box.
pub fn default_element_size(scene: &Scene) -> f64 {
    let (low, high) = scene.bounds();
    (high - low).length() / 32.0
}

impl Bake {
    fn gathering(&self, mesh: &Mesh) -> Gathering {
        let longest = |e| mesh.longest_edge(mesh.element(e));
        let largest = (0..mesh.element_count()).map(longest).fold(0.0, f64::max);
        Gathering {
            tolerance: self.bend,
            elements: self.max_elements,
            everywhere: u32::from(self.gather == Gathers::All),
            ..Gathering::new(self.smallest.unwrap_or(largest / SMALLEST))
        }
    }

    /// Lets vertices gather, if they are to.
    fn gathered(
        &self,
        mesh: &Mesh,
        radiosity: &[Rgb],
        maker: &Maker,
    ) -> Result<Option<GatheredRadiosity>, Error> {
        if self.gather == Gathers::None {
            return Ok(None);
        }
        let settings = self.gathering(mesh);
        let mut gather = maker.gather(mesh, self.hemicube / GATHER_PIXELS)?;
        let bar = bar();
        let gathered = settings.gather(mesh, radiosity, &mut *gather, |p| {
            show_gathering(&bar, p);
            Go::Continue(())
        })?;
        bar.finish_and_clear();
        Ok(Some(gathered))
    }

    /// The picture, each pixel of which gathers what the vertices know, or else the elements.
    fn gathered_image(
        &self,
        camera: &Camera,
        mesh: &Mesh,
        radiosity: &[Rgb],
        gathered: Option<&GatheredRadiosity>,
        maker: &Maker,
    ) -> Result<RadianceImage, Error> {
        let plain;
        let light = match gathered {
            Some(gathered) => gathered,
            None => {
                plain = GatheredRadiosity::from_elements(mesh, radiosity)?;
                &plain
            }
        };
        let mut gather = maker.gather(mesh, self.hemicube / GATHER_PIXELS)?;
        let ((width, height), bar) = (self.image, bar());
        let image =
            camera.gathered_image(light, &mut *gather, width, height, SAMPLES, |done, of| {
                bar.set_position((1000 * done / of) as u64);
                bar.set_message(format!("picture, {done} of {of} pixels"));
                Go::Continue(())
            })?;
        bar.finish_and_clear();
        Ok(image.expect("nobody stopped it"))
    }
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

/// Makes rows one way or the other, and counts the time.
pub struct Maker {
    rows: Rows,
    seconds: f64,
}

enum Rows {
    Gpu(Gpu, Box<Hemicubes>),
    Cpu(RayCast),
}

impl Maker {
    pub fn new(
        device: &Device,
        mesh: &Mesh,
        hemicube: u32,
        rotations: NonZeroU32,
    ) -> Result<Maker, Error> {
        let rows = match device {
            Device::Gpu(name) => {
                let gpu = Gpu::new(name.as_deref())?;
                let hemicubes = Hemicubes::new(&gpu, mesh, hemicube)?.with_rotations(rotations);
                Rows::Gpu(gpu, Box::new(hemicubes))
            }
            Device::Cpu => {
                radiosity::hemicube::check_resolution(hemicube)?;
                Rows::Cpu(RayCast::new(
                    mesh,
                    (hemicube * hemicube).saturating_mul(rotations.get()),
                )?)
            }
        };
        Ok(Maker { rows, seconds: 0.0 })
    }

    /// Who gathers: the device that makes the rows, or the CPU where that is the device: half as many
    /// rays as a hemicube's top face of `resolution` has pixels take less time there than drawing.
    fn gather(&self, mesh: &Mesh, resolution: u32) -> Result<Box<dyn Gather>, Error> {
        Ok(match &self.rows {
            Rows::Gpu(gpu, _) if gpu.adapter().kind != "CPU" => {
                Box::new(HemicubeGather::new(gpu, mesh, resolution)?)
            }
            _ => Box::new(RayGather::new(mesh, (resolution * resolution / 2).max(16))?),
        })
    }

    /// Name, type and driver.
    pub fn adapter(&self) -> [String; 3] {
        match &self.rows {
            Rows::Gpu(gpu, _) => {
                let adapter = gpu.adapter().clone();
                [adapter.name, adapter.kind, adapter.driver]
            }
            Rows::Cpu(_) => ["rays".into(), "CPU".into(), "none".into()],
        }
    }

    /// Seconds of draw, reduce and read-back; rays are all draw.
    fn stages(&self) -> (f64, f64, f64) {
        match &self.rows {
            Rows::Gpu(_, hemicubes) => {
                let s = hemicubes.seconds();
                (s.draw, s.reduce, s.readback)
            }
            Rows::Cpu(_) => (self.seconds, 0.0, 0.0),
        }
    }
}

impl FormFactors for Maker {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId]) -> Result<Vec<Row>, Error> {
        let start = Instant::now();
        let rows = match &mut self.rows {
            Rows::Gpu(_, hemicubes) => hemicubes.rows(mesh, patches),
            Rows::Cpu(rays) => rays.rows(mesh, patches),
        };
        self.seconds += start.elapsed().as_secs_f64();
        rows
    }

    fn batch(&self) -> usize {
        match &self.rows {
            Rows::Gpu(_, hemicubes) => hemicubes.batch(),
            Rows::Cpu(rays) => rays.batch(),
        }
    }
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(1000);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {msg}") {
        bar.set_style(style);
    }
    bar
}

/// The bar fills with the logarithm of the unshot share, which falls about evenly.
fn show(bar: &ProgressBar, p: &Progress, wanted: f64) {
    let done = p.unshot_share.max(1e-16).ln() / wanted.clamp(1e-16, 0.999).ln();
    bar.set_position((1000.0 * done.clamp(0.0, 1.0)) as u64);
    bar.set_message(format!(
        "shooting, {:.3} % unshot, {} shots, {} hemicubes, {:.1} s",
        100.0 * p.unshot_share,
        p.shots,
        p.rows_made,
        p.elapsed.as_secs_f64()
    ));
}

/// The bar fills with the vertices of a level.
fn show_gathering(bar: &ProgressBar, p: &GatherProgress) {
    bar.set_position((1000 * p.gathered / p.of.max(1)) as u64);
    bar.set_message(format!(
        "gathering, split {} times, {} of {} vertices, {} elements",
        p.level, p.gathered, p.of, p.elements
    ));
}

struct Clock {
    start: Instant,
    lap: Instant,
}

impl Clock {
    fn start() -> Clock {
        Clock { start: Instant::now(), lap: Instant::now() }
    }

    fn lap(&mut self) -> f64 {
        let seconds = self.lap.elapsed().as_secs_f64();
        self.lap = Instant::now();
        seconds
    }

    fn total(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
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
    let ledger = report.ledger;
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
            share(ledger.left),
            share(ledger.back),
            share(ledger.unshot)
        ),
        format!(
            "seconds    load {:.2}, mesh {:.2}, draw {:.2}, reduce {:.2}, read back {:.2}, \
             solve {:.2}, vertices {:.2}, write {:.2}, total {:.2}",
            s.load, s.mesh, s.draw, s.reduce, s.readback, s.solve, s.vertices, s.write, s.total
        ),
    ]
    .join("\n")
}
