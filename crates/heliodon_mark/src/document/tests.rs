use super::*;
use heliodon_photo::model::table::ShapeRow;
use heliodon_photo::project::{AxisEntry, DirectionEntry, FocalEntry, LensEntry, Toward};

const TEXT: &str = r#"# the castle, as of spring
[project]
name = "Castle"   # for people

[[photo]]
file = "images/a.jpg"
size_px = [1600, 1200]
[[photo]]
file = "images/b.jpg"
size_px = [1600, 1200]

# the corner that the cat sat on
[[point]]
name = "tower"
known_m = [1, 2, 3]
[point.marks]
"b.jpg" = [ 799.25, 41.5 ]   # hard to see
"a.jpg" = [812.5, 33]

[[point]]
ground = true
name = "door"

[[distance]]
metres = 12.5  # by tape
between = ["tower", "door"]

[[edge]]
axis = "y"
photo = "a.jpg"
segments = [
    [[10.0, 900.0], [12.0, 100.0]],   # left jamb
]

[[shape]]
name = "tower"
kind = "polygon"
points = ["tower", "door", "-"]

# the end
"#;

fn document(text: &str) -> (tempfile::TempDir, Document) {
    let home = tempfile::tempdir().unwrap();
    fs::write(home.path().join(PROJECT_FILE_NAME), text).unwrap();
    let document = Document::open(home.path()).unwrap();
    (home, document)
}

fn set_mark(point: &str, photo: &str, pixel: [f64; 2]) -> Edit {
    Edit::SetMark { point: point.into(), photo: photo.into(), pixel }
}

/// Lines that left and lines that came.
fn differing(old: &str, new: &str) -> (Vec<String>, Vec<String>) {
    let only = |from: &str, other: &str| {
        let mut others: Vec<&str> = other.lines().collect();
        let mut only = Vec::new();
        for line in from.lines() {
            match others.iter().position(|o| *o == line) {
                Some(at) => drop(others.remove(at)),
                None => only.push(line.to_owned()),
            }
        }
        only
    };
    (only(old, new), only(new, old))
}

fn row(name: &str) -> Box<ShapeRow> {
    let text = format!(
        "name = {name:?}\nkind = \"box\"\npoints = [\"tower\", \"door\"]\nrepeat = {{ count = 2, step = [\"tower\", \"door\"] }}"
    );
    Box::new(toml_edit::de::from_str(&text).unwrap())
}

fn polygon(name: &str) -> Box<ShapeRow> {
    let text = format!("name = {name:?}\nkind = \"polygon\"\npoints = [\"tower\", \"door\", \"-\"]");
    Box::new(toml_edit::de::from_str(&text).unwrap())
}

fn direction(toward: Toward) -> DirectionEntry {
    DirectionEntry { from: "door".into(), to: "tower".into(), toward }
}

fn set_lens(was: Option<&str>, name: &str, photos: &[&str]) -> Edit {
    let lens = LensEntry { name: name.into(), focal: FocalEntry::Known(1668.5), ..LensEntry::default() };
    let photos = photos.iter().map(|photo| (*photo).to_owned()).collect();
    Edit::SetLens { was: was.map(str::to_owned), lens: Box::new(lens), photos }
}

fn edits() -> Vec<(Edit, usize, usize)> {
    let between = ["door".to_owned(), "tower".to_owned()];
    vec![
        (set_mark("tower", "b.jpg", [700.126, 40.0]), 1, 1),
        (set_mark("door", "a.jpg", [1.0, 2.0]), 0, 2),
        (set_mark("tower", "a.jpg", [812.5, 34.0]), 1, 1),
        (Edit::RemoveMark { point: "tower".into(), photo: "a.jpg".into() }, 1, 0),
        (Edit::AddPoint { name: "new \"one\"".into() }, 0, 3),
        (Edit::RenamePoint { from: "tower".into(), to: "keep".into() }, 3, 3),
        (Edit::SetGround { name: "door".into(), ground: false }, 1, 0),
        (Edit::SetGround { name: "tower".into(), ground: true }, 0, 1),
        (Edit::AddSegment { photo: "a.jpg".into(), axis: AxisEntry::Y, ends: [[1.0, 2.0], [3.0, 4.0]] }, 0, 1),
        (Edit::AddSegment { photo: "b.jpg".into(), axis: AxisEntry::X, ends: [[1.0, 2.0], [3.0, 4.0]] }, 0, 7),
        (Edit::RemoveSegment { edge: 0, segment: 0 }, 7, 0),
        (Edit::AddShape(row("gate")), 0, 8),
        (Edit::RemoveShape { name: "tower".into() }, 5, 0),
        (Edit::SetDistance { between: between.clone(), metres: 13.0 }, 1, 1),
        (Edit::RemoveDistance { between }, 4, 0),
        (Edit::AddPhoto { file: "images/c.jpg".into() }, 0, 3),
        (Edit::SetShape { was: "tower".into(), row: polygon("keep") }, 1, 1),
        (Edit::SetDirection(direction(Toward::North)), 0, 5),
        (Edit::SetKnown { name: "tower".into(), known_m: Some([1.0, 2.0, 4.5]) }, 1, 1),
        (Edit::SetKnown { name: "door".into(), known_m: Some([1.0, 2.0, 4.5]) }, 0, 1),
        (Edit::SetKnown { name: "tower".into(), known_m: None }, 1, 0),
        (set_lens(None, "wide", &["a.jpg"]), 0, 6),
    ]
}

