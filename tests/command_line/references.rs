//! What exr frames keep beside the picture: motion, maps, and references for later jobs.

use super::job::{Job, says};
use serde_json::Value;
use std::fs;
use std::io::BufReader;
use std::path::Path;
use tweenray::math::DVec3;
use tweenray::output::exr::{self, ExrChannels, ExrSamples};
use tweenray::scene::{Camera, Pose};

/// A cube on a floor under a lamp and a sky, in a mirror.
fn scene(job: &Job, name: &str, camera: &str) {
    let text = format!(
        "[camera]\n{camera}\n[settings]\nsize = [64, 36]\nspp = 1\nvideo = false\n\
         shadow_samples = 48\nsky_samples = 16\n[sky]\nradiance = 0.3\n[reuse]\nsegment = 8\n\
         [material.mirror]\nmirror = 0.9\n\
         [[light]]\nquad = {{ centre = [2, 5, 3], normal = '-y', size = [2, 2], radiance = 20 }}\n\
         [[mesh]]\nquad = {{ centre = [0, -1, 0], normal = 'y', size = [20, 20] }}\n\
         [[mesh]]\nquad = {{ centre = [0, 0, -3], normal = 'z', size = [8, 4] }}\n\
         material = 'mirror'\n[[mesh]]\nfile = 'cube.obj'\n"
    );
    fs::write(job.path(name), text).expect("written");
}

fn pan(frames: u32, far: f64) -> String {
    format!(
        "frames = {frames}\n\
         pan = {{ from = [-1, 1.5, 7], to = [{far}, 1.5, 7], target = [0, 0, 0] }}"
    )
}

fn channels(job: &Job, name: &str) -> ExrChannels {
    let file = fs::File::open(job.path(name)).expect("there");
    exr::decode(Path::new(name), BufReader::new(file), 1 << 26).expect("an exr file")
}

fn f32s<'c>(channels: &'c ExrChannels, name: &str) -> &'c [f32] {
    channels.f32(name).unwrap_or_else(|| panic!("no {name}"))
}

/// Shadow rays of a job, by its statistics.
fn shadow_rays(job: &Job, stats: &str) -> u64 {
    let stats: Value = serde_json::from_slice(&job.read(stats)).expect("JSON");
    let of = |kind: &str| stats["rays"][kind].as_u64().expect("a count");
    of("shadow_area") + of("shadow_sky")
}

#[test]
fn motion_is_zero_at_rest_also_where_frames_share_a_tracing() {
    let job = Job::new();
    let keys = "frames = 9\nkeys = [\n\
                { at = 0, eye = [-1, 1.5, 7], target = [0, 0, 0] },\n\
                { at = 0.5, eye = [1, 1.5, 7], target = [0, 0, 0] }]\n";
    scene(&job, "scene.toml", keys);
    for policy in ["surface", "off", "colour"] {
        job.done(&format!("render scene.toml -o {policy}/f_#.exr --policy {policy} --aovs motion"));
        let most = |frame: u32| {
            let channels = channels(&job, &format!("{policy}/f_{frame}.exr"));
            let all = ["backward.u", "backward.v"].map(|name| f32s(&channels, name).to_vec());
            all.concat().into_iter().map(f32::abs).fold(0.0, f32::max)
        };
        assert_eq!(most(1), 0.0, "{policy}: nothing came before");
        assert!(most(5) > 0.5, "{policy}: the camera moves until frame 5");
        assert!((6..=9).all(|frame| most(frame) == 0.0), "{policy}: then it rests");
    }
}

#[test]
fn motion_leads_to_where_the_surface_was() {
    let job = Job::new();
    scene(&job, "scene.toml", &pan(2, -0.6).replace("frames", "fov = 40\nframes"));
    job.done("render scene.toml -o o/f_#.exr --policy off --spp 4 --aovs motion,position,depth");
    let camera = |x: f64| {
        let (eye, target) = (DVec3::new(x, 1.5, 7.0), DVec3::ZERO);
        let pose = Pose { eye, target, up: DVec3::Y, roll_degrees: 0.0 };
        Camera::new(&pose, 40.0, 64, 36).expect("a camera")
    };
    let (before, now) = (camera(-1.0), camera(-0.6));
    let held = channels(&job, "o/f_2.exr");
    let [u, v, z] = ["backward.u", "backward.v", "Z"].map(|name| f32s(&held, name));
    let [px, py, pz] = ["P.X", "P.Y", "P.Z"].map(|name| f32s(&held, name));
    let (mut most, mut found) = (0f64, 0);
    for i in (0..64 * 36).filter(|i| z[*i].is_finite()) {
        let p = DVec3::new(px[i].into(), py[i].into(), pz[i].into());
        let (Some(then), Some(now)) = (before.project(p), now.project(p)) else { continue };
        let (x, y) = (then.0 - now.0, now.1 - then.1);
        let apart = (x - f64::from(u[i])).abs().max((y - f64::from(v[i])).abs());
        assert!(apart < 1e-3, "pixel {i}: {x} {y}, not {} {}", u[i], v[i]);
        most = most.max(x.abs().min(y.abs()));
        found += 1;
    }
    assert!(found > 1000 && most > 0.05, "{found} pixels, the least of x and y at most {most}");
}

