//! IES files, valid and hostile.

use glam::Vec3;
use heliodon_lightmap::lights::ies::{IesProblem, IesProfile, IesStandard, MAX_BYTES};
use proptest::prelude::*;
use std::f64::consts::PI;

/// A file of 2002 with one plane and these numbers after `TILT=NONE`.
fn file(numbers: &str) -> String {
    format!("IESNA:LM-63-2002\n[TEST] own\n[MANUFAC] none\nTILT=NONE\n{numbers}")
}

/// A direction in the luminaire's frame.
fn towards(vertical_deg: f32, around_deg: f32) -> Vec3 {
    let (v, a) = (vertical_deg.to_radians(), around_deg.to_radians());
    Vec3::new(libm::sinf(v) * libm::cosf(a), -libm::cosf(v), -libm::sinf(v) * libm::sinf(a))
}

fn problem(text: &str) -> (usize, IesProblem) {
    let error = IesProfile::parse(text).unwrap_err();
    assert!(error.to_string().starts_with(&format!("line {}: ", error.line)));
    (error.line, error.problem)
}

#[test]
fn an_even_source_has_four_pi_candelas_of_lumens() {
    let profile = IesProfile::parse(&file("1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 180\n0\n100 100\n")).unwrap();
    assert!((profile.flux_lm() - 400.0 * PI).abs() < 1e-10);
    for (v, a) in [(0.0, 0.0), (180.0, 0.0), (90.0, 200.0), (33.0, 359.9)] {
        assert!((profile.intensity_cd(towards(v, a)) - 100.0).abs() < 1e-9);
    }
    assert_eq!(profile.lumens_per_lamp(), -1.0);
    assert_eq!((profile.intensity_cd(Vec3::ZERO), profile.intensity_cd(Vec3::NAN)), (0.0, 0.0));
}

#[test]
fn a_cosine_source_has_pi_candelas_of_lumens() {
    let vertical: Vec<String> = (0..=90).map(|v| v.to_string()).collect();
    let candelas: Vec<String> = (0..=90).map(|v| format!("{:.6}", 100.0 * libm::cos(f64::from(v).to_radians()))).collect();
    let numbers = format!("1 1000 1 91 1 1 1 1 1 0 1 1 10\n{}\n0\n{}", vertical.join(","), candelas.join("\r\n"));
    let profile = IesProfile::parse(&file(&numbers)).unwrap();
    assert!((profile.flux_lm() / (100.0 * PI) - 1.0).abs() < 1e-4);
    assert_eq!(profile.size_m(), [0.3048, 0.3048, 0.0]);
    // nothing above the angles that were measured
    assert_eq!(profile.intensity_cd(Vec3::new(0.1, 0.01, 0.0)), 0.0);
}

#[test]
fn flux_is_the_integral_of_the_intensity_for_every_symmetry() {
    let planes: [(&str, usize); 6] =
        [("0", 1), ("0 30 90", 3), ("0 60 180", 3), ("90 150 270", 3), ("0 100 200 360", 4), ("0 72 144 216 288", 5)];
    for (angles, count) in planes {
        let candelas: Vec<String> = (0..count * 4).map(|i| ((i * 37 + 11) % 50 + 1).to_string()).collect();
        let numbers = format!("1 1000 2 4 {count} 1 2 0 0 0 0.5 1 10 0 50 110 180 {angles} {}", candelas.join(" "));
        let profile = IesProfile::parse(&file(&numbers)).unwrap();
        let (n, m) = (360, 720);
        let mut sum = 0.0;
        for i in 0..n {
            let v = (i as f32 + 0.5) * 180.0 / n as f32;
            let row: f64 = (0..m).map(|j| profile.intensity_cd(towards(v, (j as f32 + 0.5) * 360.0 / m as f32))).sum();
            sum += row * libm::sin(f64::from(v).to_radians());
        }
        let integral = sum * (PI / f64::from(n)) * (2.0 * PI / f64::from(m));
        assert!((profile.flux_lm() / integral - 1.0).abs() < 1e-3, "{angles}: {} {integral}", profile.flux_lm());
    }
}

