//! A court of columns in a day that is worked out by hand: a bundle for examples and tests that needs no bake.
//!
//! Shadows come from circles and heights, sky transfer from the open hemisphere, so it is quick to make and still has every
//! kind of light that a baked bundle has.

use glam::{Vec2, Vec3};
use heliodon_bundle::site::Site;
use heliodon_bundle::{BundleMeta, BundleWriter, LightLayout, LitChunk, VertexLight};
use heliodon_image::HdrImage;
use heliodon_math::sh::{basis9, open_transfer9};
use heliodon_math::sphere::{direction_from_azimuth_elevation, fibonacci_sphere};
use heliodon_sky::lapse::{Lapse, LapseStep, Sun, SunBounceBasis};
use std::f32::consts::{FRAC_1_PI, PI, TAU};
use std::path::Path;

/// What to build.
#[derive(Clone, Copy, Debug)]
pub struct Court {
    /// Rows and columns of shafts.
    pub shafts: (u32, u32),
    /// Quads around and along a shaft.
    pub quads: u32,
    /// Quads along each side of the ground; 0 for none.
    pub ground_quads: u32,
    /// Sun steps.
    pub sun_steps: u32,
    /// Coefficients, 4 or 9, and channels, 1 or 3.
    pub transfer: (u32, u32),
    /// Functions of the bounced sunlight.
    pub bounce_functions: u32,
    /// Columns of a sky map.
    pub sky_columns: u32,
    /// Whether the shafts carry a texture.
    pub textured: bool,
}

const SHAFT_HEIGHT: f32 = 10.0;
const SHAFT_RADIUS: f32 = 1.0;
const SPACING: f32 = 4.0;

impl Court {
    /// The scene of Bevy's peer: 36 shafts of 20,000 triangles, 92 sun steps, no ground.
    pub fn peer() -> Self {
        Self {
            shafts: (4, 9),
            quads: 100,
            ground_quads: 0,
            sun_steps: 92,
            transfer: (4, 1),
            bounce_functions: 4,
            sky_columns: 512,
            textured: false,
        }
    }

    /// A small court to look at.
    pub fn small() -> Self {
        Self { shafts: (3, 5), quads: 40, ground_quads: 90, sun_steps: 24, sky_columns: 256, ..Self::peer() }
    }

    fn layout(&self) -> LightLayout {
        LightLayout {
            sun_steps: self.sun_steps,
            coefficients: self.transfer.0,
            channels: self.transfer.1,
            sun_bounce_functions: self.bounce_functions,
        }
    }

    fn centers(&self) -> Vec<Vec2> {
        let (rows, columns) = self.shafts;
        let at = |row: u32, column: u32| {
            let middle = (columns - 1) as f32 * 0.5;
            Vec2::new((column as f32 - middle) * SPACING, -(row as f32) * SPACING)
        };
        (0..rows).flat_map(|row| (0..columns).map(move |column| at(row, column))).collect()
    }

    fn sun_at(&self, step: f32) -> Vec3 {
        let day = step / (self.sun_steps.max(2) - 1) as f32;
        let azimuth = f64::from(90.0 + 180.0 * day).to_radians();
        let elevation = f64::from(1.0 + 60.0 * (PI * day).sin()).to_radians();
        direction_from_azimuth_elevation(azimuth, elevation)
    }

    /// Whether a shaft stands between `point` and the sun.
    fn shaded(&self, point: Vec3, sun: Vec3) -> bool {
        let horizontal = Vec2::new(sun.x, sun.z);
        let length = horizontal.length();
        let Some(direction) = horizontal.try_normalize() else { return false };
        self.centers().into_iter().any(|center| {
            let to_center = center - Vec2::new(point.x, point.z);
            let along = to_center.dot(direction);
            let off2 = to_center.length_squared() - along * along;
            let half2 = SHAFT_RADIUS * SHAFT_RADIUS - off2;
            // Behind, beside, or the point's own shaft.
            half2 > 0.0 && along > SHAFT_RADIUS * 1.001 && {
                let enter = along - half2.sqrt();
                point.y + enter * sun.y / length < SHAFT_HEIGHT
            }
        })
    }

