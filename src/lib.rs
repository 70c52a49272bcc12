//! Bakes diffuse global illumination into mesh vertices.
//!
//! Form factors come from hemicubes drawn on the GPU with wgpu (Vulkan, Metal, DX12, software
//! Vulkan too) or from rays on the CPU. A solver spreads the light between the elements of a mesh,
//! vertices then gather it, the mesh is refined where the light bends, and the error that is left
//! is estimated:
//!
//! ```no_run
//! use std::ops::ControlFlow;
//!
//! use radiosity::bake::BakeProgress;
//! use radiosity::{Backend, BakeTarget, load_scene, write_ply};
//!
//! # fn main() -> Result<(), radiosity::Error> {
//! let backend = Backend::gpu(None)?; // or Backend::Cpu
//! let baked = BakeTarget::Error(0.02).bake(load_scene("scene.obj")?, &backend, |progress| {
//!     if let BakeProgress::Estimated(error) = progress {
//!         eprintln!("error about {:.1} %", 100.0 * error.total);
//!     }
//!     ControlFlow::Continue(()) // Break(()) stops with what there is
//! })?;
//! write_ply("scene.ply", &baked.light.surface)?; // positions, faces, radiosity, errors
//! # Ok(())
//! # }
//! ```
//!
//! A lamp and a sky that the file does not have; a picture and a GLB file in its colours:
//!
//! ```no_run
//! # use std::ops::ControlFlow;
//! # use radiosity::io::ToneCurve;
//! # use radiosity::{Backend, BakeTarget, Camera, Rgb, SceneSettings, write_glb, write_png};
//! # fn main() -> Result<(), radiosity::Error> {
//! let mut settings = SceneSettings::default();
//! settings.emit.push(("bulb".into(), Rgb::splat(15.0))); // radiance of a material
//! settings.sky = Some(Rgb::ONE.into());
//! let (scene, go) = (settings.load("scene.obj")?, |_: &_| ControlFlow::Continue(()));
//! let light = BakeTarget::Error(0.1).bake(scene, &Backend::Cpu, go)?.light;
//! let image = Camera::framing(&light, 1.5).image(&light.surface, 768, 512, 4)?;
//! write_png("scene.png", &image)?;
//! write_glb("scene.glb", &light, &ToneCurve::fit_image(&image).of_radiosity())?;
//! # Ok(())
//! # }
//! ```
//!
//! # Where to look
//!
//! Data flows one way: [`Scene`] → [`Mesh`] → [`FormFactors`] → [`Solver`] → [`GatheredMesh`] →
//! [`VertexMesh`] → file or [`Camera`]. The root has the names of a usual program; each step has a
//! module with the rest of its story.
//!
//! | module | for |
//! |---|---|
//! | [`scene`], [`mesh`] | triangles and materials; elements, patches and clusters |
//! | [`form_factor`] | rows: the contract of their makers, closed forms, corrections |
//! | [`hemicube`] | faces, frames and pixel weights of a hemicube |
//! | [`solver`] | shooting, Gauss–Seidel, GMRES and others; save, resume, change |
//! | [`gather`], [`vertex`] | irradiance at points; radiosity at vertices, refined where it bends |
//! | [`grid`], [`probe`] | light on measuring grids; spherical harmonics at points in the air |
//! | [`daylight`] | a year of daylight at points, by daylight coefficients |
//! | [`glare`] | the unified glare rating of an observer, by paths alone |
//! | [`path_correction`] | values at points corrected by paths, with their errors |
//! | [`backend`] | who makes rows and gathers: [`backend::gpu`] or [`backend::cpu`] |
//! | [`bake`] | all of it to an error or within a time, with an estimate of the error |
//! | [`bands`] | light in any number of bands on the mesh of a bake; spectra to colours |
//! | [`view_factor`] | area-averaged factors between groups |
//! | [`heat`] | temperatures and net fluxes of groups, by their view factors |
//! | [`work`] | long work shared by processes, as those of MPI, and kept in a journal |
//! | [`light_map`] | irradiance at the texels of a texture |
//! | [`accuracy`] | the measure of error |
//! | [`verify`] | how far off a solution is, by path tracing the scene at random points |
//! | [`camera`], [`io`] | pictures; OBJ and PLY in, PLY, GLB, EXR, PNG and tables out |
//!
//! Features: `gpu` (wgpu), `textures`, `exr`, `glb`, `png`, all on by default, and `cli` for the
//! program `radiosity`. Long work takes a callback that is told of progress and answers with a
//! [`ControlFlow`](std::ops::ControlFlow): `Break(())` stops it with what there is.
//!
//! # Conventions
//!
//! | quantity | name | unit | meaning |
//! |---|---|---|---|
//! | B | `radiosity` | W/m² per channel | flux leaving a surface per area: emitted plus reflected |
//! | E | `exitance` | W/m² per channel | emitted part of B; a diffuse surface has radiance B/π |
//! | ρ | `reflectance` | 1, in [0, 1) | diffuse hemispherical reflectance per channel |
//! | F_ij | form factor | 1 | fraction of the flux leaving i (first index) that arrives at j |
//! | ΔB·A | `unshot` | W per channel | flux emitted or received and not yet passed on |
//!
//! - Channels are linear (r, g, b); for radiometry use them as any three bands.
//! - Lengths are in the scene's own unit. Radiosity does not depend on it; W are W/m² times that
//!   unit squared.
//! - A face's front is where its corners run counter-clockwise. The front reflects and emits, and
//!   the back reflects if its material says so ([`scene::Sides`]; in files, if light reaches it).
//!   Both block, but for what is translucent or clear ([`Material`]); light that meets the back of
//!   others is lost there, and counted.
//! - Shares of light are whole numbers of 1/[`Row::TOTAL`](form_factor::Row::TOTAL), so rows sum to
//!   one exactly and a solve gives the same bits on every run with the same adapter.
//!
//! # What it does not model
//!
//! Glossy reflection, what mirrors and lenses throw onto others, participating media,
//! polarisation, time. Light leaves and arrives diffusely, passes clear glass straight on, and an
//! emitter is a surface, a luminaire or the light from outside. Pictures show mirrors and glass.

