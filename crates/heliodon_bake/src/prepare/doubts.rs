//! What is odd about rooms and parts: told as warnings, for a room in the wrong place makes a bundle of the wrong stones.

use super::fit::MOST_ROUNDS;
use super::part::{simplifies, simplify_params};
use super::{PrepareReport, Work};
use crate::error::BakeError;
use heliodon_bundle::site::{Role, Room, SITE_FILE_NAME};
use heliodon_mesh::Mesh;
use heliodon_prepare::purge::{PurgeParams, PurgeReport, RoomReport, Verified};

/// Columns and furniture within a room take a few percent of its box; a box that reaches into a wall takes more.
const STONE_IN_ROOMS: f64 = 0.05;

/// A final purge and burial draw a few more or fewer triangles than were counted for their number.
const ABOUT: f64 = 1.1;

/// One sentence for each part of which cleaning leaves nothing.
///
/// # Errors
/// Where it leaves nothing of any part.
pub(super) fn empty_parts(work: &Work, report: &PrepareReport) -> Result<Vec<String>, BakeError> {
    let files = |part: usize| crate::scene::files_of(work.files, part).map(|file| file.name.clone());
    let empty: Vec<usize> = (0..report.parts.len()).filter(|&part| report.parts[part].triangles_original == 0).collect();
    if empty.len() == report.parts.len() {
        let triangles = report.parts.iter().map(|part| part.triangles_read).sum();
        let files = empty.into_iter().flat_map(files).collect::<Vec<_>>().join(", ");
        return Err(BakeError::NothingLeft { triangles, files });
    }
    let told = |part: usize| {
        let (of_part, files) = (&report.parts[part], files(part).collect::<Vec<_>>().join(", "));
        format!(
            "part {}: nothing is left of the {} triangles of {files} after cleaning; mend the files, or write clean = false into [prepare] of {SITE_FILE_NAME}",
            of_part.name, of_part.triangles_read
        )
    };
    Ok(empty.into_iter().map(told).collect())
}

/// One sentence for each scan that is smaller than the distance from which it is taken to be seen, and nearer to a room: its file is hardly in
/// metres, and it would be simplified to a few triangles.
pub(super) fn small_parts(work: &Work, meshes: &[Mesh]) -> Vec<String> {
    let nearest_m = work.settings.nearest_m;
    let told = |(index, mesh): (usize, &Mesh)| {
        let (part, (low, high)) = (&work.site.parts[index], mesh.bounds()?);
        let (size_m, away_m) = (f64::from(low.distance(high)), f64::from(work.views.distance_to_box_m(low, high)));
        let doubtful = part.role == Role::Scan && size_m < nearest_m && away_m < nearest_m;
        doubtful.then(|| {
            format!(
                "part {}: it is {size_m:.3} m large, {away_m:.3} m from the nearest room, and simplified as if it were seen from {nearest_m} m; \
                 in {SITE_FILE_NAME}, give it the unit of its file, or write a smaller nearest_m into [prepare]",
                part.display_name()
            )
        })
    };
    meshes.iter().enumerate().filter_map(told).collect()
}

/// A sentence where far more is drawn than the site wants.
pub(super) fn number_doubt(work: &Work, drawn: u64) -> Option<String> {
    let (settings, wanted) = (work.settings, work.settings.triangles);
    if wanted == 0 || drawn as f64 <= ABOUT * wanted as f64 {
        return None;
    }
    let why = match (simplifies(&simplify_params(settings), &work.views), work.views.cells.is_empty()) {
        (true, _) => format!(
            "they were not fewer after {MOST_ROUNDS} rounds of simplification; parts that are lit by texels or hold many borders keep theirs"
        ),
        (false, true) => {
            "without a [[room]] nothing tells how large a pixel is, so that nothing is simplified; add one, or write error_m"
                .to_owned()
        }
        (false, false) => "error_px = 0 lets nothing be simplified".to_owned(),
    };
    Some(format!("{drawn} triangles are drawn, where [prepare] wants about {wanted}: {why}"))
}

/// One sentence for each room that lies in stone or sees nothing, and one where that keeps the purge from dropping anything.
pub(super) fn room_doubts(rooms: &[Room], purge: &PurgeReport) -> Vec<String> {
    let doubts = rooms.iter().zip(&purge.rooms).filter_map(|(room, report)| room_doubt(room, report));
    let nobody = !purge.rooms.is_empty() && purge.rooms.iter().all(RoomReport::is_blind);
    let all_kept =
        "nobody in any room sees anything, so nothing is dropped that nobody sees; see the warnings of the rooms".to_owned();
    doubts.chain(nobody.then_some(all_kept)).collect()
}

