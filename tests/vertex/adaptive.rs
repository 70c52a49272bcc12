//! Gathering at vertices: where it splits, what it finds, and that nothing comes apart. No GPU
//! needed: irradiance is made up, has a closed form, or is found with rays.

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::backend::cpu::RayGather;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{
    GatherPoint, IrradianceSample, Progress as GatherProgress, RadiosityField, RefinementSettings,
    gather_at_vertices,
};
use radiosity::solver::StopReason;
use radiosity::{Error, ErrorKind, Gather, GatheredMesh, Material, Mesh, Rgb, VertexMesh};

use crate::common::scenes::{Quad, facing_down, facing_up, grey, lamp, standing_block};
use crate::common::surface::{assert_watertight, assert_whole};
use crate::common::{cube, keep_going, quads};

/// Gathers what a function of the sources and the place says arrives, W/m².
struct Known<F>(F);

impl<F: FnMut(&RadiosityField, &GatherPoint) -> f64> Gather for Known<F> {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let mut at = |p: &GatherPoint| Rgb::splat((self.0)(sources, p));
        let gathered =
            places.iter().map(|p| IrradianceSample { irradiance: at(p), ..Default::default() });
        Ok(gathered.collect())
    }
}

/// The light of elements, one value each, W/m².
fn shot(mesh: &Mesh, radiosity: &[Rgb]) -> GatheredMesh {
    GatheredMesh::from_elements(mesh, radiosity).unwrap()
}

/// In [0, 1), by the bits of a place.
fn random(p: DVec3) -> f64 {
    let mix =
        |h: u64, x: f64| (h ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    let bits = p.to_array().into_iter().fold(1, mix).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

fn longest(mesh: &Mesh, e: usize) -> f64 {
    let [a, b, c] = mesh.corners(mesh.element(e));
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}

fn sizes(mesh: &Mesh) -> (f64, f64) {
    let all = (0..mesh.element_count()).map(|e| longest(mesh, e));
    all.fold((f64::INFINITY, 0.0), |(least, most), l| (l.min(least), l.max(most)))
}

#[test]
fn unequal_depths_leave_no_cracks() {
    let room = cube(&grey());
    let furnished: Vec<(Quad, Material)> = (0..6)
        .map(|k| [0, 1, 2, 3].map(|c| room.positions()[4 * k + c].to_array()))
        .chain(standing_block([0.3, 0.6], [0.2, 0.5], 0.0, 0.45))
        .map(|q| (q, grey()))
        .collect();
    for scene in [room, quads(&furnished)] {
        let mut mesh = Mesh::new(scene, 0.8).unwrap();
        for _ in 0..2 {
            let middle = |e: usize| mesh.centroid(mesh.element(e));
            let some = (0..mesh.element_count()).filter(|&e| random(middle(e)) < 0.3);
            mesh = mesh.split(&some.collect::<Vec<_>>()).unwrap();
        }
        let dark = vec![Rgb::ZERO; mesh.element_count()];
        // One place in 25 is brighter than the others, and elements are split around it.
        let mut spots = Known(|_: &RadiosityField, p: &GatherPoint| {
            1.0 + f64::from(random(p.position) < 0.04) * random(-p.position)
        });
        let settings = RefinementSettings { mesh_error: 0.005, ..RefinementSettings::new(0.08) };
        let found =
            gather_at_vertices(&shot(&mesh, &dark), &mesh, &settings, &mut spots, keep_going)
                .unwrap();
        let (least, most) = sizes(&found.mesh);
        println!("{} elements from {least:.3} to {most:.3}", found.mesh.element_count());
        assert!(found.stop == StopReason::Converged && most / least > 7.9, "unequal depths");
        assert!(found.mesh.element_count() > 2 * mesh.element_count());
        for surface in [&found.surface, &VertexMesh::new(&mesh, &dark)] {
            assert_eq!(surface.radiosity.len(), surface.positions.len());
            assert_eq!(surface.normals.len(), surface.positions.len());
        }
        assert_whole(&found.mesh, &found.surface);
        assert_watertight(&found.mesh, &found.surface);
        assert_watertight(&mesh, &VertexMesh::new(&mesh, &dark));
    }
}

#[test]
fn cornell_box_is_as_watertight_as_scene() {
    let mesh = crate::common::cornell_box(70.0).split_at_contacts(3);
    let dark = vec![Rgb::ZERO; mesh.element_count()];
    assert_watertight(&mesh, &VertexMesh::new(&mesh, &dark));
    let mut even = Known(|_: &RadiosityField, p: &GatherPoint| 1.0 + random(p.position));
    let settings = RefinementSettings {
        mesh_error: 0.2,
        max_elements: 40_000,
        ..RefinementSettings::new(3.0)
    };
    let found =
        gather_at_vertices(&shot(&mesh, &dark), &mesh, &settings, &mut even, keep_going).unwrap();
    assert!(found.mesh.element_count() > 2 * mesh.element_count());
    assert_watertight(&found.mesh, &found.surface);
}

/// What arrives at a place in a convex room that nothing stands in, elements being as bright as the
/// mean of their corners.
fn convex_room(sources: &RadiosityField, place: &GatherPoint) -> f64 {
    let arrives = |e: usize| {
        let node = sources.mesh.element(e);
        let reflected = sources.corners[e].iter().map(|&v| sources.reflected[v as usize].x);
        let leaves = sources.mesh.material(node).exitance.x + reflected.sum::<f64>() / 3.0;
        leaves * point_to_polygon(place.position, place.normal, &sources.mesh.corners(node))
    };
    (0..sources.mesh.element_count()).map(arrives).sum()
}

/// Area-weighted sum of a surface's radiosity.
fn flux(s: &VertexMesh) -> f64 {
    let of = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| s.positions[v as usize]);
        let mean = f.iter().map(|&v| s.radiosity[v as usize].x).sum::<f64>() / 3.0;
        mean * (b - a).cross(c - a).length() / 2.0
    };
    s.faces.iter().map(of).sum()
}

