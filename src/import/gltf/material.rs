//! Materials: what glTF says of a surface as the parameters of a [`Material`].

use super::document::Document;
use super::image::{ImageStore, Role};
use super::json::Json;
use super::node::name_of;
use super::texture_info::{LaidImage, TextureTable};
use crate::error::Result;
use crate::import::source::Notes;
use crate::import::texture::ImageChannel;
use crate::math::Rgb;
use crate::scene::{Fresnel, Glass, Material, NormalMap, TextureMap, World};
use std::collections::BTreeSet;

/// A material, with what no single [`Material`] says.
pub(super) struct Surfaced {
    pub material: Material,
    /// Nothing of the surface is there.
    pub is_invisible: bool,
}

/// The images of a material, by key.
#[derive(Default)]
struct Laid {
    base: Option<LaidImage>,
    metal_rough: Option<LaidImage>,
    normal: Option<LaidImage>,
    emissive: Option<LaidImage>,
    transmission: Option<LaidImage>,
    coat: Option<LaidImage>,
    coat_roughness: Option<LaidImage>,
    coat_normal: Option<LaidImage>,
    specular: Option<LaidImage>,
    specular_colour: Option<LaidImage>,
}

impl Laid {
    /// All images, the most important first.
    fn all(&self) -> impl Iterator<Item = &LaidImage> {
        let Self {
            base,
            metal_rough,
            normal,
            emissive,
            transmission,
            coat,
            coat_roughness,
            coat_normal,
            specular,
            specular_colour,
        } = self;
        let of_coat = [coat, coat_roughness, coat_normal];
        let of_base = [base, normal, metal_rough, emissive, transmission];
        of_base.into_iter().chain(of_coat).chain([specular, specular_colour]).flatten()
    }

    /// The file's sets of texture coordinates that the images lie by, each once: the first is the scene's set 0, and so on.
    fn uv_sets(&self) -> Vec<usize> {
        let mut sets = Vec::new();
        for LaidImage { set, .. } in self.all() {
            if !sets.contains(set) {
                sets.push(*set);
            }
        }
        sets
    }
}

/// How opaque a surface is.
enum AlphaMode {
    Opaque,
    /// There where alpha is this or more.
    Mask(f64),
}

/// Reads materials.
pub(super) struct MaterialReader<'d> {
    document: &'d Document<'d>,
    textures: TextureTable<'d>,
}

impl<'d> MaterialReader<'d> {
    pub fn of(document: &'d Document<'d>) -> Result<Self> {
        Ok(Self { document, textures: TextureTable::of(document)? })
    }

    /// The numbers of the images that the materials `used` show.
    ///
    /// Errors: those of [`TextureTable::laid`].
    pub fn images(&self, used: &BTreeSet<usize>) -> Result<BTreeSet<usize>> {
        let mut images = BTreeSet::new();
        for at in used {
            let laid = self.laid(&self.document.materials[*at], &mut Notes::default())?;
            images.extend(laid.all().map(|laid| laid.image));
        }
        Ok(images)
    }

    /// The file's sets of texture coordinates that the images of a material lie by, in the scene's order. None without images.
    ///
    /// Errors: those of [`TextureTable::laid`].
    pub fn uv_sets(&self, material: usize) -> Result<Vec<usize>> {
        let laid = self.laid(&self.document.materials[material], &mut Notes::default())?;
        Ok(laid.uv_sets())
    }

