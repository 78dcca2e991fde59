//! What is left of the screen's colour in what remains.

use super::space::{Rgb, Wedge, dot};
use super::{Screen, ScreenKind};

/// Takes a screen's light off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spill {
    wedge: Wedge,
    /// How much is taken off.
    amount: f32,
    /// How much grey replaces it.
    grey: f32,
    /// The component that may not be the largest, and the two others.
    limited: Option<[usize; 3]>,
}

/// Weights of red, green and blue in brightness, for what replaces spill.
const BRIGHTNESS: Rgb = [0.2126, 0.7152, 0.0722];

/// The part of a screen's largest component from which green counts as much as that.
const NEARLY: f32 = 0.85;

impl Spill {
    pub fn new(screen: &Screen, wedge: Wedge, amount: f32, grey: f32) -> Self {
        let limited = match screen.kind {
            ScreenKind::Blue => Some([2, 0, 1]),
            ScreenKind::Green => Some([1, 0, 2]),
            // before a yellow wall green is no more than it should be, either: what a codec leaves of its colour has its red and its green apart
            ScreenKind::Other if f32::from(screen.color[1]) >= NEARLY * f32::from(screen.color[0].max(screen.color[2])) => {
                Some([1, 0, 2])
            }
            ScreenKind::Other => None,
        };
        Self { wedge, amount, grey, limited }
    }

    /// A premultiplied colour without it; `screen` is the screen's colour behind it.
    #[inline]
    pub fn removed(&self, mut color: Rgb, screen: Rgb) -> Rgb {
        let (own, full) = (self.wedge.difference(color), self.wedge.difference(screen));
        if own > 0.0 && full > 0.0 {
            let share = self.amount * (own / full).min(1.0);
            let grey = dot(screen, BRIGHTNESS) * self.grey;
            color = std::array::from_fn(|c| (color[c] - share * (screen[c] - grey)).max(0.0));
        }
        if let Some([limited, a, b]) = self.limited {
            let most = color[a].max(color[b]);
            if color[limited] > most {
                color[limited] += self.amount * (most - color[limited]);
            }
        }
        color
    }
}
