//! `tweenray report`: the page of a render.

mod charts;
mod film;
mod find;
mod standing;
mod tables;

use super::args::whole;
use super::audited::worse_than_traced;
use super::choose::{Choice, asks_for_choice};
use super::exit::Exit;
use super::say;
use crate::error::{Error, Result};
use crate::output::atomic;
use crate::output::manifest::{Header, Manifest, Row, folder_of};
use crate::output::video::shell_line;
use crate::page::job::JobPage;
use crate::page::words;
use crate::scene::{FrameRange, Policy, ReuseSettings, Settings};
use crate::sequence::audit_row;
use crate::sequence::survey::survey_of;
use crate::stats::{AuditSums, RayCounts, ReuseCounts};
use clap::Args;
use standing::Standing;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Make the page of a finished or running render: player, maps, charts, audit
///
/// One HTML file that opens from disk and needs no network. It is made from the manifest and the
/// frames that are there, so it can be made while the job runs.
#[derive(Debug, Args)]
#[command(after_help = "\
Maps need a render with --maps that inferred something or had --spp MIN..MAX. The page is put beside the frames:
out/frame.report.html for out/frame_####.png.

Examples:
  tweenray report out/demo
  tweenray report out/demo/frame.manifest.jsonl -o report.html --width 960")]
pub struct ReportArgs {
    /// Folder of the frames, or one of the manifests (.manifest.jsonl) in it
    #[arg(value_name = "DIR")]
    place: PathBuf,
    /// Where the page goes [default: beside the frames]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Widest that pictures in the page are, pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 640, allow_negative_numbers = true,
        value_parser = whole(16, 8192))]
    width: u32,
    /// Show every Nth frame in the player [default: so that there are at most 300]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Print nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Frames in the player unless told otherwise: some 15 MB of pictures.
const MOST_SHOWN: usize = 300;

/// A job, as read from its manifest.
struct Job {
    manifest: Manifest,
    /// Its settings; defaults for settings that another version did not write.
    settings: Settings,
    folder: PathBuf,
    standing: Standing,
    /// Rows of the frames whose files are whole, by frame.
    rows: Vec<Row>,
}

/// Runs the command.
pub fn run(args: &ReportArgs) -> Result<Exit> {
    let path = find::manifest(&args.place)?;
    let manifest =
        Manifest::as_of_now(&path)?.ok_or_else(|| Error::input(&path, "is there no longer"))?;
    let out = args.output.clone().unwrap_or_else(|| find::page_beside(&path));
    if out.extension().is_none_or(|e| !e.eq_ignore_ascii_case("html")) {
        let message = format!("the page's name {} does not end in .html", out.display());
        return Err(Error::Usage(message));
    }
    atomic::make_room(&out)?;
    let mut job = Job::of(manifest, &path)?;
    let html = job.page(args)?.to_html()?;
    atomic::write(&out, |w| w.write_all(html.as_bytes()))?;
    if !args.quiet {
        let (count, size) = (job.standing.count(), words::bytes(html.len() as u64));
        let gaps: String = job.standing.gaps().iter().map(|gap| format!("\n  {gap}")).collect();
        say::result(format!("{} ({count}, {size}){gaps}", out.display()))?;
        if let Some(worse) = job.worse_than_traced() {
            say::warning(worse);
        }
    }
    Ok(Exit::Done)
}

impl Job {
    fn of(manifest: Manifest, path: &Path) -> Result<Self> {
        let whole_move = |last| Ok(FrameRange { first: 1, last });
        let standing = Standing::new(survey_of(&manifest, path, whole_move)?, &manifest);
        let rows = { manifest.rows.values() }.filter(|row| standing.is_whole(row.frame)).cloned();
        let rows = rows.collect();
        let settings = serde_json::from_value(manifest.header.settings.clone());
        let settings = settings.unwrap_or_default();
        Ok(Self { manifest, settings, folder: folder_of(path).to_path_buf(), standing, rows })
    }

