//! The rules of `docs/architecture.md` that a compiler does not check: a room imports only from
//! lower floors, files of one room import one another in no circle, a public type's name has one meaning,
//! `unsafe` stays in its rooms, and only the command line prints.
//!
//! The floors are those that `src/lib.rs` states. This reads source text, not types: it sees paths
//! that begin with `crate::` or climb to the crate's root with `super::`, in any file of `src`.

mod layering {
    pub mod circles;
    pub mod lexer;
    pub mod modules;
    pub mod names;
    pub mod rules;
    pub mod use_tree;
}

use layering::modules::{Found, Modules};
use layering::rules::{Floors, Source, violations};
use layering::{circles, names};
use std::path::{Path, PathBuf};

#[test]
fn the_source_keeps_the_rules() {
    let floors = Floors::read(&std::fs::read_to_string("src/lib.rs").unwrap()).unwrap();
    // benches/ may call C on its own, to compare with; ffi/ is the unsafe edge.
    let mut files = vec![PathBuf::from("build.rs")];
    rust_files(Path::new("src"), &mut files);
    rust_files(Path::new("tests"), &mut files);
    assert!(files.len() > 10, "src and tests hold more files than {files:?}");
    let sources: Vec<Source> = files.iter().map(|path| Source::read(path)).collect();
    let found = violations(&floors, &sources);
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// Uses that close a circle of imports and may stay, each with its reason.
const ALLOWED_USES: [circles::Allowed; 0] = [];

#[test]
fn files_of_a_room_import_one_another_in_no_circle() {
    let found = circles::violations(&source().uses, &ALLOWED_USES);
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// Names that several public types may have, each with its reason.
const ALLOWED_NAMES: [names::Allowed; 0] = [];

#[test]
fn a_public_type_has_a_name_of_its_own() {
    let found = names::violations(&source().types, &ALLOWED_NAMES);
    assert!(found.is_empty(), "\n{}\n", found.join("\n"));
}

/// What the files of `src` define and use.
fn source() -> Found {
    let mut files = Vec::new();
    rust_files(Path::new("src"), &mut files);
    let read = |path: &PathBuf| {
        let text = std::fs::read_to_string(path).expect("a readable source file");
        (path.to_string_lossy().into_owned(), text)
    };
    let texts: Vec<(String, String)> = files.iter().map(read).collect();
    let texts: Vec<(&str, &str)> = texts.iter().map(|(p, t)| (p.as_str(), t.as_str())).collect();
    Modules::read_texts(&texts)
}

/// All `.rs` files below `dir`.
fn rust_files(dir: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).expect("a folder of sources") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            rust_files(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs") {
            into.push(path);
        }
    }
}

// ---- the checker itself must be able to fail --------------------------------------------------

const LIB: &str = "
// Floor 0: numbers.
pub mod math;
pub mod sampling;
pub mod error;
// Floor 1: the unsafe room.
#[allow(unsafe_code)]
pub mod embree;
// Floor 2: data.
pub mod film;
pub mod scene;
// Floor 3: radiance.
pub mod shade;
// Floor 4: ranks.
pub mod cluster;
// Floor 5: the command line.
pub mod cli;
";

/// What the rules say about one file.
fn check(path: &str, text: &str) -> Vec<String> {
    check_all(&[(path, text)])
}

fn check_all(files: &[(&str, &str)]) -> Vec<String> {
    let sources: Vec<Source> = files.iter().map(|(p, t)| Source::new(p, t)).collect();
    violations(&Floors::read(LIB).expect("floors"), &sources)
}

#[track_caller]
fn one(found: &[String], words: &[&str]) {
    assert_eq!(found.len(), 1, "{found:#?}");
    for word in words {
        assert!(found[0].contains(word), "{word:?} not in {:?}", found[0]);
    }
}

#[test]
fn imports_from_lower_floors_are_fine() {
    let text = "use crate::{error::Result, film::{Film, GBuffer}};\nuse crate::math::Vec3;\n\
                use super::light;\nfn f() -> crate::scene::Scene { crate::math::one() }\n";
    assert_eq!(check("src/shade/kernel.rs", text), [""; 0]);
}

#[test]
fn a_higher_floor_is_refused_with_file_and_line() {
    let found = check("src/scene/mesh.rs", "\n\nuse crate::shade::Renderer;\n");
    one(&found, &["src/scene/mesh.rs:3", "scene (floor 2)", "shade (floor 3)", "higher"]);
}

#[test]
fn the_same_floor_is_refused() {
    one(&check("src/film/mod.rs", "pub use crate::scene::Camera;"), &["film", "scene", "same"]);
}

#[test]
fn ones_own_room_is_fine() {
    assert_eq!(check("src/film/tile.rs", "use crate::film::Film;"), [""; 0]);
}

