//! Help, versions, mistakes.

use super::job::{Job, Ran, says};
use std::process::Stdio;

#[test]
fn every_command_has_help_with_an_example() {
    let job = Job::new();
    let help = job.done("--help").out;
    for command in [
        "render", "status", "slurm", "inspect", "verify", "compare", "convert", "accuracy",
        "report", "schema",
    ] {
        assert!(help.contains(&format!("  {command} ")), "{help}");
        let own = job.done(&format!("{command} --help")).out;
        assert!(own.contains("Examples:\n  tweenray"), "{own}");
        assert!(own.lines().all(|line| line.chars().count() <= 120), "{own}");
    }
    assert!(job.done("--version").out.contains("Embree 4."));
    let bare = job.run("");
    assert_eq!(bare.code, Some(2));
    assert!(bare.err.contains("Usage: tweenray"));
}

#[test]
fn invalid_arguments_are_refused_with_what_is_valid() {
    let job = Job::new();
    job.refused("rendr cube.obj", "'render'");
    job.refused("render cube.obj --shadow-sample 4", "'--shadow-samples'");
    job.refused("render cube.obj --filter tant", "'tent'");
    job.refused("render", "<SCENE>");
    job.refused("render cube.obj --size 0x0", "0x0 … pixel");
    job.refused("render cube.obj --size 640", "640 … 640x360");
    job.refused("render cube.obj --size 70000x1", "70000x1 … 32768");
    job.refused("render cube.obj --spp 0", "from 1 to 65536");
    job.refused("render cube.obj --spp 4..2", "write 2..4");
    job.refused("render cube.obj --spp 4..16 --target psnr=40", "not predicted");
    job.refused("render cube.obj --shadow-samples 16..4", "write 4..16");
    job.refused("render cube.obj --sky-samples 0..4", "starts at 1");
    job.refused("render cube.obj --shadow-samples 2..8 --target psnr=40", "not predicted");
    job.refused("render cube.obj --frames 9..3", "frame 9 … frame 3");
    job.refused("render cube.obj --frames 0", "--frames … from 1");
    job.refused("render cube.obj --frames 9999999", "9999999 … 1..48");
    job.refused("render cube.obj --crop 0,0,9999,9", "0,0,9999,9 … 640x360");
    job.refused("render cube.obj --exposure nan", "from 1e-30 to 1e30");
    job.refused("render cube.obj --exposure -1", "from 1e-30 to 1e30");
    job.refused("render cube.obj --clamp 0", "from 1e-30 to 1e30, or \"off\"");
    job.refused("render cube.obj --scale -1", "from 1e-30 to 1e30");
    job.refused("render cube.obj --cutoff -0.5", "from 0 to 1");
    job.refused("render cube.obj --fps 0", "from 1 to 1000");
    job.refused("render cube.obj --spp -1", "from 1 to 65536");
    job.refused("render cube.obj --seed 9223372036854775808", "0..=9223372036854775807");
    job.refused("render cube.obj --threads 0", "1..=4096");
    job.refused("render cube.obj -o out/frame_####.gif", ".png, .exr or .ppm");
    job.refused("render cube.obj -o a##/b##.png", "folder");
    job.refused("render nothing.obj", "nothing.obj");
    job.refused("render nothing.toml", "nothing.toml");
    assert_eq!(job.names("."), ["cube.obj"], "a refused job leaves nothing");
}

#[test]
fn an_unknown_instruction_set_in_the_environment_is_refused() {
    let job = Job::new();
    let line = "render cube.obj --size 8x8 --spp 1 --frames 1 -o f.png";
    let run = |isa: &str| {
        let output = job.command(line).env("TWEENRAY_MAX_ISA", isa).output();
        Ran::of(&output.expect("the program starts"))
    };
    let ran = run("avx1024");
    assert_eq!(ran.code, Some(2), "{}", ran.err);
    assert!(says(&ran.err, "TWEENRAY_MAX_ISA … 'avx1024'"), "{}", ran.err);
    assert!(ran.err.contains("sse2, sse4.2, avx, avx2, avx512"), "{}", ran.err);
    assert_eq!(job.names("."), ["cube.obj"], "a refused job leaves nothing");
    assert_eq!(run("").code, Some(0));
}

#[test]
fn triangles_lost_to_rounding_are_reported() {
    let job = Job::new();
    let cube = String::from_utf8(job.read("cube.obj")).expect("text");
    let far = "v 1e9 0 0\nv 1e9 1e9 0\nv 1e9 0 1e9\n";
    std::fs::write(job.path("lost.obj"), format!("{cube}{far}f 9 10 11\n")).expect("written");
    for command in ["render", "inspect", "verify"] {
        job.refused(&format!("{command} lost.obj"), "12 of … 13 triangles");
    }
    // Twenty more that are kept: no longer most.
    let fan: String =
        (0..20).map(|i| format!("v {}e7 1e9 1e9\nf 9 10 {}\n", i + 1, 12 + i)).collect();
    std::fs::write(job.path("part.obj"), format!("{cube}{far}f 9 10 11\n{fan}")).expect("written");
    let lost = "12 of … 33 triangles";
    let ran = job.done("render part.obj --size 8x8 --spp 1 --frames 1 -o f.png");
    assert!(says(&ran.err, &format!("warning: part.obj: … {lost} … help: ")), "{}", ran.err);
    let text = job.done("inspect part.obj").out;
    assert!(says(&text, lost), "{text}");
}

