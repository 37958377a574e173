//! `[settings]`: everything that `tweenray render` can set, under the same names.

mod samples;
mod switches;

use super::at::At;
use super::number::{FrameRate, Int, Positive, Share};
use super::report::Source;
use super::time::{Time, TimeOrOff};
use super::vector::List;
use crate::error::{Diagnostic, Result};
use crate::scene::{
    self, BuildQuality, Filter, FrameRange, GlassShadows, HitRules, IntersectorKind, JobOptions,
    Rect, ReuseSettings, ToneCurve, limits,
};
use samples::Samples;
use schemars::JsonSchema;
use serde::Deserialize;
use std::path::PathBuf;
use switches::{AovName, Isa, PngBits};

/// Image columns or rows.
pub(super) type Pixels = Int<1, { limits::MAX_EDGE as i64 }>;
/// A corner of a crop.
type Corner = Int<0, { limits::MAX_EDGE as i64 }>;

/// How to render. The command line's options of the same names take precedence.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct Settings {
    /// Image width and height, pixels.
    pub size: List<Pixels, 2>,
    /// Camera samples per pixel: a number, or `[least, most]`, where a pixel takes more than the least as far as its
    /// samples, or its neighbours', differ.
    spp: Samples<1>,
    /// Pixel filter: "box", "tent", "gaussian" or "blackman-harris".
    filter: Filter,
    /// Shadow samples per area light and camera sample; 0 leaves area lights unlit. With `[least, most]` a point takes
    /// the least where all of them find the same, there and in the pixels around, else the most.
    shadow_samples: Samples<0>,
    /// Sky rays per camera sample where the sky lights the scene: a number, or `[least, most]` as for shadow samples.
    sky_samples: Samples<0>,
    /// Points on each ray through fog at which a light's scattered light is estimated; 0 leaves fog unlit.
    fog_samples: Int<0, { limits::MAX_SAMPLES as i64 }>,
    /// In scenes of more than 8 lights, look at every light at every point, not only at those that matter there.
    all_lights: bool,
    /// What light does that meets glass on its way to a surface or to fog: "opaque" glass blocks it, "straight" lets it go
    /// straight on, less what the glass reflects, tints and absorbs.
    glass_shadows: GlassShadows,
    /// Start shadow rays of smooth meshes on the smooth surface that their facets stand for, so that
    /// shadows end where the shading does.
    smooth_terminator: bool,
    /// Specular bounces after the camera ray.
    bounces: Int<0, { limits::MAX_BOUNCES as i64 }>,
    /// Mirror and glass branches that contribute less than this share are dropped.
    cutoff: Share,
    /// Seed of every random number.
    seed: Int<0, { limits::MAX_SEED as i64 }>,
    /// Factor on radiance before the tone curve.
    exposure: Positive,
    /// The most that a camera sample's radiance, times the exposure, may be in each channel before a
    /// pixel's samples are averaged: with 1 the edges of bright lamps are smooth. It removes light, also in
    /// exr files. Absent: no limit.
    clamp: Option<Positive>,
    /// Tone curve of png and ppm files: "srgb" and "linear" clip, "reinhard" and "filmic" compress
    /// highlights. exr files stay linear.
    tone: ToneCurve,
    /// Bits per channel of png files: 8 or 16.
    png_bits: PngBits,
    /// What exr frames hold beside colour. Absent: what the job's options need, which is nothing without them.
    aovs: Option<Vec<AovName>>,
    /// Intersector: "embree", or "oracle", brute force in f64, for small scenes.
    intersector: IntersectorKind,
    /// Embree's instruction set, on which the last bits of frames depend. Absent: the machine's best.
    isa: Option<Isa>,
    /// How much work Embree puts into its tree: "low" is built fastest and traced slowest, "high" the
    /// other way round.
    build_quality: BuildQuality,
    /// Whether Embree's tree takes less memory, and more time to trace.
    compact: bool,
    /// The rules that make hits trustworthy.
    rules: HitRules,
    /// Render only the pixels x0 <= x < x1, y0 <= y < y1, as `[x0, y0, x1, y1]`; row 0 is the top.
    /// Absent: all of them.
    crop: Option<At<List<Corner, 4>>>,
    /// Show pixels with a sample that is NaN, infinite or negative in magenta.
    flag_bad: bool,
    /// Whether such a sample, or inferred frames that are less accurate than traced ones and off by more than the
    /// tolerance, make the job fail (its frames are written).
    strict: bool,
    /// First and last frame to render, as `[first, last]`, counted from 1. Absent: all.
    frames: Option<At<List<Int<1, 1_000_000>, 2>>>,
    /// Where frames go, relative to the current folder: `####` stands for the frame's number, the ending
    /// (png, exr, ppm) decides the format. Absent: the command line decides.
    output: Option<At<String>>,
    /// Frames per second of the preview video.
    fps: FrameRate,
    /// Whether a preview video is made of the sequence.
    video: bool,
    /// Whether existing frames are replaced.
    overwrite: bool,
    /// Rendering threads. Absent: the cores this process may use.
    threads: Option<Int<1, { limits::MAX_THREADS as i64 }>>,
    /// File for times, rays and memory of the job, as JSON, relative to the current folder. Absent: none.
    stats: Option<PathBuf>,
    /// Time after which the job stops, counted from the program's start: "25m", "1h30m", "90s".
    /// Absent: only a Slurm job stops, 30 s before its end.
    time_limit: Option<Time>,
    /// How often references that later frames need are written to disk, so that they need not be traced
    /// again after a kill: "30s", "5m", "off". Absent: every 30 s.
    checkpoint: Option<TimeOrOff>,
    /// Most discoveries (points or pixels that one rank of an MPI job traced and others use) in one
    /// message to another rank. Absent: 100000.
    exchange: Option<Int<1, { limits::MAX_EXCHANGE as i64 }>>,
}

