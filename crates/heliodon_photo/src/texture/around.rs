//! Which texels are about a texel on the surface.

use super::layout::Layout;
use super::lit::TexelIndex;

/// For each texel the numbers of others about it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Around {
    /// Where each one's begin in `texels`, and where the last one's end.
    pub starts: Vec<u32>,
    /// All of them.
    pub texels: Vec<u32>,
}

impl Around {
    /// Those about one.
    ///
    /// # Panics
    /// Where there is no such texel.
    #[must_use]
    pub fn of(&self, texel: usize) -> &[u32] {
        &self.texels[self.starts[texel] as usize..self.starts[texel + 1] as usize]
    }
}

const WAYS: [[i64; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

pub(super) fn around(layout: &Layout, distance_m: f32) -> Around {
    let index = TexelIndex::new(layout);
    let mut all = Around { starts: vec![0], texels: Vec::new() };
    for (face, range) in layout.starts.windows(2).enumerate() {
        // one texel at least, or nobody would be about
        let far = (distance_m * layout.per_m[face]).clamp(1.0, 4096.0).round() as i64;
        let steps = if far > 1 { vec![far, far / 2] } else { vec![1] };
        for texel in &layout.texels[range[0]..range[1]] {
            for step in &steps {
                for [dx, dy] in WAYS {
                    let [x, y] = texel.at.map(i64::from);
                    all.texels.extend(index.of_face(face as u32, x + dx * step, y + dy * step));
                }
            }
            all.starts.push(all.texels.len() as u32);
        }
    }
    all
}
