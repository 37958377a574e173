//! Images and what else a pixel records: plain data, no behaviour beyond indexing.

use crate::math::{Rgb, Vec2, Vec3};
use crate::stats::BadSamples;
use serde::{Deserialize, Serialize};
use std::ops::Range;

mod image;
mod provenance;

pub use image::{Encoding, Image};
pub use provenance::{Provenance, ProvenanceKind};

/// A rendered image with its AOVs. Row 0 is the top; linear radiance.
///
/// ```
/// use tweenray::film::{Film, Image};
/// use tweenray::math::Rgb;
///
/// let mut film = Film::new(4, 3, false);
/// let at = film.index(3, 0);
/// film.rgb[at] = Rgb::new(2.0, 0.0, 0.0);
/// // What `measure` compares.
/// let image = Image::of_film(&film);
/// assert_eq!((image.width, image.height, image.rgb[3]), (4, 3, Rgb::new(2.0, 0.0, 0.0)));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` pixels, row by row.
    pub rgb: Vec<Rgb>,
    /// First-hit records, when asked for.
    pub gbuffer: Option<GBuffer>,
    /// How many camera samples each pixel has; `None` where all have as many.
    pub samples: Option<Vec<u32>>,
    /// Where each pixel's light comes from; `None` where every frame is traced.
    pub provenance: Option<Vec<Provenance>>,
    /// Where the audit looked, how far each pixel is from its mean of two traces, in display steps
    /// of 255, the mean of the channels, positive where the pixel is brighter; NaN elsewhere. `None`
    /// where nothing was audited. Only maps show it: what else is in a frame's files does not depend on
    /// the audit.
    pub audit: Option<Vec<f32>>,
    /// Invalid camera samples in it.
    pub bad: BadSamples,
}

/// Per-pixel first-hit record, of the camera sample nearest the pixel's middle; AOVs are never
/// averaged over samples, since an average of two surfaces is neither. World space.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GBuffer {
    /// Distance along the view axis, world units; infinity where nothing is hit.
    pub depth: Vec<f32>,
    /// Hit point, world units; zero where nothing is hit.
    pub position: Vec<Vec3>,
    /// Unit shading normal towards the viewer; zero where nothing is hit.
    pub normal: Vec<Vec3>,
    /// Diffuse albedo, textures included.
    pub albedo: Vec<Rgb>,
    /// Mesh index + 1 (analytic spheres follow the meshes); 0 where nothing is hit.
    pub mesh_id: Vec<u32>,
    /// Motion backward: where the surface, or where nothing is hit the direction, stood in the image
    /// of the shot's previous frame, less where it stands in this one. Pixels, x to the right, y up.
    /// Zero in the first frame and where it was not in front of that camera.
    pub motion: Vec<Vec2>,
}

/// One pixel's record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GPixel {
    /// See [`GBuffer::depth`].
    pub depth: f32,
    /// See [`GBuffer::position`].
    pub position: Vec3,
    /// See [`GBuffer::normal`].
    pub normal: Vec3,
    /// See [`GBuffer::albedo`].
    pub albedo: Rgb,
    /// See [`GBuffer::mesh_id`].
    pub mesh_id: u32,
}

impl GPixel {
    /// The record of a pixel where nothing is hit.
    pub const EMPTY: Self = Self {
        depth: f32::INFINITY,
        position: Vec3::ZERO,
        normal: Vec3::ZERO,
        albedo: Rgb::ZERO,
        mesh_id: 0,
    };
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32, with_gbuffer: bool) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            rgb: vec![Rgb::ZERO; n],
            gbuffer: with_gbuffer.then(|| GBuffer::new(n)),
            samples: None,
            provenance: None,
            audit: None,
            bad: BadSamples::default(),
        }
    }

    /// Mean number of camera samples of the pixels that have any; `None` where all have as many.
    pub fn mean_samples(&self) -> Option<f64> {
        let samples = self.samples.as_ref()?;
        let sum: u64 = samples.iter().map(|n| u64::from(*n)).sum();
        let pixels = samples.iter().filter(|n| **n > 0).count();
        Some(sum as f64 / pixels.max(1) as f64)
    }

    /// Index of pixel `(x, y)`.
    pub fn index(&self, x: u32, y: u32) -> usize {
        y as usize * self.width as usize + x as usize
    }
}

impl GBuffer {
    /// Records of `n` pixels where nothing is hit.
    pub fn new(n: usize) -> Self {
        Self {
            depth: vec![f32::INFINITY; n],
            position: vec![Vec3::ZERO; n],
            normal: vec![Vec3::ZERO; n],
            albedo: vec![Rgb::ZERO; n],
            mesh_id: vec![0; n],
            motion: vec![Vec2::ZERO; n],
        }
    }

    /// The records of the pixels with the indices `of`.
    pub fn part(&self, of: Range<usize>) -> Self {
        Self {
            depth: self.depth[of.clone()].to_vec(),
            position: self.position[of.clone()].to_vec(),
            normal: self.normal[of.clone()].to_vec(),
            albedo: self.albedo[of.clone()].to_vec(),
            mesh_id: self.mesh_id[of.clone()].to_vec(),
            motion: self.motion[of].to_vec(),
        }
    }

    /// Takes in the records of more pixels, behind its own.
    pub fn append(&mut self, more: Self) {
        let Self { depth, position, normal, albedo, mesh_id, motion } = more;
        self.depth.extend(depth);
        self.position.extend(position);
        self.normal.extend(normal);
        self.albedo.extend(albedo);
        self.mesh_id.extend(mesh_id);
        self.motion.extend(motion);
    }

    /// One pixel's record.
    pub fn get(&self, index: usize) -> GPixel {
        GPixel {
            depth: self.depth[index],
            position: self.position[index],
            normal: self.normal[index],
            albedo: self.albedo[index],
            mesh_id: self.mesh_id[index],
        }
    }

    /// Writes one pixel's record, which tells no motion.
    pub fn set(&mut self, index: usize, p: &GPixel) {
        self.depth[index] = p.depth;
        self.position[index] = p.position;
        self.normal[index] = p.normal;
        self.albedo[index] = p.albedo;
        self.mesh_id[index] = p.mesh_id;
    }
}
