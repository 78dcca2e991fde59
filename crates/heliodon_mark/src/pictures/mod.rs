//! Photographs in memory: decoded on a thread of their own, in halves of halves, so that one of a hundred megapixels is drawn as fast as a small one.

mod tiles;
mod view;

pub use tiles::Tiles;
pub(crate) use tiles::small_texture;
pub use view::View;

use glam::DVec2;
use heliodon_image::{Picture as Decoded, PictureFile};
use heliodon_photo::snap::Grey;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread;

/// The longest side of a photograph's smallest form, kept for as long as the window is open.
pub const SMALLEST_PX: usize = 256;

/// Decoded photographs beyond this are let go, unless they are looked at.
const MOST_BYTES: usize = 1 << 31;

/// A photograph at one size.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// sRGB and opacity, row by row.
    pub pixels: Vec<[u8; 4]>,
}

impl Level {
    /// Half as wide and high; odd margins are repeated.
    fn half(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = [2 * y, (2 * y + 1).min(self.height - 1)].map(|y| &self.pixels[y * self.width..][..self.width]);
            for x in 0..width {
                let columns = [2 * x, (2 * x + 1).min(self.width - 1)];
                let four = [rows[0][columns[0]], rows[0][columns[1]], rows[1][columns[0]], rows[1][columns[1]]];
                let mean = |c: usize| ((four.iter().map(|p| u32::from(p[c])).sum::<u32>() + 2) / 4) as u8;
                pixels.push([mean(0), mean(1), mean(2), mean(3)]);
            }
        }
        Self { width, height, pixels }
    }
}

/// A photograph, each level half as wide and high as the one before.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    levels: Vec<Level>,
}

impl Picture {
    /// All levels of a photograph; `None` where it has no pixels.
    #[must_use]
    pub fn new(full: Level) -> Option<Self> {
        if full.width == 0 || full.height == 0 || full.pixels.len() != full.width * full.height {
            return None;
        }
        let mut levels = vec![full];
        while let Some(last) = levels.last().filter(|last| last.width.max(last.height) > SMALLEST_PX) {
            let half = last.half();
            levels.push(half);
        }
        Some(Self { levels })
    }

    /// All of it, the finest first.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> DVec2 {
        DVec2::new(self.levels[0].width as f64, self.levels[0].height as f64)
    }

    fn bytes(&self) -> usize {
        self.levels.iter().map(|level| 4 * level.pixels.len()).sum()
    }

    /// The brightness about a place of a level, both in that level's pixels, and where the piece begins. Nothing where the place is not a number.
    #[must_use]
    pub fn grey(&self, level: usize, about: DVec2, reach_px: f64) -> Option<(Grey, DVec2)> {
        let level = self.levels.get(level)?;
        let limit = DVec2::new(level.width as f64, level.height as f64);
        if !about.is_finite() {
            return None;
        }
        let from = (about - reach_px).floor().clamp(DVec2::ZERO, limit);
        let to = (about + reach_px).ceil().clamp(DVec2::ZERO, limit);
        let [x0, y0, x1, y1] = [from.x, from.y, to.x, to.y].map(|x| x as usize);
        let grey = |p: &[u8; 4]| (0.299 * f32::from(p[0]) + 0.587 * f32::from(p[1]) + 0.114 * f32::from(p[2])) / 255.0;
        let row = |y: usize| level.pixels[y * level.width + x0..y * level.width + x1].iter().map(grey);
        let grey = Grey::new(x1 - x0, y1 - y0, (y0..y1).flat_map(row).collect())?;
        Some((grey, from))
    }
}

/// How far a photograph has come.
#[derive(Clone, Debug)]
pub enum Loading {
    /// It is being decoded.
    Waiting,
    /// It is here.
    Ready(Arc<Picture>),
    /// Why it never will be.
    Failed(String),
}

#[derive(Clone)]
struct Wish {
    photo: String,
    file: PathBuf,
}

#[derive(Default)]
struct Queue {
    wishes: Vec<Wish>,
    is_over: bool,
}

