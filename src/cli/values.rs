//! Parsers of option values: sizes, frame ranges, crops, choices, numbers in bounds.

use crate::accuracy::Goal;
use crate::scene::{FrameRange, Rect, SaveInterval, limits, parse_time, parse_time_limit};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::de::DeserializeOwned;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::time::Duration;

/// A range of frames; the shot fills in an open end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRequest {
    first: Option<u32>,
    last: Option<u32>,
}

impl FrameRequest {
    /// The frames of a shot of `count` frames, or what is wrong with them.
    pub fn of_shot(self, count: u32) -> Result<FrameRange, String> {
        let range = FrameRange { first: self.first.unwrap_or(1), last: self.last.unwrap_or(count) };
        in_shot(range, count).map(|()| range)
    }
}

/// Checks that `range` lies in a shot of `count` frames; the error says what is wrong.
pub fn in_shot(range: FrameRange, count: u32) -> Result<(), String> {
    if range.first >= 1 && range.first <= range.last && range.last <= count {
        return Ok(());
    }
    let FrameRange { first, last } = range;
    Err(match first == last {
        true => format!("frame {first} lies outside the shot, which has frames 1..{count}"),
        false => {
            format!("frames {first}..{last} lie outside the shot, which has frames 1..{count}")
        }
    })
}

/// `640x360`.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let wrong = || "a size is written WIDTHxHEIGHT in pixels, as in 640x360".to_string();
    let (w, h) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
    let edge = |text: &str| text.trim().parse::<u32>().map_err(|_| wrong());
    match (edge(w)?, edge(h)?) {
        (0, _) | (_, 0) => Err("an image needs at least one pixel each way".into()),
        size => Ok(size),
    }
}

/// A number of samples; where there is a most, the first number is the least.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampleNumber {
    /// All, or the least.
    pub least: u32,
    /// The most, above the least.
    pub most: Option<u32>,
}

impl SampleNumber {
    /// All or the most, and the least of a range.
    pub fn of_light(self) -> (u32, Option<u32>) {
        (self.most.unwrap_or(self.least), self.most.map(|_| self.least))
    }
}

/// `4`, `4..16` (the least and the most).
pub fn camera_samples(text: &str) -> Result<SampleNumber, String> {
    samples("camera samples", 1, text)
}

/// As [`camera_samples`], and 0.
pub fn light_samples(text: &str) -> Result<SampleNumber, String> {
    samples("samples", 0, text)
}

fn samples(name: &str, fewest: u32, text: &str) -> Result<SampleNumber, String> {
    let most = limits::MAX_SAMPLES;
    let number = |text: &str| {
        let count = text.trim().parse().ok().filter(|n| (fewest..=most).contains(n));
        count.ok_or_else(|| {
            format!(
                "{name} are written 4, or 4..16 (the least and the most), from {fewest} to {most}"
            )
        })
    };
    let Some((least, most)) = text.split_once("..") else {
        return Ok(SampleNumber { least: number(text)?, most: None });
    };
    match (number(least)?, number(most)?) {
        (0, _) => Err(format!("a range of {name} starts at 1; 0 alone means none")),
        (least, most) if most < least => {
            Err(format!("{least}..{most} ends before it starts: write {most}..{least}"))
        }
        (least, most) => Ok(SampleNumber { least, most: (most > least).then_some(most) }),
    }
}

/// `7`, `1..16` (both included), `5..`, `..8`.
pub fn frames(text: &str) -> Result<FrameRequest, String> {
    let number = |text: &str| match text.trim().parse::<u32>() {
        Ok(0) => Err("frames are counted from 1".to_string()),
        Ok(n) => Ok(n),
        Err(_) => Err("frames are written 7, 1..16 (both included) or 5..".to_string()),
    };
    let end = |text: &str| if text.is_empty() { Ok(None) } else { number(text).map(Some) };
    let request = match text.split_once("..") {
        None => {
            let only = Some(number(text)?);
            FrameRequest { first: only, last: only }
        }
        Some((first, last)) => FrameRequest { first: end(first)?, last: end(last)? },
    };
    match request {
        FrameRequest { first: Some(a), last: Some(b) } if a > b => {
            Err(format!("frame {a} comes after frame {b}"))
        }
        request => Ok(request),
    }
}

