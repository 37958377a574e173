//! The manifest of a sequence: which frames are whole, under which settings, at what cost.
//!
//! JSON Lines beside the frames: a [`Header`], then one [`Row`] a frame. Rows are only appended,
//! each in one write that is synced, after its frame was renamed into place, so every row stands for a
//! whole frame. Only the last line can be incomplete after a crash, and reading drops it. A later row of a
//! frame overrides an earlier one.
//!
//! With several ranks, only rank 0 writes the manifest itself. Every other rank appends to a
//! part file of its own, which rank 0 merges at the end or at the next start: on a local disk many
//! writers could append to one file with `O_APPEND`, but on NFS their rows could mix.
//!
//! Several jobs may write the same sequence at once. With equal settings they write equal bytes, and
//! no row is lost ([`Journal`]); a job of other settings is refused when it starts.

mod difference;
mod journal;
mod parts;
#[cfg(test)]
mod tests;

pub use difference::HeaderDifference;
pub use journal::Journal;
pub use parts::part_path;

use super::{FramePattern, atomic};
use crate::error::{Error, Result};
use crate::scene::Settings;
use crate::stats::{AuditSums, BadSamples, RayCounts, ReuseCounts};
use difference::SCENE;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Version of the file format.
pub const FORMAT: u32 = 2;

/// Ending of a manifest's name.
pub const ENDING: &str = ".manifest.jsonl";

/// The data that all frames of a sequence share. A frame's bytes depend only on these and on its recipe.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// [`FORMAT`].
    pub manifest: u32,
    /// Version of the program.
    pub tweenray: String,
    /// The scene as the user named it; reported, never compared.
    pub scene: String,
    /// Hash of the resolved world, without the shot, hexadecimal.
    pub scene_hash: String,
    /// Hashes of the world's parts by name, used only to say which parts differ when `scene_hash` does.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub scene_parts: BTreeMap<String, String>,
    /// Hash of world and shot; no frame is refused by it, since every row has its own recipe.
    pub shot_hash: String,
    /// Frames of the whole shot; reported, never compared.
    pub shot_frames: u32,
    /// File name pattern of the frames, without a folder.
    pub files: String,
    /// Intersector, its version and instruction set.
    pub tracer: String,
    /// The words of the command that started the sequence, program first; reported, never compared.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
    /// How the program chose the settings, if it did; reported, never compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Value>,
    /// Every setting, by name. Kept as JSON, so that a manifest of another version can be read
    /// far enough to say what differs.
    pub settings: Value,
}

/// A finished frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Frame number, from 1.
    pub frame: u32,
    /// Its file, without a folder.
    pub file: String,
    /// Hash of its camera, hexadecimal.
    pub view: String,
    /// Hash of its number and camera, and of those of the frames that it is inferred from.
    pub recipe: String,
    /// BLAKE3 of the file, hexadecimal.
    pub blake3: String,
    /// Size of the file.
    pub bytes: u64,
    /// Wall seconds from the camera to the renamed file.
    pub seconds: f64,
    /// Time when the file got its final name, seconds since 1970; missing in older manifests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<f64>,
    /// The rank that rendered it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rank: u32,
    /// Rays cast for it.
    pub rays: RayCounts,
    /// Mean number of camera samples of a pixel; `None` where all pixels take as many.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<f64>,
    /// Surface points inferred.
    #[serde(default, skip_serializing_if = "ReuseCounts::is_none")]
    pub reuse: ReuseCounts,
    /// The audit of its inferred pixels.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub audit: Option<AuditRow>,
    /// Invalid camera samples.
    #[serde(default, skip_serializing_if = "BadSamples::is_none")]
    pub bad: BadSamples,
    /// Files of its maps.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub maps: Vec<MapRow>,
    /// Why the frame, which is left from an earlier job, does not belong to this sequence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stray: Option<Foreign>,
}

/// Why a frame in a manifest does not belong to the sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Foreign {
    /// It is left from a sequence of other settings, of which only a part was replaced.
    OtherSettings,
    /// It is left from another move through the same scene, or from a shorter or longer one.
    OtherMove,
}

/// A file beside a frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MapRow {
    /// Its name, without a folder.
    pub file: String,
    /// BLAKE3 of it, hexadecimal.
    pub blake3: String,
}

/// The audit of a frame: root mean square errors in display steps of 1/255, each with the ends of its
/// 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AuditRow {
    /// Error of the frame as it is.
    pub rmse: Option<[f64; 3]>,
    /// Error of its inferred pixels.
    pub rmse_inferred_pixels: Option<[f64; 3]>,
    /// Error of the frame if it had been traced.
    pub rmse_traced: Option<[f64; 3]>,
    /// Sums from which the errors are computed; frames are pooled by adding these.
    pub sums: AuditSums,
}

