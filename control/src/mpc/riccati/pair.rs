//! One inequality with its slack and its multiplier.

use nalgebra::Vector3;

/// One inequality c ≤ 0 with its slack and its multiplier.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pair {
    /// Whether the inequality is included in the problem.
    pub watched: bool,
    /// Value of c at the iterate.
    pub c: f64,
    /// Slack of the inequality, s > 0.
    pub slack: f64,
    /// Multiplier of the inequality, λ > 0.
    pub multiplier: f64,
    /// Residual c + s, corrected by the curvature along the predictor.
    pub infeasibility: f64,
    /// Target of sλ, less the predictor's Δs Δλ.
    pub target: f64,
    /// Second-order change ½‖JΔz‖² along the last direction.
    pub curvature: f64,
    pub d_slack: f64,
    pub d_multiplier: f64,
}

impl Pair {
    /// Includes the inequality. The slack is −c but at least `smallest`; sλ is `mean`, unless the
    /// multiplier `guess` is larger.
    pub(super) fn begin(&mut self, smallest: f64, mean: f64, guess: f64) {
        self.watched = true;
        self.slack = (-self.c).max(smallest);
        self.multiplier = (mean / self.slack).max(guess);
    }

    /// Evaluates c of a norm constraint at y.
    pub(super) fn evaluate(&mut self, y: &Vector3<f64>) {
        self.c = 0.5 * (y.norm_squared() - 1.0);
    }

    /// Returns the scaling λ/s of the inequality, (5).
    pub(super) fn scaling(&self) -> f64 {
        self.multiplier / self.slack
    }

    /// Returns ρ of (6), the multiplier on the right side of the Newton system after Δs and Δλ are
    /// eliminated.
    pub(super) fn effective(&self) -> f64 {
        (self.target + self.multiplier * self.infeasibility) / self.slack
    }

    /// Prepares the predictor, with τ = 0.
    pub(super) fn aim(&mut self) {
        self.infeasibility = self.c + self.slack;
        self.target = 0.0;
    }

    /// Prepares the corrector (11) to sλ = `centre`. The pair gives the shares of the predictor's
    /// second-order terms to include: the products Δs Δλ, and the curvature of the constraint along
    /// the predictor.
    pub(super) fn correct(&mut self, centre: f64, (products, curvature): (f64, f64)) {
        self.infeasibility = self.c + self.slack + curvature * self.curvature;
        self.target = centre - products * self.d_slack * self.d_multiplier;
    }

    /// Computes Δs and Δλ of (9) for a direction along which c changes by `change`.
    pub(super) fn set_direction(&mut self, change: f64, curvature: f64) {
        self.curvature = curvature;
        self.d_slack = -self.infeasibility - change;
        self.d_multiplier =
            (self.target - self.multiplier * self.d_slack) / self.slack - self.multiplier;
    }

    /// Computes the direction of a norm constraint, along which y changes by `change`.
    pub(super) fn follow(&mut self, y: &Vector3<f64>, change: &Vector3<f64>) {
        self.set_direction(y.dot(change), 0.5 * change.norm_squared());
    }

    /// Returns the longest step that keeps s and λ positive.
    pub(super) fn longest(&self) -> f64 {
        let until =
            |value: f64, change: f64| if change < 0.0 { -value / change } else { f64::INFINITY };
        until(self.slack, self.d_slack).min(until(self.multiplier, self.d_multiplier))
    }
}
