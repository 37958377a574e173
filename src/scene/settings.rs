//! Everything a job can set, resolved: scene file first, command line over it.

use super::{Aov, Aovs, ReuseSettings};
use serde::{Deserialize, Serialize};

/// The settings of a job. All of them reach the manifest, since a frame is a pure function of
/// scene, settings and frame number (threads and output places excepted, which are not here).
///
/// ```
/// use tweenray::scene::{Policy, ReuseSettings, Settings};
///
/// // The defaults are those of the command line; what is named differs from them.
/// let reuse = ReuseSettings { policy: Policy::Off, ..ReuseSettings::default() };
/// let settings = Settings { width: 1280, height: 720, reuse, ..Settings::default() };
/// assert_eq!((settings.spp, settings.region().x1), (4, 1280));
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Image columns.
    pub width: u32,
    /// Image rows.
    pub height: u32,
    /// Camera samples a pixel; where [`most_spp`](Self::most_spp) is given, the least.
    pub spp: u32,
    /// The most camera samples of a pixel: where samples differ, more than [`spp`](Self::spp) are taken. `None` if
    /// every pixel takes as many.
    #[serde(default)]
    pub most_spp: Option<u32>,
    /// Pixel filter.
    pub filter: Filter,
    /// Shadow samples per area light and camera sample; where [`least_shadow_samples`](Self::least_shadow_samples) is
    /// given, the most.
    pub shadow_samples: u32,
    /// The least shadow samples: where they all find the same, there and in the pixels around, no more are taken.
    /// `None` if every point takes all of them.
    #[serde(default)]
    pub least_shadow_samples: Option<u32>,
    /// Sky rays per camera sample where the sky lights the scene; where
    /// [`least_sky_samples`](Self::least_sky_samples) is given, the most.
    pub sky_samples: u32,
    /// The least sky rays, as [`least_shadow_samples`](Self::least_shadow_samples).
    #[serde(default)]
    pub least_sky_samples: Option<u32>,
    /// Points on each ray through fog at which a light's scattered light is estimated. In scenes of more than 8 lights that
    /// are selected, as many as for 8.
    #[serde(default)]
    pub fog_samples: u32,
    /// Look at every light at every point, however little it can send there, in scenes of many lights too.
    #[serde(default)]
    pub all_lights: bool,
    /// What light does that meets glass on its way to a surface or to fog.
    #[serde(default)]
    pub glass_shadows: GlassShadows,
    /// Start shadow rays of smooth meshes on the smooth surface, not on its facets.
    pub smooth_terminator: bool,
    /// Specular bounces after the camera ray.
    pub bounces: u32,
    /// A specular branch whose throughput (largest channel) falls below this is dropped.
    pub cutoff: f32,
    /// Seed of every random number.
    pub seed: u64,
    /// Factor on radiance before the tone curve.
    pub exposure: f32,
    /// The most that each channel of a camera sample's radiance, times the exposure, may be before a
    /// pixel's samples are averaged; `None` leaves it as it is. It makes pictures darker than the truth.
    #[serde(default)]
    pub clamp: Option<f32>,
    /// Tone curve of 8- and 16-bit files.
    pub tone: ToneCurve,
    /// Bits a channel of png files: 8 or 16.
    pub png_bits: u8,
    /// What exr frames hold beside colour; `None` for what the job's options need.
    #[serde(default)]
    pub aovs: Option<Aovs>,
    /// Which intersector.
    pub intersector: IntersectorKind,
    /// Embree's instruction set ("avx2"), or `None` for the machine's best.
    pub isa: Option<String>,
    /// How much work Embree puts into its tree. Where two triangles lie equally far, at their common
    /// edge, the tree decides which is met first.
    #[serde(default)]
    pub build_quality: BuildQuality,
    /// Whether Embree's tree takes less memory, and more time to trace.
    #[serde(default)]
    pub compact: bool,
    /// The rules that make hits trustworthy.
    pub rules: HitRules,
    /// What frames reuse of one another.
    pub reuse: ReuseSettings,
    /// Which part of the image is rendered; `None` for all of it.
    pub crop: Option<Rect>,
    /// Show pixels with an invalid sample (NaN, infinite, negative) in magenta.
    pub flag_bad: bool,
}

impl Settings {
    /// The settings of a scene file that gives none, and of a bare mesh: the [`default`](Self::default), but up to 16
    /// camera samples a pixel as far as they differ (`docs/decisions/027-adaptive-by-default.md`). In code, a number
    /// beside `..Settings::default()` means that number.
    pub fn for_files() -> Self {
        Self { most_spp: Some(16), ..Self::default() }
    }

    /// [`Self::clamp`] as radiance.
    pub fn most_radiance(&self) -> Option<f32> {
        self.clamp.map(|most| (most / self.exposure).max(f32::MIN_POSITIVE))
    }

    /// The camera samples of a pixel as text: "4", or "4..16".
    pub fn camera_samples(&self) -> String {
        self.most_spp.map_or_else(|| self.spp.to_string(), |most| format!("{}..{most}", self.spp))
    }

    /// The shadow samples of a camera sample as text: "16", or "4..16".
    pub fn shadow_sample_range(&self) -> String {
        range(self.least_shadow_samples, self.shadow_samples)
    }

