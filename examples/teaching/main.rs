//! Lesson 9 of 9: the whole method on one sheet of pictures, for those who teach it. Writes
//! `teaching.png` to the current folder and prints the numbers behind the pictures;
//! docs/teaching.md says what each shows. Takes the pixels along a picture, if not 208:
//!
//!     cargo run --release --features cli --example teaching -- 416

mod item_buffer;
mod pictures;
mod sheet;
mod truth;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::{ProximityCorrection, Row};
use radiosity::io::ToneCurve;
use radiosity::mesh::NodeId;
use radiosity::solver::{Method, Solution};
use radiosity::*;

use item_buffer::Hemicube;
use pictures::{Numbering, false_colour};
use sheet::{Sheet, legend};
use truth::Truth;

/// Whatever goes wrong ends the program with its message.
type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Longest edge of an element, mm: large enough to be seen.
const ELEMENT_SIZE: f64 = 100.0;

/// Patches are so many quadtree levels above the elements: four elements each.
const PATCH_LEVELS: u32 = 1;

/// Where the patch is that stands for all, on the red wall, mm.
const PATCH_PLACE: DVec3 = DVec3::new(550.0, 250.0, 230.0);

/// Pixels along an edge of the top of a hemicube.
const RESOLUTION: u32 = 256;

/// Rays of a row that carries much of the light; others have as few as a sixteenth.
const RAYS: u32 = 1 << 15;

/// Shots after which the light is looked at: all 8 elements of the lamp, and 56 patches more.
const SHOTS: [u64; 2] = [8, 64];

/// Pixels along an edge of the picture that is held against the truth, and paths at each.
const POINTS: u32 = 104;
const PATHS: usize = 2048;

/// The error that the colours end at, as a share of the truth.
const LIMIT: f64 = 0.2;

/// The view for which the box was made, mm and degrees.
const CAMERA: Camera = Camera {
    eye: DVec3::new(278.0, 273.0, -800.0),
    target: DVec3::new(278.0, 273.0, 0.0),
    up: DVec3::Y,
    vertical_fov: 39.3077,
};

fn main() -> Result<()> {
    let given = std::env::args().nth(1).map(|side| side.parse::<u32>());
    let side = given.transpose().map_err(|_| "give the pixels along a picture, such as 416")?;
    let side = side.map_or(2 * POINTS, |side| side.max(POINTS));
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let scene = Arc::new(load_scene(path)?.resolve_sides());
    let mesh = Mesh::new(scene.clone(), ELEMENT_SIZE)?;
    let mut sheet = Sheet::new(side, 5)?;
    one_patch(&mut sheet, &mesh)?;

    let mut rows = ProximityCorrection::new(RayRows::new(&mesh, RAYS)?, &mesh, 1.0);
    let bounces = bounces(&mesh, &mut rows)?;
    let all = &bounces[3].radiosity;
    let interpolated = VertexMesh::new(&mesh, all);
    // The same exposure for all pictures of light, so that they can be compared.
    let tone = ToneCurve::fit_image(&CAMERA.image(&interpolated, side, side, 1)?);
    bounce_by_bounce(&mut sheet, &mesh, &bounces, &tone)?;
    shot_by_shot(&mut sheet, &mesh, &mut rows, all, &tone)?;

    let go = |_: &_| ControlFlow::Continue(());
    let baked = BakeTarget::Error(0.02).bake(scene, &Backend::Cpu, go)?;
    println!("15: the bake says that it is off by {:.1} %", 100.0 * baked.estimate.total);
    let surfaces = [VertexMesh::per_element(&mesh, all), interpolated, baked.light.surface];
    against_the_truth(&mut sheet, &mesh, &surfaces, &tone)?;
    sheet.save("teaching.png")
}

/// Tiles 1 to 4: where form factors come from.
fn one_patch(sheet: &mut Sheet, mesh: &Mesh) -> Result<()> {
    let patches = patches(mesh);
    let numbering = Numbering::new(mesh, &patches);
    let side = sheet.side;

    // Elements receive light, patches send it: a quarter of the rows that elements would take.
    let note = format!("{} elements, {} patches", mesh.element_count(), patches.len());
    sheet.add("1  Elements and patches", &note, &numbering.outlines(&CAMERA, side)?)?;

    // A patch on the red wall. The same colours as in the next tile say what it sees from there.
    let distance = |patch: &NodeId| mesh.centroid(*patch).distance(PATCH_PLACE);
    let nearest = patches.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    let patch = *nearest.ok_or("a mesh without patches")?;
    let picture = numbering.items(&CAMERA, patch, side)?;
    sheet.add("2  Item buffer of the camera", "hues: patches, white: that of 3", &picture)?;

    // A patch's light goes where its hemicube sees something: by the number of pixels, and by what
    // each of them is worth.
    let hemicube = Hemicube::new(mesh, patch, RESOLUTION)?;
    let picture = numbering.hemicube(&hemicube, side);
    sheet.add("3  Item buffer of a hemicube", "black: out of the open front", &picture)?;

    // Added up by element, that is a row of form factors. Over the area of the element it is the
    // light that the patch throws on it: bright near the patch and facing it, black in its shadows.
    let row = hemicube.row(mesh)?;
    compare_with_rays(mesh, patch, &row)?;
    let per_area = |(e, factor): (usize, &f64)| Rgb::splat(factor / mesh.area(mesh.element(e)));
    let per_area: Vec<Rgb> = row.iter().enumerate().map(per_area).collect();
    let surface = VertexMesh::per_element(mesh, &per_area);
    let tone = ToneCurve::fit_image(&CAMERA.image(&surface, side, side, 1)?);
    let picture = pictures::light(&CAMERA, &surface, side, &tone)?;
    sheet.add("4  Its row of form factors", "each over its element's area", &picture)
}

