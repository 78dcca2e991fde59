//! KTX 2: textures of numbers as they are, with layers and mip levels, packed by zlib, and pictures as BC6H (Khronos: "KTX File Format Specification", version 2.0,
//! sections 3 and 4; descriptors as of the "Khronos Data Format Specification" 1.3, section 5).
//!
//! Read is only what Heliodon writes: two-dimensional, formats of whole bytes, BC7 and BC6H, packed by zlib or as they are. Whatever else a file may be is refused in words.

mod bc6h;

pub(crate) use bc6h::halved;
pub use bc6h::{ktx2_bc6h, ktx2_of_bc6h};

use crate::ImageError;
use crate::error::COPY_AGAIN;
use flate2::Compression;
use flate2::read::ZlibDecoder;
use flate2::write::ZlibEncoder;
use std::fmt::{self, Display, Formatter};
use std::io::{Read, Write};

/// The first bytes of every KTX 2 file.
const MAGIC: [u8; 12] = [0xAB, b'K', b'T', b'X', b' ', b'2', b'0', 0xBB, 0x0D, 0x0A, 0x1A, 0x0A];
/// Bytes before the index of levels.
const HEADER_BYTES: usize = 80;
/// Bytes of a level in the index.
const LEVEL_BYTES: usize = 24;
/// Where the header says how levels are packed.
const PACKING_AT: usize = 44;
/// Where the header says where texts lie.
const VALUES_AT: usize = 56;
/// Levels packed by zlib.
const ZLIB: u32 = 3;
/// Levels that are not packed.
const AS_THEY_ARE: u32 = 0;
/// The largest side.
const MOST_TEXELS: u32 = 16_384;
/// The most layers.
const MOST_LAYERS: u32 = 2048;
/// zlib packs no more than about this many bytes to one.
const MOST_EXPANSION: u64 = 1032;

/// How the numbers of a texel are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TexelFormat {
    /// One unsigned integer of 32 bits.
    R32Uint,
    /// Four floats of 16 bits.
    Rgba16Float,
    /// Four unsigned numbers of 8 bits, from 0 to 1: colour coded as sRGB, and what is linear.
    Rgba8Srgb,
    /// Four numbers from 0 to 1, blocks of 4 x 4 texels in 16 bytes: BC7 ([`crate::encode_bc7`]).
    Bc7,
    /// The same, colour coded as sRGB and what is linear.
    Bc7Srgb,
    /// Three numbers from 0 on, blocks of 4 x 4 texels in 16 bytes: BC6H ([`crate::encode_bc6h`]).
    Bc6h,
}

impl TexelFormat {
    const ALL: [Self; 6] = [Self::R32Uint, Self::Rgba16Float, Self::Rgba8Srgb, Self::Bc7, Self::Bc7Srgb, Self::Bc6h];

    /// Numbers of a texel.
    #[must_use]
    pub fn channels(self) -> u32 {
        match self {
            Self::R32Uint => 1,
            Self::Bc6h => 3,
            Self::Rgba16Float | Self::Rgba8Srgb | Self::Bc7 | Self::Bc7Srgb => 4,
        }
    }

    fn is_block(self) -> bool {
        matches!(self, Self::Bc7 | Self::Bc7Srgb | Self::Bc6h)
    }

    /// Texels along the sides of a block: 1 where each texel has its own bytes.
    #[must_use]
    pub fn block_side(self) -> u32 {
        if self.is_block() { 4 } else { 1 }
    }

    /// Bytes of a block.
    #[must_use]
    pub fn block_bytes(self) -> u32 {
        match self {
            Self::R32Uint | Self::Rgba8Srgb => 4,
            Self::Rgba16Float => 8,
            Self::Bc7 | Self::Bc7Srgb | Self::Bc6h => 16,
        }
    }

    /// Bytes of the type that files count in, as far as byte order is concerned.
    fn type_bytes(self) -> u32 {
        match self {
            Self::Rgba8Srgb | Self::Bc7 | Self::Bc7Srgb | Self::Bc6h => 1,
            Self::Rgba16Float => 2,
            Self::R32Uint => 4,
        }
    }

