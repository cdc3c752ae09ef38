//! The vehicle in motion: Θ̇ = R ω, ω̇ = I⁻¹(m − ω × I ω) + R⁻¹ Δ, integrated from one communication point to the next.

use crate::actuators::{self, Actuators, Command, Drive};
use crate::disturbance::{Disturbance, View};
use crate::dynamics::{Inertia, RigidBody};
use crate::effectors::{JETS, Surfaces};
use crate::error::Error;
use crate::integrator::{equal_steps, rk4};
use crate::kinematics;
use crate::time::tolerance;
use nalgebra::{Matrix3, Matrix6, Matrix6x3, SMatrix, Vector3, Vector6};
use serde::{Deserialize, Serialize};

/// `[alpha, beta, sigma, p, q, r]` in rad and rad/s.
pub type State = Vector6<f64>;

/// Largest |β| (rad) at which the attitude angles are used; R is singular at π/2.
pub const BETA_LIMIT: f64 = std::f64::consts::FRAC_PI_2 - 1e-6;

/// Θ of a state, rad.
pub fn angles(state: &State) -> Vector3<f64> {
    state.fixed_rows::<3>(0).into()
}

/// ω of a state, rad/s.
pub fn rates(state: &State) -> Vector3<f64> {
    state.fixed_rows::<3>(3).into()
}

/// The state of given angles (rad) and rates (rad/s).
pub fn state(angles: &Vector3<f64>, rates: &Vector3<f64>) -> State {
    Vector6::new(angles.x, angles.y, angles.z, rates.x, rates.y, rates.z)
}

/// Chai 2022 (1) with Δ = Δ_f-dot + R Δ_m of (4b) put into the rate equation: state derivative under the sum `moment`
/// (N m) of all moments and the disturbance `delta` (rad/s²) on ẋ_ω.
pub fn derivative(body: &RigidBody, state: &State, moment: &Vector3<f64>, delta: &Vector3<f64>) -> State {
    let (angles, rates) = (angles(state), rates(state));
    let acceleration = body.angular_acceleration(&rates, moment) + kinematics::r_inverse(&angles) * delta;
    self::state(&(kinematics::r(&angles) * rates), &acceleration)
}

/// Partial derivatives of [`derivative`]: by the state (6 × 6) and by the moment (6 × 3).
pub fn partial_derivatives(
    body: &RigidBody,
    state: &State,
    delta: &Vector3<f64>,
) -> (Matrix6<f64>, Matrix6x3<f64>) {
    let (angles, rates) = (angles(state), rates(state));
    let (r, r_inverse) = (kinematics::r(&angles), kinematics::r_inverse(&angles));
    let (r_alpha, r_beta) = (kinematics::r_alpha(&angles), kinematics::r_beta(&angles));
    let gyroscopic: Matrix3<f64> =
        (body.inertia * rates).cross_matrix() - rates.cross_matrix() * body.inertia;

    let mut by_state = Matrix6::zeros();
    by_state.fixed_view_mut::<3, 1>(0, 0).copy_from(&(r_alpha * rates));
    by_state.fixed_view_mut::<3, 1>(0, 1).copy_from(&(r_beta * rates));
    by_state.fixed_view_mut::<3, 3>(0, 3).copy_from(&r);
    // ∂R⁻¹ = −R⁻¹ ∂R R⁻¹
    by_state.fixed_view_mut::<3, 1>(3, 0).copy_from(&-(r_inverse * (r_alpha * (r_inverse * delta))));
    by_state.fixed_view_mut::<3, 1>(3, 1).copy_from(&-(r_inverse * (r_beta * (r_inverse * delta))));
    by_state.fixed_view_mut::<3, 3>(3, 3).copy_from(&(body.inverse * gyroscopic));

    let mut by_moment = Matrix6x3::zeros();
    by_moment.fixed_view_mut::<3, 3>(3, 0).copy_from(&body.inverse);
    (by_state, by_moment)
}

/// What acts on the vehicle from outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Control moment about the body axes, N m. Acts as it comes, unless there are actuators.
    pub moment: Vector3<f64>,
    /// Further moment about the body axes, N m.
    pub disturbance_moment: Vector3<f64>,
    /// What the actuators are to do, if there are any.
    pub command: Command,
}

impl Input {
    /// What holds a value that is not finite.
    fn fault(&self) -> Option<&'static str> {
        let broken = |values: &[f64]| values.iter().any(|value| !value.is_finite());
        if broken(self.moment.as_slice()) || broken(self.disturbance_moment.as_slice()) {
            return Some("moment");
        }
        let Command { surfaces, jets } = &self.command;
        (broken(surfaces.as_slice()) || broken(jets.as_slice())).then_some("actuator command")
    }
}

