//! A folder with a small scene, and the program run in it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

#[path = "../common/says.rs"]
mod says;
pub use says::says;

/// A temporary folder in which the program runs.
pub struct Job(tempfile::TempDir);

/// How a run ended and what it said.
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// A cube, and nothing that a default shot lacks.
const CUBE: &str = "\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

impl Job {
    pub fn new() -> Self {
        let job = Self(tempfile::tempdir().expect("a folder"));
        fs::write(job.path("cube.obj"), CUBE).expect("written");
        job
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program with `line`, split at blanks.
    pub fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tweenray"));
        command.args(line.split_whitespace()).current_dir(self.0.path());
        // These tests may themselves run under a launcher.
        for name in [
            "OMPI_COMM_WORLD_SIZE",
            "PMI_SIZE",
            "SLURM_STEP_NUM_TASKS",
            "PMIX_RANK",
            "SLURM_MPI_TYPE",
            "OMPI_COMM_WORLD_RANK",
            "PMI_RANK",
            "SLURM_PROCID",
        ] {
            command.env_remove(name);
        }
        command
    }

    pub fn run(&self, line: &str) -> Ran {
        Ran::of(&self.command(line).output().expect("the program starts"))
    }

    /// Runs and insists on exit code 0.
    pub fn done(&self, line: &str) -> Ran {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(0), "{line}\n{}", ran.err);
        ran
    }

    /// Runs and insists on exit code 2 and on an error that [`says`] these words.
    pub fn refused(&self, line: &str, words: &str) {
        let ran = self.run(line);
        assert_eq!(ran.code, Some(2), "{line}\n{}", ran.err);
        let error = ran.err.split_once("error: ").map_or("", |(_, error)| error);
        assert!(says(error, words), "{line}: not {words}\n{}", ran.err);
        assert!(!ran.err.contains("panic"), "{}", ran.err);
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn changed(&self, name: &str) -> SystemTime {
        fs::metadata(self.path(name)).and_then(|m| m.modified()).expect("a file")
    }

    /// Names in a folder, hidden ones included.
    pub fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).expect("a folder");
        let names = entries.map(|e| e.expect("an entry").file_name().into_string().expect("UTF-8"));
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }
}

/// Lines of `text` that [`says`] finds the words in.
pub fn lines_that_say(text: &str, words: &str) -> usize {
    text.lines().filter(|line| says(line, words)).count()
}

impl Ran {
    pub fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Self { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }
}
