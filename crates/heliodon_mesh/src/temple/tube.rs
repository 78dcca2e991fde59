//! Closed solids about an axis: column shafts with their flutes and capitals, drums, drops, draped figures.
//!
//! The surface is cut along lines that run up the axis. Lines that no eye sees are fewer and coarser, and rows of unlike
//! counts are zipped together. A line on an arris is doubled, so that the two flutes keep their own normals.

use super::marble::Look;
use super::noise::{fbm, gradient, smoothstep};
use super::sizing::Grain;
use super::solid::{RowVertex, SolidMesh, zip_rows};
use glam::Vec3;
use heliodon_math::frame::unit_or;
use heliodon_math::random::{hash2_u32, unit_f32};
use std::f32::consts::TAU;

/// A station of the profile.
#[derive(Clone, Copy, Debug)]
pub struct Knot {
    /// Height along the axis, metres.
    pub y: f32,
    /// Radius (to the arrises where fluted), metres.
    pub radius: f32,
    /// Depth of the flutes, 0 to 1 of the full one.
    pub flute: f32,
    /// Whether two drums meet here.
    pub joint: bool,
}

/// What the end of a tube is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Lies against another stone.
    Covered,
    /// A dressed face that shows.
    Dressed,
    /// Broken: an uneven, tilted surface.
    Broken,
}

/// What time did to a shaft.
#[derive(Clone, Copy, Debug)]
pub struct ShaftWear {
    /// 0 sharp arrises, 1 hardly any left.
    pub arris: f32,
    /// How much of the surface is battered off, 0 to 1.
    pub spall: f32,
    /// Depth of the roughness, metres.
    pub rough: f32,
    /// How far drums have shifted against each other, metres.
    pub shift: f32,
}

impl ShaftWear {
    /// A standing shaft; `erosion` from 0 to 1.
    pub fn standing(erosion: f32) -> Self {
        Self { arris: 0.75 * erosion, spall: 0.75 * erosion, rough: 0.002 + 0.008 * erosion, shift: 0.016 * erosion }
    }

    /// A drum that fell.
    pub fn fallen(erosion: f32) -> Self {
        Self { arris: 0.3 + 0.7 * erosion, spall: 0.4 + 0.6 * erosion, rough: 0.005 + 0.02 * erosion, shift: 0.0 }
    }
}

/// A closed solid about the axis `axes[1]` from `origin`; the axes' lengths scale the profile.
#[derive(Clone, Debug)]
pub struct Tube {
    pub origin: Vec3,
    pub axes: [Vec3; 3],
    pub knots: Vec<Knot>,
    /// Flutes, or facets of the coarsest cut.
    pub sides: u32,
    pub fluted: bool,
    pub wear: ShaftWear,
    pub look: Look,
    pub seed: u32,
    pub coarser: f32,
    pub ornament: bool,
    /// Bottom and top.
    pub ends: [End; 2],
}

/// Depth of a flute as a part of the shaft's radius (about a fifth of a flute's width).
const FLUTE_DEPTH: f32 = 0.066;
/// Half the gap at a joint between drums, metres.
const JOINT: f32 = 0.004;

/// How one tube is cut.
struct Cut {
    /// Points across a side, seen and turned away.
    across: [u32; 2],
    /// Steps of each section between knots, seen and turned away.
    along: [Vec<u32>; 2],
    /// By side: whether any eye sees it.
    seen: Vec<bool>,
    /// Rings of each end's face.
    rings: [u32; 2],
}

impl Tube {
    fn height(&self) -> f32 {
        self.knots.last().map_or(0.0, |k| k.y) - self.knots.first().map_or(0.0, |k| k.y)
    }

    fn max_radius(&self) -> f32 {
        self.knots.iter().map(|k| k.radius).fold(0.0, f32::max)
    }

    fn place(&self, x: f32, y: f32, z: f32) -> Vec3 {
        self.origin + self.axes[0] * x + self.axes[1] * y + self.axes[2] * z
    }

    fn middle(&self) -> Vec3 {
        let y = self.knots.first().map_or(0.0, |k| k.y) + 0.5 * self.height();
        self.place(0.0, y, 0.0)
    }

