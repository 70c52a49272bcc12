//! A whole bake: from a scene to radiosity at vertices, to an error, within a time, or as far as
//! given settings go.
//!
//! ```text
//! BakeTarget ──► BakeSettings::for_error          all settings, by the model of error and cost and
//!                      │                          a survey of where the light falls
//!                      ▼
//!                triangles cut                    along walls that stand on them
//!                      │
//!                      ▼
//!                shooting phase                   light is shot on a mesh of fine elements
//!                      │                          (form factors, solver)
//!                      ▼
//!                gather phase ◄───────────────┐   vertices of a mesh of coarse elements gather it;
//!                      │                      │   elements are split where light is not linear
//!                      ▼                      │
//!                error estimate               │   random points gather twice, and are compared
//!                      │                      │   with what the vertices interpolate to
//!                      ├─ too large ──────────┘   more of what the largest parts of the error
//!                      ▼                          follow: rays, passes, smaller elements
//!                    paths                        the estimate is held against paths, which have
//!                      │                          no bias; where they find more, all gather again
//!                      ▼
//!                  BakeResult                     the light, its error by groups, and whether the
//!                                                 target was reached
//! ```
//!
//! Shooting is done once; its error is chosen small beforehand. Rows and gathers come from a
//! [`Backend`](crate::Backend); when a graphics device fails underway, rays on the CPU go on.

mod controller;
mod error_estimate;
mod estimator;
mod fallback;
mod gather_phase;
mod in_time;
mod light_survey;
pub(crate) mod model;
mod outcome;
mod pipeline;
mod progress;
mod received_light;
mod result;
mod settings;
mod shooting_phase;
mod strata;
mod target;
mod to_error;
mod validator;

pub use crate::progress::Timings;
pub use error_estimate::{ErrorEstimate, GroupError};
pub use outcome::{Obstacle, Outcome};
pub use progress::BakeProgress;
pub use result::BakeResult;
pub use settings::{BakeSettings, GatherSettings, SolveSettings};
pub use target::BakeTarget;
pub(crate) use to_error::check_error;
