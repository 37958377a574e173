//! Jobs that are really run, and what they took.

use super::launcher;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tweenray::scene::limits::MAX_EXCHANGE;

/// A scene with as many frames as a job asks for, in a folder of its own, which goes with it.
pub struct Stage {
    folder: tempfile::TempDir,
    program: PathBuf,
    /// Scene file.
    text: String,
}

/// A job.
#[derive(Clone)]
pub struct Line {
    pub ranks: u32,
    /// Of each rank.
    pub threads: u32,
    /// Frames of the shot.
    pub frames: u32,
    /// Further words for `tweenray render`.
    pub words: String,
}

/// What a job took.
pub struct Ran {
    /// Seconds of a core of all processes, launcher and start included.
    pub cpu: f64,
    /// What `--stats` says.
    pub stats: Value,
}

impl Stage {
    /// That of the repository's scene `name`.
    pub fn of(name: &str) -> Self {
        let program = std::env::current_exe().unwrap();
        let program = program.parent().unwrap().with_file_name("tweenray");
        assert!(program.exists(), "{} is missing: build it with MPI first", program.display());
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        let text = std::fs::read_to_string(scene.join("scene.toml")).unwrap();
        Self { folder: tempfile::tempdir().unwrap(), program, text }
    }

    /// A hash of all frames of the last job.
    #[allow(dead_code, reason = "for benches/ranks.rs")]
    pub fn frames(&self) -> blake3::Hash {
        let entries = std::fs::read_dir(self.folder.path().join("out")).unwrap().flatten();
        let paths = entries.map(|entry| entry.path());
        let mut paths: Vec<PathBuf> =
            paths.filter(|p| p.extension() == Some("png".as_ref())).collect();
        paths.sort();
        let mut all = blake3::Hasher::new();
        paths.iter().for_each(|path| _ = all.update(&std::fs::read(path).unwrap()));
        all.finalize()
    }

    /// Runs the job; its frames are new.
    pub fn run(&self, line: &Line) -> Ran {
        _ = std::fs::remove_dir_all(self.folder.path().join("out"));
        self.run_on(line)
    }

    /// Seconds of a core that the job's start takes: the same job once more, with all frames there.
    pub fn start_of(&self, line: &Line) -> f64 {
        self.run_on(line).cpu
    }

    /// Goes on with the job.
    pub fn run_on(&self, line: &Line) -> Ran {
        let mut command = self.command(line);
        let before = children_seconds();
        let status = command.status().unwrap_or_else(|e| panic!("{command:?}: {e}"));
        assert!(status.success(), "{command:?}: {status}");
        let text = std::fs::read_to_string(self.folder.path().join("stats.json")).unwrap();
        Ran { cpu: children_seconds() - before, stats: serde_json::from_str(&text).unwrap() }
    }

    /// Runs the job until `frames` of its frames are there, and kills it; seconds of a core.
    #[allow(dead_code, reason = "for benches/ranks.rs")]
    pub fn kill_after(&self, line: &Line, frames: usize) -> f64 {
        let out = self.folder.path().join("out");
        _ = std::fs::remove_dir_all(&out);
        let before = children_seconds();
        let mut launched = self.command(line).spawn().unwrap();
        let count = || {
            let entries = std::fs::read_dir(&out).into_iter().flatten().flatten();
            entries.filter(|e| e.path().extension() == Some("png".as_ref())).count()
        };
        while count() < frames && launched.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        launched.kill().unwrap();
        launched.wait().unwrap();
        children_seconds() - before
    }

    /// Share of a core that a rank's main thread takes while another renders, all in all.
    pub fn comm_share(&self, line: &Line) -> f64 {
        _ = std::fs::remove_dir_all(self.folder.path().join("out"));
        let mut launched = self.command(line).spawn().unwrap();
        std::thread::sleep(Duration::from_secs(2));
        let (start, before) = (Instant::now(), self.main_thread_seconds());
        std::thread::sleep(Duration::from_secs(4));
        let (seconds, after) = (start.elapsed().as_secs_f64(), self.main_thread_seconds());
        assert!(launched.wait().unwrap().success());
        let took = after.iter().filter_map(|(pid, at)| Some(at - before.get(pid)?));
        let took: Vec<f64> = took.collect();
        took.iter().sum::<f64>() / seconds / took.len().max(1) as f64
    }

