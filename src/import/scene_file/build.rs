//! From the checked tables to a [`World`]: reads meshes and textures, places and merges them.

use super::at::{At, Span};
use super::material::{Images, Material};
use super::mesh::{Mesh, Normals, Shape, Sphere};
use super::piece::{name_meshes, nearest_file, place, uv_sphere};
use super::report::Source;
use super::{SceneFile, mapping, shapes};
use crate::error::{Diagnostic, Error, Result};
use crate::import::{self, ImageUse, Model, emission, untextured};
use crate::scene::{self, MaterialId, World, WorldMesh, WorldSphere};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Triangles that all generators of a scene file may make together: some 5 GB of memory, and as
/// much again for Embree.
pub(super) const MAX_GENERATED: u64 = 100_000_000;

/// Builds a world from the tables.
pub(super) struct Builder<'a> {
    source: &'a Source,
    pub world: World,
    pub warnings: Vec<Diagnostic>,
    /// Every file read, the scene file first, each once.
    pub files: Vec<PathBuf>,
    /// Images that no material has asked for yet.
    images: HashMap<(PathBuf, ImageUse), Result<scene::Texture>>,
    /// Those in the world.
    textures: HashMap<(PathBuf, ImageUse), scene::TextureId>,
    materials: BTreeMap<&'a str, Named>,
    default_material: Option<MaterialId>,
    generated: u64,
}

struct Named {
    id: MaterialId,
    span: Span,
    used: bool,
}

/// The images of all materials of `file`, each once for each use, read on all threads.
fn images(
    source: &Source,
    file: &SceneFile,
) -> HashMap<(PathBuf, ImageUse), Result<scene::Texture>> {
    let named = file.material.values().flat_map(|material| images_of(material));
    let path = |file: &At<String>| import::source::beside(&source.path, &file.value);
    let images: BTreeSet<_> = named.map(|(file, image_use)| (path(&file), image_use)).collect();
    let load = |image: (PathBuf, ImageUse)| {
        let loaded = import::load_image(&image.0, image.1);
        (image, loaded)
    };
    images.into_par_iter().map(load).collect()
}

/// The images of a material, but for masks.
fn images_of(material: &Material) -> impl Iterator<Item = (At<String>, ImageUse)> {
    let texture = material.texture.as_ref().map(|texture| (texture.image_file(), ImageUse::Colour));
    let roughness = material.roughness.as_ref().and_then(At::data_file);
    let roughness = roughness.map(|(file, channel)| (file, ImageUse::Data(channel)));
    let normals = material.normal_map.as_ref().map(|map| (map.image_file(), ImageUse::Normals));
    [texture, roughness, normals].into_iter().flatten()
}

impl<'a> Builder<'a> {
    /// Builds the world of `file`.
    ///
    /// Errors: `Error::Input` at the key that is wrong, or inside the mesh file that is.
    pub fn build(source: &'a Source, file: &'a SceneFile) -> Result<Self> {
        let mut this = Self {
            source,
            world: World::default(),
            warnings: Vec::new(),
            files: vec![source.path.clone()],
            images: images(source, file),
            textures: HashMap::new(),
            materials: BTreeMap::new(),
            default_material: None,
            generated: 0,
        };
        for (name, material) in &file.material {
            this.add_material(name, material)?;
        }
        for mesh in &file.mesh {
            this.add_mesh(mesh)?;
        }
        for sphere in &file.sphere {
            this.add_sphere(sphere)?;
        }
        for light in &file.light {
            this.world.lights.push(light.build(source)?);
        }
        this.world.traced_regions = file.reuse.regions(source)?;
        this.world.sky = file.sky.as_ref().map_or_else(Default::default, |sky| sky.build());
        this.warn_of_unused_materials();
        this.warn_of_darkness();
        Ok(this)
    }

    fn add_material(&mut self, name: &'a str, material: &At<Material>) -> Result<()> {
        let texture = material.texture.as_ref().map(At::image_file);
        let alpha = material.alpha.as_ref().map(At::image_file);
        let roughness = material.roughness.as_ref().and_then(At::data_file);
        let normals = material.normal_map.as_ref().map(At::image_file);
        let images = Images {
            texture: texture.map(|file| self.add_image(&file, ImageUse::Colour)).transpose()?,
            normals: normals.map(|file| self.add_image(&file, ImageUse::Normals)).transpose()?,
            alpha: alpha.map(|file| self.add_mask(&file)).transpose()?,
            roughness: roughness
                .map(|(file, channel)| self.add_image(&file, ImageUse::Data(channel)))
                .transpose()?,
        };
        let built = material.build(name, self.source, &images)?;
        let id = self.world.materials.len() as MaterialId;
        self.world.materials.push(built);
        self.materials.insert(name, Named { id, span: material.span.clone(), used: false });
        Ok(())
    }

