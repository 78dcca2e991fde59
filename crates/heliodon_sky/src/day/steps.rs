//! The times of a day's entries.

use crate::civil::TimeOfDay;
use crate::error::SkyError;

/// The sun step of an entry.
pub(super) fn mask_bit(entry: u32, entries: u32, sun_steps: u32) -> u32 {
    (u64::from(entry) * u64::from(sun_steps) / u64::from(entries.max(1))) as u32
}

/// `count` times from `first` to `last`, evenly spread, both included.
pub(super) fn times(first: TimeOfDay, last: TimeOfDay, count: u32) -> Result<Vec<TimeOfDay>, SkyError> {
    if count == 1 {
        return Ok(vec![first]);
    }
    if last.seconds < first.seconds.saturating_add(count - 1) {
        return Err(SkyError::setting(
            "first and last",
            format!("{first} to {last} leaves no second for each of {count} entries"),
            "give a longer span, or fewer sky_steps",
        ));
    }
    let span = f64::from(last.seconds - first.seconds);
    Ok((0..count)
        .map(|i| TimeOfDay::from_seconds(f64::from(first.seconds) + span * f64::from(i) / f64::from(count - 1)))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_day_comes_out() {
        let day = times("06:57".parse().unwrap(), "17:34".parse().unwrap(), 184).unwrap();
        assert_eq!((day[0].to_string(), day[183].to_string()), ("06:57".into(), "17:34".into()));
        assert!(day.windows(2).all(|w| (208..=210).contains(&(w[1].seconds - w[0].seconds))));
        let bits: Vec<u32> = (0..184).map(|i| mask_bit(i, 184, 92)).collect();
        assert!((0..184).all(|i| bits[i] == i as u32 / 2));
    }

    #[test]
    fn every_sun_step_has_an_entry() {
        for (entries, suns) in [(7, 7), (10, 7), (100, 33), (1, 1)] {
            let mut seen = vec![false; suns as usize];
            (0..entries).for_each(|i| seen[mask_bit(i, entries, suns) as usize] = true);
            assert!(seen.iter().all(|&s| s));
        }
        assert!(times("10:00".parse().unwrap(), "10:00:05".parse().unwrap(), 10).is_err());
        assert!(times("10:00".parse().unwrap(), "09:00".parse().unwrap(), 2).is_err());
    }
}
