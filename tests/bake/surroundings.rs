//! What stands around a scene changes its light by no more than the light that it adds.

use glam::{DVec3, dvec3};
use radiosity::bake::Outcome;
use radiosity::verify::PathTracer;
use radiosity::{Backend, BakeResult, BakeTarget, Material, Rgb, Scene, Triangle};

use crate::common::{cornell_box, keep_counting, keep_going, truth};

/// Triangles of one more material, in a group of its own.
struct Addition {
    name: &'static str,
    material: Material,
    positions: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

/// `scene` with more in it.
fn with(scene: &Scene, addition: &Addition) -> Scene {
    let mut positions = scene.positions().to_vec();
    let mut triangles = scene.triangles().to_vec();
    let mut groups = scene.groups().to_vec();
    let mut materials = scene.materials().to_vec();
    let first = positions.len() as u32;
    positions.extend(&addition.positions);
    let (group, material) = (groups.len() as u32, materials.len() as u32);
    triangles.extend(addition.faces.iter().map(|face| Triangle {
        corners: face.map(|k| first + k),
        group,
        material,
        smoothing: None,
    }));
    groups.push(addition.name.into());
    materials.push(addition.material.clone());
    Scene::new(positions, triangles, groups, materials).unwrap()
}

/// A black box around all that is nearer than `half` (scene unit), with this exitance, W/m².
fn sky(half: f64, exitance: f64) -> Addition {
    let corner = |k: u32| {
        let side = |bit: u32| if k & bit != 0 { half } else { -half };
        dvec3(side(1), side(2), side(4))
    };
    // Counter-clockwise from inside.
    let quads =
        [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
    let material = Material { exitance: Rgb::splat(exitance), ..Material::grey("sky", 0.0) };
    let faces = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Addition { name: "sky", material, positions: (0..8).map(corner).collect(), faces }
}

/// A plane that faces up, `half` wide on every side.
fn ground(half: f64, height: f64) -> Addition {
    let positions = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        .map(|[x, z]| dvec3(x * half, height, z * half));
    let faces = vec![[0, 1, 2], [0, 2, 3]];
    let material = Material::grey("ground", 0.3);
    Addition { name: "ground", material, positions: positions.to_vec(), faces }
}

fn cornell() -> Scene {
    cornell_box(f64::INFINITY).scene().clone()
}

fn bake(scene: Scene, error: f64) -> BakeResult {
    BakeTarget::Error(error).bake(scene, &Backend::Cpu, keep_going).unwrap()
}

/// Mean reflected radiosity, W/m² of all channels, over the groups of the Cornell box.
fn mean_light(baked: &BakeResult) -> f64 {
    let (mesh, light) = (&baked.light.mesh, &baked.light);
    let (mut flux, mut area) = (0.0, 0.0);
    for e in 0..mesh.element_count() {
        let node = mesh.element(e);
        let group = mesh.scene().triangles()[mesh.triangle(node)].group as usize;
        if !["ground", "sky"].contains(&mesh.scene().groups()[group].as_str()) {
            let corners = light.corners[e].map(|v| light.reflected[v as usize].element_sum());
            flux += mesh.area(node) * corners.iter().sum::<f64>() / 3.0;
            area += mesh.area(node);
        }
    }
    flux / area
}

#[test]
fn what_adds_no_light_costs_and_changes_nothing() {
    let alone = bake(cornell(), 0.05);
    // Around a room of 0.56 m in millimetres: a kilometre.
    for around in [sky(5e5, 0.0), ground(5e5, -1.0)] {
        let baked = bake(with(&cornell(), &around), 0.05);
        let (light, expected) = (mean_light(&baked), mean_light(&alone));
        // Both are off by 5 % in places at random, of which some thousand are averaged. Of the
        // light 30 % leaves by the opening, at most the half of it onto the ground, which reflects
        // 30 % of that, less than a third of it back in: at most 1.5 % of what stays. And neither
        // has all bounces: of what is left out, a fifth of their error, the half may differ.
        let added = if around.name == "ground" { 0.015 } else { 0.0 };
        let more = light / expected - 1.0;
        assert!((-0.01..added + 0.01).contains(&more), "{}: {light} {expected}", around.name);
        // What a bake costs on any machine: points that gathered and rows.
        let [cost, before] = [&baked, &alone].map(|b| b.light.gather_count + b.hemicubes);
        println!("{}: {cost} for {before}", around.name);
        // A plane has elements of its own near the room, several times those of the room, and
        // catches what leaves it: 50 700, to 5 600 of the room.
        let most = if around.name == "sky" { 1.2 } else { 10.0 };
        assert!(cost as f64 <= most * before as f64, "{}: {cost} for {before}", around.name);
        assert_eq!(baked.outcome, Outcome::Reached);
    }
}

#[test]
fn sky_of_a_black_box_lights_a_plane_evenly() {
    let plane = ground(1.0, 0.0);
    let floor = Scene::new(
        plane.positions.clone(),
        plane.faces.iter().map(|&corners| Triangle { corners, ..Default::default() }).collect(),
        vec!["floor".into()],
        vec![Material::grey("floor", 0.5)],
    )
    .unwrap();
    for half in [2.0, 1e3, 1e6] {
        let baked = bake(with(&floor, &sky(half, 1.0)), 0.05);
        // It sees nothing but sky: irradiance 1 W/m², of which half is reflected.
        let light = mean_light(&baked) / 3.0;
        assert!((light - 0.5).abs() < 1e-3, "{half}: {light}");
        assert_eq!(baked.outcome, Outcome::Reached);
        // The sky reflects nothing: it has neither error nor weight, nor more elements than it
        // must.
        assert_eq!(baked.groups.len(), 1);
        assert_eq!(baked.groups[0].area_share, 1.0);
        assert!(baked.estimate.total < 0.01, "{:?}", baked.estimate);
    }
}

#[test]
fn faint_sky_is_told_apart_from_the_lamp() {
    let alone = bake(cornell(), 0.05);
    let baked = bake(with(&cornell(), &sky(5e5, 1e-6)), 0.05);
    // The sky emits 6e6 W, a million times the lamp's share that falls on the room.
    // As above.
    assert!((mean_light(&baked) / mean_light(&alone) - 1.0).abs() < 0.01);
    assert_eq!(baked.settings.solve.gathered_materials.len(), 1);
    assert!(baked.estimate.total > 0.01 && baked.estimate.total <= 0.05, "{:?}", baked.estimate);
}

#[test]
fn each_group_meets_its_error_on_a_plane_under_a_sky() {
    let scene = with(&with(&cornell(), &ground(5e5, -1.0)), &sky(5e5, 1.0));
    let target = BakeTarget::ErrorEach(0.1);
    let baked = target.bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    // The ground and all groups of the room, which has a millionth of the area.
    assert_eq!(baked.groups.len(), cornell().groups().len() + 1);
    assert_eq!(scene.groups()[baked.groups[0].group as usize], "ground");
    for group in &baked.groups[1..] {
        assert!(group.area_share < 1e-5, "{group:?}");
        // Of 48 points, half of them where errors are likely. In a scene of 1.7 km what is within
        // 0.17 m of another surface counts as a crack: of the low block, whose errors are at its
        // foot, about two thirds. 16 ± 3.3 are left, by chance 8 or more.
        assert!(group.estimate.total <= 0.1 && group.estimate.samples >= 8, "{group:?}");
    }
}

#[test]
fn a_wide_plane_is_lit_as_it_is_right_before_a_room() {
    // Half a kilometre in the twelve levels that elements may be split would be 0.24 m, before an
    // opening of 0.55 m.
    let scene = with(&cornell(), &ground(5e5, -1.0));
    let baked = bake(scene, 0.05);
    let scene = baked.light.mesh.scene();
    let tracer = PathTracer::new(scene);
    let places = [-20.0, -50.0, -100.0, -200.0, -400.0].map(|z| dvec3(278.0, -1.0, z));
    let points = places.map(|place| tracer.locate(place, DVec3::Y).unwrap());
    let found = tracer.reflected(&points, 1 << 14, 1, keep_counting);
    for (place, found) in places.into_iter().zip(found) {
        let (told, _) = truth::at(&baked.light.surface, place, DVec3::Y).unwrap();
        let told = told - found.radiosity;
        // The error that was asked for holds in the mean: three times that at a place, and four
        // standard errors of the paths.
        let allowed = 0.15 * found.radiosity.length() + 4.0 * found.standard_error.length();
        assert!(told.length() < allowed, "{place}: {told} of {}", found.radiosity);
    }
}
