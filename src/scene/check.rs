//! Errors in a world that is built in code, which would break tracing: refused by name.

use super::{
    AlphaMask, Fog, Fresnel, Glass, Light, Material, NormalMap, TextureMap, World, WorldMesh,
};
use crate::error::{Error, Result};
use crate::math::Rgb;

impl World {
    /// Refuses indices of materials, textures, masks and vertices that there are not, bodies of glass with cut-outs, thin glass with an inside, and lights and
    /// spheres whose place is no number: no bounds would hold them. (The numbers of meshes are finite by
    /// invariant.)
    pub(super) fn check(&self) -> Result<()> {
        let meshes = self.meshes.iter().map(|m| (&m.name, m.material));
        let spheres = self.spheres.iter().map(|s| (&s.name, s.material));
        let count = self.materials.len();
        let stray = meshes.chain(spheres).find(|(_, material)| *material as usize >= count);
        if let Some((name, material)) = stray {
            let message = format!("`{name}` is of material {material}, counted from 0, of {count}");
            return Err(Error::Usage(message));
        }
        self.materials.iter().try_for_each(|material| {
            let of =
                |map: &TextureMap, what: &str| image_of(map, &self.textures, what, &material.name);
            material.texture.as_ref().map(|map| of(map, "texture")).transpose()?;
            material.emission_map.as_ref().map(|map| of(map, "emission map")).transpose()?;
            material.roughness_map.as_ref().map(|map| of(map, "roughness map")).transpose()?;
            for (share, map) in material.fresnel.iter().flat_map(Fresnel::maps) {
                map.as_ref().map(|map| of(map, &format!("{share} map"))).transpose()?;
            }
            material.normal_maps().try_for_each(|map| self.check_normal_map(material, map))?;
            check_glass(material)?;
            self.check_mask(material)
        })?;
        self.meshes.iter().try_for_each(check_vertices)?;
        let sky = self.sky.radiance;
        self.environment.iter().try_for_each(|own| own.check(&self.textures, sky))?;
        self.fog.iter().try_for_each(Fog::check)?;
        self.check_finite()
    }

    fn check_normal_map(&self, material: &Material, (what, map): (&str, &NormalMap)) -> Result<()> {
        let name = &material.name;
        image_of(&map.image, &self.textures, what, name)?;
        if !(map.strength >= 0.0 && map.strength.is_finite()) {
            let message = format!("the `{what}` of `{name}` has the strength {}", map.strength);
            return Err(Error::Usage(message));
        }
        if material.glass.is_some() {
            let message = format!("`{name}` is glass with a `{what}`, which glass has none of");
            return Err(Error::Usage(message));
        }
        Ok(())
    }

    fn check_mask(&self, material: &Material) -> Result<()> {
        let Some(map) = &material.alpha else { return Ok(()) };
        let name = &material.name;
        let mask = image_of(map, &self.masks, "mask", name)?;
        if !mask.is_whole() {
            let AlphaMask { name: mask, width, height, texels } = mask;
            let count = texels.len();
            let message =
                format!("the mask `{mask}` of {width} x {height} texels has {count} of them");
            return Err(Error::Usage(message));
        }
        if material.glass.is_some_and(|glass| !glass.thin) {
            let message = format!(
                "`{name}` is glass with cut-outs: a body of glass is closed, and a hole would leave it open"
            );
            return Err(Error::Usage(message));
        }
        Ok(())
    }

    fn check_finite(&self) -> Result<()> {
        let what = |what: &str| {
            Err(Error::Usage(format!("the place or size of {what} is not a finite number")))
        };
        if let Some(index) = self.lights.iter().position(|l| matches!(l, Light::Face(_))) {
            let message =
                format!("light {} is a face of no mesh: faces light by their material", index + 1);
            return Err(Error::Usage(message));
        }
        if let Some(index) = self.lights.iter().position(|l| !l.is_finite()) {
            return what(&format!("light {}", index + 1));
        }
        match self.spheres.iter().find(|s| !(s.centre.is_finite() && s.radius.is_finite())) {
            Some(sphere) => what(&format!("`{}`", sphere.name)),
            None => Ok(()),
        }
    }
}

