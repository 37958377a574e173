//! Compiles the C shim in `ffi/` and records which Embree it was compiled with.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// What a frame's bytes may depend on.
const SOURCES: [&str; 4] = ["src", "ffi", "build.rs", "Cargo.lock"];

fn main() {
    SOURCES.iter().for_each(|source| println!("cargo::rerun-if-changed={source}"));
    println!("cargo::rustc-env=TWEENRAY_SOURCES={:08x}", fingerprint());
    // embree4-sys found Embree, or failed with the list of places it looked in.
    let include = embree("INCLUDE");
    let lib = embree("LIB");

    compile_shim(&include);
    println!("cargo::rustc-env=TWEENRAY_EMBREE_VERSION={}", embree("VERSION"));
    if !is_system(Path::new(&lib)) {
        // Only the package that makes the binaries can hand them an rpath.
        println!("cargo::rustc-link-arg=-Wl,-rpath,{lib}");
        // Where `./x install` puts the library, seen from the program.
        println!("cargo::rustc-link-arg-bins=-Wl,-rpath,$ORIGIN/../lib/tweenray");
    }
}

/// What embree4-sys's build script says about Embree.
fn embree(key: &str) -> String {
    let name = format!("DEP_EMBREE4_{key}");
    env::var(&name).unwrap_or_else(|_| panic!("embree4-sys did not set {name}"))
}

/// Tells builds of other sources apart: 32 bits of FNV-1a (Fowler, Noll and Vo, 1991).
fn fingerprint() -> u32 {
    let mut files = Vec::new();
    SOURCES.iter().for_each(|source| list(Path::new(source), &mut files));
    files.sort();
    let mut hash = 0x811c_9dc5;
    for file in files {
        let text = fs::read(&file).expect("a readable source");
        for byte in file.to_string_lossy().bytes().chain(text) {
            hash = (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        }
    }
    hash
}

/// All files at and below `path`.
fn list(path: &Path, files: &mut Vec<PathBuf>) {
    match fs::read_dir(path) {
        Ok(entries) => {
            entries.for_each(|entry| list(&entry.expect("a readable folder").path(), files));
        }
        Err(_) => files.push(path.into()),
    }
}

fn compile_shim(include: &str) {
    let mut sources: Vec<PathBuf> = fs::read_dir("ffi")
        .expect("the folder ffi is part of the project")
        .map(|entry| entry.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|e| e == "c"))
        .collect();
    sources.sort();
    cc::Build::new()
        .files(&sources)
        .include("ffi")
        .include(include)
        .opt_level(3)
        .std("c11")
        .flag("-ffp-contract=off")
        .extra_warnings(true)
        .compile("tweenray_shim");
}

/// Whether the loader looks in `dir` by itself.
fn is_system(dir: &Path) -> bool {
    let multiarch = env::var("TARGET").unwrap_or_default().replace("-unknown-", "-");
    let system = ["/usr/lib", "/usr/lib64", "/usr/local/lib", "/lib", "/lib64"];
    system.iter().any(|s| dir == Path::new(s) || dir == Path::new(s).join(&multiarch))
}
