//! One moving mesh and its light: posed, seen, asked, lit.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. The visibility matrix is that of the mesh in
//! its own space: where it goes is nobody's business, and how it is turned only decides where light is looked up (section 6). What deforms is
//! asked anew in each frame, of the vertices that the cameras see (section 4.1).

use super::levels::{Directions, LevelChoice};
use super::shade::SPHERES;
use super::solid::Solid;
use glam::{Affine3A, Mat3A, Vec3};
use heliodon_math::frame::unit_or;
use heliodon_math::light_sphere::LightSphere;
use heliodon_math::visibility::VisibilityBackend;
use heliodon_mesh::Mesh;
use heliodon_mesh::motion::{MovingMesh, Pose};
use heliodon_rays::{EyeView, VertexFilter, VisibilityCpu, VisibilityCpuError};
use std::collections::HashMap;
use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;
use std::time::Instant;

/// Seconds in which the light from the sky follows: a direction that comes or goes must not be seen as a step.
pub const FOLLOW_S: f32 = 0.08;
/// Of a mesh's triangles as many may be unseen when all count as seen.
const THRESHOLD: f32 = 0.03;

/// A mesh that moves, made ready for light: what is open has its backs as vertices and triangles of their own, lit from their side.
pub struct Model {
    moving: MovingMesh,
    /// What each vertex here is of the moving mesh.
    sources: Vec<Corner>,
    /// All triangles that are drawn.
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of the moving mesh: what occludes.
    fronts: usize,
    /// Which spheres stand for the mesh where it darkens others: ranges of vertices, in an order of neighbours.
    lumps: Vec<Vec<u32>>,
}

/// A vertex with a material, seen from one side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Corner {
    vertex: u32,
    material: u16,
    back: bool,
}

impl Model {
    /// Of a mesh as it was read.
    #[must_use]
    pub fn new(moving: MovingMesh) -> Self {
        let mesh = moving.rest();
        let sides: &[bool] = if is_open(mesh) { &[false, true] } else { &[false] };
        let (mut sources, mut known) = (Vec::new(), HashMap::new());
        let mut triangles = Vec::with_capacity(mesh.triangles.len() * sides.len());
        for &back in sides {
            for (i, &[a, b, c]) in mesh.triangles.iter().enumerate() {
                let material = mesh.triangle_material.get(i).copied().unwrap_or(0);
                triangles.push((if back { [a, c, b] } else { [a, b, c] }).map(|vertex| {
                    let corner = Corner { vertex, material, back };
                    *known.entry(corner).or_insert_with(|| {
                        sources.push(corner);
                        sources.len() as u32 - 1
                    })
                }));
            }
        }
        let fronts: Vec<u32> = (0..sources.len() as u32).filter(|&i| !sources[i as usize].back).collect();
        let places: Vec<Vec3> = fronts.iter().map(|&i| mesh.positions[sources[i as usize].vertex as usize]).collect();
        let order = heliodon_rays::beam_order(&places, None);
        let each = order.len().div_ceil(SPHERES).max(1);
        let lumps = order.chunks(each).map(|part| part.iter().map(|&i| fronts[i as usize]).collect()).collect();
        let fronts = mesh.triangles.len();
        Self { moving, sources, triangles, fronts, lumps }
    }

    /// The moving mesh's vertex of each vertex here, and its side, as a GPU that poses it takes them.
    #[must_use]
    pub fn gpu_corners(&self) -> Vec<heliodon_gpu::moving::Corner> {
        let corner = |corner: &Corner| heliodon_gpu::moving::Corner { vertex: corner.vertex, back: corner.back };
        self.sources.iter().map(corner).collect()
    }

    /// The mesh and its motions.
    #[must_use]
    pub fn moving(&self) -> &MovingMesh {
        &self.moving
    }

    /// The moving mesh's vertex, and the material, of each vertex here.
    pub fn corners(&self) -> impl Iterator<Item = (usize, u16)> + '_ {
        self.sources.iter().map(|corner| (corner.vertex as usize, corner.material))
    }

    /// The material of a vertex here.
    #[must_use]
    pub fn material(&self, vertex: u32) -> u16 {
        self.sources[vertex as usize].material
    }

    /// Vertices, backs included.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.sources.len()
    }
}

