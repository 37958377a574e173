//! The tree of nodes: which of them the scene shows, and where each is at a time.

use super::animation::{Animations, Property, unit_rotation};
use super::document::Document;
use super::json::Json;
use super::uri::shortened;
use crate::error::Result;
use crate::import::source::Notes;
use crate::math::{DAffine3, DMat3, DQuat, DVec3};

/// The nodes of a file, and those that the scene shows.
pub(super) struct Nodes {
    parents: Vec<Option<usize>>,
    places: Vec<Place>,
    /// Nodes of the scene, parents before their children, in the file's order.
    pub shown: Vec<usize>,
}

/// A node's place in its parent's coordinates.
#[derive(Debug, Clone, Copy)]
enum Place {
    Matrix(DAffine3),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

impl Nodes {
    /// The nodes of `document`, and those of its scene: the default one, or the first.
    ///
    /// Errors: circles, nodes with two parents, matrices that are not affine.
    pub fn read(document: &Document<'_>) -> Result<Self> {
        let nodes = &document.nodes;
        let places = nodes.iter().map(Place::read).collect::<Result<Vec<_>>>()?;
        let mut parents = vec![None; nodes.len()];
        let mut children = Vec::with_capacity(nodes.len());
        for (at, node) in nodes.iter().enumerate() {
            let mut own = Vec::new();
            for child in node.list("children")? {
                let number = child.as_index(nodes.len(), "node")?;
                if let Some(other) = parents[number].replace(at) {
                    let message = format!("node {number} has two parents: nodes {other} and {at}");
                    return Err(child.fault(message).into());
                }
                own.push(number);
            }
            children.push(own);
        }
        let roots = (0..nodes.len()).filter(|at| parents[*at].is_none()).collect::<Vec<_>>();
        let reached = descend(&roots, &children, |_| true);
        if reached.len() < nodes.len() {
            let mut is_reached = vec![false; nodes.len()];
            reached.iter().for_each(|at| is_reached[*at] = true);
            let at = is_reached.iter().position(|reached| !reached).unwrap_or_default();
            return Err(nodes[at].fault("the node is among its own children's children").into());
        }
        let roots = scene_roots(document, &parents)?.unwrap_or(roots);
        let mut is_visible = Vec::with_capacity(nodes.len());
        for node in nodes {
            let visibility = node.extension("KHR_node_visibility");
            let visible = visibility.map(|json| json.truth("visible")).transpose()?.flatten();
            is_visible.push(visible.unwrap_or(true));
        }
        let shown = descend(&roots, &children, |at| is_visible[at]);
        Ok(Self { parents, places, shown })
    }

    /// A node and its ancestors, the node first.
    pub fn chain(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(node), |at| self.parents[*at])
    }

    /// Where a node is in its parent's coordinates at `time`.
    pub fn local(&self, node: usize, animations: &Animations, time: f64) -> DAffine3 {
        let (translation, rotation, scale) = match self.places[node] {
            Place::Matrix(matrix) if !animations.moves(node) => return matrix,
            // A matrix does not go with animation; what is not animated of it is taken to be none.
            Place::Matrix(_) => (DVec3::ZERO, DQuat::IDENTITY, DVec3::ONE),
            Place::Parts { translation, rotation, scale } => (translation, rotation, scale),
        };
        let vector = |property| animations.get(property).map(|curve| curve.vector(time));
        let turned = animations.get(Property::Rotation(node)).map(|curve| curve.rotation(time));
        DAffine3::from_scale_rotation_translation(
            vector(Property::Scale(node)).unwrap_or(scale),
            turned.unwrap_or(rotation),
            vector(Property::Translation(node)).unwrap_or(translation),
        )
    }

