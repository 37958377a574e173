//! Materials: the parameters of a surface's scattering. How it scatters stands in `shade::lobe`.

use super::TextureMap;
use crate::math::Rgb;
use serde::{Deserialize, Serialize};

/// Index into `Scene::materials`.
pub type MaterialId = u32;

/// A surface's parameters. Components add up: the course's materials are diffuse and
/// mirror-like at once. Reflectances are linear RGB in `[0, 1]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name as the file spells it.
    pub name: String,
    /// Diffuse reflectance (albedo), Lambertian, both sides.
    pub diffuse: Rgb,
    /// Image that multiplies `diffuse`.
    pub texture: Option<TextureMap>,
    /// Image of normals of a finer surface, but for its clear coat. None on glass.
    pub normal_map: Option<NormalMap>,
    /// Whether the vertex colours of a mesh multiply `diffuse`; what has none counts as white.
    pub vertex_colours: bool,
    /// Mask of its cut-outs: where it says so, the surface is not there. None on glass.
    pub alpha: Option<TextureMap>,
    /// Reflectance of a mirror, both sides.
    pub mirror: Rgb,
    /// Roughness of the mirror in `[0, 1]`; 0 is perfect.
    pub roughness: f64,
    /// Image that multiplies `roughness` and that of the glass, of data from 0 to 1.
    pub roughness_map: Option<TextureMap>,
    /// How the mirror's reflectance grows towards grazing angles, and what of the surface is metal. The mirror then takes
    /// its share from the diffuse part. `None`: `mirror` at every angle, beside the diffuse part.
    pub fresnel: Option<Fresnel>,
    /// Glass; then `diffuse` and `mirror` are zero, unless `fresnel` says what share of the surface is glass.
    pub glass: Option<Glass>,
    /// Emitted radiance.
    pub emission: Rgb,
    /// Image that multiplies `emission`.
    pub emission_map: Option<TextureMap>,
    /// Whether the back emits too.
    pub emits_back: bool,
}

/// How a material takes normals from an image: in tangent space, +Y up. A lookup's red, green and blue, from 0 to 1, are
/// the normal's parts along u, v and the shading normal, from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NormalMap {
    /// How it lies on the surface.
    pub image: TextureMap,
    /// Factor on the parts along u and v; at least 0.
    pub strength: f64,
}

/// Reflection that grows towards grazing angles, as of plastic, varnish and metal: over a diffuse part lies a mirror with the
/// reflectance `mirror` at normal incidence, and over both, if anything, a clear coat. Shares are from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fresnel {
    /// Reflectance at grazing angles, of what is no metal.
    pub grazing: f64,
    /// Share of the surface that is metal: it reflects `diffuse` (with texture and vertex colours) at normal incidence and
    /// all light at grazing angles, and has no diffuse part.
    pub metallic: f64,
    /// Image that multiplies `metallic`, of data from 0 to 1.
    pub metallic_map: Option<TextureMap>,
    /// Image that multiplies what is reflected of what is no metal, `mirror` and `grazing`; of data from 0 to 1.
    pub specular_map: Option<TextureMap>,
    /// Image of colours that multiplies what is reflected of what is no metal at normal incidence, `mirror`.
    pub specular_colour_map: Option<TextureMap>,
    /// Share of the surface that lies under a clear coat.
    pub clearcoat: f64,
    /// Image that multiplies `clearcoat`, of data from 0 to 1.
    pub clearcoat_map: Option<TextureMap>,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: f64,
    /// Image that multiplies `clearcoat_roughness`, of data from 0 to 1.
    pub clearcoat_roughness_map: Option<TextureMap>,
    /// Image of normals of the clear coat, which without it is as smooth as the mesh. None on glass.
    pub clearcoat_normal_map: Option<NormalMap>,
    /// Share of what is no metal that is the material's `glass`, in place of the diffuse part and the mirror over it. The glass
    /// then has the roughness of the mirror, and image and vertex colours multiply its tint. 0 of materials without glass.
    pub transmission: f64,
    /// Image that multiplies `transmission`, of data from 0 to 1.
    pub transmission_map: Option<TextureMap>,
}

