//! What lies in an occluder's shadow, as an eye casts it.
//!
//! T. Hudson, D. Manocha, J. Cohen, M. Lin, K. Hoff, H. Zhang: "Accelerated Occlusion Culling using Shadow Frusta", 13th ACM Symposium on
//! Computational Geometry, 1997: a convex occluder and an eye span a frustum, the eye's shadow of it; what lies wholly in it is
//! not drawn. The test is conservative by as much as drawing may move things: a pixel at the sides, a thousandth of the depth behind.

use glam::{Vec3, Vec4};

/// How much farther than its occluder something must be, relative: what depth tests tell apart for certain (as in daylight/occlusion.rs).
const DEPTH_SLACK: f32 = 1e-3;

/// Occluders that are seen under a flatter angle than this sine cast no shadow worth a test.
pub const GRAZING: f32 = 1e-3;

/// A convex polygon that hides what lies behind it, from both sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Occluder {
    /// Three or more around it, in one plane, world space.
    pub corners: Vec<Vec3>,
    /// What makes it hide.
    pub kind: Kind,
    /// The part of the scene that lies on the side from which its corners go around counter-clockwise, and the part on the other: what it may hide.
    pub parts: [f32; 2],
}

/// What makes an occluder hide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// It was put there to hide, seen or not.
    Matte,
    /// It lies in closed bodies, whose fronts hide what is behind it from every eye that is outside of them, and not so near that the near plane cuts them.
    Solid,
    /// It is a part of a surface that is drawn, less a rim, and that is flat but for this, metres. The near plane must not cut it, either.
    Face(f32),
}

impl Occluder {
    /// Of which it is not known yet what lies on its sides.
    #[must_use]
    pub fn new(corners: Vec<Vec3>, kind: Kind) -> Self {
        Self { corners, kind, parts: [1.0; 2] }
    }

    /// A normal of its plane, not of unit length, towards the side from which its corners go around counter-clockwise.
    #[must_use]
    pub fn normal(&self) -> Vec3 {
        let [first, rest @ ..] = &self.corners[..] else { return Vec3::ZERO };
        rest.windows(2).map(|pair| (pair[0] - *first).cross(pair[1] - *first)).sum()
    }

    /// The part of the scene that lies beyond its plane for an eye.
    fn beyond(&self, eye: Vec3) -> f32 {
        let is_before = self.corners.first().is_some_and(|&corner| self.normal().dot(eye - corner) > 0.0);
        self.parts[usize::from(is_before)]
    }

    /// Whether its own box meets another.
    #[must_use]
    pub fn touches(&self, (low, high): (Vec3, Vec3)) -> bool {
        let own = self.corners.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |own, &p| (own.0.min(p), own.1.max(p)));
        own.0.cmple(high).all() && own.1.cmpge(low).all()
    }

    /// Whether any of it may lie within `planes` (inward unit normal, distance).
    #[must_use]
    pub fn meets(&self, planes: &[Vec4]) -> bool {
        planes.iter().all(|plane| self.corners.iter().any(|&corner| plane.truncate().dot(corner) + plane.w > 0.0))
    }
}

/// The shadow of an occluder.
#[derive(Clone, Debug, PartialEq)]
pub struct Shadow {
    eye: Vec3,
    /// Inward unit normals of the planes through the eye and the occluder's edges.
    sides: Vec<Vec3>,
    /// Unit normal of the occluder, away from the eye, and the distance of its farthest corner along it.
    cap: (Vec3, f32),
    /// Sine of the angle by which what is hidden must stay off the sides.
    margin: f32,
}

/// How a box lies to a shadow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lies {
    /// All of it is hidden.
    Within,
    /// Nothing of it is hidden by this shadow, however small.
    Without,
    /// Parts of it may be hidden.
    Across,
}

