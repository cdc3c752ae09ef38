use super::*;

/// Equations by a function, whose Jacobian matrix is taken by differences.
struct Function<F>(F);

impl<F: FnMut(f64, &[f64], &mut [f64])> System for Function<F> {
    const CALL: &'static str = "derivatives";

    fn derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<(), Refusal> {
        (self.0)(time, states, derivatives);
        Ok(())
    }

    fn jacobian(&mut self, at: &Point, jacobian: &mut DMatrix<f64>) -> Result<(), Refusal> {
        let mut states = at.states.clone();
        for (place, mut column) in jacobian.column_iter_mut().enumerate() {
            states[place] += 1e-8;
            (self.0)(at.time, &states, column.as_mut_slice());
            states[place] = at.states[place];
            for (value, before) in column.iter_mut().zip(&at.derivatives) {
                *value = (*value - before) / 1e-8;
            }
        }
        Ok(())
    }
}

/// Integrates from 0 to `end`. Returns the states there, and the number of steps.
fn integrated(
    function: impl FnMut(f64, &[f64], &mut [f64]),
    states: &[f64],
    end: f64,
    tolerance: f64,
) -> (Vec<f64>, usize) {
    let mut system = Function(function);
    let mut rodas = Rodas::new(tolerance);
    rodas.nominals = vec![1.0; states.len()];
    let mut derivatives = vec![0.0; states.len()];
    system.derivatives(0.0, states, &mut derivatives).unwrap();
    let mut point =
        Point { time: 0.0, states: states.to_vec(), rests: vec![0.0; states.len()], derivatives };
    let mut steps = 0;
    while point.time < end {
        point = rodas.step(&mut system, &point, end).unwrap().end;
        steps += 1;
    }
    (point.states, steps)
}

#[test]
fn published_van_der_pol_is_met_with_its_stiff_parameter() {
    // Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4, VDPOL:
    // ε = 1e-6, t = 2
    let published = [1.706167732170483, -0.8928097010247975];
    for (tolerance, within) in [(1e-6, 1e-5), (1e-8, 1e-6), (1e-10, 1e-8), (1e-12, 1e-10)] {
        let equations = |_: f64, y: &[f64], dy: &mut [f64]| {
            dy[0] = y[1];
            dy[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) / 1e-6;
        };
        let (states, steps) = integrated(equations, &[2.0, 0.0], 2.0, tolerance);
        for (state, expected) in states.iter().zip(published) {
            assert!((state - expected).abs() < within, "{tolerance}: {states:?}, {steps} steps");
        }
    }
}

#[test]
fn oracle_an_oscillation_keeps_its_tolerance_with_few_steps() {
    for (tolerance, most) in [(1e-6, 60), (1e-9, 200), (1e-12, 600)] {
        let equations = |_: f64, y: &[f64], dy: &mut [f64]| (dy[0], dy[1]) = (y[1], -y[0]);
        let (states, steps) = integrated(equations, &[1.0, 0.0], 10.0, tolerance);
        let error = (states[0] - 10.0_f64.cos()).hypot(states[1] + 10.0_f64.sin());
        assert!(error < 10.0 * tolerance && steps < most, "{tolerance}: {error}, {steps} steps");
    }
}

#[test]
fn oracle_the_polynomial_of_a_step_is_that_of_its_stages() {
    let mut system = Function(|t: f64, _: &[f64], dy: &mut [f64]| dy[0] = 3.0 * t * t);
    let mut rodas = Rodas::new(1e-6);
    rodas.nominals = vec![1.0];
    let zero = vec![0.0];
    let from = Point { time: 0.0, states: zero.clone(), rests: zero.clone(), derivatives: zero };
    let step = rodas.step(&mut system, &from, 0.5).unwrap();
    let mut at = from.clone();
    for part in [0.0, 0.2, 0.7, 1.0] {
        let time = part * step.end.time;
        step.interpolate(time, &mut at);
        assert!((at.states[0] - time.powi(3)).abs() < 1e-14, "{part}: {at:?}");
    }
}
