//! Reading maps from the channels of an exr frame.

use super::{Display, Film, Map, MapScales, Provenance, ProvenanceKind, Rgb};
use crate::error::{Error, Result};
use crate::output::DEFAULT_MEMORY_LIMIT;
use crate::output::exr::{self, ExrChannels, ExrSamples};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The maps that the exr frame at `path` has, painted as for a png frame: linear display
/// values.
///
/// # Errors
/// [`Error::Io`] and [`Error::Input`] when the file cannot be read.
pub fn of_exr(path: &Path, display: &Display, scales: MapScales) -> Result<Vec<(Map, Film)>> {
    let file = File::open(path).map_err(|e| Error::io("read", path, e))?;
    let channels = exr::decode(path, BufReader::new(file), DEFAULT_MEMORY_LIMIT)?;
    let Some(film) = film_of(&channels) else { return Ok(Vec::new()) };
    let has = |map: Map| channels.list.iter().any(|channel| channel.name == map.channel_name());
    // The provenance says which pixels the two others are of.
    let is_whole = |map: &Map| match map {
        Map::Provenance | Map::Audit | Map::Samples => has(*map),
        Map::Frame | Map::Distance => has(*map) && has(Map::Provenance),
    };
    let maps = Map::ALL.into_iter().filter(is_whole);
    Ok(maps.map(|map| (map, map.paint(&film, display, scales))).collect())
}

/// The film with the data of the maps' channels, as far as there are such channels; `None` without colour.
fn film_of(channels: &ExrChannels) -> Option<Film> {
    let numbers = |name: &str| {
        let found = channels.list.iter().find(|c| c.name == name)?;
        match &found.samples {
            ExrSamples::U32(numbers) => Some(numbers),
            ExrSamples::F32(_) => None,
        }
    };
    let [r, g, b] = [channels.f32("R")?, channels.f32("G")?, channels.f32("B")?];
    let (kind, frame) = (numbers("reuse.provenance"), numbers("reuse.frame"));
    let distance = channels.f32("reuse.distance");
    let mut film = Film::new(channels.width, channels.height, false);
    film.rgb = (0..r.len()).map(|i| Rgb::new(r[i], g[i], b[i])).collect();
    let source = |i: usize| Provenance {
        kind: kind.map_or(ProvenanceKind::default(), |kind| known(kind[i])),
        frame: frame.map_or(0, |frame| frame[i]),
        distance: distance.map_or(0.0, |distance| distance[i]),
    };
    film.provenance = Some((0..r.len()).map(source).collect());
    film.audit = channels.f32("reuse.audit").map(<[f32]>::to_vec);
    film.samples = numbers("samples").cloned();
    Some(film)
}

fn known(number: u32) -> ProvenanceKind {
    use ProvenanceKind::{Both, Earlier, Later, Traced};
    [Traced, Earlier, Later, Both].into_iter().find(|p| *p as u32 == number).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{WriteOptions, write_image};
    use crate::scene::{Aovs, ToneCurve};

    #[test]
    fn an_exr_frame_gives_the_maps_that_a_png_frame_has_beside_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut film = Film::new(3, 2, false);
        film.rgb.fill(Rgb::splat(0.5));
        let source = |i: u32| Provenance { kind: known(i % 5), frame: i, distance: i as f32 / 4.0 };
        film.provenance = Some((0..6).map(source).collect());
        film.audit = Some(vec![f32::NAN, 3.0, f32::NAN, -8.0, f32::NAN, f32::NAN]);
        film.samples = Some(vec![4, 4, 9, 16, 4, 0]);
        let scales = MapScales { farthest: Some(2.0), samples: Some([4, 16]) };
        let with = |list| WriteOptions {
            aovs: Aovs::parse(list).expect("a list"),
            ..WriteOptions::default()
        };
        let path = folder.path().join("a.exr");
        write_image(&path, &film, &with("all")).expect("written");
        let display = Display { exposure: 1.0, tone: ToneCurve::Srgb };
        let maps = of_exr(&path, &display, scales).expect("read");
        assert_eq!(maps.len(), Map::ALL.len());
        for (map, painted) in maps {
            assert_eq!(painted.rgb, map.paint(&film, &display, scales).rgb, "{}", map.name());
        }
        let plain = folder.path().join("b.exr");
        for (list, expected) in [
            ("none", &[][..]),
            ("audit", &[Map::Audit]),
            ("samples", &[Map::Samples]),
            ("frame", &[]),
            ("provenance,distance", &[Map::Provenance, Map::Distance]),
        ] {
            write_image(&plain, &film, &with(list)).expect("written");
            let found = of_exr(&plain, &display, scales).expect("read");
            assert_eq!(found.iter().map(|(map, _)| *map).collect::<Vec<_>>(), expected, "{list}");
        }
    }
}
