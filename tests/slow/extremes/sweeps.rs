//! The sweeps, and how far off each may be.

use std::f64::consts::PI;
use std::path::Path;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::backend::gpu::TracedGather;
use radiosity::form_factor::{ProximityCorrection, Row};
use radiosity::gather::{GatherPoint, RefinementSettings, gather_at_vertices};
use radiosity::mesh::NodeId;
use radiosity::solver::Method;
use radiosity::{
    Backend, BakeTarget, Error, FormFactors, Gather, GatheredMesh, Mesh, Rgb, Scene, Solution,
    Solver, VertexMesh, ViewFactors, write_ply,
};

use super::sweep::Sweep;
use crate::common::closed_forms::exact;
use crate::common::framed::{self as scenes, Frame, HERE, grey};
use crate::common::{files, keep_counting, keep_going};

/// What makes rows and gathers, and how many steps are gone.
pub struct Ask<'a> {
    pub device: &'a Backend,
    /// All steps, or else the first, the middle and the last.
    pub all: bool,
}

type Swept = Result<Sweep, Error>;

/// Every sweep.
pub const ALL: [fn(&Ask) -> Swept; 23] = [
    scale_of_furnace,
    shift_of_furnace,
    exitance_of_furnace,
    reflectance_of_furnace,
    scale_of_sphere,
    reflectance_of_sphere,
    scale_of_plates,
    shift_of_plates,
    rows_of_plates,
    rows_of_small_plates,
    scale_of_room,
    shift_of_room,
    exitance_of_room,
    scale_of_bake,
    shift_of_bake,
    exitance_of_bake,
    lamps_apart,
    lamps_together,
    scale_of_lamp,
    exitance_of_lamp,
    area_of_lamp,
    exitance_next_door,
    areas,
];

/// Pixels along an edge of hemicubes, or the square root of the number of rays.
const PIXELS: u32 = 64;

const SCALES: &str = "1e-9 to 1e9";

const SHIFTS: &str = "1e-6 to 1e6 sizes";

const EXITANCES: &str = "1e-30 to 1e30 W/m²";

const REFLECTANCES: &str = "0 to 1 − 1e-6";

const RATIOS: &str = "1 to 1e12";

const FURNACE: &str = "furnace, E/(1−ρ)";

/// Rounding alone, of some million sums, and some of them of what nearly cancels.
const ROUNDING: f64 = 1e-9;

/// One ray, or one pixel of a hemicube, that falls to the other side of an edge moves 1/64² of what
/// a patch sends, 3e-4. A patch of a lamp can send a tenth of all light, and an element have a
/// thousandth of it: that is 3e-2 of it.
const ONE_RAY: f64 = 3e-2;

impl Ask<'_> {
    fn steps<T: Copy>(&self, all: impl IntoIterator<Item = T>) -> Vec<T> {
        let all: Vec<T> = all.into_iter().collect();
        if self.all { all } else { vec![all[0], all[all.len() / 2], all[all.len() - 1]] }
    }

    /// 10 to the powers from `low` to `high`, by `step`.
    fn powers(&self, low: i32, high: i32, step: usize) -> Vec<f64> {
        self.steps((low..=high).step_by(step).map(|k| 10f64.powi(k)))
    }

    fn scales(&self) -> Vec<Frame> {
        self.powers(-9, 9, 1).into_iter().map(Frame::scaled).collect()
    }

    fn shifts(&self) -> Vec<Frame> {
        self.powers(-6, 6, 1).into_iter().map(Frame::shifted).collect()
    }

    fn exitances(&self) -> Vec<f64> {
        self.powers(-30, 30, 5)
    }

    fn reflectances(&self) -> Vec<f64> {
        let near_one = [0.99, 0.999, 0.9999, 1.0 - 1e-5, 1.0 - 3e-6, 1.0 - 1e-6];
        self.steps([0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97].into_iter().chain(near_one))
    }

    fn gatherer(&self, mesh: &Mesh) -> Result<Box<dyn Gather>, Error> {
        Ok(match self.device {
            Backend::Gpu(gpu) => Box::new(TracedGather::new(gpu, mesh, PIXELS * PIXELS)?),
            Backend::Cpu => Box::new(RayGather::new(mesh, PIXELS * PIXELS)?),
        })
    }
}