#[test]
fn furnace_is_a_fixed_point() {
    for reflectance in [0.5, 0.8] {
        let glow = Material { exitance: Rgb::ONE, ..Material::grey("glow", reflectance) };
        let mesh = Mesh::new(cube(&glow), 0.8).unwrap();
        let even = 1.0 / (1.0 - reflectance);
        let settled = vec![Rgb::splat(even); mesh.element_count()];
        let settings = RefinementSettings::new(0.01);
        let mut rays = RayGather::new(&mesh, 64).unwrap();
        let (exact, seen): (_, &mut dyn Gather) = (&mut Known(convex_room), &mut rays);
        for gather in [exact, seen] {
            let found =
                gather_at_vertices(&shot(&mesh, &settled), &mesh, &settings, gather, keep_going)
                    .unwrap();
            assert_eq!(found.stop, StopReason::Converged);
            // Walls are lights of their own here, which rays find by closed forms too, all of each
            // visible. Those are good to 1e-14 each, edge on too; they are as many as elements.
            let bound = 1e-14 * mesh.element_count() as f64 * even;
            let off =
                found.surface.radiosity.iter().map(|b| (b.x - even).abs()).fold(0.0, f64::max);
            assert!(off <= bound, "{off}");
            assert_eq!(found.mesh.element_count(), mesh.element_count(), "nothing to split for");
            assert!(found.relative_change <= bound / (even - 1.0), "{}", found.relative_change);
            // A gather creates no energy.
            let before = flux(&VertexMesh::new(&mesh, &settled));
            assert!((before - 6.0 * even).abs() < 6.0 * bound);
            assert!((flux(&found.surface) - before).abs() < 6.0 * bound);
        }
    }
}

/// Half the width of a lamp at height 6, in both directions.
const LAMP: f64 = 0.2;

/// Irradiance on a floor at height 0 under that lamp, of which an edge at x = 0 and half the height
/// hides what is beyond: from x the lamp is seen from −x on.
fn half_hidden(p: DVec3) -> f64 {
    let from = (-p.x).clamp(-LAMP, LAMP);
    let seen = facing_down([from, LAMP], [-LAMP, LAMP], 6.0).map(DVec3::from_array);
    point_to_polygon(p, DVec3::Z, &seen)
}