#[test]
fn planes_lie_counterclockwise_from_east_and_are_mirrored() {
    let of = |angles: &str, candelas: &str, count: usize| {
        let numbers = format!("1 1000 1 2 {count} 1 2 0 0 0 1 1 10 0 180 {angles} {candelas}");
        IesProfile::parse(&file(&numbers)).unwrap()
    };
    // the same candelas at both vertical angles: 10 east, 20 north, 30 west, 40 south
    let all = of("0 90 180 270 360", "10 10 20 20 30 30 40 40 10 10", 5);
    let open = of("0 90 180 270", "10 10 20 20 30 30 40 40", 4);
    for profile in [&all, &open] {
        for (direction, candelas) in [(Vec3::X, 10.0), (Vec3::NEG_Z, 20.0), (Vec3::NEG_X, 30.0), (Vec3::Z, 40.0)] {
            assert!((profile.intensity_cd(direction) - candelas).abs() < 1e-9);
        }
        assert!((profile.intensity_cd(towards(90.0, 315.0)) - 25.0).abs() < 1e-4);
    }
    let quadrant = of("0 90", "10 10 20 20", 2);
    let halves = of("0 90 180", "10 10 20 20 30 30", 3);
    let across = of("90 180 270", "20 20 30 30 40 40", 3);
    for (a, in_quadrant, in_halves, in_across) in
        [(45.0, 15.0, 15.0, 25.0), (135.0, 15.0, 25.0, 25.0), (225.0, 15.0, 25.0, 35.0), (315.0, 15.0, 15.0, 35.0)]
    {
        for (profile, candelas) in [(&quadrant, in_quadrant), (&halves, in_halves), (&across, in_across)] {
            assert!((profile.intensity_cd(towards(90.0, a)) - candelas).abs() < 1e-3, "{a}");
        }
    }
}

#[test]
fn every_edition_is_read_with_its_own_factors() {
    let numbers = "TILT=NONE\n1 1000 2 2 1 1 2 0 0 0\n0.5 0.25 10\n0 180\n0\n100 100\n";
    for (header, standard, candelas) in [
        ("Some lamp of 1986\nits second label\n", IesStandard::Lm63_1986, 25.0),
        ("", IesStandard::Lm63_1986, 25.0),
        ("IESNA91\n[TEST] x\n", IesStandard::Lm63_1991, 25.0),
        ("IESNA:LM-63-1995\n[TEST] x\n[MORE] y\n", IesStandard::Lm63_1995, 100.0),
        ("IESNA:LM-63-2002\n", IesStandard::Lm63_2002, 100.0),
        ("IES:LM-63-2019\n", IesStandard::Later, 100.0),
    ] {
        let profile = IesProfile::parse(&format!("{header}{numbers}")).unwrap();
        assert_eq!((profile.standard(), profile.highest_cd()), (standard, candelas), "{header}");
        // lines may end in any way, a mark of the byte order and an end of file of DOS may stand around
        for ending in ["\r\n", "\r", "\n\n"] {
            let text = format!("\u{feff}{}\u{1a}", format!("{header}{numbers}").replace('\n', ending));
            assert_eq!(IesProfile::parse(&text).as_ref(), Ok(&profile));
        }
    }
    let latin = [b"IESNA91\n[LAMP] 30\xb0 \xfc\n".as_slice(), numbers.as_bytes()].concat();
    assert_eq!(IesProfile::from_bytes(&latin).unwrap().highest_cd(), 25.0);
}

