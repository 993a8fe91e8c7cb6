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