    fn is_left_out(&self, grain: &Grain) -> bool {
        let thickness = self.max_radius() * 2.0 * self.axes[0].length();
        self.ornament && !grain.shows(self.middle(), thickness.max(self.height() * 0.5), self.coarser)
    }

    fn cut(&self, grain: &Grain) -> Cut {
        let middle = self.middle();
        let scale = self.axes[0].length().max(self.axes[2].length());
        let radius = self.max_radius() * scale;
        let px = grain.px * self.coarser * grain.view.aside(middle);
        let width_px = grain.view.length_px(middle, TAU * radius / self.sides as f32);
        let across = if self.fluted {
            // an arris and the bottom of the flute at least, unless flutes are lost in a pixel
            match width_px / px {
                w if w < 0.5 => 1,
                w if w < 1.6 => 2,
                w => 2 * ((w / 2.0).ceil() as u32).max(2),
            }
        } else {
            (width_px / px).ceil() as u32
        }
        .clamp(1, 512);
        let step_px = width_px / across as f32;
        // the area of a square half of px, but not much longer than wide
        let along_px = (px * px / step_px.max(1e-3)).min(1.3 * px);
        let along = [1.0, super::sizing::COARSER_BACK].map(|coarser| {
            self.knots
                .windows(2)
                .map(|pair| {
                    let at = self.place(0.0, 0.5 * (pair[0].y + pair[1].y), 0.0);
                    let edge = self.axes[1] * (pair[1].y - pair[0].y) + self.axes[0] * (pair[1].radius - pair[0].radius);
                    let length_px = grain.view.length_px(at, edge.length());
                    // square on is the worst for an upright shaft; lying ones are foreshortened
                    let seen_px = grain.view.edge_px(at, self.axes[1] * (pair[1].y - pair[0].y)).max(0.7 * length_px);
                    ((seen_px / (along_px * coarser)).ceil() as u32).clamp(1, 4096)
                })
                .collect::<Vec<_>>()
        });
        let seen = (0..self.sides)
            .map(|side| {
                let angle = TAU * (side as f32 + 0.5) / self.sides as f32;
                let out = self.axes[0] * libm::cosf(angle) + self.axes[2] * libm::sinf(angle);
                grain.view.sees_within(middle + out * radius, unit_or(out, Vec3::Y), 0.30)
            })
            .collect();
        let rings = [0, 1].map(|end| {
            let at = self.place(0.0, if end == 0 { self.knots[0].y } else { self.knots[self.knots.len() - 1].y }, 0.0);
            let normal = unit_or(self.axes[1], Vec3::Y) * if end == 0 { -1.0 } else { 1.0 };
            if self.ends[end] == End::Covered || !grain.view.sees(at, normal) {
                if self.ends[end] == End::Broken { 2 } else { 1 }
            } else {
                ((grain.view.length_px(at, radius) / px).ceil() as u32).clamp(1, 512)
            }
        });
        Cut { across: [across, across.min(if self.fluted { 2 } else { across.div_ceil(3) })], along, seen, rings }
    }

    /// The knots' double rings at joints that lie inside.
    fn joints(&self) -> usize {
        self.knots.iter().take(self.knots.len() - 1).skip(1).filter(|k| k.joint).count()
    }

    /// Vertices of a line up the shaft.
    fn line_len(&self, cut: &Cut, fine: bool) -> usize {
        let steps: u32 = cut.along[usize::from(!fine)].iter().sum();
        steps as usize + 1 + if fine { self.joints() } else { 0 }
    }

    fn ring_points(&self, cut: &Cut) -> u32 {
        cut.seen.iter().map(|&seen| cut.across[usize::from(!seen)]).sum()
    }

    fn ring_count(points: u32, ring: u32, rings: u32) -> u32 {
        if ring == rings { points } else { (points * ring / rings).max(5) }
    }

    /// Exactly as many triangles as [`Tube::mesh`] makes.
    pub fn count(&self, grain: &Grain) -> usize {
        if self.is_left_out(grain) {
            return 0;
        }
        let cut = self.cut(grain);
        let mut count = 0;
        for side in 0..self.sides as usize {
            let across = cut.across[usize::from(!cut.seen[side])];
            let len = |i: u32| self.line_len(&cut, self.is_fine(&cut, side, i, across));
            count += (0..across).map(|i| len(i) + len(i + 1) - 2).sum::<usize>();
        }
        let points = self.ring_points(&cut);
        for rings in cut.rings {
            let loops: u32 =
                (1..rings).map(|r| Self::ring_count(points, r, rings) + Self::ring_count(points, r + 1, rings)).sum();
            count += (loops + Self::ring_count(points, 1, rings)) as usize;
        }
        count
    }

