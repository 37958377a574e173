//! The frames and their maps as pictures.

use super::Job;
use crate::error::Result;
use crate::film::{Encoding, Film, Image};
use crate::math::Rgb;
use crate::output::manifest::Row;
use crate::output::maps::{self, Map};
use crate::output::{Display, read_image};
use crate::page::job::Shown;
use crate::page::{Picture, words};
use crate::scene::{Settings, ToneCurve};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// One frame in `every`, at most `width` pixels wide. Frames whose files are gone are left out.
pub fn pictures(job: &Job, every: usize, width: u32) -> Result<Vec<Shown>> {
    let settings = serde_json::from_value(job.manifest.header.settings.clone());
    // Of another version's settings the pictures are all that is needed.
    let settings: Settings = settings.unwrap_or_default();
    let there = job.rows.iter().filter(|row| job.folder.join(&row.file).is_file());
    let chosen: Vec<&Row> = there.step_by(every).collect();
    chosen.into_par_iter().map(|row| shown(job, row, &settings, width)).collect()
}

/// The maps that the film has, with their meanings.
pub fn maps_of(film: &[Shown]) -> Vec<(String, String)> {
    let has = |map: &Map| film.iter().any(|frame| frame.maps.contains_key(map.name()));
    let maps = Map::ALL.into_iter().filter(has);
    maps.map(|map| (map.name().into(), map.meaning().into())).collect()
}

fn shown(job: &Job, row: &Row, settings: &Settings, width: u32) -> Result<Shown> {
    let path = job.folder.join(&row.file);
    let display = Display { exposure: settings.exposure, tone: settings.tone };
    let image = read_image(&path)?;
    let picture = match image.encoding {
        Encoding::Srgb => Picture::jpeg(&image, width)?,
        Encoding::Linear => Picture::jpeg(&code(&image, &display), width)?,
    };
    let mut pictures = BTreeMap::new();
    if image.encoding == Encoding::Linear {
        let painted = maps::of_exr(&path, &display, settings.reuse.farthest())?;
        for (map, film) in painted {
            pictures.insert(map.name().to_string(), Picture::jpeg(&paint(&film), width)?);
        }
    } else {
        for map in Map::ALL {
            let path = map.path(&path);
            if is_known(row, &path) {
                pictures.insert(map.name().into(), Picture::jpeg(&read_image(&path)?, width)?);
            }
        }
    }
    Ok(Shown { number: row.frame, text: text(row), picture, maps: pictures })
}

/// Whether the file at `path` is one of the frame's own maps.
fn is_known(row: &Row, path: &Path) -> bool {
    row.maps.iter().any(|map| path.file_name().is_some_and(|name| name == map.file.as_str()))
        && path.is_file()
}

/// Linear radiance as it is displayed.
fn code(image: &Image, display: &Display) -> Image {
    let code = |c: &Rgb| Rgb::from_array(display.code(*c).map(|v| v as f32));
    let rgb = image.rgb.par_iter().map(code).collect();
    Image { rgb, encoding: Encoding::Srgb, ..*image }
}

/// A painted map as it is displayed: no exposure, no curve.
fn paint(film: &Film) -> Image {
    code(&Image::of_film(film), &Display { exposure: 1.0, tone: ToneCurve::Srgb })
}

/// `Frame 12: 0.41 s, 4.1e6 rays, 98 % of the points inferred`.
fn text(row: &Row) -> String {
    let mut text = format!(
        "Frame {}: {}, {} rays",
        row.frame,
        words::seconds(row.seconds),
        words::short(row.rays.total() as f64)
    );
    if let Some(share) = row.reuse.share() {
        text += &format!(", {} of the surface points inferred", words::percent(share));
    }
    if let Some([rmse, low, high]) = row.audit.and_then(|audit| audit.rmse) {
        let [rmse, low, high] = [rmse, low, high].map(words::short);
        text += &format!(", error {rmse}/255 ({low}–{high})");
    }
    text
}
