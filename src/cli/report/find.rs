//! Finding the manifest that an argument names.

use crate::error::{Error, Result};
use crate::output::manifest::ENDING;
use std::path::{Path, PathBuf};

/// The manifest at `place`, or in the folder `place`.
///
/// Errors: `Error::Input` where there is none, or more than one.
pub fn manifest(place: &Path) -> Result<PathBuf> {
    if place.is_file() {
        return match name_of(place).ends_with(ENDING) {
            true => Ok(place.to_path_buf()),
            false => Err(Error::input(
                place,
                format!(
                    "is no manifest\n  help: give the folder, or the file in it that ends in {ENDING}"
                ),
            )),
        };
    }
    let entries = std::fs::read_dir(place)
        .map_err(|e| Error::input(place, format!("cannot read the folder: {e}")))?;
    let paths = entries.flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> =
        paths.filter(|p| p.is_file() && name_of(p).ends_with(ENDING)).collect();
    found.sort();
    match &found[..] {
        [one] => Ok(one.clone()),
        [] => Err(Error::input(
            place,
            format!(
                "holds no manifest ({ENDING})\n  help: give the folder that `tweenray render` wrote frames to"
            ),
        )),
        [first, ..] => {
            let names: Vec<String> = found.iter().map(|p| name_of(p)).collect();
            Err(Error::input(
                place,
                format!(
                    "holds several sequences: {}\n  help: name one, as in tweenray report {}",
                    names.join(", "),
                    first.display()
                ),
            ))
        }
    }
}

/// `out/frame.report.html` for `out/frame.manifest.jsonl`.
pub fn page_beside(manifest: &Path) -> PathBuf {
    let name = name_of(manifest);
    let stem = name.strip_suffix(ENDING).unwrap_or(&name);
    manifest.with_file_name(format!("{stem}.report.html"))
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
