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
        let map = LightMap::of_bake(atlas, &baked, &Backend::Cpu, keep_counting);
        let mut map = map.unwrap().unwrap();
        let between = map.shown_error(&baked, &Backend::Cpu, keep_counting).unwrap().unwrap().value;
        let light = map.correct(&baked, 0.6 * error, keep_counting).unwrap().unwrap();
        let (rms, told) = (truth::area_error(&map.surface().unwrap(), TRUTH), between.hypot(light));
        let texels = map.irradiance.len();
        println!("asked {error}, off by {rms:.4} and told {told:.4} as {texels} texels show it");
        assert!(rms <= error && told <= error);
        // An upper estimate: of the light it has what the bake as a whole may be off by.
        assert!((0.5..3.0).contains(&(told / rms)));
    }
}
