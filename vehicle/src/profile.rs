//! Profiles of the reference attitude over time.

use crate::math::{cos, sin, sin_cos};
use crate::reference::Reference;
use crate::table::LookupTable;
use crate::time::tolerance;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Reference attitude as a function of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Profile {
    /// Segments in order of time: the first one that has not ended applies, and the last one never
    /// ends.
    Piecewise(Vec<Segment>),
    /// Spline through given points over time.
    Table(LookupTable),
}

/// One segment, in which each angle is a constant plus sinusoids.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Time up to which the segment applies, t ≤ `until`, s.
    pub until: f64,
    /// Profiles of the angles α, β and σ.
    pub angles: [AngleProfile; 3],
}

/// Profile of one angle, c + Σ (a sin ω t + b cos ω t).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AngleProfile {
    /// Constant part c of the angle, rad.
    pub constant: f64,
    /// Sinusoids that are added to the constant part.
    pub waves: Vec<Wave>,
}

/// One sinusoid a sin ω t + b cos ω t of an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// Angular frequency ω of the sinusoid, rad/s.
    pub frequency: f64,
    /// Coefficient a of the sine, rad.
    pub sine: f64,
    /// Coefficient b of the cosine, rad.
    pub cosine: f64,
}

impl Profile {
    /// Returns a reference that keeps the `angles` (rad) constant.
    pub fn constant(angles: Vector3<f64>) -> Self {
        Self::Piecewise(vec![Segment::constant(f64::INFINITY, angles)])
    }

    /// Returns a reference that is `before` (rad) for t ≤ `time` (s) and `after` (rad) for t >
    /// `time`.
    pub fn step(before: Vector3<f64>, after: Vector3<f64>, time: f64) -> Self {
        Self::Piecewise(vec![
            Segment::constant(time, before),
            Segment::constant(f64::INFINITY, after),
        ])
    }

    /// Returns the reference `mean + amplitude · sin(frequency · t + phase)`, with angles and phase
    /// in rad and the frequency in rad/s.
    pub fn sine(mean: Vector3<f64>, amplitude: Vector3<f64>, frequency: f64, phase: f64) -> Self {
        let (sine, cosine) = (cos(phase), sin(phase));
        let angles = [0, 1, 2].map(|i| AngleProfile {
            constant: mean[i],
            waves: vec![Wave {
                frequency,
                sine: amplitude[i] * sine,
                cosine: amplitude[i] * cosine,
            }],
        });
        Self::Piecewise(vec![Segment { until: f64::INFINITY, angles }])
    }

    /// Returns the reference at `time` (s). A segment applies up to and including its end.
    pub fn at(&self, time: f64) -> Reference {
        match self {
            Self::Piecewise(segments) => {
                let ended = |segment: &&Segment| time > segment.until + tolerance(time);
                match segments.iter().find(|segment| !ended(segment)).or(segments.last()) {
                    Some(segment) => segment.at(time),
                    None => Reference::default(),
                }
            }
            Self::Table(table) => table.at(time),
        }
    }
}

impl Segment {
    fn constant(until: f64, angles: Vector3<f64>) -> Self {
        Self {
            until,
            angles: [0, 1, 2].map(|i| AngleProfile { constant: angles[i], waves: Vec::new() }),
        }
    }

    fn at(&self, time: f64) -> Reference {
        let mut reference = Reference::default();
        // Angles that oscillate together share one sine and cosine.
        let (mut frequency, mut s, mut c) = (0.0, 0.0, 1.0);
        for (i, profile) in self.angles.iter().enumerate() {
            reference.angles[i] = profile.constant;
            for wave in &profile.waves {
                if wave.frequency != frequency {
                    frequency = wave.frequency;
                    (s, c) = sin_cos(frequency * time);
                }
                let value = wave.sine * s + wave.cosine * c;
                reference.angles[i] += value;
                reference.rates[i] += wave.frequency * (wave.sine * c - wave.cosine * s);
                reference.accelerations[i] -= wave.frequency * wave.frequency * value;
            }
        }
        reference
    }
}
