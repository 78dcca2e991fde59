//! Lenses: which photographs share one, what is known of it, and what was solved.

use super::form::{QUIET, choices, focus_once, number, number_field, sheet, shown, turned_page};
use super::{Dialog, FAULT};
use crate::app::MarkApp;
use crate::document::Edit;
use crate::pictures::Loading;
use crate::solving::SolvedLens;
use eframe::egui::{CollapsingHeader, Context, Label, RichText, ScrollArea, TextEdit, Ui};
use heliodon_photo::project::{DistortionEntry, FocalEntry, LensEntry};
use std::collections::BTreeSet;

/// The width of 35 mm film, by which focal lengths are told that name no sensor.
const FILM_MM: &str = "36";

const DISTORTIONS: [(DistortionEntry, &str, &str); 4] = [
    (DistortionEntry::None, "held", "As given below, or none"),
    (DistortionEntry::Radial1, "k1", "Enough for most lenses"),
    (DistortionEntry::Radial2, "k1, k2", "For wide ones"),
    (DistortionEntry::Full, "all", "k1 to k3, p1, p2 and the centre: wants many marks near the margins"),
];

/// What is said of a focal length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Said {
    Known,
    Exif,
    Solved,
}

/// A lens as it is put together.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::app) struct LensDraft {
    was: Option<String>,
    name: String,
    focal: Said,
    length: String,
    /// Whether the length is in millimetres before a sensor of that width.
    is_mm: bool,
    sensor_mm: String,
    distortion: DistortionEntry,
    centre_px: [String; 2],
    radial: [String; 3],
    tangential: [String; 2],
    photos: BTreeSet<String>,
}

enum Wish {
    Set,
    Remove,
    Leave,
    Open(Option<String>),
}

impl LensDraft {
    fn new(lens: &LensEntry, was: Option<String>, photos: BTreeSet<String>) -> Self {
        let (focal, length) = match lens.focal {
            FocalEntry::Known(px) => (Said::Known, px.to_string()),
            FocalEntry::Exif => (Said::Exif, String::new()),
            FocalEntry::Free => (Said::Solved, String::new()),
        };
        Self {
            was,
            name: lens.name.clone(),
            focal,
            length,
            is_mm: false,
            sensor_mm: FILM_MM.to_owned(),
            distortion: lens.distortion,
            centre_px: [0, 1].map(|i| shown(lens.centre_px.map(|centre| centre[i]))),
            radial: [0, 1, 2].map(|i| shown(lens.radial.map(|radial| radial[i]))),
            tangential: [0, 1].map(|i| shown(lens.tangential.map(|tangential| tangential[i]))),
            photos,
        }
    }

    /// The entry, or what is wrong. `long_px` is the longer side of its photographs.
    fn entry(&self, long_px: Option<f64>) -> Result<LensEntry, String> {
        if self.name.trim().is_empty() {
            return Err("a lens needs a name".to_owned());
        }
        let focal = match self.focal {
            Said::Exif => FocalEntry::Exif,
            Said::Solved => FocalEntry::Free,
            Said::Known => FocalEntry::Known(self.focal_px(long_px)?),
        };
        Ok(LensEntry {
            name: self.name.trim().to_owned(),
            focal,
            distortion: self.distortion,
            centre_px: numbers(&self.centre_px, "centre")?,
            radial: numbers(&self.radial, "k1, k2, k3")?,
            tangential: numbers(&self.tangential, "p1, p2")?,
        })
    }

    fn focal_px(&self, long_px: Option<f64>) -> Result<f64, String> {
        let length = number(&self.length, "focal length")?;
        let px = if self.is_mm {
            let long_px = long_px.ok_or("how large its photographs are is not known yet: give the focal length in pixels")?;
            length * long_px / number(&self.sensor_mm, "sensor's width")?
        } else {
            length
        };
        if px > 0.0 && px.is_finite() { Ok(px) } else { Err("a focal length is above 0".to_owned()) }
    }
}

/// None where all fields are empty; those that are empty beside others are 0.
fn numbers<const N: usize>(texts: &[String; N], what: &str) -> Result<Option<[f64; N]>, String> {
    if texts.iter().all(|text| text.trim().is_empty()) {
        return Ok(None);
    }
    let mut found = [0.0; N];
    for (number_of, text) in found.iter_mut().zip(texts).filter(|(_, text)| !text.trim().is_empty()) {
        *number_of = number(text, what)?;
    }
    Ok(Some(found))
}

