//! Sequences on disk, with a maker that needs no scene.

use super::*;
use crate::film::Film;
use crate::math::DVec3;
use crate::output::manifest::{FORMAT, Foreign, Header, Manifest, manifest_path};
use crate::output::{FramePattern, WriteOptions};
use crate::scene::{CameraPath, FrameRange, KeyPose, Pose, Settings, Shot};
use crate::stats::{RayCounts, RayKind, ReuseCounts};
use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

const FOUR: FrameRange = FrameRange { first: 1, last: 4 };

/// Films that tell frames apart; `stop_before` is the frame it gives up at.
struct Plain {
    settings: Settings,
    stop_before: u32,
    made: RefCell<Vec<u32>>,
}

impl FrameGraph for Plain {}

impl FrameMaker for Plain {
    fn make(&self, frame: u32) -> Result<Made> {
        if frame == self.stop_before {
            return Err(Error::Stopped);
        }
        self.made.borrow_mut().push(frame);
        let mut film = Film::new(4, 2, false);
        film.rgb[0].x = frame as f32 / 255.0 * self.settings.exposure;
        let rays = RayCounts::of(RayKind::Camera, 8);
        Ok(Made { film, rays, reuse: ReuseCounts::default(), audit: None, reference: None })
    }
}

/// Renders `frames` as rank `rank`, with its journal at `journal`.
fn render(
    target: &Target,
    frames: &[u32],
    (rank, journal): (u32, &Path),
    maker: &Plain,
) -> Result<()> {
    let context = WriterContext { target, rank, journal, threads: 1 };
    render_frames(context, frames, maker, &AtomicBool::new(false), &mut |_| Ok(()))
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn target(&self, settings: &Settings, overwrite: bool) -> Target {
        let name = self.path("frame_##.png").display().to_string();
        let header = Header {
            manifest: FORMAT,
            shot_frames: 4,
            files: "frame_##.png".into(),
            settings: Header::settings(settings),
            ..Header::default()
        };
        Target {
            pattern: FramePattern::parse(&name, 4).expect("a pattern"),
            header,
            write: WriteOptions::of(settings, None),
            recipes: recipes(&shot(4), settings),
            overwrite,
        }
    }

    /// Renders frames 1 to 4; gives the numbers of those made, and the plan.
    fn run(
        &self,
        settings: &Settings,
        overwrite: bool,
        stop_before: u32,
    ) -> Result<(Vec<u32>, Plan)> {
        let target = self.target(settings, overwrite);
        let plan = prepare(&target, FOUR)?;
        let made = RefCell::default();
        let maker = Plain { settings: settings.clone(), stop_before, made };
        let journal = manifest_path(&target.pattern);
        render(&target, &plan.render, (0, &journal), &maker)?;
        Ok((maker.made.into_inner(), plan))
    }

    fn frames(&self) -> Vec<Vec<u8>> {
        (1..=4).map(|n| fs::read(self.path(&format!("frame_0{n}.png"))).expect("whole")).collect()
    }
}

/// A key pose a frame.
fn shot(frames: u32) -> Shot {
    let key = |i: u32| {
        let eye = DVec3::new(f64::from(i), 2.0, 9.0);
        let pose = Pose { eye, target: DVec3::ZERO, up: DVec3::Y, roll_degrees: 0.0 };
        KeyPose { at: f64::from(i) / f64::from(frames - 1), pose }
    };
    let path = CameraPath::Keys((0..frames).map(key).collect());
    Shot::new(path, frames, 40.0)
}

fn recipes(shot: &Shot, settings: &Settings) -> Recipes {
    Recipes::new(shot, settings, true, false).expect("good cameras")
}

fn settings() -> Settings {
    Settings { width: 4, height: 2, ..Settings::default() }
}

#[test]
fn finished_frames_are_kept_and_a_stopped_job_goes_on() {
    let folder = Folder::new();
    assert_eq!(folder.run(&settings(), false, 3).expect("runs").0, [1, 2]);
    assert_eq!(folder.run(&settings(), false, 0).expect("runs").0, [3, 4]);
    let (made, plan) = folder.run(&settings(), false, 0).expect("runs");
    assert_eq!((made, plan.kept, plan.notes), (vec![], vec![1, 2, 3, 4], vec![]));
    let undisturbed = Folder::new();
    undisturbed.run(&settings(), false, 0).expect("runs");
    assert_eq!(folder.frames(), undisturbed.frames());
}