#[test]
fn maps_lie_beside_their_frames_and_come_back_when_lost() {
    let job = Job::new();
    scene(&job, "scene.toml", &pan(9, 1.0));
    job.refused("render scene.toml --maps --policy off", "--maps … --policy off … --spp MIN..MAX");
    job.done("render scene.toml -o o/f_#.png --frames 1..3 --maps");
    assert_eq!(job.names("o").len(), 3 * 5 + 1);
    let map = job.read("o/f_2_provenance.png");
    // As if they were not there: nothing is rendered, nothing refused, the frames are the same.
    let again = job.done("render scene.toml -o o/f_#.png --frames 1..3");
    assert!(again.out.contains("0 rendered, 3 kept"), "{}", again.out);
    job.done("render scene.toml -o plain/f_#.png --frames 1..3");
    assert!(job.read("plain/f_2.png") == job.read("o/f_2.png"));
    fs::remove_file(job.path("o/f_2_provenance.png")).expect("removed");
    fs::write(job.path("o/f_3_audit.png"), "torn").expect("written");
    let again = job.done("render scene.toml -o o/f_#.png --frames 1..3 --maps");
    assert!(again.out.contains("2 rendered, 1 kept") && says(&again.err, "1 more … maps"));
    assert!(job.read("o/f_2_provenance.png") == map);
    // Somebody's own picture is in the way.
    fs::create_dir(job.path("p")).expect("made");
    fs::write(job.path("p/f_1_audit.png"), "mine").expect("written");
    job.refused("render scene.toml -o p/f_#.png --maps", "f_1_audit.png exists");
}

#[test]
fn exr_frames_hold_their_maps() {
    let job = Job::new();
    scene(&job, "scene.toml", &pan(9, 1.0));
    job.done("render scene.toml -o o/f_#.exr --frames 5 --maps");
    assert_eq!(job.names("o"), ["f.manifest.jsonl", "f_5.exr"]);
    let held = channels(&job, "o/f_5.exr");
    let u32s = |name: &str| match &held.list.iter().find(|c| c.name == name).expect(name).samples {
        ExrSamples::U32(v) => v.clone(),
        ExrSamples::F32(_) => panic!("{name} are numbers"),
    };
    let (provenance, frame) = (u32s("reuse.provenance"), u32s("reuse.frame"));
    assert!((0..=4).all(|kind| kind == 3 || provenance.contains(&kind)));
    for (kind, frame) in provenance.iter().zip(&frame) {
        assert!(if *kind < 2 { *frame == 0 } else { [1, 9].contains(frame) }, "{kind} {frame}");
    }
    assert!(f32s(&held, "reuse.distance").iter().any(|d| *d > 0.0));
    let audited = f32s(&held, "reuse.audit").iter().filter(|e| !e.is_nan()).count();
    assert!((1..64 * 36 / 2).contains(&audited), "{audited}");
    let maps = "provenance,frame,distance,audit";
    let differs = format!("aovs was {maps}, now it is none");
    job.refused("render scene.toml -o o/f_#.exr --frames 5", &differs);
}

#[test]
fn references_of_a_shorter_shot_save_rays_in_a_denser_and_longer_one() {
    let job = Job::new();
    scene(&job, "short.toml", &pan(9, 1.0));
    scene(&job, "long.toml", &pan(21, 1.5));
    let samples = "--shadow-samples 64 --sky-samples 64";
    job.done(&format!("render short.toml {samples} -o base/f_#.exr --aovs reference"));
    // In frames as small as these little can be vouched for: that is not what is tested here.
    let long = format!("render long.toml {samples} --tolerance 255 --probes 0.002");
    job.done(&format!("{long} -o cold/f_##.exr --stats cold.json"));
    let warm = format!("{long} --references base");
    job.done(&format!("{warm} -o warm/f_##.exr --stats warm.json --maps"));
    let (cold, warm_rays) = (shadow_rays(&job, "cold.json"), shadow_rays(&job, "warm.json"));
    assert!(3 * warm_rays < cold, "{warm_rays} shadow rays warm, {cold} cold");
    // Any part of it is the same.
    job.done(&format!("{warm} -o part/f_##.exr --frames 6..7 --maps --threads 1"));
    assert!((6..=7).all(|n| {
        job.read(&format!("part/f_0{n}.exr")) == job.read(&format!("warm/f_0{n}.exr"))
    }));
    // A key frame is inferred too, from frames that are none of its own shot.
    let first = channels(&job, "warm/f_01.exr");
    let kinds = first.list.iter().find(|c| c.name == "reuse.provenance").expect("the map");
    let ExrSamples::U32(kinds) = &kinds.samples else { panic!("numbers") };
    let inferred = kinds.iter().filter(|kind| **kind == 2).count();
    let traced = kinds.iter().filter(|kind| **kind == 1).count();
    assert!(inferred > 10 * traced && !kinds.contains(&3), "{inferred} inferred, {traced} traced");
    // As near to the truth as tracing is.
    let line = "render long.toml --policy off --frames 8";
    job.done(&format!("{line} -o off/f_##.exr"));
    job.done(&format!("{line} -o ref/f_##.exr --shadow-samples 512 --sky-samples 512 --seed 9"));
    let truth = channels(&job, "ref/f_08.exr");
    let error = |folder: &str| -> f64 {
        let own = channels(&job, &format!("{folder}/f_08.exr"));
        let (own, truth) = (f32s(&own, "G").to_vec(), f32s(&truth, "G"));
        own.iter().zip(truth).map(|(a, b)| f64::from(a - b).powi(2)).sum()
    };
    let (warm_error, off) = (error("warm"), error("off"));
    assert!(warm_error < off, "{warm_error} warm, {off} traced");
}