impl From<Vector3<f64>> for Input {
    /// A control moment (N m) alone.
    fn from(moment: Vector3<f64>) -> Self {
        Self { moment, ..Self::default() }
    }
}

/// All that determines a plant's motion but the inputs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Config {
    /// Nominal inertia.
    pub inertia: Inertia,
    /// Factor from the nominal to the vehicle's inertia.
    pub inertia_scale: f64,
    /// State at the start.
    pub initial: State,
    /// The disturbance.
    pub disturbance: Disturbance,
    /// Surfaces and jets that make the control moment; without them it is an input.
    pub actuators: Option<actuators::Config>,
    /// Longest integration step, s.
    pub step: f64,
}

/// What is held for a while: the disturbance from a tick or a change of its course to the next, and what the actuators do
/// since commands were taken last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Held {
    /// Number of the interval.
    tick: i64,
    /// When it was drawn, s.
    since: f64,
    /// Δ drawn at its beginning, rad/s².
    sample: Vector3<f64>,
    /// Whether the disturbance acts.
    acts: bool,
    /// The actuators' motion.
    drive: Drive,
}

impl Held {
    /// Δ in force, rad/s².
    pub fn delta(&self) -> Vector3<f64> {
        if self.acts { self.sample } else { Vector3::zeros() }
    }
}

/// The vehicle with its state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plant {
    body: RigidBody,
    disturbance: Disturbance,
    actuators: Option<Actuators>,
    step: f64,
    start_time: f64,
    held: Option<Held>,
    /// The state now.
    pub state: State,
}

impl Plant {
    /// At the initial state at `start_time` (s).
    ///
    /// # Errors
    /// Names the value of the configuration that is out of range.
    pub fn new(config: &Config, start_time: f64) -> Result<Self, Error> {
        let refuse = |name, problem: String| Err(Error::Parameter { name, problem });
        if !(config.inertia_scale > 0.0 && config.inertia_scale.is_finite()) {
            return refuse("inertia.scale", format!("= {} must be positive", config.inertia_scale));
        }
        let body = config.inertia.body(config.inertia_scale)?;
        if !config.initial.iter().all(|value| value.is_finite()) {
            return refuse("initial", "holds a value that is not finite".into());
        }
        if config.initial[1].abs() >= BETA_LIMIT {
            return refuse(
                "initial.beta",
                format!("= {} deg must lie within 90 deg", config.initial[1].to_degrees()),
            );
        }
        if !(config.step > 0.0 && config.step.is_finite()) {
            return refuse("integrator.step", format!("= {} s must be positive", config.step));
        }
        config.disturbance.check()?;
        Ok(Self {
            body,
            disturbance: config.disturbance.clone(),
            actuators: config.actuators.as_ref().map(Actuators::new).transpose()?,
            step: config.step,
            start_time,
            held: None,
            state: config.initial,
        })
    }

    /// The vehicle's rigid body.
    pub fn body(&self) -> &RigidBody {
        &self.body
    }

    /// Θ, rad.
    pub fn angles(&self) -> Vector3<f64> {
        angles(&self.state)
    }

    /// ω, rad/s.
    pub fn rates(&self) -> Vector3<f64> {
        rates(&self.state)
    }

    /// The next time (s) after `time` at which the right side may not be smooth: the disturbance jumps, a deflection comes
    /// to rest.
    pub fn next_change(&self, time: f64, held: &Held) -> Option<f64> {
        let jump = self.disturbance.next_change(self.start_time, time);
        let rest = self.actuators.as_ref().and_then(|actuators| actuators.next_change(time, &held.drive));
        jump.into_iter().chain(rest).min_by(f64::total_cmp)
    }

    /// What holds from `time` (s) on if commands are taken then: the disturbance is drawn from the present state and `input`
    /// if a tick has come (again, if asked again at the tick), and is the one already held otherwise.
    pub fn in_force(&self, time: f64, input: &Input) -> Held {
        let before = self.drive();
        let drive =
            self.actuators.as_ref().map_or(before, |all| all.commanded(time, &input.command, &before));
        self.drawn(time, input, drive)
    }

    fn drawn(&self, time: f64, input: &Input, drive: Drive) -> Held {
        let tick = self.disturbance.tick(self.start_time, time);
        let acts = self.disturbance.acts(time);
        match self.held {
            Some(held) if held.tick == tick && time > held.since + tolerance(time) => {
                Held { acts, drive, ..held }
            }
            _ => {
                let (angles, rates) = (self.angles(), self.rates());
                let moment = self.control_moment(time, input, &drive);
                let view = View { body: &self.body, angles, rates, moment };
                Held { tick, since: time, sample: self.disturbance.sample(tick, &view), acts, drive }
            }
        }
    }

