//! Cores that the launcher's binding leaves idle.

use super::process::{LauncherProcess, allowed_cores, cores};
use super::{World, here};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// What one rank knows.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Place {
    node: u32,
    threads: usize,
    own: BTreeSet<u32>,
    /// What the launcher on its machine could give, where it binds.
    launcher: Option<BTreeSet<u32>>,
}

/// How the launcher bound the ranks of a node, where it left cores to nobody.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    /// Ranks of the node.
    pub ranks: usize,
    /// Least cores that one of them has.
    pub cores: usize,
    /// Threads of that one.
    pub threads: usize,
    /// Cores of the node that the launcher had.
    pub of: usize,
    /// Those of them that no rank may use.
    pub idle: usize,
}

impl World {
    /// How the launcher bound the ranks, where that leaves cores idle; of several such nodes the first.
    /// `threads` are this rank's. All ranks call it.
    ///
    /// # Errors
    /// Those of talking to other ranks.
    pub fn binding(&self, threads: usize) -> Result<Option<Binding>> {
        let launcher = here().and_then(|_| LauncherProcess::find()?.cores());
        let own = cores(&allowed_cores(std::process::id()));
        let node = self.nodes()?[self.rank() as usize];
        Ok(wasted(&self.all(Place { node, threads, own, launcher })?))
    }
}

fn wasted(places: &[Place]) -> Option<Binding> {
    let nodes: BTreeSet<u32> = places.iter().map(|place| place.node).collect();
    nodes.into_iter().find_map(|node| {
        let ranks: Vec<&Place> = places.iter().filter(|place| place.node == node).collect();
        let had = ranks.iter().find_map(|place| place.launcher.as_ref())?;
        let used: BTreeSet<u32> = ranks.iter().flat_map(|place| &place.own).copied().collect();
        let idle = had.difference(&used).count();
        let least = ranks.iter().min_by_key(|place| place.own.len())?;
        let (cores, threads) = (least.own.len(), least.threads);
        let binding = Binding { ranks: ranks.len(), cores, threads, of: had.len(), idle };
        (idle > 0 && cores > 0).then_some(binding)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_cores_that_nobody_may_use_are_told() {
        let place = |node, own: &str, launcher: Option<&str>| Place {
            node,
            threads: 1,
            own: cores(own),
            launcher: launcher.map(cores),
        };
        let all = Some("0-3");
        let bound = wasted(&[place(0, "0", all), place(0, "1", all)]);
        assert_eq!(bound, Some(Binding { ranks: 2, cores: 1, threads: 1, of: 4, idle: 2 }));
        assert_eq!(wasted(&[place(0, "0-1", all), place(0, "2-3", all)]), None, "all are used");
        assert_eq!(wasted(&[place(0, "0-3", all)]), None, "not bound");
        assert_eq!(wasted(&[place(0, "0", None)]), None, "not the launcher's doing");
        assert_eq!(wasted(&[place(0, "0", Some("0"))]), None, "the launcher had no more");
        let second = wasted(&[place(0, "0-3", all), place(1, "2", all)]);
        assert_eq!(second.map(|b| (b.ranks, b.idle)), Some((1, 3)), "another node");
    }
}
