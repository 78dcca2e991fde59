//! Kept traces: what was gathered with them is what was gathered without, to the bit, and no ray is traced that is known.

#![expect(clippy::unwrap_used, reason = "a test that panics has failed")]

use crate::common::{Lit, params};
use glam::Vec3;
use heliodon_light::{
    BouncedSun, ConstantAlbedo, GatherBlock, KnownTraces, Layout, LightParams, Traces, gather, gather_knowing,
};
use heliodon_testkit::scenes::{ball, cuboid, ground, rectangle};

/// Shade with streaks of sun in it, joints that are followed, an open sheet.
fn courtyard(albedo: f32) -> Lit {
    let canopy = rectangle(Vec3::new(-0.7, 1.2, 0.7), Vec3::X * 1.4, Vec3::NEG_Z * 1.4, 3);
    let scene = ground(6.0, 24).and(cuboid(Vec3::new(-0.5, -0.1, -0.5), Vec3::new(0.5, 0.8, 0.5), 4)).and(canopy);
    Lit::new(scene.and(ball(0.4, 12).moved(Vec3::new(1.5, 0.2, 0.3))), albedo)
}

fn suns(steps: u32) -> Vec<Vec3> {
    (0..steps).map(|t| Vec3::new(2.0 * t as f32 / steps as f32 - 1.0, 0.7, 0.4).normalize_or_zero()).collect()
}

/// A gather of all points, and how many rays of it were traced.
fn gathered(lit: &Lit, steps: u32, params: &LightParams, known: Option<Traces>) -> (GatherBlock, Traces) {
    let surfaces = lit.surfaces();
    let layout = Layout::new(&surfaces, params).unwrap();
    let sun = if steps == 0 { None } else { BouncedSun::new(&surfaces, &layout, &suns(steps), params).unwrap() };
    let all = 0..layout.points().len();
    let (block, traces) =
        gather_knowing(&surfaces, &layout, sun.as_ref(), all.clone(), params, known.map(KnownTraces::from)).unwrap();
    assert_eq!(block, gather(&surfaces, &layout, sun.as_ref(), all, params).unwrap());
    (block, traces)
}

/// As they come back from a disk.
fn through_bytes(traces: &Traces) -> Traces {
    let mut back = Traces::from_bytes(&traces.to_bytes()).unwrap();
    back.traced = traces.traced;
    back
}

#[test]
fn known_rays_are_not_traced_and_nothing_changes() {
    let (lit, params) = (courtyard(0.6), params(64, 4));
    let (block, traces) = gathered(&lit, 37, &params, None);
    assert_eq!(traces.traced, block.rays);
    assert_eq!(through_bytes(&traces), traces);
    // other suns: only points that err under these and did not under those
    let (other, more) = gathered(&lit, 5, &params, Some(through_bytes(&traces)));
    assert!(other.sun != block.sun && more.traced < block.rays / 20, "{} of {}", more.traced, block.rays);
    let (same, none) = gathered(&lit, 37, &params, Some(through_bytes(&traces)));
    assert_eq!((same, none.traced), (block.clone(), 0));
    // without paths these alone are traced, and brighter stone changes nothing else
    let (_, paths) = gathered(&lit, 37, &params, Some(traces.clone().without_paths()));
    assert!(paths.traced > 0 && paths.traced < block.rays / 4, "{}", paths.traced);
    let brighter = Lit { albedo: ConstantAlbedo(Vec3::splat(0.8)), ..courtyard(0.6) };
    let (bright, of_paths) = gathered(&brighter, 37, &params, Some(traces.without_paths()));
    assert!(bright.sun != block.sun && of_paths.traced < block.rays / 4);
}

#[test]
fn traces_of_other_points_are_refused() {
    let (lit, params) = (courtyard(0.6), params(16, 2));
    let surfaces = lit.surfaces();
    let (_, traces) = gathered(&lit, 3, &params, None);
    assert!(traces.validate(&traces.range, &surfaces, &params).is_ok());
    assert!(traces.validate(&(0..traces.range.end - 1), &surfaces, &params).is_err());
    let finer = LightParams { samples: 32, ..params.clone() };
    assert!(traces.validate(&traces.range, &surfaces, &finer).is_err());
    let small = Lit::new(ground(6.0, 2), 0.6);
    assert!(traces.validate(&traces.range, &small.surfaces(), &params).is_err(), "triangles that are not there");
    let bytes = traces.to_bytes();
    assert!((0..200).chain([bytes.len() - 1]).all(|cut| Traces::from_bytes(&bytes[..cut]).is_err()));
    let layout = Layout::new(&surfaces, &params).unwrap();
    assert!(gather_knowing(&surfaces, &layout, None, 0..7, &params, Some(traces.into())).is_err());
}
