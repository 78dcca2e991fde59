//! A solution in words.

use crate::formats::cameras_file::CamerasFile;
use std::fmt::Write;

/// How many wrong marks are told one by one.
const MOST_WRONG: usize = 40;

/// What a solution says, for people: photographs with their residuals and uncertainties, wrong marks, what the whole rests on, what is missing.
#[must_use]
pub fn describe(file: &CamerasFile) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |words: std::fmt::Arguments<'_>| {
        let _ = writeln!(text, "{words}");
    };
    let solved = file.photos.iter().filter(|p| p.camera.is_some()).count();
    let points = file.points.iter().filter(|p| p.position_m.is_some()).count();
    line(format_args!(
        "{solved} of {} photographs and {points} of {} points are solved; a mark is good to {:.2} px",
        file.photos.len(),
        file.points.len(),
        file.sigma_px
    ));
    let unit = if file.metric { "m" } else { "units" };
    for photo in &file.photos {
        match (&photo.camera, &photo.unsolved) {
            (Some(camera), _) => {
                let place = photo.place_sigma_m.map(|s| format!(", place +- {s:.4} {unit}")).unwrap_or_default();
                let turn = photo.turn_sigma_deg.map(|s| format!(", turn +- {s:.4} deg")).unwrap_or_default();
                let focal = if photo.focal_sigma_px > 0.0 { format!(" +- {:.1}", photo.focal_sigma_px) } else { String::new() };
                line(format_args!(
                    "  {}: {} marks, {:.2} px rms, focal length {:.1}{focal} px{place}{turn}",
                    photo.name, photo.marks, photo.rms_px, camera.focal_px[0]
                ));
            }
            (None, why) => {
                line(format_args!("  {}: not solved: {}", photo.name, why.as_deref().unwrap_or("no reason is known")))
            }
        }
    }
    for point in file.points.iter().filter(|p| p.position_m.is_none()) {
        line(format_args!("  point {}: not solved: {}", point.name, point.unsolved.as_deref().unwrap_or("no reason is known")));
    }
    if !file.wrong_marks.is_empty() {
        line(format_args!("{} marks are wrong and were left out:", file.wrong_marks.len()));
        for wrong in file.wrong_marks.iter().take(MOST_WRONG) {
            line(format_args!("  {wrong}"));
        }
        if file.wrong_marks.len() > MOST_WRONG {
            line(format_args!("  and {} more", file.wrong_marks.len() - MOST_WRONG));
        }
    }
    for check in &file.checks {
        line(format_args!("  {} is missed by {:.4} {}", check.what, check.off, check.unit));
    }
    for note in &file.notes {
        line(format_args!("note: {note}"));
    }
    text
}
