//! `tweenray inspect`: what a scene holds and what rendering it would do, without rendering it.

mod reuse;

use super::args::{SceneArgs, SettingArgs};
use super::exit::Exit;
use super::findings::findings;
use super::{job, say};
use crate::cluster;
use crate::effects::EffectPlan;
use crate::error::{Result, counted};
use crate::import::{AddedStage, Loaded};
use crate::intersect;
use crate::math::{Bounds3, DVec3};
use crate::page::words::short;
use crate::scene::{Light, Mesh, Scene, SceneEnvironment, Settings, Shot};
use crate::shade::Renderer;
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;

/// Say what a scene holds and what rendering it would do, without rendering
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray inspect scene.toml
  tweenray inspect bunny.obj --json")]
pub struct InspectArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    settings: SettingArgs,
}

/// The output of `inspect`.
#[derive(Serialize)]
struct Inspection {
    scene: String,
    tracer: String,
    triangles: usize,
    vertices: usize,
    meshes: usize,
    spheres: usize,
    materials: usize,
    textures: usize,
    /// Masks of cut-outs.
    masks: usize,
    /// A floor and a lamp are added; the figures above and `bounds` are without them.
    adds_floor_and_lamp: bool,
    lights: Lights,
    bounds: Option<[[f64; 3]; 2]>,
    frames: u32,
    size: [u32; 2],
    camera_start: CameraView,
    camera_end: CameraView,
    memory: Memory,
    /// Copies of meshes that a glTF file places more than once; absent without any.
    #[serde(skip_serializing_if = "Option::is_none")]
    copies: Option<Copies>,
    reuse: reuse::ReusePlan,
    effects: Vec<Effect>,
    warnings: Vec<String>,
}

#[derive(Serialize, Default)]
struct Lights {
    /// Numbers of lights by kind.
    #[serde(flatten)]
    by_kind: BTreeMap<&'static str, usize>,
    sky: bool,
    /// What the sky shows where it is not one colour.
    #[serde(skip_serializing_if = "Option::is_none")]
    environment: Option<String>,
    ambient: bool,
}

/// World space.
#[derive(Serialize)]
struct CameraView {
    eye: [f64; 3],
    looks_along: [f64; 3],
    /// Vertical field of view, degrees.
    vfov_degrees: f64,
    /// Focus distance of the lens; absent for a pinhole.
    #[serde(skip_serializing_if = "Option::is_none")]
    focus: Option<f64>,
}

/// Bytes.
#[derive(Serialize)]
struct Memory {
    geometry: u64,
    /// Textures, masks of cut-outs, and tables of an environment.
    textures: u64,
    intersector: u64,
    frame: u64,
}

/// What instances would save.
#[derive(Serialize)]
struct Copies {
    /// Copies beyond the first of each mesh.
    meshes: usize,
    /// Bytes of geometry that they take.
    geometry: u64,
}

#[derive(Serialize)]
struct Effect {
    effect: &'static str,
    runs: bool,
    why: String,
}

/// Runs the command.
pub fn run(args: &InspectArgs) -> Result<Exit> {
    let inspection = inspect(args)?;
    if args.json {
        say::json(&inspection)?;
    } else {
        say::text(&inspection.to_text())?;
    }
    Ok(Exit::Done)
}

