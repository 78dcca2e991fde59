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

/// A site's view of a geocentric declination and local hour angle (degrees), with the sun's parallax: compass bearing and height, degrees.
fn horizontal(latitude_deg: f64, declination_deg: f64, hour_angle_deg: f64) -> (f64, f64) {
    let (sp, cp) = latitude_deg.to_radians().sin_cos();
    let (sd, cd) = declination_deg.to_radians().sin_cos();
    let (sh, ch) = hour_angle_deg.to_radians().sin_cos();
    let height = (sp * sd + cp * cd * ch).asin();
    let azimuth = (-cd * sh).atan2(sd * cp - cd * ch * sp);
    (azimuth.to_degrees().rem_euclid(360.0), height.to_degrees() - PARALLAX_DEG * height.cos())
}

/// The sun's horizontal parallax at its mean distance, 8.794".
const PARALLAX_DEG: f64 = 8.794 / 3600.0;

/// The angle between two places in the sky, degrees.
fn apart(a: (f64, f64), b: (f64, f64)) -> f64 {
    let across = ((a.0 - b.0 + 540.0).rem_euclid(360.0) - 180.0) * a.1.to_radians().cos();
    across.hypot(a.1 - b.1)
}

/// Seconds of universal time since midnight of `date` at a Julian day of terrestrial time.
fn seconds_at(date: &str, julian_day_tt: f64) -> f64 {
    let date = date.parse::<Date>().unwrap();
    (julian_day_tt - (date.julian_day_number() as f64 - 0.5)) * 86_400.0 - delta_t_seconds(date)
}

#[test]
fn the_spa_report_s_example_comes_out() {
    // Reda and Andreas, NREL/TP-560-34302 (revised 2008), table A5.1: Golden, 17 October 2003, 12:30:30 local, 1830.14 m, 820 hPa, 11 degrees:
    // azimuth 194.340241, height without refraction 39.872046, refraction 0.016332, zenith 50.11162
    let p = at(&place(39.742476, -105.1786, -7.0), "2003-10-17", 12.0, 30.0, 30.0);
    assert!((p.azimuth_deg - 194.340241).abs() < 1e-3, "{p:?}");
    // sea level changes the parallax by less than 1e-6
    assert!((p.geometric_elevation_deg - 39.872046).abs() < 1e-3, "{p:?}");
    // the report's refraction, brought from its pressure and temperature to 1010 hPa and 10 degrees
    let refraction = 0.016332 / (820.0 / 1010.0 * 283.0 / (273.0 + 11.0));
    assert!((refraction_deg(39.872046) - refraction).abs() < 2e-6, "{}", refraction_deg(39.872046));
}

#[test]
fn meeus_example_of_1992_comes_out() {
    // Astronomical Algorithms (1998), example 25.b, by the full VSOP87: 13 October 1992, 0h TD (JD 2448908.5): apparent right ascension 13h 13m 30.749s,
    // declination -7 47' 01.74". Seen from the pole the height is the declination, less the parallax.
    let seconds = seconds_at("1992-10-13", 2_448_908.5);
    let p = sun_position(&place(90.0, 0.0, 0.0), "1992-10-13".parse::<Date>().unwrap(), seconds).unwrap();
    let declination = -(7.0 + 47.0 / 60.0 + 1.74 / 3600.0);
    assert!((p.geometric_elevation_deg - horizontal(90.0, declination, 0.0).1).abs() < 1e-4, "{p:?}");
}

#[test]
fn declinations_are_those_of_nasa_s_eclipse_bulletins() {
    // Espenak and Anderson, NASA bulletins, table 1, "geocentric coordinates of Sun and Moon at greatest eclipse (DE200/LE200)":
    // eclipse.gsfc.nasa.gov/SEmono and umbra.nascom.nasa.gov/eclipse/990811/tables/table_1.html
    for (date, julian_day_tt, degrees, minutes, seconds, sign) in [
        ("1999-08-11", 2_451_401.961_215, 15.0, 19.0, 39.72, 1.0),
        ("2003-05-31", 2_452_790.673_176, 21.0, 50.0, 57.15, 1.0),
        ("2005-04-08", 2_453_469.358_917, 7.0, 28.0, 47.25, 1.0),
        ("2005-10-03", 2_453_646.939_435, 4.0, 5.0, 4.22, -1.0),
        ("2006-03-29", 2_453_823.925_261, 3.0, 24.0, 10.34, 1.0),
    ] {
        let p = sun_position(&place(90.0, 0.0, 0.0), date.parse::<Date>().unwrap(), seconds_at(date, julian_day_tt)).unwrap();
        let declination = sign * (degrees + minutes / 60.0 + seconds / 3600.0);
        let error = p.geometric_elevation_deg - horizontal(90.0, declination, 0.0).1;
        println!("{date}: declination {declination:.6}, error {error:.6}");
        assert!(error.abs() < 5e-4, "{date}: {error}");
    }
}

