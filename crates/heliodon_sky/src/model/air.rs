//! The air: what scatters and absorbs at each height, and how much light comes through.
//!
//! Densities as in Bruneton and Neyret, "Precomputed Atmospheric Scattering", EGSR 2008, with ozone after Bruneton, "A Qualitative and
//! Quantitative Evaluation of 8 Clear Sky Models", TVCG 2017. Lengths in kilometres.

use super::spectrum::{COUNT, Spectrum, WAVELENGTHS_NM, ozone_m2};

/// The Earth's radius.
pub(crate) const GROUND_KM: f32 = 6360.0;
/// Where the air is taken to end.
pub(crate) const TOP_KM: f32 = 6460.0;

const RAYLEIGH_HEIGHT_KM: f32 = 8.0;
const AEROSOL_HEIGHT_KM: f32 = 1.2;
const AEROSOL_SCATTERED: f32 = 0.9;

/// Asymmetry of the light that fine and that coarse aerosols scatter. One lobe of the usual 0.8 spreads the aureole into a disc twenty degrees wide; measured
/// phase functions have a narrow peak over a broad base (Dubovik et al., "Variability of Absorption and Optical Properties of Key Aerosol Types", 2002), and
/// the base is the fine particles' and bluer than the peak.
pub(crate) const ASYMMETRY: [f32; 2] = [0.58, 0.86];
/// The fine particles' share of the aerosols' extinction at 550 nm, and how it falls with the wavelength (Angstrom's exponent); that of the coarse
/// ones is even. Together they have an exponent of 1.33 between 440 and 870 nm (Preetham et al. 1999 take 1.3 for all).
const FINE: (f64, f64) = (0.8, 1.9);

/// Scattering and extinction at sea level, per km.
#[derive(Clone, Debug)]
pub(crate) struct Air {
    rayleigh: Spectrum,
    /// Extinction by aerosols of each mode: haze and smoke, and dust.
    fine: Spectrum,
    coarse: Spectrum,
    /// What aerosols of each mode scatter of the light that they take away.
    scattered: [f32; 2],
    /// Where ozone is densest.
    ozone: Spectrum,
    through: Vec<Spectrum>,
}

/// What a point of the air does to light, per km.
pub(crate) struct Local {
    pub rayleigh: Spectrum,
    pub fine: Spectrum,
    pub coarse: Spectrum,
    pub extinction: Spectrum,
}

impl Local {
    /// What of it spreads evenly (see [`Air::even`]).
    pub(crate) fn even_scattering(&self, k: usize) -> f32 {
        self.rayleigh[k] + self.fine[k] * (1.0 - ASYMMETRY[0]) + self.coarse[k] * (1.0 - ASYMMETRY[1])
    }

    /// By air and aerosols together.
    pub(crate) fn scattering(&self, k: usize) -> f32 {
        self.rayleigh[k] + self.fine[k] + self.coarse[k]
    }
}

/// The optical depth of the whole air without aerosols, at sea level: Bodhaine et al., "On Rayleigh Optical Depth Calculations", Journal of Atmospheric and
/// Oceanic Technology 16, 1999, equation 30. 0.097 at 550 nm; the 0.108 that much of graphics uses makes skies too pale.
fn rayleigh_depth(nm: f64) -> f64 {
    let um2 = (nm / 1000.0) * (nm / 1000.0);
    0.002_152 * (1.045_599_6 - 341.290_61 / um2 - 0.902_308_50 * um2) / (1.0 + 0.002_705_988_9 / um2 - 85.968_563 * um2)
}

const THROUGH_ANGLES: usize = 192;
const THROUGH_HEIGHTS: usize = 48;

impl Air {
    /// Air of a turbidity: the optical depth of air with aerosols over that of air alone, at 550 nm.
    pub(crate) fn new(turbidity: f32) -> Self {
        let aerosol_550 = (f64::from(turbidity) - 1.0).max(0.0) * rayleigh_depth(550.0) / f64::from(AEROSOL_HEIGHT_KM);
        let (fine_share, exponent) = FINE;
        // 300 Dobson units of 2.687e20 molecules/m2 in a layer whose profile integrates to 15 km
        let ozone_density = 300.0 * 2.687e20 / 15_000.0;
        Self {
            rayleigh: WAVELENGTHS_NM.map(|nm| rayleigh_depth(nm) as f32 / RAYLEIGH_HEIGHT_KM),
            fine: WAVELENGTHS_NM.map(|nm| (aerosol_550 * fine_share * libm::pow(nm / 550.0, -exponent)) as f32),
            coarse: [(aerosol_550 * (1.0 - fine_share)) as f32; COUNT],
            scattered: [AEROSOL_SCATTERED; 2],
            ozone: WAVELENGTHS_NM.map(|nm| (ozone_m2(nm) * ozone_density * 1000.0) as f32),
            through: Vec::new(),
        }
        .tabulated()
    }

    /// The air that scatters evenly in all directions and spreads light as far as this one does: what aerosols send on nearly straight counts as
    /// not scattered (the similarity relation of van de Hulst, "Multiple Light Scattering", 1980). Higher orders are reckoned in it; with
    /// the aerosols' whole scattering taken as even, much of the sun's and the ground's light would be turned back, and the sky go pale and violet.
    pub(crate) fn even(&self) -> Self {
        let mut even = self.clone();
        for (mode, asymmetry) in ASYMMETRY.into_iter().enumerate() {
            let kept = 1.0 - self.scattered[mode] * asymmetry;
            let extinction = if mode == 0 { &mut even.fine } else { &mut even.coarse };
            extinction.iter_mut().for_each(|e| *e *= kept);
            even.scattered[mode] *= (1.0 - asymmetry) / kept;
        }
        even.tabulated()
    }

