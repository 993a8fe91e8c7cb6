//! The recorded layers, for people to look at: OpenEXR files and contact sheets.

use crate::bake::recording::{Layers, recording_camera};
use crate::pictures::{labelled_sheet, png};
use crate::source::real;
use anyhow::{Context, Result, bail};
use exr::prelude::{
    AttributeValue, Compression, Encoding, Image, ImageAttributes, IntegerBounds, Layer,
    LayerAttributes, LineOrder, SpecificChannels, Text, Vec2, WritableImage, f16,
};
use exr::prelude::{Blocks, SmallVec};
use farfield_bundle::{FolderKind, NewFile, require_replaceable_by, write_folder};
use farfield_grid::Grid;
use farfield_sampling::{Lighting, Recording, Sample, Textures, linear_from_srgb, sample_colors};
use farfield_scene::Scene;
use farfield_views::ViewCell;
use std::io::Cursor;
use std::ops::Range;
use std::path::Path;

/// Folders with what is dumped.
const DUMP: FolderKind = FolderKind {
    name: "dump",
    marker: "dump.json",
    format: "farfield-dump",
};

/// Pictures beside each other on a sheet.
const COLUMNS: usize = 8;

/// Pictures on a sheet: more would be too many pixels for some viewers.
const PER_SHEET: usize = 64;

/// Pixels along each side of a sheet's pictures.
const SIDE: usize = 160;

/// The layers of an impostor with their colours.
#[derive(Clone, Copy, Debug)]
struct Colored<'a> {
    /// The impostor's.
    name: &'a str,
    /// What was recorded.
    scene: &'a Scene,
    layers: &'a Layers,
    /// sRGB, of each texel that was set.
    colors: &'a [[u8; 3]],
}

/// Checks that a dump may be put at `dir`, and that it is apart from the bundle in `bundle`.
pub(crate) fn require_place(dir: &Path, bundle: &Path) -> Result<()> {
    require_apart(dir, bundle, &DUMP)
}

/// Checks that a folder of a kind may be put at `dir`, and that it is apart from the bundle in `bundle`.
pub(crate) fn require_apart(dir: &Path, bundle: &Path, kind: &FolderKind) -> Result<()> {
    let real_path = |path: &Path| {
        let path = std::path::absolute(path).context("the current folder is gone")?;
        anyhow::Ok(real(&path))
    };
    let (of_this, of_bundle) = (real_path(dir)?, real_path(bundle)?);
    if of_this.starts_with(&of_bundle) || of_bundle.starts_with(&of_this) {
        bail!(
            "{}: a {} and the bundle in {} cannot lie in each other; choose another folder",
            dir.display(),
            kind.name,
            bundle.display()
        );
    }
    Ok(require_replaceable_by(dir, kind)?)
}

/// Writes a dump: it appears complete or not at all.
pub(crate) fn write(dir: &Path, files: &[NewFile]) -> Result<()> {
    Ok(write_folder(dir, &DUMP, files)?)
}

/// The files of one impostor: `<name>.exr`, `<name>-recorded-000.png`, `<name>-kept-000.png`, ...
pub(crate) fn files(
    name: &str,
    scene: &Scene,
    textures: &Textures<'_>,
    cell: &ViewCell,
    layers: &Layers,
) -> Result<Vec<NewFile>> {
    let is_kept = kept(&layers.recording, &layers.visible);
    let recorded = &Colored {
        name,
        scene,
        layers,
        colors: &sample_colors(
            scene,
            textures,
            &recording_camera(&layers.stack),
            &cell.corners(),
            &layers.recording.samples,
            &Lighting::default(),
        ),
    };
    let exr = NewFile {
        path: format!("{}.exr", recorded.name),
        bytes: exr(recorded, &is_kept).context("the layers cannot be written as OpenEXR")?,
    };
    let sheets = [("recorded", None), ("kept", Some(&*is_kept))]
        .into_iter()
        .flat_map(|(which, only)| {
            sheets(recorded, only)
                .enumerate()
                .map(move |(i, sheet)| NewFile {
                    path: format!("{}-{which}-{i:03}.png", recorded.name),
                    bytes: png(&sheet),
                })
        });
    Ok(std::iter::once(exr).chain(sheets).collect())
}

/// Of each sample of a recording, whether it is also one of `visible`.
fn kept(recording: &Recording, visible: &Recording) -> Vec<bool> {
    let place = |sample: &Sample| (sample.y, sample.x);
    let runs = recording.layers.iter().zip(&visible.layers);
    runs.flat_map(|(all, seen)| {
        // Both row by row.
        let mut seen = visible.samples[seen.clone()].iter().peekable();
        recording.samples[all.clone()]
            .iter()
            .map(move |sample| seen.next_if(|seen| place(seen) == place(sample)).is_some())
    })
    .collect()
}