impl Shadow {
    /// What `occluder` hides from `eye`, less `margin_rad` at its sides; none where the eye is in its plane.
    #[must_use]
    pub fn cast(occluder: &Occluder, eye: Vec3, margin_rad: f32) -> Option<Self> {
        let corners: Vec<Vec3> = occluder.corners.iter().map(|&corner| corner - eye).collect();
        let count = corners.len();
        let middle = corners.iter().sum::<Vec3>() / count as f32;
        let normal: Vec3 = (0..count).map(|i| (corners[i] - middle).cross(corners[(i + 1) % count] - middle)).sum();
        let mut normal = normal.try_normalize()?;
        if normal.dot(middle) < 0.0 {
            normal = -normal;
        }
        let heights = || corners.iter().map(|corner| normal.dot(*corner));
        let longest = corners.iter().map(|corner| corner.length()).fold(0.0, f32::max);
        let (least, most) = (heights().fold(f32::INFINITY, f32::min), heights().fold(0.0, f32::max));
        if least <= GRAZING * longest {
            return None;
        }
        let side = |i: usize| {
            let side = corners[i].cross(corners[(i + 1) % count]).try_normalize()?;
            Some(if side.dot(middle) < 0.0 { -side } else { side })
        };
        Some(Self {
            eye,
            sides: (0..count).map(side).collect::<Option<_>>()?,
            cap: (normal, most),
            margin: libm::sinf(margin_rad),
        })
    }

    /// How the box with this centre and half size lies.
    #[must_use]
    pub fn holds(&self, center: Vec3, half: Vec3) -> Lies {
        let to_center = center - self.eye;
        let off = self.margin * (to_center.length() + half.length());
        let (normal, height) = self.cap;
        let (middle, reach) = (normal.dot(to_center), normal.abs().dot(half));
        if middle + reach < height {
            return Lies::Without;
        }
        let mut within = middle - reach >= height * (1.0 + DEPTH_SLACK);
        for side in &self.sides {
            let (middle, reach) = (side.dot(to_center), side.abs().dot(half));
            if middle + reach < off {
                return Lies::Without;
            }
            within &= middle - reach >= off;
        }
        if within { Lies::Within } else { Lies::Across }
    }

    /// Which of these directions from the eye meet the occluder, a bit each.
    fn met_by(&self, directions: &[Vec3]) -> Looks {
        let mut looks = [0; LOOK_WORDS];
        for (i, direction) in directions.iter().enumerate() {
            let meets = self.sides.iter().all(|side| side.dot(*direction) > 0.0);
            looks[i / 64] |= u64::from(meets) << (i % 64);
        }
        looks
    }
}

/// The most occluders that a view takes: each costs a test of every chunk before it, and of the clusters of those that it hides partly.
pub const MOST_OCCLUDERS: usize = 16;

/// Directions in which a view looks for occluders, across and down.
pub const LOOKS: [u32; 2] = [32, 24];
const LOOK_WORDS: usize = (LOOKS[0] * LOOKS[1]).div_ceil(64) as usize;

/// A bit for each direction.
type Looks = [u64; LOOK_WORDS];

/// An occluder before less than this is not worth its tests: its part of the picture times the part of the scene that lies beyond it.
const LEAST_WORTH: f32 = 0.002;

/// An eye that looks for occluders.
#[derive(Clone, Copy, Debug)]
pub struct Onlooker<'a> {
    /// Where it is.
    pub eye: Vec3,
    /// Inward planes of what it sees: unit normal, distance.
    pub planes: &'a [Vec4],
    /// The angle by which what is hidden stays off the sides of shadows.
    pub margin_rad: f32,
    /// How far from the eye the near plane reaches, metres.
    pub near_m: f32,
    /// [`LOOKS`] directions, evenly over its picture.
    pub directions: &'a [Vec3],
}

