//! From where ID-bitfields are sampled.

use anyhow::{Context, Result, anyhow, bail};
use farfield_bitfields::{Triangulation, TriangulationError, even_directions, merge_directions};
use farfield_bundle::FACES_MOST_VIEWPOINTS;
use glam::DVec3;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// From where the bake looks at a scene.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleChoice {
    /// From where it is needed, until nothing is missed.
    Adaptive,
    /// From as many directions, spread evenly.
    Even(u32),
    /// From the directions of the viewpoints in this file: a line each, `x y z` in metres. Those in one
    /// direction, at whatever distances, are one.
    Listed(PathBuf),
}

impl SampleChoice {
    /// What an argument of the command line names: a count, or else a file.
    ///
    /// # Errors
    ///
    /// When it is a number, but not of samples that surround a scene.
    pub fn from_argument(argument: std::ffi::OsString) -> Result<Self, String> {
        let text = argument.to_str();
        let number = text.and_then(|text| text.parse::<f64>().ok());
        if !number.is_some_and(f64::is_finite) {
            return Ok(Self::Listed(argument.into()));
        }
        let count = text.and_then(|text| text.parse().ok());
        let count = count.filter(|count| COUNTS.contains(count));
        count.map(Self::Even).ok_or_else(needed)
    }
}

/// Viewpoints of a file, and the lines that they stand in.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Listed {
    pub(crate) viewpoints: Vec<DVec3>,
    lines: Vec<usize>,
    path: PathBuf,
}

/// With more, nobody reads the bundle.
const MOST: u32 = FACES_MOST_VIEWPOINTS;

/// So many surround a scene.
const COUNTS: RangeInclusive<u32> = 4..=MOST;

fn needed() -> String {
    format!("from {} to {MOST} samples surround a scene", COUNTS.start())
}

/// As many directions, spread evenly.
///
/// # Errors
///
/// When these are fewer than surround a scene, or far too many.
pub(crate) fn even(count: u32) -> Result<Vec<DVec3>> {
    if !COUNTS.contains(&count) {
        bail!("--samples {count}: {}", needed());
    }
    Ok(even_directions(count))
}

/// Reads viewpoints, one a line; empty lines and what follows a # are skipped.
///
/// # Errors
///
/// When the file cannot be read, or a line is no viewpoint; names file and line.
pub(crate) fn listed(path: &Path) -> Result<Listed> {
    let text =
        std::fs::read_to_string(path).with_context(|| format!("--samples {}", path.display()))?;
    let mut listed = Listed {
        viewpoints: Vec::new(),
        lines: Vec::new(),
        path: path.to_owned(),
    };
    // Some editors begin files with a byte order mark.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    for (number, line) in (1..).zip(text.lines()) {
        let content = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = content
            .split([' ', '\t', ','])
            .filter(|word| !word.is_empty())
            .collect();
        if words.is_empty() {
            continue;
        }
        let at = || format!("{}:{number}", path.display());
        let numbers = words.iter().map(|word| {
            let number = word.parse::<f64>().ok().filter(|n| n.is_finite());
            number.ok_or_else(|| anyhow!("{}: '{word}' is not a number", at()))
        });
        match numbers.collect::<Result<Vec<f64>>>()?[..] {
            [x, y, z] => listed.viewpoints.push(DVec3::new(x, y, z)),
            _ => bail!(
                "{}: a viewpoint is three numbers, x y z in metres, not {}",
                at(),
                words.len()
            ),
        }
        listed.lines.push(number);
        if listed.lines.len() > MOST as usize {
            bail!("{}: has more than {MOST} viewpoints", path.display());
        }
    }
    Ok(listed)
}

