//! A sentence per knob.

use super::change::Change;
use super::knobs::{Group, Knob};
use super::oracle::OracleCrop;
use super::row::CandidateRow;
use super::table::Measured;
use super::writing::Writing;
use crate::measure::{Interval, Median};
use crate::page::words::{bytes, change, count, percent, seconds, short};

/// What turning `knob` does, one sentence for each of its settings; empty where it was not turned.
pub fn about_knob(measured: &Measured, knob: Knob) -> Vec<String> {
    let rows = measured.rows.iter().filter(|row| row.knob == knob);
    rows.map(|row| sentence(measured.default_row(), row)).collect()
}

fn sentence(default: &CandidateRow, row: &CandidateRow) -> String {
    let changed = || row.change.map_or(String::new(), |c| pixels(&c));
    let what = match row.knob.group() {
        Some(Group::Intersection) => changed(),
        Some(Group::Tree) => format!("{}; {}", changed(), tree(default, row)),
        _ => error(default, row),
    };
    let samples = row.camera_samples.map_or(String::new(), |mean| {
        format!("; {} camera samples a pixel in the mean", short(mean))
    });
    format!("{}: {}, {what}{samples}.", row.name(), time(row))
}

/// What its tree takes.
fn tree(default: &CandidateRow, row: &CandidateRow) -> String {
    let [was, is] = [default, row].map(|r| seconds(r.build_seconds.median.interval.estimate));
    let memory = [default, row].map(|r| bytes(r.memory_bytes));
    format!("built in {is} instead of {was}, {} instead of {} of memory", memory[1], memory[0])
}

fn time(row: &CandidateRow) -> String {
    let Some(wall) = row.time_ratio else { return "not timed".into() };
    let told = |ratio: &Median| {
        let [is, low, high] =
            [ratio.interval.estimate, ratio.interval.low, ratio.interval.high].map(change);
        (is, format!("({low} to {high})"))
    };
    let (is, ends) = told(&wall);
    if !wall.has_interval() {
        return format!("too few turns to tell the time ({is})");
    }
    if !wall.is_sure() {
        return format!("too few turns to tell the time {ends}");
    }
    if wall.differs_from(1.0) {
        return format!("{is} time {ends}");
    }
    match row.cpu_ratio.filter(|cpu| cpu.differs_from(1.0)) {
        // Waiting for a core is no work.
        Some(cpu) => {
            let (is, cpu_ends) = told(&cpu);
            format!("no more than noise in time {ends}, but {is} CPU time {cpu_ends}")
        }
        None => format!("no more than noise in time {ends}"),
    }
}

fn error(default: &CandidateRow, row: &CandidateRow) -> String {
    if row.change.is_some_and(|c| c.differing == 0) {
        return "the same pixels".into();
    }
    let [was, is] = [default, row].map(|r| short(r.errors.rmse_steps));
    if was == is {
        return format!("the same error to three digits ({is}/255)");
    }
    match row.error_ratio {
        Some(ratio) if !ratio.is_sure() => {
            format!("too few turns to tell the error ({is}/255 against {was})")
        }
        Some(ratio) if ratio.differs_from(1.0) => {
            format!("error {is}/255 instead of {was} ({})", change(ratio.interval.estimate))
        }
        _ => format!("no more than noise in error ({is}/255 against {was})"),
    }
}

/// How many pixels another rule changes.
fn pixels(c: &Change) -> String {
    if c.differing == 0 {
        return format!("the same {} pixels", count(c.pixels));
    }
    format!(
        "{} of {} pixels differ by more than 2/255, the furthest by {}",
        count(c.over_2),
        count(c.pixels),
        short(c.largest)
    )
}

