//! The page of a sweep.

use super::{Picture, Plot, SCRIPT, STYLE, Scatter, Table, json_for_script, set, with_options};
use crate::error::Result;
use askama::Template;
use serde::Serialize;

/// A picture that can be held against another.
#[derive(Debug, Clone, Serialize)]
pub struct Named {
    /// Name.
    pub name: String,
    /// Number of its point in the plots; `None` for the reference.
    pub id: Option<usize>,
    /// The picture.
    pub picture: Picture,
}

/// The text about a selected point.
#[derive(Debug, Clone, Serialize)]
pub struct Detail {
    /// The point's number.
    pub id: usize,
    /// Name.
    pub name: String,
    /// Figures: name and value.
    pub figures: Vec<(String, String)>,
    /// The command that renders with it.
    pub command: String,
}

/// Sentences about the effect of a group of options.
#[derive(Debug, Clone, Serialize)]
pub struct KnobText {
    /// The knob.
    pub name: String,
    /// A sentence for each of its settings.
    pub sentences: Vec<String>,
}

/// Everything on the page, ready to be read.
#[derive(Debug, Clone, Default)]
pub struct AccuracyPage {
    /// The scene.
    pub title: String,
    /// Summary, in paragraphs.
    pub summary: Vec<String>,
    /// How it was measured: name and value.
    pub facts: Vec<(String, String)>,
    /// Warnings, a paragraph each.
    pub warnings: Vec<String>,
    /// Error against time, one for each measure of error.
    pub scatters: Vec<Scatter>,
    /// Every point.
    pub details: Vec<Detail>,
    /// The fastest setting for errors that one may want.
    pub goals: Table,
    /// Every knob.
    pub knobs: Vec<KnobText>,
    /// The pictures; the first two are shown at first.
    pub pictures: Vec<Named>,
    /// Which frame they show.
    pub pictured: String,
    /// All figures.
    pub tables: Vec<Table>,
    /// The command that measures this again.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// When the page was made.
    pub made: String,
}

#[derive(Template)]
#[template(path = "accuracy.html")]
struct Html<'a> {
    page: &'a AccuracyPage,
    summary: Vec<String>,
    warnings: Vec<String>,
    knobs: Vec<(&'a str, Vec<String>)>,
    style: &'static str,
    script: &'static str,
    own_script: &'static str,
    own_style: &'static str,
    plots: Vec<(&'a str, Plot)>,
    details: String,
    pictures: String,
    version: &'a str,
    made: &'a str,
}

impl AccuracyPage {
    /// The page as one HTML document.
    ///
    /// # Errors
    /// [`crate::error::Error::Failed`] when it cannot be set.
    pub fn to_html(&self) -> Result<String> {
        let all = |texts: &[String]| texts.iter().map(|text| with_options(text)).collect();
        set(&Html {
            page: self,
            summary: all(&self.summary),
            warnings: all(&self.warnings),
            knobs: self.knobs.iter().map(|k| (k.name.as_str(), all(&k.sentences))).collect(),
            style: STYLE,
            script: SCRIPT,
            own_script: include_str!("../../templates/accuracy.js"),
            own_style: include_str!("../../templates/accuracy.css"),
            plots: self.scatters.iter().map(|s| (s.metric.as_str(), s.plot())).collect(),
            details: json_for_script(&self.details)?,
            pictures: json_for_script(&self.pictures)?,
            version: &self.version,
            made: &self.made,
        })
    }
}
