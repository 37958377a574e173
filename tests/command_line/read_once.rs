//! The scene is read by one rank of each node, and references by the ranks that need them.

use super::job::{Job, Ran, lines_that_say};
use super::launch::{mpirun, under_mpirun};
use std::fs;
use std::time::{Duration, Instant};

/// A scene of several files: a mesh with a library, a picture on it and holes in it.
fn scene_of_files(job: &Job) {
    let cube = String::from_utf8(job.read("cube.obj")).expect("text");
    fs::create_dir(job.path("scene")).expect("made");
    let corners = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    let faces: String = cube
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(rest) => {
                let corner = |(i, v): (usize, &str)| format!("{v}/{}", i + 1);
                let all: Vec<String> = rest.split(' ').enumerate().map(corner).collect();
                format!("f {}\n", all.join(" "))
            }
            None => format!("{line}\n"),
        })
        .collect();
    let mesh = format!("mtllib own.mtl\nusemtl tiled\n{corners}{faces}");
    fs::write(job.path("scene/cube.obj"), mesh).expect("written");
    // Three of the four texels are dark: holes.
    let library = "newmtl tiled\nKd 1 1 1\nmap_Kd tiles.ppm\nmap_d tiles.ppm\n";
    fs::write(job.path("scene/own.mtl"), library).expect("written");
    let picture = [b"P6 2 2 255\n".as_slice(), &[9, 200, 40, 90, 90, 250, 250, 9, 0, 70, 7, 7]];
    fs::write(job.path("scene/tiles.ppm"), picture.concat()).expect("written");
    let text = "[camera]\nframes = 6\n[settings]\nsize = [48, 27]\nspp = 1\nvideo = false\n\
                [sky]\nradiance = 0.5\n[[mesh]]\nfile = 'cube.obj'\n\
                [[mesh]]\nquad = { centre = [0, -1, 0], normal = 'y', size = [9, 9] }\n\
                [[light]]\nquad = { centre = [2, 5, 3], normal = '-y', size = [2, 2], radiance = 20 }\n";
    fs::write(job.path("scene/scene.toml"), text).expect("written");
}

/// The job under mpirun, with all ranks but the first in a folder where nothing of it is.
fn elsewhere(job: &Job, ranks: &str, line: &str) -> Option<Ran> {
    fs::create_dir_all(job.path("elsewhere")).expect("made");
    let alone = job.command(line);
    let mut command = mpirun(job);
    let away = "[ $OMPI_COMM_WORLD_RANK = 0 ] || cd elsewhere; exec \"$@\"";
    command.args(["-n", ranks, "sh", "-c", away, "sh"]);
    command.arg(alone.get_program()).args(alone.get_args());
    command.output().ok().map(|output| Ran::of(&output))
}

#[test]
fn ranks_of_a_node_need_no_file_that_the_first_has_read() {
    let job = Job::new();
    scene_of_files(&job);
    let whole = job.path("o").display().to_string();
    for policy in ["surface", "colour --upload 3=scene/tiles.png"] {
        // A picture of the right size to upload: a frame.
        let line = format!("render scene/scene.toml --policy {policy}");
        if policy != "surface" {
            fs::copy(job.path("solo/f_3.png"), job.path("scene/tiles.png")).expect("copied");
        }
        _ = fs::remove_dir_all(job.path("solo"));
        _ = fs::remove_dir_all(job.path("o"));
        job.done(&format!("{line} -o solo/f_#.png"));
        let line = format!("{line} -o {whole}/f_#.png --stats {whole}/s.json");
        let Some(ran) = elsewhere(&job, "4", &line) else { return };
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        for frame in 1..=6 {
            let name = format!("f_{frame}.png");
            let same = job.read(&format!("o/{name}")) == job.read(&format!("solo/{name}"));
            assert!(same, "{policy}: {name}");
        }
        let stats: serde_json::Value =
            serde_json::from_slice(&job.read("o/s.json")).expect("valid JSON");
        let sent = |rank: usize, what: &str| stats["ranks"][rank]["sent"]["scene"][what].as_u64();
        assert_eq!(sent(0, "messages"), Some(3));
        assert!(sent(0, "bytes") > Some(3 * 600), "{:?}", sent(0, "bytes"));
        assert!((1..4).all(|rank| sent(rank, "messages") == Some(0)));
    }
    // What would not go unnoticed.
    job.refused("render nowhere/scene.toml", "nowhere/scene.toml");
}

#[test]
fn a_fault_in_a_file_is_reported_once_with_its_line_and_ends_all_ranks() {
    let job = Job::new();
    scene_of_files(&job);
    for (file, from, to, place) in [
        ("scene/scene.toml", "spp = 1", "ssp = 1", "scene/scene.toml:5:1: … `ssp`"),
        ("scene/cube.obj", "f 1/1", "f 99/1", "scene/cube.obj:15"),
    ] {
        let whole = fs::read_to_string(job.path(file)).expect("text");
        assert!(whole.contains(from), "{whole}");
        fs::write(job.path(file), whole.replace(from, to)).expect("written");
        let start = Instant::now();
        let Some(ran) = under_mpirun(&job, 4, "render scene/scene.toml") else { return };
        assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
        assert_eq!((ran.code, lines_that_say(&ran.err, place)), (Some(2), 1), "{}", ran.err);
        fs::write(job.path(file), whole).expect("written");
    }
}

/// Each rank looks into a part of the references and reads those that serve: no matter which, the
/// frames are the same; and one that cannot serve is refused by whoever looks into it.
#[test]
fn supplied_references_serve_on_any_number_of_ranks() {
    let job = Job::new();
    let scene = |name: &str, frames: u32, to: f64| {
        let text = format!(
            "[camera]\nframes = {frames}\n\
             pan = {{ from = [-1, 1.5, 7], to = [{to}, 1.5, 7], target = [0, 0, 0] }}\n\
             [settings]\nsize = [48, 27]\nspp = 1\nvideo = false\nsky_samples = 4\n\
             [sky]\nradiance = 0.3\n[reuse]\nsegment = 4\n[[mesh]]\nfile = 'cube.obj'\n\
             [[mesh]]\nquad = {{ centre = [0, -1, 0], normal = 'y', size = [20, 20] }}\n"
        );
        fs::write(job.path(name), text).expect("written");
    };
    scene("short.toml", 21, 1.0);
    scene("long.toml", 17, 1.2);
    job.done("render short.toml -o base/f_##.exr --aovs reference");
    let line = "render long.toml --references base";
    job.done(&format!("{line} -o solo/f_##.exr"));
    for ranks in [2, 5] {
        let line = format!("{line} -o r{ranks}/f_##.exr --threads 1");
        let Some(ran) = under_mpirun(&job, ranks, &line) else { return };
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        for frame in 1..=17 {
            let name = format!("f_{frame:02}.exr");
            let same = job.read(&format!("r{ranks}/{name}")) == job.read(&format!("solo/{name}"));
            assert!(same, "{ranks} ranks: {name}");
        }
    }
    let mut damaged = job.read("base/f_20.exr");
    damaged.truncate(600);
    fs::write(job.path("base/f_20.exr"), damaged).expect("written");
    let Some(ran) = under_mpirun(&job, 5, &format!("{line} -o d/f_##.exr")) else { return };
    assert_eq!((ran.code, ran.err.matches("base/f_20.exr").count()), (Some(2), 1), "{}", ran.err);
}