    fn add_image(&mut self, file: &At<String>, image_use: ImageUse) -> Result<scene::TextureId> {
        let key = (self.beside(file), image_use);
        if let Some(known) = self.textures.get(&key) {
            return Ok(*known);
        }
        let loaded = self.images.remove(&key);
        let loaded = loaded.unwrap_or_else(|| import::load_image(&key.0, image_use));
        let texture = loaded.map_err(|e| self.at_key(file, e))?;
        self.note_file(&key.0);
        if let Some(message) = import::doubt(&texture, image_use) {
            self.warnings.push(self.source.fault(&file.span, message));
        }
        let id = self.world.textures.len() as scene::TextureId;
        self.world.textures.push(texture);
        self.textures.insert(key, id);
        Ok(id)
    }

    fn add_mask(&mut self, file: &At<String>) -> Result<scene::MaskId> {
        let path = self.beside(file);
        let same = |mask: &scene::AlphaMask| Path::new(&mask.name) == path;
        if let Some(known) = self.world.masks.iter().position(same) {
            return Ok(known as scene::MaskId);
        }
        let mask = import::load_mask(&path).map_err(|e| self.at_key(file, e))?;
        self.note_file(&path);
        self.world.masks.push(mask);
        Ok(self.world.masks.len() as scene::MaskId - 1)
    }

    fn add_mesh(&mut self, mesh: &At<Mesh>) -> Result<()> {
        let shape = mesh.shape(self.source, &mesh.span)?;
        let over = mesh.material.as_ref().map(|name| self.material(name)).transpose()?;
        let mut piece = match shape {
            Shape::File(file) => self.read_model(file, mesh, over.is_some())?,
            generated => {
                let textured = over.is_some_and(|id| self.is_textured(id));
                let mesh = self.generate(&generated, mesh, textured)?;
                World { meshes: vec![mesh], ..World::default() }
            }
        };
        name_meshes(&mut piece, mesh.name.as_deref());
        place(&mut piece, mesh, self.source)?;
        let (meshes, spheres) = (self.world.meshes.len(), self.world.spheres.len());
        let grey = piece.materials.is_empty() && over.is_none();
        self.world.append(piece);
        let over = if grey { Some(self.default_material()) } else { over };
        if let Some(id) = over {
            self.world.meshes[meshes..].iter_mut().for_each(|m| m.material = id);
            self.world.spheres[spheres..].iter_mut().for_each(|s| s.material = id);
            if !self.world.materials[id as usize].vertex_colours {
                self.world.meshes[meshes..].iter_mut().for_each(|m| m.colours = None);
            }
        }
        self.world.meshes[meshes..].iter_mut().for_each(|m| m.always_traced = !mesh.reuse);
        self.world.spheres[spheres..].iter_mut().for_each(|s| s.always_traced = !mesh.reuse);
        self.light_up(meshes, spheres, &mesh.span);
        for found in untextured::find(&self.world, meshes) {
            let warning = self.source.fault(&mesh.span, found.message()).help(found.help());
            self.warnings.push(warning);
        }
        Ok(())
    }

    /// Whether the material has an image to lay on.
    fn is_textured(&self, id: MaterialId) -> bool {
        let material = &self.world.materials[id as usize];
        material.has_image() || material.alpha.is_some()
    }

    fn add_sphere(&mut self, sphere: &At<Sphere>) -> Result<()> {
        let material = match &sphere.material {
            Some(name) => self.material(name)?,
            None => self.default_material(),
        };
        let (meshes, spheres) = (self.world.meshes.len(), self.world.spheres.len());
        let name = sphere.name.clone().unwrap_or_else(|| format!("sphere {}", spheres + 1));
        let (centre, radius) = (sphere.centre.vec(), sphere.radius.0);
        let always_traced = !sphere.reuse;
        self.world.spheres.push(WorldSphere { name, centre, radius, material, always_traced });
        if self.world.materials[material as usize].vertex_colours {
            let message = "an exact sphere has no vertex colours: it shows `diffuse` as it is";
            self.warnings.push(self.source.fault(&sphere.span, message));
        }
        self.light_up(meshes, spheres, &sphere.span);
        Ok(())
    }

    /// Turns emitting meshes from number `meshes` on and spheres from `spheres` on into lights, where possible.
    fn light_up(&mut self, meshes: usize, spheres: usize, span: &Span) {
        for note in emission::adopt(&mut self.world, meshes, spheres) {
            let warning = self.source.fault(span, note.message()).help(note.help());
            self.warnings.push(warning);
        }
    }

    fn read_model(&mut self, file: &At<String>, mesh: &Mesh, bare: bool) -> Result<World> {
        let path = self.beside(file);
        let Model { mut world, warnings, files } = import::load_model(&path, mesh.policy())
            .map_err(|e| match e {
                Error::Input(inside) if inside.line.is_some() => Error::Input(inside),
                other => self.at_key(file, other),
            })?;
        files.iter().for_each(|f| self.note_file(f));
        self.warnings.extend(warnings);
        if bare {
            world.materials.clear();
            world.textures.clear();
            world.masks.clear();
        }
        Ok(world)
    }