/// The floor, on a lattice of ¼ that the penumbra, |x| < 0.2, is not symmetric on; and its light.
fn floor() -> (Mesh, Vec<Rgb>) {
    let mesh =
        Mesh::new(quads(&[(facing_up([-0.95, 1.05], [-1.0, 1.0], 0.0), grey())]), 0.36).unwrap();
    let at = |e: usize| Rgb::splat(0.5 * half_hidden(mesh.centroid(mesh.element(e))));
    let light = (0..mesh.element_count()).map(at).collect();
    (mesh, light)
}

fn at_the_edge(settings: &RefinementSettings) -> GatheredMesh {
    let (mesh, light) = floor();
    let mut gather = Known(|_: &RadiosityField, p: &GatherPoint| half_hidden(p.position));
    gather_at_vertices(&shot(&mesh, &light), &mesh, settings, &mut gather, keep_going).unwrap()
}

/// Interpolated radiosity at `p` of a floor, and the element it is in.
fn at(surface: &VertexMesh, p: DVec3) -> (f64, usize) {
    for (face, &e) in surface.faces.iter().zip(&surface.elements) {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let cross = |p: DVec3, q: DVec3| p.cross(q).z / (b - a).cross(c - a).z;
        let (u, v) = (cross(p - a, c - a), cross(b - a, p - a));
        if u.min(v).min(1.0 - u - v) >= -1e-12 {
            let [x, y, z] = face.map(|v| surface.radiosity[v as usize].x);
            return (x * (1.0 - u - v) + y * u + z * v, e as usize);
        }
    }
    panic!("no face at {p}");
}

#[test]
fn splits_only_at_the_shadow() {
    let brightest = 0.5 * half_hidden(DVec3::new(0.2, 0.0, 0.0));
    let (base, _) = floor();
    let largest = sizes(&base).1;
    let mut rms = vec![];
    for tolerance in [0.05, 0.01] {
        let settings =
            RefinementSettings { mesh_error: tolerance, ..RefinementSettings::new(0.005) };
        let found = at_the_edge(&settings);
        assert_eq!(found.stop, StopReason::Converged);
        let mut in_the_light = 0;
        for e in 0..found.mesh.element_count() {
            // Elements are judged with their parents, ½ wide here. In the light the irradiance goes
            // as (1 + (r/6)²)⁻²: over sides of √½ its middle is off by 4/6²·½/8 = 0.7 %, over ½ by
            // half of that, and an element by √(4/45 (0.7² + 2·0.35² + 1.4²)) = 0.5 %. By its area
            // this is more than what hundreds of elements at the shadow have each, so that a few
            // are split, once.
            let x = found.mesh.centroid(found.mesh.element(e)).x;
            let longest = longest(&found.mesh, e);
            in_the_light += u32::from(x.abs() >= LAMP + 0.5 && longest < 0.9 * largest);
            assert!(x.abs() < LAMP + 0.5 || longest > 0.45 * largest, "split at {x}");
        }
        let all = found.mesh.element_count() as u32;
        assert!(in_the_light < all / 8, "{in_the_light} of {all} in the light");
        let mut squares = 0.0;
        for k in 0..2000 {
            let seed = DVec3::new(f64::from(k), 1.0, 2.0);
            let p = DVec3::new(-0.95 + 2.0 * random(seed), -1.0 + 2.0 * random(-seed), 0.0);
            let (got, _) = at(&found.surface, p);
            let off = (got - 0.5 * half_hidden(p)).abs();
            squares += off * off;
        }
        rms.push((squares / 2000.0f64).sqrt() / brightest);
        // It is predicted from corners, between which nobody looks: by half of it, at most.
        assert!(rms[rms.len() - 1] < 1.5 * tolerance, "{rms:?}");
        println!(
            "{} elements, off by {:.5} of the brightest",
            found.mesh.element_count(),
            rms[rms.len() - 1]
        );
    }
    // A fifth of the one, which the first mesh is well below already: less than half of it.
    assert!(rms[1] < rms[0] / 1.5, "{rms:?}");
}

