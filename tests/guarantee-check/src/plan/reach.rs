//! How far the vehicle can be from a nominal trajectory, tick by tick.
//!
//! Let the command of tick k act over [T_k, T_k + τ), computed from a measurement of t_k = T_k − d.
//! o is the vehicle's deviation from the nominal trajectory, ô that of the predicted state, and ô_k
//! = o(T_k) − q_k, where q_k is the error of the prediction. With Φ = A + Γ K
//!
//! o(T_k+1) = Φ o(T_k) − Γ K q_k + ∫ [T_k+1 − v; 1] w(v) dv,
//!
//! w = Δ + ν + F(x, m) − F(mid-period, m): disturbance, the effect ν of the inertia error, and the
//! mismatch. With slow errors all of them are those of the navigated state, and the angle drift ζ adds
//! ∫ [ζ(v); 0] dv. q_k holds what Δ, ν and ζ did since t_k, −A_d e_k for the measurement's error
//! e_k, and a part φ_k because F differs along the two trajectories. The linear parts are summed
//! exactly; mismatch and φ are bounded as vectors.

use super::causes::{Causes, InertiaError, Mismatch};
use super::deviation::{Deviation, Extent};
use super::smoothness::{Growth, Smoothness};
use crate::body::Body;
use crate::interval::{Interval, number};
use crate::sums::{Axis, Bounds, NEVER, Pair, integral_of_size};
use control::crmpc::Settings;
use std::collections::VecDeque;

/// Bounds at one tick on the effect of mismatch and φ along one row r.
#[derive(Clone, Copy)]
struct Response {
    /// Part by mismatch and φ.
    mismatched: Interval,
    /// Part by the mismatch, if it is summed along the predictions.
    revised: Interval,
    /// Part by φ of the first tick, which is the deviation of the vehicle there.
    begun: Interval,
    /// Moment that compensates the inertia error, if the row is that of K ô, N m.
    inertia: Interval,
}

/// Bounds at one tick on the effects of unit disturbances, of all errors of measurement, and of unit
/// shifts of the angle per time.
struct Effects {
    disturbance: Bounds,
    errors: Bounds,
    shifts: Bounds,
}

/// The tube of deviations around any nominal trajectory for one set of settings.
pub(super) struct Reach {
    pub(super) deviations: Vec<Deviation>,
    pub(super) forever: Deviation,
    /// Largest additional deviation of the rates between two ticks, rad/s.
    pub(super) ripple: Interval,
}

struct Builder<'a> {
    s: &'a Settings,
    axis: Axis,
    causes: Causes,
    /// Growth of the moment that compensates ν.
    growth: Growth,
    /// Number of periods after which no response is followed one by one.
    steps: usize,
}

/// Number of times that the largest response is halved before responses are bounded together.
const HALVINGS: usize = 34;
/// Largest number of periods that are followed one by one.
const LONGEST: usize = 20_000;

impl Reach {
    /// Computes the tube; `None` if the settings leave no bound.
    pub(super) fn new(s: &Settings) -> Option<Self> {
        Builder::new(s)?.build()
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
        let steps = Some(axis.halved(HALVINGS)).filter(|&steps| steps <= LONGEST)?;
        let growth = Growth::new(&Body::new(s)?, causes.sideslip);
        Some(Self { s, axis, causes, growth, steps })
    }

    /// Moment that compensates ν after the vehicle has turned for `age`, faster than its limit
    /// before the nominal trajectory began, while the angles are measured with errors.
    fn compensating(&self, age: Interval) -> Interval {
        let faster = self.causes.smoothness.turning * number(self.s.delay).square();
        let jump = number(2.0).sqrt() * self.causes.errors[0] + faster;
        let (one, rate) = (Interval::ONE, number(self.s.limit_rate) + self.causes.later.apart[0]);
        let angle = (rate + self.causes.slow.angle_drift) * age + jump;
        let InertiaError { direct, turned, root_condition, .. } = self.causes.inertia;
        direct * self.growth.after(one, angle) + turned * self.growth.after(root_condition, angle)
    }

    /// Bounds the effects of the linear causes, by the number of periods; last for ever.
    fn effects(&self) -> Vec<Effects> {
        let by_error = self.axis.errors(self.steps);
        let shifts = self.axis.shifts(self.steps, NEVER);
        let errors = |n: usize| {
            std::array::from_fn(|i| {
                by_error[0][n][i] * self.causes.errors[0]
                    + by_error[1][n][i] * self.causes.errors[1]
            })
        };
        let reach = self.axis.reach(self.steps).into_iter().enumerate();
        reach
            .map(|(n, disturbance)| Effects { disturbance, errors: errors(n), shifts: shifts[n] })
            .collect()
    }