    fn tabulated(mut self) -> Self {
        self.through = (0..THROUGH_HEIGHTS * THROUGH_ANGLES)
            .map(|i| {
                let (row, column) = (i / THROUGH_ANGLES, i % THROUGH_ANGLES);
                let (r, mu) =
                    Self::unmap(row as f32 / (THROUGH_HEIGHTS - 1) as f32, column as f32 / (THROUGH_ANGLES - 1) as f32);
                self.integrate_to_top(r, mu)
            })
            .collect();
        self
    }

    /// The air at a height above the ground.
    pub(crate) fn at(&self, height_km: f32) -> Local {
        let height = height_km.max(0.0);
        let r = libm::expf(-height / RAYLEIGH_HEIGHT_KM);
        let a = libm::expf(-height / AEROSOL_HEIGHT_KM);
        let o = (1.0 - (height - 25.0).abs() / 15.0).max(0.0);
        let mut local = Local { rayleigh: [0.0; COUNT], fine: [0.0; COUNT], coarse: [0.0; COUNT], extinction: [0.0; COUNT] };
        for k in 0..COUNT {
            local.rayleigh[k] = self.rayleigh[k] * r;
            local.fine[k] = self.fine[k] * (self.scattered[0] * a);
            local.coarse[k] = self.coarse[k] * (self.scattered[1] * a);
            local.extinction[k] = local.rayleigh[k] + (self.fine[k] + self.coarse[k]) * a + self.ozone[k] * o;
        }
        local
    }

    /// Light that comes from the top of the air to radius `r` from a direction whose cosine to the vertical is `mu`; nothing through
    /// the Earth, with the edge as soft as the sun is wide.
    pub(crate) fn through(&self, r: f32, mu: f32) -> Spectrum {
        /// The sun's radius in radians.
        const SOFT: f32 = 0.004_65;
        let horizon = -((1.0 - (GROUND_KM / r) * (GROUND_KM / r)).max(0.0)).sqrt();
        // near the horizon differences of cosines are differences of angles
        let seen = ((mu - horizon) / (2.0 * SOFT) + 0.5).clamp(0.0, 1.0);
        let seen = seen * seen * (3.0 - 2.0 * seen);
        if seen == 0.0 {
            return [0.0; COUNT];
        }
        let (row, column) = Self::map(r, mu.max(horizon));
        let (row, column) = (row * (THROUGH_HEIGHTS - 1) as f32, column * (THROUGH_ANGLES - 1) as f32);
        let (i, j) = ((row as usize).min(THROUGH_HEIGHTS - 2), (column as usize).min(THROUGH_ANGLES - 2));
        let (fy, fx) = (row - i as f32, column - j as f32);
        let base = i * THROUGH_ANGLES + j;
        let (a, b) = (&self.through[base], &self.through[base + 1]);
        let (c, d) = (&self.through[base + THROUGH_ANGLES], &self.through[base + THROUGH_ANGLES + 1]);
        std::array::from_fn(|k| {
            let low = a[k] + (b[k] - a[k]) * fx;
            let high = c[k] + (d[k] - c[k]) * fx;
            (low + (high - low) * fy) * seen
        })
    }

    /// Bruneton's coordinates: distances to the horizon and to the top, scaled to [0, 1].
    fn map(r: f32, mu: f32) -> (f32, f32) {
        let longest = (TOP_KM * TOP_KM - GROUND_KM * GROUND_KM).sqrt();
        let rho = (r * r - GROUND_KM * GROUND_KM).max(0.0).sqrt();
        let distance = (r * r * (mu * mu - 1.0) + TOP_KM * TOP_KM).max(0.0).sqrt() - r * mu;
        let (least, most) = (TOP_KM - r, rho + longest);
        ((rho / longest).clamp(0.0, 1.0), ((distance - least) / (most - least)).clamp(0.0, 1.0))
    }

    fn unmap(row: f32, column: f32) -> (f32, f32) {
        let longest = (TOP_KM * TOP_KM - GROUND_KM * GROUND_KM).sqrt();
        let rho = row * longest;
        let r = (rho * rho + GROUND_KM * GROUND_KM).sqrt();
        let (least, most) = (TOP_KM - r, rho + longest);
        let distance = least + column * (most - least);
        let mu =
            if distance > 1e-3 { (longest * longest - rho * rho - distance * distance) / (2.0 * r * distance) } else { 1.0 };
        (r, mu.clamp(-1.0, 1.0))
    }

    fn integrate_to_top(&self, r: f32, mu: f32) -> Spectrum {
        const STEPS: u32 = 96;
        let (r, mu) = (f64::from(r), f64::from(mu));
        let top = f64::from(TOP_KM);
        let length = (r * r * (mu * mu - 1.0) + top * top).max(0.0).sqrt() - r * mu;
        let mut depth = [0.0_f64; COUNT];
        let mut before = 0.0;
        for i in 0..STEPS {
            // finer near the start, where the air is dense
            let after = length * libm::pow(f64::from(i + 1) / f64::from(STEPS), 2.0);
            let t = 0.5 * (before + after);
            let height = (r * r + t * t + 2.0 * r * mu * t).sqrt() - f64::from(GROUND_KM);
            let local = self.at(height as f32);
            for (sum, extinction) in depth.iter_mut().zip(local.extinction) {
                *sum += f64::from(extinction) * (after - before);
            }
            before = after;
        }
        depth.map(|d| libm::exp(-d) as f32)
    }
}
