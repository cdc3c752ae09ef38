//! The messages of refused parameters name variables, not the fields that hold them.

use super::refusal;
use crate::{
    AttitudeEstimator, Btvsmc, BtvsmcDo, ControlAllocator, Crmpc, Dlmpc, Fbl, Lqr, SotvsmcDo,
    TwoLoopSmc,
};
use control::crmpc::Constraints;
use control::error_dynamics::Gain;
use fmi_export::Model;

#[allow(clippy::too_many_lines)] // It is a list.
fn refusals() -> Vec<String> {
    fn messages<M: Model>(changes: &[fn(&mut M)]) -> Vec<String> {
        changes.iter().map(|change| refusal::<M>(change)).collect()
    }
    [
        messages::<Crmpc>(&[
            |instance| instance.settings.period_feedback = 0.0,
            |instance| instance.settings.period_feedback = 0.03,
            |instance| instance.parameters.limit_rate = 0.0,
            |instance| instance.parameters.limit_moment = 0.0,
            |instance| instance.parameters.limit_moment = 1e4,
            |instance| instance.parameters.latency.action = 1.5,
            |instance| instance.parameters.latency.action = 0.3,
            |instance| instance.parameters.latency.measurement = -0.1,
            |instance| instance.settings.period_optimisation = 0.0,
            |instance| instance.settings.observer.time_constant = 0.0,
            |instance| instance.settings.observer.stiffness = 0.0,
            |instance| instance.settings.p[4] = -1.0,
            |instance| instance.settings.q[1] = 0.0,
            |instance| instance.settings.horizon = 0,
            |instance| instance.settings.inertia_error = 1.0,
            |instance| instance.settings.angle_error = 1.0,
            |instance| instance.settings.rate_error = 1.0,
            |instance| instance.settings.rate_error = 0.01,
            |instance| instance.settings.sideslip_domain = 0.9,
            |instance| instance.settings.disturbance_bound = -1.0,
            |instance| instance.settings.feedback = Gain { k1: -700.0, k2: -50.0 },
            |instance| instance.settings.feedback = Gain { k1: -1.5, k2: 0.0 },
            |instance| {
                instance.settings.feedback = Gain { k1: -5.0, k2: -5.0 };
                instance.settings.disturbance_bound = 2.5_f64.to_radians();
            },
            |instance| instance.settings.terminal = Gain { k1: -1.0, k2: -1.0 },
            |instance| instance.settings.terminal = Gain { k1: -20.0, k2: -11.0 },
            |instance| instance.settings.tube = Gain { k1: -1.0, k2: -1.0 },
            |instance| {
                instance.settings.constraints = Constraints::Paper;
                instance.settings.disturbance_bound = 1.0;
            },
        ]),
        messages::<Dlmpc>(&[
            |instance| instance.settings.period_feedback = 0.03,
            |instance| instance.settings.p[1] = -1.0,
            |instance| instance.settings.sliding_mode.q = 60.0,
            |instance| instance.settings.sliding_mode.gamma = -1.0,
            |instance| instance.settings.sliding_mode.rho = 0.0,
            |instance| instance.parameters.limit_rate = 0.0,
        ]),
        messages::<Lqr>(&[
            |instance| instance.settings.period = -1.0,
            |instance| instance.settings.period = 2.0,
            |instance| instance.settings.p[2] = -1.0,
            |instance| instance.settings.q[2] = 0.0,
            |instance| instance.parameters.latency.action = 1.5,
            |instance| instance.parameters.latency.measurement = -0.1,
            |lqr| (lqr.parameters.saturation, lqr.parameters.limit_moment) = (true, 0.0),
        ]),
        messages::<Fbl>(&[
            |instance| instance.settings.kp = 0.0,
            |instance| instance.settings.kd = 0.0,
            |instance| instance.settings.period = 1.0,
        ]),
        messages::<Btvsmc>(&[
            |instance| instance.settings.period = 0.5,
            |instance| instance.settings.threshold = 0.0,
            |instance| instance.settings.surface.c[1] = 0.0,
            |instance| instance.settings.surface.lambda = 0.0,
            |instance| instance.settings.reaching.eta[0] = 0.0,
            |instance| instance.settings.reaching.h[0] = 0.0,
        ]),
        messages::<BtvsmcDo>(&[
            |instance| instance.settings.observer.lambda[0] = 0.0,
            |instance| instance.settings.observer.l[0] = 0.0,
        ]),
        messages::<SotvsmcDo>(&[
            |instance| instance.settings.law.reaching.k3[0] = 0.0,
            |instance| instance.settings.law.reaching.m = 2.0,
            |instance| instance.settings.law.reaching.k2[1] = 0.5,
            |instance| instance.settings.law.period = 11.0,
        ]),
        messages::<TwoLoopSmc>(&[
            |instance| instance.settings.period = 0.1,
            |instance| instance.settings.threshold = 0.0,
            |instance| instance.settings.filter = -1.0,
            |instance| instance.settings.disturbance[1] = -1.0,
            |instance| instance.settings.outer.k[0] = 0.0,
            |instance| instance.settings.outer.k[0] = 300.0,
            |instance| instance.settings.outer.layer.epsilon[0] = 0.0,
            |instance| instance.settings.outer.layer.b[1] = 1.0,
            |instance| instance.settings.inner.layer.rho[0] = 0.0,
            |instance| instance.settings.inner.layer.rho[0] = 0.01,
            |instance| instance.settings.inner.layer.rho[0] = 90.0,
        ]),
        messages::<ControlAllocator>(&[
            |instance| instance.settings.period = 0.0,
            |instance| instance.settings.period = 0.0105,
            |instance| instance.settings.weight_moment.y = 0.0,
            |instance| instance.settings.weight_jet = -1.0,
            |instance| instance.settings.weight_surface = -1.0,
            |instance| instance.settings.threshold = -1.0,
            |instance| instance.settings.pwpf.gain = 0.0,
            |instance| instance.settings.pwpf.time_constant = 0.0,
            |instance| instance.settings.pwpf.on = 0.0,
            |instance| instance.settings.pwpf.on = 4.5,
            |instance| instance.settings.pwpf.off = 1e3,
        ]),
        messages::<AttitudeEstimator>(&[
            |instance| instance.settings.period = 0.0,
            |instance| instance.settings.lost_after = 0.0,
            |instance| instance.settings.calibration_duration = 0.0,
            |instance| instance.settings.cutoff = 1e3,
            |instance| instance.settings.gains.proportional = 1e3,
            |instance| instance.settings.gains.integral = 1e9,
            |estimator| (estimator.settings.sensor_set, estimator.settings.sensor_delay) = (2, 2.0),
            |instance| instance.settings.rest_duration = -1.0,
            |instance| instance.settings.gates[0].range = 0.0,
            |instance| instance.settings.gates[2].jump = 0.0,
            |instance| {
                instance.settings.sensor_set = 2;
                instance.settings.corrections[1].matrix.fill(0.0);
            },
        ]),
    ]
    .concat()
}

#[test]
fn refusals_name_variables() {
    let expected: Vec<&str> = include_str!("messages.txt").lines().collect();
    let messages = refusals();
    for (message, expected) in messages.iter().zip(&expected) {
        assert_eq!(message, expected);
    }
    assert_eq!(messages, expected);
}