impl MarkApp {
    /// Opens the lens of the active photograph.
    pub(in crate::app) fn begin_lens(&mut self) {
        let Some(photo) = self.photo_in(self.active_pane) else {
            self.say("there is no photograph whose lens could be known".to_owned());
            return;
        };
        let entry = self.document.project().file.photo.iter().find(|entry| entry.name() == photo);
        match entry.and_then(|entry| entry.lens.clone()) {
            Some(lens) => self.open_lens(&lens),
            None => {
                // those that share a lens by their EXIF are meant together
                let solved = self.outcome.as_ref().and_then(|outcome| outcome.lens_of(&photo));
                let photos =
                    solved.map_or_else(|| BTreeSet::from([photo.clone()]), |lens| lens.photos.iter().cloned().collect());
                self.new_lens(photos);
            }
        }
    }

    fn new_lens(&mut self, photos: BTreeSet<String>) {
        let lenses = &self.document.project().file.lens;
        let is_free = |name: &String| lenses.iter().all(|lens| lens.name != *name);
        let name = (1..).map(|n| format!("lens {n}")).find(is_free).unwrap_or_default();
        self.dialog = Dialog::Lens(Box::new(LensDraft::new(&LensEntry { name, ..LensEntry::default() }, None, photos)));
    }

    pub(in crate::app) fn open_lens(&mut self, name: &str) {
        let file = &self.document.project().file;
        if let Some(lens) = file.lens.iter().find(|lens| lens.name == name) {
            let its = file.photo.iter().filter(|photo| photo.lens.as_deref() == Some(name));
            let photos = its.map(|photo| photo.name().to_owned()).collect();
            self.dialog = Dialog::Lens(Box::new(LensDraft::new(lens, Some(name.to_owned()), photos)));
        }
    }

    /// The longer side of a lens's photographs, as far as one of them is known.
    fn long_side_px(&self, photos: &BTreeSet<String>) -> Option<f64> {
        let file = &self.document.project().file;
        photos.iter().find_map(|name| {
            let entry = file.photo.iter().find(|entry| entry.name() == name)?;
            if let Some([width, height]) = entry.size_px {
                return Some(f64::from(width.max(height)));
            }
            match self.pictures.get(name) {
                Loading::Ready(picture) => Some(picture.size().max_element()),
                _ => {
                    let lens = self.outcome.as_ref()?.lens_of(name)?;
                    Some(f64::from(lens.intrinsics.width.max(lens.intrinsics.height)))
                }
            }
        })
    }

    pub(super) fn ask_lens(&mut self, ctx: &Context, draft: &mut LensDraft) -> bool {
        let file = &self.document.project().file;
        let lenses: Vec<String> = file.lens.iter().map(|lens| lens.name.clone()).collect();
        let photos: Vec<(String, Option<String>)> =
            file.photo.iter().map(|photo| (photo.name().to_owned(), photo.lens.clone())).collect();
        let long_px = self.long_side_px(&draft.photos);
        let solved = draft.photos.iter().find_map(|photo| self.outcome.as_ref()?.lens_of(photo)).filter(|lens| lens.is_solved);
        let solved = solved.map(|lens| told(lens, number(&draft.sensor_mm, "").unwrap_or(36.0)));
        let entry = draft.entry(long_px);
        let turned = turned_page(ctx, draft.was.as_ref(), &lenses).map(|name| Wish::Open(Some(name)));
        let is_new = draft.was.is_none();
        let contents = |ui: &mut Ui| {
            ui.set_width(430.0);
            let wish = heading(ui, draft, &lenses);
            focal(ui, draft, long_px);
            distortion(ui, draft);
            took(ui, draft, &photos);
            wish
        };
        let buttons = |ui: &mut Ui| {
            for words in solved.iter().flatten() {
                ui.add(Label::new(RichText::new(words).color(crate::app::panels::GOOD)).wrap());
            }
            if let Err(why) = &entry {
                ui.add(Label::new(RichText::new(why).color(FAULT)).wrap());
            }
            let (words, wishes) = if is_new {
                (&["Make", "Cancel"][..], vec![Wish::Set, Wish::Leave])
            } else {
                (&["Change", "Remove the lens", "Cancel"][..], vec![Wish::Set, Wish::Remove, Wish::Leave])
            };
            choices(ui, words, true).and_then(|choice| wishes.into_iter().nth(choice))
        };
        let wished = sheet(ctx, "Lens", contents, buttons);
        match turned.or(wished) {
            None => true,
            Some(Wish::Leave) => false,
            Some(Wish::Remove) => !self.edit(&Edit::RemoveLens { name: draft.was.clone().unwrap_or_default() }),
            Some(Wish::Set) => !self.set_lens(draft, long_px),
            Some(Wish::Open(next)) => {
                // what was changed counts before another is opened
                let was =
                    draft.was.as_deref().and_then(|was| self.document.project().file.lens.iter().find(|lens| lens.name == was));
                let is_changed = was.is_some_and(|was| {
                    let its = photos.iter().filter(|(_, lens)| lens.as_ref() == draft.was.as_ref());
                    draft.entry(long_px).as_ref() != Ok(was) || !its.map(|(name, _)| name).eq(&draft.photos)
                });
                if is_changed && !self.set_lens(draft, long_px) {
                    return true;
                }
                match next {
                    Some(name) => self.open_lens(&name),
                    None => self.new_lens(BTreeSet::new()),
                }
                false
            }
        }
    }

