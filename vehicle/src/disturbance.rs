//! Disturbances: an acceleration Δ that enters ẋ_ω in Chai 2022 (4b), in rad/s² and bounded in each
//! component, and a sinusoidal moment in N m.

mod table;

use crate::axes::AXES;
use crate::dynamics::RigidBody;
use crate::error::{Error, finite, not_negative, positive};
use crate::kinematics::Kinematics;
use crate::math::sin;
use crate::noise::{Stream, uniform};
use crate::time::{tick, tick_time, tolerance};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
pub use table::{DisturbanceTable, Row};

/// Waveform of the disturbance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
pub enum DisturbanceKind {
    /// No disturbance.
    #[default]
    None,
    /// Each component is drawn uniformly within disturbance.bound every disturbance.period.
    White,
    /// disturbance.bound times disturbance.direction.
    Constant,
    /// a moment that is an offset plus two sinusoids.
    Sine,
    /// disturbance.bound times disturbance.direction, with the sign changing every half
    /// disturbance.square.period.
    Square,
    /// Each component is plus or minus disturbance.bound, chosen every disturbance.period so that
    /// the angular rate grows fastest.
    AlongRate,
    /// Each component is plus or minus disturbance.bound, chosen every disturbance.period to
    /// oppose the control moment.
    AgainstMoment,
    /// disturbance.bound times the factors in the current row of a lookup table over time.
    Table,
}

/// Disturbance with all the values that determine it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Disturbance {
    /// Kind of the disturbance, which selects the values below that are used.
    pub kind: DisturbanceKind,
    /// Bound on the magnitude of each component of Δ, rad/s².
    pub bound: f64,
    /// Time between the ticks of white noise and of the state-dependent kinds, s.
    pub period: f64,
    /// Seed of the white noise's random numbers.
    pub seed: u64,
    /// Factors by which the constant and the square wave scale each component, in [−1, 1].
    pub direction: Vector3<f64>,
    /// Full period of the square wave, s.
    pub square_period: f64,
    /// Moment of the sinusoidal kind, N m.
    pub sine: SineMoment,
    /// Rows of the kind `table`.
    pub table: DisturbanceTable,
    /// Start of the interval start ≤ t < end in which the disturbance acts, s. The square wave and
    /// the table begin here.
    pub start: f64,
    /// End of the interval start ≤ t < end in which the disturbance acts, s.
    pub end: f64,
}

/// Sinusoidal moment offset + Σ amplitude · sin(frequency · t + phase), N m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SineMoment {
    /// Constant part of the moment, N m.
    #[serde(default)]
    pub offset: Vector3<f64>,
    /// Sinusoids that are added to the constant part.
    #[serde(default, rename = "wave")]
    pub waves: Vec<MomentWave>,
}

/// One sinusoid of the disturbance moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
#[serde(deny_unknown_fields)]
pub struct MomentWave {
    /// Amplitude.
    #[setting(part, each = AXES, unit = "N.m", nominal = 1e4)]
    pub amplitude: Vector3<f64>,
    /// Angular frequency.
    #[setting(part, unit = "rad/s", min = 0.0, nominal = 1.0, used_with = "~.amplitude.* != 0")]
    pub frequency: f64,
    /// Phase at time 0.
    #[serde(default)]
    #[setting(part, unit = "rad", nominal = 1.0, used_with = "~.amplitude.* != 0")]
    pub phase: f64,
}

/// State of the vehicle that the state-dependent kinds use to choose Δ, and the random numbers of
/// the white noise where its caller keeps them.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Rigid body of the vehicle, with its inertia.
    pub body: &'a RigidBody,
    /// Attitude kinematics, with the matrix R in use.
    pub kinematics: Kinematics,
    /// Attitude angles Θ of the vehicle, rad.
    pub angles: Vector3<f64>,
    /// Body rates ω of the vehicle, rad/s.
    pub rates: Vector3<f64>,
    /// Control moment m about the body axes, N m.
    pub moment: Vector3<f64>,
    /// Random numbers of the disturbance's seed, from a tick near the present one, so that the
    /// white noise needs only a short jump.
    pub noise: Option<&'a Stream<3>>,
}

impl Default for Disturbance {
    /// Returns a disturbance that does nothing, with neutral values in the other fields.
    fn default() -> Self {
        Self {
            kind: DisturbanceKind::None,
            bound: 0.0,
            period: 1.0,
            seed: 1,
            direction: Vector3::repeat(1.0),
            square_period: 1.0,
            sine: SineMoment::default(),
            table: DisturbanceTable::default(),
            start: 0.0,
            end: f64::INFINITY,
        }
    }
}