/// A manifest as read: the header, and the last row of every frame.
#[derive(Debug, Clone)]
pub struct Manifest {
    /// The header, which the frames share.
    pub header: Header,
    /// Rows by frame.
    pub rows: BTreeMap<u32, Row>,
}

impl Header {
    /// The settings as the header keeps them.
    pub fn settings(settings: &Settings) -> Value {
        // By way of text: `to_value` widens an f32 of 0.1 to 0.10000000149011612.
        let text = serde_json::to_string(settings).unwrap_or_default();
        serde_json::from_str(&text).unwrap_or(Value::Null)
    }

    /// Hash of everything that is compared.
    fn key(&self) -> String {
        let mut hash = blake3::Hasher::new();
        for (name, value) in self.entries() {
            hash.update(format!("{name}\0{value}\0").as_bytes());
        }
        hash.finalize().to_hex()[..16].to_string()
    }

    /// Everything that is compared, by name, as text. The file format comes first, since some settings apply to one
    /// format only; then the user's settings; then the rest.
    fn entries(&self) -> Vec<(String, String)> {
        let ending = Path::new(&self.files).extension().unwrap_or_default();
        let mut entries = vec![("file format".into(), ending.to_string_lossy().to_lowercase())];
        let s = &self.settings;
        entries.push(("size".into(), format!("{}x{}", plain(&s["width"]), plain(&s["height"]))));
        entries.push(("crop".into(), crop(&s["crop"])));
        for group in [s, &s["rules"], &s["reuse"]] {
            for (key, value) in group.as_object().into_iter().flatten() {
                let own = ["width", "height", "crop", "rules", "reuse"];
                if own.contains(&key.as_str()) || RANGES.iter().any(|range| range[1] == key) {
                    continue;
                }
                let other = RANGES.iter().find(|range| range[0] == key);
                let other = other.map_or(&Value::Null, |range| &group[range[1]]);
                entries.push((key.replace('_', "-"), range(plain(value), other)));
            }
        }
        for (name, value) in [
            ("output file", &self.files),
            (SCENE, &self.scene_hash),
            ("tweenray version", &self.tweenray),
            ("tracer (see --isa)", &self.tracer),
        ] {
            entries.push((name.into(), value.clone()));
        }
        entries
    }
}

/// Settings that with another one, if that is there, are the least and the most of something.
const RANGES: [[&str; 2]; 3] = [
    ["spp", "most_spp"],
    ["shadow_samples", "least_shadow_samples"],
    ["sky_samples", "least_sky_samples"],
];

/// As on the command line: `4`, or `4..16`, whichever of the two is the least.
fn range(one: String, other: &Value) -> String {
    match (one.parse::<u64>(), other.as_u64()) {
        (Ok(one), Some(other)) => format!("{}..{}", one.min(other), one.max(other)),
        _ => one,
    }
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_zero(n: &u32) -> bool {
    *n == 0
}

fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "default".into(),
        // Fractional settings are f32; in that precision text and number agree both ways.
        Value::Number(n) if n.is_f64() => format!("{}", n.as_f64().unwrap_or(f64::NAN) as f32),
        other => other.to_string(),
    }
}

fn crop(value: &Value) -> String {
    if value.is_null() {
        return "none".into();
    }
    ["x0", "y0", "x1", "y1"].map(|key| plain(&value[key])).join(",")
}

impl Manifest {
    /// Reads the manifest at `path`; `None` where there is none.
    ///
    /// Errors: `Error::Failed` if the header cannot be parsed. Rows that cannot be parsed are dropped,
    /// so that their frames are rendered again.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        read_if_there(path)?.map(|bytes| Self::of(path, &bytes)).transpose()
    }

    /// The manifest in `bytes`, which were read from `path`.
    fn of(path: &Path, bytes: &[u8]) -> Result<Self> {
        let first = bytes.split(|b| *b == b'\n').next().unwrap_or_default();
        let header = header_of(first).map_err(|why| {
            Error::Failed(format!(
                "{} is not a manifest that this version of tweenray can read: {why}\n  \
                 help: tweenray render makes the sequence anew with --overwrite, or beside it with another output",
                path.display()
            ))
        })?;
        let rows = rows_in(bytes).map(|row: Row| (row.frame, row)).collect();
        Ok(Self { header, rows })
    }

    /// Reads the manifest at `path` with the rows in the part files of a running job's
    /// ranks; changes no file. `None` where there is no manifest.
    ///
    /// Errors: those of [`Self::read`].
    pub fn as_of_now(path: &Path) -> Result<Option<Self>> {
        // Parts first: a job that ends in between moves rows from them into the manifest.
        let mut pending = Vec::new();
        for part in parts::parts(path)? {
            let rows = part.rows()?;
            pending.push((part, rows));
        }
        let Some(mut manifest) = Self::read(path)? else { return Ok(None) };
        let own = pending.into_iter().filter(|(part, _)| part.is_of(&manifest.header));
        let rows: Vec<Row> = own.flat_map(|(_, rows)| rows).collect();
        manifest.rows.extend(rows.into_iter().map(|row| (row.frame, row)));
        Ok(Some(manifest))
    }

    /// Starts a new manifest at `path` with `header`, replacing a manifest of other settings and its
    /// parts. `rows` are frames that stay.
    pub fn create(path: &Path, header: &Header, rows: &[Row]) -> Result<()> {
        let mut lines = line_of(path, header)?;
        for row in rows {
            lines.extend(line_of(path, row)?);
        }
        atomic::write(path, |w| w.write_all(&lines))?;
        Self::remove_strange_parts(path, header)
    }

    /// Replaces the header and rows of the manifest at `path`, if there is one, by those that `change` returns; they
    /// must have the same settings and frames. Rows that a running job appends meanwhile stay.
    pub fn rewrite(path: &Path, change: impl FnOnce(Self) -> (Header, Vec<Row>)) -> Result<()> {
        let _turn = Turn::take(path)?;
        let io = |e| Error::io("read", path, e);
        let mut file = match File::open(path) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(()),
            file => file.map_err(io)?,
        };
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io)?;
        let (header, rows) = change(Self::of(path, &bytes)?);
        Self::create(path, &header, &rows)?;
        let mut late = bytes.split_off(whole_lines(&bytes));
        file.read_to_end(&mut late).map_err(io)?;
        late.truncate(whole_lines(&late));
        if late.is_empty() { Ok(()) } else { Journal::of(path, &header)?.append_bytes(&late) }
    }
}

