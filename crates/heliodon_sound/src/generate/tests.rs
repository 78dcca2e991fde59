use super::*;

fn made(kind: SoundKind, seed: u64, seconds: f64) -> Clip {
    generate(&GenerateParams { seed, seconds, ..GenerateParams::new(kind) }).expect("made")
}

/// The share of energy in bands below 300, 300 to 1,000, 1,000 to 3,000 and above 3,000 Hz.
fn bands(clip: &Clip) -> [f64; 4] {
    let mono: Vec<f64> = clip.samples().iter().step_by(clip.channels()).map(|s| f64::from(*s)).collect();
    let energy = |samples: Vec<f64>| samples.iter().map(|s| s * s).sum::<f64>();
    let whole = energy(mono.clone());
    let low =
        |hz| energy(canvas::filtered(canvas::filtered(mono.clone(), canvas::Pass::Low, hz, 0.54), canvas::Pass::Low, hz, 1.31));
    let [a, b, c] = [300.0, 1000.0, 3000.0].map(low);
    [a, b - a, c - b, whole - c].map(|part| part / whole)
}

#[test]
fn every_kind_is_made_the_same_each_time_and_is_normalised() {
    for kind in SoundKind::ALL {
        let seconds = kind.seconds().min(3.0);
        let (clip, again, other) = (made(*kind, 1, seconds), made(*kind, 1, seconds), made(*kind, 2, seconds));
        assert!(clip == again && clip != other, "{}", kind.name());
        assert_eq!(SoundKind::named(kind.name()), Some(*kind));
        let (peak, rms) = (f64::from(clip.peak()), f64::from(clip.rms()));
        assert!(peak < PEAK + 1e-3 && rms < RMS + 1e-3, "{}: {peak} {rms}", kind.name());
        assert!(peak > PEAK - 1e-3 || rms > RMS - 1e-3, "{}: {peak} {rms}", kind.name());
        assert!(clip.rms() > 0.008, "{}: {rms}", kind.name());
        let mean = clip.samples().iter().map(|s| f64::from(*s)).sum::<f64>() / clip.samples().len() as f64;
        assert!(mean.abs() < 1e-3, "{}: {mean}", kind.name());
    }
}

#[test]
fn loops_have_no_seam_and_strokes_begin_and_end_in_silence() {
    for kind in SoundKind::ALL {
        let clip = made(*kind, 3, if kind.is_loop() { 3.0 } else { kind.seconds() });
        let (samples, channels) = (clip.samples(), clip.channels());
        for channel in 0..channels {
            let one: Vec<f32> = samples.iter().skip(channel).step_by(channels).copied().collect();
            let bend = |a: f32, b: f32, c: f32| (a - 2.0 * b + c).abs();
            if kind.is_loop() {
                let mut inside: Vec<f32> = one.windows(3).map(|w| bend(w[0], w[1], w[2])).collect();
                inside.sort_by(f32::total_cmp);
                let n = one.len();
                let seam = bend(one[n - 2], one[n - 1], one[0]).max(bend(one[n - 1], one[0], one[1]));
                let usual = inside[inside.len() - 1 - inside.len() / 200];
                assert!(seam <= usual * 2.0, "{}: {seam} where {usual} is usual", kind.name());
            } else {
                assert!(one[0].abs() < 0.01 && one[one.len() - 1].abs() < 1e-3, "{}", kind.name());
            }
        }
    }
}

#[test]
fn spectra_are_where_they_belong() {
    let share = |kind: SoundKind| bands(&made(kind, 0, if kind.is_loop() { 6.0 } else { kind.seconds() }));
    let told = |kind: SoundKind, good: fn([f64; 4]) -> bool| {
        let bands = share(kind);
        assert!(good(bands), "{}: {bands:?}", kind.name());
    };
    told(SoundKind::Wind, |b| b[0] + b[1] > 0.8 && b[3] < 0.1);
    told(SoundKind::Cicadas, |b| b[3] > 0.9);
    told(SoundKind::Crickets, |b| b[2] + b[3] > 0.9);
    told(SoundKind::Birds, |b| b[2] + b[3] > 0.9);
    told(SoundKind::Crowd, |b| b[0] + b[1] > 0.5 && b[3] < 0.2);
    told(SoundKind::Chisel, |b| b[2] + b[3] > 0.4);
    told(SoundKind::Gold, |b| b[2] + b[3] > 0.4);
    told(SoundKind::Wood, |b| b[0] + b[1] > 0.7);
    told(SoundKind::Fire, |b| b[0] > 0.15 && b[2] + b[3] > 0.05);
    told(SoundKind::Water, |b| b[1] + b[2] > 0.5);
    told(SoundKind::StepsEarth, |b| b[0] + b[1] > 0.6);
}

#[test]
fn odd_parameters_are_refused() {
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY, 1.0e9] {
        let params = GenerateParams { seconds, ..GenerateParams::new(SoundKind::Chisel) };
        assert!(generate(&params).is_err());
    }
    assert!(generate(&GenerateParams { channels: 3, ..GenerateParams::new(SoundKind::Wind) }).is_err());
    assert!(generate(&GenerateParams { seconds: 1.0, ..GenerateParams::new(SoundKind::Wind) }).is_err());
}
