//! What is found in real HDR images, where they are at hand.

use heliodon_image::HdrImage;
use heliodon_math::sphere::azimuth_elevation_from_direction;
use heliodon_sky::mapping::Mapping;
use heliodon_sky::probe::Probe;
use heliodon_sky::sun::{SunParams, find_sun};
use std::path::PathBuf;

#[test]
fn real_skies_show_their_suns() {
    let root = PathBuf::from("../../../shared/data/hdri");
    let images = [
        ("polyhaven_1k/aristea_wreck_puresky_1k.hdr", Mapping::LatLong, None),
        ("polyhaven_1k/kiara_1_dawn_1k.hdr", Mapping::LatLong, None),
        ("polyhaven_1k/noon_grass_1k.hdr", Mapping::LatLong, Some(true)),
        ("polyhaven_1k/quarry_01_1k.hdr", Mapping::LatLong, Some(true)),
        ("polyhaven_1k/rustig_koppie_puresky_1k.hdr", Mapping::LatLong, Some(true)),
        ("polyhaven_1k/spruit_sunrise_1k_HDR.hdr", Mapping::LatLong, Some(true)),
        ("derived_formats/quarry_01_angular_probe.hdr", Mapping::Angular, None),
        ("blender_studiolights_exr/city.exr", Mapping::LatLong, None),
        ("blender_studiolights_exr/courtyard.exr", Mapping::LatLong, None),
        ("blender_studiolights_exr/forest.exr", Mapping::LatLong, None),
        ("blender_studiolights_exr/interior.exr", Mapping::LatLong, Some(false)),
        ("blender_studiolights_exr/night.exr", Mapping::LatLong, Some(false)),
        ("blender_studiolights_exr/studio.exr", Mapping::LatLong, Some(false)),
        ("blender_studiolights_exr/sunrise.exr", Mapping::LatLong, None),
        ("blender_studiolights_exr/sunset.exr", Mapping::LatLong, None),
    ];
    for (file, mapping, expected) in images {
        let path = root.join(file);
        if !path.exists() {
            println!("skipped, not at hand: {file}");
            continue;
        }
        let image = HdrImage::read(&path).unwrap();
        let size = (image.width, image.height);
        let probe = Probe::new(image, mapping, 0.0).unwrap();
        let start = std::time::Instant::now();
        let found = find_sun(&probe, &SunParams::default());
        let took = start.elapsed();
        let any = find_sun(
            &probe,
            &SunParams { min_contrast: 0.0, max_radius_deg: 60.0, max_rival: 1e9, min_share: 0.0, ..SunParams::default() },
        );
        let text = found.as_ref().or(any.as_ref()).map(|f| {
            let (azimuth, elevation) = azimuth_elevation_from_direction(glam::Vec3::from_array(f.sun.direction));
            format!(
                "azimuth {:.1} elevation {:.1} irradiance {:.2?} radius {:.2} contrast {:.1} clipped {}",
                azimuth.to_degrees(),
                elevation.to_degrees(),
                f.sun.irradiance,
                f.radius_deg,
                f.contrast,
                f.sun.clipped
            )
        });
        println!("{file} {size:?} {took:.0?}: {} {}", if found.is_some() { "SUN " } else { "none" }, text.unwrap_or_default());
        if let Some(expected) = expected {
            assert_eq!(found.is_some(), expected, "{file}");
        }
    }
}
