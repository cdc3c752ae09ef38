//! The robust set: bounds on ‖ω̃‖ and ‖m̃‖ about a motion, for which the limits hold whatever the
//! error dynamics do (docs/guarantee.md).

use super::design::Design;
use super::guarantee::{self, Carried, Dynamics, End, Held, MomentLoss, Onset, Switching};
use super::settings::Settings;
use crate::linearise::{BodyMotion, InverseKinematics, Linear};
use crate::mpc::ErrorTrajectory;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::cell::{OnceCell, RefCell};
use vehicle::dynamics::RigidBody;
use vehicle::math::cos;
use vehicle::reference::Reference;

/// The robust set: the data from which its bounds follow.
#[derive(Clone, Debug)]
pub(super) struct Robust {
    pub settings: Settings,
    pub design: Design,
    pub dynamics: Dynamics,
    /// Feedback ticks since the nominal motion began at the measured state.
    pub age: usize,
    /// Applied share of the tightening; below 1 only for best effort.
    pub share: f64,
    /// What the motion follows on.
    pub onset: Onset,
    /// What changes of the acceleration leave at the stages of the motion that was carried along
    /// last; empty if the delay is exact.
    carried: RefCell<Vec<Carried>>,
}

/// Share of the limits that the bounds of the robust set leave free, and that the check of a motion
/// may use. It is needed because the bounds of an optimum are those about a neighbouring motion.
const RESERVE: f64 = 1e-3;
/// Share of a limit that replaces an empty set in the optimisation, which needs balls with an
/// interior. No plan within it is certified.
const EMPTY: f64 = 1e-3;

/// Bounds of one interval, and the norms to which they apply. A bound is negative where nothing is
/// left of its limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    /// Norm of the body rates at the interval's end, ‖ω̃‖, and its bound, rad/s.
    pub rate: f64,
    pub rate_bound: f64,
    /// Norm of the moment at the interval's start, ‖m̃‖, and its bound, N m.
    pub moment: f64,
    pub moment_bound: f64,
}

impl Interval {
    /// Returns whether both norms keep their bounds, enlarged by these reserves.
    pub(super) fn keeps(&self, (of_rate, of_moment): (f64, f64)) -> bool {
        self.rate <= self.rate_bound + of_rate && self.moment <= self.moment_bound + of_moment
    }
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
pub(super) struct Point {
    pub angles: Vector3<f64>,
    /// Derivative of the angles, x_ω.
    pub rates: Vector3<f64>,
    /// Norm of the rates, ‖x_ω‖.
    pub size: f64,
    /// Acceleration a; zero at the last stage.
    pub acceleration: Vector3<f64>,
    /// Norm of the acceleration, ‖a‖.
    pub pull: f64,
    turned: OnceCell<InverseKinematics>,
}

impl Point {
    pub(super) fn new(
        angles: Vector3<f64>,
        rates: Vector3<f64>,
        acceleration: Vector3<f64>,
    ) -> Self {
        let (size, pull) = (rates.norm(), acceleration.norm());
        Self { angles, rates, size, acceleration, pull, turned: OnceCell::new() }
    }

    pub(super) fn at(references: &[Reference], motion: &ErrorTrajectory<2>, k: usize) -> Self {
        let Reference { angles, rates, accelerations } = &references[k];
        let acceleration =
            motion.inputs.get(k).map_or_else(Vector3::zeros, |input| accelerations + input);
        Self::new(angles + motion.states[k][0], rates + motion.states[k][1], acceleration)
    }

    /// Returns W, which is computed at its first use.
    pub(super) fn turned(&self) -> &InverseKinematics {
        self.turned.get_or_init(|| InverseKinematics::at(&self.angles))
    }

    pub(super) fn motion(&self, body: &RigidBody) -> BodyMotion {
        self.turned().motion(body, &self.rates)
    }
}

impl Robust {
    pub(super) fn new(settings: &Settings, design: &Design) -> Self {
        Self {
            settings: *settings,
            design: design.clone(),
            dynamics: Dynamics::new(settings),
            age: 0,
            share: 1.0,
            onset: Onset::default(),
            carried: RefCell::new(Vec::with_capacity(settings.horizon + 1)),
        }
    }

    /// Returns what an unknown part of the delay adds, with what is carried along at stage `k`.
    fn switching(&self, k: usize) -> Option<(&Switching, Carried)> {
        let switching = self.design.tightening.switching.as_deref()?;
        Some((switching, self.carried.borrow().get(k).copied().unwrap_or_default()))
    }

    /// Carries along what the changes of these accelerations of the stages leave (rad/s²).
    pub(super) fn carry(&self, accelerations: impl Iterator<Item = Vector3<f64>>) {
        let Some(switching) = &self.design.tightening.switching else { return };
        let mut all = self.carried.borrow_mut();
        all.clear();
        let (mut carried, mut before) = (self.onset.carried, self.onset.before);
        for a in accelerations {
            carried = switching.begin(&carried, (a - before).norm());
            all.push(carried);
            (carried, before) = (switching.next(&carried), a);
        }
        all.push(carried);
    }

