//! Tests of the video: the command's text, and with ffmpeg the pictures that come back.

use super::super::{WriteOptions, write_image};
use super::*;
use crate::film::{Encoding, Film};
use crate::math::Rgb;
use crate::scene::ToneCurve;

static GO_ON: AtomicBool = AtomicBool::new(false);
const DISPLAY: Display = Display { exposure: 1.0, tone: ToneCurve::Srgb };

fn clip(pattern: &FramePattern) -> Clip<'_> {
    Clip { pattern, first: 3, count: 5, fps: 24.0, display: DISPLAY }
}

fn has_ffmpeg() -> bool {
    let there = Command::new("ffmpeg").arg("-version").output().is_ok();
    if !there {
        eprintln!("skipped: no ffmpeg here");
    }
    there
}

/// Smooth colours that move with the frame.
fn film(width: u32, height: u32, frame: u32) -> Film {
    let mut film = Film::new(width, height, false);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
            let index = film.index(x, y);
            film.rgb[index] = Rgb::new(u, v, frame as f32 / 10.0) * 0.8;
        }
    }
    film
}

/// Writes frames 3 to 7 and makes a video of them.
fn shoot(folder: &Path, name: &str, size: (u32, u32), display: Display) -> Video {
    let text = folder.join(name);
    let pattern = FramePattern::parse(&text.to_string_lossy(), 5).expect("a pattern");
    for frame in 3..8 {
        let options = WriteOptions { display, ..Default::default() };
        let film = film(size.0, size.1, frame);
        write_image(pattern.path(frame), &film, &options).expect("written");
    }
    make(&Clip { display, ..clip(&pattern) }, &folder.join("out.mp4"), &GO_ON).expect("ran")
}

/// The video's frames as ffmpeg shows them on an sRGB display.
fn frames_of(video: &Path, folder: &Path) -> Vec<Image> {
    let names = folder.join("back_%d.png");
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-loglevel", "error", "-y", "-i"]).arg(video);
    // Its fast conversion back is itself two steps off.
    let exact = "scale=in_color_matrix=bt709:flags=accurate_rnd+full_chroma_int+full_chroma_inp";
    let run = ffmpeg.args(["-vf", exact]).arg(names).output().expect("ran");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    (1..).map_while(|i| read_image(folder.join(format!("back_{i}.png"))).ok()).collect()
}

#[test]
fn the_command_is_spelled_out() {
    let pattern = FramePattern::parse("out/it's 50%_####.png", 2).expect("a pattern");
    let line = shell_line(&command(&clip(&pattern), Path::new("a:b.mp4")));
    assert!(line.starts_with("ffmpeg -hide_banner -loglevel error -y -f image2 -framerate 24 "));
    assert!(line.contains(r"-start_number 3 -i 'out/it'\''s 50%%_%04d.png' -frames:v 5"), "{line}");
    assert!(line.contains("-c:v libx264") && line.contains("format=yuv420p'"), "{line}");
    assert!(line.ends_with("-movflags +faststart -f mp4 ./a:b.mp4"), "{line}");
    let exr = FramePattern::parse("f_####.exr", 2).expect("a pattern");
    assert!(command(&clip(&exr), Path::new("a.mp4")).join(" ").contains("-apply_trc iec61966_2_1"));
}

#[test]
fn without_ffmpeg_the_command_is_reported_and_no_file_is_left() {
    let folder = tempfile::tempdir().expect("a folder");
    let pattern = FramePattern::parse("f_####.png", 5).expect("a pattern");
    let out = folder.path().join("out.mp4");
    let outcome =
        make_with(OsStr::new("no-such-ffmpeg"), &clip(&pattern), &out, &GO_ON).expect("ran");
    assert_eq!(outcome, Video::NoFfmpeg { command: shell_line(&command(&clip(&pattern), &out)) });
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn a_video_without_frames_is_a_usage_error() {
    let pattern = FramePattern::parse("f_####.png", 5).expect("a pattern");
    let out = Path::new("out.mp4");
    for (count, fps) in [(0, 24.0), (5, 0.0), (5, f64::NAN), (5, -1.0), (5, f64::INFINITY)] {
        let clip = Clip { count, fps, ..clip(&pattern) };
        assert!(matches!(make(&clip, out, &GO_ON), Err(Error::Usage(_))), "{count} {fps}");
    }
}

#[test]
fn a_failure_is_reported_in_ffmpegs_words_and_leaves_no_file() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let pattern = folder.path().join("none_####.png");
    let pattern = FramePattern::parse(&pattern.to_string_lossy(), 5).expect("a pattern");
    let torn = |frame| std::fs::write(pattern.path(frame), "no png").expect("written");
    (3..8).for_each(torn);
    let outcome = make(&clip(&pattern), &folder.path().join("out.mp4"), &GO_ON).expect("ran");
    let Video::Failed { stderr } = outcome else { panic!("{outcome:?}") };
    assert!(!stderr.trim().is_empty());
    assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 5);
}

