//! Roots of cubic polynomials.

/// The real roots of t^3 + p t + q, by Cardano's formula, or Vieta's where there are three.
pub(crate) fn cubic_roots(p: f64, q: f64) -> [Option<f64>; 3] {
    let discriminant = q * q / 4.0 + p * p * p / 27.0;
    if discriminant >= 0.0 {
        let u = (-q / 2.0 - discriminant.sqrt().copysign(q)).cbrt();
        let root = if u == 0.0 { 0.0 } else { u - p / (3.0 * u) };
        // Two roots that coincide are left out: the polynomial only touches zero there.
        return [Some(root), None, None];
    }
    let m = 2.0 * (-p / 3.0).sqrt();
    let angle = (3.0 * q / (p * m)).clamp(-1.0, 1.0).acos() / 3.0;
    [0.0, 1.0, 2.0].map(|k| Some(m * (angle - k * std::f64::consts::TAU / 3.0).cos()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The roots are roots, and all of them are found.
        #[test]
        fn roots_of_a_cubic_are_found(a in -10.0..10.0f64, b in -10.0..10.0f64) {
            // (t - a) (t - b) (t + a + b) has no square term.
            let c = -a - b;
            let (p, q) = (a * b + b * c + c * a, -a * b * c);
            let found: Vec<_> = cubic_roots(p, q).into_iter().flatten().collect();
            for root in [a, b, c] {
                let apart = [a, b, c].iter().filter(|r| (*r - root).abs() < 0.1).count() == 1;
                // Coefficients of up to 1e4 are rounded to 1e-12; a root moves by that over the
                // product of its distances from the others, at least 0.01.
                let near = found.iter().any(|r| (r - root).abs() < 1e-9);
                prop_assert!(!apart || near, "{root} is not among {found:?}");
            }
        }
    }
}
