//! Settings of the allocator, with the published ones from `data/allocation.toml`.

use super::pwpf::Pwpf;
use crate::error::DesignError;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use std::sync::LazyLock;
use vehicle::axes::NUMBERED_AXES;
use vehicle::data::Tables;
use vehicle::effectors::{EffectorFault, EffectorFaultKind, Effectors, Surfaces};

/// Method that divides the moment among the effectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[setting(name = "AllocationMethod")]
pub enum Method {
    /// Minimises the moment error and the use of the jets over all effectors together.
    #[default]
    Optimal,
    /// The surfaces come first, within their limits and above threshold.dynamicPressure; the jets
    /// give the remainder.
    Blending,
}

/// Form of the commands to the jets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum JetCommand {
    /// 1 for on and 0 for off, by pulse-width pulse-frequency modulation.
    #[default]
    Pwpf,
    /// Duty cycle from 0 to 1, without modulation.
    Duty,
}

/// Settings of the allocator. Units SI, angles rad.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Settings {
    #[allow(missing_docs)] // Its type says what it is.
    pub method: Method,
    #[allow(missing_docs)]
    pub jets: JetCommand,
    /// Sampling period of the allocation; with jets = pwpf a whole multiple of pwpf.period.
    #[setting(unit = "s", min = 1e-4, max = 10.0, nominal = 0.01)]
    pub period: f64,
    /// Dynamic pressure above which method = blending uses the surfaces.
    #[setting(name = "threshold.dynamicPressure", unit = "Pa", min = 0.0, nominal = 1e3)]
    #[setting(used_with = "method = blending")]
    pub threshold: f64,
    /// Maximum number of iterations of the cone solver.
    #[setting(name = "solver.maxIterations", min = 1, max = 1000)]
    pub max_iterations: u32,
    /// Weight W1 on the missing moment, diagonal, in 1/(N m).
    #[setting(name = "weight.moment", each = NUMBERED_AXES, above = 0.0)]
    pub weight_moment: Vector3<f64>,
    /// Weight W2 on the duty cycle of each jet.
    #[setting(name = "weight.jet", min = 0.0)]
    pub weight_jet: f64,
    /// Weight on half the squared ratio of each deflection to its range; 0 gives the cost function
    /// as printed, whose optimum is not unique.
    #[setting(name = "weight.surface", min = 0.0)]
    pub weight_surface: f64,
    /// A surface or a jet whose failure the allocator knows.
    #[setting(name = "effector.fault")]
    pub fault: EffectorFault,
    /// Model of surfaces and jets and of their limits that the allocator uses.
    #[setting(skip)]
    pub effectors: Effectors,
    /// Modulator of the jets, whose settings count with `jets` = pwpf alone.
    #[setting(skip)]
    pub pwpf: Pwpf,
}

static FILE: LazyLock<Tables> =
    LazyLock::new(|| Tables::new("allocation.toml", include_str!("../../data/allocation.toml")));

impl Settings {
    /// Returns the settings of Wu 2015, sections 5 and 6. Blending and all other values of ours are
    /// as in `data/allocation.toml`.
    pub fn published() -> Self {
        let mut settings = Self { effectors: Effectors::published(), ..Self::default() };
        FILE.set("settings", &mut settings);
        FILE.set("modulator", &mut settings.pwpf);
        settings
    }

    /// Returns the smallest and largest deflections, rad: (63) and (65).
    pub(super) fn limits(&self) -> (Surfaces, Surfaces) {
        let Effectors { min, max, allowed, .. } = &self.effectors;
        let within =
            |limits: &Surfaces| Surfaces::from_fn(|i, _| if allowed[i] { limits[i] } else { 0.0 });
        (within(min), within(max))
    }

    /// Returns the settings once the fault has come, and the moment (N m) that a jet then gives
    /// all the time.
    pub(super) fn failed(&self) -> (Self, Vector3<f64>) {
        let mut settings = Self { fault: EffectorFault::default(), ..self.clone() };
        let (kind, failed) = self.fault.at(f64::INFINITY);
        let Effectors { rate, allowed, jet_moments, .. } = &mut settings.effectors;
        let mut always = Vector3::zeros();
        match kind {
            EffectorFaultKind::None => {}
            // Within a period it moves nowhere.
            EffectorFaultKind::Stuck => rate[failed] = 0.0,
            EffectorFaultKind::Floating => allowed[failed] = false,
            EffectorFaultKind::Slow => rate[failed] *= self.fault.share,
            EffectorFaultKind::JetOn | EffectorFaultKind::JetOff => {
                if kind == EffectorFaultKind::JetOn {
                    always = jet_moments.column(failed).into();
                }
                jet_moments.fill_column(failed, 0.0);
            }
        }
        (settings, always)
    }

    /// Checks all settings and returns the number of ticks per allocation.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub(super) fn ratio(&self) -> Result<u64, DesignError> {
        settings::check(self)?;
        self.fault.check(&self.effectors)?;
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
