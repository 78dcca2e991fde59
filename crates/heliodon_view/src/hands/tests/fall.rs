//! What hands let go of, as bodies.

use super::*;
use crate::bodies::Bodies;

/// The lowest corner of the mallet.
fn lowest(place: Affine3A) -> f32 {
    let corners = (0..8).map(|i| {
        Vec3::select(BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0), Vec3::new(0.28, 0.08, 0.08), Vec3::new(0.2, 0.0, -0.08))
    });
    let grip = (0..4).map(|i| Vec3::new(-0.05, 0.03 * (i & 1) as f32, 0.01 - 0.02 * (i >> 1) as f32));
    corners.chain(grip).map(|p| place.transform_point3(p).y).fold(f32::INFINITY, f32::min)
}

#[test]
fn what_is_not_put_on_anything_falls_before_walls() {
    let mut visit = Visit::new();
    visit.take("mallet", MALLET + Vec3::new(0.1, 0.02, 0.0));
    visit.pass(0.4);
    // close to the wall: it is drawn nearer, and let go before it
    visit.visitor().pose = Pose::looking(Vec3::new(2.5, 1.6, WALL_Z + 0.25), Vec3::new(2.5, 1.6, -9.0));
    visit.frames(3);
    let scale = visit.place("mallet").matrix3.determinant().cbrt();
    assert!(scale < 0.6, "{scale}");
    for corner in [Vec3::new(-0.05, 0.0, -0.08), Vec3::new(0.28, 0.08, 0.08), Vec3::new(0.28, 0.0, -0.08)] {
        assert!(visit.place("mallet").transform_point3(corner).z > WALL_Z, "in the wall");
    }
    visit.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(KeyCode::KeyE);
    visit.frames(1);
    let fallen = visit.hands().let_go.first().cloned().unwrap();
    assert!((fallen.world_from_model.matrix3.determinant() - 1.0).abs() < 1e-3, "of its own size");
    let middle = fallen.world_from_model.transform_point3(Vec3::new(0.115, 0.04, 0.0));
    assert!(middle.z > WALL_Z && middle.z < WALL_Z + 0.3, "{middle}");
}

#[test]
fn what_is_let_go_in_the_air_comes_to_lie_on_what_is_below() {
    let fall = || {
        let mut visit = Visit::new();
        visit.take("mallet", MALLET + Vec3::new(0.1, 0.02, 0.0));
        visit.look_at(Vec3::new(0.0, 1.9, 9.0));
        visit.pass(0.2);
        let held_m = visit.place("mallet").translation.y;
        visit.press(KeyCode::KeyE);
        assert!(visit.app.world().resource::<Bodies>().is_falling("mallet"));
        visit.pass(3.0);
        let lies = visit.place("mallet");
        assert!(lies.translation.y < held_m - 0.5 && lowest(lies).abs() < 0.015, "{held_m} {lies:?}");
        assert!(!visit.app.world().resource::<Bodies>().is_falling("mallet"));
        visit.pass(0.5);
        assert_eq!(visit.place("mallet"), lies, "it lies still");
        (visit, lies)
    };
    let (mut visit, lies) = fall();
    // and can be taken again
    visit.look_at(lies.transform_point3(Vec3::new(0.24, 0.04, 0.0)));
    visit.press(KeyCode::KeyE);
    assert_eq!(visit.held()[0], Some("mallet"));
    // the same visit ends in the same way
    let again = fall().1;
    assert_eq!(again.to_cols_array().map(f32::to_bits), lies.to_cols_array().map(f32::to_bits));
}

#[test]
fn what_is_put_onto_a_table_stays_there_and_is_met_by_what_falls_onto_it() {
    let mut visit = Visit::new();
    visit.take("brush", BRUSH + Vec3::Y * 0.07);
    visit.look_at(Vec3::new(-0.9, 1.0, -1.2));
    visit.press(KeyCode::KeyE);
    let put = visit.place("brush");
    visit.pass(1.0);
    let stands = visit.place("brush");
    assert!(stands.translation.distance(put.translation) < 0.01 && (stands.translation.y - 1.0).abs() < 0.01, "{stands:?}");
    assert!(stands.transform_vector3(Vec3::Y).abs_diff_eq(Vec3::Y, 0.02), "upright");
    // one more on top of it, and it carries it
    visit.take("leaf", LEAF + Vec3::Y * 0.07);
    let above = Affine3A::from_translation(Vec3::from(stands.translation) + Vec3::Y * 0.5);
    visit.app.world_mut().resource_mut::<Wishes>().hands.push(Wish::Take { thing: "leaf".to_owned() });
    visit.frames(1);
    visit.app.world_mut().resource_mut::<Bodies>().release("leaf", above, Vec3::ZERO, Vec3::ZERO);
    visit.pass(0.02);
    visit.told();
    let mut met = false;
    for _ in 0..100 {
        visit.frames(1);
        let impacts = visit.app.world().resource::<Bodies>().impacts();
        met |= impacts.iter().any(|impact| impact.name == "leaf" && impact.with.as_deref() == Some("brush"));
    }
    let (leaf, brush) = (visit.place("leaf").translation, visit.place("brush").translation);
    assert_eq!(visit.told().first().map(String::as_str), Some("leaf hit brush"));
    assert!(met && (leaf.y - 1.14).abs() < 0.02 && (brush.y - 1.0).abs() < 0.01, "{leaf} on {brush}");
}

