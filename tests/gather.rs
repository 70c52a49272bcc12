//! Gathering with hemicubes: against closed forms, against rays, and against itself.

mod common;

use common::{cornell_box, cube, gpu};
use glam::DVec3;
use radiosity::{
    Gather, Gathered, Gpu, HemicubeGather, Material, Mesh, Place, RayGather, Rgb, Scene, Sources,
    Triangle,
};

/// Settled light by its value at every point.
struct Light {
    mesh: Mesh,
    corners: Vec<[u32; 3]>,
    reflected: Vec<Rgb>,
}

impl Light {
    /// `value` of triangle and point, W/m².
    fn new(mesh: Mesh, value: impl Fn(usize, DVec3) -> Rgb) -> Light {
        let (mut corners, mut reflected) = (vec![], vec![]);
        for e in 0..mesh.element_count() {
            let (node, first) = (mesh.element(e), reflected.len() as u32);
            corners.push([first, first + 1, first + 2]);
            reflected.extend(mesh.corners(node).map(|p| value(mesh.triangle(node), p)));
        }
        Light { mesh, corners, reflected }
    }

    fn sources(&self) -> Sources<'_> {
        Sources { mesh: &self.mesh, corners: &self.corners, reflected: &self.reflected }
    }

    fn gather(&self, gpu: &Gpu, n: u32, places: &[Place]) -> Vec<Gathered> {
        let mut gather = HemicubeGather::new(gpu, &self.mesh, n).unwrap();
        gather.gather(&self.sources(), places).unwrap()
    }

    /// Places just over the middle of elements, `count` of them all over the scene.
    fn places(&self, count: usize, above: f64) -> Vec<Place> {
        let place = |k: usize| {
            let node = self.mesh.element(k * 7919 % self.mesh.element_count());
            let normal = self.mesh.normal(node);
            let position = self.mesh.centroid(node) + normal * above;
            Place { position, normal, near: above }
        };
        (0..count).map(place).collect()
    }
}

#[test]
fn hemicubes_agree_with_rays() {
    let Some(gpu) = gpu() else { return };
    let light = Light::new(cornell_box(60.0), |t, p| {
        Rgb::new(1.0 + p.x / 600.0, 1.0 + p.y / 600.0, 1.0 + (t % 7) as f64 / 7.0)
    });
    let places = light.places(64, 0.01);
    let got = light.gather(&gpu, 128, &places);
    let mut rays = RayGather::new(&light.mesh, 1 << 15).unwrap();
    let want = rays.gather(&light.sources(), &places).unwrap();
    for ((place, got), want) in places.iter().zip(&got).zip(&want) {
        let indirect = |g: &Gathered| g.irradiance - g.direct;
        // Values differ by up to 2 between neighbours; outlines of some 10 half faces are crossed by
        // 900 pixels that err independently, 3e-5 of weight each: 1e-3 by itself, six times that.
        let error = (indirect(got) - indirect(&want)).abs().max_element();
        assert!(error < 6e-3 * 2.0, "{place:?}: {error}");
        let error = (got.direct - want.direct).abs().max_element();
        assert!(error <= 0.01 * want.irradiance.max_element(), "{place:?}: {error}");
        assert!((got.open - want.open).abs() < 2e-3, "{place:?}");
        assert!((got.back - want.back).abs() < 2e-3, "{place:?}");
        assert!((got.nearness / want.nearness - 1.0).abs() < 5e-3, "{place:?}");
    }
}

#[test]
fn a_furnace_is_as_bright_as_its_walls() {
    let Some(gpu) = gpu() else { return };
    // One material and shared corners: the walls are one light, which surrounds every place.
    let cube = cube(&Material::grey("furnace", 0.5));
    let mut material = cube.materials()[0].clone();
    material.exitance = Rgb::ONE;
    let one = |t: &Triangle| Triangle { material: 0, ..*t };
    let triangles = cube.triangles().iter().map(one).collect();
    let groups = cube.groups().to_vec();
    let cube = Scene::new(cube.positions().to_vec(), triangles, groups, vec![material]).unwrap();
    let light = Light::new(Mesh::new(cube, 0.2).unwrap(), |_, _| Rgb::ONE);
    for g in light.gather(&gpu, 64, &light.places(50, 1e-4)) {
        assert!((g.irradiance - 2.0).abs().max_element() < 2e-5, "{g:?}");
        assert_eq!((g.open, g.back), (0.0, 0.0));
    }
}
