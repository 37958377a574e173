//! Makes lights of the faces of meshes that emit and are seen as they are: what reflects light too, emits by an image, has
//! cut-outs, or has more faces than import replaces by lights.
//!
//! A face is one light, of the mean of what it emits, holes included. Where an image or holes make that differ within a face, the face is cut into rows
//! of smaller triangles, those first whose parts differ most. So light is right from far away, and near by up to what differs
//! within one part.
//!
//! Of more faces than a mesh may have lights, neighbours that face alike are a group, and one of them sends the light of all.

use super::face_lights::{FaceLights, MOST_FACE_LIGHTS};
use super::light::{FaceLight, Light, QuadLight};
use super::{AlphaMask, Corners, LaidMask, Material, Mesh, Texture, TextureMap};
use crate::math::{Bounds3, DVec2, DVec3, Rgb, Vec2};
use rayon::prelude::*;
use std::collections::BinaryHeap;

/// Most lights that faces are cut into for the sake of an image.
const MOST_PARTS: usize = 512;
/// Parts are small enough where what differs within them is this share of all.
const SMALL: f64 = 0.01;
/// Faces that together send this share of a mesh's light cast none: black that is nearly so would be thousands of lights.
const LEAST: f64 = 1e-3;
/// Most rows of points by which a part of a face with holes is averaged; up to eight times as many for a whole one of few faces.
const HOLE_ROWS: u32 = 32;
/// The golden ratio, whose multiples have fractions that lie evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// Bits of the places along each axis that groups of faces are told apart by.
const PLACE_BITS: u32 = 10;

/// Lights of `mesh`, scene space, of `material`, the first of which will be number `first` of the scene's. `None` where it
/// has none.
pub(super) fn face_lights(
    mesh: &Mesh,
    material: &Material,
    (textures, masks): (&[Texture], &[AlphaMask]),
    first: u32,
) -> Option<(FaceLights, Vec<Light>)> {
    if !material.emits() {
        return None;
    }
    let emission = Emission::of(mesh, material, (textures, masks));
    let means = emission.of_faces();
    let powers: Vec<f64> = (0..means.len()).map(|at| emission.power(at, means[at])).collect();
    let chosen = brightest(&powers, !emission.is_even());
    if chosen.is_empty() {
        return None;
    }
    if chosen.len() > MOST_FACE_LIGHTS {
        return Some(emission.of_groups(&chosen, (&means, &powers), first));
    }
    let rows = emission.rows(&chosen, powers.iter().sum());
    let mut all = FaceLights::none(means.len());
    let mut lights = Vec::new();
    let mut chosen = chosen.iter().zip(rows).peekable();
    while let Some((&at, rows)) = chosen.next() {
        all.cut(at, rows);
        let triangle = mesh.corners(at);
        let light = |corners, radiance| {
            let part = QuadLight { corners, radiance, two_sided: material.emits_back };
            Light::Face(FaceLight { part, triangle, stands_for: 1.0 })
        };
        // Two triangles of one radiance are one quad where they can be.
        let quad = chosen.peek().filter(|_| emission.is_even());
        let quad = quad.and_then(|(next, _)| {
            Some((**next, QuadLight::joined(triangle, mesh.corners(**next))?))
        });
        if let Some((next, corners)) = quad {
            all.cut(next, rows);
            all.push(Some(first + lights.len() as u32));
            lights.push(light(corners, means[at]));
            chosen.next();
            continue;
        }
        for part in parts(rows) {
            let radiance = if rows == 1 { means[at] } else { emission.mean(at, part) };
            let is_light = !radiance.cmple(Rgb::ZERO).all();
            all.push(is_light.then_some(first + lights.len() as u32));
            if is_light {
                let [a, b, c] = part.map(|(u, v)| {
                    let [a, b, c] = triangle;
                    a + (b - a) * u + (c - a) * v
                });
                lights.push(light([a, b, c, c], radiance));
            }
        }
    }
    Some((all, lights))
}

