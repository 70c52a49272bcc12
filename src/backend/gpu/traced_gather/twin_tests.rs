//! `rank_lights.wgsl`, `hemisphere_rays.wgsl`, `near_paths.wgsl`, `light_rays.wgsl` and
//! `settle.wgsl` against their twins, pass by pass; the same bits for any division of points into
//! calls; and the light of near surfaces against rays on the CPU.

use std::f32::consts::PI;

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};

use super::*;
use crate::backend::cpu::twins::gather_state::{HalfSums, cast_rays, range};
use crate::backend::cpu::twins::lights::ray_from;
use crate::backend::cpu::twins::near_paths::{chance_of, choose_light, covered_halves};
use crate::backend::cpu::twins::rank_lights::{
    Seen, factor_of, irradiance_of, rank_lights, seen, side, triangles,
};
use crate::backend::cpu::twins::ray_arrays::RayArrays;
use crate::backend::cpu::twins::settle::{Settled, settle};
use crate::backend::cpu::twins::shift::Shift;
use crate::backend::cpu::twins::trace::nearest;
use crate::backend::cpu::twins::{hemisphere_rays, light_rays, near_paths};
use crate::backend::gpu::field::{element_texels, quadtrees};
use crate::backend::gpu::layout::{MIN_IRRADIANCE_SHARE, NOTHING, PointState, TracedLight};
use crate::backend::gpu::test_support::{
    gather_points, gpu, lamp_within_ceiling, narrow_gap, on_sides, random_radiosity, read_buffer,
    traced_scenes, under_sky_and_sun,
};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::form_factor::closed_form::point_to_polygon;
use crate::sampling::hash::{split_mix64_nth, unit_interval};
use crate::scene::{IntensityDistribution, Luminaire};
use crate::visibility::ray_scene::{Hit, RayScene};

/// Relative rounding error of 32-bit numbers.
const ROUNDING: f64 = f32::EPSILON as f64 / 2.0;

/// A gather whose passes are run one at a time, and the inputs of the twins.
struct Passes {
    gpu: Gpu,
    gather: TracedGather,
    slot: Slot,
    bound: Bound,
    arrays: TracedArrays,
    quadtrees: Vec<u32>,
    elements: Vec<[f32; 4]>,
    directions: Vec<[f32; 4]>,
    points: Vec<TracedPoint>,
}

/// Scenes for all passes.
fn gathered_scenes() -> Vec<(&'static str, Mesh)> {
    let mut scenes = traced_scenes();
    scenes.push(("narrow gap", narrow_gap()));
    scenes
}

impl Passes {
    /// `count` points of `mesh`, with initially `rays` rays each and finally 16 times that.
    fn new(mesh: &Mesh, count: usize, rays: u32) -> Passes {
        let gpu = gpu();
        let gather =
            TracedGather::with_noise(&gpu, mesh, rays, 1e-6, 0.0).unwrap().with_near_field();
        let mut slots = Slots::new(gpu.memory(), count as u32, [1; 2]).unwrap();
        let mut slot = slots.slots.remove(0);
        // Buffers that the tests read and write.
        let buffer = |bytes: u64, usage| {
            use wgpu::BufferUsages as Usage;
            let usage = Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST | usage;
            gpu.memory().buffer("test", bytes, usage).unwrap()
        };
        let states = buffer((count * size_of::<PointState>()) as u64, wgpu::BufferUsages::empty());
        let work = WORK_HEADER_BYTES + 2 * count as u64 * 4;
        let work = buffer(work, wgpu::BufferUsages::INDIRECT);
        (slot.states, slot.work) = (states, work);
        let (corners, reflected) = random_radiosity(mesh);
        let field = RadiosityField { mesh, corners: &corners, reflected: &reflected };
        let arrays = TracedArrays::new(&gather.lights);
        let buffers = FieldBuffers::new(gpu.memory(), &field, arrays.radiance_unit).unwrap();
        let bound = gather.bind(&slot, &buffers);
        let TracedGather { min_rays, max_rays, .. } = gather;
        let directions = ordered_directions(&samples(mesh.scene(), max_rays, min_rays), min_rays);
        let points: Vec<TracedPoint> =
            gather_points(mesh, count).iter().map(|p| gather.traced_point(p)).collect();
        gpu.queue.write_buffer(&slot.points, 0, bytemuck::cast_slice(&points));
        gpu.queue.write_buffer(&slot.work, 0, bytemuck::cast_slice(&all_work(count as u32)));
        let (quadtrees, elements) = (quadtrees(mesh), element_texels(&field, arrays.radiance_unit));
        Passes { gpu, gather, bound, arrays, quadtrees, elements, directions, points, slot }
    }

