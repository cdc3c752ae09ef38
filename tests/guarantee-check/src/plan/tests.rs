//! Hand-made plans, and trajectories that are driven as far from a plan as possible.

use super::*;
use control::linearise;
use nalgebra::{Vector3, Vector6};
use vehicle::dynamics::RigidBody;
use vehicle::integrator::rk4;
use vehicle::kinematics::{self, Kinematics};
use vehicle::plant::{self, Load};

fn published() -> Settings {
    Settings::new(Constraints::Robust).resolved().unwrap()
}

/// A plan from a state in degrees with these accelerations of the sideslip angle, deg/s².
fn planned(start: [f64; 6], accelerations: &[f64]) -> Plan {
    let (h, n) = (published().period_optimisation, 100);
    let mut plan = Plan::new(n);
    plan.braking = 0.01;
    plan.states[0] = Vector6::from(start).map(f64::to_radians);
    for k in 0..n {
        let a = accelerations.get(k).copied().unwrap_or(0.0).to_radians();
        plan.accelerations[k] = Vector3::new(0.0, a, 0.0);
        let mut next = plan.states[k];
        for i in 0..3 {
            next[i] += h * (next[3 + i] + 0.5 * h * plan.accelerations[k][i]);
            next[3 + i] += h * plan.accelerations[k][i];
        }
        plan.states[k + 1] = next;
    }
    plan
}

fn resting(sideslip: f64) -> Plan {
    planned([10.0, sideslip, -30.0, 0.0, 0.0, 0.0], &[])
}

#[test]
fn a_plan_at_rest_is_confirmed_within_the_domain_only() {
    let check = PlanCheck::new(&published()).unwrap();
    let verdict = check.check(&resting(0.0), 0);
    assert!(verdict.confirmed(), "{verdict:?}");
    // The deviation of the sideslip angle is 1.85° at most.
    assert!(check.check(&resting(18.1), 0).confirmed());
    let verdict = check.check(&resting(18.2), 0);
    assert!(verdict.left.sideslip < 0.0 && verdict.left.rate > 0.0, "{verdict:?}");
}

#[test]
fn a_plan_that_leaves_the_domain_between_two_stages_is_refuted() {
    // The parabola of the first stage has its vertex at 19.999° + 0.0014°, while both ends keep the
    // deviation from 20°.
    let mut accelerations = vec![-3.6, -2.0];
    accelerations.extend([0.0; 6]);
    accelerations.extend([1.02; 5]);
    let check = PlanCheck::new(&published()).unwrap();
    let at = |sideslip: f64| {
        check.check(&planned([10.0, sideslip, -30.0, 0.0, 0.1, 0.0], &accelerations), 0)
    };
    let verdict = at(19.999);
    assert!(verdict.left.sideslip < 0.0 && verdict.left.sideslip > -1e-3, "{verdict:?}");
    assert!(verdict.at[0] < 0.15, "{verdict:?}");
    let verdict = at(19.9);
    assert!(verdict.confirmed(), "{verdict:?}");
}

#[test]
fn corrupted_plans_are_refuted() {
    let check = PlanCheck::new(&published()).unwrap();
    let fast = |rate: f64| planned([10.0, 0.0, -30.0, 0.0, rate, 0.0], &[0.0, 0.0, -5.0 * rate]);
    let good = fast(4.3);
    assert!(check.check(&good, 0).left.rate >= 0.0);
    // The same plan is too fast for a trajectory that began earlier.
    assert!(check.check(&good, 25).left.rate < 0.0);
    // Rates that are scaled lead to other states, or exceed the limit.
    assert!(check.check(&fast(4.3 * 1.4), 0).left.rate < 0.0);
    let mut scaled = resting(5.0);
    scaled.states[30] *= 1.01;
    assert!(!check.check(&scaled, 0).consistent);
    // The rates at the end need a moment that is not left, and the sideslip has no room to brake.
    let turning = planned([10.0, 0.0, -30.0, 0.0, 0.6, 0.0], &[]);
    assert!(check.check(&turning, 0).left.sideslip < 0.0);
    let mut unbraked = resting(5.0);
    unbraked.braking = 0.0;
    assert!(!check.check(&unbraked, 0).confirmed());
}

#[test]
fn other_sets_and_bodies_are_not_checked() {
    assert!(PlanCheck::new(&Settings::new(Constraints::Paper)).is_err());
    let mut skew = published();
    skew.body.inertia[(0, 1)] = 1.0;
    assert!(PlanCheck::new(&skew).is_err());
}

/// Largest deviations of an axis from a plan at rest, at the ticks, under the Δ that is worst for
/// one of them: of an angle, a rate, and the acceleration K o.
fn attained(s: &Settings, inertia: f64, row: [f64; 2], ticks: usize) -> [f64; 3] {
    let body = RigidBody::new(s.body.inertia * inertia).unwrap();
    let rest = Vector3::new(10.0, 2.0, -30.0).map(f64::to_radians);
    let (tau, k) = (s.period_feedback, s.feedback);
    // The sign of the response to a pulse within each period, from the last one back.
    let phi = |x: [f64; 2]| {
        let fed = k.k1 * x[0] + k.k2 * x[1];
        [x[0] + tau * x[1] + 0.5 * tau * tau * fed, x[1] + tau * fed]
    };
    let mut response = [0.5 * tau * tau, tau];
    let mut signs = vec![0.0; ticks];
    for sign in signs.iter_mut().rev() {
        *sign = (row[0] * response[0] + row[1] * response[1]).signum();
        response = phi(response);
    }
    let mut state = plant::state(&rest, &Vector3::zeros());
    for sign in signs {
        let angles = plant::angles(&state);
        let rates = kinematics::r(&angles) * plant::rates(&state);
        let a = (angles - rest) * k.k1 + rates * k.k2;
        let half = 0.5 * tau;
        let middle = angles + (rates + a * (0.5 * half)) * half;
        let moment = linearise::moment(&s.body, &middle, &(rates + a * half), &a);
        let delta = Vector3::repeat(sign * s.disturbance_bound);
        let load = Load { moment, delta, ..Load::default() };
        let mut f =
            |_: f64, x: &plant::State| plant::derivative(&body, Kinematics::Printed, x, &load);
        for _ in 0..4 {
            state = rk4(&mut f, 0.0, &state, 0.25 * tau);
        }
    }
    let off = plant::angles(&state) - rest;
    let rates = kinematics::r(&plant::angles(&state)) * plant::rates(&state);
    let fed = off * k.k1 + rates * k.k2;
    [off.amax(), rates.amax(), fed.amax()]
}