#[test]
fn what_is_thrown_goes_through_no_wall_and_what_is_lost_comes_back() {
    let mut visit = Visit::new();
    let throw = |visit: &mut Visit, from: Vec3, velocity: Vec3| {
        let mut bodies = visit.app.world_mut().resource_mut::<Bodies>();
        bodies.release("brush", Affine3A::from_translation(from), velocity, Vec3::X * 4.0);
        visit.pass(3.0);
        visit.place("brush").translation
    };
    let at = throw(&mut visit, Vec3::new(0.0, 1.8, -1.0), Vec3::new(0.0, 0.0, -20.0));
    assert!(at.z > WALL_Z && at.y > -0.01 && at.y < 1.2, "{at}");
    // down onto the table, then onto the floor
    let from = Affine3A::from_translation(Vec3::new(0.8, 1.4, -1.2));
    visit.app.world_mut().resource_mut::<Bodies>().release("brush", from, Vec3::NEG_Y * 20.0, Vec3::ZERO);
    for _ in 0..100 {
        visit.frames(1);
        let at = visit.place("brush").translation;
        // It bounces, and may fall off the table's side.
        assert!(at.y > 0.95 || at.z > -0.9 || at.z < -1.5 || at.x.abs() > 2.0, "{at}");
    }
    let at = throw(&mut visit, Vec3::new(3.0, 0.5, 2.0), Vec3::new(0.0, -500.0, 0.0));
    assert!(at.y > -0.01, "{at}");
    // beside the floor
    let at = throw(&mut visit, Vec3::new(12.0, 1.0, 0.0), Vec3::ZERO);
    assert!(Vec3::from(at).abs_diff_eq(BRUSH, 1e-5), "{at}");
}

#[test]
fn scripts_give_take_and_let_fall() {
    let mut visit = Visit::new();
    let gives = |thing: &str, hand| Wish::Give { thing: thing.to_owned(), hand };
    visit.wish(gives("jug", Hand::Left));
    assert_eq!(visit.held(), [None, Some("jug")]);
    visit.pass(0.4);
    let actors = visit.app.world().resource::<Actors>();
    assert!(!actors.directions["jug"].hidden, "it is shown");
    let at = visit.place("jug").translation;
    assert!(at.x < 0.0 && at.y < EYE.y, "at the lower left: {at}");
    visit.wish(gives("jug", Hand::Right));
    assert_eq!(visit.held(), [Some("jug"), None]);
    visit.wish(gives("nothing", Hand::Right));
    assert_eq!(visit.held(), [Some("jug"), None]);
    visit.app.world_mut().resource_mut::<Wishes>().hands.push(Wish::Drop { thing: "jug".to_owned() });
    visit.frames(1);
    assert!(visit.held() == [None, None] && visit.hands().let_go.len() == 1);
    visit.wish(gives("mallet", Hand::Right));
    visit.pass(0.3);
    visit.app.world_mut().resource_mut::<Wishes>().hands.push(Wish::Take { thing: "mallet".to_owned() });
    visit.frames(1);
    assert!(visit.held() == [None, None] && visit.hands().let_go.is_empty());
    assert_eq!(visit.hands().taken_up, ["mallet"]);
    assert!(Vec3::from(visit.place("mallet").translation).abs_diff_eq(MALLET, 1e-6), "back where it belongs");
    // what is hidden is in no hand
    visit.wish(gives("urn", Hand::Right));
    visit.app.world_mut().resource_mut::<Actors>().directions.get_mut("urn").unwrap().hidden = true;
    visit.frames(1);
    assert_eq!(visit.held(), [None, None]);
    assert_eq!(visit.told(), [""; 0], "they know what they did");
}