    fn ray_arrays(&self) -> RayArrays<'_> {
        RayArrays {
            scene: &self.arrays,
            quadtrees: &self.quadtrees,
            elements: &self.elements,
            directions: &self.directions,
        }
    }

    /// Rays of a half from `first` on, at most `pass_rays`; the allowed noise is so low that all
    /// that may be doubled is.
    fn settings(&self, first: u32, pass_rays: u32) -> GatherSettings {
        let TracedGather { min_rays, max_rays, .. } = self.gather;
        let points = self.points.len() as u32;
        let (noise, dim) = (1e-6, 0.0);
        GatherSettings { min_rays, max_rays, noise, dim, points, first, pass_rays, near_field: 1 }
    }

    /// Settings of all rays of a half at once.
    fn whole(&self) -> GatherSettings {
        self.settings(0, crate::sampling::hemisphere::MAX_RAYS)
    }

    /// Runs a pass: one of rays over the points of its list, others over `groups` workgroups.
    fn run(&self, of_gather: GatherPass, groups: u32, settings: &GatherSettings) {
        let slot = &self.slot;
        for buffer in [&slot.settings[0], &slot.path_settings[0]] {
            self.gpu.queue.write_buffer(buffer, 0, bytemuck::bytes_of(settings));
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.bound.set(&mut pass, of_gather, 0);
        if GatherPass::RAYS.contains(&of_gather) {
            pass.dispatch_workgroups_indirect(&slot.work, of_gather.list_offset());
        } else {
            pass.dispatch_workgroups(groups, 1, 1);
        }
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
    }

    fn states(&self) -> Vec<PointState> {
        read_buffer(&self.gpu, &self.slot.states)
    }

    /// Runs `settle`: states and samples of all points, and the points that it lists.
    fn settle(&self, settings: &GatherSettings) -> (Vec<PointState>, Vec<Sample>, [Vec<u32>; 2]) {
        let slot = &self.slot;
        let header = [0u32, 1, 1, 0, 1, 1, 0, 0];
        self.gpu.queue.write_buffer(&slot.work, 0, bytemuck::cast_slice(&header));
        let count = self.points.len();
        self.run(GatherPass::Settle, count.div_ceil(64) as u32, settings);
        let mut samples: Vec<Sample> = read_buffer(&self.gpu, &slot.samples);
        samples.truncate(count);
        let work: Vec<u32> = read_buffer(&self.gpu, &slot.work);
        let (header, lists) = work.split_at(WORK_HEADER_BYTES as usize / 4);
        assert_eq!([header[1], header[2], header[4], header[5]], [1; 4]);
        let mut lists = [&lists[..header[0] as usize], &lists[count..][..header[3] as usize]]
            .map(<[u32]>::to_vec);
        lists.iter_mut().for_each(|list| list.sort_unstable());
        (self.states(), samples, lists)
    }
}

/// Checks that `actual` is `expected` up to `width` and `roundings` roundings of it.
fn check(actual: f32, expected: f32, (width, roundings): (f64, f64), what: impl Fn() -> String) {
    let off = (f64::from(actual) - f64::from(expected)).abs();
    let limit = width + roundings * ROUNDING * f64::from(expected).abs();
    assert!(off <= limit, "{}: {actual}, not {expected}: off by {off:e} of {limit:e}", what());
}

// ---------------------------------------------------------------------------------------------
// Exact rays.

/// The nearest hits of the twin are those of exact rays along the same directions, except for rays
/// so near an edge that rounding decides: exact rays deflected by 2⁻²⁰ have the twin's hit, or
/// where it hits a side, a hit at the same distance. Distances are within the error bound of the
/// hit. The same holds for rays to the sides of triangles, for which rounding often decides; the
/// twin's triangles are widened there, by more the longer and thinner they are: by at most 2⁻¹⁷
/// here.
#[test]
fn twin_hits_what_exact_rays_hit() {
    let mut at_sides = 0;
    for (name, mesh) in traced_scenes() {
        let arrays = TracedArrays::new(&Lights::new(mesh.shared_scene()));
        let exact = RayScene::of_scene(mesh.scene());
        let samples = HemisphereSamples::progressive(1024);
        let sides = on_sides(&mesh, 7);
        let (mut rays, mut differ) = (0, 0);
        for at in gather_points(&mesh, 12) {
            let point = traced(&arrays, &at);
            let what = format!("{name}, {at:?}");
            for direction in samples.directions(at.normal, 0.3) {
                rays += 1;
                differ += u32::from(differs(&what, (&arrays, &exact), &point, &at, direction, 1.0));
            }
            let to_sides = sides.iter().map(|side| (side - at.position).normalize());
            for direction in to_sides.filter(|d| d.dot(at.normal) > 0.0) {
                at_sides +=
                    u32::from(differs(&what, (&arrays, &exact), &point, &at, direction, 8.0));
            }
        }
        println!("{name}: {differ} of {rays} rays have another hit");
        // A ray is within 2⁻²⁰ of some hundred sides, each a radian long, in 1e-4 of the
        // hemisphere.
        assert!(differ * 1000 < rays, "{name}: {differ} of {rays} rays");
    }
    println!("{at_sides} rays to sides have another hit");
    assert!(at_sides > 0);
}

/// Whether the twin's hit differs from that of an exact ray; then an exact ray deflected by `apart`
/// times 2⁻²⁰ must have it.
fn differs(
    what: &str,
    (arrays, exact): (&TracedArrays, &RayScene),
    point: &TracedPoint,
    at: &GatherPoint,
    direction: DVec3,
    apart: f32,
) -> bool {
    let unit = 1.0 / arrays.coordinates.length_unit();
    let direction = direction.as_vec3().normalize();
    let hit = nearest(arrays, &ray_from(point, direction));
    let along = |d: Vec3| exact.closest_hit(at.position, d.as_dvec3(), at.near, None);
    let truth = along(direction);
    let of_twin = (hit.triangle != NOTHING)
        .then(|| (arrays.triangles[hit.triangle as usize].index as usize, hit.front));
    let is_same = |h: Option<Hit>| h.map(|h| (h.triangle, h.front)) == of_twin;
    let is_as_far = |truth: &Hit| {
        // The direction is of unit length up to a rounding.
        let limit = f64::from(hit.off) * unit + 4.0 * ROUNDING * truth.distance;
        (f64::from(hit.distance) * unit - truth.distance).abs() <= limit
    };
    if is_same(truth) {
        assert!(truth.as_ref().is_none_or(is_as_far), "{what}: {hit:?}, {truth:?}");
        return false;
    }
    let turned = |shift: Shift| {
        let shift = Shift { across: apart * shift.across, ..shift };
        along(shift.direction(direction))
    };
    let turned: Vec<Option<Hit>> = Shift::all().into_iter().map(turned).collect();
    // Of two triangles that share a side, one may be hit only there: exact rays hit the other, at
    // the same distance up to the change by a deflection at a cosine of 2⁻⁷ or more.
    let is_on_side = hit.u.min(hit.v).min(1.0 - hit.u - hit.v) <= apart * 2f32.powi(-20);
    let moved = f64::from(apart) * 2f64.powi(-13);
    let is_near = |h: &Hit| (f64::from(hit.distance) * unit / h.distance - 1.0).abs() <= moved;
    let is_explained =
        turned.iter().any(|&h| is_same(h)) || is_on_side && turned.iter().flatten().any(is_near);
    assert!(is_explained, "{what}, {direction}: {hit:?}, not {truth:?}");
    true
}

