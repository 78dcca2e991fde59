//! The texels of one resolution of a panorama, and where they stand in its textures.

use super::Panorama;
use super::look::face;
use crate::texels::{Lit, Owners};
use heliodon_bundle::panorama::size_of;
use heliodon_light::{RayPlace, Receivers, Receiving};
use heliodon_lightmap::refine::{Grid, Place};
use heliodon_lightmap::texels::Texel;

/// Faces, each of which is a chart.
const FACES: [u32; 6] = [0, 1, 2, 3, 4, 5];
/// How many texels beside those of a level filtering asks for at most: its own nearest, and of the masks those around them.
const BESIDE: usize = 2;

/// The texels of a level: of all that are one there, that of the finest which is nearest to their middle.
pub struct Level {
    side: u32,
    level: u32,
    texels: Vec<Texel>,
    places: Vec<RayPlace>,
    grid: Grid,
}

impl Level {
    /// Of a panorama; 0 is the finest.
    pub fn new(panorama: &Panorama, level: u32) -> Self {
        let side = panorama.side >> level;
        let half = f32::from(1_u16 << level) / 2.0;
        let off = |x: u16| (f32::from(x % (1 << level)) + 0.5 - half).abs();
        let mut all: Vec<_> = (0..panorama.texels.len() as u32)
            .map(|number| {
                let at = panorama.texels[number as usize].at;
                let [x, y] = at.map(|x| x >> level);
                let from_middle = off(at[0]).hypot(off(at[1]));
                ((face(panorama.side, at), y, x), from_middle, number)
            })
            .collect();
        all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        all.dedup_by_key(|texel| texel.0);
        let texel = |&((face, y, x), ..): &((u32, u16, u16), f32, u32)| Texel {
            x,
            y,
            sheet: 0,
            is_covered: true,
            triangle: face,
            weights: glam::Vec3::X,
        };
        let texels: Vec<Texel> = all.iter().map(texel).collect();
        let places: Vec<RayPlace> = all.iter().map(|&(.., number)| panorama.texels[number as usize].place).collect();
        let place = |&RayPlace { position, normal }: &RayPlace| Place { position, normal };
        let grid = Grid::new(&texels, &FACES, places.iter().map(place).collect());
        Self { side, level, texels, places, grid }
    }

    /// Along both sides of the atlas.
    fn size(&self) -> [u32; 2] {
        size_of(self.side)
    }

    fn cell(&self, [x, y]: [u16; 2]) -> usize {
        usize::from(y) * self.size()[0] as usize + usize::from(x)
    }

    /// What holds for the texels of this level, for those of the finest.
    pub fn of_finest(&self, finest: &Self, values: &[bool]) -> Vec<bool> {
        let [width, height] = self.size();
        let mut at = vec![true; (width * height) as usize];
        self.texels.iter().zip(values).for_each(|(texel, &value)| at[self.cell([texel.x, texel.y])] = value);
        finest.texels.iter().map(|texel| at[self.cell([texel.x, texel.y].map(|x| x >> self.level))]).collect()
    }

    /// For each texel the nearest of its face that is valid.
    pub fn nearest(&self, valid: &[bool]) -> Vec<u32> {
        self.grid.nearest_valid(valid)
    }
}

impl Lit for Level {
    fn grid(&self) -> &Grid {
        &self.grid
    }

    fn receivers<'a>(&self, receiving: &'a Receiving<'a>, texels: &[u32]) -> Receivers<'a> {
        let places: Vec<RayPlace> = texels.iter().map(|&texel| self.places[texel as usize]).collect();
        receiving.on_rays(&places)
    }
}

/// Where the texels of a level stand in a texture, and those beside them that filtering asks for.
pub struct Shown {
    /// Which cells there are.
    pub owners: Owners,
    /// Cells of the texture, and the texel that each shows; those beside them last.
    cells: Vec<(usize, u32)>,
    /// How many of them are texels themselves.
    own: usize,
    len: usize,
}

impl Shown {
    /// Of a level.
    pub fn of(level: &Level) -> Self {
        let [width, height] = level.size();
        let mut source = vec![u32::MAX; (width * height) as usize];
        let mut cells: Vec<(usize, u32)> = Vec::with_capacity(level.texels.len());
        for (number, texel) in (0..).zip(&level.texels) {
            let cell = level.cell([texel.x, texel.y]);
            source[cell] = number;
            cells.push((cell, number));
        }
        let own = cells.len();
        let face = |cell: usize| {
            let [x, y] = [cell as u32 % width, cell as u32 / width].map(|x| x / level.side);
            x + 3 * y
        };
        let mut rim = 0..own;
        for _ in 0..BESIDE {
            let first = cells.len();
            for at in rim {
                let (cell, number) = cells[at];
                for beside in beside(cell, [width, height]) {
                    if source[beside] == u32::MAX && face(beside) == face(cell) {
                        source[beside] = number;
                        cells.push((beside, number));
                    }
                }
            }
            rim = first..cells.len();
        }
        let charts = cells.iter().map(|&(cell, _)| (cell, face(cell)));
        Self { owners: Owners::of([width, height], charts), own, len: source.len(), cells }
    }

    /// Values of the level's texels in the cells of its texture, `width` each.
    pub fn spread<T: Copy + Default>(&self, values: &[T], width: usize) -> Vec<T> {
        let mut all = vec![T::default(); self.len * width];
        for &(cell, texel) in &self.cells {
            let from = texel as usize * width;
            all[cell * width..(cell + 1) * width].copy_from_slice(&values[from..from + width]);
        }
        all
    }

    /// Cells that show a texel beside them.
    pub fn beside(&self) -> impl Iterator<Item = usize> + '_ {
        self.cells[self.own..].iter().map(|&(cell, _)| cell)
    }
}

/// The up to four cells beside one.
fn beside(cell: usize, [width, height]: [u32; 2]) -> impl Iterator<Item = usize> {
    let (x, y) = (cell as u32 % width, cell as u32 / width);
    let four = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
    four.into_iter().filter(move |&(x, y)| x < width && y < height).map(move |(x, y)| (y * width + x) as usize)
}
