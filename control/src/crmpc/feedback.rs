//! The feedback law (20) about the nominal trajectory, which both laws share.

use super::memory::Memory;
use super::plan;
use super::settings::Settings;
use super::state::{join, split};
use crate::controller::{Measurement, ReferenceAt};
use nalgebra::{Vector3, Vector6};
use vehicle::kinematics;

/// Inputs of a law at a tick.
pub(super) struct Tick<'a> {
    /// Feedback ticks since the last optimisation; the next one is due if there are none.
    pub within: u64,
    /// Time, s.
    pub time: f64,
    pub measured: &'a Measurement,
    /// Measured rates x_ω, rad/s.
    pub angle_rates: Vector3<f64>,
    /// Measured state (Θ, x_ω), rad and rad/s.
    pub state: Vector6<f64>,
    pub reference: ReferenceAt<'a>,
}

impl<'a> Tick<'a> {
    pub(super) fn new(
        within: u64,
        time: f64,
        measured: &'a Measurement,
        reference: ReferenceAt<'a>,
    ) -> Self {
        let angle_rates = kinematics::r(&measured.angles) * measured.rates;
        let state = join(&measured.angles, &angle_rates);
        Self { within, time, measured, angle_rates, state, reference }
    }
}

/// The feedback law (20): with ũ* = a − f(x̃*), u = K O_e − f(x) + a and m = I R⁻¹ u.
pub(super) struct Feedback {
    /// Deviation O_e of the angles and of the rates x_ω from the nominal state, rad and rad/s.
    pub deviation: [Vector3<f64>; 2],
    /// Nominal acceleration a, rad/s².
    pub nominal: Vector3<f64>,
    /// Commanded acceleration a + K O_e, with what compensates for a disturbance, rad/s².
    pub commanded: Vector3<f64>,
}

impl Feedback {
    /// Moves the nominal state of `memory` on to the tick, and returns the feedback about it with
    /// this `compensation` for a disturbance, rad/s².
    pub(super) fn new(
        settings: &Settings,
        memory: &mut Memory,
        tick: &Tick,
        compensation: &Vector3<f64>,
    ) -> Self {
        let (k, nominal) = (settings.feedback, memory.plan.accelerations[0]);
        let elapsed = tick.within as f64 * settings.period_feedback;
        memory.nominal = plan::advance(&memory.plan.states[0], &nominal, elapsed);
        let (angles, rates) = split(&(tick.state - memory.nominal));
        let commanded = nominal + angles * k.k1 + rates * k.k2 + compensation;
        Self { deviation: [angles, rates], nominal, commanded }
    }
}