/// The device's form of a point, without its rotation.
fn traced(arrays: &TracedArrays, at: &GatherPoint) -> TracedPoint {
    let [position, position_low] = arrays.coordinates.parts(at.position);
    TracedPoint {
        position,
        near: arrays.coordinates.length(at.near),
        position_low,
        normal: at.normal.as_vec3().to_array(),
        ..Default::default()
    }
}

/// Form factors to lights equal the closed form in 64 bits: the error is 3e-5 where it cancels
/// most, for a triangle of 5e-3 of its distance, and that of the lights' own terms.
#[test]
fn twin_ranks_lights_as_closed_forms_do() {
    for (name, mesh) in traced_scenes() {
        let lights = Lights::new(mesh.shared_scene());
        let arrays = TracedArrays::new(&lights);
        for at in gather_points(&mesh, 24) {
            let point = traced(&arrays, &at);
            for (number, light) in lights.lights.iter().enumerate() {
                let corners = |&t: &u32| lights.scene().corners(t as usize);
                let factor = |c: [DVec3; 3]| point_to_polygon(at.position, at.normal, &c);
                let truth: f64 = light.triangles.iter().map(corners).map(factor).sum();
                let actual = factor_of(&arrays, &arrays.lights[number], &point);
                // Near the horizon the visible part of a light is a sliver, with an error of a few
                // roundings of the whole.
                let limit = 1e-4 * truth + 16.0 * ROUNDING;
                assert!(
                    (f64::from(actual) - truth).abs() <= limit,
                    "{name}, light {number}, {at:?}: {actual}, not {truth}"
                );
            }
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Pass by pass.

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn gather_passes_equal_their_twins() {
    let mut cases = Cases::default();
    for (name, mesh) in gathered_scenes() {
        compare(name, &Passes::new(&mesh, 7, 256), &mut cases);
    }
    println!("{cases:?}");
    // All cases to compare have occurred.
    assert!(cases.wide > 0 && cases.folded > 0 && cases.full > 0 && cases.escaped > 0.0);
    assert!(cases.back > 0.0 && cases.lamps > 0.0 && cases.dim > 0 && cases.rounds >= 6);
    assert!(cases.covered > 20 && cases.near_by_field > 0.0);
}

/// Cases that occurred in the scenes.
#[derive(Debug, Default)]
struct Cases {
    /// Numbers of lights that rays over the hemisphere sample, of those that are not convex, and of
    /// points with the maximum number of lights sampled separately.
    wide: usize,
    folded: usize,
    full: usize,
    /// Lights that are omitted because they are dim.
    dim: usize,
    escaped: f32,
    back: f32,
    lamps: f32,
    /// Halves of points whose near surfaces are followed by paths, and rays to others that are not.
    covered: usize,
    near_by_field: f32,
    rounds: usize,
}

fn compare(name: &str, passes: &Passes, cases: &mut Cases) {
    let count = passes.points.len() as u32;
    passes.run(GatherPass::RankLights, count, &passes.whole());
    let mut states = passes.states();
    compare_ranks(name, passes, &states, cases);
    let mut lists = [(); 2].map(|()| (0..count).collect::<Vec<u32>>());
    let mut round = 0;
    while lists.iter().any(|list| !list.is_empty()) {
        let what = format!("{name}, round {round}");
        for twin in RayTwin::all() {
            passes.compare_rays(&what, &twin, round, &lists[twin.list], &mut states);
            if twin.of_gather == GatherPass::HemisphereRays {
                lists[0].iter().for_each(|&p| cases.count_covered(&states[p as usize]));
            }
        }
        let (after, samples, listed) = passes.settle(&passes.whole());
        compare_settled(&what, passes, &passes.whole(), [&states, &after], &samples, &listed);
        for sums in after.iter().flat_map(|state| &state.rays) {
            cases.escaped += sums.escaped;
            cases.back += sums.back;
            cases.lamps += sums.lamps[0];
        }
        (states, lists) = (after, listed);
        round += 1;
        cases.rounds = cases.rounds.max(round);
    }
    // All have cast the maximum number of rays, unless these agree.
    let max = passes.gather.max_rays;
    let settled = passes.settle(&passes.whole()).1;
    assert!(settled.iter().all(|s| s.rays == max || s.noise < 1e-5), "{name}: {settled:?}");
}

impl Cases {
    /// Counts the halves of a point whose near surfaces are followed by paths.
    fn count_covered(&mut self, state: &PointState) {
        for (covered, sums) in covered_halves(state).into_iter().zip(&state.rays) {
            self.covered += usize::from(covered);
            self.near_by_field += if covered { 0.0 } else { sums.near };
        }
    }
}

// ---------------------------------------------------------------------------------------------
// Lights.

/// Lights are the same, in the same order up to rounding of their irradiance.
fn compare_ranks(name: &str, passes: &Passes, device: &[PointState], cases: &mut Cases) {
    let arrays = &passes.arrays;
    for (p, (point, state)) in passes.points.iter().zip(device).enumerate() {
        let what = format!("{name}, point {p}");
        let twin = rank_lights(arrays, point, &passes.whole());
        assert_eq!(state.light_count, twin.light_count, "{what}: {state:?}, not {twin:?}");
        let irradiance = |light: u32| {
            let light = &arrays.lights[light as usize];
            f64::from(irradiance_of(light, factor_of(arrays, light, point)))
        };
        for (a, b) in state.ranked().iter().zip(twin.ranked()) {
            let light = &arrays.lights[a.light as usize];
            let off = factor_error(arrays, light, point);
            if a.light != b.light {
                let (sent, other) = (irradiance(a.light), irradiance(b.light));
                let brightest = f64::from(Vec3::from(light.exitance).max_element());
                assert!((sent - other).abs() < 4.0 * off * brightest, "{what}: {a:?}, not {b:?}");
            }
            check(a.factor, factor_of(arrays, light, point), (off, 0.0), || what.clone());
            let of_twin = twin.ranked().iter().find(|other| other.light == a.light);
            assert_eq!(Some(a.is_wide), of_twin.map(|b| b.is_wide), "{what}: {a:?}, not {b:?}");
            cases.wide += a.is_wide as usize;
            cases.folded += usize::from(light.is_convex == 0);
        }
        // Ties are ordered by number.
        for pair in state.ranked().windows(2) {
            let sent =
                |k: usize| irradiance_of(&arrays.lights[pair[k].light as usize], pair[k].factor);
            assert!(sent(0) > sent(1) || pair[0].light < pair[1].light, "{what}: {pair:?}");
        }
        cases.full += usize::from(state.light_count == 8);
        let all: f64 = (0..arrays.info.lights).map(irradiance).sum();
        cases.dim += (0..arrays.info.lights)
            .filter(|&k| {
                let sent = irradiance(k);
                sent > 0.0 && sent <= f64::from(MIN_IRRADIANCE_SHARE) * all
            })
            .count();
        let rest = PointState { lights: state.lights, ..twin };
        assert_eq!(*state, rest, "{what}: nothing has been cast");
    }
}

/// Maximum error of the form factor of a light on a device. Each side of a polygon is an angle
/// times a cosine: lavapipe's arc tangent has a relative error of 2.1e-5, and less for large
/// angles; the rest is some 20 roundings. A triangle represented by its middle has no more of
/// these.
fn factor_error(arrays: &TracedArrays, light: &TracedLight, point: &TracedPoint) -> f64 {
    let share = 2.1e-5 + 20.0 * ROUNDING;
    let of_triangle = |t| match seen(t, point) {
        Seen::Back => 0.0,
        Seen::Small(factor) => 20.0 * ROUNDING * f64::from(factor),
        Seen::Cut(corners) => {
            let next = corners.iter().cycle().skip(1);
            let sides = corners.iter().zip(next);
            let normal = point.normal.into();
            let sum: f32 = sides.map(|(&a, &b)| side(a, b, normal).abs()).sum();
            share * f64::from(sum / (2.0 * PI))
        }
    };
    triangles(arrays, light).map(of_triangle).sum()
}

// ---------------------------------------------------------------------------------------------
// Rays.

/// The twin of a kind of passes that cast rays, and how far these may be off.
struct RayTwin {
    of_gather: GatherPass,
    /// What a ray adds.
    ray: fn(&RayArrays, &TracedPoint, &PointState, u32, Shift) -> HalfSums,
    /// Number of rays of a point before the pass.
    count: fn(&PointState) -> u32,
    /// Which of the two lists has its points.
    list: usize,
    /// Roundings of one ray.
    roundings: f64,
    /// Width of the range of a ray, in units of that by [`Shift::all`].
    width: f64,
    /// Rays of a point that may be near an edge in any case, and of how many more rays one may.
    near_edges: usize,
    rays_per_edge: usize,
}

impl RayTwin {
    fn all() -> [RayTwin; 3] {
        [
            // Some hundred sides a radian long, and the same number of lines between elements,
            // cover 2e-4 of the hemisphere, and those between pieces of a sky, 2⁻⁹ apart, 2⁻¹⁰ of
            // it.
            RayTwin {
                of_gather: GatherPass::HemisphereRays,
                ray: hemisphere_rays::ray,
                count: |state| state.ray_count,
                list: 0,
                roundings: 40.0,
                width: 1.0,
                near_edges: 2,
                rays_per_edge: 100,
            },
            // A path has some ten vertices with three rays each, and rounding deflects each vertex
            // in its own way, shifts all in the same way.
            RayTwin {
                of_gather: GatherPass::NearPaths,
                ray: near_paths::ray,
                count: |state| state.ray_count,
                list: 0,
                roundings: 400.0,
                width: 2.0,
                near_edges: 3,
                rays_per_edge: 20,
            },
            // Near an outline, or a side of a texel, as rarely as rays over the hemisphere; near
            // the horizon and a light's own plane a factor is small, with a large relative error.
            RayTwin {
                of_gather: GatherPass::LightRays,
                ray: light_rays::ray,
                count: |state| state.shadow_count,
                list: 1,
                roundings: 40.0,
                width: 1.0,
                near_edges: 2,
                rays_per_edge: 50,
            },
        ]
    }
}

/// Number of values in [`HalfSums`], and the indices of the largest rays, others and near ones.
const NUMBERS: usize = size_of::<HalfSums>() / 4;
const LARGEST: [usize; 2] = [9, 11];

fn numbers(sums: HalfSums) -> [f32; NUMBERS] {
    bytemuck::cast(sums)
}

/// Range of the possible sums over rays.
#[derive(Clone, Copy, Debug, Zeroable)]
struct Spread {
    /// Width of the range of each number, over all rays; of the largest rays minimum and maximum.
    widths: [f64; NUMBERS],
    largest: [[f32; 2]; 2],
    /// Rays of which any number may differ by more than 5 %.
    unsure: usize,
    rays: usize,
}

impl Spread {
    /// Adds one ray, whose result is within the range of these, times `width`.
    fn add(&mut self, results: &[[f32; NUMBERS]], width: f64) {
        let mut is_unsure = false;
        for k in 0..NUMBERS {
            let of_number = results.iter().map(|result| result[k]);
            let (low, high) = (
                of_number.clone().fold(f32::INFINITY, f32::min),
                of_number.fold(f32::NEG_INFINITY, f32::max),
            );
            self.widths[k] += width * f64::from(high - low);
            is_unsure |= high - low > 0.05 * high.abs();
            if let Some(n) = LARGEST.iter().position(|&largest| largest == k) {
                self.largest[n][0] = self.largest[n][0].max(low);
                self.largest[n][1] = self.largest[n][1].max(high);
            }
        }
        self.unsure += usize::from(is_unsure);
        self.rays += 1;
    }
}

impl Passes {
    /// Casts the rays of a round from the points of `list`, in several passes, the last of them not
    /// full, and compares the new states with those of the twin; points of the list may have cast
    /// different numbers of rays, and no other point may change.
    fn compare_rays(
        &self,
        what: &str,
        twin: &RayTwin,
        round: usize,
        list: &[u32],
        states: &mut Vec<PointState>,
    ) {
        let max = list.iter().map(|&p| (twin.count)(&states[p as usize])).max().unwrap_or(0);
        let is_path = twin.of_gather == GatherPass::NearPaths;
        let len = if is_path { self.gather.path_rays() } else { max * 5 / 8 + 1 };
        for first in (0..max).step_by(len as usize) {
            let settings = self.settings(first, len);
            self.run(twin.of_gather, 0, &settings);
            let before = std::mem::replace(states, self.states());
            // Later rounds have more paths of the same kinds, which takes minutes.
            if is_path && round > 1 {
                continue;
            }
            (0..before.len()).into_par_iter().for_each(|p| {
                let what = format!("{what}, {:?} from {first}, point {p}", twin.of_gather);
                match list.contains(&(p as u32)) {
                    true => self.compare_sums(&what, twin, &settings, p, &before[p], &states[p]),
                    false => assert_eq!(before[p], states[p], "{what} is not listed"),
                }
            });
        }
    }

    /// Sums over the rays of a point are those of the twin, except for rays that rounding may
    /// deflect.
    fn compare_sums(
        &self,
        what: &str,
        twin: &RayTwin,
        settings: &GatherSettings,
        p: usize,
        before: &PointState,
        after: &PointState,
    ) {
        let (arrays, point, shifts) = (self.ray_arrays(), &self.points[p], Shift::all());
        let ray = |k: u32, shift: Shift| (twin.ray)(&arrays, point, before, k, shift);
        let count = (twin.count)(before);
        let expected = cast_rays(count, before, settings, |k, _| ray(k, Shift::NONE));
        let [from, middle, to] = range(count, before, settings);
        let mut spreads = [Spread::zeroed(); 2];
        for k in from..to {
            let results: Vec<_> = shifts.iter().map(|&shift| numbers(ray(k, shift))).collect();
            spreads[usize::from(k >= middle)].add(&results, twin.width);
        }
        for (half, spread) in spreads.iter().enumerate() {
            // A lane adds up its rays, then 64 lanes are added.
            let roundings = spread.rays as f64 / 64.0 + 6.0 + twin.roundings;
            let [was, is, expected] =
                [before, after, &expected].map(|state| numbers(HalfSums::of(state, half)));
            for k in 0..NUMBERS {
                let what = || format!("{what}, half {half}, number {k}");
                if let Some(n) = LARGEST.iter().position(|&largest| largest == k) {
                    let [low, high] = spread.largest[n].map(|largest| largest.max(was[k]));
                    let slack = (twin.roundings * ROUNDING) as f32 * high;
                    let is_within = is[k] >= low - slack && is[k] <= high + slack;
                    assert!(is_within, "{}: {}, not {low} to {high}", what(), is[k]);
                } else if spread.widths[k] == 0.0 && expected[k] == was[k] {
                    assert_eq!(is[k], was[k], "{}: nothing is added", what());
                } else {
                    check(is[k], expected[k], (spread.widths[k], roundings), what);
                }
            }
        }
        // The test is only significant if few rays are near an edge.
        let sum = |of: fn(&Spread) -> usize| spreads.iter().map(of).sum::<usize>();
        let (unsure, rays) = (sum(|spread| spread.unsure), sum(|spread| spread.rays));
        let limit = twin.near_edges + rays / twin.rays_per_edge;
        assert!(unsure <= limit, "{what}: {unsure} of {rays} rays are unsure");
        let rest = PointState { rays: after.rays, visible: after.visible, ..*before };
        assert_eq!(*after, rest, "{what}: nothing else is written");
    }
}

/// Lights are chosen as often as the balance assumes.
#[test]
fn paths_choose_lights_with_their_chance() {
    for (name, mesh) in gathered_scenes() {
        let arrays = TracedArrays::new(&Lights::new(mesh.shared_scene()));
        if arrays.info.lights == 0 {
            continue;
        }
        let settings = GatherSettings { min_rays: 256, ..Default::default() };
        for at in gather_points(&mesh, 5) {
            let state = rank_lights(&arrays, &traced(&arrays, &at), &settings);
            let mut counts = vec![0u32; arrays.info.lights as usize];
            let all = 1 << 14;
            for k in 0..all {
                let random = (k as f32 + 0.5) / all as f32;
                counts[choose_light(&arrays, &state, random) as usize] += 1;
            }
            for (light, count) in (0..).zip(counts) {
                let chance = f64::from(chance_of(&arrays, &state, light)) * f64::from(all);
                // Each light has at most two ranges of numbers, with two ends each.
                let off = (f64::from(count) - chance).abs();
                assert!(off <= 4.1, "{name}, light {light}: {count}, not {chance}");
            }
        }
    }
}

/// Between plates that are closer than their elements are wide the device's light is that of rays
/// on the CPU, within the noise of the paths: around each of several centres there are 32 points so
/// close together that only their random numbers differ, and their spread gives the noise of their
/// mean.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn light_in_a_narrow_gap_is_that_of_rays_on_the_cpu() {
    let (gpu, mesh) = (gpu(), narrow_gap());
    let (corners, reflected) = random_radiosity(&mesh);
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &reflected };
    let mut device = TracedGather::new(&gpu, &mesh, 1024).unwrap().with_near_field();
    let mut cpu = RayGather::new(&mesh, 1024).unwrap().with_near_field();
    let centres = [
        ([1.0, 1.0, 1e-4], DVec3::Z),
        ([1.8, 0.6, 1e-4], DVec3::Z),
        ([0.3, 1.3, 0.1499], -DVec3::Z),
        ([1.5, 1.5, 0.1499], -DVec3::Z),
        ([0.55, 1.0, 1e-4], DVec3::Z),
        ([1.4, 0.5, 1e-4], DVec3::Z),
        ([1.3, 0.6, 0.1499], -DVec3::Z),
    ];
    let (mut squares, mut numbers) = (0.0, 0);
    for (centre, normal) in centres {
        let near_by = |k: usize| {
            let random = |j: usize| unit_interval(split_mix64_nth((3 * k + j) as u64)) - 0.5;
            // Over some hundred cells, each of which has rays and paths of its own.
            let shift = 4e-3 * DVec3::new(random(0), random(1), 0.0);
            GatherPoint { position: DVec3::from_array(centre) + shift, normal, near: 2.5e-5 }
        };
        let points: Vec<GatherPoint> = (0..32).map(near_by).collect();
        let actual = gathered(&mut device, &field, &points, MAX_POINTS);
        assert!(actual.iter().all(|sample| sample.near_paths), "{centre:?} is covered");
        let actual = mean_and_variance(actual.into_iter());
        let expected = mean_and_variance(cpu.gather(&field, &points).unwrap().into_iter());
        let off = actual.0 - expected.0;
        let error = (actual.1 + expected.1).map(f64::sqrt);
        println!("{centre:?}: {:.4} and {:.4}: {:.2} σ", actual.0, expected.0, off / error);
        // Of 21 numbers with 31 degrees of freedom each one in 2000 goes beyond this by chance.
        assert!((off.abs() / error).max_element() < 4.8, "{centre:?}: {off} of {error}");
        assert!(error.max_element() < 0.03 * expected.0.min_element(), "{centre:?}: {error}");
        squares += (off / error).length_squared();
        numbers += 3;
    }
    // The channels at a centre depend on each other: as few as a third of all are free.
    println!("mean square {:.2}", squares / f64::from(numbers));
    assert!(squares / f64::from(numbers) < 2.5);
}

/// Mean of the light of `samples` without what lights bring by themselves, and the variance of that
/// mean.
fn mean_and_variance(
    samples: impl ExactSizeIterator<Item = IrradianceSample> + Clone,
) -> (Rgb, Rgb) {
    let count = samples.len() as f64;
    let reflected = samples.map(|sample| sample.irradiance - sample.direct);
    let mean = reflected.clone().sum::<Rgb>() / count;
    let squares: Rgb = reflected.map(|light| (light - mean) * (light - mean)).sum();
    (mean, squares / (count * (count - 1.0)))
}

/// Paths on the device sample no luminaires: of a scene with some, points that near surfaces cover
/// are gathered on the CPU, and the others are not.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn covered_points_under_luminaires_are_gathered_on_the_cpu() {
    let (gpu, mesh) = (gpu(), narrow_gap());
    let intensity = IntensityDistribution::isotropic(1.0).unwrap();
    let luminaire = Luminaire::new(intensity, DVec3::new(1.2, 0.7, 0.1), -DVec3::Z);
    let scene = mesh.scene().clone().with_luminaires(vec![luminaire]).unwrap();
    let mesh = mesh.with_scene(scene).unwrap();
    let (corners, reflected) = random_radiosity(&mesh);
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &reflected };
    let above = [([1.0, 1.0, 1e-4], DVec3::Z), ([1.0, 1.0, 0.2], DVec3::Z)];
    let points = above.map(|(position, normal)| GatherPoint {
        position: DVec3::from_array(position),
        normal,
        near: 2.5e-5,
    });
    for noise in [f64::INFINITY, 0.05] {
        let device = TracedGather::with_noise(&gpu, &mesh, 256, noise, 0.1).unwrap();
        let mut device = device.with_near_field();
        let mut cpu = RayGather::new(&mesh, 256).unwrap().with_noise(noise, 0.1).with_near_field();
        let actual = device.gather(&field, &points).unwrap();
        let expected = cpu.gather(&field, &points).unwrap();
        assert_eq!(actual[0], expected[0]);
        assert_ne!(actual[1], expected[1]);
        assert!(actual[1].irradiance.distance(expected[1].irradiance) < 1e-3);
    }
}

