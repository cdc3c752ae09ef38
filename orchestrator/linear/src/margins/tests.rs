//! Margins of loops whose characteristic polynomial is known.

use super::*;
use crate::Matrix;
use crate::model::{Signal, Step};

/// Period, s, and gains of the angle and of the rate.
const STEP: f64 = 0.05;
const ANGLE: f64 = 2.25;
const RATE: f64 = 3.0;

/// Step of a double integrator ẍ = u under u = −k x − c ẋ, which is sampled at every step and
/// arrives after a number of steps.
fn double_integrator(delay: usize) -> Step {
    let states = 2 + delay;
    let mut one = Step {
        a: Matrix::zeros(states, states),
        b: Matrix::zeros(states, 1),
        c: Matrix::zeros(1, states),
        d: Matrix::zeros(1, 1),
    };
    one.a.view_mut((0, 0), (2, 2)).copy_from_slice(&[1.0, 0.0, STEP, 1.0]);
    one.b.rows_mut(0, 2).copy_from_slice(&[0.5 * STEP * STEP, STEP]);
    let law = [-ANGLE, -RATE];
    if delay == 0 {
        one.c.copy_from_slice(&law);
        return one;
    }
    one.c[states - 1] = 1.0;
    (0..2).for_each(|place| one.a[(2, place)] = law[place]);
    (3..states).for_each(|state| one.a[(state, state - 1)] = 1.0);
    one
}

/// The loops of so many axes beside one another.
fn double_integrators(axes: usize, delay: usize) -> OpenLoop {
    let all = |matrix: &Matrix| Matrix::identity(axes, axes).kronecker(matrix);
    let Step { a, b, c, d } = double_integrator(delay);
    let step = Step { a: all(&a), b: all(&b), c: all(&c), d: all(&d) };
    let signal = |axis| Signal { name: format!("plant.u[{axis}]"), unit: String::new(), size: 1.0 };
    OpenLoop::new(&[step], &(0..axes).map(signal).collect::<Vec<_>>(), STEP, 0.0)
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
    let found = &margins(&double_integrators(1, 0)).loops[0];
    near(found.classical.gain_above, 4.0 / (a - b));
    assert!(found.classical.gain_below.is_none());
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
    let found = margins(&double_integrators(1, 0)).loops.remove(0).classical;
    near(found.phase, margin.to_degrees());
    let frequency = found.phase.unwrap().frequency;
    assert!((frequency - theta / STEP).abs() < 1e-4 * frequency, "{frequency} {}", theta / STEP);
}

#[test]
fn oracle_a_delay_of_one_step_is_a_cubic() {
    // z (z − 1)² + g (a z + b): by Jury's test stable below g = −(a + 2 b) / b².
    let (a, b) = coefficients();
    let found = margins(&double_integrators(1, 1)).loops.remove(0).classical;
    near(found.gain_above, -(a + 2.0 * b) / (b * b));
}

#[test]
fn oracle_what_a_delay_takes_a_delay_margin_loses() {
    let whole = margins(&double_integrators(1, 0)).loops.remove(0).classical.delay.unwrap().value;
    for delay in [1, 2, 5] {
        let left = margins(&double_integrators(1, delay)).loops.remove(0).classical;
        near(left.delay, whole - delay as f64 * STEP);
    }
}

#[test]
fn oracle_a_delay_of_whole_steps_is_a_chain_of_states() {
    for delay in [0, 1, 2, 5] {
        let [chain, delayed] = [
            double_integrators(2, delay).closed(&[1.0, 1.0]),
            double_integrators(2, 0).delayed(&[0, 1], delay as f64),
        ];
        let [chain, delayed] = [chain, delayed].map(|a| spectral_radius(&a.unwrap()));
        assert!((chain - delayed).abs() < 1e-9, "{delay}: {chain} {delayed}");
    }
}

#[test]
fn oracle_a_loop_has_the_same_margins_over_two_of_its_steps() {
    let one = double_integrators(1, 3);
    let twice = OpenLoop::new(&[one.step.clone(), one.step.clone()], &one.signals, STEP, 0.0);
    assert_eq!((twice.samples, twice.period), (2, 2.0 * STEP));
    let [one, twice] = [one, twice].map(|open| margins(&open).loops.remove(0));
    near(twice.classical.gain_above, one.classical.gain_above.unwrap().value);
    near(twice.classical.delay, one.classical.delay.unwrap().value);
    assert!((twice.disk.alpha - one.disk.alpha).abs() < 1e-6);
}

