//! A scene for rays on the device: hierarchy, triangles, lights, sky, panes and masks.
//!
//! ```text
//! nodes      [hierarchy of blockers of light][hierarchy of clear panes]
//! triangles  [in the order of the first][of the second][lamps that no ray hits]
//! lights     [lights of the scene][a row for each pane: its transmittance]
//!            [two rows for each translucent material: transmittance, reflectance]
//! lamps      triangles of each light, and cumulative shares of its area
//! ```

use std::f64::consts::PI;

use bytemuck::Zeroable;
use glam::{DVec2, DVec3, Vec3A};

use super::layout::{
    BACK_IS_COVERED, HAS_HOLES, LEAF, Lamp, NOTHING, ROW_OF_FLAGS, TEXELS_PER_LINE, TraceNode,
    TracedLight, TracedSceneInfo, TracedTriangle,
};
use super::memory::Memory;
use super::split_float::SplitFloat;
use crate::error::Error;
use crate::gather::lights::{Light, Lights, NO_LIGHT};
use crate::geometry::barycentric::WHOLE;
use crate::scene::{Rgb, Scene, SkyMap, Sun};
use crate::visibility::panes::Panes;
use crate::visibility::triangle_tree::TriangleTree;

/// Scene data for rays, in buffers of the device.
#[derive(Debug)]
pub struct TracedScene {
    pub coordinates: SplitFloat,
    /// Unit of light on the device, W/m²: a power of two, so that dividing by it does not round.
    pub radiance_unit: f64,
    pub nodes: wgpu::Buffer,
    pub triangles: wgpu::Buffer,
    pub info: wgpu::Buffer,
    pub mask_coordinates: wgpu::TextureView,
    pub masks: wgpu::TextureView,
    pub lights: wgpu::Buffer,
    pub lamps: wgpu::Buffer,
    pub sky: wgpu::TextureView,
    _memory: Memory,
}

/// The same in plain memory, as shaders read it.
#[derive(Debug)]
pub struct TracedArrays {
    pub coordinates: SplitFloat,
    pub radiance_unit: f64,
    pub nodes: Vec<TraceNode>,
    pub triangles: Vec<TracedTriangle>,
    pub info: TracedSceneInfo,
    pub mask_coordinates: Vec<[f32; 4]>,
    pub masks: Vec<u32>,
    pub lights: Vec<TracedLight>,
    pub lamps: Vec<Lamp>,
    pub sky: Vec<[f32; 4]>,
}

impl TracedScene {
    /// The scene of `lights` in buffers.
    pub fn new(memory: Memory, lights: &Lights) -> Result<TracedScene, Error> {
        let arrays = TracedArrays::new(lights);
        let side = arrays.info.sky_side;
        Ok(TracedScene {
            coordinates: arrays.coordinates,
            radiance_unit: arrays.radiance_unit,
            nodes: memory.storage("hierarchy", bytemuck::cast_slice(&arrays.nodes))?,
            triangles: memory.storage("triangles", bytemuck::cast_slice(&arrays.triangles))?,
            info: memory.uniform("scene", bytemuck::bytes_of(&arrays.info))?,
            mask_coordinates: memory.lines("coordinates of masks", &arrays.mask_coordinates)?,
            masks: memory.words("masks", &arrays.masks)?,
            lights: memory.storage("lights", bytemuck::cast_slice(&arrays.lights))?,
            lamps: memory.storage("lamps", bytemuck::cast_slice(&arrays.lamps))?,
            sky: memory.texels("sky", &arrays.sky, [side.max(1), (2 * side).max(1)])?,
            _memory: memory,
        })
    }