/// Objects in a light's own plane do not hide it, whichever of both rounding puts first.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn rays_to_lights_end_at_their_plane() {
    let passes = Passes::new(&lamp_within_ceiling(), 40, 1024);
    let settings = passes.whole();
    passes.run(GatherPass::RankLights, 40, &settings);
    passes.run(GatherPass::LightRays, 40, &settings);
    let mut lit = 0;
    for (point, state) in passes.points.iter().zip(passes.states()) {
        let ranked = rank_lights(&passes.arrays, point, &settings);
        let twin = cast_rays(ranked.shadow_count, &ranked, &settings, |k, _| {
            light_rays::ray(&passes.ray_arrays(), point, &ranked, k, Shift::NONE)
        });
        for visible in [state, twin].iter().flat_map(|state| state.visible.as_flattened()) {
            assert_eq!(visible.seen, [visible.all; 3], "{point:?}");
            lit += usize::from(visible.all > 0.0);
        }
    }
    assert!(lit > 40, "{lit}");
}

// ---------------------------------------------------------------------------------------------
// What rays amount to.

/// Samples within rounding, the same decisions, and the same bits of sums.
fn compare_settled(
    what: &str,
    passes: &Passes,
    settings: &GatherSettings,
    [before, after]: [&[PointState]; 2],
    samples: &[Sample],
    listed: &[Vec<u32>; 2],
) {
    for (p, (was, is)) in before.iter().zip(after).enumerate() {
        let what = format!("{what}, point {p}");
        let mut twin = *was;
        let Some(settled) = settle(&passes.arrays, &passes.points[p], settings, &mut twin) else {
            assert_eq!(was, is, "{what} is settled");
            continue;
        };
        compare_samples(&what, &samples[p], &settled);
        // Errors are differences of means, which have an error of some 40 roundings.
        let of_means = |mean: [f32; 3]| Vec3::from(mean).length();
        let slack = 160.0 * ROUNDING as f32 * of_means(settled.sample.irradiance);
        let Settled { ray_error, shadow_error, allowed, .. } = settled;
        if is.pending != twin.pending {
            let is_near = (settled.sample.noise - allowed).abs() <= 2.0 * slack
                || (ray_error - shadow_error).abs() <= 2.0 * slack;
            assert!(is_near, "{what}: next {}, not {}", is.pending, twin.pending);
            continue;
        }
        if is.pending != 0 {
            assert!((is.ray_error - ray_error).abs() <= slack, "{what}: {is:?}, not {twin:?}");
            assert!((is.shadow_error - shadow_error).abs() <= slack, "{what}: {is:?}, {twin:?}");
        }
        let rest = PointState { ray_error: is.ray_error, shadow_error: is.shadow_error, ..twin };
        assert_eq!(*is, rest, "{what}");
    }
    for (k, list) in listed.iter().enumerate() {
        let points = (0..after.len() as u32).zip(after);
        let pending = points.filter(|(_, state)| state.pending == k as u32 + 1);
        assert_eq!(*list, pending.map(|(p, _)| p).collect::<Vec<_>>(), "{what}, list {k}");
    }
}