    /// Returns what is carried along at the end of the horizon.
    pub(super) fn carried_to_the_end(&self) -> Carried {
        self.carried.borrow().last().copied().unwrap_or_default()
    }

    /// Returns whether the limits hold also in the last instants before the motion, in which its
    /// first command already acts if the delay is shorter than assumed. `size` is ‖ω̃‖ at the first
    /// stage and `bound` its bound, `sideslip` is β̃ there.
    ///
    /// Either the plan before left room for such a command, or the motion does not come near the
    /// limits in that time.
    pub(super) fn keeps_before(&self, first: &Point, (size, bound): (f64, f64)) -> bool {
        let Some((switching, carried)) = self.switching(0) else { return true };
        let Onset { before, allowed, .. } = self.onset;
        let change = (first.acceleration - before).norm();
        if switching.pulse_of_command(change) <= allowed {
            return true;
        }
        let tightening = &self.design.tightening;
        let Settings { delay_error, sideslip_domain, .. } = self.settings;
        let of_angle = tightening.at(self.age).angle + switching.deviation(&carried).angle;
        let Dynamics { geometry, rate, .. } = &self.dynamics;
        let most = first.pull.max(before.norm()) + tightening.norm + switching.turn();
        size + delay_error * (most + geometry.drift * rate * rate) <= bound
            && first.angles.y.abs() + of_angle + delay_error * rate <= sideslip_domain
    }

    /// Returns the parts of the rate limit and of the moment limit that the bounds leave free.
    pub(super) fn reserves(&self) -> (f64, f64) {
        (RESERVE * self.settings.limit_rate, RESERVE * self.settings.limit_moment)
    }

    /// Returns the bounds on ‖ω̃‖ and ‖m̃‖, enlarged where the set is empty.
    pub(super) fn nonempty(&self, (rate, moment): (f64, f64)) -> (f64, f64) {
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        (rate.max(EMPTY * limit_rate), moment.max(EMPTY * limit_moment))
    }

    /// Returns the bounds of interval `k` about the motion, with the norms.
    pub(super) fn interval(&self, k: usize, here: &Point, next: &Point) -> Interval {
        let body = &self.settings.body;
        let a = &here.acceleration;
        let before = here.turned().linearise(body, &here.rates, a).moment;
        let after = next.turned().linearise(body, &next.rates, a);
        let ends = [end(&before, here.size), end(&after.moment, next.size)];
        let by_angles = after.rates.by_angles.norm();
        Interval {
            rate: after.rates.value.norm(),
            rate_bound: self.rate_bound(k + 1, by_angles, next, here),
            moment: ends[0].moment,
            moment_bound: self.moment_bound(k, &ends, here.pull),
        }
    }

    /// Returns the feedback ticks from the beginning of the nominal motion to prediction step `k`.
    fn tick(&self, k: usize) -> usize {
        self.age + k * self.design.ratio
    }

    /// Returns whether |β| stays within its bound throughout interval `k`, whatever the error
    /// dynamics do.
    ///
    /// Within the interval β̃ is a parabola, and the deviation lies below the straight line between
    /// its values at both ends plus the bulge, so that the largest value of the sum is exact.
    ///
    /// `here` holds β̃ and its derivative at the beginning, `a` is its second derivative, and `end`
    /// is β̃ at the end.
    pub(super) fn keeps_sideslip(&self, k: usize, here: [f64; 2], a: f64, end: f64) -> bool {
        let Settings { period_optimisation: h, sideslip_domain, .. } = self.settings;
        let tightening = &self.design.tightening;
        let more = self.switching(k).map_or(0.0, |(switching, carried)| {
            let next = self.carried.borrow().get(k + 1).copied().unwrap_or_default();
            switching.deviation(&carried).angle + switching.early(&next).0
        });
        let [from, to] = [k, k + 1].map(|k| tightening.at(self.tick(k)).angle + more);
        let slope = (to - from) / h;
        let largest = |sign: f64| {
            let (rate, a) = (sign * here[1] + slope, sign * a);
            let (before, after) = (sign * here[0] + from, sign * end + to);
            let at_top = if a < 0.0 && rate > 0.0 && rate < -a * h {
                before - 0.5 * rate * rate / a
            } else {
                before
            };
            at_top.max(after)
        };
        largest(1.0).max(largest(-1.0)) + tightening.angle_bulge(self.tick(k)) <= sideslip_domain
    }