    /// Bindings of group 0 in `shared/trace.wgsl`.
    pub fn geometry(&self) -> [(u32, wgpu::BindingResource<'_>); 5] {
        [
            (0, self.nodes.as_entire_binding()),
            (1, self.triangles.as_entire_binding()),
            (2, self.info.as_entire_binding()),
            (3, wgpu::BindingResource::TextureView(&self.mask_coordinates)),
            (4, wgpu::BindingResource::TextureView(&self.masks)),
        ]
    }
}

impl TracedArrays {
    /// The scene of `lights`.
    pub fn new(lights: &Lights) -> TracedArrays {
        let scene = lights.scene();
        let tree = TriangleTree::of_scene(scene, |t| !scene.is_clear(t));
        let panes = Panes::of_scene(scene);
        let lamps = lights.lights.iter().map(|l| l.exitance.max_element());
        let sky = scene.sky();
        let brightest = lamps.chain([PI * sky.brightest()]).fold(0.0, f64::max);
        let mut arrays = TracedArrays {
            coordinates: SplitFloat::new(scene),
            radiance_unit: if brightest > 0.0 {
                libm::exp2(libm::log2(brightest).floor())
            } else {
                1.0
            },
            nodes: vec![],
            triangles: Vec::with_capacity(scene.triangles().len()),
            info: TracedSceneInfo { panes: NOTHING, ..Zeroable::zeroed() },
            mask_coordinates: vec![[0.0; 4]],
            masks: vec![0],
            lights: vec![],
            lamps: vec![],
            sky: vec![[0.0; 4]],
        };
        let has_holes = arrays.add_masks(scene);
        arrays.add_nodes(&tree, 0);
        arrays.add_triangles(scene, &tree, |t| lights.of_triangle[t]);
        let blocking = arrays.triangles.len();
        if !panes.is_none() {
            let clear: Vec<usize> =
                (0..scene.triangles().len()).filter(|&t| scene.is_clear(t)).collect();
            let tree = TriangleTree::of_scene(scene, |t| scene.is_clear(t));
            let number = |t: usize| clear.binary_search(&t).expect("a clear one");
            arrays.add_triangles(scene, &tree, |t| (lights.lights.len() + number(t)) as u32);
            arrays.lights = panes.transmittances().iter().map(share_row).collect();
            arrays.info.panes = arrays.nodes.len() as u32;
            arrays.add_nodes(&tree, blocking);
        }
        for triangle in &mut arrays.triangles {
            if has_holes.get(triangle.index as usize) == Some(&true) {
                triangle.flags |= HAS_HOLES;
            }
        }
        arrays.add_translucent(scene, lights.lights.len(), blocking);
        arrays.add_lights(lights, blocking);
        arrays.add_light_from_outside(scene);
        // A buffer must not be empty, even if unused.
        let TracedArrays { triangles, lights, lamps, .. } = &mut arrays;
        triangles.resize(triangles.len().max(1), Zeroable::zeroed());
        lights.resize(lights.len().max(1), Zeroable::zeroed());
        lamps.resize(lamps.len().max(1), Zeroable::zeroed());
        arrays
    }

    /// Adds the triangles of a tree over `scene`, each with the `row` of its light.
    fn add_triangles(&mut self, scene: &Scene, tree: &TriangleTree, row: impl Fn(usize) -> u32) {
        let coordinates = &self.coordinates;
        let triangles = tree.triangles.iter().map(|&t| t as usize);
        self.triangles.extend(triangles.map(|t| coordinates.traced(scene, t, row(t))));
    }

    /// The nodes of a tree whose triangles begin at `first_triangle`.
    fn add_nodes(&mut self, TriangleTree { tree, unit, .. }: &TriangleTree, first_triangle: usize) {
        // Only inner nodes are stored: leaves are encoded in their parents.
        let mut index = vec![u32::MAX; tree.nodes.len()];
        let mut next = self.nodes.len() as u32;
        for (k, node) in tree.nodes.iter().enumerate() {
            if node.children.is_some() {
                index[k] = next;
                next += 1;
            }
        }
        let child = |k: usize| {
            let node = &tree.nodes[k];
            match node.children {
                Some(_) => index[k],
                None => {
                    let first = (first_triangle + node.items.start) as u32;
                    LEAF | (node.items.len() as u32 - 1) << 29 | first
                }
            }
        };
        let bounds = |k: usize| {
            let bounds = &tree.nodes[k].bounds;
            let in_scene = |position: Vec3A| unit.in_scene_unit(position.as_dvec3());
            self.coordinates.widened([bounds.low, bounds.high].map(in_scene))
        };
        let mut nodes = vec![];
        for node in &tree.nodes {
            if let Some(first) = node.children {
                nodes.push(pair(
                    [first, first + 1].map(|k| Child { bounds: bounds(k), node: child(k) }),
                ));
            }
        }
        if nodes.is_empty() {
            // The root is a leaf, or there are no triangles; the other child is an empty leaf in a
            // box that no ray hits: a point beyond `FAR`.
            let none = || Child { bounds: [[1e31; 3]; 2], node: LEAF };
            let root = match tree.order.is_empty() {
                true => none(),
                false => Child { bounds: bounds(0), node: child(0) },
            };
            nodes.push(pair([root, none()]));
        }
        self.nodes.extend(nodes);
    }

