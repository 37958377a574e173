//! What is judged.

use super::Settings;
use serde::Serialize;
use std::path::Path;

/// A scene with its camera move.
pub trait Subject {
    fn label(&self) -> Label;

    /// What it is rendered with unless the command line says otherwise.
    fn settings(&self) -> Settings;

    /// Frames of the move.
    fn frames(&self) -> usize;

    /// Writes the scene file `name` and what it needs into `folder`: a move through the cameras of these `frames`, of
    /// which the first is frame `first`. The frames before it mean nothing.
    ///
    /// # Errors
    /// Of the file system.
    fn write_frames(
        &self,
        folder: &Path,
        name: &str,
        frames: &[usize],
        first: usize,
    ) -> std::io::Result<()>;

    /// The program's own settings of a traced frame: light samples, exposure and tone curve count.
    fn program_settings(&self, settings: Settings) -> tweenray::scene::Settings {
        settings.light_of(tweenray::scene::Settings::default())
    }
}

/// What a scene is called in tables and on disk.
#[derive(Clone, Serialize)]
pub struct Label {
    pub index: u64,
    /// What it has in common with others, a row of the table.
    pub family: String,
    pub name: String,
    /// How the camera moves.
    #[serde(rename = "move")]
    pub kind: &'static str,
    /// Its own folder, below that of the zoo.
    pub folder: String,
}
