//! What is written is read again; what is read is what there is.

use crate::{counting_film, ffmpeg, grey, made, number_of};
use heliodon_film::{
    Film, FilmFormat, FilmWriter, FrameReader, Rate, ReadParams, SoundReader, SoundSource, Source, WriteParams,
};

const RATE: Rate = Rate { numerator: 24_000, denominator: 1001 };

fn read(film: &Film, params: &ReadParams) -> Vec<heliodon_film::Frame> {
    let mut reader = FrameReader::open(Source::Film(film.clone()), params).unwrap();
    std::iter::from_fn(|| reader.next_frame().unwrap()).collect()
}

#[test]
fn frames_come_back_in_order_and_from_anywhere() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // what would be an option and a protocol elsewhere is a name here
    for name in ["plain.mp4", "-y.mp4", "concat:a|b.mp4", "a b%'\"é.mp4"] {
        let path = folder.path().join(name);
        counting_film(&path, 32, 18, RATE, 50);
        let film = Film::probe(&path).unwrap();
        assert_eq!((film.width, film.height, film.rate, film.frames()), (32, 18, RATE, Some(50)), "{name}");
        assert!(!film.alpha && film.sound.is_none() && film.rate_known && !film.rate_varies && film.subsampled);
        let frames = read(&film, &ReadParams::archival());
        assert_eq!(frames.len(), 50);
        for (k, frame) in (0..).zip(&frames) {
            assert_eq!((frame.number, number_of(frame.pixels[40][1])), (k, k % 20));
            assert!(frame.pixels.iter().all(|p| p[0].abs_diff(grey(k)) <= 2 && p[3] == 255), "{:?}", frame.pixels[0]);
        }
    }
    let film = Film::probe(folder.path().join("plain.mp4")).unwrap();
    for start in [1, 7, 23, 24, 49] {
        let frames = read(&film, &ReadParams { start, ..ReadParams::archival() });
        let numbers: Vec<u64> = frames.iter().map(|frame| number_of(frame.pixels[0][0])).collect();
        assert_eq!(numbers, (start..50).map(|k| k % 20).collect::<Vec<_>>(), "from {start}");
        assert_eq!(frames[0].number, start);
    }
    assert!(read(&film, &ReadParams { start: 60, ..ReadParams::archival() }).is_empty());
    let half = read(
        &film,
        &ReadParams {
            rate: Some(Rate { numerator: 12_000, denominator: 1001 }),
            size: Some((16, 10)),
            ..ReadParams::archival()
        },
    );
    assert!((24..=26).contains(&half.len()) && half[0].width == 16 && half[0].pixels.len() == 160);
}

#[test]
fn loops_have_no_gap_whether_they_fit_into_memory_or_not() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // the larger has more bytes of pictures than are kept
    for (width, height, count, read) in [(32, 18, 13, 60), (720, 720, 40, 100)] {
        let path = folder.path().join("loop.mp4");
        counting_film(&path, width, height, RATE, count);
        let film = Film::probe(&path).unwrap();
        let mut reader = FrameReader::open(Source::Film(film), &ReadParams::playing()).unwrap();
        let mut pixels = Vec::new();
        for k in 0..read {
            assert_eq!(reader.read_into(&mut pixels).unwrap(), Some(k));
            assert_eq!(number_of(pixels[5][0]), k % count % 20, "{width}x{height} {k}");
        }
        assert_eq!(reader.length(), Some(count));
        reader.stopper().stop();
        while reader.read_into(&mut pixels).unwrap().is_some() {}
    }
}

