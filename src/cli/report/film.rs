//! The frames and their maps as pictures.

use super::Job;
use crate::error::Result;
use crate::film::{Encoding, Film, Image};
use crate::math::Rgb;
use crate::output::manifest::{MapRow, Row};
use crate::output::maps::{self, Map, MapScales};
use crate::output::{Display, read_image};
use crate::page::job::PlayerFrame;
use crate::page::{Picture, words};
use crate::scene::ToneCurve;
use crate::sequence::survey::is_whole_map;
use rayon::iter::Either;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// One frame in `every`, at most `width` pixels wide, and the numbers of those that cannot be read.
pub fn pictures(job: &Job, every: usize, width: u32) -> (Vec<PlayerFrame>, Vec<u32>) {
    let maps = offered(job);
    let chosen: Vec<&Row> = job.rows.iter().step_by(every).collect();
    // One frame that was whole and is no more, a running job's say, is no reason for no page.
    chosen.into_par_iter().partition_map(|row| match shown(job, row, &maps, width) {
        Ok(shown) => Either::Left(shown),
        Err(_) => Either::Right(row.frame),
    })
}

/// The maps that the job can have.
fn offered(job: &Job) -> Vec<Map> {
    let says = |map: &Map| match map {
        Map::Audit => job.audited().is_some(),
        Map::Samples => job.samples().is_some(),
        Map::Provenance | Map::Frame | Map::Distance => job.reuse().is_inferred(),
    };
    Map::ALL.into_iter().filter(says).collect()
}

/// The maps that the film has, with their meanings.
pub fn maps_of(job: &Job, film: &[PlayerFrame]) -> Vec<(String, String)> {
    let scales = MapScales::of(&job.settings);
    let has = |map: &Map| film.iter().any(|frame| frame.maps.contains_key(map.name()));
    let maps = Map::ALL.into_iter().filter(has);
    maps.map(|map| (map.name().into(), scales.meaning(map))).collect()
}

fn shown(job: &Job, row: &Row, wanted: &[Map], width: u32) -> Result<PlayerFrame> {
    let path = job.folder.join(&row.file);
    let settings = &job.settings;
    let display = Display { exposure: settings.exposure, tone: settings.tone };
    let image = read_image(&path)?;
    let picture = match image.encoding {
        Encoding::Srgb => Picture::jpeg(&image, width)?,
        Encoding::Linear => Picture::jpeg(&code(&image, &display), width)?,
    };
    let mut text = text(row);
    let mut pictures = BTreeMap::new();
    if image.encoding == Encoding::Linear {
        let painted = maps::of_exr(&path, &display, MapScales::of(settings))?;
        for (map, film) in painted.into_iter().filter(|(map, _)| wanted.contains(map)) {
            pictures.insert(map.name().to_string(), Picture::jpeg(&paint(&film), width)?);
        }
    } else {
        for map in wanted {
            let path = map.path(&path);
            let is_it = |kept: &&MapRow| path.file_name().is_some_and(|n| n == kept.file.as_str());
            let Some(kept) = row.maps.iter().find(is_it) else { continue };
            if job.standing.lacks_map(row.frame) && !is_whole_map(&job.folder, kept)? {
                text += &format!("; its map {} is missing or damaged", map.name());
                continue;
            }
            pictures.insert(map.name().into(), Picture::jpeg(&read_image(&path)?, width)?);
        }
    }
    Ok(PlayerFrame { number: row.frame, text, picture, maps: pictures })
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
    if let Some(samples) = row.samples {
        text += &format!(", {} camera samples a pixel", words::short(samples));
    }
    if let Some(share) = row.reuse.share() {
        text += &format!(", {} of the surface points inferred", words::percent(share));
    }
    if let Some([rmse, low, high]) = row.audit.and_then(|audit| audit.rmse) {
        let [rmse, low, high] = [rmse, low, high].map(words::short);
        text += &format!(", error {rmse}/255 ({low}–{high})");
    }
    text
}
