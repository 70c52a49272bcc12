//! Cut-outs: holes in triangles, given by the mask of their material.
//!
//! ```text
//!   ■■□□■    ■ solid: it blocks, reflects, emits and receives
//!   ■□□■■    □ a hole: empty
//! ```
//!
//! A mask is a texture of white (solid) and black texels, which are squares without interpolation.
//! So the solid fraction of a piece of a triangle is the mean of the mask over it, and the area
//! used for light is this fraction of the geometric one. Triangles that lack texture coordinates at
//! a corner are solid.

use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::FILE_TOLERANCE;
use crate::geometry::barycentric::WHOLE;
use glam::DVec2;

use super::Scene;
use super::rgb::Rgb;
use super::scene_textures::SceneTextures;
use super::texture::{MAX_OUTLINE_CELLS, TextureMap, spread_over};
use super::textured::Piece;

impl Scene {
    /// Area of triangle `t` without its holes, length unit squared: the area used for light.
    pub fn solid_area(&self, t: usize) -> f64 {
        let area = self.area(t);
        self.textures.solid_shares.get(t).map_or(area, |share| share * area)
    }

    /// Whether triangle `t` is solid at the point with these weights of its second and third
    /// corner.
    pub fn is_solid(&self, t: usize, barycentric: [f64; 2]) -> bool {
        self.mask(t).is_none_or(|mask| mask.is_solid(self.texture_point(t, barycentric)))
    }

    /// Whether any material has a mask.
    pub(crate) fn has_cut_outs(&self) -> bool {
        !self.textures.solid_shares.is_empty()
    }

    /// All masks, by the indices of their materials.
    pub(crate) fn masks(&self) -> impl Iterator<Item = (u32, &TextureMap)> {
        let all = self.textures.of_materials.iter();
        all.filter_map(|(&m, textures)| Some((m, textures.mask.as_ref()?)))
    }

    /// The mask of triangle `t`; none where it is solid.
    pub(crate) fn mask(&self, t: usize) -> Option<&TextureMap> {
        if self.has_cut_outs() { self.textures(t)?.mask.as_ref() } else { None }
    }

    /// The first of `places` on triangle `t`, weights of its second and third corner, that is
    /// solid.
    pub(crate) fn first_solid(
        &self,
        t: usize,
        places: impl IntoIterator<Item = [f64; 2]>,
    ) -> Option<[f64; 2]> {
        places.into_iter().find(|&place| self.is_solid(t, place))
    }

    /// The solid fraction of each of `pieces`, in [0, 1].
    pub(crate) fn solid_shares(&self, pieces: &[Piece]) -> Vec<f64> {
        let share = |mask: &TextureMap, _: Option<&TextureMap>, place: [DVec2; 3], cells: f64| {
            mask.solid_share(place, cells)
        };
        let shares = self.of_pieces(pieces, |textures| textures.mask.as_ref(), share);
        shares.into_iter().map(|share| share.unwrap_or(1.0)).collect()
    }

    /// The same for one piece.
    pub(crate) fn solid_share(&self, (t, corners): Piece) -> f64 {
        let place = || corners.map(|corner| self.texture_point(t, corner));
        self.mask(t).map_or(1.0, |mask| mask.solid_share(place(), MAX_OUTLINE_CELLS))
    }

    /// Computes the solid fractions of all triangles from their textures.
    pub(super) fn find_solid_shares(&mut self) {
        let pieces: Vec<Piece> = (0..self.triangles.len()).map(|t| (t, WHOLE)).collect();
        let solid_shares = self.solid_shares(&pieces);
        self.textures = SceneTextures { solid_shares, ..(*self.textures).clone() }.into();
    }

