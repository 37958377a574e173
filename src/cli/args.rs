//! Options that take precedence over the scene file: what to render and how.

mod job;

pub use job::JobArgs;

use super::values::{self, Clamp, SampleNumber};
use crate::import::{LoadOptions, UpAxis};
use crate::scene::{
    Aovs, BuildQuality, Filter, GlassShadows, IntersectorKind, Policy, Recheck, Rect,
    ReuseSettings, Settings, ToneCurve, limits,
};
use clap::Args;
use std::path::PathBuf;

/// The scene and how to read it.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// Scene file (.toml), or a bare mesh (.obj, .ply, .glb, .gltf), which the camera then orbits once; a glTF
    /// file with a camera is seen by that
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Which axis of a bare mesh points up [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::choice::<UpAxis>(&["x", "y", "z"]))]
    pub up: Option<UpAxis>,
    /// Factor on the coordinates of a bare mesh [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = values::within(limits::FACTOR))]
    pub scale: Option<f64>,
    /// Camera of a glTF file: the name of a node or camera, or a number from 0 [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Time at which animated meshes of a glTF file stand, seconds: the scene is static [default: 0]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::within(limits::TIME))]
    pub time: Option<f64>,
    /// Frames per second of the video, and of the camera's move in a glTF file [default: 24]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::within(limits::FPS))]
    pub fps: Option<f64>,
}

impl SceneArgs {
    /// Options for the importer; `size` is the image size of the command line.
    pub fn load_options(&self, size: Option<(u32, u32)>) -> LoadOptions {
        let default = LoadOptions::default();
        LoadOptions {
            up: self.up.unwrap_or(default.up),
            scale: self.scale.unwrap_or(default.scale),
            size,
            camera: self.camera.clone(),
            time: self.time,
            fps: self.fps.unwrap_or(default.fps),
        }
    }
}

/// Everything that decides a frame's bytes; without an option the scene file's value is used.
#[derive(Debug, Default, Args)]
#[command(next_help_heading = "Image")]
pub struct SettingArgs {
    /// Image size in pixels [default: 640x360]
    #[arg(long, value_name = "WxH", value_parser = values::size)]
    pub size: Option<(u32, u32)>,
    /// Render only these pixels of the image (upper left corner is 0,0; x1 and y1 are excluded)
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = values::crop)]
    pub crop: Option<Rect>,
    /// Camera samples per pixel: a number, or the least and the most, as in 4..16, where a pixel takes
    /// more than the least as far as its samples, or its neighbours', differ [default: 4..16]
    #[arg(long, value_name = "N|MIN..MAX", allow_negative_numbers = true, value_parser = values::camera_samples)]
    pub spp: Option<SampleNumber>,
    /// Pixel filter [default: box]
    #[arg(long, value_name = "FILTER",
        value_parser = values::choice::<Filter>(&["box", "tent", "gaussian", "blackman-harris"]))]
    pub filter: Option<Filter>,
    /// Factor on radiance before the tone curve [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = values::within_f32(limits::FACTOR))]
    pub exposure: Option<f32>,
    /// Clamp each camera sample's radiance, times the exposure, to this before averaging: smoother edges
    /// of bright lamps, but too little light, in exr too; "off" [default: off]
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::clamp)]
    pub clamp: Option<Clamp>,
    /// Tone curve of png and ppm files; exr stays linear [default: srgb]
    #[arg(long, value_name = "CURVE",
        value_parser = values::choice::<ToneCurve>(&["srgb", "linear", "reinhard", "filmic"]))]
    pub tone: Option<ToneCurve>,
    /// Bits per channel of png files: 8 or 16 [default: 8]
    #[arg(long, value_name = "BITS", value_parser = png_bits)]
    pub png_bits: Option<u8>,
    /// What exr frames hold beside colour, with commas between: depth, position, normal, albedo, mesh-id and
    /// motion of first hits, samples (numbers of camera samples, with --spp MIN..MAX), the maps provenance, frame,
    /// distance and audit, the reference (traced points for --references), all, none [default: none; with
    /// --references: reference]. --maps adds the maps, and samples with --spp MIN..MAX
    #[arg(long, value_name = "LIST", value_delimiter = ',', hide_possible_values = true,
        value_parser = values::choice::<Aovs>(&Aovs::NAMES))]
    pub aovs: Vec<Aovs>,
    /// Show pixels with a sample that is NaN, infinite or negative in magenta [default: off]
    #[arg(long, value_name = "on|off", value_parser = values::switch())]
    pub flag_bad: Option<bool>,

    /// Shadow samples per area light and camera sample; 0 leaves area lights unlit. With the least and the most, as
    /// in 4..16, a point takes the least where all of them find the same, there and in the pixels around, else the
    /// most [default: 16]
    #[arg(long, value_name = "N|MIN..MAX", help_heading = "Light",
        allow_negative_numbers = true, value_parser = values::light_samples)]
    pub shadow_samples: Option<SampleNumber>,
    /// Sky rays per camera sample where the sky lights the scene: a number, or the least and the most as for shadow
    /// samples [default: 16]
    #[arg(long, value_name = "N|MIN..MAX", help_heading = "Light",
        allow_negative_numbers = true, value_parser = values::light_samples)]
    pub sky_samples: Option<SampleNumber>,
    /// Points on each ray through fog at which a light's scattered light is estimated [default: 4]
    #[arg(long, value_name = "N", help_heading = "Light",
        allow_negative_numbers = true, value_parser = whole(0, limits::MAX_SAMPLES))]
    pub fog_samples: Option<u32>,
    /// What light does that meets glass on its way to a surface or to fog: it is blocked, or goes straight through
    /// [default: opaque]
    #[arg(long, value_name = "KIND", help_heading = "Light", value_parser = values::choice::<GlassShadows>(&["opaque", "straight"]))]
    pub glass_shadows: Option<GlassShadows>,
    /// Whether every point looks at every light in scenes of more than 8, not only at those that matter there
    /// [default: off]
    #[arg(long, value_name = "on|off", help_heading = "Light", value_parser = values::switch())]
    pub all_lights: Option<bool>,
    /// Specular bounces after the camera ray [default: 4]
    #[arg(long, value_name = "N", help_heading = "Light",
        allow_negative_numbers = true, value_parser = whole(0, limits::MAX_BOUNCES))]
    pub bounces: Option<u32>,
    /// Drop mirror and glass branches that contribute less than this share [default: 0.001]
    #[arg(long, value_name = "SHARE", help_heading = "Light", allow_negative_numbers = true, value_parser = values::share_f32)]
    pub cutoff: Option<f32>,
    /// Seed of every random number [default: 0]
    #[arg(long, value_name = "N", help_heading = "Light", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(0..=limits::MAX_SEED))]
    pub seed: Option<u64>,

    #[command(flatten)]
    pub reuse: ReuseArgs,

    #[command(flatten)]
    pub tracing: TracingArgs,
}