/// All layers as parts of one OpenEXR file, front to back.
///
/// Part `layer.007` has the data window of the layer's texels (one transparent texel where there
/// are none) in the display window of the whole layer. Its channels are zero where no texel is:
/// `R`, `G`, `B` linear and `A` straight, half; `Z`, the distance of the recorded surface along
/// the view axis in metres, float; `kept`, one where culling kept the texel, half. The attribute
/// `planeDepth` (double) is where the layer lies, `near` and `far` (float) are the depths that it
/// stands for, all in metres.
fn exr(recorded: &Colored<'_>, is_kept: &[bool]) -> exr::error::Result<Vec<u8>> {
    let Layers {
        stack, recording, ..
    } = recorded.layers;
    let pose = recording_camera(stack).pose;
    let linear =
        |color: [u8; 3]| color.map(|c| f16::from_f32(linear_from_srgb(f32::from(c) / 255.0)));
    let (zero, one) = (f16::ZERO, f16::ONE);
    let pixel = |index: usize| {
        let [r, g, b] = linear(recorded.colors[index]);
        let point = recording.samples[index].hit.point_in_world(recorded.scene);
        let kept = if is_kept[index] { one } else { zero };
        (r, g, b, one, pose.point_in_view(point).z as f32, kept)
    };
    let layers = recording.layers.iter().zip(&stack.layers);
    let layers = layers.enumerate().map(|(i, (run, placed))| {
        let samples = &recording.samples[run.clone()];
        let [left, top, right, bottom] = window(samples);
        let mut attributes = LayerAttributes {
            near_clip_plane: Some(placed.near as f32),
            far_clip_plane: Some(placed.far as f32),
            ..LayerAttributes::named(&*format!("layer.{i:03}"))
        }
        .with_position(Vec2(left.into(), top.into()));
        // Not more than one: they are written in no fixed order.
        let depth = AttributeValue::F64(placed.depth);
        attributes.other.insert(Text::from("planeDepth"), depth);
        let first = run.start;
        let channels = SpecificChannels::build()
            .with_channel("R")
            .with_channel("G")
            .with_channel("B")
            .with_channel("A")
            .with_channel("Z")
            .with_channel("kept")
            .with_pixel_fn(move |Vec2(x, y)| {
                let place = (y + usize::from(top), x + usize::from(left));
                let found = samples
                    .binary_search_by_key(&place, |sample| (sample.y.into(), sample.x.into()));
                match found {
                    Ok(index) => pixel(first + index),
                    Err(_) => (zero, zero, zero, zero, 0.0f32, zero),
                }
            });
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let size = Vec2((right - left + 1).into(), (bottom - top + 1).into());
        Layer::new(size, attributes, encoding, channels)
    });
    let display = Vec2(stack.width as usize, stack.height as usize);
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(display));
    let layers: SmallVec<[_; 2]> = layers.collect();
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layers(attributes, layers)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// First column and row, last column and row of a layer's samples; one texel where there are none.
fn window(samples: &[Sample]) -> [u16; 4] {
    samples
        .iter()
        .map(|sample| [sample.x, sample.y, sample.x, sample.y])
        .reduce(|[a, b, c, d], [x, y, ..]| [a.min(x), b.min(y), c.max(x), d.max(y)])
        .unwrap_or_default()
}

/// Contact sheets of the layers that have texels, of all of them or of those that are `kept`, each
/// with its number and depth.
fn sheets<'a>(
    recorded: &'a Colored<'a>,
    kept: Option<&'a [bool]>,
) -> impl Iterator<Item = Grid<[u8; 3]>> {
    let Layers {
        stack, recording, ..
    } = recorded.layers;
    let set = move |run: &Range<usize>| {
        let all = run.clone();
        all.filter(move |index| kept.is_none_or(|kept| kept[*index]))
    };
    let layers = recording.layers.iter().enumerate();
    let shown: Vec<(usize, Range<usize>)> = layers
        .filter(|(_, run)| set(run).next().is_some())
        .map(|(i, run)| (i, run.clone()))
        .collect();
    let picture = move |(layer, run): &(usize, Range<usize>)| {
        let (width, height) = (stack.width as usize, stack.height as usize);
        let mut picture = Grid::filled(width, height, [0; 4]);
        for index in set(run) {
            let sample = &recording.samples[index];
            let [r, g, b] = recorded.colors[index];
            picture[(sample.x.into(), sample.y.into())] = [r, g, b, 255];
        }
        (
            format!("{layer:03} {} m", short(stack.layers[*layer].depth)),
            picture,
        )
    };
    let count = shown.len().div_ceil(PER_SHEET);
    (0..count).map(move |i| {
        let end = shown.len().min((i + 1) * PER_SHEET);
        let tiles = shown[i * PER_SHEET..end].iter().map(picture);
        labelled_sheet(tiles, COLUMNS, SIDE)
    })
}

/// A positive number with six digits.
fn short(value: f64) -> String {
    if !(1e-3..1e6).contains(&value) {
        return format!("{value:.5e}");
    }
    let whole = value.log10().floor().max(0.0) as usize + 1;
    format!("{value:.*}", 6 - whole.min(6))
}
