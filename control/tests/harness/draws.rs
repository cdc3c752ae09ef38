//! Random optimisations, for the example `worst_time` and for the tests of the longest ones.
#![allow(dead_code, unreachable_pub)] // Each user needs a part of it.

use super::flight::Random;
use super::{FEEDBACK, Optimising};
use control::Measurement;
use control::report::SolverReport;
use nalgebra::Vector3;
use vehicle::kinematics;
use vehicle::profile::Profile;
use vehicle::scenario::Scenario;

/// Largest errors of the angles and rates, deg and deg/s.
const ERRORS: (f64, f64) = (15.0, 4.5);
/// Count of the numbers of size 1 that define a case.
const UNKNOWNS: usize = 22;

/// A case to optimise: a reference, a start, and a second state to which the vehicle is kicked one
/// optimisation later.
pub struct Case {
    /// Time of the reference at the start, s.
    time: f64,
    reference: Profile,
    /// Errors of the angles, rad, and x_ω, rad/s: at the start, and after the kick.
    states: [(Vector3<f64>, Vector3<f64>); 2],
}

fn degrees(values: [f64; 3]) -> Vector3<f64> {
    Vector3::from(values.map(f64::to_radians))
}

impl Case {
    /// Returns the case that these numbers define, with errors scaled by `size`.
    fn from_numbers(x: &[f64], size: f64) -> Self {
        let at = |i: usize| x[i].clamp(-1.0, 1.0);
        let three = |i: usize| Vector3::new(at(i), at(i + 1), at(i + 2));
        let mean = degrees([10.0, 0.0, -30.0]) + three(2).component_mul(&degrees([5.0, 3.0, 20.0]));
        let reference = match at(1) {
            paper if paper < 0.0 => Scenario::crmpc2022().reference,
            sine if sine < 0.5 => {
                let amplitude = three(5).component_mul(&degrees([3.0, 1.0, 6.0]));
                Profile::sine(mean, amplitude, 0.45 + 0.35 * at(8), 3.15 * at(9))
            }
            _ => {
                Profile::step(mean, mean + three(5).component_mul(&degrees([5.0, 3.0, 16.0])), 25.0)
            }
        };
        // The vector is limited to the ball of this length.
        let vector = |i: usize, length: f64| {
            three(i) * (size * length.to_radians() / three(i).norm().max(1.0))
        };
        let states = [10, 16].map(|i| (vector(i, ERRORS.0), vector(i + 3, ERRORS.1)));
        Self { time: 25.0 + 25.0 * at(0), reference, states }
    }

    /// Returns the case of this seed.
    pub fn random(seed: u64, size: f64) -> Self {
        let random = &mut Random::new(seed);
        let x: Vec<f64> = (0..UNKNOWNS).map(|_| random.between(-1.0, 1.0)).collect();
        Self::from_numbers(&x, size)
    }

    /// Returns the reports of three optimisations, each with its shortest time: the first one
    /// (cold), the one after the kick, and the one that follows.
    pub fn optimise<C: Optimising>(&self, law: &mut C, repetitions: usize) -> [SolverReport; 3] {
        let (period, ratio) = (FEEDBACK, law.ratio());
        let mut memory = law.memory();
        let begin = (self.time / period).round() as u64 / ratio * ratio;
        let reference = |time: f64| self.reference.at(time);
        let [first, kicked] = self.states;
        let mut state = (reference(begin as f64 * period).angles + first.0, first.1);
        [0, 1, 2].map(|number| {
            let tick = begin + number * ratio;
            let time = tick as f64 * period;
            if number == 1 {
                state = (reference(time).angles + kicked.0, kicked.1);
            }
            let measured = |(angles, rates): (Vector3<f64>, Vector3<f64>)| Measurement {
                angles,
                rates: kinematics::r_inverse(&angles) * rates,
                ..Measurement::default()
            };
            let before = memory.clone();
            let mut best = f64::INFINITY;
            for _ in 0..repetitions {
                memory.clone_from(&before);
                law.update(&mut memory, tick, time, &measured(state), &reference);
                best = best.min(C::report(&memory).time);
            }
            for tick in tick + 1..tick + ratio {
                law.update(&mut memory, tick, tick as f64 * period, &measured(state), &reference);
            }
            // This is about how far the vehicle moves until the next optimisation.
            state.0 += state.1 * (ratio as f64 * period);
            SolverReport { time: best, ..C::report(&memory) }
        })
    }
}