/// All terms are positive: some 40 roundings of the sum, which is as long as any channel; the noise
/// is a difference of halves, either of which may be twice their mean.
fn compare_samples(what: &str, actual: &Sample, settled: &Settled) {
    let expected = &settled.sample;
    let whole = f64::from(Vec3::from(expected.irradiance).length());
    let width = 40.0 * ROUNDING * whole;
    let vectors = [(actual.irradiance, expected.irradiance), (actual.direct, expected.direct)];
    for (actual, expected) in vectors {
        for (a, b) in actual.into_iter().zip(expected) {
            check(a, b, (width, 0.0), || what.to_string());
        }
    }
    check(actual.noise, expected.noise, (4.0 * width, 0.0), || format!("{what}, noise"));
    let shares = [
        (actual.escaped, expected.escaped),
        (actual.back, expected.back),
        (actual.inverse_distance, expected.inverse_distance),
    ];
    for (actual, expected) in shares {
        // A sum and a division, with an error of three roundings.
        check(actual, expected, (0.0, 8.0), || format!("{what}, share"));
    }
    assert_eq!([actual.rays, actual.shadow_rays], [expected.rays, expected.shadow_rays], "{what}");
}

/// States of all kinds, in several workgroups: with an allowed noise so high that many points
/// finish.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn settle_equals_its_twin_from_any_state() {
    let mut decided = [0; 4];
    for (name, mesh) in gathered_scenes() {
        let passes = Passes::new(&mesh, 150, 64);
        let settings = GatherSettings { noise: 0.05, dim: 0.3, ..passes.whole() };
        let lights = passes.arrays.info.lights;
        let states: Vec<PointState> = (0..150).map(|k| any_state(k, lights, &settings)).collect();
        let slot = &passes.slot;
        passes.gpu.queue.write_buffer(&slot.states, 0, bytemuck::cast_slice(&states));
        let (after, samples, listed) = passes.settle(&settings);
        compare_settled(name, &passes, &settings, [&states, &after], &samples, &listed);
        for (was, is) in states.iter().zip(&after) {
            decided[if was.pending == 0 { 3 } else { is.pending as usize }] += 1;
        }
    }
    println!("enough, more rays, more rays to lights, settled before: {decided:?}");
    assert!(decided.iter().all(|&count| count > 50), "{decided:?}");
}