    /// A generated mesh, with texture coordinates where it is `textured`.
    fn generate(&mut self, shape: &Shape<'_>, mesh: &Mesh, textured: bool) -> Result<WorldMesh> {
        let mut made = match shape {
            Shape::Cuboid(c) => shapes::cuboid("box".into(), c.corners(self.source)?, 0),
            Shape::Quad(q) => WorldMesh::quad("quad", q.corners(self.source)?, 0),
            Shape::UvSphere(s) => {
                self.allow(s.triangles(), &s.span)?;
                let (r, centre) = (s.radius.0, s.centre.vec());
                uv_sphere(r, centre, s.meridians.u32(), s.bands.u32())
                    .map_err(|e| self.at_span(&s.span, &e))?
            }
            Shape::Terrain(t) => {
                self.allow(t.triangles(), &t.span)?;
                import::bench_terrain("terrain", t.vertices.u32(), 0.5 * t.size.0, 0)
                    .map_err(|e| self.at_span(&t.span, &e))?
            }
            Shape::File(file) => return Err(self.at_span(&file.span, "a file is not generated")),
        };
        if textured {
            made.uvs = match shape {
                Shape::Cuboid(_) => Some(mapping::cuboid(&shapes::FACES)),
                Shape::Quad(_) => Some(mapping::quad()),
                Shape::UvSphere(s) => Some(mapping::uv_sphere(s.meridians.u32(), s.bands.u32())),
                Shape::Terrain(t) => Some(mapping::terrain(t.vertices.u32())),
                Shape::File(_) => None,
            };
        }
        if mesh.normals != Normals::Auto {
            import::apply_normals(&mut made, mesh.policy());
        }
        Ok(made)
    }

    /// Refuses more generated triangles than [`MAX_GENERATED`].
    fn allow(&mut self, triangles: u64, span: &Span) -> Result<()> {
        self.generated += triangles;
        if self.generated <= MAX_GENERATED {
            return Ok(());
        }
        let total = self.generated;
        let message = format!("the generated meshes would have {total} triangles by here");
        let help = format!("at most {MAX_GENERATED} can be generated in one scene");
        Err(self.source.fault(span, message).help(help).into())
    }

    fn material(&mut self, name: &At<String>) -> Result<MaterialId> {
        if let Some(named) = self.materials.get_mut(name.value.as_str()) {
            named.used = true;
            return Ok(named.id);
        }
        let known: Vec<&str> = self.materials.keys().copied().collect();
        let fault = self.source.unknown(&name.span, "material", &name.value, &known);
        let define = || format!("define it: [material.{}]", name.value);
        Err(if fault.help.is_none() { fault.help(define()) } else { fault }.into())
    }

    /// The material of surfaces that name none.
    fn default_material(&mut self) -> MaterialId {
        let materials = &mut self.world.materials;
        *self.default_material.get_or_insert_with(|| {
            let grey = scene::Material::diffuse(import::DEFAULT_MATERIAL, import::DEFAULT_ALBEDO);
            materials.push(grey);
            materials.len() as MaterialId - 1
        })
    }

    fn beside(&self, file: &At<String>) -> PathBuf {
        import::source::beside(&self.source.path, &file.value)
    }

    fn note_file(&mut self, path: &Path) {
        if !self.files.iter().any(|f| f == path) {
            self.files.push(path.to_path_buf());
        }
    }

    fn at_span(&self, span: &Span, message: impl ToString) -> Error {
        self.source.fault(span, message.to_string()).into()
    }

    /// `error` about the file that a key names, at the key; with the nearest file's name where
    /// there is none of that name.
    fn at_key(&self, file: &At<String>, error: Error) -> Error {
        let missing = matches!(&error, Error::Io { source, .. }
            if source.kind() == std::io::ErrorKind::NotFound);
        let (message, help) = match error {
            Error::Input(d) => (format!("{}: {}", d.file.display(), d.message), d.help),
            other => (other.to_string(), None),
        };
        let fault = self.source.fault(&file.span, message);
        let near = if missing { nearest_file(&self.beside(file)) } else { None };
        match near.map(|n| format!("did you mean `{n}`?")).or(help) {
            Some(help) => fault.help(help).into(),
            None => fault.into(),
        }
    }

    fn warn_of_unused_materials(&mut self) {
        for (name, named) in self.materials.iter().filter(|(_, named)| !named.used) {
            let message = format!("no mesh or sphere uses the material `{name}`");
            self.warnings.push(self.source.fault(&named.span, message));
        }
    }

    fn warn_of_darkness(&mut self) {
        let World { lights, sky, materials, .. } = &self.world;
        let glows = materials.iter().any(|m| m.emission.max_element() > 0.0);
        let bright = sky.radiance.max_element() > 0.0 || sky.ambient.max_element() > 0.0;
        if lights.is_empty() && !glows && !bright {
            let warning = Diagnostic::new(&self.source.path, "nothing lights the scene")
                .help("add a [[light]] or give the [sky] a radiance");
            self.warnings.push(warning);
        }
    }
}
