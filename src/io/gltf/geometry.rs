//! Meshes of a glTF scene as triangles of the world, once for each node and instance that has one.

use std::cell::Cell;
use std::collections::hash_map::Entry;

use glam::{DAffine3, DMat4, DVec2, DVec3};
use rustc_hash::FxHashMap;
use serde_json::Value;

use super::accessors::Values;
use super::container::Buffers;
use super::document::{Document, Instances, Node, Primitive};
use super::fault::Fault;
use super::nodes::{Nodes, Placed, name, of_parts};
use crate::scene::Triangle;

/// Largest number of triangles of a scene. Plain choice: 10 GB of positions, corners, texture
/// coordinates and colours.
const MAX_TRIANGLES: usize = 1 << 25;

/// Modes of primitives: a list of triangles, those along a strip, those around a corner.
const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// Triangles of the world.
#[derive(Default)]
pub(super) struct Geometry {
    pub positions: Vec<DVec3>,
    pub triangles: Vec<Triangle>,
    /// Texture coordinates of corners, v upwards; not finite where a primitive has none.
    pub coordinates: Vec<[DVec2; 3]>,
    /// Colours of corners by which the reflectance is multiplied; white where there are none.
    pub colours: Vec<[[f32; 3]; 3]>,
    pub groups: Vec<String>,
    /// Where each group comes from.
    pub places: Vec<Group>,
    /// Number of primitives of points and lines.
    pub points_and_lines: usize,
    /// Names of nodes that are posed by the joints of a skin.
    pub skinned: Vec<String>,
    /// Whether each material, and the one of primitives without any, has colours of vertices.
    pub is_coloured: Vec<bool>,
}

/// The node that a group is of.
#[derive(Clone, Copy)]
pub(super) struct Group {
    pub node: usize,
    /// From the axes of its mesh, or of the joints of its skin, to the world.
    pub world: DAffine3,
    pub is_instance: bool,
}

/// Which texture coordinates the triangles of a material have.
pub(super) type SetOf<'a> = &'a dyn Fn(Option<usize>) -> usize;

/// A primitive in the axes of its mesh, or of the world if it is posed by a skin.
struct Local {
    positions: Vec<DVec3>,
    corners: Vec<[u32; 3]>,
    coordinates: Option<Vec<DVec2>>,
    colours: Option<Vec<[f32; 3]>>,
    material: Option<usize>,
}

/// A mesh that is read once for all nodes without skin and weights of their own.
pub(super) struct MeshReader<'a, 'b> {
    document: &'a Document,
    buffers: &'a Buffers<'b>,
    nodes: &'a Nodes,
    set_of: SetOf<'a>,
    /// Number of triangles read so far.
    triangles: Cell<usize>,
}

impl Geometry {
    /// The meshes of all `nodes`. Numbers of materials are those of the document, and the one after
    /// them is that of primitives without a material.
    pub fn new(
        document: &Document,
        buffers: &Buffers<'_>,
        nodes: &Nodes,
        set_of: SetOf<'_>,
    ) -> Result<Geometry, (String, Fault)> {
        let reader = MeshReader::new(document, buffers, nodes, set_of);
        let mut geometry = Geometry {
            is_coloured: vec![false; document.materials.len() + 1],
            ..Geometry::default()
        };
        let mut known: FxHashMap<usize, Vec<Local>> = FxHashMap::default();
        let mut names: FxHashMap<String, usize> = FxHashMap::default();
        for placed in &nodes.placed {
            let node = &document.nodes[placed.node];
            let Some(mesh) = node.mesh else { continue };
            let at = |fault| {
                (format!("node {}", crate::error::quoted(&[name(document, placed.node)])), fault)
            };
            let is_own = node.skin.is_some() || node.weights.is_some();
            let own;
            let locals = if is_own {
                own = reader.mesh(node, mesh, &mut geometry).map_err(at)?;
                &own
            } else {
                match known.entry(mesh) {
                    Entry::Occupied(read) => read.into_mut(),
                    Entry::Vacant(unread) => {
                        unread.insert(reader.mesh(node, mesh, &mut geometry).map_err(at)?)
                    }
                }
            };
            let name = unique(name(document, placed.node), &mut names);
            let mut group = Group { node: placed.node, world: placed.world, is_instance: false };
            if node.skin.is_some() {
                geometry.skinned.push(name.clone());
                group.world = DAffine3::IDENTITY;
            } else if let Some(instances) = &node.extensions.instances {
                let transforms = reader.instances(placed, instances).map_err(at)?;
                for (k, world) in (1..).zip(transforms) {
                    let group = Group { world, is_instance: true, ..group };
                    geometry.place(locals, group, format!("{name}/{k}")).map_err(at)?;
                }
                continue;
            }
            geometry.place(locals, group, name).map_err(at)?;
        }
        Ok(geometry)
    }