    /// Where all nodes are in the world at `time`, by number.
    pub fn worlds(&self, animations: &Animations, time: f64) -> Vec<DAffine3> {
        let mut worlds: Vec<Option<DAffine3>> = vec![None; self.places.len()];
        let mut above = Vec::new();
        for start in 0..worlds.len() {
            // Up to a node that is known, then down again: no recursion, however deep the tree.
            above.extend(self.chain(start).take_while(|at| worlds[*at].is_none()));
            while let Some(at) = above.pop() {
                let local = self.local(at, animations, time);
                let parent = self.parents[at].and_then(|parent| worlds[parent]);
                worlds[at] = Some(parent.map_or(local, |parent| parent * local));
            }
        }
        worlds.into_iter().map(Option::unwrap_or_default).collect()
    }
}

/// Names the scene that is shown, where the file has others.
pub(super) fn note_scenes(document: &Document<'_>, notes: &mut Notes) -> Result<()> {
    let scenes = document.top.list("scenes")?;
    let shown = document.top.index("scene", scenes.len(), "scene")?.unwrap_or(0);
    if let (Some(scene), true) = (scenes.get(shown), scenes.len() > 1) {
        let (name, count) = (name_of(scene, "scene", shown)?, scenes.len());
        let what = format!("the file has {count} scenes: its default one is shown, `{name}`");
        notes.add(&what, None);
    }
    Ok(())
}

/// The roots of the scene that the file shows; `None` without scenes.
fn scene_roots(document: &Document<'_>, parents: &[Option<usize>]) -> Result<Option<Vec<usize>>> {
    let scenes = document.top.list("scenes")?;
    let number = document.top.index("scene", scenes.len(), "scene")?.unwrap_or(0);
    let Some(scene) = scenes.get(number) else { return Ok(None) };
    let mut roots = Vec::new();
    let mut is_root = vec![false; parents.len()];
    for json in scene.list("nodes")? {
        let root = json.as_index(parents.len(), "node")?;
        if let Some(parent) = parents[root] {
            return Err(json
                .fault(format!("node {root} is no root: its parent is node {parent}"))
                .into());
        }
        if std::mem::replace(&mut is_root[root], true) {
            return Err(json.fault(format!("node {root} is there twice")).into());
        }
        roots.push(root);
    }
    Ok(Some(roots))
}

/// `roots` and all below them for which `enters` holds, each before its children. Every node has one parent at most.
fn descend(roots: &[usize], children: &[Vec<usize>], enters: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut waiting: Vec<usize> = roots.iter().rev().copied().collect();
    let mut reached = Vec::new();
    while let Some(at) = waiting.pop() {
        if enters(at) {
            reached.push(at);
            waiting.extend(children[at].iter().rev());
        }
    }
    reached
}

impl Place {
    fn read(node: &Json<'_>) -> Result<Self> {
        if let Some(m) = node.numbers::<16>("matrix")? {
            let bottom = [m[3], m[7], m[11], m[15]];
            if bottom != [0.0, 0.0, 0.0, 1.0] {
                return Err(node
                    .fault("the matrix is not affine: its last row is not 0 0 0 1")
                    .into());
            }
            let column = |at: usize| DVec3::new(m[4 * at], m[4 * at + 1], m[4 * at + 2]);
            let linear = DMat3::from_cols(column(0), column(1), column(2));
            return Ok(Self::Matrix(DAffine3::from_mat3_translation(linear, column(3))));
        }
        let translation = node.numbers::<3>("translation")?.unwrap_or_default();
        let rotation = node.numbers::<4>("rotation")?.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let scale = node.numbers::<3>("scale")?.unwrap_or([1.0; 3]);
        Ok(Self::Parts {
            translation: DVec3::from_array(translation),
            rotation: unit_rotation(rotation),
            scale: DVec3::from_array(scale),
        })
    }
}

/// The name of a thing, if need be shortened, or what it is with its number.
pub(super) fn name_of(json: &Json<'_>, what: &str, number: usize) -> Result<String> {
    Ok(json.text("name")?.map_or_else(|| format!("{what} {number}"), shortened))
}
