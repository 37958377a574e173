//! The machine and this process, from `/proc`; unknown figures are `None`, never guessed.

use crate::error::{Error, Result};
use crate::scene::limits::ISAS;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;
use std::ffi::OsStr;
use std::fs;

/// The machine of a job.
#[derive(Debug, Clone, Serialize)]
pub struct Machine {
    /// Processor's name.
    pub cpu: Option<String>,
    /// Logical cores of the machine.
    pub cores: Option<usize>,
    /// Main memory, bytes.
    pub memory_bytes: Option<u64>,
    /// Operating system.
    pub system: &'static str,
}

impl Machine {
    /// This machine.
    pub fn here() -> Self {
        let cpuinfo = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let field = |line: &str| line.split_once(':').map(|(_, value)| value.trim().to_string());
        let cores = cpuinfo.lines().filter(|line| line.starts_with("processor")).count();
        Self {
            cpu: cpuinfo.lines().find(|line| line.starts_with("model name")).and_then(field),
            cores: (cores > 0).then_some(cores),
            memory_bytes: memory(),
            system: std::env::consts::OS,
        }
    }
}

/// A new pool of `threads` threads.
pub fn thread_pool(threads: usize) -> Result<ThreadPool> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|e| Error::Failed(format!("cannot start {threads} threads: {e}")))
}

/// Environment variable that names the widest instruction set to use.
const MAX_ISA: &str = "TWEENRAY_MAX_ISA";

/// The default instruction set, on which the last bits of a hit depend:
/// this machine's widest, or the narrower one that `TWEENRAY_MAX_ISA` names.
///
/// Errors: `Error::Usage` if the variable is not one of [`ISAS`] (an empty value counts as unset).
pub fn best_isa() -> Result<&'static str> {
    let most = std::env::var_os(MAX_ISA).filter(|name| !name.is_empty());
    narrower(detected_isa(), most.as_deref())
}

fn narrower(own: &'static str, most: Option<&OsStr>) -> Result<&'static str> {
    let Some(name) = most else { return Ok(own) };
    let Some(most) = ISAS.iter().position(|isa| name == *isa) else {
        let (name, isas) = (name.to_string_lossy(), ISAS.join(", "));
        let message = format!("{MAX_ISA} is '{name}', which is not an instruction set; use {isas}");
        return Err(Error::Usage(message));
    };
    // Another kind of processor has none of these.
    let own_place = ISAS.iter().position(|isa| *isa == own);
    Ok(own_place.map_or(own, |place| ISAS[place.min(most)]))
}

/// The widest instruction set that every machine of `best` has; `None` where they are of
/// different kinds of processor.
pub fn shared_isa(best: &[String]) -> Option<&'static str> {
    let places = best.iter().map(|name| ISAS.iter().position(|isa| isa == name));
    places.collect::<Option<Vec<_>>>()?.into_iter().min().map(|place| ISAS[place])
}

/// The widest instruction set of this machine that Embree has kernels for.
pub fn detected_isa() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        // Embree's AVX-512 kernels need all of these.
        let avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512cd")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512vl");
        match () {
            () if avx512 => "avx512",
            () if is_x86_feature_detected!("avx2") => "avx2",
            () if is_x86_feature_detected!("avx") => "avx",
            () if is_x86_feature_detected!("sse4.2") => "sse4.2",
            () => "sse2",
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    std::env::consts::ARCH
}

/// Main memory of the machine, bytes.
pub fn memory() -> Option<u64> {
    kilobytes("/proc/meminfo", "MemTotal:")
}

/// Load average over the last minute: mean number of processes that wanted a core.
pub fn load() -> Option<f64> {
    fs::read_to_string("/proc/loadavg").ok()?.split(' ').next()?.parse().ok()
}

/// Most memory that this process held at once, bytes.
pub fn peak_memory() -> Option<u64> {
    // Some kernels (gVisor) answer 0.
    kilobytes("/proc/self/status", "VmHWM:").filter(|bytes| *bytes > 0)
}

fn kilobytes(file: &str, key: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let number: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machines_share_the_narrowest_of_their_best() {
        let shared =
            |names: &[&str]| shared_isa(&names.iter().map(ToString::to_string).collect::<Vec<_>>());
        assert_eq!(shared(&["avx512", "avx2", "avx512"]), Some("avx2"));
        assert_eq!(shared(&["sse4.2"]), Some("sse4.2"));
        assert_eq!(shared(&["avx2", "aarch64"]), None);
        assert!(ISAS.contains(&detected_isa()) || cfg!(not(target_arch = "x86_64")));
    }

    #[test]
    fn the_variable_narrows_and_never_widens() {
        let of = |own, most: Option<&str>| narrower(own, most.map(OsStr::new)).ok();
        assert_eq!(of("avx2", None), Some("avx2"));
        assert_eq!(of("avx2", Some("sse4.2")), Some("sse4.2"));
        assert_eq!(of("avx2", Some("avx512")), Some("avx2"));
        assert_eq!(of("aarch64", Some("sse2")), Some("aarch64"));
        assert_eq!(of("avx2", Some("SSE4.2")), None);
    }
}
