//! The page of a render.

use super::{
    Chart, Picture, Plot, SCRIPT, STYLE, Table, Timeline, json_for_script, set, with_options,
};
use crate::error::Result;
use askama::Template;
use serde::Serialize;
use std::collections::BTreeMap;

/// A frame in the player.
#[derive(Debug, Clone, Serialize)]
pub struct PlayerFrame {
    /// Its number.
    pub number: u32,
    /// Text about the frame.
    pub text: String,
    /// The frame.
    pub picture: Picture,
    /// Its maps by name.
    pub maps: BTreeMap<String, Picture>,
}

/// Everything on the page, ready to be read.
#[derive(Debug, Clone, Default)]
pub struct JobPage {
    /// Title of the page: the scene.
    pub title: String,
    /// How far it is.
    pub state: String,
    /// Why frames are left out, a line for each reason.
    pub gaps: Vec<String>,
    /// The most important facts: name and value.
    pub facts: Vec<(String, String)>,
    /// Frames in the player.
    pub film: Vec<PlayerFrame>,
    /// Which frames are in the player, where not all are.
    pub shown: String,
    /// Maps by name, and what each shows.
    pub maps: Vec<(String, String)>,
    /// Charts over the frames.
    pub charts: Vec<Chart>,
    /// Rays by kind.
    pub effects: Table,
    /// How to read them.
    pub effects_note: String,
    /// Results of the audits.
    pub audit: Table,
    /// Which inferred frames are less accurate than traced ones, if they show any.
    pub worse: Option<String>,
    /// Why they found nothing, where there was none.
    pub no_audit: String,
    /// When each rank rendered what, where the manifest tells.
    pub timeline: Option<Timeline>,
    /// Work of each rank.
    pub ranks: Table,
    /// The command that gives the same frames; empty where unknown.
    pub command: String,
    /// Note about the command.
    pub command_note: String,
    /// How its settings were chosen, where the program chose them.
    pub chosen: Table,
    /// The manifest's head.
    pub manifest: Table,
    /// All settings.
    pub settings: Table,
    /// All frames.
    pub frames: Table,
    /// Version of the program.
    pub version: String,
    /// When the page was made.
    pub made: String,
}

#[derive(Template)]
#[template(path = "job.html")]
struct Html<'a> {
    style: &'static str,
    script: &'static str,
    own_script: &'static str,
    film: String,
    has_pictures: bool,
    last: usize,
    rates: [u32; 6],
    charts: Vec<Plot>,
    timeline: Option<Plot>,
    title: &'a str,
    state: &'a str,
    gaps: &'a [String],
    facts: &'a [(String, String)],
    shown: &'a str,
    maps: &'a [(String, String)],
    effects: &'a Table,
    effects_note: &'a str,
    audit: &'a Table,
    worse: Option<String>,
    no_audit: String,
    ranks: &'a Table,
    command: &'a str,
    command_note: String,
    chosen: &'a Table,
    manifest: &'a Table,
    settings: &'a Table,
    frames: &'a Table,
    version: &'a str,
    made: &'a str,
}

impl JobPage {
    /// The page as one HTML document.
    ///
    /// # Errors
    /// [`crate::error::Error::Failed`] when it cannot be set.
    pub fn to_html(&self) -> Result<String> {
        set(&Html {
            style: STYLE,
            script: SCRIPT,
            own_script: include_str!("../../templates/job.js"),
            film: json_for_script(&self.film)?,
            has_pictures: !self.film.is_empty(),
            last: self.film.len().saturating_sub(1),
            rates: [1, 6, 12, 24, 30, 60],
            charts: self.charts.iter().map(Chart::plot).collect(),
            timeline: self.timeline.as_ref().map(Timeline::plot),
            title: &self.title,
            state: &self.state,
            gaps: &self.gaps,
            facts: &self.facts,
            shown: &self.shown,
            maps: &self.maps,
            effects: &self.effects,
            effects_note: &self.effects_note,
            audit: &self.audit,
            worse: self.worse.as_deref().map(with_options),
            no_audit: with_options(&self.no_audit),
            ranks: &self.ranks,
            command: &self.command,
            command_note: with_options(&self.command_note),
            chosen: &self.chosen,
            manifest: &self.manifest,
            settings: &self.settings,
            frames: &self.frames,
            version: &self.version,
            made: &self.made,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_without_a_frame_stands_and_text_is_escaped() {
        let no_audit = "No frame was audited: --policy off.".into();
        let page = JobPage { title: "<b>&".into(), no_audit, ..JobPage::default() };
        let html = page.to_html().expect("set");
        assert!(html.contains("There is no frame to show yet") && !html.contains("<b>&"));
        assert!(html.contains("No frame was audited: <code>--policy</code> off."));
    }

    #[test]
    fn nothing_on_the_page_names_another_place() {
        let html = JobPage::default().to_html().expect("set");
        for word in ["http:", "https:", "//cdn", "@import", "src=\"/"] {
            assert!(!html.contains(word), "{word}");
        }
        assert!(html.contains("default-src 'none'"));
    }
}
