//! Images on surfaces: colours of texels, looked up at a point and averaged over a triangle.
//!
//! ```text
//!   v                            texels (column, row), row 0 at the top: v = 1
//!   ▲  ┌──┬──┬──┬──┐             level 1: means of up to 2 × 2 of them
//!   │  ├──┼──┼──┼──┤             level 2: of up to 4 × 4, … to one for all
//!   └──────► u
//! ```
//!
//! A mean takes texels as squares of one colour. A look-up interpolates linearly between the
//! centres of texels, for pictures.

mod triangle_mean;

use std::sync::{Arc, OnceLock};

use glam::{DAffine2, DVec2};

use super::rgb::Rgb;
use triangle_mean::RowSums;

/// An image, 8 bits per channel, sRGB.
pub struct Texture {
    width: u32,
    height: u32,
    texels: Vec<[u8; 3]>,
    /// Linear means, level 1 first.
    levels: Vec<Level>,
    /// Of each level, level 0 first.
    row_sums: Vec<RowSums>,
}

struct Level {
    width: u32,
    means: Vec<[f32; 3]>,
}

/// Maximum number of cells along the outline of a triangle: cells cut by the outline at that size
/// count with their mean. Each extends half a cell beyond it: if the texture has its edges there
/// too, the mean of a triangle about as wide as high is off by at most 5e-3 of their contrast, and
/// by 1e-4 if cells differ.
pub(super) const MAX_OUTLINE_CELLS: f64 = 1500.0;

impl Texture {
    /// An image of `width` × `height` texels, at least one, rows from the top: sRGB, 8 bits per
    /// channel (IEC 61966-2-1). `None` when the number of texels differs.
    pub fn new(width: u32, height: u32, texels: Vec<[u8; 3]>) -> Option<Texture> {
        if texels.is_empty() || texels.len() as u64 != u64::from(width) * u64::from(height) {
            return None;
        }
        let mut texture = Texture { width, height, texels, levels: vec![], row_sums: vec![] };
        while texture.levels.last().map_or(texture.texels.len(), |l| l.means.len()) > 1 {
            let next = texture.coarser();
            texture.levels.push(next);
        }
        let sums = |level: usize| {
            let cell = |x, y| texture.cell(level, x, y);
            let (texels, cells) = (texture.size(), texture.level_size(level));
            RowSums::new(texels, cells, 2f64.powi(level as i32), cell)
        };
        texture.row_sums = (0..=texture.levels.len()).map(sums).collect();
        Some(texture)
    }

    /// Texels along u and v.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// Linear mean of all texels.
    pub fn whole_mean(&self) -> Rgb {
        self.cell(self.levels.len(), 0, 0)
    }

    /// Linear colour at `uv`, interpolated between the centres of the four texels around it. Beyond
    /// 0 and 1 the image repeats, or, `clamped`, continues with its border.
    pub fn at(&self, uv: DVec2, clamped: bool) -> Rgb {
        self.filtered(uv, 0.0, clamped)
    }

    /// Linear colour of the texel that contains `uv`.
    pub(super) fn texel_at(&self, uv: DVec2, clamped: bool) -> Rgb {
        let uv = if clamped { uv.clamp(DVec2::ZERO, DVec2::ONE) } else { uv - uv.floor() };
        let [x, y] = [(uv.x, self.width), (1.0 - uv.y, self.height)]
            .map(|(position, count)| ((position * f64::from(count)) as u32).min(count - 1));
        self.cell(0, x, y)
    }

    /// Linear colour of a texel, by column and row.
    pub(super) fn texel(&self, [x, y]: [u32; 2]) -> Rgb {
        self.cell(0, x, y)
    }

    /// Whether both are the same image.
    pub(super) fn has_texels_of(&self, other: &Texture) -> bool {
        std::ptr::eq(self, other) || self.width == other.width && self.texels == other.texels
    }

    /// All texels as bytes, rows from the top.
    pub(crate) fn bytes(&self) -> &[u8] {
        self.texels.as_flattened()
    }

