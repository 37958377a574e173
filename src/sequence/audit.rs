//! Audits a made frame: traces the pixels that [`crate::reuse::audit`] draws, and with a bound on the
//! error the tiles that exceed it where tracing is better.
//!
//! Three draws that know nothing of one another. Judges, some in every tile, say which tiles are
//! traced; the audit proper then says how good the picture is that came of it. Were they the same
//! pixels, the tiles that stay would be those whose judges were lucky, and the picture would seem
//! better than it is.

use super::{Inferrer, Made};
use crate::error::Result;
use crate::film::{Film, PixelSource, Provenance};
use crate::math::Rgb;
use crate::output::Display;
use crate::reuse::audit::{self, Drawn, Lot, Shown, Squares};
use crate::reuse::{is_all_kept, of_frame, of_traced_pixel};
use crate::scene::Camera;
use crate::shade::{FrameJob, Reuse};
use crate::stats::{AuditSums, RayCounts, ReuseCounts};

/// Added to a frame's number (at most a million) for the random numbers of the audit's two traces.
const AUDIT: [u32; 2] = [1 << 30, 1 << 31];
/// The same for the judges'.
const JUDGES: [u32; 2] = [1 << 28, 1 << 29];
/// Edge of a tile that is judged as one.
const TILE: u32 = 32;
/// Pixels that judge a tile, two thirds of them where error is foretold. Two traces of each cost a
/// sixteenth of tracing the tile: judging every tile stays well below tracing every tile. Were a
/// tenth of a tile's pixels wrong and nothing foretold them, the eleven that are drawn blindly
/// would miss all in a third of the cases, 0.9^11; where they are foretold, in next to none.
const PER_TILE: f64 = 32.0;
/// Where few shadow rays are cast a trace is often further off than what was inferred, so a tile is
/// traced where that is better by so many standard errors. Without, noise would choose many tiles where
/// it is worse; from 1 on, a single judge that finds much would not be enough.
const SURE: f64 = 0.7;

