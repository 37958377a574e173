//! References that an earlier run left on disk: read where they are whole and its own, made again where
//! not, and in neither case does a frame differ.

#[path = "common/says.rs"]
mod says;

use says::says;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use tweenray::import::{self, LoadOptions};
use tweenray::intersect;
use tweenray::output::manifest::{FORMAT, Header, manifest_path};
use tweenray::output::{Format, FramePattern, WriteOptions};
use tweenray::reuse;
use tweenray::reuse::colour::AgreementRule;
use tweenray::reuse::store::Compatibility;
use tweenray::scene::{FrameRange, Policy, Rect, Scene, Settings, Shot};
use tweenray::sequence::checkpoint::Checkpoints;
use tweenray::sequence::{
    ColourMaker, FrameContext, FrameGraph, FrameMaker, Pyramid, RankMaker, Recipes, SurfaceReuse,
    Target, WriterContext, prepare, render_frames,
};
use tweenray::shade::{Progress, Renderer};
use tweenray::stats::RayCounts;

const SCENE: &str = "
camera = { frames = 17, orbit = { target = [0, 0.5, 0], eye = [0, 2.6, 7], degrees = 30 } }
sky = { radiance = [0.4, 0.5, 0.7], lights = true }
material.silver = { mirror = 0.9 }
material.sand = { diffuse = [0.5, 0.42, 0.3] }
mesh = [{ terrain = { vertices = 20, size = 12 }, material = 'sand' }]
sphere = [{ centre = [0, 1.4, 0], radius = 1, material = 'silver' }]
";
const ALL: FrameRange = FrameRange { first: 1, last: 17 };

/// How many frames' worth of tiles were traced.
#[derive(Default)]
struct Traced(Mutex<f64>);

impl Progress for Traced {
    fn tile_done(&self, share: f64, _: &RayCounts) {
        *self.0.lock().expect("whole") += share;
    }
}

/// A job in a folder.
struct Bed {
    folder: tempfile::TempDir,
    scene: Scene,
    shot: Shot,
    settings: Settings,
    ending: &'static str,
}

/// What a run of some frames took and said.
struct Run {
    frames: f64,
    notes: Vec<String>,
}

fn render(target: &Target, frames: &[u32], journal: &Path, maker: &impl FrameMaker) {
    let context = WriterContext { target, rank: 0, journal, threads: 2 };
    render_frames(context, frames, maker, &AtomicBool::new(false), &mut |_| Ok(()))
        .expect("renders");
}

/// What makers are made of.
struct Tools<'a> {
    context: FrameContext<'a>,
    checkpoints: &'a Checkpoints<'a>,
}

