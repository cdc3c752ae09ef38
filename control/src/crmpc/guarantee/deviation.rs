//! How far the vehicle can be from the plan at a tick.

/// Largest deviation of the vehicle from the plan at a feedback tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// Deviation of angle of attack and sideslip, ‖(α, β) − (α̃, β̃)‖, rad. The bank angle changes
    /// neither ω nor m.
    pub angle: f64,
    /// Deviation of the rates, ‖x_ω − x̃_ω‖, rad/s.
    pub rate: f64,
    /// Deviation of angle of attack and sideslip in the predicted state on which the law acts, rad.
    pub seen_angle: f64,
    /// Deviation of the rates in the predicted state on which the law acts, rad/s.
    pub seen_rate: f64,
    /// Deviation of angle of attack and sideslip in the state that the law predicts for the middle
    /// of the period, where it evaluates f and R, rad.
    pub middle_angle: f64,
    /// Deviation of the rates in that state, rad/s.
    pub middle_rate: f64,
    /// Half width of the box part of K ô, rad/s²; the ball part below is added to it.
    pub feedback: f64,
    /// Radius of the ball part of K ô, rad/s².
    pub feedback_norm: f64,
    /// Moment that K ô requires to compensate for the inertia error, N m.
    pub feedback_moment: f64,
}

impl Deviation {
    /// Returns the larger value of each component.
    pub(super) fn or(&self, other: &Self) -> Self {
        let of = f64::max;
        Self {
            angle: of(self.angle, other.angle),
            rate: of(self.rate, other.rate),
            seen_angle: of(self.seen_angle, other.seen_angle),
            seen_rate: of(self.seen_rate, other.seen_rate),
            middle_angle: of(self.middle_angle, other.middle_angle),
            middle_rate: of(self.middle_rate, other.middle_rate),
            feedback: of(self.feedback, other.feedback),
            feedback_norm: of(self.feedback_norm, other.feedback_norm),
            feedback_moment: of(self.feedback_moment, other.feedback_moment),
        }
    }
}
