//! Photographs are asked for one after the other, each once.

use crate::BENCH;
use heliodon_image::{ImageError, Picture, SrgbImage};
use heliodon_photo::camera::{Camera, Intrinsics};
use heliodon_photo::project::PhotoFile;
use heliodon_photo::texture::{Photograph, PictureSource, Survey, TextureError, TextureParams, Textured, texture};
use heliodon_testkit::process::peak_bytes;
use std::cell::Cell;
use std::time::Instant;

/// What a source was asked for.
#[derive(Default)]
struct Asked {
    held: Cell<u32>,
    most_held: Cell<u32>,
    shown: Cell<u32>,
}

struct Counted<'a> {
    picture: &'a Picture,
    asked: &'a Asked,
}

impl PictureSource for Counted<'_> {
    fn size(&self) -> Result<Option<[u32; 2]>, ImageError> {
        Ok(None)
    }

    fn show(&self, look: &mut dyn FnMut(&Picture)) -> Result<Vec<String>, ImageError> {
        let Asked { held, most_held, shown } = self.asked;
        shown.set(shown.get() + 1);
        held.set(held.get() + 1);
        most_held.set(most_held.get().max(held.get()));
        look(self.picture);
        held.set(held.get() - 1);
        Ok(vec![format!("shown as number {}", shown.get())])
    }
}

#[test]
fn each_photograph_is_asked_for_once_and_one_is_held() {
    let bench = &*BENCH;
    let asked = Asked::default();
    let sources: Vec<Counted> = bench.pictures.iter().map(|picture| Counted { picture, asked: &asked }).collect();
    let mut photographs = bench.photographs();
    photographs.iter_mut().zip(&sources).for_each(|(photograph, source)| photograph.picture = source);
    let params = TextureParams::preview();
    let turns = texture(&bench.parts, &[&bench.panel], &photographs, &params).unwrap();
    assert_eq!((asked.shown.get(), asked.most_held.get()), (8, 1));
    assert_eq!((turns.warnings.len(), turns.warnings[7].as_str()), (8, "shown as number 8"));
    // and the same comes out as of pictures that were all there
    let at_once = texture(&bench.parts, &[&bench.panel], &bench.photographs(), &params).unwrap();
    assert_eq!((&turns.linear, &turns.evidence, &turns.gains), (&at_once.linear, &at_once.evidence, &at_once.gains));
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let bench = &*BENCH;
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let Picture::Eight(image) = &bench.pictures[0] else { panic!("of eight bits") };
    image.write_png(place("whole.png")).unwrap();
    let whole = std::fs::read(place("whole.png")).unwrap();
    std::fs::write(place("torn.png"), &whole[..whole.len() / 2]).unwrap();
    SrgbImage::filled(9, 9, [255; 4]).write_png(place("small.png")).unwrap();
    // a small picture in the guise of a large one's name: its header is not read before its turn
    std::fs::copy(place("small.png"), place("small.jpg")).unwrap();
    let told = |file: &str| -> Result<Textured, TextureError> {
        let file = PhotoFile::new(place(file));
        let mut photographs = bench.photographs()[..2].to_vec();
        photographs[1].picture = &file;
        texture(&bench.parts, &[], &photographs, &TextureParams::preview())
    };
    let named = |file: &str| told(file).unwrap_err().to_string();
    for file in ["none.png", "torn.png"] {
        let error = named(file);
        assert!(error.contains("photograph \"1\"") && error.contains(file), "{error}");
    }
    for file in ["small.png", "small.jpg"] {
        assert!(matches!(told(file), Err(TextureError::Size { pixels: [9, 9], .. })), "{}", named(file));
    }
}

