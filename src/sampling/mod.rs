//! Random numbers and the maps that turn them into directions and points.
//!
//! [`PixelSampler`] gives Owen-scrambled Sobol pairs that are a function of seed, frame, pixel,
//! sample and dimension and of nothing else. The warps turn a pair in the unit square into a
//! direction ([`cosine_hemisphere`], [`SphereCone`]), a point on a quad ([`QuadWarp`]) or an
//! offset in a pixel ([`PixelFilter`]); all are continuous, so well-spread pairs stay well spread.
//! [`GridDistribution`] chooses cells of a grid by their weights.
//!
//! Every operation is an integer one or a correctly rounded `+ - * / sqrt` (or from the crate
//! `libm`), so results are the same on every CPU. Nothing here knows what a scene is.

mod disk;
mod filter;
mod grid;
mod mix;
mod pixel;
mod quad;
mod sobol;
mod sphere;

pub use disk::{concentric_disk, cosine_hemisphere, to_world};
pub use filter::PixelFilter;
pub use grid::GridDistribution;
pub use mix::mix;
pub use pixel::PixelSampler;
pub use quad::QuadWarp;
pub use sphere::SphereCone;
