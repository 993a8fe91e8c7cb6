//! What views that were looked at tell of all views.

/// What is less probable than this does not happen: what is promised of a share of all views holds with the
/// confidence that is left, and is broken where so many views fail.
pub(crate) const IMPROBABLE: f64 = 0.05;

/// The largest share of all views that can be promised to succeed, where `failed` of `views` independent ones
/// did not: if fewer of all did, so few that fail would be improbable. Rounded down to a hundredth of a
/// percent.
pub(crate) fn sure_share(views: u64, failed: u64) -> f64 {
    let so_few = |share: f64| 1.0 - binomial_tail(views, failed + 1, 1.0 - share);
    // It rises with the share.
    let (mut sure, mut unsure) = (0.0, 1.0);
    for _ in 0..50 {
        let middle = f64::midpoint(sure, unsure);
        match so_few(middle) <= IMPROBABLE {
            true => sure = middle,
            false => unsure = middle,
        }
    }
    (sure * 1e4).floor() / 1e4
}

/// The most of `views` independent views that may miss more than is promised, where a share `promised` of
/// all views does not: more would be improbable.
pub(crate) fn most_by_chance(views: u64, promised: f64) -> u64 {
    let share = 1.0 - promised;
    let is_probable = |least| binomial_tail(views, least, share) >= IMPROBABLE;
    // The tail falls with the number. That none or more do is certain.
    let (mut most, mut too_many) = (0, views + 1);
    while too_many - most > 1 {
        let middle = most + (too_many - most) / 2;
        match is_probable(middle) {
            true => most = middle,
            false => too_many = middle,
        }
    }
    most
}

/// The probability that `least` or more of `count` independent trials succeed, each with probability
/// `share`.
///
/// The sum over k, from `least` to `count`, of count! / (k! (count - k)!) share^k (1 - share)^(count - k).
/// Terms are taken as logarithms, as powers of small shares are too small for numbers.
fn binomial_tail(count: u64, least: u64, share: f64) -> f64 {
    if least == 0 {
        return 1.0;
    }
    if least > count || share <= 0.0 {
        return 0.0;
    }
    if share >= 1.0 {
        return 1.0;
    }
    let (success, failure) = (share.ln(), (-share).ln_1p());
    let mut ways = 0.0;
    let mut tail = 0.0;
    for k in 1..=count {
        ways += ((count - k + 1) as f64 / k as f64).ln();
        if k >= least {
            tail += (ways + k as f64 * success + (count - k) as f64 * failure).exp();
        }
    }
    tail.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As by hand.
    #[test]
    fn tails_are_sums_of_terms() {
        for (count, least, share, expected) in [
            (10, 0, 0.3, 1.0),
            (1, 1, 0.05, 0.05),
            // 1 - (3/4)^3 = 37/64.
            (3, 1, 0.25, 37.0 / 64.0),
            // 6 + 4 + 1 of the 16 ways in which four coins fall.
            (4, 2, 0.5, 11.0 / 16.0),
            // 3 (1/10)^2 (9/10) + (1/10)^3.
            (3, 2, 0.1, 0.028),
            (3, 3, 0.1, 0.001),
            (3, 4, 0.1, 0.0),
            (7, 1, 0.0, 0.0),
            (7, 7, 1.0, 1.0),
            // 1 - 0.999^256 - 256 0.001 0.999^255.
            (
                256,
                2,
                0.001,
                1.0 - 0.999f64.powi(256) - 0.256 * 0.999f64.powi(255),
            ),
        ] {
            let found = binomial_tail(count, least, share);
            // A few hundred logarithms, each rounded to 1e-16 of less than 1e3.
            assert!(
                (found - expected).abs() < 1e-10,
                "{count}, {least}, {share}: {found}"
            );
        }
        // Half of all numbers of heads are at least half of the coins, and a bit more.
        let half = binomial_tail(100_000, 50_000, 0.5);
        assert!((0.5..0.502).contains(&half), "{half}");
    }

    /// As tables of Clopper and Pearson's one-sided limits have it.
    #[test]
    fn shares_are_sure() {
        for (views, failed, sure) in [
            // 0.05^(1 / views).
            (3000, 0, 0.999),
            (1000, 0, 0.997),
            (10, 0, 0.7411),
            // 1 - 4.744 / 3000 and, of many views, 1 - 7.754 / views.
            (3000, 1, 0.9984),
            (100_000, 3, 0.9999),
            // 0.3942 and 0.5069 of them.
            (10, 1, 0.6058),
            (10, 2, 0.4930),
            (7, 7, 0.0),
            (0, 0, 0.0),
        ] {
            assert_eq!(sure_share(views, failed), sure, "{failed} of {views}");
        }
        // Who promises so large a share is not found to have broken it by the same views.
        for (views, failed) in [(256, 3), (1000, 20), (3000, 1)] {
            assert!(most_by_chance(views, sure_share(views, failed)) >= failed);
        }
    }

    /// A promise of all views allows none; of a share, what chance may bring, and no view more.
    #[test]
    fn chance_allows_so_many() {
        // 1 - 0.999^256 = 0.23; of two or more 0.028. Of one view 0.05 is the least that is probable.
        for (views, promised, most) in [
            (0, 0.95, 0),
            (256, 1.0, 0),
            (256, 0.999, 1),
            // Sums of 0.057 and 0.034 for 19 and 20.
            (256, 0.95, 19),
            (1, 0.9, 1),
            (1, 0.96, 0),
        ] {
            assert_eq!(most_by_chance(views, promised), most, "{views}, {promised}");
        }
        for (views, promised) in [(24, 0.95), (256, 0.95), (3000, 0.997), (100_000, 0.95)] {
            let most = most_by_chance(views, promised);
            let expected = views as f64 * (1.0 - promised);
            // 1.64 deviations, rounded, and the lopsidedness of few.
            let reach = expected + 1.64 * expected.sqrt() + 1.0;
            assert!(
                most as f64 >= expected && most as f64 <= reach,
                "{views}, {promised}: {most}"
            );
        }
    }
}
