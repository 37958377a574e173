//! Animations: which property a channel moves, and its value at a time.

use super::accessor::Accessor;
use super::document::Document;
use super::json::Json;
use super::uri::shortened;
use crate::error::Result;
use crate::import::source::Notes;
use crate::math::{DQuat, DVec3};
use std::collections::HashMap;
use std::sync::Arc;

/// A property that can be animated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Property {
    /// Of the node of this number.
    Translation(usize),
    Rotation(usize),
    Scale(usize),
    /// Weights of morph targets.
    Weights(usize),
    /// Vertical field of view of the camera of this number.
    Yfov(usize),
}

/// How values between keys come about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Interpolation {
    Linear,
    Step,
    Cubic,
}

/// Values at times.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    /// Seconds, not decreasing; at least one.
    times: Vec<f32>,
    /// `width` numbers a time; of a cubic curve three times as many: slope before, value, slope after.
    values: Vec<f32>,
    width: usize,
    interpolation: Interpolation,
}

/// All curves of a file, by what they move.
#[derive(Debug, Default)]
pub(super) struct Animations(HashMap<Property, Arc<Curve>>);

impl Animations {
    /// The curves of all animations. Of two that move the same property the first counts.
    ///
    /// Errors: samplers that are not whole, times that are not in order.
    pub fn read(document: &Document<'_>, notes: &mut Notes) -> Result<Self> {
        let mut all = Self::default();
        let mut numbers = 0;
        for animation in document.top.list("animations")? {
            let samplers = animation.list("samplers")?;
            let mut curves = HashMap::<(usize, Option<usize>), Arc<Curve>>::new();
            for channel in animation.list("channels")? {
                let target = channel.required("target")?;
                let Some(property) = property(document, &target, notes)? else { continue };
                if all.0.contains_key(&property) {
                    let note =
                        "several animations move the same node or lens: the first one counts";
                    notes.add(note, None);
                    continue;
                }
                let sampler = channel.required("sampler")?.as_index(samplers.len(), "sampler")?;
                let width = match property {
                    Property::Translation(_) | Property::Scale(_) => Some(3),
                    Property::Rotation(_) => Some(4),
                    Property::Yfov(_) => Some(1),
                    Property::Weights(_) => None,
                };
                let curve = match curves.get(&(sampler, width)) {
                    Some(curve) => curve.clone(),
                    None => {
                        let curve = Arc::new(Curve::read(document, &samplers[sampler], width)?);
                        numbers += curve.values.len() + curve.times.len();
                        curves.insert((sampler, width), curve.clone());
                        curve
                    }
                };
                // Samplers that all read the same bytes multiply them.
                if numbers / 4 > document.bytes() {
                    let has = document.bytes();
                    let message =
                        format!("animations of {numbers} numbers, of buffers of {has} bytes");
                    return Err(samplers[sampler].fault(message).into());
                }
                all.0.insert(property, curve);
            }
        }
        Ok(all)
    }

    /// The curve of a property.
    pub fn get(&self, property: Property) -> Option<&Curve> {
        self.0.get(&property).map(Arc::as_ref)
    }

    /// The time of the first and the last key of all curves, seconds; `None` without any.
    pub fn span(&self) -> Option<[f64; 2]> {
        let spans = self.0.values().map(|curve| curve.span());
        spans.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Whether the place of a node is animated.
    pub fn moves(&self, node: usize) -> bool {
        let moving = [Property::Translation(node), Property::Rotation(node), Property::Scale(node)];
        moving.iter().any(|property| self.0.contains_key(property))
    }

    /// The curves that move node number `node`.
    pub fn of_node(&self, node: usize) -> impl Iterator<Item = &Curve> {
        let moving = [Property::Translation(node), Property::Rotation(node), Property::Scale(node)];
        moving.into_iter().filter_map(|property| self.get(property))
    }
}

/// What a channel moves; `None` of what is left out, which is noted.
fn property(
    document: &Document<'_>,
    target: &Json<'_>,
    notes: &mut Notes,
) -> Result<Option<Property>> {
    let path = target.required("path")?.as_text()?;
    if path == "pointer" {
        let Some(pointer) = target.extension("KHR_animation_pointer") else { return Ok(None) };
        return Ok(pointed_at(document, pointer.required("pointer")?.as_text()?, notes));
    }
    let Some(node) = target.index("node", document.nodes.len(), "node")? else {
        // The format leaves such a channel to extensions.
        notes.add("an animation that names no node is ignored", None);
        return Ok(None);
    };
    Ok(of_node(path, node).or_else(|| {
        notes.add(&format!("the animated `{}` of nodes is ignored", shortened(path)), None);
        None
    }))
}

fn of_node(path: &str, node: usize) -> Option<Property> {
    match path {
        "translation" => Some(Property::Translation(node)),
        "rotation" => Some(Property::Rotation(node)),
        "scale" => Some(Property::Scale(node)),
        "weights" => Some(Property::Weights(node)),
        _ => None,
    }
}

/// The property that a JSON pointer of KHR_animation_pointer means.
fn pointed_at(document: &Document<'_>, pointer: &str, notes: &mut Notes) -> Option<Property> {
    let parts: Vec<&str> = pointer.split('/').collect();
    let number = |text: &str, count: usize| text.parse::<usize>().ok().filter(|at| *at < count);
    let found = match parts[..] {
        ["", "cameras", at, "perspective", "yfov"] => {
            number(at, document.cameras.len()).map(Property::Yfov)
        }
        ["", "nodes", at, path] => {
            number(at, document.nodes.len()).and_then(|node| of_node(path, node))
        }
        _ => None,
    };
    if found.is_none() {
        // One note for a kind: numbers of materials and lights are left out.
        let kind: Vec<&str> =
            parts.iter().map(|part| if part.parse::<u64>().is_ok() { "N" } else { part }).collect();
        let kind = shortened(&kind.join("/"));
        notes.add(&format!("the animation of `{kind}` is ignored"), None);
    }
    found
}

impl Curve {
    /// The curve of a sampler, of `width` numbers a key; of as many as there are where `None`.
    fn read(document: &Document<'_>, sampler: &Json<'_>, width: Option<usize>) -> Result<Self> {
        let interpolation = match sampler.text("interpolation")? {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(other) => {
                let message = format!("`{}` is no interpolation", shortened(other));
                return Err(sampler.fault(message).into());
            }
        };
        let input = Accessor::open(document, &sampler.required("input")?)?;
        let times = input.finite::<1>()?.into_flattened();
        if times.is_empty() || times.windows(2).any(|pair| pair[1] < pair[0]) {
            return Err(input.fault("times of keys: none, or not in order").into());
        }
        let output = Accessor::open(document, &sampler.required("output")?)?;
        let values = output.scalars()?;
        let parts = if interpolation == Interpolation::Cubic { 3 } else { 1 };
        let per_key = width.map_or(values.len() / times.len(), |width| width * parts);
        if per_key == 0 || per_key % parts != 0 || per_key * times.len() != values.len() {
            let (keys, has) = (times.len(), values.len());
            let message = format!("{has} numbers for {keys} keys, which take {per_key} each");
            return Err(output.fault(message).into());
        }
        Ok(Self { times, values, width: per_key / parts, interpolation })
    }

