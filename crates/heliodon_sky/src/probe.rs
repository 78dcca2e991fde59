//! A photographed or rendered sky.

use crate::error::SkyError;
use crate::mapping::{BelowHorizon, Geometry, Mapping, ProbeGrid};
use crate::project::sum_rows;
use glam::{DVec3, Vec3};
use heliodon_image::HdrImage;
use rayon::prelude::*;
use std::sync::Arc;

/// An HDR image of the sky with its geometry.
#[derive(Clone, Debug)]
pub struct Probe {
    image: HdrImage,
    grid: Arc<ProbeGrid>,
}

impl Probe {
    /// A probe of its own. `turn_rad` is the compass bearing of what the mapping calls north.
    ///
    /// # Errors
    /// Where the image's shape does not go with the mapping.
    pub fn new(image: HdrImage, mapping: Mapping, turn_rad: f64) -> Result<Self, SkyError> {
        let grid = Arc::new(ProbeGrid::new(mapping, image.width, image.height, turn_rad)?);
        Ok(Self { image, grid })
    }

    /// A probe of a series, whose grid was made before.
    ///
    /// # Errors
    /// Where the image is not of the grid's size.
    pub fn with_grid(image: HdrImage, grid: Arc<ProbeGrid>) -> Result<Self, SkyError> {
        let geometry = grid.geometry();
        if (image.width, image.height) != (geometry.width(), geometry.height()) {
            return Err(SkyError::Probe {
                name: "probe".into(),
                problem: format!("{} x {} pixels, not {} x {}", image.width, image.height, geometry.width(), geometry.height()),
                remedy: "make a grid of the image's size",
            });
        }
        Ok(Self { image, grid })
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &HdrImage {
        &self.image
    }

    /// The image, taken out.
    #[must_use]
    pub fn into_image(self) -> HdrImage {
        self.image
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> &Arc<ProbeGrid> {
        &self.grid
    }

    /// The geometry.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        self.grid.geometry()
    }

    /// The same probe with some pixels replaced.
    #[must_use]
    pub fn with_pixels(&self, replaced: &[(u32, Vec3)]) -> Self {
        let mut copy = self.clone();
        for &(index, color) in replaced {
            if let Some(pixel) = copy.image.pixels.get_mut(index as usize) {
                *pixel = color;
            }
        }
        copy
    }

    /// Radiance from a unit direction, interpolated between the nearest pixels that count; black where the probe shows nothing.
    #[must_use]
    pub fn radiance(&self, direction: DVec3) -> Vec3 {
        self.radiance_of(direction, |_| true)
    }

    /// As [`Probe::radiance`], from pixels above the horizon only, so that nothing of the ground bleeds into a mirrored or cut sky.
    fn radiance_above(&self, direction: DVec3) -> Vec3 {
        self.radiance_of(direction, |index| self.grid.directions()[index].y >= 0.0)
    }

    fn radiance_of(&self, direction: DVec3, counts: impl Fn(usize) -> bool) -> Vec3 {
        let Some((x, y)) = self.geometry().position(direction) else { return Vec3::ZERO };
        let own = ((x as u32).min(self.image.width.saturating_sub(1)), (y as u32).min(self.image.height.saturating_sub(1)));
        let (x, y) = (x - 0.5, y - 0.5);
        let (x_low, y_low) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x_low) as f32, (y - y_low) as f32);
        let (width, height) = (i64::from(self.image.width), i64::from(self.image.height));
        let wraps = self.geometry().mapping() == Mapping::LatLong;
        let mut sum = Vec3::ZERO;
        let mut weights = 0.0;
        for (dx, dy, weight) in
            [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)]
        {
            let column = x_low as i64 + dx;
            let column = if wraps { column.rem_euclid(width) } else { column.clamp(0, width - 1) };
            let row = (y_low as i64 + dy).clamp(0, height - 1);
            let index = (row * width + column) as usize;
            let parted = self.geometry().are_parted(own, (column as u32, row as u32));
            if self.grid.solid_angles()[index] > 0.0 && !parted && counts(index) {
                sum += self.image.pixels[index] * weight;
                weights += weight;
            }
        }
        if weights > 1e-6 { sum / weights } else { Vec3::ZERO }
    }

    /// Sky coefficients (4 or 9) by solid-angle-weighted sums in f64.
    #[must_use]
    pub fn coefficients(&self, count: usize, below: BelowHorizon) -> Vec<Vec3> {
        if self.geometry().mapping() == Mapping::LatLong {
            return self.lat_long_coefficients(count, below);
        }
        let geometry = self.geometry();
        let width = geometry.width();
        let mut sums = sum_rows(geometry.height(), count, |y, add| {
            for x in 0..width {
                let index = (y * width + x) as usize;
                let solid_angle = f64::from(self.grid.solid_angles()[index]);
                if solid_angle == 0.0 || self.grid.is_rim(index) {
                    continue;
                }
                let flux = self.image.pixels[index].as_dvec3() * solid_angle;
                for (direction, share) in geometry.pixel_nodes(x, y) {
                    if below == BelowHorizon::Keep {
                        add(direction, flux * share);
                    } else if direction.y >= 0.0 {
                        add(direction, flux * share);
                        if below == BelowHorizon::Mirror {
                            add(DVec3::new(direction.x, -direction.y, direction.z), flux * share);
                        }
                    }
                }
            }
        });
        let mut rim = [DVec3::ZERO; 9];
        for pixel in self.grid.rim() {
            let color = self.image.pixels[pixel.owner as usize].as_dvec3();
            for (i, sum) in rim.iter_mut().enumerate() {
                *sum += color
                    * match below {
                        BelowHorizon::Keep => pixel.all[i],
                        BelowHorizon::Black => pixel.above[i],
                        // y_{1,-1}, y_{2,-2} and y_{2,-1} change their sign with the height's
                        BelowHorizon::Mirror if matches!(i, 1 | 4 | 5) => 0.0,
                        BelowHorizon::Mirror => 2.0 * pixel.above[i],
                    };
            }
        }
        sums.iter_mut().zip(rim).for_each(|(sum, more)| *sum = (sum.as_dvec3() + more).as_vec3());
        sums
    }

    /// The same sums over the same nodes, where rows and columns share their sines and cosines.
    fn lat_long_coefficients(&self, count: usize, below: BelowHorizon) -> Vec<Vec3> {
        let geometry = self.geometry();
        let columns = geometry.column_nodes();
        let width = columns.len();
        sum_rows(geometry.height(), count, |y, add| {
            let rows = geometry.row_nodes(y);
            let pixels = &self.image.pixels[y as usize * width..][..width];
            let solid_angle = f64::from(self.grid.solid_angles()[y as usize * width]);
            for (color, column) in pixels.iter().zip(&columns) {
                let flux = color.as_dvec3() * (0.5 * solid_angle);
                for (sine, cosine, share) in rows {
                    if below != BelowHorizon::Keep && cosine < 0.0 {
                        continue;
                    }
                    for (east, north) in column {
                        let direction = DVec3::new(sine * east, cosine, -sine * north);
                        add(direction, flux * share);
                        if below == BelowHorizon::Mirror {
                            add(DVec3::new(direction.x, -direction.y, direction.z), flux * share);
                        }
                    }
                }
            }
        })
    }

    /// The probe as a lat-long map, each pixel the mean of many looks at the probe, spaced no wider than the probe's own pixels. `lower` is looked at instead
    /// below the horizon where `below` mirrors.
    #[must_use]
    pub fn to_lat_long(&self, width: u32, height: u32, below: BelowHorizon, lower: &Self) -> HdrImage {
        let same = self.geometry().mapping() == Mapping::LatLong
            && Geometry::new(Mapping::LatLong, self.image.width, self.image.height, 0.0).is_ok_and(|g| g == *self.geometry());
        if same && below == BelowHorizon::Keep && width <= self.image.width && height <= self.image.height {
            return self.image.resized_lat_long(width, height);
        }
        let Ok(map) = Geometry::new(Mapping::LatLong, width, height, 0.0) else { return HdrImage::filled(0, 0, Vec3::ZERO) };
        let pixels = (0..height)
            .into_par_iter()
            .flat_map_iter(|y| (0..width).map(move |x| (x, y)))
            .map(|(x, y)| self.map_pixel(&map, x, y, below, lower))
            .collect();
        HdrImage { width, height, pixels }
    }

    fn map_pixel(&self, map: &Geometry, x: u32, y: u32, below: BelowHorizon, lower: &Self) -> Vec3 {
        let corner = (f64::from(x), f64::from(y));
        let looks = self.looks_across(map, corner);
        let mut sum = Vec3::ZERO;
        let mut weights = 0.0;
        for j in 0..looks {
            for i in 0..looks {
                let at = |k: u32| (f64::from(k) + 0.5) / f64::from(looks);
                let (px, py) = (corner.0 + at(i), corner.1 + at(j));
                let Some(d) = map.direction(px, py) else { continue };
                // the rows' solid angle falls towards the poles
                let weight = libm::hypot(d.x, d.z) as f32;
                weights += weight;
                sum += weight
                    * match below {
                        BelowHorizon::Black if d.y < 0.0 => Vec3::ZERO,
                        BelowHorizon::Mirror if d.y < 0.0 => lower.radiance_above(DVec3::new(d.x, -d.y, d.z)),
                        BelowHorizon::Keep => self.radiance(d),
                        _ => self.radiance_above(d),
                    };
            }
        }
        if weights > 0.0 { sum / weights } else { Vec3::ZERO }
    }

    /// How many looks across a pixel of the map leave no pixel of the probe out.
    fn looks_across(&self, map: &Geometry, corner: (f64, f64)) -> u32 {
        let at = |dx: f64, dy: f64| {
            map.direction(corner.0 + dx, corner.1 + dy)
                .and_then(|d| self.geometry().position(d))
                .unwrap_or((f64::NAN, f64::NAN))
        };
        let (a, b, c, d) = (at(0.0, 0.5), at(1.0, 0.5), at(0.5, 0.0), at(0.5, 1.0));
        let span = |p: (f64, f64), q: (f64, f64)| libm::hypot(p.0 - q.0, p.1 - q.1);
        let widest = span(a, b).max(span(c, d));
        // across a seam the span is the whole image: 8 looks are enough there, too
        if widest.is_finite() { ((widest * 1.5).ceil() as u32).clamp(2, 8) } else { 4 }
    }
}
