//! Sizes of light maps, and coordinates of triangles in them.

use glam::DVec2;

use super::pages::Maps;
use crate::error::{Error, ErrorKind};

/// Source of the texture coordinates of a light map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coordinates {
    /// Those of the scene's file if they are usable for a light map, else new ones.
    #[default]
    Auto,
    /// Those of the scene's file.
    Given,
    /// New ones.
    Unwrapped,
}

/// How the surfaces of a scene are laid out in light maps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LayoutSettings {
    /// Size of the texels.
    pub resolution: Resolution,
    /// Source of the texture coordinates.
    pub coordinates: Coordinates,
    /// What has a map of its own.
    pub maps: Maps,
    /// Texels between a chart and the border of its map, and half of those between charts, 3 or
    /// more: one that points on the outline use, the others filled from it. Filters of the map
    /// itself need two of these; of smaller images, each half as large as the one before (mipmaps),
    /// n need 2ⁿ. Coordinates of a file have what they have.
    pub padding: u32,
}

impl LayoutSettings {
    /// One map for all, by the coordinates of the file where they are usable, with a padding of 3.
    pub fn new(resolution: Resolution) -> LayoutSettings {
        let (coordinates, maps) = (Coordinates::Auto, Maps::One);
        LayoutSettings { resolution, coordinates, maps, padding: 3 }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        self.resolution.check()?;
        let bad = |place: String, found: &str, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, place, found, remedy))
        };
        if !(3..=MAX_SIDE / 4).contains(&self.padding) {
            let place = format!("padding of {} texels", self.padding);
            return bad(place, "out of range", "use 3, or 2^n for n smaller images");
        }
        match (self.maps, self.resolution) {
            (Maps::Pages(side), _) if side == 0 || side > MAX_SIDE => {
                Err(bad_size(Resolution::Pixels(side), "out of range".into()))
            }
            (Maps::Pages(side), Resolution::Pixels(_)) => bad(
                format!("pages of {side} texels along a side"),
                "no size of texels",
                "give the size of a texel on the surfaces, by which pages are as many as needed",
            ),
            _ => Ok(()),
        }
    }
}

/// Size of the texels of a light map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// Edge of a texel on the surface, scene unit, above 0: the mean over all if the texture
    /// coordinates are those of the file.
    TexelSize(f64),
    /// Texels along a side of the map; if surfaces are laid out anew its height may be less.
    Pixels(u32),
}

/// Coordinates of triangles in maps, independent of the scene.
pub(super) struct Layout {
    /// Of each map the texels in a row, and the rows.
    pub sizes: Vec<[u32; 2]>,
    /// The map of each triangle.
    pub maps: Vec<u32>,
    /// Of the corners of each triangle in its map, as in
    /// [`Atlas::coordinates`](super::Atlas::coordinates).
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
