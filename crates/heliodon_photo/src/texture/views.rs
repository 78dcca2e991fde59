//! Colours that depend on the view: for each face those photographs that show it best and from the most different directions, each with where it was taken
//! from ([`heliodon_image::view_layers`]).
//!
//! What stands out from a model of few polygons, or shines, looks right from near a photograph's place in that photograph alone; an atlas blended of all looks
//! right from nowhere (P. Debevec, C. Taylor, J. Malik, "Modeling and Rendering Architecture from Photographs", SIGGRAPH 1996, section 3). A layer is of one
//! photograph over a whole face, for filtering to find no border inside of one.

use super::Survey;
use super::eye::{Shown, shown};
use super::fill::filled;
use super::layers::{Sample, within};
use glam::Vec3;
use heliodon_image::SrgbImage;
use heliodon_image::view_layers::{HALF_RAD, MOST_LAYERS, ViewLayer, ViewLayers, direction_code};
use heliodon_math::color::srgb8_from_linear;
use heliodon_math::frame::unit_or;
use rayon::prelude::*;
use std::ops::Range;

/// Texels of a face that are looked at to choose its photographs, about.
const PROBES: usize = 256;
/// Photographs stand for one another over a wider angle than layers are shown over: four times, thirty degrees.
const STANDS_FOR_RAD: f32 = 4.0 * HALF_RAD;

/// What a photograph shows of a place.
#[derive(Clone, Copy, Default)]
struct Witness {
    /// How much it is to count, 0 to 1, whatever its resolution: from its own place it is right however coarse it is.
    alpha: f32,
    px_per_m: f32,
    /// From the surface to the camera.
    direction: Vec3,
}