    /// Seconds of a core that the main threads of the running ranks had so far.
    fn main_thread_seconds(&self) -> BTreeMap<String, f64> {
        let processes = std::fs::read_dir("/proc").unwrap().flatten().map(|entry| entry.path());
        let is_rank = |path: &PathBuf| {
            let name = std::fs::read_to_string(path.join("comm")).unwrap_or_default();
            let at = std::fs::read_link(path.join("cwd"));
            name.trim() == "tweenray" && at.is_ok_and(|at| at == self.folder.path())
        };
        let seconds = |path: PathBuf| {
            // Of a process's folder this file is that of its main thread.
            let text = std::fs::read_to_string(path.join("schedstat")).ok()?;
            let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
            Some((path.display().to_string(), 1e-9 * nanoseconds))
        };
        processes.filter(is_rank).filter_map(seconds).collect()
    }

    fn command(&self, line: &Line) -> Command {
        let folder = self.folder.path();
        let frames = |text: &str| match text.starts_with("frames = ") {
            true => format!("frames = {}\n", line.frames),
            false => format!("{text}\n"),
        };
        let text: String = self.text.lines().map(frames).collect();
        std::fs::write(folder.join("scene.toml"), text).unwrap();
        let mut command = match line.ranks {
            1 => Command::new(&self.program),
            ranks => self.launcher(ranks),
        };
        command.args(["render", "scene.toml", "-o", "out/f_####.png", "--no-video", "-q"]);
        command.args(["--threads", &line.threads.to_string(), "--stats", "stats.json"]);
        if !line.words.contains("--exchange") {
            // What a frame left in one message, so that messages are counted as the model does.
            command.args(["--exchange", &MAX_EXCHANGE.to_string()]);
        }
        command.args(line.words.split_whitespace());
        command.current_dir(folder).stdout(Stdio::null());
        command
    }

    fn launcher(&self, ranks: u32) -> Command {
        let mut command = launcher::mpirun();
        command.args(["--bind-to", "none", "-n", &ranks.to_string()]).arg(&self.program);
        command
    }
}

impl Ran {
    /// Wall seconds from the first frame to the last.
    pub fn wall(&self) -> f64 {
        self.stats["render_seconds"].as_f64().unwrap()
    }

    /// Wall seconds with start and end.
    pub fn total(&self) -> f64 {
        self.stats["total_seconds"].as_f64().unwrap()
    }

    /// Seconds that it took to make references ready and put them on disk.
    pub fn checkpoint_seconds(&self) -> f64 {
        let ranks = self.stats["ranks"].as_array().unwrap();
        ranks.iter().map(|rank| rank["checkpoint_seconds"].as_f64().unwrap()).sum()
    }

    /// Messages and bytes of a kind, of all ranks.
    pub fn sent(&self, kind: &str) -> (u64, u64) {
        let ranks = self.stats["ranks"].as_array().unwrap();
        let of = |what: &str| ranks.iter().map(|r| r["sent"][kind][what].as_u64().unwrap()).sum();
        (of("messages"), of("bytes"))
    }

    /// Mean bytes of a message of a kind; 0 where none was sent.
    pub fn size(&self, kind: &str) -> u64 {
        let (messages, bytes) = self.sent(kind);
        bytes / messages.max(1)
    }

    /// Share of their surface points that frames had to trace, of those that could infer some.
    pub fn traced_share(&self) -> f64 {
        let frames = self.stats["frames"].as_array().unwrap();
        // Nothing is told where no light is worth a lookup.
        let count = |f: &Value, what: &str| f["reuse"][what].as_f64().unwrap_or(0.0);
        let points = |f: &Value| [count(f, "direct"), count(f, "specular")].iter().sum::<f64>();
        let known = |f: &Value| {
            [count(f, "direct_inferred"), count(f, "specular_inferred")].iter().sum::<f64>()
        };
        let between: Vec<&Value> = frames.iter().filter(|f| known(f) > 0.0).collect();
        let sum = |of: &dyn Fn(&Value) -> f64| between.iter().map(|f| of(f)).sum::<f64>();
        1.0 - sum(&known) / sum(&points).max(1.0)
    }

    /// Wall seconds of each frame, by number: to make it, and to write it.
    pub fn frames(&self) -> Vec<(f64, f64)> {
        let frames = self.stats["frames"].as_array().unwrap();
        let seconds = |f: &Value, what: &str| f[what].as_f64().unwrap();
        frames.iter().map(|f| (seconds(f, "trace_seconds"), seconds(f, "write_seconds"))).collect()
    }
}

/// Seconds of a core that this process's ended children took, and theirs.
fn children_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The name, which may hold spaces, ends with a bracket; ticks are hundredths on every Linux.
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    fields[13..15].iter().map(|ticks| ticks.parse::<f64>().unwrap() / 100.0).sum()
}