    fn laid(&self, json: &Json<'_>, notes: &mut Notes) -> Result<Laid> {
        let pbr = json.get("pbrMetallicRoughness");
        let mut of = |json: Option<&Json<'_>>, key| match json {
            Some(json) => self.textures.laid(json, key, notes),
            None => Ok(None),
        };
        let base = of(pbr.as_ref(), "baseColorTexture")?;
        let metal_rough = of(pbr.as_ref(), "metallicRoughnessTexture")?;
        let transmits = match json.extension("KHR_materials_transmission") {
            Some(glass) => glass.number("transmissionFactor")?.unwrap_or(0.0) > 0.0,
            None => false,
        };
        // Glass has no normals of an image.
        let normal = if transmits { None } else { of(Some(json), "normalTexture")? };
        // An image times nothing is nothing.
        let glows = json.numbers::<3>("emissiveFactor")?.is_some_and(|factor| factor != [0.0; 3]);
        let emissive = if glows { of(Some(json), "emissiveTexture")? } else { None };
        let mut of_extension = |name, factor, usual: f64, key| {
            let Some(json) = json.extension(name) else { return Ok(None) };
            let counts = json.number(factor)?.unwrap_or(usual) > 0.0;
            if counts { of(Some(&json), key) } else { Ok(None) }
        };
        let transmission = of_extension(
            "KHR_materials_transmission",
            "transmissionFactor",
            0.0,
            "transmissionTexture",
        )?;
        let mut of_coat =
            |key| of_extension("KHR_materials_clearcoat", "clearcoatFactor", 0.0, key);
        let coat = of_coat("clearcoatTexture")?;
        let coat_roughness = of_coat("clearcoatRoughnessTexture")?;
        let coat_normal = if transmits { None } else { of_coat("clearcoatNormalTexture")? };
        let mut of_specular =
            |key| of_extension("KHR_materials_specular", "specularFactor", 1.0, key);
        let specular = of_specular("specularTexture")?;
        let specular_json = json.extension("KHR_materials_specular");
        let tint =
            specular_json.map(|json| json.numbers::<3>("specularColorFactor")).transpose()?;
        let is_tinted = tint.flatten().is_none_or(|tint| tint != [0.0; 3]);
        let specular_colour = if is_tinted { of_specular("specularColorTexture")? } else { None };
        // The ambient occlusion of an image is left out: rays find it.
        Ok(Laid {
            base,
            metal_rough,
            normal,
            emissive,
            transmission,
            coat,
            coat_roughness,
            coat_normal,
            specular,
            specular_colour,
        })
    }

    /// Material number `at`, for meshes that are `coloured` by their vertices or not. Images enter `world`.
    ///
    /// Errors: values of the wrong kind, images that cannot be read.
    pub fn read(
        &self,
        at: usize,
        coloured: bool,
        images: &mut ImageStore,
        world: &mut World,
        notes: &mut Notes,
    ) -> Result<Surfaced> {
        let json = &self.document.materials[at];
        let laid = self.laid(json, notes)?;
        let (base, uv_sets) = (laid.base, laid.uv_sets());
        let mut parts = Parts { json, laid, uv_sets, images, world, notes };
        let mut surfaced = parts.read(coloured)?;
        surfaced.material.name = name_of(json, "material", at)?;
        if let Some((image, cut)) = base.and_then(|base| images.cut(base.image)) {
            let (name, image) = (&surfaced.material.name, image.display());
            notes.add(&format!("material `{name}`: baseColorTexture {image}: {cut}"), None);
        }
        Ok(surfaced)
    }
}

/// One material as it is read.
struct Parts<'p, 'd> {
    json: &'p Json<'d>,
    laid: Laid,
    uv_sets: Vec<usize>,
    images: &'p mut ImageStore,
    world: &'p mut World,
    notes: &'p mut Notes,
}