    /// The same from a level whose texels cover at most `area` of the image; 1 is all of it. (L.
    /// Williams, "Pyramidal parametrics", SIGGRAPH 1983)
    fn filtered(&self, uv: DVec2, area: f64, clamped: bool) -> Rgb {
        if !uv.is_finite() {
            return self.whole_mean();
        }
        let texels = area * f64::from(self.width) * f64::from(self.height);
        let level = (0.5 * libm::log2(texels)).max(0.0).min(self.levels.len() as f64) as usize;
        let [columns, rows] = self.level_size(level);
        let size = DVec2::new(self.width.into(), self.height.into()) * 0.5f64.powi(level as i32);
        let uv = if clamped { uv.clamp(DVec2::ZERO, DVec2::ONE) } else { uv - uv.floor() };
        let position = DVec2::new(uv.x, 1.0 - uv.y) * size - 0.5;
        let (first, part) = (position.floor(), position - position.floor());
        let wrapped = |k: f64, count: u32| -> u32 {
            let count = i64::from(count);
            let k = k as i64;
            (if clamped { k.clamp(0, count - 1) } else { k.rem_euclid(count) }) as u32
        };
        let texel = |dx: f64, dy: f64| {
            let x = wrapped(first.x + dx, columns);
            self.cell(level, x, wrapped(first.y + dy, rows))
        };
        let top = texel(0.0, 0.0).lerp(texel(1.0, 0.0), part.x);
        top.lerp(texel(0.0, 1.0).lerp(texel(1.0, 1.0), part.x), part.y)
    }

    /// Linear mean over the triangle with these corners in texture space. If it has no area, the
    /// colour at its middle.
    pub fn mean(&self, corners: [DVec2; 3], clamped: bool) -> Rgb {
        self.mean_by_cells(corners, clamped, MAX_OUTLINE_CELLS)
    }

    /// The same, with a limit of `cells` for cells along the triangle's outline.
    pub(super) fn mean_by_cells(&self, corners: [DVec2; 3], clamped: bool, cells: f64) -> Rgb {
        let [a, b, c] = corners;
        let area = (b - a).perp_dot(c - a);
        if !area.is_finite() || area == 0.0 {
            return self.at((a + b + c) / 3.0, clamped);
        }
        let size = DVec2::new(self.width.into(), self.height.into());
        // Relative to the tile of the lowest corner, so that no digits are lost far out.
        let origin = if clamped { DVec2::ZERO } else { a.min(b).min(c).floor() };
        let in_texels = |p: DVec2| DVec2::new(p.x - origin.x, 1.0 - (p.y - origin.y)) * size;
        let outline = [a - b, b - c, c - a].map(|edge| (edge * size).length()).iter().sum::<f64>();
        let level = libm::log2(outline / cells).max(0.0).min(self.levels.len() as f64) as usize;
        // Twice that of a square with this outline, if cells are not larger than the image.
        let crossings = 4.0 * cells;
        let cell = |x, y| self.cell(level, x, y);
        let sums = &self.row_sums[level];
        match sums.mean(corners.map(in_texels), clamped, crossings, cell) {
            Some(mean) => mean,
            None if outline / size.min_element() > cells => self.whole_mean(),
            None => self.sampled_mean(corners, clamped),
        }
    }

    /// The mean of points spread evenly over a triangle.
    fn sampled_mean(&self, corners: [DVec2; 3], clamped: bool) -> Rgb {
        let n = 48;
        spread_over(corners, n).map(|uv| self.at(uv, clamped)).sum::<Rgb>() / f64::from(n * n)
    }

    /// Linear mean of a cell: a texel at level 0.
    fn cell(&self, level: usize, x: u32, y: u32) -> Rgb {
        let index = |width: u32| y as usize * width as usize + x as usize;
        match level {
            0 => linear_colour(self.texels[index(self.width)]),
            _ => {
                let level = &self.levels[level - 1];
                Rgb::from_array(level.means[index(level.width)].map(f64::from))
            }
        }
    }

    fn level_size(&self, level: usize) -> [u32; 2] {
        [self.width, self.height].map(|n| n.div_ceil(1 << level.min(31)))
    }