/// What frames reuse of one another.
#[derive(Debug, Default, Clone, Args)]
pub struct ReuseArgs {
    /// What frames reuse of one another: shadowing at surface points, as far as measured errors allow;
    /// the colours of pixels; or nothing [default: surface]
    #[arg(long, value_name = "POLICY", help_heading = "Reuse",
        value_parser = values::choice::<Policy>(&["surface", "colour", "off"]))]
    pub policy: Option<Policy>,
    /// Frames from one key frame to the next; choose less than the number of frames if the move may
    /// get longer [default: 128]
    #[arg(long, value_name = "FRAMES", help_heading = "Reuse",
        allow_negative_numbers = true, value_parser = whole(1, limits::MAX_SEGMENT))]
    pub segment: Option<u32>,
    /// By how many display steps (1/255) inferred pixels may be off even where traced ones are more
    /// accurate: root mean square over any tile of 32 x 32 pixels. Less is more accurate and slower
    /// [default: 0.25]
    #[arg(long, value_name = "STEPS", help_heading = "Reuse",
        allow_negative_numbers = true, value_parser = values::within_f32(limits::STEPS))]
    pub tolerance: Option<f32>,
    /// Share of the pixels of an in-between frame that are estimated and also traced: the errors found
    /// decide what is inferred [default: 0.01]
    #[arg(long, value_name = "SHARE", help_heading = "Reuse",
        allow_negative_numbers = true, value_parser = values::share_f32)]
    pub probes: Option<f32>,
    /// Colour policy: cached colours agree within this linear difference [default: 0.02]
    #[arg(long, value_name = "DIFFERENCE", help_heading = "Reuse",
        allow_negative_numbers = true, value_parser = values::within_f32(limits::AMOUNT))]
    pub colour_epsilon: Option<f32>,
    /// Colour policy: cached distances agree within this share of the distance [default: 0.02]
    #[arg(long, value_name = "SHARE", help_heading = "Reuse",
        allow_negative_numbers = true, value_parser = values::within_f32(limits::AMOUNT))]
    pub distance_epsilon: Option<f32>,
}