    /// The time of the first and the last key, seconds.
    pub fn span(&self) -> [f64; 2] {
        [self.times[0], self.times[self.times.len() - 1]].map(f64::from)
    }

    /// The numbers at `time`; before the first key those of the first, after the last those of the last.
    pub fn at(&self, time: f64) -> Vec<f64> {
        let (left, right, s) = self.around(time);
        if left == right || self.interpolation == Interpolation::Step {
            return self.key(left).collect();
        }
        if self.interpolation == Interpolation::Linear {
            let pairs = self.key(left).zip(self.key(right));
            return pairs.map(|(a, b)| a + (b - a) * s).collect();
        }
        let width = f64::from(self.times[right]) - f64::from(self.times[left]);
        let (s2, s3) = (s * s, s * s * s);
        // Weights of the Hermite cubic.
        let (value, slope) = (2.0 * s3 - 3.0 * s2 + 1.0, (s3 - 2.0 * s2 + s) * width);
        let (next, next_slope) = (3.0 * s2 - 2.0 * s3, (s3 - s2) * width);
        let here = self.key(left).zip(self.part(left, 2));
        let there = self.key(right).zip(self.part(right, 0));
        here.zip(there)
            .map(|((p, m), (q, n))| p * value + m * slope + q * next + n * next_slope)
            .collect()
    }

    /// The vector at `time`.
    pub fn vector(&self, time: f64) -> DVec3 {
        let numbers = self.at(time);
        DVec3::new(numbers[0], numbers[1], numbers[2])
    }

    /// The rotation at `time`; between keys along the shorter great circle (Shoemake, 1985).
    pub fn rotation(&self, time: f64) -> DQuat {
        let quaternion = |n: &[f64]| unit_rotation([n[0], n[1], n[2], n[3]]);
        let (left, right, s) = self.around(time);
        if self.interpolation == Interpolation::Linear && left != right {
            let [a, b] = [left, right].map(|key| quaternion(&self.key(key).collect::<Vec<_>>()));
            return slerp(a, b, s);
        }
        quaternion(&self.at(time))
    }

    /// The keys before and after `time`, and how far it is from the one to the other, from 0 to 1.
    fn around(&self, time: f64) -> (usize, usize, f64) {
        let last = self.times.len() - 1;
        let next = self.times.partition_point(|at| f64::from(*at) <= time);
        let (left, right) = (next.saturating_sub(1), next.min(last));
        let [from, to] = [left, right].map(|key| f64::from(self.times[key]));
        let s = if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        (left, right, s)
    }

    /// The value at a key.
    fn key(&self, key: usize) -> impl Iterator<Item = f64> {
        self.part(key, if self.interpolation == Interpolation::Cubic { 1 } else { 0 })
    }

    fn part(&self, key: usize, part: usize) -> impl Iterator<Item = f64> {
        let parts = if self.interpolation == Interpolation::Cubic { 3 } else { 1 };
        let start = (key * parts + part) * self.width;
        self.values[start..start + self.width].iter().map(|x| f64::from(*x))
    }
}

/// The rotation of a quaternion x, y, z, w of any length; none where that is zero.
pub(super) fn unit_rotation(numbers: [f64; 4]) -> DQuat {
    // Scaled first: squares of tiny numbers would underflow.
    let size = numbers.iter().fold(0f64, |size, x| size.max(x.abs()));
    let rotation = DQuat::from_array(numbers.map(|x| x / size));
    if rotation.is_finite() { rotation.normalize() } else { DQuat::IDENTITY }
}

/// Spherical interpolation, by functions that give the same on every machine.
fn slerp(a: DQuat, b: DQuat, s: f64) -> DQuat {
    let dot = a.dot(b);
    let (b, dot) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    let angle = libm::acos(dot.min(1.0));
    let sin = libm::sin(angle);
    if sin < 1e-9 {
        return (a * (1.0 - s) + b * s).normalize();
    }
    let (left, right) = (libm::sin((1.0 - s) * angle) / sin, libm::sin(s * angle) / sin);
    (a * left + b * right).normalize()
}
