//! Where a surface goes on in another chart of an atlas, the day's sky and bounced sun are shown the same on both sides.
#![expect(clippy::unwrap_used, reason = "helpers of tests")]

use glam::{Vec2, Vec3};
use heliodon_bake::bake::bake;
use heliodon_bake::plan::{BakeOptions, Plan};
use heliodon_bake::report::Silent;
use heliodon_bundle::moment::{Blend, Day, Moment};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleReader, LightLayout, TexelLight};
use heliodon_math::color::srgb_from_linear;
use heliodon_mesh::topology::{Edges, HalfEdge, places};
use heliodon_testkit::scenes::{Scene, ball, cuboid, ground};
use std::f32::consts::PI;
use std::fmt::Write;
use std::fs;

/// What eight bits show.
const MOST_CODES: f32 = 1.0;
/// Places for the length of a texel of the finest level: twice as many as are matched there.
const A_TEXEL: f32 = 8.0;
/// Normals with a lesser cosine between them are a crease, at which light changes.
const SMOOTH: f32 = 0.999;
/// Where there is something solid so close above a surface nobody sees it.
const ABOVE_M: f32 = 2e-3;
/// What is exposed to less than this is as good as dark.
const LEAST_EXPOSED: f32 = 1e-3;
/// In the morning, at noon and in the afternoon, in hours.
const HOURS: [f64; 3] = [7.0, 12.0, 17.5];

/// What is said of places in space.
type Is = fn(Vec3) -> bool;

