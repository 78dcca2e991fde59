//! What is known beforehand: directions, places, lenses.

use crate::desk::Desk;
use crate::scene::Scene;
use eframe::egui::{Key, Modifiers};
use glam::DVec3;
use heliodon_photo::project::{DistortionEntry, FocalEntry, Toward};

fn solved_desk() -> Desk {
    let mut desk = Desk::new(|_, _| false, None);
    desk.rest();
    desk
}

/// Chooses a point by searching for it.
fn choose(desk: &mut Desk, name: &str) {
    let count = desk.app.document().project().file.point.len();
    for _ in 0..=count {
        if desk.app.active_point() == Some(name) {
            desk.key(Key::X, Modifiers::NONE);
            return;
        }
        desk.key(Key::Tab, Modifiers::NONE);
    }
    panic!("there is no {name}");
}

fn way(desk: &Desk, from: &str, to: &str) -> DVec3 {
    let place = |name: &str| desk.solved().position_m(name).expect("it was solved");
    place(to) - place(from)
}

#[test]
fn a_direction_between_two_points_is_a_word_or_a_bearing_and_turns_the_whole() {
    let mut desk = solved_desk();
    let before = desk.app.document().text().to_owned();
    let ends = ["tower-sw", "tower-se"];
    ends.iter().for_each(|name| choose(&mut desk, name));
    desk.key(Key::D, Modifiers::SHIFT);
    desk.type_in("37.5");
    desk.key(Key::Enter, Modifiers::NONE);
    let direction = |desk: &Desk| desk.app.document().project().file.direction.last().cloned();
    let made = direction(&desk).unwrap();
    assert_eq!((made.from.as_str(), made.to.as_str(), made.toward), ("tower-sw", "tower-se", Toward::Bearing(37.5)));
    desk.rest();
    let along = way(&desk, ends[0], ends[1]);
    let bearing = along.x.atan2(-along.z).to_degrees();
    assert!((bearing - 37.5).abs() < 0.1, "{bearing}");
    // the same two again: what was said is changed
    desk.key(Key::D, Modifiers::SHIFT);
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("e");
    desk.click_words("Turn around");
    desk.key(Key::Enter, Modifiers::NONE);
    let changed = direction(&desk).unwrap();
    assert_eq!((changed.from.as_str(), changed.toward), ("tower-se", Toward::East));
    assert_eq!(desk.app.document().project().file.direction.len(), 1);
    desk.rest();
    let along = way(&desk, ends[1], ends[0]);
    assert!(along.x > 0.99 * along.length(), "{along}");
    // what is no direction is said, and the dialog stays
    desk.key(Key::D, Modifiers::SHIFT);
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("nord");
    desk.key(Key::Enter, Modifiers::NONE);
    assert!(desk.app.message().unwrap().contains("nord"), "{:?}", desk.app.message());
    desk.click_words("Remove");
    assert_eq!(direction(&desk), None);
    assert_eq!(desk.app.document().text(), before);
}

#[test]
fn the_place_of_a_point_is_typed_and_cleared() {
    let mut desk = solved_desk();
    let before = desk.app.document().text().to_owned();
    for (name, place) in
        [("tower-sw", ["-1.2", "0", "1"]), ("tower-se", ["0,8", "0", "1"]), ("tower-sw-top", ["-1.2", "3.4", "1"])]
    {
        choose(&mut desk, name);
        desk.key(Key::P, Modifiers::NONE);
        for number in place {
            desk.type_in(number);
            desk.key(Key::Tab, Modifiers::NONE);
        }
        // from the buttons Enter is the button's
        desk.click_words("Set");
    }
    let known =
        |desk: &Desk, name: &str| desk.app.document().project().file.point.iter().find(|p| p.name == name).unwrap().known_m;
    assert_eq!(known(&desk, "tower-se"), Some([0.8, 0.0, 1.0]));
    desk.rest();
    let found = desk.solved().position_m("tower-se").unwrap();
    assert!(found.distance(DVec3::new(0.8, 0.0, 1.0)) < 0.02, "{found}");
    desk.key(Key::P, Modifiers::NONE);
    desk.key(Key::A, Modifiers::COMMAND);
    desk.type_in("high");
    desk.key(Key::Enter, Modifiers::NONE);
    assert!(desk.app.message().unwrap().contains("high"));
    desk.click_words("Not known");
    assert_eq!(known(&desk, "tower-sw-top"), None);
    for _ in 0..4 {
        desk.key(Key::Z, Modifiers::COMMAND);
    }
    assert_eq!(desk.app.document().text(), before);
}

#[test]
fn a_lens_is_held_solved_shared_and_removed() {
    let mut desk = solved_desk();
    let photo = Scene::photo(0);
    let truth = desk.scene.camera(0).intrinsics.focal_px[0];
    let solved = desk.solved().lens_of(&photo).unwrap().clone();
    assert!(solved.is_solved && solved.sigmas[0] > 0.0 && solved.photos.len() == 4, "{solved:?}");
    desk.key(Key::L, Modifiers::SHIFT);
    desk.settle();
    let words = format!("focal length solved: {:.1} \u{b1}", solved.intrinsics.focal_px[0]);
    assert!(desk.words().iter().any(|(told, ..)| told.starts_with(&words)), "{words}");
    // 1.15 times its width of 560 px: known in millimetres before film
    desk.click_words("known");
    desk.click_words("mm");
    desk.frame(Vec::new());
    let at = desk.find("35");
    desk.click(at, Modifiers::NONE);
    desk.type_in("41.4");
    desk.click_words("k1, k2");
    desk.click_words("Change");
    let lens = desk.app.document().project().file.lens[0].clone();
    let FocalEntry::Known(px) = lens.focal else { panic!("{lens:?}") };
    assert!((px - truth).abs() < 1e-6 && lens.distortion == DistortionEntry::Radial2, "{lens:?}");
    desk.rest();
    let held = desk.solved().lens_of(&photo).unwrap().clone();
    assert!((held.intrinsics.focal_px[0] - px).abs() < 1e-9 && held.sigmas[0] == 0.0, "{held:?}");
    assert!(held.sigmas[4] > 0.0, "k2 is solved");
    // a lens of its own for one photograph
    desk.key(Key::L, Modifiers::SHIFT);
    desk.click_words("new");
    desk.click_words(&format!("{photo}   (the one now)"));
    desk.key(Key::Enter, Modifiers::NONE);
    let file = &desk.app.document().project().file;
    let lenses: Vec<Option<&str>> = file.photo.iter().map(|photo| photo.lens.as_deref()).collect();
    assert_eq!(lenses, [Some("lens 1"), Some("the one"), Some("the one"), Some("the one")]);
    desk.rest();
    assert_eq!(desk.solved().lenses.len(), 2);
    desk.key(Key::L, Modifiers::SHIFT);
    desk.click_words("Remove the lens");
    assert_eq!(desk.app.document().project().file.photo[0].lens, None);
    assert_eq!(desk.app.document().project().file.lens.len(), 1);
}
