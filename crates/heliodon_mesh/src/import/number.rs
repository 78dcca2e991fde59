//! Numbers in text, fast: most coordinates are short decimals, which one multiplication or division by a power of ten reads
//! exactly (Clinger, "How to Read Floating Point Numbers Accurately", 1990, his fast path); the rest goes to the standard library.

/// 10^0 to 10^22, each exact in an `f64`.
const POWERS_OF_TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21,
    1e22,
];

/// The nearest `f64` to a decimal number; also `nan`, `inf` and what Microsoft's runtime writes for them (`-1.#IND`).
pub(crate) fn parse_f64(word: &[u8]) -> Option<f64> {
    fast(word).or_else(|| slow(word))
}

fn fast(word: &[u8]) -> Option<f64> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let (mut mantissa, mut count, mut fraction, mut point) = (0_u64, 0_u32, 0_i32, false);
    let mut at = 0;
    while let Some(&byte) = digits.get(at) {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                count += u32::from(mantissa != 0);
                fraction += i32::from(point);
            }
            b'.' if !point => point = true,
            _ => break,
        }
        at += 1;
    }
    let any = at > usize::from(point);
    if !any || count > 19 || mantissa > 1 << 53 {
        return None;
    }
    let mut exponent = -fraction;
    if let Some(b'e' | b'E') = digits.get(at) {
        exponent = exponent.checked_add(parse_integer(&digits[at + 1..])?.try_into().ok()?)?;
    } else if at < digits.len() {
        return None;
    }
    let magnitude = match exponent {
        0 => mantissa as f64,
        1..=22 => mantissa as f64 * POWERS_OF_TEN[exponent as usize],
        -22..=-1 => mantissa as f64 / POWERS_OF_TEN[-exponent as usize],
        _ => return None,
    };
    Some(if negative { -magnitude } else { magnitude })
}

fn slow(word: &[u8]) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let name = text.trim_start_matches(['-', '+']).to_ascii_lowercase();
    if name.starts_with("1.#") || name.starts_with("nan(") {
        return Some(if name.starts_with("1.#inf") { f64::INFINITY } else { f64::NAN });
    }
    None
}

/// A decimal integer, with a sign or without.
pub(crate) fn parse_integer(word: &[u8]) -> Option<i64> {
    let (negative, digits) = match word {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    if digits.is_empty() || digits.len() > 18 {
        return None;
    }
    let mut number = 0_i64;
    for byte in digits {
        if !byte.is_ascii_digit() {
            return None;
        }
        number = number * 10 + i64::from(byte - b'0');
    }
    Some(if negative { -number } else { number })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn numbers_are_read_as_the_standard_library_reads_them(number in any::<f64>(), digits in 0_usize..18) {
            prop_assume!(number.is_finite());
            for text in [format!("{number}"), format!("{number:e}"), format!("{:.digits$}", number % 1.0e6), format!("{number:.digits$e}")] {
                prop_assert_eq!(parse_f64(text.as_bytes()).map(f64::to_bits), text.parse::<f64>().ok().map(f64::to_bits));
            }
        }

        #[test]
        fn no_bytes_make_it_panic(word in proptest::collection::vec(any::<u8>(), 0..24)) {
            let text = String::from_utf8_lossy(&word);
            if let Ok(expected) = text.parse::<f64>() && !expected.is_nan() {
                prop_assert_eq!(parse_f64(&word), Some(expected));
            }
            parse_integer(&word);
        }
    }

    #[test]
    fn odd_spellings() {
        assert_eq!(parse_f64(b".5"), Some(0.5));
        assert_eq!(parse_f64(b"-5."), Some(-5.0));
        assert_eq!(parse_f64(b"1e+02"), Some(100.0));
        assert_eq!(parse_f64(b"000000000000000000000000001"), Some(1.0));
        assert!(parse_f64(b"-1.#IND00").unwrap().is_nan());
        assert_eq!(parse_f64(b"1.#INF"), Some(f64::INFINITY));
        for word in [&b""[..], b".", b"-", b"e5", b"1e", b"1.2.3", b"abc", b"1,5", b"0x10"] {
            assert_eq!(parse_f64(word), None, "{}", String::from_utf8_lossy(word));
        }
        assert_eq!(parse_integer(b"-12"), Some(-12));
        assert_eq!(parse_integer(b"1.0"), None);
    }
}