    /// Adds the triangles of a mesh as a group.
    fn place(&mut self, locals: &[Local], place: Group, name: String) -> Result<(), Fault> {
        let world = place.world;
        if locals.iter().all(|local| local.corners.is_empty()) {
            return Ok(());
        }
        let group = self.groups.len() as u32;
        let is_mirrored = world.matrix3.determinant() < 0.0;
        for local in locals {
            let first = self.positions.len();
            check_number(self.triangles.len() + local.corners.len())?;
            self.positions.extend(local.positions.iter().map(|&p| world.transform_point3(p)));
            let material = local.material.unwrap_or(self.is_coloured.len() - 1);
            self.is_coloured[material] |= local.colours.is_some();
            for &corners in &local.corners {
                // A mirrored triangle turns over: its front stays the side that it was.
                let [a, b, c] = corners;
                let corners = if is_mirrored { [a, c, b] } else { corners };
                let coordinates = local.coordinates.as_ref();
                self.coordinates.push(
                    coordinates.map_or([DVec2::NAN; 3], |all| corners.map(|k| all[k as usize])),
                );
                let colours = local.colours.as_ref();
                self.colours
                    .push(colours.map_or([[1.0; 3]; 3], |all| corners.map(|k| all[k as usize])));
                self.triangles.push(Triangle {
                    corners: corners.map(|k| first as u32 + k),
                    group,
                    material: material as u32,
                    smoothing: None,
                });
            }
        }
        self.groups.push(name);
        self.places.push(place);
        Ok(())
    }
}

/// `name`, with a number behind it if there is another one.
fn unique(name: String, names: &mut FxHashMap<String, usize>) -> String {
    let mut unique = name.clone();
    loop {
        match names.get_mut(&unique) {
            None => {
                names.insert(unique.clone(), 1);
                return unique;
            }
            Some(count) => {
                *count += 1;
                unique = format!("{unique} ({count})");
            }
        }
    }
}

impl<'a, 'b> MeshReader<'a, 'b> {
    pub fn new(
        document: &'a Document,
        buffers: &'a Buffers<'b>,
        nodes: &'a Nodes,
        set_of: SetOf<'a>,
    ) -> MeshReader<'a, 'b> {
        MeshReader { document, buffers, nodes, set_of, triangles: Cell::new(0) }
    }
}

impl MeshReader<'_, '_> {
    /// All vertices of a primitive of `mesh`, as `node` poses them; none without positions.
    pub fn posed_vertices(
        &self,
        node: &Node,
        mesh: usize,
        primitive: &Primitive,
    ) -> Result<Option<Vec<DVec3>>, Fault> {
        let Some(position) = primitive.attributes.position else { return Ok(None) };
        let positions = self.values(position)?;
        if positions.is_without_data() {
            return Ok(None);
        }
        let weights = self.weights(node, mesh);
        let vertices: Vec<usize> = (0..positions.count()).collect();
        self.posed(node, primitive, weights, &positions, &vertices).map(Some)
    }

    /// Weights of morph targets of `mesh` at `node`.
    fn weights<'c>(&'c self, node: &'c Node, mesh: usize) -> &'c [f64] {
        let of_mesh = || self.document.meshes.get(mesh)?.weights.as_ref();
        node.weights.as_ref().or_else(of_mesh).map_or(&[], Vec::as_slice)
    }