/// Channels of radiosity over `unit`, W/m².
fn channels(values: &[Rgb], unit: f64) -> Vec<f64> {
    values.iter().flat_map(|b| (*b / unit).to_array()).collect()
}

/// A cube by closed forms, the solver that it asks for or `method`.
fn furnace(mut sweep: Sweep, steps: Vec<(Frame, f64, f64)>, method: Option<Method>) -> Swept {
    for (frame, rho, e) in steps {
        let mesh = Mesh::new(scenes::furnace(frame, rho, e), 0.8 * frame.scale)?;
        let mut solver = Solver { unshot: 1e-9, ..Solver::for_mesh(&mesh) };
        solver.method = method.unwrap_or(solver.method);
        let s = solver.solve(&mesh, &mut exact(), keep_going)?;
        sweep.solved(&s);
        let found = channels(&s.radiosity, e);
        sweep.step(&found, &vec![1.0 / (1.0 - rho); found.len()]);
    }
    Ok(sweep)
}

/// Shares of 2⁻³² in columns that sum to 1/48 or so, each rounded for itself: 48 of them, 1e-8
/// each, and one over 1 − ρ times that if all are off the same way.
const SHARES: f64 = 1e-6;

fn scale_of_furnace(ask: &Ask) -> Swept {
    let sweep = Sweep::new("scale", SCALES, FURNACE, SHARES);
    furnace(sweep, ask.scales().into_iter().map(|f| (f, 0.8, 1.0)).collect(), None)
}

fn shift_of_furnace(ask: &Ask) -> Swept {
    let sweep = Sweep::new("shift", SHIFTS, FURNACE, SHARES);
    furnace(sweep, ask.shifts().into_iter().map(|f| (f, 0.8, 1.0)).collect(), None)
}

fn exitance_of_furnace(ask: &Ask) -> Swept {
    let sweep = Sweep::new("exitance", EXITANCES, FURNACE, SHARES);
    furnace(sweep, ask.exitances().into_iter().map(|e| (HERE, 0.8, e)).collect(), None)
}

pub fn reflectance_of_furnace(ask: &Ask) -> Swept {
    // Rows sum to one exactly: what shares are off moves light about, and makes none.
    let sweep = Sweep::new("reflectance", REFLECTANCES, FURNACE, SHARES);
    let steps = ask.reflectances().into_iter().map(|rho| (HERE, rho, 1.0)).collect();
    furnace(sweep, steps, Some(Method::Gmres { restart: 50 }))
}

/// A sphere of which a cap shines: B = E + ρ Ē/(1−ρ), Ē the mean over the area. Of the cap and of
/// the rest the means, since what comes from the nearest facets is theirs and not the sphere's.
fn sphere(mut sweep: Sweep, steps: Vec<(Frame, f64)>, ask: &Ask) -> Swept {
    for (frame, rho) in steps {
        let scene = scenes::sphere(frame, 2, grey(rho, 1.0), grey(rho, 0.0));
        let mesh = Mesh::new(scene, f64::INFINITY)?;
        let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
        let s = Solver { unshot: 1e-9, ..Solver::for_mesh(&mesh) }
            .solve(&mesh, &mut rows, keep_going)?;
        sweep.solved(&s);
        let nodes = (0..mesh.element_count()).map(|k| mesh.element(k));
        let (mut areas, mut means) = ([0.0; 2], [0.0; 2]);
        for (n, b) in nodes.zip(&s.radiosity) {
            let part = mesh.scene().triangles()[mesh.triangle(n)].group as usize;
            areas[part] += mesh.area(n);
            means[part] += mesh.area(n) * b.x;
        }
        let even = rho / (1.0 - rho) * areas[1] / (areas[0] + areas[1]);
        sweep.step(&[means[0] / areas[0], means[1] / areas[1]], &[even, 1.0 + even]);
    }
    Ok(sweep)
}

/// Facets of 320 triangles have a tenth of a radian to the next: 1 − cos 0.1 is 5e-3 of the light
/// near by, and as much are rays and pixels.
const FACETS: f64 = 1e-2;

fn scale_of_sphere(ask: &Ask) -> Swept {
    let sweep = Sweep::new("scale", SCALES, "sphere, E + ρĒ/(1−ρ)", FACETS);
    sphere(sweep, ask.scales().into_iter().map(|f| (f, 0.5)).collect(), ask)
}