#[test]
fn nested_braces_are_read() {
    let text = "use crate::{\n    math::{self, Vec3},\n    cli::Options,\n};";
    one(&check("src/scene/mod.rs", text), &["src/scene/mod.rs:3", "cli"]);
    one(&check("src/scene/mod.rs", "use {crate::math::Vec3, crate::cli::X};"), &["cli"]);
}

#[test]
fn paths_outside_use_are_read() {
    one(&check("src/scene/mod.rs", "fn f(x: &crate :: cli\n::Options) {}"), &["cli"]);
    one(&check("src/scene/mod.rs", "fn f() { g(crate::cli::x()) }"), &["cli"]);
    one(&check("src/scene/mod.rs", "mod tests { use super::*; use crate::cli; }"), &["cli"]);
}

#[test]
fn super_that_climbs_to_the_root_is_read() {
    one(&check("src/error.rs", "use super::cli::X;"), &["src/error.rs:1", "cli"]);
    one(&check("src/scene/mod.rs", "use super::{math, cli};"), &["cli"]);
    one(&check("src/scene/mesh.rs", "use super::super::cli;"), &["cli"]);
    one(&check("src/scene.rs", "mod tests { use super::super::cli; }"), &["cli"]);
    assert_eq!(check("src/scene.rs", "mod tests { use super::*; }"), [""; 0]);
    assert_eq!(check("src/scene/mesh.rs", "mod a { use super::super::cli; }"), [""; 0]);
}

#[test]
fn ways_around_the_check_are_refused() {
    one(&check("src/scene/mod.rs", "use crate::*;"), &["names no room"]);
    one(&check("src/scene/mod.rs", "use crate as root;"), &["names no room"]);
    one(&check("src/scene/mod.rs", "use crate::{self as root};"), &["names no room"]);
    one(&check("src/scene/mod.rs", "use crate::Options;"), &["Options", "names no room"]);
    one(&check("src/scene/mod.rs", "macro_rules! m { () => { $crate::cli::x() } }"), &["cli"]);
    assert_eq!(check("src/scene/mod.rs", "pub(crate) fn f() {}"), [""; 0]);
}

#[test]
fn comments_and_strings_are_not_code() {
    let text = "//! [`crate::cli`] unsafe println!()\n/* crate::cli /* unsafe */ println!() */\n\
                const S: &str = \"crate::cli unsafe println!() \\\" \";\n\
                const R: &str = r#\"crate::cli \" unsafe\"#;\nconst C: char = '\"';\n\
                fn f<'a>(x: &'a str) -> char { '\\'' }\n";
    assert_eq!(check("src/scene/mod.rs", text), [""; 0]);
    one(&check("src/scene/mod.rs", &format!("{text}use crate::cli;")), &[":7"]);
}

#[test]
fn floor_0_may_import_itself_but_not_in_a_circle() {
    let down = ("src/sampling/mod.rs", "use crate::math::Vec3;");
    assert_eq!(check_all(&[down]), [""; 0]);
    let up = ("src/math/mod.rs", "use crate::error::Error;");
    let round = ("src/error.rs", "use crate::sampling::X;");
    one(&check_all(&[down, up, round]), &["circle", "math", "sampling", "error"]);
}

#[test]
fn a_room_without_a_floor_is_refused() {
    one(&check("src/utils/mod.rs", ""), &["utils", "no floor"]);
    assert!(Floors::read("pub mod math;").is_err_and(|e| e.contains("math")));
}

#[test]
fn unsafe_stays_in_its_rooms() {
    let text = "fn f() {\n    unsafe { g() }\n}";
    one(&check("src/shade/mod.rs", text), &["src/shade/mod.rs:2", "unsafe"]);
    one(&check("src/cluster/solo.rs", text), &["src/cluster/solo.rs:2", "unsafe"]);
    one(&check("tests/ranks.rs", text), &["tests/ranks.rs:2", "unsafe"]);
    assert_eq!(check("src/embree/device.rs", text), [""; 0]);
    assert_eq!(check("src/cluster/mpi.rs", text), [""; 0]);
    assert_eq!(check("src/scene/mod.rs", "#![deny(unsafe_code)]"), [""; 0]);
}

#[test]
fn only_the_command_line_prints() {
    for name in ["print", "println", "eprint", "eprintln", "dbg"] {
        let text = format!("fn f() {{ {name}!(\"x\") }}");
        one(&check("src/shade/mod.rs", &text), &["src/shade/mod.rs:1", name]);
        assert_eq!(check("src/cli/render.rs", &text), [""; 0]);
        assert_eq!(check("src/main.rs", &text), [""; 0]);
        assert_eq!(check("src/shade/tests.rs", &text), [""; 0]);
        let test = format!("#[cfg(test)]\nmod tests {{\n{text}\n}}");
        assert_eq!(check("src/shade/mod.rs", &test), [""; 0]);
    }
    one(&check("src/film/mod.rs", "mod tests { }\nfn f() { println!() }"), &["println"]);
}