#[test]
fn every_edit_leaves_the_rest_as_it_was_and_is_undone_to_the_byte() {
    for (edit, least_gone, most_come) in edits() {
        let (_home, mut document) = document(TEXT);
        document.edit(&edit).unwrap();
        let (gone, come) = differing(TEXT, document.text());
        assert_eq!(gone.len(), least_gone, "{edit:?}: {gone:?}");
        assert!(come.len() <= most_come && (most_come == 0 || !come.is_empty()), "{edit:?}: {come:?}");
        for comment in ["# the castle, as of spring", "# for people", "# the end"] {
            assert!(document.text().contains(comment), "{edit:?}\n{}", document.text());
        }
        let after = document.text().to_owned();
        assert_eq!(document.undo(), Some(edit.what()));
        assert_eq!(document.text(), TEXT);
        assert_eq!(document.redo(), Some(edit.what()));
        assert_eq!(document.text(), after);
    }
}

#[test]
fn all_edits_in_a_row_are_undone_in_a_row() {
    let (_home, mut document) = document(TEXT);
    let done = edits().iter().filter(|(edit, ..)| document.edit(edit).is_ok()).count();
    assert!(done >= 9, "{done}");
    assert_eq!(document.steps(), (done, 0));
    let last = document.text().to_owned();
    while document.undo().is_some() {}
    assert_eq!((document.text(), document.steps()), (TEXT, (0, done)));
    while document.redo().is_some() {}
    assert_eq!(document.text(), last);
}

#[test]
fn a_moved_mark_is_one_line_and_keeps_its_comment() {
    let (_home, mut document) = document(TEXT);
    document.edit(&set_mark("tower", "b.jpg", [700.126, 40.0])).unwrap();
    let (_, come) = differing(TEXT, document.text());
    assert_eq!(come, ["\"b.jpg\" = [ 700.13, 40.0 ]   # hard to see"]);
    assert_eq!(document.project().file.point[0].marks["b.jpg"], [700.13, 40.0]);
}

#[test]
fn a_segment_more_is_a_line_more() {
    let (_home, mut document) = document(TEXT);
    let add = |photo: &str, y: f64| Edit::AddSegment { photo: photo.into(), axis: AxisEntry::Y, ends: [[1.0, y], [3.0, 4.0]] };
    for photo in ["a.jpg", "b.jpg"] {
        document.edit(&add(photo, 2.0)).unwrap();
        let before = document.text().to_owned();
        document.edit(&add(photo, 3.0)).unwrap();
        let (gone, come) = differing(&before, document.text());
        assert_eq!((gone.len(), come), (0, vec!["    [[1.0, 3.0], [3.0, 4.0]],".to_owned()]), "{}", document.text());
    }
    assert!(document.text().contains("# left jamb"));
    let lengths: Vec<usize> = document.project().file.edge.iter().map(|edge| edge.segments.len()).collect();
    assert_eq!(lengths, [3, 2]);
}

#[test]
fn a_renamed_point_is_renamed_wherever_it_is_named() {
    let (_home, mut document) = document(TEXT);
    document.edit(&Edit::RenamePoint { from: "tower".into(), to: "keep".into() }).unwrap();
    let file = &document.project().file;
    assert_eq!(file.point[0].name, "keep");
    assert_eq!(file.distance[0].between, ["keep", "door"]);
    assert_eq!(
        (file.shape[0].name.as_str(), &file.shape[0].points[..2]),
        ("tower", &["keep".to_owned(), "door".to_owned()][..])
    );
    assert!(document.text().contains("# the corner that the cat sat on"));
}

