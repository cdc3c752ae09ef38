//! The constraint sets of the nominal motion as functions of the tracking error.

use super::design::{Constraints, Design, Settings};
use super::guarantee::{self, Dynamics};
use crate::error::DesignError;
use crate::linearise::{
    self, BodyMotion, InverseKinematics, Linear, Linearisation, MomentSlopeBounds, TURN_BY_ANGLES,
};
use crate::mpc::{self, Ball, Balls, Bounded, Motion, State};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::cell::OnceCell;
use std::f64::consts::SQRT_2;
use std::ops::Range;
use vehicle::dynamics::RigidBody;
use vehicle::reference::Reference;

/// The sets, with the references over the horizon and the bounds about a motion.
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
    /// Whether the bounds follow the evaluated motion.
    follow: bool,
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

/// The robust set: the data from which its bounds follow, and the bounds.
#[derive(Clone, Debug)]
struct Robust {
    settings: Settings,
    design: Design,
    dynamics: Dynamics,
    /// Feedback ticks since the nominal motion began at the measured state.
    age: usize,
    /// Applied share of the tightening; below 1 only for best effort.
    share: f64,
    /// Bounds on ‖ω̃‖ of each stage, rad/s; negative where nothing is left of the limit.
    rate: Vec<f64>,
    /// Bounds on ‖m̃‖ of each interval, N m; negative where nothing is left of the limit.
    moment: Vec<f64>,
    /// Second pair of bounds, which stands in for `rate` and `moment` while a motion is checked.
    remembered: (Vec<f64>, Vec<f64>),
}

/// Relative tolerance in the check of the paper's constraints, for rounding.
const ROUNDING: f64 = 1e-9;
/// Share of the limits that the bounds of the robust set leave free, and that the check of a motion
/// may use. It is needed because the bounds of an optimum are those about a neighbouring motion.
const RESERVE: f64 = 1e-3;
/// Share of a limit that replaces an empty set in the optimisation, which needs balls with an
/// interior. No plan within it is certified.
const EMPTY: f64 = 1e-3;