    /// Whether line `i` of a side is fine: its side is seen, or it bounds one that is.
    fn is_fine(&self, cut: &Cut, side: usize, i: u32, across: u32) -> bool {
        let sides = self.sides as usize;
        cut.seen[side] || (i == 0 && cut.seen[(side + sides - 1) % sides]) || (i == across && cut.seen[(side + 1) % sides])
    }

    /// The closed mesh.
    pub fn mesh(&self, grain: &Grain) -> SolidMesh {
        let (mut mesh, lost, doubles) = self.shape(grain);
        mesh.compute_normals(&[]);
        // arrises that are worn flat, and the smooth capital above the flutes, are no creases
        mesh.soften(&doubles, 0.90);
        mesh.paint(&self.look, &lost);
        mesh
    }

    /// Positions and triangles of the mesh, how deep the stone is lost at each vertex, and the pairs of vertices on creases.
    pub fn shape(&self, grain: &Grain) -> (SolidMesh, Vec<f32>, Vec<(u32, u32)>) {
        let mut mesh = SolidMesh::default();
        let mut lost = Vec::new();
        let mut doubles: Vec<(u32, u32)> = Vec::new();
        if self.is_left_out(grain) {
            return (mesh, lost, doubles);
        }
        let cut = self.cut(grain);
        let shape = Shape::new(self);
        // the two ends' outer rings: turn and vertex
        let mut rims: [Vec<(f32, Vec3)>; 2] = [Vec::new(), Vec::new()];
        let mut previous: Option<Vec<RowVertex>> = None;
        let mut first: Option<Vec<RowVertex>> = None;
        let sides = self.sides as usize;
        for side in 0..sides {
            let across = cut.across[usize::from(!cut.seen[side])];
            let mut line_before: Option<Vec<RowVertex>> = None;
            for i in 0..=across {
                let fine = self.is_fine(&cut, side, i, across);
                // the last line of a side is the first of the next: the same numbers, hence the same bits
                let (turn_side, part) = if i == across { ((side + 1) % sides, 0.0) } else { (side, i as f32 / across as f32) };
                let turn = (turn_side as f32 + part) / self.sides as f32;
                let reuse = match (i, side, i == across && side + 1 == sides) {
                    (0, _, _) if !self.fluted => previous.take(),
                    (_, _, true) if !self.fluted => first.take(),
                    _ => None,
                };
                let line = reuse.unwrap_or_else(|| self.line(&cut, &shape, turn, part, fine, &mut mesh, &mut lost));
                if i == 0
                    && self.fluted
                    && let Some(before) = previous.take()
                {
                    doubles.extend(before.iter().zip(&line).map(|(a, b)| (a.1, b.1)));
                }
                if side == 0 && i == 0 {
                    first = Some(line.clone());
                }
                if let Some(before) = &line_before {
                    // seen from outside with the axis up, growing angles run to the left
                    zip_rows(before, &line, &mut mesh.triangles);
                }
                if i < across {
                    for (end, vertex) in [line[0].1, line[line.len() - 1].1].into_iter().enumerate() {
                        rims[end].push(((side as f32 + part) / self.sides as f32, mesh.positions[vertex as usize]));
                    }
                }
                line_before = Some(line);
            }
            previous = line_before;
        }
        if self.fluted
            && let (Some(last), Some(start)) = (&previous, &first)
        {
            doubles.extend(last.iter().zip(start).map(|(a, b)| (a.1, b.1)));
        }
        for (end, rim) in rims.iter().enumerate() {
            self.end_face(end, &cut, &shape, rim, &mut mesh, &mut lost);
        }
        (mesh, lost, doubles)
    }

