//! What streets are called.

use crate::dice::Dice;

const FIRST: [&str; 40] = [
    "Mill", "Bridge", "Castle", "Church", "Market", "Linden", "Baker", "Cooper", "Tanner",
    "Weaver", "Potter", "Smith", "Abbey", "Fountain", "Garden", "Orchard", "Hill", "Tower", "Bell",
    "Crown", "Swan", "Rose", "Lion", "Eagle", "Bear", "Star", "Salt", "Wine", "Corn", "Hay",
    "Wool", "Butter", "Fisher", "Mason", "Tinker", "Saddler", "Chandler", "Friar", "Raven",
    "Juniper",
];
const SECOND: [&str; 6] = ["Street", "Lane", "Row", "Alley", "Gate", "Walk"];

/// The name of street number `index`; no two below 240 are alike.
pub(crate) fn street(seed: u32, index: usize) -> String {
    // A walk through all pairs from a random one: 7 and 40 share no divisor.
    let mut dice = Dice::new(seed, 3);
    let first = (dice.below(FIRST.len()) + 7 * index) % FIRST.len();
    let second = (dice.below(SECOND.len()) + index + index / FIRST.len()) % SECOND.len();
    format!("{} {}", FIRST[first], SECOND[second])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_two_of_the_first_240_streets_are_alike() {
        for seed in 0..20 {
            let names: BTreeSet<String> = (0..240).map(|i| street(seed, i)).collect();
            assert_eq!(names.len(), 240);
        }
    }
}
