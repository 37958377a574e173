//! `render --target` and `--budget`: the choice is told, kept and held against what came out.

use super::job::{Job, says};
use serde_json::Value;

const LINE: &str = "render cube.obj --size 48x32 --frames 1..3 --no-video -o o/f_##.png";

fn header(job: &Job) -> Value {
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    serde_json::from_str(manifest.lines().next().expect("a header")).expect("JSON")
}

/// A frame that is lost is rendered again with the same settings, without another probe: whatever the
/// clock would say now, its bytes are the same.
#[test]
fn a_job_that_goes_on_keeps_its_choice_and_its_bytes() {
    let job = Job::new();
    let said = job.done(&format!("{LINE} --target psnr=38")).err;
    for words in ["for psnr=38: --spp ", "predicted: PSNR ", "came out: PSNR "] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let (first, before) = (header(&job), job.read("o/f_02.png"));
    assert_eq!(first["chosen"]["wanted"], "psnr=38");
    assert_eq!(first["settings"]["spp"], first["chosen"]["predicted"]["samples"]["spp"]);
    std::fs::remove_file(job.path("o/f_02.png")).expect("removed");
    let ran = job.done(&format!("{LINE} --target psnr=38 --threads 1"));
    assert!(ran.err.contains("as chosen before") && !ran.err.contains("probe:"), "{}", ran.err);
    assert!(ran.out.contains("1 rendered, 2 kept"), "{}", ran.out);
    assert_eq!((header(&job), job.read("o/f_02.png")), (first.clone(), before.clone()));
    // What was chosen gives the same frames when it is spelled out.
    let s = &first["settings"];
    let options = format!(
        "--spp {} --shadow-samples {} --sky-samples {} --bounces {} --policy {}",
        s["spp"],
        s["shadow_samples"],
        s["sky_samples"],
        s["bounces"],
        s["reuse"]["policy"].as_str().expect("a name")
    );
    assert_eq!(s["reuse"]["tolerance"], 0.25, "{s}");
    job.done(&format!("{} {options}", LINE.replace("o/", "p/")));
    assert_eq!(job.read("p/f_02.png"), before);
}

/// The report's command is one that gives the same frames whatever the clock says.
#[test]
fn a_report_spells_out_the_chosen_options() {
    let job = Job::new();
    for wish in ["--target psnr=34", "--target=psnr=34", "--budget 3s"] {
        let line = LINE.replace("o/f", "'o/f").replace(".png", ".png'");
        job.done(&format!("{LINE} {wish} --spp 3 --overwrite"));
        job.done("report o -o p.html -q");
        let page = String::from_utf8(job.read("p.html")).expect("UTF-8").replace("&#39;", "'");
        let command = page.split("<pre id=\"command\">").nth(1).expect("a command");
        let command = command.split("</pre>").next().expect("its end");
        let begin = format!("tweenray {line} --shadow-samples ");
        assert!(command.starts_with(&begin), "{command}");
        assert!(command.ends_with(" --spp 3 --overwrite"), "{command}");
        for row in ["Wanted", "Chosen", "Predicted", "Came out"] {
            assert!(page.contains(&format!("<th scope=\"row\">{row}</th>")), "{row}");
        }
        let has_verdict = page.contains("<th scope=\"row\">Verdict</th>");
        assert_eq!(has_verdict, wish.starts_with("--target"), "{page}");
        let is_looked_at = page.contains(" in the worst of 3 frames looked at");
        assert!(is_looked_at || wish.starts_with("--budget"), "{page}");
        let frame = job.read("o/f_02.png");
        let again =
            command.trim_start_matches("tweenray ").replace('\'', "").replace("o/", "again/");
        assert!(job.done(&again).out.contains("3 rendered"));
        assert_eq!(job.read("again/f_02.png"), frame, "{wish}");
        std::fs::remove_dir_all(job.path("again")).expect("removed");
    }
    // Of a choice that cannot be read, nothing is promised.
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    let (first, rows) = manifest.split_once('\n').expect("lines");
    let mut unknown: Value = serde_json::from_str(first).expect("JSON");
    unknown["chosen"] = 7.into();
    std::fs::write(job.path("o/f.manifest.jsonl"), format!("{unknown}\n{rows}")).expect("written");
    job.done("report o -o p.html -q");
    let page = String::from_utf8(job.read("p.html")).expect("UTF-8");
    assert!(says(&page, "chose … measured times") && !page.contains("same bytes"));
}

