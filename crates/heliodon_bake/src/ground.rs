//! The ground beneath the actors, and the stone before them.
//!
//! Light is found for a figure wherever it is: one that wades through a step or crosses a wall is lit by points that have borrowed their
//! light, and nobody is told. So every path is looked at with the scene's rays, every 0.25 m: how far the figure's lowest point at rest is off
//! the first surface beneath its head, and whether it passes through stone at half its height. Why from the head: a path that is given too
//! low by less than a figure's height still finds the floor that it should be on, and what hangs over the figure is no ground.
//!
//! An actor with `ground = "follow"` is put onto that surface; the bundle holds the path that comes of it.

use crate::actors::Figure;
use glam::{DVec3, Vec3};
use heliodon_bundle::site::{Actor, Ground, Site, Walk};
use heliodon_math::sphere::fibonacci_sphere;
use heliodon_rays::{Hit, Ray, TriangleScene};

/// How far apart the places are that are looked at, metres: less than a stair's tread.
const STEP_M: f64 = 0.25;
/// More places of a path are not looked at; those of one that is longer than 25 km are farther apart.
const MOST_PLACES: f64 = 100_000.0;
/// A figure whose lowest point is farther off the ground than this is told of, metres: more than grass, gravel and the sole of a shoe.
const TOLERANCE_M: f64 = 0.15;
/// What a path on the ground may be off it where it is stored as a straight line, metres.
const STRAIGHT_M: f64 = 0.01;
/// Directions that are asked whether a place is inside of stone; of whose majority it is.
const DIRECTIONS: u32 = 16;
/// Places whose rays are asked together.
const TOGETHER: usize = 1024;

/// A place that an actor comes by.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// How far along its way, metres.
    metre: f64,
    /// Where the model's origin is, metres in the bundle's space.
    at: DVec3,
    /// Whether `site.toml` names it.
    named: bool,
}

/// What is beneath a figure's head.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Beneath {
    /// The height of the first surface.
    Ground(f64),
    Nothing,
    /// The head is within stone, so that the first surface below means nothing.
    Stone,
}

/// The site's actors in the bundle's space, as they are given.
#[must_use]
pub fn as_given(site: &Site) -> Vec<Actor> {
    site.actors.iter().map(|actor| actor.relative_to(site.site.origin)).collect()
}

/// The site's actors in the bundle's space, those with `ground = "follow"` on the ground, and those of which there are several with their lanes.
#[must_use]
pub fn on_the_ground(site: &Site, figures: &[Figure], rays: &TriangleScene) -> Vec<Actor> {
    let mut actors = as_given(site);
    for (actor, figure) in actors.iter_mut().zip(figures) {
        // Each of several has ground of its own.
        let mut lanes = actor.scattered();
        if actor.ground == Ground::Follow {
            for lane in &mut lanes {
                let (place, path) = if lane.len() > 1 { (None, Some(lane.clone())) } else { (lane.first().copied(), None) };
                let mut alone = Actor { place, path, ..actor.clone() };
                follow(&mut alone, figure, rays);
                *lane = alone.path.or(alone.place.map(|place| vec![place])).unwrap_or_default();
            }
            follow(actor, figure, rays);
        }
        actor.lanes = lanes;
    }
    actors
}

/// What is odd about where actors go: for each of them a line at most for each kind of oddity. Heights and places are those of `site.toml`.
#[must_use]
pub fn doubts(site: &Site, actors: &[Actor], figures: &[Figure], rays: &TriangleScene) -> Vec<String> {
    let doubts = |(actor, figure): (&Actor, &Figure)| {
        let way = Way { name: actor.display_name(), origin: site.site.origin.into(), places: places(&actor.stations()) };
        let mut doubts = Vec::new();
        if actor.ground != Ground::Ignore {
            way.tell_of_ground(actor.ground, figure, &beneath(&way.places, figure, rays), &mut doubts);
        }
        way.tell_of_stone(figure, rays, &mut doubts);
        doubts
    };
    actors.iter().zip(figures).flat_map(doubts).collect()
}

