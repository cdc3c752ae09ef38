//! Check of a recorded plan: a bound on everything that the vehicle can do while the plan is
//! followed, until the plan has braked to rest.
//!
//! It is derived from assumptions 1 to 4 of docs/guarantee.md and from nothing else that the
//! certificate uses. No number of the controller's design enters, only the settings, the plan and
//! its age. docs/proof.md gives the derivation.

mod causes;
mod deviation;
mod law;
mod reach;
mod rest;
mod smoothness;

use crate::body::Body;
use crate::interval::Interval;
use control::crmpc::{Constraints, Plan, Settings};
use deviation::Deviation;
use law::Range;
use reach::Reach;

/// Smallest shares of the limits that a plan leaves unused; negative where the check does not
/// confirm the limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Left {
    /// Unused share of the sideslip angle's domain.
    pub sideslip: f64,
    /// Unused share of the limit on ‖ω‖.
    pub rate: f64,
    /// Unused share of the limit on ‖m‖.
    pub moment: f64,
}

impl Left {
    const ALL: Self = Self { sideslip: 1.0, rate: 1.0, moment: 1.0 };

    /// Whether all three limits are confirmed.
    pub fn confirmed(&self) -> bool {
        self.sideslip >= 0.0 && self.rate >= 0.0 && self.moment >= 0.0
    }

    /// Returns the smaller of each share.
    #[must_use]
    pub fn min(&self, other: &Self) -> Self {
        Self {
            sideslip: self.sideslip.min(other.sideslip),
            rate: self.rate.min(other.rate),
            moment: self.moment.min(other.moment),
        }
    }
}

/// Result of the check of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Smallest unused share of each limit.
    pub left: Left,
    /// Time from the beginning of the plan at which each smallest share occurs, s; infinite beyond
    /// the horizon.
    pub at: [f64; 3],
    /// Whether the states of the plan follow from its accelerations.
    pub consistent: bool,
}

impl Verdict {
    /// Whether the plan is confirmed.
    pub fn confirmed(&self) -> bool {
        self.consistent && self.left.confirmed()
    }

    fn record(&mut self, time: f64, left: &Left) {
        let lower = |place: &mut f64, least: &mut f64, value: f64| {
            // A value that is not a number is no confirmation.
            if value.is_nan() || value < *least {
                (*place, *least) = (time, if value.is_nan() { f64::NEG_INFINITY } else { value });
            }
        };
        lower(&mut self.at[0], &mut self.left.sideslip, left.sideslip);
        lower(&mut self.at[1], &mut self.left.rate, left.rate);
        lower(&mut self.at[2], &mut self.left.moment, left.moment);
    }
}

/// Check of plans for one set of settings.
pub struct PlanCheck {
    settings: Settings,
    body: Body,
    reach: Reach,
    /// Number of feedback ticks per optimisation.
    ratio: usize,
}

/// Number of times that a range of angles is halved before a moment counts as too large.
const HALVINGS: u32 = 6;
/// Largest difference of a plan's state from the one that its accelerations lead to.
const ROUNDING: f64 = 1e-12;

impl PlanCheck {
    /// Prepares the check.
    ///
    /// # Errors
    /// Says why no bound is available for these settings: for the paper's set, and where the
    /// feedback is too slow.
    pub fn new(settings: &Settings) -> Result<Self, String> {
        if settings.constraints != Constraints::Robust {
            return Err("only the robust set is checked".into());
        }
        let settings = &settings.resolved().map_err(|error| error.to_string())?;
        let body = Body::new(settings).ok_or("the body is not symmetric about its x-z plane")?;
        let reach = Reach::new(settings)
            .ok_or("the feedback is too slow, or its delay too long, for a bound")?;
        let ratio = (settings.period_optimisation / settings.period_feedback).round() as usize;
        Ok(Self { settings: *settings, body, reach, ratio })
    }