#[test]
fn colours_and_alpha_survive_every_format() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (96, 64);
    let picture = |k: u32| -> Vec<[u8; 4]> {
        (0..width * height)
            .map(|i| {
                let (x, y) = (i % width, i / width);
                [[200, 60, 40, 255], [40, 160, 60, 128], [30, 50, 190, 255], [0, 0, 0, 0]][(x / 48 + y / 32 * 2) as usize]
                    .map(|c: u8| c.saturating_add(k as u8))
            })
            .collect()
    };
    for (name, format, tolerance) in
        [("a.mp4", FilmFormat::H264, 6), ("a.webm", FilmFormat::Vp9 { alpha: true }, 8), ("a%03d.png", FilmFormat::Pictures, 0)]
    {
        let path = folder.path().join(name);
        let params = WriteParams { format, ..WriteParams::archival(width, height, RATE) };
        let mut writer = FilmWriter::rgba(&path, &params).unwrap();
        (0..3).for_each(|k| writer.write_rgba(&picture(k)).unwrap());
        assert!(writer.write_rgba(&[[0; 4]]).is_err());
        writer.finish().unwrap();
        let film = Film::probe(&path).unwrap();
        assert_eq!((film.alpha, film.width, film.height), (format != FilmFormat::H264, width, height), "{name}");
        let frames = read(&film, &ReadParams::archival());
        assert_eq!(frames.len(), 3);
        for (k, frame) in (0..).zip(&frames) {
            for (x, y) in [(20, 12), (70, 12), (20, 50), (70, 50)] {
                let (got, want) = (frame.pixels[y * width as usize + x], picture(k)[y * width as usize + x]);
                let channels = if film.alpha { 0..4 } else { 0..3 };
                assert!(channels.clone().all(|c| got[c].abs_diff(want[c]) <= tolerance), "{name} {k}: {got:?} {want:?}");
            }
        }
    }
    let odd = WriteParams::archival(321, 193, RATE);
    assert!(FilmWriter::rgba(&folder.path().join("odd.mp4"), &odd).unwrap_err().to_string().contains("even sides"));
    let lost =
        FilmWriter::rgba(&folder.path().join("none/a.mp4"), &WriteParams::archival(64, 64, RATE)).and_then(|mut writer| {
            (0..100).try_for_each(|_| writer.write_rgba(&vec![[0; 4]; 64 * 64]))?;
            writer.finish()
        });
    let told = lost.unwrap_err().to_string();
    assert!(told.contains("No such file") && told.contains("folder"), "{told}");
}

/// A flash and a click at the same time, a film that carries both, and both read again within a frame.
#[test]
fn sound_is_taken_along_and_begins_with_the_pictures() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (source, copy) = (folder.path().join("source.mp4"), folder.path().join("copy.mp4"));
    let flash = "color=black:s=64x64:r=25:d=3,geq=lum='if(between(T,1.0,1.039),235,16)':cb=128:cr=128";
    let click = "aevalsrc='if(between(t,1,1.04),sin(2*PI*1000*t),0)':s=48000:d=3";
    made(&["-f", "lavfi", "-i", flash, "-f", "lavfi", "-i", click, "-c:a", "aac", "-pix_fmt", "yuv420p"], &source);
    let film = Film::probe(&source).unwrap();
    let sound = film.sound.clone().unwrap();
    assert_eq!((sound.rate_hz, sound.channels, sound.codec.as_str()), (48_000, 1, "aac"));
    for start in [0, 10] {
        let sound = SoundSource { film: film.clone(), start_s: film.rate.time_of(start), length_s: None };
        let params = WriteParams { sound: Some(sound), ..WriteParams::archival(64, 64, film.rate) };
        let mut writer = FilmWriter::rgba(&copy, &params).unwrap();
        for frame in read(&film, &ReadParams { start, ..ReadParams::archival() }) {
            writer.write_rgba(&frame.pixels).unwrap();
        }
        writer.finish().unwrap();
        let written = Film::probe(&copy).unwrap();
        let frames = read(&written, &ReadParams::archival());
        let seen = frames.iter().position(|frame| frame.pixels[0][0] > 128).unwrap() as f64 / 25.0;
        let mut reader = SoundReader::open(&written, 0.0, 48_000, 2).unwrap().unwrap();
        let mut samples = vec![0.0; 2 * 48_000];
        let mut all = Vec::new();
        while let count @ 1.. = reader.read(&mut samples) {
            all.extend_from_slice(&samples[..count]);
        }
        let heard = all.iter().position(|s| s.abs() > 0.2).unwrap() as f64 / 96_000.0;
        assert!((seen - heard).abs() < 0.04, "seen at {seen}, heard at {heard}");
        assert!((seen - (1.0 - film.rate.time_of(start))).abs() < 0.001);
        let mut later = SoundReader::open(&written, heard - 0.2, 48_000, 1).unwrap().unwrap();
        let count = later.read(&mut samples[..48_000]);
        let found = samples[..count].iter().position(|s| s.abs() > 0.2).unwrap() as f64 / 48_000.0;
        assert!((found - 0.2).abs() < 0.03, "{found}");
    }
    let silent = folder.path().join("silent.mp4");
    counting_film(&silent, 32, 32, RATE, 3);
    assert!(SoundReader::open(&Film::probe(&silent).unwrap(), 0.0, 48_000, 2).unwrap().is_none());
}