/// The faces that cast light, in their order; `may_differ` says whether they emit differently.
fn brightest(powers: &[f64], may_differ: bool) -> Vec<usize> {
    let total: f64 = powers.iter().sum();
    let mut order: Vec<usize> = (0..powers.len()).filter(|at| powers[*at] > 0.0).collect();
    if !may_differ {
        return order;
    }
    order.sort_by(|a, b| powers[*b].total_cmp(&powers[*a]).then(a.cmp(b)));
    let mut sum = 0.0;
    let is_enough = |at: &usize| {
        sum += powers[*at];
        sum >= (1.0 - LEAST) * total
    };
    let count = order.iter().position(is_enough).map_or(order.len(), |last| last + 1);
    order.truncate(count);
    order.sort_unstable();
    order
}

/// What the faces of a mesh emit.
struct Emission<'m> {
    mesh: &'m Mesh,
    colour: Rgb,
    /// Whether backs emit too.
    two_sided: bool,
    /// The image that multiplies it, and the coordinates of that.
    image: Option<(&'m Texture, &'m TextureMap)>,
    /// Where there is a surface at all.
    mask: Option<LaidMask<'m>>,
}

/// Weights of the second and third corner of a triangle, at the corners of a part of it.
type Part = [(f64, f64); 3];

const WHOLE: Part = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];

impl<'m> Emission<'m> {
    fn of(
        mesh: &'m Mesh,
        material: &'m Material,
        (textures, masks): (&'m [Texture], &'m [AlphaMask]),
    ) -> Self {
        let laid = |map: &'m TextureMap| LaidMask { mask: &masks[map.image as usize], map };
        let mask = material.alpha.as_ref().map(laid);
        let image = material.emission_map.as_ref();
        let image = image.map(|map| (&textures[map.image as usize], map));
        let two_sided = material.emits_back;
        match image {
            // Rays see the lower left corner.
            Some((image, map)) if mesh.uv_set(map.uv_set).is_none() => {
                let seen = image.levels()[0].bilinear(map.wrap, map.place(Vec2::ZERO));
                Self { colour: material.emission * seen, image: None, mask, mesh, two_sided }
            }
            _ => Self { colour: material.emission, image, mask, mesh, two_sided },
        }
    }

    /// Whether every point emits the same.
    fn is_even(&self) -> bool {
        self.image.is_none() && self.mask.is_none()
    }

    /// The mean radiance of each face; 0 of those without an area.
    fn of_faces(&self) -> Vec<Rgb> {
        let mean = |at| if self.area(at) > 0.0 { self.mean(at, WHOLE) } else { Rgb::ZERO };
        (0..self.mesh.triangles.len()).into_par_iter().map(mean).collect()
    }

