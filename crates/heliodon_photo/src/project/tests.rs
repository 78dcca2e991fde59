use super::*;

const TEXT: &str = r#"
[project]
name = "Castle"

[[lens]]
name = "ixus"
focal = 1668.8

[[photo]]
file = "images/a.jpg"
lens = "ixus"
size_px = [1600, 1200]

[[photo]]
file = "images/b.jpg"
size_px = [1600, 1200]

[[point]]
name = "tower"
known_m = [1.0, 2.0, 3.0]
[point.marks]
"a.jpg" = [812.5, 33]
"b.jpg" = [799.25, 41.5]

[[point]]
name = "door"
ground = true

[[edge]]
axis = "y"
photo = "a.jpg"
segments = [[[10.0, 900.0], [12.0, 100.0]]]

[[distance]]
between = ["tower", "door"]
metres = 12.5

[[direction]]
from = "door"
to = "tower"
toward = "north"
"#;

#[test]
fn a_project_becomes_a_problem_and_is_written_back_the_same() {
    let project = Project::parse(TEXT, "photos.toml").unwrap();
    let problem = project.problem(&[], &[]).unwrap();
    assert_eq!((problem.photos.len(), problem.lenses.len(), problem.marks.len()), (2, 2, 2));
    assert_eq!(problem.lenses[0].focal, Focal::Known(1668.8));
    assert_eq!(problem.lenses[1].focal, Focal::Free);
    assert_eq!(problem.points[0].known_m, Some(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(problem.directions[0].world, DVec3::NEG_Z);
    assert_eq!((problem.edges[0].axis, problem.edges[0].photo), (1, 0));
    let text = project.text().unwrap();
    let again = Project::parse(&text, "photos.toml").unwrap();
    assert_eq!(again.text().unwrap(), text);
    assert!(text.contains("\n\"a.jpg\" = [812.5, 33.0]\n"), "{text}");
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    for (from, to, place, words) in [
        ("focal = 1668.8", "focal = -1", 7, "above 0"),
        ("name = \"ixus\"", "nome = \"ixus\"", 6, "unknown field"),
        ("\"b.jpg\" = [799.25", "\"c.jpg\" = [799.25", 23, "no [[photo]] of that name"),
        ("toward = \"north\"", "toward = \"nord\"", 41, "nord"),
        ("toward = \"north\"", "toward = 400", 41, "clockwise"),
        ("metres = 12.5", "metres = 0", 34, "above 0"),
        ("lens = \"ixus\"\n", "lens = \"other\"\n", 11, "no [[lens]] called other"),
        ("file = \"images/b.jpg\"", "file = \"a.jpg\"", 15, "two photographs"),
    ] {
        let text = TEXT.replacen(from, to, 1);
        let error = Project::parse(&text, "photos.toml").unwrap_err();
        assert!(error.message.contains(words), "{error}");
        assert_eq!(error.place.map(|p| p.0), Some(place), "{error}");
    }
}

#[test]
fn a_photograph_of_unknown_size_is_named() {
    let text = TEXT.replacen("size_px = [1600, 1200]\n", "", 1);
    let error = Project::parse(&text, "photos.toml").unwrap().problem(&[], &[]).unwrap_err();
    assert!(error.message.contains("a.jpg"), "{error}");
}

#[test]
fn a_named_lens_takes_what_was_solved_for_it_but_for_what_is_said_of_it() {
    let project = Project::parse(TEXT, "photos.toml").unwrap();
    let solved = Intrinsics { radial: [-0.1, 0.02, 0.0], ..Intrinsics::pinhole(1600, 1200, 1700.0) };
    let taken = |name: &str| crate::formats::ImportedCamera {
        name: name.to_owned(),
        lens: 1,
        camera: crate::camera::Camera {
            intrinsics: solved,
            pose: crate::camera::Pose::from_centre(glam::DQuat::IDENTITY, DVec3::ONE),
        },
        centred: false,
    };
    let imported = ImportedCameras { cameras: vec![taken("a.jpg"), taken("b.jpg")], ..ImportedCameras::default() };
    let problem = project.problem(&[], &[imported]).unwrap();
    let [named, other] = &problem.lenses[..] else { panic!("{:?}", problem.lenses) };
    assert_eq!((named.focal, named.intrinsics.radial), (Focal::Known(1668.8), solved.radial));
    assert_eq!((other.focal, other.intrinsics), (Focal::Known(1700.0), solved));
    assert_eq!((named.free, other.free), (Free::default(), Free::default()));
}

#[test]
fn photographs_that_tell_nothing_of_their_lens_are_matched_with_one() {
    let text = TEXT.replace("lens = \"ixus\"\n", "");
    let mut project = Project::parse(&text, "photos.toml").unwrap();
    let loaded = project.load_for_matching().unwrap();
    assert_eq!((loaded.problem.lenses.len(), loaded.problem.photos[1].lens), (1, 0));
    assert!(loaded.notes[0].contains("2 photographs of 1600 x 1200 pixels tell nothing of their lens"), "{:?}", loaded.notes);
    // One that has a lens keeps it, and then the other is alone.
    let named = Project::parse(TEXT, "photos.toml").unwrap().load_for_matching().unwrap();
    assert_eq!((named.problem.lenses.len(), named.notes.len()), (2, 0));
    // A matching's cameras take the place of an earlier one's, others stay, and neither is asked for the next: the file is not even there.
    project.take_over("colmap/sparse/0", CameraFormat::Colmap);
    project.take_over_matched("colmap/refined");
    project.take_over_matched("colmap/refined");
    assert!(project.load_for_matching().is_ok());
    project.take_over("colmap.json", CameraFormat::Openmvg);
    let files: Vec<&str> = project.file.cameras.iter().map(|c| c.file.as_str()).collect();
    assert_eq!(files, ["colmap/refined", "colmap.json"]);
}

#[test]
fn a_direction_is_a_word_or_a_bearing() {
    for (toward, unit) in [
        ("0", DVec3::NEG_Z),
        ("90", DVec3::X),
        ("-90.0", DVec3::NEG_X),
        ("135.0", DVec3::new(0.5f64.sqrt(), 0.0, 0.5f64.sqrt())),
        ("\"south\"", DVec3::Z),
        ("\"down\"", DVec3::NEG_Y),
    ] {
        let text = TEXT.replacen("toward = \"north\"", &format!("toward = {toward}"), 1);
        let project = Project::parse(&text, "photos.toml").unwrap();
        let found = project.problem(&[], &[]).unwrap().directions[0].world;
        assert!(found.distance(unit) < 1e-12, "{toward}: {found}");
        let again = Project::parse(&project.text().unwrap(), "photos.toml").unwrap();
        assert_eq!(again.file.direction, project.file.direction);
    }
}
