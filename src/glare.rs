//! Discomfort glare of an observer by the unified glare rating (CIE 117-1995):
//!
//! ```text
//!   UGR = 8 log₁₀( 0.25/L_b · Σ L² ω / p² )
//!
//!     source  L, ω        L    luminance of a source as it is seen, cd/m²
//!        ╲   β            ω    solid angle of what is seen of it, sr
//!   eye ──●────────►      p    position index of Guth, 1 in the line of sight
//!        line of sight    L_b  E_i/π: E_i is the illuminance at the eye without the sources
//! ```
//!
//! Sources are luminaires with an opening, and surfaces that emit: those that hang together are
//! one. L_b is found by paths from the eye, without bias, so that no bake is needed; light of a sky
//! that is seen belongs to it, and that of the sun itself does not.

mod background;
mod position_index;
mod sources;

use std::ops::ControlFlow;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::light::PathTracer;
use crate::scene::Scene;
pub use background::Background;
pub use position_index::position_index;
pub use sources::GlareSource;

/// Who is dazzled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observer {
    /// Where the eye is, scene unit.
    pub eye: DVec3,
    /// Line of sight; of any length.
    pub direction: DVec3,
    /// Away from the ground; of any length, not along the line of sight.
    pub up: DVec3,
}

/// What an observer suffers.
#[derive(Clone, Debug, PartialEq)]
pub struct Glare {
    /// The luminance of what is seen besides the sources, on average.
    pub background: Background,
    /// Sources in front of the observer, hidden ones left out.
    pub sources: Vec<GlareSource>,
    /// Names of luminaires without an opening, whose luminance is unknown, that are in view.
    pub without_size: Vec<String>,
    /// Names of sources behind the observer.
    pub behind: Vec<String>,
}

impl Glare {
    /// The glare of `observer` in `scene`, whose radiances are luminances in cd/m². `progress` is
    /// called with the paths done and at most; where it stops the work, the result is `None`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an eye that is not finite, or directions that are zero or
    /// parallel.
    pub fn of(
        scene: &Scene,
        observer: &Observer,
        progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Option<Glare>, Error> {
        let observer = observer.checked()?;
        let tracer = PathTracer::new(scene);
        let Some(background) = Background::of(&tracer, &observer, progress) else {
            return Ok(None);
        };
        let mut glare = Glare { background, sources: vec![], without_size: vec![], behind: vec![] };
        sources::find(scene, &tracer, &observer, &mut glare);
        Ok(Some(glare))
    }

    /// UGR; none without a source in view, or in the dark.
    pub fn rating(&self) -> Option<f64> {
        let sum: f64 = self.sources.iter().map(GlareSource::term).sum();
        let rating = 8.0 * libm::log10(0.25 / self.background.luminance * sum);
        (sum > 0.0).then_some(rating).filter(|rating| rating.is_finite())
    }

    /// Standard error of the rating by that of L_b: 8/ln 10 times its share of L_b.
    pub fn standard_error(&self) -> f64 {
        let Background { luminance, standard_error, .. } = self.background;
        8.0 / std::f64::consts::LN_10 * standard_error / luminance
    }
}

impl Observer {
    /// The same with unit directions.
    fn checked(&self) -> Result<Observer, Error> {
        let Observer { eye, direction, up } = *self;
        let bad = |found: String, remedy| Error::new(ErrorKind::Setting, "observer", found, remedy);
        if !eye.is_finite() {
            return Err(bad(format!("eye {eye}"), "all three must be finite"));
        }
        let unit = direction.try_normalize();
        let found = || bad(format!("line of sight {direction}"), "give a direction, not zero");
        let direction = unit.ok_or_else(found)?;
        let upright = up.try_normalize().filter(|up| up.cross(direction).length() > 1e-9);
        let found = || bad(format!("line of sight {direction}, up {up}"), "give another of them");
        Ok(Observer { eye, direction, up: upright.ok_or_else(found)? })
    }
}
