//! How far the job is: frames that are there and whole, and what is the matter with the others.

use super::{Job, now};
use crate::cli::status::{not_done, runs};
use crate::error::counted;
use crate::output::manifest::{Manifest, Row};
use crate::page::words;
use crate::sequence::survey::Survey;

/// How a job's frames stand.
pub struct Standing {
    survey: Survey,
    /// Whether this sequence has made every frame, whatever became of it.
    is_made: bool,
    /// Frames that lie there and are not in the manifest.
    unknown: Vec<u32>,
    /// Whole by their hash, and yet no picture could be read from them.
    pub unreadable: Vec<u32>,
}

impl Standing {
    pub fn new(mut survey: Survey, manifest: &Manifest) -> Self {
        let is_known = |frame: &u32| manifest.rows.contains_key(frame);
        let made = manifest.rows.values().filter(|row| row.stray.is_none());
        let made = made.filter(|row| row.frame <= survey.total).count();
        // A running job puts a frame in its place before it says so in the manifest.
        let (damaged, unknown) = survey.damaged.iter().copied().partition(is_known);
        survey.damaged = damaged;
        let is_made = made == survey.total as usize;
        Self { survey, is_made, unknown, unreadable: Vec::new() }
    }

    /// Whether the frame's file is as it was written; of its maps, one may not be.
    pub fn is_whole(&self, frame: u32) -> bool {
        let has = |frames: &[u32]| frames.binary_search(&frame).is_ok();
        has(&self.survey.done) || has(&self.survey.without_map)
    }

    /// Whether a map of the frame, which is whole itself, is missing or damaged.
    pub fn lacks_map(&self, frame: u32) -> bool {
        self.survey.without_map.binary_search(&frame).is_ok()
    }

    /// `7 of 8 frames`: of the whole move, those that are there and whole.
    pub fn count(&self) -> String {
        format!("{} of {}", self.survey.done.len(), counted(self.survey.total as usize, "frame"))
    }

    /// What is the matter with the others, a line for each kind.
    pub fn gaps(&self) -> Vec<String> {
        let Self { survey, unknown, unreadable, .. } = self;
        let mut gaps = not_done(survey);
        for (kind, frames) in [
            ("not in the manifest", unknown),
            ("damaged in a map alone, and shown without that map", &survey.without_map),
            ("could not be read", unreadable),
        ] {
            if !frames.is_empty() {
                gaps.push(format!("{} {kind}: {}", frames.len(), runs(frames)));
            }
        }
        gaps
    }
}

impl Job {
    /// A sentence about how far the job is.
    pub fn state(&self) -> String {
        let survey = &self.standing.survey;
        let all = counted(survey.total as usize, "frame");
        if survey.complete {
            return match survey.total {
                1 => "The move's only frame is there.".into(),
                _ => format!("All {all} of the move are there."),
            };
        }
        let there = match survey.done.len() {
            0 => "No frame of the move is there".to_string(),
            1 => format!("Of the move's {all} 1 is there"),
            n => format!("{n} of the move's {all} are there"),
        };
        if self.standing.is_made {
            return format!("{there}. The same job, run again, makes the others.");
        }
        let ended = |row: &Row| row.ended;
        let ago = match self.rows.iter().filter_map(ended).reduce(f64::max) {
            None => String::new(),
            Some(last) => {
                format!("; the last one is {} old", words::seconds((now() - last).max(0.0)))
            }
        };
        format!("{there}{ago}: the job still runs, was stopped, or was not asked for more.")
    }
}