    /// The vertices of one line, from bottom to top.
    #[expect(clippy::too_many_arguments, reason = "one step of `mesh`, split off to be read alone")]
    fn line(
        &self,
        cut: &Cut,
        shape: &Shape,
        turn: f32,
        part: f32,
        fine: bool,
        mesh: &mut SolidMesh,
        lost: &mut Vec<f32>,
    ) -> Vec<RowVertex> {
        let (sin, cos) = (libm::sinf(TAU * turn), libm::cosf(TAU * turn));
        let mut row = Vec::with_capacity(self.line_len(cut, fine));
        let mut push = |y: f32, section: usize, row: &mut Vec<RowVertex>| {
            let (p, gone) = shape.point(cos, sin, part, y, section);
            lost.push(gone);
            row.push((y, mesh.vertex(p)));
        };
        push(self.knots[0].y, 0, &mut row);
        for (section, pair) in self.knots.windows(2).enumerate() {
            let steps = cut.along[usize::from(!fine)][section];
            let last = section + 2 == self.knots.len();
            let (from_gap, to_gap) = (
                if fine && section > 0 && pair[0].joint { JOINT } else { 0.0 },
                if fine && !last && pair[1].joint { JOINT } else { 0.0 },
            );
            let (low, high) = (pair[0].y + from_gap, pair[1].y - to_gap);
            if from_gap > 0.0 {
                push(low, section, &mut row);
            }
            for step in 1..=steps {
                push(low + (high - low) * (step as f32 / steps as f32), section, &mut row);
            }
        }
        row
    }

    /// The face of an end: rings about a hub.
    fn end_face(&self, end: usize, cut: &Cut, shape: &Shape, rim: &[(f32, Vec3)], mesh: &mut SolidMesh, lost: &mut Vec<f32>) {
        let rings = cut.rings[end];
        let points = rim.len() as u32;
        let mut outer: Vec<RowVertex> = rim
            .iter()
            .map(|&(turn, p)| {
                lost.push(0.0);
                (turn, mesh.vertex(p))
            })
            .collect();
        let close = |row: &mut Vec<RowVertex>| {
            let start = row[0].1;
            row.push((1.0, start));
        };
        close(&mut outer);
        let start = mesh.triangles.len();
        for ring in (1..rings).rev() {
            let count = Self::ring_count(points, ring, rings);
            let mut inner: Vec<RowVertex> = (0..count)
                .map(|i| {
                    let turn = i as f32 / count as f32;
                    lost.push(if self.ends[end] == End::Broken { 0.05 } else { 0.0 });
                    (turn, mesh.vertex(shape.end_point(end, turn, ring as f32 / rings as f32)))
                })
                .collect();
            close(&mut inner);
            zip_rows(&outer, &inner, &mut mesh.triangles);
            outer = inner;
        }
        lost.push(if self.ends[end] == End::Broken { 0.05 } else { 0.0 });
        let hub = mesh.vertex(shape.end_point(end, 0.0, 0.0));
        for pair in outer.windows(2) {
            mesh.triangles.push([pair[0].1, pair[1].1, hub]);
        }
        // angles grow clockwise seen from above
        if end == 1 {
            mesh.triangles[start..].iter_mut().for_each(|t| t.swap(1, 2));
        }
    }
}

/// The worn surface of a tube.
struct Shape<'a> {
    tube: &'a Tube,
    offset: Vec3,
    tilt: (f32, f32),
}

impl<'a> Shape<'a> {
    fn new(tube: &'a Tube) -> Self {
        let random = |k: u32| unit_f32(hash2_u32(tube.seed, 0x70BE + k));
        Self {
            tube,
            offset: Vec3::new(random(1), random(2), random(3)) * 50.0,
            tilt: (random(4) * 0.7 - 0.35, random(5) * 0.7 - 0.35),
        }
    }

    /// How far a broken end rises above its knot at a place of the cross-section.
    fn broken(&self, x: f32, z: f32) -> f32 {
        let radius = self.tube.max_radius();
        self.tilt.0 * x
            + self.tilt.1 * z
            + 0.16 * radius * fbm(self.tube.seed + 9, Vec3::new(x, 0.0, z) * (1.6 / radius) + self.offset, 3)
    }