impl Parts<'_, '_> {
    fn read(&mut self, coloured: bool) -> Result<Surfaced> {
        let pbr = self.json.get("pbrMetallicRoughness");
        let [r, g, b, alpha] = pbr
            .as_ref()
            .map(|pbr| pbr.numbers("baseColorFactor"))
            .transpose()?
            .flatten()
            .unwrap_or([1.0; 4]);
        let base = self.colour([r, g, b]);
        let material = Material { vertex_colours: coloured, ..Material::diffuse("", base) };
        let mut material = match self.json.extension("KHR_materials_unlit") {
            Some(_) => self.unlit(material)?,
            None => self.principled(material, pbr.as_ref())?,
        };
        (material.emission, material.emission_map) = self.emission()?;
        material.emits_back = self.json.truth("doubleSided")?.unwrap_or(false);
        let mut is_invisible = false;
        if let AlphaMode::Mask(cutoff) = self.alpha_mode(alpha)? {
            // An image only takes from it.
            is_invisible = alpha < cutoff;
            material.alpha = self.mask(alpha, cutoff)?;
        }
        if let Some((glass, transmission)) = self.glass(base, pbr.as_ref())? {
            // Beside glass BLEND is for programs that know no transmission.
            let is_mask = self.json.text("alphaMode")? == Some("MASK");
            if !glass.thin && is_mask && material.alpha.is_some() {
                self.notes.add("alphaMode MASK of what has KHR_materials_volume is left out: a body of glass has no cut-outs", None);
            }
            let is_cut = glass.thin && is_mask;
            material.alpha = material.alpha.filter(|_| is_cut);
            is_invisible &= is_cut;
            material = part_glass(material, glass, transmission);
        }
        Ok(Surfaced { material, is_invisible })
    }

    /// A surface that is shown as bright as its colour is, whatever the light: matte, the nearest that there is.
    fn unlit(&mut self, material: Material) -> Result<Material> {
        self.notes.add("KHR_materials_unlit: such surfaces are matte, and lit as all others", None);
        let texture = self.map(self.laid.base, Role::Colour)?;
        Ok(Material { texture, ..material })
    }

    fn principled(&mut self, material: Material, pbr: Option<&Json<'_>>) -> Result<Material> {
        let texture = self.map(self.laid.base, Role::Colour)?;
        let roughness_map = self.map(self.laid.metal_rough, Role::Share(ImageChannel::Green))?;
        let metallic_map = self.map(self.laid.metal_rough, Role::Share(ImageChannel::Blue))?;
        let roughness = self.share(pbr, "roughnessFactor", 1.0)?;
        let metallic = self.share(pbr, "metallicFactor", 1.0)?;
        let normal_map = self.normal_map(self.laid.normal, self.json, "normalTexture")?;
        let (mirror, grazing) = self.reflectance()?;
        let (clearcoat, clearcoat_roughness, clearcoat_normal_map) = self.clearcoat()?;
        let red = Role::Share(ImageChannel::Red);
        let clearcoat_map = self.map(self.laid.coat, red)?;
        let transmission_map = self.map(self.laid.transmission, red)?;
        let green = Role::Share(ImageChannel::Green);
        let clearcoat_roughness_map = self.map(self.laid.coat_roughness, green)?;
        let fresnel = Fresnel {
            grazing,
            specular_map: self.map(self.laid.specular, Role::Share(ImageChannel::Alpha))?,
            specular_colour_map: self.map(self.laid.specular_colour, Role::Light)?,
            metallic,
            metallic_map,
            clearcoat,
            clearcoat_map,
            clearcoat_roughness,
            clearcoat_roughness_map,
            clearcoat_normal_map,
            transmission: 0.0,
            transmission_map,
        };
        let fresnel = Some(fresnel);
        Ok(Material { texture, mirror, roughness, roughness_map, fresnel, normal_map, ..material })
    }

    /// The image of normals that `json` has under `key`; `laid` says how it lies on the surface.
    fn normal_map(
        &mut self,
        laid: Option<LaidImage>,
        json: &Json<'_>,
        key: &str,
    ) -> Result<Option<NormalMap>> {
        let Some(image) = self.map(laid, Role::Normals)? else { return Ok(None) };
        let scale = json.get(key).map(|info| info.number("scale"));
        let strength = scale.transpose()?.flatten().unwrap_or(1.0);
        if strength < 0.0 {
            self.notes.add("a normal map's negative scale is read as a positive one", None);
        }
        Ok(Some(NormalMap { image, strength: strength.abs().min(1e30) }))
    }