#[test]
fn a_direction_is_one_for_two_points_whichever_way_it_leads() {
    let (_home, mut document) = document(TEXT);
    document.edit(&Edit::SetDirection(direction(Toward::North))).unwrap();
    assert!(
        document.text().contains("\n[[direction]]\nfrom = \"door\"\nto = \"tower\"\ntoward = \"north\"\n"),
        "{}",
        document.text()
    );
    let back = DirectionEntry { from: "tower".into(), to: "door".into(), toward: Toward::Bearing(12.5) };
    document.edit(&Edit::SetDirection(back.clone())).unwrap();
    assert_eq!(document.project().file.direction, [back]);
    document.edit(&Edit::RenamePoint { from: "tower".into(), to: "keep".into() }).unwrap();
    assert_eq!(document.project().file.direction[0].from, "keep");
    document.edit(&Edit::RemoveDirection { between: ["door".into(), "keep".into()] }).unwrap();
    assert!(document.project().file.direction.is_empty() && !document.text().contains("direction"));
}

#[test]
fn a_lens_takes_its_photographs_along_and_lets_them_go() {
    let (_home, mut document) = document(TEXT);
    let lenses = |document: &Document| -> Vec<Option<String>> {
        document.project().file.photo.iter().map(|photo| photo.lens.clone()).collect()
    };
    document.edit(&set_lens(None, "wide", &["a.jpg", "b.jpg"])).unwrap();
    assert_eq!(lenses(&document), [Some("wide".to_owned()), Some("wide".to_owned())]);
    document.edit(&set_lens(Some("wide"), "narrow", &["b.jpg"])).unwrap();
    assert_eq!(lenses(&document), [None, Some("narrow".to_owned())]);
    assert_eq!(document.project().file.lens.len(), 1);
    let told = document.edit(&set_lens(None, "narrow", &[])).unwrap_err().to_string();
    assert!(told.contains("two lenses"), "{told}");
    document.edit(&Edit::RemoveLens { name: "narrow".into() }).unwrap();
    assert_eq!((lenses(&document), document.project().file.lens.len()), (vec![None, None], 0));
    while document.undo().is_some() {}
    assert_eq!(document.text(), TEXT);
}

#[test]
fn a_shape_is_written_with_a_line_for_each_of_its_settings() {
    let (_home, mut document) = document(TEXT);
    let text = "name = \"gate\"\nkind = \"box\"\npoints = [\"tower\", \"door\"]\non = { top = [\"door\"] }\n\
                edges = [{ photograph = \"a.jpg\", from = [1.0, 2.0], to = [3.5, 4.0], between = [0, 4] }]\nupright = true\n\
                repeat = { count = 2, step = [\"tower\", \"door\"] }\n";
    let row: Box<ShapeRow> = Box::new(toml_edit::de::from_str(text).unwrap());
    document.edit(&Edit::AddShape(row.clone())).unwrap();
    assert!(document.text().ends_with(&format!("\n[[shape]]\n{text}\n# the end\n")), "{}", document.text());
    let fewer = ShapeRow { repeat: None, sides: Some(12), ..*row.clone() };
    document.edit(&Edit::SetShape { was: "gate".into(), row: Box::new(fewer.clone()) }).unwrap();
    assert_eq!(document.project().file.shape[1], fewer);
    document.edit(&Edit::SetShape { was: "gate".into(), row: row.clone() }).unwrap();
    assert_eq!(document.project().file.shape[1], *row);
    let none = Edit::SetShape { was: "nave".into(), row };
    assert!(document.edit(&none).unwrap_err().to_string().contains("no shape called nave"));
}

#[test]
fn what_cannot_be_done_is_said_and_nothing_changes() {
    let (_home, mut document) = document(TEXT);
    for (edit, words) in [
        (set_mark("nobody", "a.jpg", [1.0, 2.0]), "no point called nobody"),
        (set_mark("tower", "z.jpg", [1.0, 2.0]), "no [[photo]] of that name"),
        (set_mark("tower", "a.jpg", [f64::NAN, 2.0]), "no pixel"),
        (Edit::AddPoint { name: "door".into() }, "two points called door"),
        (Edit::RenamePoint { from: "door".into(), to: "tower".into() }, "already"),
        (Edit::RemovePoint { name: "door".into() }, "shape tower needs door"),
        (Edit::RemoveMark { point: "door".into(), photo: "a.jpg".into() }, "not marked"),
        (Edit::RemoveSegment { edge: 0, segment: 5 }, "no longer"),
        (Edit::SetDistance { between: ["tower".into(), "door".into()], metres: -1.0 }, "above 0"),
        (Edit::AddPhoto { file: "a.jpg".into() }, "two photographs"),
    ] {
        let told = document.edit(&edit).unwrap_err().to_string();
        assert!(told.contains(words), "{told}");
    }
    assert_eq!((document.text(), document.steps(), document.is_changed()), (TEXT, (0, 0), false));
    document.edit(&Edit::RemoveShape { name: "tower".into() }).unwrap();
    document.edit(&Edit::RemovePoint { name: "door".into() }).unwrap();
    assert!(document.project().file.distance.is_empty());
}

