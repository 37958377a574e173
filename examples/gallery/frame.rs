//! Frames of scene texts: pictures and times.

use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::path::Path;
use std::sync::atomic::AtomicBool;
use tweenray::film::Film;
use tweenray::import::{LoadOptions, Loaded, load};
use tweenray::intersect;
use tweenray::output::Display;
use tweenray::scene::{Camera, Scene, Settings};
use tweenray::shade::Renderer;
use tweenray::stats::RayCounts;

/// Size of each half of a picture.
const WIDTH: u32 = 320;
const HEIGHT: u32 = 180;
/// White columns between the two halves.
const GAP: usize = 6;
/// Quality of the JPEG files, of 100.
const QUALITY: u8 = 90;

/// A scene and its first frame's camera.
pub struct Frame {
    scene: Scene,
    camera: Camera,
    settings: Settings,
}

impl Frame {
    /// The frame of the scene file `text`, whose paths are relative to `folder`.
    pub fn new(folder: &Path, text: &str) -> Self {
        Self::of_size(folder, text, (WIDTH, HEIGHT))
    }

    /// The same in another size.
    pub fn of_size(folder: &Path, text: &str, size: (u32, u32)) -> Self {
        let file = folder.join("scene.toml");
        std::fs::write(&file, text).unwrap();
        let options = LoadOptions { size: Some(size), ..LoadOptions::default() };
        let loaded = load(&file, &options).unwrap_or_else(|error| panic!("{error}\n{text}"));
        let Loaded { world, shot, mut settings, warnings, .. } = loaded;
        assert!(warnings.is_empty(), "{warnings:?}");
        (settings.width, settings.height) = size;
        let scene = world.into_scene(settings.rules.recentre).unwrap();
        let camera = shot.camera(1, size.0, size.1).unwrap();
        Self { scene, camera, settings }
    }

    pub fn pixels(&self) -> u64 {
        u64::from(self.settings.width) * u64::from(self.settings.height)
    }

    /// The film at `samples` camera samples in every pixel, the rays that it took, and CPU seconds without those of Embree's tree.
    pub fn render(&self, samples: u32) -> (Film, RayCounts, f64) {
        let settings = Settings { spp: samples, most_spp: None, ..self.settings.clone() };
        let intersector = intersect::build(&self.scene, &settings, 2).unwrap();
        let renderer = Renderer::new(&self.scene, &settings, &*intersector);
        let start = cpu_now();
        let frame = renderer.render(&self.camera, 1, false, &AtomicBool::new(false), &());
        let (film, rays) = frame.unwrap();
        (film, rays, cpu_now() - start)
    }

    /// The picture as a display shows it, three bytes a pixel.
    pub fn picture(&self, samples: u32) -> Picture {
        let (film, ..) = self.render(samples);
        let display = Display { exposure: self.settings.exposure, tone: self.settings.tone };
        let bytes = display.encode_8(&film.rgb, film.width);
        Picture { width: film.width as usize, height: film.height as usize, bytes }
    }
}

/// CPU seconds of this process.
fn cpu_now() -> f64 {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// Codes of a display, row 0 at the top.
pub struct Picture {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

/// Writes two pictures side by side.
pub fn save_beside(path: &Path, [left, right]: &[Picture; 2]) {
    let gap = vec![255; 3 * GAP];
    let mut bytes = Vec::new();
    for y in 0..left.height {
        let row = |picture: &Picture| {
            let stride = 3 * picture.width;
            picture.bytes[y * stride..(y + 1) * stride].to_vec()
        };
        bytes.extend([row(left), gap.clone(), row(right)].concat());
    }
    save(path, &Picture { width: left.width + right.width + GAP, height: left.height, bytes });
}

/// Writes a picture.
pub fn save(path: &Path, picture: &Picture) {
    let mut file = Vec::new();
    let (width, height) = (picture.width as u32, picture.height as u32);
    JpegEncoder::new_with_quality(&mut file, QUALITY)
        .write_image(&picture.bytes, width, height, ExtendedColorType::Rgb8)
        .unwrap();
    std::fs::write(path, file).unwrap();
}