/// The shadows of the occluders that hide most, one after the other: each is before the most of the picture that none before it covers, times the part of the
/// scene that is beyond it. No more than [`MOST_OCCLUDERS`].
///
/// Ground is large and near, but nearly nothing is beneath it: it takes no wall's place.
pub fn choose<'a>(occluders: impl Iterator<Item = &'a Occluder>, onlooker: Onlooker) -> Vec<Shadow> {
    let Onlooker { eye, planes, margin_rad, near_m, directions } = onlooker;
    let candidate = |occluder: &Occluder| {
        let beyond = occluder.beyond(eye);
        if beyond < LEAST_WORTH || !occluder.meets(planes) {
            return None;
        }
        let least_height_m = match occluder.kind {
            Kind::Matte | Kind::Solid => 0.0,
            // Rays flatter than that could pass through the rim; and the surface must lie clearly before what it hides.
            Kind::Face(off_m) => near_m.max(off_m / GRAZING),
        };
        let shadow = Shadow::cast(occluder, eye, margin_rad).filter(|shadow| shadow.cap.1 > least_height_m)?;
        let looks = shadow.met_by(directions);
        Some((beyond / directions.len() as f32, looks, shadow))
    };
    let mut candidates: Vec<(f32, Looks, Shadow)> = occluders.filter_map(candidate).collect();
    let mut covered: Looks = [0; LOOK_WORDS];
    let mut shadows: Vec<Shadow> = Vec::new();
    while shadows.len() < MOST_OCCLUDERS {
        let worth = |(scale, looks, _): &(f32, Looks, Shadow)| {
            let more: u32 = looks.iter().zip(&covered).map(|(looks, covered)| (looks & !covered).count_ones()).sum();
            more as f32 * scale
        };
        // of equals the first in the bundle
        let best = candidates.iter().map(worth).enumerate().rev().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((best, _)) = best.filter(|(_, worth)| *worth >= LEAST_WORTH) else { break };
        let (_, looks, shadow) = candidates.remove(best);
        covered.iter_mut().zip(looks).for_each(|(covered, looks)| *covered |= looks);
        shadows.push(shadow);
    }
    shadows
}

#[cfg(test)]
mod tests {
    use super::*;
    use heliodon_math::random::Pcg32;

