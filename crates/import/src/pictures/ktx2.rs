//! Decodes KTX2 files of Basis Universal textures, as KHR_texture_basisu has them.

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use farfield_scene::Image;

const IDENTIFIER: &[u8] = b"\xABKTX 20\xBB\r\n\x1A\n";

/// Colour models of Khronos Group's data formats.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// Ways of supercompression.
const NONE: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Levels of detail at most, those of the greatest side.
const MOST_LEVELS: u32 = 16;

pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(IDENTIFIER)
}

/// Width and height in texels of a file that has what KHR_texture_basisu allows, all of it inside
/// of the file and no larger than its dimensions need; so that the decoder can be trusted with it.
///
/// Source: Khronos Group, KTX File Format Specification 2.0, section 3.
///
/// # Errors
///
/// What is wrong with the file.
pub(super) fn check_header(bytes: &[u8]) -> Result<[u32; 2], String> {
    let word = |at: usize| {
        let word = bytes.get(at..).and_then(|b| b.first_chunk());
        let word = word.map(|&b| u32::from_le_bytes(b));
        word.ok_or_else(|| format!("ends after {} bytes, in its header", bytes.len()))
    };
    let long = |at: usize| Ok::<_, String>(u64::from(word(at)?) | u64::from(word(at + 4)?) << 32);
    let is_inside = |offset: u64, length: u64| {
        let end = offset.checked_add(length);
        end.is_some_and(|end| end <= bytes.len() as u64)
    };
    let [width, height, depth] = [word(20)?, word(24)?, word(28)?];
    let [layers, faces, levels] = [word(32)?, word(36)?, word(40)?];
    if width == 0 || height == 0 || depth > 0 || layers > 1 || faces != 1 {
        return Err(format!(
            "is no single two-dimensional picture ({width} x {height} x {depth} texels, \
             {layers} layers, {faces} faces)"
        ));
    }
    if !(1..=MOST_LEVELS).contains(&levels) {
        return Err(format!("has {levels} levels of detail, expected 1 to 16"));
    }
    let supercompression = word(44)?;
    let (format_at, format_length) = (word(48)?.into(), word(52)?.into());
    let (tables_at, tables_length) = (long(64)?, long(72)?);
    for (offset, length) in [(format_at, format_length), (tables_at, tables_length)] {
        if !is_inside(offset, length) {
            return Err("was cut off or damaged: a part lies beyond its end".into());
        }
    }
    let model = match format_length {
        44.. => bytes[format_at as usize + 12],
        _ => return Err("has no data format descriptor".into()),
    };
    let fits = match model {
        ETC1S => supercompression == BASIS_LZ,
        UASTC => matches!(supercompression, NONE | ZSTANDARD),
        _ => return Err("is no Basis Universal texture (ETC1S or UASTC)".into()),
    };
    if !fits {
        return Err(format!(
            "has supercompression {supercompression}, which does not go with its colours"
        ));
    }
    for level in 0..levels {
        let at = 80 + 24 * level as usize;
        let (offset, length, inflated) = (long(at)?, long(at + 8)?, long(at + 16)?);
        if !is_inside(offset, length) {
            return Err("was cut off or damaged: a level of detail lies beyond its end".into());
        }
        let blocks = |side: u32| u64::from((side >> level).max(1).div_ceil(4));
        let needs = 16 * blocks(width) * blocks(height);
        let is_right = match supercompression {
            NONE => length == needs,
            ZSTANDARD => inflated == needs,
            _ => true,
        };
        if !is_right {
            return Err(format!(
                "has a level of detail {level} of another size than its picture"
            ));
        }
    }
    Ok([width, height])
}