    /// Vulkan's number (`VkFormat`).
    fn vk(self) -> u32 {
        match self {
            Self::Rgba8Srgb => 43,
            Self::Rgba16Float => 97,
            Self::R32Uint => 98,
            Self::Bc6h => 143,
            Self::Bc7 => 145,
            Self::Bc7Srgb => 146,
        }
    }
}

/// What a texture is but for its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ktx2Shape {
    /// How texels are stored.
    pub format: TexelFormat,
    /// Texels along u and v of the first level, 1 to 16,384.
    pub size: [u32; 2],
    /// Layers, 1 to 2,048.
    pub layers: u32,
    /// Levels, 1 to 16.
    pub levels: u32,
}

impl Display for Ktx2Shape {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { format, size: [width, height], layers, levels } = self;
        write!(f, "{format:?} of {width} x {height} texels, layers: {layers}, levels: {levels}")
    }
}

/// A texture: layers and levels of texels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ktx2 {
    /// How texels are stored.
    pub format: TexelFormat,
    /// Texels along u of the first level.
    pub width: u32,
    /// And along v.
    pub height: u32,
    /// Layers, at least 1.
    pub layers: u32,
    /// The bytes of each level from the largest on, little-endian, layer by layer, row by row.
    pub levels: Vec<Vec<u8>>,
}

impl Ktx2 {
    /// Bytes of a level, unpacked.
    #[must_use]
    pub fn level_bytes(&self, level: usize) -> u64 {
        let blocks = |texels: u32| u64::from((texels >> level).max(1).div_ceil(self.format.block_side()));
        blocks(self.width) * blocks(self.height) * u64::from(self.layers) * u64::from(self.format.block_bytes())
    }

    /// The file's bytes.
    ///
    /// # Errors
    /// Sizes that the file cannot have, levels that have not their bytes.
    pub fn to_bytes(&self, name: &str) -> Result<Vec<u8>, ImageError> {
        self.to_bytes_with(&[], name)
    }

    /// The file's bytes, with texts by their keys, which must be in the order of their bytes and without zeros; [`Self::text_of`] finds them again.
    ///
    /// # Errors
    /// As [`Self::to_bytes`].
    pub fn to_bytes_with(&self, texts: &[(&str, &str)], name: &str) -> Result<Vec<u8>, ImageError> {
        self.check_levels(name)?;
        let mut packed = vec![Vec::new(); self.levels.len()];
        for (level, packed) in self.levels.iter().zip(&mut packed) {
            let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
            let failed = |e: std::io::Error| ImageError::Write { name: name.to_owned(), problem: e.to_string() };
            encoder.write_all(level).map_err(failed)?;
            *packed = encoder.finish().map_err(failed)?;
        }
        Ok(self.file(&packed, texts, ZLIB))
    }

    /// The file's bytes with levels as they are, which a device takes without any work: larger, and faster to load. Texts are as [`Self::to_bytes_with`] takes them.
    ///
    /// # Errors
    /// As [`Self::to_bytes`].
    pub fn to_plain_bytes(&self, texts: &[(&str, &str)], name: &str) -> Result<Vec<u8>, ImageError> {
        self.check_levels(name)?;
        Ok(self.file(&self.levels, texts, AS_THEY_ARE))
    }

    fn check_levels(&self, name: &str) -> Result<(), ImageError> {
        self.check_size(name)?;
        if let Some(level) = (0..self.levels.len()).find(|&level| self.levels[level].len() as u64 != self.level_bytes(level)) {
            let problem = format!("level {level} has {} bytes, not {}", self.levels[level].len(), self.level_bytes(level));
            return Err(ImageError::Write { name: name.to_owned(), problem });
        }
        Ok(())
    }

