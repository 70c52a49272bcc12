//! The energy balance of a solve: the destination of all emitted light.
//!
//! emitted = absorbed + escaped + lost at back faces + lost in panes + unshot − overshot, per
//! channel and at any time, up to rounding.

use serde::{Deserialize, Serialize};

use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Destination of all emitted flux, W per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Exitance times area, over all elements.
    pub emitted: Rgb,
    /// Absorbed at the fronts of elements.
    pub absorbed: Rgb,
    /// Hit no surface.
    pub escaped: Rgb,
    /// Hit the back of a surface and was lost there.
    pub backface_loss: Rgb,
    /// Absorbed in clear panes on the way to a surface or out of the scene.
    pub pane_loss: Rgb,
    /// Received or emitted, not yet passed on.
    pub unshot: Rgb,
    /// Passed on before it was received: 0 except for methods that send more than they have
    /// (shooting with overshoot, GMRES, the rounding of a direct solve). Unshot flux may yet
    /// compensate it.
    pub overshot: Rgb,
}

impl Ledger {
    /// Adds `weight` times `other`.
    pub(super) fn add(&mut self, weight: Rgb, other: &Ledger) {
        self.emitted += weight * other.emitted;
        self.absorbed += weight * other.absorbed;
        self.escaped += weight * other.escaped;
        self.backface_loss += weight * other.backface_loss;
        self.pane_loss += weight * other.pane_loss;
        self.unshot += weight * other.unshot;
        self.overshot += weight * other.overshot;
    }

    /// (Emitted − all other terms) / emitted: the worst channel. 0 when nothing is emitted.
    pub fn imbalance(&self) -> f64 {
        let lost = self.absorbed + self.escaped + self.backface_loss + self.pane_loss;
        let accounted = lost + self.unshot - self.overshot;
        largest_share((self.emitted - accounted).abs(), self.emitted)
    }

    /// Adds the unshot light to `radiosity` (W/m², one value per element of `mesh`) as if it fell
    /// evenly on all reflecting surfaces, again and again: the ambient term of Cohen, Chen, Wallace
    /// and Greenberg (1988). For early pictures, or to correct for unshot light; it ignores the
    /// direction in which that light would have gone. Returns the ambient radiosity, W/m² per unit
    /// of albedo.
    pub fn add_ambient(&self, mesh: &Mesh, radiosity: &mut [Rgb]) -> Rgb {
        let ambient = self.ambient(mesh);
        for (e, b) in radiosity.iter_mut().enumerate() {
            *b += mesh.albedo(e) * ambient;
        }
        ambient
    }

    /// Radiosity, W/m² per unit of albedo, if the unshot light fell evenly on all surfaces.
    pub(super) fn ambient(&self, mesh: &Mesh) -> Rgb {
        let absorptance = (Rgb::ONE - mesh.mean_albedo()).max(Rgb::splat(f64::EPSILON));
        let area = mesh.scattering_area().max(f64::MIN_POSITIVE);
        (self.unshot - self.overshot) / area / absorptance
    }

    /// Unshot and overshot share of the emitted flux: the worst channel. 0 when nothing is emitted.
    pub fn unshot_share(&self) -> f64 {
        largest_share(self.unshot + self.overshot, self.emitted)
    }
}

/// Largest ratio part/total over the channels in which the total is above zero.
pub(super) fn largest_share(part: Rgb, total: Rgb) -> f64 {
    let share = |(p, t): (f64, f64)| if t > 0.0 { p / t } else { 0.0 };
    part.to_array().into_iter().zip(total.to_array()).map(share).fold(0.0, f64::max)
}