    /// The sky rays of a camera sample as text, likewise.
    pub fn sky_sample_range(&self) -> String {
        range(self.least_sky_samples, self.sky_samples)
    }

    /// The most camera samples that any pixel takes.
    pub fn most_camera_samples(&self) -> u32 {
        self.most_spp.map_or(self.spp, |most| most.max(self.spp))
    }

    /// Whether exr frames hold `aov`.
    pub fn holds(&self, aov: Aov) -> bool {
        self.aovs.as_ref().is_some_and(|aovs| aovs.has(aov))
    }

    /// Number of the image's pixels.
    pub fn pixel_count(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The part of the image that is rendered.
    pub fn region(&self) -> Rect {
        self.crop.unwrap_or(Rect { x0: 0, y0: 0, x1: self.width, y1: self.height })
    }
}

fn range(least: Option<u32>, most: u32) -> String {
    least.map_or_else(|| most.to_string(), |least| format!("{least}..{most}"))
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 640,
            height: 360,
            spp: 4,
            most_spp: None,
            filter: Filter::Box,
            shadow_samples: 16,
            least_shadow_samples: None,
            sky_samples: 16,
            least_sky_samples: None,
            fog_samples: 4,
            all_lights: false,
            glass_shadows: GlassShadows::Opaque,
            smooth_terminator: true,
            bounces: 4,
            cutoff: 1e-3,
            seed: 0,
            exposure: 1.0,
            clamp: None,
            tone: ToneCurve::Srgb,
            png_bits: 8,
            aovs: None,
            intersector: IntersectorKind::Embree,
            isa: None,
            build_quality: BuildQuality::default(),
            compact: false,
            rules: HitRules::default(),
            reuse: ReuseSettings::default(),
            crop: None,
            flag_bad: false,
        }
    }
}

/// What light does that meets glass on its way to a surface or to fog.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum GlassShadows {
    /// It is blocked.
    #[default]
    Opaque,
    /// It goes straight through, less what the glass reflects, tints and absorbs.
    Straight,
}

/// Pixel filter. All are non-negative and importance-sampled, so a pixel uses its own samples only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// One pixel wide.
    Box,
    /// Triangle of radius 1 pixel.
    Tent,
    /// Gaussian of standard deviation 0.5 pixel, cut at 1.5.
    Gaussian,
    /// Blackman–Harris window of radius 1.5 pixels.
    BlackmanHarris,
}

/// How linear radiance becomes a display value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ToneCurve {
    /// Clip to [0, 1], then the sRGB transfer function.
    Srgb,
    /// Clip to [0, 1], no transfer function.
    Linear,
    /// Reinhard's `x / (1 + x)` on luminance, then sRGB (Reinhard et al., 2002).
    Reinhard,
    /// A filmic S-curve fitted to ACES (Narkowicz, 2015), then sRGB.
    Filmic,
}

/// Which intersector traces the scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntersectorKind {
    /// Embree 4.
    Embree,
    /// The f64 Möller–Trumbore path: brute force, for small scenes and for trust.
    Oracle,
}

/// How much work goes into Embree's tree.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum BuildQuality {
    /// Sorted along a space-filling curve: built fastest, traced slowest.
    Low,
    /// By the surface area heuristic.
    #[default]
    Medium,
    /// By the surface area heuristic, triangles split between boxes where that pays: built slowest,
    /// largest.
    High,
}

// `docs/architecture.md`, "Intersection: trust nothing", describes the rules; a scene file's schema has these lines.
/// The rules that make hits trustworthy: each can be switched off to see what it is worth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
#[schemars(rename = "Rules")]
pub struct HitRules {
    /// Watertight traversal of Embree.
    pub robust: bool,
    /// A second try for a camera or specular ray that misses near a triangle, or hits a back from
    /// outside.
    pub retry: bool,
    /// Which hits are recomputed in f64 at once: "risky" (grazing, slivers, near an edge; the others
    /// when shaded), "always", "off".
    pub recheck: Recheck,
    /// Start secondary rays outside the rounding error of their hit.
    pub spawn_offset: bool,
    /// Trace the scene about its own centre at unit size.
    pub recentre: bool,
}

impl Default for HitRules {
    fn default() -> Self {
        Self {
            robust: true,
            retry: true,
            recheck: Recheck::Risky,
            spawn_offset: true,
            recentre: true,
        }
    }
}

/// Which hits are recomputed in f64. `Always` and `Risky` give the same picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Recheck {
    /// Every hit, at once.
    Always,
    /// At once those that may be phantoms by Embree's error bound: grazing, on slivers, near an
    /// edge. The others when their triangle is looked at for shading.
    Risky,
    /// None: f32 numbers, phantoms included.
    Off,
}

/// Pixels `x0 <= x < x1`, `y0 <= y < y1`; row 0 is the top.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rect {
    /// First column.
    pub x0: u32,
    /// First row.
    pub y0: u32,
    /// One past the last column.
    pub x1: u32,
    /// One past the last row.
    pub y1: u32,
}

/// Frames to render, counted from 1, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameRange {
    /// First frame.
    pub first: u32,
    /// Last frame.
    pub last: u32,
}
