//! Light maps as files of fewer bits give them back: what is dark stays dark, and borders show the same.

use crate::bench::Bench;
use crate::{leaks, seams};
use glam::Vec3;
use heliodon_image::{HdrImage, decode_bc6h, encode_bc6h, from_rgbe8};
use heliodon_lightmap::solve::{LightMap, SolveParams, nearly_brightest, shown_srgb8};
use heliodon_math::color::{linear_from_srgb8_table, srgb8_from_linear};

/// A map as an image tells it.
fn told(bench: &Bench, map: &LightMap, image: &HdrImage) -> LightMap {
    let light = bench.texels.iter().map(|texel| image.pixel(texel.x.into(), texel.y.into())).collect();
    LightMap { light, ..map.clone() }
}

fn in_blocks(bench: &Bench, map: &LightMap) -> LightMap {
    let sides = [bench.side; 2];
    told(bench, map, &decode_bc6h(&map.bc6h(&bench.texels, 0, sides), bench.side, bench.side))
}

fn in_eight_bits(bench: &Bench, map: &LightMap) -> LightMap {
    told(bench, map, &from_rgbe8(&map.rgbe8(&bench.texels, 0, [bench.side; 2])))
}

/// As on a screen that shows `white` as white.
fn on_a_screen(map: &LightMap, white: f32) -> LightMap {
    let exposed: Vec<Vec3> = map.light.iter().map(|light| *light / white).collect();
    LightMap { light: shown_srgb8(&map.seams, &exposed), ..map.clone() }
}

#[test]
fn closed_rooms_are_dark_in_files_of_fewer_bits() {
    for (bench, map) in leaks::dark_rooms() {
        let image = map.image(&bench.texels, 0, [bench.side; 2]);
        let plain = told(&bench, &map, &decode_bc6h(&encode_bc6h(&image), bench.side, bench.side));
        for (name, map, least) in [
            ("picture", plain, 1000.0),
            ("blocks", in_blocks(&bench, &map), 1000.0),
            ("eight bits", in_eight_bits(&bench, &map), 1000.0),
            ("a screen", on_a_screen(&map, 1000.0), 0.999),
        ] {
            let (inside, outside) = leaks::inside_and_outside(&bench, &map);
            assert!(inside == 0.0 && outside > least, "{name}: {inside} of {outside}");
        }
    }
}

/// Of the places of borders the widest, by codes of eight bits, and which part of them is shown further apart than half a code, and than one.
fn borders(map: &LightMap, white: f32) -> [f32; 3] {
    let channel = |c: usize| map.light.iter().map(|light| light[c]).collect::<Vec<_>>();
    let apart: Vec<f32> = (0..3).flat_map(|c| map.seams.shown_apart(&channel(c), white)).collect();
    let beyond = |codes: f32| apart.iter().filter(|apart| **apart > codes).count() as f32 / apart.len() as f32;
    [apart.iter().copied().fold(0.0, f32::max), beyond(0.5), beyond(1.0)]
}

#[test]
fn borders_show_the_same_in_files_of_fewer_bits() {
    for (name, bench, params) in seams::benches().take(5) {
        let map = bench.solve(&SolveParams { error: 0.05, samples: 256, ..params });
        let white = nearly_brightest(&mut map.light.iter().map(|light| light.max_element()).collect::<Vec<_>>());
        // one of them is dark
        let white = white.max(f32::MIN_POSITIVE);
        let [widest, half, _] = borders(&in_eight_bits(&bench, &map), white);
        assert!(widest < 0.65 && half < 1.0e-3, "{name}, eight bits: {widest} codes, {half} above half of one");
        let shown = on_a_screen(&map, white);
        let [widest, half, _] = borders(&shown, 1.0);
        assert!(widest < 1.0 && half < 0.01, "{name}, a screen: {widest} codes, {half} above half of one");
        let table = linear_from_srgb8_table();
        let off =
            shown.light.iter().zip(&map.light).flat_map(|(shown, light)| (0..3).map(move |c| (shown[c], light[c] / white)));
        for (shown, light) in off {
            let code = usize::from(srgb8_from_linear(shown));
            assert!(shown == table[code], "{shown} is no code");
            let (below, above) = (table[code.saturating_sub(1)], table[(code + 1).min(255)]);
            assert!(below <= light.min(1.0) && light.min(1.0) <= above, "{light} as {shown}");
        }
        let [widest, half, one] = borders(&in_blocks(&bench, &map), white);
        // where a shadow's edge runs over a border, a block has no colours between those of its two sides
        assert!(
            widest < 6.0 && half < 0.02 && one < 0.004,
            "{name}, blocks: {widest} codes, {half} above half of one, {one} above one"
        );
    }
}
