//! How a texture goes on outside of its image.

/// How a texture goes on outside of its image, along one side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TextureWrap {
    /// Again and again.
    #[default]
    Repeat,
    /// Again and again, every other one mirrored.
    Mirror,
    /// The last pixel.
    Clamp,
}

impl TextureWrap {
    /// The two of `count` texels on either side of a coordinate, and how far towards the second it lies, in [0, 1]. A coordinate that is
    /// not finite counts as 0. Exact for counts below 2^24.
    ///
    /// # Panics
    /// May panic where `count` is 0.
    #[must_use]
    #[inline]
    pub fn taps(self, coordinate: f32, count: u32) -> (u32, u32, f32) {
        let size = count as f32;
        let inside = if coordinate.is_finite() { coordinate } else { 0.0 };
        let at = match self {
            Self::Repeat => inside - inside.floor(),
            Self::Mirror => 1.0 - ((inside * 0.5 - (inside * 0.5).floor()) * 2.0 - 1.0).abs(),
            Self::Clamp => inside.clamp(0.0, 1.0),
        } * size
            - 0.5;
        // at lies in [-0.5, count - 0.5], so low in [-1, count - 1]
        let low = at.floor();
        let last = size - 1.0;
        let (first, second) = match self {
            Self::Repeat => (if low < 0.0 { last } else { low.min(last) }, if low + 1.0 > last { 0.0 } else { low + 1.0 }),
            Self::Mirror | Self::Clamp => (low.clamp(0.0, last), (low + 1.0).clamp(0.0, last)),
        };
        (first as u32, second as u32, at - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The texel nearest to a coordinate, of four.
    fn nearest(wrap: TextureWrap, coordinate: f32) -> u32 {
        let (first, second, part) = wrap.taps(coordinate, 4);
        if part < 0.5 { first } else { second }
    }

    #[test]
    fn beyond_its_edge_a_texture_goes_on_as_it_says() {
        for (coordinate, repeat, mirror, clamp) in
            [(0.13, 0, 0, 0), (1.13, 0, 3, 3), (1.88, 3, 0, 3), (2.13, 0, 0, 3), (-0.13, 3, 0, 0), (-1.13, 3, 3, 0)]
        {
            let found = [TextureWrap::Repeat, TextureWrap::Mirror, TextureWrap::Clamp].map(|wrap| nearest(wrap, coordinate));
            assert_eq!(found, [repeat, mirror, clamp], "{coordinate}");
        }
    }

    #[test]
    fn edges_are_blended_with_what_lies_beyond() {
        assert_eq!(TextureWrap::Repeat.taps(0.0, 4), (3, 0, 0.5));
        assert_eq!(TextureWrap::Clamp.taps(0.0, 4), (0, 0, 0.5));
        assert_eq!(TextureWrap::Mirror.taps(1.0, 4), (3, 3, 0.5));
        assert_eq!(TextureWrap::Repeat.taps(f32::NAN, 4), TextureWrap::Repeat.taps(0.0, 4));
    }
}