#[test]
fn suns_of_ancient_and_modern_eclipses_stand_where_nasa_s_canon_has_them() {
    // Espenak and Meeus, "Five Millennium Canon of Solar Eclipses: -1999 to +3000", NASA/TP-2006-214141; Besselian elements x, y, d, mu at t0 of
    // eclipse.gsfc.nasa.gov/SEsearch/SEdata.php (VSOP87/ELP2000-82), and the canon's delta T. The moon's shadow axis has the declination d and, at the
    // meridian that delta T puts at Greenwich, the hour angle mu; it passes (x, y) Earth radii from the Earth's middle, so the sun, some
    // 23,455 radii away, stands that much aside of it. Thales' eclipse is the second of them, Thucydides' the third.
    let eclipses = [
        ("-1999-05-26", 991_085.5 + 3.0 / 24.0, -0.056_331, -0.300_701, 20.991_640, 228.293_518, 46_438.2),
        ("-1165-08-19", 1_295_781.5 + 17.0 / 24.0, 0.463_834, 1.209_172, 13.678_750, 74.737_442, 28_354.3),
        ("-0584-05-22", 1_507_899.5 + 19.0 / 24.0, -0.366_269, 0.216_789, 20.364_651, 107.344_139, 18_383.9),
        ("-0430-07-29", 1_564_214.5 + 19.0 / 24.0, 0.112_311, 0.850_741, 19.348_869, 104.458_504, 15_923.4),
        ("0540-06-22", 1_918_463.5 + 10.0 / 24.0, -0.159_594, 0.358_984, 23.626_579, 330.421_631, 5_286.4),
        ("2024-04-08", 2_460_408.5 + 18.0 / 24.0, -0.318_244, 0.219_764, 7.586_200, 89.591_217, f64::NAN),
    ];
    for (date, julian_day_tt, x, y, d, mu, canon_delta_t) in eclipses {
        let day = date.parse::<Date>().unwrap();
        let radii = 23_455.0_f64;
        let declination = d + (y / radii).to_degrees();
        // the Earth turns 15.041 degrees an hour
        let greenwich = mu - (x / radii / d.to_radians().cos()).to_degrees() - 0.004_178_07 * delta_t_seconds(day);
        for (latitude, longitude) in [(37.9715, 23.7267), (-33.0, -71.0), (65.0, 140.0)] {
            let p = sun_position(&place(latitude, longitude, 0.0), day, seconds_at(date, julian_day_tt)).unwrap();
            let published = horizontal(latitude, declination, greenwich + longitude);
            let error = apart((p.azimuth_deg, p.geometric_elevation_deg), published);
            println!("{date} at {latitude} {longitude}: canon {published:.5?}, error {error:.5}");
            assert!(error < 5e-3, "{date}: {p:?} {published:?}");
        }
        // The canon's delta T holds a term for the moon's acceleration (-0.000012932 (year - 1955)^2 s) that the polynomials proper leave out.
        let years = f64::from(day.year) - 1955.0;
        let polynomial = canon_delta_t + 0.000_012_932 * years * years;
        assert!(canon_delta_t.is_nan() || (delta_t_seconds(day) - polynomial).abs() < 3.0, "{date}: {}", delta_t_seconds(day));
    }
}

#[test]
fn delta_t_is_espenak_and_meeus() {
    // eclipse.gsfc.nasa.gov/SEhelp/deltatpoly2004.html: 17203.7 at -500 (table 1 has 17190), 10583.6 at 0, 1574.2 at 1000, 120 at 1600
    for (date, seconds) in [("-0500-01-01", 17_203.7), ("0000-01-01", 10_583.6), ("1000-01-01", 1_574.2), ("1600-01-01", 120.0)]
    {
        let got = delta_t_seconds(date.parse::<Date>().unwrap());
        assert!((got - seconds).abs() < 1.0, "{date}: {got}");
    }
}

