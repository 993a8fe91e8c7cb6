//! What keys do. The help is made of the same table.

use eframe::egui::Key;
use glam::DVec3;
use xtask::ViewMode;

/// What a key does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Action {
    /// Shows this of original and impostor.
    Mode(ViewMode),
    /// Moves the border of the split, as a share of the picture's width.
    Split(f64),
    /// Multiplies how much differences are amplified.
    Gain(f32),
    /// Leaves the view space, or returns to it.
    Leave,
    /// Looks at the centre.
    Target,
    /// Draws the view cell, or not.
    Cell,
    /// As many pixels as promised, or the window's own.
    Native,
    /// Goes to the reference viewpoint.
    Reference,
    /// Goes to the worst viewpoint of the rank that the key's place among its keys tells.
    Worst,
    /// Goes so many viewpoints on.
    Step(i64),
    /// Saves the picture.
    Save,
    /// Hides all but the picture, or shows it.
    Panel,
    /// Shows the help, or hides it.
    Help,
}

/// A line of the table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Binding {
    pub(crate) keys: &'static [Key],
    /// What the keys are called.
    pub(crate) name: &'static str,
    /// What they do.
    pub(crate) say: &'static str,
    pub(crate) action: Action,
}

const fn binding(
    keys: &'static [Key],
    name: &'static str,
    say: &'static str,
    action: Action,
) -> Binding {
    Binding {
        keys,
        name,
        say,
        action,
    }
}

/// Keys by what is written on them.
pub(crate) const BINDINGS: [Binding; 20] = [
    binding(&[Key::O], "O", "original", Action::Mode(ViewMode::Original)),
    binding(&[Key::I], "I", "impostor", Action::Mode(ViewMode::Impostor)),
    binding(
        &[Key::P],
        "P",
        "split screen: original left, impostor right",
        Action::Mode(ViewMode::Split),
    ),
    binding(
        &[Key::F],
        "F",
        "flicker between both",
        Action::Mode(ViewMode::Flicker),
    ),
    binding(
        &[Key::M],
        "M",
        "difference of both",
        Action::Mode(ViewMode::Difference),
    ),
    binding(
        &[Key::Comma],
        ",",
        "moves the border of the split to the left",
        Action::Split(-0.02),
    ),
    binding(
        &[Key::Period],
        ".",
        "moves it to the right",
        Action::Split(0.02),
    ),
    binding(
        &[Key::Minus],
        "-",
        "halves how much differences are amplified",
        Action::Gain(0.5),
    ),
    binding(
        &[Key::Plus, Key::Equals],
        "+",
        "doubles it",
        Action::Gain(2.0),
    ),
    binding(
        &[Key::L],
        "L",
        "leaves the view cell, or returns to it",
        Action::Leave,
    ),
    binding(&[Key::T], "T", "looks at the centre again", Action::Target),
    binding(&[Key::C], "C", "draws the view cell, or not", Action::Cell),
    binding(
        &[Key::R],
        "R",
        "as many pixels as promised, or the window's own",
        Action::Native,
    ),
    binding(&[Key::Num0], "0", "reference viewpoint", Action::Reference),
    binding(
        &[
            Key::Num1,
            Key::Num2,
            Key::Num3,
            Key::Num4,
            Key::Num5,
            Key::Num6,
            Key::Num7,
            Key::Num8,
            Key::Num9,
        ],
        "1 – 9",
        "worst views, the worst first",
        Action::Worst,
    ),
    // Brackets need AltGr on many keyboards.
    binding(
        &[Key::OpenBracket, Key::B],
        "[ B",
        "viewpoint before",
        Action::Step(-1),
    ),
    binding(
        &[Key::CloseBracket, Key::N],
        "] N",
        "next viewpoint",
        Action::Step(1),
    ),
    binding(&[Key::K], "K", "saves the picture", Action::Save),
    binding(
        &[Key::X],
        "X",
        "hides all but the picture, or shows it",
        Action::Panel,
    ),
    binding(&[Key::H, Key::Questionmark], "H", "this help", Action::Help),
];

/// Keys that move while they are held, by where they are on the keyboard: right, up, forward.
const MOVES: [(Key, [f64; 3]); 12] = [
    (Key::W, [0.0, 0.0, 1.0]),
    (Key::S, [0.0, 0.0, -1.0]),
    (Key::A, [-1.0, 0.0, 0.0]),
    (Key::D, [1.0, 0.0, 0.0]),
    (Key::E, [0.0, 1.0, 0.0]),
    (Key::Q, [0.0, -1.0, 0.0]),
    (Key::ArrowUp, [0.0, 0.0, 1.0]),
    (Key::ArrowDown, [0.0, 0.0, -1.0]),
    (Key::ArrowLeft, [-1.0, 0.0, 0.0]),
    (Key::ArrowRight, [1.0, 0.0, 0.0]),
    (Key::PageUp, [0.0, 1.0, 0.0]),
    (Key::PageDown, [0.0, -1.0, 0.0]),
];

/// What else moves the viewer, for the help.
pub(crate) const FLYING: [(&str, &str); 3] = [
    ("W A S D", "fly, or the arrow keys; with Shift faster"),
    ("E Q", "up and down"),
    ("mouse", "drag to look elsewhere; the wheel flies on"),
];

/// What a key does, and its place among the keys that do so.
pub(crate) fn action_of(key: Key) -> Option<(Action, usize)> {
    BINDINGS.iter().find_map(|binding| {
        let place = binding.keys.iter().position(|one| *one == key)?;
        Some((binding.action, place))
    })
}

/// Whether a key goes on doing something while it is held.
pub(crate) fn repeats(action: Action) -> bool {
    matches!(action, Action::Split(_) | Action::Gain(_) | Action::Step(_))
}

/// Whether a key moves the viewer while it is held.
pub(crate) fn moves(key: Key) -> bool {
    MOVES.iter().any(|(one, _)| *one == key)
}

/// Moves of the keys that are held, added up: right, up, forward.
pub(crate) fn movement(held: impl Iterator<Item = Key>) -> DVec3 {
    let of = |key: Key| MOVES.iter().find(|(one, _)| *one == key);
    held.filter_map(of).map(|(_, by)| DVec3::from(*by)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No key does two things.
    #[test]
    fn keys_are_unique() {
        let mut keys: Vec<Key> = BINDINGS.iter().flat_map(|one| one.keys).copied().collect();
        keys.extend(MOVES.map(|(key, _)| key));
        let count = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), count);
    }

    #[test]
    fn worst_views_are_on_number_keys() {
        assert_eq!(action_of(Key::Num1), Some((Action::Worst, 0)));
        assert_eq!(action_of(Key::Num9), Some((Action::Worst, 8)));
        assert_eq!(action_of(Key::Num0), Some((Action::Reference, 0)));
        assert_eq!(action_of(Key::W), None);
    }

    /// Also where a bracket takes a key that is for something else.
    #[test]
    fn viewpoints_are_on_letters_too() {
        let action = |key| action_of(key).map(|(action, _)| action);
        assert_eq!(action(Key::N), action(Key::CloseBracket));
        assert_eq!(action(Key::B), Some(Action::Step(-1)));
    }

    #[test]
    fn opposite_keys_cancel() {
        let held = [Key::W, Key::S, Key::D, Key::ArrowRight, Key::O];
        assert_eq!(movement(held.into_iter()), DVec3::new(2.0, 0.0, 0.0));
    }
}
