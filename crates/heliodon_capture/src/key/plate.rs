//! The screen's colour as a map over the picture: the clean plate.
//!
//! Cells of some 20 pixels hold medians. One plate is made of several frames, so that most of what an actor hides in one is seen in another; each
//! frame then says by how much its own screen is lighter or darker, cell by cell. Cells that no frame shows are filled from around them.

use super::Picture;
use super::pyramid::{Grid, fill};
use super::space::{Rgb, Space, Wedge};
use rayon::prelude::*;

/// Cells along the shorter side of a picture, about.
const CELLS: usize = 32;
/// The smallest cell, in pixels.
const MIN_CELL: usize = 8;
/// The share of a cell's pixels that must look like screen.
const MIN_SHARE: f32 = 0.35;
/// How much of the screen's saturation a pixel must have to look like it.
const MIN_PURITY: f32 = 0.7;
/// How far a pixel's brightness may lie from its cell's median.
const BRIGHTNESS: std::ops::Range<f32> = 0.8..1.25;
/// A cell that is darker than those around it by more is an actor's or his shadow's.
const MIN_GAIN: f32 = 0.82;
/// How much of a new frame's light is taken over at once, and the change of the whole picture above which all of it is.
const FOLLOW: f32 = 0.3;
const JUMP: f32 = 0.12;

/// What tells a screen's pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    pub wedge: Wedge,
    /// The wedge's difference over the sum of components, of the screen itself.
    pub purity: f32,
    /// The sum of its components.
    pub brightness: f32,
}

impl Look {
    pub fn of(screen: Rgb, wedge: Wedge) -> Self {
        let brightness = (screen[0] + screen[1] + screen[2]).max(1e-4);
        Self { wedge, purity: wedge.difference(screen) / brightness, brightness }
    }

    #[inline]
    pub fn is_screen(&self, color: Rgb) -> bool {
        let sum = color[0] + color[1] + color[2];
        sum > 0.08 * self.brightness && self.wedge.difference(color) > MIN_PURITY * self.purity * sum
    }
}

/// A frame's screen, where it shows.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    pub columns: usize,
    pub rows: usize,
    pub colors: Vec<Option<Rgb>>,
}

/// Pixels in a cell's side.
pub(super) fn cell_size(width: usize, height: usize) -> usize {
    (width.min(height) / CELLS).max(MIN_CELL)
}

/// The screen of one frame, cell by cell.
pub(super) fn cells(picture: &Picture<'_>, space: &Space, look: &Look) -> Cells {
    let size = cell_size(picture.width, picture.height);
    let (columns, rows) = (picture.width.div_ceil(size), picture.height.div_ceil(size));
    // every second pixel of large cells is enough for a median
    let step = if size >= 12 { 2 } else { 1 };
    let mut colors = vec![None; columns * rows];
    colors.par_chunks_mut(columns).enumerate().for_each(|(row, out)| {
        let (mut found, mut sums) = (Vec::new(), Vec::new());
        for (column, out) in out.iter_mut().enumerate() {
            found.clear();
            let mut all = 0;
            for y in (row * size..((row + 1) * size).min(picture.height)).step_by(step) {
                let line = &picture.pixels[y * picture.width..][..picture.width];
                for pixel in line[column * size..((column + 1) * size).min(picture.width)].iter().step_by(step) {
                    all += 1;
                    let color = space.of(*pixel);
                    if look.is_screen(color) {
                        found.push(color);
                    }
                }
            }
            if (found.len() as f32) < MIN_SHARE * all as f32 || found.is_empty() {
                continue;
            }
            sums.clear();
            sums.extend(found.iter().map(|c| c[0] + c[1] + c[2]));
            let middle = sums.len() / 2;
            let median = *sums.select_nth_unstable_by(middle, f32::total_cmp).1;
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for color in &found {
                if BRIGHTNESS.contains(&((color[0] + color[1] + color[2]) / median)) {
                    (0..3).for_each(|c| sum[c] += color[c]);
                    count += 1.0;
                }
            }
            if count > 0.0 {
                *out = Some(sum.map(|x| x / count));
            }
        }
    });
    Cells { columns, rows, colors }
}

/// The plate of several frames: of each cell the median of those that show it.
pub(super) fn over_time(frames: &[Cells]) -> Option<Grid> {
    let first = frames.first()?;
    let seen: Vec<(Rgb, f32)> = (0..first.colors.len())
        .map(|k| {
            let mut found: Vec<Rgb> = frames.iter().filter_map(|frame| frame.colors.get(k).copied().flatten()).collect();
            if found.is_empty() {
                return ([0.0; 3], 0.0);
            }
            found.sort_by(|a, b| (a[0] + a[1] + a[2]).total_cmp(&(b[0] + b[1] + b[2])));
            (found[found.len() / 2], 1.0)
        })
        .collect();
    fill(first.columns, first.rows, seen)
}

