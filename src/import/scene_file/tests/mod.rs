//! The scene file end to end: good files, bad files, the schema, the page about it.

mod bad;
mod good;
mod schema;
mod textures;

use super::*;
use crate::error::{Diagnostic, Error};
use std::path::PathBuf;

/// Loads `text` as a scene file of a folder that holds nothing else.
fn load_text(text: &str) -> (Result<Loaded>, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    (load(&path, &LoadOptions::default()), path)
}

fn good(text: &str) -> Loaded {
    match load_text(text).0 {
        Ok(loaded) => loaded,
        Err(e) => panic!("{e}\n{text}"),
    }
}

fn bad(text: &str) -> Diagnostic {
    match load_text(text) {
        (Err(Error::Input(d)), path) => {
            assert_eq!(d.file, path);
            *d
        }
        (Err(e), _) => panic!("no input error: {e}\n{text}"),
        (Ok(_), _) => panic!("no error:\n{text}"),
    }
}