/// A job that was stopped while it was held against what came out has all its frames, and is not done.
#[test]
fn a_check_that_was_interrupted_is_made_when_the_job_goes_on() {
    let job = Job::new();
    let line = format!("{LINE} --target psnr=34");
    assert!(job.done(&line).err.contains("came out: "));
    let (whole, frame) = (header(&job), job.read("o/f_02.png"));
    assert_eq!(whole["chosen"]["checked"][1], serde_json::json!({"first": 1, "last": 3}));
    assert!(!job.done(&line).err.contains("came out: "), "it was made already");
    // As the check leaves it that was stopped.
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    let (first, rows) = manifest.split_once('\n').expect("lines");
    let mut stopped: Value = serde_json::from_str(first).expect("JSON");
    stopped["chosen"]["checked"] = Value::Null;
    std::fs::write(job.path("o/f.manifest.jsonl"), format!("{stopped}\n{rows}")).expect("written");
    let ran = job.done(&line);
    assert!(ran.err.contains("as chosen before") && ran.err.contains("came out: "), "{}", ran.err);
    assert!(ran.out.contains("0 rendered, 3 kept"), "{}", ran.out);
    assert_eq!((header(&job), job.read("o/f_02.png")), (whole, frame));
}

#[test]
fn options_that_are_given_are_not_chosen_and_a_budget_is_told() {
    let job = Job::new();
    job.done(&format!("{LINE} --target psnr=30 --spp 5 --policy off"));
    let settings = &header(&job)["settings"];
    assert_eq!((&settings["spp"], &settings["reuse"]["policy"]), (&5.into(), &"off".into()));
    let begun = std::time::Instant::now();
    let said = job.done(&format!("{LINE} --budget 6s --overwrite")).err;
    assert!(said.contains("for 6 s: --spp ") && said.contains("%); in all "), "{said}");
    assert_eq!(header(&job)["chosen"]["wanted"], "6 s");
    // How near is for a quiet machine to show; this is that everything counts, and that it is used.
    let taken = begun.elapsed().as_secs_f64();
    assert!((1.0..25.0).contains(&taken), "{taken} s: {said}");
}

/// What was chosen for one frame takes longer for many: that is said, and what it came to.
#[test]
fn a_budget_that_more_frames_exceed_is_warned_of() {
    let job = Job::new();
    let line = format!("{LINE} --budget 2s");
    job.done(&line.replace("1..3", "1..1"));
    // As a slower machine leaves it.
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    let (first, rows) = manifest.split_once('\n').expect("lines");
    let mut slow: Value = serde_json::from_str(first).expect("JSON");
    slow["chosen"]["predicted"]["seconds"] = 100.into();
    std::fs::write(job.path("o/f.manifest.jsonl"), format!("{slow}\n{rows}")).expect("written");
    let ran = job.done(&line);
    assert!(ran.err.contains("as chosen before"), "{}", ran.err);
    assert!(ran.err.contains("warning: 2 frames are left and the job is predicted"), "{}", ran.err);
    assert!(ran.err.contains(", not 2 s; --overwrite"), "{}", ran.err);
    assert!(ran.err.contains("; in all "), "{}", ran.err);
    let ran = job.done(&line);
    assert!(!ran.err.contains("warning: "), "nothing is left: {}", ran.err);
}

