//! Lamps inside of something closed, as `check`, `bake` and `lightmap` tell of them.

use crate::done;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A box with its fronts outside, `half` metres from its middle to each side.
fn block(file: &Path, [x, y, z]: [f64; 3], half: f64) {
    let mut text = String::new();
    for corner in 0..8_u32 {
        let side = |bit: u32| if corner >> bit & 1 == 1 { half } else { -half };
        writeln!(text, "v {} {} {}", x + side(0), y + side(1), z + side(2)).unwrap();
    }
    text += "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    fs::write(file, text).unwrap();
}

/// A block of two metres on the ground, and beside it a bulb of glass.
fn site(folder: &Path, lamp_x: f64) -> PathBuf {
    block(&folder.join("block.obj"), [0.0, 1.0, 0.0], 1.0);
    block(&folder.join("bulb.obj"), [5.0, 1.0, 0.0], 0.25);
    fs::write(folder.join("ground.obj"), "v -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nf 1 2 3 4\n").unwrap();
    let part = |file: &str| format!("[[part]]\nfile = \"{file}.obj\"\nalbedo = [0.5, 0.5, 0.5]\n");
    let site = format!(
        "[site]\nname = \"Block\"\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\n{}{}{}\
         [[light]]\nname = \"torch\"\nplace = [{lamp_x}, 1.1, 0.1]\nintensity = [1.0, 1.0, 1.0]\n\
         [sky]\nmodel = \"atmosphere\"\ndate = \"2003-03-21\"\n[bake]\nbounces = 0\nsamples = 64\nsun_steps = 1\nsky_steps = 1\n",
        part("block"),
        part("bulb"),
        part("ground")
    );
    fs::write(folder.join("site.toml"), site).unwrap();
    folder.to_owned()
}

const TOLD: &str = "lies inside of something closed";

#[test]
fn a_lamp_in_a_block_is_told_by_every_command() {
    let folder = TempDir::new().unwrap();
    for (x, inside) in [(0.1, true), (2.5, false)] {
        let site = site(folder.path(), x);
        let out = site.join("out");
        let lit = done(&[&"lightmap", &site, &"--sky", &"none", &"--size", &"64", &"--samples", &"64", &"-o", &out]);
        for said in [done(&[&"check", &site]), done(&[&"bake", &site]), lit] {
            let said = said.out + &said.err;
            assert!(said.contains("torch") == inside && said.contains(TOLD) == inside, "{x}: {said}");
        }
    }
}

#[test]
fn a_pane_a_disc_and_a_mesh_are_told_only_where_all_of_them_lies_inside() {
    let folder = TempDir::new().unwrap();
    let site = site(folder.path(), 2.5);
    // the mesh that shines in the block, and one that is the bulb itself
    block(&site.join("ember.obj"), [0.1, 0.9, -0.1], 0.2);
    let lamps = site.join("lamps.toml");
    let told = |kind: &str| {
        fs::write(&lamps, format!("[[light]]\nname = \"it\"\namount = {{ radiance = 1.0 }}\n{kind}\n")).unwrap();
        let out = site.join("out");
        let ran = done(&[
            &"lightmap",
            &site,
            &"--sky",
            &"none",
            &"--lights",
            &lamps,
            &"--size",
            &"64",
            &"--samples",
            &"64",
            &"-o",
            &out,
        ]);
        ran.err.contains(TOLD)
    };
    let pane = |x: f64, wide: f64| {
        format!("kind = \"rectangle\"\ncorners = [[{x}, 0.5, 0.1], [{}, 0.5, 0.1], [{x}, 1.5, 0.1]]", x + wide)
    };
    assert!(told(&pane(-0.4, 0.8)));
    assert!(!told(&pane(-0.4, 2.4)), "it stands out, but not its middle");
    assert!(
        !told("kind = \"rectangle\"\ncorners = [[-0.5, 0.5, 1.0], [0.5, 0.5, 1.0], [-0.5, 1.5, 1.0]]"),
        "on the block's side"
    );
    let disc =
        |radius: f64| format!("kind = \"disc\"\nplace = [0.5, 1.0, 0.1]\nlook_at = [0.5, 1.0, 1.0]\nradius_m = {radius}");
    assert!(told(&disc(0.3)) && !told(&disc(0.8)));
    for (file, two_sided, inside) in
        [("ember", false, true), ("ember", true, true), ("bulb", false, false), ("bulb", true, false)]
    {
        let mesh = format!("kind = \"mesh\"\nfile = \"{file}.obj\"\ntwo_sided = {two_sided}");
        assert_eq!(told(&mesh), inside, "{file}, {two_sided}");
    }
}
