//! Treatment of angles that repeat after a whole turn, and of a reference that contradicts itself.
//!
//! Angle of attack and bank angle are the same attitude after a turn of 360°. A vehicle or an
//! estimator may count them from −180° to 180°, and a reference may jump from one end to the other.
//! The measured angles are therefore continued from tick to tick without jumps by whole turns, and
//! the reference is taken as the turn that is nearest to them: from 179° to −179° it is 2°.

use crate::controller::Measurement;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use vehicle::axes::{REPEATS, nearest, turned, turns};
use vehicle::reference::Reference;

/// Excess over half a turn of the reference above which the other direction is taken: noise does
/// not reverse a turn of 180°, rad.
const HYSTERESIS: f64 = 2.0 * PI / 180.0;
/// Time after which a contradiction between angles and rates is reported, and the part of it that a
/// single change of the reference can take, s.
const PATIENCE: f64 = 1.0;
const ONCE: f64 = 0.5;
const ROUNDING: f64 = 1e-6;
/// Difference between rates and derivatives that is no contradiction: a rate (rad/s), and a share
/// of the rates.
const NEGLIGIBLE: f64 = 1e-3;
const SHARE: f64 = 0.25;

/// State of the angles that is carried from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Turns {
    /// Measured angles at the last tick, continued without jumps, rad.
    angles: Vector3<f64>,
    /// Whole turns that are added to the reference; `None` before the first tick.
    reference: Option<Vector3<f64>>,
    /// Reference at the last check, and the time (s).
    last: Option<(f64, Reference)>,
    /// Time for which the reference's rates have not been the derivatives of its angles, s.
    contradicting: f64,
    /// Whether they have not been so for a second.
    pub contradicts: bool,
}

impl Turns {
    /// Returns whether a restored state can be used.
    pub fn fits(&self) -> bool {
        let turns = self.reference.unwrap_or_default();
        self.angles.iter().chain(&turns).all(|value| value.is_finite())
    }

    /// Returns the measurement with its angles continued from the last tick.
    pub fn continued(&mut self, measured: &Measurement) -> Measurement {
        let angles = Vector3::from_fn(|i, _| match measured.angles[i] {
            angle if REPEATS[i] => nearest(angle, self.angles[i]),
            angle => angle,
        });
        self.angles = angles;
        Measurement { angles, ..*measured }
    }

    /// Takes the reference at `time` (s), to which the law steers from `angles` (rad). Returns the
    /// whole turns to be added to each of its angles.
    pub fn follow(
        &mut self,
        time: f64,
        angles: &Vector3<f64>,
        reference: &Reference,
    ) -> Vector3<f64> {
        self.look(time, reference);
        let before = self.reference;
        let chosen = Vector3::from_fn(|i, _| {
            let (angle, to) = (reference.angles[i], angles[i]);
            match before.map(|before| before[i]) {
                _ if !REPEATS[i] => 0.0,
                Some(kept) if (turned(angle, kept) - to).abs() <= PI + HYSTERESIS => kept,
                _ => turns(angle, to),
            }
        });
        self.reference = Some(chosen);
        chosen
    }

    /// Compares the change of the reference's angles with its rates, from change to change: an
    /// input may be held for some ticks. A single jump is no contradiction.
    fn look(&mut self, time: f64, reference: &Reference) {
        let Some((then, before)) = self.last else {
            self.last = Some((time, *reference));
            return;
        };
        let elapsed = time - then;
        let is_held = *reference == before;
        if is_held && elapsed <= PATIENCE + ROUNDING {
            return;
        }
        let differs = (0..3).any(|i| {
            let to = reference.angles[i];
            let from = if REPEATS[i] { nearest(before.angles[i], to) } else { before.angles[i] };
            let (first, second) = (before.rates[i], reference.rates[i]);
            let bent = before.accelerations[i].abs() + reference.accelerations[i].abs();
            let tolerance = NEGLIGIBLE
                + SHARE * f64::midpoint(first.abs(), second.abs())
                + bent * elapsed / 4.0;
            (to - from - f64::midpoint(first, second) * elapsed).abs() > tolerance * elapsed
        });
        if is_held {
            self.contradicts = differs;
            return;
        }
        self.last = Some((time, *reference));
        let earlier = if elapsed > PATIENCE { 0.0 } else { self.contradicting };
        self.contradicting = if differs { earlier + elapsed.min(ONCE) } else { 0.0 };
        self.contradicts = self.contradicting >= PATIENCE - ROUNDING;
    }
}