/// A state that rays may leave, with similar halves.
fn any_state(seed: u64, lights: u32, settings: &GatherSettings) -> PointState {
    let mut next = 1000 * seed;
    let mut random = || {
        next += 1;
        unit_interval(split_mix64_nth(next)) as f32
    };
    let pending = (4.0 * random()) as u32;
    let halving = |random: f32| (5.0 * random) as u32;
    let mut state = PointState {
        light_count: lights.min((9.0 * random()) as u32),
        // Before this doubling.
        ray_count: settings.min_rays << halving(random()),
        shadow_count: (settings.min_rays / RAYS_PER_SHADOW_RAY) << halving(random()),
        pending,
        ray_error: 0.1 * random(),
        shadow_error: 0.1 * random(),
        ..Default::default()
    };
    if pending == 1 {
        state.ray_count = (state.ray_count / 2).max(settings.min_rays);
    }
    if pending == 2 {
        state.shadow_count = (state.shadow_count / 2).max(settings.min_rays / RAYS_PER_SHADOW_RAY);
    }
    let rays = state.ray_count as f32;
    let apart = 0.3 * random();
    for (k, light) in state.lights.iter_mut().enumerate() {
        light.light = k as u32 % lights.max(1);
        (light.factor, light.is_wide) = (0.2 * random(), u32::from(random() < 0.3));
    }
    for sums in &mut state.rays {
        let mut term = |mean: f32| rays * mean * (1.0 + apart * random());
        sums.light = [term(0.3), term(0.2), term(0.4)];
        sums.lamps = [term(0.1), term(0.1), term(0.05)];
        (sums.escaped, sums.back) = (term(0.1).floor(), term(0.1).floor());
        sums.inverse_distance = term(1.0);
        sums.largest = random();
        // Of some halves more than half of the rays, which are half of all.
        sums.near = (rays * random()).floor();
        sums.near_light = [(); 3].map(|_| sums.near * random());
        sums.near_largest = random();
    }
    for visible in state.visible.as_flattened_mut() {
        visible.all = 1.0 + random();
        visible.seen = [(); 3].map(|_| visible.all * (1.0 - apart * random()));
    }
    state
}