/// What is baked.
struct Case {
    name: &'static str,
    scene: Scene,
    /// Whether sky light keeps its colour, and texels along a side of the atlas.
    bake: (&'static str, u32),
    is_solid: Is,
    /// Where the exposure is raised until it is as bright there as outside.
    is_indoors: Is,
}

/// A surface over the unit square, whose front is where its normals are.
fn patch([columns, rows]: [u32; 2], at: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Scene {
    let mut scene = Scene::default();
    for (row, column) in (0..=rows).flat_map(|row| (0..=columns).map(move |column| (row, column))) {
        let (position, normal) = at(column as f32 / columns as f32, row as f32 / rows as f32);
        scene.positions.push(position);
        scene.normals.push(normal.normalize_or(Vec3::Y));
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let first = row * (columns + 1) + column;
        let above = first + columns + 1;
        for mut triangle in [[first, first + 1, above + 1], [first, above + 1, above]] {
            let [a, b, c] = triangle.map(|v| scene.positions[v as usize]);
            if (b - a).cross(c - a).dot(scene.normals[first as usize]) < 0.0 {
                triangle.swap(1, 2);
            }
            scene.triangles.push(triangle);
        }
    }
    scene
}

/// How high hills are.
fn height(p: Vec3) -> f32 {
    0.3 * libm::sinf(2.3 * p.x + 0.4) * libm::cosf(1.9 * p.z)
}

/// Hills, so many metres along a side.
fn hills(side: f32) -> Scene {
    patch([80; 2], |u, v| {
        let p = Vec3::new(u - 0.5, 0.0, v - 0.5) * side;
        let slope = |by: Vec3| (height(p + by) - height(p - by)) / (2.0 * by.length());
        (p + Vec3::Y * height(p), Vec3::new(-slope(Vec3::X * 1e-2), 1.0, -slope(Vec3::Z * 1e-2)))
    })
}

/// Whether a place is below the hills, whose triangles are up to a millimetre beside them.
fn is_in_hills(p: Vec3) -> bool {
    p.y < height(p) - 1e-3
}

const VAULT: [f32; 2] = [1.5, 1.8];
const VAULT_ENDS: f32 = 2.0;

/// Half a tube that stands in the ground, along z.
fn vault() -> Scene {
    let way = |u: f32| {
        let angle = -0.4 + u * (PI + 0.8);
        Vec3::new(libm::cosf(angle), libm::sinf(angle), 0.0)
    };
    let along = |radius: f32, side: f32| {
        patch([40, 8], move |u, v| (way(u) * radius + Vec3::Z * VAULT_ENDS * (2.0 * v - 1.0), way(u) * side))
    };
    let end = |side: f32| {
        patch([40, 1], move |u, v| {
            (way(u) * (VAULT[0] + v * (VAULT[1] - VAULT[0])) + Vec3::Z * VAULT_ENDS * side, Vec3::Z * side)
        })
    };
    along(VAULT[0], -1.0).and(along(VAULT[1], 1.0)).and(end(-1.0)).and(end(1.0))
}

fn is_in_vault(p: Vec3) -> bool {
    let radius = p.truncate().length();
    p.z.abs() < VAULT_ENDS && radius > VAULT[0] && radius < VAULT[1]
}

type Boxes = &'static [([f32; 3], [f32; 3])];

/// Both ends of the vault, in one of them a door.
const ENDS: Boxes = &[
    ([-1.8, -0.6, -2.2], [1.8, 1.8, -2.0]),
    ([-1.8, -0.6, 2.0], [-0.4, 1.8, 2.2]),
    ([0.4, -0.6, 2.0], [1.8, 1.8, 2.2]),
    ([-0.4, 0.9, 2.0], [0.4, 1.8, 2.2]),
];
/// Walls in the open, thinner than texels.
const WALLS: Boxes = &[([-1.0, -0.6, 0.3], [1.2, 0.8, 0.34]), ([0.4, -0.6, -1.4], [0.44, 0.6, 0.3])];

fn boxes(all: Boxes) -> Scene {
    all.iter().map(|&(low, high)| cuboid(low.into(), high.into(), 1)).fold(Scene::default(), Scene::and)
}

fn is_in(all: Boxes, p: Vec3) -> bool {
    all.iter().any(|&(low, high)| p.cmpgt(low.into()).all() && p.cmplt(high.into()).all())
}

const BALL: Vec3 = Vec3::new(0.4, 0.2, 0.3);
const OTHER_BALL: Vec3 = Vec3::new(-0.7, 0.5, -0.4);

fn cases() -> [Case; 4] {
    let balls = || ball(0.5, 24).moved(BALL).and(ball(0.4, 24).moved(OTHER_BALL));
    [
        Case {
            name: "balls and a box on a square",
            scene: balls().and(ground(4.0, 16)).and(boxes(&[([-1.6, -0.1, 0.2], [-0.9, 1.2, 1.1])])),
            bake: ("rgb", 256),
            is_solid: |p| p.y < 0.0 || p.distance(BALL) < 0.5 || p.distance(OTHER_BALL) < 0.4,
            is_indoors: |_| false,
        },
        Case {
            name: "walls and balls on hills",
            scene: balls().and(hills(4.0)).and(boxes(WALLS)),
            bake: ("mono", 256),
            is_solid: |p| is_in_hills(p) || p.distance(BALL) < 0.5 || p.distance(OTHER_BALL) < 0.4 || is_in(WALLS, p),
            is_indoors: |_| false,
        },
        Case {
            name: "a vault over hills",
            scene: vault().and(hills(6.0)),
            bake: ("rgb", 256),
            is_solid: |p| is_in_hills(p) || is_in_vault(p),
            is_indoors: |p| p.z.abs() < VAULT_ENDS && p.truncate().length() < VAULT[0],
        },
        Case {
            name: "a vaulted room with a door",
            scene: vault().and(hills(6.0)).and(boxes(ENDS)),
            bake: ("mono", 256),
            is_solid: |p| is_in_hills(p) || is_in_vault(p) || is_in(ENDS, p),
            is_indoors: |p| p.z.abs() < VAULT_ENDS && p.truncate().length() < VAULT[0],
        },
    ]
}

/// A surface as a bundle has it, and its light.
struct Baked {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    texels: TexelLight,
    layout: LightLayout,
    moments: Vec<Moment>,
}

fn obj(scene: &Scene) -> String {
    let mut text = String::new();
    for (p, n) in scene.positions.iter().zip(&scene.normals) {
        writeln!(text, "v {} {} {}\nvn {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
    }
    for [a, b, c] in scene.triangles.iter().map(|t| t.map(|v| v + 1)) {
        writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}").unwrap();
    }
    text
}

fn baked(case: &Case) -> Baked {
    let folder = tempfile::tempdir().unwrap();
    let (transfer, texels) = case.bake;
    let site = format!(
        "[site]\nname = \"Seams\"\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\n[[part]]\nfile = \"all.obj\"\nlight = \"texel\"\n\
         [sky]\nmodel = \"atmosphere\"\ndate = \"2024-05-01\"\n[bake]\nsamples = 64\nsun_steps = 12\nbounces = 2\noffset_m = 0.001\n\
         transfer = \"{transfer}\"\ntexels = {texels}\n"
    );
    fs::write(folder.path().join("site.toml"), site).unwrap();
    fs::write(folder.path().join("all.obj"), obj(&case.scene)).unwrap();
    let to = folder.path().join("bundle");
    bake(&Plan::new(Site::read(folder.path()).unwrap(), BakeOptions::new(&to)).unwrap(), &Silent).unwrap();
    let bundle = BundleReader::open(to).unwrap();
    let day = Day::new(bundle.lapse().clone());
    let mut all = Baked {
        positions: Vec::new(),
        normals: Vec::new(),
        uvs: Vec::new(),
        triangles: Vec::new(),
        texels: bundle.read_texels().unwrap().unwrap(),
        layout: bundle.manifest().light,
        moments: HOURS.map(|hour| day.at(3600.0 * hour, Blend::default())).into(),
    };
    for chunk in (0..bundle.chunk_count()).map(|chunk| bundle.read_chunk(chunk).unwrap()) {
        let first = all.positions.len() as u32;
        all.triangles.extend(chunk.triangles.iter().map(|t| t.map(|v| v + first)));
        all.positions.extend(chunk.positions);
        all.normals.extend(chunk.normals);
        all.uvs.extend(chunk.texel_uvs);
    }
    all
}

/// A place of a border: what the sky and the bounced sun bring to both sides at each moment.
struct Place {
    position: Vec3,
    normal: Vec3,
    sides: Vec<[Vec3; 2]>,
}

impl Baked {
    /// Places all along the borders between charts at which the surface goes on smoothly.
    fn border_places(&self) -> Vec<Place> {
        let mut found = Vec::new();
        let all = places(&self.positions, 0.0);
        let has_area = |t: usize| {
            let [a, b, c] = self.triangles[t].map(|v| all[v as usize]);
            a != b && b != c && c != a
        };
        Edges::new(&self.triangles, &all, has_area).for_each(|_, sides| {
            if let (2, Some(one), Some(other)) = (sides.len(), sides.next(), sides.next())
                && one.down != other.down
            {
                self.along(one, other, &mut found);
            }
        });
        found
    }

    fn along(&self, one: HalfEdge, other: HalfEdge, found: &mut Vec<Place>) {
        let ends = |side: HalfEdge| {
            let (corners, corner) = (self.triangles[side.triangle as usize], usize::from(side.corner));
            [corners[corner], corners[(corner + 1) % 3]].map(|v| v as usize)
        };
        let (one, [last, first]) = (ends(one), ends(other));
        let other = [first, last];
        let is_smooth = |end: usize| self.normals[one[end]].dot(self.normals[other[end]]) >= SMOOTH;
        if [0, 1].into_iter().all(|end| self.uvs[one[end]] == self.uvs[other[end]]) || ![0, 1].into_iter().all(is_smooth) {
            return;
        }
        let side = self.texels.sun.width as f32;
        let length = [one, other].map(|ends| side * self.uvs[ends[0]].distance(self.uvs[ends[1]]));
        let steps = (A_TEXEL * length[0].max(length[1])).ceil().max(1.0) as u32;
        for share in (0..=steps).map(|step| step as f32 / steps as f32) {
            let normal = self.normals[one[0]].lerp(self.normals[one[1]], share);
            let light = |moment: &Moment| {
                [one, other].map(|ends| {
                    let uv = self.uvs[ends[0]].lerp(self.uvs[ends[1]], share);
                    let light = self.texels.light(self.layout, moment, uv, normal);
                    light.sky + light.bounce
                })
            };
            found.push(Place {
                position: self.positions[one[0]].lerp(self.positions[one[1]], share),
                normal,
                sides: self.moments.iter().map(light).collect(),
            });
        }
    }
}

/// By how many codes something white is shown apart.
fn codes(sides: [Vec3; 2], exposure: f32) -> f32 {
    let [one, other] =
        sides.map(|light| Vec3::from_array((light * exposure).to_array().map(|x| 255.0 * srgb_from_linear(x.clamp(0.0, 1.0)))));
    (one - other).abs().max_element()
}

/// By how many codes a place is shown apart, at which hour, and where.
#[derive(Clone, Copy)]
struct Apart {
    codes: f32,
    hour: f64,
    position: Vec3,
}

/// All places at all hours, the widest first, each as the viewer exposes the hour by itself; of places where `is_raised`, so that what 95 of 100 of them do not exceed is white.
fn shown_apart(moments: &[Moment], seen: &[&Place], is_raised: bool) -> Vec<Apart> {
    let mut all = Vec::new();
    for (i, moment) in moments.iter().enumerate() {
        let mut bright: Vec<f32> = seen.iter().map(|place| place.sides[i][0].max_element()).collect();
        bright.sort_by(f32::total_cmp);
        let automatic = moment.exposure_stops.exp2();
        let white = bright.get(bright.len() * 95 / 100).copied().unwrap_or_default();
        // nobody raises it where no light is
        let exposure = if is_raised && white * automatic > LEAST_EXPOSED { 1.0 / white } else { automatic };
        let apart = |place: &&Place| Apart { codes: codes(place.sides[i], exposure), hour: HOURS[i], position: place.position };
        all.extend(seen.iter().map(apart));
    }
    all.sort_by(|a, b| b.codes.total_cmp(&a.codes));
    all
}

#[test]
fn the_day_is_shown_alike_on_both_sides_of_every_border() {
    for case in cases() {
        let baked = baked(&case);
        let all = baked.border_places();
        let above = |place: &Place| place.position + ABOVE_M * place.normal;
        let seen: Vec<&Place> = all.iter().filter(|place| !(case.is_solid)(above(place))).collect();
        let (indoors, outdoors): (Vec<&Place>, Vec<&Place>) = seen.iter().partition(|place| (case.is_indoors)(above(place)));
        assert!(outdoors.len() > 1000, "{}: {} places", case.name, outdoors.len());
        for (whence, places, is_raised) in [("outdoors", outdoors, false), ("indoors", indoors, true)] {
            let apart = shown_apart(&baked.moments, &places, is_raised);
            let Some(widest) = apart.first() else { continue };
            let told = format!(
                "{}, {whence}: {} codes at most (at {} h, {:.2}), 99 of 100 within {}, {} places seen of {}, at {} hours",
                case.name,
                widest.codes,
                widest.hour,
                widest.position,
                apart[apart.len() / 100].codes,
                places.len(),
                all.len(),
                HOURS.len()
            );
            println!("{told}");
            assert!(widest.codes <= MOST_CODES, "{told}");
        }
    }
}
