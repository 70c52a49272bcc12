//! Tests of the library, module for module as in `src`: `cargo test --release --test library
//! solver` runs those of the solver.
//!
//! - What takes more than seconds is in `slow.rs`; the program is tested in `command_line`, the
//!   memory that reading a file takes in `import_memory.rs`, which has a process of its own.
//! - `common` has what tests share: scenes, rows and light that are made up, closed forms, truth.
//! - A test that needs a graphics adapter fails without one. Where RADIOSITY_NO_GPU is set it is
//!   ignored instead, and shows as ignored.
//! - A tolerance is derived in a comment; no test depends on how fast the machine is.

mod api;
mod backend;
mod bake;
mod bands;
mod camera;
mod common;
mod daylight;
mod form_factor;
mod fuzz_corpus;
mod gather;
mod glare;
mod grid;
mod heat;
mod io;
#[cfg(feature = "light-map")]
mod light_map;
mod mesh;
mod probe;
mod scene;
mod solver;
mod textures;
mod verify;
mod vertex;
mod view_factor;
mod work;