    pub fn values(&self, accessor: usize) -> Result<Values<'_>, Fault> {
        Values::new(self.document, self.buffers, accessor)
    }

    /// The primitives of a mesh, as `node` poses them.
    fn mesh(&self, node: &Node, mesh: usize, geometry: &mut Geometry) -> Result<Vec<Local>, Fault> {
        let meshes = &self.document.meshes;
        let about = meshes.get(mesh).ok_or_else(|| Fault::index("mesh", mesh, meshes.len()))?;
        let weights = self.weights(node, mesh);
        let mut locals = vec![];
        for (k, primitive) in about.primitives.iter().enumerate() {
            if primitive.mode.is_some_and(|mode| mode < TRIANGLES) {
                geometry.points_and_lines += 1;
                continue;
            }
            let local = self.primitive(node, primitive, weights);
            let inside = |fault: Fault| fault.inside(&format!("primitive {k} of mesh {mesh}"));
            locals.extend(local.map_err(inside)?);
        }
        Ok(locals)
    }

    /// A primitive; none without positions.
    fn primitive(
        &self,
        node: &Node,
        primitive: &Primitive,
        weights: &[f64],
    ) -> Result<Option<Local>, Fault> {
        let draco = primitive.extensions.draco.as_ref();
        let Some(position) = primitive.attributes.position else {
            return match draco {
                Some(_) => Err(Fault::compressed("KHR_draco_mesh_compression")),
                None => Ok(None),
            };
        };
        let positions = self.values(position)?;
        if draco.is_some() && positions.is_without_data() {
            return Err(Fault::compressed("KHR_draco_mesh_compression"));
        }
        if !positions.has_components(3) {
            return Err(Fault::new("positions of fewer than three numbers", "must be VEC3"));
        }
        let indices = primitive.indices.map(|indices| self.values(indices)).transpose()?;
        let count = indices.as_ref().map_or(positions.count(), Values::count);
        // All corners are one point, and no triangle has an area: one stands for all.
        let is_point =
            indices.as_ref().is_some_and(Values::is_without_data) || positions.is_without_data();
        let triangles = triangles_of(primitive.mode, count)?;
        self.triangles.set(self.triangles.get() + triangles.len());
        check_number(self.triangles.get())?;
        let material = primitive.material;
        if material.is_some_and(|k| k >= self.document.materials.len()) {
            let (k, count) = (material.unwrap_or(0), self.document.materials.len());
            return Err(Fault::index("material", k, count));
        }
        let mut numbers: FxHashMap<usize, u32> = FxHashMap::default();
        let mut vertices = vec![];
        let mut corners = vec![];
        for triangle in triangles.take(if is_point { 1 } else { usize::MAX }) {
            let mut triangle_corners = [0; 3];
            for (corner, item) in triangle_corners.iter_mut().zip(triangle) {
                let vertex = indices.as_ref().map_or(item, |indices| indices.index(item));
                if vertex >= positions.count() {
                    return Err(Fault::index("vertex", vertex, positions.count()));
                }
                *corner = *numbers.entry(vertex).or_insert_with(|| {
                    vertices.push(vertex);
                    vertices.len() as u32 - 1
                });
            }
            corners.push(triangle_corners);
        }
        let positions = self.posed(node, primitive, weights, &positions, &vertices)?;
        let set = (self.set_of)(material);
        let attribute = |name: &str| {
            let accessor = primitive.attributes.others.get(name).and_then(Value::as_u64)?;
            let values = self.values(accessor as usize).ok()?;
            values.has_components(2).then_some(values)
        };
        // v runs upwards here, and from the top in glTF.
        let upwards = |[u, v]: [f64; 2]| DVec2::new(u, 1.0 - v);
        let coordinates = attribute(&format!("TEXCOORD_{set}"))
            .map(|values| vertices.iter().map(|&v| upwards(values.get(v))).collect());
        let colours = primitive.attributes.colour.map(|colour| self.values(colour)).transpose()?;
        let colours = colours.filter(|values| values.has_components(3)).map(|values| {
            let colour =
                |&v: &usize| values.get_normalized::<3>(v).map(|x| x.clamp(0.0, 1.0) as f32);
            vertices.iter().map(colour).collect()
        });
        Ok(Some(Local { positions, corners, coordinates, colours, material }))
    }

    /// The positions of `vertices`: at rest, with the weights of morph targets, and as the joints
    /// of a skin stand.
    fn posed(
        &self,
        node: &Node,
        primitive: &Primitive,
        weights: &[f64],
        positions: &Values<'_>,
        vertices: &[usize],
    ) -> Result<Vec<DVec3>, Fault> {
        let mut posed: Vec<DVec3> =
            vertices.iter().map(|&v| DVec3::from_array(positions.get(v))).collect();
        for (target, &weight) in primitive.targets.iter().zip(weights) {
            if let (Some(shift), true) = (target.position, weight != 0.0) {
                let shifts = self.values(shift)?;
                for (p, &v) in posed.iter_mut().zip(vertices) {
                    *p += weight * DVec3::from_array(shifts.get(v));
                }
            }
        }
        if let Some((p, &v)) = posed.iter().zip(vertices).find(|(p, _)| !p.is_finite()) {
            let found = format!("vertex {v} at {p}");
            return Err(Fault::new(found, "all three coordinates must be finite"));
        }
        let both = (primitive.attributes.joints, primitive.attributes.weights);
        if let (Some(skin), (Some(joints), Some(weights))) = (node.skin, both) {
            let matrices = self.joints(skin)?;
            let (joints, weights) = (self.values(joints)?, self.values(weights)?);
            for (p, &v) in posed.iter_mut().zip(vertices) {
                let (of, by) = (joints.get::<4>(v), weights.get_normalized::<4>(v));
                let sum: f64 = by.iter().sum();
                let moved =
                    of.iter().zip(by).filter(|(_, weight)| *weight > 0.0).map(|(&k, weight)| {
                        let matrix = matrices.get(k as usize).copied().unwrap_or_default();
                        weight / sum * matrix.transform_point3(*p)
                    });
                if sum > 0.0 {
                    *p = moved.sum();
                }
            }
        }
        Ok(posed)
    }

    /// From the axes of a skin's mesh to the world, by each of its joints.
    fn joints(&self, skin: usize) -> Result<Vec<DAffine3>, Fault> {
        let skins = &self.document.skins;
        let skin = skins.get(skin).ok_or_else(|| Fault::index("skin", skin, skins.len()))?;
        let inverses = skin.inverse_bind_matrices.map(|k| self.values(k)).transpose()?;
        let worlds = &self.nodes.worlds;
        let joint = |(k, &node): (usize, &usize)| {
            let world = worlds.get(node).ok_or_else(|| Fault::index("node", node, worlds.len()))?;
            let inverse =
                inverses.as_ref().filter(|values| values.has_components(16) && k < values.count());
            let inverse =
                inverse.map_or(DMat4::IDENTITY, |values| DMat4::from_cols_array(&values.get(k)));
            Ok(*world * DAffine3::from_mat4(inverse))
        };
        skin.joints.iter().enumerate().map(joint).collect()
    }

    /// To the world from each instance of a node (`EXT_mesh_gpu_instancing`).
    fn instances(&self, placed: &Placed, of: &Instances) -> Result<Vec<DAffine3>, Fault> {
        let values = |accessor: Option<usize>| accessor.map(|k| self.values(k)).transpose();
        let translations = values(of.attributes.translation)?;
        let (rotations, scales) = (values(of.attributes.rotation)?, values(of.attributes.scale)?);
        let all = [&translations, &rotations, &scales];
        let count = all.iter().filter_map(|values| values.as_ref()).map(Values::count).min();
        let count = count.unwrap_or(0);
        let transform = |k: usize| {
            let vector =
                |values: &Option<Values<'_>>| values.as_ref().map(|values| values.get::<3>(k));
            let rotation = rotations.as_ref().map(|values| values.get::<4>(k));
            placed.world * of_parts(vector(&translations), rotation, vector(&scales))
        };
        Ok((0..count).map(transform).collect())
    }
}

