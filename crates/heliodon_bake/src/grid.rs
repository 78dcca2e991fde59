//! Where the light grid has points: through the rooms down to their ground, and along the actors' paths.
//!
//! A place between points is lit by the corners of its cell, so every box of walkable space takes all lattice points that are corners of
//! a cell that it meets. The lattice hangs at the origin of the site's space, so that it does not move with a room's corner; its
//! planes keep away from whole and half metres, where floors and walls like to be (`ANCHOR`).

use crate::error::BakeError;
use glam::{DVec3, Vec3};
use heliodon_bundle::LightLayout;
use heliodon_bundle::grid::{GridPoints, MAX_GRID_POINTS};
use heliodon_bundle::site::{Actor, Site};
use heliodon_light::lattice_places;
use heliodon_rays::{Hit, NO_HIT, Ray, TriangleScene};
use std::collections::HashSet;

/// How far below a room, in which eyes are, its ground is looked for, metres.
const DOWN_TO_GROUND_M: f64 = 1.9;
/// How far an actor reaches to each side of its path, metres,
const BESIDE_M: f64 = 1.0;
/// below,
const BELOW_M: f64 = 0.1;
/// and above.
const ABOVE_M: f64 = 2.3;
/// The least length of a path's piece that has a box to itself, metres: shorter ones follow a slant no better.
const LEAST_PIECE_M: f64 = 0.5;
/// The part of a cell by which the lattice is off the origin: 2 minus the golden ratio, far from all simple fractions.
const ANCHOR: f64 = 0.381_966_011_250_105_1;
/// What the grid may take in the bundle: a glTF file ends at 4 GiB, and all of it is read into memory.
const MAX_GRID_BYTES: u64 = 2 << 30;
/// Functions of bounced sunlight to reckon with before the solver has chosen: its most.
const MOST_FUNCTIONS: u32 = 44;

/// A piece of walkable space, in the bundle's coordinates.
#[derive(Clone, Copy, Debug)]
struct Piece {
    low: DVec3,
    high: DVec3,
    /// Whether it goes on down to the ground.
    stands_above_ground: bool,
}

/// The lattice points of a site.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GridPlan {
    /// Where lattice coordinates (0, 0, 0) are, metres in the bundle's space.
    pub origin: [f64; 3],
    /// The distance between neighbours, metres.
    pub spacing_m: f64,
    /// Lattice coordinates, each once, ascending.
    pub cells: Vec<[u32; 3]>,
}

impl GridPlan {
    /// The points of a site's grid; none where it has neither rooms nor actors. `actors` are the site's, in the bundle's space. `rays` finds
    /// the ground beneath the rooms; without it they reach as far down as they may, which bounds the number of points.
    ///
    /// # Errors
    /// More points than a grid may have.
    pub fn new(site: &Site, actors: &[Actor], layout: LightLayout, rays: Option<&TriangleScene>) -> Result<Self, BakeError> {
        let spacing_m = site.bake.effective_grid_m();
        let limit = most_points(layout);
        let too_many = |path: &[&str], what: &str| {
            let message = format!("{what} more than {limit} points of the light grid, {spacing_m} m apart");
            let wider = format!("write grid_m = {} or more in [bake], or make it smaller", 2.0 * spacing_m);
            BakeError::from(site.error_at(path, message, wider))
        };
        // only asked and counted; sorted before anyone walks it
        let mut cells: HashSet<[i64; 3]> = HashSet::new();
        for (i, room) in site.rooms.iter().enumerate() {
            let piece = Piece { low: DVec3::from(room.min), high: DVec3::from(room.max), stands_above_ground: true };
            if !piece.add(spacing_m, limit, rays, &mut cells) {
                return Err(too_many(&["room", &i.to_string(), "min"], "this room needs, with what comes before it,"));
            }
        }
        for (i, actor) in actors.iter().enumerate() {
            let ways = actor.ways();
            let mut pieces = ways.iter().flat_map(|way| corridor(way, spacing_m));
            if !pieces.all(|piece| piece.add(spacing_m, limit, None, &mut cells)) {
                let key = if actor.path.is_some() { "path" } else { "place" };
                return Err(too_many(&["actor", &i.to_string(), key], "the actor's path needs, with what comes before it,"));
            }
        }
        Ok(Self::of(cells.into_iter().collect(), spacing_m))
    }

