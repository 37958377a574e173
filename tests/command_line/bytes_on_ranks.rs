//! Ranks that make one sequence together: the same bytes, whoever makes what; and how a job ends when
//! one of them does.

use super::job::{Job, Ran, lines_that_say, says};
use super::launch::{launched, under_mpirun};
use super::reuse::hopeless;
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The scene of the repository with its large meshes made small.
pub fn small(job: &Job, name: &str) -> String {
    let path = format!("{}/scenes/{name}/scene.toml", env!("CARGO_MANIFEST_DIR"));
    let mut text = fs::read_to_string(path).expect("a scene");
    for (large, little) in [
        ("vertices = 708", "vertices = 40"),
        ("vertices = 801", "vertices = 40"),
        ("meridians = 200, bands = 201", "meridians = 16, bands = 17"),
    ] {
        text = text.replace(large, little);
    }
    let file = format!("{name}.toml");
    fs::write(job.path(&file), text).expect("written");
    file
}

fn stats(job: &Job, file: &str) -> Value {
    serde_json::from_slice(&job.read(file)).expect("valid JSON")
}

/// Of all ranks, a count of what they sent.
fn sent(stats: &Value, kind: &str, what: &str) -> u64 {
    let ranks = stats["ranks"].as_array().expect("ranks").iter();
    ranks.map(|rank| rank["sent"][kind][what].as_u64().expect("a count")).sum()
}

/// Renders `line` alone and on each number of ranks with so many threads each; insists on the same
/// bytes, and gives the last job's statistics, or nothing where there is no mpirun.
fn same_bytes(job: &Job, line: &str, ending: &str, ranks: &[(u32, u32)]) -> Option<Value> {
    job.done(&format!("{line} --threads 2 -o solo/f_##.{ending}"));
    let mut last = None;
    for (ranks, threads) in ranks {
        let out = format!("r{ranks}");
        let line = format!("{line} --threads {threads} -o {out}/f_##.{ending} --stats s.json");
        let ran = under_mpirun(job, *ranks, &line)?;
        assert_eq!(ran.code, Some(0), "{line}, {ranks} ranks: {}", ran.err);
        let names = job.names("solo").into_iter().filter(|name| name.ends_with(ending));
        for name in names {
            let same = job.read(&format!("solo/{name}")) == job.read(&format!("{out}/{name}"));
            assert!(same, "{line}, {ranks} ranks: {name}");
        }
        fs::remove_dir_all(job.path(&out)).expect("removed");
        last = Some(stats(job, "s.json"));
    }
    fs::remove_dir_all(job.path("solo")).expect("removed");
    last
}

#[test]
fn the_bytes_are_the_same_on_1_to_16_ranks_with_references_sent_about() {
    let job = Job::new();
    for (name, spp) in
        [("spheres_on_terrain", "2"), ("reflective_spheres", "2..7"), ("demo", "1..6")]
    {
        let scene = small(&job, name);
        // Frames 1 and 16 are made, and not written.
        let line = format!(
            "render {scene} --size 64x48 --spp {spp} --shadow-samples 64 --frames 2..15 --segment 8 \
             --probes 0.02 --no-video --quiet"
        );
        let ranks = [(1, 2), (2, 2), (3, 1), (4, 1), (8, 1), (16, 1)];
        let Some(stats) = same_bytes(&job, &line, "png", &ranks) else { return };
        assert!(stats["reuse"]["direct_inferred"].as_u64() > Some(0), "{name}");
        assert!(stats["audit"].is_object(), "{name}");
        for kind in ["references", "strips", "notes"] {
            assert!(sent(&stats, kind, "messages") > 0, "{name}: {kind}");
        }
    }
}

#[test]
fn frames_that_are_given_up_are_the_same_on_1_to_8_ranks() {
    let job = Job::new();
    let scene = hopeless(&job);
    let line = format!("render {scene} --frames 2..16 --aovs reference --quiet");
    same_bytes(&job, &line, "exr", &[(1, 2), (2, 1), (3, 1), (8, 1)]);
    // Frames 3 and 7 are references that nobody wants to see.
    let adaptive = "--spp 1..4 --shadow-samples 2..16";
    for options in ["", adaptive] {
        let line = format!("render {scene} --frames 6..6 {options} --quiet");
        same_bytes(&job, &line, "png", &[(2, 1), (3, 1), (8, 1)]);
    }
}

