//! Where the sun stands.
//!
//! By the Solar Position Algorithm (Reda and Andreas, "Solar Position Algorithm for Solar Radiation Applications", Solar Energy 76(5),
//! 2004; 0.0003 degrees for the years -2000 to 6000) through the crate `solar-positioning`, with its `libm` arithmetic, so that the bits are the
//! same everywhere.
//!
//! - **Length of day** (delta T, terrestrial minus universal time): Espenak and Meeus' polynomials from the year -500 on, as that
//!   crate updates them; before -500 their parabola `-20 + 32 u^2`, u in centuries from 1820. In 2000 BCE delta T is about 13 hours and known
//!   to an hour or so; that moves the sun along its yearly path by a few hundredths of a degree, and its place in the day not at all,
//!   because the time of day is universal time.
//! - **Refraction**: Saemundsson's formula (Sky and Telescope 72, 1986) at 1010 hPa and 10 degrees Celsius, as in Meeus, Astronomical
//!   Algorithms, chapter 16. The algorithm itself stops it at once where the sun's upper limb sets (-0.8334 degrees); here it fades out below, so
//!   that twilight is smooth.
//! - Dates are proleptic Gregorian; times are local, offset from universal time as the site says.

use crate::civil::{Date, TimeOfDay};
use crate::error::SkyError;
use glam::Vec3;
use heliodon_math::sphere::direction_from_azimuth_elevation;
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, SolarPositions, delta_t};

/// A place and its clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Degrees north.
    pub latitude_deg: f64,
    /// Degrees east.
    pub longitude_deg: f64,
    /// Hours by which local time is ahead of universal time.
    pub utc_offset_hours: f64,
    /// The compass bearing, clockwise, of the model's -Z.
    pub north_deg: f64,
}

/// Where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// Compass bearing in degrees, clockwise from north.
    pub azimuth_deg: f64,
    /// Height of the sun's middle above the horizon, as seen through the air.
    pub elevation_deg: f64,
    /// The same without refraction.
    pub geometric_elevation_deg: f64,
}

/// The geometric height of the sun's middle when its upper limb rises or sets: half a degree of refraction and the sun's radius.
pub const RISE_ELEVATION_DEG: f64 = -0.8333;

impl SunPosition {
    /// The direction to the sun in the model's frame.
    #[must_use]
    pub fn direction(&self, north_deg: f64) -> Vec3 {
        direction_from_azimuth_elevation((self.azimuth_deg - north_deg).to_radians(), self.elevation_deg.to_radians())
    }
}

/// Terrestrial minus universal time, in seconds, for a date from -2000 to 6000.
#[must_use]
pub fn delta_t_seconds(date: Date) -> f64 {
    let year = f64::from(date.year) + (f64::from(date.month) - 0.5) / 12.0;
    delta_t::estimate(year).unwrap_or_else(|_| {
        let centuries = (year - 1820.0) / 100.0;
        -20.0 + 32.0 * centuries * centuries
    })
}

/// Refraction in degrees at a geometric height, fading out below the horizon.
#[must_use]
pub fn refraction_deg(geometric_elevation_deg: f64) -> f64 {
    let formula = |h: f64| 1.02 / (60.0 * libm::tan((h + 10.3 / (h + 5.11)).to_radians()));
    if geometric_elevation_deg >= RISE_ELEVATION_DEG {
        formula(geometric_elevation_deg)
    } else {
        formula(RISE_ELEVATION_DEG) * libm::exp((geometric_elevation_deg - RISE_ELEVATION_DEG) / 1.5)
    }
}

/// Where the sun stands at a local date and time of day (in seconds since midnight; may lie outside of the day).
///
/// # Errors
/// Where the place lies off the Earth, or the date outside of the years -2000 to 6000.
pub fn sun_position(place: &Place, date: Date, seconds: f64) -> Result<SunPosition, SkyError> {
    let finite = place.utc_offset_hours.is_finite() && place.north_deg.is_finite() && seconds.is_finite();
    if !finite || place.utc_offset_hours.abs() > 24.0 {
        return Err(SkyError::setting("utc_offset", "is no offset of a clock", "give hours between -24 and 24, or HH:MM"));
    }
    // the day number is that of noon
    let julian = date.julian_day_number() as f64 - 0.5 + (seconds - place.utc_offset_hours * 3600.0) / 86_400.0;
    let wrong = |e: solar_positioning::Error| {
        SkyError::setting(
            "date, latitude_deg or longitude_deg",
            e.to_string(),
            "give a date from -2000 to 6000, a latitude from -90 to 90 and a longitude from -180 to 180",
        )
    };
    let time = JulianDate::new(julian, delta_t_seconds(date)).map_err(wrong)?;
    let location = Location { latitude: place.latitude_deg, longitude: place.longitude_deg };
    let position = SolarPositions::new().at_from_julian(time, location, 0.0, None).map_err(wrong)?;
    let geometric = position.elevation_angle();
    Ok(SunPosition {
        azimuth_deg: position.azimuth(),
        elevation_deg: geometric + refraction_deg(geometric),
        geometric_elevation_deg: geometric,
    })
}

/// The first rise above and the last fall below a geometric height within the local day; `None` where the sun stays on one side of it.
///
/// # Errors
/// As [`sun_position`].
pub fn rise_and_set(place: &Place, date: Date, height_deg: f64) -> Result<Option<(TimeOfDay, TimeOfDay)>, SkyError> {
    const STEP: f64 = 600.0;
    let above = |seconds: f64| sun_position(place, date, seconds).map(|p| p.geometric_elevation_deg > height_deg);
    // halves an interval of which one end is above and the other not, down to less than a second
    let crossing = |mut low: f64, mut high: f64| -> Result<f64, SkyError> {
        let low_side = above(low)?;
        while high - low > 0.25 {
            let middle = 0.5 * (low + high);
            if above(middle)? == low_side { low = middle } else { high = middle }
        }
        Ok(0.5 * (low + high))
    };
    let sides = (0..=144).map(|i| above(f64::from(i) * STEP)).collect::<Result<Vec<bool>, _>>()?;
    let pairs: Vec<(bool, bool)> = sides.windows(2).map(|w| (w[0], w[1])).collect();
    let rise = pairs.iter().position(|&p| p == (false, true));
    let set = pairs.iter().rposition(|&p| p == (true, false));
    match (rise, set) {
        (Some(rise), Some(set)) if rise < set => {
            let (rise, set) = (
                crossing(rise as f64 * STEP, (rise + 1) as f64 * STEP)?,
                crossing(set as f64 * STEP, (set + 1) as f64 * STEP)?,
            );
            Ok(Some((TimeOfDay::from_seconds(rise), TimeOfDay::from_seconds(set))))
        }
        _ => Ok(None),
    }
}
