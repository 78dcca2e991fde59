//! Shapes typed without the mouse: all places in a line, and what goes without saying.

use crate::desk::Desk;
use crate::shapes::{place_id, shape, solved_desk, told};
use eframe::egui::{Event, Key, Modifiers};
use glam::DVec3;
use heliodon_photo::model::table::Kind;

const NONE: Modifiers = Modifiers::NONE;
const CTRL: Modifiers = Modifiers::COMMAND;

/// Where the corners of a shape are; those that were not marked are left out.
fn places(desk: &Desk, corners: &[String]) -> Vec<(usize, DVec3)> {
    let points = &desk.app.document().project().file.point;
    let place =
        |name: &String| points.iter().find(|point| point.name == *name).and_then(|point| point.known_m).map(DVec3::from);
    corners.iter().enumerate().filter_map(|(at, name)| Some((at, place(name)?))).collect()
}

/// A new shape's name and kind; its first place is typed next.
fn begin(desk: &mut Desk, name: &str, kind: Key) {
    desk.key(Key::B, NONE);
    desk.type_in(name);
    desk.key(kind, CTRL);
}

#[test]
fn a_box_is_two_corners_in_a_line_and_stands_upright() {
    let mut desk = solved_desk();
    begin(&mut desk, "hall", Key::Num2);
    desk.type_in("1 0 2 / .+2 1.5 -1");
    desk.frame(Vec::new());
    // nobody left the line yet: the model follows all the same
    let told = told(&desk);
    assert!(["length 2.0", "height 1.5", "width 3.0"].iter().all(|size| told.contains(size)), "{told}");
    desk.key(Key::Enter, NONE);
    let hall = shape(&desk, "hall");
    let corners = [(0, DVec3::new(1.0, 0.0, 2.0)), (1, DVec3::new(3.0, 0.0, 2.0)), (6, DVec3::new(3.0, 1.5, -1.0))];
    assert_eq!((hall.kind, hall.upright, places(&desk, &hall.points)), (Kind::Box, true, corners.to_vec()));
    // the same from any other corner
    for line in ["3 1.5 -1 / 1 0 2", "1 1.5 -1 / 3 0 2", "3 0 -1/1 1.5 2"] {
        desk.key(Key::B, NONE);
        desk.type_in("again");
        desk.key(Key::Num2, CTRL);
        desk.type_in(line);
        desk.frame(Vec::new());
        let told = crate::shapes::told(&desk);
        assert!(["length 2.0", "height 1.5", "width 3.0"].iter().all(|size| told.contains(size)), "{line}: {told}");
        desk.key(Key::Escape, NONE);
    }
    assert_eq!(desk.app.document().project().file.shape.len(), 2);
}

#[test]
fn what_can_stand_upright_does_once_it_is_known_what_is_level() {
    let mut desk = solved_desk();
    let upright = |desk: &mut Desk| {
        begin(desk, "wall", Key::Num2);
        // turned by a second corner of its foot: it is refused where it may lean
        desk.type_in("0 0 0 / 2 0 -1 / 1.5 1 -2");
        desk.key(Key::Enter, NONE);
        let wall = desk.app.document().project().file.shape.iter().find(|shape| shape.name == "wall").map(|wall| wall.upright);
        desk.key(Key::Escape, NONE);
        wall
    };
    assert_eq!(upright(&mut desk), None, "{:?}", desk.app.message());
    for name in ["tower-sw", "tower-se", "house-sw"] {
        while desk.app.active_point() != Some(name) {
            desk.key(Key::Tab, NONE);
        }
        desk.key(Key::G, NONE);
    }
    desk.rest();
    assert_eq!(upright(&mut desk), Some(true), "{:?}", desk.app.message());
}

