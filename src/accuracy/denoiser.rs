//! Intel Open Image Denoise as a rival: frames of few samples, denoised by its program `oidnDenoise`.

use crate::error::{Error, Result};
use crate::film::Film;
use crate::math::{Rgb, Vec3};
use crate::output::Regular;
use crate::output::child::{start, watch};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

/// The program `oidnDenoise` of Intel Open Image Denoise 2.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Denoiser {
    program: PathBuf,
    hash: String,
}

impl Denoiser {
    /// The denoiser `program`, a path or a name that `PATH` leads to; `None` where there is none.
    ///
    /// # Errors
    /// [`Error::Io`] where it cannot be read or started, [`Error::Usage`] where it is another program.
    pub fn find(program: &Path) -> Result<Option<Self>> {
        let Some(program) = resolved(program) else { return Ok(None) };
        let hash = Regular::at(&program)?.hash(&program)?;
        let mut help = Command::new(&program);
        let said = help.arg("--help").stdin(Stdio::null()).output();
        let said = said.map_err(|e| Error::io("run", &program, e))?;
        if !String::from_utf8_lossy(&said.stdout).contains("Open Image Denoise") {
            let last = String::from_utf8_lossy(&said.stderr).lines().last().map(str::to_owned);
            return Err(Error::Usage(format!(
                "{} is not oidnDenoise of Intel Open Image Denoise, by what it says to --help{}",
                program.display(),
                last.map_or(String::new(), |line| format!(": {line}"))
            )));
        }
        Ok(Some(Self { program, hash }))
    }

    /// Path of the program, and a hash of its file: what figures of denoised frames depend on.
    pub fn describe(&self) -> String {
        format!("{} ({:.12})", self.program.display(), self.hash)
    }

    /// The radiance of `film`, denoised on the processor with the help of its albedo and normals. These are of one
    /// camera sample, so they are not called clean.
    ///
    /// # Errors
    /// [`Error::Stopped`]; [`Error::Failed`] where the program fails; those of temporary files.
    pub(super) fn denoise(
        &self,
        film: &Film,
        threads: usize,
        stop: &AtomicBool,
    ) -> Result<Vec<Rgb>> {
        let Some(gbuffer) = &film.gbuffer else {
            return Err(Error::Failed("a frame without albedo and normals is not denoised".into()));
        };
        let temporary = tempfile::tempdir()
            .map_err(|e| Error::io("create a folder in", std::env::temp_dir(), e))?;
        let threads = threads.to_string();
        let mut args: Vec<OsString> =
            ["--device", "cpu", "--threads", &threads].map(OsString::from).into();
        for (option, values) in
            [("--hdr", &film.rgb), ("--alb", &gbuffer.albedo), ("--nrm", &gbuffer.normal)]
        {
            let path = temporary.path().join(format!("{}.pfm", &option[2..]));
            fs::write(&path, pfm(film.width, values)).map_err(|e| Error::io("write", &path, e))?;
            args.extend([option.into(), path.into()]);
        }
        let out = temporary.path().join("out.pfm");
        args.extend(["-o".into(), out.clone().into()]);
        let mut child = start(self.program.as_os_str(), args, Stdio::null())?;
        let ran = watch(&mut child, stop).map_err(|e| Error::io("run", &self.program, e))?;
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Stopped);
        }
        let failed = |why: &str| Error::Failed(format!("{} {why}", self.program.display()));
        if !ran.is_done {
            return Err(failed(&format!("failed: {}", ran.last_words())));
        }
        let bytes = fs::read(&out).map_err(|_| failed("wrote no picture"))?;
        let rgb = of_pfm(&bytes, film.width, film.height);
        rgb.ok_or_else(|| failed("wrote no picture of this size with finite values"))
    }
}

/// The path of `program`; a name alone is looked for in `PATH`.
fn resolved(program: &Path) -> Option<PathBuf> {
    if program.components().count() > 1 {
        return program.canonicalize().ok();
    }
    let folders = std::env::var_os("PATH")?;
    let mut paths = std::env::split_paths(&folders).map(|folder| folder.join(program));
    paths.find(|path| path.is_file())?.canonicalize().ok()
}

/// `rgb`, row by row from the top, as a PFM file, whose rows go from the bottom up (Debevec, 1998).
fn pfm(width: u32, rgb: &[Vec3]) -> Vec<u8> {
    let rows = rgb.chunks_exact(width as usize);
    // Three channels; a negative scale says that the low byte comes first.
    let mut bytes = format!("PF\n{width} {}\n-1.0\n", rows.len()).into_bytes();
    let values = rows.rev().flatten().flat_map(|c| c.to_array());
    bytes.extend(values.flat_map(f32::to_le_bytes));
    bytes
}