fn inspect(args: &InspectArgs) -> Result<Inspection> {
    let loaded = job::load(&args.scene, &args.settings)?;
    let Loaded { world, shot, settings, warnings, stage, repeats, .. } = loaded;
    // The scene gives each lamp a material of its own, and the floor that is added has one.
    let materials = world.materials.len() - usize::from(stage.is_some());
    let scene = world.into_scene(settings.rules.recentre)?;
    let intersector = intersect::build(&scene, &settings, cluster::default_threads())?;
    let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
    let lossy = job::mesh_warnings(&scene, &args.scene.scene);
    warnings.extend(lossy.iter().map(ToString::to_string));
    warnings.extend(findings(&scene, &settings, &shot, &*intersector)?);
    let meshes = own_meshes(&scene, stage);
    let renderer = Renderer::new(&scene, &settings, &*intersector);
    let reasons = EffectPlan::reasons(&scene, &settings, &shot.lens);
    Ok(Inspection {
        scene: args.scene.scene.display().to_string(),
        tracer: intersector.describe(),
        triangles: meshes.iter().map(|m| m.triangles.len()).sum(),
        vertices: meshes.iter().map(|m| m.vertex_count).sum(),
        meshes: meshes.len(),
        spheres: scene.spheres.len(),
        materials,
        textures: scene.textures.len(),
        masks: scene.masks.len(),
        adds_floor_and_lamp: stage.is_some(),
        lights: Lights::of(&scene),
        bounds: world_bounds(&scene, &meshes),
        frames: shot.frames,
        size: [settings.width, settings.height],
        camera_start: CameraView::at(&shot, 1, &settings)?,
        camera_end: CameraView::at(&shot, shot.frames, &settings)?,
        memory: Memory {
            geometry: scene.meshes.iter().map(mesh_bytes).sum(),
            textures: texture_bytes(&scene),
            intersector: intersector.memory(),
            frame: job::frame_bytes(&settings),
        },
        copies: (repeats.copies > 0)
            .then_some(Copies { meshes: repeats.copies, geometry: repeats.bytes }),
        reuse: reuse::ReusePlan::of(&renderer, &shot)?,
        effects: reasons
            .into_iter()
            .map(|r| Effect { effect: r.effect, runs: r.runs, why: r.why })
            .collect(),
        warnings,
    })
}

impl Lights {
    fn of(scene: &Scene) -> Self {
        let mut lights = Self {
            sky: scene.sky.lights
                && (scene.sky.radiance.max_element() > 0.0 || scene.environment.is_some()),
            environment: scene
                .environment
                .as_ref()
                .map(|sky| sky.environment.describe(&scene.textures)),
            ambient: scene.sky.ambient.max_element() > 0.0,
            by_kind: Light::KINDS.iter().map(|kind| (*kind, 0)).collect(),
        };
        let kinds = scene.lights.iter().map(Light::name);
        kinds.for_each(|kind| *lights.by_kind.entry(kind).or_default() += 1);
        lights
    }
}

impl CameraView {
    fn at(shot: &Shot, frame: u32, settings: &Settings) -> Result<Self> {
        let camera = shot.camera(frame, settings.width, settings.height)?;
        let (eye, looks_along) = (camera.eye.to_array(), camera.forward.to_array());
        let vfov_degrees = 2.0 * camera.half_up.length().atan().to_degrees();
        Ok(Self { eye, looks_along, vfov_degrees, focus: camera.lens.focus() })
    }
}

/// The meshes that come from the user's files.
fn own_meshes(scene: &Scene, stage: Option<AddedStage>) -> Vec<&Mesh> {
    let lamp = stage.map(|s| s.lamp as u32);
    let added = |index: usize, mesh: &Mesh| {
        stage.is_some_and(|s| s.floor == index || mesh.surface.light == lamp)
    };
    let meshes = scene.meshes.iter().enumerate();
    meshes.filter(|(index, mesh)| !added(*index, mesh)).map(|(_, mesh)| mesh).collect()
}

/// Bounds of `meshes` and of all spheres.
fn world_bounds(scene: &Scene, meshes: &[&Mesh]) -> Option<[[f64; 3]; 2]> {
    let mut bounds = meshes.iter().fold(Bounds3::EMPTY, |b, m| b.union(m.bounds));
    for s in &scene.spheres {
        bounds.include(s.centre - DVec3::splat(s.radius));
        bounds.include(s.centre + DVec3::splat(s.radius));
    }
    let corner = |p: DVec3| scene.recentring.point_to_world(p).to_array();
    (!bounds.is_empty()).then(|| [corner(bounds.min), corner(bounds.max)])
}

fn texture_bytes(scene: &Scene) -> u64 {
    let masks: u64 = scene.masks.iter().map(|mask| mask.texels.len() as u64).sum();
    let environment = scene.environment.as_ref().map_or(0, SceneEnvironment::bytes);
    masks + environment + scene.textures.iter().map(|t| t.bytes()).sum::<u64>()
}