/// Places closer than this part of a mesh's size are one: where tools close a seam they round.
const SAME_PLACE: f32 = 1e-5;

/// Whether a mesh has edges at which it ends; vertices in one place are one.
fn is_open(mesh: &Mesh) -> bool {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let scale = 1.0 / (SAME_PLACE * low.distance(high)).max(f32::MIN_POSITIVE);
    let mut places: HashMap<[i32; 3], u32> = HashMap::new();
    let mut place = |p: &Vec3| {
        let next = places.len() as u32;
        *places.entry(((*p - low) * scale).round().as_ivec3().to_array()).or_insert(next)
    };
    let place: Vec<u32> = mesh.positions.iter().map(&mut place).collect();
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        let t = t.map(|i| place[i as usize]);
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])].into_iter().filter(|(a, b)| a != b) {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let ends = balance.values().filter(|&&sum| sum != 0).count();
    // A few that a modeller forgot do not make a body a cloth.
    ends * 200 > balance.len()
}

/// What a figure's light comes from.
pub struct Surroundings<'a> {
    /// Radiance from a direction of the world, exposed or not, as the light is to be.
    pub radiance: &'a dyn Fn(Vec3) -> Vec3,
    /// Direction to the sun and its irradiance at normal incidence.
    pub sun: Option<(Vec3, Vec3)>,
    /// How much of the sun reaches a place of the world, but for the figure itself.
    pub sun_reaches: &'a (dyn Fn(Vec3) -> f32 + Sync),
}

/// What a frame did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Asked {
    /// Directions.
    pub directions: usize,
    /// Vertices for which anything was asked.
    pub vertices: usize,
    /// Whether nothing asked before was of use.
    pub deforms: bool,
}

/// A mesh in motion, with its light.
pub struct Figure {
    model: Arc<Model>,
    backend: VisibilityCpu,
    filter: VertexFilter,
    choice: LevelChoice,
    spheres: HashMap<u32, LightSphere>,
    pose: Pose,
    posed_at: Option<(Option<usize>, f32)>,
    /// Whether the backend has the mesh at all, and as it is posed.
    backend_has: [bool; 2],
    /// In its own space, sides included.
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    place: Affine3A,
    /// The light from the sky as it is shown, and whether there is any.
    sky: Vec<Vec3>,
    known: Vec<bool>,
    /// Which vertices the sun reaches past the figure itself, and for which of its directions (in the figure's space) that holds.
    sun_bits: Vec<bool>,
    sun_asked: Option<Vec3>,
    light: Vec<Vec3>,
    /// How much of the sun's irradiance / pi in the light comes straight from the sun.
    sun: Vec<f32>,
    /// Whether any of it was computed.
    lit: bool,
}

impl Figure {
    /// A figure that was not posed yet.
    #[must_use]
    pub fn new(model: Arc<Model>) -> Self {
        let count = model.vertex_count();
        let filter = VertexFilter::new(count, &model.triangles, THRESHOLD).one_sided();
        Self {
            model,
            backend: VisibilityCpu::default(),
            filter,
            choice: LevelChoice::default(),
            spheres: HashMap::new(),
            pose: Pose::default(),
            posed_at: None,
            backend_has: [false; 2],
            positions: vec![Vec3::ZERO; count],
            normals: vec![Vec3::ZERO; count],
            place: Affine3A::IDENTITY,
            sky: vec![Vec3::ZERO; count],
            known: vec![false; count],
            sun_bits: vec![false; count],
            sun_asked: None,
            light: vec![Vec3::ZERO; count],
            sun: vec![0.0; count],
            lit: false,
        }
    }

    /// The mesh.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Positions in the world.
    pub fn world_positions(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.positions.iter().map(|&p| self.place.transform_point3(p))
    }

