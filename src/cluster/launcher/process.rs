//! The process that started this one as a rank: whether it lives, and which cores it had to give.
//!
//! By `/proc`; where there is none, nothing is known.

use std::collections::BTreeSet;
use std::fs;

/// Launchers that bind ranks to cores unless told otherwise, and their helpers on other nodes, as the
/// system names them.
const BINDING: [&str; 6] = ["mpirun", "mpiexec", "orterun", "orted", "prterun", "prted"];
/// Other launchers.
const OTHERS: [&str; 4] = ["prte", "hydra_pmi_proxy", "mpiexec.hydra", "slurmstepd"];

/// The launcher's process on this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LauncherProcess {
    /// Its name, as its user knows it.
    pub name: String,
    /// Its number.
    pub id: u32,
    /// When it started, in ticks since the machine did: a number is given again.
    started: u64,
}

/// What the system says of a process.
struct Stat {
    name: String,
    state: String,
    parent: u32,
    started: u64,
}

impl LauncherProcess {
    /// The nearest of this process's ancestors that is a launcher; `None` where none is known.
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

    /// Whether it has ended.
    pub fn is_gone(&self) -> bool {
        // What was killed stays listed until somebody asks for its exit code.
        !stat(self.id)
            .is_some_and(|s| s.started == self.started && s.state != "Z" && s.state != "X")
    }

    /// The cores that it could give to its ranks, where it binds these.
    pub(super) fn cores(&self) -> Option<BTreeSet<u32>> {
        BINDING.contains(&&*self.name).then(|| cores(&allowed_cores(self.id)))
    }
}

/// What users call the launcher that the system shows as `name`: `mpirun` of Open MPI 5 turns itself into
/// `prterun`, of older ones it may be shown as `orterun`.
fn usual_name(name: &str) -> &str {
    match name {
        "prterun" | "orterun" => "mpirun",
        name => name,
    }
}

fn stat(id: u32) -> Option<Stat> {
    parse_stat(&fs::read_to_string(format!("/proc/{id}/stat")).ok()?)
}

/// `123 (name) S 1 ...`; the name may hold anything, brackets and blanks too.
fn parse_stat(text: &str) -> Option<Stat> {
    let (head, tail) = text.rsplit_once(')')?;
    let (_, name) = head.split_once('(')?;
    let mut fields = tail.split_whitespace();
    let state = fields.next()?.to_string();
    let parent = fields.next()?.parse().ok()?;
    // The 22nd field of all, of which four are read.
    let started = fields.nth(17)?.parse().ok()?;
    Some(Stat { name: name.into(), state, parent, started })
}

/// The cores that a process may use, as the system lists them; empty where it does not tell.
pub(super) fn allowed_cores(id: u32) -> String {
    let text = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    line.unwrap_or_default().trim().into()
}

/// `0-3,8` as numbers.
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
    fn a_list_of_cores_is_read() {
        assert!(cores("0-2,8").into_iter().eq([0, 1, 2, 8]));
        assert!(cores("7").into_iter().eq([7]));
        assert!(cores("").is_empty() && cores("x-3").is_empty());
    }

    #[test]
    fn a_launcher_has_the_name_that_its_user_knows() {
        assert_eq!(
            ["prterun", "mpirun", "slurmstepd"].map(usual_name),
            ["mpirun", "mpirun", "slurmstepd"]
        );
    }

    #[test]
    fn a_process_is_known_by_number_and_start() {
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