/// The video shows the frames, in number, order, size and colour.
#[test]
fn the_video_shows_the_frames() {
    if !has_ffmpeg() {
        return;
    }
    let exposed = Display { exposure: 0.5, tone: ToneCurve::Filmic };
    for (name, display) in [
        ("frame_####.png", DISPLAY),
        ("50% of it's_##.png", DISPLAY),
        ("frame_####.ppm", DISPLAY),
        ("frame_####.exr", DISPLAY),
        ("exposed_####.exr", exposed),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out.mp4");
        assert_eq!(shoot(folder.path(), name, (97, 65), display), Video::Made(out.clone()));
        let back = frames_of(&out, folder.path());
        assert_eq!(back.len(), 5, "{name}");
        for (image, frame) in back.iter().zip(3..) {
            assert_eq!((image.width, image.height), (96, 64), "{name}");
            let expected = cropped(&film(97, 65, frame), display);
            let (rmse, bias) = difference(&expected, image);
            assert!(rmse < 0.009, "{name}, frame {frame}: {rmse}");
            assert!(bias.abs().max_element() < 1.0 / 255.0, "{name}, frame {frame}: {bias}");
        }
    }
}

/// Root mean square and mean of the difference.
fn difference(a: &Image, b: &Image) -> (f32, Rgb) {
    let differences = || a.rgb.iter().zip(&b.rgb).map(|(p, q)| *q - *p);
    let n = a.rgb.len() as f32;
    let squares: f32 = differences().map(Rgb::length_squared).sum();
    ((squares / (3.0 * n)).sqrt(), differences().sum::<Rgb>() / n)
}

/// The film's display values without its last column and row.
fn cropped(film: &Film, display: Display) -> Image {
    let bytes = display.encode_8(&film.rgb, film.width);
    let rows = bytes.chunks_exact(film.width as usize * 3).take(film.height as usize - 1);
    let pixels = rows.flat_map(|row| row.chunks_exact(3).take(film.width as usize - 1));
    let rgb = pixels.map(|c| Rgb::from_array([0, 1, 2].map(|i| f32::from(c[i]) / 255.0)));
    Image::new(film.width - 1, film.height - 1, rgb.collect(), Encoding::Srgb).expect("pixels")
}

#[test]
fn one_pixel_is_enough() {
    if has_ffmpeg() {
        let folder = tempfile::tempdir().expect("a folder");
        let made = shoot(folder.path(), "f_#.png", (1, 1), DISPLAY);
        assert_eq!(made, Video::Made(folder.path().join("out.mp4")));
    }
}

#[test]
fn one_frame_without_a_number_is_enough() {
    if has_ffmpeg() {
        for name in ["50%d still.png", "still.exr"] {
            let folder = tempfile::tempdir().expect("a folder");
            let text = folder.path().join(name);
            let pattern = FramePattern::parse(&text.to_string_lossy(), 1).expect("a pattern");
            write_image(&text, &film(16, 16, 1), &WriteOptions::default()).expect("written");
            let out = folder.path().join("out.mp4");
            let made = make(&Clip { count: 1, ..clip(&pattern) }, &out, &GO_ON).expect("ran");
            assert_eq!(made, Video::Made(out));
        }
    }
}

#[test]
fn a_frame_of_another_size_or_missing_is_an_error() {
    if !has_ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    shoot(folder.path(), "f_####.png", (16, 16), DISPLAY);
    std::fs::remove_file(folder.path().join("f_0005.png")).expect("there");
    let text = folder.path().join("f_####.png");
    let pattern = FramePattern::parse(&text.to_string_lossy(), 5).expect("a pattern");
    // ffmpeg would end there and call it a success.
    let error = make(&clip(&pattern), &folder.path().join("gap.mp4"), &GO_ON).expect_err("a gap");
    assert!(error.to_string().contains("f_0005.png"), "{error}");
    assert!(!folder.path().join("gap.mp4").exists());
    shoot(folder.path(), "f_##.exr", (16, 16), DISPLAY);
    let text = folder.path().join("f_##.exr");
    let pattern = FramePattern::parse(&text.to_string_lossy(), 5).expect("a pattern");
    let options = WriteOptions::default();
    write_image(pattern.path(5), &film(8, 8, 5), &options).expect("written");
    let out = folder.path().join("second.mp4");
    let error = make(&clip(&pattern), &out, &GO_ON).expect_err("two sizes");
    assert!(error.to_string().contains("is 8x8"), "{error}");
    std::fs::remove_file(pattern.path(5)).expect("removed");
    assert!(matches!(make(&clip(&pattern), &out, &GO_ON), Err(Error::Io { .. })));
    assert!(!out.exists());
}
