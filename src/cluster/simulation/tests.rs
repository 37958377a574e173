//! Small jobs, played.

use super::*;

/// A key frame a second, another a quarter.
fn job(segment: u32, frames: u32) -> Job {
    Job { pyramid: Pyramid { segment, frames }, most_strips: 16, tells_all: false }
}

fn with(seconds: &dyn Fn(u32) -> f64) -> Model<'_> {
    Model {
        seconds,
        write_seconds: 0.01,
        pack_seconds: 0.01,
        unpack_seconds: 0.005,
        reference_bytes: 1_000_000,
        between_share: 1.0,
        strips_bytes: 2_000_000,
        note_bytes: 400,
        latency: 1e-5,
        bandwidth: 1e9,
        nap: 1e-3,
        note_seconds: 1e-5,
        clerk_share: 0.0,
        table: Table::Seconds(1e-5),
        cores: None,
    }
}

fn of(job: &Job) -> impl Fn(u32) -> f64 + use<> {
    let pyramid = job.pyramid;
    move |frame| if pyramid.is_key(frame) { 1.0 } else { 0.25 }
}

fn efficiency(job: &Job, ranks: u32, model: &Model) -> f64 {
    job.alone(model) / (job.play(ranks, model).seconds * f64::from(ranks))
}

#[test]
fn one_rank_takes_the_sum_of_its_frames() {
    let job = job(16, 65);
    let seconds = of(&job);
    let model = with(&seconds);
    let played = job.play(1, &model);
    assert_eq!(played.frames, 65);
    assert!((job.alone(&model) - (5.0 + 60.0 * 0.25)).abs() < 1e-9);
    assert!((played.busy_seconds - job.alone(&model)).abs() < 1e-9);
    // What rank 0's clerk takes is all that is added.
    assert!((played.seconds - job.alone(&model)).abs() < 65.0 * 1e-3);
    assert_eq!(played.sent, Traffic::default());
}

#[test]
fn the_same_job_takes_the_same_time_again() {
    for tells_all in [false, true] {
        let job = Job { tells_all, ..job(16, 400) };
        let seconds = of(&job);
        let model = with(&seconds);
        assert_eq!(job.play(24, &model), job.play(24, &model));
    }
}

#[test]
fn efficiency_falls_with_latency_and_with_less_bandwidth() {
    let job = job(16, 16 * 32 + 1);
    let seconds = of(&job);
    let at =
        |latency, bandwidth| efficiency(&job, 32, &Model { latency, bandwidth, ..with(&seconds) });
    let falls = [at(1e-5, 1e9), at(0.1, 1e9), at(1.0, 1e9)];
    assert!(falls[0] > 0.8 && falls.is_sorted_by(|a, b| a > b), "{falls:?}");
    assert!(falls[2] < 0.6, "{falls:?}");
    assert!(at(1e-5, 1e6) < falls[0] - 0.02, "{falls:?}");
}

#[test]
fn telling_all_costs_more_the_more_ranks_there_are() {
    // As many frames a rank, so all that grows is what each rank hears of the others.
    let play = |ranks, tells_all| {
        let job = Job { tells_all, ..job(16, 16 * 2 * ranks + 1) };
        let seconds = of(&job);
        let model = Model { bandwidth: 2e7, ..with(&seconds) };
        let played = job.play(ranks, &model);
        assert_eq!(played.frames, u64::from(16 * 2 * ranks + 1));
        (efficiency(&job, ranks, &model), played.sent.discoveries.bytes / u64::from(ranks))
    };
    let (few, many) = (play(4, true), play(32, true));
    assert!(many.0 < 0.7 * few.0 && many.1 > 6 * few.1, "{few:?} {many:?}");
    let (few, many) = (play(4, false), play(32, false));
    assert!(many.0 > 0.9 * few.0 && few.1 == 0, "{few:?} {many:?}");
}

#[test]
fn ranks_that_share_cores_get_no_more_than_these() {
    let job = job(16, 257);
    let seconds = of(&job);
    let model = Model { cores: Some(2.0), ..with(&seconds) };
    let (two, eight) = (job.play(2, &model), job.play(8, &model));
    for played in [&two, &eight] {
        assert!(played.seconds >= played.busy_seconds / 2.0 - 1e-9);
        assert!(played.seconds < 1.1 * played.busy_seconds / 2.0);
    }
    let apart = job.play(8, &with(&seconds));
    assert!(apart.seconds < 0.4 * eight.seconds);
}

#[test]
fn clerks_that_take_a_tenth_leave_nine() {
    let job = job(16, 257);
    let seconds = of(&job);
    let seconds_with =
        |ranks, clerk_share| job.play(ranks, &Model { clerk_share, ..with(&seconds) }).seconds;
    let ratio = seconds_with(4, 0.1) / seconds_with(4, 0.0);
    assert!((ratio - 1.0 / 0.9).abs() < 0.03, "{ratio}");
    assert!((seconds_with(1, 0.1) - seconds_with(1, 0.0)).abs() < 1e-9);
}

#[test]
fn who_has_no_segment_helps() {
    let job = job(64, 65);
    let seconds = of(&job);
    let model = with(&seconds);
    let (one, four) = (job.play(1, &model), job.play(4, &model));
    assert_eq!((one.frames, four.frames), (65, 65));
    assert!(four.sent.strips.messages > 0);
    assert!(four.seconds < one.seconds / 3.0, "{} {}", one.seconds, four.seconds);
}