    fn light(&self, positions: &[Vec3], normals: &[Vec3]) -> VertexLight {
        let layout = self.layout();
        let mut light = VertexLight::zeros(layout, positions.len());
        let words = layout.mask_words();
        let suns: Vec<Vec3> = (0..self.sun_steps).map(|t| self.sun_at(t as f32)).collect();
        for (v, (&p, &n)) in positions.iter().zip(normals).enumerate() {
            for (t, &sun) in suns.iter().enumerate() {
                if n.dot(sun) > 0.0 && !self.shaded(p, sun) {
                    light.sun_mask[v * words + t / 32] |= 1 << (t % 32);
                }
            }
            let open = open_transfer9(n);
            let channels = self.transfer.1 as usize;
            for (i, open) in open.into_iter().enumerate().take(self.transfer.0 as usize) {
                for c in 0..channels {
                    light.sky_transfer[v * layout.transfer_floats() + i * channels + c] = open * (1.0 - 0.1 * c as f32);
                }
            }
            for r in 0..self.bounce_functions as usize {
                for c in 0..channels {
                    let low = 0.06 * (1.0 - p.y / SHAFT_HEIGHT).max(0.0) / (1 + r) as f32;
                    light.sun_bounce[v * layout.bounce_floats() + r * channels + c] = low * (1.0 - 0.2 * c as f32);
                }
            }
        }
        light
    }

    fn chunk(&self, positions: Vec<Vec3>, normals: Vec<Vec3>, uvs: Vec<Vec2>, triangles: Vec<[u32; 3]>, part: u16) -> LitChunk {
        let tint = |p: &Vec3| {
            let vein = 0.5 + 0.5 * (p.x * 3.1 + (p.y * 2.3).sin() + p.z * 1.7).sin();
            Vec3::new(0.62, 0.56, 0.46).lerp(Vec3::new(0.45, 0.38, 0.3), vein * vein)
        };
        LitChunk {
            part,
            texture: (!uvs.is_empty()).then_some(0),
            detail: None,
            light: self.light(&positions, &normals),
            albedo: positions.iter().map(tint).collect(),
            valid: vec![1; positions.len()],
            positions,
            normals,
            uvs,
            texel_uvs: Vec::new(),
            triangles,
        }
    }

    fn shaft(&self, center: Vec2) -> LitChunk {
        let n = self.quads;
        let (mut positions, mut normals, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
        for j in 0..=n {
            for i in 0..=n {
                let (sin, cos) = (i as f32 / n as f32 * TAU).sin_cos();
                let normal = Vec3::new(cos, 0.0, sin);
                let up = j as f32 / n as f32;
                positions.push(Vec3::new(center.x, up * SHAFT_HEIGHT, center.y) + normal * SHAFT_RADIUS);
                normals.push(normal);
                if self.textured {
                    uvs.push(Vec2::new(i as f32 / n as f32 * 4.0, up * 8.0));
                }
            }
        }
        self.chunk(positions, normals, uvs, grid(n), 0)
    }

    /// The ground in chunks of at most 20,000 triangles.
    fn ground(&self) -> Vec<LitChunk> {
        const SIDE: u32 = 90;
        let (tiles, n) = (self.ground_quads.div_ceil(SIDE), SIDE.min(self.ground_quads));
        let extent = 60.0;
        let quad = extent / (tiles * n).max(1) as f32;
        let mut chunks = Vec::new();
        for tile in 0..tiles * tiles {
            let (tx, tz) = ((tile % tiles * n) as f32, (tile / tiles * n) as f32);
            let mut positions = Vec::new();
            for j in 0..=n {
                for i in 0..=n {
                    let (x, z) = ((tx + i as f32) * quad, (tz + j as f32) * quad);
                    positions.push(Vec3::new(x - extent * 0.5, 0.0, z - extent * 0.5 - 4.0));
                }
            }
            let normals = vec![Vec3::Y; positions.len()];
            chunks.push(self.chunk(positions, normals, Vec::new(), grid(n), 1));
        }
        chunks
    }

    fn sky_map(&self, sun: Vec3) -> HdrImage {
        let (width, height) = (self.sky_columns, self.sky_columns / 2);
        let mut pixels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let (azimuth, elevation) = (
                    ((x as f64 + 0.5) / f64::from(width) * 2.0 - 1.0) * std::f64::consts::PI,
                    (0.5 - (y as f64 + 0.5) / f64::from(height)) * std::f64::consts::PI,
                );
                pixels.push(sky_radiance(direction_from_azimuth_elevation(azimuth, elevation), sun));
            }
        }
        HdrImage { width, height, pixels }
    }

    fn lapse(&self) -> Lapse {
        let directions = fibonacci_sphere(2000);
        let solid_angle = 4.0 * PI / directions.len() as f32;
        let steps = (0..2 * self.sun_steps).map(|entry| {
            let step = entry / 2;
            let sun = self.sun_at(step as f32);
            let mut sky = vec![Vec3::ZERO; self.transfer.0 as usize];
            for &d in &directions {
                let radiance = sky_radiance(d, self.sun_at(entry as f32 * 0.5));
                for (slot, y) in sky.iter_mut().zip(basis9(d)) {
                    *slot += radiance * y * solid_angle;
                }
            }
            let minutes = 6.0 * 60.0 + 12.0 * 60.0 * f64::from(entry) / f64::from(2 * self.sun_steps);
            let seconds = (minutes * 60.0).round() as u32;
            LapseStep {
                time: format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60),
                sun: Some(Sun { direction: sun.to_array(), irradiance: sun_irradiance(sun).to_array(), clipped: false }),
                sky: sky.into_iter().map(|s| s.to_array()).collect(),
                exposure_stops: 0.6 - 1.2 * sun.y,
                sky_map: format!("sky/{entry:04}.hdr"),
                mask_bit: step,
                ..step_defaults()
            }
        });
        Lapse {
            steps: steps.collect(),
            sun_bounce_basis: (self.bounce_functions > 0).then(|| SunBounceBasis {
                channels: self.transfer.1,
                functions: (0..self.bounce_functions)
                    .map(|r| (0..self.sun_steps).map(|t| (0.3 * t as f32 + r as f32).cos().abs()).collect())
                    .collect(),
            }),
        }
    }

    /// Writes the bundle.
    pub fn write(&self, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let site = Site::parse(SITE_TOML, "court/site.toml")?;
        let mut writer = BundleWriter::create(folder, BundleMeta::from_site(site.file(), self.layout(), 1e-4))?;
        let lapse = self.lapse();
        if self.textured {
            writer.add_texture("checks", &checks()?)?;
        }
        for center in self.centers() {
            writer.push_chunk(&self.shaft(center))?;
        }
        for chunk in self.ground() {
            writer.push_chunk(&chunk)?;
        }
        for (entry, step) in lapse.steps.iter().enumerate() {
            let map = self.sky_map(self.sun_at(entry as f32 * 0.5));
            writer.add_sky_map(&step.sky_map, &map.to_hdr_bytes())?;
        }
        writer.finish(&lapse)?;
        Ok(())
    }
}

