//! Conversion of MTL materials to those of a Whitted renderer.
//!
//! | MTL | ours |
//! |---|---|
//! | `Kd`, `map_Kd` | diffuse reflectance, texture; nothing on glass |
//! | `norm`; `map_Bump` and `bump` whose image looks like normals | normal map, `-bm` its strength; nothing on glass |
//! | `map_d` | cut-outs: below a half the surface is not there; nothing on glass |
//! | `-s`, `-o`, `-clamp` of images | how the image lies ([`super::image`]) |
//! | `Ke`, `map_Ke` | emission, both sides, and its image |
//! | `illum` 3 or 5 with `Ks` and without `Pm` or `Pc` | mirror of reflectance `Ks` beside the diffuse part; perfect, or of the roughness `Pr` or `map_Pr` |
//! | `Pm`, `map_Pm`, `Pc`; `Pr`, `map_Pr` of what is no mirror | principled: metallic, clear coat (`Pcr` its roughness), roughness (else 0.5), the index of refraction `Ni` (else 1.5) |
//! | `illum` 6 or 7; 4 or 9 unless `d` is 1 or `map_d` alone; `d` of at most 0.5 with `Ni` | glass: `Ni` (else 1.5), `Tf`, `Pr` or `map_Pr` (else polished) |
//! | `Ks` otherwise, `Ns`, `Ka` | nothing: no glossy highlights |

use super::front::Source;
use crate::import::model::DEFAULT_ALBEDO;
use crate::math::{DVec3, Rgb};
use crate::scene::{Fresnel, Glass, Material};

/// Index of refraction of glass whose file has no `Ni`.
const DEFAULT_IOR: f64 = 1.5;

/// Roughness of physically based materials whose file has none.
const DEFAULT_ROUGHNESS: f64 = 0.5;

/// The material without its images, and warnings about it.
pub(super) fn of(source: &Source, mtl: &tobj::Material) -> (Material, Vec<String>) {
    let mut notes = Vec::new();
    let mut out = Material::black(&source.name);
    // Programs that write an image beside black mean the image.
    let plain = if source.emission_map.is_some() { Rgb::ONE } else { Rgb::ZERO };
    out.emission = emission(mtl).unwrap_or(plain);
    out.emits_back = true;
    if is_glass(source, mtl, &mut notes) {
        let tint = source.filter.map_or(Rgb::ONE, rgb);
        let ior = mtl.optical_density.unwrap_or_else(|| {
            notes.push(format!("glass without `Ni`: the index of refraction is {DEFAULT_IOR}"));
            DEFAULT_IOR
        });
        let roughness = source.roughness.unwrap_or(0.0);
        out.glass = Some(Glass { tint, roughness, ..Glass::clear(ior) });
        if let Some(bump) = &source.normal_map {
            let line = bump.line;
            notes.push(format!("glass has no normal map: that of line {line} is ignored"));
        }
        if source.texture.is_some() {
            notes.push("texture left out: glass has none, `map_Kd` is ignored".into());
        }
        let is_metal = source.metallic.is_some_and(|metallic| metallic > 0.0);
        let is_coated = source.clearcoat.is_some_and(|coat| coat > 0.0);
        for (keyword, is_given) in
            [("Pm", is_metal), ("map_Pm", source.metallic_map.is_some()), ("Pc", is_coated)]
        {
            if is_given {
                notes.push(format!("glass is neither metal nor coated: `{keyword}` is ignored"));
            }
        }
        if source.mask.is_some() {
            notes.push("cut-outs left out: glass has none, `map_d` is ignored".into());
        }
        return (out, notes);
    }
    let is_principled = is_principled(source, mtl);
    if let Some(mirror) = mirror(mtl).filter(|_| !is_principled) {
        out.mirror = mirror;
        out.roughness = source.roughness.unwrap_or(0.0);
    }
    let dark = out.mirror != Rgb::ZERO || out.emission != Rgb::ZERO;
    out.diffuse = match mtl.diffuse {
        Some(diffuse) => rgb(diffuse),
        None if dark => Rgb::ZERO,
        None => DEFAULT_ALBEDO,
    };
    if is_principled {
        out.diffuse = out.diffuse.min(Rgb::ONE);
        cover(&mut out, source, mtl);
    }
    (out, notes)
}

