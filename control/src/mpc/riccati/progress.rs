//! Progress of a search: its damping, and its end without an optimum.

use super::residuals::Residuals;
use crate::mpc::problem::Outcome;

/// Residual of the norm constraints below which a trajectory counts as the optimum.
const FEASIBILITY: f64 = 1e-7;
/// Feasibility tolerance for bounds that follow the trajectory. As their derivatives are left out,
/// the residual then only shrinks by a constant factor per iteration.
const FEASIBILITY_FOLLOWING: f64 = 1e-5;
/// A search has stalled when `STALLED_STEPS` successive steps were shorter than `STALLED`.
const STALLED: f64 = 1e-5;
const STALLED_STEPS: u32 = 4;
/// A search has also stalled when its residual has not been halved in the first number of
/// iterations. The count restarts when the residual exceeds the least one by the second number,
/// because the iterate has then come near norm constraints that were left out. `PATIENCE` is for
/// given bounds, which may have any size, `PATIENCE_FOLLOWING` for bounds that follow the
/// trajectory.
const PATIENCE: (u32, f64) = (30, 1e3);
const PATIENCE_FOLLOWING: (u32, f64) = (16, f64::INFINITY);
/// Patience of a search, cold or warm, that is followed by another one from another start: it ends
/// in time for that one, with bounds of any kind.
const PATIENCE_ANOTHER: (u32, u32) = (10, 8);
/// A search runs in a cycle when its residual has not been halved in `CIRCLING` iterations; its
/// steps are then multiplied by `DAMPING`.
const CIRCLING: u32 = 8;
const DAMPING: f64 = 0.5;
/// Where only the bounds still move, a step that leaves more than this share of the residual
/// overshoots: the bounds respond to the trajectory by almost as much in the other direction. Every
/// other step is then multiplied by `DAMPING`, which ends that; the whole steps between them reduce
/// the residuals that do not respond.
const OVERSHOOTING: f64 = 0.5;
/// A first guess is misleading when the residual of the norm constraints exceeds the least one so
/// far by this factor; least values below 1 count as 1.
const ASTRAY: f64 = 1e3;
/// A search that fails while the residual of the norm constraints is above this value is hopeless.
const FAR_FROM_FEASIBLE: f64 = 1e-3;

/// The rules by which a search is damped or ended.
pub(super) struct Progress {
    /// Tolerance of the residual of the norm constraints.
    pub feasibility: f64,
    /// Number of iterations in which the residual must halve, and the growth that restarts the
    /// count.
    patience: (u32, f64),
    /// Whether the first guess comes from a similar problem.
    warm: bool,
    short_steps: u32,
    /// Least residual so far that was half of the one before, and its iteration.
    best: (f64, u32),
    /// Least residual of the norm constraints so far, at least 1.
    least_outside: f64,
    /// Share of the residual above which a step overshoots; infinite if the bounds are held.
    overshooting: f64,
    /// Whether steps have overshot the bounds, and whether the last one was damped for that.
    overshoots: bool,
    damped: bool,
    /// Residual of the last iterate.
    last: f64,
}

impl Progress {
    /// Begins a search, from the solution of a similar problem if it is `warm`. `another` says that
    /// a search from another start follows if this one fails.
    pub(super) fn new(follows: bool, warm: bool, another: bool) -> Self {
        let (feasibility, mut patience) = if follows {
            (FEASIBILITY_FOLLOWING, PATIENCE_FOLLOWING)
        } else {
            (FEASIBILITY, PATIENCE)
        };
        if another {
            patience.0 = if warm { PATIENCE_ANOTHER.1 } else { PATIENCE_ANOTHER.0 };
        }
        Self {
            feasibility,
            patience,
            warm,
            short_steps: 0,
            best: (f64::INFINITY, 0),
            least_outside: f64::INFINITY,
            overshooting: if follows { OVERSHOOTING } else { f64::INFINITY },
            overshoots: false,
            damped: false,
            last: f64::INFINITY,
        }
    }

    /// Returns the length of the step to take from an iterate with these residuals, whose direction
    /// allows `length`; or the outcome, if the search ends here.
    pub(super) fn damp(
        &mut self,
        iteration: u32,
        residuals: &Residuals,
        length: f64,
    ) -> Result<f64, Outcome> {
        let (patience, anew) = self.patience;
        self.short_steps = if length < STALLED { self.short_steps + 1 } else { 0 };
        let residual = residuals.stationarity.max(residuals.feasibility);
        if !(0.5 * self.best.0..=anew * self.best.0).contains(&residual) {
            self.best = (residual, iteration);
        }
        let since = iteration - self.best.1;
        if self.short_steps == STALLED_STEPS
            || residuals.feasibility > self.feasibility && since >= patience
        {
            return Err(give_up(iteration, residuals));
        }
        self.least_outside = residuals.feasibility.clamp(1.0, self.least_outside);
        if self.warm && residuals.feasibility > ASTRAY * self.least_outside {
            return Err(Outcome::Failed(iteration + 1));
        }
        let is_damped = self.overshoots_bounds(residual, residuals.is_closed());
        Ok(if is_damped || since >= CIRCLING { DAMPING * length } else { length })
    }

    /// Returns whether the next step is to be damped because the bounds respond to the steps.
    fn overshoots_bounds(&mut self, residual: f64, closed: bool) -> bool {
        let answers = closed && residual > self.overshooting * self.last;
        self.overshoots |= answers;
        self.damped = self.overshoots && !self.damped;
        self.last = residual;
        self.damped
    }
}

/// Returns the outcome of a search that finds no further step.
pub(super) fn give_up(iteration: u32, residuals: &Residuals) -> Outcome {
    if residuals.feasibility > FAR_FROM_FEASIBLE {
        Outcome::Hopeless(iteration + 1)
    } else {
        Outcome::Failed(iteration + 1)
    }
}