impl Inferrer<'_> {
    /// Audits `rendered`, which is frame `frame`; traces tiles in it where the settings bound the
    /// error. Without an inferred pixel there is nothing to audit. The outer `None` when the job
    /// shall stop.
    pub(super) fn audit(
        &self,
        frame: u32,
        rendered: &mut Made,
    ) -> Result<Option<Option<AuditSums>>> {
        let settings = &self.renderer.settings.reuse;
        let inferred =
            |s: &PixelSource| !matches!(s.provenance, Provenance::Background | Provenance::Traced);
        let is_inferred = rendered.film.sources.as_ref().is_some_and(|s| s.iter().any(inferred));
        if !is_inferred || (settings.audit <= 0.0 && settings.max_rmse.is_none()) {
            return Ok(Some(None));
        }
        let camera = self.camera(frame)?;
        let work = || self.judge_and_measure(frame, &camera, rendered);
        Ok(self.pool.install(work).map(Some))
    }

    fn judge_and_measure(
        &self,
        frame: u32,
        camera: &Camera,
        rendered: &mut Made,
    ) -> Option<AuditSums> {
        let count = self.audited_pixels(rendered);
        let mut judged = AuditSums::default();
        if let Some(most) = self.renderer.settings.reuse.max_rmse {
            judged = self.judge(frame, camera, f64::from(most), rendered)?;
        }
        let shown = self.shown(&rendered.film)?;
        let lot = Lot { seed: self.renderer.settings.seed, frame, number: 0 };
        let drawn = audit::draw(&shown.foretold(), shown.pixels(), count, lot);
        let (traces, rays) = self.trace_twice(camera, frame, AUDIT, &drawn)?;
        let mut sums = audit::sums(&shown, &drawn, [&traces[0], &traces[1]]);
        sums.rays = rays;
        sums.rays += judged.rays;
        sums.tiles_traced = judged.tiles_traced;
        let mut map = vec![f32::NAN; shown.rgb.len()];
        for (k, Drawn { index, .. }) in drawn.iter().enumerate() {
            let i = *index as usize;
            map[i] = audit::difference(&shown.display, shown.rgb[i], traces[0][k], traces[1][k]);
        }
        rendered.film.audit = Some(map);
        Some(sums)
    }

    /// How many pixels cost the wanted share of the frame.
    fn audited_pixels(&self, rendered: &Made) -> f64 {
        let Made { rays, reuse, .. } = rendered;
        let r = &self.renderer;
        let cost = of_frame(rays, reuse.direct + reuse.specular);
        let pixel = 2.0 * of_traced_pixel(rays, r.scene, &r.plan, r.settings);
        f64::from(r.settings.reuse.audit) * cost / pixel
    }

    fn shown<'f>(&self, film: &'f Film) -> Option<Shown<'f>> {
        let r = &self.renderer;
        Some(Shown {
            rgb: &film.rgb,
            sources: film.sources.as_deref()?,
            width: film.width,
            crop: r.settings.crop,
            display: Display { exposure: r.settings.exposure, tone: r.settings.tone },
            everywhere: !is_all_kept(&self.channels, r.scene, &r.plan),
        })
    }

    fn trace_twice(
        &self,
        camera: &Camera,
        frame: u32,
        streams: [u32; 2],
        drawn: &[Drawn],
    ) -> Option<([Vec<Rgb>; 2], RayCounts)> {
        let place = |d: &Drawn| (d.index % camera.width, d.index / camera.width);
        let places: Vec<(u32, u32)> = drawn.iter().map(place).collect();
        let trace = |stream: u32| {
            self.renderer.render_scattered(camera, frame | stream, &places, self.stop)
        };
        // At once: few pixels would not keep all threads busy.
        let (a, b) = rayon::join(|| trace(streams[0]), || trace(streams[1]));
        let ((a, mut rays), (b, more)) = (a?, b?);
        rays += more;
        Some(([a, b], rays))
    }

    /// Traces the tiles of `rendered` whose error by their judges exceeds `most`, display steps, and
    /// that of tracing. Gives the judges' rays and the number of tiles.
    fn judge(
        &self,
        frame: u32,
        camera: &Camera,
        most: f64,
        rendered: &mut Made,
    ) -> Option<AuditSums> {
        let shown = self.shown(&rendered.film)?;
        let foretold = shown.foretold();
        let lot = |number| Lot { seed: self.renderer.settings.seed, frame, number };
        let mut drawn = Vec::new();
        let mut tiles: Vec<Tile> = Vec::new();
        for (number, mut tile) in Tile::all(camera, &shown).into_iter().enumerate() {
            let first = drawn.len();
            let among = tile.inferred.iter().copied();
            drawn.extend(audit::draw(&foretold, among, PER_TILE, lot(number as u32 + 1)));
            tile.judges = first..drawn.len();
            tiles.push(tile);
        }
        let ([a, b], rays) = self.trace_twice(camera, frame, JUDGES, &drawn)?;
        let is_better_traced = |tile: &Tile| {
            let (mut error, mut gain, mut spread) = (0.0, 0.0, 0.0);
            for k in tile.judges.clone() {
                let Drawn { index, weight } = drawn[k];
                let shown_rgb = shown.rgb[index as usize];
                let squares = Squares::of(&shown.display, shown_rgb, a[k], b[k]);
                let by_tracing = weight * (squares.error - squares.trace);
                error += weight * squares.error;
                gain += by_tracing;
                spread += by_tracing * by_tracing;
            }
            error > most * most * tile.inferred.len() as f64 && gain > SURE * spread.sqrt()
        };
        tiles.retain(is_better_traced);
        let sums = AuditSums { rays, tiles_traced: tiles.len() as u64, ..AuditSums::default() };
        self.replace(frame, camera, &tiles, rendered)?;
        Some(sums)
    }

    /// Traces the inferred pixels of `tiles` and puts them in place; what was inferred there counts as
    /// traced.
    fn replace(
        &self,
        frame: u32,
        camera: &Camera,
        tiles: &[Tile],
        rendered: &mut Made,
    ) -> Option<()> {
        if tiles.is_empty() {
            return Some(());
        }
        let film = &mut rendered.film;
        let mut mask = vec![false; film.rgb.len()];
        let indices = || tiles.iter().flat_map(|tile| tile.inferred.iter().map(|i| *i as usize));
        indices().for_each(|i| mask[i] = true);
        let job = FrameJob {
            camera,
            stream: frame,
            with_gbuffer: false,
            // Nothing is looked up, but points are counted.
            reuse: Some(Reuse { channels: &self.channels, inference: None }),
            mask: Some(&mask),
            beyond_crop: false,
        };
        let traced = self.renderer.render_job(&job, self.stop, self.progress)?;
        for i in indices() {
            film.rgb[i] = traced.film.rgb[i];
            if let Some(sources) = &mut film.sources {
                let risk = sources[i].risk;
                sources[i] =
                    PixelSource { provenance: Provenance::Traced, risk, ..PixelSource::default() };
            }
        }
        rendered.rays += traced.rays;
        // In an inferred pixel all points are. (Of more than four camera samples in a block that was
        // inferred in part, some that were two points may count as one.)
        let ReuseCounts { direct, specular, .. } = traced.reuse;
        let counts = &mut rendered.reuse;
        counts.direct_inferred = counts.direct_inferred.saturating_sub(direct);
        counts.specular_inferred = counts.specular_inferred.saturating_sub(specular);
        Some(())
    }
}

/// A tile with something inferred in it.
struct Tile {
    /// Its inferred pixels, row by row.
    inferred: Vec<u32>,
    /// Those that judge it, among all that were drawn.
    judges: std::ops::Range<usize>,
}

impl Tile {
    fn all(camera: &Camera, shown: &Shown) -> Vec<Self> {
        let across = camera.width.div_ceil(TILE);
        let mut tiles: Vec<Vec<u32>> = Vec::new();
        tiles.resize_with((across * camera.height.div_ceil(TILE)) as usize, Vec::new);
        for index in (0..shown.rgb.len() as u32).filter(|i| shown.is_inferred(*i as usize)) {
            let (x, y) = (index % camera.width, index / camera.width);
            tiles[(y / TILE * across + x / TILE) as usize].push(index);
        }
        let filled = tiles.into_iter().filter(|tile| !tile.is_empty());
        filled.map(|inferred| Self { inferred, judges: 0..0 }).collect()
    }
}
