//! Jobs that are stopped, politely or not, and go on.

use super::job::{Job, Ran, lines_that_say, says};
use std::fs;
use std::io::{BufRead, BufReader};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Frames of some tenths of a second each.
const SLOW: &str = "render cube.obj --size 192x108 --spp 32 --shadow-samples 1 \
    --sky-samples 1 --frames 1..4 --no-video";

/// Starts the job and waits for its first finished frame.
fn after_first_frame(job: &Job, out: &str) -> (Child, BufReader<std::process::ChildStderr>) {
    let (out, more) = out.split_once(' ').unwrap_or((out, ""));
    let line = format!("{SLOW} -o {out}/f_##.png {more}");
    let mut child = job.command(&line).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut first = String::new();
    err.read_line(&mut first).expect("a line");
    assert!(first.starts_with("frame 1 of 4"), "{first}");
    (child, err)
}

fn send(signal: &str, child: &Child) {
    let line = format!("kill -{signal} {}", child.id());
    assert!(Command::new("sh").args(["-c", &line]).status().expect("a shell").success());
}

/// Waits until the program listens for SIGTERM.
fn wait_for_handler(child: &Child) {
    let listens = || {
        let text = fs::read_to_string(format!("/proc/{}/status", child.id())).expect("a process");
        let mask = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).expect("a mask");
        u64::from_str_radix(mask.trim(), 16).expect("a number") & (1 << (15 - 1)) != 0
    };
    while !listens() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn rest(mut err: BufReader<std::process::ChildStderr>) -> String {
    let mut text = String::new();
    std::io::Read::read_to_string(&mut err, &mut text).expect("text");
    text
}

fn assert_same_frames(job: &Job, a: &str, b: &str) {
    for n in 1..=4 {
        let name = format!("f_0{n}.png");
        assert_eq!(job.read(&format!("{a}/{name}")), job.read(&format!("{b}/{name}")), "{name}");
    }
}

/// Nothing is there yet that the same command could go on from, and what it was to replace is as it was.
#[test]
fn a_signal_while_the_scene_is_read_says_to_give_the_same_command_again() {
    let job = Job::new();
    let text = "mesh = [{ terrain = { vertices = 1500, size = 12 } }]\n";
    fs::write(job.path("large.toml"), text).expect("written");
    let line = "render large.toml --threads 1 --no-video --overwrite -o o/f_##.png";
    // On a busy machine the scene may be read before the signal comes.
    let mut told = (0..10).map(|_| {
        let child = job.command(line).stderr(Stdio::piped()).spawn().expect("it starts");
        wait_for_handler(&child);
        send("TERM", &child);
        let ran = Ran::of(&child.wait_with_output().expect("it ends"));
        assert_eq!(ran.code, Some(75), "{}", ran.err);
        ran.err
    });
    let early = |err: &String| says(err, "SIGTERM … before the first frame … same command");
    assert!(told.any(|err| err.lines().count() == 1 && early(&err)));
}