/// A lock that a job holds while it reads a manifest and replaces it. On a file system without locks no job
/// waits.
#[derive(Debug)]
pub struct Turn(#[allow(dead_code, reason = "closing it ends the turn")] File);

impl Turn {
    /// Waits for the lock of the manifest at `path`, in an existing folder.
    pub fn take(path: &Path) -> Result<Self> {
        let folder = folder_of(path);
        let file = File::open(folder).map_err(|e| Error::io("open", folder, e))?;
        // Of the folder, since the manifest itself is replaced. The system ends it with the process.
        while flock(&file, FlockOperation::LockExclusive) == Err(Errno::INTR) {}
        Ok(Self(file))
    }
}

/// The pattern's file name, without its folder.
pub fn file_name(pattern: &FramePattern) -> String {
    let whole = pattern.to_string();
    Path::new(&whole).file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Path of the manifest of a sequence: `out/frame.manifest.jsonl` for `out/frame_####.png`.
pub fn manifest_path(pattern: &FramePattern) -> PathBuf {
    beside(pattern, ENDING)
}

/// Path of a file beside the frames: the part of their names before the number, then `ending`.
pub fn beside(pattern: &FramePattern, ending: &str) -> PathBuf {
    let name = file_name(pattern);
    let stem = Path::new(&name).file_stem().unwrap_or_default().to_string_lossy();
    let prefix = stem.split('#').next().unwrap_or_default().trim_end_matches(['_', '-', '.']);
    // `####.png` has no prefix, and a name that starts with a dot would be hidden.
    let prefix = if prefix.is_empty() { "frames" } else { prefix };
    pattern.folder().join(format!("{prefix}{ending}"))
}

/// The header in `line`, or why it cannot be parsed.
fn header_of(line: &[u8]) -> std::result::Result<Header, String> {
    let value: Value = serde_json::from_slice(line).map_err(|e| e.to_string())?;
    match value["manifest"].as_u64() {
        Some(version) if version != u64::from(FORMAT) => {
            Err(format!("it has version {version} of the format, this one writes version {FORMAT}"))
        }
        _ => serde_json::from_value(value).map_err(|e| e.to_string()),
    }
}

/// The header of the file at `path`, if that is a manifest.
fn header_at(path: &Path) -> Option<Header> {
    let mut line = Vec::new();
    BufReader::new(File::open(path).ok()?).read_until(b'\n', &mut line).ok()?;
    header_of(&line).ok()
}

/// Number of bytes in complete lines.
fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|b| *b == b'\n').map_or(0, |at| at + 1)
}

fn rows_in<T: DeserializeOwned>(bytes: &[u8]) -> impl Iterator<Item = T> + '_ {
    // Without its line feed the last line is torn, even if it happens to parse.
    let lines = bytes.split_inclusive(|b| *b == b'\n').filter(|l| l.ends_with(b"\n"));
    lines.filter_map(|line| serde_json::from_slice(line).ok())
}

/// The folder of `path`; `.` for the working folder.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

fn line_of(path: &Path, value: &impl Serialize) -> Result<Vec<u8>> {
    let mut line = serde_json::to_vec(value).map_err(|e| Error::io("write", path, e.into()))?;
    line.push(b'\n');
    Ok(line)
}

fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>> {
    match fs::read(path) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(Error::io("read", path, e)),
    }
}
