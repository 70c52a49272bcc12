//! A part of a light map that is a file of its own.

use super::gathered::LightMap;
use super::pages::Page;

/// A page of a light map, or all of it, to be written to a file.
#[derive(Clone, Copy, Debug)]
pub struct MapPage<'a> {
    pub(crate) map: &'a LightMap,
    pub(crate) page: Page,
}

impl LightMap {
    /// Page `k` of [`Atlas::pages`](super::Atlas::pages).
    ///
    /// # Panics
    /// Where there are not so many.
    pub fn page(&self, k: usize) -> MapPage<'_> {
        MapPage { map: self, page: self.atlas.pages()[k] }
    }
}

/// The whole map.
impl<'a> From<&'a LightMap> for MapPage<'a> {
    fn from(map: &'a LightMap) -> MapPage<'a> {
        let size = [map.atlas.width(), map.atlas.height()];
        MapPage { map, page: Page { group: None, origin: [0, 0], size } }
    }
}

impl MapPage<'_> {
    /// Texels in a row, and rows.
    pub fn size(&self) -> [u32; 2] {
        self.page.size
    }

    /// Those of `values`, one a texel of the whole map, that are of the page, row by row.
    pub(crate) fn of<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let Page { origin: [x, y], size: [width, height], .. } = self.page;
        let row = |row: u32| {
            let first = (row * self.map.atlas.width() + x) as usize;
            &values[first..first + width as usize]
        };
        (y..y + height).flat_map(row).copied().collect()
    }

    /// Whether triangles cover each of its texels.
    pub(crate) fn covered(&self) -> Vec<bool> {
        self.of(&self.map.covered())
    }
}
