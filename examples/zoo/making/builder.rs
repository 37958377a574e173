//! The text of a scene file as it grows.

use super::obj::Obj;
use glam::DVec3;
use std::fmt::Write;

/// A scene without its camera.
#[derive(Default)]
pub struct Builder {
    /// TOML.
    pub text: String,
    /// Names and contents of the files beside it.
    pub files: Vec<(String, Vec<u8>)>,
    /// Lights whose shadows take `--shadow-samples` each, the sky counted as one.
    pub soft_lights: usize,
    names: usize,
}

/// `[x, y, z]`
pub fn triple(v: DVec3) -> String {
    format!("[{:.6}, {:.6}, {:.6}]", v.x, v.y, v.z)
}

impl Builder {
    fn line(&mut self, line: &str) {
        let _ = writeln!(self.text, "{line}");
    }

    /// A name that no other material has.
    pub fn fresh_name(&mut self) -> String {
        self.names += 1;
        format!("thing{}", self.names)
    }

    /// A diffuse material.
    pub fn paint(&mut self, name: &str, diffuse: DVec3) {
        self.line(&format!("[material.{name}]\ndiffuse = {}", triple(diffuse)));
    }

    /// A material of any keys.
    pub fn material(&mut self, name: &str, keys: &str) {
        self.line(&format!("[material.{name}]\n{keys}"));
    }

    /// A constant sky.
    pub fn sky(&mut self, radiance: DVec3, lights: bool) {
        self.line(&format!("[sky]\nradiance = {}\nlights = {lights}", triple(radiance)));
        self.soft_lights += usize::from(lights);
    }

    /// No sky, but light from everywhere that nothing blocks.
    pub fn ambient(&mut self, level: f64) {
        self.line(&format!("[sky]\nambient = {level:.4}"));
    }

    /// A quad light that shines from `centre` towards `target`.
    pub fn quad_light(&mut self, [centre, target]: [DVec3; 2], size: [f64; 2], radiance: DVec3) {
        let normal = triple(target - centre);
        let [w, h] = size;
        self.line(&format!(
            "[[light]]\nquad = {{ centre = {}, normal = {normal}, size = [{w:.6}, {h:.6}], radiance = {} }}",
            triple(centre),
            triple(radiance)
        ));
        self.soft_lights += 1;
    }

    /// A sphere light.
    pub fn sphere_light(&mut self, centre: DVec3, radius: f64, radiance: DVec3) {
        self.line(&format!(
            "[[light]]\nsphere = {{ centre = {}, radius = {radius:.6}, radiance = {} }}",
            triple(centre),
            triple(radiance)
        ));
        self.soft_lights += 1;
    }

    /// A light without extent: `point = ...` or `directional = ...`.
    pub fn hard_light(&mut self, keys: &str) {
        self.line(&format!("[[light]]\n{keys}"));
    }

    /// A generated mesh: `box = ...`, `quad = ...`.
    pub fn shape(&mut self, keys: &str, material: &str) {
        self.line(&format!("[[mesh]]\n{keys}\nmaterial = \"{material}\""));
    }

    /// A level quad about `centre`.
    pub fn floor(&mut self, centre: DVec3, size: [f64; 2], material: &str) {
        let [w, d] = size;
        self.shape(
            &format!(
                "quad = {{ centre = {}, normal = \"y\", size = [{w:.4}, {d:.4}] }}",
                triple(centre)
            ),
            material,
        );
    }

    /// A parallelogram.
    pub fn wall(&mut self, corner: DVec3, edges: [DVec3; 2], material: &str) {
        let [a, b] = edges.map(triple);
        self.shape(
            &format!("quad = {{ corner = {}, edges = [{a}, {b}] }}", triple(corner)),
            material,
        );
    }

    /// An exact sphere.
    pub fn sphere(&mut self, centre: DVec3, radius: f64, material: &str) {
        self.line(&format!(
            "[[sphere]]\ncentre = {}\nradius = {radius:.6}\nmaterial = \"{material}\"",
            triple(centre)
        ));
    }

    /// A mesh of its own file, shaded smooth or flat.
    pub fn mesh(&mut self, obj: Obj, material: &str, smooth: bool) {
        let name = format!("mesh{}.obj", self.files.len());
        let normals = if smooth { "smooth" } else { "flat" };
        self.shape(&format!("file = \"{name}\"\nnormals = \"{normals}\""), material);
        self.files.push((name, obj.into_text().into_bytes()));
    }

    /// A material of a checkered texture of `squares` a side, in two colours.
    pub fn checkers(&mut self, name: &str, squares: usize, colours: [DVec3; 2]) {
        let side = squares * 16;
        let mut ppm = format!("P6\n{side} {side}\n255\n").into_bytes();
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let colour = colours[(x / 16 + y / 16) % 2];
            ppm.extend(colour.to_array().map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8));
        }
        let file = format!("{name}.ppm");
        self.material(name, &format!("texture = \"{file}\""));
        self.files.push((file, ppm));
    }
}
