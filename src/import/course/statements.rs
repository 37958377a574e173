//! The statements of a file in the course's dialect, checked.

use super::Notes;
use crate::import::lines::{Line, Lines, Words, number, show};
use crate::import::source::Fault;
use crate::math::{DVec3, Rgb, Vec2};
use crate::scene::MaterialId;

/// The statements of a file.
#[derive(Default)]
pub(super) struct File {
    pub positions: Vec<DVec3>,
    /// Texture coordinates, one per position.
    pub uvs: Vec<Option<Vec2>>,
    pub materials: Vec<CourseMaterial>,
    pub faces: Vec<Face>,
    pub spheres: Vec<Ball>,
    pub notes: Notes,
    current: Option<MaterialId>,
    /// Whether the last statement stands inside a `material`.
    in_material: bool,
}

#[derive(Default)]
pub(super) struct CourseMaterial {
    pub diffuse: Rgb,
    pub reflective: Rgb,
    pub emitted: Rgb,
    /// Line and file name of the texture.
    pub texture: Option<(usize, String)>,
}

/// Three or four corners, indices from 0; `None` is no material.
pub(super) struct Face {
    pub corners: Vec<u32>,
    pub material: Option<MaterialId>,
    line: usize,
}

pub(super) struct Ball {
    pub centre: DVec3,
    pub radius: f64,
    pub material: Option<MaterialId>,
    line: usize,
}

type Checked<T> = std::result::Result<T, String>;

/// Reads the statements. Faces may use vertices and materials that are defined later.
pub(super) fn parse(text: &[u8]) -> Result<File, Fault> {
    let mut file = File::default();
    let mut lines = Lines::new(text, 1);
    while let Some(line) = lines.next_line() {
        file.statement(line).map_err(|message| Fault::new(line.number, message))?;
    }
    file.check()?;
    Ok(file)
}

impl File {
    fn statement(&mut self, line: Line<'_>) -> Checked<()> {
        let mut words = line.words();
        let Some(keyword) = words.value() else { return Ok(()) };
        let inside = matches!(
            keyword,
            b"diffuse" | b"reflective" | b"emitted" | b"roughness" | b"texture_file"
        );
        if inside {
            return self.of_material(keyword, words, line.number);
        }
        self.in_material = false;
        match keyword {
            b"material" => {
                none_left(keyword, words)?;
                self.materials.push(CourseMaterial::default());
                self.in_material = true;
            }
            b"m" => {
                let [n] = numbers(keyword, words)?;
                if n.fract() != 0.0 || !(0.0..1e9).contains(&n) {
                    return Err(format!("`m {n}`: materials count 0, 1, 2..."));
                }
                self.current = Some(n as MaterialId);
            }
            b"v" => {
                self.positions.push(DVec3::from_array(numbers(keyword, words)?));
                self.uvs.push(None);
            }
            b"vt" => {
                let [u, v] = numbers(keyword, words)?;
                let last = self.uvs.last_mut().ok_or("`vt` before the first `v`")?;
                *last = Some(Vec2::new(u as f32, v as f32));
            }
            b"f" => self.face(words, line.number)?,
            b"s" => {
                let [x, y, z, radius] = numbers(keyword, words)?;
                if radius <= 0.0 {
                    return Err(format!("a sphere of radius {radius}"));
                }
                let (centre, material) = (DVec3::new(x, y, z), self.current);
                self.spheres.push(Ball { centre, radius, material, line: line.number });
            }
            _ => {
                return Err(format!(
                    "`{}` is not a statement of the course's dialect",
                    show(keyword)
                ));
            }
        }
        Ok(())
    }

    fn of_material(&mut self, keyword: &[u8], words: Words<'_>, line: usize) -> Checked<()> {
        let material = self.materials.last_mut().filter(|_| self.in_material);
        let material =
            material.ok_or_else(|| format!("`{}` outside of a `material`", show(keyword)))?;
        match keyword {
            b"diffuse" => material.diffuse = colour(keyword, words, 1.0)?,
            b"reflective" => material.reflective = colour(keyword, words, 1.0)?,
            b"emitted" => material.emitted = colour(keyword, words, f64::from(f32::MAX))?,
            b"texture_file" => {
                let name = String::from_utf8_lossy(words.rest()).into_owned();
                if name.is_empty() {
                    return Err("`texture_file` without a name".into());
                }
                material.texture = Some((line, name));
            }
            _ => {
                let [roughness] = numbers(keyword, words)?;
                if roughness < 0.0 {
                    return Err(format!("`roughness {roughness}` is negative"));
                }
                if roughness > 0.0 && material.reflective != Rgb::ZERO {
                    self.notes.add("a rough mirror is rendered as a perfect one", line);
                }
            }
        }
        Ok(())
    }

    fn face(&mut self, mut words: Words<'_>, line: usize) -> Checked<()> {
        let mut corners = Vec::with_capacity(4);
        while let Some(word) = words.value() {
            let index = number(word)?;
            if index.fract() != 0.0 || !(1.0..4e9).contains(&index) {
                return Err(format!("vertex index `{}`: indices count 1, 2, 3...", show(word)));
            }
            corners.push(index as u32 - 1);
        }
        if !matches!(corners.len(), 3 | 4) {
            return Err(format!(
                "a face with {} corners; four (or three) are possible",
                corners.len()
            ));
        }
        self.faces.push(Face { corners, material: self.current, line });
        Ok(())
    }

    fn check(&self) -> Result<(), Fault> {
        let known = |material: Option<MaterialId>, line| match material {
            Some(m) if m as usize >= self.materials.len() => {
                let count = self.materials.len();
                Err(Fault::new(line, format!("material {m}, but the file has only {count}")))
            }
            _ => Ok(()),
        };
        for face in &self.faces {
            known(face.material, face.line)?;
            let count = self.positions.len();
            if let Some(i) = face.corners.iter().find(|i| **i as usize >= count) {
                let message = format!("vertex index {}, but the file has only {count}", i + 1);
                return Err(Fault::new(face.line, message));
            }
        }
        self.spheres.iter().try_for_each(|s| known(s.material, s.line))
    }
}

/// Exactly `N` finite numbers.
fn numbers<const N: usize>(keyword: &[u8], mut words: Words<'_>) -> Checked<[f64; N]> {
    let all = words;
    let mut values = [0.0; N];
    for value in &mut values {
        let word = words.value().ok_or_else(|| {
            format!("`{}` takes {N} numbers, not `{}`", show(keyword), show(all.rest()))
        })?;
        *value = number(word)?;
    }
    none_left(keyword, words)?;
    Ok(values)
}

fn none_left(keyword: &[u8], mut words: Words<'_>) -> Checked<()> {
    match words.value() {
        None => Ok(()),
        Some(word) => Err(format!("`{}` is one word too many for `{}`", show(word), show(keyword))),
    }
}

fn colour(keyword: &[u8], words: Words<'_>, max: f64) -> Checked<Rgb> {
    let values: [f64; 3] = numbers(keyword, words)?;
    if values.iter().any(|v| !(0.0..=max).contains(v)) {
        return Err(format!("`{}` outside of 0 to {max}", show(keyword)));
    }
    Ok(DVec3::from_array(values).as_vec3())
}
