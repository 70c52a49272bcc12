//! A light map as its renderer shows it, against path-traced truth.

use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::{Backend, BakeTarget};

use crate::common::{cornell_box, keep_counting, keep_going, truth};

const TRUTH: &str = include_str!("../data/cornell_box.truth.json");

#[test]
#[ignore = "slow"]
fn light_map_is_as_exact_as_asked() {
    for error in [0.1, 0.05] {
        let scene = cornell_box(f64::INFINITY).scene().clone();
        let atlas = Atlas::new(scene, Resolution::Pixels(192), Coordinates::Auto).unwrap();
        let baked = BakeTarget::Error(error);
        let baked = baked.bake(atlas.scene().clone(), &Backend::Cpu, keep_going).unwrap();
        let map = LightMap::of_bake(atlas, &baked, &Backend::Cpu, keep_counting).unwrap().unwrap();
        let surface = map.surface().unwrap();
        let points = truth::points(TRUTH).unwrap();
        let area: Vec<_> = points.iter().filter(|p| p.kind == "area").collect();
        let mean = area.iter().map(|p| p.radiosity.length()).sum::<f64>() / area.len() as f64;
        let square = |point: &&truth::Point| {
            let (found, _) = truth::at(&surface, point.position, point.normal).unwrap();
            let scale = point.radiosity.length().max(0.05 * mean);
            (found.distance(point.radiosity) / scale).powi(2)
        };
        let rms = (area.iter().map(square).sum::<f64>() / area.len() as f64).sqrt();
        println!("asked {error}, off by {rms:.4} as {} texels show it", map.irradiance.len());
        assert!(rms <= error);
    }
}