#[test]
fn damaged_missing_and_unlisted_frames_are_rendered_again() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    let whole = folder.frames();
    fs::write(folder.path("frame_01.png"), b"torn").expect("written");
    fs::remove_file(folder.path("frame_02.png")).expect("removed");
    // A crash between rename and row, and in the middle of the next row.
    let manifest = folder.path("frame.manifest.jsonl");
    let text = fs::read_to_string(&manifest).expect("there");
    let lines: Vec<&str> = text.lines().collect();
    let torn = &lines[4][..lines[4].len() / 2];
    fs::write(&manifest, [&lines[..4].join("\n"), "\n", torn].concat()).expect("written");
    let (made, plan) = folder.run(&settings(), false, 0).expect("runs");
    assert_eq!((made, plan.notes.len()), (vec![1, 2, 4], 2));
    assert_eq!(folder.frames(), whole);
    let read = Manifest::read(&manifest).expect("readable").expect("there");
    assert_eq!(read.rows.len(), 4);
    assert_eq!(folder.run(&settings(), false, 0).expect("runs").0, Vec::<u32>::new());
}

#[test]
fn other_settings_are_refused_by_name_and_overwrite_replaces() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    let brighter = Settings { exposure: 2.1, ..settings() };
    let error = folder.run(&brighter, false, 0).expect_err("refused").to_string();
    assert!(error.contains("exposure was 1, now it is 2.1"), "{error}");
    let mut crop = settings();
    crop.crop = Some(crate::scene::Rect { x0: 0, y0: 0, x1: 2, y1: 1 });
    let error = folder.run(&crop, false, 0).expect_err("refused").to_string();
    assert!(error.contains("crop was none, now it is 0,0,2,1"), "{error}");
    assert_eq!(folder.run(&brighter, true, 3).expect("runs").0, [1, 2]);
    // Frames 3 and 4 of the old settings are still there; no row of the new manifest has them.
    let (made, plan) = folder.run(&brighter, false, 0).expect("runs");
    assert_eq!((made, plan.kept), (vec![3, 4], vec![1, 2]));
    assert!(plan.notes[0].contains("frame_03.png and 1 more are not in the manifest"));
    assert_eq!(plan.notes.len(), 1);
    // Exposure 0.1 is no f64: it must still equal itself after a round through the file.
    let dark = Settings { exposure: 0.1, ..settings() };
    folder.run(&dark, true, 0).expect("runs");
    assert_eq!(folder.run(&dark, false, 0).expect("kept").0, Vec::<u32>::new());
}

#[test]
fn frames_without_a_manifest_are_not_touched() {
    let folder = Folder::new();
    fs::write(folder.path("frame_03.png"), b"somebody's").expect("written");
    let error = folder.run(&settings(), false, 0).expect_err("refused").to_string();
    assert!(error.contains("frame_03.png exists"), "{error}");
    assert!(!folder.path("frame.manifest.jsonl").exists());
    assert_eq!(folder.run(&settings(), true, 0).expect("runs").0, [1, 2, 3, 4]);
}

#[test]
fn settings_may_change_once_all_frames_are_gone() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    (1..=4).for_each(|n| {
        fs::remove_file(folder.path(&format!("frame_0{n}.png"))).expect("removed");
    });
    let other = Settings { spp: 9, ..settings() };
    assert_eq!(folder.run(&other, false, 0).expect("runs").0, [1, 2, 3, 4]);
}

#[test]
fn parts_of_ranks_are_taken_in_at_the_next_start() {
    let folder = Folder::new();
    let target = folder.target(&settings(), false);
    let plan = prepare(&target, FOUR).expect("prepared");
    let maker = Plain { settings: settings(), stop_before: 0, made: RefCell::default() };
    let manifest = manifest_path(&target.pattern);
    let part = crate::output::manifest::part_path(&manifest, &target.header, 1);
    render(&target, &plan.render[..2], (0, &manifest), &maker).expect("runs");
    render(&target, &plan.render[2..3], (1, &part), &maker).expect("runs");
    // Whoever looks while they run sees the rows of both, and moves none.
    let now = Manifest::as_of_now(&manifest).expect("read").expect("there");
    let ranks: Vec<(u32, u32)> = now.rows.values().map(|row| (row.frame, row.rank)).collect();
    assert_eq!(ranks, [(1, 0), (2, 0), (3, 1)]);
    assert!(now.rows.values().all(|row| row.ended.is_some_and(|t| t > 1e9)) && part.exists());
    // Both ranks were killed here.
    assert_eq!(folder.run(&settings(), false, 0).expect("runs").0, [4]);
    assert!(!part.exists());
}

/// As `target`, for the shot given.
fn target_of(folder: &Folder, shot: &Shot, settings: &Settings) -> Target {
    let mut target = folder.target(settings, false);
    target.recipes = recipes(shot, settings);
    target.header.shot_frames = shot.frames;
    target.header.shot_hash = format!("{shot:?}");
    target
}

