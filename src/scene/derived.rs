//! What is made of a scene once, and kept as long as the scene.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

/// Values that are made of a scene when they are first needed, one of a type. A clone has none,
/// since it may become another scene.
#[derive(Debug, Default)]
pub(super) struct Derived(Mutex<Vec<Arc<dyn Any + Send + Sync>>>);

impl Clone for Derived {
    fn clone(&self) -> Derived {
        Derived::default()
    }
}

impl Derived {
    /// The value, by `make` if there is none yet. Nothing is locked meanwhile: a thread that waits
    /// for a part of it may be given other work that asks for the same, and then both make it.
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
