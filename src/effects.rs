//! What a scene calls for, decided once before the first pixel.
//!
//! An absent effect casts no ray, takes no branch per pixel and holds no memory: `shade` picks
//! its kernel by this plan. `tweenray inspect` prints [`EffectPlan::reasons`].

use crate::error::counted;
use crate::math::Rgb;
use crate::scene::{
    Fog, Fresnel, Glass, GlassShadows, Light, Material, MeanLights, Mesh, Scene, Settings,
    ShotLens, ratio_count,
};

/// Which effects run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EffectPlan {
    /// Mirrors, perfect or rough, exist and bounces are allowed.
    pub mirror: bool,
    /// Glass exists and bounces are allowed.
    pub glass: bool,
    /// Some of the glass has a priority: paths carry the bodies that they are in.
    pub nested_glass: bool,
    /// Some of the glass absorbs light along the way.
    pub absorption: bool,
    /// Some material shows an image: paths carry how wide they are.
    pub textures: bool,
    /// Some surface reflects diffusely: the light there can be kept for other frames.
    pub diffuse: bool,
    /// Diffuse or glossy surfaces are lit by area lights with shadow samples.
    pub area_lights: bool,
    /// Diffuse or glossy surfaces are lit by delta lights, with hard shadows.
    pub delta_lights: bool,
    /// The sky lights diffuse surfaces through sky rays; an environment glossy ones too.
    pub sky_light: bool,
    /// Rays that leave the scene see more than one colour: an environment, or a sun.
    pub environment: bool,
    /// Light goes straight through glass, to diffuse surfaces and fog, and of lights without a surface to glossy ones.
    pub glass_shadows: bool,
    /// Some of that glass gives light another colour.
    pub coloured_shadows: bool,
    /// A medium between the surfaces takes light from rays and scatters some towards them.
    pub fog: bool,
    /// A ray-free ambient term is added.
    pub ambient: bool,
}

/// One line of `inspect`: an effect, whether it runs, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EffectReason {
    /// The effect's name.
    pub effect: &'static str,
    /// Whether it runs.
    pub runs: bool,
    /// Why, in a few words with the counts that decided.
    pub why: String,
}