/// A photograph of so many times as many pixels on each side.
fn enlarged(camera: &Camera, picture: &Picture, times: u32) -> (Camera, SrgbImage) {
    let Picture::Eight(small) = picture else { panic!("of eight bits") };
    let lens = camera.intrinsics;
    let scale = f64::from(times);
    let intrinsics = Intrinsics {
        width: lens.width * times,
        height: lens.height * times,
        focal_px: lens.focal_px.map(|x| x * scale),
        centre_px: lens.centre_px.map(|x| x * scale),
        ..lens
    };
    let pixel = |i: u64| {
        let (x, y) = (i % u64::from(intrinsics.width), i / u64::from(intrinsics.width));
        small.pixel(x as u32 / times, y as u32 / times)
    };
    let count = u64::from(intrinsics.width) * u64::from(intrinsics.height);
    let pixels = (0..count).map(pixel).collect();
    (Camera { intrinsics, ..*camera }, SrgbImage { width: intrinsics.width, height: intrinsics.height, pixels })
}

/// What the process has had of memory at most since the last call, GB.
fn peak_gb() -> f64 {
    let peak = peak_bytes().unwrap();
    std::fs::write("/proc/self/clear_refs", "5").unwrap();
    peak as f64 / 1.0e9
}

/// Eight photographs of 106 megapixels from files, then with all of them in memory as before: gigabytes, and minutes. Linux tells what it took.
#[test]
#[ignore = "minutes, and 8 GB"]
fn photographs_of_a_hundred_megapixels_take_turns() {
    let bench = &*BENCH;
    let folder = tempfile::tempdir().unwrap();
    let mut cameras = Vec::new();
    let files: Vec<PhotoFile> = (bench.cameras.iter().zip(&bench.pictures).enumerate())
        .map(|(i, (camera, picture))| {
            let path = folder.path().join(format!("{i}.png"));
            let (camera, image) = enlarged(camera, picture, 22);
            image.write_png(&path).unwrap();
            cameras.push(camera);
            PhotoFile::new(path)
        })
        .collect();
    let names: Vec<String> = (0..files.len()).map(|i| i.to_string()).collect();
    let run = |sources: &[&dyn PictureSource]| {
        let photograph = |i: usize| Photograph { name: &names[i], camera: cameras[i], picture: sources[i] };
        let photographs: Vec<Photograph> = (0..names.len()).map(photograph).collect();
        let start = Instant::now();
        let mut survey = Survey::new(&bench.parts, &[&bench.panel], &photographs, &TextureParams::default()).unwrap();
        let (looking, looking_gb) = (start.elapsed().as_secs_f64(), peak_gb());
        let gains = survey.equalize();
        let textured = survey.painted(&survey.blended(), gains);
        println!(
            "looked at after {looking:.0} s with {looking_gb:.2} GB at most, blended and filled after {:.0} s with {:.2} GB",
            start.elapsed().as_secs_f64(),
            peak_gb()
        );
        (textured, looking_gb)
    };
    peak_gb();
    let sources: Vec<&dyn PictureSource> = files.iter().map(|file| file as &dyn PictureSource).collect();
    println!("{} files of {} in turn:", files.len(), cameras[0].intrinsics.width * cameras[0].intrinsics.height);
    let (turns, turns_gb) = run(&sources);
    let image = &turns.atlas.image;
    println!("{} x {} texels, {:.3} seen", image.width, image.height, turns.seen);
    let start = Instant::now();
    let read = |file: &PhotoFile| {
        let mut all = None;
        file.show(&mut |picture| all = Some(picture.clone())).unwrap();
        all.unwrap()
    };
    let pictures: Vec<Picture> = files.iter().map(read).collect();
    println!("all at once, after {:.0} s of reading:", start.elapsed().as_secs_f64());
    let sources: Vec<&dyn PictureSource> = pictures.iter().map(|picture| picture as &dyn PictureSource).collect();
    let (at_once, at_once_gb) = run(&sources);
    assert_eq!((&turns.linear, &turns.evidence), (&at_once.linear, &at_once.evidence));
    assert!(turns_gb + 2.0 < at_once_gb, "{turns_gb} {at_once_gb}");
}
