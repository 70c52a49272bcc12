//! What a map tells of its own error.

use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::{Backend, BakeResult, BakeTarget};

use crate::common::{cornell_box, keep_counting, keep_going, truth};

const TRUTH: &str = include_str!("../data/cornell_box.truth.json");

fn cornell_map(pixels: u32) -> (LightMap, BakeResult) {
    let scene = cornell_box(f64::INFINITY).scene().clone();
    let atlas = Atlas::new(scene, Resolution::Pixels(pixels), Coordinates::Auto).unwrap();
    let target = BakeTarget::Error(0.2);
    let baked = target.bake(atlas.scene().clone(), &Backend::Cpu, keep_going).unwrap();
    let map = LightMap::of_bake(atlas, &baked, &Backend::Cpu, keep_counting).unwrap().unwrap();
    (map, baked)
}

fn told(map: &LightMap, baked: &BakeResult) -> f64 {
    map.shown_error(baked, &Backend::Cpu, keep_counting).unwrap().unwrap().value
}

#[test]
fn a_coarse_map_tells_what_it_misses() {
    let (mut map, baked) = cornell_map(32);
    let found = told(&map, &baked);
    let true_error = truth::area_error(&map.surface().unwrap(), TRUTH);
    // Far more than the vertices are off by: it is the texels that are too large.
    assert!(found > 1.2 * baked.estimate.total, "{found} {}", baked.estimate.total);
    assert!((0.5..2.0).contains(&(found / true_error)), "{found} {true_error}");
    // Half as bright again: the mean square of 0.5 + 1.5 e, where e is what it was off by and 0 in
    // the mean. Dark points count by less, and the tail of one error is not that of the other.
    map.irradiance.iter_mut().for_each(|e| *e *= 1.5);
    let bright = told(&map, &baked);
    let expected = (0.25 + 2.25 * found * found).sqrt();
    assert!((0.85..1.15).contains(&(bright / expected)), "{bright} {expected}");
}
