//! `[sky]`.

use super::at::{At, Span};
use super::file_name;
use super::light::sun_angle;
use super::number::{Degrees, Positive, SunAngle, Turbidity};
use super::report::Source;
use super::vector::{Direction, Light as Amount, Reflectance};
use crate::error::Result;
use crate::math::Rgb;
use crate::scene::{self, Environment, EnvironmentKind, SkyGradient};
use schemars::JsonSchema;
use serde::Deserialize;

/// The light of rays that hit nothing: one colour, an image, a gradient, or sun and sky.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Sky {
    /// Radiance of a sky of one colour, W/(m² sr).
    radiance: Option<At<Amount>>,
    /// Image in latitude and longitude; its middle is seen along -z, what is right of it towards +x.
    #[serde(default, deserialize_with = "file_name::placed")]
    image: Option<At<String>>,
    /// Radiance by the height above the horizon.
    gradient: Option<At<Gradient>>,
    /// Sun and sky of a day.
    sun_sky: Option<At<SunSky>>,
    /// Turn of image, gradient or day about +y, counter-clockwise seen from above, degrees.
    rotate: Option<At<Degrees>>,
    /// Factor on the radiance of image, gradient or day.
    strength: Option<At<Positive>>,
    /// Whether the sky lights surfaces, by rays that geometry can block; otherwise it is only a backdrop.
    #[serde(default = "yes")]
    lights: bool,
    /// Light that reaches every diffuse surface, corners included, without any ray: it adds
    /// `diffuse` times `ambient` to what is seen.
    #[serde(default)]
    ambient: Amount,
}

/// Radiance between those of zenith, horizon and ground, linear in the sine of the height above the horizon.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct Gradient {
    /// Radiance straight above, W/(m² sr).
    zenith: Amount,
    /// Radiance at the horizon.
    horizon: Amount,
    /// Radiance straight below.
    ground: Amount,
}

/// Sun and sky of a clear or hazy day. A unit of radiance stands for 10,000 cd/m².
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "a table")]
pub(super) struct SunSky {
    /// Vector towards the sun, before `rotate`; not below the horizon.
    to_sun: Direction,
    /// How hazy the air is: 2 very clear, 3 clear, 6 hazy.
    #[serde(default = "clear")]
    turbidity: Turbidity,
    /// Angle under which the sun is seen, degrees.
    #[serde(default = "sun_angle")]
    angle: SunAngle,
    /// Diffuse reflectance of the ground below the horizon.
    #[serde(default = "ground")]
    ground: Reflectance,
}

/// What a sky shows.
pub(super) enum Shown<'a> {
    Radiance,
    Image(&'a At<String>),
    Gradient(&'a At<Gradient>),
    SunSky(&'a At<SunSky>),
}

fn yes() -> bool {
    true
}

fn clear() -> Turbidity {
    Turbidity(3.0)
}

fn ground() -> Reflectance {
    Reflectance::grey(0.2)
}

impl Sky {
    /// What is shown.
    ///
    /// Errors, at the later of the keys: two of `radiance`, `image`, `gradient` and `sun_sky`; `rotate` or `strength` of a
    /// sky of one colour.
    pub fn shown(&self, source: &Source, span: &Span) -> Result<Shown<'_>> {
        let Self { radiance, image, gradient, sun_sky, rotate, strength, .. } = self;
        let spans = [
            radiance.as_ref().map(|key| &key.span),
            image.as_ref().map(|key| &key.span),
            gradient.as_ref().map(|key| &key.span),
            sun_sky.as_ref().map(|key| &key.span),
        ];
        let given = spans.iter().flatten();
        if let (2.., Some(last)) = (given.clone().count(), given.max_by_key(|span| span.start)) {
            let message = "a sky has one of `radiance`, `image`, `gradient` and `sun_sky`";
            return Err(source.fault(last, message).into());
        }
        let shown = match (image, gradient, sun_sky) {
            (Some(image), ..) => Shown::Image(image),
            (_, Some(gradient), _) => Shown::Gradient(gradient),
            (.., Some(day)) => Shown::SunSky(day),
            (None, None, None) => Shown::Radiance,
        };
        let turned = rotate.as_ref().map(|key| ("rotate", &key.span));
        let scaled = strength.as_ref().map(|key| ("strength", &key.span));
        match (&shown, turned.or(scaled)) {
            (Shown::Radiance, Some((key, at))) => {
                let message = format!("`{key}` belongs to an `image`, a `gradient` or a `sun_sky`");
                let at = if at.is_empty() { span } else { at };
                Err(source.fault(at, message).help("give the colour in `radiance`").into())
            }
            _ => Ok(shown),
        }
    }

    /// The environment of this `kind`.
    pub fn environment(&self, kind: EnvironmentKind) -> Environment {
        let strength = self.strength.as_ref().map_or(1.0, |factor| factor.0 as f32);
        let turn = self.rotate.as_ref().map_or(0.0, |degrees| degrees.0);
        Environment { strength, ..Environment::new(kind).turned(turn) }
    }

    /// The sky itself as scene data.
    pub fn build(&self) -> scene::Sky {
        scene::Sky {
            radiance: self.radiance.as_ref().map_or(Rgb::ZERO, |radiance| radiance.rgb()),
            lights: self.lights,
            ambient: self.ambient.rgb(),
        }
    }
}

impl At<Gradient> {
    /// Errors: a black one.
    pub fn build(&self, source: &Source) -> Result<EnvironmentKind> {
        let [zenith, horizon, ground] =
            [&self.zenith, &self.horizon, &self.ground].map(|amount| amount.rgb());
        if [zenith, horizon, ground] == [Rgb::ZERO; 3] {
            return Err(source.fault(&self.span, "the gradient is black").into());
        }
        Ok(EnvironmentKind::Gradient(SkyGradient { zenith, horizon, ground }))
    }
}

impl At<SunSky> {
    /// Errors: a sun below the horizon.
    pub fn build(&self, source: &Source) -> Result<EnvironmentKind> {
        let to_sun = self.to_sun.unit();
        if to_sun.y < 0.0 {
            let message = "the sun is below the horizon: the second number of `to_sun` is negative";
            return Err(source.fault(&self.span, message).into());
        }
        let SunSky { turbidity, angle, ground, .. } = &self.value;
        let (turbidity, sun_radius) = (turbidity.0, angle.radius());
        Ok(EnvironmentKind::SunSky(scene::SunSky {
            to_sun,
            turbidity,
            sun_radius,
            ground: ground.rgb(),
        }))
    }
}
