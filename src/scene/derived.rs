//! What is made of a scene once, and kept as long as the scene.

use std::any::Any;
use std::sync::{Arc, OnceLock};

use super::Scene;

/// A value that is made of a scene when it is first needed. A clone has none, since it may become
/// another scene.
#[derive(Debug, Default)]
pub(super) struct Derived(OnceLock<Arc<dyn Any + Send + Sync>>);

impl Clone for Derived {
    fn clone(&self) -> Derived {
        Derived::default()
    }
}

impl Scene {
    /// What `make` makes of the scene, once: the hierarchy that rays are cast at, of which the
    /// scene knows nothing. No other type is made so.
    pub(crate) fn derived<T: Any + Send + Sync>(&self, make: impl FnOnce(&Scene) -> T) -> Arc<T> {
        let made = self.derived.0.get_or_init(|| Arc::new(make(self)));
        Arc::clone(made).downcast().expect("one type is made of scenes")
    }
}
