//! Tests that take minutes: `cargo test --release --test slow`.

mod common;

mod slow {
    mod accuracy;
    mod checkpoint;
    mod extremes;
    mod hemicubes;
    #[cfg(feature = "cli")]
    mod kill_and_resume;
    mod many_triangles;
    mod properties;
    mod view_factors;
}
