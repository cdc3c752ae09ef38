//! Faults that the assumptions of the guarantee exclude, under settings of several kinds.
#![allow(dead_code, missing_docs, unreachable_pub)] // Each user needs a part of it.

use super::flight::{BEGIN, Fault, Flight, Random, Shown, Sight, Slow, Stuck, Waveform};
use super::{in_parallel, settings};
use control::crmpc::{Constraints, Settings};
use control::error_dynamics::Gain;
use nalgebra::{Matrix3, Vector3};
use vehicle::profile::Profile;

/// Settings under which faults are flown, with the age of the measurements, s.
pub fn situations() -> [(&'static str, Settings, f64); 5] {
    let published = settings(Constraints::Robust);
    let estimator = Settings {
        feedback: Gain { k1: -0.5, k2: -1.5 },
        angle_error: 0.25 * DEGREE,
        rate_error: 0.25 * DEGREE,
        delay: 0.04,
        disturbance_bound: 0.4 * DEGREE,
        ..published
    };
    let small = Settings {
        angle_error: 0.1 * DEGREE,
        rate_error: 0.1 * DEGREE,
        disturbance_bound: 0.8 * DEGREE,
        ..published
    };
    let slow = Settings {
        angle_error: 0.005 * DEGREE,
        rate_error: 0.005 * DEGREE,
        slow_angle_error: 0.3 * DEGREE,
        slow_angle_rate: 0.046 * DEGREE,
        ..published
    };
    [
        ("default", published, 0.0),
        ("delay", Settings { delay: 0.04, ..published }, 0.0),
        ("estimator", estimator, 0.04),
        ("errors .1", small, 0.0),
        ("slow", slow, 0.0),
    ]
}

/// A fault with its name, the inertia's factor and how much later the commands act (s).
pub type Case = (&'static str, Fault, f64, f64);

/// Returns every fault.
pub fn faults() -> Vec<Case> {
    let about = |size: f64| Matrix3::identity() * size;
    let swapped = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let one = |size: f64| Matrix3::from_diagonal(&Vector3::new(1.0, size, 1.0));
    let kinds = [
        ("stuck", Fault::Stuck(Stuck::All, 0.0)),
        ("stuck, noise 1e-9 rad", Fault::Stuck(Stuck::All, 1e-9)),
        ("stuck, noise 1e-7 rad", Fault::Stuck(Stuck::All, 1e-7)),
        ("stuck, noise 1e-5 rad", Fault::Stuck(Stuck::All, 1e-5)),
        ("stuck, noise 1e-4 rad", Fault::Stuck(Stuck::All, 1e-4)),
        ("stuck, noise 1e-3 rad", Fault::Stuck(Stuck::All, 1e-3)),
        ("stuck, noise 1e-2 rad", Fault::Stuck(Stuck::All, 1e-2)),
        ("rates stuck", Fault::Stuck(Stuck::Rates, 0.0)),
        ("rates stuck, noise 1e-4", Fault::Stuck(Stuck::Rates, 1e-4)),
        ("angles stuck", Fault::Stuck(Stuck::Angles, 0.0)),
        ("angles stuck, noise 1e-4", Fault::Stuck(Stuck::Angles, 1e-4)),
        ("bias .3 deg/s", Fault::Bias(0.3 * DEGREE, 0.0)),
        ("bias .5 deg/s", Fault::Bias(0.5 * DEGREE, 0.0)),
        ("bias 1 deg/s", Fault::Bias(DEGREE, 0.0)),
        ("bias 2 deg/s", Fault::Bias(2.0 * DEGREE, 0.0)),
        ("bias 5 deg/s", Fault::Bias(5.0 * DEGREE, 0.0)),
        ("bias by .05 deg/s²", Fault::Bias(0.0, 0.05 * DEGREE)),
        ("bias by .2 deg/s²", Fault::Bias(0.0, 0.2 * DEGREE)),
        ("bias by 1 deg/s²", Fault::Bias(0.0, DEGREE)),
        ("angles by .1 deg/s", Fault::Drift(0.1 * DEGREE)),
        ("angles by 1 deg/s", Fault::Drift(DEGREE)),
        ("rates times .5", Fault::Rates(about(0.5))),
        ("rates times .8", Fault::Rates(about(0.8))),
        ("rates times .9", Fault::Rates(about(0.9))),
        ("rates times 1.2", Fault::Rates(about(1.2))),
        ("rates p and q swapped", Fault::Rates(swapped)),
        ("rates' signs", Fault::Rates(about(-1.0))),
        ("q's sign", Fault::Rates(one(-1.0))),
        ("q zero", Fault::Rates(one(0.0))),
        ("late by a tick", Fault::Late(1)),
        ("late by .2 s", Fault::Late(5)),
        ("late by 1 s", Fault::Late(25)),
        ("dropout .5 s", Fault::Dropout(0.5)),
        ("half lost", Fault::Lost(0.5)),
        ("9 of 10 lost", Fault::Lost(0.9)),
        ("spikes 2 deg/s", Fault::Spikes(2.0 * DEGREE)),
        ("1.2 times disturbance.bound", Fault::Disturbance(1.2)),
        ("2 times", Fault::Disturbance(2.0)),
        ("3 times", Fault::Disturbance(3.0)),
        ("5 times", Fault::Disturbance(5.0)),
        ("every second command", Fault::HalfTheCommands),
        ("half the moment", Fault::Moment(about(0.5))),
        (".8 times the moment", Fault::Moment(about(0.8))),
        ("1.5 times the moment", Fault::Moment(about(1.5))),
        ("moment's sign", Fault::Moment(about(-1.0))),
        ("no pitching moment", Fault::Moment(one(0.0))),
        ("moments x and y swapped", Fault::Moment(swapped)),
        ("moment stuck", Fault::StuckMoment),
    ];
    let mut cases: Vec<Case> =
        kinds.into_iter().map(|(name, fault)| (name, fault, 1.0, 0.0)).collect();
    cases.push(("inertia + 30 %", Fault::None, 1.3, 0.0));
    cases.push(("delay + .2 s", Fault::None, 1.0, 0.2));
    cases
}

pub const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Returns a flight of 40 s in which the bank angle steps or oscillates.
pub fn flight(settings: &Settings, age: f64, seed: u64) -> Flight {
    let random = &mut Random::new(seed);
    let mut flight = Flight { age, seed, duration: 40.0, ..Flight::new(settings) };
    let bank = random.between(15.0, 60.0) * if random.below(2) == 0 { 1.0 } else { -1.0 };
    let [from, to] = [0.0, bank]
        .map(|bank| Vector3::new(random.between(5.0, 30.0), 0.0, bank).map(f64::to_radians));
    flight.angles = from;
    flight.rates = Vector3::zeros();
    flight.reference = match random.below(3) {
        0 => Profile::step(from, to, BEGIN + random.between(-3.0, 5.0)),
        1 => Profile::sine(from, to * 0.3, random.between(0.3, 0.8), random.between(0.0, 6.0)),
        _ => Profile::constant(from),
    };
    flight.disturbance = match random.below(4) {
        0 => Waveform::Constant(random.corner()),
        1 => Waveform::White,
        2 => Waveform::Square(random.between(1.0, 6.0), random.corner()),
        _ => Waveform::AlongRate(1.0),
    };
    if settings.slow_angle_error > 0.0 {
        let derivative = Waveform::Switching(random.between(2.0, 20.0));
        flight.slow = Some(Slow::new(settings, derivative, random.vector()));
    }
    if settings.rate_error > 0.0 {
        flight.sight = Sight::Errors(Waveform::White);
    }
    flight
}

fn broken(shown: &Shown) -> bool {
    shown.rate.max(shown.moment) > 1.0 + 1e-9
}

/// Flights of one fault under the same settings.
pub struct Flown {
    /// Number of flights in which the guarantee ended, and the mean time until then, s.
    pub noticed: usize,
    pub mean: f64,
    /// Number of flights in which a limit was exceeded under guarantee, and of ticks.
    pub broken: usize,
    pub ticks: u32,
    /// Largest rate over its limit under guarantee.
    pub largest: f64,
    /// Seed of the flight with it.
    pub seed: u64,
}

pub fn fly(situation: &(&str, Settings, f64), case: &Case, count: u64) -> Flown {
    let (_, settings, age) = situation;
    let &(_, fault, inertia_scale, late) = case;
    let flights: Vec<Flight> = (0..count)
        .map(|seed| Flight { inertia_scale, late, fault, ..flight(settings, *age, 7000 + seed) })
        .collect();
    let shown = in_parallel(&flights, Flight::fly);
    let begin = if fault == Fault::None { 0.0 } else { BEGIN };
    let noticed: Vec<f64> = shown.iter().filter_map(|shown| shown.withdrawn).collect();
    let worst = (0..shown.len()).max_by(|&i, &j| shown[i].rate.total_cmp(&shown[j].rate)).unwrap();
    Flown {
        noticed: noticed.len(),
        mean: noticed.iter().map(|time| time - begin).sum::<f64>() / noticed.len() as f64,
        broken: shown.iter().filter(|shown| broken(shown)).count(),
        ticks: shown.iter().map(|shown| shown.ticks_over).sum(),
        largest: shown[worst].rate,
        seed: flights[worst].seed,
    }
}
