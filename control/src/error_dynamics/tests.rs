//! Tests of the sampled error dynamics against simulations of what may have acted.

use super::*;

/// Largest |angle|, |rate| and |K ô| at each tick over all signs of the sources' responses
/// (`respond`): by superposition this is the sum over the sources.
fn superposed(
    steps: usize,
    sources: usize,
    respond: impl Fn(usize) -> Vec<[f64; 7]>,
) -> Vec<[f64; 7]> {
    let mut sums = vec![[0.0; 7]; steps + 1];
    for source in 0..sources {
        for (sum, value) in sums.iter_mut().zip(respond(source)) {
            for (sum, value) in sum.iter_mut().zip(value) {
                *sum += value.abs();
            }
        }
    }
    sums
}

/// Deviation half a period after the law has seen `deviation`, with its feedback held.
fn in_the_middle(error: &SampledError, deviation: &Vector2<f64>) -> Vector2<f64> {
    let half = 0.5 * error.period;
    transition(half) * deviation + response(half) * (error.gain.row() * deviation).x
}

fn assert_agree(computed: &[Reach], expected: &[[f64; 7]], tolerance: f64) {
    for (n, (reach, expected)) in computed.iter().zip(expected).enumerate() {
        let Reach { angle, rate, seen_angle, seen_rate, middle_angle, middle_rate, .. } = *reach;
        let values =
            [angle, rate, seen_angle, seen_rate, middle_angle, middle_rate, reach.feedback];
        for (value, expected) in values.iter().zip(expected) {
            assert!(
                (value - expected).abs() <= tolerance * (1.0 + expected),
                "{n}: {value} {expected}"
            );
        }
    }
}

#[test]
fn oracle_errors_of_measurement_add_up_as_in_a_simulation() {
    for (component, latency) in [(0, 0.0), (0, 0.05), (1, 0.0), (1, 0.05)] {
        let error = SampledError::delayed(Gain { k1: -5.0, k2: -4.0 }, 0.04, latency);
        let steps = 12;
        let expected = superposed(steps, steps + 1, |at| {
            let error_of_state = [Vector2::x(), Vector2::new(latency, 1.0)][component];
            let off = |n: usize| error_of_state * if n == at { 1.0 } else { 0.0 };
            let mut deviation = -off(0);
            (0..=steps)
                .map(|n| {
                    let seen = deviation + off(n);
                    let feedback = (error.gain.row() * seen).x;
                    let middle = in_the_middle(&error, &seen);
                    let values =
                        [deviation.x, deviation.y, seen.x, seen.y, middle.x, middle.y, feedback];
                    deviation = transition(error.period) * deviation + error.gamma * feedback;
                    values
                })
                .collect()
        });
        assert_agree(&error.errors(steps)[component], &expected, 1e-12);
    }
}

#[test]
fn oracle_pulses_add_up_as_in_a_simulation() {
    // Each pulse lasts a thousandth of a period. It is seen by the first measurement after it,
    // `latency` before the tick of the resulting command.
    let fine = 1000;
    for (k, period, late) in
        [(-5.0, 0.04, 0), (-5.0, 0.04, 1000), (-5.0, 0.04, 2925), (-5.0, 0.2, 0), (-10.0, 0.04, 0)]
    {
        let pulse = period / f64::from(fine);
        let latency = f64::from(late) * pulse;
        let error = SampledError::delayed(Gain { k1: k, k2: k }, period, latency);
        let steps = 8_u32;
        let sources = usize::try_from(late + steps.cast_signed() * fine).unwrap();
        // Source i acts from −latency + i·pulse on.
        let expected = superposed(steps as usize, sources, |source| {
            let begins = (source as f64 + 0.5) * pulse - latency;
            let mut seen = Vector2::zeros();
            (0..=steps)
                .map(|n| {
                    let time = f64::from(n) * period;
                    let free = (time - begins).max(0.0);
                    // Before a measurement has seen the pulse, the vehicle moves freely.
                    let fresh = if free > 0.0 && free < latency {
                        Vector2::new(free, 1.0)
                    } else {
                        Vector2::zeros()
                    };
                    if n > 0 {
                        seen = error.phi * seen;
                        if free > 0.0 && (latency..latency + period).contains(&free) {
                            seen = Vector2::new(free, 1.0);
                        }
                    }
                    let actual = seen + fresh;
                    let middle = in_the_middle(&error, &seen);
                    let feedback = (error.gain.row() * seen).x;
                    [actual.x, actual.y, seen.x, seen.y, middle.x, middle.y, feedback]
                        .map(|value| value * pulse)
                })
                .collect()
        });
        assert_agree(&error.reach(steps as usize), &expected, 2e-4);
    }
}

#[test]
fn the_papers_box_is_not_invariant() {
    // The start is the corner (1/|k1|, 0) of (26), where the rate may still be c̄: the angle
    // leaves the box within one tick.
    let error = SampledError::new(Gain { k1: -5.0, k2: -5.0 }, 0.04);
    let (angle, rate) = (0.2, 0.1525);
    let next = error.phi * Vector2::new(angle, rate) + error.gamma;
    assert!(next.x > angle);
}