    /// The level after the last: means of up to 2 × 2 cells, weighted by their numbers of texels.
    fn coarser(&self) -> Level {
        let from = self.levels.len();
        let [width, height] = self.level_size(from + 1);
        let [inner_width, inner_height] = self.level_size(from);
        let extent = |k: u32, count: u32| {
            let start = u64::from(k) << from;
            (u64::from(count).min(start + (1 << from)) - start) as f64
        };
        let mut means = Vec::with_capacity(width as usize * height as usize);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let (mut sum, mut count) = (Rgb::ZERO, 0.0);
            for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let [x, y] = [2 * x + i, 2 * y + j];
                if x < inner_width && y < inner_height {
                    let texels = extent(x, self.width) * extent(y, self.height);
                    sum += texels * self.cell(from, x, y);
                    count += texels;
                }
            }
            means.push((sum / count).as_vec3().to_array());
        }
        Level { width, means }
    }
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({} × {})", self.width, self.height)
    }
}

/// `n`² points spread evenly over a triangle: a square of them folded onto it.
pub(super) fn spread_over([a, b, c]: [DVec2; 3], n: u32) -> impl Iterator<Item = DVec2> {
    (0..n).flat_map(move |i| (0..n).map(move |j| [i, j])).map(move |ij| {
        let [mut s, mut t] = ij.map(|k| (f64::from(k) + 0.5) / f64::from(n));
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        a + s * (b - a) + t * (c - a)
    })
}

/// Linear colour of an 8-bit sRGB texel.
fn linear_colour(texel: [u8; 3]) -> Rgb {
    Rgb::from_array(texel.map(|s| linear()[s as usize]))
}

/// Linear value of an 8-bit sRGB channel.
#[cfg(all(feature = "glb", feature = "textures"))]
pub(crate) fn linear_of_srgb(code: u8) -> f64 {
    linear()[code as usize]
}

/// Linear values of 8-bit sRGB.
fn linear() -> &'static [f64; 256] {
    static LINEAR: OnceLock<[f64; 256]> = OnceLock::new();
    LINEAR.get_or_init(|| {
        std::array::from_fn(|k| {
            let x = k as f64 / 255.0;
            if x <= 0.04045 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) }
        })
    })
}

/// A texture in use by a material.
#[derive(Clone, Debug)]
pub struct TextureMap {
    /// The image.
    pub texture: Arc<Texture>,
    /// Factor of its colours, per channel.
    pub factor: Rgb,
    /// Upper limit of a point if the material's mean is changed: the largest reflectance, infinite
    /// for light.
    pub ceiling: f64,
    /// Mean over the triangles of the material, per channel.
    pub mean: Rgb,
    /// From texture coordinates of a corner to those of the image.
    pub placement: DAffine2,
    /// Whether the image continues with its border beyond 0 and 1 instead of repeating.
    pub clamped: bool,
}

impl TextureMap {
    /// `texture` with a factor of 1, where the coordinates are; repeated.
    pub fn new(texture: Arc<Texture>) -> TextureMap {
        let (factor, ceiling, mean) = (Rgb::ONE, f64::MAX, Rgb::ONE);
        let placement = DAffine2::IDENTITY;
        TextureMap { texture, factor, ceiling, mean, placement, clamped: false }
    }

    /// Where texture coordinates as in the file are in the image.
    pub(crate) fn placed(&self, uv: DVec2) -> DVec2 {
        self.placement.transform_point2(uv)
    }

    /// The value at texture coordinates as in the file.
    pub fn at(&self, uv: DVec2) -> Rgb {
        self.value(self.texture.at(self.placed(uv), self.clamped))
    }

    /// The value of the texel that contains texture coordinates as in the file.
    pub(crate) fn texel(&self, uv: DVec2) -> Rgb {
        self.value(self.texture.texel_at(self.placed(uv), self.clamped))
    }

    /// The value at texture coordinates as in the file, filtered over `area` of them.
    pub(crate) fn filtered(&self, uv: DVec2, area: f64) -> Rgb {
        let area = area * self.placement.matrix2.determinant().abs();
        self.value(self.texture.filtered(self.placed(uv), area, self.clamped))
    }

    /// The mean over a triangle with these texture coordinates, as in the file.
    pub fn mean(&self, corners: [DVec2; 3]) -> Rgb {
        self.mean_by_cells(corners, MAX_OUTLINE_CELLS)
    }