/// Scales down what reflects more than all light, and says so. Layers share the light by themselves.
pub(super) fn limit(material: &mut Material) -> Option<String> {
    let most = (material.diffuse + material.mirror).max_element();
    if most <= 1.0 || material.fresnel.is_some() {
        return None;
    }
    material.diffuse /= most;
    material.mirror /= most;
    let diffuse = if material.texture.is_some() { "`Kd` times `map_Kd`" } else { "`Kd`" };
    Some(format!("{diffuse} and `Ks` reflect up to {most} of the light: scaled down to 1"))
}

/// The factor on the texture: `Kd`, or 1 if it is missing or black, since programs that write these beside a
/// texture mean the plain texture.
pub(super) fn textured(mtl: &tobj::Material) -> Rgb {
    match mtl.diffuse.map(rgb) {
        Some(diffuse) if diffuse != Rgb::ZERO => diffuse.min(Rgb::ONE),
        _ => Rgb::ONE,
    }
}

/// `Ke`, unless that is black.
pub(super) fn emission(mtl: &tobj::Material) -> Option<Rgb> {
    mtl.emissive.map(rgb).filter(|emission| *emission != Rgb::ZERO)
}

/// The reflectance of the mirror that it is, if any.
pub(super) fn mirror(mtl: &tobj::Material) -> Option<Rgb> {
    let is_mirror = matches!(mtl.illumination_model, Some(3 | 5));
    mtl.specular.filter(|_| is_mirror).map(rgb).filter(|mirror| *mirror != Rgb::ZERO)
}

/// Whether it is a material of the extension for physically based materials: a mirror has a roughness without being one.
fn is_principled(source: &Source, mtl: &tobj::Material) -> bool {
    let Source { roughness, roughness_map, metallic, metallic_map, clearcoat, .. } = source;
    let is_rough = roughness.is_some() || roughness_map.is_some();
    metallic.is_some()
        || metallic_map.is_some()
        || clearcoat.is_some_and(|coat| coat > 0.0)
        || (is_rough && mirror(mtl).is_none())
}

/// The layers over the base colour.
fn cover(out: &mut Material, source: &Source, mtl: &tobj::Material) {
    // Next to no index of refraction is what programs write that mean none.
    let ior = mtl.optical_density.filter(|ior| *ior > 1.0).unwrap_or(DEFAULT_IOR);
    let root = (ior - 1.0) / (ior + 1.0);
    out.mirror = Rgb::splat((root * root) as f32);
    out.roughness = source.roughness.unwrap_or(DEFAULT_ROUGHNESS);
    out.fresnel = Some(Fresnel {
        metallic: source.metallic.unwrap_or(0.0),
        clearcoat: source.clearcoat.unwrap_or(0.0),
        clearcoat_roughness: source.clearcoat_roughness.unwrap_or(0.0),
        ..Fresnel::PLASTIC
    });
}

fn is_glass(source: &Source, mtl: &tobj::Material, notes: &mut Vec<String>) -> bool {
    let clear = mtl.dissolve.is_some_and(|d| d < 1.0);
    // Programs write an `Ni` with everything: what is more than half opaque is paint.
    let is_mostly_there = mtl.dissolve.is_some_and(|d| d > 0.5);
    match mtl.illumination_model {
        Some(6 | 7) => true,
        // 3ds Max writes `illum 4` with `d 1` for what is plainly opaque. A map says what is transparent.
        Some(4 | 9) => clear || (mtl.dissolve.is_none() && source.mask.is_none()),
        _ if clear && mtl.optical_density.is_some() && !is_mostly_there => true,
        _ => {
            if clear {
                let why = if is_mostly_there { "by less than half" } else { "without `Ni`" };
                notes.push(format!("transparent (`d`, `Tr`) {why}: rendered opaque"));
            }
            false
        }
    }
}

fn rgb(c: [f64; 3]) -> Rgb {
    DVec3::from_array(c).as_vec3()
}
