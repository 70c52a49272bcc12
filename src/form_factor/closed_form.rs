//! Closed forms: the reference in every test.
//!
//! Form factors of unoccluded planar polygons, diffuse on both ends. A polygon is a slice of
//! corners, planar, convex and counter-clockwise seen from its front; only its front takes part.
//! Lengths are in any one unit, form factors are dimensionless fractions in [0, 1], and everything
//! is invariant under scaling and moving both ends together, as long as squares of areas neither
//! overflow nor underflow. A polygon without area neither emits nor receives.
//!
//! Both functions first clip each polygon by the other's plane: the remainder sees all of the
//! other. The formula then depends on the gap between the two, in radii of spheres around them,
//! since each loses digits where another does not:
//!
//! ```text
//! point → polygon      gap < 64 radii     Lambert's formula, a sum over edges
//!                      farther            Gauss cubature of cos θ cos θ′ / (π r²)
//!
//! polygon → polygon    gap < 8 radii of   double contour integral of ln r, a sum over
//!                      the smaller        pairs of edges; of polygons of dissimilar
//!                                         size the larger is halved first
//!                      farther            Gauss cubature over the smaller of point → polygon
//! ```

mod contour;
mod edge;
mod face;
mod lambert;
mod point_to_polygon;
mod polygon_to_polygon;
#[cfg(test)]
mod tests;

pub use self::point_to_polygon::point_to_polygon;
pub use self::polygon_to_polygon::polygon_to_polygon;
pub use crate::geometry::polygon::polygon_area;

pub(crate) use self::lambert::lambert;