/// `9=picture.png`: a frame and the picture of it.
pub fn upload(text: &str) -> Result<(u32, PathBuf), String> {
    let wrong = || "an upload is written FRAME=FILE, as in 9=picture.png".to_string();
    let (frame, file) =
        text.split_once('=').filter(|(_, file)| !file.is_empty()).ok_or_else(wrong)?;
    Ok((frame.trim().parse().map_err(|_| wrong())?, PathBuf::from(file)))
}

/// `x0,y0,x1,y1`; the second corner is excluded.
pub fn crop(text: &str) -> Result<Rect, String> {
    let wrong = || {
        "a crop is written x0,y0,x1,y1 in pixels from the upper left, x1 and y1 excluded"
            .to_string()
    };
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.map_err(|_| wrong())?[..] {
        [x0, y0, x1, y1] if x0 < x1 && y0 < y1 => Ok(Rect { x0, y0, x1, y1 }),
        [_, _, _, _] => Err("this crop holds no pixel: x0 < x1 and y0 < y1 must hold".into()),
        _ => Err(wrong()),
    }
}

/// `psnr=45`, `ssim=0.99`, `flip=0.02`, `max-share=0.1%`.
pub fn goal(text: &str) -> Result<Goal, String> {
    let wrong = "a target is written psnr=45, ssim=0.99, flip=0.02 or max-share=0.1%";
    let (figure, value) = text.split_once('=').ok_or(wrong)?;
    let inner = |x: f64| match x > 0.0 && x < 1.0 {
        true => Ok(x),
        false => Err("this target has to lie between 0 and 1 (100 %), both excluded".to_string()),
    };
    match figure.trim() {
        "psnr" => within(10.0..=100.0)(value).map(Goal::Psnr),
        "ssim" => share(value).and_then(inner).map(Goal::Ssim),
        "flip" => share(value).and_then(inner).map(Goal::Flip),
        "max-share" => share(value).and_then(inner).map(Goal::MaxShare),
        _ => Err(wrong.into()),
    }
}

/// `25m`, `1h30m`, `90s`, `2d`.
pub fn time(text: &str) -> Result<Duration, String> {
    parse_time(text)
}

/// A time, or one of Slurm's forms: `30` (minutes), `00:30:00`, `1-00:00:00`.
pub fn time_limit(text: &str) -> Result<Duration, String> {
    parse_time_limit(text)
}

/// A budget of time, at least one second.
pub fn budget(text: &str) -> Result<Duration, String> {
    let time = parse_time(text)?;
    if time.is_zero() {
        return Err("nothing is rendered in no time: a budget is at least 1s".into());
    }
    Ok(time)
}

/// `1 h 30 min`, `2 min`, `90 s` as `1 min 30 s`: exactly, to the second.
pub fn time_in_words(time: Duration) -> String {
    let s = time.as_secs();
    let parts = [(s / 3600, "h"), (s % 3600 / 60, "min"), (s % 60, "s")];
    let told = parts.iter().filter(|(n, _)| *n > 0).map(|(n, unit)| format!("{n} {unit}"));
    told.collect::<Vec<_>>().join(" ")
}

/// A time, or `off`.
pub fn time_or_off(text: &str) -> Result<SaveInterval, String> {
    SaveInterval::parse(text)
}

/// The most that a camera sample may be; `None` is `off`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clamp(pub Option<f32>);

/// A factor, or `off`.
pub fn clamp(text: &str) -> Result<Clamp, String> {
    if text.trim() == "off" {
        return Ok(Clamp(None));
    }
    let most = within_f32(crate::scene::limits::FACTOR)(text);
    most.map(|most| Clamp(Some(most))).map_err(|message| format!("{message}, or \"off\""))
}

/// A parser of numbers in `range`.
pub fn within(
    range: RangeInclusive<f64>,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync {
    move |text| {
        let value: f64 = text.trim().parse().map_err(|_| "this is not a number".to_string())?;
        let (least, most) = (range.start(), range.end());
        let wrong = || format!("expected a number from {} to {}", plain(*least), plain(*most));
        if range.contains(&value) { Ok(value) } else { Err(wrong()) }
    }
}

/// As [`within`], for settings that are f32.
pub fn within_f32(
    range: RangeInclusive<f64>,
) -> impl Fn(&str) -> Result<f32, String> + Clone + Send + Sync {
    let parse = within(range);
    move |text| parse(text).map(|value| value as f32)
}

/// A share: `0.05` or `5%`.
pub fn share(text: &str) -> Result<f64, String> {
    if let Some(percent) = text.trim().strip_suffix('%') {
        return within(0.0..=100.0)(percent).map(|percent| percent / 100.0);
    }
    within(limits::SHARE)(text).map_err(|wrong| match within(1.0..=100.0)(text) {
        Ok(percent) => format!("{wrong}, or per cent with their sign: {percent}%"),
        Err(_) => wrong,
    })
}

/// As [`share`], for settings that are f32.
pub fn share_f32(text: &str) -> Result<f32, String> {
    share(text).map(|share| share as f32)
}

/// `1000`, but `1e30`.
fn plain(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x) { x.to_string() } else { format!("{x:e}") }
}