/// All frames are there, and the same command would replace them.
#[test]
fn a_signal_while_the_video_is_made_says_to_leave_overwrite_out() {
    let job = Job::new();
    fs::create_dir(job.path("bin")).expect("made");
    let slow = job.path("bin/ffmpeg");
    let script = "#!/bin/sh\n[ \"$1\" = -version ] || { echo $$ > pid; sleep 60; }\n";
    fs::write(&slow, script).expect("written");
    fs::set_permissions(&slow, fs::Permissions::from_mode(0o755)).expect("runs");
    let path = format!("{}:{}", job.path("bin").display(), env!("PATH"));
    let line = "render cube.obj --size 48x27 --spp 1 --frames 1..3 -o o/f_##.png";
    let mut command = job.command(&format!("{line} --overwrite"));
    let child = command.env("PATH", path).stderr(Stdio::piped()).stdout(Stdio::null()).spawn();
    let child = child.expect("it starts");
    let written = || fs::read_to_string(job.path("pid")).ok().filter(|pid| pid.ends_with('\n'));
    let start = Instant::now();
    let pid = loop {
        match written() {
            Some(pid) => break pid,
            None => assert!(start.elapsed() < Duration::from_secs(60), "no video is begun"),
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    send("TERM", &child);
    let ran = Ran::of(&child.wait_with_output().expect("it ends"));
    assert_eq!(ran.code, Some(75), "{}", ran.err);
    let stopped = "SIGTERM … 3 of 3 frames … same command without --overwrite";
    assert!(says(&ran.err, stopped), "{}", ran.err);
    // Nobody goes on writing, and nothing half done is left.
    assert!(!Path::new("/proc").join(pid.trim()).exists(), "ffmpeg runs on");
    assert!(!job.names("o").iter().any(|name| name.contains(".mp4")), "{:?}", job.names("o"));
    assert!(job.done(&format!("{line} --no-video")).out.contains("0 rendered, 3 kept"));
}

/// However many frames were still to be replaced, one line tells of them.
#[test]
fn a_job_that_was_stopped_while_it_replaced_frames_goes_on_with_one_line() {
    let job = Job::new();
    job.done(&format!("{} -o o/f_##.png", SLOW.replace("--spp 32", "--spp 1")));
    let (child, err) = after_first_frame(&job, "o --overwrite");
    send("TERM", &child);
    let words = rest(err);
    assert!(says(&words, "same command without --overwrite"), "{words}");
    let ran = job.done(&format!("{SLOW} -o o/f_##.png"));
    let notes =
        ["note: ", "note: … not in the manifest"].map(|words| lines_that_say(&ran.err, words));
    assert_eq!(notes, [1, 1], "{}", ran.err);
    assert!(!ran.out.contains(" 0 kept"), "{}", ran.out);
    job.done(&format!("{SLOW} -o whole/f_##.png"));
    assert_same_frames(&job, "o", "whole");
}

/// All frames are there then; the same command would replace them.
#[test]
fn a_signal_while_frames_are_checked_says_how_to_go_on_without_replacing_them() {
    let job = Job::new();
    let line = "render cube.obj --size 48x32 --frames 1..3 --no-video -o o/f_##.png --spp 1024 \
        --shadow-samples 1 --sky-samples 1 --policy off --target psnr=20";
    let overwrite = format!("{line} --overwrite");
    let mut child = job.command(&overwrite).stderr(Stdio::piped()).spawn().expect("it starts");
    let mut err = BufReader::new(child.stderr.take().expect("a pipe"));
    let mut said = String::new();
    while !said.contains("frame 3 of 3") {
        assert!(err.read_line(&mut said).expect("a line") > 0, "{said}");
    }
    // The last frame's line comes shortly before the check begins.
    std::thread::sleep(Duration::from_millis(100));
    send("INT", &child);
    let code = child.wait().expect("it ends").code();
    let words = rest(err);
    assert_eq!(code, Some(75), "{words}");
    let stopped = "SIGINT … 3 of 3 frames … same command without --overwrite";
    assert!(says(&words, stopped) && !words.contains("error:"), "{words}");
    let ran = job.done(line);
    assert!(
        ran.out.contains("0 rendered, 3 kept") && ran.err.contains("came out: "),
        "{}",
        ran.err
    );
}

#[test]
fn a_signal_stops_within_a_second_and_the_same_command_goes_on() {
    let job = Job::new();
    for signal in ["INT", "TERM", "USR1"] {
        let (mut child, err) = after_first_frame(&job, signal);
        let asked = Instant::now();
        send(signal, &child);
        if signal == "USR1" {
            // A batch system may repeat its warning.
            send(signal, &child);
        }
        let code = child.wait().expect("it ends").code();
        assert!(asked.elapsed() < Duration::from_secs(1), "{:?}", asked.elapsed());
        let words = rest(err);
        assert_eq!(code, Some(75), "{words}");
        assert!(says(&words, &format!("SIG{signal} … of 4 frames")), "{words}");
        assert!(job.names(signal).iter().all(|name| !name.contains(".tmp")), "no torn file");
        let ran = job.done(&format!("{SLOW} -o {signal}/f_##.png"));
        assert!(!ran.out.contains(" 0 kept"), "{}", ran.out);
    }
    job.done(&format!("{SLOW} -o whole/f_##.png"));
    assert_same_frames(&job, "INT", "whole");
    assert_same_frames(&job, "TERM", "whole");
    assert_same_frames(&job, "USR1", "whole");
}

#[test]
fn a_kill_loses_the_frame_in_flight_at_most() {
    let job = Job::new();
    let (mut child, _err) = after_first_frame(&job, "k");
    send("KILL", &child);
    child.wait().expect("it ends");
    let ran: Ran = job.done(&format!("{SLOW} -o k/f_##.png"));
    assert!(!ran.out.contains(" 0 kept"), "{}", ran.out);
    job.done(&format!("{SLOW} -o whole/f_##.png"));
    assert_same_frames(&job, "k", "whole");
}

/// A scene file sets both; an option stands over it.
#[test]
fn a_scene_file_sets_time_limit_and_checkpoint() {
    let job = Job::new();
    let text = "[settings]\nspp = 4096\nvideo = false\ntime_limit = '1s'\ncheckpoint = 'off'\n\
                [[mesh]]\nfile = 'cube.obj'\n[sky]\nradiance = 1\n";
    std::fs::write(job.path("scene.toml"), text).expect("written");
    for (option, limit) in [("", "time limit … 1.0 s"), ("--time-limit 2s", "time limit … 2.0 s")]
    {
        let ran = job.run(&format!("render scene.toml -o o/f_##.png {option}"));
        assert!(ran.code == Some(75) && says(&ran.err, limit), "{}", ran.err);
    }
}

/// Runs a job of minutes under `limit` with `variables`; it must stop by itself.
fn stops_in_time(limit: &str, variables: &[(&str, String)], reason: &str) {
    let job = Job::new();
    let line = format!("render cube.obj --spp 4096 --no-video -o o/f_##.png {limit}");
    let start = Instant::now();
    let output = job.command(&line).envs(variables.iter().cloned()).output().expect("it starts");
    let ran = Ran::of(&output);
    assert!(start.elapsed() < Duration::from_secs(11), "{:?}", start.elapsed());
    assert_eq!(ran.code, Some(75), "{}", ran.err);
    assert!(says(&ran.err, &format!("{reason} … same command")), "{}", ran.err);
}

#[test]
fn a_job_ends_by_its_time_limit_and_before_its_allocation() {
    stops_in_time("--time-limit 1s", &[], "time limit … 1.0 s … 0 of 48 frames");
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).expect("a clock");
    let end = ("SLURM_JOB_END_TIME", (now.as_secs() + 33).to_string());
    stops_in_time("--time-limit 1h", &[end], "Slurm");
    let job = Job::new();
    for (limit, words) in
        [("25x", "25x … hours:minutes:seconds"), ("0:75", "75 in 0:75"), ("0", "--time-limit … 0")]
    {
        job.refused(&format!("render cube.obj --time-limit {limit}"), words);
    }
}