/// A thin pane has no inside that a priority or absorption could be of, and only polished glass has a priority.
fn check_glass(material: &Material) -> Result<()> {
    let share = material.fresnel.map(|fresnel| fresnel.transmission);
    let Some(glass) = &material.glass else {
        if share.is_some_and(|share| share != 0.0) {
            let message = format!("`{}` lets light through, but has no glass", material.name);
            return Err(Error::Usage(message));
        }
        return Ok(());
    };
    let is_ranked = glass.priority.is_some();
    let what = match glass {
        _ if share == Some(0.0) => "glass of which layers leave nothing",
        _ if share.is_some() && is_ranked => "glass with a priority beside other layers",
        _ if is_ranked && material.emits() => "glass with a priority that emits",
        Glass { thin: true, absorption, .. } if is_ranked || *absorption != Rgb::ZERO => {
            "thin glass with a priority or absorption, which bodies have"
        }
        Glass { roughness, .. } if is_ranked && *roughness != 0.0 => {
            "rough glass with a priority, which polished glass has"
        }
        _ => return Ok(()),
    };
    Err(Error::Usage(format!("`{}` is {what}", material.name)))
}

/// The image among `images` that a material lays on surfaces; `what` names it: a "texture", a "mask".
fn image_of<'w, T>(map: &TextureMap, images: &'w [T], what: &str, material: &str) -> Result<&'w T> {
    let (at, count) = (map.image, images.len());
    let image = images.get(at as usize).ok_or_else(|| {
        Error::Usage(format!("`{material}` has the {what} {at}, counted from 0, of {count}"))
    })?;
    if !map.transform.is_finite() {
        let message = format!("the {what} of `{material}` lies by numbers that are not finite");
        return Err(Error::Usage(message));
    }
    Ok(image)
}