impl Sets {
    /// # Errors
    /// Returns an error that names the empty set of the paper, or the gain whose eigenvalues are
    /// not real as the paper's constants require.
    pub(super) fn new(settings: &Settings, design: &Design) -> Result<Self, DesignError> {
        let n = settings.horizon;
        let (kind, terminal_radius) = match settings.constraints {
            Constraints::Robust => {
                let robust = Robust {
                    settings: *settings,
                    design: design.clone(),
                    dynamics: Dynamics::new(settings),
                    age: 0,
                    share: 1.0,
                    rate: vec![settings.limit_rate; n + 1],
                    moment: vec![settings.limit_moment; n],
                    remembered: (vec![0.0; n + 1], vec![0.0; n]),
                };
                (Kind::Robust(Box::new(robust)), None)
            }
            Constraints::Paper => {
                let paper = design.paper.ok_or(DesignError::NotReal { name: "feedback" })?;
                let (x_tube, u_tube, epsilon) =
                    (paper.x_tube, paper.u_tube, paper.epsilon1.min(paper.epsilon2));
                for (name, value) in [("x_tube", x_tube), ("u_tube", u_tube), ("epsilon", epsilon)] {
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
            follow: false,
        })
    }

    /// Returns the bounds in force.
    pub(super) fn bounds(&self) -> Bounds {
        let n = self.references.len() - 1;
        let (rate, input) = match &self.kind {
            Kind::Robust(robust) => (robust.rate.clone(), robust.moment.clone()),
            Kind::Paper { x_tube, u_tube, .. } => (vec![*x_tube; n + 1], vec![*u_tube; n]),
        };
        Bounds { rate, input, terminal: self.terminal_radius }
    }

    /// Prepares the robust set for a nominal motion that began at the measured state `age` feedback
    /// ticks ago, with the given share of the tightening.
    pub(super) fn begin(&mut self, age: usize, share: f64) {
        if let Kind::Robust(robust) = &mut self.kind {
            (robust.age, robust.share) = (age, share);
        }
    }

    /// Returns the certificate of a plan, or `None` if it does not satisfy the conditions of the
    /// theorem (docs/guarantee.md), which require the whole tightening.
    ///
    /// `checked` says that [`mpc::Bounded::violated`] has already found no violation in it.
    pub(super) fn certify(&mut self, motion: &Motion<2>, checked: bool) -> Option<Certified> {
        if !matches!(&self.kind, Kind::Robust(robust) if robust.design.counted >= 1.0 && robust.share >= 1.0)
        {
            return None;
        }
        if !checked && mpc::Bounded::violated(self, motion, 0..0).is_some() {
            return None;
        }
        let Self { kind: Kind::Robust(robust), body, references, .. } = self else { return None };
        let n = motion.inputs.len();
        let points = |k| Point::at(references, motion, k);
        // The first state, which no optimisation can change, and the last one, beyond which the
        // motion brakes, are checked separately.
        let (first, second) = (points(0), points(1));
        let rates = first.motion(body);
        let bound = robust.rate_bound(0, norm_of_columns(&rates.rates_by_angles), &first, &second);
        let inside = (0..=n).all(|k| {
            let angle = references[k].angles.y + motion.states[k][0].y;
            angle.abs() + robust.deviation(k).angle <= robust.settings.sideslip_domain
        });
        if !inside || rates.rates.norm() > bound + robust.reserves().0 {
            return None;
        }
        let last = points(n);
        let Robust { settings, dynamics, design, .. } = &**robust;
        let braking = guarantee::braking(settings, dynamics, &design.tightening, last.angles.y, &last.rates)?;
        Some(Certified { margins: robust.margins(body, &first, &second), braking })
    }

    /// Returns the [`Margins`] of a motion; they are zero unless the set is the robust one.
    pub(super) fn margins(&mut self, motion: &Motion<2>) -> Margins {
        let Self { kind: Kind::Robust(robust), body, references, .. } = self else {
            return Margins::default();
        };
        robust.margins(body, &Point::at(references, motion, 0), &Point::at(references, motion, 1))
    }

    /// Returns the largest deviations that the assumptions explain `tick` ticks after the present
    /// optimisation; `None` with the paper's set.
    pub(super) fn explained(&self, tick: usize) -> Option<&guarantee::Deviation> {
        match &self.kind {
            Kind::Robust(robust) => Some(robust.design.tightening.at(robust.age + tick)),
            Kind::Paper { .. } => None,
        }
    }

    /// Returns (Θ̃, x̃_ω, a) for an error and its input at stage `k`.
    fn nominal(&self, k: usize, state: &State<2>, input: &Vector3<f64>) -> [Vector3<f64>; 3] {
        let Reference { angles, rates, accelerations } = &self.references[k];
        [angles + state[0], rates + state[1], accelerations + input]
    }
}

impl mpc::Constraints<2> for Sets {
    fn has_state_balls(&self) -> bool {
        true
    }

    fn follows(&self) -> bool {
        self.follow
    }

    fn balls(&self, k: usize, state: &State<2>, input: &Vector3<f64>) -> Balls<2> {
        let [angles, rates, a] = self.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let at = kinematics.linearise(&self.body, &rates, &a);
        match &self.kind {
            Kind::Robust(robust) => {
                let (rate, moment) = if self.follow {
                    let here = Point::new(angles, rates, a);
                    robust.bounds_about(k, &at, &here, robust.moment_after(&here))
                } else {
                    robust.bounds(k)
                };
                Balls { state: ball(&at.rates, rate), input: ball(&at.moment, moment) }
            }
            Kind::Paper { x_tube, u_tube, .. } => Balls {
                state: Ball {
                    value: rates / *x_tube,
                    by_state: [Matrix3::zeros(), Matrix3::from_diagonal_element(1.0 / x_tube)],
                    by_input: Matrix3::zeros(),
                },
                input: ball(&kinematics.input_of_moment(&self.body, &at.moment), *u_tube),
            },
        }
    }

    fn squares(&self, k: usize, state: &State<2>, input: &Vector3<f64>) -> (f64, f64) {
        let [angles, rates, a] = self.nominal(k, state, input);
        let kinematics = InverseKinematics::at(&angles);
        let (state, input) = match &self.kind {
            Kind::Robust(robust) => {
                let (rate, moment) = robust.bounds(k);
                (kinematics.body_rates(&rates).0 / rate, kinematics.moment(&self.body, &rates, &a) / moment)
            }
            Kind::Paper { x_tube, u_tube, .. } => {
                (rates / *x_tube, kinematics.input(&self.body, &rates, &a) / *u_tube)
            }
        };
        (state.norm_squared(), input.norm_squared())
    }
}

impl Bounded<2> for Sets {
    fn follow(&mut self, follow: bool) {
        self.follow = follow;
    }

