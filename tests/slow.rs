//! Tests that take minutes, ignored unless asked for:
//!
//! ```sh
//! cargo test --release --features cli --test slow -- --ignored
//! ```
//!
//! With `--nocapture` they print what they measure: `extremes` its table, for one. Those that need
//! a graphics adapter are left out where RADIOSITY_NO_GPU is set.

mod common;

mod slow {
    mod accuracy;
    mod checkpoint;
    mod extremes;
    #[cfg(not(skip_gpu_tests))]
    mod hemicubes;
    #[cfg(feature = "cli")]
    mod kill_and_resume;
    #[cfg(feature = "light-map")]
    mod light_maps;
    mod many_triangles;
    mod open_scenes;
    mod properties;
    mod row_memory;
    mod small_change;
    mod view_factors;
}
