//! Solved light as it is kept until the bundle is written.

use crate::codec::{Decoder, Encoder};
use crate::light::{BakedGrid, BakedLight, LightInput};
use heliodon_light::{LatticeLight, Layout, SunBounce, SunMasks, Validity, VertexLight};

/// The vertices' light as bytes.
#[must_use]
pub fn encode_light(baked: &BakedLight) -> Vec<u8> {
    let light = &baked.light;
    let mut encoder = Encoder::default();
    encoder.run(&[baked.points, baked.gather_rays, baked.mask_rays]);
    encoder.run(&light.sky_transfer).run(&light.validity.valid).run(&light.validity.source).run(&baked.masks.words);
    let bounces = light.sun_bounce.as_slice();
    encoder.number(bounces.len() as u64);
    for bounce in bounces {
        encoder.run(&[bounce.median_error, bounce.p95_error]).run(&bounce.coefficients);
        encoder.number(bounce.functions.len() as u64).run(&bounce.functions.concat());
    }
    encoder.finish()
}

/// The vertices' light from its bytes; `None` where they are of something else.
#[must_use]
pub fn decode_light(bytes: &[u8], layout: &Layout, input: &LightInput) -> Option<BakedLight> {
    let mut decoder = Decoder::new(bytes);
    let [points, gather_rays, mask_rays] = decoder.run::<u64>()?[..] else { return None };
    let (sky_transfer, valid, source, words) = (decoder.run()?, decoder.run()?, decoder.run()?, decoder.run()?);
    let sun_bounce = match decoder.number()? {
        0 => None,
        _ => {
            let [median_error, p95_error] = decoder.run::<f32>()?[..] else { return None };
            let coefficients = decoder.run()?;
            let count = decoder.number()?;
            let numbers: Vec<f32> = decoder.run()?;
            let steps = input.suns.len().max(1);
            if numbers.len() as u64 != count.checked_mul(steps as u64)? {
                return None;
            }
            let functions = numbers.chunks_exact(steps).map(<[f32]>::to_vec).collect();
            Some(SunBounce { functions, coefficients, median_error, p95_error })
        }
    };
    let light = VertexLight {
        coefficients: input.params.coefficients,
        channels: input.params.channels,
        sky_transfer,
        validity: Validity { valid, source },
        sun_bounce,
    };
    let masks = SunMasks { steps: input.suns.len() as u32, words, rays: mask_rays };
    let fits = decoder.is_empty()
        && light.vertex_count() == layout.vertex_count()
        && masks.words.len() == layout.vertex_count() * masks.words_per_point();
    (fits && light.validate().is_ok() && masks.validate().is_ok()).then_some(BakedLight {
        light,
        masks,
        points,
        gather_rays,
        mask_rays,
        grid: None,
        texels: None,
        panorama: None,
        scan: None,
    })
}

/// The grid's light as bytes.
#[must_use]
pub fn encode_grid(grid: &BakedGrid) -> Vec<u8> {
    let light = &grid.light;
    let mut encoder = Encoder::default();
    encoder.run(&[grid.gather_rays, grid.mask_rays, u64::from(light.masks.steps)]).run(&light.valid).run(&light.source);
    encoder.run(&light.sky_transfer).run(&light.sun_bounce).run(&light.masks.words);
    encoder.finish()
}

/// The grid's light from its bytes; `None` where they are of something else.
#[must_use]
pub fn decode_grid(bytes: &[u8], input: &LightInput) -> Option<BakedGrid> {
    let mut decoder = Decoder::new(bytes);
    let [gather_rays, mask_rays, steps] = decoder.run::<u64>()?[..] else { return None };
    let (valid, source) = (decoder.run()?, decoder.run()?);
    let (sky_transfer, sun_bounce) = (decoder.run()?, decoder.run()?);
    let masks = SunMasks { steps: u32::try_from(steps).ok()?, words: decoder.run()?, rays: mask_rays };
    let light = LatticeLight { valid, source, sky_transfer, sun_bounce, masks };
    let fits = decoder.is_empty()
        && light.point_count() == input.grid.cells.len()
        && light.masks.steps as usize == input.suns.len()
        && light.validate().is_ok();
    fits.then_some(BakedGrid { light, gather_rays, mask_rays })
}
