//! Cores that no rank may use because the launcher bound each rank to few cores.

use super::process::{LauncherProcess, allowed_cores, cores};
use super::{Communicator, current};
use crate::error::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The cores of one rank.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct RankCores {
    /// Id of the rank's node.
    node: u32,
    threads: usize,
    /// Cores that the rank may use.
    own: BTreeSet<u32>,
    /// Cores that the launcher on the node could give, if it is one that binds.
    launcher: Option<BTreeSet<u32>>,
}

/// A node with cores that no rank may use.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    /// Number of ranks on the node.
    pub ranks: usize,
    /// Number of cores of the rank with the fewest.
    pub cores: usize,
    /// Number of threads of that rank.
    pub threads: usize,
    /// Number of cores of the node that the launcher may use.
    pub of: usize,
    /// Number of the launcher's cores that no rank may use.
    pub idle: usize,
}

impl Communicator {
    /// The first node with cores that no rank may use. `threads` is this rank's number of threads. All
    /// ranks call it.
    ///
    /// # Errors
    /// A message between ranks cannot be encoded or decoded.
    pub fn binding(&self, threads: usize) -> Result<Option<Binding>> {
        let launcher = current().and_then(|_| LauncherProcess::find()?.cores());
        let own = cores(&allowed_cores(std::process::id()));
        let node = self.node_ids()?[self.rank() as usize];
        Ok(first_with_idle_cores(&self.all_gather(RankCores { node, threads, own, launcher })?))
    }
}

fn first_with_idle_cores(all: &[RankCores]) -> Option<Binding> {
    let nodes: BTreeSet<u32> = all.iter().map(|rank| rank.node).collect();
    nodes.into_iter().find_map(|node| {
        let ranks: Vec<&RankCores> = all.iter().filter(|rank| rank.node == node).collect();
        let had = ranks.iter().find_map(|rank| rank.launcher.as_ref())?;
        let used: BTreeSet<u32> = ranks.iter().flat_map(|rank| &rank.own).copied().collect();
        let idle = had.difference(&used).count();
        let least = ranks.iter().min_by_key(|rank| rank.own.len())?;
        let (cores, threads) = (least.own.len(), least.threads);
        let binding = Binding { ranks: ranks.len(), cores, threads, of: had.len(), idle };
        (idle > 0 && cores > 0).then_some(binding)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_cores_that_no_rank_may_use_count_as_idle() {
        let rank = |node, own: &str, launcher: Option<&str>| RankCores {
            node,
            threads: 1,
            own: cores(own),
            launcher: launcher.map(cores),
        };
        let all = Some("0-3");
        let bound = first_with_idle_cores(&[rank(0, "0", all), rank(0, "1", all)]);
        assert_eq!(bound, Some(Binding { ranks: 2, cores: 1, threads: 1, of: 4, idle: 2 }));
        assert_eq!(
            first_with_idle_cores(&[rank(0, "0-1", all), rank(0, "2-3", all)]),
            None,
            "all are used"
        );
        assert_eq!(first_with_idle_cores(&[rank(0, "0-3", all)]), None, "not bound");
        assert_eq!(
            first_with_idle_cores(&[rank(0, "0", None)]),
            None,
            "the launcher does not bind"
        );
        assert_eq!(
            first_with_idle_cores(&[rank(0, "0", Some("0"))]),
            None,
            "the launcher had no more"
        );
        let second = first_with_idle_cores(&[rank(0, "0-3", all), rank(1, "2", all)]);
        assert_eq!(second.map(|b| (b.ranks, b.idle)), Some((1, 3)), "another node");
    }
}