impl Default for Settings {
    fn default() -> Self {
        let s = scene::Settings::for_files();
        let job = JobOptions::default();
        Self {
            size: List([s.width, s.height].map(|x| Int::clamped(x.into()))),
            spp: Samples { least: s.spp, most: s.most_spp },
            filter: s.filter,
            shadow_samples: Samples::of_light(s.shadow_samples, s.least_shadow_samples),
            sky_samples: Samples::of_light(s.sky_samples, s.least_sky_samples),
            fog_samples: Int::clamped(s.fog_samples.into()),
            all_lights: s.all_lights,
            glass_shadows: s.glass_shadows,
            smooth_terminator: s.smooth_terminator,
            bounces: Int::clamped(s.bounces.into()),
            cutoff: Share(shortest(s.cutoff)),
            seed: Int::clamped(s.seed as i64),
            exposure: Positive(shortest(s.exposure)),
            clamp: None,
            tone: s.tone,
            png_bits: PngBits(s.png_bits),
            aovs: None,
            intersector: s.intersector,
            isa: None,
            build_quality: s.build_quality,
            compact: s.compact,
            rules: s.rules,
            crop: None,
            flag_bad: s.flag_bad,
            strict: job.strict,
            frames: None,
            output: None,
            fps: FrameRate(job.fps),
            video: job.video,
            overwrite: job.overwrite,
            threads: None,
            stats: None,
            time_limit: None,
            checkpoint: None,
            exchange: None,
        }
    }
}