// ---------------------------------------------------------------------------------------------
// The same bits.

/// Gathers at these points, at most `max` at once.
fn gathered(
    gather: &mut TracedGather,
    field: &RadiosityField,
    points: &[GatherPoint],
    max: u32,
) -> Vec<IrradianceSample> {
    let traced: Vec<TracedPoint> = points.iter().map(|p| gather.traced_point(p)).collect();
    let buffers = gather.gpu.tracing.field(&gather.scene, field, || gather.gpu.memory()).unwrap();
    gather.gather_all(&buffers, &traced, max).unwrap()
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn gathers_have_the_same_bits_in_any_batches() {
    let gpu = gpu();
    for (name, mesh) in gathered_scenes() {
        let (corners, reflected) = random_radiosity(&mesh);
        let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &reflected };
        let new =
            || TracedGather::with_noise(&gpu, &mesh, 64, 0.05, 0.1).unwrap().with_near_field();
        // More batches of 64 than are in flight at once.
        let points = gather_points(&mesh, 200);
        let mut gather = new();
        let all = gather.gather(&field, &points).unwrap();
        assert!(all.iter().any(|sample| sample.noise > 0.0));
        for max in [MAX_POINTS, 64, 23] {
            let again = gathered(&mut gather, &field, &points, max);
            assert!(again == all, "{name}: {max} at once");
        }
        assert!(new().gather(&field, &points).unwrap() == all, "{name}: another gather");
        for k in (0..200).step_by(41) {
            let alone = gather.gather(&field, &points[k..=k]).unwrap();
            assert_eq!(alone, [all[k]], "{name}: point {k} alone");
        }
    }
}

/// More rays than in one pass: passes add up to the result of one, except for the order of sums.
#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn many_rays_are_cast_in_several_passes() {
    let (gpu, mesh) = (gpu(), under_sky_and_sun());
    let (corners, reflected) = random_radiosity(&mesh);
    let field = RadiosityField { mesh: &mesh, corners: &corners, reflected: &reflected };
    let points = gather_points(&mesh, 5);
    let few = TracedGather::new(&gpu, &mesh, PASS_RAYS).unwrap().gather(&field, &points).unwrap();
    let mut gather = TracedGather::new(&gpu, &mesh, 16 * PASS_RAYS).unwrap();
    let many = gather.gather(&field, &points).unwrap();
    assert_eq!(gather.rays(), 5 * u64::from(16 * PASS_RAYS + 4 * PASS_RAYS));
    for (a, b) in few.iter().zip(&many) {
        // Standard error of stratified samples: less than that of independent ones, 1/√n each.
        let limit = 4.0 / f64::from(PASS_RAYS).sqrt() * b.irradiance.length();
        assert!(a.irradiance.distance(b.irradiance) <= limit, "{a:?}, not {b:?}");
    }
}
