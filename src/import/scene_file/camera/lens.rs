//! `lens` of the camera and of its key poses.

use super::{Camera, Key};
use crate::error;
use crate::import::scene_file::at::{At, Span};
use crate::import::scene_file::number::{Degrees, FieldOfView, Int, NotNegative, Positive};
use crate::import::scene_file::report::Source;
use crate::import::scene_file::schema::inline_schema;
use crate::scene::{CameraPath, Focus, LensKey, ShotLens, ThinLensPath};
use schemars::{JsonSchema, json_schema};
use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;

/// Height of the film of a 35 mm still camera, metres.
const FULL_FRAME: f64 = 0.024;
/// The word that a focus may be.
const TARGET: &str = "target";

/// A thin lens: surfaces out of focus are blurred. The aperture is given by `radius` or by `f_number`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("not" = {"required": ["radius", "f_number"]}))]
pub(super) struct Lens {
    /// Radius of the aperture, world units; 0 makes a pinhole.
    radius: Option<At<NotNegative>>,
    /// Focal length over the aperture's diameter. The focal length follows from `fov` and `sensor_height`.
    f_number: Option<At<Positive>>,
    /// Distance of the plane in focus along the view axis, world units, or "target".
    focus: Option<Sharp>,
    /// Height of the picture on the film, world units: 0.024 for a 35 mm still camera and a world in metres.
    /// Only with `f_number`.
    sensor_height: Option<At<Positive>>,
    /// Blades of the aperture, whose shape bright spots out of focus take. Absent: a round one.
    blades: Option<Int<3, 64>>,
    /// Turn of the blades, degrees, counter-clockwise in the image; at 0 a corner points up in spots
    /// behind the focus, and down in those before it.
    blade_rotation: Option<At<Degrees>>,
}

/// The lens at a key pose: what it leaves out is the camera's.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
#[schemars(extend("not" = {"required": ["radius", "f_number"]}))]
pub(super) struct KeyLens {
    /// Radius of the aperture, world units; 0 makes a pinhole.
    radius: Option<At<NotNegative>>,
    /// Focal length over the aperture's diameter.
    f_number: Option<At<Positive>>,
    /// Distance of the plane in focus along the view axis, world units, or "target".
    focus: Option<Sharp>,
}

/// Where the plane in focus is.
#[derive(Debug, Clone, Copy)]
enum Sharp {
    Distance(Positive),
    Target,
}

struct SharpVisitor;

impl Visitor<'_> for SharpVisitor {
    type Value = Sharp;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a distance or \"target\"")
    }

    fn visit_str<E: Error>(self, word: &str) -> Result<Sharp, E> {
        match word {
            TARGET => Ok(Sharp::Target),
            _ => {
                Err(E::custom(format_args!("expected a distance or \"target\", found \"{word}\"")))
            }
        }
    }

    fn visit_f64<E: Error>(self, x: f64) -> Result<Sharp, E> {
        use serde::de::IntoDeserializer;
        Positive::deserialize(IntoDeserializer::<E>::into_deserializer(x)).map(Sharp::Distance)
    }

    fn visit_i64<E: Error>(self, x: i64) -> Result<Sharp, E> {
        self.visit_f64(x as f64)
    }
}

impl<'de> Deserialize<'de> for Sharp {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SharpVisitor)
    }
}

impl Serialize for Sharp {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Distance(distance) => distance.serialize(serializer),
            Self::Target => serializer.serialize_str(TARGET),
        }
    }
}

inline_schema!(Sharp, |generator| {
    let distance = generator.subschema_for::<Positive>();
    json_schema!({ "anyOf": [distance, { "enum": [TARGET] }] })
});

/// A lens as far as it is given.
#[derive(Clone, Copy, Default)]
struct Given<'a> {
    radius: Option<&'a At<NotNegative>>,
    f_number: Option<&'a At<Positive>>,
    focus: Option<Sharp>,
}

