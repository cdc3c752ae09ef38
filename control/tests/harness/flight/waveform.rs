//! Waveforms of disturbances and errors over time.

use super::moving::Vehicle;
use super::random::{Random, signs};
use nalgebra::Vector3;
use vehicle::kinematics;

/// A waveform of a vector in the box [−1, 1]³ over time, for the disturbance or the errors relative
/// to their bounds.
#[derive(Clone, Debug)]
pub enum Waveform {
    /// The vector is constant over time.
    Constant(Vector3<f64>),
    /// The vector is drawn again at each request.
    White,
    /// The vector changes its sign every half period (s).
    Square(f64, Vector3<f64>),
    /// The vector moves to a new corner of the box after random times of at most this length (s).
    Switching(f64),
    /// The vector is the corner along x_ω, times this sign.
    AlongRate(f64),
    /// The vector is the corner along the acceleration by the acting moment, times this sign.
    AlongMoment(f64),
}

impl Waveform {
    /// Returns disturbances of every kind.
    pub fn all() -> [Self; 6] {
        let corner = Vector3::new(1.0, -1.0, 1.0);
        [
            Self::White,
            Self::Constant(corner),
            Self::Square(2.5, corner),
            Self::Switching(1.0),
            Self::AlongRate(1.0),
            Self::AlongMoment(-1.0),
        ]
    }

    /// Draws any waveform except segments.
    pub fn random(random: &mut Random) -> Self {
        let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let period = 10.0_f64.powf(random.between(-1.1, 1.4));
        match random.below(8) {
            0 => Self::White,
            1 => Self::Constant(random.corner()),
            2 => Self::Constant(random.vector()),
            3 => Self::Square(period, random.corner()),
            4 => Self::Square(period, random.vector()),
            5 => Self::Switching(period),
            6 => Self::AlongRate(sign),
            _ => Self::AlongMoment(sign),
        }
    }
}

/// A waveform in progress over time.
#[derive(Clone, Debug)]
pub(super) struct Progress {
    waveform: Waveform,
    random: Random,
    now: Vector3<f64>,
    until: f64,
}

impl Progress {
    pub(super) fn new(waveform: &Waveform, seed: u64) -> Self {
        Self {
            waveform: waveform.clone(),
            random: Random::new(seed),
            now: Vector3::zeros(),
            until: 0.0,
        }
    }

    /// Returns the value at `time` (s), which must not decrease.
    pub(super) fn at(&mut self, time: f64, vehicle: &Vehicle) -> Vector3<f64> {
        let r = kinematics::r(&vehicle.angles());
        match &self.waveform {
            Waveform::Constant(value) => *value,
            Waveform::White => self.random.vector(),
            Waveform::Square(period, value) => {
                let half = (2.0 * (time + 1e-9) / period).floor() as i64;
                if half % 2 == 0 { *value } else { -*value }
            }
            Waveform::Switching(longest) => {
                if time >= self.until {
                    self.now = self.random.corner();
                    self.until = time + self.random.between(0.0, *longest);
                }
                self.now
            }
            Waveform::AlongRate(sign) => signs(&(r * vehicle.rates())) * *sign,
            Waveform::AlongMoment(sign) => {
                signs(&(r * vehicle.body.inverse * vehicle.moment(time))) * *sign
            }
        }
    }
}