/// What `writing` takes where a frame takes `making` to make, seconds.
pub fn about_writing(writing: &Writing, making: Interval) -> Vec<String> {
    let (w, frame_seconds) = (writing, making.estimate);
    let sync = match w.sync_ends {
        [low, _] if low <= 0.0 => "the sync is no more than noise in that".into(),
        _ if w.sync_seconds >= 0.95 * w.frame_seconds => "about all of it for the sync".to_string(),
        [low, high] => {
            let [is, low, high] = [w.sync_seconds, low, high].map(seconds);
            format!("{is} of it for the sync ({low} to {high})")
        }
    };
    let [low, high] = w.frame_ends;
    let [least, most] = [low / making.high, high / making.low].map(|share| change(1.0 + share));
    let mut all = vec![format!(
        "A frame as png ({}): {} to encode, write and sync ({} to {}), {sync}. {} time ({least} to {most}). \
         No setting spares the sync: a frame that is there is whole.",
        bytes(w.frame_bytes),
        seconds(w.frame_seconds),
        seconds(low),
        seconds(high),
        change(1.0 + w.frame_seconds / frame_seconds)
    )];
    if let Some((taken, size)) = w.checkpoint {
        let share = f64::from(w.keys) * taken / (f64::from(w.frames) * frame_seconds);
        all.push(format!(
            "--checkpoint 0s: {} and {} of disk for each of the move's {} key frames, {} time at most. \
             --checkpoint off spares it, and a killed job traces them again.",
            seconds(taken),
            bytes(size),
            count(w.keys.into()),
            change(1.0 + share)
        ));
    }
    all
}

/// What the oracle says.
pub fn about_oracle(crop: &OracleCrop) -> String {
    let [width, height] = crop.size;
    format!(
        "The oracle on {width} × {height} pixels of frame {}, one sample of everything: {} instead of \
         Embree's {}; {}{}.",
        crop.frame,
        seconds(crop.oracle_seconds),
        seconds(crop.embree_seconds),
        pixels(&crop.change),
        match crop.change.over_2 {
            0 => String::new(),
            n => format!(" ({})", percent(n as f64 / crop.change.pixels.max(1) as f64)),
        }
    )
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::measured;
    use super::*;

    #[test]
    fn time_of_a_sync_has_an_interval_and_is_at_most_the_whole() {
        let making = Interval { estimate: 0.1, low: 0.08, high: 0.2 };
        let writing = |sync_seconds, sync_ends| Writing {
            frame_seconds: 0.01,
            frame_ends: [0.008, 0.02],
            sync_seconds,
            sync_ends,
            frame_bytes: 1000,
            checkpoint: None,
            keys: 1,
            frames: 1,
        };
        let told = |w: Writing| about_writing(&w, making).concat();
        let some = told(writing(0.004, [0.002, 0.006]));
        assert!(
            some.contains("10 ms to encode, write and sync (8 ms to 20 ms), 4 ms of it"),
            "{some}"
        );
        assert!(some.contains("for the sync (2 ms to 6 ms). +10 % time (+4 % to +25 %)"), "{some}");
        let all = told(writing(0.01, [0.008, 0.02]));
        assert!(all.contains("about all of it for the sync"), "{all}");
        let noise = told(writing(0.001, [-0.002, 0.003]));
        assert!(noise.contains("the sync is no more than noise"), "{noise}");
    }

    #[test]
    fn differences_within_noise_are_called_that() {
        let mut m = measured(&[
            (Knob::Default, "", 1.0, 2.0),
            (Knob::Tolerance, "--tolerance 4", 0.8, 2.5),
            (Knob::Probes, "--probes 0.03", 1.0, 2.0),
            (Knob::Retry, "--retry off", 1.0, 2.0),
        ]);
        for row in &mut m.rows[1..] {
            row.change = Some(Change { pixels: 9000, differing: 7, over_2: 3, largest: 90.0 });
        }
        assert_eq!(
            about_knob(&m, Knob::Tolerance),
            ["--tolerance 4: −20 % time (−20 % to −20 %), error 2.5/255 instead of 2 (+25 %)."]
        );
        let retry = about_knob(&m, Knob::Retry).concat();
        assert!(retry.contains("no more than noise in time (+0 % to +0 %)"), "{retry}");
        assert!(retry.contains("3 of 9,000 pixels differ by more than 2/255, the furthest by 90"));
        m.rows[2].change = Some(Change { pixels: 9000, ..Change::default() });
        assert!(about_knob(&m, Knob::Probes).concat().contains("the same pixels"));
        assert!(about_knob(&m, Knob::Segment).is_empty());
    }
}