    /// The same, with at most `cells` cells of the image along the triangle's outline.
    pub(super) fn mean_by_cells(&self, corners: [DVec2; 3], cells: f64) -> Rgb {
        let corners = corners.map(|uv| self.placed(uv));
        self.value(self.texture.mean_by_cells(corners, self.clamped, cells))
    }

    /// The mean of the whole image.
    pub fn whole_mean(&self) -> Rgb {
        self.value(self.texture.whole_mean())
    }

    pub(super) fn value(&self, colour: Rgb) -> Rgb {
        self.factor * colour
    }

    /// The map's `value` rescaled for `mean` as the mean over the triangles of the material. A map
    /// that is 0 everywhere becomes constant.
    pub(crate) fn scaled(&self, value: Rgb, mean: Rgb) -> Rgb {
        let relative = Rgb::select(self.mean.cmpgt(Rgb::ZERO), value / self.mean, Rgb::ONE);
        (mean * relative).min(Rgb::splat(self.ceiling))
    }
}

/// The textures of a material.
#[derive(Clone, Debug, Default)]
pub struct MaterialTextures {
    /// Of its reflectance.
    pub reflectance: Option<TextureMap>,
    /// Of its exitance, W/m².
    pub exitance: Option<TextureMap>,
    /// Solid parts, white; black is a hole.
    pub mask: Option<TextureMap>,
}

impl MaterialTextures {
    /// All of its images.
    pub(super) fn images(&self) -> impl Iterator<Item = &Texture> {
        let maps = [&self.reflectance, &self.exitance, &self.mask];
        maps.into_iter().flatten().map(|map| &*map.texture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels of noise, and their linear value.
    fn noise(width: u32, height: u32) -> Texture {
        let mut state = 7u64;
        let texel = |_| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            [(state >> 56) as u8, (state >> 48) as u8, (state >> 40) as u8]
        };
        Texture::new(width, height, (0..width * height).map(texel).collect()).unwrap()
    }

    /// Black on the left, white on the right.
    fn two_halves(side: u32) -> Texture {
        let texel = |k| [if k % side < side / 2 { 0 } else { 255 }; 3];
        Texture::new(side, side, (0..side * side).map(texel).collect()).unwrap()
    }

    /// The two triangles of a rectangle, and their mean.
    fn rectangle(texture: &Texture, low: DVec2, high: DVec2) -> Rgb {
        let [b, d] = [DVec2::new(high.x, low.y), DVec2::new(low.x, high.y)];
        0.5 * (texture.mean([low, b, high], false) + texture.mean([low, high, d], false))
    }

    #[test]
    fn rectangles_of_texels_have_the_mean_of_these() {
        // Means are kept in 24 bits, and are sums of thousands: 1e-6.
        for (width, height) in [(8, 8), (5, 3), (1, 7), (37, 64)] {
            let texture = noise(width, height);
            let size = DVec2::new(width.into(), height.into());
            let (across, down) = (width.div_ceil(2), height.div_ceil(3));
            let mut sum = Rgb::ZERO;
            for (x, y) in (0..across).flat_map(|x| (0..down).map(move |y| (x, y))) {
                sum += texture.cell(0, x, y);
            }
            let mean = sum / f64::from(across * down);
            let position = |x: u32, y: u32| {
                let p = DVec2::new(x.into(), y.into()) / size;
                DVec2::new(p.x, 1.0 - p.y)
            };
            let (low, high) = (position(0, down), position(across, 0));
            for shift in [DVec2::ZERO, DVec2::new(3.0, -2.0)] {
                let found = rectangle(&texture, low + shift, high + shift);
                assert!(found.abs_diff_eq(mean, 1e-6), "{width} × {height}: {found} {mean}");
            }
            let all = rectangle(&texture, DVec2::splat(-1.0), DVec2::splat(2.0));
            assert!(all.abs_diff_eq(texture.whole_mean(), 1e-6));
        }
    }

    #[test]
    fn mean_over_any_triangle_is_that_of_many_points() {
        let texture = noise(16, 11);
        let corners = [DVec2::new(-0.4, 0.2), DVec2::new(1.7, 0.35), DVec2::new(0.4, 2.2)];
        let [a, b, c] = corners;
        let n = 2000;
        for clamped in [false, true] {
            let (mut sum, mut count) = (Rgb::ZERO, 0.0);
            for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
                let [s, t] = [i, j].map(|k| (f64::from(k) + 1.0 / 3.0) / f64::from(n));
                sum += texture.texel_at(a + s * (b - a) + t * (c - a), clamped);
                count += 1.0;
            }
            // Points on texels that an edge cuts: some 100 texels of contrast 1, a 2000th off each.
            let mean = texture.mean(corners, clamped);
            assert!(mean.abs_diff_eq(sum / count, 1e-3), "{mean} {}", sum / count);
        }
        // As does turning the other way round, to rounding.
        let mirrored = texture.mean([a, c, b], false);
        assert!(mirrored.abs_diff_eq(texture.mean(corners, false), 1e-12));
    }

