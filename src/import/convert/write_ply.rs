//! Writes binary little-endian PLY.

use super::flatten::{Flat, flatten};
use crate::error::{Error, Result};
use crate::import::uv_sphere;
use crate::math::{Bounds3, DVec3, Rgb, Vec2, Vec3, srgb_encode};
use crate::scene::{World, WorldMesh};
use std::io::Write;
use std::path::Path;

/// Coordinates further from the origin than this many times the world's size are written as
/// doubles: as floats, they would lose more than two of 24 bits to the distance.
const FAR: f64 = 4.0;
/// Bytes gathered before they are written.
const BUFFER: usize = 1 << 20;

/// The content of a written file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlyReport {
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Whether positions are doubles (eight bytes a coordinate) or floats.
    pub doubles: bool,
    /// Whether the vertices have normals.
    pub normals: bool,
    /// Whether the vertices have texture coordinates.
    pub uvs: bool,
    /// Whether the vertices have colours.
    pub colours: bool,
    /// Size of the file, bytes.
    pub bytes: u64,
}

/// Writes all triangles of `world` as one mesh to `out`; `file` names it in errors.
///
/// Positions are floats where that loses nothing or the world is not far from the origin, else
/// doubles. Vertices where several normals or texture coordinates meet are split. Where only
/// some meshes have normals, the others' are zero, which reads as flat; where only some have colours, the others are
/// white. Colours are sRGB: bytes, or floats where some would not fit into bytes. Spheres become 80,000
/// triangles each. Materials, textures, lights and the sky have no place in the format, and of several sets of texture
/// coordinates the first is written: without the materials nothing says what the others are for.
///
/// Errors: `Error::Io`; more than 1,431,655,764 triangles or vertices.
pub fn write_ply(world: &World, out: &mut dyn Write, file: &Path) -> Result<PlyReport> {
    let spheres = world
        .spheres
        .iter()
        .map(|s| uv_sphere(&s.name, s.centre, s.radius, 200, 201, s.material))
        .collect::<Result<Vec<WorldMesh>>>()?;
    let parts: Vec<Flat<'_>> = world.meshes.iter().chain(&spheres).map(flatten).collect();
    let mut report = PlyReport {
        vertices: parts.iter().map(|p| p.positions.len()).sum(),
        triangles: parts.iter().map(|p| p.triangles.len()).sum(),
        doubles: needs_doubles(&parts),
        normals: parts.iter().any(|p| p.normals.is_some()),
        uvs: parts.iter().any(|p| p.uvs.is_some()),
        colours: parts.iter().any(|p| p.has_colours().is_some()),
        bytes: 0,
    };
    if report.vertices.max(report.triangles) >= u32::MAX as usize / 3 {
        return Err(Error::Usage("too many triangles for one PLY file".into()));
    }
    let colours = Colours::of(&parts);
    let mut sink = Sink { out, buffer: Vec::with_capacity(BUFFER + 64), bytes: 0 };
    let written = sink.all(&parts, &report, colours);
    written.map_err(|e| Error::io("write", file, e))?;
    report.bytes = sink.bytes;
    Ok(report)
}

fn needs_doubles(parts: &[Flat<'_>]) -> bool {
    let all = || parts.iter().flat_map(|p| p.positions.iter());
    let mut bounds = Bounds3::EMPTY;
    all().for_each(|p| bounds.include(*p));
    let size = bounds.extent().max_element();
    let reach = bounds.largest_coordinate();
    let fits = reach < f64::from(f32::MAX) && size > f64::from(f32::MIN_POSITIVE) * 1e8;
    let exact = || all().all(|p| p.as_vec3().as_dvec3() == *p);
    !(fits && reach <= FAR * size || exact())
}

/// How colours are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Colours {
    None,
    Bytes,
    Floats,
}

impl Colours {
    fn of(parts: &[Flat<'_>]) -> Self {
        let of_parts = parts.iter().filter_map(Flat::has_colours);
        of_parts.fold(Self::None, |so_far, are_codes| match so_far {
            Self::Floats => Self::Floats,
            Self::None | Self::Bytes if are_codes => Self::Bytes,
            Self::None | Self::Bytes => Self::Floats,
        })
    }
}

fn header(report: &PlyReport, colours: Colours) -> String {
    let coordinate = if report.doubles { "double" } else { "float" };
    let list = |t: &str, names: &[&str]| -> String {
        names.iter().map(|name| format!("property {t} {name}\n")).collect()
    };
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\ncomment written by tweenray\n\
         element vertex {}\n",
        report.vertices
    );
    text += &list(coordinate, &["x", "y", "z"]);
    if report.normals {
        text += &list("float", &["nx", "ny", "nz"]);
    }
    if report.uvs {
        text += &list("float", &["u", "v"]);
    }
    text += &match colours {
        Colours::None => String::new(),
        Colours::Bytes => list("uchar", &["red", "green", "blue"]),
        Colours::Floats => list("float", &["red", "green", "blue"]),
    };
    text + &format!(
        "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        report.triangles
    )
}

struct Sink<'a> {
    out: &'a mut dyn Write,
    buffer: Vec<u8>,
    bytes: u64,
}

impl Sink<'_> {
    fn all(
        &mut self,
        parts: &[Flat<'_>],
        report: &PlyReport,
        colours: Colours,
    ) -> std::io::Result<()> {
        self.buffer.extend_from_slice(header(report, colours).as_bytes());
        for part in parts {
            for (i, p) in part.positions.iter().enumerate() {
                self.position(*p, report.doubles);
                if report.normals {
                    let n = part.normals.as_ref().map_or(Vec3::ZERO, |n| n[i]);
                    self.floats(&n.to_array());
                }
                if report.uvs {
                    let uv = part.uvs.as_ref().map_or(Vec2::ZERO, |uv| uv[i]);
                    self.floats(&uv.to_array());
                }
                self.colour(part.colour(i), colours);
                self.flush(BUFFER)?;
            }
        }
        let mut first = 0;
        for part in parts {
            for t in part.triangles.iter() {
                self.buffer.push(3);
                t.iter().for_each(|i| self.buffer.extend_from_slice(&(first + i).to_le_bytes()));
                self.flush(BUFFER)?;
            }
            first += part.positions.len() as u32;
        }
        self.flush(1)?;
        self.out.flush()
    }

    fn position(&mut self, p: DVec3, doubles: bool) {
        if doubles {
            p.to_array().iter().for_each(|x| self.buffer.extend_from_slice(&x.to_le_bytes()));
        } else {
            self.floats(&p.as_vec3().to_array());
        }
    }

    fn colour(&mut self, colour: Rgb, colours: Colours) {
        let shares = || colour.to_array().map(|c| srgb_encode(f64::from(c)));
        match colours {
            Colours::None => {}
            Colours::Bytes => self.buffer.extend(shares().map(|c| (255.0 * c).round() as u8)),
            Colours::Floats => self.floats(&shares().map(|c| c as f32)),
        }
    }

    fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|x| self.buffer.extend_from_slice(&x.to_le_bytes()));
    }

    /// Writes the buffer once it holds `least` bytes.
    fn flush(&mut self, least: usize) -> std::io::Result<()> {
        if self.buffer.len() >= least {
            self.out.write_all(&self.buffer)?;
            self.bytes += self.buffer.len() as u64;
            self.buffer.clear();
        }
        Ok(())
    }
}