/// Mirrors by themselves: traced frames have next to no noise.
#[test]
fn key_frames_inferred_from_references_obey_the_same_limits() {
    let job = Job::new();
    let path = format!("{}/scenes/reflective_spheres/scene.toml", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).expect("a scene");
    fs::write(job.path("short.toml"), &text).expect("written");
    let longer = text.replace("frames = 16", "frames = 19");
    assert_ne!(longer, text);
    fs::write(job.path("long.toml"), longer).expect("written");
    let line = "--size 64x48 --shadow-samples 64 --quiet --no-video";
    job.done(&format!("render short.toml -o base/f_##.exr --aovs reference --frames 1..3 {line}"));
    let warm = format!("render long.toml --references base {line}");
    job.done(&format!("{warm} -o warm/f_##.exr --frames 1..2"));
    let manifest = String::from_utf8(job.read("warm/f.manifest.jsonl")).expect("UTF-8");
    let rows = manifest.lines().skip(1).map(|l| serde_json::from_str::<Value>(l).expect("JSON"));
    let rows: Vec<Value> = rows.collect();
    assert_eq!(rows.len(), 2);
    for row in rows {
        assert!(row["reuse"]["direct_inferred"].as_u64() > Some(0), "{row}");
    }
}

#[test]
fn unusable_references_are_refused_by_name() {
    let job = Job::new();
    scene(&job, "scene.toml", &pan(3, 1.0));
    job.done("render scene.toml -o plain/f_#.exr --frames 1");
    job.done("render scene.toml -o base/f_#.exr --frames 1 --aovs reference");
    let line = "render scene.toml -o o/f_#.exr --frames 1 --references";
    job.refused(&format!("{line} nowhere"), "--references nowhere … folder");
    fs::create_dir(job.path("empty")).expect("made");
    job.refused(&format!("{line} empty"), "empty … exr");
    job.refused(&format!("{line} plain"), "plain/f_1.exr … --aovs reference");
    job.refused(&format!("{line} base --policy off"), "--references … --policy surface");
    job.refused(&format!("{line} base --shadow-samples 64"), "48 … light 1");
    job.refused(&format!("{line} base --sky-samples 0"), "light 1, sky");
    job.refused(&format!("{line} o"), "o: ");
    job.refused("render scene.toml -o base/g_#.exr --references base", "base … own frames");
    // Another camera move is the same scene, another lamp is not.
    scene(&job, "other.toml", &pan(5, 2.0));
    job.done("render other.toml -o other/f_#.exr --frames 2 --references base");
    let text = fs::read_to_string(job.path("scene.toml")).expect("there");
    // Nor does it matter what is always traced.
    let named =
        text.replace("[reuse]", "[[reuse.traced]]\nmin = [-9, -9, -9]\nmax = [0, 9, 9]\n[reuse]");
    let named = named.replace("file = 'cube.obj'", "file = 'cube.obj'\nreuse = false");
    fs::write(job.path("named.toml"), named).expect("ok");
    job.done("render named.toml -o named/f_#.exr --frames 1 --references base");
    fs::write(job.path("lamp.toml"), text.replace("radiance = 20", "radiance = 21")).expect("ok");
    job.refused("render lamp.toml -o l/f_#.exr --references base", "base/f_1.exr … serve");
    job.done("render scene.toml -o off/f_#.exr --frames 1 --policy off");
    job.refused(&format!("{line} off"), "off/f_1.exr … serve");
    let whole = job.read("base/f_1.exr");
    fs::create_dir(job.path("bad")).expect("made");
    for at in (0..whole.len().min(4000)).step_by(97) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x5a;
        fs::write(job.path("bad/f_1.exr"), &bytes).expect("written");
        let ran = job.run(&format!("{line} bad --overwrite"));
        assert!(!ran.err.contains("panic"), "byte {at}: {}", ran.err);
        assert!([Some(0), Some(2)].contains(&ran.code), "byte {at}: {:?}", ran.code);
        assert!(ran.code == Some(0) || ran.err.contains("bad/f_1.exr"), "byte {at}: {}", ran.err);
    }
    fs::write(job.path("bad/f_1.exr"), &whole[..whole.len() / 3]).expect("written");
    job.refused(&format!("{line} bad"), "bad/f_1.exr");
}
