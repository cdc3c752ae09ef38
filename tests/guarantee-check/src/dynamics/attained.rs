//! Search for the state in which a quantity is largest, which bounds it from below.

use super::body::Body;
use super::series::{Series, coefficient, line, vector};
use crate::dual::Number;
use crate::kinematics::{Turn, Vector, scaled, sum, turned};
use control::crmpc::Settings;
use std::f64::consts::PI;
use std::ops::Neg;

fn norm(value: &Vector<f64>) -> f64 {
    crate::kinematics::square(value).sqrt()
}

/// Maps coordinates in [−1, 1] to a vector in the ball of this radius.
fn ball(z: &[f64], radius: f64) -> Vector<f64> {
    let value = [z[0], z[1], z[2]];
    let size = norm(&value);
    scaled(radius / size.max(1.0), value)
}

/// Number of coordinates of a trial point: β, α, ω or x, m or a, a direction of the angles, and one
/// of the rates.
const COORDINATES: usize = 13;

/// Returns the largest value of `f` that repeated ascents by random steps find.
fn ascent(f: impl Fn(&[f64; COORDINATES]) -> f64) -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut largest = 0.0_f64;
    for _ in 0..40 {
        let mut at: [f64; COORDINATES] = std::array::from_fn(|_| random());
        let (mut value, mut step) = (f(&at), 1.0);
        for _ in 0..400 {
            let tried = at.map(|z| (z + step * random()).clamp(-1.0, 1.0));
            let there = f(&tried);
            if there > value {
                (at, value) = (tried, there);
            } else {
                step = f64::max(step * 0.98, 1e-4);
            }
        }
        largest = largest.max(value);
    }
    largest
}

/// Direction of the angles at a trial point.
fn angle_unit(z: &[f64; COORDINATES]) -> [f64; 2] {
    let size = z[8].hypot(z[9]).max(1e-9);
    [z[8] / size, z[9] / size]
}

/// Direction of these three coordinates.
fn unit(z: &[f64]) -> Vector<f64> {
    let size = norm(&[z[0], z[1], z[2]]).max(1e-9);
    scaled(1.0 / size, [z[0], z[1], z[2]])
}

/// Returns the largest values that the search found, in the order of [`super::from_lemmas`].
pub(super) fn attained(s: &Settings, sizes: (f64, f64), curved: (f64, f64)) -> [f64; 12] {
    let body = Body::new(s);
    let angles = |z: &[f64; COORDINATES]| [PI * z[1], s.sideslip_domain * z[0]];
    // This gives the state (α, β), x and m, with x = R ω.
    let state = |z: &[f64; COORDINATES]| {
        let [alpha, beta] = angles(z);
        let (omega, m) = (ball(&z[2..5], s.limit_rate), ball(&z[5..8], s.limit_total()));
        let x = Turn::new(beta.sin(), beta.cos()).r(&turned(alpha.sin(), alpha.cos(), &omega));
        ([alpha, beta], x, m)
    };
    let held = |[alpha, beta]: [f64; 2]| [Series::constant(alpha), Series::constant(beta)];
    let along = |[alpha, beta]: [f64; 2], o: [f64; 2]| {
        [Series::line(alpha, o[0]), Series::line(beta, o[1])]
    };
    let acceleration = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(&body.acceleration(&held(angles), &vector(&x), &vector(&m)), 0))
    };
    let by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(
            &body.acceleration(&held(angles), &line(&x, &unit(&z[10..])), &vector(&m)),
            1,
        ))
    };
    let by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, m) = state(z);
        norm(&coefficient(
            &body.acceleration(&along(angles, angle_unit(z)), &vector(&x), &vector(&m)),
            1,
        ))
    };
    let jerk = |z: &[f64; COORDINATES]| {
        let (from, x, m) = state(z);
        let m = vector(&m);
        let mut series = vector(&x);
        for _ in 0..2 {
            let angles = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * series[i].0[1]]));
            let a = body.acceleration(&angles, &series, &m);
            series = std::array::from_fn(|i| Series([x[i], a[i].0[0], 0.5 * a[i].0[1]]));
        }
        let angles = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * series[i].0[1]]));
        2.0 * norm(&coefficient(&body.acceleration(&angles, &series, &m), 2))
    };
    let nominal = |z: &[f64; COORDINATES], (x, a): (f64, f64)| {
        (angles(z), ball(&z[2..5], x), ball(&z[5..8], a))
    };
    let moment_by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&along(angles, angle_unit(z)), &vector(&x), &vector(&a)), 1))
    };
    let moment_by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&held(angles), &line(&x, &unit(&z[10..])), &vector(&a)), 1))
    };
    let moment = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = nominal(z, sizes);
        norm(&coefficient(&body.moment(&held(angles), &vector(&x), &vector(&a)), 0))
    };
    let [moment_curvature, rate_curvature, by_angles_curvature, by_rates_curvature, bearing] =
        attained_along_a_trajectory(s, &body, curved);
    [
        ascent(acceleration),
        ascent(by_rates),
        ascent(by_angles),
        ascent(jerk),
        ascent(moment_by_angles),
        ascent(moment_by_rates),
        ascent(moment),
        moment_curvature,
        rate_curvature,
        by_angles_curvature,
        by_rates_curvature,
        bearing,
    ]
}

