//! Light from outside of the scene that differs by direction: an image, a gradient, or the sky of a day with its sun.
//!
//! [`Environment`] is the plain record, which a world has in place of a sky of one colour. [`SceneEnvironment`] adds the tables
//! that lighting by it needs, made once a scene. Its own axes have +y up; the middle of an image lies along -z, and what is to the
//! right of it towards +x.

mod daylight;
mod gradient;
mod irradiance;
mod table;

pub use daylight::{Daylight, SunSky};
pub use gradient::SkyGradient;
pub use irradiance::IrradianceTable;
pub use table::{RadianceTable, brightness, image_place};

use super::{Light, SunLight, Texture, TextureId, place};
use crate::error::{Error, Result};
use crate::math::{DAffine3, DMat3, DVec3, Rgb};
use serde::{Deserialize, Serialize};

/// Radiance that is refused: sums of it would overflow.
const MOST_RADIANCE: f32 = 1e30;

/// Light from outside of the scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// What is seen.
    pub kind: EnvironmentKind,
    /// From the environment's own axes to those of the world: orthogonal.
    pub orientation: DMat3,
    /// Factor on all radiance.
    pub strength: f32,
}

/// What an environment shows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum EnvironmentKind {
    /// An image in latitude and longitude.
    Image(TextureId),
    /// Zenith, horizon and ground.
    Gradient(SkyGradient),
    /// A day.
    SunSky(SunSky),
}

/// What an environment shows along a direction, ready to be looked up; without strength, and without a sun.
#[derive(Debug, Clone, Copy)]
pub enum EnvironmentRadiance<'a> {
    /// The texels of an image.
    Image(&'a Texture),
    /// A gradient.
    Gradient(SkyGradient),
    /// The sky of a day.
    Daylight(Daylight),
}

/// An environment with what lighting by it needs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneEnvironment {
    /// What it was made of.
    pub environment: Environment,
    /// Radiance by direction.
    pub radiance: RadianceTable,
    /// Irradiance without shadows by normal.
    pub irradiance: IrradianceTable,
}

impl Environment {
    /// An environment of this `kind` as it stands.
    pub fn new(kind: EnvironmentKind) -> Self {
        Self { kind, orientation: DMat3::IDENTITY, strength: 1.0 }
    }