    /// Unit normals in the world.
    pub fn world_normals(&self) -> impl Iterator<Item = Vec3> + '_ {
        let turn = rotation(self.place);
        self.normals.iter().map(move |&n| turn * n)
    }

    /// What of it can be touched: its triangles, as they are posed.
    #[must_use]
    pub fn solid(&self) -> Solid<'_> {
        Solid { world_from_mesh: self.place, positions: &self.positions, triangles: &self.model.triangles[..self.model.fronts] }
    }

    /// Irradiance / pi of each vertex; what no camera saw has the light that it was last seen with.
    #[must_use]
    pub fn light(&self) -> &[Vec3] {
        &self.light
    }

    /// How much of the sun's irradiance / pi in [`Self::light`] comes straight from the sun: what stands in its way takes that.
    #[must_use]
    pub fn sun(&self) -> &[f32] {
        &self.sun
    }

    /// Goes to a moment of a clip, and to a place; answers whether the mesh itself has changed.
    pub fn go(&mut self, clip: Option<usize>, time_s: f32, place: Affine3A) -> bool {
        self.place = place;
        if self.posed_at == Some((clip, time_s)) {
            return false;
        }
        let rest = self.model.moving.rest();
        let (positions, normals) = match clip {
            Some(clip) => {
                self.model.moving.pose(clip, time_s, &mut self.pose);
                (&self.pose.positions, &self.pose.normals)
            }
            None => (&rest.positions, &rest.normals),
        };
        let first = self.posed_at.replace((clip, time_s)).is_none();
        let mut sources = self.model.sources.iter().zip(&self.positions);
        if !first && sources.all(|(corner, &position)| positions[corner.vertex as usize] == position) {
            return false;
        }
        for (i, corner) in self.model.sources.iter().enumerate() {
            let normal = normals[corner.vertex as usize];
            self.positions[i] = positions[corner.vertex as usize];
            self.normals[i] = if corner.back { -normal } else { normal };
        }
        self.backend_has[1] = false;
        self.filter.reset();
        self.sun_asked = None;
        true
    }

    /// Tells the backend how the mesh is posed.
    fn tell_backend(&mut self) -> Result<(), VisibilityCpuError> {
        match self.backend_has {
            [_, true] => {}
            [true, _] => self.backend.move_vertices(&self.positions, &self.normals)?,
            [false, _] => {
                self.backend.set_mesh(&self.positions, &self.normals, &self.model.triangles[..self.model.fronts])?;
            }
        }
        self.backend_has = [true; 2];
        Ok(())
    }

    /// The light sphere of a level.
    pub fn sphere(&mut self, level: u32) -> &LightSphere {
        self.spheres.entry(level).or_insert_with(|| LightSphere::new(level))
    }

    /// How the mesh's own directions lie in the world.
    #[must_use]
    pub fn turn(&self) -> Mat3A {
        rotation(self.place)
    }

    /// Asks what the eyes need (in the world's space) and lights it; `dt_s` seconds have passed since it was lit last, none for a picture on its own.
    ///
    /// # Errors
    /// Not posed yet, or a mesh that cannot be asked.
    pub fn illuminate(
        &mut self,
        eyes: &[EyeView],
        directions: Directions,
        deforming: bool,
        around: &Surroundings<'_>,
        dt_s: Option<f32>,
    ) -> Result<Asked, VisibilityCpuError> {
        self.tell_backend()?;
        let place = glam::Mat4::from(self.place);
        let mut new = 0;
        for eye in eyes {
            new += self.filter.look(&self.positions, &EyeView { clip_from_mesh: eye.clip_from_mesh * place, ..*eye });
        }
        let wanted = self.filter.wanted();
        let count = wanted.iter().filter(|&&wanted| wanted).count();
        let level = self.choice.next(directions, count, deforming);
        let sphere = self.spheres.entry(level).or_insert_with(|| LightSphere::new(level));
        let start = Instant::now();
        self.backend.compute_for(wanted, sphere.directions())?;
        if deforming {
            self.choice.took(start.elapsed().as_secs_f32() * 1e3, count, sphere.directions().len());
        }
        let turn = rotation(self.place);
        let radiance: Vec<Vec3> = sphere.directions().iter().map(|&l| (around.radiance)(turn * l)).collect();
        let sky = self.backend.light(sphere.weights(), &radiance)?.light;
        let follow = heliodon_gpu::moving::follow(dt_s, FOLLOW_S);
        if !self.lit {
            // What no eye is thought to see may show at a pixel's edge: then as the rest does on the average.
            let sum: Vec3 = sky.iter().zip(wanted).filter(|(_, wanted)| **wanted).map(|(light, _)| *light).sum();
            self.light.fill(sum / count.max(1) as f32);
            self.lit = count > 0;
        }
        for ((shown, known), (&now, &wanted)) in self.sky.iter_mut().zip(&mut self.known).zip(sky.iter().zip(wanted)) {
            *shown = if *known && wanted {
                *shown + (now - *shown) * follow
            } else if wanted {
                now
            } else {
                *shown
            };
            *known = wanted;
        }
        let sun = around.sun.map(|(direction, irradiance)| (turn.transpose() * direction, irradiance));
        if let Some((direction, _)) = sun
            && (self.sun_asked != Some(direction) || new > 0)
        {
            self.sun_asked = Some(direction);
            self.sun_bits = self.backend.seen_from(wanted, direction)?;
        }
        let place = self.place;
        for i in (0..wanted.len()).filter(|&i| wanted[i]) {
            (self.light[i], self.sun[i]) = (self.sky[i], 0.0);
            if let Some((direction, irradiance)) = sun
                && self.sun_bits[i]
            {
                let cosine = self.normals[i].dot(direction).max(0.0);
                self.sun[i] = cosine * (around.sun_reaches)(place.transform_point3(self.positions[i]));
                self.light[i] += irradiance * (self.sun[i] * FRAC_1_PI);
            }
        }
        let vertices = if deforming { count } else { new };
        Ok(Asked { directions: sphere.directions().len(), vertices, deforms: deforming })
    }

    /// Spheres of the world that take as much of the sky, seen from afar, as the mesh: centres, and radii in w. Parts of a surface of area A show A / 4 on the average
    /// (A. Cauchy, 1832), as a sphere of radius sqrt(A / 4 pi) does.
    #[must_use]
    pub fn lumps(&self) -> Vec<glam::Vec4> {
        let mut area = vec![0.0; self.positions.len()];
        for t in &self.model.triangles[..self.model.fronts] {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let third = (b - a).cross(c - a).length() / 6.0;
            t.iter().for_each(|&i| area[i as usize] += third);
        }
        // A surface that has two sides is as wide as both.
        let sides = (self.model.triangles.len() / self.model.fronts.max(1)) as f32;
        let scale = self.place.matrix3.x_axis.length();
        let lump = |vertices: &Vec<u32>| {
            let (mut sum, mut center) = (0.0, Vec3::ZERO);
            for &i in vertices {
                sum += area[i as usize];
                center += self.positions[i as usize] * area[i as usize];
            }
            let radius = (sides * sum / (4.0 * std::f32::consts::PI)).sqrt() * scale;
            (sum > 0.0).then(|| self.place.transform_point3(center / sum).extend(radius))
        };
        self.model.lumps.iter().filter_map(lump).collect()
    }
}

