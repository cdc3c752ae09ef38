//! Search for the state in which a quantity is largest, which bounds it from below.

use crate::body::Body;
use crate::dual::{Dual, Real};
use crate::kinematics::{Turn, Vector, scaled, square, sum, turned};
use control::crmpc::Settings;
use std::f64::consts::PI;
use std::ops::Neg;

/// Function of time, with its first and second derivative.
type Series = Dual<1, Dual<1, f64>>;

fn series(value: f64, first: f64, second: f64) -> Series {
    Dual { value: Dual { value, slope: [first] }, slope: [Dual { value: first, slope: [second] }] }
}

/// Values that do not change.
fn held<const M: usize>(values: [f64; M]) -> [Series; M] {
    values.map(|value| series(value, 0.0, 0.0))
}

/// Values that change with these derivatives.
fn line<const M: usize>(values: [f64; M], slopes: [f64; M]) -> [Series; M] {
    std::array::from_fn(|i| series(values[i], slopes[i], 0.0))
}

/// Size of the derivative of this order.
fn size(vector: &Vector<Series>, order: usize) -> f64 {
    norm(&vector.map(|x| match order {
        0 => x.value.value,
        1 => x.slope[0].value,
        _ => x.slope[0].slope[0],
    }))
}

fn norm(value: &Vector<f64>) -> f64 {
    square(value).sqrt()
}

/// Maps coordinates in [−1, 1] to a vector in the ball of this radius.
fn ball(z: &[f64], radius: f64) -> Vector<f64> {
    let value = [z[0], z[1], z[2]];
    let size = norm(&value);
    scaled(radius / size.max(1.0), value)
}

/// Coordinates of a trial point: β, α, ω or x, m or a, a direction of the angles, and one of the
/// rates.
type Point = [f64; 13];

/// Returns the largest value of `f` that repeated ascents by random steps find.
fn ascent(f: impl Fn(&Point) -> f64) -> f64 {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let mut largest = 0.0_f64;
    for _ in 0..40 {
        let mut at: Point = std::array::from_fn(|_| random());
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

/// Direction of these coordinates.
fn unit<const M: usize>(z: &[f64]) -> [f64; M] {
    let size = z[..M].iter().map(|z| z * z).sum::<f64>().sqrt().max(1e-9);
    std::array::from_fn(|i| z[i] / size)
}

/// Product T y at this angle of attack, from the body's axes to those of [`Body`] or back.
fn turned_by(alpha: Series, y: &Vector<Series>) -> Vector<Series> {
    let (sine, cosine) = alpha.sin_cos();
    turned(sine, cosine, y)
}

/// The dynamics in the body's axes, along a trajectory.
struct Dynamics(Body);

impl Dynamics {
    fn acceleration(
        &self,
        angles: [Series; 2],
        x: &Vector<Series>,
        m: Vector<f64>,
    ) -> Vector<Series> {
        self.0.at(angles).acceleration(x, &turned_by(angles[0], &held(m)))
    }

    fn moment(
        &self,
        angles: [Series; 2],
        x: &Vector<Series>,
        a: &Vector<Series>,
    ) -> Vector<Series> {
        turned_by(angles[0], &self.0.at(angles).moment(x, a))
    }
}

/// Returns the largest values that the search found, in the order of [`super::from_lemmas`]; zeros
/// for a body that is not symmetric about its x–z plane.
pub(super) fn attained(s: &Settings, sizes: (f64, f64), curved: (f64, f64)) -> Vec<f64> {
    let Some(body) = Body::new(s).map(Dynamics) else { return vec![0.0; 12] };
    let angles = |z: &Point| [PI * z[1], s.sideslip_domain * z[0]];
    // This gives the state (α, β), x and m, with x = R ω.
    let state = |z: &Point| {
        let [alpha, beta] = angles(z);
        let (omega, m) = (ball(&z[2..5], s.limit_rate), ball(&z[5..8], s.limit_total()));
        let x = Turn::new(beta.sin(), beta.cos()).r(&turned(alpha.sin(), alpha.cos(), &omega));
        ([alpha, beta], x, m)
    };
    let nominal = |z: &Point| (angles(z), ball(&z[2..5], sizes.0), held(ball(&z[5..8], sizes.1)));
    let mut found = vec![
        ascent(|z| {
            let (angles, x, m) = state(z);
            size(&body.acceleration(held(angles), &held(x), m), 0)
        }),
        ascent(|z| {
            let (angles, x, m) = state(z);
            size(&body.acceleration(held(angles), &line(x, unit(&z[10..])), m), 1)
        }),
        ascent(|z| {
            let (angles, x, m) = state(z);
            size(&body.acceleration(line(angles, unit(&z[8..])), &held(x), m), 1)
        }),
        ascent(|z| {
            let (angles, x, m) = state(z);
            let along = |x: &Vector<Series>| {
                let angle = |i: usize| series(angles[i], x[i].value.value, x[i].slope[0].value);
                body.acceleration([0, 1].map(angle), x, m)
            };
            // Each time the derivatives of x are right up to one order more.
            let next = |a: Vector<Series>| {
                std::array::from_fn(|i| series(x[i], a[i].value.value, a[i].slope[0].value))
            };
            size(&along(&next(along(&next(along(&held(x)))))), 2)
        }),
        ascent(|z| {
            let (angles, x, a) = nominal(z);
            size(&body.moment(line(angles, unit(&z[8..])), &held(x), &a), 1)
        }),
        ascent(|z| {
            let (angles, x, a) = nominal(z);
            size(&body.moment(held(angles), &line(x, unit(&z[10..])), &a), 1)
        }),
        ascent(|z| {
            let (angles, x, a) = nominal(z);
            size(&body.moment(held(angles), &held(x), &a), 0)
        }),
    ];
    found.extend(along_trajectories(s, &body, curved));
    found
}

/// Returns the largest second derivatives that the search found along trajectories with a held.
fn along_trajectories(s: &Settings, body: &Dynamics, curved: (f64, f64)) -> [f64; 5] {
    let trajectory = |z: &Point| {
        let from = [PI * z[1], s.sideslip_domain * z[0]];
        let (x, a) = (ball(&z[2..5], curved.0), ball(&z[5..8], curved.1));
        let angles: [Series; 2] = std::array::from_fn(|i| series(from[i], x[i], a[i]));
        (angles, line(x, a), held(a))
    };
    // The derivatives by the angles and rates are those of differences over a short distance.
    let short = 1e-4;
    let difference = |moved: &dyn Fn(f64) -> Vector<Series>| {
        size(&sum(moved(short), moved(-short).map(Neg::neg)), 2) / (2.0 * short)
    };
    [
        ascent(|z| {
            let (angles, x, a) = trajectory(z);
            size(&body.moment(angles, &x, &a), 2)
        }),
        ascent(|z| {
            let (angles, x, _) = trajectory(z);
            let rates = body.0.at(angles).turn.by_sideslip(0, &x);
            size(&turned_by(angles[0], &rates), 2)
        }),
        ascent(|z| {
            let (angles, x, a) = trajectory(z);
            let o = unit::<2>(&z[8..]);
            difference(&|by| body.moment(sum(angles, held(scaled(by, o))), &x, &a))
        }),
        ascent(|z| {
            let (angles, x, a) = trajectory(z);
            let v = unit::<3>(&z[10..]);
            difference(&|by| body.moment(angles, &sum(x, held(scaled(by, v))), &a))
        }),
        ascent(|z| {
            let corner = [z[10], z[11], z[12]].map(f64::signum);
            size(&body.moment(trajectory(z).0, &held([0.0; 3]), &held(corner)), 2)
        }),
    ]
}
