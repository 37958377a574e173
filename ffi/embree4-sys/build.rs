//! Finds Embree 4.3 or newer, binds its installed header and tells cargo where its library lies.

use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, exit};

/// The first version whose hit structs have the sizes that `src/lib.rs` asserts.
const OLDEST: Version = (4, 3, 0);

type Version = (u32, u32, u32);

/// A usable Embree.
struct Embree {
    include: PathBuf,
    lib: PathBuf,
    version: Version,
}

/// One place to look in: an installation prefix and why it is looked at.
struct Place {
    prefix: PathBuf,
    reason: &'static str,
}

fn main() {
    for name in ["EMBREE_DIR", "CMAKE_PREFIX_PATH", "PKG_CONFIG_PATH"] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    println!("cargo::rerun-if-changed=build.rs");
    let embree = find().unwrap_or_else(|message| {
        eprintln!("{message}");
        exit(1);
    });
    // Only the place in use: a path that does not exist would make every build start afresh.
    println!("cargo::rerun-if-changed={}", embree.include.join("embree4").display());
    bind(&embree.include);

    let (major, minor, patch) = embree.version;
    println!("cargo::rustc-link-search=native={}", embree.lib.display());
    println!("cargo::rustc-link-lib=dylib=embree4");
    // For this package's own tests; the binaries get theirs from the build script of their package.
    println!("cargo::rustc-link-arg=-Wl,-rpath,{}", embree.lib.display());
    println!("cargo::metadata=include={}", embree.include.display());
    println!("cargo::metadata=lib={}", embree.lib.display());
    println!("cargo::metadata=version={major}.{minor}.{patch}");
}

/// The first place with a new enough Embree, or a message that names every place.
fn find() -> Result<Embree, String> {
    let mut looked = String::new();
    let mut found = None;
    for place in places() {
        let result = probe(&place.prefix);
        let finding = match &result {
            Ok(embree) => format!("Embree {}", dotted(embree.version)),
            Err(why) => why.clone(),
        };
        let _ = writeln!(looked, "  {} ({}): {finding}", place.prefix.display(), place.reason);
        found = found.or(result.ok());
        // What EMBREE_DIR names is meant: nothing else may quietly take its place.
        if found.is_some() || place.reason == FROM_ENV {
            break;
        }
    }
    found.ok_or_else(|| {
        format!(
            "no Embree {} or newer found. Looked for its header embree4/rtcore.h and its library \
             libembree4.so in\n{looked}Run `./x setup`, which installs it, or set EMBREE_DIR to the \
             folder that holds its include/ and lib/ (and unset it where it is set wrongly).",
            dotted(OLDEST)
        )
    })
}

const FROM_ENV: &str = "EMBREE_DIR";

fn places() -> Vec<Place> {
    let mut places = Vec::new();
    let mut add = |prefix: PathBuf, reason| {
        if !prefix.as_os_str().is_empty() && !places.iter().any(|p: &Place| p.prefix == prefix) {
            places.push(Place { prefix, reason });
        }
    };
    if let Some(dir) = env::var_os("EMBREE_DIR").filter(|d| !d.is_empty()) {
        add(dir.into(), FROM_ENV);
    }
    add(private_prefix(), "made by ./x setup");
    for dir in env::split_paths(&env::var_os("CMAKE_PREFIX_PATH").unwrap_or_default()) {
        add(dir, "CMAKE_PREFIX_PATH");
    }
    if let Some(dir) = pkg_config_prefix() {
        add(dir, "pkg-config");
    }
    add("/usr/local".into(), "system");
    add("/usr".into(), "system");
    places
}

/// `.embree` at the root of the workspace.
fn private_prefix() -> PathBuf {
    let here = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    here.ancestors().nth(2).expect("ffi/embree4-sys is two folders down").join(".embree")
}

fn pkg_config_prefix() -> Option<PathBuf> {
    ["embree4", "embree"].iter().find_map(|name| {
        let out = Command::new("pkg-config").args(["--variable=prefix", name]).output().ok()?;
        let prefix = String::from_utf8(out.stdout).ok()?.trim().to_string();
        (out.status.success() && !prefix.is_empty()).then(|| prefix.into())
    })
}

/// The Embree in `prefix`, or what it lacks.
fn probe(prefix: &Path) -> Result<Embree, String> {
    let include = prefix.join("include");
    let header = ["rtcore_config.h", "rtcore.h"]
        .iter()
        .find_map(|name| fs::read_to_string(include.join("embree4").join(name)).ok())
        .ok_or("no header include/embree4/rtcore.h")?;
    let version = version_of(&header).ok_or("a header without RTC_VERSION")?;
    if version < OLDEST {
        return Err(format!("Embree {}, too old", dotted(version)));
    }
    let lib = library_dir(prefix)
        .ok_or_else(|| format!("the header of {}, but no libembree4.so", dotted(version)))?;
    Ok(Embree { include, lib, version })
}

fn version_of(header: &str) -> Option<Version> {
    let number = |name: &str| {
        header.lines().find_map(|line| {
            let mut words = line.split_whitespace();
            (words.next() == Some("#define") && words.next() == Some(name))
                .then(|| words.next()?.parse().ok())?
        })
    };
    Some((number("RTC_VERSION_MAJOR")?, number("RTC_VERSION_MINOR")?, number("RTC_VERSION_PATCH")?))
}

fn library_dir(prefix: &Path) -> Option<PathBuf> {
    let target = env::var("TARGET").unwrap_or_default();
    // Debian's multiarch folder: x86_64-unknown-linux-gnu lies in x86_64-linux-gnu.
    let multiarch = target.replace("-unknown-", "-");
    ["lib".to_string(), format!("lib/{multiarch}"), "lib64".to_string()]
        .iter()
        .map(|dir| prefix.join(dir))
        .find(|dir| dir.join("libembree4.so").exists())
}

fn dotted((major, minor, patch): Version) -> String {
    format!("{major}.{minor}.{patch}")
}

/// Writes the bindings to `OUT_DIR/bindings.rs`.
fn bind(include: &Path) {
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it")).join("bindings.rs");
    bindgen::Builder::default()
        .header_contents("embree4-sys.h", "#include <embree4/rtcore.h>\n")
        .clang_arg(format!("-I{}", include.display()))
        .allowlist_function("rtc.*")
        .allowlist_type("RTC.*")
        .allowlist_var("RTC_.*")
        .prepend_enum_name(false)
        .derive_default(false)
        // Embree's C comments would become doc tests.
        .generate_comments(false)
        .rust_target(bindgen::RustTarget::stable(85, 0).expect("bindgen knows Rust 1.85"))
        .rust_edition(bindgen::RustEdition::Edition2024)
        .generate()
        .unwrap_or_else(|error| {
            eprintln!("cannot bind embree4/rtcore.h in {}: {error}", include.display());
            exit(1);
        })
        .write_to_file(&out)
        .unwrap_or_else(|error| {
            eprintln!("cannot write {}: {error}", out.display());
            exit(1);
        });
}
