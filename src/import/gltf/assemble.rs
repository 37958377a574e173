//! The scene's nodes as meshes, materials and lights.

use super::animation::Animations;
use super::deform::{self, JointMatrices, Shape};
use super::document::Document;
use super::image::ImageStore;
use super::json::Json;
use super::material::{MaterialReader, Surfaced};
use super::node::{Nodes, name_of};
use super::primitive::{self, MOST_PIECES, MOST_PLACED, Size};
use super::uri::shortened;
use super::{instances, light, place};
use crate::error::Result;
use crate::import::model::{Model, traced_bytes};
use crate::import::source::Notes;
use crate::math::DAffine3;
use crate::scene::{MaterialId, WorldMesh};
use std::collections::{BTreeSet, HashMap};

/// What a scene is put together from.
pub(super) struct Assembly<'a, 'd> {
    document: &'d Document<'d>,
    nodes: &'a Nodes,
    animations: (&'a Animations, f64),
    worlds: Vec<DAffine3>,
    materials: MaterialReader<'d>,
    images: ImageStore,
    /// Materials that were made, by their number in the file, and whether vertices have colours.
    made: HashMap<(Option<usize>, bool), Made>,
    /// Joint matrices by skin.
    joints: HashMap<usize, JointMatrices>,
    model: Model,
    notes: &'a mut Notes,
}

/// A mesh at its places.
struct Piece {
    name: String,
    places: Vec<DAffine3>,
    joints: Option<JointMatrices>,
    weights: Vec<f64>,
}

/// A material in the model.
#[derive(Clone, Copy)]
struct Made {
    id: MaterialId,
    is_invisible: bool,
}

impl<'a, 'd> Assembly<'a, 'd> {
    /// Counts what the scene places and decodes the images of its materials.
    ///
    /// Errors: more than [`MOST_PLACED`] vertices or triangles; those of [`ImageStore::decode`].
    pub fn of(
        document: &'d Document<'d>,
        nodes: &'a Nodes,
        animations: (&'a Animations, f64),
        mut model: Model,
        notes: &'a mut Notes,
    ) -> Result<Self> {
        let used = count(document, nodes)?;
        let materials = MaterialReader::of(document)?;
        let images = ImageStore::decode(document, &materials.images(&used)?, &mut model.files)?;
        let worlds = nodes.worlds(animations.0, animations.1);
        let (made, joints) = (HashMap::new(), HashMap::new());
        Ok(Self {
            document,
            nodes,
            animations,
            worlds,
            materials,
            images,
            made,
            joints,
            model,
            notes,
        })
    }

    /// The model, with all that the scene's nodes show.
    ///
    /// Errors: of meshes, skins, materials and lights.
    pub fn build(mut self) -> Result<Model> {
        let mut seen = HashMap::new();
        for number in &self.nodes.shown {
            let node = &self.document.nodes[*number];
            if let Some(light) =
                light::read(self.document, node, &self.worlds[*number], self.notes)?
            {
                self.model.world.lights.push(light);
            }
            let meshes = self.document.meshes.len();
            if let Some(mesh) = node.index("mesh", meshes, "mesh")? {
                self.add_mesh(*number, mesh, &mut seen)?;
            }
        }
        Ok(self.model)
    }

    /// Adds mesh number `mesh` where node `number` has it. `seen` counts how often each was placed before.
    fn add_mesh(
        &mut self,
        number: usize,
        mesh: usize,
        seen: &mut HashMap<usize, usize>,
    ) -> Result<()> {
        let (node, json) = (&self.document.nodes[number], &self.document.meshes[mesh]);
        let primitives = json.list("primitives")?;
        let mut targets = 0;
        for json in &primitives {
            targets = targets.max(json.list("targets")?.len());
        }
        let joints = self.joints(node)?;
        let weights = deform::morph_weights(node, (number, targets), json, self.animations)?;
        let world = self.worlds[number];
        let places = match instances::places(self.document, node)? {
            Some(places) => places.into_iter().map(|place| world * place).collect(),
            None => vec![world],
        };
        let name = match node.text("name")?.or(json.text("name")?) {
            Some(name) => shortened(name),
            None => name_of(json, "mesh", mesh)?,
        };
        let bends = joints.is_some() || !weights.is_empty();
        let piece = Piece { name, places, joints, weights };
        let before = self.model.world.meshes.len();
        for json in primitives {
            self.add_primitive(&json, &piece)?;
        }
        // Copies that instances would not need: of a mesh that bends none.
        if !bends {
            let bytes = self.model.world.meshes[before..].iter().map(traced_bytes).sum();
            self.count_copies(seen.entry(mesh).or_insert(0), piece.places.len(), bytes);
        }
        Ok(())
    }

    /// Adds a primitive at the places of a piece.
    fn add_primitive(&mut self, json: &Json<'_>, piece: &Piece) -> Result<()> {
        let material = json.index("material", self.document.materials.len(), "material")?;
        let mut uv_sets = material.map_or(Ok(vec![]), |at| self.materials.uv_sets(at))?;
        if uv_sets.is_empty() {
            // For `convert`, which writes them whatever the material is.
            uv_sets.push(0);
        }
        let read = primitive::read(self.document, json, &uv_sets, self.notes)?;
        let Some(mut primitive) = read else { return Ok(()) };
        let made = self.material(material, primitive.colours.is_some())?;
        if made.is_invisible {
            self.notes.add("a surface whose alpha is below its cutoff, or less than a half of BLEND, was left out", None);
            return Ok(());
        }
        let mut shape = Shape::of(&mut primitive);
        shape.morph(self.document, json, &piece.weights)?;
        let skin = piece.joints.as_ref().filter(|_| !primitive.joints.is_empty());
        if let Some(joints) = skin {
            shape.skin(&primitive, json, joints)?;
        }
        let mesh = place::mesh(primitive, shape, &piece.name, self.notes);
        let Some(mesh) = mesh else { return Ok(()) };
        // A skin's joints say where it is, its node does not.
        let still = [DAffine3::IDENTITY];
        let places = if skin.is_some() { &still[..] } else { &piece.places };
        if let Some(mesh) = place::at_all(mesh, places, json, self.notes)? {
            self.model.world.meshes.push(WorldMesh { material: made.id, ..mesh });
        }
        Ok(())
    }

    /// Counts the copies among `places` of a mesh that was placed `earlier` so often; all of these places take `bytes`.
    fn count_copies(&mut self, earlier: &mut usize, places: usize, bytes: u64) {
        let copies = places - usize::from(*earlier == 0).min(places);
        *earlier += places;
        if copies > 0 {
            self.model.repeats.copies += copies;
            self.model.repeats.bytes += bytes / places as u64 * copies as u64;
        }
    }

    /// The joint matrices of the skin of `node`; `None` without a skin.
    fn joints(&mut self, node: &Json<'_>) -> Result<Option<JointMatrices>> {
        let skins = &self.document.skins;
        let Some(at) = node.index("skin", skins.len(), "skin")? else { return Ok(None) };
        if let Some(known) = self.joints.get(&at) {
            return Ok(Some(known.clone()));
        }
        let joints = deform::joint_matrices(self.document, &skins[at], &self.worlds)?;
        Ok(Some(self.joints.entry(at).or_insert(joints).clone()))
    }

    fn material(&mut self, at: Option<usize>, coloured: bool) -> Result<Made> {
        if let Some(made) = self.made.get(&(at, coloured)) {
            return Ok(*made);
        }
        let made = match at {
            Some(number) => {
                let world = &mut self.model.world;
                let read =
                    self.materials.read(number, coloured, &mut self.images, world, self.notes)?;
                let Surfaced { material, is_invisible } = read;
                Made { id: world.add_material(material), is_invisible }
            }
            None if coloured => Made { id: self.model.coloured_material(), is_invisible: false },
            None => Made { id: self.model.default_material(), is_invisible: false },
        };
        self.made.insert((at, coloured), made);
        Ok(made)
    }
}

/// Counts what the scene places; gives the materials that it shows.
fn count(document: &Document<'_>, nodes: &Nodes) -> Result<BTreeSet<usize>> {
    let mut used = BTreeSet::new();
    let mut sizes: HashMap<usize, Size> = HashMap::new();
    let mut placed = Size::default();
    for number in &nodes.shown {
        let node = &document.nodes[*number];
        let Some(mesh) = node.index("mesh", document.meshes.len(), "mesh")? else { continue };
        let size = match sizes.get(&mesh) {
            Some(size) => *size,
            None => mesh_size(document, &document.meshes[mesh], &mut used)?,
        };
        sizes.insert(mesh, size);
        placed = placed.plus(size.times(instances::count(document, node)?.unwrap_or(1)));
        let Size { vertices, triangles, pieces } = placed;
        if vertices > MOST_PLACED || triangles > MOST_PLACED {
            let message = format!(
                "with this node the scene has {vertices} vertices and {triangles} triangles; {MOST_PLACED} of each can be placed"
            );
            return Err(too_many(node, &message).into());
        }
        if pieces > MOST_PIECES {
            let message = format!(
                "with this node the scene has {pieces} primitives and morph targets; {MOST_PIECES} can be placed"
            );
            return Err(too_many(node, &message).into());
        }
    }
    Ok(used)
}

fn too_many(node: &Json<'_>, message: &str) -> crate::error::Diagnostic {
    node.fault(message).help("each copy of a mesh takes memory of its own: leave some out")
}

/// The size of a mesh; the materials of its primitives are added to `used`.
fn mesh_size(document: &Document<'_>, mesh: &Json<'_>, used: &mut BTreeSet<usize>) -> Result<Size> {
    let mut sum = Size::default();
    for json in mesh.list("primitives")? {
        sum = sum.plus(primitive::size(document, &json)?);
        used.extend(json.index("material", document.materials.len(), "material")?);
    }
    // A mesh without any takes some time too.
    Ok(Size { pieces: sum.pieces.max(1), ..sum })
}
