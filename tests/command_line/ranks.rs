//! Several processes: refused without MPI, and the same bytes with it.

use super::job::{Job, Ran, says};

const LINE: &str = "render cube.obj --size 48x27 --spp 1 --frames 1..5 --no-video";

/// Runs `line` as process `rank` of two.
fn as_rank(job: &Job, line: &str, rank: &str) -> Ran {
    let variables = [("OMPI_COMM_WORLD_SIZE", "2"), ("OMPI_COMM_WORLD_RANK", rank)];
    Ran::of(&job.command(line).envs(variables).output().expect("it starts"))
}

/// All have the same words, and one tells what is wrong with them.
#[test]
fn a_mistyped_option_is_reported_by_one_rank() {
    let job = Job::new();
    let line = "render cube.obj --thread 3";
    let (first, second) = (as_rank(&job, line, "0"), as_rank(&job, line, "1"));
    assert_eq!((first.code, second.code), (Some(2), Some(2)));
    assert!(says(&first.err, "error: … '--thread'"), "{}", first.err);
    assert_eq!((&*second.out, &*second.err), ("", ""));
    let help = ["0", "1"].map(|rank| as_rank(&job, "render --help", rank));
    assert_eq!(help.each_ref().map(|ran| ran.code), [Some(0); 2]);
    assert_eq!(help.map(|ran| ran.out.is_empty()), [false, true]);
}

/// Each process would do the whole of it, in the same files.
#[test]
fn commands_for_one_process_are_refused_under_a_launcher() {
    let job = Job::new();
    job.done(&format!("{LINE} -o o/f_##.png"));
    for line in ["accuracy cube.obj -o a", "report o -o page.html", "convert cube.obj cube.ply"] {
        let (first, second) = (as_rank(&job, line, "0"), as_rank(&job, line, "1"));
        assert_eq!((first.code, second.code), (Some(2), Some(2)), "{line}");
        assert!(says(&first.err, "error: mpirun … 2 processes"), "{line}: {}", first.err);
        assert_eq!(second.err, "", "{line}");
    }
    assert_eq!(job.names("."), ["cube.obj", "o"], "nothing is written");
    let mut lonely = job.command("convert cube.obj cube.ply");
    assert!(lonely.env("OMPI_COMM_WORLD_SIZE", "1").status().expect("it starts").success());
}

/// A launcher without MPI would have every rank render everything.
#[cfg(not(feature = "mpi"))]
#[test]
fn a_launcher_without_mpi_is_refused() {
    let job = Job::new();
    let mut command = job.command(LINE);
    let output = command.env("OMPI_COMM_WORLD_SIZE", "4").output().expect("it starts");
    let ran = Ran::of(&output);
    assert_eq!(ran.code, Some(2));
    assert!(says(&ran.err, "4 processes"), "{}", ran.err);
    let alone = job.command(LINE).env("OMPI_COMM_WORLD_SIZE", "1").output().expect("it starts");
    assert!(alone.status.success());
}

#[cfg(feature = "mpi")]
mod with_mpi {
    use super::super::job::lines_that_say;
    use super::super::launch::{mpirun, under_mpirun};
    use super::*;
    use std::fs;
    use std::time::{Duration, Instant};

    #[test]
    fn ranks_share_the_frames_and_the_bytes_are_the_same() {
        let job = Job::new();
        job.done(&format!("{LINE} -o solo/f_##.png"));
        for ranks in [2, 3] {
            let line = format!("{LINE} -o r{ranks}/f_##.png --stats s.json");
            let Some(ran) = under_mpirun(&job, ranks, &line) else { return };
            assert_eq!(ran.code, Some(0), "{}", ran.err);
            assert_eq!(ran.out.matches("5 frames in").count(), 1, "{}", ran.out);
            assert!(ran.err.contains("frame 5 of 5"), "{}", ran.err);
            let mut names: Vec<String> = (1..=5).map(|n| format!("f_0{n}.png")).collect();
            for name in &names {
                let ours = job.read(&format!("r{ranks}/{name}"));
                assert!(ours == job.read(&format!("solo/{name}")), "{ranks} ranks, {name}");
            }
            names.insert(0, "f.manifest.jsonl".into());
            assert_eq!(job.names(&format!("r{ranks}")), names);
            let stats: serde_json::Value =
                serde_json::from_slice(&job.read("s.json")).expect("valid JSON");
            assert_eq!(stats["ranks"].as_array().map(Vec::len), Some(ranks as usize));
            assert!(job.done(&line).out.contains("5 kept"));
        }
    }

