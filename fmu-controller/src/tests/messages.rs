//! The messages of refused parameters name variables, not the fields that hold them.

use super::refusal;
use crate::{
    AttitudeEstimator, Btvsmc, BtvsmcDo, ControlAllocator, Crmpc, Dlmpc, Fbl, Lqr, SotvsmcDo,
    TwoLoopSmc,
};
use control::crmpc::{Constraints, InitialState};
use control::error_dynamics::Gain;
use fmi2_export::Model;

#[allow(clippy::too_many_lines)] // It is a list.
fn all() -> Vec<String> {
    fn of<M: Model>(changes: &[fn(&mut M)]) -> Vec<String> {
        changes.iter().map(|change| refusal::<M>(change)).collect()
    }
    [
        of::<Crmpc>(&[
            |unit| unit.parameters.period = 0.0,
            |unit| unit.parameters.period = 0.03,
            |unit| unit.parameters.limit_rate = 0.0,
            |unit| unit.parameters.limit_moment = 0.0,
            |unit| unit.parameters.limit_moment = 1e4,
            |unit| unit.parameters.latency.action = 1.5,
            |unit| unit.parameters.latency.action = 0.2,
            |unit| unit.parameters.latency.measurement = -0.1,
            |unit| unit.parameters.inertia.Ixx = 0.0,
            |unit| unit.parameters.inertia.Ixz = 2e6,
            |unit| unit.law.settings.period_optimisation = 0.0,
            |unit| unit.law.settings.observer.time_constant = 0.0,
            |unit| unit.law.settings.observer.stiffness = 0.0,
            |unit| unit.law.settings.p[4] = -1.0,
            |unit| unit.law.settings.q[1] = 0.0,
            |unit| unit.law.settings.horizon = 0,
            |unit| unit.law.settings.inertia_error = 1.0,
            |unit| unit.law.settings.angle_error = 1.0,
            |unit| unit.law.settings.rate_error = 1.0,
            |unit| unit.law.settings.rate_error = 0.01,
            |unit| unit.law.settings.delay_error = -0.01,
            |unit| unit.law.settings.delay_error = 0.01,
            |unit| {
                unit.parameters.latency.action = 0.04;
                unit.law.settings.delay_error = 0.03;
            },
            |unit| {
                unit.parameters.latency.action = 0.04;
                unit.law.settings.delay_error = 0.01;
                unit.law.settings.initial_state = InitialState::Tube;
            },
            |unit| unit.law.settings.sideslip_domain = 0.9,
            |unit| unit.law.settings.disturbance_bound = -1.0,
            |unit| unit.law.settings.feedback = Gain { k1: -700.0, k2: -50.0 },
            |unit| unit.law.settings.terminal = Gain { k1: -1.0, k2: -1.0 },
            |unit| unit.law.settings.terminal = Gain { k1: -20.0, k2: -11.0 },
            |unit| unit.law.settings.tube = Gain { k1: -1.0, k2: -1.0 },
            |unit| {
                unit.law.settings.initial_state = InitialState::Tube;
                unit.law.settings.feedback = Gain { k1: -5.0, k2: -2.0 };
            },
            |unit| {
                unit.law.settings.constraints = Constraints::Paper;
                unit.law.settings.disturbance_bound = 1.0;
            },
        ]),
        of::<Dlmpc>(&[
            |unit| unit.parameters.period = 0.03,
            |unit| unit.law.settings.p[1] = -1.0,
            |unit| unit.law.settings.sliding_mode.q = 60.0,
            |unit| unit.law.settings.sliding_mode.gamma = -1.0,
            |unit| unit.law.settings.sliding_mode.rho = 0.0,
            |unit| unit.parameters.limit_rate = 0.0,
        ]),
        of::<Lqr>(&[
            |unit| unit.parameters.period = -1.0,
            |unit| unit.parameters.period = 2.0,
            |unit| unit.law.settings.p[2] = -1.0,
            |unit| unit.law.settings.q[2] = 0.0,
            |unit| unit.parameters.latency.action = 1.5,
            |unit| unit.parameters.latency.measurement = -0.1,
            |unit| {
                unit.parameters.saturation = true;
                unit.parameters.limit_moment = 0.0;
            },
        ]),
        of::<Fbl>(&[
            |unit| unit.law.settings.kp = 0.0,
            |unit| unit.law.settings.kd = 0.0,
            |unit| unit.parameters.period = 1.0,
        ]),
        of::<Btvsmc>(&[
            |unit| unit.parameters.period = 0.5,
            |unit| unit.law.settings.threshold = 0.0,
            |unit| unit.law.settings.surface.c[1] = 0.0,
            |unit| unit.law.settings.surface.lambda = 0.0,
            |unit| unit.law.settings.reaching.eta[0] = 0.0,
            |unit| unit.law.settings.reaching.h[0] = 0.0,
        ]),
        of::<BtvsmcDo>(&[
            |unit| unit.law.observer.lambda[0] = 0.0,
            |unit| unit.law.observer.l[0] = 0.0,
        ]),
        of::<SotvsmcDo>(&[
            |unit| unit.law.settings.reaching.k3[0] = 0.0,
            |unit| unit.law.settings.reaching.m = 2.0,
            |unit| unit.law.settings.reaching.k2[1] = 0.5,
            |unit| unit.parameters.period = 11.0,
        ]),
        of::<TwoLoopSmc>(&[
            |unit| unit.parameters.period = 0.1,
            |unit| unit.law.settings.threshold = 0.0,
            |unit| unit.law.settings.filter = -1.0,
            |unit| unit.law.settings.disturbance[1] = -1.0,
            |unit| unit.law.settings.outer.k[0] = 0.0,
            |unit| unit.law.settings.outer.k[0] = 300.0,
            |unit| unit.law.settings.outer.layer.epsilon[0] = 0.0,
            |unit| unit.law.settings.outer.layer.b[1] = 1.0,
            |unit| unit.law.settings.inner.layer.rho[0] = 0.0,
            |unit| unit.law.settings.inner.layer.rho[0] = 0.01,
            |unit| unit.law.settings.inner.layer.rho[0] = 90.0,
        ]),
        of::<ControlAllocator>(&[
            |unit| unit.settings.period = 0.0,
            |unit| unit.settings.period = 0.0105,
            |unit| unit.settings.effectors.reference_pressure = 0.0,
            |unit| unit.settings.weight_moment.y = 0.0,
            |unit| unit.settings.weight_jet = -1.0,
            |unit| unit.settings.weight_surface = -1.0,
            |unit| unit.settings.threshold = -1.0,
            |unit| unit.settings.effectors.max[2] = -1.0,
            |unit| unit.settings.pwpf.gain = 0.0,
            |unit| unit.settings.pwpf.time_constant = 0.0,
            |unit| unit.settings.pwpf.on = 0.0,
            |unit| unit.settings.pwpf.off = 1e3,
        ]),
        of::<AttitudeEstimator>(&[
            |unit| unit.settings.period = 0.0,
            |unit| unit.settings.lost_after = 0.0,
            |unit| unit.settings.calibration_duration = 0.0,
            |unit| unit.settings.cutoff = 1e3,
            |unit| unit.settings.gains.proportional = 1e3,
            |unit| unit.settings.gains.integral = 1e9,
            |unit| {
                unit.sensor_set = 2;
                unit.settings.sensor_delay = 2.0;
            },
            |unit| unit.settings.rest_duration = -1.0,
            |unit| unit.settings.gates[0].range = 0.0,
            |unit| unit.settings.gates[2].jump = 0.0,
            |unit| {
                unit.sensor_set = 2;
                unit.settings.corrections[1].matrix.fill(0.0);
            },
        ]),
    ]
    .concat()
}

#[test]
fn refusals_name_variables() {
    let expected: Vec<&str> = include_str!("messages.txt").lines().collect();
    let found = all();
    for (found, expected) in found.iter().zip(&expected) {
        assert_eq!(found, expected);
    }
    assert_eq!(found, expected);
}