fn check_vertices(mesh: &WorldMesh) -> Result<()> {
    let count = mesh.positions.len();
    if let Some(colours) = mesh.colours.as_ref().filter(|c| c.count() != count) {
        let (name, colours) = (&mesh.name, colours.count());
        let message = format!("`{name}` has {colours} vertex colours for {count} vertices");
        return Err(Error::Usage(message));
    }
    if mesh.colours.as_ref().is_some_and(|colours| !colours.are_reflectances()) {
        let message = format!("a vertex colour of `{}` lies outside of 0 to 1", mesh.name);
        return Err(Error::Usage(message));
    }
    let most = mesh.triangles.iter().flatten().copied().max();
    match most.filter(|most| *most as usize >= count) {
        Some(most) => Err(Error::Usage(format!(
            "a triangle of `{}` has vertex {most}, counted from 0, of {count}",
            mesh.name
        ))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, Rgb};
    use crate::scene::{Texture, VertexColours, WorldSphere};

    #[test]
    fn indices_out_of_range_are_refused_by_name() {
        let refusal = |world: World| world.into_scene(true).expect_err("no scene").to_string();
        let floor = |last, material| {
            let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Z];
            WorldMesh::new("floor", corners, vec![[0, 1, last]], material)
        };
        let world = |meshes| World { meshes, ..World::default() };
        assert!(refusal(world(vec![floor(2, 0)])).contains("`floor` is of material 0"));
        let mut bad = world(vec![floor(3, 0)]);
        bad.add_material(Material::diffuse("white", Rgb::ONE));
        assert!(refusal(bad.clone()).contains("`floor` has vertex 3"));
        bad.meshes = vec![floor(2, 0)];
        bad.spheres = vec![WorldSphere::new("ball", DVec3::ZERO, 1.0, 1)];
        assert!(refusal(bad).contains("`ball` is of material 1"));
    }

    #[test]
    fn vertex_colours_that_do_not_fit_are_refused_by_name() {
        let refusal = |colours: Vec<Rgb>| {
            let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Z];
            let mesh = WorldMesh::new("scan", corners, vec![[0, 1, 2]], 0);
            let colours = Some(VertexColours::from_linear(colours));
            let meshes = vec![WorldMesh { colours, ..mesh }];
            let materials = vec![Material::diffuse("white", Rgb::ONE)];
            let world = World { meshes, materials, ..World::default() };
            world.into_scene(true).expect_err("no scene").to_string()
        };
        assert!(refusal(vec![Rgb::ONE; 2]).contains("`scan` has 2 vertex colours for 3 vertices"));
        for bad in [f32::NAN, -0.1, 1.5] {
            let refused = refusal(vec![Rgb::ONE, Rgb::splat(bad), Rgb::ONE]);
            assert!(refused.contains("vertex colour of `scan`"), "{bad}: {refused}");
        }
    }

    #[test]
    fn masks_that_are_not_there_or_on_glass_are_refused_by_name() {
        let refusal = |material: Material, masks: Vec<AlphaMask>| {
            let world = World { materials: vec![material], masks, ..World::default() };
            world.into_scene(true).expect_err("no scene").to_string()
        };
        let leaf =
            Material { alpha: Some(TextureMap::of(0)), ..Material::diffuse("leaf", Rgb::ONE) };
        let mask = AlphaMask { name: "m".into(), width: 2, height: 2, texels: vec![0; 4] };
        assert!(refusal(leaf.clone(), vec![]).contains("`leaf` has the mask 0"));
        let short = AlphaMask { texels: vec![0; 3], ..mask.clone() };
        assert!(refusal(leaf, vec![short]).contains("`m` of 2 x 2 texels has 3"));
        let body = Material { alpha: Some(TextureMap::of(0)), ..Material::glass("body", 1.5) };
        assert!(
            refusal(body.clone(), vec![mask.clone()]).contains("`body` is glass with cut-outs")
        );
        let pane = Material { glass: Some(Glass { thin: true, ..Glass::clear(1.5) }), ..body };
        let world = World { materials: vec![pane], masks: vec![mask], ..World::default() };
        assert!(world.into_scene(true).is_ok());
        let ranked = Glass { priority: Some(1), ..Glass::clear(1.5) };
        let of = |glass| Material { glass: Some(glass), ..Material::black("pane") };
        let pane = Glass { thin: true, ..ranked };
        assert!(refusal(of(pane), vec![]).contains("`pane` is thin glass"));
        let frosted = Glass { roughness: 0.3, ..ranked };
        assert!(refusal(of(frosted), vec![]).contains("`pane` is rough glass"));
    }

    #[test]
    fn normal_maps_of_wrong_strength_or_on_glass_are_refused_by_name() {
        let refusal = |strength: f64, glass: Option<Glass>| {
            let map = Some(NormalMap { image: TextureMap::of(0), strength });
            let transmission = if glass.is_some() { 0.5 } else { 0.0 };
            let layers = Fresnel { clearcoat: 1.0, transmission, ..Fresnel::PLASTIC };
            let black = Material::black("hull");
            let base = Material { normal_map: map, glass, fresnel: Some(layers), ..black.clone() };
            let coated = Some(Fresnel { clearcoat_normal_map: map, ..layers });
            let coat = Material { glass, fresnel: coated, ..black };
            [base, coat].map(|material| {
                let image = Texture::from_vectors8("n", [1, 1], vec![[128, 128, 255]]);
                let (materials, textures) = (vec![material], vec![image]);
                let world = World { materials, textures, ..World::default() };
                world.into_scene(true).map_or_else(|e| e.to_string(), |_| String::new())
            })
        };
        assert_eq!(refusal(1.0, None), ["", ""]);
        for strength in [-1.0, f64::NAN, f64::INFINITY] {
            let [base, coat] = refusal(strength, None);
            assert!(base.contains("the `normal_map` of `hull` has the strength"), "{base}");
            assert!(coat.contains("the `clearcoat_normal_map` of `hull` has"), "{coat}");
        }
        let [base, coat] = refusal(1.0, Some(Glass::clear(1.5)));
        assert!(base.contains("`hull` is glass with a `normal_map`"), "{base}");
        assert!(coat.contains("`hull` is glass with a `clearcoat_normal_map`"), "{coat}");
    }
}
