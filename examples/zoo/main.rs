//! `./x zoo`: random scenes of many families, or scene files, rendered with what the program infers and without, and
//! both judged by a converged trace. `docs/reuse.md` says what the tables mean. Needs the program
//! built; works in `target/zoo`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for people")]

mod given;
mod judging;
mod making;
mod options;
mod telling;

use clap::Parser;
use given::Given;
use judging::{Failure, Program, judge};
use making::{Change, FAMILIES, Specimen, Subject};
use options::Options;
use std::path::PathBuf;
use std::process::ExitCode;
use telling::{Sheet, Told, summary, table};

fn main() -> ExitCode {
    let options = Options::parse();
    match run(&options) {
        Ok(all_met) if !all_met && options.check => ExitCode::FAILURE,
        Ok(_) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("zoo: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the zoo; whether all targets are met.
fn run(options: &Options) -> Result<bool, Failure> {
    if options.list {
        FAMILIES.iter().for_each(|family| println!("{}", family.name));
        return Ok(true);
    }
    let program = Program::new(program()?);
    let given = Given::all(options)?;
    let folder = options.folder();
    let mut told = Vec::new();
    let mut sheet = Sheet::default();
    let (json, sheet_path) = (folder.join("zoo.json"), folder.join("sheet.png"));
    println!("{}", telling::HEAD);
    let mut show = |subject: &dyn Subject| -> Result<(), Failure> {
        let label = subject.label();
        let settings = options.settings.unwrap_or_else(|| subject.settings());
        let place = folder.join(&label.folder);
        let verdict = judge(&program, subject, settings, &options.plan(), &place)?;
        telling::save_panels(&place.join("panels.png"), &verdict)?;
        sheet.add(&verdict);
        let one = Told::new(label, settings, &verdict);
        println!("{}", one.line());
        told.push(one);
        // After each scene: a run that is stopped leaves what it found.
        telling::save_json(&json, &told, &summary(&told, options.frames))?;
        sheet.save(&sheet_path)
    };
    if given.is_empty() {
        options.indices()?.into_iter().try_for_each(|index| show(&specimen(options, index)))?;
    } else {
        given.iter().try_for_each(|scene| show(scene))?;
    }
    println!("\n{}", table(&told));
    let summary = summary(&told, options.frames);
    println!("{}", summary.text);
    println!("figures: {}, all scenes: {}", json.display(), sheet_path.display());
    telling::name_the_worst(&told, &folder);
    Ok(summary.all_met)
}

/// The random scene of this index.
fn specimen(options: &Options, index: u64) -> Specimen {
    let changes: [(bool, Change); 5] = [
        (options.lens, Specimen::with_lens),
        (options.gloss, Specimen::with_gloss),
        (options.sky, Specimen::with_sky),
        (options.matter, Specimen::with_matter),
        (options.fog, Specimen::with_fog),
    ];
    let wanted = changes.into_iter().filter(|(is_wanted, _)| *is_wanted);
    wanted.fold(Specimen::new(options.seed, index, options.frames), |specimen, (_, change)| {
        change(specimen, options.seed)
    })
}

/// The program, in the folder above this one or one of those above.
fn program() -> Result<PathBuf, Failure> {
    let own = std::env::current_exe()?;
    own.ancestors()
        .map(|folder| folder.join("tweenray"))
        .find(|path| path.is_file())
        .ok_or_else(|| "the program is not built: cargo build --release".into())
}