/// The intersector and its rules.
#[derive(Debug, Default, Clone, Args)]
pub struct TracingArgs {
    /// The intersector: Embree, or the brute-force f64 oracle for small scenes [default: embree]
    #[arg(long, value_name = "KIND", help_heading = "Tracing",
        value_parser = values::choice::<IntersectorKind>(&["embree", "oracle"]))]
    pub intersector: Option<IntersectorKind>,
    /// Embree's instruction set; frames differ in the last bits by it [default: this machine's best]
    #[arg(long, value_name = "ISA", help_heading = "Tracing",
        value_parser = limits::ISAS)]
    pub isa: Option<String>,
    /// How much work Embree puts into its tree: a better tree takes longer to build and less time to
    /// trace [default: medium]
    #[arg(long, value_name = "QUALITY", help_heading = "Tracing",
        value_parser = values::choice::<BuildQuality>(&["low", "medium", "high"]))]
    pub build_quality: Option<BuildQuality>,
    /// A tree that takes less memory and more time to trace [default: off]
    #[arg(long, value_name = "on|off", help_heading = "Tracing", value_parser = values::switch())]
    pub compact: Option<bool>,
    /// Which hits are recomputed in f64 at once; "always" gives the same picture [default: risky]
    #[arg(long, value_name = "WHICH", help_heading = "Tracing",
        value_parser = values::choice::<Recheck>(&["risky", "always", "off"]))]
    pub recheck: Option<Recheck>,
    /// Watertight traversal of Embree [default: on]
    #[arg(long, value_name = "on|off", help_heading = "Tracing", value_parser = values::switch())]
    pub robust: Option<bool>,
    /// Trace a ray a second time if it misses near a triangle or hits a back from outside
    /// [default: on]
    #[arg(long, value_name = "on|off", help_heading = "Tracing", value_parser = values::switch())]
    pub retry: Option<bool>,
    /// Start secondary rays outside the rounding error of their hit [default: on]
    #[arg(long, value_name = "on|off", help_heading = "Tracing", value_parser = values::switch())]
    pub spawn_offset: Option<bool>,
    /// Trace the scene about its own centre at unit size [default: on]
    #[arg(long, value_name = "on|off", help_heading = "Tracing", value_parser = values::switch())]
    pub recentre: Option<bool>,
}

impl SettingArgs {
    /// Overrides `settings` with the options that were given.
    pub fn apply(&self, settings: &mut Settings) {
        let s = settings;
        if let Some((width, height)) = self.size {
            (s.width, s.height) = (width, height);
        }
        if self.crop.is_some() {
            s.crop = self.crop;
        }
        if let Some(SampleNumber { least, most }) = self.spp {
            (s.spp, s.most_spp) = (least, most);
        }
        put(&mut s.filter, self.filter);
        put(&mut s.exposure, self.exposure);
        put(&mut s.clamp, self.clamp.map(|Clamp(most)| most));
        put(&mut s.tone, self.tone);
        put(&mut s.png_bits, self.png_bits);
        if !self.aovs.is_empty() {
            s.aovs = Some(self.aovs.iter().cloned().collect());
        }
        put(&mut s.flag_bad, self.flag_bad);
        if let Some(samples) = self.shadow_samples {
            (s.shadow_samples, s.least_shadow_samples) = samples.of_light();
        }
        if let Some(samples) = self.sky_samples {
            (s.sky_samples, s.least_sky_samples) = samples.of_light();
        }
        put(&mut s.fog_samples, self.fog_samples);
        put(&mut s.all_lights, self.all_lights);
        put(&mut s.glass_shadows, self.glass_shadows);
        put(&mut s.bounces, self.bounces);
        put(&mut s.cutoff, self.cutoff);
        put(&mut s.seed, self.seed);
        self.reuse.apply(&mut s.reuse);
        self.tracing.apply(s);
    }
}

impl ReuseArgs {
    fn apply(&self, s: &mut ReuseSettings) {
        put(&mut s.policy, self.policy);
        put(&mut s.segment, self.segment);
        put(&mut s.tolerance, self.tolerance);
        put(&mut s.probes, self.probes);
        put(&mut s.colour_epsilon, self.colour_epsilon);
        put(&mut s.distance_epsilon, self.distance_epsilon);
    }
}

impl TracingArgs {
    fn apply(&self, s: &mut Settings) {
        if self.isa.is_some() {
            s.isa.clone_from(&self.isa);
        }
        put(&mut s.intersector, self.intersector);
        put(&mut s.build_quality, self.build_quality);
        put(&mut s.compact, self.compact);
        put(&mut s.rules.recheck, self.recheck);
        put(&mut s.rules.robust, self.robust);
        put(&mut s.rules.retry, self.retry);
        put(&mut s.rules.spawn_offset, self.spawn_offset);
        put(&mut s.rules.recentre, self.recentre);
    }
}

/// A whole number of this range.
pub fn whole(least: u32, most: u32) -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(i64::from(least)..=i64::from(most))
}

fn png_bits(text: &str) -> Result<u8, String> {
    match text {
        "8" => Ok(8),
        "16" => Ok(16),
        _ => Err("png files have 8 or 16 bits per channel".into()),
    }
}

fn put<T: Copy>(slot: &mut T, option: Option<T>) {
    if let Some(value) = option {
        *slot = value;
    }
}
