//! The launcher's process on this machine: whether it lives, and its cores.
//!
//! All is read from `/proc`. On a system without `/proc` no launcher is found.

use std::collections::BTreeSet;
use std::fs;

/// Process names of launchers that bind ranks to cores by default, and of their helpers on other nodes.
const BINDING: [&str; 6] = ["mpirun", "mpiexec", "orterun", "orted", "prterun", "prted"];
/// Process names of other launchers.
const OTHERS: [&str; 4] = ["prte", "hydra_pmi_proxy", "mpiexec.hydra", "slurmstepd"];

/// The launcher's process on this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LauncherProcess {
    /// Name of the command that the user started.
    pub name: String,
    /// Process id.
    pub id: u32,
    /// Start time in clock ticks since boot; tells the process from a later one with the same id.
    started: u64,
}

/// Fields of `/proc/PID/stat`.
struct Stat {
    name: String,
    state: String,
    parent: u32,
    started: u64,
}

impl LauncherProcess {
    /// This process's nearest ancestor that is a launcher.
    pub(super) fn find() -> Option<Self> {
        let mut id = std::process::id();
        loop {
            id = stat(id)?.parent;
            let Stat { name, started, .. } = stat(id)?;
            if BINDING.contains(&&*name) || OTHERS.contains(&&*name) {
                return Some(Self { name: usual_name(&name).into(), id, started });
            }
        }
    }

    /// Whether the process has ended.
    pub fn is_gone(&self) -> bool {
        // A killed process stays listed as a zombie until its parent reads the exit code.
        !stat(self.id)
            .is_some_and(|s| s.started == self.started && s.state != "Z" && s.state != "X")
    }

    /// The cores that the launcher may use, if it is one that binds ranks to cores by default.
    pub(super) fn cores(&self) -> Option<BTreeSet<u32>> {
        BINDING.contains(&&*self.name).then(|| cores(&allowed_cores(self.id)))
    }
}

/// The command behind the process name `name`: `mpirun` of Open MPI 5 runs as `prterun`, that of older
/// versions may run as `orterun`.
fn usual_name(name: &str) -> &str {
    match name {
        "prterun" | "orterun" => "mpirun",
        name => name,
    }
}

fn stat(id: u32) -> Option<Stat> {
    parse_stat(&fs::read_to_string(format!("/proc/{id}/stat")).ok()?)
}

/// Parses `123 (name) S 1 ...`. The name may contain brackets and blanks.
fn parse_stat(text: &str) -> Option<Stat> {
    let (head, tail) = text.rsplit_once(')')?;
    let (_, name) = head.split_once('(')?;
    let mut fields = tail.split_whitespace();
    let state = fields.next()?.to_string();
    let parent = fields.next()?.parse().ok()?;
    // Field 22 of the line; four were read.
    let started = fields.nth(17)?.parse().ok()?;
    Some(Stat { name: name.into(), state, parent, started })
}

/// The cores that a process may use, in the form `0-3,8`; empty if unknown.
pub(super) fn allowed_cores(id: u32) -> String {
    let text = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    line.unwrap_or_default().trim().into()
}

/// The numbers of a list such as `0-3,8`.
pub(super) fn cores(list: &str) -> BTreeSet<u32> {
    let range = |text: &str| {
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
    };
    list.split(',').filter_map(range).flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_cores_is_parsed() {
        assert!(cores("0-2,8").into_iter().eq([0, 1, 2, 8]));
        assert!(cores("7").into_iter().eq([7]));
        assert!(cores("").is_empty() && cores("x-3").is_empty());
    }

    #[test]
    fn a_launcher_is_named_by_the_command_that_started_it() {
        assert_eq!(
            ["prterun", "mpirun", "slurmstepd"].map(usual_name),
            ["mpirun", "mpirun", "slurmstepd"]
        );
    }

    #[test]
    fn a_process_is_identified_by_its_id_and_start_time() {
        let text = "12 (a) b) S 7 12 1 0 -1 4 100 0 0 0 1 2 0 0 20 0 1 0 4711 99 5";
        let found = parse_stat(text).expect("a process");
        assert_eq!((&*found.name, &*found.state), ("a) b", "S"));
        assert_eq!((found.parent, found.started), (7, 4711));
        let own = stat(std::process::id()).expect("itself");
        let here = LauncherProcess { name: own.name, id: std::process::id(), started: own.started };
        assert!(!here.is_gone());
        assert!(LauncherProcess { started: own.started + 1, ..here }.is_gone());
    }
}
