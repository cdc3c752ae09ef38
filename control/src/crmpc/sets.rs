//! The constraint sets of the nominal motion as functions of the tracking error.

use super::design::Design;
use super::few_stages::Anchor;
use super::guarantee::{self, Carried, Deviation, Onset};
use super::robust::{Margins, Point, Robust, norm_of_columns};
use super::settings::{Constraints, Settings};
use crate::error::DesignError;
use crate::linearise::{self, InverseKinematics, Linear};
use crate::mpc::constraints::StagePoint;
use crate::mpc::{self, Bounded, ErrorTrajectory, NormConstraint, StageConstraints, State};
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;
use vehicle::dynamics::RigidBody;
use vehicle::math::cos;
use vehicle::reference::Reference;

/// The sets, with the references over the horizon.
#[derive(Clone, Debug)]
pub(super) struct Sets {
    kind: Kind,
    body: RigidBody,
    /// Optimisation period h, s.
    step: f64,
    /// References at the prediction times.
    pub(super) references: Vec<Reference>,
    /// Radius ε of the paper's terminal ball.
    terminal_radius: Option<f64>,
}

/// The bounds of an optimisation, for benchmarks and tests that solve the same problem by other
/// means.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounds {
    /// Bounds at stages 0..=N, of which the first has no effect: on ‖ω̃‖ with the robust set, on
    /// ‖x̃_ω‖ with the paper's, rad/s.
    pub rate: Vec<f64>,
    /// Bounds in intervals 0..N: on ‖m̃‖ (N m) with the robust set, on ‖ũ‖ (rad/s²) with the
    /// paper's.
    pub input: Vec<f64>,
    /// Radius ε of ‖Ẽ_N‖_G ≤ ε; only with the paper's set.
    pub terminal: Option<f64>,
}

#[derive(Clone, Debug)]
enum Kind {
    /// Stage-wise bounds on ‖ω‖ and ‖m‖.
    Robust(Box<Robust>),
    /// Constant bounds on ‖x_ω‖ and ‖u‖ of (21), and the ratio of the largest to the smallest
    /// moment of inertia.
    Paper { x_tube: f64, u_tube: f64, inertia_ratio: f64 },
}

/// Relative tolerance in the check of the paper's constraints, for rounding.
const ROUNDING: f64 = 1e-9;

impl Sets {
    /// # Errors
    /// Returns an error that names the empty set of the paper, or the gain whose eigenvalues are
    /// not real as the paper's constants require.
    pub(super) fn new(settings: &Settings, design: &Design) -> Result<Self, DesignError> {
        let n = settings.horizon;
        let (kind, terminal_radius) = match settings.constraints {
            Constraints::Robust => (Kind::Robust(Box::new(Robust::new(settings, design))), None),
            Constraints::Paper => {
                let paper = design.paper.ok_or(DesignError::NotReal { name: "feedback" })?;
                let (x_tube, u_tube, epsilon) =
                    (paper.x_tube, paper.u_tube, paper.epsilon1.min(paper.epsilon2));
                for (name, value) in [("x_tube", x_tube), ("u_tube", u_tube), ("epsilon", epsilon)]
                {
                    if value.is_nan() || value <= 0.0 {
                        return Err(DesignError::EmptySet { name, value });
                    }
                }
                (Kind::Paper { x_tube, u_tube, inertia_ratio: design.inertia_ratio }, Some(epsilon))
            }
        };
        let references = vec![Reference::default(); n + 1];
        Ok(Self {
            kind,
            body: settings.body,
            step: settings.period_optimisation,
            references,
            terminal_radius,
        })
    }

    /// Returns the bounds, which are `held` by the optimiser if they depend on the motion.
    pub(super) fn bounds(&self, held: &mpc::Bounds) -> Bounds {
        let n = self.references.len() - 1;
        let (rate, input) = match &self.kind {
            Kind::Robust(_) => (held.state.clone(), held.input.clone()),
            Kind::Paper { x_tube, u_tube, .. } => (vec![*x_tube; n + 1], vec![*u_tube; n]),
        };
        Bounds { rate, input, terminal: self.terminal_radius }
    }

