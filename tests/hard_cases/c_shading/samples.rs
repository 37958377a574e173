//! Invalid samples: counted by name, shown when asked, fatal when asked, never black in silence.

use crate::common::{self, Job};
use crate::suite::{Outcome, Size};
use std::path::Path;
use std::process::Command;
use tweenray::error::Error;
use tweenray::film::Film;
use tweenray::math::{DVec3, Rgb, Vec2};
use tweenray::scene::{
    Corners, DirectionalLight, Glass, Light, Material, PointLight, QuadLight, Sky, SphereLight,
    Texture, TextureMap, World, WorldSphere,
};

/// Everything that has a parameter, side by side.
fn world() -> World {
    let mut world = World::default();
    let glass = Glass { tint: Rgb::splat(0.9), ..Glass::clear(1.5) };
    let ranked = Glass { priority: Some(1), ..glass };
    world.materials = vec![
        Material::diffuse("floor", Rgb::splat(0.5)),
        Material { mirror: Rgb::splat(0.7), ..Material::black("mirror") },
        Material { glass: Some(glass), ..Material::black("glass") },
        Material { glass: Some(ranked), ..Material::black("ranked") },
        Material { texture: Some(TextureMap::of(0)), ..Material::diffuse("poster", Rgb::ONE) },
        Material { emission: Rgb::splat(0.8), emits_back: true, ..Material::black("glow") },
    ];
    world.textures.push(Texture::from_linear("poster", [4, 4], vec![Rgb::splat(0.6); 16]));
    let p = DVec3::new;
    let floor = [p(-4.0, 0.0, 3.0), p(4.0, 0.0, 3.0), p(4.0, 0.0, -3.0), p(-4.0, 0.0, -3.0)];
    world.meshes.push(common::quad(floor, 0));
    let panel =
        |x: f64| [p(x, 0.1, -1.0), p(x + 1.4, 0.1, -1.0), p(x + 1.4, 1.5, -1.0), p(x, 1.5, -1.0)];
    let mut poster = common::quad(panel(-1.6), 4);
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let values = corners.map(|(u, v)| Vec2::new(u, v)).to_vec();
    poster.uvs = Some(Corners { values, corners: None });
    world.meshes.push(poster);
    world.meshes.push(common::quad(panel(0.2), 5));
    for (x, material) in [(-2.2, 1), (-0.1, 2), (2.0, 3)] {
        world.spheres.push(WorldSphere::new("ball", p(x, 0.6, 0.4), 0.5, material));
    }
    let lamp = [p(-1.0, 3.0, -1.0), p(1.0, 3.0, -1.0), p(1.0, 3.0, 1.0), p(-1.0, 3.0, 1.0)];
    world.lights = vec![
        Light::Quad(QuadLight { corners: lamp, radiance: Rgb::splat(2.0), two_sided: false }),
        Light::Sphere(SphereLight {
            centre: p(3.0, 1.5, -1.5),
            radius: 0.3,
            radiance: Rgb::splat(3.0),
        }),
        Light::Point(PointLight { position: p(-3.0, 2.0, 1.0), intensity: Rgb::splat(2.0) }),
        Light::Directional(DirectionalLight {
            to_light: p(1.0, 2.0, 1.0).normalize(),
            irradiance: Rgb::splat(0.3),
        }),
    ];
    let radiance = Rgb::new(0.2, 0.3, 0.5);
    world.sky = Sky { radiance, lights: true, ambient: Rgb::splat(0.05) };
    world
}