impl Bed {
    fn new(ending: &'static str, crop: Option<Rect>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("scene.toml");
        fs::write(&file, SCENE).expect("written");
        let loaded = import::load(&file, &LoadOptions::default()).expect("a scene");
        let mut settings = Settings { width: 64, height: 36, spp: 2, crop, ..loaded.settings };
        settings.reuse.segment = 8;
        let scene = loaded.world.into_scene(true).expect("a scene");
        Self { folder, scene, shot: loaded.shot, settings, ending }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn target(&self) -> Target {
        let name = self.path(&format!("f_##.{}", self.ending)).display().to_string();
        let pattern = FramePattern::parse(&name, 17).expect("a pattern");
        let with_motion = pattern.format() == Format::Exr;
        let header = Header {
            manifest: FORMAT,
            settings: Header::settings(&self.settings),
            ..Header::default()
        };
        Target {
            pattern,
            header,
            recipes: Recipes::new(&self.shot, &self.settings, true, with_motion).expect("cameras"),
            write: WriteOptions::of(&self.settings, None),
            overwrite: false,
        }
    }

    /// A process as it were, that expects `frames` and makes the first `count` of them.
    fn run(&self, frames: &[u32], count: usize) -> Run {
        self.process(|maker, target, _| {
            maker.expect(frames);
            let journal = manifest_path(&target.pattern);
            render(target, &frames[..count], &journal, maker);
        })
    }

    fn process(&self, act: impl FnOnce(&mut SurfaceReuse, &Target, &Compatibility)) -> Run {
        self.with(|tools| {
            let pyramid = Pyramid { segment: 8, frames: 17 };
            let Tools { context, checkpoints } = tools;
            let with_gbuffer = context.with_gbuffer;
            let mut maker = SurfaceReuse::new(context, pyramid).expect("cameras");
            maker.terms = with_gbuffer.then(|| checkpoints.terms.clone());
            maker.checkpoints = Some(checkpoints);
            act(&mut maker, checkpoints.target, checkpoints.terms);
            maker.notes()
        })
    }

    /// As [`run`](Self::run), under policy `colour`.
    fn run_colour(&self, frames: &[u32], count: usize) -> Run {
        self.with(|tools| {
            let rule = AgreementRule { colour_epsilon: 0.02, distance_epsilon: 0.02 };
            let Tools { context, checkpoints } = tools;
            let mut maker = ColourMaker::new(context, rule, &[]).expect("no pictures");
            maker.checkpoints = Some(checkpoints);
            maker.expect(frames);
            let (target, frames) = (checkpoints.target, &frames[..count]);
            let journal = manifest_path(&target.pattern);
            render(target, frames, &journal, &maker);
            maker.notes()
        })
    }

    fn with(&self, act: impl FnOnce(Tools) -> Vec<String>) -> Run {
        let target = self.target();
        let settings = &self.settings;
        let mut notes = prepare(&target, ALL).expect("ready").notes;
        let channels = reuse::channels(&self.scene, settings);
        let terms = Compatibility::of("h", &channels, settings);
        let whole = settings.crop.is_none() && settings.reuse.policy == Policy::Surface;
        let every = Some(Duration::ZERO);
        let checkpoints = Checkpoints::new(&target, every, &terms, self.scene.recentring, whole);
        let intersector = intersect::build(&self.scene, settings, 1).expect("a tree");
        let renderer = Renderer::new(&self.scene, settings, &*intersector);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
        let (stop, traced) = (AtomicBool::new(false), Traced::default());
        let context = FrameContext {
            renderer,
            shot: &self.shot,
            pool: &pool,
            with_gbuffer: self.ending == "exr",
            stop: &stop,
            progress: &traced,
        };
        notes.extend(act(Tools { context, checkpoints: &checkpoints }));
        let frames = *traced.0.lock().expect("whole");
        Run { frames: frames.round(), notes }
    }

    fn frame(&self, frame: u32) -> Vec<u8> {
        fs::read(self.path(&format!("f_{frame:02}.{}", self.ending))).expect("whole")
    }

    fn reference(&self, frame: u32) -> PathBuf {
        self.path(&format!(".f.references/{frame:07}.reference"))
    }
}

/// As a kill leaves it that comes before frame 2 is made of frames 1, 9, 5 and 3.
fn killed(ending: &'static str, crop: Option<Rect>) -> Bed {
    let bed = Bed::new(ending, crop);
    assert_eq!(bed.run(&[1, 9, 5, 3, 2], 4).frames, 4.0, "{ending}");
    bed
}

fn undisturbed(ending: &'static str, crop: Option<Rect>) -> Vec<u8> {
    let bed = Bed::new(ending, crop);
    bed.run(&[1, 9, 5, 3, 2], 5);
    assert!(!bed.reference(1).exists(), "what no frame needs is removed");
    bed.frame(2)
}

fn flip(path: &Path, at: usize) {
    let mut bytes = fs::read(path).expect("there");
    let at = at.min(bytes.len() - 1);
    bytes[at] ^= 4;
    fs::write(path, bytes).expect("written");
}

#[test]
fn references_are_read_and_the_frame_is_the_same() {
    let crop = Some(Rect { x0: 5, y0: 3, x1: 40, y1: 30 });
    // Key frames alone are checkpoints: frames 5 and 3 are inferred again.
    for (ending, crop, frames) in [("png", None, 3.0), ("exr", None, 1.0), ("exr", crop, 3.0)] {
        let bed = killed(ending, crop);
        let run = bed.run(&[2], 1);
        assert_eq!((run.frames, &run.notes[..]), (frames, &[][..]), "{ending}");
        assert!(bed.frame(2) == undisturbed(ending, crop), "{ending}");
    }
}

#[test]
fn references_go_from_disk_to_other_ranks_without_a_ray() {
    for (ending, on_disk) in [("png", &[1, 9][..]), ("exr", &[1, 9, 5, 3])] {
        let bed = killed(ending, None);
        let run = bed.process(|maker, _, terms| {
            maker.exchange = Some(terms.clone());
            let found: Vec<u32> = (1..=17).filter(|f| maker.is_on_disk(*f)).collect();
            let mut expected = on_disk.to_vec();
            expected.sort_unstable();
            assert_eq!(found, expected);
            for frame in on_disk {
                maker.hold(*frame);
                maker.make_reference(*frame).expect("read");
                let sent = maker.export(*frame).expect("bytes").bytes;
                let file = fs::read(bed.reference(1)).unwrap_or_default();
                assert!(*frame != 1 || file.is_empty() || file.ends_with(&sent));
                maker.import(*frame, &sent);
            }
        });
        assert_eq!(run.frames, 0.0, "{ending}");
    }
}

#[test]
fn exr_frames_are_references_themselves() {
    let bed = killed("exr", None);
    fs::remove_dir_all(bed.path(".f.references")).expect("removed");
    assert_eq!(bed.run(&[2], 1).frames, 1.0);
    assert!(bed.frame(2) == undisturbed("exr", None));
    // A frame that is not what the manifest says is nobody's reference.
    let bed = killed("exr", None);
    fs::remove_dir_all(bed.path(".f.references")).expect("removed");
    flip(&bed.path("f_05.exr"), 3000);
    assert_eq!(bed.run(&[2], 1).frames, 2.0);
    assert!(bed.frame(2) == undisturbed("exr", None));
}

#[test]
fn missing_and_damaged_references_are_made_again() {
    let whole = undisturbed("png", None);
    let bed = killed("png", None);
    fs::remove_file(bed.reference(1)).expect("removed");
    let length = fs::metadata(bed.reference(9)).expect("there").len() as usize;
    flip(&bed.reference(9), length * 3 / 4);
    let run = bed.run(&[2], 1);
    assert_eq!(run.frames, 5.0);
    let note = "0000009.reference … damaged";
    assert!(run.notes.len() == 1 && says(&run.notes[0], note), "{:?}", run.notes);
    assert!(bed.frame(2) == whole);
    for at in [0, 40, 1500] {
        let bed = killed("png", None);
        flip(&bed.reference(1), at);
        bed.run(&[2], 1);
        assert!(bed.frame(2) == whole, "byte {at}");
        let bed = killed("png", None);
        let bytes = fs::read(bed.reference(1)).expect("there");
        fs::write(bed.reference(1), &bytes[..at]).expect("cut");
        assert_eq!(bed.run(&[2], 1).frames, 4.0, "cut at {at}");
        assert!(bed.frame(2) == whole, "cut at {at}");
    }
}

#[test]
fn references_of_other_settings_are_refused_and_overwrite_removes_them() {
    for has_manifest in [true, false] {
        let mut bed = killed("png", None);
        (1..=17).for_each(|f| _ = fs::remove_file(bed.path(&format!("f_{f:02}.png"))));
        let manifest = bed.path("f.manifest.jsonl");
        if !has_manifest {
            fs::remove_file(&manifest).expect("removed");
        }
        let before = fs::read(&manifest).ok();
        bed.settings.seed = 7;
        let error = prepare(&bed.target(), ALL).expect_err("refused").to_string();
        assert!(says(&error, "seed … 0 … 7"), "{error}");
        assert!(error.contains("2 references") && error.contains("--overwrite"), "{error}");
        assert!(bed.reference(1).exists() && fs::read(&manifest).ok() == before);
        let target = Target { overwrite: true, ..bed.target() };
        let notes = prepare(&target, ALL).expect("ready").notes;
        assert!(says(&notes[0], "removed 2 references … seed … 0 … 7"), "{notes:?}");
        assert!(!bed.reference(1).exists());
    }
}

/// They only save time.
#[test]
fn references_that_cannot_be_written_do_not_end_the_job() {
    let bed = Bed::new("png", None);
    let run = bed.process(|maker, target, _| {
        // In place of the folder.
        fs::write(bed.path(".f.references"), "").expect("written");
        let frames = [1, 9, 5, 3, 2];
        maker.expect(&frames);
        let journal = manifest_path(&target.pattern);
        render(target, &frames, &journal, maker);
        maker.stopped();
    });
    assert!(run.notes.len() == 1 && run.notes[0].contains(".f.references"), "{:?}", run.notes);
    assert!(bed.frame(2) == undisturbed("png", None));
}

#[test]
fn references_of_another_version_are_refused() {
    let bed = killed("png", None);
    let mut bytes = fs::read(bed.reference(9)).expect("there");
    let start = b"{\"checkpoint\":";
    assert!(bytes.starts_with(start));
    bytes[start.len()] = b'9';
    fs::write(bed.reference(9), bytes).expect("written");
    let error = prepare(&bed.target(), ALL).expect_err("refused").to_string();
    assert!(says(&error, "1 reference … version"), "{error}");
}

#[test]
fn references_of_another_move_are_removed_with_the_reason() {
    let mut bed = killed("png", None);
    (1..=17).for_each(|f| _ = fs::remove_file(bed.path(&format!("f_{f:02}.png"))));
    bed.shot.vfov_degrees += 1.0;
    let notes = bed.run(&[2], 0).notes;
    assert!(says(&notes[0], "camera"), "{notes:?}");
    assert!(!bed.reference(1).exists());
}

/// Under policy `colour` frame 2 is inferred from frames 1, 17, 9, 5 and 3.
#[test]
fn discoveries_of_policy_colour_are_read_or_made_again() {
    let frames = [1, 17, 9, 5, 3, 2];
    for ending in ["png", "exr"] {
        let colour = || {
            let mut bed = Bed::new(ending, None);
            bed.settings.reuse.policy = Policy::Colour;
            bed
        };
        let whole = colour();
        whole.run_colour(&frames, 6);
        assert!(!whole.reference(1).exists(), "what no frame needs is removed");
        let killed = || {
            let bed = colour();
            assert_eq!(bed.run_colour(&frames, 5).frames, 5.0);
            bed
        };
        let bed = killed();
        let run = bed.run_colour(&[2], 1);
        assert_eq!((run.frames, &run.notes[..]), (1.0, &[][..]));
        assert!(bed.frame(2) == whole.frame(2), "{ending}");
        // Frame 17's are damaged: it is traced again, and frame 9, which is there, is not.
        let bed = killed();
        flip(&bed.reference(17), 1_000_000);
        let run = bed.run_colour(&[2], 1);
        assert_eq!(run.frames, 2.0);
        assert!(says(&run.notes[0], "damaged"), "{:?}", run.notes);
        assert!(bed.frame(2) == whole.frame(2), "{ending}");
        let bed = killed();
        fs::remove_dir_all(bed.path(".f.references")).expect("removed");
        assert_eq!(bed.run_colour(&[2], 1).frames, 6.0);
        assert!(bed.frame(2) == whole.frame(2), "{ending}");
    }
}