fn mesh_bytes(mesh: &Mesh) -> u64 {
    let normals = mesh.normals.as_ref();
    let uvs = || mesh.uvs.iter().chain(mesh.more_uvs.iter().flatten());
    let corner_lists = normals.and_then(|n| n.corners.as_ref()).map_or(0, Vec::len)
        + uvs().filter_map(|uv| uv.corners.as_ref()).map(Vec::len).sum::<usize>();
    let words = 3 * mesh.positions.len()
        + 3 * mesh.triangles.len()
        + 3 * normals.map_or(0, |n| n.values.len())
        + 2 * uvs().map(|uv| uv.values.len()).sum::<usize>()
        + 3 * corner_lists;
    let colours = mesh.colours.as_ref().map_or(0, |colours| colours.bytes().len());
    4 * words as u64 + colours as u64
}

impl Inspection {
    fn images(&self) -> String {
        let textures = counted(self.textures, "texture");
        match self.masks {
            0 => textures,
            masks => format!("{textures}, {}", counted(masks, "alpha mask")),
        }
    }

    fn to_text(&self) -> String {
        let mut lines = vec![
            format!("scene      {}", self.scene),
            format!(
                "geometry   {}, {} vertices, {} {}, {}",
                counted(self.triangles, "triangle"),
                self.vertices,
                self.meshes,
                if self.meshes == 1 { "mesh" } else { "meshes" },
                counted(self.spheres, "sphere")
            ),
            format!("materials  {}, {}", self.materials, self.images()),
            format!("lights     {}", self.lights.to_text()),
        ];
        if let Some([min, max]) = self.bounds {
            lines.push(format!("bounds     {} to {}", point(min), point(max)));
        }
        if self.adds_floor_and_lamp {
            lines.push("stage      a floor and a lamp are added, not counted above".into());
        }
        let [width, height] = self.size;
        lines.push(format!("frames     {} of {width}x{height} pixels", self.frames));
        for (name, view) in [("start", &self.camera_start), ("end", &self.camera_end)] {
            let (eye, along) = (point(view.eye), point(view.looks_along));
            let focus =
                view.focus.map_or(String::new(), |at| format!(", focused at {}", short(at)));
            let vfov = short(view.vfov_degrees);
            lines.push(format!(
                "camera     {name}: at {eye}, looks along {along}, {vfov} degrees high{focus}"
            ));
        }
        lines.push(format!("tracer     {}", self.tracer));
        let m = &self.memory;
        lines.push(format!(
            "memory     geometry {}, textures {}, intersector {}, a frame {}",
            bytes(m.geometry),
            bytes(m.textures),
            bytes(m.intersector),
            bytes(m.frame)
        ));
        if let Some(Copies { meshes, geometry }) = &self.copies {
            let copies = match meshes {
                1 => "1 copy of a mesh".into(),
                n => format!("{n} copies of meshes"),
            };
            let saved = bytes(*geometry);
            lines.push(format!("copies     {copies}; instances would save {saved} of geometry"));
        }
        lines.extend(self.reuse.to_text());
        lines.push("effects".into());
        for e in &self.effects {
            let runs = if e.runs { "runs" } else { "off" };
            lines.push(format!("  {:<18} {runs:<5} {}", e.effect, e.why));
        }
        lines.extend(self.warnings.iter().map(|w| format!("warning: {w}")));
        lines.join("\n") + "\n"
    }
}

impl Lights {
    fn to_text(&self) -> String {
        let present = Light::KINDS.iter().map(|kind| (kind, self.by_kind[kind]));
        let present = present.filter(|(_, count)| *count > 0);
        let mut parts: Vec<String> = present.map(|(kind, n)| format!("{n} {kind}")).collect();
        let sky = self.environment.as_ref().map_or("sky".into(), |what| format!("sky ({what})"));
        parts.extend(self.sky.then_some(sky));
        parts.extend(self.ambient.then(|| "ambient".into()));
        if parts.is_empty() { "none".into() } else { parts.join(", ") }
    }
}

fn point(p: [f64; 3]) -> String {
    // Adding zero turns -0 into 0.
    let [x, y, z] = p.map(|c| (c * 1e4).round() / 1e4 + 0.0);
    format!("({x}, {y}, {z})")
}

fn bytes(count: u64) -> String {
    match count {
        0..1_000_000 => format!("{:.1} kB", count as f64 * 1e-3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", count as f64 * 1e-6),
        _ => format!("{:.2} GB", count as f64 * 1e-9),
    }
}