/// The corners of each triangle of `count` corners in a row: a list, a strip or a fan.
pub(super) fn triangles_of(
    mode: Option<u32>,
    count: usize,
) -> Result<impl ExactSizeIterator<Item = [usize; 3]>, Fault> {
    let mode = mode.unwrap_or(TRIANGLES);
    let triangles = match mode {
        TRIANGLES => count / 3,
        TRIANGLE_STRIP | TRIANGLE_FAN => count.saturating_sub(2),
        other => return Err(Fault::new(format!("primitives of mode {other}"), "must be 0 to 6")),
    };
    Ok((0..triangles).map(move |k| match mode {
        TRIANGLES => [3 * k, 3 * k + 1, 3 * k + 2],
        // Every other one is turned over.
        TRIANGLE_STRIP => [k, k + 1 + k % 2, k + 2 - k % 2],
        _ => [k + 1, k + 2, 0],
    }))
}

pub(super) fn check_number(triangles: usize) -> Result<(), Fault> {
    if triangles <= MAX_TRIANGLES {
        return Ok(());
    }
    let found = format!("{triangles} triangles, each mesh as often as nodes have it");
    Err(Fault::new(found, format!("give at most {MAX_TRIANGLES}")))
}

/// The bits of a point; those of 0 for both zeros.
pub(super) fn bits(p: DVec3) -> [u64; 3] {
    (p + 0.0).to_array().map(f64::to_bits)
}