fn reflectance_of_sphere(ask: &Ask) -> Swept {
    let sweep = Sweep::new("reflectance", REFLECTANCES, "sphere, E + ρĒ/(1−ρ)", FACETS);
    sphere(sweep, ask.reflectances().into_iter().map(|rho| (HERE, rho)).collect(), ask)
}

/// Two plates by view factors.
fn plates(mut sweep: Sweep, steps: Vec<Frame>) -> Swept {
    sweep.by("view factors");
    for frame in steps {
        let matrix = ViewFactors::new(&scenes::plates(frame), 1e-4, &[], keep_counting)?;
        let matrix = matrix.expect("nobody cancels");
        let both = [matrix.factor(0, 1).value, matrix.factor(1, 0).value];
        sweep.step(&both, &[scenes::PLATES; 2]);
    }
    Ok(sweep)
}

fn scale_of_plates(ask: &Ask) -> Swept {
    plates(Sweep::new("scale", SCALES, "plates, F = 0.19982", 1e-13), ask.scales())
}

fn shift_of_plates(ask: &Ask) -> Swept {
    // Steps of coordinates are 1e-10 of the size, and the plates are off by some.
    plates(Sweep::new("shift", SHIFTS, "plates, F = 0.19982", 1e-9), ask.shifts())
}

/// At a patch's centroid not the mean over it: 6e-3 at most, by h²/24 times the factor's curvature.
/// The rim is some 200 pixels, each off by up to 1.5e-4 either way: 1e-3 a patch, of which the mean
/// of some hundred has a tenth; over F, six times as much is 3e-3.
const PATCHES: f64 = 9e-3;

/// Factors between groups 0 and 1, both ways: means of the rows of their elements by area.
fn factors_of_plates(mesh: &Mesh, rows: &mut dyn FormFactors) -> Result<[f64; 2], Error> {
    let group = |node: NodeId| mesh.scene().triangles()[mesh.triangle(node)].group;
    let nodes: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    let (mut areas, mut sums) = ([0.0; 2], [0.0; 2]);
    for (row, &from) in rows.rows(mesh, &nodes, 1.0)?.iter().zip(&nodes) {
        row.check(mesh, from)?;
        let Some(area) = areas.get_mut(group(from) as usize) else { continue };
        *area += mesh.area(from);
        for entry in &row.entries {
            if group(mesh.element(entry.element as usize)) == 1 - group(from) {
                sums[group(from) as usize] += mesh.area(from) * Row::form_factor(entry.share);
            }
        }
    }
    Ok([sums[0] / areas[0], sums[1] / areas[1]])
}

fn rows_of_plates(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("scale", SCALES, "plates, F = 0.19982", PATCHES);
    sweep.by("rows");
    for frame in ask.scales() {
        let mesh = Mesh::new(scenes::plates(frame), 0.1 * frame.scale)?;
        let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
        sweep.step(&factors_of_plates(&mesh, &mut rows)?, &[scenes::PLATES; 2]);
    }
    Ok(sweep)
}

/// Plates ever smaller in a scene that is not, a thousand of its sizes from the origin.
fn rows_of_small_plates(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("area ratio", RATIOS, "plates, F = 0.19982", PATCHES);
    sweep.by("rows");
    for side in ask.steps((0..=12).map(|k| 10f64.powf(-f64::from(k) / 2.0))) {
        let scene = scenes::small_plates(Frame::shifted(1e3), side);
        let mut mesh = Mesh::new(scene, f64::INFINITY)?;
        for _ in 0..4 {
            let far = mesh.elements_of(mesh.root(4)).start;
            mesh = mesh.split(&(0..far).collect::<Vec<_>>())?;
        }
        let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
        sweep.step(&factors_of_plates(&mesh, &mut rows)?, &[scenes::PLATES; 2]);
    }
    Ok(sweep)
}

/// Light of `scene` by all stages: corrected rows, and the solver that the mesh asks for.
fn settle(scene: Scene, size: f64, ask: &Ask) -> Result<(Mesh, Solution), Error> {
    let mesh = Mesh::new(scene, size)?.split_at_contacts(1);
    let rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
    let mut rows = ProximityCorrection::new(rows, &mesh, 1.0);
    let solution = Solver::for_mesh(&mesh).solve(&mesh, &mut rows, keep_going)?;
    Ok((mesh, solution))
}

