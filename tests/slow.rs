//! Tests that take minutes: `cargo test --release --test slow`.

mod common;

mod slow {
    mod extremes;
    mod properties;
}
