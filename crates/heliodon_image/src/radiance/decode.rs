//! Reading a Radiance picture.

use super::header::{Axis, Header};
use crate::error::{COPY_AGAIN, ImageError, check_expansion, check_size};
use crate::{HdrImage, MAX_PIXELS};
use glam::{Mat3, Vec3};

/// Scanlines shorter or longer than this are never in the new run-length form (Radiance, `color.c`: MINELEN, MAXELEN).
const NEW_FORM_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;

/// No picture is longer than this along either side; scanlines are held whole.
const LONGEST_SIDE: u32 = 65_536;

/// How many bytes of memory a byte of the file can stand for: 191 in the new form (127 pixels in 8 bytes), but thousands in the old
/// one, whose runs can fill a scanline of one colour from 12 bytes. This much lets 4,096 x 2,048 pixels of one colour pass.
const MAX_EXPANSION: u64 = 4096;

/// Decodes a whole file.
pub(crate) fn decode(bytes: &[u8], name: &str) -> Result<HdrImage, ImageError> {
    let header = Header::parse(bytes, name)?;
    let (width, height) =
        if header.fast.is_x { (header.fast.count, header.slow.count) } else { (header.slow.count, header.fast.count) };
    if width.max(height) > LONGEST_SIDE {
        let problem = format!("{width} x {height} pixels, where a side has at most {LONGEST_SIDE}");
        return Err(ImageError::malformed(name, "the size in its header", problem, COPY_AGAIN));
    }
    check_size(name, "the size in its header", u64::from(width), u64::from(height), MAX_PIXELS)?;
    let needed = u64::from(width) * u64::from(height) * size_of::<Vec3>() as u64;
    check_expansion(name, needed, bytes.len(), MAX_EXPANSION)?;
    let scanline_length = header.fast.count as usize;
    // grows as the file bears it out: a header alone makes no large allocation
    let mut file_order: Vec<Vec3> = Vec::new();
    let mut scanline = vec![[0_u8; 4]; scanline_length];
    let mut source = Source { bytes, at: header.pixels_at };
    for row in 0..header.slow.count {
        source.scanline(&mut scanline).map_err(|problem| {
            ImageError::malformed(
                name,
                format!("scanline {} of {}, byte {}", row + 1, header.slow.count, source.at),
                problem,
                COPY_AGAIN,
            )
        })?;
        file_order.extend(scanline.iter().map(|&rgbe| radiance(rgbe) * header.scale));
    }
    if header.rec709_from_file != Mat3::IDENTITY {
        for pixel in &mut file_order {
            *pixel = header.rec709_from_file * *pixel;
        }
    }
    let standard = header.fast.is_x && header.fast.increasing && !header.slow.increasing;
    let pixels = if standard { file_order } else { reorder(&file_order, &header, width, height) };
    Ok(HdrImage { width, height, pixels })
}

/// Pixels of another scan order, row-major from the top left. +X runs to the right, -Y down.
fn reorder(file_order: &[Vec3], header: &Header, width: u32, height: u32) -> Vec<Vec3> {
    let place = |axis: Axis, index: u32| {
        let from_low_end = axis.increasing == axis.is_x;
        if from_low_end { index } else { axis.count - 1 - index }
    };
    let mut pixels = vec![Vec3::ZERO; width as usize * height as usize];
    let mut source = file_order.iter();
    for i in 0..header.slow.count {
        for j in 0..header.fast.count {
            let (s, f) = (place(header.slow, i), place(header.fast, j));
            let (x, y) = if header.fast.is_x { (f, s) } else { (s, f) };
            if let Some(&color) = source.next() {
                pixels[y as usize * width as usize + x as usize] = color;
            }
        }
    }
    pixels
}

/// `mantissa * 2^(exponent - 136)`; an exponent of 0 is black.
fn radiance([r, g, b, e]: [u8; 4]) -> Vec3 {
    if e == 0 {
        return Vec3::ZERO;
    }
    let scale = libm::ldexp(1.0, i32::from(e) - 136) as f32;
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)) * scale
}

struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
}

const ENDS: &str = "the file ends here";

impl Source<'_> {
    fn byte(&mut self) -> Result<u8, &'static str> {
        let byte = *self.bytes.get(self.at).ok_or(ENDS)?;
        self.at += 1;
        Ok(byte)
    }

    fn rgbe(&mut self) -> Result<[u8; 4], &'static str> {
        let four = self.bytes.get(self.at..self.at + 4).ok_or(ENDS)?;
        self.at += 4;
        Ok([four[0], four[1], four[2], four[3]])
    }

    fn scanline(&mut self, out: &mut [[u8; 4]]) -> Result<(), &'static str> {
        let first = self.rgbe()?;
        let width = out.len();
        let announced = usize::from(first[2]) << 8 | usize::from(first[3]);
        if NEW_FORM_WIDTHS.contains(&width) && first[0] == 2 && first[1] == 2 && first[2] < 128 {
            if announced != width {
                return Err("the scanline's length is not the image's width");
            }
            (0..4).try_for_each(|component| self.new_form(out, component))
        } else {
            self.at -= 4;
            self.old_form(out)
        }
    }

    /// One component of a scanline: runs (count above 128) and literals.
    fn new_form(&mut self, out: &mut [[u8; 4]], component: usize) -> Result<(), &'static str> {
        let mut x = 0;
        while x < out.len() {
            let code = usize::from(self.byte()?);
            let count = if code > 128 { code - 128 } else { code };
            if count == 0 || x + count > out.len() {
                return Err("a run of no length or beyond the scanline's end");
            }
            if code > 128 {
                let value = self.byte()?;
                out[x..x + count].iter_mut().for_each(|pixel| pixel[component] = value);
            } else {
                let values = self.bytes.get(self.at..self.at + count).ok_or(ENDS)?;
                self.at += count;
                out[x..x + count].iter_mut().zip(values).for_each(|(pixel, &value)| pixel[component] = value);
            }
            x += count;
        }
        Ok(())
    }

    /// Flat pixels, with (1, 1, 1, n) to repeat the last one n times, 256 n times when it follows another such, and so on.
    fn old_form(&mut self, out: &mut [[u8; 4]]) -> Result<(), &'static str> {
        let mut x = 0;
        let mut shift = 0;
        while x < out.len() {
            let pixel = self.rgbe()?;
            if pixel[..3] == [1, 1, 1] {
                let Some(&last) = x.checked_sub(1).and_then(|i| out.get(i)) else {
                    return Err("a repetition before any pixel");
                };
                let count = usize::from(pixel[3]).checked_shl(shift).unwrap_or(usize::MAX);
                if shift > 24 || count > out.len() - x {
                    return Err("a run beyond the scanline's end");
                }
                out[x..x + count].fill(last);
                x += count;
                shift += 8;
            } else {
                out[x] = pixel;
                x += 1;
                shift = 0;
            }
        }
        Ok(())
    }
}