    fn area(&self, at: usize) -> f64 {
        let [a, b, c] = self.mesh.corners(at);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Area times the sum of the colours of `radiance`, of face `at`.
    fn power(&self, at: usize, radiance: Rgb) -> f64 {
        let power = self.area(at) * f64::from(radiance.max(Rgb::ZERO).element_sum());
        // A light of no number stays one, so that it is noticed.
        if radiance.is_finite() { power } else { self.area(at) }
    }

    /// The mean radiance of a part of face `at`: of many points in rows, looked up where texels are about as far apart.
    fn mean(&self, at: usize, part: Part) -> Rgb {
        if let Some(mask) = &self.mask {
            return self.mean_there(at, part, mask);
        }
        let Some((image, map)) = self.image else { return self.colour };
        let Some(uvs) = self.mesh.uv_set(map.uv_set) else { return self.colour };
        let [a, b, c] = uvs.get(at, self.mesh.triangles[at]);
        let [a, b, c] = [a, b, c].map(|uv| map.transform.transform_point2(uv.as_dvec2()));
        let corners = part.map(|(u, v)| a + (b - a) * u + (c - a) * v);
        self.colour * mean_between(image, map, corners)
    }

    /// The mean radiance of a part of face `at` of what has holes: of points in rows, each anywhere in a small triangle of its
    /// own, since even rows would meet a pattern that repeats always at the same places.
    fn mean_there(&self, at: usize, part: Part, mask: &LaidMask<'_>) -> Rgb {
        let triangle = self.mesh.triangles[at];
        let corners_of = |uvs: Option<&Corners<Vec2>>| {
            uvs.map(|uvs| uvs.get(at, triangle).map(|uv| uv.as_dvec2()))
        };
        let between = |[a, b, c]: [DVec2; 3], (u, v): (f64, f64)| a + (b - a) * u + (c - a) * v;
        // Rays see a face whole that has no coordinates.
        let of_mask = corners_of(mask.uvs(self.mesh)).filter(|[a, b, c]| a != b || b != c);
        let image = self.image.map(|(image, map)| {
            // Rays see the lower left corner where there are none.
            let corners = corners_of(self.mesh.uv_set(map.uv_set)).unwrap_or_default();
            (&image.levels()[0], map, corners)
        });
        // As many as there are texels, but for a mesh of so many faces that some stand for others.
        let texels = |[a, b, c]: [DVec2; 3], size: [u32; 2]| {
            let size = DVec2::from(size.map(f64::from));
            0.5 * ((b - a) * size).perp_dot((c - a) * size).abs()
        };
        let of_part = part.map(DVec2::from);
        let share = (of_part[1] - of_part[0]).perp_dot(of_part[2] - of_part[0]).abs();
        let on_mask = of_mask.map_or(0.0, |uvs| mask.texels(texels(uvs, [1, 1])));
        let on_image = image.as_ref().map_or(0.0, |(level, map, corners)| {
            let uvs = corners.map(|uv| map.transform.transform_point2(uv));
            texels(uvs, [level.width, level.height])
        });
        let faces = self.mesh.triangles.len();
        let most = match share {
            _ if faces > MOST_FACE_LIGHTS => HOLE_ROWS / 4,
            // What a whole face sends is all that is known of it where its parts are alike.
            1.0 => HOLE_ROWS * ((MOST_PARTS / faces.max(1)).isqrt() as u32).clamp(1, 8),
            _ => HOLE_ROWS,
        };
        let wanted = 2.0 * (share * on_mask.max(on_image)).sqrt();
        // NaN counts as few.
        let rows = wanted.max(4.0).min(f64::from(most)) as u32;
        // Another stretch of the sequence in each part: a pattern may repeat from part to part.
        let start = at + (1e4 * (part[0].0 + 0.618 * part[0].1)) as usize;
        let mut sum = DVec3::ZERO;
        for (k, smaller) in parts(rows).enumerate() {
            let corners = within(part, smaller).map(DVec2::from);
            let place = between(corners, inner_point((start + k) as f64)).into();
            if of_mask.is_none_or(|uvs| mask.is_there(between(uvs, place).as_vec2())) {
                sum += match &image {
                    Some((level, map, corners)) => {
                        let uv = between(*corners, place).as_vec2();
                        level.bilinear(map.wrap, map.place(uv)).as_dvec3()
                    }
                    None => DVec3::ONE,
                };
            }
        }
        self.colour * (sum / f64::from(rows * rows)).as_vec3()
    }

    /// Lights of groups of the `chosen` faces, of these `means` and `powers`, the first of which will be number `first` of the
    /// scene's. Each group has about as much power as any other, and each is one light: a face of it with the light of all, taken
    /// by power as samples would be. So the light is right from far away, and shadow rays end on the mesh.
    fn of_groups(
        &self,
        chosen: &[usize],
        (means, powers): (&[Rgb], &[f64]),
        first: u32,
    ) -> (FaceLights, Vec<Light>) {
        let middle = |at: usize| self.mesh.corners(at).iter().sum::<DVec3>() / 3.0;
        let mut bounds = Bounds3::EMPTY;
        chosen.iter().for_each(|at| bounds.include(middle(*at)));
        let place = |at: &usize| (self.place_of(*at, middle(*at), &bounds), *at);
        let mut order: Vec<(u64, usize)> = chosen.par_iter().map(place).collect();
        order.par_sort_unstable();
        let total: f64 = chosen.iter().map(|at| powers[*at]).sum();
        // The last group may have less.
        let least = total / (MOST_FACE_LIGHTS - 1) as f64;
        let (mut all, mut lights) = (FaceLights::none(means.len()), Vec::new());
        let (mut from, mut power) = (0, 0.0);
        for to in 1..=order.len() {
            power += powers[order[to - 1].1];
            if power < least && to < order.len() {
                continue;
            }
            let group = || order[from..to].iter().map(|(_, at)| *at);
            // A share of the group's power along the order; any fixed one would prefer larger faces.
            let mut left = power * (GOLDEN * (lights.len() as f64 + 0.5)).fract();
            let is_there = |at: &usize| {
                left -= powers[*at];
                left < 0.0
            };
            let one = group().find(is_there).unwrap_or(order[to - 1].1);
            let sent: DVec3 = group().map(|at| means[at].as_dvec3() * self.area(at)).sum();
            let number = Some(first + lights.len() as u32);
            for at in group() {
                all.cut(at, 1);
                all.push(number);
            }
            let triangle = self.mesh.corners(one);
            let [a, b, c] = triangle;
            let radiance = (sent / self.area(one)).as_vec3();
            let part = QuadLight { corners: [a, b, c, c], radiance, two_sided: self.two_sided };
            let stands_for = group().map(|at| self.area(at)).sum::<f64>() / self.area(one);
            lights.push(Light::Face(FaceLight { part, triangle, stands_for }));
            (from, power) = (to, 0.0);
        }
        (all, lights)
    }

    /// Where face `at` comes in the order of groups: by the axis that its normal is nearest to and the side along that, then along
    /// a curve through the cells of `bounds` that its `middle` lies in (Morton, 1966).
    fn place_of(&self, at: usize, middle: DVec3, bounds: &Bounds3) -> u64 {
        let [a, b, c] = self.mesh.corners(at);
        let normal = (b - a).cross(c - a);
        let axis = normal.abs().max_position();
        let side = 2 * axis as u64 + u64::from(normal[axis] < 0.0);
        let extent = bounds.extent().max_element().max(f64::MIN_POSITIVE);
        let cell =
            ((middle - bounds.min) / extent * f64::from((1u32 << PLACE_BITS) - 1)).as_u64vec3();
        let mut place = side;
        for bit in (0..PLACE_BITS).rev() {
            for x in cell.to_array() {
                place = place << 1 | (x >> bit & 1);
            }
        }
        place
    }

    /// Into how many rows each of the `chosen` faces is cut, of which all send `total`.
    fn rows(&self, chosen: &[usize], total: f64) -> Vec<u32> {
        let mut rows = vec![1; chosen.len()];
        if self.is_even() || chosen.len() >= MOST_PARTS {
            return rows;
        }
        let differs = |k: usize, rows| Differs { by: self.differs(chosen[k], rows), at: k };
        let mut heap: BinaryHeap<Differs> =
            (0..chosen.len()).into_par_iter().map(|k| differs(k, 1)).collect::<Vec<_>>().into();
        let mut left: f64 = heap.iter().map(|face| face.by).sum();
        let mut count = chosen.len();
        while let Some(Differs { by, at }) = heap.pop() {
            let more = 3 * (rows[at] * rows[at]) as usize;
            if left <= SMALL * total || by == 0.0 {
                break;
            }
            if count + more > MOST_PARTS {
                continue;
            }
            count += more;
            rows[at] *= 2;
            let smaller = differs(at, rows[at]);
            left += smaller.by - by;
            heap.push(smaller);
        }
        rows
    }

    /// By how much of its power the quarters of the parts of face `at`, in `rows` rows, differ from the parts.
    fn differs(&self, at: usize, rows: u32) -> f64 {
        let area = self.area(at) / f64::from(4 * rows * rows);
        let of = |part: Part| -> f64 {
            let mut quarters = [Rgb::ZERO; 4];
            for (mean, quarter) in quarters.iter_mut().zip(parts(2)) {
                *mean = self.mean(at, within(part, quarter));
            }
            let whole = quarters.iter().sum::<Rgb>() / 4.0;
            // Of a fine pattern of holes means differ by chance, which smaller parts do not mend.
            let chance =
                if self.mask.is_some() { whole * (2.0 / HOLE_ROWS as f32) } else { Rgb::ZERO };
            let apart = |mean: &Rgb| ((*mean - whole).abs() - chance).max(Rgb::ZERO).element_sum();
            quarters.iter().map(|mean| f64::from(apart(mean)) * area).sum()
        };
        // Summed in order, whatever thread comes first.
        let all: Vec<Part> = parts(rows).collect();
        let by: f64 = all.into_par_iter().map(of).collect::<Vec<f64>>().iter().sum();
        if by.is_finite() { by } else { 0.0 }
    }
}

/// What differs within the parts of a face.
struct Differs {
    by: f64,
    at: usize,
}

impl Ord for Differs {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.by.total_cmp(&other.by).then(other.at.cmp(&self.at))
    }
}