/// `on` or `off`.
pub fn switch() -> impl TypedValueParser<Value = bool> {
    PossibleValuesParser::new(["on", "off"]).map(|text| text == "on")
}

/// One of `names`, each the name that serde knows the value of `T` by.
pub fn choice<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names)
        .try_map(|name| serde_json::from_value::<T>(serde_json::Value::String(name)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::limits;

    #[test]
    fn frame_ranges_include_both_ends_and_stay_in_the_shot() {
        let range = |text: &str, count| frames(text)?.of_shot(count).map(|r| (r.first, r.last));
        assert_eq!(range("7", 16), Ok((7, 7)));
        assert_eq!(range("1..16", 16), Ok((1, 16)));
        assert_eq!(range("5..", 16), Ok((5, 16)));
        assert_eq!(range("..8", 16), Ok((1, 8)));
        for (text, count) in [("0", 16), ("9..3", 16), ("1..17", 16), ("20..", 16), ("a", 16)] {
            assert!(range(text, count).is_err(), "{text}");
        }
        assert!(frames("1-16").is_err() && frames("1...3").is_err() && frames("-1").is_err());
    }

    #[test]
    fn sizes_and_crops_need_a_pixel() {
        assert_eq!(size("640x360"), Ok((640, 360)));
        for text in ["0x0", "640", "640x", "x", "-1x5", "99999999999x1", "640*360"] {
            assert!(size(text).is_err(), "{text}");
        }
        assert_eq!(crop("1,2,3,4"), Ok(Rect { x0: 1, y0: 2, x1: 3, y1: 4 }));
        for text in ["3,2,1,4", "1,2,3", "1,2,3,4,5", "a,b,c,d", "1,1,1,1"] {
            assert!(crop(text).is_err(), "{text}");
        }
    }

    #[test]
    fn an_upload_names_frame_and_file() {
        assert_eq!(upload("9=a=b.png"), Ok((9, PathBuf::from("a=b.png"))));
        for text in ["9", "9=", "=a.png", "x=a.png", "-1=a.png", "a.png"] {
            assert!(upload(text).is_err(), "{text}");
        }
    }

    #[test]
    fn targets_are_read_as_people_write_them() {
        assert_eq!(goal("psnr=45"), Ok(Goal::Psnr(45.0)));
        assert_eq!(goal("max-share=25%"), Ok(Goal::MaxShare(0.25)));
        assert_eq!(goal("ssim=0.99"), Ok(Goal::Ssim(0.99)));
        let share = goal("max-share=5").expect_err("five whole");
        assert!(share.ends_with("sign: 5%"), "{share}");
        for text in
            ["psnr", "psnr=", "psnr=nan", "psnr=999", "ssim=1", "flip=0", "mse=1", "flip=x%"]
        {
            assert!(goal(text).is_err(), "{text}");
        }
    }

    #[test]
    fn shares_are_read_as_people_write_them() {
        assert_eq!(
            ["0", "1", "0.05", "5%", "5 %", "100%"].map(share),
            [0.0, 1.0, 0.05, 0.05, 0.05, 1.0].map(Ok)
        );
        for text in ["1.5", "-0.1", "101%", "%", "x%", "nan", "5 per cent"] {
            assert!(share(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_budget_is_at_least_a_second() {
        assert_eq!(budget("1m30s"), Ok(Duration::from_secs(90)));
        let words = |text| budget(text).map(time_in_words).unwrap_or_default();
        assert_eq!((words("2m"), words("90s")), ("2 min".into(), "1 min 30 s".into()));
        assert_eq!((words("1h"), words("6s")), ("1 h".into(), "6 s".into()));
        for text in ["0s", "0h0m", "-1s", "", "5"] {
            assert!(budget(text).is_err(), "{text}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for text in ["nan", "inf", "-1", "0", "1e99"] {
            assert!(within_f32(limits::FACTOR)(text).is_err(), "{text}");
        }
        assert_eq!(within(limits::FPS)("0"), Err("expected a number from 1 to 1000".into()));
    }
}