    fn page(&mut self, args: &ReportArgs) -> Result<JobPage> {
        let every = args.every.map_or(self.rows.len().div_ceil(MOST_SHOWN).max(1), |n| n as usize);
        let (film, unreadable) = film::pictures(self, every, args.width);
        self.standing.unreadable = unreadable;
        let header = &self.manifest.header;
        let choice = Choice::of(header);
        let shown = match every {
            1 => String::new(),
            n => format!("The player has one frame in {n} (--every)."),
        };
        Ok(JobPage {
            title: header.scene.clone(),
            state: self.state(),
            gaps: self.standing.gaps(),
            facts: self.facts(),
            maps: film::maps_of(self, &film),
            film,
            shown,
            charts: charts::all(self),
            effects: tables::effects(self),
            effects_note: tables::EFFECTS_NOTE.into(),
            audit: tables::audit(self),
            worse: self.worse_than_traced(),
            no_audit: self.why_no_audit().into(),
            timeline: charts::timeline(self),
            ranks: tables::ranks(self),
            command: match &choice {
                Some(choice) => shell_line(&choice.spelled_out(&header.command)),
                None => shell_line(&header.command),
            },
            command_note: command_note(header, choice.is_some()),
            chosen: choice.map(|choice| tables::chosen(self, &choice)).unwrap_or_default(),
            manifest: tables::manifest(self),
            settings: tables::settings(self),
            frames: tables::frames(self),
            version: crate::output::VERSION.into(),
            made: words::date(now()),
        })
    }

    fn facts(&self) -> Vec<(String, String)> {
        let settings = &self.manifest.header.settings;
        let seconds: f64 = self.rows.iter().map(|row| row.seconds).sum();
        let bytes = self.rows.iter().map(|row| row.bytes).sum();
        let mut facts = vec![
            ("Size".to_string(), format!("{} × {}", settings["width"], settings["height"])),
            ("Time in frames".into(), words::seconds(seconds)),
            ("A frame".into(), words::seconds(seconds / self.rows.len().max(1) as f64)),
            ("Rays".into(), words::short(self.rays().total() as f64)),
            ("Files".into(), words::bytes(bytes)),
        ];
        if let Some(samples) = self.samples() {
            let mean = format!("{} ({})", words::short(samples), self.settings.camera_samples());
            facts.push(("Camera samples a pixel".into(), mean));
        }
        if let Some(share) = self.reuse().share() {
            facts.push(("Surface points inferred".into(), words::percent(share)));
        }
        if let Some([rmse, low, high]) = self.audited().and_then(|sums| audit_row(&sums).rmse) {
            let [rmse, low, high] = [rmse, low, high].map(words::steps);
            facts.push(("Error of inferred frames".into(), format!("{rmse}/255 ({low}–{high})")));
        }
        facts
    }

    /// The sentence that takes the place of an audit.
    fn why_no_audit(&self) -> &'static str {
        let ReuseSettings { policy, .. } = self.settings.reuse;
        match policy {
            Policy::Colour => "Policy colour has no audit, so the error of its frames is unknown.",
            _ if self.rows.is_empty() => "No frame was audited yet.",
            _ if !self.reuse().is_inferred() => "No frame was audited: none is inferred.",
            _ => "No frame was audited.",
        }
    }

    fn rays(&self) -> RayCounts {
        let mut sum = RayCounts::default();
        self.rows.iter().for_each(|row| sum += row.rays);
        sum
    }

    /// Mean number of camera samples of a pixel; `None` where all pixels take as many.
    fn samples(&self) -> Option<f64> {
        let means: Vec<f64> = self.rows.iter().filter_map(|row| row.samples).collect();
        (!means.is_empty()).then(|| means.iter().sum::<f64>() / means.len() as f64)
    }

    fn reuse(&self) -> ReuseCounts {
        let mut sum = ReuseCounts::default();
        self.rows.iter().for_each(|row| sum += row.reuse);
        sum
    }

    /// Which inferred frames are less accurate than traced ones.
    fn worse_than_traced(&self) -> Option<String> {
        worse_than_traced(&self.audits(), self.settings.reuse.tolerance)
    }

    /// All audits together.
    fn audited(&self) -> Option<AuditSums> {
        let audits = self.audits();
        (!audits.is_empty()).then(|| audits.iter().map(|(_, sums)| *sums).sum())
    }

    /// The audits of the frames, by frame.
    fn audits(&self) -> Vec<(u32, AuditSums)> {
        self.rows.iter().filter_map(|row| Some((row.frame, row.audit?.sums))).collect()
    }
}

/// The note about the command on the page. `is_spelled_out` says whether it has the chosen settings in place of
/// `--target` or `--budget`.
fn command_note(header: &Header, is_spelled_out: bool) -> String {
    let same = "The same scene, settings and version give the same bytes, on any number of ranks and \
                threads.";
    if !asks_for_choice(&header.command) {
        return format!("It started the sequence. {same}");
    }
    match is_spelled_out {
        true => format!(
            "It started the sequence; what was chosen stands in place of --target or --budget. {same}"
        ),
        false => {
            "It started the sequence, and chose settings by measured times: those below.".into()
        }
    }
}

/// Seconds since 1970; 0 before.
fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |t| t.as_secs_f64())
}