// The same bytes on every platform: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]
// Hemicube geometry and some queries of meshes are used by the GPU passes only.
#![cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "hemicubes are drawn on a GPU"))]

pub mod accuracy;
pub mod backend;
pub mod bake;
pub mod bands;
pub mod camera;
pub mod daylight;
mod error;
pub mod form_factor;
pub mod gather;
mod geometry;
pub mod glare;
pub mod grid;
pub mod heat;
pub mod hemicube;
pub mod io;
pub mod kept_mesh;
mod light;
#[cfg(feature = "light-map")]
pub mod light_map;
mod linear;
pub mod mesh;
pub mod path_correction;
pub mod probe;
mod progress;
mod sampling;
pub mod scene;
pub mod solver;
pub mod verify;
pub mod vertex;
pub mod view_factor;
mod visibility;
mod whole_file;
pub mod work;

pub use glam;

pub use backend::Backend;
#[cfg(feature = "gpu")]
pub use backend::gpu::Gpu;
pub use bake::{BakeResult, BakeSettings, BakeTarget};
pub use camera::Camera;
pub use error::{Error, ErrorKind};
pub use form_factor::FormFactors;
pub use gather::{Gather, GatheredMesh};
#[cfg(feature = "exr")]
pub use io::write_exr;
#[cfg(feature = "glb")]
pub use io::write_glb;
#[cfg(feature = "png")]
pub use io::write_png;
#[expect(deprecated, reason = "former names stay for one release")]
pub use io::{ObjSettings, load_obj};
pub use io::{SceneSettings, load_scene, read_ply, write_ply};
pub use mesh::Mesh;
pub use scene::{Material, Rgb, Scene, Sky, Sun, Triangle};
pub use solver::{Solution, Solver};
pub use vertex::VertexMesh;
pub use view_factor::ViewFactors;

/// The code of the README and of the pages under `docs` compiles.
#[cfg(doctest)]
mod pages {
    #[doc = include_str!("../README.md")]
    struct Readme;
    #[doc = include_str!("../docs/grids_and_probes.md")]
    struct GridsAndProbes;
    #[doc = include_str!("../docs/incremental.md")]
    struct Incremental;
    #[doc = include_str!("../docs/robustness.md")]
    struct Robustness;
    #[doc = include_str!("../docs/verify.md")]
    struct Verify;
    #[doc = include_str!("../docs/view_factors.md")]
    struct ViewFactors;
}
