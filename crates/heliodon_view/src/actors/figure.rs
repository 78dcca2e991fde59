//! One moving mesh and its light: posed, seen, asked, lit.
//!
//! M. Sattler, R. Sarlette, G. Zachmann, R. Klein: "Hardware-accelerated ambient occlusion computation", VMV 2004. The visibility matrix is that of the mesh in
//! its own space: where it goes is nobody's business, and how it is turned only decides where light is looked up (section 6). What deforms is
//! asked anew in each frame, of the vertices that the cameras see (section 4.1).

use super::levels::{Directions, LevelChoice};
use super::shade::SPHERES;
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
const FOLLOW_S: f32 = 0.08;
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

/// Whether a mesh has edges at which it ends; vertices in one place are one.
fn is_open(mesh: &Mesh) -> bool {
    let mut places: HashMap<[u32; 3], u32> = HashMap::new();
    let place: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            // Minus zero is zero.
            let next = places.len() as u32;
            *places.entry((*p + Vec3::ZERO).to_array().map(f32::to_bits)).or_insert(next)
        })
        .collect();
    let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
    for t in &mesh.triangles {
        let t = t.map(|i| place[i as usize]);
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            *balance.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
        }
    }
    let ends = balance.values().filter(|&&sum| sum != 0).count();
    // A seam or two that a modeller forgot do not make a body a cloth.
    ends * 50 > balance.len()
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
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Asked {
    /// Directions.
    pub directions: usize,
    /// Vertices for which anything was asked.
    pub vertices: usize,
    /// Milliseconds for posing, filtering, asking and summing.
    pub ms: f32,
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
    /// Whether any of it was computed.
    lit: bool,
}

impl Figure {
    /// A figure that was not posed yet.
    #[must_use]
    pub fn new(model: Arc<Model>) -> Self {
        let count = model.vertex_count();
        let filter = VertexFilter::new(count, &model.triangles, THRESHOLD);
        Self {
            model,
            backend: VisibilityCpu::default(),
            filter,
            choice: LevelChoice::default(),
            spheres: HashMap::new(),
            pose: Pose::default(),
            posed_at: None,
            positions: vec![Vec3::ZERO; count],
            normals: vec![Vec3::ZERO; count],
            place: Affine3A::IDENTITY,
            sky: vec![Vec3::ZERO; count],
            known: vec![false; count],
            sun_bits: vec![false; count],
            sun_asked: None,
            light: vec![Vec3::ZERO; count],
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

    /// Irradiance / pi of each vertex; what no camera saw has the light that it was last seen with.
    #[must_use]
    pub fn light(&self) -> &[Vec3] {
        &self.light
    }

    /// Goes to a moment of a clip, and to a place; answers whether the mesh itself has changed.
    ///
    /// # Errors
    /// A mesh that cannot be asked.
    pub fn go(&mut self, clip: Option<usize>, time_s: f32, place: Affine3A) -> Result<bool, VisibilityCpuError> {
        self.place = place;
        if self.posed_at == Some((clip, time_s)) {
            return Ok(false);
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
            return Ok(false);
        }
        for (i, corner) in self.model.sources.iter().enumerate() {
            let normal = normals[corner.vertex as usize];
            self.positions[i] = positions[corner.vertex as usize];
            self.normals[i] = if corner.back { -normal } else { normal };
        }
        if first {
            self.backend.set_mesh(&self.positions, &self.normals, &self.model.triangles[..self.model.fronts])?;
        } else {
            self.backend.move_vertices(&self.positions, &self.normals)?;
        }
        self.filter.reset();
        self.sun_asked = None;
        Ok(true)
    }

    /// Asks what the eyes need (in the world's space) and lights it; `dt_s` seconds have passed since it was lit last, none for a picture on its own.
    ///
    /// # Errors
    /// Not posed yet.
    pub fn illuminate(
        &mut self,
        eyes: &[EyeView],
        directions: Directions,
        deforming: bool,
        around: &Surroundings<'_>,
        dt_s: Option<f32>,
    ) -> Result<Asked, VisibilityCpuError> {
        let place = glam::Mat4::from(self.place);
        let mut new = 0;
        for eye in eyes {
            new += self.filter.look(&self.positions, &EyeView { clip_from_mesh: eye.clip_from_mesh * place, ..*eye });
        }
        let wanted = self.filter.wanted();
        let count = wanted.iter().filter(|&&wanted| wanted).count();
        let before = self.choice.clone();
        let level = self.choice.next(directions, count, deforming);
        if !deforming && new == 0 && count == 0 {
            self.choice = before;
        }
        let sphere = self.spheres.entry(level).or_insert_with(|| LightSphere::new(level));
        let start = Instant::now();
        self.backend.compute_for(wanted, sphere.directions())?;
        if deforming {
            self.choice.took(start.elapsed().as_secs_f32() * 1e3, count, sphere.directions().len());
        }
        let turn = rotation(self.place);
        let radiance: Vec<Vec3> = sphere.directions().iter().map(|&l| (around.radiance)(turn * l)).collect();
        let sky = self.backend.light(sphere.weights(), &radiance)?.light;
        let follow = dt_s.map_or(1.0, |dt| 1.0 - libm::expf(-dt / FOLLOW_S));
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
        for (i, light) in self.light.iter_mut().enumerate().filter(|(i, _)| wanted[*i]) {
            *light = self.sky[i];
            if let Some((direction, irradiance)) = sun
                && self.sun_bits[i]
            {
                let cosine = self.normals[i].dot(direction).max(0.0);
                let reaches = (around.sun_reaches)(place.transform_point3(self.positions[i]));
                *light += irradiance * (cosine * reaches * FRAC_1_PI);
            }
        }
        Ok(Asked { directions: sphere.directions().len(), vertices: if deforming { count } else { new }, ms: 0.0 })
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
