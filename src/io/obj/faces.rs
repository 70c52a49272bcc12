//! The faces of an OBJ file as triangles of a scene.
//!
//! tobj returns the faces by models, and renumbers the vertices of each. Here the faces get back
//! the file's numbering and the notes of [`super::statements`], and are cut into triangles.

use glam::{DVec2, DVec3};

use super::super::mtl::MtlMaterial;
use super::super::text;
use super::ObjFile;
use super::statements::{FaceNote, MaterialUse};
use crate::error::Error;
use crate::geometry::triangulation::{triangulate, triangulate_anyhow};
use crate::scene::{Material, Triangle, Warning, WarningKind};

/// Positions and faces of a scene.
pub(super) struct Geometry {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<Triangle>,
    /// Texture coordinates of the triangles' corners, if requested or if some material has a
    /// texture.
    pub texture_coordinates: Vec<[DVec2; 3]>,
}

impl ObjFile<'_> {
    /// The vertices of the file, and its faces as triangles; with texture coordinates if requested
    /// or if some material has a texture.
    pub(super) fn geometry(
        &mut self,
        models: Vec<tobj::Model>,
        named: &[u32],
        with_coordinates: bool,
    ) -> Result<Geometry, Error> {
        let mut geometry = Geometry {
            positions: std::mem::take(&mut self.statements.positions),
            triangles: Vec::with_capacity(self.statements.faces.len()),
            texture_coordinates: vec![],
        };
        let textured =
            with_coordinates || self.library.materials.iter().any(MtlMaterial::has_images);
        let (mut face, mut bare) = (0, 0);
        let order = std::mem::take(&mut self.statements.vertex_order);
        let mut order = &order[..];
        for tobj::Model { mesh, .. } in models {
            let numbers;
            (numbers, order) = order.split_at(mesh.positions.len() / 3);
            let arity = |k: usize| mesh.face_arities.get(k).map_or(3, |&arity| arity as usize);
            let (mut start, mut k) = (0, 0);
            while start < mesh.indices.len() {
                let corners = &mesh.indices[start..start + arity(k)];
                let corners: Vec<u32> = corners.iter().map(|&i| numbers[i as usize]).collect();
                let places = textured.then(|| texture_coordinates(&mesh, start, corners.len()));
                let FaceNote { group, smoothing, material, .. } = self.statements.faces[face];
                let MaterialUse { name, known } = self.statements.material_uses[material as usize];
                let by_name = name.map_or(named[named.len() - 1], |k| named[k as usize]);
                let material = known.unwrap_or(by_name);
                let like = Triangle { group, material, smoothing, ..Default::default() };
                self.cut(face, &corners, places.as_deref(), like, &mut geometry)?;
                bare += usize::from(name.is_none());
                (start, k, face) = (start + corners.len(), k + 1, face + 1);
            }
        }
        if bare > 0 {
            let default = Material::DEFAULT_REFLECTANCE;
            let done = match bare == face {
                true => format!("all of them reflect {default} and emit nothing"),
                false => format!("before the first `usemtl`: reflect {default} and emit nothing"),
            };
            self.repairs.push(Warning::new(WarningKind::FaceWithoutMaterial, bare, done));
        }
        Ok(geometry)
    }

    /// Appends the triangles of a face with these corners, and texture coordinates `places` if
    /// used; all else is copied from `like`.
    fn cut(
        &mut self,
        face: usize,
        corners: &[u32],
        places: Option<&[DVec2]>,
        like: Triangle,
        geometry: &mut Geometry,
    ) -> Result<(), Error> {
        let points: Vec<DVec3> = corners.iter().map(|&i| geometry.positions[i as usize]).collect();
        let pieces = match triangulate(&points) {
            Some(pieces) => pieces,
            None => {
                let group = &self.statements.groups.list[like.group as usize];
                let line = self.statements.faces[face].line as usize;
                let place = || text::place(self.path, line);
                let done = "cut into triangles as well as can be";
                self.repairs.note_at(WarningKind::Polygon, place, group, done)?;
                triangulate_anyhow(&points)
            }
        };
        if let Some(places) = places {
            let coordinates = pieces.iter().map(|t| t.map(|i| places[i]));
            geometry.texture_coordinates.extend(coordinates);
        }
        let triangle = |t: [usize; 3]| Triangle { corners: t.map(|i| corners[i]), ..like };
        geometry.triangles.extend(pieces.into_iter().map(triangle));
        Ok(())
    }
}

/// Texture coordinates of `count` corners of `mesh` from `start` on; not finite if they have none.
fn texture_coordinates(mesh: &tobj::Mesh, start: usize, count: usize) -> Vec<DVec2> {
    let index = |k: usize| mesh.texcoord_indices.get(k).map(|&i| 2 * i as usize);
    let place = |k| index(k).and_then(|at| mesh.texcoords.get(at..at + 2));
    let corners = start..start + count;
    corners.map(|k| place(k).map_or(DVec2::NAN, |uv| DVec2::new(uv[0], uv[1]))).collect()
}
