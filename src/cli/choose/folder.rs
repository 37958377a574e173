//! Checks of the output folder before settings are chosen.

use super::{Choice, Chooser};
use crate::error::{Error, Result, counted};
use crate::output::atomic;
use crate::output::manifest::{Header, Manifest, manifest_path};
use crate::sequence::{self, Target};
use serde_json::Value;

impl Chooser<'_> {
    /// Refuses, before the probe, a folder that cannot be written, and frames that were made for another
    /// target or settings; rendering would refuse them only after the probe.
    pub(super) fn check_folder(&self) -> Result<()> {
        let request = self.request;
        atomic::make_room(request.pattern.path(request.frames.first))?;
        if request.options.overwrite {
            return Ok(());
        }
        let folder = request.pattern.folder();
        let found = Manifest::as_of_now(&manifest_path(&request.pattern))?;
        let is_there = |file: &str| folder.join(file).exists();
        let left = |m: &Manifest| m.rows.values().filter(|row| is_there(&row.file)).count();
        let Some((found, left)) = found.map(|m| (left(&m), m)).filter(|(left, _)| *left > 0) else {
            return sequence::refuse_unlisted(&self.target()?, request.frames);
        };
        Err(Error::Usage(format!(
            "{} holds {} {}; --overwrite replaces them\n  \
             help: or choose another output with -o",
            request.pattern,
            counted(found, "frame"),
            self.made_for(&left.header)?
        )))
    }

    /// The target of the job without a choice of settings.
    fn target(&self) -> Result<Target> {
        let setup = self.request.setup(self.context.base.clone())?;
        Ok(self.request.target(&setup, self.tracer))
    }

    /// What frames with the header `before` were made for, in words; if the target is the same, also what differs.
    fn made_for(&self, before: &Header) -> Result<String> {
        let Some(chosen) = Choice::of(before) else {
            return Ok("whose settings were not chosen".into());
        };
        if chosen.wanted != self.args.words() {
            return Ok(format!("made for {}", chosen.wanted));
        }
        let base = |settings: Value, header: Header| Header { settings, ..header };
        let now = base(Header::settings(self.context.base), self.target()?.header);
        // Where others were given, the first difference may be of one that nobody gave.
        let is_given_alike = chosen.given == self.given();
        let d = base(chosen.base, before.clone()).first_difference(&now).filter(|_| is_given_alike);
        let why = d.map_or("other options were given".into(), |d| d.was_and_is());
        Ok(format!("made for {} too, but {why}", chosen.wanted))
    }
}