#[test]
fn a_scene_with_an_unknown_ending_or_output_format_is_refused() {
    let job = Job::new();
    std::fs::write(job.path("scene.txt"), "[camera]\n").expect("written");
    job.refused("render scene.txt", "scene.txt … .toml");
    let text = "[settings]\noutput = 'f_####.gif'\n[[mesh]]\nfile = 'cube.obj'\n";
    std::fs::write(job.path("scene.toml"), text).expect("written");
    for command in ["inspect", "render"] {
        job.refused(&format!("{command} scene.toml"), "scene.toml:2:10: … f_####.gif");
    }
}

#[test]
fn inspect_of_a_bare_mesh_gives_its_own_figures() {
    let job = Job::new();
    let text = job.done("inspect cube.obj").out;
    let bounds = "bounds     (-1, -1, -1) to (1, 1, 1)";
    for words in ["12 triangles, 8 vertices, 1 mesh, 0 spheres", "materials  1,", bounds, "stage "]
    {
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn inspect_counts_no_materials_of_lamps() {
    let job = Job::new();
    let quad =
        "[[light]]\nquad = { centre = [0, 9, 0], normal = '-y', size = [1, 1], radiance = 9 }\n";
    boxed(&job, "[0, 2, 9]", "[0, 0, 0]", &quad.repeat(2));
    let json = inspected(&job);
    assert_eq!((&json["materials"], &json["lights"]["quad"]), (&1.into(), &2.into()));
}

#[test]
fn convert_makes_the_folder_and_names_the_target() {
    let job = Job::new();
    job.done("convert cube.obj new/folder/b.ply");
    assert_eq!(job.names("new/folder"), ["b.ply"]);
    let ran = job.run("convert cube.obj cube.obj/b.ply");
    assert_eq!(ran.code, Some(1), "{}", ran.err);
    assert!(ran.err.contains("cube.obj/b.ply: ") && !ran.err.contains(".part"), "{}", ran.err);
}

/// A closed box and a lamp, and a camera somewhere.
fn boxed(job: &Job, eye: &str, target: &str, light: &str) {
    let text = format!(
        "[camera]\nframes = 3\nstill = {{ eye = {eye}, target = {target} }}\n\
         [sky]\nradiance = 0\n{light}\n\
         [[mesh]]\nname = \"box\"\nbox = {{ min = [-1, -1, -1], max = [1, 1, 3] }}\n"
    );
    std::fs::write(job.path("box.toml"), text).expect("written");
}

const LAMP: &str = "[[light]]\npoint = { position = [0, 4, 0], intensity = 9 }";

fn inspected(job: &Job) -> serde_json::Value {
    let json = job.done("inspect box.toml --json").out;
    serde_json::from_str(&json).expect("valid JSON")
}

#[test]
fn inspect_writes_no_file() {
    let job = Job::new();
    boxed(&job, "[0, 2, 9]", "[0, 0, 0]", LAMP);
    let text = job.done("inspect box.toml").out;
    for word in ["12 triangles", "bounds     (-1, -1, -1) to (1, 1, 3)", "effects", "1 point"] {
        assert!(text.contains(word), "{text}");
    }
    let json = inspected(&job);
    assert_eq!((&json["triangles"], &json["frames"]), (&12.into(), &3.into()));
    assert_eq!(json["camera_end"]["eye"], serde_json::json!([0.0, 2.0, 9.0]));
    assert_eq!(json["warnings"], serde_json::json!([]));
    assert!(json["memory"]["geometry"].as_u64() > Some(0));
    assert_eq!(job.names("."), ["box.toml", "cube.obj"]);
}

#[test]
fn inspect_warns_of_cameras_inside_of_darkness_and_of_emptiness() {
    let job = Job::new();
    for (eye, target, light, warning) in [
        ("[0, 0, 0.2]", "[0, 0, 0]", LAMP, "inside"),
        ("[0, 2, 9]", "[0, 2, 20]", LAMP, "visible"),
        ("[0, 2, 9]", "[0, 0, 0]", "", "lights"),
        (
            "[0, 2, 9]",
            "[0, 0, 0]",
            "[settings]\nshadow_samples = 0\n[[light]]\nquad = \
          { centre = [0, 9, 0], normal = \"-y\", size = [1, 1], radiance = 9 }",
            "shadow-samples … 0",
        ),
    ] {
        boxed(&job, eye, target, light);
        let warnings = inspected(&job)["warnings"].clone();
        assert_eq!(warnings.as_array().map(Vec::len), Some(1), "{warnings}");
        assert!(warnings[0].as_str().is_some_and(|w| says(w, warning)), "{warnings}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_cannot_be_written_is_a_failure() {
    use std::os::unix::fs::FileTypeExt;
    let about = std::fs::metadata("/dev/full");
    if !about.is_ok_and(|about| about.file_type().is_char_device()) {
        eprintln!("skipped: no /dev/full here");
        return;
    }
    let job = Job::new();
    for line in ["inspect cube.obj", "--help", "schema"] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
        let ran = Ran::of(&job.command(line).stdout(full).output().expect("the program starts"));
        assert_eq!(ran.code, Some(1), "{line}");
        assert!(says(&ran.err, "error: … stdout"), "{}", ran.err);
    }
}

#[test]
fn a_closed_stdout_is_no_error() {
    let job = Job::new();
    for line in ["inspect cube.obj", "--help", "schema"] {
        let mut child = job
            .command(line)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        drop(child.stdout.take());
        let ran = Ran::of(&child.wait_with_output().expect("it ends"));
        assert_eq!((ran.code, ran.err.as_str()), (Some(0), ""), "{line}");
    }
}
