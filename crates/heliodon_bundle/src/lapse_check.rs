//! Whether a lapse fits the light that a bundle stores.

use crate::chunk::LightLayout;
use crate::site::{MAX_SKY_STEPS, TimeOfDay};
use heliodon_sky::lapse::Lapse;

/// Checks a lapse against the stored light: steps in the order of time, coefficients, mask bits and functions as many as the
/// layout says, all numbers finite, directions of unit length.
///
/// # Errors
/// What is wrong, for a message.
pub fn check_lapse(lapse: &Lapse, layout: LightLayout) -> Result<(), String> {
    if lapse.steps.is_empty() || lapse.steps.len() > MAX_SKY_STEPS as usize {
        return Err(format!("the lapse has {} steps; it must have 1 to {MAX_SKY_STEPS}", lapse.steps.len()));
    }
    let mut before: Option<(TimeOfDay, u32)> = None;
    for (i, step) in lapse.steps.iter().enumerate() {
        let time: TimeOfDay = step.time.parse().map_err(|error| format!("step {i}: {error}"))?;
        if let Some((earlier, bit)) = before
            && (time <= earlier || step.mask_bit < bit)
        {
            return Err(format!("step {i} at {time}: times must rise and mask bits not fall"));
        }
        before = Some((time, step.mask_bit));
        if step.mask_bit >= layout.sun_steps {
            return Err(format!("step {i} names mask bit {} of {}", step.mask_bit, layout.sun_steps));
        }
        if step.sky.len() != layout.coefficients as usize {
            return Err(format!("step {i} has {} sky coefficients, not {}", step.sky.len(), layout.coefficients));
        }
        if !(step.exposure_stops.is_finite() && step.sky.as_flattened().iter().all(|c| c.is_finite())) {
            return Err(format!("step {i} holds a number that is not finite"));
        }
        if let Some(sun) = &step.sun {
            let length_squared: f32 = sun.direction.iter().map(|c| c * c).sum();
            if !(0.998..=1.002).contains(&length_squared) {
                return Err(format!("step {i}: the direction to the sun is not of unit length"));
            }
            if !sun.irradiance.iter().all(|c| c.is_finite() && *c >= 0.0) {
                return Err(format!("step {i}: the sun's irradiance is negative or not finite"));
            }
        }
        if let Some(fitted) = &step.fitted {
            if fitted.sky.len() != step.sky.len() || !fitted.sky.as_flattened().iter().all(|c| c.is_finite()) {
                return Err(format!("step {i}: the fitted sky must hold {} coefficients, all finite", step.sky.len()));
            }
            if !fitted.glow.iter().all(|c| c.is_finite() && *c >= 0.0) {
                return Err(format!("step {i}: the glow is negative or not finite"));
            }
            if step.sun.is_none() && fitted.glow != [0.0; 3] {
                return Err(format!("step {i} has a glow but no sun from whose direction it could come"));
            }
        }
    }
    let Some(basis) = &lapse.sun_bounce_basis else {
        return match layout.sun_bounce_functions {
            0 => Ok(()),
            r => Err(format!("the light has {r} functions of bounced sunlight, the lapse none")),
        };
    };
    let shape = (basis.functions.len(), basis.channels);
    if shape != (layout.sun_bounce_functions as usize, layout.channels) {
        let (r, c) = (layout.sun_bounce_functions, layout.channels);
        return Err(format!("bounced sunlight: the lapse has (functions, channels) {shape:?}, the light ({r}, {c})"));
    }
    for (r, function) in basis.functions.iter().enumerate() {
        if function.len() != layout.sun_steps as usize || !function.iter().all(|v| v.is_finite()) {
            return Err(format!("function {r} of bounced sunlight must hold {} finite numbers", layout.sun_steps));
        }
    }
    Ok(())
}
