//! How a glTF file is exposed, turned and scaled.

use glam::{DQuat, DVec3};
use gltf_json::scene::{Node, UnitQuaternion};

use crate::io::tone::ToneCurve;
use crate::scene::Scene;

/// How [`write_glb`](crate::write_glb) and
/// [`write_light_map_glb`](crate::io::write_light_map_glb) expose, turn and scale. A tone curve
/// alone makes settings with the defaults of all others.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GlbSettings {
    /// The curve of radiosity for colours, such as that of a picture
    /// ([`ToneCurve::of_radiosity`]).
    pub tone: ToneCurve,
    /// Metres in a unit of the scene's lengths, above 0; 1 by default.
    pub metres: f64,
    /// Error of the light as a share. Two sides of a surface are one double-sided face where their
    /// radiosities differ nowhere by more than three times this share of their mean; by default 0.
    pub error: f64,
}

impl From<&ToneCurve> for GlbSettings {
    fn from(tone: &ToneCurve) -> GlbSettings {
        GlbSettings { tone: *tone, metres: 1.0, error: 0.0 }
    }
}

impl GlbSettings {
    /// The top node for positions of `scene` relative to `origin`, scene unit: glTF has metres and
    /// +Y up. All vertices keep the scene's axes and unit, so that they keep their digits.
    pub(super) fn top_node(&self, scene: &Scene, origin: DVec3) -> Node {
        let up = scene.up();
        let rotation = DQuat::from_rotation_arc(up, DVec3::Y);
        let translation = rotation * origin * self.metres;
        let is_turned = up != DVec3::Y;
        Node {
            name: Some("scene".into()),
            translation: (origin != DVec3::ZERO).then(|| translation.as_vec3().to_array()),
            rotation: is_turned.then(|| UnitQuaternion(rotation.as_quat().to_array())),
            scale: (self.metres != 1.0).then_some([self.metres as f32; 3]),
            ..Default::default()
        }
    }
}
