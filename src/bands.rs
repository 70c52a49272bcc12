//! Light in any number of bands: wavelengths of a spectrum, or the bands of a plant, a sensor or a
//! heater.
//!
//! A bake in red, green and blue sets the mesh, its vertices and the number of rays of each. The
//! hits of these rays are stored as rows once, and all bands are looked up along the same rows:
//!
//! ```text
//!   BakeResult ── vertices ──┬── few rays: rows stored ► sweeps until each band converges
//!                            │                                  │ reflected light of vertices
//!   Bands ───────────────────┴── many rays: looked up once ◄────┘
//!   ρ, τ, E by material and band          │
//!                                         └──► BandLight: radiosity, irradiance, error by band
//! ```
//!
//! Arithmetic and stop rules are per band: a band has the same bits in any order of the bands and
//! with any other bands.
//!
//! Bands with wavelengths can be converted to colours: [`cie`].
//!
//! ```
//! # use std::ops::ControlFlow;
//! # use radiosity::bands::{Band, BandMaterial, Bands};
//! # use radiosity::{Backend, BakeTarget, Error, load_scene};
//! # fn main() -> Result<(), Error> {
//! let scene = load_scene("scenes/cornell_box.obj")?;
//! let go = |_: &_| ControlFlow::Continue(());
//! let baked = BakeTarget::Error(0.3).bake(scene, &Backend::Cpu, go)?;
//! let names = ["near", "far"].map(|name| Band { name: name.into(), wavelength: None });
//! // The materials of baked.mesh.scene(), one for one: white, red, green and light.
//! let wall = |reflectance: [f64; 2]| BandMaterial::opaque(reflectance.into());
//! let lamp = BandMaterial { exitance: vec![10.0, 20.0], ..wall([0.0, 0.0]) };
//! let materials = vec![wall([0.9, 0.8]), wall([0.7, 0.6]), wall([0.4, 0.9]), lamp];
//! let bands = Bands { materials, ..Bands::dark(names.into()) };
//! let light = bands.light(&baked, |_, _| ControlFlow::Continue(()))?.expect("nothing stops it");
//! let [near, far] = light.radiosity_at(0) else { unreachable!("two bands") };
//! # assert!(near.is_finite() && far.is_finite());
//! # Ok(())
//! # }
//! ```

pub mod cie;
mod error;
mod final_gather;
mod light;
mod lookup;
mod spectra;
mod surface_vertices;
mod vertex_system;

pub use error::BandError;
pub use light::BandLight;
pub use spectra::{Band, BandMaterial, Bands};
