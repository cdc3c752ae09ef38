//! How far the vehicle can be from a nominal trajectory, tick by tick.
//!
//! Let the command of tick k act over [T_k, T_k + τ), computed from a measurement of t_k = T_k − d.
//! o is the vehicle's deviation from the nominal trajectory, ô that of the predicted state, and ô_k
//! = o(T_k) − q_k, where q_k is the error of the prediction. With Φ = A + Γ K
//!
//! o(T_k+1) = Φ o(T_k) − Γ K q_k + ∫ [T_k+1 − v; 1] w(v) dv,
//!
//! w = Δ + ν + F(x, m) − F(mid-period, m): disturbance, the effect ν of the inertia error, and the
//! mismatch. With slow errors all of them are those of the navigated state, and the creep ζ adds
//! ∫ [ζ(v); 0] dv. q_k holds what Δ, ν and ζ did since t_k, −A_d e_k for the measurement's error
//! e_k, and a part φ_k because F differs along the two trajectories. The linear parts are summed
//! exactly; mismatch and φ are bounded as vectors.

use super::body::Body;
use super::causes::{Causes, InertiaError, Mismatch};
use super::deviation::{Deviation, Extent, upper};
use super::smoothness::{Growth, Smoothness};
use crate::interval::Interval;
use crate::sums::{Axis, Matrix, Pair, integral_of_size, product};
use control::crmpc::Settings;
use control::error_dynamics::InvariantSet;
use nalgebra::Vector2;
use std::collections::VecDeque;

fn number(value: f64) -> Interval {
    Interval::from(value)
}

/// Sums over the responses of one row r to everything that drives the deviation, by the number of
/// periods since the nominal trajectory began.
struct Response {
    /// ∫ |r Φⁱ [u; 1]| du over all unit pulses that have been seen.
    seen: Vec<Interval>,
    /// Parts by measurement errors: of earlier ticks, and of the first.
    erred: Vec<Interval>,
    /// Sums of |r Φⁱ [1; 0]| over all unit shifts of the angle per time that have been seen, s.
    crept: Vec<Interval>,
    /// Part by mismatch and φ.
    mismatched: Vec<Interval>,
    /// Part by the mismatch, if it is summed along the predictions.
    revised: Vec<Interval>,
    /// Part by φ of the first tick, which is the deviation of the vehicle there.
    begun: Vec<Interval>,
    /// Moment that compensates the inertia error, if the row is that of K ô, N m.
    inertia: Vec<Interval>,
}

/// The tube of deviations around any nominal trajectory for one set of settings.
pub(super) struct Reach {
    pub(super) deviations: Vec<Deviation>,
    pub(super) forever: Deviation,
    /// Largest additional deviation of the rates between two ticks, rad/s.
    pub(super) swing: Interval,
}

struct Builder<'a> {
    s: &'a Settings,
    axis: Axis,
    causes: Causes,
    /// Growth of the moment that compensates ν.
    growth: Growth,
    /// Matrices of the errors: Γ K A_d, A A_d and A_d.
    errors: [Matrix; 3],
    /// Number of periods after which no response is followed one by one.
    steps: usize,
}

/// Number of times that the largest response is halved before responses are bounded together.
const HALVINGS: usize = 34;
/// Largest number of periods that are followed one by one.
const LONGEST: usize = 20_000;

impl Reach {
    /// Computes the tube; `start` is the set in which the deviation of each axis may begin, per
    /// unit of the disturbance bound. `None` if the settings leave no bound.
    pub(super) fn new(s: &Settings, start: Option<(&InvariantSet, f64)>) -> Option<Self> {
        Builder::new(s)?.build(start)
    }

    /// Returns the deviation `n` feedback ticks after the nominal trajectory began.
    pub(super) fn at(&self, n: usize) -> &Deviation {
        self.deviations.get(n).unwrap_or(&self.forever)
    }
}

impl<'a> Builder<'a> {
    fn new(s: &'a Settings) -> Option<Self> {
        let axis = Axis::new(s.feedback, s.period_feedback, s.delay)?;
        let causes = Causes::new(s)?;
        let (zero, one, d, tau) =
            (Interval::ZERO, Interval::ONE, number(s.delay), number(s.period_feedback));
        let transition = |h: Interval| [[one, h], [zero, one]];
        let (k, half) = ([s.feedback.k1, s.feedback.k2].map(number), number(0.5));
        let gamma = [half * tau.square(), tau];
        let fed = gamma.map(|g| k.map(|k| g * k));
        let delayed = transition(d);
        let errors = [product(&fed, &delayed), product(&transition(tau), &delayed), delayed];
        let steps = Some(axis.halved(HALVINGS)).filter(|&steps| steps <= LONGEST)?;
        let growth = Growth::new(&Body::new(s)?, causes.sideslip);
        Some(Self { s, axis, causes, growth, errors, steps })
    }

