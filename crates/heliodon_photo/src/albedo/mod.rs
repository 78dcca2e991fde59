//! Stone's own colour: what photographs show, divided by the light that was there.
//!
//! After P. Debevec, C. Tchou, A. Gardner, T. Hawkins, C. Poullis, J. Stumpfel, A. Jones, N. Yun, P. Einarsson, T. Lundgren, M. Fajardo, P. Martinez,
//! "Estimating surface reflectance properties of a complex scene under captured natural illumination", ICT Technical Report 06.2004: pixels over light, with
//! the light that the surface throws onto itself found by iterating. The light comes from whoever bakes it; here several photographs of several hours are
//! merged, and each counts by how well it is known: little in deep shade, where a small error of the sky's light is a large part, and not at all by the edge of
//! a shadow, which no model puts exactly where it was.

use crate::texture::{Around, PhotoGain, Sample, compared};
use glam::Vec3;
use rayon::prelude::*;

/// How albedo is solved.
#[derive(Clone, Debug, PartialEq)]
pub struct AlbedoParams {
    /// Whether photographs' exposures and white balances are unknown beside the light's unit. They are then made to agree, and the mean is as [`Self::mean`]
    /// says.
    pub exposures_unknown: bool,
    /// The mean albedo of what was seen, for each colour, where somebody measured it; without, and with exposures unknown, photographs are taken to be right
    /// in the mean.
    pub mean: Option<Vec3>,
    /// Places of known albedo, as of a grey card that lay on the steps: they make all of it absolute, and go before [`Self::mean`].
    pub known: Vec<KnownAlbedo>,
    /// Light that changes by more than this part about a texel is a shadow's edge, and its photograph not asked there. Less trusts fewer texels near edges.
    pub most_change: f32,
    /// How well pixels tell a colour, as a part of it.
    pub pixel_error: f32,
    /// How well light is known in the shade, as a part of the photograph's median light.
    pub light_error: f32,
    /// Rounds of bounced light at most; each asks for all of it once more.
    pub rounds: u32,
    /// Rounds end when albedo's median change is below this part.
    pub settled: f32,
}

impl Default for AlbedoParams {
    fn default() -> Self {
        Self {
            exposures_unknown: false,
            mean: None,
            known: Vec::new(),
            most_change: 0.15,
            pixel_error: 0.02,
            light_error: 0.02,
            rounds: 8,
            settled: 0.002,
        }
    }
}

/// A texel that shows something of known albedo in one photograph, whatever others show there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownAlbedo {
    /// The photograph.
    pub photograph: usize,
    /// The texel.
    pub texel: u32,
    /// Its linear albedo.
    pub albedo: Vec3,
}

/// How a photograph agrees with the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// The photograph.
    pub photograph: String,
    /// Median over the texels that others speak of too, of how far it is off the merged albedo, as a factor's logarithm, the worst colour.
    pub median: f32,
    /// The same for 95 of 100 texels.
    pub percentile_95: f32,
    /// How many texels it was asked for, and said something.
    pub texels: usize,
    /// Of how many of them others say something as well.
    pub compared: usize,
    /// And how many of its texels were left out by the edges of shadows.
    pub by_edges: usize,
}

/// Albedo of all texels that are known.
#[derive(Clone, Debug, PartialEq)]
pub struct Albedo {
    /// For each texel its linear albedo in [0, 1].
    pub albedo: Vec<Option<Vec3>>,
    /// How far it may be off, as a part of it: what the photographs' own errors and their disagreement come to.
    pub error: Vec<f32>,
    /// Exposure and white balance of each photograph, where these were unknown.
    pub gains: Vec<PhotoGain>,
    /// How photographs agree: the consistency that was reached.
    pub agreement: Vec<Agreement>,
    /// Rounds that were needed, and the median change in the last one.
    pub rounds: u32,
    /// That change, as a part.
    pub change: f32,
    /// For each of [`AlbedoParams::known`] how far it is off in the end, as a factor; `None` where its photograph does not tell it, as by a shadow's edge.
    pub known_off: Vec<Option<Vec3>>,
    /// Texels whose albedo came out above 1 in some colour, and was held there: light there is too weak, or a photograph too bright.
    pub above_one: usize,
}

