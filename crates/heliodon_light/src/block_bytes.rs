//! Gathered blocks as bytes, so that a bake can go on where it stopped.
//!
//! Little-endian throughout: magic, then the fields in order, each list with its length before it. The bytes carry no
//! checksum: whoever stores them adds one.

use crate::{Followed, GatherBlock, LightError, UnitHits};

/// Eight bytes that name the format and its version.
const MAGIC: [u8; 8] = *b"HELGATH5";

impl GatherBlock {
    /// The block as bytes.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(64 + self.hit_bytes() + 4 * (self.sky.len() + self.sun.len() + 2 * self.scale.len()));
        out.extend(MAGIC);
        for number in [self.range.start as u64, self.range.end as u64, self.rays] {
            out.extend(number.to_le_bytes());
        }
        for list in [&self.sky, &self.sun, &self.scale, &self.back] {
            put_list(&mut out, list, |x| x.to_le_bytes());
        }
        put_list(&mut out, self.back_cells.as_flattened(), |x| x.to_le_bytes());
        out.extend((self.hits.len() as u64).to_le_bytes());
        for hits in &self.hits {
            out.push(u8::from(hits.is_some()));
            let Some(hits) = hits else { continue };
            put_list(&mut out, &hits.met, |x| x.to_le_bytes());
            put_list(&mut out, &hits.cells, |x| x.to_le_bytes());
        }
        out.extend((self.followed.len() as u64).to_le_bytes());
        for followed in &self.followed {
            put_list(&mut out, &followed.light, |x| x.to_le_bytes());
            for list in [&followed.keys[..], followed.ends.as_flattened()] {
                put_list(&mut out, list, |x| x.to_le_bytes());
            }
        }
        out
    }

    /// A block from its bytes; check it against its layout with [`GatherBlock::validate`].
    ///
    /// # Errors
    /// Bytes of something else, too few or too many of them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, LightError> {
        let mut rest = bytes;
        if take::<8>(&mut rest)? != MAGIC {
            return Err(LightError::Block("of another format or version"));
        }
        let [start, end, rays] = [number(&mut rest)?, number(&mut rest)?, number(&mut rest)?];
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok()).filter(|(start, end)| start <= end);
        let (start, end) = range.ok_or(LightError::Block("a range that is none"))?;
        let [sky, sun, scale, back] = [(); 4].map(|()| take_list(&mut rest, f32::from_le_bytes));
        let back_cells = take_groups(&mut rest)?;
        let hits = take_hits(&mut rest)?;
        let units = number(&mut rest)?;
        let mut followed = Vec::new();
        for _ in 0..units {
            let light = take_list(&mut rest, f32::from_le_bytes)?;
            let keys = take_list(&mut rest, u32::from_le_bytes)?;
            followed.push(Followed { keys, light, ends: take_groups(&mut rest)? });
        }
        if !rest.is_empty() {
            return Err(LightError::Block("more bytes than it should have"));
        }
        Ok(Self { range: start..end, sky: sky?, sun: sun?, scale: scale?, back: back?, back_cells, hits, followed, rays })
    }
}

/// The hits alone of a block's bytes.
pub(crate) fn hits_of_block(bytes: &[u8]) -> Result<Vec<Option<UnitHits>>, LightError> {
    let mut rest = bytes;
    if take::<8>(&mut rest)? != MAGIC {
        return Err(LightError::Block("of another format or version"));
    }
    take::<24>(&mut rest)?;
    for _ in 0..5 {
        take_bytes::<4>(&mut rest)?;
    }
    take_hits(&mut rest)
}

fn take_hits(rest: &mut &[u8]) -> Result<Vec<Option<UnitHits>>, LightError> {
    let hits = |rest: &mut &[u8]| match take(rest)? {
        [0] => Ok(None),
        [1] => {
            let met = take_list(rest, u64::from_le_bytes)?;
            Ok(Some(UnitHits { met, cells: take_list(rest, u32::from_le_bytes)? }))
        }
        _ => Err(LightError::Block("hits that are neither kept nor not")),
    };
    (0..number(rest)?).map(|_| hits(rest)).collect()
}

pub(crate) fn put_list<T: Copy, const N: usize>(out: &mut Vec<u8>, list: &[T], bytes: impl Fn(T) -> [u8; N]) {
    out.extend((list.len() as u64).to_le_bytes());
    out.extend(list.iter().flat_map(|&x| bytes(x)));
}

pub(crate) fn take<const N: usize>(rest: &mut &[u8]) -> Result<[u8; N], LightError> {
    let (head, tail) = rest.split_first_chunk().ok_or(LightError::Block("fewer bytes than it should have"))?;
    *rest = tail;
    Ok(*head)
}

pub(crate) fn number(rest: &mut &[u8]) -> Result<u64, LightError> {
    take(rest).map(u64::from_le_bytes)
}

pub(crate) fn take_list<T, const N: usize>(rest: &mut &[u8], value: impl Fn([u8; N]) -> T) -> Result<Vec<T>, LightError> {
    Ok(take_bytes::<N>(rest)?.iter().map(|&x| value(x)).collect())
}

/// A list as its bytes, N for each of its numbers.
fn take_bytes<'a, const N: usize>(rest: &mut &'a [u8]) -> Result<&'a [[u8; N]], LightError> {
    let short = LightError::Block("fewer bytes than it should have");
    let count = usize::try_from(number(rest)?).map_err(|_| short.clone())?;
    let (bytes, tail) = count.checked_mul(N).and_then(|n| rest.split_at_checked(n)).ok_or(short)?;
    *rest = tail;
    Ok(bytes.as_chunks().0)
}

/// A list of groups of N numbers.
pub(crate) fn take_groups<const N: usize>(rest: &mut &[u8]) -> Result<Vec<[u32; N]>, LightError> {
    match take_list(rest, u32::from_le_bytes)?.as_chunks() {
        (groups, []) => Ok(groups.to_vec()),
        _ => Err(LightError::Block("a group that is cut short")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block() -> GatherBlock {
        GatherBlock {
            range: 5..7,
            sky: vec![0.1, -0.2, 0.3, 0.4],
            sun: vec![0.5, 0.25],
            scale: vec![1.0, 2.0],
            back: vec![0.0, 0.75],
            back_cells: vec![[3, 1], [9, 2]],
            hits: vec![None, Some(UnitHits { met: vec![1, 2, 3], cells: vec![8, 1 << 31, 2, 7] })],
            followed: vec![Followed { keys: vec![1], light: vec![0.5; 4], ends: vec![[4, 5, 6]] }],
            rays: 1 << 40,
        }
    }

    #[test]
    fn a_block_survives_the_round_trip() {
        assert_eq!(GatherBlock::from_bytes(&block().to_bytes()), Ok(block()));
        assert_eq!(hits_of_block(&block().to_bytes()), Ok(block().hits));
    }

    #[test]
    fn no_cut_or_changed_length_is_accepted_or_panics() {
        let bytes = block().to_bytes();
        for cut in 0..bytes.len() {
            assert!(GatherBlock::from_bytes(&bytes[..cut]).is_err(), "cut at {cut}");
            let _ = hits_of_block(&bytes[..cut]);
        }
        assert!(GatherBlock::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
        for at in 0..bytes.len() {
            let mut broken = bytes.clone();
            broken[at] ^= 0xff;
            // must not panic or ask for memory without bound; payload bits may change silently
            let _ = (GatherBlock::from_bytes(&broken), hits_of_block(&broken));
        }
    }
}