    #[test]
    fn few_cells_along_the_outline_are_enough() {
        let (grey, halves) = (noise(512, 512), two_halves(512));
        let corners = [DVec2::new(0.1, 0.2), DVec2::new(1.7, 0.35), DVec2::new(0.4, 2.2)];
        // As thin as a texel, along the edge of the halves.
        let thin = [DVec2::new(0.499, 0.0), DVec2::new(0.5, 30.0), DVec2::new(0.501, 0.0)];
        // Of noise with a standard deviation of 0.3, a thin piece is some 512 texels in a row, and
        // cells see their neighbours, too: 3 × 0.3 / √512.
        for (texture, corners, tolerance, usual_tolerance) in [
            (&grey, corners, 2e-3, 1e-4),
            (&halves, corners, 1e-2, 1e-4),
            (&grey, thin, 4e-2, 4e-2),
            (&halves, thin, 1e-2, 1e-4),
        ] {
            let exact = texture.mean_by_cells(corners, false, 1e9);
            let coarse = texture.mean_by_cells(corners, false, 64.0);
            assert!(coarse.abs_diff_eq(exact, tolerance), "{coarse} {exact}");
            let usual = texture.mean(corners, false);
            assert!(usual.abs_diff_eq(exact, usual_tolerance), "{usual} {exact}");
        }
    }

    #[test]
    fn large_noise_has_its_mean_over_a_large_triangle() {
        let texture = noise(4096, 4096);
        let found = texture.mean([DVec2::ZERO, DVec2::X, DVec2::ONE], false);
        // Of 8e6 texels with a standard deviation of 0.3: 1e-4, and the same of all.
        assert!(found.abs_diff_eq(texture.whole_mean(), 5e-4), "{found}");
    }

    #[test]
    fn borders_repeat_or_go_on() {
        let texture = Texture::new(2, 1, vec![[0; 3], [255; 3]]).unwrap();
        let at = |u, clamped| texture.at(DVec2::new(u, 0.5), clamped).x;
        assert_eq!([at(0.25, false), at(0.75, false), at(0.5, false)], [0.0, 1.0, 0.5]);
        assert_eq!([at(0.0, false), at(1.25, false), at(-0.25, false)], [0.5, 0.0, 1.0]);
        assert_eq!([at(-3.0, true), at(9.0, true), at(0.0, true)], [0.0, 1.0, 0.0]);
        // Up is +v: row 0 is at the top.
        let texture = Texture::new(1, 2, vec![[255; 3], [0; 3]]).unwrap();
        assert_eq!(texture.at(DVec2::new(0.5, 0.75), true).x, 1.0);
        let beyond = [DVec2::new(0.0, 1.5), DVec2::new(1.0, 1.5), DVec2::new(0.0, 9.0)];
        assert!(texture.mean(beyond, true).abs_diff_eq(Rgb::ONE, 1e-12));
    }

    #[test]
    fn odd_triangles_have_a_colour() {
        let texture = noise(4, 4);
        let point = DVec2::new(0.3, 0.4);
        let mean = texture.mean([point; 3], false);
        assert!(mean.abs_diff_eq(texture.at(point, false), 1e-12));
        let far = [DVec2::ZERO, DVec2::new(1e9, 0.0), DVec2::new(0.0, 1e9)];
        assert_eq!(texture.mean(far, false), texture.whole_mean());
        assert_eq!(texture.mean([DVec2::NAN; 3], false), texture.whole_mean());
        assert!(Texture::new(0, 0, vec![]).is_none() && Texture::new(2, 2, vec![[0; 3]]).is_none());
    }
}