/// One sentence for each room from which more pixels than may still lack a triangle that the purge has dropped, after all of its checks.
pub(super) fn purge_doubts(rooms: &[Room], purge: &PurgeReport, params: &PurgeParams) -> Vec<String> {
    // where nobody sees anything nothing is dropped, and nothing checked
    if purge.passed || purge.checks == 0 {
        return Vec::new();
    }
    let told = |(room, report): (&Room, &RoomReport)| {
        let verified = &report.verified;
        (verified.wrong_share() > params.wrong_share).then(|| {
            let Verified { met, wrong, worst, .. } = verified;
            let place = worst.map_or_else(String::new, |worst| {
                let [x, y, z] = worst.eye;
                format!(", most of them, {}, from ({x:.2}, {y:.2}, {z:.2})", worst.wrong)
            });
            format!(
                "room \"{}\": {wrong} of {met} pixels of random frames lack a triangle that was dropped as one that nobody sees{place}, after {} checks; one in {:.0} may; \
                 write purge_effort = \"archival\", a larger ring, or purge = false into [prepare] of {SITE_FILE_NAME}",
                room.name,
                purge.checks,
                1.0 / params.wrong_share
            )
        })
    };
    rooms.iter().zip(&purge.rooms).filter_map(told).collect()
}

fn room_doubt(room: &Room, report: &RoomReport) -> Option<String> {
    if report.eyes > 0 && report.is_blind() {
        let windows = if room.windows.is_empty() { "" } else { ", and its windows to what is there" };
        return Some(format!("{} sees nothing of the site; {}{windows}", place(room), remedy()));
    }
    stone_doubt(room, report.in_stone)
}

/// A sentence for a room of which such a part lies in stone, if that is too much.
pub(crate) fn stone_doubt(room: &Room, in_stone: f64) -> Option<String> {
    let (place, remedy, stone) = (place(room), remedy(), 100.0 * in_stone);
    if in_stone >= 1.0 {
        Some(format!("{place} lies in stone: no eye in it sees anything; {remedy}"))
    } else if in_stone > STONE_IN_ROOMS {
        Some(format!("{place} reaches into stone with {stone:.0} % of its box, where nobody can stand; {remedy}"))
    } else {
        None
    }
}

fn remedy() -> String {
    format!("set its min and max in {SITE_FILE_NAME} to where visitors' eyes can be")
}

fn place(room: &Room) -> String {
    let [x, y, z] = std::array::from_fn(|axis| 0.5 * (room.min[axis] + room.max[axis]));
    format!("room \"{}\", around ({x:.2}, {y:.2}, {z:.2}),", room.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_prepare::purge::WorstFrame;

    #[test]
    fn a_purge_that_fails_its_last_check_is_told_with_its_pixels() {
        let room =
            |name: &str| Room { name: name.to_owned(), min: [0.0; 3], max: [1.0; 3], windows: Vec::new(), looks_at: None };
        let checked = |wrong: u64| {
            let worst = WorstFrame { eye: [0.5, 1.5, 0.25], forward: [1.0, 0.0, 0.0], met: 4000, wrong: 7 };
            let verified = Verified { frames: 300, met: 1_200_000, wrong, worst: Some(worst), ..Verified::default() };
            RoomReport { seen: 10, verified, ..RoomReport::default() }
        };
        let rooms = [room("hall"), room("cell")];
        let params = PurgeParams::default();
        let purge = PurgeReport { rooms: vec![checked(5), checked(12)], checks: 4, passed: false, ..PurgeReport::default() };
        let [told] = &purge_doubts(&rooms, &purge, &params)[..] else { panic!("the hall's are within what may be") };
        for words in [
            "room \"cell\": 12 of 1200000 pixels",
            "7, from (0.50, 1.50, 0.25), after 4 checks; one in 200000 may",
            "purge_effort = \"archival\", a larger ring",
        ] {
            assert!(told.contains(words), "`{words}` is not in {told}");
        }
        assert!(purge_doubts(&rooms, &PurgeReport { passed: true, ..purge.clone() }, &params).is_empty());
        assert!(purge_doubts(&rooms, &PurgeReport { checks: 0, ..purge }, &params).is_empty());
    }
}
