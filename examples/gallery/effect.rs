//! Effects: scene files that say what differs with and without.

/// Names of scenes of `scenes/gallery`, with their texts.
macro_rules! scenes {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("../../scenes/gallery/", $name, ".toml")))),*]
    };
}

/// Name and text of each effect, in the order of the page.
pub const EFFECTS: [(&str, &str); 28] = scenes!(
    "soft-shadows" "mirror" "rough-mirror" "rough-metal" "plastic" "clear-coat" "glass" "tinted-glass" "rough-glass"
    "thin-glass" "transmission" "straight-light" "textures" "roughness-map" "normal-map" "cut-outs" "vertex-colours"
    "emitting-mesh" "emission-map" "many-lights" "sky" "environment" "gradient" "sun-and-sky" "fog" "fog-of-lamps" "depth-of-field" "scene"
);

/// What a file of `scenes/gallery` says.
pub struct Effect {
    pub name: &'static str,
    pub title: &'static str,
    /// What the two frames show.
    pub about: String,
    /// The scene with the effect.
    pub with: String,
    /// The scene without it.
    pub without: String,
    /// The lines that only the first of the two has.
    pub lines: String,
}

impl Effect {
    /// Reads a scene's text: a title, a paragraph, and lines of which `#with`, `#without` and `#end` mark who has them; those of the
    /// scene without the effect are comments.
    pub fn read(name: &'static str, text: &'static str) -> Self {
        let mut comments = text.lines().map_while(|line| line.strip_prefix("# "));
        let title = comments.next().expect("a title in the first line");
        let about = comments.collect::<Vec<_>>().join("\n");
        let [mut with, mut without, mut lines] = [const { String::new() }; 3];
        let mut part = "#end";
        for line in text.lines() {
            match line {
                "#with" | "#without" | "#end" => part = line,
                _ => {
                    let into: &mut [&mut String] = match part {
                        "#with" => &mut [&mut with, &mut lines],
                        "#without" => &mut [&mut without],
                        _ => &mut [&mut with, &mut without],
                    };
                    let is_comment = part == "#without";
                    let line = line.strip_prefix("# ").filter(|_| is_comment).unwrap_or(line);
                    for text in into {
                        text.push_str(line);
                        text.push('\n');
                    }
                }
            }
        }
        Self { name, title, about, with, without, lines: lines.trim_end().to_string() }
    }

    /// Name of the picture's file.
    pub fn picture(&self) -> String {
        format!("gallery-{}.jpg", self.name)
    }
}
