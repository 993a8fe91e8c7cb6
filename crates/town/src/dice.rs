//! Repeatable randomness for shapes and places.

use crate::noise::random;

/// Rolls numbers that depend on nothing but the seed, the name of the dice and how often they were
/// rolled.
#[derive(Clone, Debug)]
pub(crate) struct Dice {
    seed: u32,
    name: i32,
    rolls: i32,
}

impl Dice {
    /// Dice with a name of their own roll unrelated numbers.
    pub(crate) fn new(seed: u32, name: u32) -> Self {
        Self {
            seed,
            name: name as i32,
            rolls: 0,
        }
    }

    /// A number in [0, 1).
    pub(crate) fn roll(&mut self) -> f32 {
        self.rolls += 1;
        random([self.rolls, self.name], self.seed)
    }

    /// A number between two others.
    pub(crate) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.roll()
    }

    /// True with a probability.
    pub(crate) fn chance(&mut self, probability: f32) -> bool {
        self.roll() < probability
    }

    /// A whole number below `count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.roll() * count as f32) as usize
    }

    /// One of several, which must not be none.
    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}
