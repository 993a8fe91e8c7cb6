//! What rectangles cost.

use farfield_grid::Rect;

/// What a texture and its quads weigh; `cover` looks for the rectangles of least weight.
///
/// Only the ratio of the two decides which rectangles are best: a quad is worth
/// `bytes_per_quad / bytes_per_texel` texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Price {
    /// Bytes of a quad's geometry, finite and at least 0. More than it really weighs asks for
    /// fewer quads and more texels, less for more quads and fewer texels.
    /// Default 104: four vertices of five and six indices, 4 bytes each.
    pub bytes_per_quad: f64,
    /// Bytes of a texel, finite and above 0. Default 4: uncompressed RGBA.
    pub bytes_per_texel: f64,
}

impl Default for Price {
    fn default() -> Self {
        Self {
            bytes_per_quad: 104.0,
            bytes_per_texel: 4.0,
        }
    }
}

impl Price {
    /// Bytes of `rects`: their texels with gutters and their quads.
    pub fn bytes(&self, rects: &[Rect]) -> f64 {
        self.bytes_per_texel * count_padded_texels(rects) as f64
            + self.bytes_per_quad * rects.len() as f64
    }

    /// What a quad weighs, in texels.
    ///
    /// # Panics
    ///
    /// When a field is out of its range.
    pub(crate) fn texels_per_quad(&self) -> f64 {
        let (quad, texel) = (self.bytes_per_quad, self.bytes_per_texel);
        assert!(
            quad >= 0.0 && quad.is_finite(),
            "{quad} bytes per quad are not finite and at least 0"
        );
        assert!(
            texel > 0.0 && texel.is_finite() && (quad / texel).is_finite(),
            "{texel} bytes per texel are not finite and above 0"
        );
        quad / texel
    }
}

/// Texels of `rects` when each is stored with a gutter of one texel on every side:
/// (width + 2) (height + 2), summed.
pub fn count_padded_texels(rects: &[Rect]) -> u64 {
    rects
        .iter()
        .map(|r| (u64::from(r.width) + 2) * (u64::from(r.height) + 2))
        .sum()
}
