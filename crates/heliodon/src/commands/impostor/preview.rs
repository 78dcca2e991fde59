//! The window in which a model is placed in the frames of an impostor, and looked at from every view.

use super::{GROUNDS, over};
use anyhow::Result;
use heliodon_capture::impostor::preview::{Preview, PreviewFrame};
use heliodon_capture::impostor::{CaptureParams, Framing};
use heliodon_image::SrgbImage;
use heliodon_mesh::motion::MovingMesh;
use heliodon_view::easel::{Press, Work, show};
use std::sync::{Arc, Mutex, PoisonError};

/// Of a window that opens, logical pixels.
const WINDOW: (u32, u32) = (1024, 768);
/// What a key or a notch zooms by.
const ZOOM_STEP: f32 = 1.04;
/// From which to which zoom.
const ZOOMS: (f32, f32) = (0.05, 8.0);
/// The frame's border where all is well, and where the model is too near to it.
const WELL: [u8; 4] = [70, 150, 90, 255];
const CUT: [u8; 4] = [225, 50, 40, 255];

/// How a preview ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Capture,
    GiveUp,
}

/// A preview on the easel.
struct Placing {
    preview: Preview,
    view: usize,
    frame: usize,
    plays: bool,
    passed_s: f32,
    ground: usize,
    changed: bool,
    end: Option<End>,
}

/// Lets somebody place the model; none where they gave it up.
///
/// # Errors
/// A model that cannot be captured, or a window that cannot be opened.
pub fn place(model: MovingMesh, name: &str, params: CaptureParams) -> Result<Option<(MovingMesh, CaptureParams)>> {
    let placing = Arc::new(Mutex::new(Placing::new(Preview::new(model, name, params)?)));
    show(&format!("{name} - impostor"), WINDOW, &placing)?;
    let placing = placing.lock().unwrap_or_else(PoisonError::into_inner);
    Ok((placing.end == Some(End::Capture)).then(|| (placing.preview.model().clone(), placing.preview.params().clone())))
}

impl Placing {
    fn new(preview: Preview) -> Self {
        Self { preview, view: 0, frame: 0, plays: false, passed_s: 0.0, ground: 3, changed: true, end: None }
    }

    fn reframe(&mut self, change: impl FnOnce(&mut Framing)) {
        let mut framing = self.preview.params().framing;
        change(&mut framing);
        framing.zoom = framing.zoom.clamp(ZOOMS.0, ZOOMS.1);
        framing.shift = framing.shift.map(|shift| shift.clamp(-1.0, 1.0));
        self.preview.set_framing(framing);
        self.changed = true;
    }

    /// Another view or frame.
    fn step(&mut self, views: i64, frames: i64) {
        let info = self.preview.info();
        let on = |now: usize, by: i64, of: u32| (now as i64 + by).rem_euclid(i64::from(of.max(1))) as usize;
        (self.view, self.frame) = (on(self.view, views, info.views()), on(self.frame, frames, info.frames()));
        self.changed = true;
    }

    /// To the ring above or below, as nearly the same side as it has.
    fn change_ring(&mut self, by: i64) {
        let rings = &self.preview.info().rings;
        let (ring, nth) = self.ring();
        let other = (ring as i64 + by).rem_euclid(rings.len() as i64) as usize;
        let (wanted, first) = (rings[ring].azimuth_deg(nth), rings[..other].iter().map(|ring| ring.views).sum::<u32>());
        let off = |view: u32| {
            let off = (rings[other].azimuth_deg(view) - wanted).rem_euclid(360.0);
            off.min(360.0 - off)
        };
        let nearest = (0..rings[other].views).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(0);
        self.view = (first + nearest) as usize;
        self.changed = true;
    }

    /// The ring of the view, and which of its views it is.
    fn ring(&self) -> (usize, u32) {
        let mut nth = self.view as u32;
        for (number, ring) in self.preview.info().rings.iter().enumerate() {
            if nth < ring.views {
                return (number, nth);
            }
            nth -= ring.views;
        }
        (0, 0)
    }
}

impl Work for Placing {
    fn picture(&mut self) -> Option<SrgbImage> {
        if !std::mem::take(&mut self.changed) {
            return None;
        }
        let border = if self.preview.is_whole() { WELL } else { CUT };
        Some(framed(&self.preview.frame(self.view, self.frame), GROUNDS[self.ground], border))
    }

    fn told(&self) -> String {
        let (info, framing) = (self.preview.info(), self.preview.params().framing);
        let (ring, nth) = self.ring();
        let (nearest, margin) = self.preview.nearest_border();
        let [width, height] = info.frame_px;
        let nearest = nearest + 1;
        let state = match (self.preview.is_whole(), margin < 0.0) {
            (true, _) => format!("{margin:.1} texels to the border, in view {nearest}"),
            (false, true) => format!("CUT by {:.1} texels in view {nearest}", -margin),
            (false, false) => format!("TOO NEAR: {margin:.1} texels to the border in view {nearest}"),
        };
        format!(
            "view {} of {}: {:.0} deg up, {:.0} deg round\nframe {} of {}\n{width} x {height} texels, {:.0} % used\nzoom {:.2}, shift {:.3}, {:.3}\n{state}\n\n\
             Left, Right   views\nUp, Down      rings\n, .           frames\nSpace         plays\n+ - wheel     zoom\nShift+arrows  shift, as the\n              mouse does\n0             fitted\nB             background\nEnter         captures\nEscape        gives up",
            self.view + 1,
            info.views(),
            info.rings[ring].elevation_deg,
            info.rings[ring].azimuth_deg(nth),
            self.frame + 1,
            info.frames(),
            100.0 * self.preview.used(self.view),
            framing.zoom,
            framing.shift[0],
            framing.shift[1],
        )
    }