impl PartialOrd for Differs {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Differs {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Differs {}

/// The parts of a triangle in `rows` rows, row by row from the side between the first and the third corner; each as the triangle
/// winds.
fn parts(rows: u32) -> impl Iterator<Item = Part> {
    let at = move |i: u32, j: u32| (f64::from(i) / f64::from(rows), f64::from(j) / f64::from(rows));
    (0..rows).flat_map(move |i| {
        (0..2 * (rows - i) - 1).map(move |k| {
            let j = k / 2;
            match k % 2 {
                0 => [at(i, j), at(i + 1, j), at(i, j + 1)],
                _ => [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)],
            }
        })
    })
}

/// The part `inner` of the part `outer`.
fn within(outer: Part, inner: Part) -> Part {
    let [a, b, c] = outer.map(|(u, v)| DVec2::new(u, v));
    inner.map(|(u, v)| (a + (b - a) * u + (c - a) * v).into())
}

/// Weights of the second and third corner of a triangle at point number `k` of a sequence that fills it evenly (Roberts, 2018).
fn inner_point(k: f64) -> (f64, f64) {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    let k = k + 1.0;
    let (u, v) = ((k / PLASTIC).fract(), (k / (PLASTIC * PLASTIC)).fract());
    if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) }
}

/// The mean of what `image` shows between three `corners`, in its coordinates.
fn mean_between(image: &Texture, map: &TextureMap, corners: [DVec2; 3]) -> Rgb {
    const TEXELS: f64 = 256.0;
    let levels = image.levels();
    let size = DVec2::new(f64::from(levels[0].width), f64::from(levels[0].height));
    let [a, b, c] = corners;
    let texels = 0.5 * ((b - a) * size).perp_dot((c - a) * size).abs();
    // A level down has a quarter of them.
    let down = (0..levels.len() - 1).find(|level| texels / 4f64.powi(*level as i32) <= TEXELS);
    let down = down.unwrap_or(levels.len() - 1);
    let covered = texels / 4f64.powi(down as i32);
    let rows = (2.0 * covered).sqrt().ceil().clamp(2.0, 2.0 * TEXELS.sqrt()) as u32;
    let points = parts(rows).map(|part| {
        let (u, v) = part.iter().fold((0.0, 0.0), |sum, w| (sum.0 + w.0 / 3.0, sum.1 + w.1 / 3.0));
        let uv = map.wrapped(a + (b - a) * u + (c - a) * v);
        levels[down].bilinear(map.wrap, uv).as_dvec3()
    });
    (points.sum::<DVec3>() / f64::from(rows * rows)).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_fill_a_triangle_and_are_found_by_their_weights() {
        for rows in [1, 2, 4, 8, 16] {
            let mut lights = FaceLights::none(1);
            lights.cut(0, rows);
            (0..rows * rows).for_each(|number| lights.push(Some(number)));
            let mut area = 0.0;
            for (number, part) in parts(rows).enumerate() {
                let [a, b, c] = part.map(DVec2::from);
                let own = 0.5 * (b - a).perp_dot(c - a);
                assert!(own > 0.0, "part {number} of {rows} rows winds the other way");
                area += own;
                // Its middle, and points next to its corners.
                for weights in [[1.0, 1.0, 1.0], [9.0, 0.5, 0.5], [0.5, 9.0, 0.5], [0.5, 0.5, 9.0]]
                {
                    let [i, j, k] = weights;
                    let p = (a * i + b * j + c * k) / (i + j + k);
                    assert_eq!(lights.light(0, p.x, p.y), Some(number as u32), "{rows} rows");
                }
            }
            assert!((area - 0.5).abs() < 1e-12);
            for (u, v) in
                [(1.0, 1e-9), (1e-9, 1.0), (0.5, 0.5 + 1e-9), (-1e-9, 2.0), (f64::NAN, 0.3)]
            {
                assert!(lights.light(0, u, v).is_some(), "{u}, {v} of {rows} rows");
            }
        }
    }
}