/// Why there is no albedo.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AlbedoError {
    /// Nothing to solve from.
    #[error("no photograph says anything of any texel")]
    Nothing,
    /// Arrays that do not belong together.
    #[error("{what} has {found} entries where {expected} belong")]
    Length {
        /// Which.
        what: &'static str,
        /// What it has.
        found: usize,
        /// What it should have.
        expected: usize,
    },
    /// Samples that cannot be used.
    #[error("the samples of photograph {photograph} are not in the order of texels, or name one that there is not")]
    Order {
        /// Which photograph.
        photograph: usize,
    },
    /// Light that is none.
    #[error("the light of photograph {photograph} is not finite, or below 0, for its sample {sample}")]
    Light {
        /// Which photograph.
        photograph: usize,
        /// Which of its samples.
        sample: usize,
    },
    /// Whoever bakes the light could not.
    #[error("the light could not be baked: {0}")]
    Bake(String),
}

/// The light of every sample, irradiance over pi, photograph by photograph, in the samples' order.
pub type Light = Vec<Vec<Vec3>>;

/// Solves albedo. `samples` are what each photograph says, in the order of texels, linear; `around` has other texels near each one, as far as shadows may be
/// off. `light` is asked for the light that falls on every sample at its photograph's hour while the surface has the albedo that it is given, bounces and all.
///
/// # Errors
/// Arrays that do not belong together, light that is none, and what `light` itself tells.
pub fn solve(
    texels: usize,
    samples: &[Vec<Sample>],
    names: &[&str],
    around: &Around,
    params: &AlbedoParams,
    mut light: impl FnMut(&[Vec3]) -> Result<Light, String>,
) -> Result<Albedo, AlbedoError> {
    check(texels, samples, names, around)?;
    // half of what falls on it is about what stone gives back
    let mut albedo = vec![params.mean.unwrap_or(Vec3::splat(0.5)); texels];
    let mut round = 0;
    loop {
        round += 1;
        let of_samples = light(&albedo).map_err(AlbedoError::Bake)?;
        check_light(samples, &of_samples)?;
        let mut merged = merge(texels, samples, names, around, params, &of_samples);
        let mut changes: Vec<f32> = merged
            .albedo
            .iter()
            .zip(&albedo)
            .filter_map(|(new, old)| new.map(|new| ((new - *old).abs() / old.max(Vec3::splat(0.01))).max_element()))
            .collect();
        if changes.is_empty() {
            return Err(AlbedoError::Nothing);
        }
        let change = percentile(&mut changes, 0.5);
        let known = merged.albedo.iter().flatten();
        let mean = known.clone().sum::<Vec3>() / known.count().max(1) as f32;
        albedo = merged.albedo.iter().map(|color| color.unwrap_or(mean)).collect();
        if change < params.settled || round >= params.rounds.max(1) {
            (merged.rounds, merged.change) = (round, change);
            return Ok(merged);
        }
    }
}

fn check(texels: usize, samples: &[Vec<Sample>], names: &[&str], around: &Around) -> Result<(), AlbedoError> {
    let length =
        |what, found, expected| if found == expected { Ok(()) } else { Err(AlbedoError::Length { what, found, expected }) };
    length("names", names.len(), samples.len())?;
    length("around.starts", around.starts.len(), texels + 1)?;
    length("around.texels", around.texels.len(), around.starts.last().map_or(0, |end| *end as usize))?;
    for (photograph, own) in samples.iter().enumerate() {
        let is_sorted = own.windows(2).all(|pair| pair[0].texel < pair[1].texel);
        if !is_sorted || own.last().is_some_and(|last| last.texel as usize >= texels) {
            return Err(AlbedoError::Order { photograph });
        }
    }
    if samples.iter().all(Vec::is_empty) { Err(AlbedoError::Nothing) } else { Ok(()) }
}

