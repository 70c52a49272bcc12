//! How things are drawn.

use image::imageops::{self, FilterType};
use image::{Rgb as Pixel, RgbImage};
use radiosity::io::ToneCurve;
use radiosity::mesh::NodeId;
use radiosity::{Camera, Mesh, VertexMesh};

use crate::Result;
use crate::item_buffer::{Hemicube, Item, item_buffer};

/// Elements by their patches.
pub struct Numbering<'a> {
    mesh: &'a Mesh,
    patches: &'a [NodeId],
    /// Of each element, the index of its patch.
    patch_of: Vec<usize>,
}

impl<'a> Numbering<'a> {
    /// Each element of `mesh` is in one of `patches`.
    pub fn new(mesh: &'a Mesh, patches: &'a [NodeId]) -> Numbering<'a> {
        let mut patch_of = vec![0; mesh.element_count()];
        for (k, &patch) in patches.iter().enumerate() {
            patch_of[mesh.elements_of(patch)].fill(k);
        }
        Numbering { mesh, patches, patch_of }
    }

    /// The surfaces in the colours of their materials, with thin lines around elements and thick
    /// ones around patches.
    pub fn outlines(&self, camera: &Camera, side: u32) -> Result<RgbImage> {
        let fine = 4 * side;
        let items = item_buffer(camera, self.mesh, fine)?;
        let at = |x: u32, y: u32| items[(y.min(fine - 1) * fine + x.min(fine - 1)) as usize];
        let patch_at = |item: Item| item.map(|e| self.patch_of[e]);
        let tone = ToneCurve::with_exposure(1.5);
        let paint = |k: u32| {
            let (x, y) = (k % fine, k / fine);
            let here = at(x, y);
            // A line is where pixels to the right or below see another one.
            let next = |by: u32| [at(x + by, y), at(x, y + by)];
            if next(5).iter().any(|&item| patch_at(item) != patch_at(here)) {
                [15, 40, 120]
            } else if next(2).iter().any(|&item| item != here) {
                [110; 3]
            } else {
                here.map_or([0; 3], |e| tone.display(self.mesh.reflectance(e)))
            }
        };
        Ok(shrunk((0..fine * fine).map(paint), side))
    }

    /// What the camera sees, by number; the elements of `marked` are white.
    pub fn items(&self, camera: &Camera, marked: NodeId, side: u32) -> Result<RgbImage> {
        let marked = self.mesh.elements_of(marked);
        let is_marked = |item: &Item| item.is_some_and(|e| marked.contains(&e));
        let paint = |item| if is_marked(&item) { [255; 3] } else { self.colour_of(item) };
        let items = item_buffer(camera, self.mesh, 2 * side)?;
        Ok(shrunk(items.into_iter().map(paint), side))
    }

    /// What a hemicube sees, in the same colours.
    pub fn hemicube(&self, hemicube: &Hemicube, side: u32) -> RgbImage {
        let paint = |(k, &item)| match hemicube.delta_index(k) {
            Some(_) => self.colour_of(item),
            None => [255; 3],
        };
        shrunk(hemicube.items.iter().enumerate().map(paint), side)
    }

    /// The hue of its patch, in one of four shades.
    fn colour_of(&self, item: Item) -> [u8; 3] {
        let Some(element) = item else { return [0; 3] };
        // Hues of patches that follow each other are far apart: steps by the golden ratio.
        let hue = 6.0 * (self.patch_of[element] as f64 * 0.618_034).fract();
        let first = self.mesh.elements_of(self.patches[self.patch_of[element]]).start;
        let shade = [255.0, 215.0, 175.0, 135.0][(element - first) % 4];
        [0.0, 2.0, 4.0].map(|channel| {
            let turn = (hue - channel).rem_euclid(6.0);
            let strength = (2.0 - turn.min(6.0 - turn)).clamp(0.15, 1.0);
            (shade * strength) as u8
        })
    }
}

/// What the camera sees of the light on a surface.
pub fn light(
    camera: &Camera,
    surface: &VertexMesh,
    side: u32,
    tone: &ToneCurve,
) -> Result<RgbImage> {
    let image = camera.image(surface, side, side, 4)?;
    Ok(square(image.pixels.iter().map(|&radiance| tone.display(radiance))))
}

/// From blue at -1 over white at 0 to red at 1.
pub fn false_colour(value: f64) -> [u8; 3] {
    let end = if value > 0.0 { [178.0, 24.0, 43.0] } else { [33.0, 102.0, 172.0] };
    end.map(|channel| (255.0 + value.abs().min(1.0) * (channel - 255.0)) as u8)
}

/// A square picture of these pixels, row by row from the top.
fn square(pixels: impl Iterator<Item = [u8; 3]>) -> RgbImage {
    let pixels: Vec<[u8; 3]> = pixels.collect();
    let side = pixels.len().isqrt() as u32;
    RgbImage::from_fn(side, side, |x, y| Pixel(pixels[(y * side + x) as usize]))
}

/// The same with fewer pixels, each the mean of several: smooth edges.
fn shrunk(pixels: impl Iterator<Item = [u8; 3]>, side: u32) -> RgbImage {
    imageops::resize(&square(pixels), side, side, FilterType::Triangle)
}

/// The same with more pixels, each as it is.
pub fn enlarged(pixels: impl Iterator<Item = [u8; 3]>, side: u32) -> RgbImage {
    imageops::resize(&square(pixels), side, side, FilterType::Nearest)
}