/// A room with a block and two lamps: elements and vertices, against those of the room as it is.
fn room(mut sweep: Sweep, steps: Vec<(Frame, f64)>, ask: &Ask) -> Swept {
    let light = |frame: Frame, e: f64, sweep: &mut Sweep| -> Result<Vec<f64>, Error> {
        let (mesh, s) = settle(scenes::room(frame, e, 0.1 * e), 0.25 * frame.scale, ask)?;
        sweep.solved(&s);
        let vertices = VertexMesh::new(&mesh, &s.radiosity).radiosity;
        Ok(channels(&[s.radiosity, vertices].concat(), e))
    };
    let known = light(HERE, 1.0, &mut sweep)?;
    for (frame, e) in steps {
        let found = light(frame, e, &mut sweep)?;
        sweep.step(&found, &known);
    }
    Ok(sweep)
}

fn scale_of_room(ask: &Ask) -> Swept {
    let sweep = Sweep::new("scale", SCALES, "room at scale 1", ROUNDING);
    room(sweep, ask.scales().into_iter().map(|f| (f, 1.0)).collect(), ask)
}

fn shift_of_room(ask: &Ask) -> Swept {
    let sweep = Sweep::new("shift", SHIFTS, "room at the origin", ONE_RAY);
    room(sweep, ask.shifts().into_iter().map(|f| (f, 1.0)).collect(), ask)
}

fn exitance_of_room(ask: &Ask) -> Swept {
    let sweep = Sweep::new("exitance", EXITANCES, "room at 1 W/m²", ROUNDING);
    room(sweep, ask.exitances().into_iter().map(|e| (HERE, e)).collect(), ask)
}

/// The same room from an OBJ file to a PLY file, baked to 10 %, and what `told` reads of it.
fn bake(
    mut sweep: Sweep,
    steps: Vec<(Frame, f64)>,
    ask: &Ask,
    told: impl Fn(&GatheredMesh, &Path) -> Vec<f64>,
) -> Swept {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let light = |frame: Frame, e: f64, sweep: &mut Sweep| -> Result<Vec<f64>, Error> {
        let scene = files::through_obj(&scenes::room(frame, e, 0.1 * e), folder.path())?;
        let baked = BakeTarget::Error(0.1).bake(scene, ask.device, keep_going)?;
        sweep.solved(&baked.solution);
        let ply = folder.path().join("scene.ply");
        write_ply(&ply, &baked.light.surface)?;
        Ok(told(&baked.light, &ply).into_iter().map(|b| b / e).collect())
    };
    let known = light(HERE, 1.0, &mut sweep)?;
    for (frame, e) in steps {
        let found = light(frame, e, &mut sweep)?;
        sweep.step(&found, &known);
    }
    sweep.by("gathering");
    Ok(sweep)
}

/// Every vertex of the file, with floats' 6e-8.
fn vertices(_: &GatheredMesh, file: &Path) -> Vec<f64> {
    files::radiosity_of_ply(file)
}

/// The mean of every wall, by area: of what is a twentieth of all or more. A ray that falls to the
/// other side of an edge may split an element more, so that there are other vertices; what is dim
/// and small, as the block's underside, that paths measure to be off by the half of itself where
/// 10 % are asked for over all, may have another mean then.
fn group_means(light: &GatheredMesh, _: &Path) -> Vec<f64> {
    let (scene, surface) = (light.mesh.scene(), &light.surface);
    let mut sums = vec![[0.0; 2]; scene.groups().len()];
    for (face, &e) in surface.faces.iter().zip(&surface.elements) {
        let triangle = light.mesh.triangle(light.mesh.element(e as usize));
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let area = (b - a).cross(c - a).length();
        let radiosity = face.map(|v| surface.radiosity[v as usize].x).iter().sum::<f64>() / 3.0;
        let [sum, total] = &mut sums[scene.triangles()[triangle].group as usize];
        (*sum, *total) = (*sum + radiosity * area, *total + area);
    }
    let all: f64 = sums.iter().map(|[_, area]| area).sum();
    let walls = sums.into_iter().filter(|[_, area]| *area > all / 20.0);
    walls.map(|[sum, area]| sum / area).collect()
}