fn check_light(samples: &[Vec<Sample>], light: &Light) -> Result<(), AlbedoError> {
    if light.len() != samples.len() {
        return Err(AlbedoError::Length { what: "light", found: light.len(), expected: samples.len() });
    }
    for (photograph, (own, light)) in samples.iter().zip(light).enumerate() {
        if light.len() != own.len() {
            return Err(AlbedoError::Length { what: "a photograph's light", found: light.len(), expected: own.len() });
        }
        if let Some(sample) = light.iter().position(|light| !light.is_finite() || light.min_element() < 0.0) {
            return Err(AlbedoError::Light { photograph, sample });
        }
    }
    Ok(())
}

fn percentile(values: &mut [f32], part: f32) -> f32 {
    let index = ((values.len() - 1) as f32 * part) as usize;
    *values.select_nth_unstable_by(index, f32::total_cmp).1
}

/// A photograph's samples over their light, each weighted by one over the square of its error, as a part.
fn quotients(own: &[Sample], light: &[Vec3], around: &Around, params: &AlbedoParams) -> (Vec<Sample>, usize) {
    let mut brightness: Vec<f32> = light.iter().map(|light| light.element_sum() / 3.0).collect();
    if brightness.is_empty() {
        return (Vec::new(), 0);
    }
    let median = percentile(&mut brightness.clone(), 0.5);
    brightness.iter_mut().for_each(|light| *light = light.max(f32::MIN_POSITIVE));
    let best = own.iter().map(|sample| sample.weight).fold(0.0, f32::max).max(f32::MIN_POSITIVE);
    let quotient = |i: usize| {
        let (sample, here) = (&own[i], brightness[i]);
        let near = around.of(sample.texel as usize).iter();
        let of_near = near.filter_map(|texel| own.binary_search_by_key(texel, |sample| sample.texel).ok());
        let change = of_near.map(|other| (brightness[other] - here).abs() / here.max(brightness[other])).fold(0.0, f32::max);
        let is_edge = change > params.most_change;
        let in_shade = params.light_error * median / here;
        let variance = params.pixel_error * params.pixel_error + change * change + in_shade * in_shade;
        // how finely and squarely it is seen matters less than whether the light is known
        let seen = (sample.weight / best).clamp(1.0e-4, 1.0).sqrt();
        let weight = if is_edge || !sample.tells || light[i].min_element() <= 0.0 { 0.0 } else { seen / variance };
        let color = if weight > 0.0 { sample.color / light[i] } else { Vec3::ZERO };
        (Sample { texel: sample.texel, color, weight, tells: weight > 0.0 }, is_edge)
    };
    let all: Vec<(Sample, bool)> = (0..own.len()).into_par_iter().map(quotient).collect();
    let by_edges = all.iter().filter(|(_, is_edge)| *is_edge).count();
    (all.into_iter().map(|(sample, _)| sample).collect(), by_edges)
}

/// A photograph that disagrees by so many of its errors counts half.
const DISSENT: f32 = 2.5;
/// The least albedo that is told from black.
const BLACK: f32 = 1.0e-4;

