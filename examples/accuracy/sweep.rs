//! A sweep, run and read.

use serde_json::Value;
use std::path::PathBuf;
use std::process::Command;

/// The folder of the repository.
pub const ROOT: &str = env!("CARGO_MANIFEST_DIR");
/// What the sweeps are called with.
pub const OPTIONS: &str = "--size 640x360 --turns 5 --frames 1,8 --reference-spp 256";

/// What came out for a scene.
pub struct Sweep {
    pub name: &'static str,
    /// `accuracy.json`.
    pub json: Value,
    pub rows: Vec<Row>,
    pub folder: PathBuf,
}

/// A setting.
#[derive(Clone)]
pub struct Row {
    pub knob: String,
    pub options: String,
    pub seconds: Measured,
    pub cpu_seconds: Measured,
    /// CPU seconds over the default's.
    pub cpu_ratio: Option<Measured>,
    pub rmse: f64,
    pub psnr: f64,
    pub error_ratio: Option<Measured>,
    /// Pixels that differ from the default's by more than 2/255, and all.
    pub changed: Option<[u64; 2]>,
    pub memory: f64,
    /// Whether nothing beats it in CPU time and error.
    pub on_front: bool,
}

/// A median with its interval.
#[derive(Clone, Copy)]
pub struct Measured {
    pub estimate: f64,
    pub low: f64,
    pub high: f64,
}

impl Measured {
    fn read(value: &Value) -> Option<Self> {
        let number = |name: &str| value[name].as_f64();
        Some(Self { estimate: number("estimate")?, low: number("low")?, high: number("high")? })
    }

    /// Whether the interval leaves 1 out.
    pub fn is_sure(&self) -> bool {
        !(self.low..=self.high).contains(&1.0)
    }
}

impl Sweep {
    /// Runs the program, which goes on where it was stopped.
    pub fn run(name: &'static str) -> Self {
        let folder = PathBuf::from(format!("{ROOT}/out/accuracy/{name}"));
        let program = std::env::current_exe()
            .unwrap()
            .ancestors()
            .find(|folder| folder.join("tweenray").is_file())
            .expect("cargo build --release, first")
            .join("tweenray");
        let scene = format!("scenes/{name}/scene.toml");
        println!("tweenray accuracy {scene} {OPTIONS} -o out/accuracy/{name}");
        let status = Command::new(program)
            .args(["accuracy", &scene, "-o"])
            .arg(&folder)
            .args(OPTIONS.split(' '))
            .current_dir(ROOT)
            .status()
            .unwrap();
        assert!(status.success(), "the sweep of {name} ended with {status}");
        Self::read(name, folder)
    }

    fn read(name: &'static str, folder: PathBuf) -> Self {
        let bytes = std::fs::read(folder.join("accuracy.json")).unwrap();
        let json: Value = serde_json::from_slice(&bytes).unwrap();
        let rows = json["rows"].as_array().unwrap().iter().map(Row::read).collect();
        Self { name, json, rows, folder }
    }

    pub fn default_row(&self) -> &Row {
        &self.rows[0]
    }

    /// The setting of these options, if it was compared.
    pub fn row(&self, options: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.options == options && !row.is_denoised())
    }

    /// The setting of this number of camera samples, or the default without one, whose frames are denoised.
    pub fn denoised(&self, spp: Option<u64>) -> Option<&Row> {
        let spp = spp.map(|spp| spp.to_string());
        let spp_of = |row: &Row| row.options.split_whitespace().nth(1).map(str::to_owned);
        self.rows.iter().find(|row| row.is_denoised() && spp_of(row) == spp)
    }

    /// The rows that nothing beats, the fastest first.
    pub fn front(&self) -> Vec<&Row> {
        let mut front: Vec<&Row> = self.rows.iter().filter(|row| row.on_front).collect();
        front.sort_by(|a, b| a.cpu_seconds.estimate.total_cmp(&b.cpu_seconds.estimate));
        front
    }

    /// A number of the default's settings.
    pub fn setting(&self, name: &str) -> u64 {
        self.json["default"][name].as_u64().unwrap()
    }
}

impl Row {
    fn read(value: &Value) -> Self {
        let text = |name: &str| value[name].as_str().unwrap().to_string();
        let change = &value["change"];
        let pixels = |name: &str| change[name].as_u64();
        Self {
            knob: text("knob"),
            options: text("options"),
            seconds: Measured::read(&value["seconds"]).unwrap(),
            cpu_seconds: Measured::read(&value["cpu_seconds"]).unwrap(),
            cpu_ratio: Measured::read(&value["cpu_ratio"]),
            rmse: value["errors"]["rmse_steps"].as_f64().unwrap(),
            psnr: value["errors"]["psnr"].as_f64().unwrap_or(f64::INFINITY),
            error_ratio: Measured::read(&value["error_ratio"]),
            changed: pixels("over_2").zip(pixels("pixels")).map(|(over, all)| [over, all]),
            memory: value["memory_bytes"].as_f64().unwrap(),
            on_front: value["on_cpu_front"].as_bool().unwrap(),
        }
    }

    fn is_denoised(&self) -> bool {
        self.knob == "denoiser"
    }

    pub fn name(&self) -> &str {
        if self.options.is_empty() { "default" } else { &self.options }
    }
}
