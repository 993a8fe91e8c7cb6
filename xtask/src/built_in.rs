//! Scenes that are made in code, as they are named on the command line and in manifests.

use farfield_bundle::SceneSource;
use farfield_scene::Scene;
use farfield_town::TOWN_TRIANGLES;

/// A scene that needs no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuiltIn {
    /// `house`: a half-timbered guildhall.
    House,
    /// `town[:TRIANGLES[:SEED]]`: an old town on a hill.
    Town {
        /// About how many are drawn, from 10^5 to 10^7.
        triangles: u32,
        /// Another seed, another town.
        seed: u32,
    },
}

/// The seed of the house's textures.
const HOUSE_SEED: u64 = 0;

impl Default for BuiltIn {
    /// A town of some three hundred houses.
    fn default() -> Self {
        Self::Town {
            triangles: 500_000,
            seed: 1,
        }
    }
}

impl BuiltIn {
    /// The scene that a word of the command line names, `None` where it names none.
    ///
    /// # Errors
    ///
    /// When a size or a seed is not a number in range.
    pub fn from_word(word: &str) -> Option<Result<Self, String>> {
        let mut parts = word.split(':');
        match (parts.next()?, parts.next(), parts.next(), parts.next()) {
            ("house", None, None, None) => Some(Ok(Self::House)),
            ("town", triangles, seed, None) => Some(Self::town(triangles, seed)),
            _ => None,
        }
    }

    fn town(triangles: Option<&str>, seed: Option<&str>) -> Result<Self, String> {
        let Self::Town {
            triangles: fewest,
            seed: first,
        } = Self::default()
        else {
            unreachable!("the default is a town");
        };
        let triangles = triangles.map_or(Ok(fewest), |text| {
            // Also 1e6.
            let number: Option<f64> = text.parse().ok();
            let whole = number.filter(|n| TOWN_TRIANGLES.contains(&(*n as u64)));
            whole.map(|n| n as u32).ok_or_else(|| {
                let (least, most) = (TOWN_TRIANGLES.start(), TOWN_TRIANGLES.end());
                format!("a town has from {least} to {most} triangles, not '{text}'")
            })
        })?;
        let seed = seed.map_or(Ok(first), |text| {
            text.parse()
                .map_err(|_| format!("the seed '{text}' of a town is not a whole number"))
        })?;
        Ok(Self::Town { triangles, seed })
    }

    /// Its name in manifests and folders.
    pub fn name(&self) -> &'static str {
        match self {
            Self::House => "house",
            Self::Town { .. } => "town",
        }
    }

    /// Makes it.
    pub(crate) fn scene(&self) -> Scene {
        match *self {
            Self::House => farfield_town::house(HOUSE_SEED),
            Self::Town { triangles, seed } => farfield_town::town(seed, triangles.into()),
        }
    }

    /// How a manifest refers to it.
    pub(crate) fn record(&self) -> SceneSource {
        let (size, seed) = match *self {
            Self::House => (1, HOUSE_SEED),
            Self::Town { triangles, seed } => (triangles, seed.into()),
        };
        SceneSource::BuiltIn {
            name: self.name().into(),
            size,
            seed,
        }
    }

    /// The scene that a manifest refers to; `None` where this version has no such.
    pub(crate) fn from_record(name: &str, size: u32, seed: u64) -> Option<Self> {
        match name {
            "house" => ((size, seed) == (1, HOUSE_SEED)).then_some(Self::House),
            "town" => {
                let seed = u32::try_from(seed).ok()?;
                let exists = TOWN_TRIANGLES.contains(&size.into());
                exists.then_some(Self::Town {
                    triangles: size,
                    seed,
                })
            }
            _ => None,
        }
    }
}

impl std::fmt::Display for BuiltIn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::House => f.write_str("the built-in house"),
            Self::Town { triangles, seed } => {
                write!(f, "the built-in town of {triangles} triangles, seed {seed}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a word names is found again by what the manifest says of it.
    #[test]
    fn words_and_records_name_the_same_scenes() {
        let town = |triangles, seed| BuiltIn::Town { triangles, seed };
        for (word, expected) in [
            ("house", BuiltIn::House),
            ("town", BuiltIn::default()),
            ("town:1e6", town(1_000_000, 1)),
            ("town:250000:7", town(250_000, 7)),
        ] {
            let found = BuiltIn::from_word(word).unwrap().unwrap();
            assert_eq!(found, expected);
            let SceneSource::BuiltIn { name, size, seed } = found.record() else {
                panic!("{word} is no built-in scene");
            };
            assert_eq!(BuiltIn::from_record(&name, size, seed), Some(expected));
        }
    }

    #[test]
    fn other_words_are_files_and_wrong_numbers_errors() {
        for word in [
            "house.glb",
            "town.obj",
            "./town",
            "house:2",
            "town:1e5:1:1",
            "",
        ] {
            assert_eq!(BuiltIn::from_word(word), None, "{word}");
        }
        for (word, reason) in [
            ("town:7", "from 100000 to 10000000"),
            ("town:many", "'many'"),
            ("town:1e5:x", "seed 'x'"),
        ] {
            let error = BuiltIn::from_word(word).unwrap().unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
        assert_eq!(BuiltIn::from_record("town", 5, 1), None);
        assert_eq!(BuiltIn::from_record("castle", 1, 0), None);
    }
}