#[test]
fn oracle_no_adversary_exceeds_the_deviation_and_the_worst_one_comes_near() {
    let s = published();
    let check = PlanCheck::new(&s).unwrap();
    let rows = [[1.0, 0.0], [0.0, 1.0], [s.feedback.k1, s.feedback.k2]];
    for ticks in [1, 2, 5, 25, 200] {
        let deviation = check.reach.at(ticks);
        let bounds = [deviation.angle, deviation.rate, deviation.feedback];
        for inertia in [1.0 - s.inertia_error, 1.0, 1.0 + s.inertia_error] {
            for (i, row) in rows.into_iter().enumerate() {
                let deviations = attained(&s, inertia, row, ticks);
                for (j, deviation) in deviations.into_iter().enumerate() {
                    // K o compensates the inertia error, too, which has a separate bound.
                    let more = if j == 2 { 0.2 * bounds[2].half.high } else { 0.0 };
                    assert!(
                        deviation <= bounds[j].component().high + more,
                        "{ticks} {inertia} {i} {j}"
                    );
                }
                if inertia == 1.0 {
                    let share = deviations[i] / bounds[i].half.high;
                    assert!(share > 0.97 && share < 1.03, "{ticks} {i}: {share}");
                }
            }
        }
    }
}

/// Largest deviations of the bank angle from a plan at rest, as the law sees them, under the slow
/// error that is worst for one of them. Nothing else drives it.
fn drifted(s: &Settings, row: [f64; 2], ticks: usize) -> [f64; 3] {
    let rest = Vector3::new(10.0, 2.0, -30.0).map(f64::to_radians);
    let (tau, k) = (s.period_feedback, s.feedback);
    let mut response = [tau, 0.0];
    let mut signs = vec![0.0; ticks];
    for sign in signs.iter_mut().rev() {
        *sign = (row[0] * response[0] + row[1] * response[1]).signum();
        let fed = k.k1 * response[0] + k.k2 * response[1];
        response[0] += tau * response[1] + 0.5 * tau * tau * fed;
        response[1] += tau * fed;
    }
    let (mut state, mut error) = (plant::state(&rest, &Vector3::zeros()), Vector3::zeros());
    let seen = |state: &plant::State, error: &Vector3<f64>| {
        let angles = plant::angles(state) + error;
        let rates = kinematics::r(&angles) * plant::rates(state);
        let fed = (angles - rest) * k.k1 + rates * k.k2;
        (angles, rates, fed)
    };
    for sign in signs {
        let (angles, rates, a) = seen(&state, &error);
        let half = 0.5 * tau;
        let middle = angles + (rates + a * (0.5 * half)) * half;
        let moment = linearise::moment(&s.body, &middle, &(rates + a * half), &a);
        let load = Load { moment, ..Load::default() };
        let mut f =
            |_: f64, x: &plant::State| plant::derivative(&s.body, Kinematics::Printed, x, &load);
        for _ in 0..4 {
            state = rk4(&mut f, 0.0, &state, 0.25 * tau);
        }
        error.z += sign * s.slow_angle_rate * tau;
    }
    let (angles, rates, fed) = seen(&state, &error);
    [(angles - rest).amax(), rates.amax(), fed.amax()]
}

#[test]
fn oracle_no_slow_error_exceeds_the_deviation_and_the_worst_one_comes_near() {
    let s = Settings {
        disturbance_bound: 0.0,
        inertia_error: 0.0,
        slow_angle_rate: 0.3_f64.to_radians(),
        ..published()
    };
    let check = PlanCheck::new(&s).unwrap();
    let rows = [[1.0, 0.0], [0.0, 1.0], [s.feedback.k1, s.feedback.k2]];
    for ticks in [1, 5, 25, 200] {
        let deviation = check.reach.at(ticks);
        let bounds = [deviation.angle, deviation.rate, deviation.feedback];
        let bounds = bounds.map(|bound| bound.component().high);
        for (i, row) in rows.into_iter().enumerate() {
            let deviations = drifted(&s, row, ticks);
            assert!((0..3).all(|j| deviations[j] <= bounds[j]), "{ticks} {i}: {deviations:?}");
            // The bound is that of a norm with three components.
            let share = 3.0_f64.sqrt() * deviations[i] / bounds[i];
            let least = if i == 0 { 0.95 } else { 0.75 };
            assert!(share > least || i > 0 && ticks < 200, "{ticks} {i}: {share}");
        }
    }
}

#[test]
fn an_error_of_the_tensor_widens_the_tube() {
    let s = Settings { delay: 0.04, ..published() };
    let largest = |s: &Settings| {
        let check = PlanCheck::new(s).unwrap();
        check.check(&resting(0.0), 0).left.moment
    };
    let exact = largest(&s);
    assert!(largest(&Settings { tensor_error: 0.01, ..s }) < exact - 0.01);
}