    /// Prepares the robust set for a nominal motion that began at the measured state `age` feedback
    /// ticks ago and follows on `onset`, with the given share of the tightening.
    pub(super) fn begin(&mut self, age: usize, share: f64, onset: &Onset) {
        if let Kind::Robust(robust) = &mut self.kind {
            (robust.age, robust.share, robust.onset) = (age, share, *onset);
        }
    }

    /// Carries along what the motion's changes of acceleration leave.
    fn carry(&self, motion: &ErrorTrajectory<2>) {
        if let Kind::Robust(robust) = &self.kind {
            let stages = motion.inputs.iter().zip(&self.references);
            robust.carry(stages.map(|(input, reference)| input + reference.accelerations));
        }
    }

    /// Returns the certificate of a plan, or `None` if it does not satisfy the conditions of the
    /// theorem (docs/guarantee.md), which require the whole tightening.
    ///
    /// `checked` says that [`mpc::Bounded::violated`] has already found no violation in it.
    pub(super) fn certify(&self, motion: &ErrorTrajectory<2>, checked: bool) -> Option<Certified> {
        let Kind::Robust(robust) = &self.kind else { return None };
        let n = motion.inputs.len();
        if robust.design.counted < 1.0
            || robust.share < 1.0
            || !checked && self.first_and_last(motion, 0..n, |_, _| ()).is_some()
        {
            return None;
        }
        self.carry(motion);
        // The first state, which no optimisation can change, and the last one, beyond which the
        // motion brakes, are checked separately.
        let [first, second, last] = [0, 1, n].map(|k| self.point(motion, k));
        let rates = first.motion(&self.body);
        let bound = robust.rate_bound(0, norm_of_columns(&rates.rates_by_angles), &first, &second);
        let sideslip = |k: usize| {
            let (reference, [angles, rates]) = (&self.references[k], &motion.states[k]);
            [reference.angles.y + angles.y, reference.rates.y + rates.y]
        };
        let inside = (0..n).all(|k| {
            let a = self.references[k].accelerations.y + motion.inputs[k].y;
            robust.keeps_sideslip(k, sideslip(k), a, sideslip(k + 1)[0])
        });
        let (size, bound) = (rates.rates.norm(), bound + robust.reserves().0);
        if !inside || size > bound || !robust.keeps_before(&first, (size, bound)) {
            return None;
        }
        let Robust { settings, dynamics, design, .. } = &**robust;
        let before = self.references[n - 1].accelerations + motion.inputs[n - 1];
        let braking = guarantee::braking(
            settings,
            dynamics,
            &design.tightening,
            last.angles.y,
            &last.rates,
            (&robust.carried_to_the_end(), before.norm()),
        )?;
        Some(Certified { margins: robust.margins(&first, &second), braking })
    }

    /// Returns the [`Margins`] of a motion; they are zero unless the set is the robust one.
    pub(super) fn margins(&self, motion: &ErrorTrajectory<2>) -> Margins {
        let Kind::Robust(robust) = &self.kind else { return Margins::default() };
        self.carry(motion);
        robust.margins(&self.point(motion, 0), &self.point(motion, 1))
    }

    /// Returns the largest deviations that the assumptions explain `tick` ticks after a nominal
    /// motion began, in a stage that begins with `carried`; `None` with the paper's set.
    pub(super) fn explained(&self, tick: usize, carried: &Carried) -> Option<Deviation> {
        let Kind::Robust(robust) = &self.kind else { return None };
        let tightening = &robust.design.tightening;
        let explained = *tightening.at(tick);
        let Some(switching) = &tightening.switching else { return Some(explained) };
        Some(explained.plus(&switching.deviation(carried)))
    }

    /// Returns (Θ̃, x̃_ω, a) for an error and its input at stage `k`.
    fn nominal(&self, k: usize, state: &State<2>, input: &Vector3<f64>) -> [Vector3<f64>; 3] {
        let Reference { angles, rates, accelerations } = &self.references[k];
        [angles + state[0], rates + state[1], accelerations + input]
    }