    /// Moment that compensates ν after the vehicle has turned for `age`, faster than its limit
    /// before the nominal trajectory began, while the angles are measured with errors.
    fn compensating(&self, age: Interval) -> Interval {
        let early = self.causes.smoothness.turning * number(self.s.delay).square();
        let jump = number(2.0).sqrt() * self.causes.errors[0] + early;
        let (one, rate) = (Interval::ONE, number(self.s.limit_rate) + self.causes.later.apart[0]);
        let angle = (rate + self.causes.slow.creep) * age + jump;
        let InertiaError { direct, turned, root_condition, .. } = self.causes.inertia;
        direct * self.growth.after(one, angle) + turned * self.growth.after(root_condition, angle)
    }

    /// Sums the responses of a row.
    fn respond(&self, row: Pair) -> Response {
        let (zero, tau, d) = (Interval::ZERO, number(self.s.period_feedback), number(self.s.delay));
        let mut sums = [zero; 5];
        let mut response = Response {
            seen: vec![zero],
            erred: vec![zero],
            crept: vec![zero],
            mismatched: vec![zero],
            revised: vec![zero],
            begun: vec![],
            inertia: vec![zero],
        };
        let mut excess = VecDeque::new();
        let mut earlier = zero;
        for (i, power) in self.axis.transitions(self.steps).enumerate() {
            let reached = [0, 1].map(|j| row[0] * power[0][j] + row[1] * power[1][j]);
            let wave = integral_of_size(&reached, d, tau);
            let small = self.mismatched(&reached, &self.causes.later);
            let first = self.mismatched(&reached, &self.causes.first.0);
            excess.push_back([0, 1].map(|j| first[j] - small[j]));
            if excess.len() > self.causes.first.1 {
                excess.pop_front();
            }
            let age = number(i as f64) * tau + d + tau + number(0.5) * tau;
            response.begun.push(self.unseen(&reached));
            let inertia = wave * self.compensating(age);
            let parts = [wave, small[0], inertia, small[1], reached[0].abs() * tau];
            sums = std::array::from_fn(|j| sums[j] + parts[j]);
            response.seen.push(sums[0]);
            response.crept.push(sums[4]);
            let more = |j: usize| excess.iter().fold(zero, |sum, part| sum + part[j]);
            response.mismatched.push(sums[1] + more(0));
            response.revised.push(sums[3] + more(1));
            response.inertia.push(sums[2]);
            response.erred.push(earlier + self.erred(&reached, 1));
            earlier = earlier + self.erred(&reached, 0);
        }
        let tail = self.axis.tails(self.steps).0 * (row[0].abs() + row[1].abs());
        self.end(&mut response, tail, earlier);
        response
    }

    /// Adds the remainder when every response has faded, bounded by the sum `tail` of its size.
    fn end(&self, response: &mut Response, tail: Interval, earlier: Interval) {
        let tau = number(self.s.period_feedback);
        let end = number(self.s.delay) + tau;
        let last = |values: &[Interval]| values.last().copied().unwrap_or(Interval::ALL);
        let one = [Interval::ONE, Interval::ONE];
        let more = tail * end.max(Interval::ONE);
        let seen = last(&response.seen) + more * tau;
        let crept = last(&response.crept) + tail * tau;
        let small = self.mismatched(&one, &self.causes.first.0);
        let revised = last(&response.revised) + more * small[1];
        let small = last(&response.mismatched) + more * small[0];
        let inertia = last(&response.inertia) + more * tau * self.compensating(number(1e9));
        let erred = earlier + more * (self.erred(&one, 0) + self.erred(&one, 1));
        response.seen.push(seen);
        response.crept.push(crept);
        response.mismatched.push(small);
        response.revised.push(revised);
        response.inertia.push(inertia);
        response.erred.push(erred);
        let begun = tail * self.unseen(&one);
        response.begun.extend([begun, begun]);
    }

    /// Effect of the errors through one of the matrices.
    fn erred(&self, row: &Pair, matrix: usize) -> Interval {
        let m = &self.errors[matrix];
        let by = |j: usize| (row[0] * m[0][j] + row[1] * m[1][j]).abs() * self.causes.errors[j];
        by(0) + by(1)
    }

    /// Effect of the mismatch of one tick, summed along the true trajectory with φ, and along the
    /// predictions. The part of F that is odd about the middle of the period shifts the angle only.
    fn mismatched(&self, row: &Pair, mismatch: &Mismatch) -> [Interval; 2] {
        let tau = number(self.s.period_feedback);
        let Causes { smoothness, middle, .. } = &self.causes;
        let cube = tau.square() * tau;
        let at = |u: Interval| (row[0] * u + row[1]).abs();
        let most = at(Interval::ZERO).max(at(tau));
        let late = at(Interval::ZERO).max(at(tau + number(self.s.delay)));
        let half = number(0.5) * tau;
        let k = [self.s.feedback.k1, self.s.feedback.k2].map(|k| number(k).abs());
        let fed = (row[0] * half * tau + row[1] * tau).abs()
            * (k[0] * mismatch.unseen[0] + k[1] * mismatch.unseen[1]);
        let swing = most * smoothness.bend * cube / number(24.0)
            + at(half) * tau * *middle
            + row[0].abs() * smoothness.slope * cube / number(12.0);
        [most * mismatch.drifted + fed + swing, late * mismatch.revised + swing]
    }

