//! What all ranks do together before and after the frames: they agree, tell each other, and share what
//! one of them read.

use super::World;
use super::failure::Verdict;
use super::post::{decode, encode};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// How long a rank that failed waits for the others to hear of it.
const PATIENCE: Duration = Duration::from_millis(1500);

impl World {
    /// `outcome`, if no rank failed; else the error of the lowest rank that did, on every rank.
    /// All ranks call it. Where others are busy with something long, a rank that failed soon
    /// comes back with its own error, and [`is_stranded`](Self::is_stranded).
    pub fn agree<T>(&self, outcome: Result<T>) -> Result<T> {
        if self.size() == 1 || self.is_stranded() {
            return outcome;
        }
        if !self.assemble(outcome.is_err().then_some(PATIENCE)) {
            self.is_stranded.set(true);
            return outcome;
        }
        let mine = outcome.as_ref().err().map(Verdict::of);
        let verdicts: Vec<Option<Verdict>> = self.exchange(&mine)?;
        match (verdicts.into_iter().enumerate().find_map(|(r, v)| Some((r, v?))), outcome) {
            (None, outcome) => outcome,
            (Some((rank, _)), Err(own)) if rank as u32 == self.rank() => Err(own),
            (Some((rank, verdict)), _) => Err(verdict.into_error(rank)),
        }
    }

    /// What rank 0 makes of `make`, on every rank; its error too. All ranks call it.
    pub fn from_root<T>(&self, make: impl FnOnce() -> Result<T>) -> Result<T>
    where
        T: Serialize + for<'de> Deserialize<'de>,
    {
        if self.size() == 1 {
            return make();
        }
        // (As a list of one: what is nothing itself, as `()`, is told from nothing.)
        let made = if self.is_root() { make().map(|value| Some((value,))) } else { Ok(None) };
        let bytes = encode(&self.agree(made)?)?;
        match decode::<Option<(T,)>>(&self.broadcast(bytes))? {
            Some((value,)) => Ok(value),
            None => Err(Error::Failed("rank 0 sent nothing".into())),
        }
    }

    /// What the first rank of each node makes of `make`, on every rank of the node; its error too. It
    /// travels as a whole, by the memory that they share. All ranks call it.
    pub fn from_node<T>(&self, make: impl FnOnce() -> Result<T>) -> Result<T>
    where
        T: Serialize + for<'de> Deserialize<'de>,
    {
        let (place, ranks) = self.place_in_node();
        if self.size() == 1 {
            return make();
        }
        let pack = |value: T| match ranks {
            1 => Ok((value, Vec::new())),
            _ => wire(postcard::to_stdvec(&value)).map(|bytes| (value, bytes)),
        };
        let made = if place == 0 { make().and_then(pack).map(Some) } else { Ok(None) };
        // Asleep, however long it takes: the others leave the cores to who makes it.
        match self.agree(made)? {
            Some((value, bytes)) => {
                (1..ranks).for_each(|_| self.count(|sent| sent.scene(bytes.len())));
                self.broadcast_in_node(bytes);
                Ok(value)
            }
            None => wire(postcard::from_bytes(&self.broadcast_in_node(Vec::new()))),
        }
    }

    /// Whether this rank failed and the others do not know: only [`fail`](Self::fail) is left.
    pub fn is_stranded(&self) -> bool {
        self.is_stranded.get()
    }

    /// Every rank's `value`, in rank order, on rank 0; nothing on the others. All ranks call it.
    pub fn gather<T: Serialize + for<'de> Deserialize<'de>>(&self, value: &T) -> Result<Vec<T>> {
        let all = self.gather_bytes(encode(value)?);
        all.iter().map(|bytes| decode(bytes)).collect()
    }

    /// Every rank's `value`, in rank order, on every rank. All ranks call it.
    pub fn all<T: Serialize + for<'de> Deserialize<'de>>(&self, value: T) -> Result<Vec<T>> {
        if self.size() == 1 { Ok(vec![value]) } else { self.exchange(&value) }
    }

    /// `value` if all ranks have the same, else an error that says what differs. All ranks call it.
    pub fn same_everywhere(&self, what: &str, value: String) -> Result<String> {
        if self.size() == 1 {
            return Ok(value);
        }
        let all: Vec<String> = self.exchange(&value)?;
        match all.iter().enumerate().find(|(_, other)| **other != all[0]) {
            None => Ok(value),
            Some((rank, other)) => Err(Error::Usage(format!(
                "rank 0 {what} {}, but rank {rank} {what} {other}\n  help: frames would differ in \
                 their last bits; --isa avx2 makes mixed machines agree",
                all[0]
            ))),
        }
    }

    /// (Packed, so that every number comes back as it was.)
    fn exchange<T: Serialize + for<'de> Deserialize<'de>>(&self, value: &T) -> Result<Vec<T>> {
        let gathered = self.gather_bytes(wire(postcard::to_stdvec(value))?);
        let all = self.broadcast(wire(postcard::to_stdvec(&gathered))?);
        let all: Vec<Vec<u8>> = wire(postcard::from_bytes(&all))?;
        all.iter().map(|bytes| wire(postcard::from_bytes(bytes))).collect()
    }
}

fn wire<T>(outcome: postcard::Result<T>) -> Result<T> {
    outcome.map_err(|e| Error::Failed(format!("cannot share with other ranks: {e}")))
}