    /// The point at an angle, a part of its side in [0, 1), a height and the section that the height belongs to.
    fn point(&self, cos: f32, sin: f32, part: f32, y: f32, section: usize) -> (Vec3, f32) {
        let tube = self.tube;
        let (low, high) = (tube.knots[section], tube.knots[section + 1]);
        let t = ((y - low.y) / (high.y - low.y)).clamp(0.0, 1.0);
        let mut radius = low.radius + (high.radius - low.radius) * t;
        let flute = (low.flute + (high.flute - low.flute) * t) * if tube.fluted { 1.0 } else { 0.0 };
        let wear = &tube.wear;
        let place = Vec3::new(cos * radius, y, sin * radius) + self.offset;
        // a parabola for the flute's arc: -1 and 1 are its arrises
        let across = 2.0 * part - 1.0;
        let depth = FLUTE_DEPTH * radius * flute;
        let mut sunk = depth * (1.0 - across * across);
        let mut lost = 0.0;

        // arrises wear first, in bites
        let bite = smoothstep(-0.25, 0.55, fbm(tube.seed, place * Vec3::new(2.2, 1.1, 2.2), 2) + wear.arris - 0.55);
        let worn = bite * wear.arris * 0.75 * depth;
        if worn > sunk {
            lost += 0.6 * (worn - sunk);
            sunk = worn;
        }
        // whole patches are battered off, deeper than the flutes
        let hole = smoothstep(0.18, 0.52, fbm(tube.seed + 1, place * 0.85, 3) + 0.30 * wear.spall - 0.22) * wear.spall;
        let patch = hole * (depth * 1.0 + 0.05 * radius * (1.0 + fbm(tube.seed + 2, place * 2.8, 2)));
        if patch > sunk {
            lost += patch - sunk;
            sunk = patch;
        }
        // edges of the drums crumble
        let to_joint = [low, high].iter().filter(|k| k.joint).map(|k| (y - k.y).abs()).fold(f32::MAX, f32::min);
        if to_joint < 0.06 {
            let crumble = 0.006 + 0.07 * wear.arris * smoothstep(0.05, 0.5, gradient(tube.seed + 3, place * 1.9));
            sunk += crumble * (1.0 - to_joint / 0.06) * radius.min(1.0);
            lost += 0.5 * crumble * (1.0 - to_joint / 0.06);
        }
        let rough = wear.rough * (0.6 + 0.6 * fbm(tube.seed + 4, place * 4.1, 3));
        radius = (radius - sunk - rough).max(0.08 * radius);

        let (mut x, mut z) = (cos * radius, sin * radius);
        let mut height = y;
        if wear.shift > 0.0 && section > 0 {
            let random = |k: u32| unit_f32(hash2_u32(tube.seed, 64 * section as u32 + k)) - 0.5;
            x += wear.shift * random(1);
            z += wear.shift * random(2);
        }
        let last = section + 2 == tube.knots.len();
        if last && tube.ends[1] == End::Broken {
            height += t * self.broken(x, z);
        }
        if section == 0 && tube.ends[0] == End::Broken {
            height -= (1.0 - t) * self.broken(x, z);
        }
        (tube.place(x, height, z), lost)
    }

    /// A point inside an end's face: `out` is 0 at the hub and 1 at the rim.
    fn end_point(&self, end: usize, turn: f32, out: f32) -> Vec3 {
        let tube = self.tube;
        let knot = if end == 0 { tube.knots[0] } else { tube.knots[tube.knots.len() - 1] };
        let inset = knot.radius * (1.0 - 0.5 * FLUTE_DEPTH * knot.flute) * out;
        let (x, z) = (libm::cosf(TAU * turn) * inset, libm::sinf(TAU * turn) * inset);
        let sign = if end == 0 { -1.0 } else { 1.0 };
        let mut height = knot.y;
        match tube.ends[end] {
            End::Covered => {}
            // the joint face: a smooth rim about a rougher, sunken field and the dowel's hole
            End::Dressed => {
                let field = smoothstep(0.80, 0.70, out);
                let dowel = smoothstep(0.16, 0.10, out);
                let rough = fbm(tube.seed + 11, Vec3::new(x, 0.0, z) * 5.0 + self.offset, 3);
                height -= sign * (0.012 * field * (1.0 + 0.6 * rough) + 0.05 * dowel) * knot.radius;
            }
            End::Broken => height += sign * self.broken(x, z),
        }
        tube.place(x, height, z)
    }
}