impl EffectPlan {
    /// The plan for `scene` under `settings`.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        Self::with_reasons(scene, settings, &UsedMaterials::of(scene)).0
    }

    /// Why each effect runs or not, what only data decide (normals, the lens) among them.
    pub fn reasons(scene: &Scene, settings: &Settings, lens: &ShotLens) -> Vec<EffectReason> {
        let used = UsedMaterials::of(scene);
        let (plan, mut reasons) = Self::with_reasons(scene, settings, &used);
        let smooth = scene.meshes.iter().filter(|m| m.normals.is_some()).count();
        let (blurs, lens) = lens.reason();
        let normals = format!("{smooth} of {} meshes have shading normals", scene.meshes.len());
        reasons.extend([
            cut_outs(scene, &used),
            vertex_colours(scene, &used),
            fresnel(&used),
            roughness_maps(&used, settings),
            normal_maps(&used),
            EffectReason { effect: "smooth normals", runs: smooth > 0, why: normals },
            EffectReason { effect: "depth of field", runs: blurs, why: lens },
            light_selection(scene, settings, &plan),
        ]);
        reasons
    }

    /// The plan that leaves nothing out: for the test that specialised kernels equal it.
    pub const EVERYTHING: Self = Self {
        mirror: true,
        glass: true,
        nested_glass: true,
        absorption: true,
        textures: true,
        diffuse: true,
        area_lights: true,
        delta_lights: true,
        sky_light: true,
        environment: true,
        glass_shadows: true,
        coloured_shadows: true,
        fog: true,
        ambient: true,
    };

    fn with_reasons(
        scene: &Scene,
        settings: &Settings,
        used: &UsedMaterials,
    ) -> (Self, Vec<EffectReason>) {
        let area = scene.lights.iter().filter(|light| light.is_area()).count();
        let delta = scene.lights.len() - area;
        let bounces = settings.bounces;
        let bounced = counted(bounces as usize, "bounce");
        let samples = settings.shadow_samples;
        let environment = scene.environment.as_ref();
        let sky_bright = match environment {
            Some(sky) => !sky.radiance.is_black(),
            None => is_something(scene.sky.radiance),
        };
        let shown = seen_outside(scene);
        let is_image = environment.is_some_and(|sky| sky.is_image());
        let mut reasons = Vec::new();
        let mut decide = |effect, runs: bool, why: String| {
            reasons.push(EffectReason { effect, runs, why });
            runs
        };
        let diffuse = used.diffuse > 0;
        let fog = scene.fog.as_ref().filter(|fog| fog.extinction > 0.0);
        let scatters = fog.is_some_and(|fog| is_something(fog.albedo)) && settings.fog_samples > 0;
        // Light from outside the scene goes an endless way through fog that is everywhere.
        let is_hidden = fog.is_some_and(|fog| fog.bounds.is_none());
        let no_diffuse = || "no diffuse surface to light".to_string();
        let lit = diffuse || (used.glossy > 0 && bounces > 0) || scatters;
        // Glossy surfaces see a sky of one colour by their own rays.
        let lit_by_sky = diffuse || (lit && environment.is_some()) || scatters;
        let is_straight = settings.glass_shadows == GlassShadows::Straight;
        let is_through = used.glass > 0 && is_straight && (lit || lit_by_sky);
        let coloured_shadows = is_through && used.coloured_glass > 0;
        let none_lit = || "no diffuse or glossy surface to light".to_string();
        let plan = Self {
            mirror: decide(
                "mirror reflection",
                used.mirror > 0 && bounces > 0,
                format!("{} in use, {}", counted(used.mirror, "mirror material"), bounced),
            ) | decide(
                "glossy reflection",
                used.glossy > 0 && bounces > 0,
                format!(
                    "{} in use, {}",
                    counted(used.glossy, "rough mirror or glass material"),
                    bounced
                ),
            ),
            glass: decide(
                "glass",
                used.glass > 0 && bounces > 0,
                format!(
                    "{} in use{}, {}",
                    counted(used.glass, "glass material"),
                    used.panes(),
                    bounced
                ),
            ),
            nested_glass: decide(
                "nested glass",
                used.ranked > 0 && bounces > 0,
                format!("{} with a priority in use", counted(used.ranked, "glass material")),
            ),
            absorption: decide(
                "absorption",
                used.absorbing > 0 && bounces > 0,
                format!("{} that absorb in use", counted(used.absorbing, "glass material")),
            ),
            textures: decide(
                "textures",
                used.textured > 0 || is_image,
                format!(
                    "{} in use{}{}",
                    counted(used.textured, "textured material"),
                    bare(scene),
                    if is_image { "; the environment is an image" } else { "" }
                ),
            ),
            diffuse,
            area_lights: decide(
                "soft shadows",
                lit && area > 0 && samples > 0,
                if lit {
                    let samples = match settings.least_shadow_samples {
                        Some(_) => format!("{} shadow samples", settings.shadow_sample_range()),
                        None => counted(samples as usize, "shadow sample"),
                    };
                    format!("{}, {samples}", counted(area, "area light"))
                } else {
                    none_lit()
                },
            ),
            delta_lights: decide(
                "hard shadows",
                lit && delta > 0,
                if lit { counted(delta, "delta light") } else { none_lit() },
            ),
            sky_light: decide(
                "sky light",
                lit_by_sky
                    && sky_bright
                    && scene.sky.lights
                    && settings.sky_samples > 0
                    && !is_hidden,
                if !lit_by_sky {
                    no_diffuse()
                } else if !sky_bright {
                    "the sky is black".into()
                } else if !scene.sky.lights {
                    "the sky is only a backdrop".into()
                } else if is_hidden {
                    "fog hides the sky".into()
                } else {
                    let samples = match settings.least_sky_samples {
                        // An environment has no pilot rays.
                        Some(_) if environment.is_none() => {
                            format!("{} sky samples", settings.sky_sample_range())
                        }
                        _ => counted(settings.sky_samples as usize, "sky sample"),
                    };
                    match environment {
                        None => format!("constant sky, {samples}"),
                        Some(sky) => {
                            let [width, height] = sky.radiance.size();
                            format!(
                                "{}, {samples}: importance in {width} x {height} cells and the cosine, {} kept",
                                sky.environment.describe(&scene.textures),
                                counted(
                                    ratio_count(sky.radiance.tints().len(), coloured_shadows),
                                    "ratio"
                                )
                            )
                        }
                    }
                },
            ),
            environment: decide(
                "environment",
                shown.is_some(),
                shown.unwrap_or_else(|| "rays that leave the scene see one colour".into()),
            ),
            glass_shadows: decide(
                "light through glass",
                is_through,
                format!(
                    "{} in use{}, glass shadows are {}",
                    counted(used.glass, "glass material"),
                    match used.coloured_glass {
                        0 => String::new(),
                        coloured => format!(" ({coloured} coloured)"),
                    },
                    if is_straight { "straight" } else { "opaque" }
                ),
            ),
            coloured_shadows,
            fog: decide(
                "fog",
                fog.is_some(),
                fog.map_or("none".into(), |f| described(f, scene, settings)),
            ),
            ambient: decide(
                "ambient term",
                (diffuse || scatters) && is_something(scene.sky.ambient),
                if diffuse || scatters {
                    format!("ambient {}", scene.sky.ambient)
                } else {
                    no_diffuse()
                },
            ),
        };
        (plan, reasons)
    }
}

