//! Textures on the triangles of a scene: reflectance and exitance of points and of pieces.
//!
//! ```text
//!   texture ── mean over all triangles of the material ──► Material::reflectance, ρ̄
//!      ├────── mean over a piece of a triangle ÷ mean of all, × ρ̄ ──► ρ of an element
//!      └────── look-up at a point ÷ mean of all, × ρ̄ ──────────────► ρ of a point
//! ```
//!
//! A texture gives the distribution of reflectance, the material its mean: a changed material
//! scales its texture. Emission is the mean over each triangle, in the same way.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::texture::{MAX_OUTLINE_CELLS, MaterialTextures, TextureMap};
use super::{Rgb, Scene};
use crate::geometry::barycentric::WHOLE;
use crate::geometry::barycentric::barycentric;

/// A piece of a triangle: its index, and the weights of the second and third corner of the triangle
/// at the three corners of the piece.
pub(crate) type Piece = (usize, [[f64; 2]; 3]);

impl Scene {
    /// Texture coordinates (u, v) of the corners of triangle `t`, as in the file; `None` if the
    /// scene has no textures, unless they were [kept](crate::SceneSettings::texture_coordinates).
    /// Not finite for a corner without them.
    pub fn texture_coordinates(&self, t: usize) -> Option<[DVec2; 3]> {
        self.textures.coordinates.get(t).copied()
    }

    /// Textures of triangle `t`; `None` if its material has none.
    pub fn textures(&self, t: usize) -> Option<&MaterialTextures> {
        self.textures.of_materials.get(&self.triangles[t].material)
    }

    /// Reflectance per channel at the point of triangle `t` with these weights of its second and
    /// third corner: from the texture, if there is one.
    pub fn reflectance_at(&self, t: usize, barycentric: [f64; 2]) -> Rgb {
        self.reflectance_around(t, barycentric, 0.0)
    }

    /// The same, filtered over a fraction of the triangle's area.
    pub(crate) fn reflectance_around(&self, t: usize, barycentric: [f64; 2], share: f64) -> Rgb {
        let map = self.textures(t).and_then(|textures| textures.reflectance.as_ref());
        let colour = self.colour(t, barycentric);
        self.filtered(t, map, self.material(t).reflectance, barycentric, share, colour)
    }

    /// The colour that a textured reflectance is multiplied by at a point: of vertices, or white.
    pub(super) fn colour(&self, t: usize, [u, v]: [f64; 2]) -> Rgb {
        let of_point = |&[a, b, c]: &[Vec3; 3]| {
            let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
            a * (1.0 - u - v) + b * u + c * v
        };
        self.textures.colours.get(t).map_or(Rgb::ONE, of_point)
    }

    /// The fraction of the light arriving around a point that is scattered diffusely, on either
    /// side, per channel: for a textured material it is proportional to the reflectance.
    pub(crate) fn albedo_around(&self, t: usize, barycentric: [f64; 2], share: f64) -> Rgb {
        let (material, reflectance) =
            (self.material(t), self.reflectance_around(t, barycentric, share));
        if !material.is_translucent() {
            return reflectance;
        }
        let has_mean = material.reflectance.cmpgt(Rgb::ZERO);
        let relative = Rgb::select(has_mean, reflectance / material.reflectance, Rgb::ONE);
        reflectance + material.transmittance * relative
    }

    /// Exitance per channel, W/m², at the point of triangle `t` with these weights of its second
    /// and third corner: from the texture, if there is one.
    pub fn exitance_at(&self, t: usize, barycentric: [f64; 2]) -> Rgb {
        self.exitance_around(t, barycentric, 0.0)
    }

    /// The same, filtered over a fraction of the triangle's area.
    pub(crate) fn exitance_around(&self, t: usize, barycentric: [f64; 2], share: f64) -> Rgb {
        let map = self.textures(t).and_then(|textures| textures.exitance.as_ref());
        self.filtered(t, map, self.material(t).exitance, barycentric, share, Rgb::ONE)
    }