impl Fresnel {
    /// Plastic: all light at grazing angles, over the diffuse part.
    pub const PLASTIC: Self = Self {
        grazing: 1.0,
        metallic: 0.0,
        metallic_map: None,
        specular_map: None,
        specular_colour_map: None,
        clearcoat: 0.0,
        clearcoat_map: None,
        clearcoat_roughness: 0.0,
        clearcoat_roughness_map: None,
        clearcoat_normal_map: None,
        transmission: 0.0,
        transmission_map: None,
    };

    /// Its images but for normals, each after the name of what it multiplies.
    pub fn maps(&self) -> [(&'static str, &Option<TextureMap>); 6] {
        [
            ("metallic", &self.metallic_map),
            ("specular", &self.specular_map),
            ("specular_colour", &self.specular_colour_map),
            ("clearcoat", &self.clearcoat_map),
            ("clearcoat_roughness", &self.clearcoat_roughness_map),
            ("transmission", &self.transmission_map),
        ]
    }

    /// All its images, to be changed.
    fn images_mut(&mut self) -> impl Iterator<Item = &mut TextureMap> {
        let maps = [
            &mut self.metallic_map,
            &mut self.specular_map,
            &mut self.specular_colour_map,
            &mut self.clearcoat_map,
            &mut self.clearcoat_roughness_map,
            &mut self.transmission_map,
        ];
        let normals = self.clearcoat_normal_map.as_mut().map(|map| &mut map.image);
        maps.into_iter().flatten().chain(normals)
    }
}

impl Material {
    /// A material that reflects and emits nothing.
    pub fn black(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            diffuse: Rgb::ZERO,
            texture: None,
            normal_map: None,
            vertex_colours: false,
            alpha: None,
            mirror: Rgb::ZERO,
            roughness: 0.0,
            roughness_map: None,
            fresnel: None,
            glass: None,
            emission: Rgb::ZERO,
            emission_map: None,
            emits_back: false,
        }
    }

    /// A Lambertian material.
    pub fn diffuse(name: impl Into<String>, albedo: Rgb) -> Self {
        Self { diffuse: albedo, ..Self::black(name) }
    }

    /// A perfect mirror.
    pub fn mirror(name: impl Into<String>, reflectance: Rgb) -> Self {
        Self { mirror: reflectance, ..Self::black(name) }
    }

    /// Whether anything but its cut-outs is looked up in an image.
    pub fn has_image(&self) -> bool {
        self.images().next().is_some()
    }

    /// The images of [`has_image`](Self::has_image), each an index into `Scene::textures`.
    pub fn images(&self) -> impl Iterator<Item = &TextureMap> {
        let normals = self.normal_maps().map(|(_, map)| &map.image);
        let shares =
            self.fresnel.iter().flat_map(|fresnel| fresnel.maps()).map(|(_, map)| map.as_ref());
        let maps = [&self.texture, &self.roughness_map, &self.emission_map].map(Option::as_ref);
        maps.into_iter().chain(shares).flatten().chain(normals)
    }

    /// Its images of normals, of the surface and of its clear coat, each after its name.
    pub fn normal_maps(&self) -> impl Iterator<Item = (&'static str, &NormalMap)> {
        let coat = self.fresnel.as_ref().map(|fresnel| &fresnel.clearcoat_normal_map);
        let maps =
            [("normal_map", Some(&self.normal_map)), ("clearcoat_normal_map", coat)].into_iter();
        maps.filter_map(|(name, map)| Some((name, map?.as_ref()?)))
    }

    /// [`images`](Self::images), to be changed.
    pub fn images_mut(&mut self) -> impl Iterator<Item = &mut TextureMap> {
        let normals = self.normal_map.as_mut().map(|map| &mut map.image);
        let layers = self.fresnel.iter_mut().flat_map(Fresnel::images_mut);
        let maps = [&mut self.texture, &mut self.roughness_map, &mut self.emission_map];
        maps.into_iter().flatten().chain(normals).chain(layers)
    }

    /// Whether any of the surface reflects light diffusely. What is NaN or negative goes on, to be counted at its pixel.
    pub fn is_diffuse(&self) -> bool {
        let is_metal = |f: &Fresnel| f.metallic == 1.0 && f.metallic_map.is_none();
        let is_clear =
            |f: &Fresnel| is_metal(f) || f.transmission == 1.0 && f.transmission_map.is_none();
        self.diffuse != Rgb::ZERO && !self.fresnel.as_ref().is_some_and(is_clear)
    }