    /// Reflectance of what is no metal, at normal incidence and at grazing angles: KHR_materials_ior and
    /// KHR_materials_specular.
    fn reflectance(&mut self) -> Result<(Rgb, f64)> {
        let ior = self.ior()?;
        // 0 stands for reflectance 1, whatever the angle.
        let root = if ior == 0.0 { 1.0 } else { (ior - 1.0) / (ior + 1.0) };
        let Some(json) = self.json.extension("KHR_materials_specular") else {
            return Ok((Rgb::splat((root * root) as f32), 1.0));
        };
        let specular = self.share(Some(&json), "specularFactor", 1.0)?;
        let tint = json.numbers::<3>("specularColorFactor")?.unwrap_or([1.0; 3]);
        let normal = tint.map(|tint| ((root * root * tint.max(0.0)).min(1.0) * specular) as f32);
        Ok((Rgb::from_array(normal), specular))
    }

    fn ior(&self) -> Result<f64> {
        match self.json.extension("KHR_materials_ior") {
            Some(json) => json.number_within("ior", [0.0, 1e3], 1.5),
            None => Ok(1.5),
        }
    }

    /// The share of the surface under a coat, its roughness and its normals.
    fn clearcoat(&mut self) -> Result<(f64, f64, Option<NormalMap>)> {
        let Some(json) = self.json.extension("KHR_materials_clearcoat") else {
            return Ok((0.0, 0.0, None));
        };
        let coat = self.share(Some(&json), "clearcoatFactor", 0.0)?;
        let roughness = self.share(Some(&json), "clearcoatRoughnessFactor", 0.0)?;
        let laid = self.laid.coat_normal;
        Ok((coat, roughness, self.normal_map(laid, &json, "clearcoatNormalTexture")?))
    }

    /// Emitted radiance, and the image that multiplies it. A unit of emission is a unit of radiance: white.
    fn emission(&mut self) -> Result<(Rgb, Option<TextureMap>)> {
        let factor = self.json.numbers::<3>("emissiveFactor")?.unwrap_or_default();
        let strength = match self.json.extension("KHR_materials_emissive_strength") {
            Some(json) => json.number_within("emissiveStrength", [0.0, 1e30], 1.0)?,
            None => 1.0,
        };
        let emission = factor.map(|x| (x.max(0.0) * strength).min(1e30) as f32);
        Ok((Rgb::from_array(emission), self.map(self.laid.emissive, Role::Light)?))
    }

    /// How the surface's alpha is read, `factor` times that of its image.
    fn alpha_mode(&mut self, factor: f64) -> Result<AlphaMode> {
        Ok(match self.json.text("alphaMode")? {
            Some("MASK") => {
                AlphaMode::Mask(self.json.number_within("alphaCutoff", [0.0, f64::MAX], 0.5)?)
            }
            Some("BLEND") => {
                let image = self.laid.base.is_some_and(|base| self.images.has_alpha(base.image));
                if image || factor < 1.0 {
                    self.notes.add("alphaMode BLEND is read as cut-outs: a surface is there where its alpha is a half or more", None);
                }
                AlphaMode::Mask(0.5)
            }
            None | Some("OPAQUE") => AlphaMode::Opaque,
            Some(_) => return Err(self.json.fault("`alphaMode` is OPAQUE, MASK or BLEND").into()),
        })
    }

    /// The mask of the base image's alpha times `factor`, cut at `cutoff`; `None` where it cuts nothing.
    fn mask(&mut self, factor: f64, cutoff: f64) -> Result<Option<TextureMap>> {
        if cutoff == 0.0 {
            return Ok(None);
        }
        let cutoff = if factor > 0.0 { cutoff / factor } else { f64::INFINITY };
        self.map(self.laid.base, Role::Mask(cutoff.to_bits()))
    }