/// Where light is a parabola, a vertex that follows it without a look is as good as one that looks.
#[test]
fn interpolated_vertices_lie_on_parabola() {
    let (mesh, radiosity) = floor();
    let light = shot(&mesh, &radiosity);
    let curved =
        |p: DVec3| 10.0 + 0.3 * p.x - p.y + 0.7 * p.x * p.x - 1.1 * p.x * p.y + 0.4 * p.y * p.y;
    // Vertices stand a little off where they belong: on a lattice of 1/16 after two splits.
    let lattice = |x: f64, origin: f64| ((x - origin) * 16.0).round() / 16.0 + origin;
    let belongs = |p: DVec3| DVec3::new(lattice(p.x, -0.95), lattice(p.y, -1.0), 0.0);
    let mut asked = 0;
    let mut gather = |settings: &RefinementSettings| {
        asked = 0;
        let mut known = Known(|_: &RadiosityField, place: &GatherPoint| {
            asked += 1;
            curved(belongs(place.position))
        });
        let found = gather_at_vertices(&light, &mesh, settings, &mut known, keep_going).unwrap();
        (found, asked)
    };
    let plain = RefinementSettings {
        mesh_error: 1.0,
        initial_subdivisions: 2,
        ..RefinementSettings::new(1e-9)
    };
    let (flat, looks) =
        gather(&RefinementSettings { interpolation_tolerance: f64::INFINITY, ..plain.clone() });
    let (found, others) = gather(&RefinementSettings { interpolation_tolerance: 1e-12, ..plain });
    assert_eq!(looks, others, "nobody looks for it");
    let ratio = found.mesh.element_count() as f64 / flat.mesh.element_count() as f64;
    assert!(ratio > 3.9, "all that gathers is split once more: {ratio}");
    // Exact but for rounding, of values up to 7.
    let count = found.surface.positions.len();
    assert!(count > 4 * flat.surface.positions.len() - 200, "{count}");
    for (p, b) in found.surface.positions.iter().zip(&found.surface.radiosity) {
        assert!((b.x - 0.5 * curved(*p)).abs() < 1e-13, "{p}: {b}");
    }
}

#[test]
fn settings_bound_count_and_size() {
    let (base, _) = floor();
    let fine = RefinementSettings {
        mesh_error: 1e-5,
        interpolation_tolerance: f64::INFINITY,
        // None is split whose longest edge is an eighth of it.
        ..RefinementSettings::new(0.16)
    };
    let (found, largest) = (at_the_edge(&fine), sizes(&base).1);
    // What is above the smallest size is split in two along its edges.
    let (least, most) = sizes(&found.mesh);
    assert!(least > 0.02 / 2.0 && least <= 0.02, "{least}");
    assert!(most <= largest);
    // Each at least once; what was wrong or has grown stale, again.
    let all = places(&found);
    assert!(
        (all..2 * all).contains(&(found.gather_count as usize)),
        "{} {all}",
        found.gather_count
    );
    let few = at_the_edge(&RefinementSettings {
        max_elements: base.element_count() + 100,
        ..fine.clone()
    });
    assert_eq!(few.stop, StopReason::Elements);
    let count = few.mesh.element_count() - base.element_count();
    assert!(count <= 100 && count > 90, "{count}");
    assert_whole(&few.mesh, &few.surface);
    // No room at all.
    let none = at_the_edge(&RefinementSettings { max_elements: 0, ..fine.clone() });
    assert_eq!(
        (none.stop, none.mesh.element_count()),
        (StopReason::Elements, base.element_count())
    );
    let all = RefinementSettings { mesh_error: 1.0, initial_subdivisions: 1, ..fine };
    let all = at_the_edge(&all);
    let quarters = 0..4 * base.element_count();
    assert_eq!(all.mesh.element_count(), quarters.len());
    let whole = |e| (longest(&all.mesh, e) - largest / 2.0).abs() < 1e-12;
    assert!(quarters.into_iter().all(whole));
}

/// Vertices of the elements' corners: all but the middles of fans.
fn places(found: &GatheredMesh) -> usize {
    let mut corners: Vec<[u64; 3]> = (0..found.mesh.element_count())
        .flat_map(|e| found.mesh.corners(found.mesh.element(e)))
        .map(|p| ((p + 2.0).as_vec3() * 1e4).to_array().map(|x| x.round() as u64))
        .collect();
    corners.sort_unstable();
    corners.dedup();
    corners.len()
}

/// Where a box stands on the floor: off the lattice.
const FOOT: [f64; 2] = [-0.33, 0.29];