fn strays(target: &Target) -> Vec<u32> {
    let manifest = Manifest::read(&manifest_path(&target.pattern)).expect("readable");
    let rows = manifest.expect("there").rows.into_values();
    rows.filter(|row| row.stray == Some(Foreign::OtherMove)).map(|row| row.frame).collect()
}

#[test]
fn a_longer_shot_keeps_frames_with_the_same_recipe_and_renders_the_others() {
    let folder = Folder::new();
    let mut settings = settings();
    settings.reuse.segment = 2;
    folder.run(&settings, false, 0).expect("runs");
    let long = target_of(&folder, &shot(9), &settings);
    let all = FrameRange { first: 1, last: 9 };
    // 1, 2 and 3 are a whole segment; 4 was a key frame at the end and is one in between now.
    let plan = prepare(&long, all).expect("a longer shot is no other scene");
    assert_eq!((plan.kept, plan.render), (vec![1, 2, 3], vec![4, 5, 6, 7, 8, 9]));
    let note = &plan.notes[0];
    assert!(note.contains("9 frames, not 4: 1 frame from frame 4 on"), "{note}");
    assert!(note.contains("--segment"), "{note}");
    // The job was killed before frame 4: it is still the old one, and known as such.
    assert_eq!(strays(&long), [4]);
    assert_eq!(prepare(&long, all).expect("goes on").kept, [1, 2, 3]);
    let four = target_of(&folder, &shot(4), &settings);
    assert_eq!(prepare(&four, FOUR).expect("back again").kept, [1, 2, 3, 4]);
    assert_eq!(strays(&four), Vec::<u32>::new());
}

#[test]
fn another_move_is_refused_by_its_first_frame() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    let mut moved = shot(4);
    let CameraPath::Keys(keys) = &mut moved.path else { panic!("keys") };
    keys[2].pose.eye.y = 2.5;
    let mut target = target_of(&folder, &moved, &settings());
    let error = prepare(&target, FOUR).expect_err("refused").to_string();
    assert!(error.contains("frame_03.png is of another camera move"), "{error}");
    assert_eq!(strays(&target), Vec::<u32>::new(), "nothing was touched");
    target.overwrite = true;
    assert_eq!(prepare(&target, FOUR).expect("replaces").render, [1, 2, 3, 4]);
    assert_eq!(strays(&target), [3], "no other frame is made from frame 3");
}

#[test]
fn a_survey_lists_done_missing_damaged_and_stray_frames() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    let brighter = Settings { exposure: 2.0, ..settings() };
    let target = folder.target(&brighter, true);
    prepare(&target, FrameRange { first: 1, last: 3 }).expect("ready to replace three");
    let path = manifest_path(&target.pattern);
    let maker = Plain { settings: brighter, stop_before: 0, made: RefCell::default() };
    render(&target, &[1, 2], (0, &path), &maker).expect("runs");
    fs::write(folder.path("frame_02.png"), b"torn").expect("written");
    fs::remove_file(folder.path("frame_03.png")).expect("removed");
    let all = |last| Ok(FrameRange { first: 1, last });
    let found = survey::survey(&path, all).expect("a sequence");
    assert_eq!((found.done, found.missing, found.damaged), (vec![1], vec![3], vec![2]));
    assert_eq!((found.other_settings, found.complete), (vec![4], false));
    let one = |_| Ok(FrameRange { first: 1, last: 1 });
    assert!(survey::survey(&path, one).expect("a sequence").complete);
    assert!(survey::survey(&folder.path("no.jsonl"), all).is_err());
}

#[test]
fn an_older_manifest_is_refused_with_its_version() {
    let folder = Folder::new();
    folder.run(&settings(), false, 0).expect("runs");
    let manifest = folder.path("frame.manifest.jsonl");
    let text = fs::read_to_string(&manifest).expect("there");
    fs::write(&manifest, text.replacen("\"manifest\":2", "\"manifest\":1", 1)).expect("written");
    let error = folder.run(&settings(), false, 0).expect_err("refused").to_string();
    assert!(error.contains("version 1 of the format"), "{error}");
    assert_eq!(folder.run(&settings(), true, 0).expect("runs").0, [1, 2, 3, 4]);
}

/// How many frames have a row in the manifest.
fn listed(manifest: &Path) -> usize {
    let text = fs::read_to_string(manifest).unwrap_or_default();
    text.lines()
        .skip(1)
        .filter(|line| serde_json::from_str::<serde_json::Value>(line).is_ok())
        .count()
}