    /// Checks a plan whose nominal trajectory began `age` feedback ticks before the plan.
    pub fn check(&self, plan: &Plan, age: usize) -> Verdict {
        let mut verdict =
            Verdict { left: Left::ALL, at: [0.0; 3], consistent: self.is_consistent(plan) };
        for k in 0..plan.accelerations.len() {
            let stage = Stage::new(&self.settings, plan, k);
            let tick = k * self.ratio;
            let of_moment = self.moment(&stage, age + tick);
            for j in 0..self.ratio {
                let time = (tick + j) as f64 * self.settings.period_feedback;
                let left = self.sideslip_and_rates(&stage, j, age + tick + j);
                verdict.record(time, &Left { moment: of_moment, ..left });
            }
        }
        verdict.record(f64::INFINITY, &self.rest(plan, &self.reach.forever));
        verdict
    }

    fn is_consistent(&self, plan: &Plan) -> bool {
        let h = self.settings.period_optimisation;
        let whole = plan.states.len() == plan.accelerations.len() + 1;
        let next = |k: usize| {
            let (from, to, a) = (&plan.states[k], &plan.states[k + 1], &plan.accelerations[k]);
            (0..3).all(|i| {
                let angle = from[i] + h * (from[3 + i] + 0.5 * h * a[i]);
                let rate = from[3 + i] + h * a[i];
                (angle - to[i]).abs() <= ROUNDING * (1.0 + to[i].abs())
                    && (rate - to[3 + i]).abs() <= ROUNDING
            })
        };
        whole && (0..plan.accelerations.len()).all(next)
    }

    /// Bounds sideslip and body rates from feedback tick `j` of a stage, `n` ticks after the nominal
    /// trajectory began, until the next.
    fn sideslip_and_rates(&self, stage: &Stage, j: usize, n: usize) -> Left {
        let ends = [0, 1].map(|i| (stage.at((j + i) as f64), self.reach.at(n + i)));
        let angles = ends.map(|(_, deviation)| deviation.angle.component());
        let off = angles[0].max(angles[1]) + ends[0].1.bulge;
        let swept = stage.sideslip(j).abs();
        // The plan's rates are straight lines, and the deviation is convex except for the ripple, so
        // that ‖ω‖ is largest at an end.
        let near = swept - off;
        let rate = ends.map(|(state, deviation)| {
            self.body_rates(near, [3, 4, 5].map(|i| state[i].abs()), deviation)
        });
        let size = stage.farthest_sideslip(j, angles) + ends[0].1.bulge;
        let Settings { sideslip_domain, limit_rate, .. } = self.settings;
        Left {
            sideslip: (sideslip_domain - size.high) / sideslip_domain,
            rate: (limit_rate - rate[0].high.max(rate[1].high)) / limit_rate,
            moment: 1.0,
        }
    }

    /// Bounds ‖ω‖ where |β| is at least `sideslip` and the plan's rates have these sizes.
    fn body_rates(
        &self,
        sideslip: Interval,
        sizes: [Interval; 3],
        deviation: &Deviation,
    ) -> Interval {
        let cosine = Interval::from(sideslip.low.max(0.0)).sin_cos().1;
        let [alpha, beta, sigma] = sizes.map(|size| size + deviation.rate.half);
        let squares = (cosine * alpha).square() + beta.square() + sigma.square();
        squares.sqrt() + deviation.rate.norm + self.reach.ripple
    }

    /// Bounds the commands of a stage that begins `n` ticks after the nominal trajectory; the result
    /// is the smallest unused share of the limit.
    fn moment(&self, stage: &Stage, n: usize) -> f64 {
        let deviation = |j: usize| self.reach.at(n + j);
        let ranges = (0..self.ratio).map(|j| Self::range(stage, j, deviation(j)));
        let Some(hull) = ranges.clone().reduce(|a, b| a.hull(&b)) else { return f64::NAN };
        let remainder = law::remainder(&self.body, &hull);
        // The flights have no known moment, but one might begin to act while the plan is followed.
        let limit = self.settings.limit_moment - self.settings.known_change;
        let largest = ranges.enumerate().map(|(j, range)| {
            let added = self.added(deviation(j));
            let bound = (Interval::from(law::largest(&self.body, &range)) + remainder + added).high;
            if bound <= limit {
                return bound;
            }
            let rest = (Interval::from(limit) - added).low;
            (Interval::from(law::divided(&self.body, &range, rest, HALVINGS)) + added).high
        });
        (limit - largest.fold(0.0, f64::max)) / self.settings.limit_moment
    }