    /// Whoever makes a frame makes the references that it is inferred from.
    #[test]
    fn inferred_frames_are_the_same_on_any_number_of_ranks() {
        let job = Job::new();
        let line = "render cube.obj --size 48x27 --spp 1 --shadow-samples 64 --sky-samples 64 \
                    --frames 2..19 --segment 4 --no-video";
        job.done(&format!("{line} -o solo/f_##.png"));
        for ranks in [2, 3] {
            let line = format!("{line} -o r{ranks}/f_##.png --stats s.json");
            let Some(ran) = under_mpirun(&job, ranks, &line) else { return };
            assert_eq!(ran.code, Some(0), "{}", ran.err);
            for frame in 2..=19 {
                let name = format!("f_{frame:02}.png");
                let ours = job.read(&format!("r{ranks}/{name}"));
                assert!(ours == job.read(&format!("solo/{name}")), "{ranks} ranks, {name}");
            }
            let stats: serde_json::Value =
                serde_json::from_slice(&job.read("s.json")).expect("valid JSON");
            assert!(stats["reuse"]["direct_inferred"].as_u64() > Some(0));
            let frames = stats["frames"].as_array().expect("frames");
            let by = |rank: u32| frames.iter().filter(|f| f["rank"] == rank).count();
            assert!((0..ranks).all(|rank| by(rank) > 0), "{ran:?}", ran = ran.err);
        }
    }

    /// Each rank reads a part of what is there; what is found is what one process finds.
    #[test]
    fn ranks_share_the_search_for_damaged_and_missing_frames() {
        let job = Job::new();
        let line = format!("{LINE} --maps -o o/f_##.png");
        job.done(&line);
        let whole: Vec<Vec<u8>> = (1..=5).map(|n| job.read(&format!("o/f_0{n}.png"))).collect();
        let map = job.names("o").into_iter().find(|name| name.contains("04_")).expect("a map");
        for ranks in [2, 3, 8] {
            fs::write(job.path("o/f_02.png"), "no picture").expect("written");
            fs::remove_file(job.path(format!("o/{map}"))).expect("removed");
            fs::remove_file(job.path("o/f_05.png")).expect("removed");
            let Some(ran) = under_mpirun(&job, ranks, &line) else { return };
            assert_eq!(ran.code, Some(0), "{}", ran.err);
            assert!(ran.out.contains("3 rendered, 2 kept"), "{}", ran.out);
            assert_eq!(lines_that_say(&ran.err, "f_02.png … damaged"), 1, "{}", ran.err);
            assert_eq!(lines_that_say(&ran.err, "f_04.png … maps"), 1, "{}", ran.err);
            let same = |n: usize| job.read(&format!("o/f_0{n}.png")) == whole[n - 1];
            assert!((1..=5).all(same), "{ranks} ranks");
        }
        let Some(ran) = under_mpirun(&job, 3, &format!("{line} --seed 5")) else { return };
        assert_eq!(lines_that_say(&ran.err, "seed … 0 … 5"), 1, "{}", ran.err);
        assert_eq!(ran.code, Some(2));
    }

    /// Rank 0 alone looks at the scene; all render what it chose, and one process goes on with it.
    #[test]
    fn ranks_render_what_one_of_them_chose() {
        let job = Job::new();
        let line = format!("{} --target psnr=36 -o r/f_##.png", LINE.replace(" --spp 1", ""));
        let Some(ran) = under_mpirun(&job, 2, &line) else { return };
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert_eq!(ran.err.matches("the probe took").count(), 1, "{}", ran.err);
        let before = job.read("r/f_03.png");
        fs::remove_file(job.path("r/f_03.png")).expect("removed");
        let ran = job.done(&line);
        assert!(ran.out.contains("1 rendered, 4 kept"), "{}", ran.out);
        assert_eq!(job.read("r/f_03.png"), before);
    }

    /// What may fit a time is tried by all ranks at once.
    #[test]
    fn ranks_keep_a_budget_together() {
        let job = Job::new();
        let line = format!("{} --budget 5s", LINE.replace(" --spp 1", ""));
        let Some(ran) = under_mpirun(&job, 2, &format!("{line} -o r/f_##.png")) else { return };
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert_eq!(ran.err.matches("for 5 s: --spp ").count(), 1, "{}", ran.err);
        assert_eq!(ran.err.matches("; in all ").count(), 1, "{}", ran.err);
        let (before, after) = ran.err.split_once("for 5 s: ").expect("a choice");
        let options = after.lines().next().expect("options");
        assert!(before.contains("probe: times"), "{}", ran.err);
        job.done(&format!("{} {options} -o solo/f_##.png", LINE.replace(" --spp 1", "")));
        assert!(job.read("r/f_03.png") == job.read("solo/f_03.png"), "{options}");
    }