    /// Takes over what [`Plant::in_force`] says: commands hold until they are taken again, the disturbance until the next tick.
    pub fn hold(&mut self, time: f64, input: &Input) -> Held {
        *self.held.insert(self.in_force(time, input))
    }

    fn drive(&self) -> Drive {
        self.held.map_or_else(Drive::default, |held| held.drive)
    }

    /// What is held now, if anything was yet.
    pub fn held(&self) -> Option<Held> {
        self.held
    }

    /// The disturbing moment (N m) at `time` (s): the external one and that of the disturbance.
    pub fn disturbance_moment(&self, time: f64, input: &Input, held: &Held) -> Vector3<f64> {
        let own = if held.acts { self.disturbance.moment(time) } else { Vector3::zeros() };
        input.disturbance_moment + own
    }

    fn control_moment(&self, time: f64, input: &Input, drive: &Drive) -> Vector3<f64> {
        self.actuators.as_ref().map_or(input.moment, |all| all.moment(time, &input.command, drive))
    }

    /// The control moment (N m) that acts at `time` (s).
    pub fn applied_moment(&self, time: f64, input: &Input, held: &Held) -> Vector3<f64> {
        self.control_moment(time, input, &held.drive)
    }

    /// Deflections of the surfaces (rad) at `time` (s); zero without actuators.
    pub fn deflections(&self, time: f64, held: &Held) -> Surfaces {
        self.actuators.as_ref().map_or_else(Surfaces::zeros, |all| all.deflections(time, &held.drive))
    }

    /// Partial derivatives of [`Plant::applied_moment`]: by the input moment (3 × 3) and by the commands to the jets (3 × 10).
    pub fn applied_moment_by_inputs(&self, input: &Input) -> (Matrix3<f64>, SMatrix<f64, 3, JETS>) {
        self.actuators.as_ref().map_or((Matrix3::identity(), SMatrix::zeros()), |all| {
            (Matrix3::zeros(), all.moment_by_jets(&input.command))
        })
    }

    /// All moments together (N m) at `time` (s).
    pub fn total_moment(&self, time: f64, input: &Input, held: &Held) -> Vector3<f64> {
        self.applied_moment(time, input, held) + self.disturbance_moment(time, input, held)
    }

    /// State derivative at `time` (s), at the present state.
    pub fn derivative(&self, time: f64, input: &Input, held: &Held) -> State {
        derivative(&self.body, &self.state, &self.total_moment(time, input, held), &held.delta())
    }

    /// From `from` to `to` (s) under a constant control moment (N m).
    ///
    /// # Errors
    /// If the attitude becomes singular or a value is not finite; the state is then the last good one.
    pub fn advance(&mut self, from: f64, to: f64, moment: Vector3<f64>) -> Result<(), Error> {
        self.advance_with(from, to, |_| moment.into())
    }

    /// From `from` to `to` (s) under an input that is a function of time. Commands are taken at `from`; only a duty cycle of
    /// the jets follows the input on the way. The interval is cut where the disturbance jumps and where a deflection comes to
    /// rest, and every piece is integrated in equal steps, so the end is met exactly.
    ///
    /// # Errors
    /// If the attitude becomes singular or a value is not finite; the state is then the last good one.
    pub fn advance_with(
        &mut self,
        from: f64,
        to: f64,
        mut input: impl FnMut(f64) -> Input,
    ) -> Result<(), Error> {
        let mut time = from;
        while time < to {
            let held = if time == from {
                self.hold(time, &input(time))
            } else {
                *self.held.insert(self.drawn(time, &input(time), self.drive()))
            };
            let cut = self.next_change(time, &held).filter(|&change| change + tolerance(to) < to);
            let end = cut.unwrap_or(to);
            let steps = equal_steps(end - time, self.step);
            let h = (end - time) / steps as f64;
            for k in 0..steps {
                let begin = time + k as f64 * h;
                let mut f = |t: f64, state: &State| {
                    derivative(&self.body, state, &self.total_moment(t, &input(t), &held), &held.delta())
                };
                let next = rk4(&mut f, begin, &self.state, h);
                check(&next, begin + h).map_err(|error| {
                    let fault = input(begin).fault().or_else(|| input(begin + h).fault());
                    fault.map_or(error, |what| Error::NotFinite { time: begin, what })
                })?;
                self.state = next;
            }
            time = end;
        }
        Ok(())
    }
}

/// Whether the equations hold at a state.
///
/// # Errors
/// If it is not finite or its sideslip angle is ±90°.
pub fn check(state: &State, time: f64) -> Result<(), Error> {
    if !state.iter().all(|value| value.is_finite()) {
        return Err(Error::NotFinite { time, what: "attitude or rate" });
    }
    if state[1].abs() >= BETA_LIMIT {
        return Err(Error::Singular { time, beta_deg: state[1].to_degrees() });
    }
    Ok(())
}