/// How a place turns directions.
fn rotation(place: Affine3A) -> Mat3A {
    let axes = [place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis];
    let [x, y, z] = axes.map(|axis| unit_or(Vec3::from(axis), Vec3::ZERO));
    Mat3A::from_cols(x.into(), y.into(), z.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat4, Quat, UVec2};
    use heliodon_testkit::scenes::{Scene, ball, ground, rectangle};

    const FIXED: Directions = Directions::Fixed(3);

    fn figure(scene: Scene) -> Figure {
        let mesh = Mesh { positions: scene.positions, normals: scene.normals, triangles: scene.triangles, ..Mesh::default() };
        Figure::new(Arc::new(Model::new(MovingMesh::still(mesh))))
    }

    fn eye(from: Vec3) -> EyeView {
        let project = Mat4::perspective_infinite_reverse_rh(1.2, 1.0, 0.1);
        EyeView { clip_from_mesh: project * Mat4::look_at_rh(from, Vec3::ZERO, Vec3::Y), size_px: UVec2::splat(256) }
    }

    /// Eyes on all sides.
    fn eyes() -> Vec<EyeView> {
        [Vec3::X, Vec3::NEG_X, Vec3::new(0.1, 1.0, 0.0), Vec3::new(0.1, -1.0, 0.0), Vec3::Z, Vec3::NEG_Z]
            .map(|d| eye(d * 4.0))
            .to_vec()
    }

    fn sky(direction: Vec3) -> Vec3 {
        Vec3::new(1.0 + 0.5 * direction.y, 1.0, 1.0 - 0.3 * direction.x)
    }

    fn around() -> Surroundings<'static> {
        Surroundings { radiance: &sky, sun: None, sun_reaches: &|_| 1.0 }
    }

    #[test]
    fn a_ball_in_the_open_is_lit_by_all_that_it_faces() {
        let mut figure = figure(ball(1.0, 20));
        assert!(figure.go(None, 0.0, Affine3A::IDENTITY));
        let asked = figure.illuminate(&eyes(), FIXED, true, &around(), None).unwrap();
        assert_eq!((asked.directions, asked.vertices), (258, figure.model().vertex_count()));
        let normals = ball(1.0, 20).normals;
        for (light, (vertex, _)) in figure.light().iter().zip(figure.model().corners()) {
            let n = normals[vertex];
            // the light of a linear radiance is its mean and two thirds of its slope
            let exact = Vec3::new(1.0 + n.y / 3.0, 1.0, 1.0 - 0.2 * n.x);
            assert!((*light - exact).abs().max_element() < 0.04, "{light} for {exact}");
        }
    }

    #[test]
    fn what_is_turned_and_carried_is_not_asked_again() {
        let scene = ball(0.5, 12).and(ground(2.0, 8).moved(Vec3::Y * -0.6));
        let mut carried = figure(scene.clone());
        carried.go(None, 0.0, Affine3A::IDENTITY);
        carried.illuminate(&eyes(), FIXED, true, &around(), None).unwrap();
        let place = Affine3A::from_rotation_translation(Quat::from_rotation_y(1.1), Vec3::new(0.3, 0.0, -0.2));
        assert!(!carried.go(None, 0.0, place), "the same shape");
        let asked = carried.illuminate(&eyes(), FIXED, false, &around(), None).unwrap();
        assert_eq!(asked.vertices, 0);
        // against one that was built there, whose directions are the world's: other directions, nearly the same light
        let turned = Scene {
            positions: scene.positions.iter().map(|&p| place.transform_point3(p)).collect(),
            normals: scene.normals.iter().map(|&n| place.transform_vector3(n)).collect(),
            ..scene
        };
        let mut built = figure(turned);
        built.go(None, 0.0, Affine3A::IDENTITY);
        built.illuminate(&eyes(), Directions::Fixed(4), true, &around(), None).unwrap();
        let off = carried.light().iter().zip(built.light()).map(|(a, b)| (*a - *b).abs().max_element());
        assert!(off.clone().sum::<f32>() / (built.light().len() as f32) < 0.01);
        let worst = off.fold(0.0, f32::max);
        assert!(worst < 0.15, "{worst}");
    }

    #[test]
    fn a_cloth_has_two_sides_and_each_its_light() {
        let sheet = rectangle(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 4);
        let count = sheet.positions.len();
        let mut figure = figure(sheet);
        assert_eq!(figure.model().vertex_count(), 2 * count);
        figure.go(None, 0.0, Affine3A::IDENTITY);
        let from_ahead = |direction: Vec3| if direction.z > 0.0 { Vec3::ONE } else { Vec3::ZERO };
        let sun = Some((Vec3::Z, Vec3::splat(std::f32::consts::PI)));
        let around = Surroundings { radiance: &from_ahead, sun, sun_reaches: &|place| if place.x > 0.0 { 1.0 } else { 0.0 } };
        figure
            .illuminate(&[eye(Vec3::new(0.1, 0.0, 3.0)), eye(Vec3::new(0.1, 0.0, -3.0))], FIXED, true, &around, None)
            .unwrap();
        let places: Vec<Vec3> = figure.world_positions().collect();
        for (i, (light, place)) in figure.light().iter().zip(places).enumerate() {
            let sunlit = if place.x > 0.0 { 1.0 } else { 0.0 };
            let exact = if i < count { 1.0 + sunlit } else { 0.0 };
            assert!((light.x - exact).abs() < 0.03, "{i} at {place}: {light}");
        }
        // two sheets' sides weigh as much as what they hide: a square of two metres
        let taken: f32 = figure.lumps().iter().map(|lump| lump.w * lump.w * std::f32::consts::PI).sum();
        assert!((taken - 2.0).abs() < 0.01, "{taken}");
    }

    #[test]
    fn only_what_is_seen_is_asked_and_the_rest_when_it_shows() {
        let mut figure = figure(ball(1.0, 30));
        figure.go(None, 0.0, Affine3A::IDENTITY);
        let front = figure.illuminate(&[eye(Vec3::Z * 4.0)], FIXED, false, &around(), None).unwrap().vertices;
        let all = figure.model().vertex_count();
        assert!(front * 5 < all * 3 && front * 4 > all, "{front} of {all}");
        assert_eq!(figure.illuminate(&[eye(Vec3::Z * 4.0)], FIXED, false, &around(), None).unwrap().vertices, 0);
        let mut sum = front;
        for other in eyes() {
            sum += figure.illuminate(&[other], FIXED, false, &around(), None).unwrap().vertices;
        }
        assert_eq!(sum, all);
        // nobody looks: nothing is asked, and nothing is lost
        let before = figure.light().to_vec();
        assert_eq!(figure.illuminate(&[], FIXED, false, &around(), None).unwrap().vertices, 0);
        assert_eq!(figure.light(), before);
    }

    #[test]
    fn light_from_the_sky_follows_and_does_not_jump() {
        let mut figure = figure(ball(1.0, 12));
        figure.go(None, 0.0, Affine3A::IDENTITY);
        let even = |value: f32| move |_: Vec3| Vec3::splat(value);
        let (dark, bright) = (even(0.0), even(1.0));
        let lit = |figure: &mut Figure, radiance: &dyn Fn(Vec3) -> Vec3, dt_s| {
            let around = Surroundings { radiance, sun: None, sun_reaches: &|_| 1.0 };
            figure.illuminate(&eyes(), FIXED, false, &around, dt_s).unwrap();
            figure.light()[0].x
        };
        assert_eq!(lit(&mut figure, &dark, None), 0.0);
        let first = lit(&mut figure, &bright, Some(FOLLOW_S));
        assert!((first - 0.632).abs() < 0.03, "{first}");
        let later = lit(&mut figure, &bright, Some(10.0 * FOLLOW_S));
        assert!((later - 1.0).abs() < 0.03 && later > first);
        let alone = lit(&mut figure, &dark, None);
        assert_eq!(alone, 0.0, "a picture on its own depends on nothing before it");
    }

    #[test]
    fn other_directions_come_in_over_several_frames() {
        // A light from one side, that few directions see otherwise than many.
        let narrow = |direction: Vec3| Vec3::splat(libm::expf(30.0 * (direction.dot(Vec3::new(0.48, 0.64, 0.6)) - 1.0)));
        let around = Surroundings { radiance: &narrow, sun: None, sun_reaches: &|_| 1.0 };
        let mut figure = figure(ball(1.0, 12));
        figure.go(None, 0.0, Affine3A::IDENTITY);
        let mut lit = |level, dt_s| {
            figure.illuminate(&eyes(), Directions::Fixed(level), false, &around, dt_s).unwrap();
            figure.light().to_vec()
        };
        let [few, many] = [1, 4].map(|level| lit(level, None));
        let apart = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
        let step = apart(&few, &many);
        assert!(step > 0.02 * many.iter().map(|l| l.x).fold(0.0, f32::max), "{step}");
        // At sixty frames a second no frame takes a fifth of the step, and a third of a second all of it.
        let mut before = lit(1, None);
        for frame in 0..20 {
            let now = lit(4, Some(1.0 / 60.0));
            assert!(apart(&before, &now) < 0.2 * step, "frame {frame}");
            before = now;
        }
        assert!(apart(&before, &many) < 0.03 * step);
    }
}
