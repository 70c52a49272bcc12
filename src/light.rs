//! The light of a scene by path tracing: unbiased, without elements and without a solver.

mod emitters;
mod luminaires;
mod path_tracer;

pub use path_tracer::{PathTracer, Reflected, SurfacePoint};
pub(crate) use path_tracer::{Visit, nearest_surfaces, random_point};