/// The plate of a film, followed frame by frame.
#[derive(Clone, Debug)]
pub(super) struct Plate {
    size: usize,
    over_time: Grid,
    gains: Option<Grid>,
    /// The screen of the frame that was followed last.
    pub now: Grid,
}

impl Plate {
    pub fn new(over_time: Grid, width: usize, height: usize) -> Self {
        Self { size: cell_size(width, height), now: over_time.clone(), over_time, gains: None }
    }

    /// Takes a frame's light over; the share of cells that showed screen.
    pub fn follow(&mut self, cells: &Cells) -> f32 {
        let plate = &self.over_time;
        let gain = |k: usize| -> Option<Rgb> {
            let color = cells.colors[k]?;
            Some(std::array::from_fn(|c| (color[c] / plate.colors[k][c].max(2e-3)).clamp(0.1, 8.0)))
        };
        let gains: Vec<Option<Rgb>> = (0..cells.colors.len()).map(gain).collect();
        let trusted: Vec<(Rgb, f32)> = (0..gains.len())
            .map(|k| match gains[k] {
                Some(own) if !is_darker_than_around(&gains, cells.columns, k) => (own, 1.0),
                _ => ([0.0; 3], 0.0),
            })
            .collect();
        let shown = trusted.iter().filter(|cell| cell.1 > 0.0).count() as f32 / trusted.len().max(1) as f32;
        // hardly any screen: what was goes on
        if shown > 0.02
            && let Some(new) = fill(cells.columns, cells.rows, trusted)
        {
            let mean =
                |grid: &Grid| grid.colors.iter().map(|c| c[0] + c[1] + c[2]).sum::<f32>() / (3 * grid.colors.len()) as f32;
            self.gains = Some(match self.gains.take() {
                Some(old) if (mean(&new) / mean(&old) - 1.0).abs() < JUMP => {
                    let colors = old.colors.iter().zip(&new.colors);
                    Grid { colors: colors.map(|(&old, &new)| super::space::lerp(old, new, FOLLOW)).collect(), ..old }
                }
                _ => new,
            });
        }
        if let Some(gains) = &self.gains {
            let smooth = smoothed(gains);
            let colors = plate.colors.iter().zip(&smooth.colors);
            self.now.colors = colors.map(|(color, gain)| std::array::from_fn(|c| color[c] * gain[c])).collect();
        }
        shown
    }

    /// The screen's colour behind a pixel.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> Rgb {
        let scale = 1.0 / self.size as f32;
        self.now.at((x as f32 + 0.5) * scale, (y as f32 + 0.5) * scale)
    }
}

/// Whether a cell's gain lies far below the median of those around it.
fn is_darker_than_around(gains: &[Option<Rgb>], columns: usize, k: usize) -> bool {
    let rows = gains.len() / columns;
    let (x, y) = (k % columns, k / columns);
    let mut around = [0.0_f32; 49];
    let mut count = 0;
    for other_y in y.saturating_sub(3)..(y + 4).min(rows) {
        for other_x in x.saturating_sub(3)..(x + 4).min(columns) {
            if let Some(gain) = gains[other_y * columns + other_x] {
                around[count] = gain[0] + gain[1] + gain[2];
                count += 1;
            }
        }
    }
    let around = &mut around[..count];
    around.sort_unstable_by(f32::total_cmp);
    // the upper third, for of the cells beside an actor most may be darkened by him
    let usual = around.get(count * 2 / 3).copied().unwrap_or(0.0);
    gains[k].is_some_and(|own| own[0] + own[1] + own[2] < MIN_GAIN * usual)
}

/// The mean of 3 x 3 cells.
fn smoothed(grid: &Grid) -> Grid {
    let colors = (0..grid.colors.len())
        .map(|k| {
            let (x, y) = (k % grid.columns, k / grid.columns);
            let (mut sum, mut count) = ([0.0; 3], 0.0);
            for other_y in y.saturating_sub(1)..(y + 2).min(grid.rows) {
                for other_x in x.saturating_sub(1)..(x + 2).min(grid.columns) {
                    let color = grid.colors[other_y * grid.columns + other_x];
                    (0..3).for_each(|c| sum[c] += color[c]);
                    count += 1.0;
                }
            }
            sum.map(|x| x / count)
        })
        .collect();
    Grid { colors, ..*grid }
}