    fn unsettled(&mut self, motion: &Motion<2>, of: Range<usize>) -> bool {
        let Kind::Robust(robust) = &mut self.kind else { return false };
        robust.exchange();
        let unsettled = self.violated_in(motion, of).is_some();
        if let Kind::Robust(robust) = &mut self.kind {
            robust.exchange();
        }
        unsettled
    }

    fn tighten(&mut self, motion: &Motion<2>, of: Range<usize>) {
        let Self { kind, body, references, .. } = self;
        if let Kind::Robust(robust) = kind {
            let mut here = Point::at(references, motion, of.start);
            for k in of {
                let next = Point::at(references, motion, k + 1);
                robust.tighten(body, k, &here, &next);
                here = next;
            }
        }
    }

    fn violated(&mut self, motion: &Motion<2>, skip: Range<usize>) -> Option<Range<usize>> {
        let n = motion.inputs.len();
        let before = self.violated_in(motion, 0..skip.start);
        let after = self.violated_in(motion, skip.end.min(n)..n);
        match (before, after) {
            (Some(before), Some(after)) => Some(before.start..after.end),
            (before, after) => before.or(after),
        }
    }

    fn is_set_beyond(&self) -> bool {
        self.follow || matches!(self.kind, Kind::Paper { .. })
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
                let secant = 1.0 / angles.y.cos();
                let most = secant * limit_moment / robust.design.smallest_inertia;
                let drift = vehicle::kinematics::r(&angles) * (body.inverse * -at_rest);
                // The sideslip will have changed by then.
                let beta = angles.y.abs() + h * (rates.norm() + h * (drift.norm() + most));
                if beta >= std::f64::consts::FRAC_PI_3 {
                    return false;
                }
                (rates + drift * h, h * most, limit_rate / beta.cos())
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

/// Margins that the first interval of a plan leaves to the limits, beyond the reserve for
/// deviations from the plan, as shares of the limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// Margin to the rate limit at the interval's end.
    pub rate: f64,
    /// Margin to the moment limit in the interval.
    pub moment: f64,
}

/// One stage of a motion, with its kinematics on demand.
struct Point {
    angles: Vector3<f64>,
    /// Derivative of the angles, x_ω.
    rates: Vector3<f64>,
    /// Norm of the rates, ‖x_ω‖.
    size: f64,
    /// Acceleration a; zero at the last stage.
    acceleration: Vector3<f64>,
    /// Norm of the acceleration, ‖a‖.
    pull: f64,
    turned: OnceCell<InverseKinematics>,
}

/// A stage with known kinematics, from which neighbouring stages are estimated.
struct Anchor {
    angles: Vector3<f64>,
    /// Derivative of the angles, x_ω.
    rates: Vector3<f64>,
    /// Norm of the rates, ‖x_ω‖.
    size: f64,
    motion: BodyMotion,
    /// Largest ‖I W δ‖ over the disturbances.
    feedback: f64,
    /// Upper bound on the growth of `feedback` with the angles.
    feedback_by_angles: f64,
}

impl Point {
    fn new(angles: Vector3<f64>, rates: Vector3<f64>, acceleration: Vector3<f64>) -> Self {
        let (size, pull) = (rates.norm(), acceleration.norm());
        Self { angles, rates, size, acceleration, pull, turned: OnceCell::new() }
    }

    fn at(references: &[Reference], motion: &Motion<2>, k: usize) -> Self {
        let Reference { angles, rates, accelerations } = &references[k];
        let acceleration = motion.inputs.get(k).map_or_else(Vector3::zeros, |input| accelerations + input);
        Self::new(angles + motion.states[k][0], rates + motion.states[k][1], acceleration)
    }

    /// Returns W, which is computed at its first use.
    fn turned(&self) -> &InverseKinematics {
        self.turned.get_or_init(|| InverseKinematics::at(&self.angles))
    }