    fn wall(z: f32, half: f32) -> Occluder {
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| Vec3::new(x, y, z));
        Occluder::new(corners.into(), Kind::Matte)
    }

    /// Directions of a square picture of a right angle, towards -z.
    fn directions() -> Vec<Vec3> {
        let [across, down] = LOOKS;
        let at = |i: u32, count: u32| (i as f32 + 0.5) / count as f32 * 2.0 - 1.0;
        (0..across * down).map(|i| Vec3::new(at(i % across, across), at(i / across, down), -1.0)).collect()
    }

    #[test]
    fn only_what_lies_wholly_behind_is_hidden() {
        let shadow = Shadow::cast(&wall(-2.0, 1.0), Vec3::ZERO, 1e-3).unwrap();
        let box_at = |x: f32, z: f32, half: f32| shadow.holds(Vec3::new(x, 0.0, z), Vec3::splat(half));
        assert_eq!(box_at(0.0, -4.0, 0.5), Lies::Within);
        assert_eq!(box_at(1.3, -4.0, 0.5), Lies::Across, "it looks out at the side");
        assert_eq!(box_at(1.2, -4.0, 0.5), Lies::Within, "its front's corner is at 1.7 of 1.75");
        assert_eq!(box_at(0.9, -4.0, 0.5), Lies::Within);
        assert_eq!(box_at(0.0, -2.2, 0.5), Lies::Across, "it reaches through");
        assert_eq!(box_at(0.0, -1.0, 0.5), Lies::Without);
        assert_eq!(box_at(4.0, -4.0, 0.5), Lies::Without);
        assert_eq!(box_at(0.0, 4.0, 0.5), Lies::Without, "behind the eye");
        assert!(Shadow::cast(&wall(-2.0, 1.0), Vec3::new(5.0, 0.0, -2.0), 0.0).is_none(), "in its plane");
        assert!(Shadow::cast(&wall(-2.0, 0.0), Vec3::ZERO, 0.0).is_none(), "without an area");
    }

    #[test]
    fn nothing_hidden_can_be_reached_past_the_occluder() {
        let mut random = Pcg32::new(5, 3);
        let mut next = |low: f32, high: f32| low + (high - low) * random.next_f32();
        let mut hidden = 0;
        for _ in 0..2000 {
            let occluder = wall(next(-3.0, 3.0), next(0.5, 3.0));
            let eye = Vec3::new(next(-4.0, 4.0), next(-4.0, 4.0), next(-4.0, 4.0));
            let Some(shadow) = Shadow::cast(&occluder, eye, 1e-3) else { continue };
            let (center, half) = (Vec3::new(next(-9.0, 9.0), next(-9.0, 9.0), next(-9.0, 9.0)), Vec3::splat(next(0.01, 0.5)));
            if shadow.holds(center, half) != Lies::Within {
                continue;
            }
            hidden += 1;
            for corner in 0..8 {
                let sign = |bit: i32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let point = center + half * Vec3::new(sign(0), sign(1), sign(2));
                let (z, size) = (occluder.corners[0].z, occluder.corners[2].x);
                let at = eye + (point - eye) * ((z - eye.z) / (point.z - eye.z));
                assert!((z - eye.z).abs() < (point.z - eye.z).abs() && (z - eye.z) * (point.z - eye.z) > 0.0);
                assert!(at.x.abs() < size && at.y.abs() < size, "{at} past {size}");
            }
        }
        assert!(hidden > 20, "{hidden}");
    }

    #[test]
    fn the_largest_in_view_are_chosen_and_none_that_another_hides() {
        let occluders = [wall(-9.0, 1.0), wall(-2.0, 1.5), wall(3.0, 2.0), wall(-30.0, 0.2)];
        let planes = [Vec4::new(0.0, 0.0, -1.0, 0.0)];
        let directions = directions();
        let onlooker = Onlooker { eye: Vec3::ZERO, planes: &planes, margin_rad: 0.0, near_m: 0.05, directions: &directions };
        let shadows = choose(occluders.iter(), onlooker);
        // The first is hidden by the second, the third lies behind the eye, the last is too small.
        assert_eq!(shadows, [Shadow::cast(&occluders[1], Vec3::ZERO, 0.0).unwrap()]);
        let slat = |x: f32| [[-0.4, -9.0], [0.4, -9.0], [0.4, 9.0], [-0.4, 9.0]].map(|[dx, y]| Vec3::new(x + dx, y, -10.0));
        let many: Vec<Occluder> = (0..20).map(|k| Occluder::new(slat(k as f32 - 9.5).into(), Kind::Matte)).collect();
        assert_eq!(choose(many.iter(), onlooker).len(), MOST_OCCLUDERS);
        // A face that the near plane cuts, and one that is not flat enough for an eye so near.
        for (kind, chosen) in [(Kind::Face(0.0), 1), (Kind::Face(3e-3), 0), (Kind::Solid, 1)] {
            let one = Occluder { kind, ..wall(-2.0, 1.5) };
            assert_eq!(choose([&one].into_iter(), onlooker).len(), chosen, "{kind:?}");
            let near = Onlooker { near_m: 2.5, ..onlooker };
            assert_eq!(choose([&one].into_iter(), near).len(), usize::from(kind == Kind::Solid));
        }
    }

    #[test]
    fn what_has_nothing_beyond_it_takes_no_place() {
        let directions = directions();
        let onlooker = Onlooker { eye: Vec3::ZERO, planes: &[], margin_rad: 0.0, near_m: 0.05, directions: &directions };
        let large = wall(-1.0, 4.0);
        // seen from +z it goes around counter-clockwise: what lies beyond is on the other side
        assert!(large.normal().z > 0.0);
        let small = wall(-2.0, 1.0);
        let of = |parts: [f32; 2]| choose([&Occluder { parts, ..large.clone() }, &small].into_iter(), onlooker);
        let [of_large, of_small] = [&large, &small].map(|one| Shadow::cast(one, Vec3::ZERO, 0.0).unwrap());
        for (parts, wanted) in
            [([1.0, 0.0], vec![&of_small]), ([0.0, 1.0], vec![&of_large]), ([0.9, 0.1], vec![&of_small, &of_large])]
        {
            assert_eq!(of(parts).iter().collect::<Vec<_>>(), wanted, "{parts:?}");
        }
    }
}
