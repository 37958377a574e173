//! The figures as a page.

mod plots;
mod tables;

use super::given::{Given, given, with_given};
use super::{AccuracyArgs, Outcome};
use crate::accuracy::{
    CandidateRow, Goal, Knob, about_knob, about_oracle, about_writing, best_within,
    fastest_reaching, perhaps_faster,
};
use crate::cli::spelled;
use crate::error::Result;
use crate::measure::Median;
use crate::output::video::shell_line;
use crate::page::Picture;
use crate::page::accuracy::{AccuracyPage, Detail, KnobText, Named};
use crate::page::words::{bytes, change, count, date, percent, seconds, short};
use std::time::{SystemTime, UNIX_EPOCH};

/// Most pictures in the page.
const MOST_PICTURES: usize = 14;

/// The page of `outcome`, measured by `command`.
pub fn page(args: &AccuracyArgs, outcome: &Outcome, command: &[String]) -> Result<AccuracyPage> {
    let scene = args.scene.scene.display().to_string();
    let given = given(command);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64());
    Ok(AccuracyPage {
        title: scene.clone(),
        summary: summary(outcome),
        facts: facts(outcome, &given),
        warnings: warnings(outcome),
        scatters: plots::METRICS
            .iter()
            .filter_map(|metric| plots::scatter(outcome, metric))
            .collect(),
        details: details(outcome, &scene, &given),
        goals: tables::goals(outcome),
        knobs: knobs(outcome),
        pictures: pictures(outcome)?,
        pictured: format!("Frame {}, as a display shows it in 8 bits.", outcome.shown_frame),
        tables: vec![tables::figures(outcome), tables::times(outcome), tables::rays(outcome)],
        command: shell_line(command),
        version: crate::output::VERSION.into(),
        made: date(now),
    })
}

fn median_of(row: &CandidateRow) -> f64 {
    row.seconds.median.interval.estimate
}

fn summary(outcome: &Outcome) -> Vec<String> {
    let default = outcome.measured.default_row();
    let (time, e) = (median_of(default), &default.errors);
    let mut lines = vec![format!(
        "By default a frame takes {} and is {}/255 off (RMSE; PSNR {} dB, FLIP {}), mean over the \
         move.",
        seconds(time),
        short(e.rmse_steps),
        short(e.psnr),
        short(e.flip)
    )];
    let half = best_within(&outcome.measured, time * 1.02).filter(|row| row.knob != Knob::Default);
    let beyond_noise = |ratio: &Option<Median>| ratio.is_some_and(|r| r.differs_from(1.0));
    // The time ratio needs as many turns as the error ratio.
    let is_timed = |row: &&CandidateRow| row.time_ratio.is_some_and(|ratio| ratio.is_sure());
    if let Some(row) = half.filter(is_timed).filter(|row| beyond_noise(&row.error_ratio)) {
        lines.push(format!(
            "{} is more accurate in the same time: {}/255.",
            row.name(),
            short(row.errors.rmse_steps)
        ));
    }
    let goal = Goal::Psnr(e.psnr);
    let Some(row) = fastest_reaching(&outcome.measured, goal) else { return lines };
    if row.knob != Knob::Default {
        let share = percent(median_of(row) / time);
        lines.push(format!("{} is as accurate in {share} of the time.", row.name()));
    }
    if let Some(row) = perhaps_faster(&outcome.measured, goal, row) {
        lines.push(format!(
            "{} may be as accurate in less time, but {} too few to distinguish that from noise: \
             about 6 --turns are needed.",
            row.name(),
            match row.seconds.turns.len() {
                1 => "1 turn is".into(),
                turns => format!("{turns} turns are"),
            }
        ));
    }
    lines
}

fn facts(outcome: &Outcome, given: &[Given]) -> Vec<(String, String)> {
    let frames: Vec<String> = outcome.frames.iter().map(u32::to_string).collect();
    let load = outcome.load.map(|l| l.map_or("?".into(), short));
    let base = outcome.base;
    let default = spelled::options(base, &outcome.plan);
    let times = &outcome.measured.default_row().seconds;
    let intervals = match times.median.has_interval() {
        true => format!("of {}", percent(times.median.confidence)),
        false => "none: one turn gives none".into(),
    };
    let turns = times.turns.len();
    let fact = |name: &str, value: String| (name.to_string(), value);
    let denoiser = outcome.denoiser.iter().map(|d| fact("Denoiser", d.clone()));
    let facts = vec![
        fact("Default", shell_line(&with_given(given, &default))),
        fact("Size", format!("{} × {}", base.width, base.height)),
        fact("Frames looked at", format!("{} of {}", frames.join(", "), outcome.shot_frames)),
        fact("Settings compared", count(outcome.measured.rows.len() as u64)),
        fact("Turns timed", format!("{turns}, after a warm-up")),
        fact("Intervals", intervals),
        fact("Reference", reference(outcome)),
        fact("Threads", outcome.threads.to_string()),
        fact("Machine's load", format!("{} before, {} after", load[0], load[1])),
        fact("Tracer", outcome.tracer.clone()),
        fact("Whole sweep", whole(outcome)),
    ];
    facts.into_iter().chain(denoiser).collect()
}

