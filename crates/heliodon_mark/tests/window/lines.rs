//! Shapes typed without the mouse: all places in a line, and what goes without saying.

use crate::desk::Desk;
use crate::shapes::{place_id, shape, solved_desk, told};
use eframe::egui::{Event, Key, Modifiers, Vec2};
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
    desk.type_in("1.5 0 / 2 1 / 0.5 3 / . .+1");
    desk.key(Key::Tab, NONE);
    desk.type_in("1 0 -2");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("ring radius 2.000 m, ring radius 0.500 m, ring radius 0.500 m"), "{}", told(&desk));
    desk.key(Key::Enter, NONE);
    let made = shape(&desk, "lantern");
    let rings: Vec<DVec3> = made.rings.iter().flat_map(|ring| places(&desk, ring)).map(|(_, place)| place).collect();
    let ring = |radius: f64, height: f64| DVec3::new(1.0 + radius, height, -2.0);
    assert_eq!(rings, [ring(1.5, 0.0), ring(2.0, 1.0), ring(0.5, 3.0), ring(0.5, 4.0)]);
    let axis: Vec<DVec3> = places(&desk, &made.axis.unwrap()).into_iter().map(|(_, place)| place).collect();
    assert_eq!(axis, [DVec3::new(1.0, 0.0, -2.0), DVec3::new(1.0, 1.0, -2.0)]);
    desk.rest();
    let told = &desk.solved().wrong_shapes;
    assert!(told.iter().all(|words| words.contains("its axis is taken as named")), "{told:?}");
}

#[test]
fn a_line_of_rings_that_is_left_with_the_mouse_leaves_the_keys_where_it_clicked() {
    for goes_by_field in [false, true] {
        let mut desk = solved_desk();
        desk.key(Key::B, NONE);
        desk.type_in("lantern");
        desk.click_words("revolution");
        if goes_by_field {
            // its axis has a place already, and so its fields are there to be clicked
            desk.click_words("Two points near its axis, to begin with");
            desk.type_in("1 0 -2");
            desk.click_words("ring 1, 1");
        }
        desk.type_in("1.5 0 / 1.5 1 / 0.5 3 / 0.25 3");
        desk.settle();
        if goes_by_field {
            desk.click(desk.find("axis, one") + Vec2::new(150.0, 0.0), NONE);
            desk.key(Key::A, CTRL);
        } else {
            desk.click_words("Two points near its axis, to begin with");
        }
        desk.settle();
        desk.type_in("2 0 -2");
        desk.frame(Vec::new());
        let told = told(&desk);
        assert!(told.contains("radius 1.500 m, ring radius 1.500 m, ring radius 0.500 m, ring radius 0.250 m"), "{told}");
        desk.key(Key::Enter, NONE);
        let made = shape(&desk, "lantern");
        let rings: Vec<DVec3> = made.rings.iter().flat_map(|ring| places(&desk, ring)).map(|(_, place)| place).collect();
        let ring = |radius: f64, height: f64| DVec3::new(2.0 + radius, height, -2.0);
        assert_eq!(rings, [ring(1.5, 0.0), ring(1.5, 1.0), ring(0.5, 3.0), ring(0.25, 3.0)]);
    }
}

#[test]
fn rings_without_an_axis_ask_for_it_and_other_axes_may_rest_on_the_first_corner() {
    let mut desk = solved_desk();
    begin(&mut desk, "lantern", Key::Num7);
    desk.type_in("1.5 0 / 2 1");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("ring 1, 1: 1.5 0 is a radius and a height about a plumb axis"), "{}", told(&desk));
    desk.key(Key::Tab, NONE);
    desk.type_in(". 0 0");
    desk.frame(Vec::new());
    assert!(told(&desk).contains("axis, one: . rests on a place before it"), "{}", told(&desk));
    desk.key(Key::A, CTRL);
    desk.type_in("tower-sw");
    desk.key(Key::Enter, NONE);
    // above a corner that is marked, where it is now
    let [_, above] = shape(&desk, "lantern").axis.unwrap();
    let above_m = places(&desk, &[above])[0].1 * 1000.0;
    assert!((above_m - above_m.round()).length() < 1e-9, "{above_m}");
    begin(&mut desk, "shaft", Key::Num4);
    desk.type_in("1 0 0 / 0 0 1 / -1 0 0");
    desk.click_words("upper rim 1");
    // the last of the lower rim
    desk.type_in(". 2 . / 0 2 1 / 1 2 0");
    desk.click_words("Two points near its axis, to begin with");
    // its first
    desk.type_in(".-1 . .");
    desk.frame(Vec::new());
    desk.key(Key::Enter, NONE);
    let made = shape(&desk, "shaft");
    let of = |names: &[String]| places(&desk, names).into_iter().map(|(_, place)| place).collect::<Vec<_>>();
    assert_eq!(of(&made.top)[0], DVec3::new(-1.0, 2.0, 0.0));
    assert_eq!(of(&made.axis.unwrap()), [DVec3::ZERO, DVec3::Y]);
}

#[test]
fn a_point_whose_name_has_a_stroke_is_one_of_a_line_s_places() {
    let mut desk = solved_desk();
    while desk.app.active_point() != Some("tower-sw") {
        desk.key(Key::Tab, NONE);
    }
    desk.key(Key::F2, NONE);
    desk.type_in("north/3");
    desk.key(Key::Enter, NONE);
    desk.rest();
    let at = desk.solved().position_m("north/3").unwrap();
    begin(&mut desk, "sill", Key::Num1);
    desk.type_in("north/3+0.5 0 0 / . . 1 / north/3");
    desk.key(Key::Enter, NONE);
    let made = shape(&desk, "sill");
    let corners: Vec<DVec3> = places(&desk, &made.points).into_iter().map(|(_, place)| place).collect();
    assert_eq!((made.points[2].as_str(), corners.len()), ("north/3", 2));
    assert!(corners[0].distance(DVec3::new(at.x + 0.5, 0.0, 0.0)) < 0.001 && corners[1].z == 1.0, "{corners:?} {at}");
}

#[test]
fn marked_corners_move_and_so_two_of_them_are_no_box() {
    let mut desk = solved_desk();
    for (line, is_one) in [("tower-sw / house-ne-top", false), ("tower-sw / 9 9 -9", false), ("0 0 0 / tower-sw+9 9 -9", true)]
    {
        begin(&mut desk, "hall", Key::Num2);
        desk.type_in(line);
        desk.frame(Vec::new());
        assert_eq!(told(&desk).contains("length"), is_one, "{line}: {}", told(&desk));
        desk.key(Key::Escape, NONE);
        desk.key(Key::Escape, NONE);
    }
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
