//! Views that are held back: what they show is known only after sets were made for them.

use crate::Bitfield;
use glam::DVec3;

/// Views that are looked at before samples are added: with fewer, sets are united more often; with
/// more, views are wasted where something is known to be missed.
const BATCH: u64 = 64;

/// A batch of views that no sample was taken from before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Round {
    /// Viewpoints that samples were taken from before.
    pub viewpoints: u32,
    /// Views that missed more pixels than are tolerated.
    pub missing_views: u32,
    /// Pixels that showed a primitive which the set for their view had not, in all views.
    pub missed_pixels: u64,
    /// Pixels of the worst view.
    pub worst: u64,
}

impl Round {
    pub(crate) fn new(viewpoints: usize) -> Self {
        Self {
            viewpoints: viewpoints as u32,
            missing_views: 0,
            missed_pixels: 0,
            worst: 0,
        }
    }

    /// Counts a view and its missed pixels.
    pub(crate) fn count(&mut self, pixels: u64, tolerated: u64) {
        self.missing_views += u32::from(pixels > tolerated);
        self.missed_pixels += pixels;
        self.worst = self.worst.max(pixels);
    }
}

/// Looks at views, in batches, until as many in a row as asked for are clean or there were as many
/// as allowed. Returns how many the last clean ones are, and what came of each batch.
///
/// * `view` - the viewpoint of each view, by its number
/// * `look` - what views from there show: primitives, each with its number of pixels
/// * `learn` - from viewpoints and what was shown there
pub(crate) fn until_clean<E>(
    clean_views: u32,
    most_views: u32,
    view: impl Fn(u64) -> DVec3,
    mut look: impl FnMut(&[DVec3]) -> Vec<Vec<[u32; 2]>>,
    mut learn: impl FnMut(&[DVec3], &[Vec<[u32; 2]>]) -> Result<Round, E>,
) -> Result<(u32, Vec<Round>), E> {
    let mut rounds = Vec::new();
    let (mut clean, mut looked) = (0, 0);
    while clean < clean_views && looked < most_views {
        let batch = BATCH
            .min(u64::from(clean_views - clean))
            .min(u64::from(most_views - looked));
        let views: Vec<DVec3> = (0..batch).map(|i| view(u64::from(looked) + i)).collect();
        looked += batch as u32;
        let shown = look(&views);
        assert!(
            shown.len() == views.len(),
            "{} views of {batch}",
            shown.len()
        );
        let round = learn(&views, &shown)?;
        clean = match round.missing_views {
            0 => clean + batch as u32,
            _ => 0,
        };
        rounds.push(round);
    }
    Ok((clean, rounds))
}

/// Pixels that show a primitive which a set lacks.
///
/// * `shown` - primitives, each with its number of pixels
pub fn missed_pixels(shown: &[[u32; 2]], set: &Bitfield) -> u64 {
    let missed = shown.iter().filter(|[id, _]| !set.contains(*id));
    missed.map(|[_, pixels]| u64::from(*pixels)).sum()
}
