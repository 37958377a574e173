//! Simulations of small jobs.

use super::*;

fn job(segment: u32, frames: u32) -> Job {
    Job { pyramid: Pyramid { segment, frames }, most_strips: 16, sends_to_all: false }
}

fn with(seconds: &dyn Fn(u32) -> f64) -> CostModel<'_> {
    CostModel {
        seconds,
        write_seconds: 0.01,
        pack_seconds: 0.01,
        unpack_seconds: 0.005,
        reference_bytes: 1_000_000,
        between_share: 1.0,
        strips_bytes: 2_000_000,
        message_bytes: 400,
        latency: 1e-5,
        bandwidth: 1e9,
        poll_interval: 1e-3,
        message_seconds: 1e-5,
        comm_share: 0.0,
        scheduler: SchedulerCost::Seconds(1e-5),
        cores: None,
    }
}

/// Core seconds by frame: 1 for a key frame, a quarter for another.
fn frame_seconds(job: &Job) -> impl Fn(u32) -> f64 + use<> {
    let pyramid = job.pyramid;
    move |frame| if pyramid.is_key(frame) { 1.0 } else { 0.25 }
}

fn efficiency(job: &Job, ranks: u32, model: &CostModel) -> f64 {
    job.single_rank_seconds(model) / (job.simulate(ranks, model).seconds * f64::from(ranks))
}

#[test]
fn one_rank_takes_the_sum_of_its_frames() {
    let job = job(16, 65);
    let seconds = frame_seconds(&job);
    let model = with(&seconds);
    let run = job.simulate(1, &model);
    assert_eq!(run.frames, 65);
    assert!((job.single_rank_seconds(&model) - (5.0 + 60.0 * 0.25)).abs() < 1e-9);
    assert!((run.busy_seconds - job.single_rank_seconds(&model)).abs() < 1e-9);
    // Rank 0's communication thread adds at most a poll interval per frame.
    assert!((run.seconds - job.single_rank_seconds(&model)).abs() < 65.0 * 1e-3);
    assert_eq!(run.sent, Traffic::default());
}

#[test]
fn the_same_job_takes_the_same_time_again() {
    for sends_to_all in [false, true] {
        let job = Job { sends_to_all, ..job(16, 400) };
        let seconds = frame_seconds(&job);
        let model = with(&seconds);
        assert_eq!(job.simulate(24, &model), job.simulate(24, &model));
    }
}

#[test]
fn efficiency_falls_with_latency_and_with_less_bandwidth() {
    let job = job(16, 16 * 32 + 1);
    let seconds = frame_seconds(&job);
    let at = |latency, bandwidth| {
        efficiency(&job, 32, &CostModel { latency, bandwidth, ..with(&seconds) })
    };
    let falls = [at(1e-5, 1e9), at(0.1, 1e9), at(1.0, 1e9)];
    assert!(falls[0] > 0.8 && falls.is_sorted_by(|a, b| a > b), "{falls:?}");
    assert!(falls[2] < 0.6, "{falls:?}");
    assert!(at(1e-5, 1e6) < falls[0] - 0.02, "{falls:?}");
}

#[test]
fn sending_discoveries_to_all_costs_more_with_more_ranks() {
    // Frames per rank are constant, so only the bytes that each rank receives grow.
    let simulate = |ranks, sends_to_all| {
        let job = Job { sends_to_all, ..job(16, 16 * 2 * ranks + 1) };
        let seconds = frame_seconds(&job);
        let model = CostModel { bandwidth: 2e7, ..with(&seconds) };
        let run = job.simulate(ranks, &model);
        assert_eq!(run.frames, u64::from(16 * 2 * ranks + 1));
        (efficiency(&job, ranks, &model), run.sent.discoveries.bytes / u64::from(ranks))
    };
    let (few, many) = (simulate(4, true), simulate(32, true));
    assert!(many.0 < 0.7 * few.0 && many.1 > 6 * few.1, "{few:?} {many:?}");
    let (few, many) = (simulate(4, false), simulate(32, false));
    assert!(many.0 > 0.9 * few.0 && few.1 == 0, "{few:?} {many:?}");
}

#[test]
fn ranks_that_share_cores_get_no_more_than_these() {
    let job = job(16, 257);
    let seconds = frame_seconds(&job);
    let model = CostModel { cores: Some(2.0), ..with(&seconds) };
    let (two, eight) = (job.simulate(2, &model), job.simulate(8, &model));
    for run in [&two, &eight] {
        assert!(run.seconds >= run.busy_seconds / 2.0 - 1e-9);
        assert!(run.seconds < 1.1 * run.busy_seconds / 2.0);
    }
    let on_own_cores = job.simulate(8, &with(&seconds));
    assert!(on_own_cores.seconds < 0.4 * eight.seconds);
}

#[test]
fn communication_threads_that_take_a_tenth_leave_nine_tenths() {
    let job = job(16, 257);
    let seconds = frame_seconds(&job);
    let seconds_with = |ranks, comm_share| {
        job.simulate(ranks, &CostModel { comm_share, ..with(&seconds) }).seconds
    };
    let ratio = seconds_with(4, 0.1) / seconds_with(4, 0.0);
    assert!((ratio - 1.0 / 0.9).abs() < 0.03, "{ratio}");
    assert!((seconds_with(1, 0.1) - seconds_with(1, 0.0)).abs() < 1e-9);
}

#[test]
fn a_rank_without_a_segment_renders_strips() {
    let job = job(64, 65);
    let seconds = frame_seconds(&job);
    let model = with(&seconds);
    let (one, four) = (job.simulate(1, &model), job.simulate(4, &model));
    assert_eq!((one.frames, four.frames), (65, 65));
    assert!(four.sent.strips.messages > 0);
    assert!(four.seconds < one.seconds / 3.0, "{} {}", one.seconds, four.seconds);
}