/// The fog of a scene in words.
fn described(fog: &Fog, scene: &Scene, settings: &Settings) -> String {
    let recentring = &scene.recentring;
    let extinction = fog.extinction * recentring.scale();
    let place = fog.bounds.map_or("everywhere".into(), |bounds| {
        let [x, y, z] = bounds.extent().to_array().map(|edge| recentring.length_to_world(edge));
        format!("in a box of {x} x {y} x {z}")
    });
    let samples = match settings.fog_samples {
        0 => "unlit".into(),
        n => format!("{} of each light on a ray", counted(n as usize, "sample")),
    };
    format!("extinction {extinction} {place}, {samples}")
}

/// What rays see that leave the scene, if it is more than one colour.
fn seen_outside(scene: &Scene) -> Option<String> {
    let suns = scene.lights.iter().filter(|light| matches!(light, Light::Sun(_))).count();
    let sky = scene.environment.as_ref().map(|sky| sky.environment.describe(&scene.textures));
    match (sky, suns) {
        (None, 0) => None,
        (None, suns) => Some(counted(suns, "sun")),
        (Some(sky), 0) => Some(sky),
        (Some(sky), suns) => Some(format!("{sky}, {} that lights", counted(suns, "sun"))),
    }
}

/// Whether rays pass through holes of surfaces, and of how many.
fn cut_outs(scene: &Scene, used: &UsedMaterials) -> EffectReason {
    let meshes = scene.meshes.iter().filter(|mesh| scene.mesh_mask(mesh).is_some()).count();
    let spheres = scene.spheres.iter().filter(|s| scene.mask(s.surface).is_some()).count();
    let cut = meshes + spheres;
    let surfaces = scene.meshes.len() + scene.spheres.len();
    let materials = counted(used.cut_out, "material");
    let why = match used.cut_out {
        0 => format!("{materials} with alpha in use"),
        _ => format!("{materials} with alpha in use, holes in {cut} of {surfaces} surfaces"),
    };
    EffectReason { effect: "alpha cut-outs", runs: cut > 0, why }
}

/// Whether reflection grows towards grazing angles.
fn fresnel(used: &UsedMaterials) -> EffectReason {
    let why = format!(
        "{} in use, {} with a clear coat, {} in part glass",
        counted(used.fresnel, "principled material"),
        used.coated,
        used.part_glass
    );
    EffectReason { effect: "Fresnel reflection", runs: used.fresnel > 0, why }
}

/// Whether the roughness of mirrors or glass is looked up in images.
fn roughness_maps(used: &UsedMaterials, settings: &Settings) -> EffectReason {
    let why = format!("{} in use", counted(used.roughness_maps, "roughness-mapped material"));
    let runs = used.roughness_maps > 0 && settings.bounces > 0;
    EffectReason { effect: "roughness maps", runs, why }
}

/// Whether images tilt normals.
fn normal_maps(used: &UsedMaterials) -> EffectReason {
    let why = format!("{} in use", counted(used.normal_maps, "normal-mapped material"));
    EffectReason { effect: "normal maps", runs: used.normal_maps > 0, why }
}

fn has_roughness_map(material: &Material) -> bool {
    let of_coat = |f: Fresnel| f.clearcoat_roughness_map.is_some() && f.clearcoat_roughness != 0.0;
    let of_layers = material.is_mirror() && material.roughness != 0.0;
    let of_glass = material.glass.as_ref().is_some_and(Glass::is_rough);
    let is_mapped = material.roughness_map.is_some() && (of_layers || of_glass);
    is_mapped || material.is_mirror() && material.fresnel.is_some_and(of_coat)
}

/// Whether surfaces show colours of vertices, and how many.
fn vertex_colours(scene: &Scene, used: &UsedMaterials) -> EffectReason {
    let meshes = scene.meshes.iter().filter(|mesh| mesh.colours.is_some()).count();
    let materials = counted(used.vertex_colours, "material");
    let why = match used.vertex_colours {
        0 => "no material in use shows them".into(),
        _ => format!("{materials} in use, {meshes} of {} meshes have them", scene.meshes.len()),
    };
    EffectReason { effect: "vertex colours", runs: meshes > 0, why }
}