/// The pixels of a PFM file of this size, row by row from the top; `None` of any other file, and where a value is not
/// finite.
fn of_pfm(bytes: &[u8], width: u32, height: u32) -> Option<Vec<Rgb>> {
    // Kind, columns, rows and scale, whose sign says the order of the bytes; whitespace ends each.
    let mut parts = bytes.splitn(5, u8::is_ascii_whitespace);
    let mut word = || std::str::from_utf8(parts.next()?).ok();
    if word()? != "PF" || word()?.parse() != Ok(width) || word()?.parse() != Ok(height) {
        return None;
    }
    let is_little = word()?.parse::<f32>().ok()? < 0.0;
    let values = parts.next()?;
    let bytes_of_row = 12 * width as usize;
    if bytes_of_row == 0 || values.len() != bytes_of_row * height as usize {
        return None;
    }
    let number = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if is_little { f32::from_le_bytes(bytes) } else { f32::from_be_bytes(bytes) }
    };
    let pixel =
        |bytes: &[u8]| Rgb::new(number(&bytes[..4]), number(&bytes[4..8]), number(&bytes[8..12]));
    let rows = values.chunks_exact(bytes_of_row).rev();
    let rgb: Vec<Rgb> = rows.flat_map(|row| row.chunks_exact(12).map(pixel)).collect();
    rgb.iter().all(|c| c.is_finite()).then_some(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::GBuffer;

    #[test]
    fn pictures_come_back_from_pfm_as_they_were() {
        let rgb: Vec<Rgb> = (0..6).map(|i| Rgb::new(i as f32, -0.5, 1e-9)).collect();
        let bytes = pfm(3, &rgb);
        assert_eq!(of_pfm(&bytes, 3, 2), Some(rgb.clone()));
        // The first row of the file is the lowest one.
        assert_eq!(&bytes[..12], b"PF\n3 2\n-1.0\n");
        assert_eq!(bytes[12..16], 3f32.to_le_bytes());
        assert_eq!((of_pfm(&bytes, 2, 3), of_pfm(&bytes[..80], 3, 2)), (None, None));
        let infinite = pfm(1, &[Rgb::splat(f32::INFINITY)]);
        assert_eq!(of_pfm(&infinite, 1, 1), None);
        assert_eq!((of_pfm(b"", 3, 2), of_pfm(b"P6\n3 2\n255\n", 3, 2)), (None, None));
        let mut turned = b"PF 3 2 1 ".to_vec();
        turned.extend(bytes[12..].chunks(4).flat_map(|value| value.iter().rev()));
        assert_eq!(of_pfm(&turned, 3, 2), Some(rgb));
    }

    /// A program in `folder` that runs `script`, but for `--help`.
    fn program(folder: &Path, script: &str) -> Denoiser {
        let path = folder.join("denoise");
        let text = format!(
            "#!/bin/sh\n[ \"$1\" = --help ] && echo Open Image Denoise && exit\n{script}\n"
        );
        // By another process: a program that is open for writing, here or in a child of another test, does not run.
        let mut write = Command::new("sh");
        write.args(["-c", r#"printf %s "$1" > "$0" && chmod +x "$0""#]).arg(&path).arg(text);
        assert!(write.status().expect("a shell").success());
        Denoiser::find(&path).expect("started").expect("there")
    }

    #[test]
    fn pictures_go_through_the_program_and_its_failures_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut film = Film::new(2, 2, true);
        film.rgb = (0..4).map(|i| Rgb::splat(i as f32)).collect();
        let mut gbuffer = GBuffer::new(4);
        gbuffer.albedo[3] = Rgb::splat(0.25);
        film.gbuffer = Some(gbuffer.clone());
        let go_on = AtomicBool::new(false);
        let run = |script: &str| program(folder.path(), script).denoise(&film, 1, &go_on);
        // Options: --device cpu --threads 1 --hdr COLOUR --alb ALBEDO --nrm NORMAL -o OUT.
        assert_eq!(run("cp $6 ${12}").expect("done"), film.rgb);
        assert_eq!(run("cp $8 ${12}").expect("done"), gbuffer.albedo);
        let told = |script| run(script).expect_err("failed").to_string();
        assert!(told("echo no memory >&2; exit 3").contains("no memory"));
        assert!(told("exit 0").contains("wrote no picture"));
        assert!(told("echo PF > ${12}").contains("of this size"));
        go_on.store(true, Ordering::Relaxed);
        let stopped = program(folder.path(), "exec sleep 60").denoise(&film, 1, &go_on);
        assert!(matches!(stopped, Err(Error::Stopped)));
    }

    #[test]
    fn only_the_denoiser_is_one() {
        assert_eq!(Denoiser::find(Path::new("no-such-denoiser")).expect("none"), None);
        assert_eq!(Denoiser::find(Path::new("./no-such-denoiser")).expect("none"), None);
        let other = Denoiser::find(Path::new("true")).expect_err("another program").to_string();
        assert!(other.contains("is not oidnDenoise"), "{other}");
    }
}
