//! What a project says of its light, and what is said where it does not.

use glam::Vec3;
use heliodon_bake::photo::ProjectLight;
use heliodon_image::HdrImage;
use heliodon_photo::project::Project;

const SKY: &str = "[sky]\nlatitude_deg = 38.0\nlongitude_deg = 23.7\nutc_offset = \"+02:00\"\nnorth_deg = 0.0\n";
const PHOTOS: &str = "[[photo]]\nfile = \"a.jpg\"\ntime = \"2024-04-20 08:45\"\n[[photo]]\nfile = \"b.jpg\"\n[[photo]]\nfile = \"c.jpg\"\ntime = \"2024-04-20 08:45\"\n";

fn light(text: &str) -> Result<ProjectLight, String> {
    let project = Project::parse(text, "photos.toml").map_err(|error| error.to_string())?;
    ProjectLight::of(&project, &["a.jpg", "b.jpg", "c.jpg"]).map_err(|error| error.to_string())
}

#[test]
fn photographs_of_one_time_share_their_light_and_one_without_is_named() {
    let light = light(&format!("{SKY}{PHOTOS}")).unwrap();
    assert_eq!((light.hours.len(), light.hour_of), (1, vec![Some(0), None, Some(0)]));
    assert!(light.notes.len() == 1 && light.notes[0].contains("b.jpg is left out: nothing says when"), "{:?}", light.notes);
    // mid-morning in spring: the sun stands in the south-east
    let sun = light.hours[0].sun.unwrap();
    assert!(sun.direction.x > 0.5 && sun.direction.y > 0.4 && sun.direction.z > 0.0, "{}", sun.direction);
}

#[test]
fn what_is_missing_is_said() {
    for (from, to, words) in [
        ("north_deg = 0.0\n", "", "where north is"),
        ("utc_offset = \"+02:00\"\n", "", "utc_offset"),
        ("latitude_deg = 38.0\n", "", "latitude_deg"),
        ("latitude_deg = 38.0\n", "latitude_deg = 138.0\n", "photos.toml:2:1: a latitude"),
        ("+02:00", "two", "no offset of a clock"),
        ("[sky]", "[[grey]]\nphoto = \"d.jpg\"\nat = [1, 2]\nalbedo = 0.18\n[sky]", "no [[photo]] called d.jpg"),
        ("north_deg", "turbidity = 99\nnorth_deg", "turbidity"),
    ] {
        let error = light(&format!("{SKY}{PHOTOS}").replacen(from, to, 1)).unwrap_err();
        assert!(error.contains(words), "{words}: {error}");
    }
    let night = light(&format!("{SKY}{PHOTOS}").replace("08:45", "23:45")).unwrap();
    assert!(night.hours[0].sun.is_none() && night.notes.iter().any(|note| note.contains("below the horizon")));
}

#[test]
fn a_photograph_of_the_sky_goes_before_the_model() {
    let folder = tempfile::tempdir().unwrap();
    // a grey sky and a sun of a few pixels in the east, 45 degrees high
    let is_sun = |x: u32, y: u32| (383..385).contains(&x) && (63..65).contains(&y);
    let map = HdrImage::from_fn(512, 256, |x, y| Vec3::splat(if is_sun(x, y) { 20_000.0 } else { 0.5 }));
    map.write_exr(folder.path().join("sky.exr")).unwrap();
    let text = "[sky]\nnorth_deg = 0\n[[photo]]\nfile = \"a.jpg\"\nprobe = \"sky.exr\"\n";
    let project = Project::parse(text, folder.path().join("photos.toml")).unwrap();
    let light = ProjectLight::of(&project, &["a.jpg"]).unwrap();
    let sun = light.hours[0].sun.unwrap();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert!(sun.direction.distance(Vec3::new(half, half, 0.0)) < 0.01, "{}", sun.direction);
    // four pixels of 2 pi / 512 squared, foreshortened by their height
    let solid_angle = 4.0 * (std::f32::consts::TAU / 512.0).powi(2) * half;
    assert!((sun.irradiance.x / (20_000.0 * solid_angle) - 1.0).abs() < 0.05, "{}", sun.irradiance);
    let missing = Project::parse(&text.replace("sky.exr", "no.exr"), folder.path().join("photos.toml")).unwrap();
    assert!(ProjectLight::of(&missing, &["a.jpg"]).unwrap_err().to_string().contains("no.exr"));
}
