//! The guarantee of the robust set in closed loops: it is in force throughout, and it holds.
//! `orchestrator campaign` and `orchestrator falsify` fly many more cases.

use crate::harness::flight::{
    Flight, Random, Shown, Sight, Tried, Waveform, optimised_every, random_settings, tried,
};
use crate::harness::{constant, in_parallel, run, settings};
use control::Measurement;
use control::crmpc::{Constraints, Design, Guarantee, Settings};
use control::delay::Predictor;
use control::error_dynamics::Gain;
use nalgebra::Vector3;
use vehicle::disturbance::Disturbance;
use vehicle::integrator::rk4;
use vehicle::kinematics::{self, Kinematics};
use vehicle::plant::{self, Load};

/// Returns flights with disturbances of every kind and both inertia errors, from the start of Chai
/// 2022.
fn flights(settings: &Settings, sights: &[Sight]) -> Vec<Flight> {
    let mut flights = Vec::new();
    for (i, disturbance) in Waveform::all().into_iter().enumerate() {
        flights.push(Flight {
            disturbance,
            inertia_scale: crate::harness::INERTIA_SCALES[i % 2],
            hold: [0.04, crate::harness::CHECK][i / 2 % 2],
            sight: sights[i % sights.len()].clone(),
            seed: i as u64,
            duration: 30.0,
            ..Flight::new(settings)
        });
    }
    flights
}

fn assert_kept(flights: &[Flight]) {
    let shown: Vec<Shown> = in_parallel(flights, Flight::fly);
    for (Flight { disturbance, sight, settings, duration, .. }, shown) in flights.iter().zip(shown)
    {
        assert!(shown.assumed && !shown.defective(), "{disturbance:?}, {sight:?}: {shown:?}");
        // The guarantee is in force from the instant at which the first command acts.
        let before = (settings.delay / settings.period_feedback).ceil() * settings.period_feedback;
        assert!(
            (shown.in_force - (1.0 - before / duration)).abs() < 1e-12,
            "{disturbance:?}, {sight:?}: {shown:?}"
        );
    }
}

#[test]
fn guarantee_is_kept_with_an_error_of_the_tensor_of_inertia() {
    let settings = Settings {
        inertia_error: 0.0,
        tensor_error: 0.05,
        delay: 0.04,
        ..settings(Constraints::Robust)
    };
    let with_error = |(seed, flight): (u64, Flight)| Flight {
        inertia_scale: 1.0,
        tensor_error: Flight::tensor_of(settings.tensor_error, &mut Random::new(seed)),
        ..flight
    };
    let flights = [(); 2].map(|()| flights(&settings, &[Sight::Exact])).concat();
    let flights: Vec<Flight> = (1..).zip(flights).map(with_error).collect();
    assert_kept(&flights);
}

#[test]
fn guarantee_is_kept_with_a_delay_that_is_known_within_an_interval() {
    let settings = Settings {
        delay: 0.04,
        delay_error: 0.01,
        disturbance_bound: f64::to_radians(1.9),
        ..settings(Constraints::Robust)
    };
    let late = [-0.01, -0.006, 0.004, 0.01];
    let flights = late.map(|late| {
        let flights = flights(&settings, &[Sight::Exact]);
        flights.into_iter().map(move |flight| Flight { late, ..flight }).collect::<Vec<_>>()
    });
    assert_kept(&flights.concat());
}

#[test]
fn guarantee_is_kept_without_delay_and_errors() {
    assert_kept(&flights(&settings(Constraints::Robust), &[Sight::Exact]));
}

#[test]
fn guarantee_is_kept_with_a_delay_of_one_period() {
    assert_kept(&flights(
        &Settings { delay: 0.04, ..settings(Constraints::Robust) },
        &[Sight::Exact],
    ));
}

#[test]
fn guarantee_is_kept_with_a_long_delay() {
    assert_kept(&flights(
        &Settings { delay: 0.117, ..settings(Constraints::Robust) },
        &[Sight::Exact],
    ));
}

/// Returns errors of every kind within their bounds.
fn erroneous() -> [Sight; 4] {
    let waveforms = [
        Waveform::White,
        Waveform::Switching(0.2),
        Waveform::AlongRate(-1.0),
        Waveform::AlongMoment(1.0),
    ];
    waveforms.map(Sight::Errors)
}

#[test]
fn guarantee_is_kept_with_erroneous_measurements() {
    let error = f64::to_radians(0.02);
    assert_kept(&flights(
        &Settings { angle_error: error, rate_error: error, ..settings(Constraints::Robust) },
        &erroneous(),
    ));
}

#[test]
fn guarantee_is_kept_with_large_errors_a_delay_and_less_disturbance() {
    assert_kept(&flights(&estimated(), &erroneous()));
}