    /// Ranks on unlike machines use what all have, and say so.
    #[test]
    fn unlike_machines_share_an_instruction_set() {
        let job = Job::new();
        job.done(&format!("{LINE} --isa sse4.2 -o solo/f_##.png"));
        let alone = job.command(&format!("{LINE} -o mixed/f_##.png"));
        let mut command = mpirun(&job);
        // (Several programs for one mpirun, with ":" between them, crash the one of Open MPI 5.)
        let unlike = "case $OMPI_COMM_WORLD_RANK in 0) isa=avx2 ;; *) isa=sse4.2 ;; esac; \
                      TWEENRAY_MAX_ISA=$isa exec \"$@\"";
        command.args(["-n", "2", "sh", "-c", unlike, "sh"]);
        command.arg(alone.get_program()).args(alone.get_args());
        let Ok(output) = command.output() else { return };
        let ran = Ran::of(&output);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        assert!(ran.err.contains("they share: sse4.2"), "{}", ran.err);
        for frame in 1..=5 {
            let name = format!("f_0{frame}.png");
            assert!(job.read(&format!("mixed/{name}")) == job.read(&format!("solo/{name}")));
        }
    }

    /// Hard case 21 over ranks: which of many faces in one place is seen must not depend on who
    /// renders the frame.
    #[test]
    fn coincident_faces_look_the_same_on_every_rank() {
        let job = Job::new();
        for (name, order) in [("red", ["red", "blue"]), ("blue", ["blue", "red"])] {
            let mut scene = String::from(
                "[settings]\nsize = [48, 32]\nspp = 1\n[camera]\nframes = 4\n\
                 [material.red]\ndiffuse = [0.8, 0.1, 0.1]\n\
                 [material.blue]\ndiffuse = [0.1, 0.1, 0.8]\n\
                 [[light]]\ndirectional = { to_light = [1, 2, 3], irradiance = 3 }\n",
            );
            for copy in 0..40 {
                let material = order[copy % 2];
                scene += &format!("[[mesh]]\nfile = \"cube.obj\"\nmaterial = \"{material}\"\n");
            }
            fs::write(job.path(format!("{name}.toml")), scene).expect("written");
            job.done(&format!("render {name}.toml --no-video --threads 1 -o {name}1/f_##.png"));
            for ranks in [2, 4] {
                let line = format!("render {name}.toml --no-video -o {name}{ranks}/f_##.png");
                let Some(ran) = under_mpirun(&job, ranks, &line) else { return };
                assert_eq!(ran.code, Some(0), "{}", ran.err);
                for frame in 1..=4 {
                    let ours = job.read(&format!("{name}{ranks}/f_0{frame}.png"));
                    let alone = job.read(&format!("{name}1/f_0{frame}.png"));
                    assert!(ours == alone, "{name} first, {ranks} ranks, frame {frame}");
                }
            }
        }
        let differ = job.read("red1/f_01.png") != job.read("blue1/f_01.png");
        assert!(differ, "the first of them is not the one that is seen");
    }

    /// Ranks that the launcher bound to no cores, or several to the same ones, share these.
    #[test]
    fn ranks_share_the_cores_that_they_have_in_common() {
        let job = Job::new();
        let alone = job.command(&format!("{LINE} --stats s.json -o o/f_##.png"));
        let mut command = mpirun(&job);
        command.args(["--bind-to", "none", "-n", "2"]);
        command.arg(alone.get_program()).args(alone.get_args());
        let Ok(output) = command.output() else { return };
        let ran = Ran::of(&output);
        assert_eq!(ran.code, Some(0), "{}", ran.err);
        let stats: serde_json::Value =
            serde_json::from_slice(&job.read("s.json")).expect("valid JSON");
        let cores = std::thread::available_parallelism().expect("cores").get();
        let threads = |rank: usize| stats["ranks"][rank]["threads"].as_u64();
        assert_eq!([threads(0), threads(1)], [Some((cores as u64 / 2).max(1)); 2]);
    }

    #[test]
    fn a_failing_rank_ends_the_job_with_its_error() {
        let job = Job::new();
        // A folder stands in the place of a frame.
        fs::create_dir_all(job.path("o/f_05.png")).expect("made");
        let start = Instant::now();
        let line = format!("{LINE} --policy off -o o/f_##.png --overwrite");
        let Some(ran) = under_mpirun(&job, 2, &line) else { return };
        assert_eq!((ran.code, ran.err.matches("o/f_05.png").count()), (Some(1), 1), "{}", ran.err);
        assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
        let Some(ran) = under_mpirun(&job, 2, "render none.obj") else { return };
        assert_eq!(ran.err.matches("error: none.obj").count(), 1, "{}", ran.err);
        assert_eq!(ran.code, Some(2));
    }
}