    fn file(&self, stored: &[Vec<u8>], texts: &[(&str, &str)], packing: u32) -> Vec<u8> {
        let size = [self.width, self.height];
        let head = Head { vk: self.format.vk(), type_bytes: self.format.type_bytes(), size, packing };
        let layers = if self.layers == 1 { 0 } else { self.layers };
        let whole = (0..stored.len()).map(|level| self.level_bytes(level));
        let levels: Vec<(&[u8], u64)> = stored.iter().map(Vec::as_slice).zip(whole).collect();
        let values: Vec<u8> = texts.iter().flat_map(|(key, text)| key_value(key, text)).collect();
        // of what is not packed, texels lie where numbers of their size may
        let alignment = if packing == ZLIB { 1 } else { self.format.block_bytes().next_multiple_of(4) as usize };
        head.file(layers, &levels, &self.descriptor(), &values, alignment)
    }

    /// The text that a file has by a key, without anything of it being unpacked.
    #[must_use]
    pub fn text_of<'a>(bytes: &'a [u8], key: &str) -> Option<&'a str> {
        let number =
            |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk()).map(|&four| u32::from_le_bytes(four) as usize);
        let mut values = bytes.starts_with(&MAGIC).then(|| {
            let (at, length) = (number(VALUES_AT)?, number(VALUES_AT + 4)?);
            bytes.get(at..at.checked_add(length)?)
        })??;
        while let Some((length, rest)) = values.split_first_chunk() {
            let length = u32::from_le_bytes(*length) as usize;
            let pair = rest.get(..length)?;
            if let Some(text) = pair.strip_prefix(key.as_bytes()).and_then(|rest| rest.strip_prefix(b"\0")) {
                return std::str::from_utf8(text.strip_suffix(b"\0").unwrap_or(text)).ok();
            }
            values = rest.get(length.next_multiple_of(4)..)?;
        }
        None
    }

    /// What the texture is but for its texels.
    #[must_use]
    pub fn shape(&self) -> Ktx2Shape {
        let Self { format, width, height, layers, ref levels } = *self;
        Ktx2Shape { format, size: [width, height], layers, levels: levels.len() as u32 }
    }

    /// What the texture of a file is as its header says, before any of it is unpacked.
    ///
    /// # Errors
    /// Files of something else; `name` is theirs in the message.
    pub fn shape_of(bytes: &[u8], name: &str) -> Result<Ktx2Shape, ImageError> {
        let bad = |place: &str, problem: String| ImageError::malformed(name, place, problem, COPY_AGAIN);
        if !bytes.starts_with(&MAGIC) {
            return Err(ImageError::UnknownFormat { name: name.to_owned() });
        }
        let number = |at: usize| bytes[at..].first_chunk().map(|&four| u32::from_le_bytes(four));
        let header: Option<Vec<u32>> = (0..9).map(|i| bytes.get(12 + 4 * i..).and_then(|_| number(12 + 4 * i))).collect();
        let Some([vk, _, width, height, depth, layers, faces, levels, packing]) = header.as_deref() else {
            return Err(bad("its header", "it ends within it".to_owned()));
        };
        let Some(format) = TexelFormat::ALL.into_iter().find(|format| format.vk() == *vk) else {
            return Err(bad("its header", format!("its format {vk} is none that is read here")));
        };
        let is_known = matches!(*packing, ZLIB | AS_THEY_ARE);
        if *depth != 0 || *faces != 1 || !is_known || !(1..=16).contains(levels) {
            return Err(bad("its header", "it is not a two-dimensional texture, as it is or packed by zlib".to_owned()));
        }
        let texture = Self { format, width: *width, height: *height, layers: (*layers).max(1), levels: Vec::new() };
        texture.check_size(name)?;
        Ok(Ktx2Shape { levels: *levels, ..texture.shape() })
    }

    /// A texture from the bytes of a file. It takes no more memory than twice what the file really unpacks to, at most about 2,000 times its bytes: who knows
    /// what to expect looks at [`Ktx2::shape_of`] before.
    ///
    /// # Errors
    /// Files that are broken or hold something else; `name` is theirs in the message.
    pub fn from_bytes(bytes: &[u8], name: &str) -> Result<Self, ImageError> {
        let bad = |place: &str, problem: String| ImageError::malformed(name, place, problem, COPY_AGAIN);
        let Ktx2Shape { format, size: [width, height], layers, levels } = Self::shape_of(bytes, name)?;
        let mut texture = Self { format, width, height, layers, levels: Vec::new() };
        let is_packed = bytes.get(PACKING_AT..).and_then(<[u8]>::first_chunk) == Some(&ZLIB.to_le_bytes());
        for level in 0..levels as usize {
            let place = format!("level {level}");
            let index = bytes.get(HEADER_BYTES + LEVEL_BYTES * level..).and_then(<[u8]>::first_chunk::<LEVEL_BYTES>);
            let index = index.ok_or_else(|| bad(&place, "the file ends before it".to_owned()))?;
            let [at, len, whole] = [0, 8, 16].map(|i| index[i..].first_chunk().map_or(0, |&eight| u64::from_le_bytes(eight)));
            let packed = usize::try_from(at).ok().zip(usize::try_from(len).ok());
            let packed = packed.and_then(|(at, len)| bytes.get(at..at.checked_add(len)?));
            let packed = packed.ok_or_else(|| bad(&place, "it lies beyond the file".to_owned()))?;
            let wanted = texture.level_bytes(level);
            if whole != wanted || wanted > (len + 1) * MOST_EXPANSION {
                return Err(bad(&place, format!("it says {whole} bytes from {len}, its size asks for {wanted}")));
            }
            if !is_packed {
                if len != wanted {
                    return Err(bad(&place, format!("it has {len} bytes, not {wanted}")));
                }
                texture.levels.push(packed.to_vec());
                continue;
            }
            // what a header asks for is not given before the texels are there
            let mut unpacked = Vec::new();
            ZlibDecoder::new(packed).take(wanted + 1).read_to_end(&mut unpacked).map_err(|e| bad(&place, e.to_string()))?;
            if unpacked.len() as u64 != wanted {
                return Err(bad(&place, format!("it has not {wanted} bytes")));
            }
            texture.levels.push(unpacked);
        }
        Ok(texture)
    }

    pub(crate) fn check_size(&self, name: &str) -> Result<(), ImageError> {
        let sides = [self.width, self.height].iter().all(|side| (1..=MOST_TEXELS).contains(side));
        if sides && (1..=MOST_LAYERS).contains(&self.layers) {
            return Ok(());
        }
        let problem = format!("{} x {} texels in {} layers", self.width, self.height, self.layers);
        Err(ImageError::malformed(name, "its size", problem, "sides are 1 to 16,384 texels, layers 1 to 2,048"))
    }

    /// The data format descriptor: what each channel is, for programs that do not know Vulkan's numbers.
    fn descriptor(&self) -> Vec<u8> {
        const BLOCK_BYTES: u32 = 24;
        const SAMPLE_BYTES: u32 = 16;
        /// RGBSDA, BT.709, linear,
        const MODEL: [u8; 4] = [1, 1, 1, 0];
        /// or coded as sRGB, and multiplied with alpha.
        const SRGB_MODEL: [u8; 4] = [1, 1, 2, 1];
        const VERSION: u32 = 2;
        const ALPHA: u32 = 15;
        const LINEAR: u32 = 0x10;
        let format = self.format;
        match format {
            TexelFormat::Bc7 => return block_descriptor(BC7_MODEL, [0, u32::MAX]),
            TexelFormat::Bc7Srgb => return block_descriptor(BC7_SRGB_MODEL, [0, u32::MAX]),
            TexelFormat::Bc6h => return block_descriptor(bc6h::MODEL, [0, 1.0_f32.to_bits()]),
            _ => {}
        }
        let channels = format.channels();
        let block = BLOCK_BYTES + SAMPLE_BYTES * channels;
        let mut bytes = Vec::new();
        for number in [4 + block, 0, VERSION | block << 16] {
            bytes.extend(number.to_le_bytes());
        }
        let is_srgb = format == TexelFormat::Rgba8Srgb;
        bytes.extend(if is_srgb { SRGB_MODEL } else { MODEL });
        bytes.extend([0_u8; 4]);
        bytes.extend([format.block_bytes() as u8, 0, 0, 0, 0, 0, 0, 0]);
        let bits = 8 * format.type_bytes();
        // floats are signed, from -1 to 1 as far as programs that know nothing else are concerned
        let (kind, low, high) = match format {
            TexelFormat::Rgba16Float => (0xC0, (-1.0_f32).to_bits(), 1.0_f32.to_bits()),
            TexelFormat::Rgba8Srgb => (0, 0, 255),
            _ => (0, 0, 1),
        };
        for channel in 0..channels {
            let id = if channel == 3 { ALPHA } else { channel };
            // alpha is never coded
            let kind = if is_srgb && channel == 3 { LINEAR } else { kind };
            let numbers = [(channel * bits) | (bits - 1) << 16 | (id | kind) << 24, 0, low, high];
            numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        }
        bytes
    }
}