fn scale_of_bake(ask: &Ask) -> Swept {
    let sweep = Sweep::new("scale", SCALES, "bake at scale 1", 1e-6);
    bake(sweep, ask.scales().into_iter().map(|f| (f, 1.0)).collect(), ask, vertices)
}

fn shift_of_bake(ask: &Ask) -> Swept {
    // Of elements with equal shares in the error rounding says which is split last: means are off
    // by no more than half of what is asked for.
    let sweep = Sweep::new("shift", SHIFTS, "bake at the origin, walls", 0.1 / 2.0);
    bake(sweep, ask.shifts().into_iter().map(|f| (f, 1.0)).collect(), ask, group_means)
}

fn exitance_of_bake(ask: &Ask) -> Swept {
    let sweep = Sweep::new("exitance", EXITANCES, "bake at 1 W/m²", 1e-6);
    bake(sweep, ask.exitances().into_iter().map(|e| (HERE, e)).collect(), ask, vertices)
}

/// Two closed rooms, one brighter than the other, by all methods: the mean of each is its E/(1−ρ).
fn lamps_apart(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("flux ratio", RATIOS, "two rooms, mean E/(1−ρ) each", ROUNDING);
    for ratio in ask.powers(0, 12, 1) {
        let mesh = Mesh::new(scenes::rooms(0.5, ratio, 1.0), 0.8)?;
        let (mut found, mut known) = (vec![], vec![]);
        for method in Method::ALL {
            let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
            let s = Solver { unshot: 0.0, ..Solver::new(method) }
                .solve(&mesh, &mut rows, keep_going)?;
            sweep.solved(&s);
            let mut means = [0.0; 2];
            for (k, b) in s.radiosity.iter().enumerate() {
                let node = mesh.element(k);
                let group = mesh.scene().triangles()[mesh.triangle(node)].group as usize;
                means[group / 6] += b.x * mesh.area(node) / 6.0;
            }
            found.extend([means[0] / ratio, means[1]]);
            known.extend([2.0, 2.0]);
        }
        sweep.step(&found, &known);
    }
    Ok(sweep)
}

/// Two lamps in one room, by the same rows: light adds up.
fn lamps_together(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("flux ratio", RATIOS, "one lamp, plus the other", ROUNDING);
    let room = |first, second, sweep: &mut Sweep| -> Result<Vec<f64>, Error> {
        let mesh = Mesh::new(scenes::room(HERE, first, second), 0.5)?;
        let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
        let solver = Solver { unshot: 0.0, ..Solver::new(Method::Gmres { restart: 50 }) };
        let s = solver.solve(&mesh, &mut rows, keep_going)?;
        sweep.solved(&s);
        Ok(channels(&s.radiosity, 1.0))
    };
    let (one, two) = (room(1.0, 0.0, &mut sweep)?, room(0.0, 1.0, &mut sweep)?);
    for ratio in ask.powers(0, 12, 1) {
        let known: Vec<f64> = one.iter().zip(&two).map(|(a, b)| a * ratio + b).collect();
        let found = room(ratio, 1.0, &mut sweep)?;
        sweep.step(&found, &known);
    }
    Ok(sweep)
}

/// What is gathered in the middle of a unit cube's ceiling from a square lamp of `side` in the
/// middle of its floor, against its closed form (Howell, B-3): four times a corner's.
fn lamp(sweep: &mut Sweep, frame: Frame, side: f64, e: f64, ask: &Ask) -> Result<(), Error> {
    let scene = scenes::panelled(frame, side, grey(0.0, 0.0), grey(0.0, e));
    let mesh = Mesh::new(scene, f64::INFINITY)?;
    let dark = GatheredMesh::from_elements(&mesh, &vec![Rgb::ZERO; mesh.element_count()])?;
    let at = |z| DVec3::from_array(frame.place([0.5, 0.5, z]));
    let normal = (at(0.0) - at(1.0)).normalize();
    let near = 1e-6 * frame.scale;
    let place = GatherPoint { position: at(1.0) + normal * (4.0 * near), normal, near };
    let found = ask.gatherer(&mesh)?.gather(&dark.radiosity_field(), &[place])?[0].irradiance;
    let (x, r) = (side / 2.0, (1.0 + side * side / 4.0).sqrt());
    let known = 4.0 / PI * (x / r) * (x / r).atan();
    sweep.by("gathering");
    sweep.step(&channels(&[found], e), &[known; 3]);
    Ok(())
}

