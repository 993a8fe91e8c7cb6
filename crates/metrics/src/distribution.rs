//! Many values in little memory: count, mean, greatest and percentiles.

use hdrhistogram::Histogram;

/// A summary of non-negative values, of bounded size (58 KiB), that can be joined with others.
///
/// Count and maximum are exact; percentiles are at most 1 % too large (or 1e-12, whichever is
/// more) and never too small; the mean is a sum of f64, over the count. Joining summaries in
/// another order changes nothing but the mean's last digits.
///
/// Percentiles come from buckets whose width follows the value (G. Tene's HdrHistogram). Beyond
/// 4 million values share one bucket: a percentile that lies there is told as the maximum.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution {
    buckets: Histogram<u64>,
    sum: f64,
    max: f64,
}

/// Buckets count in these units, so that 1 % holds from 2e-10 on.
const UNITS: f64 = (1u64 << 40) as f64;

/// The last bucket, in units.
const LAST: u64 = 1 << 62;

impl Default for Distribution {
    /// Nothing recorded.
    fn default() -> Self {
        Self {
            // Two digits are buckets of at most 1/128 of their value.
            buckets: Histogram::new_with_bounds(1, LAST, 2)
                .expect("2^62 units and two digits fit in 63 bits"),
            sum: 0.0,
            max: 0.0,
        }
    }
}

impl Distribution {
    /// Adds a value.
    ///
    /// # Panics
    ///
    /// When the value is negative, infinite or NaN.
    pub fn record(&mut self, value: f64) {
        self.record_many(value, 1);
    }

    /// Adds a value `count` times.
    ///
    /// # Panics
    ///
    /// When the value is negative, infinite or NaN.
    pub fn record_many(&mut self, value: f64, count: u64) {
        assert!(
            value.is_finite() && value >= 0.0,
            "{value} is not a non-negative finite number"
        );
        if count > 0 {
            // A float too large for an integer becomes the greatest integer.
            let units = ((value * UNITS).ceil() as u64).min(LAST);
            self.buckets.saturating_record_n(units, count);
            self.sum += value * count as f64;
            self.max = self.max.max(value);
        }
    }

    /// Adds all values of another summary.
    pub fn merge(&mut self, other: &Self) {
        self.buckets += &other.buckets;
        self.sum += other.sum;
        self.max = self.max.max(other.max);
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.buckets.len()
    }

    /// Mean value; 0 of none.
    pub fn mean(&self) -> f64 {
        self.sum / self.count().max(1) as f64
    }

    /// Greatest value; 0 of none.
    pub fn max(&self) -> f64 {
        self.max
    }

    /// The least value that at least `share` of all values do not exceed, rounded up by at most
    /// 1 %; 0 of none.
    ///
    /// * `share` - in [0, 1]: 0.5 is the median, 1 the maximum
    ///
    /// # Panics
    ///
    /// When `share` is not in [0, 1].
    pub fn percentile(&self, share: f64) -> f64 {
        assert!(
            (0.0..=1.0).contains(&share),
            "a share of {share} is not in [0, 1]"
        );
        if self.count() == 0 {
            return 0.0;
        }
        // Asked for the quantile 0, the histogram would answer with a bucket's lower end.
        let units = self.buckets.value_at_quantile(share.max(f64::MIN_POSITIVE));
        match units >= LAST {
            true => self.max,
            false => (units as f64 / UNITS).min(self.max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn values() -> impl Strategy<Value = Vec<f64>> {
        let value = prop_oneof![
            Just(0.0),
            Just(1.0),
            0.0..1.0f64,
            (-13.0..12.0f64).prop_map(|exponent| 10f64.powf(exponent)),
            Just(f64::MIN_POSITIVE),
        ];
        prop::collection::vec(value, 1..200)
    }

    fn summary(values: &[f64]) -> Distribution {
        let mut summary = Distribution::default();
        values.iter().for_each(|value| summary.record(*value));
        summary
    }

    proptest! {
        /// A percentile is never below the one found by sorting, and at most 1 % or 1e-12 above
        /// it, except that it is the maximum where the true one exceeds four million.
        #[test]
        fn percentiles_are_those_of_the_sorted_values(values in values(), share in 0.0..=1.0f64) {
            let summary = summary(&values);
            let mut sorted = values;
            sorted.sort_by(f64::total_cmp);
            for share in [share, 0.0, 0.5, 0.95, 0.999, 1.0] {
                let rank = (share * sorted.len() as f64).ceil().max(1.0) as usize;
                let expected = sorted[rank - 1];
                let found = summary.percentile(share);
                prop_assert!(found >= expected, "{found} is below {expected}");
                if expected < 4e6 {
                    prop_assert!(found <= (expected * 1.01).max(expected + 1e-12),
                        "{found} is above {expected}");
                } else {
                    prop_assert!(found <= summary.max());
                }
            }
            prop_assert_eq!(summary.max(), *sorted.last().unwrap());
            prop_assert_eq!(summary.percentile(1.0), summary.max());
        }

        /// However values are shared among summaries and in whichever order these are joined,
        /// everything but the mean is the same, and the mean is to rounding.
        #[test]
        fn joining_in_any_order_gives_the_same(values in values(), parts in 1..5usize) {
            let all = summary(&values);
            let parts: Vec<Distribution> = values.chunks(values.len().div_ceil(parts))
                .map(summary).collect();
            for backwards in [false, true] {
                let mut joined = Distribution::default();
                match backwards {
                    false => parts.iter().for_each(|part| joined.merge(part)),
                    true => parts.iter().rev().for_each(|part| joined.merge(part)),
                }
                prop_assert_eq!(&joined.buckets, &all.buckets);
                prop_assert_eq!(joined.max(), all.max());
                // 200 additions, each rounded to 2^-53 of at most the sum.
                prop_assert!((joined.mean() - all.mean()).abs() <= 200.0 * 2f64.powi(-53) * all.mean());
            }
        }

        /// A value recorded many times counts as often.
        #[test]
        fn recording_many_is_recording_often(value in 0.0..9.0f64, count in 0..50u64) {
            let mut many = Distribution::default();
            many.record_many(value, count);
            let often = summary(&vec![value; count as usize]);
            prop_assert_eq!(&many.buckets, &often.buckets);
            prop_assert!((many.mean() - often.mean()).abs() <= 50.0 * 2f64.powi(-53) * value);
        }
    }

    #[test]
    fn nothing_recorded_is_zero() {
        let nothing = Distribution::default();
        let figures = [nothing.mean(), nothing.max(), nothing.percentile(0.5)];
        assert_eq!((nothing.count(), figures), (0, [0.0; 3]));
    }

    #[test]
    #[should_panic(expected = "NaN is not a non-negative finite number")]
    fn nan_is_refused() {
        Distribution::default().record(f64::NAN);
    }
}