/// Returns the largest second derivatives that the search found along trajectories with a held.
fn attained_along_a_trajectory(s: &Settings, body: &Body, curved: (f64, f64)) -> [f64; 5] {
    let angles = |z: &[f64; COORDINATES]| [PI * z[1], s.sideslip_domain * z[0]];
    // This gives a trajectory along which a is held.
    let trajectory = |z: &[f64; COORDINATES]| {
        let from = angles(z);
        let (x, a) = (ball(&z[2..5], curved.0), ball(&z[5..8], curved.1));
        let angles: [Series; 2] = std::array::from_fn(|i| Series([from[i], x[i], 0.5 * a[i]]));
        (angles, line(&x, &a), vector(&a))
    };
    let moment_curvature = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        2.0 * norm(&coefficient(&body.moment(&angles, &x, &a), 2))
    };
    let rate_curvature = |z: &[f64; COORDINATES]| {
        let (angles, x, _) = trajectory(z);
        2.0 * norm(&coefficient(&Body::rates(&angles, &x), 2))
    };
    // The derivatives by the angles and rates are those of differences over a short distance.
    let short = 1e-4;
    let difference = |after: Vector<Series>, before: Vector<Series>| {
        let change = sum(after, before.map(Neg::neg));
        norm(&coefficient(&change, 2)) / short
    };
    let curvature_by_angles = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        let o = angle_unit(z);
        let moved = |side: f64| {
            let turned = std::array::from_fn(|i| angles[i] + Series::constant(side * short * o[i]));
            body.moment(&turned, &x, &a)
        };
        difference(moved(1.0), moved(-1.0))
    };
    let curvature_by_rates = |z: &[f64; COORDINATES]| {
        let (angles, x, a) = trajectory(z);
        let v = unit(&z[10..]);
        let moved = |side: f64| {
            let changed = std::array::from_fn(|i| x[i] + Series::constant(side * short * v[i]));
            body.moment(&angles, &changed, &a)
        };
        difference(moved(1.0), moved(-1.0))
    };
    let curvature_of_bearing = |z: &[f64; COORDINATES]| {
        let (angles, ..) = trajectory(z);
        let corner = [z[10], z[11], z[12]].map(|z| if z < 0.0 { -1.0 } else { 1.0 });
        let at_rest = vector(&[0.0; 3]);
        2.0 * norm(&coefficient(&body.moment(&angles, &at_rest, &vector(&corner)), 2))
    };
    [
        ascent(moment_curvature),
        ascent(rate_curvature),
        ascent(curvature_by_angles),
        ascent(curvature_by_rates),
        ascent(curvature_of_bearing),
    ]
}
