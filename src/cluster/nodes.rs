//! Which ranks share a node, so that neighbouring segments of the camera path are rendered on one node.

use super::Communicator;
use crate::error::{Error, Result};
use std::fs;
use std::path::Path;

/// The ranks in the order in which they get segments of the camera path: node by node. Ranks that share
/// memory share a node, unless the file at `map` says otherwise. The file has one line for each rank, in
/// any order: the rank's number and the name of its node. A `#` starts a comment. All ranks call it.
///
/// # Errors
/// `map` cannot be read, or does not name every rank exactly once.
pub fn rank_order(comm: &Communicator, map: Option<&Path>) -> Result<Vec<u32>> {
    let nodes = match map {
        // A map for several ranks is no error for one rank, so the same command line works.
        _ if comm.size() == 1 => vec![0],
        Some(path) => comm.from_root(|| read(path, comm.size()))?,
        None => comm.node_ids()?,
    };
    let mut order: Vec<u32> = (0..comm.size()).collect();
    order.sort_by_key(|rank| (nodes[*rank as usize], *rank));
    Ok(order)
}

/// Checks that the file at `map` is valid for a job of `ranks` ranks.
///
/// # Errors
/// As for [`rank_order`].
pub fn check_rank_map(map: &Path, ranks: u32) -> Result<()> {
    match ranks {
        1 => Ok(()),
        _ => read(map, ranks).map(drop),
    }
}

/// For each rank the id of its node: ids count the names in the file, in order of first use.
fn read(path: &Path, size: u32) -> Result<Vec<u32>> {
    let text = fs::read_to_string(path)
        .map_err(|e| Error::input(path, format!("cannot read the map of ranks: {e}")))?;
    parse(&text, size).map_err(|why| Error::input(path, why))
}

fn parse(text: &str, size: u32) -> std::result::Result<Vec<u32>, String> {
    let mut names: Vec<&str> = Vec::new();
    let mut nodes = vec![None; size as usize];
    // Some editors write a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = line.split_whitespace().collect();
        let (rank, name) = match words[..] {
            [] => continue,
            [rank, name] => (rank, name),
            _ => return Err(format!("line {number}: expected a rank and the name of its node")),
        };
        let slot = rank.parse().ok().and_then(|rank: usize| nodes.get_mut(rank));
        let Some(slot) = slot else {
            return Err(format!("line {number}: {rank} is no rank of this job, which has {size}"));
        };
        let node = names.iter().position(|known| *known == name).unwrap_or_else(|| {
            names.push(name);
            names.len() - 1
        });
        if slot.replace(node as u32).is_some() {
            return Err(format!("line {number}: rank {rank} has a node already"));
        }
    }
    let missing = nodes.iter().position(Option::is_none);
    match missing {
        Some(rank) => Err(format!("rank {rank} has no node")),
        None => Ok(nodes.into_iter().flatten().collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_names_every_rank_once() {
        assert_eq!(parse("# two nodes\n0 a\n2 a # near\n\n1 b\n3 b\n", 4), Ok(vec![0, 1, 0, 1]));
        assert_eq!(parse("\u{feff}0 a\r\n1 b\r\n", 2), Ok(vec![0, 1]));
        let wrong = |text: &str, says: &str| {
            let why = parse(text, 2).expect_err(text);
            assert!(why.contains(says), "{why}");
        };
        wrong("0 a\n", "rank 1 has no node");
        wrong("0 a\n0 b\n", "line 2: rank 0 has a node already");
        wrong("0 a\n2 b\n", "line 2: 2 is no rank of this job");
        wrong("0\n", "line 1: expected");
    }
}