    /// The same, turned about +y by `degrees`, counter-clockwise seen from above.
    pub fn turned(self, degrees: f64) -> Self {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let turn =
            DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos));
        Self { orientation: turn * self.orientation, ..self }
    }

    /// What is seen, of the images `textures`.
    pub fn radiance<'a>(&self, textures: &'a [Texture]) -> EnvironmentRadiance<'a> {
        match &self.kind {
            EnvironmentKind::Image(image) => EnvironmentRadiance::Image(&textures[*image as usize]),
            EnvironmentKind::Gradient(gradient) => EnvironmentRadiance::Gradient(*gradient),
            EnvironmentKind::SunSky(day) => EnvironmentRadiance::Daylight(Daylight::of(day)),
        }
    }

    /// The sun, if there is one.
    pub fn sun(&self) -> Option<SunLight> {
        let EnvironmentKind::SunSky(day) = &self.kind else { return None };
        let to_light = (self.orientation * day.to_sun).normalize();
        let irradiance = day.sun_irradiance() * self.strength;
        Some(SunLight::of_irradiance(to_light, day.sun_radius, irradiance))
    }

    /// What it is, in a few words.
    pub fn describe(&self, textures: &[Texture]) -> String {
        match self.radiance(textures) {
            EnvironmentRadiance::Image(texture) => {
                let level = &texture.levels()[0];
                format!("an image of {} x {}", level.width, level.height)
            }
            EnvironmentRadiance::Gradient(_) => "a gradient".into(),
            EnvironmentRadiance::Daylight(_) => "sun and sky".into(),
        }
    }

    /// Turns it with the world.
    pub(super) fn transform(&mut self, transform: &DAffine3) -> Result<()> {
        let scale = place::uniform_scale("the environment is a sphere", "", transform)?;
        self.orientation = transform.matrix3 * (1.0 / scale) * self.orientation;
        Ok(())
    }

    /// Refuses what is no light, or light of a sky with the radiance `sky` as well.
    pub(super) fn check(&self, textures: &[Texture], sky: Rgb) -> Result<()> {
        let refuse = |what: &str| Err(Error::Usage(format!("the environment {what}")));
        let is_light = |c: Rgb| c.is_finite() && c.min_element() >= 0.0;
        if sky != Rgb::ZERO {
            return refuse("stands in place of the sky's radiance, which is not 0");
        }
        if !(self.strength >= 0.0 && self.strength.is_finite()) {
            return refuse(&format!("has the strength {}", self.strength));
        }
        let square = self.orientation * self.orientation.transpose();
        if !square.abs_diff_eq(DMat3::IDENTITY, 1e-6) {
            return refuse("is turned by a matrix that is not orthogonal");
        }
        let brightest = match &self.kind {
            EnvironmentKind::Image(image) => match textures.get(*image as usize) {
                Some(texture) => brightest(texture),
                None => {
                    let count = textures.len();
                    return refuse(&format!("has the texture {image}, counted from 0, of {count}"));
                }
            },
            EnvironmentKind::Gradient(SkyGradient { zenith, horizon, ground }) => {
                if ![zenith, horizon, ground].into_iter().all(|c| is_light(*c)) {
                    return refuse("is a gradient of numbers that are negative or not finite");
                }
                zenith.max(*horizon).max(*ground).max_element()
            }
            EnvironmentKind::SunSky(day) => {
                let SunSky { to_sun, turbidity, sun_radius, ground } = day;
                let is_unit = (to_sun.length() - 1.0).abs() < 1e-6 && to_sun.y >= 0.0;
                let is_sound = (1.7..=10.0).contains(turbidity)
                    && (1e-4..=0.8).contains(sun_radius)
                    && is_light(*ground)
                    && ground.max_element() <= 1.0;
                if !(is_unit && is_sound) {
                    return refuse("is a day of numbers out of range");
                }
                0.0
            }
        };
        if !(0.0..=MOST_RADIANCE).contains(&(brightest * self.strength)) {
            return refuse("is brighter than 1e30, negative or not finite");
        }
        Ok(())
    }
}

/// The largest number in an image; NaN where one is negative or not finite.
pub(crate) fn brightest(texture: &Texture) -> f32 {
    let level = &texture.levels()[0];
    let rows = 0..level.height as usize;
    let texels = rows.flat_map(|y| (0..level.width as usize).map(move |x| (x, y)));
    let is_light = |c: &Rgb| c.is_finite() && c.min_element() >= 0.0;
    let mut most =
        texels.map(|(x, y)| level.texel(x, y)).map(|c| is_light(&c).then(|| c.max_element()));
    most.try_fold(0.0, |most, own| Some(own?.max(most))).unwrap_or(f32::NAN)
}

impl SceneEnvironment {
    /// The environment with its tables, of the images `textures`.
    pub(super) fn of(environment: Environment, textures: &[Texture]) -> Self {
        let radiance = RadianceTable::of(&environment.radiance(textures), environment.strength);
        let irradiance = IrradianceTable::of(&radiance);
        Self { environment, radiance, irradiance }
    }

    /// Whether it shows an image.
    pub fn is_image(&self) -> bool {
        matches!(self.environment.kind, EnvironmentKind::Image(_))
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> u64 {
        self.radiance.bytes() + self.irradiance.bytes()
    }
}

/// The lights of a scene with this environment: those of the world, and the sun of a day that lights it.
pub(super) fn with_sun(
    mut lights: Vec<Light>,
    environment: Option<&Environment>,
    shines: bool,
) -> Vec<Light> {
    if shines {
        lights.extend(environment.and_then(Environment::sun).map(Light::Sun));
    }
    lights
}
