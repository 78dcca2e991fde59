//! An MP4 file of one H.264 track at a constant frame rate, with its index before its frames, so that a browser shows the
//! first frame before it has read the last.
//!
//! ISO/IEC 14496-12 (boxes) and 14496-15 (avc1, avcC). Own code rather than a crate: the two that are kept were weighed in
//! `docs/decisions/009-film.md`; what a film of ours needs is the boxes below.

use std::io::{self, Write};

/// Ticks per frame; the time scale is the frame rate in frames per 1,000 seconds, so that 23.976 is exact too.
const TICKS_PER_FRAME: u32 = 1000;

/// One encoded picture.
#[derive(Clone, Debug)]
pub struct Sample {
    /// NAL units, each after its length as a big-endian u32, without parameter sets.
    pub data: Vec<u8>,
    /// Whether a player can begin here.
    pub key: bool,
}

/// What the track's header says.
#[derive(Clone, Debug)]
pub struct Track {
    /// Columns of the picture.
    pub width: u16,
    /// Rows of the picture.
    pub height: u16,
    /// Frames per 1,000 seconds.
    pub frames_per_1000_s: u32,
    /// Sequence parameter set, as a NAL unit without start code.
    pub sequence_parameters: Vec<u8>,
    /// Picture parameter set, likewise.
    pub picture_parameters: Vec<u8>,
}

/// Writes the whole film.
///
/// # Errors
/// Those of `out`, and [`io::ErrorKind::InvalidInput`] for a film without frames, of 4 GiB and more, or without parameter
/// sets.
pub fn write(out: &mut dyn Write, track: &Track, samples: &[Sample]) -> io::Result<()> {
    let invalid = |what: &str| io::Error::new(io::ErrorKind::InvalidInput, what.to_owned());
    if samples.is_empty() {
        return Err(invalid("a film needs at least one frame"));
    }
    if track.sequence_parameters.len() < 4 || track.picture_parameters.is_empty() {
        return Err(invalid("the encoder gave no parameter sets"));
    }
    let payload: u64 = samples.iter().map(|sample| sample.data.len() as u64).sum();
    let file_type = boxed(b"ftyp", &[b"isom", &0x200_u32.to_be_bytes(), b"isom", b"iso2", b"avc1", b"mp41"]);
    // The index holds the frames' offset, and its own length does not depend on that number's value.
    let index_length = index(track, samples, 0).len();
    let first_frame = (file_type.len() + index_length + 8) as u64;
    if first_frame + payload > u64::from(u32::MAX) {
        return Err(invalid("the film is longer than 4 GiB; make it shorter, or smaller"));
    }
    out.write_all(&file_type)?;
    out.write_all(&index(track, samples, first_frame as u32))?;
    out.write_all(&(payload as u32 + 8).to_be_bytes())?;
    out.write_all(b"mdat")?;
    for sample in samples {
        out.write_all(&sample.data)?;
    }
    out.flush()
}

fn boxed(kind: &[u8; 4], parts: &[&[u8]]) -> Vec<u8> {
    let length = 8 + parts.iter().map(|part| part.len()).sum::<usize>();
    let mut bytes = Vec::with_capacity(length);
    bytes.extend((length as u32).to_be_bytes());
    bytes.extend(kind);
    for part in parts {
        bytes.extend(*part);
    }
    bytes
}