/// The f64 with the fewest digits that rounds to `x`: 0.001 for the f32 next to it.
pub(super) fn shortest(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

impl Settings {
    /// As scene data, together with the table `[reuse]`.
    ///
    /// Errors: a crop that leaves the image or is empty.
    pub fn build(&self, source: &Source, reuse: ReuseSettings) -> Result<scene::Settings> {
        let (shadow_samples, least_shadow_samples) = self.shadow_samples.to_light();
        let (sky_samples, least_sky_samples) = self.sky_samples.to_light();
        Ok(scene::Settings {
            width: self.size.0[0].u32(),
            height: self.size.0[1].u32(),
            spp: self.spp.least,
            most_spp: self.spp.most,
            filter: self.filter,
            shadow_samples,
            least_shadow_samples,
            sky_samples,
            least_sky_samples,
            fog_samples: self.fog_samples.u32(),
            all_lights: self.all_lights,
            glass_shadows: self.glass_shadows,
            smooth_terminator: self.smooth_terminator,
            bounces: self.bounces.u32(),
            cutoff: self.cutoff.0 as f32,
            seed: self.seed.u64(),
            exposure: self.exposure.0 as f32,
            clamp: self.clamp.map(|most| most.0 as f32),
            tone: self.tone,
            png_bits: self.png_bits.0,
            aovs: self.aovs.as_ref().map(|names| names.iter().map(|n| n.0.clone()).collect()),
            intersector: self.intersector,
            isa: self.isa.as_ref().map(|isa| isa.0.clone()),
            build_quality: self.build_quality,
            compact: self.compact,
            rules: self.rules,
            reuse,
            crop: self.crop.as_ref().map(|c| self.crop(c, source)).transpose()?,
            flag_bad: self.flag_bad,
        })
    }

    fn crop(&self, crop: &At<List<Corner, 4>>, source: &Source) -> Result<Rect> {
        let [x0, y0, x1, y1] = crop.0.map(Int::u32);
        let [width, height] = self.size.0.map(Int::u32);
        if x0 < x1 && y0 < y1 && x1 <= width && y1 <= height {
            return Ok(Rect { x0, y0, x1, y1 });
        }
        let message = format!("the crop is empty or leaves the image of {width} x {height} pixels");
        let help = "crop = [x0, y0, x1, y1] with x0 < x1 and y0 < y1, row 0 at the top";
        Err(source.fault(&crop.span, message).help(help).into())
    }

    /// The options that do not decide a frame's bytes, for a shot of `shot_frames` frames.
    ///
    /// Errors: frames that the camera's move does not have, an empty output pattern.
    pub fn job(&self, source: &Source, shot_frames: u32) -> Result<JobOptions> {
        let frames = self.frames.as_ref();
        let frames = frames.map(|f| frame_range(f, source, shot_frames)).transpose()?;
        if let Some(output) = self.output.as_ref().filter(|output| output.is_empty()) {
            return Err(source.fault(&output.span, "the output pattern is empty").into());
        }
        let default = JobOptions::default();
        Ok(JobOptions {
            frames,
            output: self.output.as_ref().map(|output| output.value.clone()),
            overwrite: self.overwrite,
            strict: self.strict,
            video: self.video,
            fps: self.fps.0,
            time_limit: self.time_limit.map(|limit| limit.0),
            checkpoint: self.checkpoint.map_or(default.checkpoint, |interval| interval.0.0),
            exchange: self.exchange.map_or(default.exchange, Int::u32),
            stats: self.stats.clone(),
            threads: self.threads.map(Int::u32),
            // The command line alone has these.
            maps: default.maps,
            references: default.references,
            uploads: default.uploads,
        })
    }

    /// Place of the output pattern, for errors about it.
    pub fn output_place(&self, source: &Source) -> Option<Diagnostic> {
        self.output.as_ref().map(|output| source.fault(&output.span, ""))
    }
}

fn frame_range(
    frames: &At<List<Int<1, 1_000_000>, 2>>,
    source: &Source,
    shot_frames: u32,
) -> Result<FrameRange> {
    let [first, last] = frames.0.map(Int::u32);
    let message = if first > last {
        format!("the first frame, {first}, comes after the last, {last}")
    } else if last > shot_frames {
        format!("there is no frame {last}: the camera's move has {shot_frames}")
    } else {
        return Ok(FrameRange { first, last });
    };
    Err(source.fault(&frames.span, message).into())
}