    fn motion(&self, body: &RigidBody) -> BodyMotion {
        self.turned().motion(body, &self.rates)
    }
}

impl Sets {
    /// Returns the range from the first to the last of the intervals `of` that `motion` violates.
    /// The bounds of all others are set about the motion.
    fn violated_in(&mut self, motion: &Motion<2>, of: Range<usize>) -> Option<Range<usize>> {
        let mut anchor = None;
        let mut here = Point::at(&self.references, motion, of.start);
        let first = of.clone().find(|&k| {
            let next = Point::at(&self.references, motion, k + 1);
            let violates = self.violates(k, &here, &next, &mut anchor);
            here = next;
            violates
        })?;
        // The search runs from the other end, as intervals between two violated ones need no check.
        let mut anchor = None;
        let mut next = Point::at(&self.references, motion, of.end);
        let last = (first + 1..of.end).rev().find(|&k| {
            let here = Point::at(&self.references, motion, k);
            let violates = self.violates(k, &here, &next, &mut anchor);
            next = here;
            violates
        });
        Some(first..last.unwrap_or(first) + 1)
    }

    /// Returns whether the input of interval `k` or the state at its end violates its constraint,
    /// with the bounds about themselves or smaller ones. `anchor` is a neighbouring stage.
    fn violates(&mut self, k: usize, here: &Point, next: &Point, anchor: &mut Option<Anchor>) -> bool {
        let body = &self.body;
        match &mut self.kind {
            Kind::Paper { x_tube, u_tube, inertia_ratio } => {
                let Point { angles, rates, size, acceleration, pull, .. } = here;
                let bound = linearise::input_bound(angles.y, *size, *pull, *inertia_ratio);
                let input = || here.turned().input(body, rates, acceleration).norm();
                let exceeds = |value: f64, bound: f64| value > bound * (1.0 + ROUNDING);
                exceeds(next.size, *x_tube) || exceeds(bound, *u_tube) && exceeds(input(), *u_tube)
            }
            Kind::Robust(robust) => {
                if anchor.as_ref().is_some_and(|anchor| robust.keeps_by_size(k, here, next, anchor)) {
                    return false;
                }
                let anchor = anchor.insert(robust.anchor(body, here));
                if robust.keeps_by_size(k, here, next, anchor) {
                    return false;
                }
                let (moment, rates) = robust.tighten(body, k, here, next);
                let (of_rate, of_moment) = robust.reserves();
                rates > robust.rate[k + 1] + of_rate || moment > robust.moment[k] + of_moment
            }
        }
    }
}

impl Robust {
    /// Exchanges the bounds with the second pair.
    fn exchange(&mut self) {
        let Self { rate, moment, remembered, .. } = self;
        std::mem::swap(rate, &mut remembered.0);
        std::mem::swap(moment, &mut remembered.1);
    }

    /// Returns the parts of the rate limit and of the moment limit that the bounds leave free.
    fn reserves(&self) -> (f64, f64) {
        (RESERVE * self.settings.limit_rate, RESERVE * self.settings.limit_moment)
    }

    /// Returns the bounds on ‖ω̃‖ and ‖m̃‖ at stage `k`, enlarged where the set is empty.
    fn bounds(&self, k: usize) -> (f64, f64) {
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        let moment = self.moment.get(k).map_or(f64::INFINITY, |bound| bound.max(EMPTY * limit_moment));
        (self.rate[k].max(EMPTY * limit_rate), moment)
    }

    /// Returns the bounds on ‖ω̃‖ and ‖m̃‖ about the linearised motion at stage `k`, with
    /// ‖m̃‖ = `after` at the interval's end.
    fn bounds_about(&self, k: usize, at: &Linearisation, here: &Point, after: f64) -> (f64, f64) {
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        let moment = if k < self.moment.len() {
            self.moment_bound_about(k, &at.moment, here, after).max(EMPTY * limit_moment)
        } else {
            f64::INFINITY
        };
        (self.rate_bound(k, at.rates.by_angles.norm(), here, here).max(EMPTY * limit_rate), moment)
    }

    /// Returns ‖m̃‖ at the end of an interval that begins at `here`, with a held, N m.
    fn moment_after(&self, here: &Point) -> f64 {
        let Settings { body, period_optimisation: h, .. } = &self.settings;
        let Point { angles, rates, acceleration: a, .. } = here;
        let angles = angles + (rates + a * (0.5 * h)) * *h;
        linearise::moment(body, &angles, &(rates + a * *h), a).norm()
    }