    fn set_lens(&mut self, draft: &LensDraft, long_px: Option<f64>) -> bool {
        match draft.entry(long_px) {
            Ok(lens) => {
                let photos = draft.photos.iter().cloned().collect();
                self.edit(&Edit::SetLens { was: draft.was.clone(), lens: Box::new(lens), photos })
            }
            Err(why) => {
                self.complain(why);
                false
            }
        }
    }
}

fn heading(ui: &mut Ui, draft: &mut LensDraft, lenses: &[String]) -> Option<Wish> {
    let mut wish = None;
    ui.horizontal(|ui| {
        ui.label("Name");
        let field = ui.add(TextEdit::singleline(&mut draft.name).desired_width(180.0));
        focus_once(ui, &field, &draft.name);
    });
    if !lenses.is_empty() {
        ui.horizontal_wrapped(|ui| {
            for name in lenses {
                let is_it = draft.was.as_ref() == Some(name);
                if ui.selectable_label(is_it, name.as_str()).clicked() && !is_it {
                    wish = Some(Wish::Open(Some(name.clone())));
                }
            }
            if ui.selectable_label(draft.was.is_none(), "new").clicked() && draft.was.is_some() {
                wish = Some(Wish::Open(None));
            }
        });
    }
    ui.separator();
    wish
}

fn focal(ui: &mut Ui, draft: &mut LensDraft, long_px: Option<f64>) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Focal length");
        for (said, word, why) in [
            (Said::Solved, "solved", "Nothing is known of it"),
            (Said::Exif, "from EXIF", "A start that marks correct; solved where a photograph has none"),
            (Said::Known, "known", "It is held"),
        ] {
            if ui.selectable_label(draft.focal == said, word).on_hover_text(why).clicked() {
                draft.focal = said;
            }
        }
        if draft.focal == Said::Known {
            number_field(ui, "", &mut draft.length, if draft.is_mm { "35" } else { "1668.8" }, "");
            for (is_mm, word) in [(false, "px"), (true, "mm")] {
                if ui.selectable_label(draft.is_mm == is_mm, word).clicked() {
                    draft.is_mm = is_mm;
                }
            }
        }
    });
    if draft.focal == Said::Known && draft.is_mm {
        ui.horizontal_wrapped(|ui| {
            number_field(ui, "before a sensor whose longer side is", &mut draft.sensor_mm, FILM_MM, "mm");
            if let Ok(px) = draft.focal_px(long_px) {
                ui.label(RichText::new(format!("= {px:.1} px")).color(QUIET));
            }
        });
    }
}

fn distortion(ui: &mut Ui, draft: &mut LensDraft) {
    ui.horizontal_wrapped(|ui| {
        ui.label("Distortion solved");
        for (distortion, word, why) in DISTORTIONS {
            let word = if distortion == DistortionEntry::None { "none" } else { word };
            if ui.selectable_label(draft.distortion == distortion, word).on_hover_text(why).clicked() {
                draft.distortion = distortion;
            }
        }
    });
    let is_given = draft.centre_px.iter().chain(&draft.radial).chain(&draft.tangential).any(|text| !text.is_empty());
    CollapsingHeader::new(RichText::new("What it starts from, and is where it is not solved").color(QUIET))
        .default_open(is_given)
        .show(ui, |ui| {
            ui.horizontal(|ui| {
                number_field(ui, "centre x", &mut draft.centre_px[0], "middle", "px");
                number_field(ui, "y", &mut draft.centre_px[1], "middle", "px");
            });
            ui.horizontal(|ui| {
                for (name, text) in ["k1", "k2", "k3"].iter().zip(&mut draft.radial) {
                    number_field(ui, name, text, "0", "");
                }
            });
            ui.horizontal(|ui| {
                for (name, text) in ["p1", "p2"].iter().zip(&mut draft.tangential) {
                    number_field(ui, name, text, "0", "");
                }
            });
        });
}

