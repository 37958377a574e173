//! The command line.

use crate::judging::{Failure, Plan, SIDE};
use crate::making::{FAMILIES, Settings};
use crate::telling::LONG;
use clap::Parser;
use std::path::PathBuf;

/// What the tables show.
const COLUMNS: &str = "\
Columns, for each scene, then for each family:
  dB            how much nearer to the truth inferred frames are than the mean of four traces, worst frame; 20 log10 of the RMSEs
  RMSE          of that frame, in steps of 1/255, inferred and traced
  worst tile    RMSE of the 32 x 32 tile that exceeds the target most, or comes nearest; its frame, column and row
  >16, %        pixels off by more than 16 steps, inferred and traced
  flicker       change of errors from frame to frame, inferred over traced; of a family median and largest
  inferred      per cent of the points that were inferred: seen directly, then in mirrors and through glass
  speed         CPU seconds with --policy off over those with reuse; with 4 frames mostly noise
  audit         RMSE by the audit; ! if its interval of 95 % does not contain the true error
  kept          frames without a tile worse than traced, / those without one that is worse beyond chance (of a family \"strict\"
                and \"kept\"), of how many
  CPU seconds   with reuse, and with --policy off

A trace is the same frame with --policy off; the truth is the mean of many, of other random numbers. The targets, and which
are met, are printed last. Figures (zoo.json), scenes and pictures go to target/zoo/SEED. A scene of 4 frames takes some
seconds, one of 48 frames a minute.

Examples:
  ./x zoo --seed 7 --count 5
  ./x zoo --seed 7 --families forest,mirrors --settings 4,16 --check
  ./x zoo --scene scene.toml --frames 48";

/// Renders random scenes, or those given, and judges what was inferred.
#[derive(Parser)]
#[command(name = "zoo", after_help = COLUMNS)]
pub struct Options {
    /// Judges this scene file, with the camera's own move and its own settings, instead of random scenes; may be repeated
    ///
    /// Camera samples are 4 where the file says nothing of them. --frames says into how many frames the whole move is cut:
    /// the fewer, the further apart they are, and the less is inferred.
    #[arg(
        long = "scene",
        value_name = "FILE",
        conflicts_with_all = [
            "seed", "count", "families", "only", "lens", "gloss", "sky", "matter", "fog",
        ]
    )]
    pub scenes: Vec<PathBuf>,
    /// Scenes are a function of this and their index
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// How many scenes
    #[arg(long, default_value_t = 38, value_parser = count)]
    count: usize,
    /// Frames of each move; the first and the last are traced
    #[arg(long, default_value_t = 4, value_parser = frames)]
    pub frames: usize,
    /// Most frames of a move that are judged
    #[arg(long, default_value_t = 6)]
    judged: usize,
    /// Pixels of a frame; tiles of 32 x 32 are judged
    #[arg(long, default_value = "160x96", value_parser = size)]
    size: [u32; 2],
    /// Camera samples and light samples of every scene, as 4,16 or 4..16,16, instead of random ones or the file's
    ///
    /// With a range of camera samples the truth has many camera samples of its own, since traced and inferred frames
    /// take different numbers, and errors include those of edges. Uniform samples are rendered too, and the error of the
    /// range is compared with theirs at equal rays.
    #[arg(long, value_parser = settings)]
    pub settings: Option<Settings>,
    /// Only scenes of these families
    #[arg(long, value_delimiter = ',')]
    families: Vec<String>,
    /// Gives every camera a random thin lens
    #[arg(long)]
    pub lens: bool,
    /// Makes mirrors rough, and half of what is painted plastic, some of it coated or partly metal
    #[arg(long)]
    pub gloss: bool,
    /// Gives every scene a random environment for a sky: an image, a gradient, or sun and sky
    #[arg(long)]
    pub sky: bool,
    /// Makes most of what is painted of other matter (images, normal maps, cut-outs, panes, emission), and glass rough
    #[arg(long)]
    pub matter: bool,
    /// Fills every scene with random fog
    #[arg(long)]
    pub fog: bool,
    /// Only the scene of this index
    #[arg(long)]
    only: Option<u64>,
    /// Names the families
    #[arg(long)]
    pub list: bool,
    /// Exit code 1 where a target is missed
    #[arg(long)]
    pub check: bool,
}

impl Options {
    /// Where scenes, pictures and figures go.
    pub fn folder(&self) -> PathBuf {
        let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
        let own = if self.scenes.is_empty() { self.seed.to_string() } else { "scenes".into() };
        PathBuf::from(target).join("zoo").join(own)
    }

    pub fn plan(&self) -> Plan {
        Plan {
            size: self.size,
            judged: self.judged.max(2),
            between_only: false,
            timed: self.frames >= LONG,
        }
    }

    /// Indices of the scenes. An index means the same scene whatever else is asked for.
    ///
    /// # Errors
    /// Where there is no such family.
    pub fn indices(&self) -> Result<Vec<u64>, Failure> {
        if let Some(only) = self.only {
            return Ok(vec![only]);
        }
        let number = |name: &String| {
            let found = FAMILIES.iter().position(|family| family.name == name);
            found.ok_or_else(|| format!("there is no family {name}; --list names them"))
        };
        let wanted: Vec<usize> = self.families.iter().map(number).collect::<Result<_, _>>()?;
        let is_wanted = |index: &u64| {
            wanted.is_empty() || wanted.contains(&((index % FAMILIES.len() as u64) as usize))
        };
        Ok((0..).filter(is_wanted).take(self.count).collect())
    }
}

fn count(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|count| *count > 0).ok_or("wanted: 1 or more".into())
}

fn frames(text: &str) -> Result<usize, String> {
    // In-between frames there must be, and numbers above those of the move are the judges'.
    match text.parse() {
        Ok(frames) if (3..1000).contains(&frames) => Ok(frames),
        _ => Err("wanted: 3 to 999".into()),
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once('x').ok_or("wanted: WxH, as 160x96")?;
    let number = |text: &str| text.parse::<u32>().map_err(|e| format!("{text}: {e}"));
    let size = [number(w)?, number(h)?];
    if size.iter().any(|side| *side < SIDE as u32) {
        return Err(format!("a frame holds at least one tile of {SIDE} x {SIDE}"));
    }
    Ok(size)
}

fn settings(text: &str) -> Result<Settings, String> {
    let (camera, light) = text.split_once(',').ok_or("wanted: SPP,LIGHT, as 4,16 or 4..16,16")?;
    let number = |text: &str| text.parse::<usize>().map_err(|e| format!("{text}: {e}"));
    let (spp, most) = match camera.split_once("..") {
        Some((least, most)) => (number(least)?, Some(number(most)?)),
        None => (number(camera)?, None),
    };
    let settings = Settings { spp, most, light: number(light)? };
    if settings.spp == 0 || settings.light == 0 {
        return Err("wanted: at least one sample of each".into());
    }
    if settings.most.is_some_and(|most| most <= settings.spp) {
        return Err("wanted: more samples at the end of a range than at its start".into());
    }
    Ok(settings)
}
