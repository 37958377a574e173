//! From the checked tables to a [`World`]: reads meshes and textures, places and merges them.

use super::at::{At, Span};
use super::fog::Fog;
use super::material::Material;
use super::mesh::{Mesh, Normals, Shape, Sphere};
use super::piece::{name_meshes, nearest_file, place, uv_sphere};
use super::report::Source;
use super::sky::{Shown, Sky};
use super::{SceneFile, mapping, shapes};
use crate::error::{Diagnostic, Error, Result};
use crate::import::images::{ImageUse, Images};
use crate::import::model::traced_bytes;
use crate::import::{self, Model, ModelOptions, Repeats, emission, untextured};
use crate::scene::{self, EnvironmentKind, MaterialId, World, WorldMesh, WorldSphere};
use std::collections::{BTreeMap, HashSet};
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
    /// The images of all materials.
    images: Images,
    materials: BTreeMap<&'a str, Named>,
    default_material: Option<MaterialId>,
    generated: u64,
    /// Mesh files that were placed, with the bits of their time.
    placed: HashSet<(PathBuf, u64)>,
    pub repeats: Repeats,
}

struct Named {
    id: MaterialId,
    span: Span,
    used: bool,
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
            images: Images::default(),
            materials: BTreeMap::new(),
            default_material: None,
            generated: 0,
            placed: HashSet::new(),
            repeats: Repeats::default(),
        };
        this.read_images(file)?;
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
        if let Some(sky) = &file.sky {
            this.add_sky(sky)?;
        }
        if let Some(fog) = &file.fog {
            this.world.fog = Some(fog.build(source)?);
            this.warn_of_hidden_light(fog);
        }
        this.warn_of_unused_materials();
        this.warn_of_darkness();
        Ok(this)
    }

    /// Reads the images of all materials on all threads. Those that may be meant for another use are warned of where
    /// the scene file first names them.
    ///
    /// Errors: of those that cannot be read, the one that the scene file names first.
    fn read_images(&mut self, file: &SceneFile) -> Result<()> {
        let keys = file.material.values().flat_map(|material| material.images().all());
        let mut keys: Vec<_> = keys.map(|(key, what)| ((self.beside(&key), what), key)).collect();
        keys.sort_by_key(|(_, key)| key.span.start);
        self.images.read(keys.iter().map(|(image, _)| image.clone()));
        for ((path, what), key) in &keys {
            if let Some(error) = self.images.refusal(path, *what) {
                return Err(self.at_key(key, error));
            }
        }
        let mut seen = HashSet::new();
        keys.retain(|(image, _)| seen.insert(image.clone()));
        for ((path, what), key) in &keys {
            if let Some(message) = self.images.doubt(path, *what) {
                self.warnings.push(self.source.fault(&key.span, message));
            }
        }
        Ok(())
    }

    fn add_material(&mut self, name: &'a str, material: &At<Material>) -> Result<()> {
        let images = material.images().try_map(|(file, what)| self.image(&file, what))?;
        let built = material.build(name, self.source, &images)?;
        let id = self.world.materials.len() as MaterialId;
        self.world.materials.push(built);
        self.materials.insert(name, Named { id, span: material.span.clone(), used: false });
        Ok(())
    }

    /// The number of the image in the world.
    fn image(&mut self, file: &At<String>, what: ImageUse) -> Result<u32> {
        let path = self.beside(file);
        let found = self.images.place(&path, what, &mut self.world, &mut self.files);
        found.map_err(|error| self.at_key(file, &error))
    }

    fn add_sky(&mut self, sky: &At<Sky>) -> Result<()> {
        self.world.sky = sky.build();
        let shown = sky.shown(self.source, &sky.span)?;
        let kind = match &shown {
            Shown::Radiance => return Ok(()),
            Shown::Image(file) => EnvironmentKind::Image(self.image(file, ImageUse::Light)?),
            Shown::Gradient(gradient) => gradient.build(self.source)?,
            Shown::SunSky(day) => day.build(self.source)?,
        };
        let environment = sky.environment(kind);
        if let (Shown::Image(file), EnvironmentKind::Image(image)) = (&shown, &environment.kind) {
            let doubt = self.images.doubt(&self.beside(file), ImageUse::Light);
            self.warnings.extend(doubt.map(|doubt| self.source.fault(&file.span, doubt)));
            let brightest = scene::brightest(&self.world.textures[*image as usize]);
            let seen = f64::from(brightest) * f64::from(environment.strength);
            let name = &file.value;
            if seen == 0.0 {
                let message =
                    format!("{name}: the image is black everywhere, so it lights nothing");
                return Err(self.at_span(&file.span, message));
            }
            if seen > 1e30 {
                let message = format!(
                    "{name}: the image is too bright: {seen:e} with `strength`, 1e30 at most"
                );
                return Err(self.at_span(&file.span, message));
            }
        }
        self.world.environment = Some(environment);
        Ok(())
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
            let message =
                "an exact sphere has no vertex colours: it shows its material's own colour";
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
        let options = self.model_options(&path, mesh)?;
        let Model { mut world, warnings, files, repeats, .. } =
            import::load_model_with(&path, mesh.policy(), &options).map_err(|e| match e {
                Error::Input(inside) if inside.line.is_some() => Error::Input(inside),
                other => self.at_key(file, &other),
            })?;
        files.iter().for_each(|f| self.note_file(f));
        self.warnings.extend(warnings);
        let is_new = self.placed.insert((path, options.time.to_bits()));
        let all = || Repeats {
            copies: world.meshes.len(),
            bytes: world.meshes.iter().map(traced_bytes).sum(),
        };
        let Repeats { copies, bytes } = if is_new { repeats } else { all() };
        self.repeats.copies += copies;
        self.repeats.bytes += bytes;
        if bare {
            world.materials.clear();
            world.textures.clear();
            world.masks.clear();
        }
        Ok(world)
    }

    /// What is wanted of the mesh file `path`.
    ///
    /// Errors: a `time` of a file that is not glTF.
    fn model_options(&self, path: &Path, mesh: &Mesh) -> Result<ModelOptions> {
        let usual = ModelOptions::without_camera();
        let Some(time) = &mesh.time else { return Ok(usual) };
        if !import::gltf::is_named(path) {
            return Err(self.at_span(&time.span, "`time` is for glTF files, .glb and .gltf"));
        }
        Ok(ModelOptions { time: time.value.0, ..usual })
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
    fn at_key(&self, file: &At<String>, error: &Error) -> Error {
        let missing = matches!(error, Error::Io { source, .. }
            if source.kind() == std::io::ErrorKind::NotFound);
        let (message, help) = match error {
            Error::Input(d) => (format!("{}: {}", d.file.display(), d.message), d.help.clone()),
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

    fn warn_of_hidden_light(&mut self, fog: &At<Fog>) {
        let World { fog: built, lights, sky, environment, .. } = &self.world;
        let is_everywhere =
            built.as_ref().is_some_and(|fog| fog.bounds.is_none() && fog.extinction > 0.0);
        let is_outside = |light: &scene::Light| light.far_field().place().is_none();
        let is_bright = sky.radiance.max_element() > 0.0 || environment.is_some();
        if is_everywhere && (is_bright || lights.iter().any(is_outside)) {
            let message = "fog that is everywhere hides the sky, suns and directional lights";
            self.warnings.push(self.source.fault(&fog.span, message).help("give it a `box`"));
        }
    }

    fn warn_of_darkness(&mut self) {
        let World { lights, sky, environment, materials, .. } = &self.world;
        let glows = materials.iter().any(|m| m.emits());
        let bright = environment.is_some()
            || sky.radiance.max_element() > 0.0
            || sky.ambient.max_element() > 0.0;
        if lights.is_empty() && !glows && !bright {
            let warning = Diagnostic::new(&self.source.path, "nothing lights the scene")
                .help("add a [[light]] or give the [sky] a radiance or an image");
            self.warnings.push(warning);
        }
    }
}
