//! Surfaces that a scene has once for each side, in one place: whoever looks sees a front.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::backend::cpu::{RayGather, RayRows};
use radiosity::backend::gpu::{HemicubeRows, TracedGather, TracedRows};
use radiosity::mesh::NodeId;
use radiosity::{
    Backend, BakeTarget, Camera, FormFactors, Gather, GatheredMesh, Material, Mesh, Rgb, Scene,
};

use crate::common::fakes::GivenRadiosity;
use crate::common::scenes::{facing_up, grey, lamp, walls};
use crate::common::{gpu, keep_counting, keep_going, quads};

/// A table leaf in a closed room with this ceiling: once for each side, `apart` from one another,
/// the lower one cut along the other diagonal.
fn room(apart: f64, ceiling: Material) -> Scene {
    let material = |k: usize| if k == 5 { ceiling.clone() } else { grey() };
    let walls =
        walls([0.0; 3], [1.0; 3]).into_iter().enumerate().map(|(k, quad)| (quad, material(k)));
    let table = facing_up([0.3, 0.7], [0.25, 0.75], 0.4);
    let [a, b, c, d] = table.map(|[x, y, z]| [x, y, z - apart]);
    quads(&walls.chain([(table, grey()), ([d, c, b, a], grey())]).collect::<Vec<_>>())
}

fn check_rows(mut rows: impl FormFactors, mesh: &Mesh) {
    let patches: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    for (row, &patch) in rows.rows(mesh, &patches, 1.0).unwrap().iter().zip(&patches) {
        assert_eq!((row.escaped, row.backface), (0, 0), "from {}", mesh.centroid(patch));
    }
}

fn check_gather(mut gather: impl Gather, light: &GivenRadiosity) {
    // All that reflects shines alike.
    let places = light.places(100, 1e-4);
    for (found, place) in gather.gather(&light.sources(), &places).unwrap().iter().zip(&places) {
        assert_eq!((found.escaped, found.backface), (0.0, 0.0), "{place:?}");
        assert!(found.irradiance.abs_diff_eq(Rgb::ONE, 2e-5), "{place:?}: {}", found.irradiance);
    }
}

fn even_light() -> GivenRadiosity {
    GivenRadiosity::new(Mesh::new(room(0.0, grey()), 0.2).unwrap(), |_, _| Rgb::ONE)
}

#[test]
fn rays_meet_fronts() {
    let light = even_light();
    check_rows(RayRows::new(&light.mesh, 4096).unwrap(), &light.mesh);
    check_gather(RayGather::new(&light.mesh, 4096).unwrap(), &light);
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn devices_meet_fronts() {
    let (light, gpu) = (even_light(), gpu());
    check_rows(HemicubeRows::new(&gpu, &light.mesh, 64).unwrap(), &light.mesh);
    check_rows(TracedRows::new(&gpu, &light.mesh, 4096).unwrap(), &light.mesh);
    check_gather(TracedGather::new(&gpu, &light.mesh, 4096).unwrap(), &light);
}

#[test]
fn pictures_show_fronts() {
    let mesh = Mesh::new(room(0.0, grey()), 0.1).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]).unwrap();
    // From above the leaf, and from below it.
    for z in [0.9, 0.1] {
        let (eye, target) = (DVec3::new(0.1, 0.2, z), DVec3::new(0.5, 0.5, 0.4));
        let camera = Camera { eye, target, up: DVec3::Z, vertical_fov: 60.0 };
        let image = camera.interpolated_image(&light, 64, 64, 1, keep_counting).unwrap().unwrap();
        let even = |pixel: &Rgb| pixel.abs_diff_eq(Rgb::splat(1.0 / PI), 1e-9);
        assert!(image.pixels.iter().all(even), "from {z}");
    }
}

/// The same light as where the two sides are a hundred-thousandth of the room apart.
#[test]
fn light_is_that_of_a_thin_plate() {
    let light = |apart: f64| {
        let baked = BakeTarget::Error(0.02)
            .bake(room(apart, lamp([5.0, 4.0, 3.0])), &Backend::Cpu, keep_going)
            .unwrap();
        assert!(apart > 0.0 || baked.solution.ledger.backface_loss == Rgb::ZERO);
        let mesh = &baked.light.mesh;
        let mut flux = [Rgb::ZERO; 2];
        for (face, &e) in baked.light.surface.faces.iter().zip(&baked.light.surface.elements) {
            let t = mesh.triangle(mesh.element(e as usize));
            if let Some(side) = (mesh.scene().triangles()[t].group as usize).checked_sub(6) {
                let [a, b, c] = face.map(|v| baked.light.surface.positions[v as usize]);
                let values = face.map(|v| baked.light.surface.radiosity[v as usize]);
                flux[side] += values.iter().sum::<Rgb>() / 6.0 * (b - a).cross(c - a).length();
            }
        }
        flux
    };
    for (found, wanted) in light(0.0).into_iter().zip(light(1e-5)) {
        // Both to 2 % at a place, and far better on the whole.
        assert!((found / wanted - 1.0).abs().max_element() < 0.01, "{found} {wanted}");
    }
}