/// More frames are rendered under the choice of the first, or all under a tighter one where these show
/// that it is not enough; the next run keeps them either way.
#[test]
fn a_job_that_gets_longer_keeps_its_choice_or_its_tighter_one() {
    let job = Job::new();
    let line = LINE.replace("1..3", "1..9");
    job.done(&format!("{} --target psnr=36", line.replace("1..9", "1..2")));
    let ran = job.done(&format!("{line} --target psnr=36"));
    assert!(ran.err.contains("as chosen before"), "{}", ran.err);
    let before = (header(&job), job.read("o/f_01.png"));
    let tightened = before.0["chosen"]["tightened"].as_u64() > Some(0);
    assert_eq!(tightened, ran.err.contains("rendered again, tightened"), "{}", ran.err);
    let ran = job.done(&format!("{line} --target psnr=36"));
    assert!(ran.out.contains("0 rendered, 9 kept"), "{}", ran.out);
    assert_eq!((header(&job), job.read("o/f_01.png")), before);
}

#[test]
fn figures_that_need_neighbours_are_targets_too() {
    let job = Job::new();
    let targets = [("ssim=0.9", "SSIM 0.9"), ("flip=10%", "FLIP 0.0"), ("max-share=30%", "share ")];
    for (target, figure) in targets {
        let said = job.done(&format!("{LINE} --target {target} --overwrite")).err;
        // Before and afterwards in the same unit. Of a choice that is tightened later, by what nothing was
        // tried of, the figure may not be predicted.
        let line = |begin: &str| said.lines().find(|line| line.starts_with(begin)).expect("said");
        assert!(line("predicted: ").starts_with(&format!("predicted: {figure}")), "{said}");
        let came = line("came out: ");
        assert!(came.starts_with(&format!("came out: {figure}")), "{said}");
        assert!(came.contains(&format!(" in the worst, predicted {figure}")), "{said}");
    }
}

#[test]
fn a_target_out_of_reach_is_refused_before_a_frame_is_rendered() {
    let job = Job::new();
    let said = |line: &str, words: &str| {
        job.refused(line, words);
        job.run(line).err
    };
    // Known without a look at the scene.
    let bits = said(&format!("{LINE} --target psnr=70"), "--png-bits 16");
    assert!(!bits.contains("probe:"), "{bits}");
    let samples = said(
        &format!("{LINE} --target psnr=50 --spp 1"),
        "is predicted to reach psnr=50 … --spp 1",
    );
    assert!(!samples.contains("bits") && samples.contains("give fewer options"), "{samples}");
    assert!(!job.path("o/f_01.png").exists());
}

#[test]
fn options_that_cannot_be_predicted_are_refused() {
    let job = Job::new();
    for target in ["psnr", "psnr=", "psnr=-1", "psnr=nan", "ssim=2", "max-share=200%", "flip=0"] {
        job.refused(&format!("{LINE} --target {target}"), "--target");
    }
    job.refused(&format!("{LINE} --target mse=1"), "psnr=45, ssim=0.99");
    job.refused(&format!("{LINE} --target psnr=45 --budget 1m"), "--target … --budget");
    job.refused(&format!("{LINE} --budget never"), "90s, 25m or 1h30m");
    job.refused(&format!("{LINE} --budget -3s"), "90s, 25m or 1h30m");
    job.refused(&format!("{LINE} --target max-share=5"), "max-share=5 … 5%");
    job.refused(&format!("{LINE} --budget 0s"), "budget … 1s");
    job.refused(&format!("{LINE} --target psnr=45 --crop 0,0,8,8"), "--crop");
    job.refused(&format!("{LINE} --target psnr=45 --policy colour"), "--policy colour");
}

/// A probe may take long: what would be refused after it is refused before.
#[test]
fn frames_of_other_settings_are_refused_before_the_probe() {
    let job = Job::new();
    job.done(&format!("{LINE} --target psnr=30"));
    let manifest = job.read("o/f.manifest.jsonl");
    for (options, why) in [
        ("--target psnr=31", "3 frames … psnr=30 … --overwrite"),
        ("--budget 2m", "psnr=30"),
        ("--target psnr=30 --seed 3", "psnr=30 … seed … 0 … 3"),
        ("--target psnr=30 --spp 9", "psnr=30 … options"),
    ] {
        let line = format!("{LINE} {options}");
        job.refused(&line, why);
        assert!(!job.run(&line).err.contains("probe:"), "{options}");
    }
    assert_eq!(job.read("o/f.manifest.jsonl"), manifest);
    // Frames without a manifest, and a folder that is none.
    std::fs::remove_file(job.path("o/f.manifest.jsonl")).expect("removed");
    for folder in ["o", "cube.obj"] {
        let ran = job
            .run(&format!("{} --target psnr=30", LINE.replace("-o o/", &format!("-o {folder}/"))));
        assert!(ran.code != Some(0) && !ran.err.contains("probe:"), "{}", ran.err);
    }
}

