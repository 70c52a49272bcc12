//! Previews: elements alone, without vertices that gather.

use radiosity::{BakeSettings, Mesh};

use crate::common::quads;
use crate::common::scenes::paint;

/// A hundred parallel sheets in a unit cube, all of which glow. Elements of a 32nd of the diagonal
/// are 1.7/32 long, halvings of √2: 2·4⁵ on each sheet, 204 800 in all.
#[test]
fn surfaces_that_fill_space_have_larger_elements() {
    let sheet = |k: u32| {
        let z = f64::from(k) / 99.0;
        let corners = [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]];
        (corners, paint(0.5, 1.0))
    };
    let scene = quads(&(0..100).map(sheet).collect::<Vec<_>>());
    let settings = BakeSettings::elements_only(&scene);
    let elements = Mesh::new(scene, settings.solve.element_size).unwrap().element_count();
    // A level of the quadtree is a factor of four.
    assert!(elements <= 1 << 16 && elements > 1 << 14, "{elements}");
}