    /// Whether triangle `s` of `other`, whose corners have these weights in triangle `t`, is solid
    /// wherever `t` is: it has no holes, or those of `t`.
    pub(crate) fn has_no_other_holes(
        &self,
        t: usize,
        (other, s): (&Scene, usize),
        corners: [[f64; 2]; 3],
    ) -> bool {
        let Some(mask) = other.mask(s) else { return true };
        let of_t = corners.map(|corner| self.texture_point(t, corner));
        let of_s = WHOLE.map(|corner| other.texture_point(s, corner));
        let near =
            |(a, b): (&DVec2, &DVec2)| a.abs_diff_eq(*b, FILE_TOLERANCE * (1.0 + b.length()));
        self.mask(t).is_some_and(|of_t| of_t.has_holes_of(mask)) && of_t.iter().zip(&of_s).all(near)
    }
}

impl TextureMap {
    /// Of a mask: whether the texel at `uv` is solid; points without coordinates are.
    pub(crate) fn is_solid(&self, uv: DVec2) -> bool {
        !uv.is_finite() || self.texel(uv) != Rgb::ZERO
    }

    /// The position of texture coordinates, as in the file, in texels, rows from the top.
    pub(crate) fn in_texels(&self, uv: DVec2) -> DVec2 {
        let [width, height] = self.texture.size().map(f64::from);
        let place = self.placed(uv);
        DVec2::new(place.x * width, (1.0 - place.y) * height)
    }

    /// Whether each texel is solid, rows from the top.
    pub(crate) fn solid_texels(&self) -> impl Iterator<Item = bool> + '_ {
        let [width, height] = self.texture.size();
        let texels = (0..height).flat_map(move |y| (0..width).map(move |x| [x, y]));
        texels.map(|at| self.value(self.texture.texel(at)) != Rgb::ZERO)
    }

    /// The solid fraction of a mask over a triangle with these texture coordinates, in [0, 1], with
    /// at most `cells` cells of the image along the triangle's outline.
    fn solid_share(&self, corners: [DVec2; 3], cells: f64) -> f64 {
        if !corners.iter().all(|corner| corner.is_finite()) {
            return 1.0;
        }
        let [a, b, c] = corners.map(|uv| self.placed(uv));
        let share = if (b - a).perp_dot(c - a) != 0.0 {
            self.texture.mean_by_cells([a, b, c], self.clamped, cells).x
        } else {
            let places = spread_over(corners, points_across(cells));
            let (all, solid) = places.fold((0.0, 0.0), |(all, solid), uv| {
                (all + 1.0, solid + f64::from(u8::from(self.is_solid(uv))))
            });
            solid / all
        };
        match share {
            share if share < COINCIDENCE_TOLERANCE => 0.0,
            share if share > 1.0 - COINCIDENCE_TOLERANCE => 1.0,
            share => share,
        }
    }

    /// The mean over the part of a triangle with these texture coordinates that is solid by `mask`,
    /// if any is.
    pub(super) fn mean_where_solid(
        &self,
        mask: &TextureMap,
        corners: [DVec2; 3],
        cells: f64,
    ) -> Option<Rgb> {
        match mask.solid_share(corners, cells) {
            0.0 => None,
            1.0 => Some(self.mean_by_cells(corners, cells)),
            _ => {
                let solid =
                    spread_over(corners, points_across(cells)).filter(|&uv| mask.is_solid(uv));
                let (sum, count) = solid
                    .fold((Rgb::ZERO, 0.0), |(sum, count), uv| (sum + self.texel(uv), count + 1.0));
                (count > 0.0).then(|| sum / count)
            }
        }
    }

    /// Whether this mask has the holes of another, for the same texture coordinates.
    fn has_holes_of(&self, other: &TextureMap) -> bool {
        self.texture.has_texels_of(&other.texture)
            && (self.placement, self.clamped) == (other.placement, other.clamped)
    }
}

/// Points on the sides of a triangle's square of points, for `cells` cells along its outline.
fn points_across(cells: f64) -> u32 {
    (48.0 * cells / MAX_OUTLINE_CELLS).clamp(8.0, 48.0) as u32
}