#[test]
fn no_darkness_leaks_from_under_block() {
    let bottom = facing_down(FOOT, FOOT, 0.0);
    let lamp_at = facing_down([1.0, 1.6], [-0.3, 0.3], 3.0);
    // Lower than elements are long, and higher, so that its inside is roomy for most of them.
    for (height, bottom) in [(0.05, None), (0.05, Some(bottom)), (0.5, None), (0.5, Some(bottom))] {
        let stands = standing_block(FOOT, FOOT, 0.0, height).into_iter().chain(bottom);
        let mut all =
            vec![(facing_up([-1., 1.], [-1., 1.], 0.0), grey()), (lamp_at, lamp([1.0; 3]))];
        all.extend(stands.map(|q| (q, Material::grey("black", 0.0))));
        let mesh = Mesh::new(quads(&all), 0.36).unwrap().split_at_contacts(3);
        let light = vec![Rgb::ZERO; mesh.element_count()];
        let mut rays = RayGather::new(&mesh, 256).unwrap();
        let settings = RefinementSettings { max_elements: 3000, ..RefinementSettings::new(0.04) };
        let found =
            gather_at_vertices(&shot(&mesh, &light), &mesh, &settings, &mut rays, keep_going)
                .unwrap();
        for k in 0..60 {
            // Before the wall that faces the lamp nothing hides it, and the light is even: on the
            // elements that the wall stands on, too, it is what is gathered at the point directly,
            // but for what sides may bend.
            let (away, along) = (0.001 * f64::from(k + 1), f64::from(k * 7 % 60) / 60.0);
            let p = DVec3::new(FOOT[1] + away, -0.25 + 0.5 * along, 0.0);
            let arrives = point_to_polygon(p, DVec3::Z, &lamp_at.map(DVec3::from_array));
            let off = at(&found.surface, p).0 / (0.5 * arrives) - 1.0;
            assert!(off.abs() < settings.mesh_error, "height {height}: {off} at {p}");
        }
    }
}

