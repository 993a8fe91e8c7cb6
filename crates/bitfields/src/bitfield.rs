//! Sets of primitives, one bit each.

use std::ops::Range;

/// Words that one bit of the summary's words stands for, and bits in a word.
const BITS: usize = u64::BITS as usize;

/// A set of primitives of a model: those that a view sees.
///
/// One bit a primitive, 64 a word, and above them one bit for each word that is not zero, so that
/// 4,096 primitives which nobody sees are skipped at once.
///
/// ```text
/// summary          bit 0          bit 1          bit 2  ...
///                    |              |              |
/// words         ids 0 to 63   ids 64 to 127  ids 128 to 191  ...
/// ```
///
/// Invariants: a bit of the summary is set exactly where its word is not zero; bits from the
/// number of primitives on are zero.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bitfield {
    primitives: u32,
    words: Vec<u64>,
    summary: Vec<u64>,
}

impl Bitfield {
    /// The set without any of a model's `primitives`.
    pub fn empty(primitives: u32) -> Self {
        let words = (primitives as usize).div_ceil(BITS);
        Self {
            primitives,
            words: vec![0; words],
            summary: vec![0; words.div_ceil(BITS)],
        }
    }

    /// What an id buffer shows of a model's `primitives`.
    ///
    /// * `ids` - a primitive for each pixel, in any order; `u32::MAX` where none is seen
    ///
    /// # Panics
    ///
    /// When an id other than `u32::MAX` is not below `primitives`.
    pub fn from_ids(primitives: u32, ids: &[u32]) -> Self {
        let mut set = Self::empty(primitives);
        // Neighbouring pixels often show the same primitive.
        let mut last = u32::MAX;
        for &id in ids {
            if id != last && id != u32::MAX {
                set.insert(id);
            }
            last = id;
        }
        set
    }

    /// The set of all primitives that lie in one of the `ranges`, in any order.
    ///
    /// # Panics
    ///
    /// When a range that is not empty ends beyond `primitives`.
    pub fn from_ranges(primitives: u32, ranges: &[Range<u32>]) -> Self {
        let mut set = Self::empty(primitives);
        ranges
            .iter()
            .cloned()
            .flatten()
            .for_each(|id| set.insert(id));
        set
    }

    /// Number of primitives of the model, in the set or not.
    pub fn primitives(&self) -> u32 {
        self.primitives
    }

    /// Adds a primitive.
    ///
    /// # Panics
    ///
    /// When the model has no such primitive.
    pub fn insert(&mut self, id: u32) {
        assert!(
            id < self.primitives,
            "primitive {id} is none of the model's {}",
            self.primitives
        );
        let word = id as usize / BITS;
        self.words[word] |= 1 << (id as usize % BITS);
        self.summary[word / BITS] |= 1 << (word % BITS);
    }

    /// Whether a primitive is in the set; false for what the model does not have.
    pub fn contains(&self, id: u32) -> bool {
        let word = self.words.get(id as usize / BITS);
        word.is_some_and(|word| word >> (id as usize % BITS) & 1 != 0)
    }

    /// Number of primitives in the set.
    pub fn len(&self) -> u32 {
        self.words.iter().map(|word| word.count_ones()).sum()
    }

    /// Whether the set has no primitive.
    pub fn is_empty(&self) -> bool {
        self.summary.iter().all(|word| *word == 0)
    }

    /// Adds all primitives of another set of the same model.
    ///
    /// Bound by memory: both are read once, less what the summary skips.
    ///
    /// # Panics
    ///
    /// When the other set is one of a model with another number of primitives.
    pub fn union_with(&mut self, other: &Self) {
        self.assert_same_model(other);
        let blocks = self.words.chunks_mut(BITS).zip(other.words.chunks(BITS));
        let summaries = self.summary.iter_mut().zip(&other.summary);
        for ((mine, theirs), (summary, their_summary)) in blocks.zip(summaries) {
            // Whole blocks without a branch: the words of a block in use are mostly in use.
            if *their_summary != 0 {
                for (mine, theirs) in mine.iter_mut().zip(theirs) {
                    *mine |= theirs;
                }
                *summary |= their_summary;
            }
        }
    }

    /// Number of this set's primitives that another set of the same model lacks.
    ///
    /// # Panics
    ///
    /// When the other set is one of a model with another number of primitives.
    pub fn count_missing_in(&self, other: &Self) -> u32 {
        self.assert_same_model(other);
        let words = self.words.iter().zip(&other.words);
        words
            .map(|(mine, theirs)| (mine & !theirs).count_ones())
            .sum()
    }