    /// Moment by the parts of K ô that are bounded in norm, N m: ‖I W k‖ ≤ λ_max(I) ‖k‖.
    fn added(&self, deviation: &Deviation) -> Interval {
        let [x, z, y] = self.body.principal();
        x.max(y).max(z) * deviation.feedback.norm + deviation.inertia
    }

    /// Range in which the law evaluates the moment of feedback tick `j` of a stage.
    fn range(stage: &Stage, j: usize, deviation: &Deviation) -> Range {
        let state = stage.at(j as f64 + 0.5);
        let Deviation { law_angle, law_rate, feedback, .. } = deviation;
        let radius = |i: usize| if i < 2 { law_angle.half } else { law_rate.half };
        Range {
            centre: [state[0], state[1], state[3], state[4], state[5]],
            radii: std::array::from_fn(radius),
            norms: [law_angle.norm, law_rate.norm],
            acceleration: stage.acceleration,
            feedback: [feedback.half; 3],
        }
    }
}

/// One interval of the plan, with its acceleration held.
struct Stage {
    state: [Interval; 6],
    acceleration: [Interval; 3],
    period: Interval,
}

impl Stage {
    fn new(settings: &Settings, plan: &Plan, k: usize) -> Self {
        Self {
            state: std::array::from_fn(|i| Interval::from(plan.states[k][i])),
            acceleration: std::array::from_fn(|i| Interval::from(plan.accelerations[k][i])),
            period: Interval::from(settings.period_feedback),
        }
    }

    /// State after this many feedback periods.
    fn at(&self, periods: f64) -> [Interval; 6] {
        let t = Interval::from(periods) * self.period;
        let half = Interval::from(0.5);
        std::array::from_fn(|i| {
            if i < 3 {
                self.state[i] + t * (self.state[3 + i] + half * t * self.acceleration[i])
            } else {
                self.state[i] + t * self.acceleration[i - 3]
            }
        })
    }

    /// Largest |β| from feedback tick `j` until the next, with a deviation below the straight line
    /// between these values at both ends: a parabola is largest at an end or at its vertex.
    fn farthest_sideslip(&self, j: usize, off: [Interval; 2]) -> Interval {
        let [from, to] = [j, j + 1].map(|j| self.at(j as f64));
        let largest = |side: fn(Interval) -> Interval| {
            let (rate, a) =
                (side(from[4]) + (off[1] - off[0]) / self.period, side(self.acceleration[1]));
            let (begin, end) = (side(from[1]) + off[0], side(to[1]) + off[1]);
            let turns = a.high < 0.0 && rate.high > 0.0 && (rate + a * self.period).low < 0.0;
            let vertex = begin - Interval::from(0.5) * rate.square() / a;
            begin.max(end).max(if turns { vertex } else { begin })
        };
        largest(|value| value).max(largest(|value| -value))
    }

    /// All sideslip angles from feedback tick `j` until the next, with the vertex of the parabola.
    fn sideslip(&self, j: usize) -> Interval {
        let [from, to] = [j, j + 1].map(|j| self.at(j as f64));
        let mut range = from[1].hull(to[1]);
        let (rate, a) = (from[4], self.acceleration[1]);
        if (rate * to[4]).low <= 0.0 && !a.contains(0.0) {
            let vertex = from[1] - Interval::from(0.5) * rate.square() / a;
            range = range.hull(vertex);
        }
        range
    }
}

#[cfg(test)]
mod tests;