    fn press(&mut self, key: &Press, shift: bool) {
        let texel = self.preview.info().frame_px.map(|side| 1.0 / side as f32);
        let by = |x: f32, y: f32| {
            move |framing: &mut Framing| {
                framing.shift[0] += x * texel[0];
                framing.shift[1] += y * texel[1];
            }
        };
        match key {
            Press::Left if shift => self.reframe(by(-1.0, 0.0)),
            Press::Right if shift => self.reframe(by(1.0, 0.0)),
            Press::Up if shift => self.reframe(by(0.0, 1.0)),
            Press::Down if shift => self.reframe(by(0.0, -1.0)),
            Press::Left => self.step(-1, 0),
            Press::Right => self.step(1, 0),
            Press::Up => self.change_ring(1),
            Press::Down => self.change_ring(-1),
            Press::Enter if self.preview.is_whole() => self.end = Some(End::Capture),
            Press::Enter => {}
            Press::Escape => self.end = Some(End::GiveUp),
            Press::Sign(sign) => match sign.as_str() {
                "," => self.step(0, -1),
                "." => self.step(0, 1),
                " " => self.plays = !self.plays,
                "+" | "=" => self.turn(1.0),
                "-" => self.turn(-1.0),
                "0" => self.reframe(|framing| *framing = Framing::default()),
                "b" | "B" => {
                    self.ground = (self.ground + 1) % GROUNDS.len();
                    self.changed = true;
                }
                _ => {}
            },
        }
    }

    fn drag(&mut self, by: [f32; 2]) {
        let [width, height] = self.preview.info().frame_px.map(|side| side as f32);
        self.reframe(|framing| {
            framing.shift[0] += by[0] / width;
            framing.shift[1] -= by[1] / height;
        });
    }

    fn turn(&mut self, notches: f32) {
        self.reframe(|framing| framing.zoom *= ZOOM_STEP.powf(notches));
    }

    fn pass(&mut self, seconds: f32) {
        if !self.plays {
            return;
        }
        self.passed_s += seconds;
        let frames = (self.passed_s * self.preview.params().frames_per_s).floor();
        if frames >= 1.0 {
            self.passed_s -= frames / self.preview.params().frames_per_s;
            self.step(0, frames as i64);
        }
    }

    fn is_done(&self) -> bool {
        self.end.is_some()
    }
}

/// A frame over a background, with its border.
fn framed(frame: &PreviewFrame, ground: [f32; 3], border: [u8; 4]) -> SrgbImage {
    let [width, height] = frame.size;
    let mut picture = SrgbImage::filled(width + 2, height + 2, border);
    for (i, &texel) in frame.looks.iter().enumerate() {
        let (x, y) = (i as u32 % width + 1, i as u32 / width + 1);
        picture.pixels[(y * picture.width + x) as usize] = over(texel, ground);
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_bundle::impostor::Ring;

    fn placing() -> Placing {
        let scene = heliodon_mesh::figures::cloth::cloth().mesh;
        let rings = vec![Ring::around(0.0, 8), Ring::around(40.0, 4)];
        let params = CaptureParams { rings, frame_px: Some([32, 48]), ..CaptureParams::preview() };
        Placing::new(Preview::new(MovingMesh::still(scene), "cloth", params).unwrap())
    }

    #[test]
    fn a_model_is_placed_and_taken_as_it_was_placed() {
        let mut placing = placing();
        let fitted = placing.picture().unwrap();
        assert!(fitted.pixels[0] == WELL && placing.picture().is_none());
        assert!(fitted.pixels.iter().filter(|p| **p != WELL && **p != over([0; 4], GROUNDS[3])).count() > 100);
        // larger than fits: it is told, and not taken
        (0..12).for_each(|_| placing.press(&Press::Sign("+".into()), false));
        assert!(placing.told().contains("CUT") && placing.picture().unwrap().pixels[0] == CUT);
        placing.press(&Press::Enter, false);
        assert!(!placing.is_done());
        placing.turn(-14.0);
        placing.drag([1.0, 0.0]);
        placing.press(&Press::Up, true);
        let framing = placing.preview.params().framing;
        assert!(
            framing.zoom < 1.0 && (framing.shift[0] - 1.0 / 32.0).abs() < 1e-6 && (framing.shift[1] - 1.0 / 48.0).abs() < 1e-6
        );
        placing.press(&Press::Enter, false);
        assert_eq!(placing.end, Some(End::Capture));
    }

    #[test]
    fn views_are_walked_through_ring_by_ring() {
        let mut placing = placing();
        placing.press(&Press::Left, false);
        assert_eq!((placing.view, placing.ring()), (11, (1, 3)), "the last of all");
        placing.press(&Press::Up, false);
        assert_eq!(placing.ring(), (0, 6), "270 degrees round in either");
        placing.press(&Press::Right, false);
        placing.press(&Press::Down, false);
        // 315 degrees are as far from 270 as from 0
        assert!([(1, 3), (1, 0)].contains(&placing.ring()));
    }
}