    /// Rows of translucent materials: they begin after those of the lights, which are not there
    /// yet, and of panes.
    fn add_translucent(&mut self, scene: &Scene, light_count: usize, blocking: usize) {
        let mut rows = rustc_hash::FxHashMap::default();
        for triangle in &mut self.triangles[..blocking] {
            let t = triangle.index as usize;
            if scene.other_side(t).next().is_none() {
                continue;
            }
            let row = *rows.entry(scene.triangles()[t].material).or_insert_with(|| {
                let material = scene.material(t);
                self.lights.push(share_row(&material.transmittance));
                self.lights.push(share_row(&material.reflectance));
                light_count + self.lights.len() - 2
            });
            triangle.flags |= (row as u32 + 1) << ROW_OF_FLAGS;
        }
    }

    fn add_lights(&mut self, lights: &Lights, blocking: usize) {
        let scene = lights.scene();
        let mut slot = vec![u32::MAX; scene.triangles().len()];
        for (k, triangle) in self.triangles[..blocking].iter().enumerate() {
            slot[triangle.index as usize] = k as u32;
        }
        let mut rows = vec![];
        let power = |light: &Light| light.exitance.max_element() * light.surface.total_area();
        let all_power: f64 = lights.lights.iter().map(power).sum();
        let mut power_end = 0.0;
        for (number, light) in (0..).zip(&lights.lights) {
            power_end += power(light) / all_power;
            let first = self.lamps.len() as u32;
            let area = light.surface.total_area();
            let mut end = 0.0;
            for &t in &light.triangles {
                let t = t as usize;
                if slot[t] == u32::MAX {
                    slot[t] = self.triangles.len() as u32;
                    self.triangles.push(self.coordinates.traced(scene, t, number));
                }
                end += scene.area(t) / area;
                self.lamps.push(Lamp { triangle: slot[t], end: end as f32 });
            }
            rows.push(TracedLight {
                exitance: (light.exitance / self.radiance_unit).as_vec3().to_array(),
                is_convex: light.convex.into(),
                first,
                count: light.triangles.len() as u32,
                area: self.coordinates.area(area),
                power_end: power_end as f32,
            });
        }
        self.info.lights = rows.len() as u32;
        rows.append(&mut self.lights);
        self.lights = rows;
    }

    fn add_light_from_outside(&mut self, scene: &Scene) {
        let (sky, unit) = (scene.sky(), self.radiance_unit);
        let vector = |v: DVec3| v.as_vec3().to_array();
        if let Some(uniform) = sky.uniform_radiance() {
            self.info.sky = vector(PI * uniform / unit);
        }
        if let Some(map) = sky.map() {
            let back = map.turn().inverse();
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| vector(back * axis));
            self.info.sky_side = map.side() as u32;
            (self.info.sky_x, self.info.sky_y, self.info.sky_z) = (x, y, z);
            self.sky = sky_texels(map, unit);
        }
        if let Some(sun) = sky.sun() {
            let (right, up) = sun.direction.any_orthonormal_pair();
            self.info.has_sun = 1;
            self.info.sun = vector(sun.irradiance / unit);
            self.info.sun_middle = vector(sun.direction);
            self.info.sun_right = vector(right * Sun::tangent());
            self.info.sun_up = vector(up * Sun::tangent());
        }
    }

