//! The text of a batch script; reads and writes no files.

use crate::scene::FrameRange;
use std::borrow::Cow;

/// Everything that a script contains.
pub struct Script<'a> {
    pub program: &'a str,
    pub folder: &'a str,
    /// The command line that made the script.
    pub words: &'a [String],
    pub scene: &'a str,
    /// Options of `tweenray render`.
    pub render: &'a [String],
    /// Pattern of the frames' paths.
    pub pattern: &'a str,
    /// Frames to render; `None` for all.
    pub frames: Option<FrameRange>,
    /// Folder of the references on disk.
    pub references: &'a str,
    pub nodes: u32,
    pub tasks_per_node: u32,
    /// Cores of each process; `None` for whole nodes.
    pub cpus: Option<u32>,
    pub minutes: u64,
    /// Seconds between the signal to stop and the limit.
    pub notice: u64,
    pub sbatch: &'a [String],
    pub setup: &'a [String],
}

/// The script's body, after its variables are set. A run that ends early for any reason is followed by another as
/// long as it made progress: at least one frame or reference more, so the job ends at last. A run that was stopped
/// before it made progress is followed by only one more.
const BODY: &str = r#"
# What is there of the sequence; succeeds once that is all of it.
so_far() { "$tweenray" "${status[@]}" 2>&1; }
kept() { ls "$references" 2>/dev/null; }
# There while the run before this one had too little time to get any further.
idle=.tweenray-$SLURM_JOB_ID.idle

echo "== $(date '+%F %T') job $SLURM_JOB_ID on $SLURM_JOB_NODELIST, run $((${SLURM_RESTART_COUNT:-0} + 1))"
before=$(so_far)/$(kept)
for pause in 5 30 0; do
  srun --mpi=pmix --export=ALL --kill-on-bad-exit=1 "${srun[@]}" "$tweenray" "${render[@]}"
  code=$?
  now=$(so_far)
  is_all=$?
  echo "$now"
  # Where it was stopped or killed with all frames there, the video is left, or a look at what came out.
  if [ "$is_all" = 0 ]; then
    case $code in 0 | 1 | 2) rmdir "$idle" 2>/dev/null; exit "$code" ;; esac
  fi
  if [ "$now/$(kept)" != "$before" ]; then
    rmdir "$idle" 2>/dev/null
    scontrol requeue "$SLURM_JOB_ID" || exit $((code ? code : 1))
    echo "requeued after exit code $code"
    exit 75
  fi
  # Processes that could not be started may be so a little later: nodes clear up after the run before.
  case $code in 0 | 2 | 75) break ;; esac
  sleep "$pause"
done
# It may have had but little time: a start that failed took it, or the signal came a minute early.
if [ "$code" = 75 ] && mkdir "$idle" 2>/dev/null; then
  scontrol requeue "$SLURM_JOB_ID" || exit "$code"
  echo "this run got no further for want of time: requeued once more"
  exit 75
fi
rmdir "$idle" 2>/dev/null
echo "this run got no further and ended with exit code $code: not requeued" >&2
exit $((code ? code : 1))
"#;

