//! A disk that is full in the middle of a job.

use super::job::Job;
use std::process::Command;

/// Runs the program with a disk of its own at `disk` that has room for a few frames, then once more
/// with more room. What was there after the first run lies in `before`.
const SCRIPT: &str = "
mkdir disk before after && mount -t tmpfs -o size=1m none disk || exit 99
head -c 1000000 /dev/zero > disk/ballast
\"$@\"; first=$?
find disk -name 'f_*' -type f -exec cp {} before \\;
rm disk/ballast
\"$@\" && cp disk/f_* after
echo \"ended with $first and $?\"
";

const LINE: &str = "render cube.obj --size 96x54 --spp 2 --segment 8 --frames 1..12 --no-video \
    --checkpoint 0s";

/// What was finished is whole and stays, what was not is not there, and once there is room the same
/// command goes on.
#[test]
fn a_full_disk_ends_the_job_and_finished_frames_stay() {
    for (ending, more) in
        [("png", ""), ("png", "--maps"), ("exr", "--spp 1 --size 48x27 --aovs all")]
    {
        let job = Job::new();
        let line = match ending {
            "exr" => LINE.replace("--size 96x54 --spp 2", more),
            _ => format!("{LINE} {more}"),
        };
        job.done(&format!("{line} -o whole/f_##.{ending}"));
        let alone = job.command(&format!("{line} -o disk/f_##.{ending}"));
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", SCRIPT, "sh"]);
        command.arg(alone.get_program()).args(alone.get_args()).current_dir(job.path("."));
        let output = command.output();
        let Some(output) = output.ok().filter(|o| o.status.success()) else {
            eprintln!("skipped: no file system can be mounted here");
            return;
        };
        let (out, err) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(out.contains("ended with 1 and 0"), "{line}: {out}\n{err}");
        assert!(err.contains("No space left"), "{err}");
        for folder in ["before", "after"] {
            let is_frame = |name: &String| name.ends_with(ending);
            for name in job.names(folder).into_iter().filter(is_frame) {
                let same =
                    job.read(&format!("{folder}/{name}")) == job.read(&format!("whole/{name}"));
                assert!(same, "{line}: {folder}/{name}");
            }
        }
        let frames = |folder: &str| {
            let names = job.names(folder).into_iter();
            names.filter(|name| name.starts_with("f_")).collect::<Vec<_>>()
        };
        assert_eq!(frames("after"), frames("whole"));
        assert!(frames("before").len() < frames("whole").len());
    }
}
