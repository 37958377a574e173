//! Lights: plain data, in world space inside a `World` and in scene space inside a `Scene`.
//!
//! One file for each kind says all that a scene needs to know of it ([`LightData`]); nothing else in
//! this room asks for the kind. How a light shines stands in `shade::light`.

mod bound;
mod directional;
mod disk;
mod face;
mod far_field;
mod point;
mod quad;
mod sky;
mod sphere;
mod spot;
mod sun;

pub use directional::DirectionalLight;
pub use disk::DiskLight;
pub use face::FaceLight;
pub use far_field::FarField;
pub use point::PointLight;
pub use quad::QuadLight;
pub use sky::Sky;
pub use sphere::SphereLight;
pub use spot::SpotLight;
pub use sun::SunLight;

use super::{Recentring, place};
use crate::error::Result;
use crate::math::{Bounds3, DAffine3, DVec3, Rgb, Vec3};
use serde::{Deserialize, Serialize};

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident($data:ident) = $name:literal,)*) => {
        /// A light. Radiometric units: radiance W/(m²·sr), intensity W/sr, irradiance W/m².
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        pub enum Light {
            $($(#[$doc])* $kind($data),)*
        }

        impl Light {
            /// Names of all kinds.
            pub const KINDS: &[&str] = &[$($name),*];

            /// Names of the kinds that scene files write: all but faces, the last, which are of meshes that emit.
            pub fn written_kinds() -> impl Iterator<Item = &'static str> {
                Self::KINDS.iter().copied().filter(|kind| *kind != "face")
            }

            /// The kind, as scene files and messages call it.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => $name,)*
                }
            }

            fn data(&self) -> &dyn LightData {
                match self {
                    $(Self::$kind(light) => light,)*
                }
            }

            fn data_mut(&mut self) -> &mut dyn LightData {
                match self {
                    $(Self::$kind(light) => light,)*
                }
            }
        }
    };
}

// In the order of `inspect` and of messages. The names are part of a scene's hash.
kinds! {
    /// A point that emits alike in all directions.
    Point(PointLight) = "point",
    /// Parallel light from infinitely far.
    Directional(DirectionalLight) = "directional",
    /// A flat convex quad.
    Quad(QuadLight) = "quad",
    /// A sphere that emits outwards.
    Sphere(SphereLight) = "sphere",
    /// A flat disk.
    Disk(DiskLight) = "disk",
    /// A cone of light.
    Spot(SpotLight) = "spot",
    /// A disk at infinity.
    Sun(SunLight) = "sun",
    /// A face of a mesh, or a part of one; a scene makes them of the meshes of its world.
    Face(FaceLight) = "face",
}

/// The interface of a kind of light to the scene.
trait LightData {
    /// Whether the light has an extent, so that its shadows are soft and take samples. A delta light has none.
    fn is_area(&self) -> bool;

    /// Whether every coordinate is a finite number.
    fn is_finite(&self) -> bool;

    /// The box around what emits, in the light's own space; empty where rays cannot meet it.
    fn bounds(&self) -> Bounds3;

    /// Moves the light by `transform`, which `mirrors` or does not.
    ///
    /// Errors: a transform that would deform the light.
    fn transform(&mut self, transform: &DAffine3, mirrors: bool) -> Result<()>;

    /// Moves the light from world to scene space.
    fn recentre(&mut self, recentring: &Recentring);

    /// The surface that rays see, in the light's own space; `None` for a light that is not seen.
    fn surface(&self) -> Option<EmittingSurface>;

    /// What the light emits: radiance of an area light, intensity of a point or spot light, irradiance of a
    /// directional one.
    fn emission(&self) -> Rgb;

    /// An upper bound of the irradiance without shadows that arrives at any point of the box `cell`, whatever the
    /// normal there, per unit of emission; infinite where there is none.
    fn most_irradiance(&self, cell: &Bounds3) -> f64;

    /// What arrives of the light at points that are far from it.
    fn far_field(&self) -> FarField;
}

/// The visible surface of a light.
pub(super) struct EmittingSurface {
    /// Where it is.
    pub shape: EmittingShape,
    /// Emitted radiance.
    pub radiance: Rgb,
    /// Whether the back emits too.
    pub two_sided: bool,
}

/// The shape of a light's surface, in the light's own space.
pub(super) enum EmittingShape {
    /// Triangles between corners, counter-clockwise on the emitting side.
    Triangles(Vec<Vec3>, Vec<[u32; 3]>),
    /// An exact sphere: its centre and radius.
    Sphere(DVec3, f64),
}

impl Light {
    /// Whether the light has an extent, so that its shadows are soft and take samples.
    pub fn is_area(&self) -> bool {
        self.data().is_area()
    }

    pub(super) fn is_finite(&self) -> bool {
        self.data().is_finite()
    }

    pub(super) fn bounds(&self) -> Bounds3 {
        self.data().bounds()
    }

    pub(super) fn transform(&mut self, transform: &DAffine3, mirrors: bool) -> Result<()> {
        self.data_mut().transform(transform, mirrors)
    }

    pub(super) fn into_scene(mut self, recentring: &Recentring) -> Self {
        self.data_mut().recentre(recentring);
        self
    }

    pub(super) fn surface(&self) -> Option<EmittingSurface> {
        self.data().surface()
    }

    /// What arrives of the light at points that are far from it, shadows aside, per unit of emission; scene space.
    pub fn far_field(&self) -> FarField {
        self.data().far_field()
    }

    /// What the light emits: radiance of an area light, intensity of a point or spot light, irradiance of a
    /// directional one.
    pub fn emission(&self) -> Rgb {
        self.data().emission()
    }

    /// An upper bound of the irradiance without shadows that arrives at any point of the box `cell`, whatever the
    /// normal there: of the brightest of the three colours. Infinite where there is none, as of an emission that
    /// is no number.
    pub(super) fn most_irradiance(&self, cell: &Bounds3) -> f64 {
        let [r, g, b] = self.data().emission().to_array().map(|x| f64::from(x).abs());
        let emission = r.max(g).max(b);
        if (r + g + b).is_nan() {
            return f64::INFINITY;
        }
        if emission == 0.0 {
            return 0.0;
        }
        // Closed forms are rounded too.
        let most = emission * self.data().most_irradiance(cell) * (1.0 + 1e-6);
        if most.is_nan() { f64::INFINITY } else { most }
    }
}