    /// Returns the bound on ‖ω̃‖ at prediction step k for which ‖ω‖ keeps its limit there and in
    /// the intervals before and after, whatever the error dynamics do. `by_angles` is the norm of
    /// ∂ω/∂(α, β), and `before` is the point before.
    pub(super) fn rate_bound(&self, k: usize, by_angles: f64, here: &Point, before: &Point) -> f64 {
        let Settings { limit_rate, limit_moment, period_optimisation: h, horizon, .. } =
            self.settings;
        let reserve = self.reserves().0;
        // Between two steps ‖ω̃‖ may exceed both values by h²/8 times its second derivative. The
        // optimisation does not know the point before, so both accelerations are replaced by one
        // that is rarely exceeded. The bound is then the same in the optimisation and in the check
        // of its result.
        let typical = limit_moment / self.design.largest_inertia;
        let a = here.pull.max(before.pull).max(typical);
        let size = here.size + 2.0 * h * a;
        let loss = self.design.tightening.rate_loss(self.tick(k));
        let more = self.more_of_the_deviation(k, here, before).map(|more| loss.with(more, h));
        let loss = more.as_ref().unwrap_or(loss);
        let loss = loss.at(by_angles, here.size) + loss.within(size, a);
        let bound = limit_rate - reserve - self.share * loss;
        // This uses ‖x̃_ω‖ ≤ sec β ‖ω̃‖.
        if k == horizon {
            let terminal_rate = self.terminal_rate(here, before);
            bound.min(terminal_rate * cos(here.angles.y) - reserve)
        } else {
            bound
        }
    }

    /// Returns the largest ‖x̃_ω‖ at the end of the horizon, rad/s.
    fn terminal_rate(&self, end: &Point, before: &Point) -> f64 {
        let Self { settings, dynamics, design, .. } = self;
        let Some((switching, carried)) = self.switching(settings.horizon) else {
            return design.assessment.terminal_rate;
        };
        let from = (&carried, before.pull, &end.rates);
        guarantee::terminal_rate(settings, dynamics, &design.tightening, switching, from)
    }

    /// Returns what the plan's changes of acceleration add to the deviation of angles and rates
    /// (rad, rad/s) at prediction step k and in the intervals before and after, if the delay is
    /// not exact.
    fn more_of_the_deviation(&self, k: usize, here: &Point, before: &Point) -> Option<(f64, f64)> {
        let (switching, mut carried) = self.switching(k)?;
        let Settings { horizon, period_optimisation: h, .. } = self.settings;
        if k == horizon {
            // The motion brakes from here on, with less than 1/h.
            carried = switching.begin(&carried, before.pull + here.size / h);
        }
        let after = switching.deviation(&carried);
        let Some(before) = k.checked_sub(1).and_then(|k| self.switching(k)) else {
            return Some((after.angle, after.rate));
        };
        let (in_between, early) = (switching.deviation(&before.1), switching.early(&carried));
        let largest = |after: f64, before: f64, early: f64| after.max(before + early);
        Some((
            largest(after.angle, in_between.angle, early.0),
            largest(after.rate, in_between.rate, early.1),
        ))
    }

    /// Returns the bound on ‖m̃‖ at the start of prediction interval k, between these ends and with
    /// an acceleration of this norm, for which ‖m‖ keeps its limit at each of its feedback ticks.
    pub(super) fn moment_bound(&self, k: usize, ends: &[End; 2], acceleration: f64) -> f64 {
        let held = Held { acceleration, ratio: self.design.ratio, share: self.share };
        let tightening = &self.design.tightening;
        let more = self.switching(k).map(|(switching, carried)| {
            let deviation = tightening.within(self.tick(k), self.design.ratio);
            let deviation = deviation.plus(&switching.deviation(&carried));
            let h = self.settings.period_optimisation;
            MomentLoss::new(&self.dynamics, &deviation, tightening.bearing, h)
        });
        let loss = more.as_ref().unwrap_or_else(|| tightening.moment_loss(self.tick(k)));
        let needed = loss.largest_moment(&self.dynamics, ends, held);
        self.settings.limit_moment - self.reserves().1 - (needed - ends[0].moment)
    }

    /// Returns the margins of the first interval.
    pub(super) fn margins(&self, first: &Point, second: &Point) -> Margins {
        let Interval { rate, rate_bound, moment, moment_bound } = self.interval(0, first, second);
        let Settings { limit_rate, limit_moment, .. } = self.settings;
        let left = |bound: f64, value: f64, limit: f64| (bound - value) / limit + RESERVE;
        Margins {
            rate: left(rate_bound, rate, limit_rate),
            moment: left(moment_bound, moment, limit_moment),
        }
    }
}

/// Returns the end of an interval with this linearised moment and ‖x̃_ω‖ = `size`.
fn end(moment: &Linear, size: f64) -> End {
    End {
        moment: moment.value.norm(),
        bearing: largest_over_box(&moment.by_acceleration),
        slopes: (moment.by_angles.norm(), moment.by_rates.norm()),
        size,
    }
}

/// Returns the Frobenius norm of the matrix with these columns.
pub(super) fn norm_of_columns(columns: &[Vector3<f64>; 2]) -> f64 {
    (columns[0].norm_squared() + columns[1].norm_squared()).sqrt()
}

/// Returns max ‖M s‖ over |s_i| ≤ 1. The maximum is at a corner, where each product of two columns
/// has the product of their signs.
pub(super) fn largest_over_box(m: &Matrix3<f64>) -> f64 {
    let [x, y, z] = std::array::from_fn(|i| m.column(i));
    let (xy, xz, yz) = (x.dot(&y), x.dot(&z), y.dot(&z));
    let products = (xy + xz + yz).max(xy - xz - yz).max(xz - xy - yz).max(yz - xy - xz);
    (x.norm_squared() + y.norm_squared() + z.norm_squared() + 2.0 * products).sqrt()
}