    /// Adds the masks of cut-outs; returns whether each triangle has one.
    fn add_masks(&mut self, scene: &Scene) -> Vec<bool> {
        if !scene.has_cut_outs() {
            return vec![];
        }
        let mut first_word = rustc_hash::FxHashMap::default();
        for (material, mask) in scene.masks() {
            first_word.insert(material, self.masks.len() as u32);
            let solid: Vec<bool> = mask.solid_texels().collect();
            let word =
                |bits: &[bool]| bits.iter().rev().fold(0, |word, &bit| word << 1 | u32::from(bit));
            self.masks.extend(solid.chunks(32).map(word));
        }
        let count = scene.triangles().len();
        self.mask_coordinates = vec![[0.0; 4]; 3 * count];
        let mut has_holes = vec![false; count];
        for t in 0..count {
            let Some(mask) = scene.mask(t) else { continue };
            let corners = WHOLE.map(|c| mask.in_texels(scene.texture_point(t, c)));
            if !corners.iter().all(|place| place.is_finite()) {
                continue;
            }
            let size = mask.texture.size();
            let whole = DVec2::new(size[0].into(), size[1].into());
            // Relative to the tile of the first corner, so that few digits are lost far from the
            // origin.
            let tile =
                if mask.clamped { DVec2::ZERO } else { (corners[0] / whole).floor() * whole };
            let [a, b, c] = corners.map(|place| (place - tile).as_vec2());
            let word = first_word[&scene.triangles()[t].material] as f32;
            self.mask_coordinates[3 * t] = [a.x, a.y, b.x, b.y];
            self.mask_coordinates[3 * t + 1] = [c.x, c.y, word, size[0] as f32];
            self.mask_coordinates[3 * t + 2] = [size[1] as f32, mask.clamped.into(), 0.0, 0.0];
            has_holes[t] = true;
        }
        has_holes
    }
}

/// A child of a node of the hierarchy: its box, low and high corner, and its index or leaf.
struct Child {
    bounds: [[f32; 3]; 2],
    node: u32,
}

fn pair([a, b]: [Child; 2]) -> TraceNode {
    let ([low_a, high_a], [low_b, high_b]) = (a.bounds, b.bounds);
    TraceNode {
        low_a,
        child_a: a.node,
        high_a,
        child_b: b.node,
        low_b,
        padding: 0,
        high_b,
        padding_2: 0,
    }
}

/// A row with a share of light per channel.
fn share_row(share: &Rgb) -> TracedLight {
    TracedLight { exitance: share.as_vec3().to_array(), ..Zeroable::zeroed() }
}

/// Radiosity of the pieces of a map in units of `radiance_unit`, line by line.
fn sky_texels(map: &SkyMap, radiance_unit: f64) -> Vec<[f32; 4]> {
    let texel = |piece: &[f32; 3]| {
        let [r, g, b] = piece.map(|l| (f64::from(l) * PI / radiance_unit) as f32);
        [r, g, b, 0.0]
    };
    map.pieces().iter().map(texel).collect()
}

impl SplitFloat {
    /// A box for rays, with a margin in units of the scene's size: four roundings of a coordinate,
    /// which is at most half of that. The margin of the hierarchy itself is in its own unit.
    fn widened(&self, [low, high]: [DVec3; 2]) -> [[f32; 3]; 2] {
        let [low, high] = [low, high].map(|p| Vec3A::from_array(self.parts(p)[0]));
        [(low - 2.4e-7).to_array(), (high + 2.4e-7).to_array()]
    }

    /// Triangle `t` of `scene`, which belongs to this light.
    fn traced(&self, scene: &Scene, t: usize, light: u32) -> TracedTriangle {
        let [a, b, c] = scene.corners(t);
        let [corner, corner_low] = self.parts(a);
        let edge = |v: DVec3| (v * self.length_unit()).as_vec3().to_array();
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        TracedTriangle {
            corner,
            index: t as u32,
            corner_low,
            flags: if scene.is_back_covered(t) { BACK_IS_COVERED } else { 0 },
            edge_u: edge(b - a),
            light,
            edge_v: edge(c - a),
            extent: self.length(longest),
        }
    }
}

const _: () = assert!(NO_LIGHT == u32::MAX && TEXELS_PER_LINE.is_power_of_two());
