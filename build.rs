//! Compiles the C shim in `ffi/` and records which Embree it was compiled with.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // embree4-sys found Embree, or failed with the list of places it looked in.
    let include = embree("INCLUDE");
    let lib = embree("LIB");

    compile_shim(&include);
    println!("cargo::rustc-env=TWEENRAY_EMBREE_VERSION={}", embree("VERSION"));
    if !is_system(Path::new(&lib)) {
        // Only the package that makes the binaries can hand them an rpath.
        println!("cargo::rustc-link-arg=-Wl,-rpath,{lib}");
    }
}

/// What embree4-sys's build script says about Embree.
fn embree(key: &str) -> String {
    let name = format!("DEP_EMBREE4_{key}");
    env::var(&name).unwrap_or_else(|_| panic!("embree4-sys did not set {name}"))
}

fn compile_shim(include: &str) {
    // The folder itself: a new source file counts as a change.
    println!("cargo::rerun-if-changed=ffi");
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