/// Places along the stations, each of these among them.
fn places(stations: &[[f64; 3]]) -> Vec<Place> {
    let points: Vec<DVec3> = stations.iter().copied().map(DVec3::from).collect();
    let length: f64 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
    let step = STEP_M.max(length / MOST_PLACES);
    let mut places: Vec<Place> = points.first().map(|&at| Place { metre: 0.0, at, named: true }).into_iter().collect();
    let mut metre = 0.0;
    for pair in points.windows(2) {
        let leg = pair[0].distance(pair[1]);
        let parts = (leg / step).ceil().max(1.0) as u32;
        places.extend((1..=parts).map(|part| {
            let share = f64::from(part) / f64::from(parts);
            Place { metre: metre + leg * share, at: pair[0].lerp(pair[1], share), named: part == parts }
        }));
        metre += leg;
    }
    places
}

/// What is beneath the head of a figure at each of the places.
fn beneath(places: &[Place], figure: &Figure, rays: &TriangleScene) -> Vec<Beneath> {
    let heads: Vec<Vec3> = places.iter().map(|place| (place.at + DVec3::Y * figure.high_m).as_vec3()).collect();
    let hits = |direction: Vec3| {
        let rays_of: Vec<Ray> =
            heads.iter().map(|&origin| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }).collect();
        let mut hits = vec![Hit::MISS; rays_of.len()];
        rays.closest(&rays_of, &mut hits);
        hits
    };
    let (down, up) = (hits(Vec3::NEG_Y), hits(Vec3::Y));
    let found = |((head, inside), (down, up)): ((&Vec3, bool), (&Hit, &Hit))| {
        if inside {
            Beneath::Stone
        } else if down.is_some() {
            Beneath::Ground(f64::from(head.y) - f64::from(down.t))
        } else if up.is_some() && up.back {
            // a ground of a single sheet, seen from below
            Beneath::Ground(f64::from(head.y) + f64::from(up.t))
        } else {
            Beneath::Nothing
        }
    };
    heads.iter().zip(inside(&heads, rays)).zip(down.iter().zip(&up)).map(found).collect()
}

/// Which of the places are within closed surfaces, however these run into each other.
fn inside(places: &[Vec3], rays: &TriangleScene) -> Vec<bool> {
    let directions = fibonacci_sphere(DIRECTIONS);
    let mut inside = Vec::with_capacity(places.len());
    for places in places.chunks(TOGETHER) {
        let from = |&origin: &Vec3| {
            directions.iter().map(move |&direction| Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY })
        };
        let asked: Vec<Ray> = places.iter().flat_map(from).collect();
        let mut counts = vec![0; asked.len()];
        rays.enclosures(&asked, &mut counts);
        let most = |counts: &[i32]| 2 * counts.iter().filter(|&&count| count > 0).count() > directions.len();
        inside.extend(counts.chunks_exact(directions.len()).map(most));
    }
    inside
}

/// Puts an actor's place or path onto the ground. Where there is none it keeps its height.
fn follow(actor: &mut Actor, figure: &Figure, rays: &TriangleScene) {
    let mut places = places(&actor.stations());
    let beneath = beneath(&places, figure, rays);
    for (place, beneath) in places.iter_mut().zip(&beneath) {
        if let Beneath::Ground(height) = beneath {
            place.at.y = height - figure.low_m;
        }
    }
    match &mut actor.path {
        Some(path) => {
            *path = straightened(&places);
            // a circle goes back to its first point by itself
            if actor.walk == Walk::Circle && path.len() > 2 {
                path.pop();
            }
        }
        None => actor.place = places.first().map(|place| place.at.to_array()),
    }
}

/// The named places, and as many between them as keep the heights of all (U. Ramer: "An iterative procedure for the polygonal
/// approximation of plane curves", CGIP 1, 1972).
fn straightened(places: &[Place]) -> Vec<[f64; 3]> {
    let mut kept: Vec<bool> = places.iter().map(|place| place.named).collect();
    let named: Vec<usize> = (0..places.len()).filter(|&i| kept[i]).collect();
    let mut spans: Vec<(usize, usize)> = named.windows(2).map(|pair| (pair[0], pair[1])).collect();
    while let Some((first, last)) = spans.pop() {
        // places of a leg are evenly spread
        let off = |i: usize| {
            let share = (i - first) as f64 / (last - first) as f64;
            (places[i].at.y - places[first].at.y - (places[last].at.y - places[first].at.y) * share).abs()
        };
        let farthest = (first + 1..last).map(|i| (off(i), i)).reduce(|a, b| if b.0 > a.0 { b } else { a });
        if let Some((_, middle)) = farthest.filter(|(off, _)| *off > STRAIGHT_M) {
            kept[middle] = true;
            spans.extend([(first, middle), (middle, last)]);
        }
    }
    places.iter().zip(kept).filter(|(_, kept)| *kept).map(|(place, _)| place.at.to_array()).collect()
}