impl Camera {
    /// The lens along `path`.
    ///
    /// Errors: an aperture given twice or not at all, a film without an f-number; at the lens.
    pub(super) fn lens(&self, path: &CameraPath, source: &Source) -> error::Result<ShotLens> {
        let keys = self.keys.as_ref().map_or(&[][..], |keys| &keys.value);
        let own = self.lens.as_ref().map(|lens| lens.given()).unwrap_or_default();
        let spans = self.lens.as_ref().map(|lens| &lens.span).into_iter();
        let mut spans = spans.chain(keys.iter().filter_map(|key| Some(&key.lens.as_ref()?.span)));
        let Some(first) = spans.next() else { return Ok(ShotLens::Pinhole) };
        self.check_sensor(keys, source)?;
        self.check_own(source)?;
        let at_key = |key: &At<Key>, at: f64| {
            let lens = key.lens.as_ref();
            let span = lens.map_or(&key.span, |lens| &lens.span);
            let given = lens.map_or(own, |lens| lens.given().or(own));
            self.lens_key((at, key.fov.unwrap_or(self.vfov())), &given, source, span)
        };
        let keys = match path {
            CameraPath::Keys(poses) if self.keys.is_some() => {
                keys.iter().zip(poses).map(|(key, pose)| at_key(key, pose.at)).collect()
            }
            _ => self.lens_key((0.0, self.vfov()), &own, source, first).map(|key| vec![key]),
        }?;
        let own = self.lens.as_ref();
        let blades = own.and_then(|lens| lens.blades).map_or(0, Int::u32);
        let turn = own.and_then(|lens| lens.blade_rotation.as_ref()).map_or(0.0, |turn| turn.0);
        Ok(ShotLens::Thin(ThinLensPath { keys, blades, blade_rotation_degrees: turn }))
    }

    /// The lens at a moment with its field of view, as it is `given`.
    fn lens_key(
        &self,
        (at, fov): (f64, FieldOfView),
        given: &Given,
        source: &Source,
        span: &Span,
    ) -> error::Result<LensKey> {
        let focus = match given.focus {
            Some(Sharp::Distance(distance)) => Focus::Distance(distance.0),
            Some(Sharp::Target) | None => Focus::Target,
        };
        let radius = match (given.radius, given.f_number) {
            (Some(radius), None) => radius.0,
            (None, Some(f_number)) => {
                let sensor = self.lens.as_ref().and_then(|lens| lens.sensor_height.as_ref());
                let height = sensor.map_or(FULL_FRAME, |height| height.0);
                let focal_length = 0.5 * height / libm::tan(0.5 * fov.0.to_radians());
                0.5 * focal_length / f_number.0
            }
            (Some(_), Some(f_number)) => {
                return Err(source
                    .fault(&f_number.span, "the lens has a `radius` already")
                    .help("give `radius` or `f_number`, not both")
                    .into());
            }
            (None, None) => {
                return Err(source
                    .fault(span, "the lens has no aperture here")
                    .help("give it a `radius` in world units, or an `f_number`")
                    .into());
            }
        };
        Ok(LensKey { at, radius, focus })
    }

    /// Refuses what contradicts itself or does nothing in the camera's own lens, whatever keys say.
    fn check_own(&self, source: &Source) -> error::Result<()> {
        let Some(Lens { radius, f_number, blades, blade_rotation, .. }) = self.lens.as_deref()
        else {
            return Ok(());
        };
        match (radius, f_number, blades, blade_rotation) {
            (Some(_), Some(f_number), ..) => Err(source
                .fault(&f_number.span, "the lens has a `radius` already")
                .help("give `radius` or `f_number`, not both")
                .into()),
            (.., None, Some(turn)) => Err(source
                .fault(&turn.span, "`blade_rotation` has no effect without `blades`")
                .help("an aperture without blades is round")
                .into()),
            _ => Ok(()),
        }
    }

    fn check_sensor(&self, keys: &[At<Key>], source: &Source) -> error::Result<()> {
        let own = self.lens.iter().map(|lens| lens.f_number.is_some());
        let of_keys = keys.iter().filter_map(|key| key.lens.as_ref());
        let is_used = own.chain(of_keys.map(|lens| lens.f_number.is_some())).any(|given| given);
        let sensor = self.lens.as_ref().and_then(|lens| lens.sensor_height.as_ref());
        match sensor.filter(|_| !is_used) {
            Some(height) => Err(source
                .fault(&height.span, "`sensor_height` has no effect without `f_number`")
                .help("a `radius` is in world units whatever the film")
                .into()),
            None => Ok(()),
        }
    }
}

impl Lens {
    /// Whether it depends neither on a field of view nor on a target.
    pub(super) fn stands_alone(&self) -> bool {
        self.f_number.is_none() && matches!(self.focus, Some(Sharp::Distance(_)))
    }

    fn given(&self) -> Given<'_> {
        let Self { radius, f_number, focus, .. } = self;
        Given { radius: radius.as_ref(), f_number: f_number.as_ref(), focus: *focus }
    }
}

impl KeyLens {
    fn given(&self) -> Given<'_> {
        let Self { radius, f_number, focus } = self;
        Given { radius: radius.as_ref(), f_number: f_number.as_ref(), focus: *focus }
    }
}

impl Given<'_> {
    /// With what it leaves out as in `other`.
    fn or(self, other: Self) -> Self {
        let is_open = self.radius.is_some() || self.f_number.is_some();
        let opening = if is_open { self } else { other };
        Self { focus: self.focus.or(other.focus), ..opening }
    }
}
