//! New texture coordinates: charts for every smooth surface, all in one texture.
//!
//! Charts, their parameterisation (Lévy, Petitjean, Ray, Maillot 2002: least squares conformal
//! maps) and their packing are those of the crate `uvunwrap`.

use std::collections::BTreeMap;

use glam::DVec2;
use rustc_hash::FxHashMap;
use uvunwrap::{Density, MeshInput, Options, OutputMesh, Packing};

use super::layout::{Layout, LayoutSettings, MAX_SIDE, Resolution, bad_size};
use super::pages::Maps;
use crate::error::Error;
use crate::mesh::SurfaceTopology;
use crate::scene::Scene;

/// A smooth surface as input of the unwrapper: 32-bit numbers.
#[derive(Default)]
struct Surface {
    triangles: Vec<usize>,
    positions: Vec<[f32; 3]>,
    /// Three for each triangle.
    indices: Vec<u32>,
}

/// Coordinates of `triangles` of `scene`, which have these smooth `surfaces`, in one texture, or in
/// as many pages as they take.
///
/// # Errors
/// [`ErrorKind::Setting`](crate::ErrorKind::Setting) if they do not fit into [`MAX_SIDE`] texels,
/// or not into the requested number.
pub(super) fn layout(
    scene: &Scene,
    triangles: &[u32],
    surfaces: &[u32],
    settings: &LayoutSettings,
) -> Result<Layout, Error> {
    let (resolution, unit) = (settings.resolution, scene.bounds().longest_side());
    let pages = match settings.maps {
        Maps::Pages(side) => Some(side),
        Maps::One | Maps::EachGroup => None,
    };
    let density = match resolution {
        Resolution::Pixels(page_size) => Density::Auto { page_size },
        Resolution::TexelSize(size) => {
            let area: f64 = triangles.iter().map(|&t| scene.area(t as usize)).sum();
            let side = area.sqrt() / size;
            if side > f64::from(MAX_SIDE) {
                return Err(bad_size(resolution, format!("at least {} along a side", side.ceil())));
            }
            Density::Fixed { texels_per_unit: (unit / size) as f32, page_size: pages }
        }
    };
    let surfaces = self::surfaces(scene, triangles, surfaces);
    // Packing by shapes leaves less empty space, and takes seconds for a few thousand surfaces.
    let packing = if surfaces.len() > 1000 { Packing::Fast } else { Packing::Shape };
    let options = Options { density, packing, padding: settings.padding, ..Options::default() };
    let inputs: Vec<MeshInput<'_>> =
        surfaces.iter().map(|s| MeshInput::new(&s.positions, &s.indices)).collect();
    let atlas = uvunwrap::generate(&inputs, &options)
        .map_err(|e| bad_size(resolution, format!("no room: {e}")).with_source(e))?;
    let side = atlas.width.max(atlas.height);
    if atlas.page_count > 1 && pages.is_none() {
        return Err(bad_size(
            resolution,
            format!("no room: charts take {} maps", atlas.page_count),
        ));
    }
    if side > MAX_SIDE {
        return Err(bad_size(resolution, format!("{side} along a side")));
    }
    let (mut coordinates, mut maps) =
        (vec![[DVec2::ZERO; 3]; triangles.len()], vec![0; triangles.len()]);
    for (surface, OutputMesh { vertices, indices, .. }) in surfaces.iter().zip(&atlas.meshes) {
        for (&k, corners) in surface.triangles.iter().zip(indices.chunks_exact(3)) {
            coordinates[k] = [0, 1, 2].map(|k| {
                let [u, v] = vertices[corners[k] as usize].uv;
                DVec2::new(u.into(), v.into())
            });
            maps[k] = vertices[corners[0] as usize].page.unwrap_or(0);
        }
    }
    let sizes = vec![[atlas.width, atlas.height]; atlas.page_count.max(1) as usize];
    Ok(Layout { sizes, maps, coordinates, charts: Some(atlas.chart_count as usize) })
}

/// The smooth surfaces of `triangles`, numbered by `surfaces`, in units of the longest side of
/// `scene` from its centre, so that 32 bits suffice for coordinates of any size. Their triangles
/// are numbered as in `triangles`.
fn surfaces(scene: &Scene, triangles: &[u32], surfaces: &[u32]) -> Vec<Surface> {
    let (bounds, topology) = (scene.bounds(), SurfaceTopology::of_scene(scene));
    let (centre, unit) = (bounds.centre(), bounds.longest_side());
    let mut all: BTreeMap<u32, (Surface, FxHashMap<u32, u32>)> = BTreeMap::new();
    for (k, t) in triangles.iter().map(|&t| t as usize).enumerate() {
        let (surface, numbers) = all.entry(surfaces[t]).or_default();
        surface.triangles.push(k);
        for (corner, position) in topology.corners[t].into_iter().zip(scene.corners(t)) {
            let number = *numbers.entry(corner).or_insert_with(|| {
                surface.positions.push(((position - centre) / unit).as_vec3().to_array());
                surface.positions.len() as u32 - 1
            });
            surface.indices.push(number);
        }
    }
    all.into_values().map(|(surface, _)| surface).collect()
}
