//! Margins of loops whose characteristic polynomial is known.

use super::*;
use crate::Matrix;
use crate::components::{Component, Dynamics};
use crate::continuous::Continuous;
use crate::model::{Signal, Step};
use crate::propagation::Link;
use cosim::experiment::Coupling;
use fmi_master::delay::Reading;
use fmi_master::description::Carrier;
use fmi_master::wiring::Port;

/// Period, s, and gains of the angle and of the rate.
const STEP: f64 = 0.05;
const ANGLE: f64 = 2.25;
const RATE: f64 = 3.0;

fn component(name: &str, ports: [usize; 2], every: u64, dynamics: Dynamics) -> Component {
    let port =
        |variable: usize| Port { component: 0, variable, reference: 0, carrier: Carrier::Real };
    let [inputs, outputs] = ports.map(|count| (0..count).map(port).collect());
    Component { name: name.into(), every, first: 0, inputs, outputs, states: Vec::new(), dynamics }
}

/// Double integrators ẍ = u, each under u = −k x − c ẋ that is sampled at every step of the law.
/// The plant makes `per_step` communication steps meanwhile, and its input acts after `delay` (s).
fn double_integrators(axes: usize, delay: f64, per_step: u64) -> Net {
    let (none, one) = (Matrix::zeros(axes, axes), Matrix::identity(axes, axes));
    let stacked = |rows: [[&Matrix; 2]; 2]| {
        let mut all = Matrix::zeros(2 * axes, 2 * axes);
        for (i, row) in rows.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                all.view_mut((i * axes, j * axes), (axes, axes)).copy_from(block);
            }
        }
        all
    };
    let mut b = Matrix::zeros(2 * axes, axes);
    b.rows_mut(axes, axes).copy_from(&one);
    let plant = Continuous {
        a: stacked([[&none, &one], [&none, &none]]),
        b,
        c: Matrix::identity(2 * axes, 2 * axes),
        d: Matrix::zeros(2 * axes, axes),
        delay,
    };
    let mut d = Matrix::zeros(axes, 2 * axes);
    d.columns_mut(0, axes).copy_from(&(&one * -ANGLE));
    d.columns_mut(axes, axes).copy_from(&(&one * -RATE));
    let law = Step {
        a: Matrix::zeros(0, 0),
        b: Matrix::zeros(0, 2 * axes),
        c: Matrix::zeros(axes, 0),
        d,
    };
    let link = |from: (usize, usize), to: (usize, usize), opened: Option<usize>| Link {
        from,
        to,
        factor: 1.0,
        reading: if opened.is_some() { Reading::AfterStep } else { Reading::BeforeStep },
        opened,
    };
    let measured = (0..2 * axes).map(|i| link((1, i), (0, i), None));
    let commanded = (0..axes).map(|i| link((0, i), (1, i), Some(i)));
    Net {
        components: vec![
            component("law", [2 * axes, axes], per_step, Dynamics::Sampled(vec![law])),
            component("plant", [axes, 2 * axes], 1, Dynamics::Continuous(plant)),
        ],
        links: measured.chain(commanded).collect(),
        coupling: Coupling::Sequential,
        first: 0,
        length: STEP / per_step as f64,
        signals: (0..axes)
            .map(|i| Signal { name: format!("plant.u[{i}]"), unit: String::new(), size: 1.0 })
            .collect(),
    }
}

fn of(net: &Net) -> Margins {
    margins(net, &net.open())
}

fn near(found: Option<Crossing>, expected: f64) {
    let found = found.unwrap_or_else(|| panic!("no crossing, {expected} expected")).value;
    assert!((found - expected).abs() <= 1e-6 * expected, "{found} {expected}");
}

/// The loop's transfer function is (a z + b) / (z − 1)², with these a and b.
fn coefficients() -> (f64, f64) {
    let half = 0.5 * ANGLE * STEP * STEP;
    (RATE * STEP + half, half - RATE * STEP)
}