fn merge(
    texels: usize,
    samples: &[Vec<Sample>],
    names: &[&str],
    around: &Around,
    params: &AlbedoParams,
    light: &Light,
) -> Albedo {
    let of_photograph = |(own, light): (&Vec<Sample>, &Vec<Vec3>)| quotients(own, light, around, params);
    let (mut layers, by_edges): (Vec<Vec<Sample>>, Vec<usize>) = samples.iter().zip(light).map(of_photograph).unzip();
    let mut gains = Vec::new();
    if params.exposures_unknown {
        gains = compared(&layers, names);
        for (layer, PhotoGain { gain, .. }) in layers.iter_mut().zip(&gains) {
            layer.iter_mut().for_each(|sample| sample.color /= *gain);
        }
    }
    let mut words: Vec<Vec<(Vec3, f32)>> = vec![Vec::new(); texels];
    for sample in layers.iter().flatten().filter(|sample| sample.weight > 0.0) {
        words[sample.texel as usize].push((sample.color.max(Vec3::splat(BLACK)).map(libm::logf), sample.weight));
    }
    let merged: Vec<Option<(Vec3, f32)>> = words.par_iter().map(|words| agreed(words)).collect();
    let known: Vec<Option<Vec3>> = params
        .known
        .iter()
        .map(|known| {
            let layer = layers.get(known.photograph)?;
            let sample = &layer[layer.binary_search_by_key(&known.texel, |sample| sample.texel).ok()?];
            let logs = [known.albedo, sample.color].map(|color| color.max(Vec3::splat(BLACK)).map(libm::logf));
            (sample.weight > 0.0).then_some(logs[0] - logs[1])
        })
        .collect();
    let mut scale = Vec3::ONE;
    let off: Vec<Vec3> = known.iter().copied().flatten().collect();
    if !off.is_empty() {
        scale = (off.iter().sum::<Vec3>() / off.len() as f32).map(libm::expf);
    } else if let Some(mean) = params.mean {
        let known: Vec<Vec3> = merged.iter().flatten().map(|(log, _)| log.map(libm::expf)).collect();
        let now = known.iter().sum::<Vec3>() / known.len().max(1) as f32;
        scale = mean / now.max(Vec3::splat(BLACK));
    }
    let told = |index: usize| {
        let own = layers[index].iter().filter(|sample| sample.weight > 0.0);
        let texels = own.clone().count();
        let off = |sample: &Sample| {
            let (merged, _) = merged[sample.texel as usize].filter(|_| words[sample.texel as usize].len() > 1)?;
            Some((sample.color.max(Vec3::splat(BLACK)).map(libm::logf) - merged).abs().max_element())
        };
        let mut off: Vec<f32> = own.filter_map(off).collect();
        let compared = off.len();
        let [median, percentile_95] = [0.5, 0.95].map(|part| if compared == 0 { 0.0 } else { percentile(&mut off, part) });
        Agreement { photograph: names[index].to_string(), median, percentile_95, texels, compared, by_edges: by_edges[index] }
    };
    let agreement = (0..names.len()).map(told).collect();
    let raw: Vec<Option<Vec3>> = merged.iter().map(|word| word.map(|(log, _)| log.map(libm::expf) * scale)).collect();
    let above_one = raw.iter().flatten().filter(|color| color.max_element() > 1.0).count();
    Albedo {
        albedo: raw.into_iter().map(|color| color.map(|color| color.min(Vec3::ONE))).collect(),
        error: merged.into_iter().map(|word| word.map_or(f32::INFINITY, |(_, error)| error)).collect(),
        gains,
        agreement,
        rounds: 0,
        change: 0.0,
        known_off: known.into_iter().map(|off| off.map(|off| scale / off.map(libm::expf))).collect(),
        above_one,
    }
}

/// The logarithm that words about a texel agree on, and its error: their weighted mean, those counting less that are far from where most weight lies.
fn agreed(words: &[(Vec3, f32)]) -> Option<(Vec3, f32)> {
    let whole: f32 = words.iter().map(|(_, weight)| weight).sum();
    if words.is_empty() || whole <= 0.0 {
        return None;
    }
    // the weighted median to begin with
    let mut order: Vec<usize> = (0..words.len()).collect();
    let middle = |channel: usize, order: &mut Vec<usize>| {
        order.sort_by(|&a, &b| words[a].0[channel].total_cmp(&words[b].0[channel]));
        let mut sum = 0.0;
        let at = order.iter().find(|&&i| {
            sum += words[i].1;
            2.0 * sum >= whole
        });
        at.map_or(0.0, |&i| words[i].0[channel])
    };
    let mut log = Vec3::new(middle(0, &mut order), middle(1, &mut order), middle(2, &mut order));
    let (mut sum, mut scatter) = (0.0, 0.0);
    for _ in 0..3 {
        let (mut colors, mut squares) = (Vec3::ZERO, 0.0);
        sum = 0.0;
        for (word, weight) in words {
            let off = (*word - log).abs().max_element();
            let in_errors = off * weight.sqrt() / DISSENT;
            let weight = weight / (1.0 + in_errors * in_errors);
            colors += *word * weight;
            squares += off * off * weight;
            sum += weight;
        }
        log = colors / sum;
        scatter = squares / sum;
    }
    // the errors that were expected, or the disagreement if that is more
    let expected = 1.0 / sum;
    let found = if words.len() > 1 { scatter / (words.len() - 1) as f32 } else { 0.0 };
    Some((log, expected.max(found).sqrt()))
}