/// `KHR_DF_MODEL_BC7`, primaries of Rec. 709, linear, alpha straight.
const BC7_MODEL: u32 = 134 | 1 << 8 | 1 << 16;
/// The same, coded as sRGB.
const BC7_SRGB_MODEL: u32 = 134 | 1 << 8 | 2 << 16;

/// The descriptor of blocks of four by four texels, sixteen bytes, of one sample: its model, and the sample's lowest and highest number.
fn block_descriptor(model: u32, limits: [u32; 2]) -> Vec<u8> {
    let size = 24 + 16;
    // the lengths of the descriptor and of its one block, version 2; then the texel block's sides less one, and its bytes
    let head = [4 + size, 0, 2 | size << 16, model, 3 | 3 << 8, 16, 0];
    // 128 bits from bit 0 on; BC6H's are floats
    let kind = if model == bc6h::MODEL { 0x80 << 24 } else { 0 };
    let sample = [127 << 16 | kind, 0, limits[0], limits[1]];
    head.iter().chain(&sample).flat_map(|word| word.to_le_bytes()).collect()
}

/// A text by its key, as files hold it.
fn key_value(key: &str, value: &str) -> Vec<u8> {
    let text = [key.as_bytes(), b"\0", value.as_bytes(), b"\0"].concat();
    let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
    bytes.extend(text);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

/// What the beginning of a file says of its texture.
struct Head {
    /// Vulkan's number of the format.
    vk: u32,
    /// Bytes of its type, as far as byte order is concerned.
    type_bytes: u32,
    size: [u32; 2],
    /// How levels are packed.
    packing: u32,
}

impl Head {
    /// A file of levels from the largest on, each with its bytes unpacked, that begin at multiples of `alignment`.
    fn file(&self, layers: u32, levels: &[(&[u8], u64)], descriptor: &[u8], values: &[u8], alignment: usize) -> Vec<u8> {
        let descriptor_at = HEADER_BYTES + LEVEL_BYTES * levels.len();
        let values_at = descriptor_at + descriptor.len();
        // the smallest level lies first
        let mut places = vec![0; levels.len()];
        let mut end = values_at + values.len();
        for (level, (bytes, _)) in levels.iter().enumerate().rev() {
            places[level] = end.next_multiple_of(alignment);
            end = places[level] + bytes.len();
        }
        let [width, height] = self.size;
        let head = [self.vk, self.type_bytes, width, height, 0, layers, 1, levels.len() as u32, self.packing];
        let values_at = if values.is_empty() { 0 } else { values_at };
        let index = [descriptor_at, descriptor.len(), values_at, values.len(), 0, 0, 0, 0].map(|word| word as u32);
        let mut file = MAGIC.to_vec();
        file.extend(head.iter().chain(&index).flat_map(|word| word.to_le_bytes()));
        for (place, (bytes, whole)) in places.iter().zip(levels) {
            let entry = [*place as u64, bytes.len() as u64, *whole];
            file.extend(entry.iter().flat_map(|word| word.to_le_bytes()));
        }
        file.extend(descriptor);
        file.extend(values);
        for (place, (bytes, _)) in places.iter().zip(levels).rev() {
            file.resize(*place, 0);
            file.extend(*bytes);
        }
        file
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texture(format: TexelFormat, layers: u32) -> Ktx2 {
        let mut texture = Ktx2 { format, width: 12, height: 5, layers, levels: Vec::new() };
        for level in 0..3 {
            texture.levels.push((0..texture.level_bytes(level)).map(|i| (i * i % 251) as u8).collect());
        }
        texture
    }

    #[test]
    fn what_is_written_is_read() {
        for (format, layers) in TexelFormat::ALL.into_iter().zip([7, 3, 1]) {
            let written = texture(format, layers);
            let bytes = written.to_bytes("a.ktx2").unwrap();
            assert_eq!(Ktx2::from_bytes(&bytes, "a.ktx2").unwrap(), written);
            assert_eq!(written.level_bytes(2), 3 * u64::from(layers * format.block_bytes()));
        }
    }

    #[test]
    fn what_is_written_plainly_is_read_and_lies_where_devices_want_it() {
        for format in TexelFormat::ALL {
            let written = texture(format, 1);
            let bytes = written.to_plain_bytes(&[("KTXwriter", "us")], "a.ktx2").unwrap();
            assert_eq!(Ktx2::from_bytes(&bytes, "a.ktx2").unwrap(), written);
            assert_eq!(Ktx2::text_of(&bytes, "KTXwriter"), Some("us"));
            let at = u64::from_le_bytes(bytes[HEADER_BYTES..HEADER_BYTES + 8].try_into().unwrap());
            assert!(at.is_multiple_of(u64::from(format.block_bytes())), "{format:?}: {at}");
            for len in 0..bytes.len() {
                assert!(Ktx2::from_bytes(&bytes[..len], "a").is_err(), "{len} of {}", bytes.len());
            }
        }
    }

    #[test]
    fn a_header_that_asks_for_more_than_there_is_gets_no_memory() {
        // a few kilobytes that unpack to a few megabytes, said to be 16,384 layers' worth of them
        let honest =
            Ktx2 { format: TexelFormat::R32Uint, width: 1024, height: 1024, layers: 1, levels: vec![vec![0; 4 << 20]] };
        let mut bytes = honest.to_bytes("a").unwrap();
        assert_eq!(Ktx2::shape_of(&bytes, "a").unwrap(), honest.shape());
        assert_eq!(honest.shape().to_string(), "R32Uint of 1024 x 1024 texels, layers: 1, levels: 1");
        let padded = 8 << 20;
        let mut put = |at: usize, number: &[u8]| bytes[at..at + number.len()].copy_from_slice(number);
        // 2,048 layers, 8 GiB, of a level that reaches to the end of a file of 8 MiB
        put(32, &2048_u32.to_le_bytes());
        put(HEADER_BYTES + 8, &(padded - 1000_u64).to_le_bytes());
        put(HEADER_BYTES + 16, &(8_u64 << 30).to_le_bytes());
        bytes.resize(padded as usize, 0);
        assert_eq!(Ktx2::shape_of(&bytes, "a").unwrap().layers, 2048);
        let error = Ktx2::from_bytes(&bytes, "a").unwrap_err().to_string();
        assert!(error.contains("it has not 8589934592 bytes"), "{error}");
    }

    #[test]
    fn broken_files_are_refused_in_words() {
        let bytes = texture(TexelFormat::Rgba16Float, 2).to_bytes("a").unwrap();
        for len in 0..bytes.len() {
            assert!(Ktx2::from_bytes(&bytes[..len], "a").is_err(), "{len} of {}", bytes.len());
        }
        for at in 0..bytes.len() {
            let mut other = bytes.clone();
            other[at] ^= 0x41;
            // no panic; the descriptor and unused numbers may say what they like
            drop(Ktx2::from_bytes(&other, "a"));
        }
        let mut large = texture(TexelFormat::R32Uint, 1);
        large.width = 20_000;
        assert!(large.to_bytes("a").unwrap_err().to_string().contains("16,384"));
        large.width = 11;
        assert!(large.to_bytes("a").unwrap_err().to_string().contains("level 0 has"));
    }
}