#[test]
fn tilt_is_read_applied_or_refused() {
    let text = "IESNA:LM-63-1995\ntilt = include\n1\n3\n0 45 90\n1.0 0.9\n0.5\n1 1000 1 2 1 1 2 0 0 0 1 1 10 0 90 0 100 100";
    let profile = IesProfile::parse(text).unwrap();
    for (angle, factor) in [(0.0, 1.0), (22.5, 0.95), (90.0, 0.5), (170.0, 0.5)] {
        assert!((profile.tilt_factor(angle) - factor).abs() < 1e-12);
    }
    assert_eq!(IesProfile::parse(&file("1 1 1 2 1 1 2 0 0 0 1 1 1 0 90 0 1 1")).unwrap().tilt_factor(30.0), 1.0);
    let (line, elsewhere) = problem("IESNA91\nTILT=HPS.TLT\n1");
    assert_eq!((line, elsewhere), (2, IesProblem::TiltFile("HPS.TLT".to_owned())));
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    let head = "1 1000 1 3 1 1 2 0 0 0\n1 1 10\n";
    let value = |problem: IesProblem| matches!(problem, IesProblem::Value { .. });
    assert_eq!(problem(""), (1, IesProblem::NoTilt));
    assert_eq!(problem("a\nb\n\n"), (4, IesProblem::NoTilt));
    assert!(matches!(problem(&file("1 lots 1")), (5, IesProblem::NotANumber { what: "the lumens of a lamp", .. })));
    assert!(matches!(problem(&file("1 nan 1")), (5, IesProblem::NotANumber { .. })));
    assert!(matches!(problem(&file("1 1000\ninf 1")), (6, IesProblem::NotANumber { .. })));
    assert!(matches!(problem(&file("1 1000 1 3")), (5, IesProblem::Ends { what: "the number of horizontal angles" })));
    assert!(matches!(problem(&file("1 1 1 3 1 2 2 0 0 0")), (5, IesProblem::PhotometricType('B'))));
    assert!(matches!(problem(&file("1 1 1 3 1 3 2 0 0 0")), (5, IesProblem::PhotometricType('A'))));
    for numbers in ["1 1 0", "1 1 -1", "1 1 1 1", "1 1 1 2.5", "1 1 1 -3", "1 1 1 1e30", "1 1 1 3 0", "1 1 1 3 1 7"] {
        let (line, what) = problem(&file(numbers));
        assert!(line == 5 && value(what), "{numbers}");
    }
    assert!(matches!(problem(&file("1 1 1 10000 10000")), (5, IesProblem::TooMany { .. })));
    let (line, order) = problem(&file(&format!("{head}0 90\n80\n0\n1 2 3")));
    assert_eq!((line, order), (8, IesProblem::Order { what: "vertical angles", before: 90.0, after: 80.0 }));
    assert!(value(problem(&file(&format!("{head}0 90 181\n0\n1 2 3"))).1));
    assert!(matches!(
        problem(&file(&format!("{head}0 45 90\n0\n1 2"))),
        (9 | 10, IesProblem::Ends { what: "a candela value" })
    ));
    let (line, negative) = problem(&file(&format!("{head}0 45 90\n0\n1 -2 3")));
    assert!(line == 9 && value(negative));
    for angles in ["0 100", "10 90", "0 270", "90 180", "180 360"] {
        let text = file(&format!("1 1 1 2 2 1 2 0 0 0\n1 1 10\n0 90\n{angles}\n1 2 3 4"));
        assert!(matches!(problem(&text), (8, IesProblem::HorizontalRange { .. })), "{angles}");
    }
    let long = " ".repeat(MAX_BYTES + 1);
    assert!(matches!(problem(&long).1, IesProblem::TooLong { .. }));
    // counts that promise gigabytes take none
    assert!(matches!(problem(&file("1 1 1 10000 400 1 2 0 0 0 1 1 1 0 1 2")).1, IesProblem::Ends { .. }));
}

/// Pieces of files, right and wrong.
fn piece() -> impl Strategy<Value = String> {
    prop_oneof![
        Just("IESNA91\n".to_owned()),
        Just("IESNA:LM-63-2002\r\n".to_owned()),
        Just("TILT=NONE\n".to_owned()),
        Just("TILT=INCLUDE\n".to_owned()),
        Just("TILT=\u{e9}\n".to_owned()),
        Just("1 1000 1 2 1 1 2 0 0 0\n1 1 10\n".to_owned()),
        Just("0 90\n0\n".to_owned()),
        "[0-9eE+., -]{0,12}",
        "[a-z\u{1a}\u{0}\\[\\]=]{0,6}",
        (-5_i32..400).prop_map(|x| format!("{x} ")),
        any::<f64>().prop_map(|x| format!("{x} ")),
        any::<String>(),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_text_makes_the_parser_panic(pieces in prop::collection::vec(piece(), 0..30)) {
        let text = pieces.concat();
        match IesProfile::parse(&text) {
            Ok(profile) => {
                prop_assert!(profile.flux_lm().is_finite() && profile.flux_lm() >= 0.0);
                for d in [Vec3::X, Vec3::Y, Vec3::NEG_Y, Vec3::new(-0.3, -0.2, 0.5)] {
                    prop_assert!((0.0..=profile.highest_cd() * (1.0 + 1e-12)).contains(&profile.intensity_cd(d)));
                }
            }
            Err(error) => prop_assert!(error.line >= 1 && error.line <= text.split(['\n', '\r']).count()),
        }
    }

    #[test]
    fn no_bytes_make_the_parser_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = IesProfile::from_bytes(&bytes);
    }

    /// A valid file with one byte changed or its end cut off.
    #[test]
    fn damaged_files_are_read_or_refused(at in 0_usize..200, byte in any::<u8>(), end in 0_usize..260) {
        let mut bytes = crate::scenes::STREET_LAMP.as_bytes().to_vec();
        let last = bytes.len() - 1;
        bytes[at.min(last)] = byte;
        bytes.truncate(end);
        if let Ok(profile) = IesProfile::from_bytes(&bytes) {
            prop_assert!(profile.flux_lm().is_finite());
        }
    }
}
