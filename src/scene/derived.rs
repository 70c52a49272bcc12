//! What is made of a scene once, and kept as long as the scene.

use std::any::Any;
use std::sync::{Arc, OnceLock};

/// A value that is made of a scene when it is first needed. A clone has none, since it may become
/// another scene.
#[derive(Debug, Default)]
pub(super) struct Derived(OnceLock<Arc<dyn Any + Send + Sync>>);

impl Clone for Derived {
    fn clone(&self) -> Derived {
        Derived::default()
    }
}

impl Derived {
    /// The value, by `make` if there is none yet; of another type than that which is kept, it is
    /// made each time.
    pub fn get<T: Any + Send + Sync>(&self, make: impl Fn() -> T) -> Arc<T> {
        let kept = self.0.get_or_init(|| Arc::new(make()));
        Arc::clone(kept).downcast().unwrap_or_else(|_| Arc::new(make()))
    }
}
