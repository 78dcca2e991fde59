//! The lines of a datagram that are read, and what they say of each target.

use super::line::{Line, whole};
use crate::pose::Pose;
use crate::report::{AXES, Buttons, Malformed, NO_ROTATION, Sight};
use crate::rotation;
use glam::Vec3;

/// The most buttons or axes that one flystick is believed to have.
const MAX_CONTROLS: u32 = 256;

/// What one target of a frame says.
pub(super) struct Target {
    pub(super) id: u32,
    pub(super) sight: Sight,
    pub(super) buttons: Option<Buttons>,
    pub(super) axes: [Option<f32>; AXES],
}

/// A kind of targets in a frame.
#[derive(Default)]
pub(super) struct Targets {
    /// Whether the frame has a line of them.
    pub(super) told: bool,
    pub(super) list: Vec<Target>,
}

/// What a datagram says.
#[derive(Default)]
pub(super) struct Frame {
    pub(super) counter: Option<u32>,
    pub(super) bodies: Targets,
    pub(super) flysticks: Targets,
    /// Whether any line is of DTrack.
    pub(super) known: bool,
}

impl Frame {
    /// Reads one more line.
    pub(super) fn line(&mut self, mut line: Line<'_>) -> Result<(), Malformed> {
        let word = line.word();
        match word {
            b"fr" => {
                self.counter = Some(line.count()?);
                line.end()?;
            }
            b"ts" => {
                line.number()?;
                line.end()?;
            }
            b"6dcal" => {
                line.count()?;
                line.end()?;
            }
            b"6d" | b"6di" => self.bodies.read(line, word)?,
            b"6df" | b"6df2" => self.flysticks.read(line, word)?,
            b"3d" | b"6dmt" | b"6dmt2" | b"6dmtr" | b"6dcov" | b"6dj" | b"gl" | b"glcal" => {}
            _ => return Ok(()),
        }
        self.known = true;
        Ok(())
    }
}

impl Targets {
    fn read(&mut self, mut line: Line<'_>, kind: &[u8]) -> Result<(), Malformed> {
        self.told = true;
        // 6df2 counts those that could be there, then those that follow
        let mut targets = line.count()?;
        if kind == b"6df2" {
            targets = line.count()?;
        }
        for _ in 0..targets {
            let target = target(&mut line, kind)?;
            self.list.push(target);
        }
        line.end()
    }
}

fn target(line: &mut Line<'_>, kind: &[u8]) -> Result<Target, Malformed> {
    let place = *line;
    let count = |value: f64| whole(value).map_or_else(|| place.wrong("a whole number from 0 up is wanted"), Ok);
    let head = line.block(match kind {
        b"6d" => &[2],
        b"6df2" => &[4],
        _ => &[3],
    })?;
    let position = line.block(&[3, 6])?;
    let matrix = line.block(&[9])?;
    let seen = if kind == b"6di" { head[1] != 0.0 } else { head[1] >= 0.0 };
    let mut target = Target { id: count(head[0])?, sight: Sight::Lost, buttons: None, axes: [None; AXES] };
    if seen {
        let position = Vec3::from_array([0, 1, 2].map(|i| (position[i] * 0.001) as f32));
        let column = |i: usize| Vec3::from_array([0, 1, 2].map(|row| matrix[3 * i + row] as f32));
        let orientation = rotation::from_columns(column(0), column(1), column(2)).unwrap_or(NO_ROTATION);
        target.sight = Sight::Pose(Pose { position, orientation });
    }
    match kind {
        b"6df" => {
            let bits = count(head[2])?;
            target.buttons = Some(Buttons::all(bits));
            let axis = |less: u32, more: u32| f32::from(bits & more != 0) - f32::from(bits & less != 0);
            target.axes[0] = Some(axis(0x20, 0x80));
            target.axes[1] = Some(axis(0x10, 0x40));
        }
        b"6df2" => {
            let (buttons, axes) = (count(head[2])?, count(head[3])?);
            if buttons > MAX_CONTROLS || axes > MAX_CONTROLS {
                return place.wrong("a flystick has too many buttons or axes");
            }
            let words = buttons.div_ceil(u32::BITS) as usize;
            let controls = line.block(&[words + axes as usize])?;
            let (words, axes) = controls.split_at(words);
            target.buttons = Some(Buttons::all(words.first().map_or(Ok(0), |word| button_word(*word, count))?));
            for (axis, value) in target.axes.iter_mut().zip(axes) {
                *axis = Some(*value as f32);
            }
        }
        _ => {}
    }
    Ok(target)
}

/// Button 31 may be a sign.
fn button_word(word: f64, count: impl Fn(f64) -> Result<u32, Malformed>) -> Result<u32, Malformed> {
    if word >= 0.0 { count(word) } else { count(word + f64::from(u32::MAX) + 1.0) }
}
