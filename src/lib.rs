//! Radiosity: diffuse light settled in a scene, per vertex.
//!
//! The crate draws a hemicube per patch with wgpu, on any Vulkan, Metal or DX12 device (software
//! Vulkan included), turns it into form factors, lets progressive shooting on the CPU spread the
//! light, and gives radiosity at the vertices of a mesh. The path, in one line:
//! [`Scene`] → [`Mesh`] → [`FormFactors`] → [`Solver`] → [`VertexMesh`] → file. For exact
//! vertices, [`RefinementSettings`] stands before the last: each sees the settled light for itself, and the
//! mesh grows finer where the light asks for it. [`Solver`] has other methods beside shooting, GMRES
//! for reflectance near one among them, and a rule that picks one.
//!
//! ```no_run
//! use std::ops::ControlFlow;
//!
//! use radiosity::{
//!     Gpu, HemicubeRows, Mesh, ProximityCorrection, Solver, VertexMesh, load_obj, write_ply,
//! };
//!
//! # fn main() -> Result<(), radiosity::Error> {
//! let scene = load_obj("scenes/cornell_box.obj")?;
//! let mesh = Mesh::new(scene, 30.0)?; // no element edge over 30 units of the file
//! let gpu = Gpu::new(None)?;
//! let hemicubes = HemicubeRows::new(&gpu, &mesh, 128)?; // 128 × 128 pixels on the top face
//! let mut rows = ProximityCorrection::new(hemicubes, &mesh, 1.0); // mends what is within one diameter
//! let solution = Solver::default().solve(&mesh, &mut rows, |progress| {
//!     println!("{:.2} % unshot", 100.0 * progress.unshot_share);
//!     ControlFlow::Continue(())
//! })?;
//! let surface = VertexMesh::new(&mesh, &solution.radiosity);
//! write_ply("cornell_box.ply", &surface)?;
//! # Ok(())
//! # }
//! ```
//!
//! # Conventions
//!
//! | quantity | name | unit | meaning |
//! |---|---|---|---|
//! | B | `radiosity` | W/m² per channel | all flux leaving a surface, per area: emitted plus reflected |
//! | E | `exitance` | W/m² per channel | the emitted part of B; radiance of a diffuse surface is B/π |
//! | ρ | `reflectance` | 1, in [0, 1) | diffuse hemispherical reflectance per channel |
//! | F_ij | form factor | 1 | fraction of the flux leaving i that arrives at j: first index leaves, second receives |
//! | ΔB·A | `unshot` | W per channel | what was emitted or received and is not yet passed on |
//!
//! - Channels are linear (r, g, b); for radiometry use them as any three bands.
//! - Lengths are in the scene's own unit. Radiosity does not depend on it; W are W/m² times that
//!   unit squared.
//! - A face's front is where its corners run counter-clockwise. The front reflects and emits; both
//!   sides block; light that meets a back is lost there, and counted.
//! - Shares of light are whole numbers of 1/[`Row::TOTAL`], so rows sum to one exactly and a solve
//!   gives the same bits on every run with the same adapter.
//!
//! # What it does not model
//!
//! Specular or glossy reflection, transparency, textures, participating media, polarisation, time.
//! Light leaves and arrives diffusely, and an emitter is a surface.

// Hemicube geometry and some queries of meshes are used by the GPU passes only.
#![cfg_attr(not(feature = "gpu"), allow(dead_code))]

pub mod backend;
pub mod bake;
pub mod camera;
mod error;
pub mod form_factor;
pub mod gather;
mod geometry;
pub mod hemicube;
pub mod io;
pub mod mesh;
mod progress;
mod sampling;
pub mod scene;
pub mod solver;
pub mod vertex;
pub mod view_factor;
mod visibility;

pub use backend::cpu::{RayGather, RayRows};
#[cfg(feature = "gpu")]
pub use backend::gpu::{Gpu, GpuLimits, HemicubeGather, HemicubeRows};
pub use backend::{AdapterInfo, AdapterKind, Backend, BackendRows, Fallback};
pub use bake::{
    BakeProgress, BakeResult, BakeSettings, BakeTarget, ErrorEstimate, GatherSettings,
    SolveSettings,
};
pub use camera::{Camera, RadianceImage};
pub use error::{Error, ErrorKind};
pub use form_factor::proximity::ProximityCorrection;
pub use form_factor::viewpoints::AdaptiveViewpoints;
pub use form_factor::{Entry, FormFactors, Row};
pub use gather::{
    Gather, GatherPoint, GatheredMesh, IrradianceSample, Progress as GatherProgress,
    RadiosityField, RefinementSettings, gather_at_vertices,
};
#[cfg(feature = "exr")]
pub use io::write_exr;
#[cfg(feature = "png")]
pub use io::write_png;
pub use io::{ToneCurve, load_obj, read_obj, write_ply};
pub use mesh::{Mesh, NodeId};
pub use progress::{StopReason, Timings};
pub use scene::{Material, Rgb, Scene, Triangle};
pub use solver::{Ledger, Method, Progress, Solution, SolveSession, Solver};
pub use vertex::VertexMesh;
pub use view_factor::{
    EnforcementReport, ErrorStats, Estimate, Factor, MatrixChecks, Missing, ViewFactors,
};

/// The README's code compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