    fn of(cells: Vec<[i64; 3]>, spacing_m: f64) -> Self {
        let Some(low) = cells.iter().copied().reduce(|a, b| [0, 1, 2].map(|axis| a[axis].min(b[axis]))) else {
            return Self { spacing_m, ..Self::default() };
        };
        let origin = low.map(|cell| coordinate(cell, spacing_m));
        // sites whose boxes lie farther apart than that are refused by the bundle
        let own = |cell: [i64; 3]| [0, 1, 2].map(|axis| u32::try_from(cell[axis] - low[axis]).unwrap_or(u32::MAX));
        let mut cells: Vec<[u32; 3]> = cells.into_iter().map(own).collect();
        cells.sort_unstable();
        Self { origin, spacing_m, cells }
    }

    /// Whether there is no grid.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Where the points are, metres in the bundle's space: the very numbers that the bundle stores.
    #[must_use]
    pub fn positions(&self) -> Vec<Vec3> {
        let lattice = GridPoints { origin: self.origin, spacing_m: self.spacing_m, ..GridPoints::default() };
        self.cells.iter().map(|&cell| lattice.position(cell)).collect()
    }

    /// What the solver is asked for: six points each.
    #[must_use]
    pub fn places(&self) -> Vec<(Vec3, Vec3)> {
        lattice_places(&self.positions())
    }

    /// Sixteen hexadecimal digits that differ where the points do: names of blocks of the grid hold them, so that another room or path
    /// takes nothing from this one, and leaves the vertices' blocks as they are.
    #[must_use]
    pub fn digits(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for number in self.origin.iter().chain([&self.spacing_m]) {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(bytemuck::cast_slice(&self.cells));
        hasher.finalize().to_hex()[..16].to_owned()
    }
}

/// The most points whose light fits.
fn most_points(layout: LightLayout) -> usize {
    let functions = layout.sun_bounce_functions.max(MOST_FUNCTIONS);
    let layout = LightLayout { sun_bounce_functions: functions, ..layout };
    ((MAX_GRID_BYTES / heliodon_bundle::grid::point_bytes(layout)) as usize).min(MAX_GRID_POINTS)
}

fn coordinate(cell: i64, spacing_m: f64) -> f64 {
    (cell as f64 + ANCHOR) * spacing_m
}

/// The lattice coordinate at or below a place.
fn at_or_below(place: f64, spacing_m: f64) -> i64 {
    (place / spacing_m - ANCHOR).floor() as i64
}

/// Boxes about the pieces of a path, or about a place.
fn corridor(stations: &[[f64; 3]], spacing_m: f64) -> impl Iterator<Item = Piece> {
    let piece = |a: DVec3, b: DVec3| Piece {
        low: a.min(b) - DVec3::new(BESIDE_M, BELOW_M, BESIDE_M),
        high: a.max(b) + DVec3::new(BESIDE_M, ABOVE_M, BESIDE_M),
        stands_above_ground: false,
    };
    let alone = if let [place] = stations { Some(piece(DVec3::from(*place), DVec3::from(*place))) } else { None };
    let walked = stations.windows(2).flat_map(move |pair| {
        let (from, to) = (DVec3::from(pair[0]), DVec3::from(pair[1]));
        let parts = (from.distance(to) / spacing_m.max(LEAST_PIECE_M)).ceil().max(1.0) as u64;
        let at = move |part: u64| from.lerp(to, part as f64 / parts as f64);
        (0..parts).map(move |part| piece(at(part), at(part + 1)))
    });
    walked.chain(alone)
}

impl Piece {
    /// Adds the corners of all cells that the piece meets; false where they are too many.
    fn add(&self, spacing_m: f64, limit: usize, rays: Option<&TriangleScene>, cells: &mut HashSet<[i64; 3]>) -> bool {
        let down = if self.stands_above_ground { DOWN_TO_GROUND_M } else { 0.0 };
        let first = (self.low - DVec3::Y * down).to_array().map(|place| at_or_below(place, spacing_m));
        let last = self.high.to_array().map(|place| at_or_below(place, spacing_m) + 1);
        let count: f64 = (0..3).map(|axis| (last[axis] - first[axis] + 1) as f64).product();
        let columns = || (first[0]..=last[0]).flat_map(|x| (first[2]..=last[2]).map(move |z| (x, z)));
        // the ground cuts no more than a few layers, so that what is far beyond the limit need not be listed
        if count > 8.0 * limit as f64 {
            return false;
        }
        let lowest = match rays.filter(|_| self.stands_above_ground) {
            Some(rays) => self.lowest_cells(spacing_m, rays, columns(), first[1]),
            None => columns().map(|_| first[1]).collect(),
        };
        for ((x, z), lowest) in columns().zip(lowest) {
            for y in lowest..=last[1] {
                cells.insert([x, y, z]);
            }
            if cells.len() > limit {
                return false;
            }
        }
        true
    }