fn reference(outcome: &Outcome) -> String {
    let truth = outcome.truth;
    let (camera, shadow) = (truth.settings.camera_samples(), truth.settings.shadow_samples);
    let samples = format!("{camera} camera and {shadow} shadow samples");
    match truth.change.is_finite() {
        true => format!(
            "{samples}, {}/255 away from the one before the last doubling",
            short(truth.change)
        ),
        false => format!("{samples}, never doubled"),
    }
}

/// The duration of the sweep in words, as far as it is known.
fn whole(outcome: &Outcome) -> String {
    match (outcome.seconds.map(seconds), outcome.runs) {
        (Some(own), 1) => own,
        (Some(own), runs) => format!("{runs} runs, the last {own}"),
        (None, 1) => "an earlier run".into(),
        (None, runs) => format!("{runs} earlier runs"),
    }
}

fn warnings(outcome: &Outcome) -> Vec<String> {
    let mut warnings = Vec::new();
    let [done, of] = outcome.trials;
    if done < of {
        warnings.push(format!(
            "The sweep is not complete: the page has {} of {} trials, {} of {} settings. \
             The same command goes on.",
            count(done as u64),
            count(of as u64),
            count(outcome.measured.rows.len() as u64),
            count(outcome.settings as u64)
        ));
    }
    let rows = &outcome.measured.rows;
    let own = rows.iter().filter(|row| !row.knob.is_denoised());
    let best = own.map(|row| row.errors.rmse_steps).fold(f64::INFINITY, f64::min);
    let change = outcome.truth.change;
    let longer = "Errors of about this size are overestimated here. A higher --reference-spp lets the reference converge.";
    if !change.is_finite() {
        let best = short(best);
        warnings.push(format!(
            "The error of the reference itself is unknown, since its samples were never doubled. The best \
             setting's error is {best}/255. {longer}"
        ));
    } else if change > best / 4.0 {
        warnings.push(format!(
            "The reference has not converged: its last doubling changed it by {}/255, more than a \
             quarter of the best setting's error, {}/255. {longer}",
            short(change),
            short(best)
        ));
    }
    let before = outcome.load[0].unwrap_or(0.0);
    if before > 0.5 {
        warnings.push(format!(
            "The machine was busy when the sweep began (load {}), so times are less certain.",
            short(before)
        ));
    }
    let times = &outcome.measured.default_row().seconds;
    warnings.extend(few_turns(times.turns.len(), outcome.turns, times.median.confidence));
    warnings
}

/// The warning where only `turns` of `asked` turns were timed, or too few for an interval.
fn few_turns(turns: usize, asked: u32, confidence: f64) -> Option<String> {
    let so_far = turns < asked as usize;
    Some(match turns {
        6.. => return None,
        1 if so_far => "So far 1 turn is timed, which gives no interval.".into(),
        1 => "One turn is timed, which gives no interval; more --turns go on.".into(),
        _ => {
            let hold = format!("the intervals contain the true value in {}", percent(confidence));
            match so_far {
                true => format!("So far {turns} turns are timed: {hold} of cases, not in 95 %."),
                false => format!("With --turns {turns} {hold} of cases, not in 95 %."),
            }
        }
    })
}

fn with_ends(m: &Median, word: fn(f64) -> String) -> String {
    let i = m.interval;
    if !m.has_interval() {
        return word(i.estimate);
    }
    format!("{} ({}–{})", word(i.estimate), word(i.low), word(i.high))
}

/// A ratio's difference from 1, with the ends of its interval, in words.
fn with_changes(ratio: &Median) -> String {
    let i = ratio.interval;
    let [is, low, high] = [i.estimate, i.low, i.high].map(change);
    if ratio.has_interval() { format!("{is} ({low} to {high})") } else { is }
}

