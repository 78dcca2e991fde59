//! The sun's place against published values.

#![expect(clippy::unwrap_used, reason = "a test may panic")]

use glam::Vec3;
use heliodon_sky::civil::Date;
use heliodon_sky::solar::{Place, RISE_ELEVATION_DEG, delta_t_seconds, refraction_deg, rise_and_set, sun_position};

fn place(latitude_deg: f64, longitude_deg: f64, utc_offset_hours: f64) -> Place {
    Place { latitude_deg, longitude_deg, utc_offset_hours, north_deg: 0.0 }
}

fn at(place: &Place, date: &str, h: f64, m: f64, s: f64) -> heliodon_sky::solar::SunPosition {
    sun_position(place, date.parse::<Date>().unwrap(), h * 3600.0 + m * 60.0 + s).unwrap()
}

#[test]
fn the_spa_report_s_example_comes_out() {
    // Reda and Andreas, NREL/TP-560-34302, table A5.1: Golden, 17 October 2003, 12:30:30 local, 1830.14 m, 820 hPa, 11 degrees:
    // zenith 50.11162 with refraction of about 0.0161, azimuth 194.34024
    let p = at(&place(39.742476, -105.1786, -7.0), "2003-10-17", 12.0, 30.0, 30.0);
    assert!((p.azimuth_deg - 194.34024).abs() < 1e-3, "{p:?}");
    // the report's geometric height is 39.872046; sea level changes the parallax by less than 1e-6
    assert!((p.geometric_elevation_deg - 39.872046).abs() < 1e-3, "{p:?}");
}

#[test]
fn meeus_example_of_1992_comes_out() {
    // Astronomical Algorithms, example 25.b: 13 October 1992, 0h TD: apparent right ascension 13h 13m 30.749s, declination -7 47' 01.74".
    // Seen from the pole the height is the declination, less the parallax of 8.8" times the cosine.
    let seconds = -delta_t_seconds("1992-10-13".parse::<Date>().unwrap());
    let p = sun_position(&place(90.0, 0.0, 0.0), "1992-10-13".parse::<Date>().unwrap(), seconds).unwrap();
    let declination = -(7.0 + 47.0 / 60.0 + 1.74 / 3600.0);
    assert!((p.geometric_elevation_deg - (declination - 8.79 / 3600.0)).abs() < 3e-4, "{p:?}");
}

#[test]
fn equinoxes_and_solstices_fall_when_published() {
    // instants from the Astronomical Almanac and from Meeus, table 27.E (dynamical time): declination 0 or extreme
    let declination =
        |date: &str, h: f64, m: f64| at(&place(90.0, 0.0, 0.0), date, h, m, 0.0).geometric_elevation_deg + 8.79 / 3600.0;
    assert!(declination("2000-03-20", 7.0, 35.0).abs() < 0.001);
    assert!(declination("2020-09-22", 13.0, 31.0).abs() < 0.001);
    assert!((declination("2000-06-21", 1.0, 48.0) - 23.4381).abs() < 0.001);
    assert!((declination("2024-12-21", 9.0, 20.0) + 23.4385).abs() < 0.001);
}

#[test]
fn an_ancient_equinox_falls_on_its_day() {
    // Meeus' mean equinox of March (Astronomical Algorithms, table 27.A, years -1000 to 1000) for the year -437
    let y = -0.437_f64;
    let jde = 1_721_139.291_89 + 365_242.137_40 * y + 0.061_34 * y * y + 0.001_11 * y.powi(3) - 0.000_71 * y.powi(4);
    let date = "-0437-03-21".parse::<Date>().unwrap();
    let seconds = (jde - (date.julian_day_number() as f64 - 0.5)) * 86_400.0 - delta_t_seconds(date);
    // the true equinox lies within about a quarter of an hour of the mean one, in which the declination moves 0.004 degrees
    let p = sun_position(&place(90.0, 0.0, 0.0), date, seconds).unwrap();
    assert!(p.geometric_elevation_deg.abs() < 0.01, "{p:?}, {seconds}");
    assert!((delta_t_seconds(date) - 16_700.0).abs() < 600.0, "{}", delta_t_seconds(date));
    assert!((delta_t_seconds("-0500-01-01".parse::<Date>().unwrap()) - 17_190.0).abs() < 60.0);
}

#[test]
fn the_sun_rises_over_athens_when_the_almanac_says() {
    // U.S. Naval Observatory's table for 37.97 N 23.72 E, 21 June 2023, UT+3: rise 06:03, set 20:51 (whole minutes)
    let athens = place(37.9715, 23.7267, 3.0);
    let (rise, set) = rise_and_set(&athens, "2023-06-21".parse::<Date>().unwrap(), RISE_ELEVATION_DEG).unwrap().unwrap();
    assert!((f64::from(rise.seconds) - (6.0 * 3600.0 + 180.0)).abs() < 90.0, "{rise}");
    assert!((f64::from(set.seconds) - (20.0 * 3600.0 + 51.0 * 60.0)).abs() < 90.0, "{set}");
    // no night at the North Cape, no day on Svalbard
    assert_eq!(
        rise_and_set(&place(71.17, 25.78, 2.0), "2023-06-21".parse::<Date>().unwrap(), RISE_ELEVATION_DEG).unwrap(),
        None
    );
    assert_eq!(rise_and_set(&place(78.2, 15.6, 1.0), "2023-12-21".parse::<Date>().unwrap(), RISE_ELEVATION_DEG).unwrap(), None);
}

#[test]
fn refraction_is_saemundsson_s_and_fades_below() {
    // Meeus, chapter 16: 28.7' at the true horizon; 0 at the zenith
    assert!((refraction_deg(0.0) * 60.0 - 28.98).abs() < 0.3, "{}", refraction_deg(0.0) * 60.0);
    assert!(refraction_deg(90.0).abs() < 0.001);
    let mut last = refraction_deg(-0.5);
    for i in 1..400 {
        let h = -0.5 - f64::from(i) * 0.02;
        // the apparent height keeps falling with the true one
        assert!(h + refraction_deg(h) < h + 0.02 + last);
        last = refraction_deg(h);
    }
    assert!(refraction_deg(-8.0) < 0.01);
}

#[test]
fn the_model_s_north_turns_the_sun() {
    let mut athens = place(37.9715, 23.7267, 2.0);
    let p = at(&athens, "2023-03-21", 12.0, 32.0, 0.0);
    assert!((p.azimuth_deg - 180.0).abs() < 2.0);
    assert!(p.direction(0.0).z > 0.5, "south is +Z");
    // -Z looks east: the southern sun stands to the right of it
    athens.north_deg = 90.0;
    assert!(p.direction(athens.north_deg).x > 0.5);
    assert!((p.direction(33.0).y - Vec3::Y.dot(p.direction(0.0))).abs() < 1e-6);
}

#[test]
fn places_and_dates_off_the_map_are_refused() {
    for (bad, date) in [
        (place(91.0, 0.0, 0.0), "2000-01-01"),
        (place(0.0, f64::NAN, 0.0), "2000-01-01"),
        (place(0.0, 0.0, 99.0), "2000-01-01"),
    ] {
        assert!(sun_position(&bad, date.parse::<Date>().unwrap(), 0.0).is_err());
    }
    assert!(sun_position(&place(0.0, 0.0, 0.0), "-3000-01-01".parse::<Date>().unwrap(), 0.0).is_err());
    assert!(sun_position(&place(0.0, 0.0, 0.0), "-1999-01-01".parse::<Date>().unwrap(), 0.0).is_ok());
}
