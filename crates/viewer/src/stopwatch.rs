//! How long drawing takes.

use std::collections::VecDeque;

/// The median of so many pictures.
const PICTURES: usize = 9;

/// Times of one side's pictures.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stopwatch {
    times: VecDeque<f64>,
    /// Whether the first time was told: textures are still on their way while the first picture is drawn.
    is_warm: bool,
}

impl Stopwatch {
    /// Notes what a picture took.
    pub(crate) fn add(&mut self, milliseconds: f64) {
        if !self.is_warm {
            self.is_warm = true;
            return;
        }
        self.times.push_back(milliseconds);
        if self.times.len() > PICTURES {
            self.times.pop_front();
        }
    }

    /// The median of the last times; `None` where there are none.
    pub(crate) fn milliseconds(&self) -> Option<f64> {
        let mut ascending: Vec<f64> = self.times.iter().copied().collect();
        ascending.sort_by(f64::total_cmp);
        ascending.get(ascending.len() / 2).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first time does not count, an outlier does not matter, and old times are forgotten.
    #[test]
    fn times_are_medians_of_the_last() {
        let mut stopwatch = Stopwatch::default();
        stopwatch.add(99.0);
        assert_eq!(stopwatch.milliseconds(), None);
        [1.0, 3.0, 50.0]
            .iter()
            .for_each(|time| stopwatch.add(*time));
        assert_eq!(stopwatch.milliseconds(), Some(3.0));
        (0..PICTURES).for_each(|_| stopwatch.add(7.0));
        assert_eq!(stopwatch.milliseconds(), Some(7.0));
    }
}