    /// Whether glass gives light that goes through it another colour.
    pub fn colours_light(&self) -> bool {
        let is_grey = |colour: Rgb| colour == Rgb::splat(colour.x);
        let is_painted = self.texture.is_some() || self.vertex_colours;
        self.glass.is_some_and(|glass| {
            !is_grey(glass.tint)
                || !is_grey(glass.absorption)
                || self.fresnel.is_some() && is_painted
        })
    }

    /// Whether any of the surface is a mirror, perfect or rough, or glass beside other layers.
    pub fn is_mirror(&self) -> bool {
        let any = |f: Fresnel| [f.grazing, f.metallic, f.clearcoat, f.transmission] != [0.0; 4];
        self.mirror != Rgb::ZERO || self.fresnel.is_some_and(any)
    }

    /// Whether the layers that `fresnel` says are seen from outside the surface, or from inside. The inner side of a body of
    /// glass has none: light that would meet them has crossed glass, where no shadow ray leads.
    pub fn shows_layers(&self, outside: bool) -> bool {
        self.fresnel.is_some() && (outside || self.glass.is_none_or(|glass| glass.thin))
    }

    /// Whether any mirror or coat of it, or its glass, is rough.
    pub fn is_glossy(&self) -> bool {
        let is_coat_rough = |f: Fresnel| f.clearcoat != 0.0 && f.clearcoat_roughness != 0.0;
        let is_glass_rough = self.glass.as_ref().is_some_and(Glass::is_rough);
        is_glass_rough
            || self.is_mirror() && self.roughness != 0.0
            || self.fresnel.is_some_and(is_coat_rough)
    }

    /// Whether the surface reflects any light; glass does not count.
    pub fn reflects(&self) -> bool {
        let most = self.diffuse.max_element().max(self.mirror.max_element());
        let any = |f: Fresnel| f.grazing > 0.0 || f.clearcoat > 0.0 || f.metallic > 0.0;
        most > 0.0 || self.fresnel.is_some_and(any)
    }

    /// Whether the surface emits; what is no number counts, so that it is noticed.
    pub fn emits(&self) -> bool {
        !self.emission.cmple(Rgb::ZERO).all()
    }

    /// Emitted radiance towards the outside or inside, but for its image.
    pub fn emitted(&self, outside: bool) -> Rgb {
        if outside || self.emits_back { self.emission } else { Rgb::ZERO }
    }

    /// Clear glass with the index of refraction `ior`.
    pub fn glass(name: impl Into<String>, ior: f64) -> Self {
        Self { glass: Some(Glass::clear(ior)), ..Self::black(name) }
    }
}

/// A dielectric boundary, smooth or rough; the mesh's outward normals point to the outside medium. Or a thin pane: both its faces
/// are the one surface.
///
/// With a `priority` the body that it bounds may overlap others: where several are, the one of
/// the highest priority is, and the rest are not (Schmidt and Budge, 2002).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Glass {
    /// Roughness in `[0, 1]`; 0 is polished, 1 as ground as glass gets. Rough glass has no `priority`.
    pub roughness: f64,
    /// Index of refraction inside; positive. Relative to outside, whatever that is; with a
    /// `priority`, relative to air.
    pub ior: f64,
    /// Share of light that each crossing transmits, linear RGB (white is clear).
    pub tint: Rgb,
    /// Absorption coefficient of the body, per world unit, linear RGB: after a way of `x` the share
    /// exp(-absorption x) of light is left (Beer, 1852). Takes a closed surface.
    pub absorption: Rgb,
    /// Which of several bodies at one place is there: the highest. Those that overlap need
    /// different ones. None of a thin pane.
    pub priority: Option<u8>,
    /// Whether it is a pane without thickness: light goes straight through it, and nothing is inside. `tint` is then
    /// of the pane, and `absorption` is zero.
    pub thin: bool,
}

impl Glass {
    /// Glass with the index of refraction `ior` that takes nothing from light and overlaps nothing.
    pub fn clear(ior: f64) -> Self {
        let (tint, absorption) = (Rgb::ONE, Rgb::ZERO);
        Self { roughness: 0.0, ior, tint, absorption, priority: None, thin: false }
    }

    /// Whether it scatters light to many directions. A body whose index is that of what is around it bends none.
    pub fn is_rough(&self) -> bool {
        self.roughness != 0.0 && (self.thin || self.ior != 1.0)
    }
}