/// Makes frames while it looks at those before.
struct Beside<'a> {
    manifest: &'a Path,
    /// How many rows each frame waited for, while it was made.
    waits_for: fn(u32) -> usize,
    /// Called with each frame, when it is made.
    and: &'a dyn Fn(u32),
}

impl FrameGraph for Beside<'_> {}

impl FrameMaker for Beside<'_> {
    fn make(&self, frame: u32) -> Result<Made> {
        let start = Instant::now();
        while listed(self.manifest) < (self.waits_for)(frame) {
            assert!(start.elapsed().as_secs() < 20, "no frame is written meanwhile");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        (self.and)(frame);
        let (film, rays) = (Film::new(4, 2, false), RayCounts::default());
        Ok(Made { film, rays, reuse: ReuseCounts::default(), audit: None, reference: None })
    }
}

fn render_beside(
    target: &Target,
    waits_for: fn(u32) -> usize,
    and: &dyn Fn(u32),
    stop: &AtomicBool,
) -> (Result<()>, Vec<u32>) {
    prepare(target, FOUR).expect("prepared");
    let manifest = manifest_path(&target.pattern);
    let maker = Beside { manifest: &manifest, waits_for, and };
    let context = WriterContext { target, rank: 0, journal: &manifest, threads: 2 };
    let mut done = Vec::new();
    let mut after_frame = |report: FrameReport| {
        assert!(report.trace_seconds > 0.0 && report.write_seconds > 0.0);
        done.push(report.frame);
        Ok(())
    };
    let ended = render_frames(context, &[1, 2, 3, 4], &maker, stop, &mut after_frame);
    (ended, done)
}

#[test]
fn a_frame_is_written_while_the_next_is_made() {
    let folder = Folder::new();
    let target = folder.target(&settings(), false);
    let manifest = manifest_path(&target.pattern);
    // Of two frames before this one, the first has been written: two are in memory at most.
    let is_bounded = |frame: u32| assert!(listed(&manifest) + 2 >= frame as usize);
    let each_waits = |frame| frame as usize - 1;
    let (ended, done) = render_beside(&target, each_waits, &is_bounded, &AtomicBool::new(false));
    assert_eq!((ended.expect("written"), done), ((), vec![1, 2, 3, 4]));
    let folder = Folder::new();
    let target = folder.target(&settings(), false);
    let manifest = manifest_path(&target.pattern);
    let is_bounded = |frame: u32| assert!(listed(&manifest) + 2 >= frame as usize);
    let (ended, done) = render_beside(&target, |_| 0, &is_bounded, &AtomicBool::new(false));
    assert_eq!((ended.expect("written"), done), ((), vec![1, 2, 3, 4]));
}

#[test]
fn a_frame_that_cannot_be_written_stops_the_job_and_those_before_stay() {
    let folder = Folder::new();
    let target = folder.target(&settings(), false);
    let stop = AtomicBool::new(false);
    let in_the_way = |frame: u32| {
        if frame == 2 {
            fs::create_dir(folder.path("frame_02.png")).expect("made");
        }
    };
    let (ended, done) = render_beside(&target, |_| 0, &in_the_way, &stop);
    let error = ended.expect_err("a folder is in the way").to_string();
    assert!(error.contains("frame_02.png"), "{error}");
    assert_eq!(done, [1]);
    assert!(stop.load(Ordering::Relaxed), "what is being traced is given up");
    assert!(!folder.path("frame_03.png").exists());
    assert_eq!(listed(&manifest_path(&target.pattern)), 1);
}

#[test]
fn a_panic_while_frames_are_made_or_written_ends_the_job() {
    for frame in [1, 3] {
        let folder = Folder::new();
        let target = folder.target(&settings(), false);
        let panics = |at: u32| assert!(at != frame, "on purpose");
        let run = || render_beside(&target, |_| 0, &panics, &AtomicBool::new(false));
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).expect_err("panicked");
        assert_eq!(listed(&manifest_path(&target.pattern)), frame as usize - 1);
    }
    let folder = Folder::new();
    let target = folder.target(&settings(), false);
    prepare(&target, FOUR).expect("prepared");
    let maker = Plain { settings: settings(), stop_before: 0, made: RefCell::default() };
    let journal = manifest_path(&target.pattern);
    let context = WriterContext { target: &target, rank: 0, journal: &journal, threads: 1 };
    let mut after_frame = |_: FrameReport| panic!("on purpose");
    let run = || {
        let stop = AtomicBool::new(false);
        render_frames(context, &[1, 2, 3, 4], &maker, &stop, &mut after_frame)
    };
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).expect_err("panicked");
}