#[test]
fn a_new_shape_is_of_the_kind_and_mesh_before_and_tab_goes_from_its_mesh_to_its_places() {
    let mut desk = solved_desk();
    desk.key(Key::B, NONE);
    desk.type_in("gutter");
    desk.key(Key::Tab, NONE);
    desk.type_in("trim");
    desk.key(Key::Num8, CTRL);
    // the line goes into its places, and the keys to the way that it is drawn by
    desk.type_in("0 2 0 / . . 1 / . .+1 .");
    desk.key(Key::Tab, NONE);
    desk.type_in(".+4 . .");
    desk.key(Key::M, CTRL);
    desk.type_in(". . -5");
    desk.key(Key::R, CTRL);
    desk.type_in("3");
    desk.key(Key::Tab, NONE);
    desk.type_in(". .-0.5 .");
    desk.key(Key::Enter, NONE);
    let made = shape(&desk, "gutter");
    assert_eq!((made.kind, made.part.as_deref(), made.upright), (Kind::Extrusion, Some("trim"), false));
    let corners = [DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.0, 2.0, 1.0), DVec3::new(0.0, 3.0, 1.0)];
    let of = |desk: &Desk, names: &[String]| places(desk, names).into_iter().map(|(_, place)| place).collect::<Vec<_>>();
    assert_eq!(of(&desk, &made.points), corners);
    // a way that has one end begins at the first corner
    assert_eq!(of(&desk, &made.along.unwrap()), [corners[0], DVec3::new(4.0, 2.0, 0.0)]);
    assert_eq!(of(&desk, &made.mirror), [corners[0], DVec3::new(0.0, 2.0, -5.0)]);
    let repeat = made.repeat.unwrap();
    assert_eq!((repeat.count, of(&desk, &repeat.step.unwrap())), (3, vec![corners[0], DVec3::new(0.0, 1.5, 0.0)]));
    desk.key(Key::B, NONE);
    desk.key(Key::Tab, NONE);
    desk.key(Key::Tab, NONE);
    desk.frame(Vec::new());
    assert_eq!(desk.ctx.memory(|memory| memory.focused()), Some(place_id(0, 0)));
    desk.type_in("0 2 4 / . . 5 / . .+1 .");
    desk.key(Key::Tab, NONE);
    desk.type_in(".+4 . .");
    desk.key(Key::Enter, NONE);
    let made = desk.app.document().project().file.shape.last().unwrap();
    assert_eq!((made.kind, made.part.as_deref()), (Kind::Extrusion, Some("trim")));
    // another mesh is typed over that one
    desk.key(Key::B, NONE);
    desk.key(Key::Tab, NONE);
    desk.type_in("roof");
    desk.key(Key::Num2, CTRL);
    desk.type_in("0 2 0 / 1 3 1");
    desk.key(Key::Enter, NONE);
    let made = desk.app.document().project().file.shape.last().unwrap();
    assert_eq!((made.kind, made.part.as_deref(), made.upright), (Kind::Box, Some("roof"), true));
}

#[test]
fn rings_are_radii_and_heights_about_a_plumb_axis() {
    let mut desk = solved_desk();
    begin(&mut desk, "lantern", Key::Num7);
    desk.type_in("1.5 0 / 2 1 / 0.5 3");
    desk.key(Key::Tab, NONE);
    desk.type_in("1 0 -2");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("ring radius 1.500 m, ring radius 2.000 m, ring radius 0.500 m"), "{}", told(&desk));
    desk.key(Key::Enter, NONE);
    let made = shape(&desk, "lantern");
    let rings: Vec<DVec3> = made.rings.iter().flat_map(|ring| places(&desk, ring)).map(|(_, place)| place).collect();
    assert_eq!(rings, [DVec3::new(2.5, 0.0, -2.0), DVec3::new(3.0, 1.0, -2.0), DVec3::new(1.5, 3.0, -2.0)]);
    let axis: Vec<DVec3> = places(&desk, &made.axis.unwrap()).into_iter().map(|(_, place)| place).collect();
    assert_eq!(axis, [DVec3::new(1.0, 0.0, -2.0), DVec3::new(1.0, 1.0, -2.0)]);
    desk.rest();
    let told = &desk.solved().wrong_shapes;
    assert!(told.iter().all(|words| words.contains("its axis is taken as named")), "{told:?}");
}

#[test]
fn what_cannot_be_made_is_not_made() {
    let mut desk = solved_desk();
    let before = desk.app.document().text().to_owned();
    for (line, why) in [("0 0 0 / 1 0 0 / 2 0 0", "on a line"), ("0 0 0 / 1 0 0 / nowhere", "no point called nowhere")] {
        begin(&mut desk, "sill", Key::Num1);
        desk.type_in(line);
        desk.key(Key::Enter, NONE);
        assert_eq!(desk.app.document().text(), before);
        assert!(desk.app.message().is_some_and(|words| words.contains(why)), "{:?}", desk.app.message());
        desk.frame(Vec::new());
        assert!(told(&desk).contains(why), "the dialog stays: {}", told(&desk));
        desk.key(Key::Escape, NONE);
    }
}

#[test]
fn a_shape_whose_keys_all_fall_into_one_frame_is_made_of_what_was_typed() {
    let mut desk = solved_desk();
    let key = |key, modifiers| {
        [true, false].map(|pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers }).to_vec()
    };
    let typed = |words: &str| vec![Event::Text(words.to_owned())];
    let all = [
        key(Key::B, NONE),
        typed("sill"),
        key(Key::Num8, CTRL),
        typed("0 1 0 / 0 1 1 / 0 2 1"),
        key(Key::Tab, NONE),
        typed(".+3 . ."),
        key(Key::M, CTRL),
        typed(". . 9"),
        key(Key::R, CTRL),
        typed("4"),
        key(Key::Tab, NONE),
        typed(".+5 . ."),
        key(Key::Enter, NONE),
    ];
    desk.frame(all.concat());
    (0..30).for_each(|_| desk.frame(Vec::new()));
    let made = shape(&desk, "sill");
    assert_eq!((made.points.len(), made.mirror.len(), made.repeat.unwrap().count), (3, 2, 4));
}
