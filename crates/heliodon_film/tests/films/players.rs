//! Players against a clock of our own: what is tested is which frames are shown, never how fast this machine is.

use crate::{counting_film, ffmpeg, number_of};
use heliodon_film::{Film, FilmFormat, FilmWriter, Player, PlayerParams, Rate, Shown, Source, WriteParams};
use std::path::Path;
use std::time::{Duration, Instant};

const RATE: Rate = Rate { numerator: 30, denominator: 1 };
/// Nothing here takes this long on a machine that works at all.
const PATIENCE: Duration = Duration::from_secs(60);

/// Asks for a time until its own frame is there.
fn wait_for(player: &Player, time_s: f64) -> Shown {
    let begun = Instant::now();
    loop {
        if let Some(shown) = player.frame_at(time_s)
            && shown.frame.number == shown.wanted
        {
            return shown;
        }
        assert!(player.problem().is_none(), "{:?}", player.problem());
        assert!(begun.elapsed() < PATIENCE, "frame at {time_s} s never came");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn film(path: &Path, count: u64) -> Film {
    counting_film(path, 64, 48, RATE, count);
    Film::probe(path).unwrap()
}

#[test]
fn time_is_followed_paused_sought_and_looped() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let film = film(&folder.path().join("a.mp4"), 90);
    let player = Player::start(Source::Film(film.clone()), &PlayerParams::playing()).unwrap();
    assert_eq!((player.rate(), player.size()), (RATE, (64, 48)));
    // on over the end of the loop, each frame once
    for k in 0..200_u64 {
        let shown = wait_for(&player, RATE.time_of(k) + 0.001);
        assert_eq!((shown.frame.number, number_of(shown.frame.pixels[0][0])), (k, k % 90 % 20));
    }
    // a pause is the same frame, and nothing moves
    let paused = wait_for(&player, 6.0);
    assert!((0..5).all(|_| player.frame_at(6.0).unwrap().frame.number == paused.frame.number));
    // back, far ahead, into a later pass
    for (time, content) in [(0.5, 15), (2.9, 87), (6.1, 183 % 90), (0.0, 0), (30.0, 900 % 90)] {
        let shown = wait_for(&player, time);
        assert_eq!(number_of(shown.frame.pixels[0][0]), content % 20, "at {time} s");
    }
    // a step back of one frame needs no search
    let _ = wait_for(&player, 30.2);
    let begun = player.frame_at(30.2 - 1.0 / 30.0).unwrap();
    assert_eq!(begun.frame.number, begun.wanted);
    // the middle of nowhere is the beginning
    for odd in [-5.0, f64::NAN] {
        let _ = player.frame_at(odd);
    }
    assert_eq!(wait_for(&player, -5.0).frame.number, 0);
}

#[test]
fn the_last_frame_stays_where_nothing_loops() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let film = film(&folder.path().join("a.mp4"), 20);
    let player = Player::start(Source::Film(film), &PlayerParams::once()).unwrap();
    for k in 0..20 {
        let _ = wait_for(&player, RATE.time_of(k));
    }
    let begun = Instant::now();
    while player.end_s().is_none() {
        assert!(begun.elapsed() < PATIENCE);
        let _ = player.frame_at(0.7);
    }
    assert_eq!(player.frame_at(100.0).unwrap().frame.number, 19);
    assert!((player.end_s().unwrap() - 20.0 / 30.0).abs() < 1e-9);
    assert_eq!(number_of(wait_for(&player, 0.1).frame.pixels[0][0]), 3);
}

#[test]
fn an_image_and_its_mask_keep_step() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (image, mask) = (film(&folder.path().join("a.image.mp4"), 60), film(&folder.path().join("a.mask.mp4"), 60));
    let player = Player::start(Source::Pair { image, mask }, &PlayerParams::playing()).unwrap();
    for k in (0..150).chain([15, 700]) {
        let shown = wait_for(&player, RATE.time_of(k) + 0.01);
        for pixel in &shown.frame.pixels {
            assert_eq!((number_of(pixel[0]), number_of(255 - pixel[3])), (k % 60 % 20, k % 60 % 20), "frame {k}: {pixel:?}");
        }
    }
}

#[test]
fn asking_never_waits_and_dropping_leaves_nothing() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large.mp4");
    let params = WriteParams { format: FilmFormat::H264, quality: 30, ..WriteParams::archival(1280, 960, RATE) };
    let mut writer = FilmWriter::grey(&path, &params).unwrap();
    (0..40).for_each(|k| writer.write_grey(&vec![k; 1280 * 960]).unwrap());
    writer.finish().unwrap();
    let film = Film::probe(&path).unwrap();
    for wait_ms in [0, 1, 30, 200] {
        let player = Player::start(Source::Film(film.clone()), &PlayerParams::playing()).unwrap();
        // before anything can be decoded: an answer all the same
        let asked: Vec<Duration> = (0..200)
            .map(|k| {
                let begun = Instant::now();
                let _ = player.frame_at(f64::from(k) * 10.0);
                begun.elapsed()
            })
            .collect();
        // the median, for a busy machine stops any thread for a while
        let mut sorted = asked;
        sorted.sort();
        assert!(sorted[100] < Duration::from_millis(5), "{:?}", sorted[100]);
        std::thread::sleep(Duration::from_millis(wait_ms));
        drop(player);
    }
    #[cfg(target_os = "linux")]
    {
        // children of this process that play the large film, zombies among them: other tests have others
        let own = std::process::id().to_string();
        let left = std::fs::read_dir("/proc").unwrap().flatten().filter(|entry| {
            let read = |name: &str| std::fs::read_to_string(entry.path().join(name)).unwrap_or_default();
            let of_ours = read("status").lines().any(|line| line.starts_with("PPid:") && line.ends_with(&format!("\t{own}")));
            of_ours && read("cmdline").contains("large.mp4")
        });
        assert_eq!(left.count(), 0);
    }
}

#[test]
fn what_cannot_be_played_says_why() {
    if !ffmpeg() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mp4");
    let film = film(&path, 10);
    std::fs::write(&path, b"gone").unwrap();
    let player = Player::start(Source::Film(film), &PlayerParams::playing()).unwrap();
    let begun = Instant::now();
    while player.problem().is_none() {
        assert!(begun.elapsed() < PATIENCE && player.frame_at(0.0).is_none());
    }
    assert!(player.problem().unwrap().to_string().contains("not one frame"));
}
