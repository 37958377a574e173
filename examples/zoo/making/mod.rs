//! Random scenes: families of them, and camera moves that suit each.
//!
//! A scene is a function of the seed and its index alone. It comes as the text of a scene file
//! without its camera, the meshes and textures beside it, and a pose for each frame.

mod builder;
mod cameras;
mod changes;
mod dice;
mod families;
mod hdr;
mod lamps;
mod obj;
mod props;
mod specimen;
mod subject;

pub use cameras::camera_table;
pub use changes::Change;
pub use families::FAMILIES;
pub use specimen::{Settings, Specimen};
pub use subject::{Label, Subject};
