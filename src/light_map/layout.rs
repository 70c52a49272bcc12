//! Size of a light map, and coordinates of triangles in it.

use glam::DVec2;

use crate::error::{Error, ErrorKind};

/// Size of the texels of a light map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// Edge of a texel on the surface, scene unit, above 0: the mean over all if the texture
    /// coordinates are those of the file.
    TexelSize(f64),
    /// Texels along a side of the map; if surfaces are laid out anew its height may be less.
    Pixels(u32),
}

/// Coordinates of triangles in a map, independent of the scene.
pub(super) struct Layout {
    /// Texels in a row, and rows.
    pub size: [u32; 2],
    /// Of the corners of each triangle, as in [`Atlas::coordinates`](super::Atlas::coordinates).
    pub coordinates: Vec<[DVec2; 3]>,
    /// Number of charts laid out; none if the coordinates are those of the file.
    pub charts: Option<usize>,
}

/// Maximum number of texels along a side of a map: the limit of any graphics device (WebGPU's
/// `maxTextureDimension2D`).
pub(super) const MAX_SIDE: u32 = 8192;

/// Texture coordinates in units of texels, from the centre of the upper left one.
pub(super) fn in_texels(coordinates: [DVec2; 3], [width, height]: [u32; 2]) -> [DVec2; 3] {
    coordinates.map(|p| p * DVec2::new(width.into(), height.into()) - 0.5)
}

impl Resolution {
    pub(super) fn check(self) -> Result<(), Error> {
        match self {
            Resolution::TexelSize(size) if !(size > 0.0 && size.is_finite()) => {
                let remedy = "give a length above 0, in the scene's unit";
                let place = format!("texels of {size}");
                Err(Error::new(ErrorKind::Setting, place, "not above 0", remedy))
            }
            Resolution::Pixels(side) if side == 0 || side > MAX_SIDE => {
                Err(bad_size(self, "out of range".into()))
            }
            _ => Ok(()),
        }
    }
}

/// The error of a map that is too large, or too small for its surfaces: `found` is the finding.
pub(super) fn bad_size(resolution: Resolution, found: String) -> Error {
    let place = match resolution {
        Resolution::TexelSize(size) => format!("texels of {size}"),
        Resolution::Pixels(pixels) => format!("{pixels} texels along a side"),
    };
    let remedy = match resolution {
        Resolution::TexelSize(_) => format!("ask for larger ones: up to {MAX_SIDE} along a side"),
        Resolution::Pixels(_) => format!("ask for 1 to {MAX_SIDE}, and enough for all surfaces"),
    };
    Error::new(ErrorKind::Setting, place, found, remedy)
}