impl Disturbance {
    /// Refuses values that the definitions of the fields do not allow.
    ///
    /// # Errors
    /// Names the value at fault by its path in the configuration of the plant.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name: &'static str, problem: String| Err(Error::parameter(name, problem));
        not_negative("disturbance.bound", self.bound, " rad/s2")?;
        positive("disturbance.period", self.period, " s")?;
        positive("disturbance.square.period", self.square_period, " s")?;
        if !self.direction.iter().all(|component| component.abs() <= 1.0) {
            return refuse("disturbance.direction", "must have components between -1 and 1".into());
        }
        if !(self.start.is_finite() && self.end > self.start) {
            return refuse(
                "disturbance.end",
                format!("= {} s must come after disturbance.start = {} s", self.end, self.start),
            );
        }
        let sine = &self.sine;
        let waves = sine.waves.iter();
        let waves =
            waves.flat_map(|wave| wave.amplitude.iter().chain([&wave.frequency, &wave.phase]));
        finite("disturbance.sine", sine.offset.iter().chain(waves))?;
        self.table.check()
    }

    /// Whether the disturbance acts at `time` (s).
    pub fn acts(&self, time: f64) -> bool {
        self.kind != DisturbanceKind::None
            && time + tolerance(time) >= self.start
            && time + tolerance(time) < self.end
    }

    /// Origin (s) and length (s) of the intervals over which Δ is held, if all have the same
    /// length; `origin` is the start of the experiment (s).
    pub(crate) fn intervals(&self, origin: f64) -> Option<(f64, f64)> {
        match self.kind {
            DisturbanceKind::None
            | DisturbanceKind::Constant
            | DisturbanceKind::Sine
            | DisturbanceKind::Table => None,
            DisturbanceKind::White
            | DisturbanceKind::AlongRate
            | DisturbanceKind::AgainstMoment => Some((origin, self.period)),
            DisturbanceKind::Square => Some((self.start, self.square_period / 2.0)),
        }
    }

    /// Number of the interval with constant Δ that contains `time` (s). For the table it is the
    /// number of the row in force, from 1, or 0 before the first row.
    pub fn tick(&self, origin: f64, time: f64) -> i64 {
        if self.kind == DisturbanceKind::Table {
            return i64::try_from(self.table.row(self.start, time)).unwrap_or(i64::MAX);
        }
        self.intervals(origin).map_or(0, |(start, length)| tick(time, start, length))
    }

    /// First time (s) after `time` at which the disturbance may jump.
    pub fn next_change(&self, origin: f64, time: f64) -> Option<f64> {
        if self.kind == DisturbanceKind::None || time + tolerance(time) >= self.end {
            return None;
        }
        if time + tolerance(time) < self.start {
            return Some(self.start);
        }
        let next = if self.kind == DisturbanceKind::Table {
            self.table.next_change(self.start, time)
        } else {
            self.intervals(origin)
                .map(|(start, length)| tick_time(tick(time, start, length) + 1, start, length))
        };
        let next = next.map_or(self.end, |next| next.min(self.end));
        next.is_finite().then_some(next)
    }

    /// Value of Δ (rad/s²) in the interval with number `tick`, provided that the disturbance acts.
    pub fn sample(&self, tick: i64, view: &View) -> Vector3<f64> {
        match self.kind {
            DisturbanceKind::None | DisturbanceKind::Sine => Vector3::zeros(),
            DisturbanceKind::White => {
                let near = view.noise.filter(|noise| noise.seed() == self.seed);
                let drawn = near.map_or_else(|| uniform(self.seed, tick), |noise| noise.at(tick));
                Vector3::from(drawn) * self.bound
            }
            DisturbanceKind::Constant => self.direction * self.bound,
            DisturbanceKind::Square => {
                self.direction * if tick.rem_euclid(2) == 0 { self.bound } else { -self.bound }
            }
            DisturbanceKind::Table => self.table.direction(tick) * self.bound,
            // d‖ω‖²/dt contains 2 ωᵀ R⁻¹ Δ
            DisturbanceKind::AlongRate => {
                signs(&view.kinematics.r_inverse(&view.angles).tr_mul(&view.rates)) * self.bound
            }
            DisturbanceKind::AgainstMoment => {
                signs(&(view.kinematics.r(&view.angles) * (view.body.inverse * view.moment)))
                    * -self.bound
            }
        }
    }

    /// Disturbance moment (N m) at `time` (s), provided that the disturbance acts.
    pub fn moment(&self, time: f64) -> Vector3<f64> {
        if self.kind != DisturbanceKind::Sine {
            return Vector3::zeros();
        }
        let wave = |wave: &MomentWave| wave.amplitude * sin(wave.frequency * time + wave.phase);
        self.sine.waves.iter().fold(self.sine.offset, |sum, next| sum + wave(next))
    }
}

/// Returns the sign of each component, with + for 0.
fn signs(vector: &Vector3<f64>) -> Vector3<f64> {
    vector.map(|component| if component < 0.0 { -1.0 } else { 1.0 })
}