    /// The primitives of the set, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.nonzero_words()
            .flat_map(|word| bits(self.words[word]).map(move |bit| (word * BITS + bit) as u32))
    }

    /// The primitives of the set as the fewest ranges: ascending, none empty, none that touch.
    pub fn ranges(&self) -> Vec<Range<u32>> {
        let mut ranges: Vec<Range<u32>> = Vec::new();
        for at in self.nonzero_words() {
            let (mut word, mut start) = (self.words[at], (at * BITS) as u32);
            while word != 0 {
                let skipped = word.trailing_zeros();
                word >>= skipped;
                let run = word.trailing_ones();
                word = word.checked_shr(run).unwrap_or(0);
                start += skipped;
                match ranges.last_mut() {
                    Some(last) if last.end == start => last.end += run,
                    _ => ranges.push(start..start + run),
                }
                start += run;
            }
        }
        ranges
    }

    /// Indices of the words that are not zero, ascending.
    fn nonzero_words(&self) -> impl Iterator<Item = usize> {
        let summary = self.summary.iter().enumerate();
        summary.flat_map(|(block, &word)| bits(word).map(move |bit| block * BITS + bit))
    }

    fn assert_same_model(&self, other: &Self) {
        assert!(
            self.primitives == other.primitives,
            "sets of models with {} and {} primitives do not mix",
            self.primitives,
            other.primitives
        );
    }
}

/// Indices of the bits that are set, ascending.
fn bits(word: u64) -> impl Iterator<Item = usize> {
    let rest = |word: &u64| Some(word & (word - 1)).filter(|rest| *rest != 0);
    let first = Some(word).filter(|word| *word != 0);
    std::iter::successors(first, rest).map(|word| word.trailing_zeros() as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::{btree_set, vec};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Models from none over the borders of words and blocks to a few blocks, and two sets of
    /// their primitives: few, many, runs, and nearly all.
    fn sets() -> impl Strategy<Value = (u32, [BTreeSet<u32>; 2])> {
        let sizes = prop_oneof![0..3u32, 63..66u32, 4095..4098u32, 0..20_000u32];
        sizes.prop_flat_map(|primitives| {
            let ids = move || match primitives {
                0 => Just(BTreeSet::new()).boxed(),
                _ => {
                    let some = btree_set(0..primitives, 0..50);
                    let run = move |ranges: Vec<(u32, u32)>| {
                        let run = |(at, len): (u32, u32)| at..(at + len).min(primitives);
                        ranges.into_iter().flat_map(run).collect()
                    };
                    let runs = vec((0..primitives, 0..300u32), 0..9).prop_map(run);
                    let most = some.clone().prop_map(move |holes: BTreeSet<u32>| {
                        (0..primitives).filter(|id| !holes.contains(id)).collect()
                    });
                    prop_oneof![some, runs, most].boxed()
                }
            };
            (Just(primitives), [ids(), ids()])
        })
    }

    fn bitfield(primitives: u32, ids: &BTreeSet<u32>) -> Bitfield {
        Bitfield::from_ids(primitives, &ids.iter().copied().collect::<Vec<_>>())
    }

    /// Whether the summary tells of exactly the words that are not zero.
    fn check_summary(set: &Bitfield) -> bool {
        let told = |word: usize| set.summary[word / BITS] >> (word % BITS) & 1 != 0;
        let mut words = set.words.iter().enumerate();
        words.all(|(i, word)| (*word != 0) == told(i))
    }

    proptest! {
        /// A set holds what was put in, each once and in order, however it is asked.
        #[test]
        fn a_set_holds_what_was_put_in((primitives, [ids, other]) in sets()) {
            let set = bitfield(primitives, &ids);
            prop_assert!(check_summary(&set));
            prop_assert_eq!(set.iter().collect::<Vec<_>>(), Vec::from_iter(ids.iter().copied()));
            prop_assert_eq!(set.len() as usize, ids.len());
            prop_assert_eq!(set.is_empty(), ids.is_empty());
            prop_assert!((0..primitives + 70).all(|id| set.contains(id) == ids.contains(&id)));
            let missing = ids.difference(&other).count();
            prop_assert_eq!(set.count_missing_in(&bitfield(primitives, &other)) as usize, missing);
        }

        /// A union holds both sets and nothing else: it is monotone.
        #[test]
        fn a_union_holds_both_and_nothing_else((primitives, [a, b]) in sets()) {
            let mut union = bitfield(primitives, &a);
            union.union_with(&bitfield(primitives, &b));
            prop_assert!(check_summary(&union));
            prop_assert_eq!(&union, &bitfield(primitives, &a.union(&b).copied().collect()));
            prop_assert_eq!(bitfield(primitives, &a).count_missing_in(&union), 0);
        }

        /// The ranges hold exactly the set's primitives, ascending, and none could be joined.
        #[test]
        fn ranges_are_the_set((primitives, [ids, _]) in sets()) {
            let set = bitfield(primitives, &ids);
            let ranges = set.ranges();
            prop_assert!(ranges.iter().all(|range| !range.is_empty()));
            prop_assert!(ranges.windows(2).all(|pair| pair[0].end < pair[1].start));
            prop_assert!(ranges.iter().cloned().flatten().eq(ids));
            prop_assert_eq!(Bitfield::from_ranges(primitives, &ranges), set);
        }
    }

    #[test]
    fn nothing_is_no_primitive() {
        let set = Bitfield::from_ids(3, &[u32::MAX, 2, 2, u32::MAX, 0]);
        assert_eq!(set.ranges(), [0..1, 2..3]);
    }

    #[test]
    #[should_panic(expected = "primitive 3 is none of the model's 3")]
    fn a_foreign_id_panics() {
        Bitfield::from_ids(3, &[3]);
    }
}