struct Held {
    picture: Arc<Picture>,
    last_wanted: u64,
}

/// All photographs of a project.
pub struct Pictures {
    queue: Arc<(Mutex<Queue>, Condvar)>,
    told: Receiver<(String, Result<Picture, String>)>,
    held: BTreeMap<String, Held>,
    failed: BTreeMap<String, String>,
    small: BTreeMap<String, Arc<Level>>,
    turn: u64,
    most_bytes: usize,
}

impl Pictures {
    /// Starts the thread; `wake` is called whenever a photograph was decoded.
    #[must_use]
    pub fn start(wake: Arc<dyn Fn() + Send + Sync>) -> Self {
        let queue = Arc::new((Mutex::new(Queue::default()), Condvar::new()));
        let (tell, told) = channel();
        let theirs = Arc::clone(&queue);
        thread::spawn(move || decode_wishes(&theirs, &tell, &wake));
        let (held, failed, small) = Default::default();
        Self { queue, told, held, failed, small, turn: 0, most_bytes: MOST_BYTES }
    }

    /// Says which photographs are looked at, and which are there at all: these are decoded first and all others once, for their small forms.
    pub fn want(&mut self, looked_at: &[(String, PathBuf)], all: &[(String, PathBuf)]) {
        self.turn += 1;
        while let Ok((photo, decoded)) = self.told.try_recv() {
            match decoded {
                Ok(picture) => {
                    if let Some(smallest) = picture.levels.last() {
                        self.small.insert(photo.clone(), Arc::new(smallest.clone()));
                    }
                    let held = Held { picture: Arc::new(picture), last_wanted: 0 };
                    self.held.insert(photo, held);
                }
                Err(why) => {
                    self.failed.insert(photo, why);
                }
            }
        }
        for (photo, _) in looked_at {
            if let Some(held) = self.held.get_mut(photo) {
                held.last_wanted = self.turn;
            }
        }
        self.let_go();
        let missing = |photo: &String| !self.failed.contains_key(photo);
        let first = looked_at.iter().filter(|(photo, _)| missing(photo) && !self.held.contains_key(photo));
        let then = all.iter().filter(|(photo, _)| missing(photo) && !self.small.contains_key(photo));
        let wishes = first.chain(then).map(|(photo, file)| Wish { photo: photo.clone(), file: file.clone() }).collect();
        let (queue, bell) = &*self.queue;
        queue.lock().unwrap_or_else(PoisonError::into_inner).wishes = wishes;
        bell.notify_one();
    }

    fn let_go(&mut self) {
        let mut bytes: usize = self.held.values().map(|held| held.picture.bytes()).sum();
        while bytes > self.most_bytes {
            let idle = self.held.iter().filter(|(_, held)| held.last_wanted < self.turn);
            let Some(oldest) = idle.min_by_key(|(_, held)| held.last_wanted).map(|(photo, _)| photo.clone()) else { return };
            if let Some(held) = self.held.remove(&oldest) {
                bytes -= held.picture.bytes();
            }
        }
    }

    /// How far a photograph has come.
    #[must_use]
    pub fn get(&self, photo: &str) -> Loading {
        match (self.held.get(photo), self.failed.get(photo)) {
            (Some(held), _) => Loading::Ready(Arc::clone(&held.picture)),
            (None, Some(why)) => Loading::Failed(why.clone()),
            (None, None) => Loading::Waiting,
        }
    }

    /// Its smallest form, once it was decoded.
    #[must_use]
    pub fn small(&self, photo: &str) -> Option<&Arc<Level>> {
        self.small.get(photo)
    }

    /// Whether photographs are still to come.
    #[must_use]
    pub fn is_busy(&self, all: usize) -> bool {
        self.small.len() + self.failed.len() < all
    }
}

impl Drop for Pictures {
    fn drop(&mut self) {
        let (queue, bell) = &*self.queue;
        queue.lock().unwrap_or_else(PoisonError::into_inner).is_over = true;
        bell.notify_one();
    }
}