/// The largest level of detail of a file whose header was checked.
///
/// # Errors
///
/// When the data are damaged.
pub(super) fn decode(bytes: &[u8]) -> Result<Image, String> {
    let [width, height] = check_header(bytes)?;
    // Without its keys and values, which say nothing about texels: the decoder miscounts damaged
    // ones.
    let mut file = bytes.to_vec();
    file[56..64].fill(0);
    let decode = || {
        let transcoder = Transcoder::new(&file)?;
        transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE)
    };
    let texels = decode()
        .map_err(|_: basisu::Error| "was cut off or damaged: its blocks cannot be decoded")?;
    Ok(Image {
        name: String::new(),
        width,
        height,
        texels: texels.as_chunks().0.to_vec(),
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A UASTC block of one colour: mode 8, whose code is 10111, then red, green, blue and alpha.
    fn block(texel: [u8; 4]) -> [u8; 16] {
        (0x17 | u128::from(u32::from_le_bytes(texel)) << 5).to_le_bytes()
    }

    /// A zstd frame of up to 255 bytes as they are.
    fn zstd(bytes: &[u8]) -> Vec<u8> {
        let block = (bytes.len() as u32) << 3 | 1;
        let mut frame = vec![0x28, 0xB5, 0x2F, 0xFD, 0x20, bytes.len() as u8];
        frame.extend(&block.to_le_bytes()[..3]);
        frame.extend(bytes);
        frame
    }

    /// A file of one UASTC level with blocks of the given colours, row by row.
    pub(crate) fn file(
        width: u32,
        height: u32,
        blocks: &[[u8; 4]],
        supercompression: u32,
    ) -> Vec<u8> {
        let plain: Vec<u8> = blocks.iter().flat_map(|&texel| block(texel)).collect();
        let data = match supercompression {
            ZSTANDARD => zstd(&plain),
            _ => plain.clone(),
        };
        let mut file = IDENTIFIER.to_vec();
        // From the format on: one level, then data format, keys and tables.
        for word in [
            0,
            1,
            width,
            height,
            0,
            0,
            1,
            1,
            supercompression,
            104,
            44,
            0,
            0,
            0,
            0,
            0,
            0,
        ] {
            file.extend(word.to_le_bytes());
        }
        for long in [160, data.len() as u64, plain.len() as u64] {
            file.extend(long.to_le_bytes());
        }
        // UASTC in sRGB, blocks of 4 x 4 in 16 bytes, one sample of red, green, blue and alpha.
        let descriptor = [
            44,
            0,
            2 | 40 << 16,
            u32::from(UASTC) | 1 << 8 | 2 << 16,
            0x0303,
            16,
            0,
            3 << 24 | 127 << 16,
            0,
            0,
            u32::MAX,
        ];
        for word in descriptor {
            file.extend(word.to_le_bytes());
        }
        file.resize(160, 0);
        file.extend(data);
        file
    }

    proptest! {
        /// Blocks of one colour come out as they went in, with and without supercompression.
        #[test]
        fn blocks_come_out_as_they_went_in(
            blocks in prop::collection::vec(any::<[u8; 4]>(), 6),
            crop in prop::array::uniform2(0..4u32),
            supercompression in prop::sample::select(vec![NONE, ZSTANDARD]),
        ) {
            let [width, height] = [12 - crop[0], 8 - crop[1]];
            let file = file(width, height, &blocks, supercompression);
            prop_assert_eq!(check_header(&file), Ok([width, height]));
            let image = decode(&file).unwrap();
            prop_assert_eq!(image.texels.len() as u32, width * height);
            for (i, texel) in image.texels.iter().enumerate() {
                let (x, y) = (i as u32 % width, i as u32 / width);
                prop_assert_eq!(*texel, blocks[(y / 4 * 3 + x / 4) as usize], "at {}, {}", x, y);
            }
        }

        /// A file with bytes changed or cut off is refused or has all its texels.
        #[test]
        fn damaged_bytes_do_no_harm(
            supercompression in prop::sample::select(vec![NONE, ZSTANDARD]),
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
            length in prop::option::of(any::<prop::sample::Index>()),
        ) {
            let mut file = file(8, 4, &[[1, 2, 3, 4], [5, 6, 7, 8]], supercompression);
            for (at, byte) in changes {
                let at = at.index(file.len());
                file[at] = byte;
            }
            if let Some(length) = length {
                file.truncate(length.index(file.len()));
            }
            let read = || Some((super::super::check_size(&file).ok()?, super::super::decode(&file).ok()?));
            if let Some(([width, height], image)) = read() {
                prop_assert_eq!(image.texels.len() as u64, u64::from(width) * u64::from(height));
            }
        }
    }

    #[test]
    fn faults_are_told() {
        let sound = file(8, 4, &[[1, 2, 3, 4], [5, 6, 7, 8]], ZSTANDARD);
        assert!(check_header(&sound).is_ok());
        let refusal = |at: usize, value: u32| {
            let mut file = sound.clone();
            file[at..at + 4].copy_from_slice(&value.to_le_bytes());
            check_header(&file).unwrap_err()
        };
        for (message, expected) in [
            (refusal(20, 0), "is no single two-dimensional picture"),
            (refusal(28, 1), "is no single two-dimensional picture"),
            (refusal(36, 6), "is no single two-dimensional picture"),
            (refusal(40, 17), "has 17 levels"),
            (refusal(44, 3), "has supercompression 3"),
            (refusal(48, 1 << 30), "was cut off or damaged"),
            (refusal(52, 40), "has no data format descriptor"),
            (refusal(80, 1 << 30), "was cut off or damaged"),
            // What would be inflated to more than the picture has.
            (
                refusal(96, 1 << 30),
                "has a level of detail 0 of another size",
            ),
            (refusal(116, 1), "is no Basis Universal texture"),
        ] {
            assert!(
                message.starts_with(expected),
                "{message}, expected {expected}"
            );
        }
        let message = check_header(&sound[..70]).unwrap_err();
        assert!(message.starts_with("ends after 70 bytes"), "{message}");
        let message = decode(&sound[..sound.len() - 1]).unwrap_err();
        assert!(message.contains("cut off"), "{message}");
    }
}