const SITE_TOML: &str = r#"
[site]
name = "A court of columns"
[[part]]
file = "shafts.obj"
role = "scan"
[[part]]
file = "ground.obj"
role = "ground"
[sky]
probes = "sky/*.hdr"
mapping = "lat-long"
[[room]]
name = "stand"
min = [-6.0, 1.0, 20.0]
max = [6.0, 7.0, 40.0]
looks_at = [0.0, 4.0, 0.0]
"#;

fn sun_irradiance(sun: Vec3) -> Vec3 {
    let haze = (-0.12 / sun.y.max(0.02)).exp();
    Vec3::new(1.0, haze.powf(0.7), haze.powf(1.6)) * haze * 2.6
}

/// A blue sky, paler at the horizon, brighter around the sun, dark earth below.
fn sky_radiance(d: Vec3, sun: Vec3) -> Vec3 {
    let day = 0.25 + 0.75 * sun.y.max(0.0);
    if d.y < 0.0 {
        return Vec3::new(0.12, 0.1, 0.08) * day;
    }
    let blue = Vec3::new(0.9, 0.85, 0.75).lerp(Vec3::new(0.16, 0.32, 0.75), d.y.sqrt()) * day * 0.55;
    let near_sun = d.dot(sun).max(0.0);
    blue + Vec3::new(1.0, 0.75, 0.45) * (0.5 * near_sun.powi(64) + 0.15 * near_sun.powi(8)) * FRAC_1_PI * 2.0
}

/// Two triangles a quad of a grid of `n` by `n`, seen from outside of a shaft or from above the ground.
fn grid(n: u32) -> Vec<[u32; 3]> {
    let quad = |i: u32, j: u32| {
        let a = j * (n + 1) + i;
        [[a, a + n + 1, a + 1], [a + 1, a + n + 1, a + n + 2]]
    };
    (0..n).flat_map(|j| (0..n).flat_map(move |i| quad(i, j))).collect()
}

fn checks() -> Result<Vec<u8>, Box<dyn std::error::Error>> {
    let pixels = (0..64u32 * 64).map(|i| if (i / 8 + i / 512) % 2 == 0 { [230, 220, 200, 255] } else { [140, 120, 100, 255] });
    let image = heliodon_image::SrgbImage { width: 64, height: 64, pixels: pixels.collect() };
    Ok(image.to_png_bytes()?)
}

/// A step with nothing in it.
pub fn step_defaults() -> LapseStep {
    LapseStep {
        time: String::new(),
        sun: None,
        sky: Vec::new(),
        fitted: None,
        exposure_stops: 0.0,
        sky_map: String::new(),
        mask_bit: 0,
        sun_in_map: false,
    }
}
