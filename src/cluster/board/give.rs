//! What each rank is given next.

use super::{Board, Cut, Errand, Order, State, Step, What};

/// Strips for each rank that a frame is cut for, so that a slow rank does not hold the others.
const STRIPS_A_RANK: usize = 2;
/// Ranks that look for work of others at a time and find none.
const IN_VAIN: usize = 8;

impl Board {
    /// Everything that can be given out now.
    pub fn give(&mut self) -> Vec<Step> {
        let mut steps = Vec::new();
        if self.is_stopped {
            return steps;
        }
        for t in std::mem::take(&mut self.to_join) {
            self.give_joined(t, &mut steps);
        }
        self.give_all_idle(&mut steps);
        for rank in std::mem::take(&mut self.touched) {
            // So nobody waits for messages. Where little is ready it would only keep work from those
            // who have none.
            if self.ready.len() >= self.members.len() {
                self.give_ahead(rank, &mut steps);
            }
        }
        steps
    }

    /// An idle rank gets a strip of a frame that others wait for, else a task of its own, else somebody
    /// else's. Where few look for these in vain, the others need not: their turn comes
    /// with the next note.
    fn give_all_idle(&mut self, steps: &mut Vec<Step>) {
        let mut busiest = None;
        let mut in_vain = 0;
        let turn = self.turn.min(self.members.len() as u32);
        let idle: Vec<u32> =
            self.idle.range(turn..).chain(self.idle.range(..turn)).copied().collect();
        for rank in idle {
            if self.ready.is_empty() && self.cut.is_empty() {
                break;
            }
            if let Some(t) = self.cut_for(rank) {
                self.give_strip(rank, t, steps);
                continue;
            }
            let own = |t: &&usize| self.tasks[**t].unmet == 0;
            let mut found = self.members[rank as usize].own.iter().find(own).copied();
            if found.is_none() && in_vain < IN_VAIN {
                let busiest = busiest.get_or_insert_with(|| self.busiest());
                found = self.take_for(rank, busiest);
                in_vain += usize::from(found.is_none());
                self.turn = rank + 1;
            }
            if let Some(t) = found {
                self.give_found(rank, t, steps);
            }
        }
    }

    fn give_found(&mut self, rank: u32, t: usize, steps: &mut Vec<Step>) {
        match self.strips_of(t) {
            1 => self.give_whole(rank, t, steps),
            of => {
                self.no_longer_waits(t);
                let leader = rank;
                self.tasks[t].state = State::Cut(Cut { leader, of, given: 0, made: 0 });
                self.cut.insert(t);
                self.give_strip(rank, t, steps);
            }
        }
    }

    /// A task of its own for when it is through with the one in hand, on which it may depend.
    fn give_ahead(&mut self, rank: u32, steps: &mut Vec<Step>) {
        let member = &self.members[rank as usize];
        if member.in_hand != 1 {
            return;
        }
        let at_hand = |need: &usize| match &self.tasks[*need].state {
            State::Made => true,
            State::Given(other) => *other == rank,
            _ => false,
        };
        // Of a batch that waits for another rank's reference no task is at hand: it is not searched
        // for long.
        let mut own = member.own.iter().take(2 * super::take::FEW);
        let fits =
            |t: &&usize| self.tasks[**t].needs.iter().all(at_hand) && self.strips_of(**t) == 1;
        let next = own.find(fits).copied();
        if let Some(t) = next {
            self.give_whole(rank, t, steps);
        }
    }

    /// A frame with strips to give out: its own, or one whose references it has, or any.
    fn cut_for(&self, rank: u32) -> Option<usize> {
        let lack = |t: &usize| {
            let task = &self.tasks[*t];
            let leads = matches!(&task.state, State::Cut(cut) if cut.leader == rank);
            let has = |need: &&usize| self.tasks[**need].at.contains(&rank);
            (!leads, task.needs.len() - task.needs.iter().filter(has).count(), *t)
        };
        self.cut.iter().copied().min_by_key(lack)
    }

