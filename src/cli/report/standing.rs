//! The state of the job: frames that are finished and whole, and the reasons why others are not.

use super::{Job, now};
use crate::cli::status::{not_done, runs};
use crate::error::counted;
use crate::output::manifest::{Manifest, Row};
use crate::page::words;
use crate::sequence::survey::Survey;

/// The state of a job's frames.
pub struct Standing {
    survey: Survey,
    /// Whether this sequence once finished every frame, even if some were damaged or deleted since.
    is_made: bool,
    /// Frames that exist but are not in the manifest.
    unknown: Vec<u32>,
    /// Frames with the right hash from which no picture could be read.
    pub unreadable: Vec<u32>,
}

impl Standing {
    pub fn new(mut survey: Survey, manifest: &Manifest) -> Self {
        let is_known = |frame: &u32| manifest.rows.contains_key(frame);
        let made = manifest.rows.values().filter(|row| row.stray.is_none());
        let made = made.filter(|row| row.frame <= manifest.header.shot_frames).count();
        // A running job puts a frame in its place before it says so in the manifest.
        let (damaged, unknown) = survey.damaged.iter().copied().partition(is_known);
        survey.damaged = damaged;
        let is_made = made == survey.total as usize;
        Self { survey, is_made, unknown, unreadable: Vec::new() }
    }

    /// Whether the frame's file has its hash; its maps may be damaged.
    pub fn is_whole(&self, frame: u32) -> bool {
        let has = |frames: &[u32]| frames.binary_search(&frame).is_ok();
        has(&self.survey.done) || has(&self.survey.without_map)
    }

    /// Whether a map of a whole frame is missing or damaged.
    pub fn lacks_map(&self, frame: u32) -> bool {
        self.survey.without_map.binary_search(&frame).is_ok()
    }

    /// `7 of 8 frames`: the whole frames, of all frames of the move.
    pub fn count(&self) -> String {
        format!("{} of {}", self.survey.done.len(), counted(self.survey.total as usize, "frame"))
    }

    /// Why other frames are left out, a line for each reason.
    pub fn gaps(&self) -> Vec<String> {
        let Self { survey, unknown, unreadable, .. } = self;
        let mut gaps = not_done(survey);
        for (kind, frames) in [
            ("not in the manifest", unknown),
            ("with a damaged map, and shown without that map", &survey.without_map),
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
    /// A sentence about the state of the job.
    pub fn state(&self) -> String {
        let survey = &self.standing.survey;
        let all = counted(survey.total as usize, "frame");
        if survey.complete {
            return match survey.total {
                1 => "The only frame is there.".into(),
                _ => format!("All {all} of the move are there."),
            };
        }
        let there = match survey.done.len() {
            0 => "No frame of the move is there".to_string(),
            1 => format!("Of the move's {all} 1 is there"),
            n => format!("{n} of the move's {all} are there"),
        };
        if self.standing.is_made {
            return format!("{there}. The same command renders the others.");
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