/// Whether points look at the lights that matter there only, and how many these are.
fn light_selection(scene: &Scene, settings: &Settings, plan: &EffectPlan) -> EffectReason {
    let lights = counted(scene.lights.len(), "light");
    let (runs, why) = match (&scene.light_cells, scene.selected_lights(settings)) {
        (None, _) => (false, format!("{lights}, all looked at everywhere")),
        (Some(_), None) => {
            (false, format!("{lights}, all looked at everywhere: all lights are on"))
        }
        (Some(cells), Some(_)) => {
            let MeanLights { main, tail, .. } = cells.mean();
            let memory = cells.memory() as f64 / 1e6;
            let [of_light, of_tail] =
                [1, cells.tints().len()].map(|own| ratio_count(own, plan.coloured_shadows));
            let most = counted(cells.most_area() * of_light + of_tail, "ratio");
            let why = format!(
                "{lights}: at a point {main:.1} on average are traced each, {tail:.1} drawn from; \
                 {} cells of {memory:.1} MB, at most {most} kept for a point",
                cells.len()
            );
            (true, why)
        }
    };
    EffectReason { effect: "light selection", runs, why }
}

/// Whether a colour does anything: not only what is positive, since what is NaN or negative must
/// reach its pixel to be counted there.
fn is_something(colour: Rgb) -> bool {
    colour != Rgb::ZERO
}

/// How many meshes have a material with an image but no texture coordinates for it, where any have.
fn bare(scene: &Scene) -> String {
    let is_bare = |mesh: &&Mesh| {
        let material = &scene.materials[mesh.surface.material as usize];
        material.images().any(|map| mesh.uv_set(map.uv_set).is_none())
    };
    let bare = scene.meshes.iter().filter(is_bare);
    match bare.count() {
        0 => String::new(),
        count => format!(
            "; {count} of {} meshes have one but no coordinates: one flat colour",
            scene.meshes.len()
        ),
    }
}

/// How many materials that some surface uses call for what.
#[derive(Default)]
struct UsedMaterials {
    diffuse: usize,
    mirror: usize,
    glossy: usize,
    fresnel: usize,
    coated: usize,
    part_glass: usize,
    glass: usize,
    coloured_glass: usize,
    thin: usize,
    ranked: usize,
    absorbing: usize,
    /// With any image but a mask.
    textured: usize,
    roughness_maps: usize,
    normal_maps: usize,
    vertex_colours: usize,
    cut_out: usize,
}

impl UsedMaterials {
    /// How many of the glass materials are thin panes, in words; empty if none is.
    fn panes(&self) -> String {
        match self.thin {
            0 => String::new(),
            thin => format!(" ({thin} thin)"),
        }
    }

    fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        let surfaces = scene.meshes.iter().map(|m| m.surface);
        surfaces
            .chain(scene.spheres.iter().map(|s| s.surface))
            .for_each(|s| used[s.material as usize] = true);
        let mut counts = Self::default();
        for (material, _) in scene.materials.iter().zip(&used).filter(|(_, used)| **used) {
            counts.diffuse += usize::from(material.is_diffuse());
            counts.glossy += usize::from(material.is_glossy());
            counts.mirror += usize::from(material.is_mirror() && !material.is_glossy());
            counts.fresnel += usize::from(material.fresnel.is_some());
            let is_coated = material.fresnel.is_some_and(|fresnel| fresnel.clearcoat != 0.0);
            counts.coated += usize::from(is_coated);
            let is_clear = material.fresnel.is_some_and(|fresnel| fresnel.transmission != 0.0);
            counts.part_glass += usize::from(is_clear);
            counts.glass += usize::from(material.glass.is_some());
            counts.coloured_glass += usize::from(material.colours_light());
            let glass =
                |is: fn(&Glass) -> bool| usize::from(material.glass.as_ref().is_some_and(is));
            counts.thin += glass(|glass| glass.thin);
            counts.ranked += glass(|glass| glass.priority.is_some());
            counts.absorbing += glass(|glass| is_something(glass.absorption));
            counts.textured += usize::from(material.has_image());
            counts.normal_maps += usize::from(material.normal_maps().next().is_some());
            counts.roughness_maps += usize::from(has_roughness_map(material));
            counts.vertex_colours += usize::from(material.vertex_colours);
            counts.cut_out += usize::from(material.alpha.is_some());
        }
        counts
    }
}
