//! Random flights.

use super::random::Random;
use super::waveform::Waveform;
use super::{Flight, Sight, Slow};
use control::crmpc::{Crmpc, Settings};
use control::{Controller, Measurement};
use nalgebra::{Matrix3, Rotation3, Vector3};
use vehicle::profile::Profile;

impl Flight {
    /// Draws disturbance, inertia, start and reference, and the waveform of the errors if the
    /// settings have any.
    pub fn random(settings: &Settings, seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let mut flight = Self::new(settings);
        flight.seed = seed;
        flight.duration = 25.0;
        flight.inertia_scale = match random.below(3) {
            0 => 1.0 - settings.inertia_error,
            1 => 1.0 + settings.inertia_error,
            _ => 1.0 + settings.inertia_error * random.between(-1.0, 1.0),
        };
        if settings.tensor_error > 0.0 {
            flight.tensor_error = Self::tensor_of(settings.tensor_error, random);
        }
        flight.disturbance = Waveform::random(random);
        flight.hold = if random.below(2) == 0 { 0.04 } else { 0.01 };
        match random.below(3) {
            0 => flight.reference_start = random.between(0.0, 50.0),
            1 => flight.reference = Self::random_sine(random),
            _ => {
                let steady = |random: &mut Random| {
                    degrees([10.0, 0.0, -30.0])
                        + random.vector().component_mul(&degrees([5.0, 3.0, 8.0]))
                };
                flight.reference =
                    Profile::step(steady(random), steady(random), random.between(1.0, 20.0));
            }
        }
        if random.below(4) > 0 {
            let first = flight.reference.at(flight.reference_start).angles;
            flight.angles = first + random.vector().component_mul(&degrees([10.0, 8.0, 12.0]));
            let length = random.between(0.0, 0.7) * settings.limit_rate;
            flight.rates = random.direction(length);
        }
        if settings.rate_error > 0.0 || settings.angle_error > 0.0 {
            flight.sight = Sight::Errors(Waveform::random(random));
        }
        if settings.slow_angle_error > 0.0 || settings.slow_angle_rate > 0.0 {
            flight.slow = Some(Slow::new(settings, Waveform::random(random), random.vector()));
        }
        flight
    }

    /// Draws a flight that begins just inside the set of states from which a plan is certified:
    /// with much sideslip, with fast rates, or with both. The result is `None` if not even the
    /// reference at rest is certified.
    pub fn at_the_edge(settings: &Settings, seed: u64) -> Option<Self> {
        let random = &mut Random::new(seed ^ (1 << 40));
        let mut flight = Self::random(settings, seed);
        flight.duration = 4.0;
        let angles = flight.reference.at(flight.reference_start).angles;
        let mut far = angles + random.vector().component_mul(&degrees([8.0, 0.0, 10.0]));
        let mut rates = random.direction(settings.limit_rate);
        let kind = random.below(4);
        if kind != 1 {
            far.y = settings.sideslip_domain * if random.below(2) == 0 { 1.0 } else { -1.0 };
        }
        let mut share = random.between(0.0, 1.0);
        if kind == 0 {
            // The sideslip begins below its bound by this share of it, and moves outwards.
            let below = 10.0_f64.powf(random.between(-5.0, -1.0));
            far.y *= 1.0 - below;
            rates.y = rates.y.abs() * far.y.signum();
            share = 1.0;
        }
        if kind == 3 {
            rates *= random.between(0.0, 0.7);
        }
        let mut law = Crmpc::new(*settings).unwrap();
        let begin = |size: f64| {
            // Either the angles or the rates stay as they are while the others grow.
            let (of_angles, of_rates) = match kind {
                0 | 1 => (share, size),
                2 => (size, size),
                _ => (size, 1.0),
            };
            (angles + (far - angles) * of_angles, rates * of_rates)
        };
        let mut certified = |size: f64| {
            let ((angles, rates), mut memory) = (begin(size), law.memory());
            let measured = Measurement { angles, rates, ..Measurement::default() };
            let reference = |time: f64| flight.reference.at(flight.reference_start + time);
            law.update(&mut memory, 0, 0.0, &measured, &reference);
            memory.assured()
        };
        let (mut low, mut high) = (0.0, 1.0);
        if !certified(low) {
            return None;
        }
        for _ in 0..14 {
            let middle = 0.5 * (low + high);
            if certified(middle) { low = middle } else { high = middle }
        }
        (flight.angles, flight.rates) = begin(low * if random.below(2) == 0 { 1.0 } else { 0.999 });
        // Many disturbances drive the sideslip further outwards, and some flights have none.
        let mut outwards = random.corner();
        outwards.y = flight.angles.y.signum();
        match random.below(4) {
            0 => flight.disturbance = Waveform::Constant(outwards),
            1 => flight.disturbance = Waveform::Constant(Vector3::zeros()),
            _ => {}
        }
        Some(flight)
    }

    /// Draws a symmetric matrix in any directions, whose eigenvalues are of this size.
    pub fn tensor_of(size: f64, random: &mut Random) -> Matrix3<f64> {
        let turned = Rotation3::new(random.direction(1.0) * random.between(0.0, 3.1)).into_inner();
        let error = turned * Matrix3::from_diagonal(&(random.corner() * size)) * turned.transpose();
        // Rounding must leave the tensor symmetric.
        0.5 * (error + error.transpose())
    }

    fn random_sine(random: &mut Random) -> Profile {
        let mean =
            degrees([10.0, 0.0, -30.0]) + random.vector().component_mul(&degrees([5.0, 2.0, 20.0]));
        // A moving sideslip needs many optimisations.
        let sideslip = if random.below(12) == 0 { 3.0 } else { 0.0 };
        let amplitude = random.vector().component_mul(&degrees([3.0, sideslip, 6.0]));
        Profile::sine(mean, amplitude, random.between(0.1, 0.8), random.between(0.0, 6.3))
    }
}

fn degrees(values: [f64; 3]) -> Vector3<f64> {
    Vector3::from(values).map(f64::to_radians)
}
