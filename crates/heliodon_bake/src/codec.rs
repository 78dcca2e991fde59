//! The bytes of a finished block: runs of plain numbers, little-endian, each run after its length.
//!
//! Not a format that anyone else reads: a cache's key holds the program's revision, so it never outlives it.

use bytemuck::Pod;

/// Appends runs of numbers.
#[derive(Debug, Default)]
pub struct Encoder {
    bytes: Vec<u8>,
}

impl Encoder {
    /// Appends one run.
    pub fn run<T: Pod>(&mut self, values: &[T]) -> &mut Self {
        self.bytes.extend((values.len() as u64).to_le_bytes());
        self.bytes.extend_from_slice(bytemuck::cast_slice(values));
        self
    }

    /// Appends one number.
    pub fn number(&mut self, value: u64) -> &mut Self {
        self.run(&[value])
    }

    /// What was appended.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

/// Takes the runs back in the order in which they were appended; `None` where the bytes hold something else.
#[derive(Debug)]
pub struct Decoder<'a> {
    rest: &'a [u8],
}

impl<'a> Decoder<'a> {
    /// Reads from the beginning of `bytes`.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// The next run.
    pub fn run<T: Pod>(&mut self) -> Option<Vec<T>> {
        let (length, rest) = self.rest.split_first_chunk::<8>()?;
        let bytes = usize::try_from(u64::from_le_bytes(*length)).ok()?.checked_mul(size_of::<T>())?;
        let (run, rest) = rest.split_at_checked(bytes)?;
        self.rest = rest;
        Some(bytemuck::pod_collect_to_vec(run))
    }

    /// The next number.
    pub fn number(&mut self) -> Option<u64> {
        let run = self.run::<u64>()?;
        if let [value] = run[..] { Some(value) } else { None }
    }

    /// Whether everything was taken.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_come_back_and_broken_bytes_do_not() {
        let mut encoder = Encoder::default();
        encoder.number(7).run(&[1.5_f32, -2.0, 3.25]).run::<u32>(&[]).run(&[u64::MAX]);
        let bytes = encoder.finish();
        let mut decoder = Decoder::new(&bytes);
        assert_eq!(decoder.number(), Some(7));
        assert_eq!(decoder.run::<f32>().unwrap(), [1.5, -2.0, 3.25]);
        assert_eq!(decoder.run::<u32>().unwrap(), [0_u32; 0]);
        assert!(!decoder.is_empty());
        assert_eq!(decoder.run::<u64>().unwrap(), [u64::MAX]);
        assert!(decoder.is_empty() && decoder.number().is_none());

        assert!(Decoder::new(&bytes[..20]).run::<u64>().is_some());
        assert!(Decoder::new(&[0xFF; 16]).run::<f32>().is_none(), "a length beyond the bytes");
        assert!(Decoder::new(&[1, 0, 0]).run::<u8>().is_none());
    }
}