    /// The value of `map` times `colour` at a point of triangle `t`, filtered over a fraction of
    /// its area, for this `mean` of the material; the mean if there is no map.
    fn filtered(
        &self,
        t: usize,
        map: Option<&TextureMap>,
        mean: Rgb,
        barycentric: [f64; 2],
        share: f64,
        colour: Rgb,
    ) -> Rgb {
        let Some(map) = map else { return mean };
        let [a, b, c] = WHOLE.map(|corner| self.texture_point(t, corner));
        let area = share * 0.5 * (b - a).perp_dot(c - a).abs();
        map.scaled(colour * map.filtered(self.texture_point(t, barycentric), area), mean)
    }

    /// Exitance per channel, W/m², with which triangle `t` lights others: that of its material, or
    /// the mean of the texture over the triangle.
    pub fn exitance(&self, t: usize) -> Rgb {
        let mean = self.material(t).exitance;
        self.textures.relative_exitance.get(t).map_or(mean, |relative| mean * relative)
    }

    /// Whether any material has a texture.
    pub(crate) fn has_textures(&self) -> bool {
        !self.textures.of_materials.is_empty()
    }

    /// Whether any material has a texture of its reflectance.
    pub(crate) fn has_textured_reflectance(&self) -> bool {
        self.textures.of_materials.values().any(|textures| textures.reflectance.is_some())
    }

    /// Mean reflectance per channel of each of `pieces`.
    pub(crate) fn mean_reflectances(&self, pieces: &[Piece]) -> Vec<Rgb> {
        let means = self.reflectance_means(pieces);
        let scaled = |(&(t, _), mean): (&Piece, Option<Rgb>)| {
            let whole = self.material(t).reflectance;
            let map = self.textures(t).and_then(|textures| textures.reflectance.as_ref());
            map.zip(mean).map_or(whole, |(map, mean)| map.scaled(mean, whole))
        };
        pieces.iter().zip(means).map(scaled).collect()
    }

    /// Mean of the texture of reflectance over the solid part of each of `pieces`, times the mean
    /// of the colours of vertices; none for those without one. Exact unless both differ on a piece.
    fn reflectance_means(&self, pieces: &[Piece]) -> Vec<Option<Rgb>> {
        let mut means = self.solid_means(pieces, |textures| textures.reflectance.as_ref());
        for (mean, &(t, [a, b, c])) in means.iter_mut().zip(pieces) {
            let middle = [0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0);
            *mean = mean.map(|mean| mean * self.colour(t, middle));
        }
        means
    }

    /// Gives materials the means of their textures.
    pub(super) fn lay_textures(&mut self) {
        let has_masks = self.textures.of_materials.values().any(|maps| maps.mask.is_some());
        let pieces: Vec<Piece> = (0..self.triangles.len()).map(|t| (t, WHOLE)).collect();
        if has_masks {
            self.find_solid_shares();
        }
        let reflected = self.reflectance_means(&pieces);
        let emitted = self.solid_means(&pieces, |textures| textures.exitance.as_ref());
        let reflectances = self.means_of_materials(&reflected);
        let exitances = self.means_of_materials(&emitted);
        let mut textures = (*self.textures).clone();
        for (&m, maps) in &mut textures.of_materials {
            let material = &mut self.materials[m as usize];
            if let Some(map) = &mut maps.reflectance {
                let given = map.mean;
                map.mean = reflectances.get(&m).copied().unwrap_or(map.whole_mean());
                material.reflectance = map.mean;
                if material.is_translucent() {
                    let has_mean = given.cmpgt(Rgb::ZERO);
                    material.transmittance *= Rgb::select(has_mean, map.mean / given, Rgb::ZERO);
                }
            }
            if let Some(map) = &mut maps.exitance {
                map.mean = exitances.get(&m).copied().unwrap_or(map.whole_mean());
                material.exitance = map.mean;
            }
        }
        if emitted.iter().any(Option::is_some) {
            let relative = |(t, mean): (usize, &Option<Rgb>)| {
                let maps = textures.of_materials.get(&self.triangles[t].material);
                let map = maps.and_then(|maps| maps.exitance.as_ref());
                map.zip(*mean).map_or(Rgb::ONE, |(map, mean)| map.scaled(mean, Rgb::ONE))
            };
            textures.relative_exitance = emitted.iter().enumerate().map(relative).collect();
        }
        self.textures = textures.into();
    }

