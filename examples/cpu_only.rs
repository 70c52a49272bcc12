//! Lesson 3 of 9: no graphics device. Rays on the CPU make the form factors; without the feature
//! `gpu` the crate does not depend on wgpu.
//!
//!     cargo run --release --no-default-features --example cpu_only

use std::ops::ControlFlow;

use radiosity::{Backend, BakeSettings, Error, Material, Rgb, Scene, Triangle};

fn main() -> Result<(), Error> {
    let scene = plates()?;
    let settings = BakeSettings::elements_only(&scene); // fixed settings; no vertex gathers
    let baked = settings.bake(scene, &Backend::Cpu, |_| ControlFlow::Continue(()))?;
    let surface = &baked.light.surface;
    for (position, radiosity) in surface.positions.iter().zip(&surface.radiosity).step_by(50) {
        println!("{position:.3}: {radiosity:.3} W/m²");
    }
    let ledger = baked.solution.ledger;
    println!("emitted {:.2} W, absorbed {:.3} W", ledger.emitted.x, ledger.absorbed.x);
    Ok(())
}

/// A scene without a file: a square lamp of 100 W/m² one metre above a grey square.
fn plates() -> Result<Scene, Error> {
    let corner = |x: f64, y: f64, z: f64| glam::DVec3::new(x, y, z);
    let square = |z| [corner(0., 0., z), corner(1., 0., z), corner(1., 1., z), corner(0., 1., z)];
    let positions = [square(0.0), square(1.0)].concat();
    let triangle = |corners, k| Triangle { corners, group: k, material: k, smoothing: None };
    let triangles = vec![
        triangle([0, 1, 2], 0), // counter-clockwise from above: the front is up
        triangle([0, 2, 3], 0),
        triangle([4, 6, 5], 1), // the front is down
        triangle([4, 7, 6], 1),
    ];
    let lamp = Material { exitance: Rgb::splat(100.0), ..Material::grey("lamp", 0.0) };
    let groups = vec!["floor".into(), "lamp".into()];
    Scene::new(positions, triangles, groups, vec![Material::grey("grey", 0.5), lamp])
}