#[test]
fn integrators_that_are_known_with_an_error_have_no_lower_gain_margin() {
    // Eigenvalues 1 ± e of the double integrator make it unstable at low gains.
    let e = 1e-2;
    let mut open = double_integrators(1, 0);
    open.step.a[(1, 0)] = e * e / STEP;
    let found = |open: &OpenLoop| margins(open).loops[0].classical.gain_below;
    near(found(&open), e * e / (ANGLE * STEP * STEP + 0.5 * RATE * STEP * e * e));
    open.slowest = 1.1 * e / STEP;
    assert!(found(&open).is_none());
}

#[test]
fn oracle_equal_loops_beside_one_another_have_the_margin_of_one() {
    let one = margins(&double_integrators(1, 0));
    let three = margins(&double_integrators(3, 0));
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
    let found = &margins(&double_integrators(1, 0)).loops[0];
    assert!((found.disk.alpha * largest - 1.0).abs() < 1e-6, "{} {largest}", found.disk.alpha);
    assert!((found.sensitivity.value / sensitivity - 1.0).abs() < 1e-6);
}

#[test]
fn oracle_a_loop_without_states_has_the_margins_of_its_gain() {
    // One signal is half the other, at once: S = (I − D)⁻¹ = [1, 0; 1/2, 1], and the structured
    // singular value of S − I/2 is the largest of its diagonal.
    let d = Matrix::from_row_slice(2, 2, &[0.0, 0.0, 0.5, 0.0]);
    let none = |rows, columns| Matrix::zeros(rows, columns);
    let step = Step { a: none(0, 0), b: none(0, 2), c: none(2, 0), d };
    let found = margins(&OpenLoop::new(&[step], &double_integrators(2, 0).signals, STEP, 0.0));
    let together = found.together.unwrap();
    assert!(found.stable && together.classical.gain_above.is_none());
    assert!((together.disk.alpha - 2.0).abs() < 1e-9, "{}", together.disk.alpha);
    // The largest singular value of S is the root of σ − 1/σ = 1/2.
    let largest = 0.25 + 1.0625_f64.sqrt();
    assert!((together.sensitivity.value - largest).abs() < 1e-9, "{}", together.sensitivity.value);
}

#[test]
fn oracle_parts_of_a_sample_delay_a_held_signal_exactly() {
    // The pulse over each quarter of a sample, of which the whole one is the sum.
    let parts = 4;
    let whole = double_integrator(0);
    let held = |begin: f64, end: f64| [0.5 * (end * end - begin * begin), end - begin];
    let mut quarters = whole.clone();
    (quarters.b, quarters.d) = (Matrix::zeros(2, parts), Matrix::zeros(1, parts));
    for part in 0..parts {
        let left = |part: usize| STEP * (1.0 - part as f64 / parts as f64);
        quarters.b.column_mut(part).copy_from_slice(&held(left(part + 1), left(part)));
    }
    let signals = double_integrators(1, 0).signals;
    let open = OpenLoop::new(&[quarters], &signals, STEP, 0.0);
    assert!((&open.step.b - &whole.b).amax() < 1e-15);
    // A quarter of a sample late, the command before acts for a quarter: a state more.
    let late = held(0.75 * STEP, STEP);
    let mut exact = Matrix::zeros(3, 3);
    exact.view_mut((0, 0), (2, 2)).copy_from(&(&whole.a + &whole.b * &whole.c));
    for row in 0..2 {
        exact[(row, 0)] += late[row] * ANGLE;
        exact[(row, 1)] += late[row] * RATE;
        exact[(row, 2)] = late[row];
    }
    (exact[(2, 0)], exact[(2, 1)]) = (-ANGLE, -RATE);
    let found = open.delayed(&[0], 0.25).unwrap();
    assert!((found - exact).amax() < 1e-12);
}

#[test]
fn a_loop_that_is_unstable_has_no_margins() {
    let found = margins(&double_integrators(1, 20));
    assert!(!found.stable && found.loops.is_empty() && found.spectral_radius > 1.0);
}