    /// Returns stage `k` of a motion of the errors.
    fn point(&self, motion: &ErrorTrajectory<2>, k: usize) -> Point {
        Point::at(&self.references, motion, k)
    }

    /// Returns the range from the first to the last of the intervals `of` that `motion` violates
    /// with the bounds about itself or smaller ones. `keep` receives the bounds of the robust set.
    fn first_and_last(
        &self,
        motion: &ErrorTrajectory<2>,
        of: Range<usize>,
        mut keep: impl FnMut(usize, (f64, f64)),
    ) -> Option<Range<usize>> {
        self.carry(motion);
        let mut violates = |k: usize, here: &Point, next: &Point, anchor: &mut Option<Anchor>| {
            match &self.kind {
                Kind::Robust(robust) => {
                    let (interval, kept) = robust.examine(k, here, next, anchor);
                    keep(k, (interval.rate_bound, interval.moment_bound));
                    !kept
                }
                Kind::Paper { x_tube, u_tube, inertia_ratio } => {
                    let Point { angles, rates, size, acceleration, pull, .. } = here;
                    // The estimate of ‖u‖ needs no sines: mean time 0.015 → 0.009 ms, longest 0.049
                    // → 0.039.
                    let estimate = linearise::input_bound(angles.y, *size, *pull, *inertia_ratio);
                    let input = || here.turned().input(&self.body, rates, acceleration).norm();
                    let exceeds = |value: f64, bound: f64| value > bound * (1.0 + ROUNDING);
                    exceeds(next.size, *x_tube)
                        || exceeds(estimate, *u_tube) && exceeds(input(), *u_tube)
                }
            }
        };
        let mut anchor = None;
        let mut here = self.point(motion, of.start);
        let first = of.clone().find(|&k| {
            let next = self.point(motion, k + 1);
            let violates = violates(k, &here, &next, &mut anchor);
            here = next;
            violates
        })?;
        // The search runs from the other end, as intervals between two violated ones need no check.
        let mut anchor = None;
        let mut next = self.point(motion, of.end);
        let last = (first + 1..of.end).rev().find(|&k| {
            let here = self.point(motion, k);
            let violates = violates(k, &here, &next, &mut anchor);
            next = here;
            violates
        });
        Some(first..last.unwrap_or(first) + 1)
    }
}

impl Bounded<2> for Sets {
    fn constrains_states(&self) -> bool {
        true
    }

