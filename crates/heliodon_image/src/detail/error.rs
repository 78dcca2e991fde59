//! What can be wrong with a detail texture.

use super::{MAX_SIDE, MIN_SIDE, NEUTRAL};
use crate::ImageError;

/// Parameters that nothing can be made of, or an image that cannot serve: which, why, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum DetailError {
    /// The file is no image that can be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A parameter lies outside of its range.
    #[error("{parameter} is {value}; give {allowed}")]
    Parameter {
        /// Which.
        parameter: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        allowed: &'static str,
    },
    /// A side is no power of two.
    #[error(
        "{name}: {width} x {height} texels; both sides must be powers of two, so that each mip level halves the one before: scale it to {} x {}",
        nearest_side(*width), nearest_side(*height)
    )]
    NotPowerOfTwo {
        /// The file.
        name: String,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// A side is too short or too long.
    #[error("{name}: {width} x {height} texels; each side must have {MIN_SIDE} to {MAX_SIDE}: {remedy}")]
    Side {
        /// The file.
        name: String,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// What to do about it.
        remedy: &'static str,
    },
    /// All texels are the same.
    #[error("{name}: all texels have the code {code}: there is no detail in it; give an image with a pattern")]
    Constant {
        /// The file.
        name: String,
        /// The code.
        code: u8,
    },
    /// The mean is not 128, and no correction was asked for.
    #[error(
        "{name}: its mean is {mean:.2}, not {NEUTRAL}: surfaces would become {} by {:.1} % where the detail fades in; ask for its correction (--correct), or shift its brightness",
        if *mean > f64::from(NEUTRAL) { "brighter" } else { "darker" },
        (mean / f64::from(NEUTRAL) - 1.0).abs() * 100.0
    )]
    Mean {
        /// The file.
        name: String,
        /// What it is, in codes.
        mean: f64,
    },
    /// The number of pixels is not that of the size.
    #[error("{name}: its pixels are not {width} x {height}; read or export the image again")]
    Broken {
        /// The file.
        name: String,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// The power of two that a side is scaled to with the least change.
fn nearest_side(side: u32) -> u32 {
    let above = side.clamp(MIN_SIDE, MAX_SIDE).next_power_of_two();
    let below = (above / 2).max(MIN_SIDE);
    // nearest by ratio: side^2 against above * below
    if u64::from(side).pow(2) < u64::from(above) * u64::from(below) { below } else { above }
}

/// Refuses sides that are too short, too long, or no powers of two.
pub(super) fn check_sides(name: &str, width: u32, height: u32) -> Result<(), DetailError> {
    let remedy = match (width.min(height), width.max(height)) {
        (shortest, _) if shortest < MIN_SIDE => "lay it side by side with itself until it is that large, or use a larger image",
        (_, longest) if longest > MAX_SIDE => "cut a piece out of it that tiles, or scale it down",
        _ if width.is_power_of_two() && height.is_power_of_two() => return Ok(()),
        _ => return Err(DetailError::NotPowerOfTwo { name: name.into(), width, height }),
    };
    Err(DetailError::Side { name: name.into(), width, height, remedy })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_that_cannot_serve_are_told_with_a_remedy() {
        let told = |width, height| check_sides("a.png", width, height).unwrap_err().to_string();
        assert!(told(300, 90).contains("scale it to 256 x 64"), "{}", told(300, 90));
        assert!(told(100, 1000).contains("scale it to 128 x 1024"), "{}", told(100, 1000));
        assert!(told(8, 64).contains("16 to 2048") && told(0, 0).contains("a.png: 0 x 0"));
        assert!(told(4096, 64).contains("scale it down"));
        assert!(check_sides("a.png", MIN_SIDE, MAX_SIDE).is_ok());
    }
}
