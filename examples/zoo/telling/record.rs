//! The figures of one scene, without its pictures.

use crate::judging::{FrameFigures, Verdict};
use crate::making::{Label, Settings};
use serde::Serialize;

/// Over the lines of [`Told::line`].
pub const HEAD: &str = "index family          move      spp,light    dB  RMSE inf/traced  worst tile inf/traced    \
                        >16, %    flicker inferred  speed  audit   kept";

/// A scene's figures.
#[derive(Serialize)]
pub struct Told {
    #[serde(flatten)]
    pub label: Label,
    pub spp: String,
    pub light: usize,
    pub frames: Vec<Frame>,
    pub flicker: Option<[f64; 2]>,
    pub flicker_ratio: Option<f64>,
    /// Share of points inferred, seen directly and in mirrors or glass.
    pub inferred: [Option<f64>; 2],
    /// Seconds of the surface job and of the off job.
    pub cpu_seconds: [f64; 2],
    pub wall_seconds: [f64; 2],
    /// Of these, reading the scene and building the tree.
    pub before_frames_seconds: [f64; 2],
    /// Off over surface, CPU.
    pub speed: f64,
    pub audit: Option<Audit>,
    /// Decibels by which a range of camera samples is nearer to the truth than uniform samples of as many rays,
    /// inferred and traced.
    pub gains: Option<[f64; 2]>,
    pub worst_tile: Option<WorstTile>,
}

/// An in-between frame's figures.
#[derive(Serialize)]
pub struct Frame {
    pub frame: usize,
    pub db: f64,
    pub rmse_inferred: f64,
    pub rmse_traced: f64,
    pub far_off: [f64; 2],
    pub keeps_strictly: bool,
    pub keeps: bool,
    /// By how many deviations independent traces of it exceed what others predict, in the worst tile.
    pub chance: Vec<f64>,
    /// How many of them break their bound.
    pub chance_breaks: usize,
    pub is_visibly_worse: bool,
    /// Tiles that break the contract: strictly, with the allowance; and all.
    pub tiles_broken: [usize; 2],
    pub tiles: usize,
}

/// The audit, and what is true.
#[derive(Serialize)]
pub struct Audit {
    pub rmse: [f64; 3],
    pub truly: f64,
    pub holds: bool,
    pub rmse_traced: [f64; 3],
    pub traced_truly: f64,
}

/// The tile that exceeds the contract most.
#[derive(Serialize)]
pub struct WorstTile {
    pub frame: usize,
    /// Column and row, in tiles.
    pub place: [usize; 2],
    pub rmse_inferred: f64,
    pub rmse_traced: f64,
    pub rmse_bound: f64,
}

impl Frame {
    fn new(f: &FrameFigures) -> Self {
        let broken = |keeps: fn(&crate::judging::Tile) -> bool| {
            f.tiles.iter().filter(|tile| !keeps(tile)).count()
        };
        Self {
            frame: f.frame,
            db: f.db(),
            rmse_inferred: f.inferred,
            rmse_traced: f.traced,
            far_off: f.far_off,
            keeps_strictly: f.keeps_strictly(),
            keeps: f.keeps(),
            chance: f.chance().to_vec(),
            chance_breaks: f.chance_breaks(),
            is_visibly_worse: f.is_visibly_worse(),
            tiles_broken: [broken(|t| t.keeps_strictly()), broken(|t| t.keeps())],
            tiles: f.tiles.len(),
        }
    }
}

impl Told {
    /// The verdict's figures.
    pub fn new(label: Label, settings: Settings, verdict: &Verdict) -> Self {
        let jobs = &verdict.jobs;
        Self {
            label,
            spp: settings.camera_samples(),
            light: settings.light,
            frames: verdict.frames.iter().map(Frame::new).collect(),
            flicker: verdict.flicker,
            flicker_ratio: verdict.flicker_ratio(),
            inferred: verdict.inferred_share,
            cpu_seconds: jobs.each_ref().map(|job| job.cpu),
            wall_seconds: jobs.each_ref().map(|job| job.wall),
            before_frames_seconds: jobs.each_ref().map(|job| job.before_frames()),
            speed: verdict.speed(),
            audit: verdict.audit.as_ref().map(|audit| Audit {
                rmse: audit.shown,
                truly: audit.shown_truly,
                holds: audit.holds(),
                rmse_traced: audit.traced,
                traced_truly: audit.traced_truly,
            }),
            gains: verdict.equal_rays.map(|equal| equal.gains()),
            worst_tile: verdict.worst_tile().map(|(frame, tile)| WorstTile {
                frame,
                place: tile.place,
                rmse_inferred: tile.inferred.sqrt(),
                rmse_traced: tile.traced.sqrt(),
                rmse_bound: tile.bound.sqrt(),
            }),
        }
    }

    /// The frame that is worst against tracing.
    pub fn worst(&self) -> Option<&Frame> {
        self.frames.iter().min_by(|a, b| a.db.total_cmp(&b.db))
    }

    /// How far the worst tile exceeds what tracing has, display steps.
    pub fn tile_excess(&self) -> f64 {
        let of = |t: &WorstTile| t.rmse_inferred - t.rmse_traced.max(crate::judging::FLOOR);
        self.worst_tile.as_ref().map_or(0.0, of)
    }

    /// One line.
    pub fn line(&self) -> String {
        let percent = |x: f64| 100.0 * x;
        let share = |x: Option<f64>| x.map_or("  -".into(), |x| format!("{:3.0}", percent(x)));
        let tile = self.worst_tile.as_ref().map_or(String::new(), |t| {
            let [x, y] = t.place;
            format!("{:6.2}/{:<5.2} f{} {x},{y}", t.rmse_inferred, t.rmse_traced, t.frame)
        });
        let Some(worst) = self.worst() else { return self.label.name.clone() };
        let audit = match &self.audit {
            None => "  -  ".into(),
            Some(a) => format!("{:5.2}{}", a.rmse[0], if a.holds { ' ' } else { '!' }),
        };
        let kept = |keeps: fn(&Frame) -> bool| self.frames.iter().filter(|f| keeps(f)).count();
        let gains = self.gains.map_or(String::new(), |[inferred, traced]| {
            format!("  against uniform {inferred:+.2} {traced:+.2} dB")
        });
        format!(
            "{:5} {:15} {:9} {:>2},{:<3} {:+8.2}  {:6.2}/{:<6.2}  {tile:24}  {:4.1}/{:<4.1} {:6.2}  {} {}  {:5.2}  {audit}  {}/{} of {}{gains}",
            self.label.index,
            self.label.name,
            self.label.kind,
            self.spp,
            self.light,
            worst.db,
            worst.rmse_inferred,
            worst.rmse_traced,
            percent(worst.far_off[0]),
            percent(worst.far_off[1]),
            self.flicker_ratio.unwrap_or(f64::NAN),
            share(self.inferred[0]),
            share(self.inferred[1]),
            self.speed,
            kept(|f| f.keeps_strictly),
            kept(|f| f.keeps),
            self.frames.len(),
        )
    }
}
