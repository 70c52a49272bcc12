//! Size of elements as a function of position.
//!
//! Light may fill a small part of a scene, such as a lit room on a ground plane of a kilometre.
//! Within the lit region elements have one size; outside they grow with the distance, so that they
//! look equally large from there:
//!
//! ```text
//!  size · (1 + d/D)    d: distance from the region; D: the region's diagonal
//! ```
//!
//! A plane then adds a number of elements that grows with the logarithm of its size.

use std::sync::Arc;

use glam::DVec3;

use super::{Cell, Mesh, cell_corners};
use crate::error::{Error, ErrorKind};
use crate::geometry::aabb::Aabb;
use crate::scene::{Scene, Triangle, longest_edge};

/// Size of elements as a function of position.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ElementSizing {
    /// Longest edge of an element within the region, scene unit.
    pub size: f64,
    /// The region with most of the light; none for the whole scene.
    pub region: Option<Aabb>,
    /// Materials, by their index, whose triangles are not split: they neither receive nor shoot.
    pub unsplit_materials: Vec<u32>,
}

impl ElementSizing {
    /// Whether the size is the same everywhere in `scene`.
    pub fn is_uniform(&self, scene: &Scene) -> bool {
        let unsplit = |t: &Triangle| self.unsplit_materials.contains(&t.material);
        self.region.is_none() && !scene.triangles().iter().any(unsplit)
    }

    /// Longest edge of an element with these `corners` in triangle `t`, scene unit.
    pub fn size_at(&self, scene: &Scene, t: usize, corners: &[DVec3; 3]) -> f64 {
        if self.unsplit_materials.contains(&scene.triangles()[t].material) {
            return f64::INFINITY;
        }
        self.size * size_growth(self.region.as_ref(), corners)
    }
}

impl ElementSizing {
    /// The same sizing scaled up until `scene` has at most `max_elements` at up to `max_depth`
    /// levels; its triangles are not merged.
    pub fn within(&self, scene: &Scene, max_depth: u32, max_elements: usize) -> ElementSizing {
        let mut sizing = self.clone();
        let triangles = scene.triangles().len();
        let bound = max_elements.max(triangles);
        let longest = (0..triangles).map(|t| longest_edge(scene.corners(t))).fold(0.0, f64::max);
        while sizing.size < longest && sizing.count(scene, max_depth, bound) > bound {
            // Half as many elements.
            sizing.size *= std::f64::consts::SQRT_2;
        }
        sizing
    }

    /// Number of elements of `scene`; counting stops beyond `bound`.
    fn count(&self, scene: &Scene, max_depth: u32, bound: usize) -> usize {
        let mut count = 0;
        for t in 0..scene.triangles().len() {
            let is_inner = self.is_inner(scene, t, longest_edge(scene.corners(t)), max_depth);
            count += leaves(&is_inner, bound);
            if count > bound {
                break;
            }
        }
        count
    }

    /// Whether a cell of triangle `t`, whose longest edge is `length`, is split.
    fn is_inner(
        &self,
        scene: &Scene,
        t: usize,
        length: f64,
        max_depth: u32,
    ) -> impl Fn(Cell) -> bool {
        move |cell: Cell| {
            let edge = length / f64::from(1u32 << cell.level) * (1.0 - 1e-12);
            cell.level < max_depth
                && edge > self.size
                && edge > self.size_at(scene, t, &cell_corners(scene.corners(t), cell))
        }
    }
}

impl Mesh {
    /// Splits every triangle of `scene` until no element is larger than `sizing` allows at its
    /// position, down to `max_depth` levels. For a uniform size the elements are those of
    /// [`Mesh::new`].
    ///
    /// # Errors
    /// Those of [`Mesh::new`].
    pub(crate) fn sized(
        scene: Arc<Scene>,
        sizing: &ElementSizing,
        max_depth: u32,
    ) -> Result<Mesh, Error> {
        if sizing.is_uniform(&scene) {
            return Mesh::new(scene, sizing.size);
        }
        let lengths: Vec<f64> =
            (0..scene.triangles().len()).map(|t| longest_edge(scene.corners(t))).collect();
        let is_inner =
            |t: usize, cell: Cell| sizing.is_inner(&scene, t, lengths[t], max_depth)(cell);
        let wanted = sizing.count(&scene, max_depth, Mesh::MAX_ELEMENTS);
        if wanted > Mesh::MAX_ELEMENTS {
            let place = format!("element size {}", sizing.size);
            let found = format!("asks for {wanted} elements");
            let remedy = format!("at most {}: use a larger size", Mesh::MAX_ELEMENTS);
            return Err(Error::new(ErrorKind::Setting, place, found, remedy));
        }
        Ok(Mesh::refined_where(scene.clone(), is_inner))
    }
}