    /// Sums the responses of a row to mismatch and φ, by the number of periods; last for ever, with
    /// a bound on all responses that are not followed.
    fn respond(&self, row: Pair) -> Vec<Response> {
        let (zero, tau, d) = (Interval::ZERO, number(self.s.period_feedback), number(self.s.delay));
        let (mut small, mut inertia) = ([zero; 2], zero);
        let mut response =
            Response { mismatched: zero, revised: zero, begun: self.unseen(&row), inertia };
        let mut responses = Vec::with_capacity(self.steps + 2);
        let mut excess = VecDeque::new();
        for (i, power) in self.axis.transitions(self.steps).enumerate() {
            let reached = [0, 1].map(|j| row[0] * power[0][j] + row[1] * power[1][j]);
            responses.push(Response { begun: self.unseen(&reached), ..response });
            let later = self.mismatched(&reached, &self.causes.later);
            let first = self.mismatched(&reached, &self.causes.first.0);
            excess.push_back([0, 1].map(|j| first[j] - later[j]));
            if excess.len() > self.causes.first.1 {
                excess.pop_front();
            }
            let age = number(i as f64) * tau + d + tau + number(0.5) * tau;
            inertia = inertia + integral_of_size(&reached, d, tau) * self.compensating(age);
            small = [0, 1].map(|j| small[j] + later[j]);
            let [mismatched, revised] =
                [0, 1].map(|j| excess.iter().fold(small[j], |sum, part| sum + part[j]));
            response = Response { mismatched, revised, inertia, ..response };
        }
        let one = [Interval::ONE, Interval::ONE];
        let tail = self.axis.tails(self.steps).0 * (row[0].abs() + row[1].abs());
        let begun = tail * self.unseen(&one);
        responses.push(Response { begun, ..response });
        let more = tail * (d + tau).max(Interval::ONE);
        let rest = self.mismatched(&one, &self.causes.first.0);
        responses.push(Response {
            mismatched: response.mismatched + more * rest[0],
            revised: response.revised + more * rest[1],
            begun,
            inertia: inertia + more * tau * self.compensating(number(1e9)),
        });
        responses
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
        let ripple = most * smoothness.bend * cube / number(24.0)
            + at(half) * tau * *middle
            + row[0].abs() * smoothness.slope * cube / number(12.0);
        [most * mismatch.drifted + fed + ripple, late * mismatch.revised + ripple]
    }

    fn build(&self) -> Option<Reach> {
        let (tau, eighth) = (number(self.s.period_feedback), number(0.125));
        let rows = self.axis.rows();
        let (responses, effects) = (rows.map(|row| self.respond(row)), self.effects());
        // K ô is held between two ticks.
        let at = |n: usize| {
            let at = self.deviation(n, &rows, responses.each_ref().map(|row| &row[n]), &effects[n]);
            let held = at.feedback.component()
                + self.causes.inertia.acceleration * effects[n].disturbance[6];
            Deviation { bulge: (eighth * tau.square() * held).upper(), ..at }
        };
        let deviations: Vec<Deviation> = (0..=self.steps).map(at).collect();
        let forever = deviations.iter().fold(at(self.steps + 1), |most, at| most.max(at));
        let Smoothness { slope, bend, .. } = self.causes.smoothness;
        let ripple = eighth * tau.square() * (slope + bend * tau);
        let bounded = forever.rate.norm.high.is_finite();
        bounded.then_some(Reach { deviations, forever, ripple })
    }

    /// Bounds the deviation after `n` periods. The vehicle's angle and rate are entries 0 and 1 of
    /// the effects, what the law computes are the entries from 2 on.
    fn deviation(
        &self,
        n: usize,
        rows: &[Pair; 5],
        responses: [&Response; 5],
        effects: &Effects,
    ) -> Deviation {
        let Causes { disturbance, inertia, slow, .. } = &self.causes;
        let (inertia, delay) = (inertia.acceleration, number(self.s.delay));
        let half = |i: usize| (*disturbance * effects.disturbance[i] + effects.errors[i]).upper();
        let vehicle = |i: usize| {
            let Response { mismatched, revised, begun, .. } = *responses[i];
            let small = (mismatched + begun).min(revised + self.unseen(&rows[i]));
            let shifted = slow.angle_drift * (effects.shifts[i] + rows[i][0].abs() * delay);
            let lasting = (inertia + slow.acceleration) * effects.disturbance[i];
            Extent { half: half(i), norm: (lasting + shifted + small).upper() }
        };
        let law = |i: usize, compensated: bool| {
            let Response { mismatched, revised, begun, .. } = *responses[i];
            // The first predicted state is known exactly.
            let along = mismatched + begun + self.unseen(&rows[i]);
            let small = if n > 0 { along.min(revised) } else { Interval::ZERO };
            let at = i + 2;
            let inertia =
                if compensated { inertia * effects.disturbance[at] } else { Interval::ZERO };
            let slow =
                slow.acceleration * effects.disturbance[at] + slow.angle_drift * effects.shifts[at];
            Extent { half: half(at), norm: (inertia + slow + small).upper() }
        };
        Deviation {
            angle: vehicle(0),
            rate: vehicle(1),
            law_angle: law(2, true),
            law_rate: law(3, true),
            feedback: law(4, false),
            inertia: responses[4].inertia.upper(),
            bulge: Interval::ZERO,
        }
    }

    /// Size of φ along a row.
    fn unseen(&self, row: &Pair) -> Interval {
        let [angle, rate] = self.causes.first.0.unseen;
        row[0].abs() * angle + row[1].abs() * rate
    }
}
