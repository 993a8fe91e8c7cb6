//! Lists of ranges of triangles, one for each face or cell.

use crate::check::{Checked, require};
use crate::manifest::{BitfieldsBody, Body, Manifest};
use crate::read::{parse_json, read_beginning};
use crate::{BundleError, ManifestError};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Bytes of `faces.json` or `cells.json` at most, larger ones are not read: a thousand lists of a thousand
/// ranges take 20 MB.
pub const LISTS_MOST_BYTES: u64 = 64 << 20;

/// Checks that lists are in order, each of their ranges in one part, and all as the manifest says.
///
/// * `name` - of the lists in the file, in the plural
pub(crate) fn check<'a>(
    lists: impl Iterator<Item = &'a [[u32; 2]]> + Clone,
    parts: &[u32],
    body: &BitfieldsBody,
    name: &str,
) -> Checked {
    require(
        parts.first() == Some(&0) && parts.is_sorted_by(|a, b| a < b),
        "parts",
        || "do not begin with 0 and ascend".into(),
    )?;
    let triangles = parts.last().copied().unwrap_or(0);
    require(u64::from(triangles) == body.triangles, "parts", || {
        format!(
            "end with {triangles}, but the manifest says {} triangles",
            body.triangles
        )
    })?;
    for (i, list) in lists.clone().enumerate() {
        check_ranges(list, parts, &format!("{name}[{i}].draw"))?;
    }
    let lengths = || lists.clone().map(|list| list.len() as u64);
    for (what, found, stated) in [
        (name, lengths().count() as u64, u64::from(body.lists)),
        ("ranges", lengths().sum(), body.ranges),
        (
            "ranges in one at most",
            lengths().max().unwrap_or(0),
            u64::from(body.most_ranges),
        ),
    ] {
        require(found == stated, name, || {
            format!("have {found} {what}, but the manifest says {stated}")
        })?;
    }
    let culled = culled(lists, triangles);
    // Sums of whole numbers, divided once.
    require((culled - body.culled).abs() <= 1e-9, name, || {
        format!(
            "leave out {culled} of the triangles, but the manifest says {}",
            body.culled
        )
    })
}

fn check_ranges(ranges: &[[u32; 2]], parts: &[u32], place: &str) -> Checked {
    let mut before = 0;
    for (i, &[first, end]) in ranges.iter().enumerate() {
        require(
            first >= before && first < end,
            format_args!("{place}[{i}]"),
            || format!("is from {first} to {end}, which is empty or not behind the one before"),
        )?;
        // The first border behind its beginning.
        let border = parts.partition_point(|border| *border <= first);
        let border = parts.get(border).copied().unwrap_or(0);
        require(end <= border, format_args!("{place}[{i}]"), || {
            format!("is from {first} to {end}, over the end of a primitive at {border}")
        })?;
        before = end;
    }
    Ok(())
}

/// Triangles in ranges.
pub(crate) fn drawn(ranges: &[[u32; 2]]) -> u64 {
    let lengths = ranges.iter().map(|[first, end]| u64::from(end - first));
    lengths.sum()
}

/// Mean share of the triangles that lists leave out; 0 where there is no list.
pub(crate) fn culled<'a>(lists: impl Iterator<Item = &'a [[u32; 2]]>, triangles: u32) -> f64 {
    let (mut count, mut all) = (0u64, 0);
    for list in lists {
        count += 1;
        all += drawn(list);
    }
    match count {
        0 => 0.0,
        count => 1.0 - all as f64 / (count as f64 * f64::from(triangles).max(1.0)),
    }
}

/// Reads a file of lists, of which at most 64 MiB are read.
///
/// # Errors
///
/// When there is none, or it cannot be true; the error names the file and the place in it.
pub(crate) fn read<T: DeserializeOwned>(
    dir: &Path,
    manifest: &Manifest,
    name: &str,
    check: impl FnOnce(&T, &BitfieldsBody) -> Checked,
) -> Result<T, BundleError> {
    let path = dir.join(name);
    let text = read_beginning(&path, LISTS_MOST_BYTES + 1)?;
    if text.len() as u64 > LISTS_MOST_BYTES {
        return Err(BundleError::TooLarge {
            path,
            limit: LISTS_MOST_BYTES,
        });
    }
    let lists: T = match parse_json(&text) {
        Ok(lists) => lists,
        Err((place, error)) => return Err(BundleError::Json { path, place, error }),
    };
    let mut bodies = manifest.impostors.iter().map(|one| &one.body);
    let body = bodies.find_map(|body| match body {
        Body::Bitfields(body) => Some(body),
        Body::Layered(_) | Body::Tdm(_) => None,
    });
    let checked = match body {
        Some(body) => check(&lists, body),
        None => Err(ManifestError {
            place: "the file".into(),
            problem: "is there, but the manifest tells of no bitfields".into(),
        }),
    };
    match checked {
        Ok(()) => Ok(lists),
        Err(error) => Err(BundleError::Manifest { path, error }),
    }
}
