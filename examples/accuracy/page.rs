//! The measured part of `docs/accuracy.md`.

use crate::heat::FULL;
use crate::sweep::{Measured, OPTIONS, ROOT, Row, Sweep};
use serde_json::Value;
use std::fmt::Write;
use tweenray::page::words::{bytes, change, count, percent, seconds, short};

const BEGIN: &str = "<!-- measured by ./x accuracy; what stands here is overwritten -->\n";
const END: &str = "<!-- end of what was measured -->\n";

/// Puts `text` where it stands.
pub fn write(text: &str) {
    let path = format!("{ROOT}/docs/accuracy.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).expect("docs/accuracy.md has a place for it");
    let (_, after) = rest.split_once(END).expect("and an end of it");
    std::fs::write(&path, format!("{before}{BEGIN}{text}{END}{after}")).unwrap();
    println!("{path}");
}

/// All of it.
pub fn text(sweeps: &[Sweep]) -> String {
    let mut out = String::new();
    how(&mut out, sweeps);
    table(&mut out, "Intersection", sweeps, &intersection(), rules_cell);
    table(&mut out, "Sampling", sweeps, &sampling(), trade_cell);
    table(&mut out, "Reuse between frames", sweeps, &reuse(), trade_cell);
    denoised(&mut out, sweeps);
    sweeps.iter().for_each(|sweep| scene(&mut out, sweep));
    out
}

fn how(out: &mut String, sweeps: &[Sweep]) {
    let json = &sweeps[0].json;
    let loads = sweeps.iter().flat_map(|s| s.json["load"].as_array().unwrap());
    let loads: Vec<f64> = loads.filter_map(Value::as_f64).collect();
    let (least, most) =
        loads.iter().fold((f64::INFINITY, 0f64), |(l, m), load| (l.min(*load), m.max(*load)));
    let confidence = json["rows"][0]["seconds"]["confidence"].as_f64().unwrap();
    _ = writeln!(
        out,
        "tweenray {}, {} threads of {} ({} cores, whose load was {} to {}); `{OPTIONS}`, intervals of {}.\n",
        json["tweenray"].as_str().unwrap(),
        json["threads"],
        json["machine"]["cpu"].as_str().unwrap_or("an unknown processor"),
        json["machine"]["cores"],
        short(least),
        short(most),
        percent(confidence)
    );
    head(out, "", sweeps);
    line(out, "camera, shadow and sky samples", sweeps, |s| {
        let [shadow, sky] = ["shadow_samples", "sky_samples"].map(|name| s.setting(name));
        format!("{}, {shadow}, {sky}", camera_samples(&s.json["default"]))
    });
    line(out, "a frame by default", sweeps, |s| {
        let m = s.default_row().seconds;
        format!("{} ({}–{})", seconds(m.estimate), seconds(m.low), seconds(m.high))
    });
    line(out, "its CPU time", sweeps, |s| {
        let m = s.default_row().cpu_seconds;
        format!("{} ({}–{})", seconds(m.estimate), seconds(m.low), seconds(m.high))
    });
    line(out, "its error", sweeps, |s| {
        format!("{}/255, {} dB", short(s.default_row().rmse), short(s.default_row().psnr))
    });
    line(out, "memory of tree and references", sweeps, |s| bytes(s.default_row().memory as u64));
    line(out, "reference: camera samples, change of the last doubling", sweeps, |s| {
        let reference = &s.json["reference"];
        let change = reference["change"].as_f64().map_or("–".into(), short);
        let number = |name: &str| reference[name].as_f64().unwrap_or(f64::INFINITY);
        let end = if number("change") > number("wanted") { ", not converged" } else { "" };
        format!("{}, {change}/255{end}", camera_samples(&reference["settings"]))
    });
    out.push('\n');
}

/// The camera samples of settings as text: "4", or "4..16".
fn camera_samples(settings: &Value) -> String {
    let least = &settings["spp"];
    settings["most_spp"].as_u64().map_or(least.to_string(), |most| format!("{least}..{most}"))
}

fn head(out: &mut String, name: &str, sweeps: &[Sweep]) {
    let names: Vec<&str> = sweeps.iter().map(|s| s.name).collect();
    _ = writeln!(out, "| {name} | {} |\n|---|{}", names.join(" | "), "---|".repeat(names.len()));
}

fn line(out: &mut String, name: &str, sweeps: &[Sweep], cell: impl Fn(&Sweep) -> String) {
    let cells: Vec<String> = sweeps.iter().map(cell).collect();
    _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
}

/// What a line of a table is called, and the options that it is about.
type Turned = (&'static str, fn(&Sweep) -> String);

fn table(
    out: &mut String,
    name: &str,
    sweeps: &[Sweep],
    lines: &[Turned],
    cell: fn(&Sweep, &Row) -> String,
) {
    head(out, &format!("**{name}**"), sweeps);
    for (name, options) in lines {
        line(out, name, sweeps, |s| s.row(&options(s)).map_or("–".into(), |row| cell(s, row)));
    }
    if name == "Intersection" {
        line(out, "the f64 oracle instead of Embree", sweeps, oracle_cell);
    }
    out.push('\n');
}

fn intersection() -> [Turned; 10] {
    [
        ("`--recheck off`", |_| "--recheck off".into()),
        ("`--recheck always`", |_| "--recheck always".into()),
        ("`--retry off`", |_| "--retry off".into()),
        ("`--robust off`", |_| "--robust off".into()),
        ("`--spawn-offset off`", |_| "--spawn-offset off".into()),
        ("all of these off", |_| {
            "--recheck off --retry off --robust off --spawn-offset off".into()
        }),
        ("`--recentre off`", |_| "--recentre off".into()),
        ("`--build-quality low`", |_| "--build-quality low".into()),
        ("`--build-quality high`", |_| "--build-quality high".into()),
        ("`--compact on`", |_| "--compact on".into()),
    ]
}

fn sampling() -> [Turned; 9] {
    [
        ("four times the camera samples", |s| format!("--spp {}", 4 * s.setting("spp"))),
        ("a quarter of them", |s| format!("--spp {}", (s.setting("spp") / 4).max(1))),
        ("up to four times as many where samples differ", |s| {
            format!("--spp {0}..{1}", s.setting("spp"), 4 * s.setting("spp"))
        }),
        ("up to eight times", |s| {
            format!("--spp {0}..{1}", s.setting("spp"), 8 * s.setting("spp"))
        }),
        ("four times the shadow samples", |s| {
            format!("--shadow-samples {}", 4 * s.setting("shadow_samples"))
        }),
        ("a quarter of them", |s| {
            format!("--shadow-samples {}", (s.setting("shadow_samples") / 4).max(1))
        }),
        ("an eighth where pilots agree", |s| {
            let n = s.setting("shadow_samples");
            format!("--shadow-samples {}..{n}", (n / 8).max(1))
        }),
        ("four times the sky samples", |s| {
            format!("--sky-samples {}", 4 * s.setting("sky_samples"))
        }),
        ("twice the bounces", |s| format!("--bounces {}", 2 * s.setting("bounces"))),
    ]
}

fn reuse() -> [Turned; 5] {
    [
        ("`--policy off`: every frame traced", |_| "--policy off".into()),
        ("`--policy colour`", |_| "--policy colour".into()),
        ("`--tolerance 0.0625`", |_| "--tolerance 0.0625".into()),
        ("`--tolerance 1`", |_| "--tolerance 1".into()),
        ("`--probes 0.03`", |_| "--probes 0.03".into()),
    ]
}

/// Frames behind a denoiser, where there was one.
fn denoised(out: &mut String, sweeps: &[Sweep]) {
    if !sweeps.iter().any(|s| s.denoised(None).is_some()) {
        return;
    }
    head(out, "**Denoised by Intel Open Image Denoise**", sweeps);
    let mut own = |name: &str, spp: &dyn Fn(&Sweep) -> Option<u64>| {
        let cell = |s: &Sweep| s.denoised(spp(s)).map_or("–".into(), |row| trade_cell(s, row));
        line(out, name, sweeps, cell);
    };
    own("the default's frames", &|_| None);
    own("a quarter of the camera samples, traced with one sample of each light", &|s| {
        Some((s.setting("spp") / 4).max(1))
    });
    own("as many", &|s| Some(s.setting("spp")));
    own("four times as many", &|s| Some(4 * s.setting("spp")));
    out.push('\n');
}

fn time(ratio: Option<Measured>) -> String {
    let Some(ratio) = ratio else { return "–".into() };
    let [is, low, high] = [ratio.estimate, ratio.low, ratio.high].map(change);
    match ratio.is_sure() {
        true => format!("{is} ({low} to {high})"),
        false => format!("noise ({low} to {high})"),
    }
}

/// Time, and pixels that are not the default's.
fn rules_cell(_: &Sweep, row: &Row) -> String {
    let pixels = match row.changed {
        Some([0, _]) => "no pixel off".into(),
        Some([over, all]) => format!("{} of {} pixels off", count(over), count(all)),
        None => String::new(),
    };
    format!("{}; {pixels}", time(row.cpu_ratio))
}

/// Time and error.
fn trade_cell(sweep: &Sweep, row: &Row) -> String {
    let error = match row.error_ratio {
        _ if row.rmse == sweep.default_row().rmse => "same error".into(),
        Some(ratio) if (ratio.estimate - 1.0).abs() < 5e-4 => "same error to three digits".into(),
        Some(ratio) if ratio.is_sure() => format!("error {}", change(ratio.estimate)),
        _ => "error: noise".into(),
    };
    format!("{}; {error}", time(row.cpu_ratio))
}

fn oracle_cell(sweep: &Sweep) -> String {
    let oracle = &sweep.json["oracle"];
    let number = |name: &str| oracle[name].as_f64();
    let Some((slow, fast)) = number("oracle_seconds").zip(number("embree_seconds")) else {
        return "too many triangles".into();
    };
    let pixels = oracle["change"]["over_2"].as_u64().unwrap();
    let all = oracle["change"]["pixels"].as_u64().unwrap();
    let off = if pixels == 0 { "no".into() } else { count(pixels) };
    format!("{} times the time; {off} of {} pixels off", short(slow / fast), count(all))
}

fn scene(out: &mut String, sweep: &Sweep) {
    let name = sweep.name;
    _ = writeln!(
        out,
        "### {name}\n\n\
         ![Error against CPU time of {} settings](pictures/accuracy-{name}.svg)\n\n\
         | | settings that nothing beats | CPU seconds a frame | RMSE | PSNR |\n|---|---|---|---|---|",
        sweep.rows.len()
    );
    for (number, row) in (1..).zip(sweep.front()) {
        let m = row.cpu_seconds;
        let options =
            if row.options.is_empty() { "default".into() } else { format!("`{}`", row.options) };
        _ = writeln!(
            out,
            "| {number} | {options} | {} ({}–{}) | {}/255 | {} dB |",
            short(m.estimate),
            short(m.low),
            short(m.high),
            short(row.rmse),
            short(row.psnr)
        );
    }
    _ = writeln!(
        out,
        "\n![A frame, and by how much it is off](pictures/accuracy-{name}.png)\n\n\
         By default, and by how much the worst channel of each pixel is off: black not at all, light yellow \
         by {}/255 and more.\n",
        short(FULL.into())
    );
}