/// Returns the settings of the experiment with sensors and estimator.
fn estimated() -> Settings {
    Settings {
        feedback: Gain { k1: -0.5, k2: -1.5 },
        angle_error: f64::to_radians(0.25),
        rate_error: f64::to_radians(0.25),
        delay: 0.04,
        disturbance_bound: f64::to_radians(0.4),
        ..settings(Constraints::Robust)
    }
}

#[test]
fn guarantee_is_kept_with_sensors_and_estimator() {
    // The estimate is one period old, and its errors stay within the bounds: only the law's own
    // assumptions are used.
    let sights: Vec<Sight> = (1..=6).map(Sight::Estimator).collect();
    let flights: Vec<Flight> = flights(&estimated(), &sights)
        .into_iter()
        .map(|flight| Flight { age: 0.04, duration: 50.0, ..flight })
        .collect();
    assert_kept(&flights);
}

#[test]
fn guarantee_is_kept_from_random_starts_along_random_references() {
    let flights: Vec<Flight> = (1..=24)
        .map(|seed| Flight {
            duration: 15.0,
            ..Flight::random(&settings(Constraints::Robust), seed)
        })
        .collect();
    let mut in_force = 0.0;
    for (flight, shown) in flights.iter().zip(in_parallel(&flights, Flight::fly)) {
        assert!(!shown.defective(), "seed {}: {shown:?}", flight.seed);
        in_force += shown.in_force / flights.len() as f64;
    }
    assert!(in_force > 0.8, "{in_force}");
}

#[test]
fn guarantee_is_kept_from_the_edge_of_the_certified_states() {
    // Without the check of beta between two stages, 2 % of the flights with a period of 1 s leave
    // the bound on the sideslip.
    for period in [0.08, 0.2, 0.4, 1.0] {
        let settings = optimised_every(period);
        let seeds: Vec<u64> = (1..=150).collect();
        let shown = in_parallel(&seeds, |&seed| {
            Flight::at_the_edge(&settings, seed).map(|flight| flight.fly())
        });
        let flown: Vec<(u64, Shown)> =
            seeds.iter().zip(shown).filter_map(|(seed, shown)| Some((*seed, shown?))).collect();
        for (seed, shown) in &flown {
            assert!(!shown.defective(), "{period} s, seed {seed}: {shown:?}");
        }
        let in_force: f64 = flown.iter().map(|(_, shown)| shown.in_force).sum();
        assert!(flown.len() > 100 && in_force > 0.98 * flown.len() as f64, "{period} s");
        let largest = flown.iter().map(|(_, shown)| shown.sideslip).fold(0.0, f64::max);
        assert!(largest > 0.999, "{period} s: {largest}");
    }
}

#[test]
fn accepted_settings_keep_the_guarantee_and_refused_ones_name_bounds_that_are_accepted() {
    let seeds: Vec<u64> = (1..=60).collect();
    let (mut flown, mut named) = (0, 0);
    for (seed, outcome) in
        seeds.iter().zip(in_parallel(&seeds, |&seed| tried(&random_settings(seed), seed)))
    {
        match outcome {
            Tried::Flown(shown) => {
                flown += 1;
                assert!(!shown.defective(), "seed {seed}: {shown:?}");
            }
            Tried::Refused { bounds, not_accepted } => {
                named += bounds;
                assert!(not_accepted.is_empty(), "seed {seed}: {not_accepted:?}");
            }
            Tried::Invalid(_) => {}
        }
    }
    assert!(flown >= 10 && named >= 10, "{flown} flown, {named} bounds named");
}