    fn norm_constraints(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> StageConstraints<2> {
        let [angles, rates, a] = self.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let at = kinematics.linearise(&self.body, &rates, &a);
        match &self.kind {
            Kind::Robust(robust) => {
                let (rate, moment) = robust.nonempty(bounds);
                StageConstraints { state: ball(&at.rates, rate), input: ball(&at.moment, moment) }
            }
            Kind::Paper { x_tube, u_tube, .. } => StageConstraints {
                state: NormConstraint {
                    value: rates / *x_tube,
                    by_state: [Matrix3::zeros(), Matrix3::from_diagonal_element(1.0 / x_tube)],
                    by_input: Matrix3::zeros(),
                },
                input: ball(&kinematics.input_of_moment(&self.body, &at.moment), *u_tube),
            },
        }
    }

    fn squares(
        &self,
        k: usize,
        state: &State<2>,
        input: &Vector3<f64>,
        bounds: (f64, f64),
    ) -> (f64, f64) {
        let [angles, rates, a] = self.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let (state, input) = match &self.kind {
            Kind::Robust(robust) => {
                let (rate, moment) = robust.nonempty(bounds);
                (
                    kinematics.body_rates(&rates).0 / rate,
                    kinematics.moment(&self.body, &rates, &a) / moment,
                )
            }
            Kind::Paper { x_tube, u_tube, .. } => {
                (rates / *x_tube, kinematics.input(&self.body, &rates, &a) / *u_tube)
            }
        };
        (state.norm_squared(), input.norm_squared())
    }

    fn violated(
        &self,
        motion: &ErrorTrajectory<2>,
        of: Range<usize>,
        bounds: &mut mpc::Bounds,
    ) -> Option<Range<usize>> {
        self.first_and_last(motion, of, |k, about| bounds.set(k, about))
    }

    fn bounds_about(
        &self,
        motion: &ErrorTrajectory<2>,
        of: Range<usize>,
        bounds: &mut mpc::Bounds,
    ) {
        let Kind::Robust(robust) = &self.kind else { return };
        self.carry(motion);
        let mut here = self.point(motion, of.start);
        for k in of {
            let next = self.point(motion, k + 1);
            let interval = robust.interval(k, &here, &next);
            bounds.set(k, (interval.rate_bound, interval.moment_bound));
            here = next;
        }
    }

    fn bounds_between(
        &self,
        k: usize,
        here: StagePoint<2>,
        next: StagePoint<2>,
    ) -> Option<(f64, f64)> {
        let Kind::Robust(robust) = &self.kind else { return None };
        let point = |k: usize, (state, input): StagePoint<2>| {
            let [angles, rates, a] = self.nominal(k, state, input);
            let last = k == robust.settings.horizon;
            Point::new(angles, rates, if last { Vector3::zeros() } else { a })
        };
        let interval = robust.interval(k, &point(k, here), &point(k + 1, next));
        Some((interval.rate_bound, interval.moment_bound))
    }

    fn depends_on_trajectory(&self) -> bool {
        matches!(self.kind, Kind::Robust(_))
    }

    // With the paper's constant bounds, the wider tolerance shortens the longest first optimisation
    // of 1500 random cases by a tenth.
    fn follows_at_first(&self) -> bool {
        true
    }

    /// Returns whether the full moment (or input) over one interval cannot bring the rates down to
    /// the bound at its end.
    fn out_of_reach(&self, start: &State<2>) -> bool {
        let [angles, rates, _] = self.nominal(0, start, &Vector3::zeros());
        let (body, h) = (&self.body, self.step);
        let kinematics = InverseKinematics::at(&angles);
        // These are x_ω after an interval without input, the largest change by the input, and the
        // bound.
        let (coasting, most, allowed) = match &self.kind {
            Kind::Robust(robust) => {
                let Settings { limit_rate, limit_moment, .. } = robust.settings;
                let at_rest = kinematics.motion(body, &rates).moment_at_rest;
                let secant = 1.0 / cos(angles.y);
                let most = secant * limit_moment / robust.design.smallest_inertia;
                let drift = vehicle::kinematics::r(&angles) * (body.inverse * -at_rest);
                // The sideslip will have changed by then.
                let beta = angles.y.abs() + h * (rates.norm() + h * (drift.norm() + most));
                if beta >= std::f64::consts::FRAC_PI_3 {
                    return false;
                }
                (rates + drift * h, h * most, limit_rate / cos(beta))
            }
            Kind::Paper { x_tube, u_tube, .. } => {
                (rates - kinematics.input(body, &rates, &Vector3::zeros()) * h, h * u_tube, *x_tube)
            }
        };
        coasting.norm() - most > allowed * (1.0 + ROUNDING)
    }

    fn terminal_radius(&self) -> Option<f64> {
        self.terminal_radius
    }
}

/// Properties of a plan that satisfies the conditions of the theorem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Certified {
    pub margins: Margins,
    /// Braking rate beyond the horizon, see [`super::Plan::braking`].
    pub braking: f64,
}

/// Expresses ‖y‖ ≤ bound in terms of the tracking error and v = a − Θ̈_r.
fn ball(y: &Linear, bound: f64) -> NormConstraint<2> {
    let share = 1.0 / bound;
    let mut by_angles = Matrix3::zeros();
    by_angles.fixed_view_mut::<3, 2>(0, 0).copy_from(&(y.by_angles * share));
    NormConstraint {
        value: y.value * share,
        by_state: [by_angles, y.by_rates * share],
        by_input: y.by_acceleration * share,
    }
}

#[cfg(test)]
mod tests;
