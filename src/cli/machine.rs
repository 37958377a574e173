//! The machine and this process, from `/proc`; what is not there is absent, never guessed.

use serde::Serialize;
use std::fs;

/// What a job ran on.
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

/// The widest instruction set of this machine that Embree has kernels for: what it uses unless
/// told, and by which the last bits of a hit differ.
pub fn best_isa() -> &'static str {
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