/// Tiles 5 to 8: what each bounce adds. The lamp alone; what it lights itself, with black shadows
/// and a black ceiling; then light from there, which colours the blocks red and green; all of it.
fn bounce_by_bounce(
    sheet: &mut Sheet,
    mesh: &Mesh,
    bounces: &[Solution],
    tone: &ToneCurve,
) -> Result<()> {
    let titles =
        ["5  0 bounces: emission", "6  1 bounce: direct light", "7  2 bounces", "8  All bounces"];
    let flux = |solution: &Solution| reflected_flux(mesh, &solution.radiosity);
    for (title, solution) in titles.iter().zip(bounces) {
        let share = flux(solution) / flux(&bounces[3]);
        let note = format!("{:.0} % of the reflected flux", 100.0 * share);
        println!("{title}: {note}");
        let surface = VertexMesh::new(mesh, &solution.radiosity);
        sheet.add(title, &note, &pictures::light(&CAMERA, &surface, sheet.side, tone)?)?;
    }
    // A bounce adds light, or none, in each channel of each element.
    for (k, pair) in bounces.windows(2).enumerate() {
        let pairs = pair[0].radiosity.iter().zip(&pair[1].radiosity);
        let changes = pairs.map(|(before, after)| (*after - *before).min_element());
        let least = changes.fold(f64::INFINITY, f64::min);
        println!("from {} to {} elements change by {least:.1e} W/m² at least", k + 5, k + 6);
    }
    Ok(())
}

/// Tiles 9 to 12: progressive refinement. The lamp has shot: the direct light of tile 6. Later the
/// brightest patches have, too. What is unshot yet, spread evenly as the ambient term, makes a
/// useful picture at once, flat as it is in the shadows, and fades out as the solve goes on.
fn shot_by_shot(
    sheet: &mut Sheet,
    mesh: &Mesh,
    rows: &mut dyn FormFactors,
    all: &[Rgb],
    tone: &ToneCurve,
) -> Result<()> {
    for (k, solution) in shots(mesh, rows)?.into_iter().enumerate() {
        let title = format!("{}  After {} shots", 9 + 2 * k, solution.shots);
        let title_of_ambient = format!("{}  The same with ambient", 10 + 2 * k);
        let mut with_ambient = solution.radiosity.clone();
        solution.ledger.add_ambient(mesh, &mut with_ambient);
        for (title, radiosity) in [(title, solution.radiosity), (title_of_ambient, with_ambient)] {
            let off = 100.0 * deviation(mesh, &radiosity, all);
            let unshot = 100.0 * solution.ledger.unshot_share();
            let note = format!("{unshot:.0} % unshot, {off:.0} % off tile 8");
            println!("{title}: {note}");
            let surface = VertexMesh::new(mesh, &radiosity);
            sheet.add(&title, &note, &pictures::light(&CAMERA, &surface, sheet.side, tone)?)?;
        }
    }
    Ok(())
}

/// Tiles 13 to 20: from elements to a picture, and how far each way is from the truth. One value an
/// element has steps everywhere; interpolation hides them and blurs shadows as much; a final gather
/// asks at each vertex anew what light arrives.
fn against_the_truth(
    sheet: &mut Sheet,
    mesh: &Mesh,
    surfaces: &[VertexMesh; 3],
    tone: &ToneCurve,
) -> Result<()> {
    let labels = [
        ("13  Constant per element", "the light of tile 8"),
        ("14  Interpolated", "the same between vertices"),
        ("15  Final gather", "a bake to 2 %"),
    ];
    for ((title, note), surface) in labels.iter().zip(surfaces) {
        sheet.add(title, note, &pictures::light(&CAMERA, surface, sheet.side, tone)?)?;
    }
    let truth = Truth::new(mesh, CAMERA, POINTS, PATHS)?;
    let pixels = truth.radiance().map(|radiance| tone.display(radiance));
    let picture = pictures::enlarged(pixels, sheet.side);
    sheet.add("16  The truth: path traced", &format!("{PATHS} paths a pixel"), &picture)?;
    for (k, surface) in surfaces.iter().enumerate() {
        let difference = truth.difference(surface)?;
        let [rms, error] = [difference.rms, difference.standard_error].map(|share| 100.0 * share);
        let title = format!("{}  Tile {} less truth", 17 + k, 13 + k);
        let note = format!("{rms:.1} ± {error:.1} % root mean square");
        println!("{title}: {note}, {:.1} % without one point", 100.0 * difference.without_worst);
        let colour = |error: &Option<f64>| error.map_or([0; 3], |e| false_colour(e / LIMIT));
        let picture = pictures::enlarged(difference.signed.iter().map(colour), sheet.side);
        sheet.add(&title, &note, &picture)?;
    }
    let note = format!("noise of the truth {:.1} %", 100.0 * truth.noise());
    println!("{note}");
    let texts = [(1.0, ": too bright"), (0.5, ""), (0.0, ""), (-0.5, ""), (-1.0, ": too dark")];
    let texts =
        texts.map(|(place, words)| (place, format!("{:.0} %{words}", 100.0 * LIMIT * place)));
    sheet.add("20  Error, signed", &note, &legend(sheet.side, false_colour, &texts)?)
}

