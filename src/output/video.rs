//! An mp4 of a sequence, made by ffmpeg where it is installed.
//!
//! H.264, yuv420p (4:2:0, which every player shows), BT.709 matrix with the sRGB transfer function
//! tagged, index first (`faststart`). An odd last column or row is cut off, since 4:2:0 needs even
//! sizes. ffmpeg writes to a temporary name; a video that exists is whole.
//!
//! png and ppm frames hold display values, and ffmpeg reads them itself. exr frames are linear:
//! [`make`] reads them, applies exposure, tone curve and transfer function as for a png and pipes
//! the pixels, so the video looks the same whatever the frames' format. The command from
//! [`command`] for exr frames uses ffmpeg's own conversion: the sRGB curve, no exposure.

use super::atomic::Temporary;
use super::child::{Ran, start, watch};
use super::{Display, Format, FramePattern, read_image};
use crate::error::{Error, Result};
use crate::film::Image;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

/// The frames of a video.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip<'a> {
    /// Pattern of the frames' paths.
    pub pattern: &'a FramePattern,
    /// Number of the first frame.
    pub first: u32,
    /// Number of frames, without gaps.
    pub count: u32,
    /// Frames per second.
    pub fps: f64,
    /// How exr frames are shown; png and ppm frames are shown as they are.
    pub display: Display,
}

/// The result of [`make`]. A job without a video is still finished, so no case is an error.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Video {
    /// The video was made at this path.
    Made(PathBuf),
    /// ffmpeg is not installed; this command would make the video where it is.
    NoFfmpeg {
        /// A line for a shell.
        command: String,
    },
    /// ffmpeg ran and failed.
    Failed {
        /// The last lines of its stderr.
        stderr: String,
    },
}

/// Makes `out` from the clip's frames, unless `stop` is set before it is done.
///
/// # Errors
/// [`Error::Usage`] for a clip without frames or an invalid frame rate; [`Error::Io`] if a
/// frame is missing; [`Error::Io`] and
/// [`Error::Input`] if an exr frame cannot be read or the video cannot be renamed;
/// [`Error::Stopped`].
pub fn make(clip: &Clip, out: &Path, stop: &AtomicBool) -> Result<Video> {
    make_with(OsStr::new("ffmpeg"), clip, out, stop)
}

fn make_with(program: &OsStr, clip: &Clip, out: &Path, stop: &AtomicBool) -> Result<Video> {
    if clip.count == 0 || !(clip.fps.is_finite() && clip.fps > 0.0) {
        let (n, fps) = (clip.count, clip.fps);
        return Err(Error::Usage(format!("{n} frames at {fps} frames a second make no video")));
    }
    // Ask before anything is created: without ffmpeg the folder must stay as it is.
    if let Err(e) = Command::new(program).arg("-version").stdin(Stdio::null()).output() {
        return match e.kind() {
            io::ErrorKind::NotFound => {
                Ok(Video::NoFfmpeg { command: shell_line(&command(clip, out)) })
            }
            _ => Err(Error::io("run", program, e)),
        };
    }
    // ffmpeg ends at a gap as if that were the end.
    let mut frames = (clip.first..clip.first + clip.count).map(|frame| clip.pattern.path(frame));
    if let Some(missing) = frames.find(|path| !path.is_file()) {
        return Err(Error::io("make a video without", missing, io::ErrorKind::NotFound.into()));
    }
    let (temporary, _) = Temporary::create(out)?;
    let run = match clip.pattern.format() {
        Format::Exr => run_piped(program, clip, temporary.path(), stop)?,
        Format::Png | Format::Ppm => {
            let args = [input_args(clip), output_args(temporary.path())].concat();
            let mut child = start(program, args, Stdio::null())?;
            watch(&mut child, stop).map_err(|e| Error::io("run", program, e))?
        }
    };
    if !run.is_done {
        // A signal to the whole group ended ffmpeg, too.
        return match stop.load(Ordering::Relaxed) {
            true => Err(Error::Stopped),
            false => Ok(Video::Failed { stderr: run.last_words() }),
        };
    }
    let synced = File::open(temporary.path()).and_then(|f| f.sync_all());
    synced.map_err(|e| temporary.error("sync", e))?;
    temporary.rename()?;
    Ok(Video::Made(out.to_path_buf()))
}

/// The command, program first, that makes `out` from the clip's frames.
pub fn command(clip: &Clip, out: &Path) -> Vec<String> {
    let mut line = vec!["ffmpeg".to_owned()];
    line.extend(input_args(clip));
    line.extend(output_args(out));
    line
}