#[test]
fn equinoxes_fall_when_published() {
    // U.S. Naval Observatory, aa.usno.navy.mil/calculated/seasons?year=2023, to the minute: 20 March 21:24, 23 September 06:50 UT; the
    // declination moves 0.0003 degrees a minute
    let declination =
        |date: &str, h: f64, m: f64| at(&place(90.0, 0.0, 0.0), date, h, m, 0.0).geometric_elevation_deg + PARALLAX_DEG;
    assert!(declination("2023-03-20", 21.0, 24.0).abs() < 3e-4);
    assert!(declination("2023-09-23", 6.0, 50.0).abs() < 3e-4);
    // the solstices of the same page, 21 June 14:58 and 22 December 03:27 UT: as high a day before as a day after, within an hour's worth
    for (date, h, m) in [("2023-06-21", 14.0, 58.0), ("2023-12-22", 3.0, 27.0)] {
        assert!((declination(date, h - 24.0, m) - declination(date, h + 24.0, m)).abs() < 6e-4, "{date}");
    }
}

#[test]
fn an_ancient_equinox_falls_on_its_day() {
    // Meeus' mean equinox of March (Astronomical Algorithms, table 27.A, years -1000 to 1000) for the year -437
    let y = -0.437_f64;
    let jde = 1_721_139.291_89 + 365_242.137_40 * y + 0.061_34 * y * y + 0.001_11 * y.powi(3) - 0.000_71 * y.powi(4);
    let seconds = seconds_at("-0437-03-21", jde);
    // the true equinox lies within about a quarter of an hour of the mean one, in which the declination moves 0.004 degrees
    let p = sun_position(&place(90.0, 0.0, 0.0), "-0437-03-21".parse::<Date>().unwrap(), seconds).unwrap();
    assert!(p.geometric_elevation_deg.abs() < 0.01, "{p:?}, {seconds}");
}

#[test]
fn the_sun_rises_and_sets_when_the_almanac_says() {
    // U.S. Naval Observatory, "Rise and Set for the Sun for 2020" (aa.usno.navy.mil/data/RS_OneYear), whole minutes of universal time, as kept with the tests
    // of the crate solar-positioning; local clocks make one day of each rise and set
    for (latitude, longitude, offset, date, rise, set) in [
        (61.216_667, -149.866_667, -10.0, "2020-03-15", (16, 14), (28, 3)),
        (61.216_667, -149.866_667, -10.0, "2020-06-25", (12, 22), (31, 42)),
        (61.216_667, -149.866_667, -10.0, "2020-12-15", (19, 10), (24, 40)),
        (-36.833_333, 174.8, 12.0, "2020-06-26", (-5, 34), (5, 13)),
        (-15.8, -47.85, -3.0, "2020-03-15", (9, 15), (21, 25)),
        (-15.8, -47.85, -3.0, "2020-06-25", (9, 38), (20, 50)),
        (-15.8, -47.85, -3.0, "2020-12-15", (8, 35), (21, 39)),
    ] {
        let day = date.parse::<Date>().unwrap();
        let (rises, sets) = rise_and_set(&place(latitude, longitude, offset), day, RISE_ELEVATION_DEG).unwrap().unwrap();
        let local = |(h, m): (i32, i32)| f64::from(h) * 3600.0 + f64::from(m) * 60.0 + offset * 3600.0;
        for (got, published) in [(rises, local(rise)), (sets, local(set))] {
            assert!((f64::from(got.seconds) - published).abs() < 90.0, "{date} at {latitude}: {got}");
        }
    }
    // no night at the North Cape, no day on Svalbard
    let none =
        |place: &Place, date: &str| rise_and_set(place, date.parse::<Date>().unwrap(), RISE_ELEVATION_DEG).unwrap().is_none();
    assert!(none(&place(71.17, 25.78, 2.0), "2023-06-21"));
    assert!(none(&place(78.2, 15.6, 1.0), "2023-12-21"));
}

#[test]
fn refraction_is_saemundsson_s_and_fades_below() {
    // Meeus, chapter 16, formula 16.4: 1.02' / tan(h + 10.3 / (h + 5.11)) is 28.98' at the true horizon; 0 at the zenith
    assert!((refraction_deg(0.0) * 60.0 - 28.98).abs() < 0.01, "{}", refraction_deg(0.0) * 60.0);
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