fn decode_wishes(
    queue: &(Mutex<Queue>, Condvar),
    tell: &Sender<(String, Result<Picture, String>)>,
    wake: &Arc<dyn Fn() + Send + Sync>,
) {
    let mut last: Option<String> = None;
    loop {
        let (lock, bell) = queue;
        let mut state = lock.lock().unwrap_or_else(PoisonError::into_inner);
        let wish = loop {
            if state.is_over {
                return;
            }
            // What was just told stays in the queue until the window has heard of it.
            let next = state.wishes.iter().find(|wish| Some(&wish.photo) != last.as_ref()).cloned();
            state.wishes.retain(|wish| next.as_ref().is_none_or(|next| next.photo != wish.photo));
            match next {
                Some(wish) => break wish,
                None => {
                    state.wishes.clear();
                    last = None;
                    state = bell.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
            }
        };
        drop(state);
        let decoded = decoded(&wish.file);
        last = Some(wish.photo.clone());
        if tell.send((wish.photo, decoded)).is_err() {
            return;
        }
        wake();
    }
}

fn decoded(file: &std::path::Path) -> Result<Picture, String> {
    let read = PictureFile::read(file).map_err(|error| error.to_string())?;
    let Decoded::Eight(image) = read.picture else {
        return Err("holds radiance; save it as JPEG, PNG or 8-bit TIFF to mark in it".to_owned());
    };
    let level = Level { width: image.width as usize, height: image.height as usize, pixels: image.pixels };
    Picture::new(level).ok_or_else(|| "has no pixels".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_image::SrgbImage;

    fn level(width: usize, height: usize) -> Level {
        let pixels = (0..width * height).map(|i| [(i % width) as u8, (i / width) as u8, 7, 255]).collect();
        Level { width, height, pixels }
    }

    #[test]
    fn levels_halve_to_the_smallest_and_keep_the_mean() {
        let picture = Picture::new(level(1001, 600)).unwrap();
        let sizes: Vec<(usize, usize)> = picture.levels().iter().map(|l| (l.width, l.height)).collect();
        assert_eq!(sizes, [(1001, 600), (501, 300), (251, 150)]);
        assert_eq!(picture.levels()[1].pixels[501 + 3], [7, 3, 7, 255]);
        assert!(Picture::new(Level { width: 0, height: 3, pixels: Vec::new() }).is_none());
    }

    #[test]
    fn a_piece_at_the_margin_is_smaller_and_says_where_it_begins() {
        let picture = Picture::new(level(40, 30)).unwrap();
        let (_, from) = picture.grey(0, DVec2::new(38.0, 10.0), 5.0).unwrap();
        assert_eq!(from, DVec2::new(33.0, 5.0));
        assert!(picture.grey(0, DVec2::NAN, 5.0).is_none() && picture.grey(3, DVec2::ZERO, 5.0).is_none());
        assert!(picture.grey(0, DVec2::splat(-1e9), 5.0).is_some());
    }

    #[test]
    fn photographs_come_in_and_what_cannot_be_read_is_told() {
        let home = tempfile::tempdir().unwrap();
        let mut all = Vec::new();
        for name in ["a.png", "b.png"] {
            let file = home.path().join(name);
            SrgbImage { width: 20, height: 10, pixels: vec![[9, 9, 9, 255]; 200] }.write_png(&file).unwrap();
            all.push((name.to_owned(), file));
        }
        all.push(("none.png".to_owned(), home.path().join("none.png")));
        let mut pictures = Pictures::start(Arc::new(|| {}));
        pictures.most_bytes = 1000;
        for _ in 0..500 {
            pictures.want(&all[..1], &all);
            if !pictures.is_busy(3) {
                break;
            }
            thread::sleep(std::time::Duration::from_millis(10));
        }
        assert!(matches!(pictures.get("none.png"), Loading::Failed(_)));
        assert_eq!(pictures.small("b.png").map(|level| level.width), Some(20));
        // Room for one: the one that is looked at stays.
        pictures.want(&all[..1], &all);
        assert!(matches!((pictures.get("a.png"), pictures.get("b.png")), (Loading::Ready(_), Loading::Waiting)));
    }
}
