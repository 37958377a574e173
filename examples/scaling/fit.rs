//! Does the model tell what eight ranks take, when it was fitted on one to four?

use crate::costs::Costs;
use crate::real::{Line, Ran, Stage};
use crate::simulation::{CostModel, Job};
use tweenray::sequence::Pyramid;

const SHOT: Pyramid = Pyramid { segment: 16, frames: 65 };
const WORDS: &str = "--size 400x300 --spp 1 --shadow-samples 16 --segment 16";
const RANKS: [u32; 5] = [1, 2, 3, 4, 8];
const REPEATS: usize = 3;

/// What was measured of so many ranks: least, median and most.
pub struct Row {
    pub ranks: u32,
    /// Seconds of a core, start left out.
    pub cpu: [f64; 3],
    /// From the first frame to the last.
    pub wall: [f64; 3],
    pub references: [f64; 3],
    /// Notes.
    pub notes: [f64; 3],
}

/// What the model says of so many ranks.
pub struct Said {
    pub cpu: f64,
    pub wall: f64,
    pub references: f64,
    pub notes: f64,
}

pub struct Fit {
    pub rows: Vec<Row>,
    pub costs: Costs,
    /// Cores that the ranks got together, of those that are shared with others.
    pub cores: f64,
    /// Seconds of a core that each rank adds.
    pub rank_seconds: f64,
    pub said: Vec<Said>,
}

pub fn fit(stage: &Stage) -> Fit {
    let mut rows = Vec::new();
    let mut costs = None;
    let mut message_bytes = 0;
    for ranks in RANKS {
        let line = Line { ranks, threads: 1, frames: SHOT.frames, words: WORDS.into() };
        let runs: Vec<(Ran, f64)> = (0..REPEATS)
            .map(|_| {
                let ran = stage.run(&line);
                let start = stage.start_of(&line);
                let cpu = (ran.cpu - start).max(0.0);
                (ran, cpu)
            })
            .collect();
        let of = |value: &dyn Fn(&(Ran, f64)) -> f64| spread(runs.iter().map(value).collect());
        let row = Row {
            ranks,
            cpu: of(&|(_, cpu)| *cpu),
            wall: of(&|(ran, _)| ran.wall()),
            references: of(&|(ran, _)| ran.sent("references").0 as f64),
            notes: of(&|(ran, _)| ran.sent("notes").0 as f64),
        };
        println!("  {ranks} ranks: {:.2} s of a core, {:.2} s", row.cpu[1], row.wall[1]);
        if ranks == 1 {
            costs = Some(Costs::of(&runs[0].0, SHOT, row.cpu[1]));
        } else if ranks <= 4 {
            message_bytes = runs[0].0.size("notes");
        }
        rows.push(row);
    }
    let mut costs = costs.unwrap();
    costs.message_bytes = message_bytes;
    costs.weigh(stage, "--size 400x300 --spp 1 --shadow-samples 16");
    let rank_seconds = fit_rank_seconds(&costs, &rows);
    let shares = rows[1..4].iter().map(|row| row.cpu[1] / row.wall[1]);
    // Two ranks never use more than two, whatever there is.
    let cores = shares.fold(0.0, f64::max);
    let said = rows.iter().map(|row| say(&costs, cores, rank_seconds, row.ranks)).collect();
    Fit { rows, costs, cores, rank_seconds, said }
}

/// What two to four ranks take more than one, and do not spend on making references ready to travel, each
/// of them adds. Least squares.
fn fit_rank_seconds(costs: &Costs, rows: &[Row]) -> f64 {
    let users = |f: u32| (1..=SHOT.frames).any(|g| SHOT.ancestors(g).contains(&f));
    let weight = |f: u32| if SHOT.is_key(f) { 1.0 } else { costs.between_share };
    let packing =
        costs.pack_seconds * (1..=SHOT.frames).filter(|f| users(*f)).map(weight).sum::<f64>();
    let more = |row: &Row| row.cpu[1] - rows[0].cpu[1] - packing;
    let rise: f64 = rows[1..4].iter().map(|row| f64::from(row.ranks) * more(row)).sum();
    let run: f64 = rows[1..4].iter().map(|row| f64::from(row.ranks).powi(2)).sum();
    (rise / run).max(0.0)
}

fn say(costs: &Costs, cores: f64, rank_seconds: f64, ranks: u32) -> Said {
    let seconds = costs.as_measured();
    let share = if ranks == 1 { None } else { Some(cores) };
    let model = CostModel { cores: share, ..costs.model(&seconds) };
    let job = Job { pyramid: SHOT, most_strips: strips(300), sends_to_all: false };
    let run = job.simulate(ranks, &model);
    let own = if ranks == 1 { 0.0 } else { rank_seconds * f64::from(ranks) };
    Said {
        cpu: run.busy_seconds + own,
        wall: run.seconds + own / share.unwrap_or(1.0),
        references: run.sent.references.messages as f64,
        notes: run.sent.notes.messages as f64,
    }
}

/// Into how many strips a frame of so many rows can be cut: rows of whole blocks.
pub fn strips(height: u32) -> u32 {
    height.div_ceil(8)
}

fn spread(mut values: Vec<f64>) -> [f64; 3] {
    values.sort_by(f64::total_cmp);
    [values[0], values[values.len() / 2], values[values.len() - 1]]
}