/// Largest ‖x̂_ω − x̃_ω‖ of the second predicted state, relative to its bound, that a search over
/// states, moments and errors of two measurements finds. Nothing else drives the deviation.
fn second_prediction(settings: &Settings) -> f64 {
    let Settings { body, limit_moment, limit_rate, delay, period_feedback: tau, .. } = *settings;
    let predictor = Predictor::new(body, delay, tau).unwrap();
    let over_a_period = Predictor::new(body, tau, tau).unwrap();
    let bound = Design::new(settings).unwrap().tightening.at(1).seen_rate;
    let measured = |state: &Measurement, corner: &Vector3<f64>, of_angles: &Vector3<f64>| {
        let angles = state.angles + of_angles * settings.angle_error;
        let rates = kinematics::r(&state.angles) * state.rates + corner * settings.rate_error;
        Measurement { angles, rates: kinematics::r_inverse(&angles) * rates, ..*state }
    };
    let vector = |z: &[f64]| Vector3::new(z[0], z[1], z[2]);
    let inside = |z: &[f64], size: f64| vector(z) * (size / vector(z).norm().max(1.0));
    let share = |z: &[f64; 17]| {
        let angles =
            Vector3::new(std::f64::consts::PI * z[0], settings.sideslip_domain * z[1], 0.0);
        let start =
            Measurement { angles, rates: inside(&z[2..5], limit_rate), ..Measurement::default() };
        let (under_way, next) = (inside(&z[5..8], limit_moment), inside(&z[8..11], limit_moment));
        let (corner, of_angles) = (vector(&z[11..14]).map(f64::signum), vector(&z[14..17]));
        let first = predictor.predict(&[under_way; 3], &measured(&start, &corner, &of_angles));
        let moved = over_a_period.predict(&[under_way], &start);
        let true_end = predictor.predict(&[under_way, under_way, next], &moved);
        let end = predictor
            .predict(&[under_way, under_way, next], &measured(&moved, &-corner, &-of_angles));
        let within_limits = |state: &Measurement| {
            state.rates.norm() <= limit_rate && state.angles.y.abs() <= settings.sideslip_domain
        };
        if !(within_limits(&start) && within_limits(&moved) && within_limits(&true_end)) {
            return 0.0;
        }
        // The plan's acceleration is the one for which the law commands `next`.
        let rates = kinematics::r(&first.angles) * first.rates;
        let mut a = Vector3::zeros();
        for _ in 0..8 {
            let angles = first.angles + (rates + a * (0.25 * tau)) * (0.5 * tau);
            let x = rates + a * (0.5 * tau);
            a = body.drift(&angles, &x) + kinematics::r(&angles) * body.inverse * next;
        }
        (kinematics::r(&end.angles) * end.rates - rates - a * tau).norm() / bound
    };
    let mut random = Random::new(7);
    let mut largest = 0.0_f64;
    for _ in 0..40 {
        let mut at: [f64; 17] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let (mut value, mut step) = (share(&at), 1.0);
        for _ in 0..600 {
            let tried = at.map(|z| (z + step * random.between(-1.0, 1.0)).clamp(-1.0, 1.0));
            let there = share(&tried);
            if there > value {
                (at, value) = (tried, there);
            } else {
                step = f64::max(0.98 * step, 0.01);
            }
        }
        largest = largest.max(value);
    }
    largest
}

#[test]
fn regress_errors_grow_over_the_delay() {
    // The change of F along the prediction enlarges the errors of two measurements before the next
    // one shows it. The bound once omitted this, and was exceeded.
    let error = 0.2_f64.to_radians();
    let settings = Settings {
        feedback: Gain { k1: -0.5, k2: -1.5 },
        disturbance_bound: 0.0,
        inertia_error: 0.0,
        angle_error: error,
        rate_error: error,
        delay: 0.117,
        ..settings(Constraints::Robust)
    };
    let share = second_prediction(&settings);
    assert!(share > 0.9 && share < 1.0, "{share}");
}

#[test]
fn regress_a_disturbance_of_1_4_times_the_bound_does_not_cost_the_attitude() {
    // The EMS of an LQR with limited moment is 4.15° on average and 16.3° at most, by a campaign
    // that docs/guarantee.md names.
    let published = settings(Constraints::Robust);
    let disturbance_bound = 1.4 * published.disturbance_bound;
    let told = Settings { disturbance_bound, guarantee: Guarantee::BestEffort, ..published };
    for (settings, largest) in [(told, 3.0), (published, 6.0)] {
        let outcomes = in_parallel(&constant(), |case| {
            let disturbance = Disturbance { bound: disturbance_bound, ..case.disturbance.clone() };
            run(&settings, case.inertia_scale, disturbance)
        });
        for (case, (outcome, kept)) in constant().iter().zip(outcomes) {
            assert!(outcome.ems_deg < largest && outcome.rate <= 1.0, "{}: {outcome:?}", case.name);
            assert!(kept.in_force < 1.0, "{}: {kept:?}", case.name);
        }
    }
}

#[test]
fn regress_the_prediction_errs_by_less_than_its_rounding() {
    // The same prediction with a hundred times smaller steps; docs/guarantee.md states the size.
    let Settings { body, limit_rate, limit_moment, sideslip_domain, period_feedback, .. } =
        settings(Constraints::Robust);
    let predictor = Predictor::new(body, 0.12, period_feedback).unwrap();
    let random = &mut Random::new(1);
    let mut largest = 0.0_f64;
    for _ in 0..2000 {
        let length = random.between(0.0, limit_rate);
        let measured = Measurement {
            angles: Vector3::new(
                random.between(-3.1, 3.1),
                sideslip_domain * random.between(-1.0, 1.0),
                0.0,
            ),
            rates: random.direction(length),
            ..Measurement::default()
        };
        let moments = [(); 3].map(|()| random.direction(limit_moment));
        let predicted = predictor.predict(&moments, &measured);
        let mut state = plant::state(&measured.angles, &measured.rates);
        for moment in moments {
            let load = Load { moment, ..Load::default() };
            let mut f = |_: f64, state: &plant::State| {
                plant::derivative(&body, Kinematics::Printed, state, &load)
            };
            for _ in 0..400 {
                state = rk4(&mut f, 0.0, &state, 0.0001);
            }
        }
        let of_angles = (predicted.angles - plant::angles(&state)).norm();
        largest = largest.max(of_angles).max((predicted.rates - plant::rates(&state)).norm());
    }
    assert!(largest < 1e-12, "{largest}");
}
