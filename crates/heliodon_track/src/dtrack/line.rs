//! One line of a datagram: numbers, and blocks of numbers in brackets.

use crate::report::Malformed;

/// A place in a line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// What is left of the line.
    rest: &'a [u8],
    /// Where in the packet that begins.
    offset: usize,
}

impl<'a> Line<'a> {
    pub(super) fn new(line: &'a [u8], offset: usize) -> Self {
        Self { rest: line, offset }
    }

    /// An error at the present place.
    pub(super) fn wrong<T>(&self, reason: &'static str) -> Result<T, Malformed> {
        Err(Malformed { offset: self.offset, reason })
    }

    fn skip(&mut self, bytes: usize) {
        self.rest = &self.rest[bytes..];
        self.offset += bytes;
    }

    fn skip_blanks(&mut self) {
        self.skip(self.rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t' | b'\r')).count());
    }

    /// The word that the line begins with; a line that does not begin with a word has none.
    pub(super) fn word(&mut self) -> &'a [u8] {
        self.skip_blanks();
        let (word, _) = self.rest.split_at(self.rest.iter().take_while(|byte| byte.is_ascii_alphanumeric()).count());
        self.skip(word.len());
        word
    }

    /// The next number, which is finite.
    pub(super) fn number(&mut self) -> Result<f64, Malformed> {
        self.skip_blanks();
        let length = self.rest.iter().take_while(|byte| !b" \t\r[]".contains(byte)).count();
        if length == 0 {
            return self.wrong("a number is missing");
        }
        let text = std::str::from_utf8(&self.rest[..length]).ok();
        // Rust reads "nan" and "inf" as numbers
        match text.and_then(|text| text.parse::<f64>().ok()).filter(|value| value.is_finite()) {
            Some(value) => {
                self.skip(length);
                Ok(value)
            }
            None => self.wrong("this is no number"),
        }
    }

    /// The next number, which counts something.
    pub(super) fn count(&mut self) -> Result<u32, Malformed> {
        let place = *self;
        whole(self.number()?).map_or_else(|| place.wrong("a whole number from 0 up is wanted"), Ok)
    }

    /// The numbers of the next block, as many as one of `lengths` (any number where that is empty).
    pub(super) fn block(&mut self, lengths: &[usize]) -> Result<Vec<f64>, Malformed> {
        self.skip_blanks();
        let place = *self;
        if self.rest.first() != Some(&b'[') {
            return self.wrong("a block in brackets is missing");
        }
        self.skip(1);
        let mut values = Vec::with_capacity(9);
        loop {
            self.skip_blanks();
            match self.rest.first() {
                Some(b']') => break self.skip(1),
                _ => values.push(self.number()?),
            }
        }
        if lengths.is_empty() || lengths.contains(&values.len()) {
            return Ok(values);
        }
        place.wrong("a block has another number of numbers")
    }

    /// Nothing follows.
    pub(super) fn end(&mut self) -> Result<(), Malformed> {
        self.skip_blanks();
        if self.rest.is_empty() { Ok(()) } else { self.wrong("something stands behind the last number") }
    }
}

/// A number that counts something.
pub(super) fn whole(value: f64) -> Option<u32> {
    (value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value)).then_some(value as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Line<'_> {
        Line::new(text.as_bytes(), 100)
    }

    #[test]
    fn words_numbers_and_blocks_are_read_in_their_order() {
        let mut line = line("6d 2 [0 1.000] [-4.5e-1 +2]\r");
        assert_eq!(line.word(), b"6d");
        assert_eq!(line.count(), Ok(2));
        assert_eq!(line.block(&[2]), Ok(vec![0.0, 1.0]));
        assert_eq!(line.block(&[1, 2]), Ok(vec![-0.45, 2.0]));
        assert_eq!(line.end(), Ok(()));
    }

    #[test]
    fn what_is_no_number_is_told_with_its_place() {
        let no_number = |text: &str, reason| {
            let fault = line(text).block(&[]).unwrap_err();
            assert_eq!((fault.reason, fault.offset), (reason, 103), "{text}");
        };
        for text in ["[1 nan]", "[1 inf]", "[1 1e999]", "[1 --2]", "[1 0x10]", "[1 2,5]", "[1 \u{665}]", "[1 1\0]"] {
            no_number(text, "this is no number");
        }
        no_number("[1 ", "a number is missing");
        no_number("[1 [", "a number is missing");
        assert_eq!(line("1 2]").block(&[]).unwrap_err().reason, "a block in brackets is missing");
        assert_eq!(line("[1 2]").block(&[3]).unwrap_err().reason, "a block has another number of numbers");
    }

    #[test]
    fn counts_are_whole_and_not_negative() {
        assert_eq!(line("4294967295").count(), Ok(u32::MAX));
        for text in ["-1", "1.5", "4294967296", "1e300"] {
            assert_eq!(line(text).count().unwrap_err().reason, "a whole number from 0 up is wanted", "{text}");
        }
    }
}
