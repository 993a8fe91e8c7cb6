//! Reads material libraries (MTL).

use super::lines::{Line, lines, words};
use crate::mesh_error::MeshFileError;
use glam::Vec3;

/// A material as its library describes it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Description {
    pub(super) name: String,
    /// Linear.
    pub(super) diffuse: Option<Vec3>,
    pub(super) specular: Vec3,
    pub(super) emissive: Vec3,
    /// Of Phong's reflection.
    pub(super) exponent: Option<f32>,
    pub(super) roughness: Option<f32>,
    pub(super) metallic: Option<f32>,
    /// 1 is opaque.
    pub(super) opacity: f32,
    pub(super) diffuse_map: Option<Map>,
    pub(super) emissive_map: Option<Map>,
    pub(super) opacity_map: Option<Map>,
    /// In tangent space.
    pub(super) normal_map: Option<Map>,
}

/// A picture that a material shows.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Map {
    pub(super) file: String,
    /// That mentions it.
    pub(super) line: usize,
    pub(super) clamped: bool,
    /// Whether it has options that are not read.
    pub(super) has_options: bool,
}

/// The materials of a library, in its order.
///
/// # Errors
///
/// When a number is damaged or a picture's name missing; the first one, with its line.
pub(super) fn parse_mtl(bytes: &[u8]) -> Result<Vec<Description>, MeshFileError> {
    let mut materials: Vec<Description> = Vec::new();
    for line in lines(bytes) {
        if line.keyword() == b"newmtl" {
            materials.push(Description {
                name: line.name(),
                diffuse: None,
                specular: Vec3::ZERO,
                emissive: Vec3::ZERO,
                exponent: None,
                roughness: None,
                metallic: None,
                opacity: 1.0,
                diffuse_map: None,
                emissive_map: None,
                opacity_map: None,
                normal_map: None,
            });
            continue;
        }
        let Some(material) = materials.last_mut() else {
            continue;
        };
        let number = || Ok::<_, MeshFileError>(line.numbers([None])?[0] as f32);
        match line.keyword() {
            b"Kd" => material.diffuse = color(&line)?.or(material.diffuse),
            b"Ks" => material.specular = color(&line)?.unwrap_or(material.specular),
            b"Ke" => material.emissive = color(&line)?.unwrap_or(material.emissive),
            b"Ns" => material.exponent = Some(number()?),
            b"Pr" => material.roughness = Some(number()?),
            b"Pm" => material.metallic = Some(number()?),
            b"Tr" => material.opacity = 1.0 - number()?,
            // A halo fades with the angle.
            b"d" if line.arguments().next() != Some(b"-halo") => material.opacity = number()?,
            b"map_Kd" => material.diffuse_map = Some(map(&line)?),
            b"map_Ke" => material.emissive_map = Some(map(&line)?),
            b"map_d" => material.opacity_map = Some(map(&line)?),
            b"norm" => material.normal_map = Some(map(&line)?),
            _ => {}
        }
    }
    Ok(materials)
}

/// Red, green and blue, or one number for all; `None` for a spectrum.
fn color(line: &Line<'_>) -> Result<Option<Vec3>, MeshFileError> {
    if matches!(line.arguments().next(), Some(b"spectral" | b"xyz")) {
        return Ok(None);
    }
    let [red] = line.numbers([None])?;
    let [_, green, blue] = line.numbers([None, Some(red), Some(red)])?;
    Ok(Some(Vec3::from([red, green, blue].map(|c| c as f32))))
}

/// A picture: its options, then its name to the end of the line.
fn map(line: &Line<'_>) -> Result<Map, MeshFileError> {
    let mut rest = line.rest();
    let mut map = Map {
        file: String::new(),
        line: line.number,
        clamped: false,
        has_options: false,
    };
    while rest.starts_with(b"-") {
        let mut option = words(rest);
        let name = option.next().unwrap_or_default();
        let arguments: Vec<&[u8]> = option.collect();
        let is_number = |word: &&&[u8]| {
            let text = std::str::from_utf8(word).ok();
            text.is_some_and(|text| text.parse::<f64>().is_ok())
        };
        let count = match name {
            b"-mm" => 2,
            b"-o" | b"-s" | b"-t" => arguments.iter().take(3).take_while(is_number).count(),
            b"-blendu" | b"-blendv" | b"-boost" | b"-bm" | b"-cc" | b"-clamp" | b"-imfchan"
            | b"-texres" | b"-type" => 1,
            // No option but a name that begins with a dash.
            _ => break,
        };
        match name {
            b"-clamp" => map.clamped = arguments.first() == Some(&b"on".as_slice()),
            b"-mm" | b"-o" | b"-s" | b"-t" => map.has_options = true,
            _ => {}
        }
        for _ in 0..=count {
            let word = words(rest).next().unwrap_or_default();
            rest = rest.trim_ascii_start()[word.len()..].trim_ascii_start();
        }
    }
    map.file = String::from_utf8_lossy(rest).into_owned();
    match map.file.is_empty() {
        true => Err(line.wrong("names no picture", "add one or remove the line")),
        false => Ok(map),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Whatever the bytes, there are materials or one error with its line.
        #[test]
        fn any_bytes_do_no_harm(
            lines in prop::collection::vec(
                prop::sample::select(vec![
                    "newmtl a", "Kd 1", "Kd 1 0", "Kd", "Kd spectral x", "d -halo 0.5", "d", "Tr 2", "map_Kd",
                    "map_Kd -o", "map_Kd -o 1 2 x.png", "map_Kd -s -clamp", "map_d -mm 1", "norm -", "Ns x",
                ]), 0..20),
        ) {
            let text = lines.join("\n");
            match parse_mtl(text.as_bytes()) {
                Ok(materials) => prop_assert!(materials.len() <= lines.len()),
                Err(error) => prop_assert!(error.place.starts_with("line "), "{}", error),
            }
        }
    }

    #[test]
    fn materials_come_out_as_they_were_written() {
        let text =
            b"# a house\nnewmtl red brick\nKd 0.5 0.25 0\nKe 1\nNs 98\nKs 0.1 0.1 0.1\nTr 0.25\n\
            map_Kd -clamp on -s 2 2 1 -blendu off a wall.png\nmap_d leaf.png\nillum 2\n\
            newmtl plain\nd 0.5\nPr 0.3\nPm 1\nnorm -odd.png\n";
        let materials = parse_mtl(text).unwrap();
        let brick = &materials[0];
        assert_eq!(brick.name, "red brick");
        assert_eq!(brick.diffuse, Some(Vec3::new(0.5, 0.25, 0.0)));
        assert_eq!(
            (brick.emissive, brick.exponent, brick.opacity),
            (Vec3::ONE, Some(98.0), 0.75)
        );
        let map = brick.diffuse_map.clone().unwrap();
        assert_eq!((map.file.as_str(), map.line), ("a wall.png", 8));
        assert!(map.clamped && map.has_options);
        assert_eq!(brick.opacity_map.as_ref().unwrap().file, "leaf.png");
        let plain = &materials[1];
        assert_eq!(
            (plain.opacity, plain.roughness, plain.metallic),
            (0.5, Some(0.3), Some(1.0))
        );
        assert_eq!(plain.normal_map.as_ref().unwrap().file, "-odd.png");
    }
}
