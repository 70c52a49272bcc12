//! Nodes of a glTF scene, each with its transform to the world.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::document::{Document, Node};
use super::fault::Fault;
use crate::error::quoted;

/// A node of the scene that is read.
#[derive(Clone, Copy)]
pub(super) struct Placed {
    pub node: usize,
    /// From the node's axes to the world's.
    pub world: DAffine3,
}

/// The nodes of a document.
pub(super) struct Nodes {
    /// Of every node, in a scene or not.
    pub worlds: Vec<DAffine3>,
    /// Those of the scene, parents before children.
    pub placed: Vec<Placed>,
    /// Numbers of nodes that several others have as a child: the first of these is their parent.
    pub shared: Vec<usize>,
}

impl Nodes {
    /// The nodes of `scene`, by its name or number, else of the file's own, else of the first, or
    /// all nodes of a file without scenes.
    pub fn new(document: &Document, scene: Option<&str>) -> Result<Nodes, Fault> {
        let nodes = &document.nodes;
        let (parents, shared) = parents(nodes)?;
        let mut worlds: Vec<Option<DAffine3>> = vec![None; nodes.len()];
        let parents = &parents[..];
        let children = |k: usize| nodes[k].children.iter().filter(move |&&c| parents[c] == Some(k));
        let mut open: Vec<usize> = (0..nodes.len()).filter(|&k| parents[k].is_none()).collect();
        while let Some(k) = open.pop() {
            // A child may be listed twice.
            if worlds[k].is_none() {
                let above = parents[k].and_then(|parent| worlds[parent]);
                worlds[k] = Some(above.unwrap_or(DAffine3::IDENTITY) * local(&nodes[k]));
                open.extend(children(k));
            }
        }
        let roots = match scene_index(document, scene)? {
            Some(scene) => document.scenes[scene].nodes.clone(),
            None => (0..nodes.len()).filter(|&k| parents[k].is_none()).collect(),
        };
        let (mut placed, mut visited) = (vec![], vec![false; nodes.len()]);
        let mut open: Vec<usize> = roots.into_iter().rev().collect();
        while let Some(k) = open.pop() {
            let node = nodes.get(k).ok_or_else(|| Fault::index("node", k, nodes.len()))?;
            let world = worlds[k].ok_or_else(|| {
                let found = format!("node {} is below itself", quoted(&[name(document, k)]));
                Fault::new(found, "nodes must form trees")
            })?;
            let is_visible = node.extensions.visibility.as_ref().is_none_or(|v| v.visible);
            if !std::mem::replace(&mut visited[k], true) && is_visible {
                placed.push(Placed { node: k, world });
                open.extend(children(k).rev());
            }
        }
        let unknown = worlds.iter().filter(|world| world.is_none()).count();
        if placed.is_empty() && unknown > 0 {
            return Err(Fault::new("nodes that are below themselves", "nodes must form trees"));
        }
        let worlds = worlds.into_iter().map(Option::unwrap_or_default).collect();
        Ok(Nodes { worlds, placed, shared })
    }
}

impl Nodes {
    /// Whether each node is in the scene.
    pub fn is_placed(&self) -> Vec<bool> {
        let mut is_placed = vec![false; self.worlds.len()];
        self.placed.iter().for_each(|placed| is_placed[placed.node] = true);
        is_placed
    }
}

/// The parent of each node, if any, and the nodes with several.
fn parents(nodes: &[Node]) -> Result<(Vec<Option<usize>>, Vec<usize>), Fault> {
    let (mut parents, mut shared) = (vec![None; nodes.len()], vec![]);
    for (k, node) in nodes.iter().enumerate() {
        for &child in &node.children {
            match parents.get_mut(child) {
                None => return Err(Fault::index("node", child, nodes.len())),
                Some(Some(parent)) if *parent != k => shared.push(child),
                Some(parent) => *parent = Some(k),
            }
        }
    }
    Ok((parents, shared))
}

/// The number of the scene that is wanted; none in a file without scenes.
fn scene_index(document: &Document, wanted: Option<&str>) -> Result<Option<usize>, Fault> {
    let scenes = &document.scenes;
    if let Some(wanted) = wanted {
        let by_name = scenes.iter().position(|scene| scene.name.as_deref() == Some(wanted));
        let by_number = || wanted.parse().ok().filter(|&k: &usize| k < scenes.len());
        return by_name.or_else(by_number).map(Some).ok_or_else(|| {
            let numbered = scenes.iter().enumerate();
            let names: Vec<String> =
                numbered.map(|(k, s)| s.name.clone().unwrap_or(k.to_string())).collect();
            let found = format!("no scene {}", quoted(&[wanted]));
            Fault::new(found, format!("its scenes are {}", quoted(&names)))
        });
    }
    match document.scene {
        Some(scene) if scene >= scenes.len() && !scenes.is_empty() => {
            Err(Fault::index("scene", scene, scenes.len()))
        }
        Some(scene) if scene < scenes.len() => Ok(Some(scene)),
        _ => Ok((!scenes.is_empty()).then_some(0)),
    }
}

/// The name of node `k`, or that of its mesh, or its number.
pub(super) fn name(document: &Document, k: usize) -> String {
    let node = &document.nodes[k];
    let of_mesh = || document.meshes.get(node.mesh?)?.name.clone();
    let named = |name: &String| !name.is_empty();
    let own = node.name.clone().filter(named).or_else(|| of_mesh().filter(named));
    own.unwrap_or_else(|| format!("node {k}"))
}

/// The transform of a node to its parent.
fn local(node: &Node) -> DAffine3 {
    if let Some(matrix) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&matrix));
    }
    of_parts(node.translation, node.rotation, node.scale)
}

/// The transform of a translation, rotation and scale.
pub(super) fn of_parts(
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
) -> DAffine3 {
    let rotation = rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let is_turn = rotation.length_squared() > 0.0 && rotation.is_finite();
    DAffine3::from_scale_rotation_translation(
        scale.map_or(DVec3::ONE, DVec3::from_array),
        if is_turn { rotation.normalize() } else { DQuat::IDENTITY },
        translation.map_or(DVec3::ZERO, DVec3::from_array),
    )
}
