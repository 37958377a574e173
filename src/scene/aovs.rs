//! What exr frames hold beside colour: AOVs, and the traced points that later jobs reuse.

use super::Policy;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeSet;
use std::fmt;

/// One thing that exr frames can hold beside colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Aov {
    /// Distance of the first hit along the view axis.
    Depth,
    /// Position of the first hit.
    Position,
    /// Shading normal of the first hit.
    Normal,
    /// Diffuse reflectance of the first hit.
    Albedo,
    /// Number of the mesh that is hit first.
    MeshId,
    /// Motion of the first hit since the frame before.
    Motion,
    /// Number of camera samples, where pixels take different numbers.
    Samples,
    /// Map of reuse: traced, or inferred from earlier or later frames.
    Provenance,
    /// Map of reuse: the reference frame with the largest weight.
    Frame,
    /// Map of reuse: the distance of the samples that were used.
    Distance,
    /// Map of reuse: the errors of the audited pixels.
    Audit,
    /// The frame's traced points, from which later jobs infer frames (`--references`).
    Reference,
}

impl Aov {
    /// All of them.
    pub const ALL: [Self; 12] = [
        Self::Depth,
        Self::Position,
        Self::Normal,
        Self::Albedo,
        Self::MeshId,
        Self::Motion,
        Self::Samples,
        Self::Provenance,
        Self::Frame,
        Self::Distance,
        Self::Audit,
        Self::Reference,
    ];

    /// Its name on the command line and in the scene file: one of [`Aovs::NAMES`].
    pub fn name(self) -> &'static str {
        Aovs::NAMES[self as usize]
    }

    /// Whether it belongs to the first hit of a pixel.
    fn is_first_hit(self) -> bool {
        self <= Self::Motion
    }

    /// Whether frames of `policy` can have it, where pixels take as many samples or, `adaptive`, different numbers.
    fn is_of(self, policy: Policy, adaptive: bool) -> bool {
        match self {
            Self::Samples => adaptive,
            Self::Reference => policy == Policy::Surface,
            _ => self.is_first_hit() || policy != Policy::Off,
        }
    }
}

/// The AOVs of exr frames. Its text, as in manifests, has the names with commas between them, or `none`.
///
/// ```
/// use tweenray::scene::{Aov, Aovs};
///
/// let aovs: Aovs = Aovs::parse("normal,depth").unwrap();
/// assert!(aovs.has(Aov::Depth) && !aovs.has(Aov::Motion));
/// assert_eq!(aovs.to_string(), "depth,normal");
/// assert_eq!(Aovs::parse("dept"), Err("dept".into()));
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Aovs {
    /// All that frames of the job's policy can have.
    All,
    /// These.
    These(BTreeSet<Aov>),
}

impl Aovs {
    /// All words of a list: the AOVs in the order of [`Aov::ALL`], and two for all and none.
    pub const NAMES: [&'static str; 14] = [
        "depth",
        "position",
        "normal",
        "albedo",
        "mesh-id",
        "motion",
        "samples",
        "provenance",
        "frame",
        "distance",
        "audit",
        "reference",
        "all",
        "none",
    ];

    /// The AOVs that the words of `text` name, with commas between them; the first unknown word as an error.
    pub fn parse(text: &str) -> Result<Self, String> {
        text.split(',').map(|word| Self::of_word(word.trim())).collect()
    }

    fn of_word(word: &str) -> Result<Self, String> {
        let named = || Aov::ALL.into_iter().find(|aov| aov.name() == word);
        match word {
            "all" => Ok(Self::All),
            "none" => Ok(Self::default()),
            _ => named().map(|aov| [aov].into()).ok_or_else(|| word.into()),
        }
    }

    /// Whether `aov` is among them.
    pub fn has(&self, aov: Aov) -> bool {
        match self {
            Self::All => true,
            Self::These(these) => these.contains(&aov),
        }
    }

    /// Whether some belong to first hits.
    pub fn have_first_hits(&self) -> bool {
        Aov::ALL.into_iter().any(|aov| aov.is_first_hit() && self.has(aov))
    }

    /// Whether frames that are all traced cannot have some of them.
    pub fn need_reuse(&self) -> bool {
        Aov::ALL.into_iter().any(|aov| !aov.is_of(Policy::Off, true) && self.has(aov))
    }

