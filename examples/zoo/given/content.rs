//! A scene file as a table.

use crate::judging::Failure;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

/// What a scene file says of the job, not of its pictures.
const OF_THE_JOB: [&str; 5] = ["frames", "crop", "aovs", "strict", "time_limit"];

/// Reads the file at `path`. Names of `files`, which are all that it needs, become absolute.
pub fn read(path: &Path, files: &[PathBuf]) -> Result<Table, Failure> {
    let mut table: Table = std::fs::read_to_string(path)?.parse()?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let absolute = |name: &str| {
        let written = [name.to_owned(), name.replace('\\', "/")].map(|name| folder.join(name));
        let found = written.into_iter().find(|path| files.contains(path))?;
        Some(std::path::absolute(found).ok()?.to_string_lossy().into_owned())
    };
    rename_in(&mut table, &absolute);
    Ok(table)
}

/// Gives all texts that `renamed` knows another name, except for names of materials.
fn rename_in(table: &mut Table, renamed: &impl Fn(&str) -> Option<String>) {
    let of_files = |(key, value): &(&String, &mut Value)| *key != "material" || !value.is_str();
    table.iter_mut().filter(of_files).for_each(|(_, value)| rename(value, renamed));
}

fn rename(value: &mut Value, renamed: &impl Fn(&str) -> Option<String>) {
    match value {
        Value::String(text) => *text = renamed(text).unwrap_or_else(|| std::mem::take(text)),
        Value::Array(all) => all.iter_mut().for_each(|one| rename(one, renamed)),
        Value::Table(table) => rename_in(table, renamed),
        _ => {}
    }
}

/// How the camera moves.
pub fn kind(table: &Table) -> &'static str {
    let is_there = |kind: &&str| table.get("camera").is_some_and(|own| own.get(*kind).is_some());
    // Without any the camera orbits the scene.
    ["pan", "keys", "bspline", "poses"].into_iter().find(is_there).unwrap_or("orbit")
}

/// The text of all but the camera and what is the job's.
pub fn without_camera(mut table: Table) -> Result<String, Failure> {
    table.remove("camera");
    if let Some(Value::Table(settings)) = table.get_mut("settings") {
        settings.retain(|key, _| !OF_THE_JOB.contains(&key));
    }
    Ok(toml::to_string(&table)?)
}