/// Where an actor goes, and how to speak of it.
struct Way<'a> {
    name: &'a str,
    /// From the bundle's space back to the site's.
    origin: DVec3,
    places: Vec<Place>,
}

impl Way<'_> {
    fn tell_of_ground(&self, ground: Ground, figure: &Figure, beneath: &[Beneath], doubts: &mut Vec<String>) {
        let nothing: Vec<bool> = beneath.iter().map(|beneath| *beneath == Beneath::Nothing).collect();
        if let Some(first) = nothing.iter().position(|nothing| *nothing) {
            let (along, at) = (self.along(&nothing), self.place(first));
            doubts.push(format!(
                "actor {}: there is no ground beneath it {along} {at}; lead it over ground, or write ground = \"ignore\" if it hangs or flies",
                self.name
            ));
        }
        // who follows the ground is on it; on a stair what lies between two places is not
        if ground == Ground::Follow {
            return;
        }
        // above where positive
        let off = |i: usize| match beneath[i] {
            Beneath::Ground(height) => self.places[i].at.y + figure.low_m - height,
            _ => 0.0,
        };
        for (sign, word) in [(1.0, "above"), (-1.0, "below")] {
            let wrong: Vec<bool> = (0..beneath.len()).map(|i| sign * off(i) > TOLERANCE_M).collect();
            let worst =
                (0..beneath.len()).filter(|&i| wrong[i]).reduce(|a, b| if sign * off(b) > sign * off(a) { b } else { a });
            let Some(worst) = worst else { continue };
            let (along, at, most) = (self.along(&wrong), self.place(worst), off(worst).abs());
            let on_ground = self.places[worst].at.y - off(worst) + self.origin.y;
            let height = on_ground + figure.low_m;
            doubts.push(format!(
                "actor {}: its lowest point is {word} the ground {along} {at}: by {most:.2} m, for the ground there is at y = {height:.2}; \
                 give y = {on_ground:.2} there, or write ground = \"follow\" (\"ignore\" if it hangs or flies)",
                self.name
            ));
        }
    }

    fn tell_of_stone(&self, figure: &Figure, rays: &TriangleScene, doubts: &mut Vec<String>) {
        let middle = DVec3::Y * (0.5 * (figure.low_m + figure.high_m));
        let middles: Vec<Vec3> = self.places.iter().map(|place| (place.at + middle).as_vec3()).collect();
        let mut stone = inside(&middles, rays);
        let between = |pair: &[Vec3]| {
            // who stays where he is meets nothing
            let (direction, t_max) = if pair[0] == pair[1] { (Vec3::Y, 0.0) } else { (pair[1] - pair[0], 1.0) };
            Ray { origin: pair[0], direction, t_min: 0.0, t_max }
        };
        let steps: Vec<Ray> = middles.windows(2).map(between).collect();
        let mut occluded = vec![0; steps.len().div_ceil(64)];
        rays.occluded(&steps, &mut occluded);
        for i in (0..steps.len()).filter(|i| occluded[i / 64] >> (i % 64) & 1 == 1) {
            stone[i] = true;
            stone[i + 1] = true;
        }
        let Some(first) = stone.iter().position(|stone| *stone) else { return };
        let (along, at) = (self.along(&stone), self.place(first));
        doubts
            .push(format!("actor {}: it is within stone at half its height {along} {at}; lead it round, or higher", self.name));
    }

    /// How much of the way is marked, in words that a place follows.
    fn along(&self, marked: &[bool]) -> String {
        let Some(length) = self.places.last().map(|last| last.metre).filter(|_| self.places.len() > 1) else {
            return "at its place".to_owned();
        };
        let metre = |i: usize| self.places[i].metre;
        // each place stands for half the way to the next one on either side
        let own = |i: usize| 0.5 * (metre((i + 1).min(marked.len() - 1)) - metre(i.saturating_sub(1)));
        let metres: f64 = (0..marked.len()).filter(|&i| marked[i]).map(own).sum();
        format!("along {metres:.1} of {length:.1} m of its way, see")
    }

    fn place(&self, i: usize) -> String {
        let [x, y, z] = (self.places[i].at + self.origin).to_array();
        let at = format!("{x:.2}, {y:.2}, {z:.2}");
        if self.places.len() > 1 { format!("metre {:.1} ({at})", self.places[i].metre) } else { at }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_rays::BuildParams;

    /// A walker of 1.8 m whose origin is at its soles.
    fn walker() -> Figure {
        Figure { low_m: 0.0, high_m: 1.8, ..Figure::default() }
    }

    fn boxes(boxes: &[[[f32; 3]; 2]]) -> TriangleScene {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for [low, high] in boxes {
            let base = positions.len() as u32;
            let pick = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
            positions.extend((0..8).map(|corner| Vec3::from_array([0, 1, 2].map(|axis| pick(corner, axis)))));
            for [a, b, c, d] in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
                triangles.extend([[a, b, c], [a, c, d]].map(|t| t.map(|i: u32| base + i)));
            }
        }
        TriangleScene::build(&positions, &triangles, &BuildParams::default()).unwrap()
    }

    /// Ground up to y = 0, and on it three steps of 0.5 m up to a floor at 1.5 m from x = 2 on, with a wall of 0.1 m at x = 8.
    fn temple() -> TriangleScene {
        boxes(&[
            [[-50.0, -1.0, -50.0], [50.0, 0.0, 50.0]],
            [[0.0, -0.1, -9.0], [20.0, 0.5, 9.0]],
            [[1.0, 0.4, -9.0], [20.0, 1.0, 9.0]],
            [[2.0, 0.9, -9.0], [20.0, 1.5, 9.0]],
            [[8.0, 1.4, -9.0], [8.1, 5.0, 9.0]],
        ])
    }

    fn site(actor: &str) -> Site {
        let text = format!(
            "[site]\nname = \"a\"\norigin = [100, 10, 0]\n[[part]]\nfile = \"a.ply\"\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n\
             [[actor]]\nfile = \"walker.glb\"\n{actor}\n"
        );
        Site::parse(&text, "site.toml").unwrap()
    }

    fn doubts_of(actor: &str, figure: Figure) -> Vec<String> {
        let (site, rays, figures) = (site(actor), temple(), [figure]);
        doubts(&site, &on_the_ground(&site, &figures, &rays), &figures, &rays)
    }

    #[test]
    fn who_stands_where_he_should_is_not_spoken_of() {
        for actor in [
            "place = [95, 10, 0]",
            "place = [105, 11.5, 0]",
            "path = [[90, 10.1, 0], [99, 10, 3], [95, 9.9, -5]]",
            "path = [[103, 11.5, 0], [107, 11.5, 0]]\nwalk = \"once\"",
            // a bird, over the wall too
            "path = [[90, 25, 0], [115, 25, 0]]\nground = \"ignore\"",
        ] {
            assert_eq!(doubts_of(actor, walker()), [""; 0], "{actor}");
        }
        // an origin at the hips
        assert_eq!(doubts_of("place = [95, 11, 0]", Figure { low_m: -1.0, high_m: 0.8, ..Figure::default() }), [""; 0]);
    }

    #[test]
    fn who_floats_sinks_or_has_no_ground_is_told_where() {
        let floats = doubts_of("place = [95, 10.4, 0]", walker());
        assert_eq!(
            floats,
            [
                "actor walker: its lowest point is above the ground at its place 95.00, 10.40, 0.00: by 0.40 m, for the ground there is at \
              y = 10.00; give y = 10.00 there, or write ground = \"follow\" (\"ignore\" if it hangs or flies)"
            ]
        );
        // level with the yard, through the steps to under the floor: sunk, and in stone
        let wades = doubts_of("path = [[98, 10, 0], [104, 10, 0]]\nwalk = \"once\"", walker());
        assert_eq!(wades.len(), 2, "{wades:?}");
        assert!(wades[0].contains("below the ground along ") && wades[0].contains(" of 6.0 m of its way"), "{wades:?}");
        assert!(wades[0].contains("by 1.50 m, for the ground there is at y = 11.50; give y = 11.50 there"), "{wades:?}");
        assert!(wades[1].contains("within stone at half its height along"), "{wades:?}");
        let off = doubts_of("path = [[148.1, 10, 0], [156.1, 10, 0]]\nwalk = \"once\"", walker());
        assert_eq!(off.len(), 1, "{off:?}");
        assert!(
            off[0].contains("no ground beneath it along 6.1 of 8.0 m of its way, see metre 2.0 (150.10, 10.00, 0.00)"),
            "{off:?}"
        );
        let hips = doubts_of("place = [95, 10, 0]", Figure { low_m: -1.0, high_m: 0.8, ..Figure::default() });
        assert!(hips[0].contains("below") && hips[0].contains("at y = 10.00; give y = 11.00 there"), "{hips:?}");
    }

    #[test]
    fn walls_are_told_of_however_thin() {
        let through = doubts_of("path = [[105.15, 11.5, 0], [110.15, 11.5, 0]]\nwalk = \"back-and-forth\"", walker());
        assert_eq!(through.len(), 1, "{through:?}");
        assert!(
            through[0].starts_with("actor walker: it is within stone at half its height along 0.5 of 5.0 m"),
            "{through:?}"
        );
        assert!(through[0].contains("(107.90, 11.50, 0.00)"), "{through:?}");
        let within = doubts_of("place = [108.05, 11.5, 0]", walker());
        assert_eq!(
            within,
            ["actor walker: it is within stone at half its height at its place 108.05, 11.50, 0.00; lead it round, or higher"]
        );
    }

    #[test]
    fn a_ground_of_one_sheet_is_found_from_below() {
        let sheet = [[-50.0, -50.0], [50.0, -50.0], [0.0, 90.0]].map(|[x, z]| Vec3::new(x, 0.0, z));
        let rays = TriangleScene::build(&sheet, &[[0, 2, 1]], &BuildParams::default()).unwrap();
        let site = site("place = [100, 6, 0]");
        let doubts = doubts(&site, &as_given(&site), &[walker()], &rays);
        assert!(doubts.len() == 1 && doubts[0].contains("below the ground") && doubts[0].contains("by 4.00 m"), "{doubts:?}");
    }

    #[test]
    fn who_follows_the_ground_walks_up_the_steps() {
        let rays = temple();
        let followed = |actor: &str| {
            let site = site(actor);
            on_the_ground(&site, &[walker()], &rays).remove(0)
        };
        // given level, 0.2 m above the yard
        let stairs = "path = [[96.1, 10.2, 0], [106.1, 10.2, 0]]\nwalk = \"once\"\nground = \"follow\"";
        let path = followed(stairs).path.unwrap();
        // each step is where it changes: before and on it
        let expected = [(-3.9, 0.0), (-0.15, 0.0), (0.1, 0.5), (0.85, 0.5), (1.1, 1.0), (1.85, 1.0), (2.1, 1.5), (6.1, 1.5)];
        assert_eq!(path.len(), expected.len(), "{path:?}");
        let near = |(point, (x, y)): (&[f64; 3], (f64, f64))| (point[0] - x).abs() < 1e-6 && (point[1] - y).abs() < 1e-6;
        assert!(path.iter().zip(expected).all(near), "{path:?}");
        assert_eq!(doubts_of(stairs, walker()), [""; 0]);
        // a circle's way back is among it, its first point is not twice
        let round = followed("path = [[96.1, 10, 0], [106.1, 10, 0], [106.1, 10, 1]]\nground = \"follow\"").path.unwrap();
        assert!(round.len() > 10 && round.first() != round.last() && round[round.len() - 1][0] > -3.8, "{round:?}");
        // who stands, stands by its lowest point; a floor that is above the head is not its ground
        for (y, height) in [(11, 2.5), (10, 0.0)] {
            let site = site(&format!("place = [105, {y}, 0]\nground = \"follow\""));
            let hips = Figure { low_m: -1.0, high_m: 0.8, ..Figure::default() };
            let place = on_the_ground(&site, &[hips], &rays)[0].place.unwrap();
            assert!((place[1] - height).abs() < 1e-6, "{place:?}");
        }
        // where there is nothing the height stays
        assert_eq!(followed("place = [200, 13, 0]\nground = \"follow\"").place, Some([100.0, 3.0, 0.0]));
        // other actors go as they are given
        assert_eq!(followed("place = [105, 10, 0]").place, Some([5.0, 0.0, 0.0]));
    }
}
