//! Collective calls before and after rendering: agreement on errors, broadcast from one rank to all or to
//! its node, gather and all-gather.

use super::Communicator;
use super::failure::RemoteError;
use super::point_to_point::{decode, encode};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How long a failed rank waits for the other ranks to reach the barrier.
const FAILURE_TIMEOUT: Duration = Duration::from_millis(1500);

impl Communicator {
    /// Returns `outcome` if no rank failed, else the error of the lowest failed rank, on every rank.
    /// All ranks call it. A failed rank waits 1.5 s for the others; then it returns its own error, and
    /// [`has_unreported_failure`](Self::has_unreported_failure) is true.
    pub fn agree<T>(&self, outcome: Result<T>) -> Result<T> {
        if self.size() == 1 || self.has_unreported_failure() {
            return outcome;
        }
        if !self.timed_barrier(outcome.is_err().then_some(FAILURE_TIMEOUT)) {
            self.has_unreported_failure.set(true);
            return outcome;
        }
        let own = outcome.as_ref().err().map(RemoteError::of);
        let errors: Vec<Option<RemoteError>> = self.all_gather_packed(&own)?;
        match (errors.into_iter().enumerate().find_map(|(r, e)| Some((r, e?))), outcome) {
            (None, outcome) => outcome,
            (Some((rank, _)), Err(own)) if rank as u32 == self.rank() => Err(own),
            (Some((rank, error)), _) => Err(error.into_error(rank)),
        }
    }

    /// Calls `make` on rank 0 and broadcasts the value or the error to every rank. All ranks call it.
    pub fn from_root<T>(&self, make: impl FnOnce() -> Result<T>) -> Result<T>
    where
        T: Serialize + for<'de> Deserialize<'de>,
    {
        if self.size() == 1 {
            return make();
        }
        // (A one-tuple, because in JSON a value like `()` looks the same as no value.)
        let made = if self.is_root() { make().map(|value| Some((value,))) } else { Ok(None) };
        let bytes = encode(&self.agree(made)?)?;
        match decode::<Option<(T,)>>(&self.broadcast(bytes))? {
            Some((value,)) => Ok(value),
            None => Err(Error::Failed("rank 0 sent nothing".into())),
        }
    }

    /// Calls `make` on the first rank of each node and broadcasts the value or the error within the
    /// node, through shared memory. All ranks call it.
    pub fn from_node<T>(&self, make: impl FnOnce() -> Result<T>) -> Result<T>
    where
        T: Serialize + for<'de> Deserialize<'de>,
    {
        let (node_rank, ranks) = self.node_rank_and_size();
        if self.size() == 1 {
            return make();
        }
        let pack = |value: T| match ranks {
            1 => Ok((value, Vec::new())),
            _ => packed(postcard::to_stdvec(&value)).map(|bytes| (value, bytes)),
        };
        let made = if node_rank == 0 { make().and_then(pack).map(Some) } else { Ok(None) };
        // The other ranks sleep meanwhile, and leave the cores to the rank that runs `make`.
        match self.agree(made)? {
            Some((value, bytes)) => {
                (1..ranks).for_each(|_| self.count(|sent| sent.scene(bytes.len())));
                self.broadcast_in_node(bytes);
                Ok(value)
            }
            None => packed(postcard::from_bytes(&self.broadcast_in_node(Vec::new()))),
        }
    }

    /// Whether this rank failed and the other ranks do not know: [`abort`](Self::abort) must follow.
    pub fn has_unreported_failure(&self) -> bool {
        self.has_unreported_failure.get()
    }

    /// The values of all ranks, in rank order, on rank 0; empty on the others. All ranks call it.
    pub fn gather<T: Serialize + for<'de> Deserialize<'de>>(&self, value: &T) -> Result<Vec<T>> {
        let all = self.gather_bytes(encode(value)?);
        all.iter().map(|bytes| decode(bytes)).collect()
    }

    /// The values of all ranks, in rank order, on every rank. All ranks call it.
    pub fn all_gather<T: Serialize + for<'de> Deserialize<'de>>(&self, value: T) -> Result<Vec<T>> {
        if self.size() == 1 { Ok(vec![value]) } else { self.all_gather_packed(&value) }
    }

    /// Returns `value` if all ranks have the same, else an error that names two that differ. All ranks
    /// call it.
    pub fn same_everywhere(&self, what: &str, value: String) -> Result<String> {
        if self.size() == 1 {
            return Ok(value);
        }
        let all: Vec<String> = self.all_gather_packed(&value)?;
        match all.iter().enumerate().find(|(_, other)| **other != all[0]) {
            None => Ok(value),
            Some((rank, other)) => Err(Error::Usage(format!(
                "rank 0 {what} {}, but rank {rank} {what} {other}\n  help: frames would differ in \
                 their last bits; --isa avx2 makes mixed machines agree",
                all[0]
            ))),
        }
    }

    /// The values of all ranks on every rank, in postcard's binary form, which keeps floats exact.
    fn all_gather_packed<T: Serialize + for<'de> Deserialize<'de>>(
        &self,
        value: &T,
    ) -> Result<Vec<T>> {
        let gathered = self.gather_bytes(packed(postcard::to_stdvec(value))?);
        let all = self.broadcast(packed(postcard::to_stdvec(&gathered))?);
        let all: Vec<Vec<u8>> = packed(postcard::from_bytes(&all))?;
        all.iter().map(|bytes| packed(postcard::from_bytes(bytes))).collect()
    }
}

fn packed<T>(outcome: postcard::Result<T>) -> Result<T> {
    outcome.map_err(|e| Error::Failed(format!("cannot share with other ranks: {e}")))
}
