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
        match self.known() {
            Some(known) => known,
            None => self.keep(Arc::new(make())),
        }
    }

    /// The value, if it was computed.
    fn known<T: Any + Send + Sync>(&self) -> Option<Arc<T>> {
        find(&self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Keeps `value`, unless there is one; the one that is kept.
    fn keep<T: Any + Send + Sync>(&self, value: Arc<T>) -> Arc<T> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        find(&all).unwrap_or_else(|| {
            all.push(value.clone());
            value
        })
    }
}

fn find<T: Any + Send + Sync>(values: &[Arc<dyn Any + Send + Sync>]) -> Option<Arc<T>> {
    values.iter().find_map(|value| Arc::clone(value).downcast().ok())
}