/// The last line says what came of a target, and says so again when nothing is left to do.
#[test]
fn a_target_ends_with_its_verdict() {
    let job = Job::new();
    let line = format!("{LINE} --target psnr=34");
    let last = |out: &str| out.lines().last().expect("a line").to_string();
    let verdict = last(&job.done(&line).out);
    let known = ["reached", "undecided: too close to the target for so few pixels", "missed"];
    assert!(known.iter().any(|word| verdict == format!("psnr=34: {word}")), "{verdict}");
    assert_eq!(last(&job.done(&line).out), verdict);
    // As a job leaves it that missed.
    let manifest = String::from_utf8(job.read("o/f.manifest.jsonl")).expect("UTF-8");
    let (first, rows) = manifest.split_once('\n').expect("lines");
    let mut missed: Value = serde_json::from_str(first).expect("JSON");
    missed["chosen"]["verdict"] = "Missed".into();
    std::fs::write(job.path("o/f.manifest.jsonl"), format!("{missed}\n{rows}")).expect("written");
    assert_eq!(last(&job.done(&line).out), "psnr=34: missed");
}

/// Between mirrors that face each other four bounces, which are the default, leave the picture dark in the
/// middle: no time makes that up.
#[test]
fn a_budget_pays_for_the_bounces_that_a_scene_needs() {
    let job = Job::new();
    let scene = "[camera]\nframes = 2\npan = { from = [0, 1, 1], to = [0.2, 1, 1], target = [0, 1, -2] }\n\
                 [[light]]\nquad = { centre = [0, 3.9, 0], normal = '-y', size = [1, 1], radiance = 12 }\n\
                 [material.mirror]\nmirror = 0.95\n\
                 [[mesh]]\nquad = { corner = [-5, 0, 3], edges = [[10, 0, 0], [0, 0, -6]] }\n\
                 [[mesh]]\nquad = { corner = [-3, 0, -2], edges = [[6, 0, 0], [0, 4, 0]] }\n\
                 material = 'mirror'\n\
                 [[mesh]]\nquad = { corner = [3, 0, 2], edges = [[-6, 0, 0], [0, 4, 0]] }\n\
                 material = 'mirror'\n";
    std::fs::write(job.path("mirrors.toml"), scene).expect("written");
    let line = LINE.replace("cube.obj", "mirrors.toml").replace("1..3", "1..2");
    let bounces = |options: &str| {
        job.done(&format!("{line} {options} --overwrite"));
        header(&job)["settings"]["bounces"].as_u64().expect("a number")
    };
    // Which budget is enough depends on what else the machine does.
    let budgets = ["--budget 4s", "--budget 15s", "--budget 60s"];
    assert!(budgets.iter().any(|budget| bounces(budget) > 4));
    assert!(bounces("--target psnr=35") > 8);
    assert_eq!(bounces("--budget 4s --bounces 3"), 3);
}

/// Another tree takes another time, and may give other last bits.
#[test]
fn a_choice_serves_only_the_tree_that_it_was_made_with() {
    let job = Job::new();
    let line = format!("{LINE} --target psnr=30");
    job.done(&line);
    for option in ["--build-quality high", "--compact on"] {
        let ran = job.run(&format!("{line} {option}"));
        // The frames that are there are of the first tree.
        assert_eq!(ran.code, Some(2), "{}", ran.err);
        assert!(says(&ran.err, "psnr=30"), "{}", ran.err);
        let name = option.trim_start_matches("--").split(' ').next().expect("a name");
        assert!(says(&ran.err, name), "{}", ran.err);
        for word in ["probe:", "as chosen before"] {
            assert!(!ran.err.contains(word), "{}", ran.err);
        }
    }
    assert!(job.done(&line).err.contains("as chosen before"));
}