/// The quadtree nodes that shoot.
fn patches(mesh: &Mesh) -> Vec<NodeId> {
    let triangles = 0..mesh.scene().triangles().len();
    let mut pending: Vec<NodeId> = triangles.map(|t| mesh.root(t)).collect();
    let mut patches = vec![];
    while let Some(node) = pending.pop() {
        let is_large = mesh.elements_of(node).len() > 4usize.pow(PATCH_LEVELS);
        match mesh.children(node) {
            Some(parts) if is_large => pending.extend(parts),
            _ => patches.push(node),
        }
    }
    patches
}

/// Light after 0, 1, 2 and all bounces: E, E + ME, E + ME + M²E, … with M = ρF.
fn bounces(mesh: &Mesh, rows: &mut dyn FormFactors) -> Result<Vec<Solution>> {
    let mut session = Solver::new(Method::Jacobi).begin(mesh)?;
    let mut solutions = vec![];
    for (unshot, bounces) in [(0.0, Some(0)), (0.0, Some(1)), (0.0, Some(2)), (1e-5, None)] {
        session.set_limits(unshot, bounces)?;
        session.run(rows, |_| ControlFlow::Continue(()))?;
        solutions.push(session.solution()?);
    }
    Ok(solutions)
}

/// Light after some shots: the patch with most of what is unshot shoots it, again and again (Cohen,
/// Chen, Wallace and Greenberg 1988).
fn shots(mesh: &Mesh, rows: &mut dyn FormFactors) -> Result<Vec<Solution>> {
    // The patches of tile 1, but for the lamp, whose elements shoot by themselves.
    let (patch_tolerance, min_patch_level) = (0.0, PATCH_LEVELS);
    let solver = Solver { patch_tolerance, min_patch_level, ..Solver::default() };
    let mut session = solver.begin(mesh)?;
    let mut solutions = vec![];
    for shots in SHOTS {
        session.set_limits(0.0, Some(shots))?;
        session.run(rows, |_| ControlFlow::Continue(()))?;
        solutions.push(session.solution()?);
    }
    Ok(solutions)
}

/// Prints how far the row of a hemicube is from one that the library makes with rays.
fn compare_with_rays(mesh: &Mesh, patch: NodeId, row: &[f64]) -> Result<()> {
    let mut by_rays = vec![0.0; row.len()];
    for entry in &RayRows::new(mesh, 1 << 20)?.rows(mesh, &[patch], 1.0)?[0].entries {
        by_rays[entry.element as usize] = Row::form_factor(entry.share);
    }
    let is_lamp = |e: &usize| mesh.exitance(*e) != Rgb::ZERO;
    let to_lamp = |row: &[f64]| (0..row.len()).filter(is_lamp).map(|e| row[e]).sum::<f64>();
    println!("4: F to the lamp {:.5}, by rays {:.5}", to_lamp(row), to_lamp(&by_rays));
    let moved: f64 = row.iter().zip(&by_rays).map(|(a, b)| (a - b).abs() / 2.0).sum();
    println!("4: by rays {:.2} % of its light goes to other elements", 100.0 * moved);
    Ok(())
}

/// Flux that all elements reflect, the sum of the channels, W.
fn reflected_flux(mesh: &Mesh, radiosity: &[Rgb]) -> f64 {
    let reflected = |e: usize| (radiosity[e] - mesh.exitance(e)).element_sum();
    (0..radiosity.len()).map(|e| mesh.area(mesh.element(e)) * reflected(e)).sum()
}

/// Root mean square by area of what `radiosity` lacks or has too much, over that of the reflected
/// light of `all`.
fn deviation(mesh: &Mesh, radiosity: &[Rgb], all: &[Rgb]) -> f64 {
    let (mut difference, mut reflected) = (0.0, 0.0);
    for (e, all) in all.iter().enumerate() {
        let area = mesh.area(mesh.element(e));
        difference += area * (radiosity[e] - *all).length_squared();
        reflected += area * (*all - mesh.exitance(e)).length_squared();
    }
    f64::sqrt(difference / reflected)
}
