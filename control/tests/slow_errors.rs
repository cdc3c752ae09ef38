//! The guarantee of the robust set while the errors of the measured angles change slowly.

use crate::prelude::*;

/// Returns the settings for errors of an inertial navigation: of the angles up to 0.3°, which
/// change by up to 0.046°/s, and small ones from tick to tick.
fn navigated(delay: f64) -> Settings {
    let error = f64::to_radians(0.005);
    Settings {
        delay,
        angle_error: error,
        rate_error: error,
        slow_angle_error: f64::to_radians(0.3),
        slow_angle_rate: f64::to_radians(0.046),
        ..settings(Constraints::Robust)
    }
}

/// Returns derivatives of the slow error: ramps up to the bound, reversals in resonance with the
/// loop and slower ones, and those that follow the motion or the moment.
fn derivatives() -> [Waveform; 8] {
    let corner = Vector3::new(-1.0, 1.0, 1.0);
    [
        Waveform::Constant(corner),
        Waveform::Square(0.4, corner),
        Waveform::Square(2.0, corner),
        Waveform::Square(20.0, corner),
        Waveform::Switching(5.0),
        Waveform::AlongRate(1.0),
        Waveform::AlongRate(-1.0),
        Waveform::AlongMoment(1.0),
    ]
}

/// Returns flights under disturbances of every kind with slow errors of every kind at the bounds of
/// `declared`, and fast errors.
fn flights(settings: &Settings, declared: &Settings) -> Vec<Flight> {
    let begin = Vector3::new(1.0, -1.0, 2.0);
    let mut flights = Vec::new();
    for (i, derivative) in derivatives().into_iter().enumerate() {
        for (j, disturbance) in Waveform::all().into_iter().enumerate() {
            flights.push(Flight {
                disturbance,
                slow: Some(Slow::new(declared, derivative.clone(), begin)),
                sight: Sight::Errors([Waveform::White, Waveform::AlongMoment(1.0)][i % 2].clone()),
                inertia_scale: crate::harness::INERTIA_SCALES[j % 2],
                seed: (10 * i + j) as u64,
                duration: 30.0,
                ..Flight::new(settings)
            });
        }
    }
    flights
}

#[test]
fn guarantee_is_kept_with_slow_errors_without_and_with_a_delay() {
    for delay in [0.0, 0.04] {
        let settings = navigated(delay);
        assert_kept(&format!("delay {delay}"), &flights(&settings, &settings));
    }
}

/// Returns settings in which the slow errors, large and quick ones, count for more than Δ.
fn drifting() -> Settings {
    Settings {
        slow_angle_error: f64::to_radians(1.0),
        slow_angle_rate: f64::to_radians(0.3),
        disturbance_bound: f64::to_radians(0.5),
        ..settings(Constraints::Robust)
    }
}

#[test]
fn guarantee_is_kept_with_slow_errors_from_the_edge_of_the_certified_states() {
    let settings = drifting();
    let seeds: Vec<u64> = (1..=150).collect();
    let shown = in_parallel(&seeds, |&seed| {
        let flight = Flight::at_the_edge(&settings, seed)?;
        // At first the navigated angles are those for which a plan was just certified, and the
        // sideslip is larger.
        let begin = Vector3::new(0.0, -flight.angles.y.signum(), 0.0);
        let slow = flight.slow.clone().map(|slow| Slow { begin, ..slow });
        let angles = flight.angles - begin * settings.slow_angle_error;
        Some(Flight { angles, slow, ..flight }.fly())
    });
    let flown: Vec<Shown> = shown.into_iter().flatten().collect();
    let largest = |of: fn(&Shown) -> f64| flown.iter().map(of).fold(0.0, f64::max);
    assert!(flown.iter().all(|shown| !shown.defective()));
    let in_force: f64 = flown.iter().map(|shown| shown.in_force).sum();
    assert!(flown.len() > 100 && in_force > 0.98 * flown.len() as f64, "{in_force}");
    let (sideslip, rate) = (largest(|shown| shown.sideslip), largest(|shown| shown.rate));
    assert!(sideslip > 0.99 && rate > 0.9, "{sideslip} {rate}");
}

/// Returns the largest deviations of the state that the law sees, relative to their bounds: of the
/// angles, of the rates, and K ô.
fn shares(flight: &Flight) -> [f64; 3] {
    let Settings { feedback, .. } = flight.settings;
    let design = Design::new(&flight.settings).unwrap();
    let mut shares = [0.0_f64; 3];
    let observe = |memory: &Memory, tick: u64, measured: &Measurement, _: &Reference| {
        let rates = kinematics::r(&measured.angles) * measured.rates;
        let angles: Vector3<f64> = measured.angles - memory.nominal.fixed_rows::<3>(0);
        let rates: Vector3<f64> = rates - memory.nominal.fixed_rows::<3>(3);
        let n = memory.age as usize + (tick as usize) % design.ratio;
        let bounds = design.tightening.at(n);
        let sizes = [
            (angles.xy().norm(), bounds.seen_angle),
            (rates.norm(), bounds.seen_rate),
            ((angles * feedback.k1 + rates * feedback.k2).norm(), bounds.feedback_norm),
        ];
        if n > 0 {
            shares = std::array::from_fn(|i| shares[i].max(sizes[i].0 / sizes[i].1));
        }
    };
    let shown = flight.fly_seen(observe);
    assert!(!shown.defective() && shown.in_force == 1.0, "{shown:?}");
    shares
}

#[test]
fn no_slow_error_drives_the_vehicle_beyond_the_bound_and_the_worst_comes_half_way() {
    // Nothing else drives it, and the nominal trajectory never begins anew.
    let settings = Settings {
        disturbance_bound: 0.0,
        inertia_error: 0.0,
        initial_state: InitialState::Nominal,
        ..drifting()
    };
    let mut flights = Vec::new();
    for period in [0.16, 0.4, 0.8, 1.4, 2.0, 2.8, 4.0, 8.0, 60.0] {
        for corner in [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, -1.0]] {
            let corner = Vector3::from(corner);
            let slow = Slow::new(&settings, Waveform::Square(period, corner), -corner);
            flights.push(Flight { slow: Some(slow), duration: 30.0, ..Flight::new(&settings) });
        }
    }
    let found = in_parallel(&flights, shares);
    let largest = |i: usize| found.iter().map(|shares| shares[i]).fold(0.0, f64::max);
    for i in 0..3 {
        assert!(largest(i) < 1.0, "{i}: {}", largest(i));
    }
    assert!(largest(1) > 0.5, "{}", largest(1));
}

#[test]
fn slow_errors_that_are_not_declared_can_end_the_guarantee() {
    let exact = Settings { angle_error: 0.0, rate_error: 0.0, ..navigated(0.0) };
    let undeclared = |s: Settings| Settings { slow_angle_error: 0.0, slow_angle_rate: 0.0, ..s };
    for (settings, least) in [(navigated(0.0), 5), (exact, 40)] {
        let flights = flights(&undeclared(settings), &navigated(0.0));
        let shown = in_parallel(&flights, Flight::fly);
        let ended = shown.iter().filter(|shown| shown.withdrawn.is_some()).count();
        assert!(shown.iter().all(|shown| !shown.broken && !shown.assumed));
        assert!(ended >= least, "{ended} of {}", shown.len());
    }
}
