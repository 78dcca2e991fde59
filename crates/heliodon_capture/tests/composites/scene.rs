//! Films whose alpha is known: a figure before a screen, composed from both.

use heliodon_math::color::{linear_from_srgb, srgb_from_linear};

/// How a film is made.
#[derive(Clone, Copy)]
pub struct Scene {
    pub width: usize,
    pub height: usize,
    /// sRGB codes.
    pub screen: [f32; 3],
    /// Whether light is added up, or codes.
    pub linear: bool,
    /// How much darker the screen's lower corner is.
    pub uneven: f32,
    /// Standard deviation of noise, in codes.
    pub noise: f32,
    /// How much of the screen's light lies on the figure.
    pub spill: f32,
}

impl Scene {
    pub fn studio(screen: [f32; 3]) -> Self {
        Self { width: 240, height: 320, screen, linear: true, uneven: 0.35, noise: 2.0, spill: 0.06 }
    }
}

pub const GREEN: [f32; 3] = [46.0, 176.0, 72.0];
pub const BLUE: [f32; 3] = [36.0, 64.0, 190.0];

/// A frame and its alpha.
pub struct Frame {
    pub pixels: Vec<[u8; 4]>,
    pub alpha: Vec<f32>,
}

/// Noise of a place, about Gaussian, of unit variance; the same each time.
fn gauss(k: u32) -> f32 {
    let hash = |k: u32| {
        let k = (k ^ (k >> 16)).wrapping_mul(0x7feb_352d);
        let k = (k ^ (k >> 15)).wrapping_mul(0x846c_a68b);
        f32::from(((k ^ (k >> 16)) & 0xffff) as u16) / 65_535.0
    };
    ((0..6).map(|i| hash(k.wrapping_mul(6).wrapping_add(i))).sum::<f32>() - 3.0) * std::f32::consts::SQRT_2
}

/// How much of a pixel is covered at a signed distance (positive inside), the edge being `soft` pixels wide.
fn cover(inside: f32, soft: f32) -> f32 {
    let t = (inside / soft + 0.5).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Distance to a line between two points, and where along it the nearest point lies.
fn to_line(p: [f32; 2], a: [f32; 2], b: [f32; 2]) -> (f32, f32) {
    let (d, q) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let t = ((d[0] * q[0] + d[1] * q[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
    (((q[0] - t * d[0]).powi(2) + (q[1] - t * d[1]).powi(2)).sqrt(), t)
}

/// The figure at a pixel: its sRGB codes and alpha. Head with hair, a garment in three colours (yellow, grey, dark), an arm that moves and is blurred.
fn figure(scene: &Scene, x: f32, y: f32, time: f32) -> ([f32; 3], f32) {
    // in a picture of 240 x 320
    let unit = scene.height as f32 / 320.0;
    let p = [x / unit - 10.0 * time, y / unit];
    let soft = 1.6;
    let (mut color, mut alpha) = ([0.0; 3], 0.0);
    let mut paint = |over: [f32; 3], a: f32| {
        let sum: f32 = a + alpha * (1.0 - a);
        if sum > 0.0 {
            (0..3).for_each(|c| color[c] = (over[c] * a + color[c] * alpha * (1.0 - a)) / sum);
        }
        alpha = sum;
    };
    // strands of hair, one to two pixels wide, behind the head
    for strand in 0..44 {
        let angle = -2.9 + 2.7 * strand as f32 / 43.0 + 0.05 * gauss(strand);
        let length = 44.0 + 12.0 * gauss(strand + 100);
        let end = [120.0 + length * angle.cos(), 74.0 + length * angle.sin() + 6.0];
        let (distance, along) = to_line(p, [120.0, 74.0], end);
        paint([52.0, 34.0, 24.0], 0.9 * cover(0.8 * (1.1 - along) - distance, 1.4));
    }
    // shade runs over everything, as on whatever is round
    let shade = 1.0 - 0.3 * ((p[0] - 120.0) / 60.0).clamp(-1.0, 1.0);
    let lit = |c: [f32; 3]| c.map(|x| (x * shade).min(250.0));
    let torso = 42.0 - ((p[0] - 120.0).abs()).max((p[1] - 190.0).abs() - 50.0);
    let garment = match p[1] {
        y if y < 165.0 => [206.0, 178.0, 40.0],
        y if y < 200.0 => [128.0, 128.0, 128.0],
        _ => [22.0, 22.0, 26.0],
    };
    let leg = |at: f32| 15.0 - ((p[0] - at).abs()).max(p[1] - 300.0);
    let trousers = if scene.screen[2] > scene.screen[1] { [110.0, 90.0, 60.0] } else { [60.0, 70.0, 110.0] };
    paint(lit(trousers), cover(leg(98.0).max(leg(142.0)).min(p[1] - 225.0), soft));
    paint(lit(garment), cover(torso, soft));
    // an arm that sweeps: the mean of its places
    let arm = (0..16).map(|k| {
        let angle = 0.5 + 0.25 * k as f32 / 15.0 - 0.3 * time;
        let (distance, _) = to_line(p, [160.0, 150.0], [160.0 + 60.0 * angle.cos(), 150.0 - 60.0 * angle.sin()]);
        cover(8.0 - distance, soft)
    });
    paint(lit([205.0, 150.0, 125.0]), arm.sum::<f32>() / 16.0);
    let head = 27.0 - ((p[0] - 120.0).powi(2) + ((p[1] - 84.0) * 0.8).powi(2)).sqrt();
    paint(lit([210.0, 160.0, 135.0]), cover(head, soft));
    let cap = 29.0 - ((p[0] - 120.0).powi(2) + ((p[1] - 76.0) * 0.9).powi(2)).sqrt();
    paint([56.0, 38.0, 28.0], cover(cap.min(76.0 - p[1]), soft));
    (color, alpha)
}

/// A frame at a time in [0, 1].
pub fn frame(scene: &Scene, time: f32) -> Frame {
    let to = |code: f32| if scene.linear { linear_from_srgb(code / 255.0) } else { code / 255.0 };
    let from = |x: f32| 255.0 * if scene.linear { srgb_from_linear(x) } else { x };
    let (mut pixels, mut alphas) = (Vec::new(), Vec::new());
    for y in 0..scene.height {
        for x in 0..scene.width {
            let (own, alpha) = figure(scene, x as f32 + 0.5, y as f32 + 0.5, time);
            let (u, v) = (x as f32 / scene.width as f32, y as f32 / scene.height as f32);
            let light = 1.0 - scene.uneven * (0.5 * u + 0.5 * v) * (1.0 - 0.3 * (6.0 * u).sin().powi(2));
            let mut pixel = [0, 0, 0, 255];
            for c in 0..3 {
                let screen = to(scene.screen[c] * light);
                let covered = to(own[c]) + scene.spill * screen;
                let code = from(alpha * covered + (1.0 - alpha) * screen);
                let noise = scene.noise * gauss(((y * scene.width + x) * 3 + c) as u32 ^ ((time * 1000.0) as u32) << 20);
                pixel[c] = (code + noise).round().clamp(0.0, 255.0) as u8;
            }
            pixels.push(pixel);
            alphas.push(alpha);
        }
    }
    Frame { pixels, alpha: alphas }
}