    /// These, by name, of a job with `policy` whose pixels take as many samples or, `adaptive`, different numbers; the
    /// first that its frames cannot have as an error. What is not named, as with [`Aovs::All`], is left out.
    pub fn under(self, policy: Policy, adaptive: bool) -> Result<Self, Aov> {
        let can_have = |aov: &Aov| aov.is_of(policy, adaptive);
        match self {
            Self::All => Ok(Aov::ALL.into_iter().filter(can_have).collect()),
            Self::These(these) => match these.iter().find(|aov| !can_have(aov)) {
                Some(aov) => Err(*aov),
                None => Ok(Self::These(these)),
            },
        }
    }
}

impl Default for Aovs {
    /// None: colour alone.
    fn default() -> Self {
        Self::These(BTreeSet::new())
    }
}

impl<const N: usize> From<[Aov; N]> for Aovs {
    fn from(aovs: [Aov; N]) -> Self {
        aovs.into_iter().collect()
    }
}

impl FromIterator<Aov> for Aovs {
    fn from_iter<I: IntoIterator<Item = Aov>>(aovs: I) -> Self {
        Self::These(aovs.into_iter().collect())
    }
}

impl FromIterator<Self> for Aovs {
    /// All of several lists.
    fn from_iter<I: IntoIterator<Item = Self>>(lists: I) -> Self {
        let mut all = BTreeSet::new();
        for list in lists {
            match list {
                Self::All => return Self::All,
                Self::These(these) => all.extend(these),
            }
        }
        Self::These(all)
    }
}

impl fmt::Display for Aovs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::These(these) if these.is_empty() => f.write_str("none"),
            Self::These(these) => {
                let names: Vec<&str> = these.iter().map(|aov| aov.name()).collect();
                f.write_str(&names.join(","))
            }
        }
    }
}

impl Serialize for Aovs {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Aovs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(|word| D::Error::unknown_variant(&word, &Self::NAMES))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_aov_has_a_name_and_is_found_by_it() {
        for (aov, name) in Aov::ALL.into_iter().zip(Aovs::NAMES) {
            assert_eq!((aov.name(), Aovs::parse(name)), (name, Ok([aov].into())));
        }
        assert_eq!(Aovs::parse("none"), Ok(Aovs::default()));
        assert_eq!(Aovs::parse("depth, all"), Ok(Aovs::All));
        assert_eq!(Aovs::parse("depth,,normal"), Err(String::new()));
    }

    #[test]
    fn text_comes_back_as_the_same_list() {
        for list in ["none", "all", "depth,mesh-id,reference"] {
            let aovs = Aovs::parse(list).expect("a list");
            let text = serde_json::to_string(&aovs).expect("JSON");
            assert_eq!(text, format!("\"{list}\""));
            assert_eq!(serde_json::from_str::<Aovs>(&text).expect("JSON"), aovs);
        }
        let wrong = serde_json::from_str::<Aovs>("\"dept\"").expect_err("unknown").to_string();
        assert!(wrong.contains("`dept`") && wrong.contains("`depth`"), "{wrong}");
    }

    #[test]
    fn a_policy_has_all_that_it_can_and_refuses_by_name_what_it_cannot() {
        let under = |text: &str, policy| Aovs::parse(text).expect("a list").under(policy, true);
        let all = |policy| under("all", policy).map(|aovs| aovs.to_string());
        let first_hits = "depth,position,normal,albedo,mesh-id,motion,samples";
        assert_eq!(Aovs::from([Aov::Samples]).under(Policy::Off, false), Err(Aov::Samples));
        let maps = "provenance,frame,distance,audit";
        assert_eq!(all(Policy::Off), Ok(first_hits.into()));
        assert_eq!(all(Policy::Colour), Ok(format!("{first_hits},{maps}")));
        assert_eq!(all(Policy::Surface), Ok(format!("{first_hits},{maps},reference")));
        assert_eq!(under("depth,audit", Policy::Off), Err(Aov::Audit));
        assert_eq!(under("reference", Policy::Colour), Err(Aov::Reference));
        let named = Aovs::parse("motion").expect("a list");
        assert!(named.have_first_hits() && !named.need_reuse());
        let kept = Aovs::from([Aov::Reference]);
        assert!(!kept.have_first_hits() && kept.need_reuse());
    }
}
