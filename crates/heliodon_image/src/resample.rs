//! Looking images up between pixels, and scaling them.

use crate::HdrImage;
use glam::Vec3;

/// What lies beyond the left and right edges of an image. Beyond the upper and lower edge the last row goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The last column goes on.
    Clamp,
    /// The other side: for lat-long images.
    Longitude,
}

impl HdrImage {
    /// The colour at (x, y) in pixels, pixel centres at `k + 0.5`, interpolated between the four nearest. Black where the image
    /// is empty or a coordinate is not finite.
    #[must_use]
    pub fn sample_bilinear(&self, x: f32, y: f32, wrap: Wrap) -> Vec3 {
        if self.pixels.is_empty() || !(x.is_finite() && y.is_finite()) {
            return Vec3::ZERO;
        }
        let (x, y) = (x - 0.5, y - 0.5);
        let (x_low, y_low) = (x.floor(), y.floor());
        let column = |k: f32| match wrap {
            Wrap::Clamp => k.clamp(0.0, self.width as f32 - 1.0) as u32,
            Wrap::Longitude => (k as i64).rem_euclid(i64::from(self.width)) as u32,
        };
        let row = |k: f32| k.clamp(0.0, self.height as f32 - 1.0) as u32;
        let (x0, x1, fx) = (column(x_low), column(x_low + 1.0), x - x_low);
        let (y0, y1, fy) = (row(y_low), row(y_low + 1.0), y - y_low);
        let top = self.pixel(x0, y0).lerp(self.pixel(x1, y0), fx);
        let bottom = self.pixel(x0, y1).lerp(self.pixel(x1, y1), fx);
        top.lerp(bottom, fy)
    }

    /// A lat-long image at another size: every new pixel is the mean of what it covers (a box filter; where it grows, pixels are
    /// repeated by coverage), with rows weighted by the solid angle that they stand for, so that its integral over the sphere stays.
    #[must_use]
    pub fn resized_lat_long(&self, width: u32, height: u32) -> Self {
        if (width, height) == (self.width, self.height) {
            return self.clone();
        }
        if self.pixels.is_empty() || width == 0 || height == 0 {
            return Self::filled(width, height, Vec3::ZERO);
        }
        let columns = coverage(self.width, width, |left, right| right - left);
        // the solid angle of a band of colatitudes is proportional to cos(top) - cos(bottom)
        let rows = coverage(self.height, height, |top, bottom| {
            libm::cos(std::f64::consts::PI * top) - libm::cos(std::f64::consts::PI * bottom)
        });
        let source_width = self.width as usize;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        let mut band = vec![Vec3::ZERO; source_width];
        for weights in &rows {
            band.fill(Vec3::ZERO);
            for &(row, weight) in weights {
                let source = &self.pixels[row * source_width..][..source_width];
                band.iter_mut().zip(source).for_each(|(sum, &color)| *sum += color * weight);
            }
            pixels.extend(columns.iter().map(|weights| weights.iter().map(|&(x, weight)| band[x] * weight).sum::<Vec3>()));
        }
        Self { width, height, pixels }
    }

    /// The lat-long image between this one and another, `share` of the way to it; of this one's size.
    #[must_use]
    pub fn mixed_lat_long(mut self, other: &Self, share: f32) -> Self {
        let other = other.resized_lat_long(self.width, self.height);
        self.pixels.iter_mut().zip(other.pixels).for_each(|(pixel, other)| *pixel = pixel.lerp(other, share));
        self
    }
}

/// For each of `to` intervals, which of `from` intervals it covers and with what weight; weights sum to 1.
pub(crate) fn coverage(from: u32, to: u32, measure: impl Fn(f64, f64) -> f64) -> Vec<Vec<(usize, f32)>> {
    (0..to)
        .map(|i| {
            let (start, end) = (f64::from(i) / f64::from(to), f64::from(i + 1) / f64::from(to));
            let first = ((start * f64::from(from)).floor() as u32).min(from - 1);
            let last = ((end * f64::from(from)).ceil() as u32).clamp(first + 1, from);
            let parts: Vec<(usize, f64)> = (first..last)
                .map(|k| {
                    let low = (f64::from(k) / f64::from(from)).max(start);
                    let high = (f64::from(k + 1) / f64::from(from)).min(end);
                    (k as usize, measure(low, high.max(low)).max(0.0))
                })
                .collect();
            let sum: f64 = parts.iter().map(|p| p.1).sum();
            parts.into_iter().filter(|p| p.1 > 0.0).map(|(k, weight)| (k, (weight / sum) as f32)).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lat_long_scaling_keeps_the_integral_over_the_sphere() {
        let image =
            HdrImage::from_fn(64, 32, |x, y| Vec3::new((x % 5) as f32, (y * y) as f32, if y == 0 { 1000.0 } else { 0.0 }));
        let integral = |i: &HdrImage| -> glam::DVec3 {
            let edge = |y: u32| libm::cos(std::f64::consts::PI * f64::from(y) / f64::from(i.height));
            i.pixels
                .iter()
                .enumerate()
                .map(|(k, p)| {
                    let y = k as u32 / i.width;
                    p.as_dvec3() * (edge(y) - edge(y + 1)) / f64::from(i.width)
                })
                .sum()
        };
        for (width, height) in [(32, 16), (24, 9), (81, 50), (1, 1)] {
            let (a, b) = (integral(&image), integral(&image.resized_lat_long(width, height)));
            assert!((a - b).abs().max_element() < 1e-4 * a.max_element(), "{width} x {height}: {a} {b}");
        }
    }

    #[test]
    fn longitude_wraps_and_latitude_ends() {
        let image = HdrImage::from_fn(4, 2, |x, _| Vec3::splat(x as f32));
        assert_eq!(image.sample_bilinear(0.0, 0.0, Wrap::Longitude), Vec3::splat(1.5));
        assert_eq!(image.sample_bilinear(0.0, -5.0, Wrap::Clamp), Vec3::ZERO);
        assert_eq!(image.sample_bilinear(2.0, 1.0, Wrap::Clamp), Vec3::splat(1.5));
        assert_eq!(image.sample_bilinear(f32::NAN, 1.0, Wrap::Clamp), Vec3::ZERO);
    }
}
