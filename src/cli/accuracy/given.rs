//! Options that the user gave to a sweep; every command on its page includes them.

use super::AccuracyArgs;
use crate::cli::args::{SceneArgs, SettingArgs};
use clap::parser::ValueSource;
use clap::{Args, Command};

/// An option with its value, as it was given.
pub struct Given {
    /// `--spp`
    name: String,
    value: String,
}

/// The options about the scene and its picture in the command `words`.
pub fn given(words: &[String]) -> Vec<Given> {
    let command = AccuracyArgs::augment_args(Command::new("tweenray accuracy"));
    // The second word is the subcommand's name.
    let Ok(found) = command.try_get_matches_from(words.iter().skip(1)) else { return Vec::new() };
    let shaping = SettingArgs::augment_args(SceneArgs::augment_args(Command::new("")));
    let of = |arg: &clap::Arg| {
        let (id, long) = (arg.get_id().as_str(), arg.get_long()?);
        let is_given = found.value_source(id) == Some(ValueSource::CommandLine);
        let value = found.get_raw(id).filter(|_| is_given)?.next()?;
        Some(Given { name: format!("--{long}"), value: value.to_string_lossy().into_owned() })
    };
    shaping.get_arguments().filter_map(of).collect()
}

/// The words of `options`, preceded by the given options that `options` does not set.
pub fn with_given(given: &[Given], options: &str) -> Vec<String> {
    let own: Vec<&str> = options.split_whitespace().collect();
    let others = given.iter().filter(|given| !own.contains(&given.name.as_str()));
    let others = others.flat_map(|given| [given.name.clone(), given.value.clone()]);
    others.chain(own.iter().map(ToString::to_string)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn given_options_come_before_those_that_a_setting_varies() {
        let line = "tweenray accuracy a.obj -o out --up z --turns 3 --spp=2 --shadow-samples 4 \
                    --knobs reuse,samples --threads 2 -q --exposure 1e-3";
        let words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        let given = given(&words);
        let command = |options| with_given(&given, options).join(" ");
        assert_eq!(command(""), "--up z --spp 2 --exposure 1e-3 --shadow-samples 4");
        assert_eq!(
            command("--spp 8 --policy off"),
            "--up z --exposure 1e-3 --shadow-samples 4 --spp 8 --policy off"
        );
    }
}