/// The place is 4e-6 nearer than one, which is 8e-6 of the factor; and on a device closed forms are
/// of 32 bits, good to 3e-5 (`shaders/rank_lights.wgsl`).
fn lifted(ask: &Ask) -> f64 {
    match ask.device {
        Backend::Gpu(_) => 4e-5,
        Backend::Cpu => 1e-5,
    }
}

fn scale_of_lamp(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("scale", SCALES, "under a lamp, E F", lifted(ask));
    ask.scales().into_iter().try_for_each(|f| lamp(&mut sweep, f, 0.3, 1.0, ask))?;
    Ok(sweep)
}

fn exitance_of_lamp(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("exitance", EXITANCES, "under a lamp, E F", lifted(ask));
    ask.exitances().into_iter().try_for_each(|e| lamp(&mut sweep, HERE, 0.3, e, ask))?;
    Ok(sweep)
}

fn area_of_lamp(ask: &Ask) -> Swept {
    let mut sweep = Sweep::new("area ratio", RATIOS, "under a lamp, E F", lifted(ask));
    let sides = ask.steps((0..=12).map(|k| 0.9 * 10f64.powf(-f64::from(k) / 2.0)));
    sides.into_iter().try_for_each(|s| lamp(&mut sweep, HERE, s, 1.0 / (s * s), ask))?;
    Ok(sweep)
}

/// What is gathered in the second of two rooms, whose walls reflect 1e-12 of what those of the
/// first emit: as much as leaves them.
fn exitance_next_door(ask: &Ask) -> Swept {
    // Sums of 32 bits.
    let mut sweep = Sweep::new("exitance", EXITANCES, "next door, 1e-12 E", 1e-5);
    sweep.by("gathering");
    for e in ask.exitances() {
        let mesh = Mesh::new(scenes::rooms(0.5, e, 0.0), f64::INFINITY)?;
        let mut light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ZERO; mesh.element_count()])?;
        let even = vec![Rgb::splat(1e-12 * e); light.reflected.len()];
        light.reflected = even;
        let [p, q] = [0.4, 0.5].map(|z| DVec3::from_array(HERE.place([1.8, 0.6, z])));
        let place = GatherPoint { position: p, normal: (q - p).normalize(), near: 1e-3 };
        let found = ask.gatherer(&mesh)?.gather(&light.radiosity_field(), &[place])?[0].irradiance;
        sweep.step(&channels(&[found], 1e-12 * e), &[1.0; 3]);
    }
    Ok(sweep)
}

/// A furnace with a panel in a wall: the mean over all area, and vertices that gather, each by
/// itself.
fn areas(ask: &Ask) -> Swept {
    // Three sweeps of gathering leave ρ⁴ of what elements are off by, a tenth, and rays or pixels
    // have 1/64 of what they see unevenly: 6e-3 each.
    let mut sweep = Sweep::new("area ratio", RATIOS, FURNACE, 1.2e-2);
    for side in ask.steps((0..=12).map(|k| 0.5 * 10f64.powf(-f64::from(k) / 2.0))) {
        let scene = scenes::panelled(HERE, side, grey(0.5, 1.0), grey(0.5, 1.0));
        let mesh = Mesh::new(scene, 0.5)?;
        let mut rows = ask.device.rows(&mesh, PIXELS)?.with_full_share(0.0);
        let s = Solver::for_mesh(&mesh).solve(&mesh, &mut rows, keep_going)?;
        sweep.solved(&s);
        let areas = (0..mesh.element_count()).map(|k| mesh.area(mesh.element(k)));
        let leaving: f64 = s.radiosity.iter().zip(areas).map(|(b, a)| b.x * a).sum();
        let light = GatheredMesh::from_elements(&mesh, &s.radiosity)?;
        let gathering = RefinementSettings {
            max_elements: 0,
            gather_passes: 3,
            ..RefinementSettings::new(1.0)
        };
        let fine =
            gather_at_vertices(&light, &mesh, &gathering, &mut *ask.gatherer(&mesh)?, keep_going)?;
        let mut found = channels(&fine.surface.radiosity, 1.0);
        found.push(leaving / 6.0);
        sweep.step(&found, &vec![2.0; found.len()]);
    }
    sweep.by("gathering");
    Ok(sweep)
}
