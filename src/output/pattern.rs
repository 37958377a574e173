//! Names of the files of a sequence: `out/frame_####.png`.
//!
//! One group of `#` in the file's name stands for the frame number, with zeros in front to as many
//! digits as there are `#`; a longer number takes the digits it needs. A name without `#` is used
//! as it is for a single frame; for several, `_####` goes before its ending.

use super::Format;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A file name with a place for the frame number.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FramePattern {
    folder: PathBuf,
    before: String,
    /// Least number of digits; 0 when the name has no frame number.
    digits: usize,
    /// The part of the name after the number, including the ending.
    after: String,
    format: Format,
}

impl FramePattern {
    /// Parses `text` as the pattern of a job that renders `frames` frames.
    ///
    /// # Errors
    /// [`Error::Usage`] for two groups of `#`, a `#` in a folder's name or in the ending, no name,
    /// or an ending that is not a format's.
    pub fn parse(text: &str, frames: u32) -> Result<Self> {
        let format = Format::of(text)?;
        let wrong = |what: &str| Err(Error::Usage(format!("the name {text} {what}")));
        let path = Path::new(text);
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        if folder.to_string_lossy().contains('#') {
            return wrong("has # in a folder: the frame number belongs into the file's name");
        }
        let part = |p: Option<&std::ffi::OsStr>| p.and_then(|p| p.to_str()).map(str::to_owned);
        let (Some(stem), Some(ending)) = (part(path.file_stem()), part(path.extension())) else {
            return wrong("names no file");
        };
        let (before, digits, after) = match stem.find('#') {
            None if frames > 1 => (format!("{stem}_"), 4, String::new()),
            None => (stem, 0, String::new()),
            Some(start) => {
                let rest = stem[start..].trim_start_matches('#');
                if rest.contains('#') {
                    return wrong("has two groups of #: one is the frame number");
                }
                (stem[..start].to_owned(), stem.len() - start - rest.len(), rest.to_owned())
            }
        };
        Ok(Self { folder, before, digits, after: format!("{after}.{ending}"), format })
    }

    /// The file of a frame.
    pub fn path(&self, frame: u32) -> PathBuf {
        let Self { before, digits, after, .. } = self;
        self.folder.join(match digits {
            0 => format!("{before}{after}"),
            _ => format!("{before}{frame:0digits$}{after}"),
        })
    }

    /// The folder of all frames; empty for the working folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The format that the ending names.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Whether frames have names of their own.
    pub fn is_numbered(&self) -> bool {
        self.digits > 0
    }

    /// The pattern as ffmpeg's image reader has it: `%04d` for the number, `%%` for a percent sign.
    pub(super) fn for_ffmpeg(&self) -> String {
        let escape = |s: &str| s.replace('%', "%%");
        let name = match self.digits {
            0 => format!("{}{}", self.before, self.after),
            n => format!("{}%0{n}d{}", escape(&self.before), escape(&self.after)),
        };
        let folder = self.folder.to_string_lossy();
        let folder = if self.digits > 0 { escape(&folder) } else { folder.into_owned() };
        Path::new(&folder).join(name).to_string_lossy().into_owned()
    }
}

impl std::fmt::Display for FramePattern {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = format!("{}{}{}", self.before, "#".repeat(self.digits), self.after);
        write!(f, "{}", self.folder.join(name).display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str, frames: u32, frame: u32) -> String {
        let pattern = FramePattern::parse(text, frames).expect("a pattern");
        pattern.path(frame).display().to_string()
    }

    #[test]
    fn numbers_are_padded_and_may_be_longer() {
        assert_eq!(path("out/frame_####.png", 16, 7), "out/frame_0007.png");
        assert_eq!(path("out/frame_##.exr", 500, 123), "out/frame_123.exr");
        assert_eq!(path("#.ppm", 2, 10), "10.ppm");
        assert_eq!(path("/a/b.c/f#_left.png", 2, 3), "/a/b.c/f3_left.png");
        assert_eq!(path("f####.v2.PNG", 2, 3), "f0003.v2.PNG");
        assert_eq!(path("ä###ö.png", 2, 3), "ä003ö.png");
    }

    #[test]
    fn names_without_a_number() {
        assert_eq!(path("still.png", 1, 7), "still.png");
        assert_eq!(path("out/shot.png", 2, 7), "out/shot_0007.png");
        let single = FramePattern::parse("still.png", 1).expect("a pattern");
        assert!(!single.is_numbered());
        assert_eq!(single.to_string(), "still.png");
        let several = FramePattern::parse("out/shot.png", 2).expect("a pattern");
        assert_eq!(several.to_string(), "out/shot_####.png");
    }

    #[test]
    fn invalid_patterns_are_refused() {
        let cases = [
            ("f##_##.png", "two groups"),
            ("out_##/f.png", "folder"),
            ("a##/f##.png", "folder"),
            ("frame_####", "end in .png"),
            ("frame_####.gif", "end in .png"),
            ("frame.p#g", "end in .png"),
            ("", "end in .png"),
            ("out/", "end in .png"),
            (".png", "end in .png"),
        ];
        for (text, expected) in cases {
            let error = FramePattern::parse(text, 3).expect_err(text);
            assert!(matches!(error, Error::Usage(_)));
            assert!(error.to_string().contains(expected), "{text}: {error}");
        }
    }

    #[test]
    fn ffmpeg_spelling() {
        let spelled = |text, frames| FramePattern::parse(text, frames).expect("text").for_ffmpeg();
        assert_eq!(spelled("out/frame_####.png", 2), "out/frame_%04d.png");
        assert_eq!(spelled("50%/a%b_##.png", 2), "50%%/a%%b_%02d.png");
        assert_eq!(spelled("50%/a%b.png", 1), "50%/a%b.png");
    }
}