impl Listed {
    /// Directions from a centre, each once however many viewpoints lie in it, and the least and the
    /// greatest distance from there.
    ///
    /// # Errors
    ///
    /// When a viewpoint is nearer than `least` to the centre, or they do not surround it.
    pub(crate) fn directions(&self, center: DVec3, least: f64) -> Result<(Vec<DVec3>, [f64; 2])> {
        let path = self.path.display();
        let line = |viewpoint: usize| self.lines[viewpoint];
        let distances: Vec<f64> = self.viewpoints.iter().map(|v| v.distance(center)).collect();
        if let Some(inside) = distances.iter().position(|distance| *distance < least) {
            bail!(
                "{path}:{}: the viewpoint is inside of the scene or just before it: it must be at \
                 least {least:.6} m from the centre ({}, {}, {})",
                line(inside),
                center.x,
                center.y,
                center.z
            );
        }
        let directions = merge_directions(&self.viewpoints, center);
        let directions = directions.map_err(|error| match error {
            TriangulationError::NoDirection { viewpoint, .. } => {
                anyhow!("{path}:{}: {error}", line(viewpoint))
            }
            error => anyhow!("{path}: {error}"),
        })?;
        let faces = Triangulation::new(&directions, DVec3::ZERO).map_err(|error| match error {
            TriangulationError::TooFew { count } => anyhow!(
                "{path}: of the viewpoints listed, {}, the directions from the centre are {count}, but at \
                 least 4 are needed to surround the scene",
                self.viewpoints.len()
            ),
            error => anyhow!("{path}: {error}"),
        })?;
        let range = distances
            .iter()
            .fold([f64::INFINITY, 0.0], |[min, max], d| {
                [d.min(min), d.max(max)]
            });
        Ok((faces.directions().to_vec(), range))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Listed> {
        let file = tempfile::NamedTempFile::new().expect("there is room for a file");
        std::fs::write(file.path(), text).expect("it can be written");
        listed(file.path())
    }

    const AROUND: &str = "# four\n2 2 2\n\n2,-2,-2 # a comment\n\t-2 2 -2\n-2 -2 2\n";

    /// What some editors write before the first line is no part of it.
    #[test]
    fn a_byte_order_mark_is_skipped() {
        assert_eq!(
            read("\u{feff}1 2 3\n").unwrap().viewpoints,
            [DVec3::new(1.0, 2.0, 3.0)]
        );
    }

    #[test]
    fn a_list_gives_directions_and_distances() {
        let (directions, [near, far]) = read(AROUND).unwrap().directions(DVec3::ZERO, 1.0).unwrap();
        assert_eq!(directions.len(), 4);
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
        assert!((near - 12f64.sqrt()).abs() < 1e-12 && near == far);
    }

    /// Viewpoints at several distances in one direction are one, and none of the distances is lost.
    #[test]
    fn viewpoints_in_one_direction_are_merged() {
        let listed = read(&format!("{AROUND}4 4 4\n1 1 1\n2 2 2\n")).unwrap();
        let (directions, [near, far]) = listed.directions(DVec3::ZERO, 1.0).unwrap();
        assert_eq!(
            directions,
            read(AROUND)
                .unwrap()
                .directions(DVec3::ZERO, 1.0)
                .unwrap()
                .0
        );
        assert!((near - 3f64.sqrt()).abs() < 1e-12 && (far - 48f64.sqrt()).abs() < 1e-12);
    }

    /// Whatever is wrong with a list, the message names the line.
    #[test]
    fn wrong_lines_are_named() {
        for (text, at, what) in [
            ("1 2 3\n1 2\n", ":2: ", "three numbers"),
            ("1 2 3 4\n", ":1: ", "three numbers"),
            ("1 2 3\n\n1 two 3\n", ":3: ", "'two' is not a number"),
            ("1 nan 3\n", ":1: ", "'nan' is not a number"),
        ] {
            let message = format!("{:#}", read(text).unwrap_err());
            assert!(message.contains(at) && message.contains(what), "{message}");
        }
        let cases = [
            (format!("{AROUND}0.1 0 0\n"), ":7: ", "inside of the scene"),
            ("2 2 2\n3 3 0\n-2 2 2\n".into(), ": ", "at least 4"),
            ("2 2 2\n3 3 0\n-2 2 2\n4 4 4\n".into(), ": ", "at least 4"),
            (
                "2 1 0\n2 -1 0\n-2 1 0\n-2 -1 0\n".into(),
                ": ",
                "do not surround",
            ),
            (
                "2 0 1\n2 1 0\n2 -1 0\n2 0 -1\n".into(),
                ": ",
                "do not surround",
            ),
            (String::new(), ": ", "at least 4"),
            (
                "1 1 1\n2 2 2\n-1 -1 -1\n-3 -3 -3\n5 5 5\n".into(),
                ": ",
                "listed, 5, the directions from the centre are 2, but at least 4",
            ),
        ];
        for (text, at, what) in cases {
            let found = read(&text).unwrap().directions(DVec3::ZERO, 1.0);
            let message = format!("{:#}", found.unwrap_err());
            assert!(message.contains(at) && message.contains(what), "{message}");
        }
    }

    #[test]
    fn an_argument_is_a_count_or_a_file() {
        let named = |argument: &str| SampleChoice::from_argument(argument.into());
        assert_eq!(named("25"), Ok(SampleChoice::Even(25)));
        for file in ["views.txt", "inf", "25.txt"] {
            assert_eq!(named(file), Ok(SampleChoice::Listed(file.into())));
        }
        for number in ["0", "3", "-4", "2.5", "10001", "99999999999999999999"] {
            assert_eq!(named(number), Err(needed()));
        }
        assert!(even(3).is_err() && even(4).is_ok() && even(0).is_err());
    }
}