    fn build(&self, start: Option<(&InvariantSet, f64)>) -> Option<Reach> {
        let (tau, half, eighth) = (number(self.s.period_feedback), number(0.5), number(0.125));
        let [k1, k2] = [self.s.feedback.k1, self.s.feedback.k2].map(number);
        let (zero, one) = (Interval::ZERO, Interval::ONE);
        let rows = [
            [one, zero],
            [zero, one],
            [one + eighth * tau.square() * k1, half * tau + eighth * tau.square() * k2],
            [half * tau * k1, one + half * tau * k2],
            [k1, k2],
        ];
        let responses = rows.map(|row| self.respond(row));
        let starts = rows.map(|row| self.starts(row, start));
        let unseen = [half * number(self.s.delay).square(), number(self.s.delay)];
        let at = |n: usize| self.deviation(n, &rows, &responses, &starts, &unseen);
        // K ô is held between two ticks.
        let at = |n: usize| {
            let at = at(n);
            let held =
                at.feedback.component() + self.causes.inertia.acceleration * responses[4].seen[n];
            Deviation { bulge: upper(eighth * tau.square() * held), ..at }
        };
        let deviations: Vec<Deviation> = (0..=self.steps).map(at).collect();
        let forever = deviations.iter().fold(at(self.steps + 1), |most, at| most.max(at));
        let Smoothness { slope, bend, .. } = self.causes.smoothness;
        let swing = eighth * tau.square() * (slope + bend * tau);
        let bounded = forever.rate.norm.high.is_finite();
        bounded.then_some(Reach { deviations, forever, swing })
    }

    /// Support of the start set along r Φⁿ for each n.
    fn starts(&self, row: Pair, start: Option<(&InvariantSet, f64)>) -> Vec<Interval> {
        let Some((set, size)) = start else { return vec![Interval::ZERO; self.steps + 2] };
        let support = |power: &Matrix| {
            let [x, y] = [0, 1].map(|j| row[0] * power[0][j] + row[1] * power[1][j]);
            // The slack covers rounding of the row and of the sum.
            let along = set.support(&Vector2::new(x.middle(), y.middle()));
            number(along * size * (1.0 + 1e-9) + 1e-15)
        };
        let powers = self.axis.transitions(self.steps + 1);
        let mut supports: Vec<Interval> = powers.map(|power| support(&power)).collect();
        let largest = set.support(&Vector2::x()).max(set.support(&Vector2::y()));
        let tail = self.axis.tails(self.steps).0 * (row[0].abs() + row[1].abs());
        supports.push(tail * number(largest * size));
        supports
    }

    fn deviation(
        &self,
        n: usize,
        rows: &[Pair; 5],
        responses: &[Response; 5],
        starts: &[Vec<Interval>; 5],
        unseen: &Pair,
    ) -> Deviation {
        let Causes { disturbance, inertia, slow, .. } = &self.causes;
        let (inertia, delay) = (inertia.acceleration, number(self.s.delay));
        let half = |i: usize| {
            let Response { seen, erred, .. } = &responses[i];
            *disturbance * seen[n] + erred[n] + starts[i][n]
        };
        let vehicle = |i: usize| {
            let Response { seen, crept, mismatched, revised, begun, .. } = &responses[i];
            let erred = if n == 0 { self.erred(&rows[i], 2) } else { Interval::ZERO };
            let (along, revised) = (mismatched[n] + begun[n], revised[n] + self.unseen(&rows[i]));
            let small = along.min(revised);
            let pulses = seen[n] + unseen[i];
            let half = half(i) + *disturbance * unseen[i] + erred;
            let crept = slow.creep * (crept[n] + rows[i][0].abs() * delay);
            let lasting = (inertia + slow.acceleration) * pulses;
            Extent { half: upper(half), norm: upper(lasting + crept + small) }
        };
        let law = |i: usize, compensated: bool| {
            let Response { seen, crept, mismatched, revised, begun, .. } = &responses[i];
            // The first predicted state is known exactly.
            let (mut half, mut small) = (half(i), Interval::ZERO);
            if n > 0 {
                half = half + self.erred(&rows[i], 2);
                let along = mismatched[n] + begun[n] + self.unseen(&rows[i]);
                small = along.min(revised[n]);
            }
            let inertia = if compensated { inertia * seen[n] } else { Interval::ZERO };
            let slow = slow.acceleration * seen[n] + slow.creep * crept[n];
            Extent { half: upper(half), norm: upper(inertia + slow + small) }
        };
        Deviation {
            angle: vehicle(0),
            rate: vehicle(1),
            law_angle: law(2, true),
            law_rate: law(3, true),
            feedback: law(4, false),
            inertia: upper(responses[4].inertia[n]),
            bulge: Interval::ZERO,
        }
    }

    /// Size of φ along a row.
    fn unseen(&self, row: &Pair) -> Interval {
        let [angle, rate] = self.causes.first.0.unseen;
        row[0].abs() * angle + row[1].abs() * rate
    }
}