#[test]
fn sweeps_gather_from_previous_sweep() {
    // Light from nowhere is taken for half of what is known: reflectance ½, no emission, so that
    // the light of each sweep is half of the last one's.
    let mesh = Mesh::new(cube(&grey()), 0.8).unwrap();
    let fine = Mesh::new(mesh.scene().clone(), 0.2).unwrap();
    let light = shot(&fine, &vec![Rgb::ONE; fine.element_count()]);
    for sweeps in [1, 2, 3] {
        let mut told = vec![];
        let mut gather = Known(|s: &RadiosityField, p: &GatherPoint| convex_room(s, p));
        let settings =
            RefinementSettings { gather_passes: sweeps, ..RefinementSettings::new(0.01) };
        let found = gather_at_vertices(&light, &mesh, &settings, &mut gather, |p| {
            told.push(p.pass);
            ControlFlow::Continue(())
        });
        let (found, want) = (found.unwrap(), 0.5f64.powi(sweeps as i32));
        told.dedup();
        assert_eq!(told, (0..sweeps).collect::<Vec<_>>());
        // Closed forms are good to 1e-14 each, and there are as many as elements.
        let off = found.surface.radiosity.iter().map(|b| (b.x - want).abs()).fold(0.0, f64::max);
        assert!(off < 1e-14 * fine.element_count() as f64, "{sweeps}: {off}");
        assert!((found.relative_change - 1.0).abs() < 1e-9, "half of it is as much as is left");
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    let material = Material { exitance: Rgb::new(1.0, 0.5, 0.0), ..grey() };
    let mut walls: Vec<(Quad, Material)> =
        standing_block([0.2, 0.5], [0.3, 0.6], 0.0, 0.4).into_iter().map(|q| (q, grey())).collect();
    walls.push((facing_up([0.0, 1.0], [0.0, 1.0], 0.0), grey()));
    walls.push((facing_down([0.0, 1.0], [0.0, 1.0], 1.0), material));
    let mesh = Mesh::new(quads(&walls), 0.3).unwrap();
    let light = vec![Rgb::ONE; mesh.element_count()];
    let [one, two] = [0, 1].map(|_| {
        let mut rays = RayGather::new(&mesh, 64).unwrap();
        gather_at_vertices(
            &shot(&mesh, &light),
            &mesh,
            &RefinementSettings::new(0.1),
            &mut rays,
            keep_going,
        )
        .unwrap()
    });
    assert!(one.mesh.element_count() > mesh.element_count());
    assert!(one.surface.radiosity == two.surface.radiosity);
    assert!(one.surface.positions == two.surface.positions);
    assert!(one.surface.normals == two.surface.normals);
    assert!(
        (&one.surface.faces, &one.surface.elements) == (&two.surface.faces, &two.surface.elements)
    );
    assert_eq!(
        (one.gather_count, one.relative_change, one.stop),
        (two.gather_count, two.relative_change, two.stop)
    );
}

#[test]
fn cancelled_gather_keeps_what_was_reached() {
    let (mesh, light) = floor();
    for stop_at in [0, 1, 2] {
        let mut told: Vec<GatherProgress> = vec![];
        let mut gather = Known(|_: &RadiosityField, p: &GatherPoint| half_hidden(p.position));
        let found = gather_at_vertices(
            &shot(&mesh, &light),
            &mesh,
            &RefinementSettings::new(0.01),
            &mut gather,
            |p| {
                told.push(*p);
                if p.refinements == stop_at {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        );
        let (found, last) = (found.unwrap(), told[told.len() - 1]);
        assert_eq!(
            (found.stop, last.refinements, told.len() as u32),
            (StopReason::Cancelled, stop_at, stop_at + 1)
        );
        assert_eq!(found.mesh.element_count(), last.elements);
        assert!(told.iter().all(|p| p.gathered == p.total && p.total > 0), "one batch a level");
        assert_eq!(found.gather_count as usize, told.iter().map(|p| p.gathered).sum::<usize>());
        assert_whole(&found.mesh, &found.surface);
    }
}

#[test]
fn rejects_settings_out_of_range() {
    let (mesh, values) = floor();
    let light = shot(&mesh, &values);
    let refused = |settings: RefinementSettings, light: &GatheredMesh| {
        let mut never = Known(|_: &RadiosityField, _: &GatherPoint| unreachable!());
        let error =
            gather_at_vertices(light, &mesh, &settings, &mut never, keep_going).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
    };
    let good = RefinementSettings::new(0.1);
    for tolerance in [0.0, -0.1, 1.1, f64::NAN] {
        refused(RefinementSettings { mesh_error: tolerance, ..good.clone() }, &light);
    }
    for smallest in [0.0, -1.0, f64::NAN] {
        refused(RefinementSettings { min_edge: smallest, ..good.clone() }, &light);
    }
    let elsewhere = Mesh::new(cube(&grey()), 1.0).unwrap();
    refused(good, &shot(&elsewhere, &vec![Rgb::ONE; elsewhere.element_count()]));
    for few in [&values[1..], &[]] {
        let error = GatheredMesh::from_elements(&mesh, few).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
    }
}

#[test]
fn a_beam_between_corners_is_found() {
    // A bright spot in an otherwise even floor, half-way between corners of its two elements.
    let corners = facing_up([0.0, 10.0], [0.0, 10.0], 0.0);
    let mesh = Mesh::new(quads(&[(corners, grey())]), 1e3).unwrap();
    let dark = vec![Rgb::ZERO; mesh.element_count()];
    let beam = |p: &GatherPoint| p.position.truncate().distance([5.0, 0.3].into()) < 1.0;
    let mut light = Known(|_: &RadiosityField, p: &GatherPoint| if beam(p) { 9.0 } else { 1.0 });
    let mut brightest = |min_edge: f64| {
        let settings = RefinementSettings::new(min_edge);
        let found =
            gather_at_vertices(&shot(&mesh, &dark), &mesh, &settings, &mut light, keep_going);
        let radiosity = found.unwrap().surface.radiosity;
        radiosity.iter().map(|b| b.x).fold(0.0, f64::max) / grey().reflectance.x
    };
    // Elements of 14: where 4 is the shortest edge their corners are believed; where it is 1, their
    // parts are looked at.
    assert!(brightest(4.0) < 1.5);
    assert!(brightest(1.0) > 8.0);
}