/// Returns the reference with whole `turns` added to its angles.
pub fn turned_reference(reference: Reference, turns: &Vector3<f64>) -> Reference {
    let angles = reference.angles.zip_map(turns, turned);
    Reference { angles, ..reference }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sigma(angle_deg: f64) -> Vector3<f64> {
        Vector3::new(0.1, 0.0, angle_deg.to_radians())
    }

    fn reference(angle_deg: f64, rate_deg_s: f64) -> Reference {
        Reference {
            angles: sigma(angle_deg),
            rates: sigma(rate_deg_s) - sigma(0.0),
            ..Reference::default()
        }
    }

    #[test]
    fn oracle_measurements_are_continued_over_every_turn() {
        let mut turns = Turns::default();
        for degrees in (0..4000).chain((-2000..4000).rev()) {
            let wrapped = (f64::from(degrees) + 180.0).rem_euclid(360.0) - 180.0;
            let measured = Measurement { angles: sigma(wrapped), ..Measurement::default() };
            let continued = turns.continued(&measured).angles.z.to_degrees();
            assert!((continued - f64::from(degrees)).abs() < 1e-9, "{degrees}: {continued}");
        }
    }

    #[test]
    fn the_nearest_turn_of_a_reference_is_taken_and_noise_does_not_reverse_it() {
        let mut turns = Turns::default();
        let mut error = |measured: f64, target: f64| {
            let (angles, target) = (sigma(measured), reference(target, 0.0));
            let chosen = turns.follow(0.0, &angles, &target);
            (turned_reference(target, &chosen).angles.z - angles.z).to_degrees()
        };
        assert!((error(179.0, -179.0) - 2.0).abs() < 1e-9);
        assert!((error(181.0, 178.0) + 3.0).abs() < 1e-9);
        assert!((error(0.0, 179.5) - 179.5).abs() < 1e-9);
        assert!((error(-1.0, 179.5) - 180.5).abs() < 1e-9, "noise of a degree");
        assert!((error(-5.0, 179.5) + 175.5).abs() < 1e-9);
        assert!((error(0.0, 190.0) + 170.0).abs() < 1e-9);
    }

    #[test]
    fn an_angle_within_half_a_turn_keeps_its_bits() {
        for angle in [0.1, -0.0, 3.1, -3.1, f64::NAN] {
            assert_eq!(nearest(angle, 0.0).to_bits(), angle.to_bits(), "{angle}");
        }
        assert!(nearest(f64::MAX, -f64::MAX).is_finite());
    }

    /// Returns when a reference over time is found to contradict itself, s; it is held for `held`
    /// ticks.
    fn contradicts(held: u32, at: impl Fn(f64) -> Reference) -> Option<f64> {
        let mut turns = Turns::default();
        (0..500_u32).map(|k| f64::from(k) * 0.04).find(|time| {
            let sampled = at(f64::from((time / 0.04).round() as u32 / held * held) * 0.04);
            turns.follow(*time, &sigma(0.0), &sampled);
            turns.contradicts
        })
    }

    #[test]
    fn rates_that_are_no_derivatives_are_told_after_a_second() {
        for held in [1, 3, 25] {
            assert_eq!(contradicts(held, |t| reference(10.0 + 3.0 * t, 3.0)), None, "ramp {held}");
            assert_eq!(
                contradicts(held, |t| reference(10.0 * t.sin(), 10.0 * t.cos())),
                None,
                "sine {held}"
            );
            let told = contradicts(held, |t| reference(10.0 * t, 0.0)).unwrap();
            assert!((1.0..2.1).contains(&told), "{held}: {told}");
        }
        let constant = contradicts(1, |_| reference(10.0, 1.25)).unwrap();
        assert!((constant - 1.0).abs() < 0.05, "{constant}");
        assert_eq!(contradicts(1, |_| reference(10.0, 0.0)), None);
        assert_eq!(
            contradicts(1, |t| reference(if t < 5.0 { -60.0 } else { 60.0 }, 0.0)),
            None,
            "a step"
        );
        assert_eq!(
            contradicts(1, |t| reference((20.0 * t + 180.0).rem_euclid(360.0) - 180.0, 20.0)),
            None,
            "over the end"
        );
    }
}