/// Which photographs it took.
fn took(ui: &mut Ui, draft: &mut LensDraft, photos: &[(String, Option<String>)]) {
    ui.separator();
    ui.horizontal(|ui| {
        ui.label("It took");
        if ui.button("all").clicked() {
            draft.photos = photos.iter().map(|(name, _)| name.clone()).collect();
        }
        if ui.button("none").clicked() {
            draft.photos.clear();
        }
        ui.label(RichText::new("as a lens at one setting: one focal length, one size").small().color(QUIET));
    });
    ScrollArea::vertical().id_salt("photographs of a lens").max_height(190.0).show(ui, |ui| {
        ui.set_width(410.0);
        for (name, lens) in photos {
            let mut is_its = draft.photos.contains(name);
            let other = lens.as_ref().filter(|lens| Some(*lens) != draft.was.as_ref());
            let words = other.map_or_else(|| name.clone(), |lens| format!("{name}   ({lens} now)"));
            if ui.checkbox(&mut is_its, words).clicked() {
                if is_its {
                    draft.photos.insert(name.clone());
                } else {
                    draft.photos.remove(name);
                }
            }
        }
    });
}

/// What was solved of it, with its uncertainty where it was not held.
fn told(lens: &SolvedLens, sensor_mm: f64) -> Vec<String> {
    let with = |value: f64, sigma: f64, digits: usize| {
        if sigma > 0.0 { format!("{value:.digits$} \u{b1}{sigma:.digits$}") } else { format!("{value:.digits$}") }
    };
    let of = &lens.intrinsics;
    let [focal, centre_x, centre_y, k1, k2, k3, p1, p2] = lens.sigmas;
    let mm = of.focal_px[0] * sensor_mm / f64::from(of.width.max(of.height));
    let how = if focal > 0.0 { "solved" } else { "held" };
    let mut words =
        vec![format!("focal length {how}: {} px, {mm:.2} mm before {sensor_mm} mm", with(of.focal_px[0], focal, 1))];
    let values = [
        ("k1", of.radial[0], k1),
        ("k2", of.radial[1], k2),
        ("k3", of.radial[2], k3),
        ("p1", of.tangential[0], p1),
        ("p2", of.tangential[1], p2),
    ];
    let distorted = values.iter().filter(|(_, value, sigma)| *value != 0.0 || *sigma > 0.0);
    let distorted: Vec<String> = distorted.map(|(name, value, sigma)| format!("{name} {}", with(*value, *sigma, 4))).collect();
    let centre = format!("centre {}, {} px", with(of.centre_px[0], centre_x, 1), with(of.centre_px[1], centre_y, 1));
    words.push([vec![centre], distorted].concat().join(", "));
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_comes_back_from_the_dialogs_fields() {
        for text in [
            "name = \"a\"\nfocal = 1668.8\ndistortion = \"full\"\ncentre_px = [801.5, 600.0]\nradial = [-0.1, 0.02, 0.0]\ntangential = [0.001, 0.0]",
            "name = \"b\"\nfocal = \"free\"\ndistortion = \"none\"",
            "name = \"c\"\nfocal = \"exif\"\ndistortion = \"radial-2\"",
        ] {
            let lens: LensEntry = toml_edit::de::from_str(text).unwrap();
            assert_eq!(LensDraft::new(&lens, None, BTreeSet::new()).entry(None), Ok(lens));
        }
    }

    #[test]
    fn millimetres_become_pixels_by_the_longer_side() {
        let mut draft = LensDraft::new(&LensEntry { name: "a".into(), ..LensEntry::default() }, None, BTreeSet::new());
        (draft.focal, draft.is_mm) = (Said::Known, true);
        draft.length = "18".into();
        assert!(draft.entry(None).unwrap_err().contains("in pixels"));
        assert_eq!(draft.entry(Some(1600.0)).unwrap().focal, FocalEntry::Known(800.0));
        draft.sensor_mm = "7,2".into();
        assert_eq!(draft.entry(Some(1600.0)).unwrap().focal, FocalEntry::Known(4000.0));
        for wrong in ["0", "-3", "long", ""] {
            draft.length = wrong.into();
            assert!(draft.entry(Some(1600.0)).is_err(), "{wrong}");
        }
    }
}