/// Where a value goes in.
type Site = (&'static str, fn(&mut World, f32));

fn quad(world: &mut World) -> &mut QuadLight {
    let Light::Quad(quad) = &mut world.lights[0] else { panic!("the first light is a quad") };
    quad
}

fn poster(world: &mut World, colour: Rgb) {
    world.textures[0] = Texture::from_linear("poster", [4, 4], vec![colour; 16]);
}

/// Sites whose value is light or a share of it, one channel or all.
const LIGHT: [Site; 20] = [
    ("diffuse", |w, v| w.materials[0].diffuse.y = v),
    ("diffuse, all channels", |w, v| w.materials[0].diffuse = Rgb::splat(v)),
    ("mirror", |w, v| w.materials[1].mirror.x = v),
    ("mirror, all channels", |w, v| w.materials[1].mirror = Rgb::splat(v)),
    ("glass tint", |w, v| w.materials[2].glass.as_mut().unwrap().tint.x = v),
    ("ranked glass tint", |w, v| w.materials[3].glass.as_mut().unwrap().tint = Rgb::splat(v)),
    ("glass ior", |w, v| w.materials[2].glass.as_mut().unwrap().ior = v.into()),
    ("ranked glass ior", |w, v| w.materials[3].glass.as_mut().unwrap().ior = v.into()),
    ("texture", |w, v| poster(w, Rgb::splat(v))),
    ("texture, red", |w, v| poster(w, Rgb::new(v, 0.6, 0.6))),
    ("textured diffuse", |w, v| w.materials[4].diffuse = Rgb::splat(v)),
    ("emission", |w, v| w.materials[5].emission.z = v),
    ("quad light", |w, v| quad(w).radiance = Rgb::splat(v)),
    ("quad light, blue", |w, v| quad(w).radiance.z = v),
    ("sphere light", |w, v| {
        if let Light::Sphere(SphereLight { radiance, .. }) = &mut w.lights[1] {
            *radiance = Rgb::splat(v);
        }
    }),
    ("point light", |w, v| {
        if let Light::Point(PointLight { intensity, .. }) = &mut w.lights[2] {
            intensity.x = v;
        }
    }),
    ("directional light", |w, v| {
        if let Light::Directional(DirectionalLight { irradiance, .. }) = &mut w.lights[3] {
            *irradiance = Rgb::splat(v);
        }
    }),
    ("sky", |w, v| w.sky.radiance = Rgb::splat(v)),
    ("sky, green", |w, v| w.sky.radiance.y = v),
    ("ambient", |w, v| w.sky.ambient = Rgb::splat(v)),
];

/// Sites whose value is a place or a size: an error must say so.
const PLACE: [Site; 6] = [
    ("quad light corner", |w, v| quad(w).corners[1].y = v.into()),
    ("sphere light centre", |w, v| {
        if let Light::Sphere(SphereLight { centre, .. }) = &mut w.lights[1] {
            centre.z = v.into();
        }
    }),
    ("sphere light radius", |w, v| {
        if let Light::Sphere(SphereLight { radius, .. }) = &mut w.lights[1] {
            *radius = v.into();
        }
    }),
    ("point light position", |w, v| {
        if let Light::Point(PointLight { position, .. }) = &mut w.lights[2] {
            position.x = v.into();
        }
    }),
    ("directional light direction", |w, v| {
        if let Light::Directional(DirectionalLight { to_light, .. }) = &mut w.lights[3] {
            to_light.y = v.into();
        }
    }),
    ("sphere radius", |w, v| w.spheres[0].radius = v.into()),
];

const MAGENTA: Rgb = Rgb::new(1.0, 0.0, 1.0);

fn job(world: World, edge: u32) -> Job {
    let camera = common::pose((0.0, 1.8, 6.0), (0.0, 0.8, 0.0));
    let mut job = common::job(world, camera, edge, edge * 3 / 4);
    job.settings.spp = 2;
    job.settings.shadow_samples = 4;
    job.settings.sky_samples = 2;
    job
}

fn render(job: &Job) -> Film {
    common::render(job).0
}

pub fn bad_samples(size: Size) -> Outcome {
    let mut outcome = Outcome::default();
    let edge = size.of(48, 320);
    let clean = render(&job(world(), edge));
    outcome.check(clean.bad.is_none(), || format!("the clean scene has {}", clean.bad));
    let mut silent = 0;
    for (name, inject) in LIGHT {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0] {
            let what = format!("{name} = {value}");
            let mut bad = world();
            inject(&mut bad, value);
            silent += judge_light(&mut outcome, &what, &job(bad, edge), &clean, value);
        }
    }
    outcome.at_most("pixels changed by a bad value and not counted", silent as f64, 0.0);
    for (name, inject) in PLACE {
        for value in [f32::NAN, f32::INFINITY] {
            let mut bad = world();
            inject(&mut bad, value);
            let made = bad.into_scene(true).map(drop);
            let ok =
                matches!(&made, Err(Error::Usage(m)) if m.contains("finite") || m.contains("hold"));
            outcome.check(ok, || format!("{name} = {value}: {made:?}"));
        }
    }
    overflow(&mut outcome);
    command(&mut outcome);
    outcome
}