#[test]
fn exr_files_crops_and_other_policies_give_the_same_bytes_on_any_number_of_ranks() {
    let job = Job::new();
    let scene = small(&job, "demo");
    let line = format!("render {scene} --size 64x48 --segment 8 --no-video --quiet");
    for (more, ending) in [
        ("--spp 1 --frames 3..12 --aovs all", "exr"),
        ("--spp 4..16 --frames 3..12 --aovs all", "exr"),
        ("--spp 1 --frames 5..9 --crop 10,9,50,40 --aovs all", "exr"),
        ("--spp 2..9 --shadow-samples 2..16 --frames 5..9 --crop 10,9,50,40", "png"),
        ("--spp 1 --frames 1..9 --tolerance 0.5", "png"),
        ("--spp 1 --frames 1..5 --policy off", "png"),
        ("--spp 1..8 --frames 1..5 --policy off", "png"),
        ("--spp 1 --frames 1..24 --policy colour", "png"),
    ] {
        let line = format!("{line} {more}");
        let Some(stats) = same_bytes(&job, &line, ending, &[(3, 2), (7, 1)]) else { return };
        let discoveries = sent(&stats, "discoveries", "messages");
        // Each frame's but the leaves', to six others: the paper's exchange.
        assert_eq!(discoveries > 0, more.contains("colour"), "{more}");
        assert_eq!(discoveries % 6, 0, "{more}");
    }
}

/// However few discoveries a message carries, by word or by scene file: more of them, and the same bytes.
#[test]
fn the_size_of_messages_changes_no_byte() {
    let job = Job::new();
    let scene = small(&job, "reflective_spheres");
    let text = fs::read_to_string(job.path(&scene)).expect("a scene");
    let own = text.replace("[settings]", "[settings]\nexchange = 300");
    assert_ne!(own, text);
    fs::write(job.path("own.toml"), own).expect("written");
    for (policy, kind) in [("surface", "references"), ("colour", "discoveries")] {
        let line = |scene: &str, more: &str| {
            format!(
                "render {scene} --size 64x48 --spp 1 --shadow-samples 64 --frames 1..9 --segment 4 \
                 --policy {policy} --no-video --quiet {more}"
            )
        };
        let mut sizes = Vec::new();
        for line in [line(&scene, ""), line(&scene, "--exchange 100"), line("own.toml", "")] {
            let Some(stats) = same_bytes(&job, &line, "png", &[(3, 1)]) else { return };
            let (messages, bytes) = (sent(&stats, kind, "messages"), sent(&stats, kind, "bytes"));
            assert!(messages > 0, "{line}");
            sizes.push(bytes / messages);
        }
        // 3,072 pixels and more in one, in messages of 100 and of 300.
        assert!(sizes[1] < sizes[2] && 2 * sizes[2] < sizes[0], "{policy}: {sizes:?}");
    }
    job.refused(&format!("render {scene} --exchange 0"), "--exchange");
}

#[test]
fn a_still_camera_under_a_rank_map_gives_the_same_bytes() {
    let job = Job::new();
    let scene = small(&job, "reflective_spheres");
    let text = fs::read_to_string(job.path(&scene)).expect("a scene");
    let pan = text.lines().find(|line| line.starts_with("pan")).expect("a pan");
    let still = "still = { eye = [5, 3, 10], target = [0.5, 0, -0.5] }";
    fs::write(job.path("still.toml"), text.replace(pan, still)).expect("written");
    fs::write(job.path("map"), "0 near\n1 far\n2 near # beside 0\n").expect("written");
    let line = "render still.toml --size 48x27 --no-video --quiet --rank-map map";
    if same_bytes(&job, line, "png", &[(3, 1)]).is_none() {
        return;
    }
    let Some(ran) = under_mpirun(&job, 2, &format!("{line} -o o/f_##.png")) else { return };
    assert!(says(&ran.err, "line 3 … 2 … 2"), "{}", ran.err);
    assert_eq!(ran.code, Some(2));
}

/// Statistics add up: every rank's time is work or waiting, and the balance is theirs.
#[test]
fn statistics_cover_all_ranks() {
    let job = Job::new();
    let scene = small(&job, "reflective_spheres");
    let line = format!("render {scene} --size 64x48 --no-video -o o/f_##.png --stats s.json");
    let Some(ran) = under_mpirun(&job, 3, &line) else { return };
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    let stats = stats(&job, "s.json");
    let number = |value: &Value| value.as_f64().expect("a number");
    let ranks = stats["ranks"].as_array().expect("ranks");
    let busy: Vec<f64> = ranks.iter().map(|rank| number(&rank["busy_seconds"])).collect();
    for rank in ranks {
        let spent = number(&rank["busy_seconds"]) + number(&rank["waiting_seconds"]);
        assert!(spent > 0.0 && spent <= number(&rank["render_seconds"]) + 0.05, "{rank}");
    }
    let (sum, most) = (busy.iter().sum::<f64>(), busy.iter().copied().fold(0.0, f64::max));
    assert!((number(&stats["busy_seconds"]) - sum).abs() < 1e-9);
    assert!((number(&stats["balance"]) - sum / 3.0 / most).abs() < 1e-9);
}

/// Frames of some tenths of a second each.
const SLOW: &str = "render cube.obj --size 192x108 --spp 96 --shadow-samples 1 --sky-samples 1 \
    --frames 1..8 --policy off --no-video";

