//! Values computed from a scene once, and kept as long as the scene.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

/// Values computed from a scene on first use, one per type. A clone has none, since it may become
/// another scene.
#[derive(Debug, Default)]
pub(super) struct Derived(Mutex<Vec<Arc<dyn Any + Send + Sync>>>);

impl Clone for Derived {
    fn clone(&self) -> Derived {
        Derived::default()
    }
}

impl Derived {
    /// The value, computed by `make` if there is none yet. No lock is held meanwhile: a thread that
    /// waits for a part of the work may take other work that needs the same value, and then both
    /// compute it.
    pub fn get<T: Any + Send + Sync>(&self, make: impl FnOnce() -> T) -> Arc<T> {
        let all = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = |all: &[Arc<dyn Any + Send + Sync>]| {
            all.iter().find_map(|value| Arc::clone(value).downcast().ok())
        };
        if let Some(kept) = kept(&all()) {
            return kept;
        }
        let made = Arc::new(make());
        let mut all = all();
        kept(&all).unwrap_or_else(|| {
            all.push(made.clone());
            made
        })
    }
}