/// Big-endian words, one after the other.
fn words(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

/// The identity as ISO/IEC 14496-12 stores a video matrix: 16.16 numbers, the last column 2.30.
const IDENTITY: [u32; 9] = [0x1_0000, 0, 0, 0, 0x1_0000, 0, 0, 0, 0x4000_0000];

fn index(track: &Track, samples: &[Sample], first_frame: u32) -> Vec<u8> {
    let duration = samples.len() as u32 * TICKS_PER_FRAME;
    let timescale = track.frames_per_1000_s;
    let movie_header = boxed(
        b"mvhd",
        &[
            &words(&[0, 0, 0, timescale, duration, 0x1_0000]),
            &0x0100_u16.to_be_bytes(),
            &[0; 10],
            &words(&IDENTITY),
            &[0; 24],
            &words(&[2]),
        ],
    );
    let (width, height) = (u32::from(track.width), u32::from(track.height));
    let track_header = boxed(
        b"tkhd",
        &[
            // enabled, in the movie, in the preview
            &words(&[7, 0, 0, 1, 0, duration, 0, 0, 0, 0]),
            &words(&IDENTITY),
            &words(&[width << 16, height << 16]),
        ],
    );
    const UNDETERMINED_LANGUAGE: u32 = 0x55C4 << 16;
    let media_header = boxed(b"mdhd", &[&words(&[0, 0, 0, timescale, duration, UNDETERMINED_LANGUAGE])]);
    let handler = boxed(b"hdlr", &[&words(&[0, 0]), b"vide", &words(&[0, 0, 0]), b"Heliodon\0"]);
    let video_header = boxed(b"vmhd", &[&words(&[1, 0, 0])]);
    let same_file = boxed(b"dref", &[&words(&[0, 1]), &boxed(b"url ", &[&words(&[1])])]);
    let data_information = boxed(b"dinf", &[&same_file]);
    let media_information = boxed(b"minf", &[&video_header, &data_information, &sample_table(track, samples, first_frame)]);
    let media = boxed(b"mdia", &[&media_header, &handler, &media_information]);
    boxed(b"moov", &[&movie_header, &boxed(b"trak", &[&track_header, &media])])
}

fn sample_table(track: &Track, samples: &[Sample], first_frame: u32) -> Vec<u8> {
    let frames = samples.len() as u32;
    let description = boxed(b"stsd", &[&words(&[0, 1]), &visual_sample_entry(track)]);
    let times = boxed(b"stts", &[&words(&[0, 1, frames, TICKS_PER_FRAME])]);
    let keys: Vec<u32> = (1..).zip(samples).filter(|(_, sample)| sample.key).map(|(number, _)| number).collect();
    let key_frames = boxed(b"stss", &[&words(&[0, keys.len() as u32]), &words(&keys)]);
    let one_chunk = boxed(b"stsc", &[&words(&[0, 1, 1, frames, 1])]);
    let lengths: Vec<u32> = samples.iter().map(|sample| sample.data.len() as u32).collect();
    let sizes = boxed(b"stsz", &[&words(&[0, 0, frames]), &words(&lengths)]);
    let offsets = boxed(b"stco", &[&words(&[0, 1, first_frame])]);
    boxed(b"stbl", &[&description, &times, &key_frames, &one_chunk, &sizes, &offsets])
}

fn visual_sample_entry(track: &Track) -> Vec<u8> {
    let (sps, pps) = (&track.sequence_parameters, &track.picture_parameters);
    let decoder = boxed(
        b"avcC",
        &[
            // version 1; profile, compatibility and level as the parameter set has them; lengths of 4 bytes; one set
            &[1, sps[1], sps[2], sps[3], 0xFF, 0xE1],
            &(sps.len() as u16).to_be_bytes(),
            sps,
            &[1],
            &(pps.len() as u16).to_be_bytes(),
            pps,
        ],
    );
    // BT.709 primaries, transfer and matrix, video range, as `colour` converts and as the parameter set says.
    let colour = boxed(b"colr", &[b"nclx", &[0, 1, 0, 1, 0, 1, 0]]);
    let square_pixels = boxed(b"pasp", &[&words(&[1, 1])]);
    let mut name = [0; 32];
    name[..9].copy_from_slice(b"\x08Heliodon");
    const DPI_72: u32 = 72 << 16;
    boxed(
        b"avc1",
        &[
            &[0, 0, 0, 0, 0, 0, 0, 1],
            &[0; 16],
            &track.width.to_be_bytes(),
            &track.height.to_be_bytes(),
            &words(&[DPI_72, DPI_72, 0]),
            &1_u16.to_be_bytes(),
            &name,
            &24_u16.to_be_bytes(),
            &0xFFFF_u16.to_be_bytes(),
            &decoder,
            &colour,
            &square_pixels,
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track() -> Track {
        Track {
            width: 64,
            height: 48,
            frames_per_1000_s: 30_000,
            sequence_parameters: vec![0x67, 77, 0, 30, 1, 2, 3],
            picture_parameters: vec![0x68, 9],
        }
    }

    /// The bytes of the box at `path`, and where they begin.
    fn find<'a>(bytes: &'a [u8], at: usize, path: &[&[u8; 4]]) -> (usize, &'a [u8]) {
        let mut position = 0;
        while position < bytes.len() {
            let length = u32::from_be_bytes(bytes[position..position + 4].try_into().unwrap()) as usize;
            let content = &bytes[position + 8..position + length];
            if bytes[position + 4..position + 8] == path[0][..] {
                return if path.len() == 1 {
                    (at + position + 8, content)
                } else {
                    find(content, at + position + 8, &path[1..])
                };
            }
            position += length;
        }
        panic!("no box {:?}", String::from_utf8_lossy(path[0]));
    }

    #[test]
    fn the_index_leads_to_the_frames() {
        let samples = [
            Sample { data: vec![0, 0, 0, 2, 0x65, 1], key: true },
            Sample { data: vec![0, 0, 0, 1, 0x41], key: false },
            Sample { data: vec![0, 0, 0, 3, 0x65, 2, 3], key: true },
        ];
        let mut file = Vec::new();
        write(&mut file, &track(), &samples).unwrap();
        let table: [&[u8; 4]; 4] = [b"moov", b"trak", b"mdia", b"minf"];
        let leaf = |kind: &'static [u8; 4]| {
            let path: Vec<&[u8; 4]> = table.iter().copied().chain([b"stbl", kind]).collect();
            find(&file, 0, &path).1.chunks(4).map(|word| u32::from_be_bytes(word.try_into().unwrap())).collect::<Vec<_>>()
        };
        assert_eq!(leaf(b"stsz"), [0, 0, 3, 6, 5, 7]);
        assert_eq!(leaf(b"stss"), [0, 2, 1, 3]);
        assert_eq!(leaf(b"stts"), [0, 1, 3, TICKS_PER_FRAME]);
        let (media_start, media) = find(&file, 0, &[b"mdat"]);
        assert_eq!(leaf(b"stco"), [0, 1, media_start as u32]);
        assert_eq!(media, samples.iter().flat_map(|sample| sample.data.clone()).collect::<Vec<_>>());
        assert!(file.len() == media_start + media.len() && find(&file, 0, &[b"moov"]).0 < media_start);
    }

    #[test]
    fn a_film_without_frames_is_refused() {
        assert_eq!(write(&mut Vec::new(), &track(), &[]).unwrap_err().kind(), io::ErrorKind::InvalidInput);
    }
}