#[test]
fn oracle_without_delay_the_gain_is_limited_at_half_the_sampling_frequency() {
    // z² + (g a − 2) z + 1 + g b has the root −1 for g (a − b) = 4.
    let (a, b) = coefficients();
    for net in [double_integrators(1, 0.0, 1), double_integrators(1, 0.0, 4)] {
        let found = &of(&net).loops[0];
        near(found.classical.gain_above, 4.0 / (a - b));
        assert!(found.classical.gain_below.is_none());
    }
}

#[test]
fn oracle_phase_and_delay_follow_from_the_crossover() {
    // |a z + b|² = |z − 1|⁴ at z = e^{jθ} is a² + b² + 2 a b c = 4 (1 − c)² for c = cos θ.
    let (a, b) = coefficients();
    let (p, q) = (-2.0 - 0.5 * a * b, 1.0 - 0.25 * (a * a + b * b));
    let c = -0.5 * p - (0.25 * p * p - q).sqrt();
    let theta = c.acos();
    let phase_of = |re: f64, im: f64| im.atan2(re);
    let numerator = phase_of(a * c + b, a * theta.sin());
    let denominator = 2.0 * phase_of(c - 1.0, theta.sin());
    let margin = (std::f64::consts::PI + numerator - denominator).rem_euclid(std::f64::consts::TAU);
    let found = of(&double_integrators(1, 0.0, 1)).loops.remove(0).classical;
    near(found.phase, margin.to_degrees());
    let frequency = found.phase.unwrap().frequency;
    assert!((frequency - theta / STEP).abs() < 1e-4 * frequency, "{frequency} {}", theta / STEP);
}

#[test]
fn oracle_a_delay_of_one_step_is_a_cubic() {
    // z (z − 1)² + g (a z + b): by Jury's test stable below g = −(a + 2 b) / b².
    let (a, b) = coefficients();
    let found = of(&double_integrators(1, STEP, 1)).loops.remove(0).classical;
    near(found.gain_above, -(a + 2.0 * b) / (b * b));
}

#[test]
fn oracle_what_a_delay_takes_a_delay_margin_loses() {
    let whole = of(&double_integrators(1, 0.0, 1)).loops.remove(0).classical.delay.unwrap().value;
    for delay in [0.3 * STEP, STEP, 2.7 * STEP] {
        for per_step in [1, 5] {
            let left = of(&double_integrators(1, delay, per_step)).loops.remove(0).classical;
            near(left.delay, whole - delay);
        }
    }
}

#[test]
fn oracle_equal_loops_beside_one_another_have_the_margin_of_one() {
    let one = of(&double_integrators(1, 0.0, 1));
    let three = of(&double_integrators(3, 0.0, 1));
    let together = three.together.unwrap();
    let single = &one.loops[0];
    assert!((together.disk.alpha - single.disk.alpha).abs() < 1e-6);
    assert!((together.sensitivity.value - single.sensitivity.value).abs() < 1e-6);
    near(together.classical.gain_above, single.classical.gain_above.unwrap().value);
}

#[test]
fn oracle_the_disk_is_the_one_that_the_nyquist_curve_touches() {
    let (a, b) = coefficients();
    let (mut largest, mut sensitivity) = (0.0_f64, 0.0_f64);
    for k in 1..200_000 {
        let z = nalgebra::Complex::from_polar(1.0, std::f64::consts::PI * f64::from(k) / 2e5);
        let l = (z * a + b) / ((z - 1.0) * (z - 1.0));
        let s = (l + 1.0).inv();
        largest = largest.max((s - 0.5).norm());
        sensitivity = sensitivity.max(s.norm());
    }
    let found = &of(&double_integrators(1, 0.0, 1)).loops[0];
    assert!((found.disk.alpha * largest - 1.0).abs() < 1e-6, "{} {largest}", found.disk.alpha);
    assert!((found.sensitivity.value / sensitivity - 1.0).abs() < 1e-6);
}

#[test]
fn a_loop_that_is_unstable_has_no_margins() {
    let found = of(&double_integrators(1, 1.0, 1));
    assert!(!found.stable && found.loops.is_empty() && found.spectral_radius > 1.0);
}
