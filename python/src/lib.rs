//! What `radiosity`, the package for Python, is made of: its functions check what they are given,
//! and call these, which work without the interpreter's lock.
//!
//! | file | content |
//! |---|---|
//! | `work` | threads, progress, Ctrl-C, exceptions |
//! | `arrays` | views of what the library made |
//! | `scene`, `bake`, `factors`, `light_map` | one class each, and functions that make it |

mod arrays;
mod bake;
mod factors;
mod light_map;
mod scene;
mod work;

/// The module.
#[pyo3::pymodule]
mod _radiosity {
    #[pymodule_export]
    use crate::bake::{PyBake, PyGrid, PyImage, bake, probe_positions, verify_solution};
    #[pymodule_export]
    use crate::factors::{PyFactors, factors_of_rows, heat, load_factors, view_factors};
    #[pymodule_export]
    use crate::light_map::{PyAtlas, PyLightMap, atlas, light_map};
    #[pymodule_export]
    use crate::scene::{PyScene, PySky, sun_angles};
    #[pymodule_export]
    use crate::work::Stopped;
}