    /// Into how many strips a task is cut: one where there are ready tasks for all. A key frame is
    /// dear and takes no references to help with; another frame is cut where so many wait for it that
    /// sending references about pays.
    fn strips_of(&self, t: usize) -> u32 {
        let task = &self.tasks[t];
        if task.is_read {
            return 1;
        }
        let ready = self.ready.len().max(1);
        let helpers = match task.needs.is_empty() {
            // Whoever has frames of its own to come back to stays with them.
            true => 1 + self.without_own,
            false => self.idle.len(),
        };
        if helpers <= ready {
            return 1;
        }
        let ranks = helpers.div_ceil(ready);
        if self.lacking(t, ranks) >= self.tree(t, task.owner).len() && !task.needs.is_empty() {
            return 1;
        }
        self.most_strips.min((STRIPS_A_RANK * ranks) as u32).max(1)
    }

    /// How many references `ranks` idle ranks lack together to make a task.
    fn lacking(&self, t: usize, ranks: usize) -> usize {
        let needs = || self.tasks[t].needs.iter();
        let lack = |rank: &u32| needs().filter(|n| !self.tasks[**n].at.contains(rank)).count();
        self.idle.iter().take(ranks).map(lack).sum()
    }

    fn give_whole(&mut self, rank: u32, t: usize, steps: &mut Vec<Step>) {
        self.no_longer_waits(t);
        self.tasks[t].state = State::Given(rank);
        let what = What::Whole { strips: 0, frames: self.tasks[t].frames.clone() };
        self.hand_over(rank, t, what, steps);
    }

    fn give_strip(&mut self, rank: u32, t: usize, steps: &mut Vec<Step>) {
        let State::Cut(cut) = &mut self.tasks[t].state else { return };
        let what = What::Strip { number: cut.given, of: cut.of, leader: cut.leader };
        cut.given += 1;
        if cut.given == cut.of {
            self.cut.remove(&t);
        }
        self.hand_over(rank, t, what, steps);
    }

    fn give_joined(&mut self, t: usize, steps: &mut Vec<Step>) {
        let State::Cut(Cut { of, leader: rank, .. }) = self.tasks[t].state else { return };
        self.tasks[t].state = State::Given(rank);
        let what = What::Whole { strips: of, frames: self.tasks[t].frames.clone() };
        self.hand_over(rank, t, what, steps);
    }

    fn no_longer_waits(&mut self, t: usize) {
        self.ready.remove(&t);
        self.take_from(self.tasks[t].owner, t);
    }

    fn hand_over(&mut self, rank: u32, t: usize, what: What, steps: &mut Vec<Step>) {
        // Whoever puts strips together traced some of them.
        let is_joined = matches!(what, What::Whole { strips, .. } if strips > 0);
        let needs = if is_joined { Vec::new() } else { self.tasks[t].needs.clone() };
        for need in &needs {
            self.bring(*need, rank, steps);
        }
        let member = &mut self.members[rank as usize];
        member.in_hand += 1;
        self.idle.remove(&rank);
        self.touched.insert(rank);
        let drops = std::mem::take(&mut member.drops);
        let needs = needs.iter().map(|need| self.tasks[*need].original).collect();
        let task = &self.tasks[t];
        let order =
            Order { task: t, original: task.original, is_source: !task.users.is_empty(), what };
        steps.push(Step::Do(rank, Errand { order, needs, drops }));
    }

    /// Has the reference of a made task sent to `rank`, unless it is there or on its way.
    fn bring(&mut self, t: usize, rank: u32, steps: &mut Vec<Step>) {
        let task = &mut self.tasks[t];
        if !matches!(task.state, State::Made) || !task.at.insert(rank) {
            return;
        }
        let least = task.holders.iter_mut().min_by_key(|(_, sent)| **sent);
        if let Some((from, sent)) = least {
            *sent += 1;
            steps.push(Step::Send { from: *from, to: rank, original: task.original });
        }
    }
}
