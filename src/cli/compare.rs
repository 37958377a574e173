//! `tweenray compare`: the difference between two images or sequences.

use super::exit::{Exit, as_input};
use super::say;
use crate::error::{Error, Result};
use crate::measure::{self, Comparison, Space, Summary};
use crate::output::{self, FramePattern, manifest};
use clap::Args;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Measure how far two images, or two sequences, are apart
///
/// Gives MSE, RMSE, PSNR, SSIM, FLIP, and the largest error and where it is; of sequences, for
/// every frame and for all together. Two linear files (exr) are compared in linear radiance
/// clipped to [0, 1], any other pair in sRGB code values.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  tweenray compare reference.exr out/frame_0007.exr
  tweenray compare 'reference/frame_####.png' 'out/frame_####.png' --json
  tweenray compare reference/ out/")]
pub struct CompareArgs {
    /// The reference: an image, a pattern with ####, or a folder of frames
    #[arg(value_name = "A")]
    reference: String,
    /// What to compare with it: an image, a pattern or a folder, as the reference
    #[arg(value_name = "B")]
    other: String,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// One pair of images.
#[derive(Serialize)]
struct Pair {
    name: String,
    #[serde(flatten)]
    comparison: Comparison,
}

#[derive(Serialize)]
struct Report {
    pairs: Vec<Pair>,
    pooled: Option<Summary>,
    /// Names that only one side has; they are not compared.
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
}

/// Runs the command.
pub fn run(args: &CompareArgs) -> Result<Exit> {
    let report = compare(&args.reference, &args.other)?;
    if args.json {
        say::json(&report)?;
    } else {
        report.print()?;
    }
    Ok(Exit::Done)
}

fn compare(a: &str, b: &str) -> Result<Report> {
    let (left, right) = (images(a)?, images(b)?);
    let single = |images: &Images| matches!(images, Images::One(_));
    let (left, right) = match (left, right) {
        (Images::One(left), Images::One(right)) => {
            let pair = pair(right.display().to_string(), &left, &right)?;
            return Ok(Report {
                pairs: vec![pair],
                pooled: None,
                only_in_a: vec![],
                only_in_b: vec![],
            });
        }
        (Images::Many(left), Images::Many(right)) => (left, right),
        (left, _) => {
            let (one, many) = if single(&left) { (a, b) } else { (b, a) };
            return Err(Error::Usage(format!("{one} is one image and {many} a sequence")));
        }
    };
    let missing = |of: &Named, from: &Named| -> Vec<String> {
        from.keys().filter(|name| !of.contains_key(*name)).cloned().collect()
    };
    let (only_in_a, only_in_b) = (missing(&right, &left), missing(&left, &right));
    let both = left.iter().filter_map(|(name, path)| Some((name, path, right.get(name)?)));
    let pairs = both
        .map(|(name, left, right)| pair(name.clone(), left, right))
        .collect::<Result<Vec<Pair>>>()?;
    if pairs.is_empty() {
        return Err(Error::Usage(format!("{a} and {b} have no frame in common")));
    }
    let comparisons: Vec<Comparison> = pairs.iter().map(|p| p.comparison.clone()).collect();
    Ok(Report { pooled: measure::summarise(&comparisons), pairs, only_in_a, only_in_b })
}

fn pair(name: String, reference: &Path, other: &Path) -> Result<Pair> {
    let read = |path: &Path| output::read_image(path).map_err(as_input);
    let comparison = measure::compare(&read(reference)?, &read(other)?).map_err(|e| match e {
        Error::Usage(what) => {
            Error::Usage(format!("{} and {}: {what}", reference.display(), other.display()))
        }
        e => e,
    })?;
    Ok(Pair { name, comparison })
}

/// Files by the key that pairs them: the frame number for a pattern, the file name for a folder.
type Named = BTreeMap<String, PathBuf>;

enum Images {
    One(PathBuf),
    Many(Named),
}

/// The images of an argument: a file, a folder, or a pattern.
fn images(name: &str) -> Result<Images> {
    let path = Path::new(name);
    if path.is_dir() {
        return Ok(Images::Many(in_folder(path)?));
    }
    if path.exists() {
        return Ok(Images::One(path.to_path_buf()));
    }
    if !name.contains('#') {
        return Err(Error::Usage(format!("there is no file or folder {name}")));
    }
    let pattern = FramePattern::parse(name, 2)?;
    let whole = manifest::file_name(&pattern);
    let numbered = |(file, path): (String, PathBuf)| {
        Some((format!("frame {:>4}", frame_number(&whole, &file)?), path))
    };
    let folder = pattern.folder();
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    let found: Named = in_folder(folder)?.into_iter().filter_map(numbered).collect();
    if found.is_empty() {
        return Err(Error::Usage(format!("no file is named like {name}")));
    }
    Ok(Images::Many(found))
}

/// The frame number in the file name `file`, where the pattern has its #s.
fn frame_number(pattern: &str, file: &str) -> Option<u32> {
    let (before, rest) = pattern.split_once('#')?;
    let after = rest.trim_start_matches('#');
    let digits = file.strip_prefix(before)?.strip_suffix(after)?;
    let all = digits.bytes().all(|b| b.is_ascii_digit());
    let number = digits.parse().ok().filter(|_| all)?;
    // `frame_1.png` is no frame of `frame_####.png`.
    let width = rest.len() + 1 - after.len();
    (format!("{number:0width$}") == digits).then_some(number)
}

fn in_folder(folder: &Path) -> Result<Named> {
    let entries = fs::read_dir(folder).map_err(|e| as_input(Error::io("read", folder, e)))?;
    let image = |path: &Path| {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        ["png", "exr", "ppm", "hdr", "jpg", "jpeg"].contains(&ending.to_ascii_lowercase().as_str())
    };
    let files: Vec<PathBuf> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    let maps = maps(&files);
    let named = |path: PathBuf| Some((path.file_name()?.to_str()?.to_string(), path));
    let named = files.into_iter().filter(|p| image(p)).filter_map(named);
    Ok(named.filter(|(name, _)| !maps.contains(name)).collect())
}

/// Names of files that manifests among `files` list as maps, which are not frames. Unreadable manifests are
/// ignored.
fn maps(files: &[PathBuf]) -> BTreeSet<String> {
    let is_manifest = |path: &&PathBuf| path.to_string_lossy().ends_with(manifest::ENDING);
    let read = |path: &PathBuf| manifest::Manifest::as_of_now(path).ok().flatten();
    let found = files.iter().filter(is_manifest).filter_map(read);
    let rows = found.flat_map(|manifest| manifest.rows.into_values());
    rows.flat_map(|row| row.maps).map(|map| map.file).collect()
}

impl Report {
    fn print(&self) -> Result<()> {
        let width = self.pairs.iter().map(|p| p.name.len()).max().unwrap_or(0).max(6);
        say::result(format_args!(
            "{:width$}  {:>10} {:>10} {:>8} {:>7} {:>7}  largest error",
            "", "MSE", "RMSE", "PSNR dB", "SSIM", "FLIP"
        ))?;
        for Pair { name, comparison: c } in &self.pairs {
            let l = &c.largest;
            say::result(format_args!(
                "{name:width$}  {:>10.3e} {:>10.3e} {:>8.2} {:>7.4} {:>7.4}  {:.4} at {},{}",
                c.mse, c.rmse, c.psnr, c.ssim, c.flip, l.value, l.x, l.y
            ))?;
            if c.not_finite > 0 {
                say::warning(format_args!("{name}: {} pixels are not finite", c.not_finite));
            }
        }
        if let Some(s) = &self.pooled {
            let (l, frame) = (&s.largest.0, &self.pairs[s.largest.1].name);
            say::result(format_args!(
                "{:width$}  {:>10.3e} {:>10.3e} {:>8.2} {:>7.4} {:>7.4}  {:.4} at {},{} in {frame}",
                "all", s.mse, s.rmse, s.psnr, s.ssim, s.flip, l.value, l.x, l.y
            ))?;
        }
        let linear = self.pairs.iter().any(|p| p.comparison.space == Space::Linear);
        say::result(if linear {
            "MSE, RMSE, PSNR and largest error in linear radiance clipped to [0, 1]; SSIM and FLIP \
             in sRGB"
        } else {
            "in sRGB code values from 0 to 1"
        })?;
        for (side, names) in [("A", &self.only_in_a), ("B", &self.only_in_b)] {
            if !names.is_empty() {
                say::warning(format_args!("only {side} has {}", names.join(", ")));
            }
        }
        Ok(())
    }
}