    /// The glass of KHR_materials_transmission and KHR_materials_volume, and the share of what is no metal that it is.
    fn glass(&mut self, tint: Rgb, pbr: Option<&Json<'_>>) -> Result<Option<(Glass, f64)>> {
        let Some(json) = self.json.extension("KHR_materials_transmission") else { return Ok(None) };
        let transmission = self.share(Some(&json), "transmissionFactor", 0.0)?;
        if transmission == 0.0 {
            return Ok(None);
        }
        let roughness = self.share(pbr, "roughnessFactor", 1.0)?;
        let coat = self.json.extension("KHR_materials_clearcoat");
        let of_coat = coat.and_then(|coat| coat.get("clearcoatNormalTexture"));
        if self.json.get("normalTexture").or(of_coat).is_some() {
            self.notes
                .add("what has KHR_materials_transmission is shown without its normal maps", None);
        }
        let ior = self.ior()?;
        let ior = if ior == 0.0 { 1.5 } else { ior.clamp(0.1, 10.0) };
        let volume = self.json.extension("KHR_materials_volume");
        let volume =
            volume.filter(|json| json.number("thicknessFactor").is_ok_and(|t| t > Some(0.0)));
        let Some(volume) = volume else {
            let pane = Glass { roughness, tint, thin: true, ..Glass::clear(ior) };
            return Ok(Some((pane, transmission)));
        };
        let distance = volume.number_within("attenuationDistance", [1e-30, f64::MAX], f64::MAX)?;
        let colour = volume.numbers::<3>("attenuationColor")?.unwrap_or([1.0; 3]);
        // Of black a millionth is left after the distance.
        let absorption =
            colour.map(|c| (-libm::log(c.clamp(1e-6, 1.0)) / distance).min(1e30) as f32);
        let absorption = Rgb::from_array(absorption);
        Ok(Some((Glass { roughness, tint, absorption, ..Glass::clear(ior) }, transmission)))
    }

    /// A colour from 0 to 1; what lies outside is cut.
    fn colour(&mut self, colour: [f64; 3]) -> Rgb {
        if colour.iter().any(|c| !(0.0..=1.0).contains(c)) {
            self.notes.add("numbers of a material outside of 0 to 1 were cut to that", None);
        }
        Rgb::from_array(colour.map(|c| c.clamp(0.0, 1.0) as f32))
    }

    /// A number from 0 to 1; what lies outside is cut.
    fn share(&mut self, json: Option<&Json<'_>>, key: &str, default: f64) -> Result<f64> {
        let share = json.map(|json| json.number(key)).transpose()?.flatten().unwrap_or(default);
        if !(0.0..=1.0).contains(&share) {
            self.notes.add("numbers of a material outside of 0 to 1 were cut to that", None);
        }
        Ok(share.clamp(0.0, 1.0))
    }

    fn map(&mut self, laid: Option<LaidImage>, role: Role) -> Result<Option<TextureMap>> {
        let Some(laid) = laid else { return Ok(None) };
        let number = self.images.place(laid.image, role, self.world)?;
        // A material has a handful of images, so no more sets than a byte counts.
        let uv_set = self.uv_sets.iter().position(|set| *set == laid.set).unwrap_or(0) as u8;
        Ok(number.map(|number| laid.map(number, uv_set)))
    }
}

/// `material` of which `transmission` is `glass`: where nothing else is, glass alone.
fn part_glass(material: Material, glass: Glass, transmission: f64) -> Material {
    let glass = Some(glass);
    let Material { alpha, emission, emission_map, emits_back, .. } = material;
    let name = material.name.clone();
    let alone =
        Material { glass, alpha, emission, emission_map, emits_back, ..Material::black(name) };
    let Some(fresnel) = material.fresnel else { return alone };
    let is_alone = transmission == 1.0 && fresnel.metallic == 0.0 && fresnel.clearcoat == 0.0;
    if is_alone && !material.has_image() && !material.vertex_colours {
        return alone;
    }
    let fresnel = Some(Fresnel { transmission, ..fresnel });
    Material { glass, fresnel, ..material }
}
