//! The plan in force at points of its horizon, with what the limits leave to it: what a picture of
//! the guarantee draws.

use super::plan::Plan;
use super::stages::Point;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Number of points at which a plan is shown.
pub const POINTS: usize = 25;
/// Number of intervals at the beginning that are shown one by one.
const DENSE: usize = 8;

/// One point of the plan.
///
/// What is missing from a bound to its limit is the tube: as long as the assumptions hold, the norm
/// differs from the planned one by at most that much while the plan is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct PlanPoint {
    /// Norm of the planned body rates at this point.
    #[setting(unit = "rad/s", nominal = 0.1)]
    pub rate: f64,
    /// Bound on plan.rate here; what is missing to limit.rate is the tube, the largest difference
    /// to the flown norm.
    ///
    /// It is negative if nothing is left of the limit.
    #[setting(unit = "rad/s", nominal = 0.1)]
    pub rate_bound: f64,
    /// Norm of the moment planned from this point on, less the known moment.
    ///
    /// In the last point it is that at the end of the horizon.
    #[setting(unit = "N.m", nominal = 1e5)]
    pub moment: f64,
    /// Bound on plan.moment here; what is missing to limit.moment is the tube, the largest
    /// difference to the flown norm.
    ///
    /// It is negative if nothing is left of the limit.
    #[setting(unit = "N.m", nominal = 1e5)]
    pub moment_bound: f64,
}

/// Returns the prediction steps at which a plan over `horizon` intervals is shown: the first ones,
/// then ever fewer up to the last. A short horizon ends before the points do, and its last step is
/// repeated.
pub fn points(horizon: usize) -> [usize; POINTS] {
    let sparse = POINTS - 1 - DENSE;
    let mut steps = [0; POINTS];
    for i in 1..POINTS {
        let beyond = i.saturating_sub(DENSE);
        let wanted = DENSE + horizon.saturating_sub(DENSE) * beyond * beyond / (sparse * sparse);
        let next = steps[i - 1] + 1;
        steps[i] = if i > DENSE { next.max(wanted) } else { next }.min(horizon);
    }
    steps
}

impl Plan {
    /// Returns stage `k` of the plan, the last one without acceleration.
    pub(super) fn point(&self, k: usize) -> Point {
        let (angles, rates) = super::state::split(&self.states[k]);
        let a = self.accelerations.get(k).copied().unwrap_or_else(Vector3::zeros);
        Point::new(angles, rates, a)
    }
}

#[cfg(test)]
mod tests {
    use super::{POINTS, points};

    #[test]
    fn the_points_cover_every_horizon() {
        for horizon in 2..=1000 {
            let steps = points(horizon);
            assert_eq!((steps[0], steps[POINTS - 1]), (0, horizon));
            let grows = |pair: &[usize]| pair[1] > pair[0] || pair[0] == horizon;
            assert!(steps.windows(2).all(grows), "{horizon}: {steps:?}");
        }
    }
}
