//! Tests of the library, module for module as in `src`. Slow ones are in `slow.rs`.

mod api;
mod backend;
mod bake;
mod camera;
mod common;
mod form_factor;
mod fuzz_corpus;
mod io;
mod mesh;
mod scene;
mod solver;
mod vertex;
mod view_factor;
