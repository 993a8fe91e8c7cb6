//! What is shown of original and impostor.

/// What is shown of original and impostor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ViewMode {
    /// The original alone.
    Original,
    /// The impostor alone.
    Impostor,
    /// The original on the left, the impostor on the right.
    Split,
    /// One after the other.
    Flicker,
    /// How much they differ, amplified.
    Difference,
}

impl ViewMode {
    /// As the command line, the page's address and the window call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Original => "original",
            Self::Impostor => "impostor",
            Self::Split => "split",
            Self::Flicker => "flicker",
            Self::Difference => "difference",
        }
    }
}

/// Width and height of a picture in pixels, written as 800x600.
///
/// # Errors
///
/// When that is not what is written, or a side is 0 or more than 16384.
pub fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x');
    let sides = sides.and_then(|(width, height)| Some([width.parse().ok()?, height.parse().ok()?]));
    let sides: [u32; 2] = sides.ok_or("a size is WIDTHxHEIGHT in pixels, such as 800x600")?;
    match sides.iter().all(|side| (1..=16384).contains(side)) {
        true => Ok(sides),
        false => Err("a picture has 1 to 16384 pixels along each side".into()),
    }
}