impl Script<'_> {
    /// The script.
    pub fn text(&self) -> String {
        let mut text = self.head();
        for option in self.options() {
            text += &format!("#SBATCH --{option}\n");
        }
        text += "\n";
        for line in self.setup {
            text += &format!("{line}\n");
        }
        text += &format!("cd {} || exit 1\n", quoted(self.folder));
        text += &format!("tweenray={}\n", quoted(self.program));
        text += &array("render", &self.render_words());
        text += &array("status", &self.status_words());
        text += &array("srun", &self.srun_words());
        text += &format!("references={}\n", quoted(self.references));
        text + BODY
    }

    fn head(&self) -> String {
        let words: Vec<Cow<str>> = self.words.iter().map(|word| quoted(word)).collect();
        let (nodes, scene) = (crate::error::counted(self.nodes as usize, "node"), self.scene);
        format!(
            "#!/bin/bash\n\
             # Renders {scene} on {nodes}, {} min at a time, until every frame is there.\n\
             # Made by tweenray {} with: {}\n\
             # Send it with sbatch. Sent again after a failure it goes on where it was.\n",
            self.minutes,
            crate::output::VERSION,
            words.join(" ")
        )
    }

    fn options(&self) -> Vec<String> {
        let name = self.name();
        let mut options = vec![
            format!("job-name={name}"),
            format!("nodes={}", self.nodes),
            format!("ntasks-per-node={}", self.tasks_per_node),
            match self.cpus {
                Some(cpus) => format!("cpus-per-task={cpus}"),
                None => "exclusive".into(),
            },
            format!("time={}", self.minutes),
            // To the processes alone: the script waits for them.
            format!("signal=USR1@{}", self.notice),
            "requeue".into(),
            "open-mode=append".into(),
            format!("output={name}-%j.log"),
            "export=NONE".into(),
        ];
        // Of an option that is given twice sbatch takes the last.
        options.extend(self.sbatch.iter().map(|o| o.trim_start_matches('-').to_string()));
        options
    }

    /// The scene's name, without characters that file names or Slurm's patterns do not allow.
    fn name(&self) -> String {
        let stem = std::path::Path::new(self.scene).file_stem().unwrap_or_default();
        let fits = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '_' };
        stem.to_string_lossy().chars().map(fits).collect()
    }

    fn render_words(&self) -> Vec<String> {
        let mut words = vec!["render".to_string(), self.scene.to_string()];
        words.extend(self.render.iter().cloned());
        words
    }

    fn status_words(&self) -> Vec<String> {
        let mut words = vec!["status".to_string(), self.pattern.to_string()];
        if let Some(FrameRange { first, last }) = self.frames {
            words.extend(["--frames".into(), format!("{first}..{last}")]);
        }
        words
    }

    /// Options of srun: it inherits neither the number of cores per process nor `--exclusive`.
    fn srun_words(&self) -> Vec<String> {
        match self.cpus {
            Some(cpus) => vec![format!("--cpus-per-task={cpus}")],
            None => vec!["--cpu-bind=none".into()],
        }
    }
}

fn array(name: &str, words: &[String]) -> String {
    let words: Vec<Cow<str>> = words.iter().map(|word| quoted(word)).collect();
    format!("{name}=({})\n", words.join(" "))
}

/// A word quoted for the shell.
fn quoted(word: &str) -> Cow<'_, str> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    match !word.is_empty() && word.chars().all(plain) {
        true => Cow::Borrowed(word),
        false => Cow::Owned(format!("'{}'", word.replace('\'', r"'\''"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn script<'a>(scene: &'a str, render: &'a [String]) -> Script<'a> {
        Script {
            program: "/opt/tween ray/tweenray",
            folder: "/home/me",
            words: &[],
            scene,
            render,
            pattern: "out/f_####.png",
            frames: Some(FrameRange { first: 3, last: 9 }),
            references: "out/.f.references",
            nodes: 4,
            tasks_per_node: 1,
            cpus: None,
            minutes: 30,
            notice: 60,
            sbatch: &[],
            setup: &[],
        }
    }

    #[test]
    fn words_come_through_a_shell_as_they_are() {
        let words = ["a'b c", "$(rm x)", "", "f_####.png", "`x`", "é"];
        let render: Vec<String> = words.iter().map(ToString::to_string).collect();
        let text = script("my scene.toml", &render).text();
        let line = text.lines().find(|line| line.starts_with("render=")).expect("the words");
        let print = format!("{line}\nprintf '%s\\n' \"${{render[@]}}\"");
        let output = std::process::Command::new("bash").args(["-c", &print]).output();
        let out = String::from_utf8(output.expect("a shell").stdout).expect("text");
        let expected = format!("render\nmy scene.toml\n{}\n", words.join("\n"));
        assert_eq!(out, expected);
    }

    #[test]
    fn the_users_own_options_come_last() {
        let own = ["--time=5".to_string(), "account=physics".into()];
        let text = Script { sbatch: &own, cpus: Some(8), ..script("a%b c.toml", &[]) }.text();
        let options: Vec<&str> =
            text.lines().filter_map(|line| line.strip_prefix("#SBATCH --")).collect();
        assert_eq!(options[0], "job-name=a_b_c");
        assert!(options.contains(&"cpus-per-task=8") && !options.contains(&"exclusive"));
        assert_eq!(options[options.len() - 2..], ["time=5", "account=physics"]);
        assert!(text.contains("srun=(--cpus-per-task=8)"), "{text}");
        assert!(text.contains("status=(status 'out/f_####.png' --frames 3..9)"), "{text}");
    }
}