/// The command as a line for a POSIX shell, quoted where needed.
pub fn shell_line(command: &[String]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+%".contains(c);
    let quote = |arg: &String| match !arg.is_empty() && arg.chars().all(plain) {
        true => arg.clone(),
        false => format!("'{}'", arg.replace('\'', r"'\''")),
    };
    command.iter().map(quote).collect::<Vec<_>>().join(" ")
}

fn input_args(clip: &Clip) -> Vec<String> {
    let mut args = words("-hide_banner -loglevel error -y -f image2");
    if clip.pattern.format() == Format::Exr {
        args.extend(words("-apply_trc iec61966_2_1"));
    }
    args.extend(words(&format!("-framerate {}", clip.fps)));
    if clip.pattern.is_numbered() {
        args.extend(words(&format!("-pattern_type sequence -start_number {}", clip.first)));
    } else {
        args.extend(words("-pattern_type none"));
    }
    args.extend(["-i".to_owned(), plain_file(Path::new(&clip.pattern.for_ffmpeg()))]);
    args.extend(words(&format!("-frames:v {}", clip.count)));
    args
}

fn output_args(out: &Path) -> Vec<String> {
    // The pad only gives an image of one column or row the second that 4:2:0 needs.
    let filter = "pad=max(iw\\,2):max(ih\\,2),crop=trunc(iw/2)*2:trunc(ih/2)*2:0:0,\
                  scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd+full_chroma_int,\
                  format=yuv420p";
    let mut args = vec!["-vf".to_owned(), filter.to_owned()];
    args.extend(words("-c:v libx264 -preset medium -crf 16 -color_range tv -colorspace bt709"));
    args.extend(words(
        "-color_primaries bt709 -color_trc iec61966-2-1 -movflags +faststart -f mp4",
    ));
    args.push(plain_file(out));
    args
}

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

/// `path` in a form that ffmpeg takes neither for an option (`-a.mp4`) nor for a protocol (`a:b.mp4`).
fn plain_file(path: &Path) -> String {
    let text = path.to_string_lossy();
    if text.starts_with('-') || text.contains(':') && path.is_relative() {
        return format!("./{text}");
    }
    text.into_owned()
}

/// Runs ffmpeg on display values that this process pipes to it.
fn run_piped(program: &OsStr, clip: &Clip, out: &Path, stop: &AtomicBool) -> Result<Ran> {
    let first = read_image(clip.pattern.path(clip.first))?;
    let (width, height) = (first.width, first.height);
    let input = format!(
        "-hide_banner -loglevel error -y -f rawvideo -pixel_format rgb24 -video_size \
         {width}x{height} -framerate {} -i pipe:0",
        clip.fps
    );
    let args = [words(&input), output_args(out)].concat();
    let mut child = start(program, args, Stdio::piped())?;
    let stdin = child.stdin.take();
    let (fed, ran) = std::thread::scope(|scope| {
        let feeder = scope.spawn(|| stdin.map_or(Ok(()), |stdin| feed(stdin, clip, first, stop)));
        let ran = watch(&mut child, stop);
        (feeder.join(), ran)
    });
    let ran = ran.map_err(|e| Error::io("run", program, e))?;
    match fed {
        // When ffmpeg fails, the broken pipe is a consequence; its own words are the cause.
        _ if !ran.is_done => Ok(ran),
        Ok(fed) => fed.map(|()| ran),
        Err(_) => Err(Error::Failed("feeding frames to ffmpeg failed".into())),
    }
}

/// Writes every frame's display values to the pipe, unless `stop` is set; closes the pipe on return.
fn feed(mut stdin: ChildStdin, clip: &Clip, first: Image, stop: &AtomicBool) -> Result<()> {
    let (width, height) = (first.width, first.height);
    let mut next = Some(first);
    for frame in clip.first..clip.first.saturating_add(clip.count) {
        if stop.load(Ordering::Relaxed) {
            return Err(Error::Stopped);
        }
        let path = clip.pattern.path(frame);
        let image = next.take().map_or_else(|| read_image(&path), Ok)?;
        if (image.width, image.height) != (width, height) {
            let (w, h) = (image.width, image.height);
            let message = format!("is {w}x{h}, the frames before are {width}x{height}");
            return Err(Error::input(path, message));
        }
        let bytes = clip.display.encode_8(&image.rgb, width);
        stdin.write_all(&bytes).map_err(|e| Error::io("pipe to ffmpeg", path, e))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