#[test]
fn saving_is_whole_and_a_crash_loses_little() {
    let (home, mut document) = document(TEXT);
    let path = home.path().join(PROJECT_FILE_NAME);
    let beside = home.path().join(".photos.toml.autosave");
    assert!(!document.autosave().unwrap());
    document.edit(&set_mark("tower", "a.jpg", [1.0, 2.0])).unwrap();
    assert!(document.autosave().unwrap() && !document.autosave().unwrap());
    assert_eq!(fs::read_to_string(&path).unwrap(), TEXT);
    // The window is gone; the next one offers what it left.
    let mut next = Document::open(&path).unwrap();
    assert!(next.has_left_work() && !next.is_changed());
    next.take_up().unwrap();
    assert_eq!(next.text(), document.text());
    assert_eq!(next.save().unwrap(), Saved::Written);
    assert!(!beside.exists());
    assert_eq!(fs::read_to_string(&path).unwrap(), document.text());
    assert_eq!(fs::read_dir(home.path()).unwrap().count(), 1, "nothing is left about");
    next.undo();
    assert!(next.is_changed());
    next.redo();
    assert!(!next.is_changed());
}

#[test]
fn what_another_program_writes_is_seen_and_not_written_over() {
    let (home, mut document) = document(TEXT);
    let path = home.path().join(PROJECT_FILE_NAME);
    assert_eq!(document.changed_outside(), None);
    let theirs = TEXT.replace("Castle", "Another castle");
    fs::write(&path, &theirs).unwrap();
    document.edit(&set_mark("tower", "a.jpg", [1.0, 2.0])).unwrap();
    assert_eq!(document.changed_outside(), Some(theirs.as_str()));
    assert_eq!(document.save().unwrap(), Saved::ChangedOutside);
    assert_eq!(fs::read_to_string(&path).unwrap(), theirs);
    document.take_theirs().unwrap();
    assert_eq!((document.text(), document.is_changed()), (theirs.as_str(), false));
    document.undo();
    assert_eq!(document.project().file.point[0].marks["a.jpg"], [1.0, 2.0]);
    fs::write(&path, "[project").unwrap();
    assert!(document.changed_outside().is_some() && document.take_theirs().is_err());
    document.keep_ours();
    assert_eq!(document.save().unwrap(), Saved::Written);
    assert_eq!(fs::read_to_string(&path).unwrap(), document.text());
}

#[test]
fn a_folder_of_photographs_becomes_a_project() {
    let home = tempfile::tempdir().unwrap();
    assert!(Document::open(home.path()).unwrap_err().to_string().contains("neither photos.toml nor photographs"));
    assert!(Document::open(home.path().join("nowhere")).unwrap_err().to_string().contains("no such folder or project"));
    for file in ["b.JPG", "a.png", "notes.txt"] {
        fs::write(home.path().join(file), "").unwrap();
    }
    let mut document = Document::open(home.path()).unwrap();
    let names: Vec<&str> = document.project().file.photo.iter().map(|p| p.name()).collect();
    assert_eq!((names, document.is_changed()), (vec!["a.png", "b.JPG"], true));
    document.save().unwrap();
    assert!(Document::open(home.path()).unwrap().text().contains("\n\n[[photo]]\nfile = \"a.png\"\n\n[[photo]]"));
}

#[test]
fn lists_in_brackets_and_inline_marks_are_understood() {
    let text = "photo = [{ file = \"a.jpg\" }]\npoint = [{ name = \"p\", marks = { \"a.jpg\" = [1, 2] } }]\n";
    let (_home, mut document) = document(text);
    document.edit(&set_mark("p", "a.jpg", [3.0, 4.0])).unwrap();
    document.edit(&Edit::AddPoint { name: "q".into() }).unwrap();
    document.edit(&set_mark("q", "a.jpg", [5.0, 6.0])).unwrap();
    let marks: Vec<[f64; 2]> = document.project().file.point.iter().map(|p| p.marks["a.jpg"]).collect();
    assert_eq!(marks, [[3.0, 4.0], [5.0, 6.0]]);
}