/// Number of leaves of the quadtree of a triangle with inner cells by `is_inner`; counting stops
/// beyond `bound`.
fn leaves(is_inner: &impl Fn(Cell) -> bool, bound: usize) -> usize {
    let mut pending = vec![Cell::ROOT];
    let mut count = 0;
    while let Some(cell) = pending.pop() {
        if count > bound {
            break;
        }
        if is_inner(cell) { pending.extend(cell.children()) } else { count += 1 }
    }
    count
}

/// Ratio of the sizes allowed for an element with these `corners` and for one in `region`.
pub(crate) fn size_growth(region: Option<&Aabb>, corners: &[DVec3; 3]) -> f64 {
    region.map_or(1.0, |region| {
        let bounds = Aabb::from_points(*corners);
        let gap = (region.low - bounds.high).max(bounds.low - region.high).max(DVec3::ZERO);
        1.0 + gap.length() / region.diagonal().max(f64::MIN_POSITIVE)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    /// A square from −`half` to `half`, of two triangles.
    fn plane(half: f64) -> Arc<Scene> {
        let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, 0.0);
        let positions =
            vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let triangle = |corners| Triangle { corners, ..Default::default() };
        let triangles = vec![triangle([0, 1, 2]), triangle([0, 2, 3])];
        let materials = vec![Material::grey("grey", 0.5)];
        Arc::new(Scene::new(positions, triangles, vec!["plane".into()], materials).unwrap())
    }

    #[test]
    fn elements_are_as_much_larger_as_it_takes() {
        let scene = plane(100.0);
        let fine = ElementSizing { size: 0.5, ..Default::default() };
        let count = |sizing: &ElementSizing| {
            Mesh::sized(scene.clone(), sizing, Mesh::MAX_DEPTH).unwrap().element_count()
        };
        for max in [10, 1000, 100_000] {
            let sizing = fine.within(&scene, Mesh::MAX_DEPTH, max);
            let elements = count(&sizing);
            // A level of the quadtree is a factor of four.
            assert!(elements <= max && 4 * elements > max, "{elements} of {max}");
        }
        assert_eq!(fine.within(&scene, Mesh::MAX_DEPTH, usize::MAX), fine);
        // The triangles remain, whatever the maximum number of elements.
        assert_eq!(count(&fine.within(&scene, Mesh::MAX_DEPTH, 1)), 2);
    }

    #[test]
    fn sizes_grow_with_distance_from_region() {
        let region = Aabb { low: DVec3::splat(-1.0), high: DVec3::ONE };
        let sizing = ElementSizing { size: 0.5, region: Some(region), ..Default::default() };
        let count = |half: f64| {
            let mesh = Mesh::sized(plane(half), &sizing, Mesh::MAX_DEPTH).unwrap();
            for e in 0..mesh.element_count() {
                let node = mesh.element(e);
                let allowed = 0.5 * size_growth(Some(&region), &mesh.corners(node));
                assert!(mesh.longest_edge(node) <= allowed * (1.0 + 1e-9));
            }
            mesh.element_count()
        };
        let [ten, hundred, thousand] = [8.0, 64.0, 512.0].map(count);
        // The same number of elements for each ring of doubled size.
        let (first, second) = (hundred - ten, thousand - hundred);
        assert!(second < 2 * first, "{ten} {hundred} {thousand}");
        assert!(thousand < 20 * ten, "{ten} {hundred} {thousand}");
    }

    #[test]
    fn uniform_sizes_are_those_of_mesh_new() {
        let sizing = ElementSizing { size: 0.3, ..Default::default() };
        let sized = Mesh::sized(plane(4.0), &sizing, Mesh::MAX_DEPTH).unwrap();
        let everywhere = Aabb { low: DVec3::splat(-4.0), high: DVec3::splat(4.0) };
        let sizing = ElementSizing { region: Some(everywhere), ..sizing };
        let in_region = Mesh::sized(plane(4.0), &sizing, Mesh::MAX_DEPTH).unwrap();
        let new = Mesh::new(plane(4.0), 0.3).unwrap();
        assert!(sized.has_elements_of(&new) && in_region.has_elements_of(&new));
        let sizing = ElementSizing { unsplit_materials: vec![0], ..sizing };
        assert_eq!(Mesh::sized(plane(4.0), &sizing, Mesh::MAX_DEPTH).unwrap().element_count(), 2);
    }
}
