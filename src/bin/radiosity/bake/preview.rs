//! Files of a bake that is under way: PLY and GLB are written again whenever the light is better.
//!
//! ```text
//! bake ──► slot for the newest light ──► thread that writes it ──► STEM.ply, STEM.glb
//! ```
//!
//! The bake never waits for the files: light that came while others were written and is no longer
//! the newest is left out. Each file is replaced as a whole, so that a viewer can read it at any
//! time.

use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};

use radiosity::GatheredMesh;
use radiosity::bake::{BakeProgress, ErrorEstimate};

use super::files::Files;
use crate::progress::locked;

/// Light of a bake so far, with its estimated error; without one until vertices have gathered.
type LightSoFar = (Arc<GatheredMesh>, Option<ErrorEstimate>);

/// Runs `bake`, which passes on its progress, and writes `files` of its light meanwhile; with none,
/// runs it alone.
pub fn during<T>(
    files: Option<&Files>,
    bake: impl FnOnce(&mut dyn FnMut(&BakeProgress)) -> T,
) -> T {
    let Some(files) = files else { return bake(&mut |_| ()) };
    let newest: Mutex<Option<LightSoFar>> = Mutex::default();
    let take = || locked(&newest).take();
    std::thread::scope(|scope| {
        let (changed, changes) = channel();
        scope.spawn(move || {
            for () in changes {
                if let Some((light, estimate)) = take()
                    && let Err(error) = files.write_preview(&light, estimate.as_ref())
                {
                    eprintln!("warning: no preview: {error}");
                    return;
                }
            }
        });
        let result = bake(&mut |progress| {
            if let BakeProgress::Light { light, estimate } = progress {
                *locked(&newest) = Some((light.clone(), *estimate));
                // Nobody listens after a file could not be written.
                _ = changed.send(());
            }
        });
        // The files of the end come next.
        take();
        result
    })
}