    /// Sets the bounds of interval `k`. Returns ‖m̃‖ of the interval and ‖ω̃‖ at its end.
    fn tighten(&mut self, body: &RigidBody, k: usize, here: &Point, next: &Point) -> (f64, f64) {
        let at = here.turned().linearise(body, &here.rates, &here.acceleration).moment;
        let after = next.motion(body);
        self.moment[k] = self.moment_bound_about(k, &at, here, after.moment(&here.acceleration).norm());
        self.rate[k + 1] = self.rate_bound(k + 1, norm_of_columns(&after.rates_by_angles), next, here);
        (at.value.norm(), after.rates.norm())
    }

    fn anchor(&self, body: &RigidBody, here: &Point) -> Anchor {
        let motion = here.motion(body);
        let feedback = largest_over_box(&motion.moment_by_acceleration);
        // ‖∂W/∂α‖² and ‖∂W/∂β‖² are at most 2, and the two are orthogonal.
        let feedback_by_angles = self.design.largest_inertia * SQRT_2 * 3.0_f64.sqrt();
        let Point { angles, rates, size, .. } = *here;
        Anchor { angles, rates, size, motion, feedback, feedback_by_angles }
    }

    /// Returns whether the estimate by sizes alone shows that interval `k` satisfies the bounds
    /// that it sets.
    fn keeps_by_size(&mut self, k: usize, here: &Point, next: &Point, anchor: &Anchor) -> bool {
        let (moment, rates) = self.tighten_by_size(k, here, next, anchor);
        moment <= self.moment[k] && rates <= self.rate[k + 1]
    }

    /// Sets bounds that are at most those of [`Self::tighten`], and returns upper bounds of ‖m̃‖ and
    /// ‖ω̃‖. Along the way from `anchor` to `here` and on to `next`, every change is bounded by the
    /// largest derivatives there.
    fn tighten_by_size(&mut self, k: usize, here: &Point, next: &Point, anchor: &Anchor) -> (f64, f64) {
        let Design { largest_inertia, inertia_ratio, .. } = &self.design;
        let a = &here.acceleration;
        let size = next.size.max(here.size).max(anchor.size);
        let slopes = MomentSlopeBounds::new(size, here.pull, *inertia_ratio);
        let (by_angles, by_rates) = (largest_inertia * slopes.by_angles, largest_inertia * slopes.by_rates);
        let turn = (here.angles - anchor.angles).xy().norm();
        let moment =
            anchor.motion.moment(a).norm() + by_angles * turn + by_rates * (here.rates - anchor.rates).norm();
        let turn_within = (next.angles - here.angles).xy().norm();
        let after = moment + by_angles * turn_within + by_rates * (next.rates - here.rates).norm();
        let feedback = anchor.feedback + anchor.feedback_by_angles * turn;
        self.moment[k] = self.moment_bound(k, moment, after, feedback, (by_angles, by_rates), here);
        self.rate[k + 1] = self.rate_bound(k + 1, TURN_BY_ANGLES * next.size, next, here);
        (moment, next.size)
    }

    /// Returns [`Self::moment_bound`] about a linearised moment.
    fn moment_bound_about(&self, k: usize, at: &Linear, here: &Point, after: f64) -> f64 {
        let feedback = largest_over_box(&at.by_acceleration);
        let slopes = (at.by_angles.norm(), at.by_rates.norm());
        self.moment_bound(k, at.value.norm(), after, feedback, slopes, here)
    }

    /// Returns the feedback ticks from the beginning of the nominal motion to prediction step `k`.
    fn tick(&self, k: usize) -> usize {
        self.age + k * self.design.ratio
    }

    fn deviation(&self, k: usize) -> &guarantee::Deviation {
        self.design.tightening.at(self.tick(k))
    }

    /// Returns the bound on ‖ω̃‖ at prediction step k for which ‖ω‖ keeps its limit there and in the
    /// intervals before and after, whatever the error dynamics do. `by_angles` is the norm of
    /// ∂ω/∂(α, β), and `before` is the point before.
    fn rate_bound(&self, k: usize, by_angles: f64, here: &Point, before: &Point) -> f64 {
        let Settings { limit_rate, limit_moment, period_optimisation: h, horizon, .. } = self.settings;
        let reserve = self.reserves().0;
        // Between two steps ‖ω̃‖ may exceed both values by h²/8 times its second derivative. The
        // optimisation does not know the point before, so both accelerations are replaced by one
        // that is rarely exceeded. The bound is then the same in the optimisation and in the check
        // of its result.
        let typical = limit_moment / self.design.largest_inertia;
        let a = here.pull.max(before.pull).max(typical);
        let size = here.size + 2.0 * h * a;
        let curved = 0.125 * h * h * Dynamics::rate_curvature(size, a);
        let loss = self.design.tightening.rate_loss(self.tick(k)).at(by_angles, here.size) + curved;
        let bound = limit_rate - reserve - self.share * loss;
        // This uses ‖x̃_ω‖ ≤ sec β ‖ω̃‖.
        if k == horizon {
            bound.min(self.design.assessment.terminal_rate * here.angles.y.cos() - reserve)
        } else {
            bound
        }
    }

