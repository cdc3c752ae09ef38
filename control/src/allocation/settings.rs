//! Settings of the allocator, with the published ones from `data/allocation.toml`.

use super::pwpf::Pwpf;
use crate::error::{DesignError, invalid, positive};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use std::sync::LazyLock;
use vehicle::data;
use vehicle::effectors::{Effectors, SURFACES, Surfaces};

/// Method that divides the moment among the effectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "AllocationMethod")]
pub enum Method {
    /// Minimises the moment error and the use of the jets over all effectors together.
    Optimal,
    /// The surfaces come first, within their limits and above threshold.dynamicPressure; the jets
    /// give the remainder.
    Blending,
}

/// Form of the commands to the jets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum JetCommand {
    /// 1 for on and 0 for off, by pulse-width pulse-frequency modulation.
    Pwpf,
    /// Duty cycle from 0 to 1, without modulation.
    Duty,
}

/// Settings of the allocator. Units SI, angles rad.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// Model of surfaces and jets and of their limits that the allocator uses.
    pub effectors: Effectors,
    /// Method of division among the effectors.
    pub method: Method,
    /// Form of the commands to the jets.
    pub jets: JetCommand,
    /// Time between allocations, s.
    pub period: f64,
    /// Weight W₁ of (60), 1/(N m).
    pub weight_moment: Vector3<f64>,
    /// Value of each entry of W₂.
    pub weight_jet: f64,
    /// Weight of ½ (deflection/range)², a term that (60) does not have.
    pub weight_surface: f64,
    /// Dynamic pressure above which blending uses the surfaces, Pa.
    pub threshold: f64,
    /// Modulator of the jets.
    pub pwpf: Pwpf,
    /// Largest number of iterations of the cone solver.
    pub max_iterations: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    period: f64,
    weight: Weight,
    pwpf: Pwpf,
    blending: Blending,
    solver: Solver,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Weight {
    moment: Vector3<f64>,
    jet: f64,
    surface: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Blending {
    threshold: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Solver {
    max_iterations: u32,
}

impl Settings {
    /// Returns the settings of Wu 2015, sections 5 and 6. Blending and all other values of ours are
    /// as in `data/allocation.toml`.
    pub fn published() -> Self {
        let &File { period, ref weight, pwpf, ref blending, ref solver } = embedded();
        Self {
            effectors: Effectors::published(),
            method: Method::Optimal,
            jets: JetCommand::Pwpf,
            period,
            weight_moment: weight.moment,
            weight_jet: weight.jet,
            weight_surface: weight.surface,
            threshold: blending.threshold,
            pwpf,
            max_iterations: solver.max_iterations,
        }
    }

    /// Returns the smallest and largest deflections, rad: (63) and (65).
    pub(super) fn limits(&self) -> (Surfaces, Surfaces) {
        let Effectors { min, max, allowed, .. } = &self.effectors;
        let within =
            |limits: &Surfaces| Surfaces::from_fn(|i, _| if allowed[i] { limits[i] } else { 0.0 });
        (within(min), within(max))
    }

    /// Checks all settings and returns the number of ticks per allocation.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub(super) fn ratio(&self) -> Result<u64, DesignError> {
        positive("period", self.period)?;
        positive("dynamicPressure.reference", self.effectors.reference_pressure)?;
        positive("weight.moment[1]", self.weight_moment.x)?;
        positive("weight.moment[2]", self.weight_moment.y)?;
        positive("weight.moment[3]", self.weight_moment.z)?;
        let not_negative = [
            ("weight.jet", self.weight_jet),
            ("weight.surface", self.weight_surface),
            ("threshold.dynamicPressure", self.threshold),
        ];
        for (name, value) in not_negative {
            if !(0.0..f64::INFINITY).contains(&value) {
                return Err(invalid(name, value, "must be finite and not negative"));
            }
        }
        let Effectors { effectiveness, jet_moments, min, max, rate, .. } = &self.effectors;
        if let Some(&value) =
            effectiveness.iter().chain(jet_moments).find(|value| !value.is_finite())
        {
            return Err(invalid("surfaceMoment, jetMoment", value, "must be finite"));
        }
        for i in 0..SURFACES {
            let (min, max, rate) = (min[i], max[i], rate[i]);
            let holds_zero = min <= 0.0 && 0.0 <= max && min.is_finite() && max.is_finite();
            if !(holds_zero && (0.0..f64::INFINITY).contains(&rate)) {
                return Err(DesignError::Surface { index: i + 1, min, max, rate });
            }
        }
        if self.jets == JetCommand::Duty {
            return Ok(1);
        }
        self.pwpf.check()?;
        let (period, pwpf) = (self.period, self.pwpf.period);
        let ratio = (period / pwpf).round();
        if ratio < 1.0 || (ratio * pwpf - period).abs() > 1e-9 * period {
            return Err(DesignError::Modulation { period, pwpf });
        }
        Ok(ratio as u64)
    }
}

fn embedded() -> &'static File {
    static READ: LazyLock<File> = LazyLock::new(|| {
        data::embedded("allocation.toml", include_str!("../../data/allocation.toml"))
    });
    &READ
}
