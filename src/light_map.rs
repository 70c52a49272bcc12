//! Light maps: the irradiance of all surfaces of a scene in one texture.
//!
//! ```text
//!   Scene ──► Atlas ──────► texels ─────► gather ───► weld seams ──► dilate ──► LightMap
//!             texture       that surfaces  irradiance  where charts   buried and
//!             coordinates   are seen with  of each     meet in space  empty texels
//! ```
//!
//! Renderers show a surface point by the four texels around its texture coordinates, each by how
//! near it is. So every texel gathers that any point of a surface is shown with: those whose
//! squares a triangle touches, and some of their neighbours. A texel whose centre lies outside of
//! all triangles gathers at the nearest point of one.
//!
//! Each side of a surface that reflects on both has triangles of its own
//! ([`Scene::resolve_sides`](crate::Scene::resolve_sides)), and so texels of its own.

mod atlas;
mod coverage;
mod dilation;
mod footprint;
mod gathered;
mod given_coordinates;
mod layout;
mod measured;
mod sampled;
mod seams;
mod texel_points;
mod unwrapping;

pub use atlas::{Atlas, Coordinates};
pub use gathered::LightMap;
pub use given_coordinates::Unusable;
pub use layout::Resolution;