    /// Mean over all triangles of each material of a value per triangle.
    fn means_of_materials(&self, of_triangles: &[Option<Rgb>]) -> BTreeMap<u32, Rgb> {
        let mut sums: BTreeMap<u32, (Rgb, f64)> = BTreeMap::new();
        for (t, mean) in of_triangles.iter().enumerate() {
            if let Some(mean) = mean {
                let (sum, area) = sums.entry(self.triangles[t].material).or_default();
                *sum += self.solid_area(t) * *mean;
                *area += self.solid_area(t);
            }
        }
        let seen = sums.into_iter().filter(|(_, (_, area))| *area > 0.0);
        seen.map(|(m, (sum, area))| (m, sum / area)).collect()
    }

    /// Mean of a texture over the solid part of each of `pieces`; none for those without one.
    fn solid_means(
        &self,
        pieces: &[Piece],
        map_of: impl Fn(&MaterialTextures) -> Option<&TextureMap>,
    ) -> Vec<Option<Rgb>> {
        let mean = |map: &TextureMap, mask: Option<&TextureMap>, place: [DVec2; 3], cells: f64| {
            mask.map_or_else(
                || Some(map.mean_by_cells(place, cells)),
                |mask| map.mean_where_solid(mask, place, cells),
            )
        };
        self.of_pieces(pieces, map_of, mean).into_iter().map(Option::flatten).collect()
    }

    /// Result of `find` for each of `pieces` with a texture, called with the texture, its mask, the
    /// texture coordinates of the piece, and the number of cells along the piece's outline; none
    /// for the others. Equal pieces, which many triangles may share, are computed once.
    pub(super) fn of_pieces<T: Copy + Send>(
        &self,
        pieces: &[Piece],
        map_of: impl Fn(&MaterialTextures) -> Option<&TextureMap>,
        find: impl Fn(&TextureMap, Option<&TextureMap>, [DVec2; 3], f64) -> T + Sync,
    ) -> Vec<Option<T>> {
        let mut numbers: FxHashMap<(u32, [u64; 6]), u32> = FxHashMap::default();
        let mut different: Vec<(&TextureMap, Option<&TextureMap>, [DVec2; 3])> = vec![];
        let number_of = |&(t, corners): &Piece| {
            let textures = self.textures(t)?;
            let (map, mask) = (map_of(textures)?, textures.mask.as_ref());
            let [a, b, c] = corners.map(|corner| self.texture_point(t, corner));
            let bits = [a.x, a.y, b.x, b.y, c.x, c.y].map(f64::to_bits);
            let key = (self.triangles[t].material, bits);
            Some(*numbers.entry(key).or_insert_with(|| {
                different.push((map, mask, [a, b, c]));
                different.len() as u32 - 1
            }))
        };
        let numbers: Vec<Option<u32>> = pieces.iter().map(number_of).collect();
        // For all pieces together at most about 0.15 s; with 64 cells a mean is off by some 1e-2
        // of the contrast.
        let cells = 3e6 / different.len().max(1) as f64;
        let cells = cells.clamp(64.0, MAX_OUTLINE_CELLS);
        let found = different.par_iter().map(|&(map, mask, place)| find(map, mask, place, cells));
        let found: Vec<T> = found.collect();
        numbers.into_iter().map(|number| Some(found[number? as usize])).collect()
    }

    /// Weights of the second and third corner of triangle `t` at `position` in its plane.
    pub(crate) fn barycentric(&self, t: usize, position: DVec3) -> [f64; 2] {
        barycentric(self.corners(t), self.normal(t), position)
    }

    /// Texture coordinates of a point of triangle `t`; not finite if it has none.
    pub(crate) fn texture_point(&self, t: usize, [u, v]: [f64; 2]) -> DVec2 {
        let place = |[a, b, c]: [DVec2; 3]| a * (1.0 - u - v) + b * u + c * v;
        self.texture_coordinates(t).map_or(DVec2::NAN, place)
    }
}