fn details(outcome: &Outcome, scene: &str, given: &[Given]) -> Vec<Detail> {
    let detail = |(id, row): (usize, &CandidateRow)| {
        let e = &row.errors;
        let mut figures = vec![
            ("Seconds a frame", with_ends(&row.seconds.median, short)),
            ("CPU seconds", with_ends(&row.cpu_seconds.median, short)),
        ];
        if let Some(ratio) = &row.time_ratio {
            let word = match ratio.differs_from(1.0) {
                true => "",
                false if ratio.is_sure() => ", within noise",
                false => ", too few turns to tell",
            };
            figures.push(("Time against default", with_changes(ratio) + word));
        }
        if let Some(mean) = row.camera_samples {
            figures.push(("Camera samples a pixel", short(mean)));
        }
        if row.knob.is_denoised() {
            figures
                .push(("Denoised", "from colour, albedo and normals of the frames below".into()));
        }
        figures.extend([
            ("RMSE", format!("{}/255", short(e.rmse_steps))),
            ("PSNR", format!("{} dB", short(e.psnr))),
            ("SSIM", format!("{:.5}", e.ssim)),
            ("FLIP", short(e.flip)),
            ("Off by more than 2/255", percent(e.share_over_2)),
            ("Rays a frame", count(row.rays_per_frame.round() as u64)),
            ("Memory", bytes(row.memory_bytes)),
        ]);
        let figures = figures.into_iter().map(|(name, value)| (name.to_string(), value)).collect();
        let words = ["tweenray", "render", scene].map(String::from);
        let mut command: Vec<String> =
            words.into_iter().chain(with_given(given, &row.options)).collect();
        if row.knob.is_denoised() {
            let channels = ["--aovs", "albedo,normal", "-o", "noisy_####.exr"];
            command.extend(channels.map(String::from));
        }
        let command = shell_line(&command);
        Detail { id, name: row.name(), figures, command }
    };
    outcome.measured.rows.iter().enumerate().map(detail).collect()
}

/// Sentences about the effect of each group of options.
pub fn knobs(outcome: &Outcome) -> Vec<KnobText> {
    let mut seen: Vec<Knob> = Vec::new();
    for row in &outcome.measured.rows {
        let alone = !matches!(row.knob, Knob::Default | Knob::Combination);
        if alone && !seen.contains(&row.knob) {
            seen.push(row.knob);
        }
    }
    let text = |knob: Knob| KnobText {
        name: knob.name().into(),
        sentences: about_knob(&outcome.measured, knob),
    };
    let mut all: Vec<KnobText> = seen.into_iter().map(text).collect();
    if let Some(crop) = &outcome.oracle {
        all.push(KnobText { name: "Oracle".into(), sentences: vec![about_oracle(crop)] });
    } else if outcome.oracle_was_wanted {
        let why = "Left out: the oracle tests every ray against every triangle, and would take minutes for a \
                   few pixels of this scene.";
        all.push(KnobText { name: "Oracle".into(), sentences: vec![why.into()] });
    }
    if outcome.lacks_denoiser {
        let why = "Left out: oidnDenoise of Intel Open Image Denoise was not found. --denoiser gives its path.";
        all.push(KnobText { name: Knob::Denoiser.name().into(), sentences: vec![why.into()] });
    }
    if let Some(writing) = &outcome.writing {
        let sentences =
            about_writing(writing, outcome.measured.default_row().seconds.median.interval);
        all.push(KnobText { name: "Writing to disk".into(), sentences });
    }
    all
}

/// Up to [`MOST_PICTURES`] pictures: the default, the reference, settings on the front, then the others.
fn pictures(outcome: &Outcome) -> Result<Vec<Named>> {
    let rows = &outcome.measured.rows;
    let named = |candidate: usize| {
        let found = outcome.pictures.iter().find(|p| p.candidate == candidate);
        found.map(|p| Named {
            name: rows[candidate].name(),
            id: Some(candidate),
            picture: p.picture.clone(),
        })
    };
    let front = (1..rows.len()).filter(|k| rows[*k].on_front);
    let rest = (1..rows.len()).filter(|k| !rows[*k].on_front && rows[*k].knob != Knob::Combination);
    let order: Vec<usize> = std::iter::once(0).chain(front).chain(rest).collect();
    let mut all: Vec<Named> = order.into_iter().filter_map(named).take(MOST_PICTURES - 1).collect();
    let truth = Picture::png(&outcome.truth.frames[&outcome.shown_frame])?;
    all.insert(1.min(all.len()), Named { name: "reference".into(), id: None, picture: truth });
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::few_turns;

    #[test]
    fn the_warning_names_the_turns_timed_so_far_not_those_asked_for() {
        let told = |turns, asked| few_turns(turns, asked, 0.75).unwrap_or_default();
        assert!(
            told(3, 6).starts_with(
                "So far 3 turns are timed: the intervals contain the true value in 75 %"
            )
        );
        assert!(told(3, 3).starts_with("With --turns 3 the intervals contain"));
        for one in [told(1, 6), told(1, 1)] {
            assert!(one.contains("gives no interval") && !one.contains('%'), "{one}");
        }
        assert_eq!(few_turns(6, 9, 0.97), None);
    }
}