/// Every pixel that `value` changes must be counted and flagged; gives those that are not.
fn judge_light(outcome: &mut Outcome, what: &str, job: &Job, clean: &Film, value: f32) -> u64 {
    let film = render(job);
    let mut flagging =
        Job { world: job.world.clone(), camera: job.camera, settings: job.settings.clone() };
    flagging.settings.flag_bad = true;
    let flagged = render(&flagging);
    let (mut magenta, mut silent) = (0, 0);
    for ((plain, flag), clean) in film.rgb.iter().zip(&flagged.rgb).zip(&clean.rgb) {
        let is_flagged = *flag == MAGENTA;
        magenta += u64::from(is_flagged);
        // Bits, since NaN is not equal to itself.
        let same = plain.to_array().map(f32::to_bits) == clean.to_array().map(f32::to_bits);
        silent += u64::from(!same && !is_flagged);
    }
    let bad = film.bad;
    let named = match value {
        v if v.is_nan() => bad.nan > 0,
        v if v.is_infinite() => bad.nan + bad.infinite > 0,
        _ => bad.nan + bad.negative > 0,
    };
    let first = bad.first.is_some_and(|[x, y]| flagged.rgb[flagged.index(x, y)] == MAGENTA);
    let ok = named && first && magenta > 0 && silent == 0 && flagged.bad == bad;
    let most = 2 * film.rgb.len() as u64;
    let ok = ok && bad.total() >= magenta && bad.total() <= most;
    outcome.check(ok, || format!("{what}: {bad}; {magenta} flagged, {silent} silent"));
    // The kernel that leaves nothing out counts the same.
    let scene = job.world.clone().into_scene(true).unwrap();
    let (all, _) = common::render_with_every_effect(&scene, job);
    outcome.check(all.bad == bad, || format!("{what}: {bad}, with everything on {}", all.bad));
    silent
}

/// Good samples whose sum no f32 holds.
fn overflow(outcome: &mut Outcome) {
    let mut world = World::default();
    world.sky.radiance = Rgb::splat(3e38);
    let mut job = job(world, 8);
    job.settings.spp = 4;
    let film = render(&job);
    let pixels = film.rgb.len() as u64;
    let ok = film.bad.infinite == pixels && film.bad.total() == pixels;
    outcome.check(ok, || format!("overflow of the sum: {}", film.bad));
}

/// The command: a scene file cannot hold a NaN, but a point light of 1e30 W/sr 1e-5 above a floor
/// overflows.
fn command(outcome: &mut Outcome) {
    let folder = std::env::temp_dir().join(format!("tweenray-bad-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let scene = "[camera]\nstill = { eye = [0, 2, 0.1], target = [0, 0, 0] }\n\
        [[mesh]]\nquad = { centre = [0, 0, 0], normal = \"y\", size = [4, 4] }\n\
        [[light]]\npoint = { position = [0, 1e-5, 0], intensity = 1e30 }\n\
        [settings]\nsize = [9, 9]\nspp = 1\n";
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    let run = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tweenray"));
        let output = if more.contains(&"-o") { &[][..] } else { &["-o", "f_####.exr"][..] };
        let fixed = ["render", "scene.toml", "--stats", "stats.json"];
        let done =
            command.current_dir(&folder).args(fixed).args(output).args(more).output().unwrap();
        (done.status.code().unwrap(), String::from_utf8(done.stderr).unwrap())
    };
    let stats = || std::fs::read_to_string(folder.join("stats.json")).unwrap();
    let has = |text: &str, words: &[&str]| words.iter().all(|w| text.contains(w));
    let (code, words) = run(&[]);
    let told = has(
        &words,
        &["warning", "invalid camera sample", "1 infinite", "pixel 4,4 of frame 1", "--flag-bad"],
    );
    outcome.check(code == 0 && told, || format!("plain: {code}, {words}"));
    outcome.check(has(&stats(), &["bad_samples", "\"infinite\": 1"]), stats);
    let manifest = std::fs::read_to_string(folder.join("f.manifest.jsonl")).unwrap();
    let row = "\"bad\":{\"nan\":0,\"infinite\":1,\"negative\":0,\"first\":[4,4]}";
    outcome.check(manifest.contains(row), || manifest.clone());
    let (code, words) = run(&["--strict"]);
    let kept = has(&words, &["error", "1 infinite"]) && stats().contains("\"infinite\": 1");
    outcome.check(code == 1 && kept, || format!("strict on a kept frame: {code}, {words}"));
    let (code, words) = run(&["--strict", "--overwrite", "--flag-bad", "on", "-q"]);
    outcome.check(code == 1 && words.contains("error"), || format!("strict: {code}, {words}"));
    outcome.check(Path::new(&folder).join("f_0001.exr").exists(), || "no frame written".into());
    let (code, words) = run(&["-o", "g_####.png", "--exposure", "1", "--crop", "0,0,4,9"]);
    outcome.check(code == 0 && !words.contains("radiance"), || {
        format!("cropped away: {code}, {words}")
    });
    std::fs::remove_dir_all(&folder).unwrap();
}
