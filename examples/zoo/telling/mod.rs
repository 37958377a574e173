//! What came out, told: a line a scene, a table, the targets, JSON, pictures.

mod panels;
mod record;
mod summary;
mod table;

pub use panels::{Sheet, name_the_worst, save as save_panels};
pub use record::{HEAD, Told};
pub use summary::{LONG, save_json, summary};
pub use table::table;