impl Survey<'_> {
    /// What up to `most` photographs saw of each face, in the atlas' layout and, after [`Survey::equalize`], as bright as it: fewer layers where no face is
    /// seen by so many. A photograph's word counts here even where others contradict it.
    ///
    /// # Panics
    /// If `most` is not 1 to [`MOST_LAYERS`].
    #[must_use]
    pub fn view_layers(&self, most: usize) -> ViewLayers {
        assert!((1..=MOST_LAYERS).contains(&most), "one layer at least, {MOST_LAYERS} at most");
        let faces = self.surface.faces.len();
        let chosen: Vec<Vec<usize>> = (0..faces).into_par_iter().map(|face| self.chosen(face, most)).collect();
        let layers = chosen.iter().map(Vec::len).max().unwrap_or(0);
        ViewLayers { layers: (0..layers).map(|layer| self.view_layer(&chosen, layer)).collect() }
    }

    fn witness(&self, photograph: usize, sample: &Sample) -> Witness {
        let texel = &self.layout.texels[sample.texel as usize];
        let camera = &self.cameras[photograph];
        let normal = self.surface.triangles[texel.triangle as usize].normal;
        let Some(Shown { px_per_m, .. }) = shown(camera, texel.place, normal) else { return Witness::default() };
        let alpha = (sample.weight / (px_per_m * px_per_m)).min(1.0);
        Witness { alpha, px_per_m, direction: self.direction(photograph, texel.place) }
    }

    fn direction(&self, photograph: usize, place: Vec3) -> Vec3 {
        unit_or((self.cameras[photograph].centre() - place.as_dvec3()).as_vec3(), Vec3::Z)
    }

    /// A face's photographs, the most useful first: whichever stands for most of what all of them show, beside those that were chosen before. Of any such
    /// choice of so many this finds 63 % at least, for a photograph adds less the more there are (G. Nemhauser, L. Wolsey, M. Fisher, "An analysis of
    /// approximations for maximizing submodular set functions", Mathematical Programming 14, 1978).
    fn chosen(&self, face: usize, most: usize) -> Vec<usize> {
        let range = self.layout.starts[face]..self.layout.starts[face + 1];
        let inside: Vec<usize> = range.filter(|&texel| self.layout.texels[texel].inside).collect();
        let probes: Vec<usize> = inside.iter().copied().step_by(inside.len().div_ceil(PROBES).max(1)).collect();
        let witnesses: Vec<Vec<Witness>> = (self.samples.iter().enumerate())
            .map(|(photograph, own)| {
                let at = |&texel: &usize| {
                    let found = own.binary_search_by_key(&(texel as u32), |sample| sample.texel);
                    found.map_or_else(|_| Witness::default(), |found| self.witness(photograph, &own[found]))
                };
                probes.iter().map(at).collect()
            })
            .collect();
        let finest: Vec<f32> = (0..probes.len())
            .map(|probe| witnesses.iter().map(|own| own[probe].px_per_m).fold(f32::MIN_POSITIVE, f32::max))
            .collect();
        // how well each is stood for so far, at each probe
        let mut stood_for = vec![vec![0.0_f32; probes.len()]; witnesses.len()];
        let stands = |p: &Witness, q: &Witness, finest: f32| {
            let off = (p.direction - q.direction).length_squared() / (STANDS_FOR_RAD * STANDS_FOR_RAD);
            p.alpha * (p.px_per_m / finest) * libm::exp2f(-off)
        };
        let mut chosen: Vec<usize> = Vec::new();
        while chosen.len() < most {
            let use_of = |p: usize| -> f32 {
                let of_probe = |probe: usize| -> f32 {
                    let more = |q: usize| {
                        let (own, other) = (&witnesses[p][probe], &witnesses[q][probe]);
                        other.alpha * (stands(own, other, finest[probe]) - stood_for[q][probe]).max(0.0)
                    };
                    (0..witnesses.len()).map(more).sum()
                };
                (0..probes.len()).map(of_probe).sum()
            };
            let left = (0..witnesses.len()).filter(|p| !chosen.contains(p)).map(|p| (p, use_of(p)));
            let best = left.filter(|(_, gain)| *gain > 0.0).max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let Some((best, _)) = best else { break };
            for (q, stood_for) in stood_for.iter_mut().enumerate() {
                for (probe, stood_for) in stood_for.iter_mut().enumerate() {
                    *stood_for = stood_for.max(stands(&witnesses[best][probe], &witnesses[q][probe], finest[probe]));
                }
            }
            chosen.push(best);
        }
        chosen
    }

    fn view_layer(&self, chosen: &[Vec<usize>], layer: usize) -> ViewLayer {
        let [width, height] = self.layout.size;
        let image = |pixels| SrgbImage { width, height, pixels };
        let of_face = |(face, chosen): (usize, &Vec<usize>)| {
            Some((self.layout.starts[face]..self.layout.starts[face + 1], *chosen.get(layer)?))
        };
        let own: Vec<(Range<usize>, usize)> = chosen.iter().enumerate().filter_map(of_face).collect();
        let mut alphas = vec![0; width as usize * height as usize];
        let seen = own.iter().flat_map(|(texels, photograph)| {
            within(&self.samples[*photograph], texels.clone()).iter().map(|sample| (*photograph, sample))
        });
        let colors = seen.filter_map(|(photograph, sample)| {
            let alpha = (self.witness(photograph, sample).alpha * 255.0).round_ties_even() as u8;
            alphas[self.layout.cell(sample.texel as usize)] = alpha;
            (alpha > 0).then_some((sample.texel as usize, sample.color))
        });
        // where it saw nothing the colours about it, so that filtering draws in no other
        let colors = self.all_over(colors);
        let color = |(color, alpha): (Vec3, u8)| {
            let [r, g, b] = color.to_array().map(srgb8_from_linear);
            [r, g, b, alpha]
        };
        let colors = image(colors.into_iter().zip(alphas).map(color).collect());
        let directions = own.iter().flat_map(|(texels, photograph)| {
            texels.clone().map(|texel| (texel, self.direction(*photograph, self.layout.texels[texel].place)))
        });
        let code = |direction: Vec3| direction_code(unit_or(direction, Vec3::Z));
        ViewLayer { colors, directions: image(self.all_over(directions).into_iter().map(code).collect()) }
    }

    /// Each pixel's value, of some texels'.
    fn all_over(&self, known: impl Iterator<Item = (usize, Vec3)>) -> Vec<Vec3> {
        let [columns, rows] = self.layout.size.map(|side| side as usize);
        let mut pixels: Vec<Option<Vec3>> = vec![None; columns * rows];
        known.for_each(|(texel, value)| pixels[self.layout.cell(texel)] = Some(value));
        filled(&mut pixels, columns, rows);
        pixels.into_iter().map(Option::unwrap_or_default).collect()
    }
}
