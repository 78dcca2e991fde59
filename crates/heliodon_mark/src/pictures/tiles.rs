//! Photographs on the screen: tiles of the level that fits the zoom, handed to the graphics card as they come into view.

use super::{Level, Picture, View};
use eframe::egui::{Color32, ColorImage, Context, Painter, Pos2, Rect, TextureFilter, TextureHandle, TextureOptions};
use glam::DVec2;
use std::collections::BTreeMap;

/// A tile's side without its margin: with it, far below what any graphics card takes.
const SIDE: usize = 512;
/// Pixels of its neighbours around a tile, so that it is not seen where it ends.
const MARGIN: usize = 1;
/// Tiles handed over in one frame; others follow in the next.
const MOST_NEW: usize = 12;
/// Tiles held: 256 MB.
const MOST_TILES: usize = 256;
/// Pixels larger than this are shown as the squares that they are.
const SQUARE_FROM_ZOOM: f64 = 2.0;

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    photo: String,
    level: usize,
    column: usize,
    row: usize,
    is_square: bool,
}

struct Tile {
    texture: TextureHandle,
    last_drawn: u64,
}

/// Tiles that the graphics card holds.
#[derive(Default)]
pub struct Tiles {
    tiles: BTreeMap<Key, Tile>,
    frame: u64,
    new: usize,
}

impl Tiles {
    /// To be called once a frame, before anything is drawn.
    pub fn begin_frame(&mut self) {
        self.frame += 1;
        self.new = 0;
        while self.tiles.len() > MOST_TILES {
            let idle = self.tiles.iter().filter(|(_, tile)| tile.last_drawn + 1 < self.frame);
            let Some(oldest) = idle.min_by_key(|(_, tile)| tile.last_drawn).map(|(key, _)| key.clone()) else { return };
            self.tiles.remove(&oldest);
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.tiles.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tiles.is_empty()
    }

    /// Draws what a view shows of a photograph.
    pub fn draw(&mut self, ctx: &Context, painter: &Painter, photo: &str, picture: &Picture, view: &View) {
        let coarsest = picture.levels().len() - 1;
        let level = ((1.0 / view.zoom).log2().floor().max(0.0) as usize).min(coarsest);
        // What is under tiles that are still to come.
        self.draw_level(ctx, painter, photo, picture, view, coarsest);
        if level != coarsest {
            self.draw_level(ctx, painter, photo, picture, view, level);
        }
    }

    fn draw_level(&mut self, ctx: &Context, painter: &Painter, photo: &str, picture: &Picture, view: &View, level: usize) {
        let of = &picture.levels()[level];
        let size = (1u64 << level) as f64;
        let side = SIDE as f64 * size;
        let clip = painter.clip_rect().intersect(view.rect);
        let (from, to) = (view.to_pixel(clip.min), view.to_pixel(clip.max));
        let span = |from: f64, to: f64, pixels: usize| {
            let most = pixels.div_ceil(SIDE);
            let first = (from / side).floor().max(0.0) as usize;
            first..((to / side).ceil().max(0.0) as usize).min(most)
        };
        for row in span(from.y, to.y, of.height) {
            for column in span(from.x, to.x, of.width) {
                let key =
                    Key { photo: photo.to_owned(), level, column, row, is_square: level == 0 && view.zoom >= SQUARE_FROM_ZOOM };
                let Some(tile) = self.tile(ctx, key, of) else {
                    ctx.request_repaint();
                    continue;
                };
                let (left, top) = (column * SIDE, row * SIDE);
                let (right, bottom) = ((left + SIDE).min(of.width), (top + SIDE).min(of.height));
                let place = |x: usize, y: usize| view.to_window(DVec2::new(x as f64, y as f64) * size);
                let [width, height] = tile.size().map(|side| side as f32);
                let margins = [left, top].map(|start| start.min(MARGIN) as f32);
                let uv = Rect::from_min_max(
                    Pos2::new(margins[0] / width, margins[1] / height),
                    Pos2::new((margins[0] + (right - left) as f32) / width, (margins[1] + (bottom - top) as f32) / height),
                );
                painter.image(tile.id(), Rect::from_min_max(place(left, top), place(right, bottom)), uv, Color32::WHITE);
            }
        }
    }

    fn tile(&mut self, ctx: &Context, key: Key, level: &Level) -> Option<&TextureHandle> {
        if !self.tiles.contains_key(&key) {
            if self.new >= MOST_NEW {
                return None;
            }
            self.new += 1;
            let magnification = if key.is_square { TextureFilter::Nearest } else { TextureFilter::Linear };
            let options = TextureOptions { magnification, ..TextureOptions::LINEAR };
            let image = piece(level, key.column * SIDE, key.row * SIDE);
            let texture = ctx.load_texture(format!("{} {}/{}/{}", key.photo, key.level, key.column, key.row), image, options);
            self.tiles.insert(key.clone(), Tile { texture, last_drawn: self.frame });
        }
        let tile = self.tiles.get_mut(&key)?;
        tile.last_drawn = self.frame;
        Some(&tile.texture)
    }
}

/// A tile and its margin.
fn piece(level: &Level, left: usize, top: usize) -> ColorImage {
    let columns = left.saturating_sub(MARGIN)..(left + SIDE + MARGIN).min(level.width);
    let rows = top.saturating_sub(MARGIN)..(top + SIDE + MARGIN).min(level.height);
    let size = [columns.len(), rows.len()];
    let row = |y: usize| level.pixels[y * level.width..][columns.clone()].iter();
    let pixels = rows.flat_map(row).map(|&[r, g, b, a]| Color32::from_rgba_unmultiplied(r, g, b, a)).collect();
    ColorImage::new(size, pixels)
}

/// A photograph's small form as one texture.
pub(crate) fn small_texture(ctx: &Context, photo: &str, level: &Level) -> TextureHandle {
    let pixels = level.pixels.iter().map(|&[r, g, b, a]| Color32::from_rgba_unmultiplied(r, g, b, a)).collect();
    ctx.load_texture(format!("{photo} small"), ColorImage::new([level.width, level.height], pixels), TextureOptions::LINEAR)
}
