//! The robust set: bounds on ‖ω̃‖ and ‖m̃‖ about a motion, for which the limits hold whatever the
//! error dynamics do (docs/guarantee.md).

mod certificate;
mod judging;
mod law;
mod norms;

use super::design::Design;
use super::guarantee::{self, Dynamics, End, Held, HorizonEnd, Tightening};
use super::plan::Terms;
use super::settings::Settings;
use super::stages::{Point, Stages};
use crate::linearise::Linear;
use nalgebra::{Matrix3, Vector3, Vector6};
use vehicle::math::cos;

/// The robust set: the data from which its bounds follow.
#[derive(Clone, Debug)]
pub(super) struct Robust {
    pub settings: Settings,
    pub design: Design,
    pub dynamics: Dynamics,
    pub stages: Stages,
    /// Feedback ticks since the nominal trajectory began at the measured state.
    pub age: usize,
    /// Applied share of the tightening; below 1 only for best effort.
    pub share: f64,
    /// Whether another optimisation follows if this one finds no optimum.
    pub another: bool,
    /// Terms of the plan.
    terms: Terms,
    /// Part of the rate limit that the turn of the trajectory needs, rad/s.
    turn: f64,
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
    /// Norm of the moment that the actuators must give at the interval's start, and its bound, N m.
    pub moment: f64,
    pub moment_bound: f64,
}

impl Interval {
    /// Returns whether both norms keep their bounds, enlarged by these reserves.
    pub(super) fn keeps(&self, (of_rate, of_moment): (f64, f64)) -> bool {
        self.rate <= self.rate_bound + of_rate && self.moment <= self.moment_bound + of_moment
    }
}

/// How a nominal trajectory begins (docs/guarantee.md, "Where the nominal trajectory begins").
#[derive(Clone, Copy)]
struct Beginning {
    /// First state (Θ̃, x̃_ω), rad and rad/s.
    state: Vector6<f64>,
    /// Feedback ticks since the nominal trajectory began at a measured state.
    age: u32,
    /// Level of the bound on the disturbance, see [`crate::crmpc::Terms::level`].
    level: usize,
}

impl Robust {
    pub(super) fn new(settings: &Settings, design: &Design) -> Self {
        let Settings { horizon, body, period_optimisation, .. } = *settings;
        Self {
            settings: *settings,
            turn: 0.0,
            terms: Terms { limit_moment: settings.limit_moment, ..Terms::default() },
            design: design.clone(),
            dynamics: Dynamics::new(settings),
            stages: Stages::new(horizon, body, period_optimisation),
            age: 0,
            share: 1.0,
            another: false,
        }
    }

    /// Prepares the bounds for a nominal trajectory with this beginning and this share of the
    /// tightening.
    fn begin(&mut self, beginning: &Beginning, share: f64) {
        let Beginning { age, level, .. } = *beginning;
        (self.age, self.share) = (age as usize, share);
        self.terms.level = level;
        self.another = false;
    }

    /// Returns the tightening for the bound on the disturbance that the plan assumes.
    fn tightening(&self) -> &Tightening {
        self.design.at_level(self.terms.level)
    }

    /// Returns the settings with the limit that the plan assumes.
    fn settings_of_plan(&self) -> Settings {
        Settings { limit_moment: self.terms.limit_moment, ..self.settings }
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
        let before = self.asked(here.turned().linearise(body, &here.rates, a).moment);
        let after = next.turned().linearise(body, &next.rates, a);
        let ends = [end(&before, here.size), end(&self.asked(after.moment), next.size)];
        let by_angles = after.rates.by_angles.norm();
        Interval {
            rate: after.rates.value.norm(),
            rate_bound: self.rate_bound(k + 1, by_angles, next, here),
            moment: ends[0].moment,
            moment_bound: self.moment_bound(k, &ends, here.pull),
        }
    }

    /// Returns the part of a moment that the actuators must give.
    pub(super) fn asked(&self, moment: Linear) -> Linear {
        Linear { value: moment.value - self.terms.known, ..moment }
    }

    /// Returns the feedback ticks from the beginning of the nominal trajectory to prediction step
    /// `k`.
    fn tick(&self, k: usize) -> usize {
        self.age + k * self.design.ratio
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
        let loss = &self.tightening().tick(self.tick(k)).rate_loss;
        let loss = loss.at(by_angles, here.size) + loss.within(size, a);
        let bound = limit_rate - self.turn - reserve - self.share * loss;
        // This uses ‖x̃_ω‖ ≤ sec β ‖ω̃‖.
        if k == horizon {
            bound.min(self.terminal_rate() * cos(here.angles.y) - reserve)
        } else {
            bound
        }
    }

    /// Returns the largest ‖x̃_ω‖ at the end of the horizon, rad/s.
    fn terminal_rate(&self) -> f64 {
        let Self { settings, dynamics, design, terms, .. } = self;
        let is_scheduled = terms.level > 0 || terms.limit_moment < settings.limit_moment;
        if self.turn == 0.0 && !is_scheduled {
            return design.assessment.terminal_rate;
        }
        let settings = self.settings_of_plan();
        guarantee::terminal_rate(&settings, dynamics, self.tightening(), self.turn)
    }

    /// Returns the end of a plan with this last stage.
    fn horizon_end(&self, last: &Point) -> HorizonEnd {
        HorizonEnd { sideslip: last.angles.y, rates: last.rates, turn: self.turn }
    }

    /// Returns the bound on ‖m̃‖ at the start of prediction interval k, between these ends and with
    /// an acceleration of this norm, for which ‖m‖ keeps its limit at each of its feedback ticks.
    pub(super) fn moment_bound(&self, k: usize, ends: &[End; 2], acceleration: f64) -> f64 {
        let held = Held { acceleration, ratio: self.design.ratio, share: self.share };
        let loss = &self.tightening().tick(self.tick(k)).moment_loss;
        let needed = loss.largest_moment(&self.dynamics, ends, held);
        let limit = self.terms.limit_moment - self.settings.known_change;
        limit - self.reserves().1 - (needed - ends[0].moment)
    }
}

/// Returns the end of an interval with this linearised moment and ‖x̃_ω‖ = `size`.
fn end(moment: &Linear, size: f64) -> End {
    End {
        moment: moment.value.norm(),
        induced_norm: largest_over_box(&moment.by_acceleration),
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

#[cfg(test)]
mod tests;
