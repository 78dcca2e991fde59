//! How well a texture goes on into itself.

use super::DetailTexture;
use super::mips::BlockSums;

/// What the eye will say of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SeamVerdict {
    /// The step across the edge is like those inside.
    Seamless,
    /// Larger than inside: seen by those who look for it.
    Faint,
    /// Much larger: every tile is seen.
    Visible,
}

impl SeamVerdict {
    /// In one word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Seamless => "seamless",
            Self::Faint => "faint",
            Self::Visible => "visible",
        }
    }
}

/// How steps across the edges compare with those between neighbours inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// The mean step, up or down, from the last column to the first, divided by that inside: about 1 without a seam, from 0 to 1000. The greatest
    /// over the mip levels of 16 texels or more, as coarse levels tell a slow change of brightness from grain.
    pub u: f32,
    /// The same from the last row to the first.
    pub v: f32,
    /// The worse of both.
    pub verdict: SeamVerdict,
}

/// The coarsest level that is looked at: fewer steps say little.
const FEWEST: u32 = 16;
/// What a ratio ends at.
const LARGEST: f64 = 1000.0;

impl DetailTexture {
    /// Compares what lies on either side of the edges with what lies side by side inside.
    ///
    /// A step counts as a seam only where it is greater than at any other place of its direction, so that a joint of masonry
    /// on the edge is none, and greater than the mean by more than chance gives.
    #[must_use]
    pub fn seam(&self) -> Seam {
        let mut seam = Seam { u: 0.0, v: 0.0, verdict: SeamVerdict::Seamless };
        let mut level = Some(BlockSums::of(self));
        while let Some(blocks) = level {
            let (width, height) = (blocks.width as usize, blocks.height as usize);
            if blocks.width.min(blocks.height) < FEWEST {
                break;
            }
            let at = |x: usize, y: usize| u64::from(blocks.sums[y * width + x]);
            let columns = (0..width).map(|x| (0..height).map(|y| at(x, y).abs_diff(at((x + 1) % width, y))).sum()).collect();
            let rows = (0..height).map(|y| (0..width).map(|x| at(x, y).abs_diff(at(x, (y + 1) % height))).sum()).collect();
            let (u, u_verdict) = judge(columns, height);
            let (v, v_verdict) = judge(rows, width);
            seam = Seam { u: seam.u.max(u), v: seam.v.max(v), verdict: seam.verdict.max(u_verdict).max(v_verdict) };
            level = blocks.halved();
        }
        seam
    }
}

/// How the last of some sums of steps compares with the others, and what that means where each is of `count` steps.
///
/// Of steps, not of their squares: one knot that lies across the edge is no seam.
fn judge(steps: Vec<u64>, count: usize) -> (f32, SeamVerdict) {
    let Some((&across, inside)) = steps.split_last() else { return (0.0, SeamVerdict::Seamless) };
    let mean = inside.iter().sum::<u64>() as f64 / inside.len().max(1) as f64;
    if mean <= 0.0 {
        // nothing inside to compare with: any step is beyond measure
        return if across > 0 { (LARGEST as f32, SeamVerdict::Visible) } else { (0.0, SeamVerdict::Seamless) };
    }
    let ratio = (across as f64 / mean).min(LARGEST);
    // The mean size of n independent Gaussian steps varies by 0.76 / sqrt(n) of itself. Steps side by side depend on one another, as if
    // they were a third as many: four deviations are hardly chance. Along a fibre all of them do, which only the spread of the others
    // tells; it is known from few, and far values are common there: six.
    let spread = inside.iter().map(|&s| s as f64 / mean - 1.0).map(|d| d * d).sum::<f64>() / inside.len() as f64;
    let chance = (4.0 * libm::sqrt(3.0 * 0.57 / count as f64)).max(6.0 * libm::sqrt(spread));
    let greatest = inside.iter().copied().max().unwrap_or(0);
    let verdict = match ratio - 1.0 {
        _ if across <= greatest => SeamVerdict::Seamless,
        above if above <= chance => SeamVerdict::Seamless,
        above if above <= 2.0 * chance => SeamVerdict::Faint,
        _ => SeamVerdict::Visible,
    };
    (ratio as f32, verdict)
}
