//! Light maps: the irradiance of all surfaces of a scene in one texture.
//!
//! ```text
//!   Scene ─► Atlas ──────► texels ───────► gather ───► correct ─► weld seams ──► dilate ─► map
//!            texture       that surfaces   irradiance  by paths   where charts   buried and
//!            coordinates   are seen with   of each                meet in space  empty texels
//! ```
//!
//! Renderers interpolate a surface point from the four texels around its texture coordinates. So
//! every texel that a surface point uses gathers: those whose squares a triangle touches, and some
//! of their neighbours. A texel whose centre lies outside of all triangles gathers at the nearest
//! point of one.
//!
//! Each side of a surface that reflects on both has its own triangles
//! ([`Scene::resolve_sides`](crate::Scene::resolve_sides)), and so its own texels.

mod atlas;
mod correction;
mod coverage;
mod dilation;
mod directional;
mod footprint;
mod gathered;
mod given_coordinates;
mod layout;
mod map_page;
mod measured;
mod pages;
mod sampled;
mod seams;
mod texel_points;
mod unwrapping;

pub use atlas::Atlas;
pub use gathered::LightMap;
pub use given_coordinates::Unusable;
pub use layout::{Coordinates, LayoutSettings, Resolution};
pub use map_page::MapPage;
pub use pages::{Maps, Page};