/// Sends `signal` to rank 1 once the first frame is finished.
fn with_a_signal_to_rank_1(job: &Job, signal: &str) -> Option<Ran> {
    let line = format!("{SLOW} -o {signal}/f_##.png");
    let piped = launched(job, 3, &line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut child = piped.ok()?;
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut words = String::new();
    while !words.contains("frame 1 of 8") {
        assert!(err.read_line(&mut words).expect("a line") > 0, "{words}");
    }
    let kill = format!("kill -{signal} $(cat pid.1)");
    let shell = Command::new("sh").args(["-c", &kill]).current_dir(job.path(".")).status();
    assert!(shell.expect("a shell").success());
    let asked = Instant::now();
    err.read_to_string(&mut words).expect("text");
    let code = child.wait().expect("it ends").code();
    assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
    Some(Ran { code, out: String::new(), err: words })
}

/// Whatever kills a rank ends the job, and what was finished stays finished.
#[test]
fn a_killed_rank_ends_the_job_and_the_same_command_goes_on() {
    let job = Job::new();
    job.done(&format!("{SLOW} -o whole/f_##.png"));
    for signal in ["KILL", "ABRT", "TERM"] {
        let Some(ran) = with_a_signal_to_rank_1(&job, signal) else { return };
        assert!(ran.code != Some(0), "{signal}: {}", ran.err);
        if signal == "TERM" {
            assert_eq!(ran.code, Some(75), "{}", ran.err);
            assert_eq!(lines_that_say(&ran.err, "of 8 frames … same command"), 1, "{}", ran.err);
        }
        let line = format!("{SLOW} -o {signal}/f_##.png");
        let Some(ran) = under_mpirun(&job, 2, &line) else { return };
        assert!(ran.code == Some(0) && !ran.out.contains(" 0 kept"), "{}", ran.out);
        for frame in 1..=8 {
            let name = format!("f_0{frame}.png");
            let same = job.read(&format!("{signal}/{name}")) == job.read(&format!("whole/{name}"));
            assert!(same, "{signal}: {name}");
        }
    }
}

/// What a rank sends for a frame does not grow with the number of ranks, from 2 to 64 of them, but for rank
/// 0, which sends every order: of 64 ranks it sends the most. What rank 0 makes nobody is told of, since it
/// keeps the table, and at one end of the path there is no neighbour: so of all ranks one has nothing to
/// send, which is half of two and little of many. What the others send for a frame is the same within a
/// fifth where all ranks get the same of the cores, and so are the messages for each of them; where some
/// are quicker, work changes hands, and few ranks send up to a third more.
/// Minutes, so only by name:
/// `cargo test --release --features mpi --test command_line -- --ignored --nocapture bytes_sent`
#[test]
#[ignore = "64 ranks: minutes"]
fn bytes_sent_for_a_frame_do_not_grow_with_the_ranks() {
    let job = Job::new();
    let scene = small(&job, "reflective_spheres");
    let text = fs::read_to_string(job.path(&scene)).expect("a scene");
    println!("       bytes a rank and frame                                   messages");
    println!(
        "ranks    all  references  strips  notes  but for one  most     all  a rank but for one"
    );
    let mut rows = Vec::new();
    for ranks in [2, 4, 8, 16, 32, 64] {
        // Each rank gets four segments.
        let count = 64 * ranks + 1;
        let longer = text.replace("frames = 16", &format!("frames = {count}"));
        fs::write(job.path("long.toml"), longer).expect("written");
        let line = "render long.toml --size 64x48 --segment 16 --threads 1 --no-video --quiet \
                    --shadow-samples 16 --policy surface -o o/f_####.png --overwrite --stats s.json";
        let Some(ran) = under_mpirun(&job, ranks, line) else { return };
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let stats = stats(&job, "s.json");
        let kinds = ["references", "strips", "notes"];
        let bytes = kinds.map(|kind| sent(&stats, kind, "bytes") as f64 / f64::from(count));
        let messages: u64 = kinds.iter().map(|kind| sent(&stats, kind, "messages")).sum();
        let own = |rank: &Value| -> f64 {
            kinds.iter().filter_map(|kind| rank["sent"][kind]["bytes"].as_f64()).sum()
        };
        let each = stats["ranks"].as_array().expect("ranks").iter();
        let most = each.map(own).fold(0.0, f64::max) / 64.0;
        let all: f64 = bytes.iter().sum();
        let others = f64::from(ranks - 1);
        let a_rank = messages as f64 / others;
        let but_one = all * f64::from(ranks) / others;
        println!(
            "{ranks:5}  {all:5.0}  {:10.0}  {:6.0}  {:5.0}  {but_one:11.0}  {most:4.0}  {messages:6}  \
             {a_rank:6.1}",
            bytes[0], bytes[1], bytes[2]
        );
        rows.push((but_one, a_rank));
        fs::remove_dir_all(job.path("o")).expect("removed");
    }
    let spread = |of: fn(&(f64, f64)) -> f64| {
        let most = rows.iter().map(of).fold(0.0, f64::max);
        most / rows.iter().map(of).fold(f64::INFINITY, f64::min)
    };
    println!(
        "most over least: bytes {:.2}, messages a rank {:.2}",
        spread(|r| r.0),
        spread(|r| r.1)
    );
    assert!(spread(|r| r.0) < 1.35 && spread(|r| r.1) < 1.2, "{rows:?}");
}