    /// Returns the bound on ‖m̃‖ at the start of prediction interval k for which ‖m‖ keeps its limit
    /// at each of its feedback ticks. With a held, ‖m̃‖ moves from `value` to `after` within the
    /// interval. `feedback` is the largest ‖I R⁻¹ s‖ over the corners s of the shape, and `slopes`
    /// are ‖∂m/∂(α, β)‖ and ‖∂m/∂x_ω‖.
    fn moment_bound(
        &self,
        k: usize,
        value: f64,
        after: f64,
        feedback: f64,
        slopes: (f64, f64),
        here: &Point,
    ) -> f64 {
        let Settings { limit_moment, period_optimisation: h, .. } = self.settings;
        let a = here.pull;
        let size = here.size + h * a;
        let by_angles = self.design.largest_inertia * guarantee::TURN * 3.0_f64.sqrt();
        let loss = self.design.tightening.moment_loss(self.tick(k));
        let loss = loss.at((feedback, by_angles), slopes, (size, a));
        let within = (after - value).max(0.0) + 0.125 * h * h * self.dynamics.moment_curvature(size, a);
        limit_moment - self.reserves().1 - self.share * loss - within
    }

    /// Returns the margins of the first interval.
    fn margins(&mut self, body: &RigidBody, first: &Point, second: &Point) -> Margins {
        let (moment, rate) = self.tighten(body, 0, first, second);
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        let left = |bound: f64, value: f64, limit: f64| (bound - value) / limit + RESERVE;
        Margins {
            rate: left(self.rate[1], rate, limit_rate),
            moment: left(self.moment[0], moment, limit_moment),
        }
    }
}

/// Expresses ‖y‖ ≤ bound in terms of the tracking error and v = a − Θ̈_r.
fn ball(y: &Linear, bound: f64) -> Ball<2> {
    let share = 1.0 / bound;
    let mut by_angles = Matrix3::zeros();
    by_angles.fixed_view_mut::<3, 2>(0, 0).copy_from(&(y.by_angles * share));
    Ball {
        value: y.value * share,
        by_state: [by_angles, y.by_rates * share],
        by_input: y.by_acceleration * share,
    }
}

/// Returns the Frobenius norm of the matrix with these columns.
fn norm_of_columns(columns: &[Vector3<f64>; 2]) -> f64 {
    (columns[0].norm_squared() + columns[1].norm_squared()).sqrt()
}

/// Returns max ‖M s‖ over |s_i| ≤ 1. The maximum is at a corner, where each product of two columns
/// has the product of their signs.
fn largest_over_box(m: &Matrix3<f64>) -> f64 {
    let [x, y, z] = std::array::from_fn(|i| m.column(i));
    let (xy, xz, yz) = (x.dot(&y), x.dot(&z), y.dot(&z));
    let products = (xy + xz + yz).max(xy - xz - yz).max(xz - xy - yz).max(yz - xy - xz);
    (x.norm_squared() + y.norm_squared() + z.norm_squared() + 2.0 * products).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mpc::Constraints as _;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
    use std::cell::Cell;

    fn robust() -> Sets {
        let settings = Settings::new(Constraints::Robust);
        Sets::new(&settings, &Design::new(&settings).unwrap()).unwrap()
    }

    /// A wave of (Θ̃, x̃_ω, a) over the horizon, which is all that the check needs of a motion.
    fn wave() -> impl Strategy<Value = Motion<2>> {
        let component = || (-1.0..1.0, -1.0..1.0, 0.0..0.3, 0.0..6.3);
        let sizes = ((-2.0..0.0), (-3.0..-0.8), (-3.0..-0.8));
        (sizes, prop::collection::vec(component(), 9)).prop_map(
            |((angle, rate, acceleration), components)| {
                let mut motion = Motion::new(100);
                let at = |k: usize, first: usize, decade: f64| {
                    Vector3::from_fn(|i, _| {
                        let (mean, amplitude, frequency, phase) = components[first + i];
                        10.0_f64.powf(decade) * (mean + amplitude * f64::sin(phase + frequency * k as f64))
                    })
                };
                for (k, state) in motion.states.iter_mut().enumerate() {
                    *state = [at(k, 0, angle), at(k, 3, rate)];
                }
                for (k, input) in motion.inputs.iter_mut().enumerate() {
                    *input = at(k, 6, acceleration);
                }
                motion
            },
        )
    }

    fn run(cases: u32, property: impl Fn(Motion<2>) -> Result<(), TestCaseError>) {
        let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        let config = Config { cases, failure_persistence: None, ..Config::default() };
        TestRunner::new_with_rng(config, random).run(&wave(), property).unwrap();
    }

    fn count(of: &Cell<[usize; 2]>, which: bool) {
        let mut counts = of.get();
        counts[usize::from(which)] += 1;
        of.set(counts);
    }

    #[test]
    fn oracle_the_check_of_the_horizon_finds_what_exact_bounds_find() {
        let (violations, by_size) = (Cell::new([0; 2]), Cell::new([0; 2]));
        run(5000, |motion| {
            let n = motion.inputs.len();
            let mut sets = robust();
            let found = sets.violated(&motion, 0..0);
            let checked = sets.bounds();
            sets.tighten(&motion, 0..n);
            let exact = sets.bounds();
            let Kind::Robust(robust) = &sets.kind else { unreachable!() };
            let (of_rate, of_moment) = robust.reserves();
            let violates = |&k: &usize| {
                let input = motion.inputs.get(k + 1).copied().unwrap_or_default();
                let rates =
                    sets.squares(k + 1, &motion.states[k + 1], &input).0.sqrt() * robust.bounds(k + 1).0;
                let moment =
                    sets.squares(k, &motion.states[k], &motion.inputs[k]).1.sqrt() * robust.bounds(k).1;
                rates > exact.rate[k + 1] + of_rate || moment > exact.input[k] + of_moment
            };
            let expected = (0..n).find(violates).zip((0..n).rfind(violates));
            count(&violations, found.is_some());
            let expected = expected.map(|(first, last)| first..last + 1);
            prop_assert_eq!(&found, &expected);
            // Bounds of the intervals between violated ones stay unchanged.
            for k in (0..n).filter(|k| !expected.as_ref().is_some_and(|range| range.contains(k))) {
                prop_assert!(checked.rate[k + 1] <= exact.rate[k + 1] + 1e-12, "{}", k);
                prop_assert!(checked.input[k] <= exact.input[k] + 1e-6, "{}", k);
                count(&by_size, checked.input[k] < exact.input[k]);
            }
            Ok(())
        });
        // Both outcomes must occur, and both ways of deciding them.
        let least = |of: &Cell<[usize; 2]>| of.get().into_iter().min().unwrap();
        assert!(least(&violations) > 40 && least(&by_size) > 4000, "{violations:?} {by_size:?}");
    }

    #[test]
    fn oracle_bounds_by_size_hold_from_any_stage() {
        let tightest = Cell::new(0.0_f64);
        run(100, |motion| {
            let mut sets = robust();
            let Sets { kind: Kind::Robust(robust), body, references, .. } = &mut sets else { unreachable!() };
            let point = |k| Point::at(references, &motion, k);
            for k in 0..motion.inputs.len() {
                let (here, next) = (point(k), point(k + 1));
                let anchor = robust.anchor(body, &point(k - k % 10));
                let (moment, rates) = robust.tighten_by_size(k, &here, &next, &anchor);
                let (moment_bound, rate_bound) = (robust.moment[k], robust.rate[k + 1]);
                let exact = robust.tighten(body, k, &here, &next);
                let rounding = 1.0 + 1e-12;
                prop_assert!(moment * rounding >= exact.0 && rates * rounding >= exact.1, "{}", k);
                let bounds = (robust.moment[k] * rounding, robust.rate[k + 1] * rounding);
                prop_assert!(moment_bound <= bounds.0 && rate_bound <= bounds.1, "{}", k);
                let known = anchor.motion.moment(&here.acceleration).norm();
                if moment > known {
                    tightest.set(tightest.get().max((exact.0 - known) / (moment - known)));
                }
            }
            Ok(())
        });
        assert!(tightest.get() > 0.3, "{tightest:?}");
    }
}