    /// The lowest lattice coordinate that each column of a room needs: just below the ground, as far as it is found.
    fn lowest_cells(
        &self,
        spacing_m: f64,
        rays: &TriangleScene,
        columns: impl Iterator<Item = (i64, i64)>,
        lowest: i64,
    ) -> Vec<i64> {
        let downwards: Vec<Ray> = columns
            .map(|(x, z)| Ray {
                origin: DVec3::new(coordinate(x, spacing_m), self.low.y, coordinate(z, spacing_m)).as_vec3(),
                direction: Vec3::NEG_Y,
                t_min: 0.0,
                t_max: DOWN_TO_GROUND_M as f32,
            })
            .collect();
        let mut hits = vec![Hit::MISS; downwards.len()];
        rays.closest(&downwards, &mut hits);
        let lowest_of = |hit: &Hit| match hit.triangle {
            NO_HIT => lowest,
            _ => at_or_below(self.low.y - f64::from(hit.t), spacing_m).max(lowest),
        };
        hits.iter().map(lowest_of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::as_given;
    use heliodon_rays::BuildParams;

    const LAYOUT: LightLayout = LightLayout { sun_steps: 92, coefficients: 4, channels: 1, sun_bounce_functions: 0 };

    fn site(more: &str) -> Site {
        let text = format!(
            "[site]\nname = \"a\"\norigin = [100, 0, 0]\n[[part]]\nfile = \"a.ply\"\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n{more}"
        );
        Site::parse(&text, "site.toml").unwrap()
    }

    fn laid(site: &Site, layout: LightLayout, rays: Option<&TriangleScene>) -> Result<GridPlan, BakeError> {
        GridPlan::new(site, &as_given(site), layout, rays)
    }

    fn floor(height: f32) -> TriangleScene {
        let positions = [[-50.0, -50.0], [50.0, -50.0], [0.0, 90.0]].map(|[x, z]| Vec3::new(x, height, z));
        TriangleScene::build(&positions, &[[0, 2, 1]], &BuildParams::default()).unwrap()
    }

    #[test]
    fn a_room_reaches_down_to_its_ground_and_no_farther() {
        let site = site("[[room]]\nname = \"r\"\nmin = [0, 1.2, 0]\nmax = [2, 2.2, 1]\n");
        let heights = |rays: Option<&TriangleScene>| {
            let plan = laid(&site, LAYOUT, rays).unwrap();
            let positions = plan.positions();
            assert!(plan.cells.windows(2).all(|pair| pair[0] < pair[1]));
            let low = positions.iter().fold(f32::INFINITY, |low, at| low.min(at.y));
            let high = positions.iter().fold(f32::NEG_INFINITY, |high, at| high.max(at.y));
            (low, high, positions.len())
        };
        let (low, high, open) = heights(None);
        assert!((-1.2..=-0.7).contains(&low) && (2.2..2.7).contains(&high), "{low} {high}");
        let (low, _, grounded) = heights(Some(&floor(0.0)));
        assert!((-0.5..0.0).contains(&low) && grounded < open, "{low}");
        assert_eq!(heights(Some(&floor(-5.0))).2, open, "a ground that is too far down is not looked for");
        // every place of the room has all corners of its cell
        let plan = laid(&site, LAYOUT, Some(&floor(0.0))).unwrap();
        let positions = plan.positions();
        for place in [Vec3::new(0.0, 0.01, 0.0), Vec3::new(2.0, 2.2, 1.0), Vec3::new(1.3, 1.0, 0.4)] {
            assert_eq!(positions.iter().filter(|at| (**at - place).abs().max_element() < 0.5).count(), 8, "{place}");
        }
    }

    #[test]
    fn a_corridor_follows_its_path_and_nothing_else() {
        let walk = "[[actor]]\nfile = \"a.glb\"\npath = [[100, 0, 0], [108, 2, 8]]\nwalk = \"once\"\n";
        let plan = laid(&site(walk), LAYOUT, None).unwrap();
        let positions = plan.positions();
        for t in 0..=16 {
            let on_path = DVec3::new(8.0, 2.0, 8.0).as_vec3() * (t as f32 / 16.0);
            for beside in [Vec3::ZERO, Vec3::new(0.7, 2.2, -0.7), Vec3::new(-0.7, -0.05, 0.7)] {
                let place = on_path + beside;
                assert_eq!(positions.iter().filter(|at| (**at - place).abs().max_element() < 0.5).count(), 8, "{place}");
            }
        }
        let off = |at: &Vec3| (at.x - at.z).abs() / 2.0_f32.sqrt();
        assert!(positions.iter().all(|at| off(at) < 2.6 && at.y < 5.0 && at.y > -0.7), "sparse");
        let round = laid(&site(&walk.replace("\"once\"", "\"circle\"")), LAYOUT, None).unwrap();
        assert_eq!(round.cells.len(), plan.cells.len(), "the way back is the way there");
        let stand = laid(&site("[[actor]]\nfile = \"a.glb\"\nplace = [100, 0, 0]\n"), LAYOUT, None).unwrap();
        assert!((6 * 6 * 6..=6 * 7 * 6).contains(&stand.cells.len()), "{}", stand.cells.len());
        assert!(stand.digits() != plan.digits() && plan.digits() == plan.clone().digits());
    }

    #[test]
    fn neither_rooms_nor_actors_need_a_grid_and_too_large_ones_are_refused() {
        assert!(laid(&site(""), LAYOUT, None).unwrap().is_empty());
        let error = |more: &str, layout| laid(&site(more), layout, None).unwrap_err().to_string();
        let wide = error("[[room]]\nname = \"r\"\nmin = [0, 0, 0]\nmax = [1e6, 1e6, 1e6]\n", LAYOUT);
        assert!(wide.contains("site.toml:11:1") && wide.contains("grid_m = 1 or more"), "{wide}");
        let long = error("[[actor]]\nfile = \"a.glb\"\npath = [[0, 0, 0], [1e9, 0, 0]]\n", LAYOUT);
        assert!(long.contains("site.toml:11:1") && long.contains("path needs"), "{long}");
        let room = "[[room]]\nname = \"r\"\nmin = [0, 0, 0]\nmax = [60, 30, 40]\n";
        assert!(laid(&site(room), LAYOUT, None).unwrap().cells.len() > 500_000);
        let rgb = LightLayout { sun_steps: 1024, coefficients: 9, channels: 3, sun_bounce_functions: 0 };
        assert!(error(room, rgb).contains("points of the light grid"), "its light would not fit into the file");
    }
}
