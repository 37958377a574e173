//! What exr frames hold beside colour: a choice, with colour alone where nothing asks for more.

use super::job::Job;
use std::fs;
use std::io::BufReader;
use std::path::Path;
use tweenray::output::exr;

const LINE: &str = "render scene.toml --size 16x9 --spp 1 --frames 2";
const FIRST_HITS: &str =
    "N.X N.Y N.Z P.X P.Y P.Z R Z albedo.B albedo.G albedo.R backward.u backward.v mesh_id";

/// A folder with a cube under a lamp, in three frames; `settings` has more lines of the scene file.
fn folder(settings: &str) -> Job {
    let job = Job::new();
    let text = format!(
        "camera = {{ frames = 3, orbit = {{ target = [0, 0, 0], eye = [0, 2, 7], degrees = 4 }} }}\n\
         light = [{{ quad = {{ centre = [2, 5, 3], normal = '-y', size = [2, 2], radiance = 20 }} }}]\n\
         mesh = [{{ file = 'cube.obj' }}]\n[settings]\nvideo = false\n{settings}\n"
    );
    fs::write(job.path("scene.toml"), text).expect("written");
    job
}

/// Names of the channels of an exr frame, and whether it holds its reference.
fn held(job: &Job, name: &str) -> (String, bool) {
    let path = job.path(name);
    let file = BufReader::new(fs::File::open(&path).expect("there"));
    let channels = exr::decode(Path::new(name), file, 1 << 26).expect("an exr file").list;
    let names: Vec<String> = channels.into_iter().map(|channel| channel.name).collect();
    let attribute = exr::read_attribute(&path, "tweenrayReference", 1 << 26).expect("readable");
    (names.join(" "), attribute.is_some())
}

#[test]
fn exr_frames_hold_colour_alone_unless_more_is_asked_for() {
    let job = folder("");
    let maps = "reuse.audit reuse.distance reuse.frame reuse.provenance";
    let all = format!("B G {FIRST_HITS} {maps}");
    job.done(&format!("{LINE} -o base/f_#.exr --aovs reference"));
    for (options, channels, has_reference) in [
        ("", "B G R", false),
        ("--aovs none", "B G R", false),
        ("--aovs depth,mesh-id", "B G R Z mesh_id", false),
        ("--aovs motion --aovs depth", "B G R Z backward.u backward.v", false),
        ("--aovs reference", "B G R", true),
        ("--aovs provenance", "B G R reuse.provenance", false),
        ("--maps", &format!("B G R {maps}"), false),
        ("--maps --aovs depth", &format!("B G R Z {maps}"), false),
        ("--maps --spp 2..8", &format!("B G R {maps} samples"), false),
        ("--maps --spp 2..8 --policy off", "B G R samples", false),
        ("--references base", "B G R", true),
        ("--references base --aovs none", "B G R", false),
        ("--aovs all", &all, true),
        ("--aovs all --policy colour", &all, false),
        ("--aovs all --policy off", &format!("B G {FIRST_HITS}"), false),
    ] {
        // An option is given once.
        let line =
            if options.contains("--spp") { LINE.replace(" --spp 1", "") } else { LINE.into() };
        job.done(&format!("{line} -o o/f_#.exr {options} --overwrite"));
        assert_eq!(held(&job, "o/f_2.exr"), (channels.into(), has_reference), "{options}");
    }
}

#[test]
fn colour_is_the_same_whatever_else_a_frame_holds() {
    let job = folder("");
    let colours = ["none", "depth", "all"].map(|list| {
        job.done(&format!("{LINE} -o {list}/f_#.exr --aovs {list}"));
        let file =
            BufReader::new(fs::File::open(job.path(format!("{list}/f_2.exr"))).expect("there"));
        let channels = exr::decode(Path::new(list), file, 1 << 26).expect("an exr file");
        ["R", "G", "B"].map(|name| channels.f32(name).expect("colour").to_vec())
    });
    assert!(colours[0] == colours[1] && colours[0] == colours[2]);
}

#[test]
fn the_scene_file_may_choose_and_the_command_line_wins() {
    let job = folder("aovs = [\"depth\", \"normal\"]");
    job.done(&format!("{LINE} -o o/f_#.exr"));
    assert_eq!(held(&job, "o/f_2.exr").0, "B G N.X N.Y N.Z R Z");
    // A frame with other channels does not count as finished.
    job.refused(
        &format!("{LINE} -o o/f_#.exr --aovs all"),
        "aovs was depth,normal, now it is depth,position",
    );
    job.done(&format!("{LINE} -o p/f_#.exr --aovs none"));
    assert_eq!(held(&job, "p/f_2.exr").0, "B G R");
    // png frames have no channels to choose: another list is no other picture.
    job.done(&format!("{LINE} -o q/f_#.png"));
    let text = fs::read_to_string(job.path("scene.toml")).expect("there");
    fs::write(job.path("scene.toml"), text.replace("\"normal\"", "\"albedo\"")).expect("written");
    let again = job.done(&format!("{LINE} -o q/f_#.png"));
    assert!(again.out.contains("0 rendered, 1 kept"), "{}", again.out);
}

#[test]
fn lists_that_cannot_be_are_refused_by_name() {
    let job = folder("");
    job.refused(&format!("{LINE} -o o/f_#.exr --aovs dept"), "dept … mesh-id … depth");
    job.refused(&format!("{LINE} -o o/f_#.exr --aovs depth,"), "mesh-id");
    job.refused(&format!("{LINE} -o o/f_#.png --aovs depth"), "--aovs depth: only exr");
    job.done(&format!("{LINE} -o o/f_#.png --aovs none"));
    let off = format!("{LINE} -o o/f_#.exr --policy off --aovs");
    job.refused(&format!("{off} depth,provenance"), "no provenance … surface or colour");
    job.refused(&format!("{off} reference"), "no reference … --policy surface");
    job.refused(
        "slurm scene.toml --nodes 2 --time 30m -- -o o/f_#.exr --policy off --aovs audit",
        "no audit",
    );
    let job = folder("aovs = [\"dept\"]");
    job.refused(&format!("{LINE} -o o/f_#.exr"), "scene.toml: … `dept` … did you mean `depth`?");
    let job = folder("aovs = \"depth\"");
    job.refused(&format!("{LINE} -o o/f_#.exr"), "scene.toml: … array");
}
