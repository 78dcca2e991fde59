//! What can keep a film from being keyed.

/// Why nothing can be keyed, and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum KeyError {
    /// A picture without pixels, or whose size is another.
    #[error("a picture of {width} x {height} has {pixels} pixels; read it again")]
    Picture {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// How many there are.
        pixels: usize,
    },
    /// There is no picture at all.
    #[error("there are no pictures to find the screen in; give at least one frame")]
    NoPictures,
    /// Nothing in the pictures has a screen's colour.
    #[error(
        "no {wanted} screen is to be seen: {:.1} % of the pictures have a colour like one; give the colour of what is behind the actor (--screen \"#rrggbb\"), or film before a screen",
        share * 100.0
    )]
    NoScreen {
        /// What was looked for.
        wanted: &'static str,
        /// How much of all pictures looks like it, in [0, 1].
        share: f32,
    },
    /// A colour that is given has no hue.
    #[error("the screen's colour #{:02x}{:02x}{:02x} is nearly grey, and grey cannot be told from what is before it; give the colour of a green or blue screen", color[0], color[1], color[2])]
    GreyScreen {
        /// sRGB codes.
        color: [u8; 3],
    },
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
}
