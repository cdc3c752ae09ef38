//! Tests of the plant: conservation laws, order, cuts, reproducibility and refusals.

use nalgebra::{Vector3, Vector6};
use proptest::prelude::*;
use vehicle::actuators::{self, Command, JetMode};
use vehicle::disturbance::{
    Disturbance, DisturbanceKind, DisturbanceTable, MomentWave, Row, SineMoment,
};
use vehicle::effectors::Effectors;
use vehicle::kinematics::{Kinematics, Trajectory};
use vehicle::plant::{
    Config, Input, Load, Partials, Plant, State, derivative, partial_derivatives,
};
use vehicle::sensor_data::SensorData;
use vehicle::{Error, Scenario, sensors, turntable};

fn config() -> Config {
    Scenario::crmpc2022().config(0.01)
}

fn undisturbed(initial: State, step: f64) -> Config {
    Config { initial, step, disturbance: Disturbance::default(), ..config() }
}

const TUMBLING: [f64; 6] = [0.2, 0.1, -0.5, 0.08, -0.05, 0.06];

/// One plant for each kind of disturbance, all with the data of crmpc-2022.
fn kinds() -> impl Iterator<Item = Config> {
    use DisturbanceKind::{AgainstMoment, AlongRate, Constant, None, Sine, Square, Table, White};
    [None, White, Constant, Sine, Square, AlongRate, AgainstMoment, Table].into_iter().map(|kind| {
        let wave = |frequency| MomentWave {
            amplitude: Vector3::new(1e4, 2e4, -1e4),
            frequency,
            phase: 0.2,
        };
        let sine = SineMoment { offset: Vector3::repeat(5e3), waves: vec![wave(1.0), wave(0.1)] };
        let disturbance = Disturbance {
            kind,
            sine,
            square_period: 0.7,
            table: table(),
            start: 0.5,
            end: 3.3,
            ..config().disturbance
        };
        Config { disturbance, ..config() }
    })
}

/// Returns a table with jumps between the communication points of any test.
fn table() -> DisturbanceTable {
    let rows = [(0.113, [1.0, 0.0, -1.0]), (0.3141, [-0.4, 0.7, 1.0]), (0.7, [0.0, -1.0, 0.2])];
    let row = |(time, direction)| Row { time, direction: Vector3::from(direction) };
    DisturbanceTable { period: 0.9, rows: rows.map(row).to_vec() }
}

fn moment(k: u32) -> Vector3<f64> {
    let t = f64::from(k) * 0.2;
    Vector3::new(2e4 * t.sin(), -1e4 * (0.7 * t).cos(), 3e4 * (0.3 * t).sin())
}

#[test]
fn oracle_torque_free_motion_conserves_energy_and_angular_momentum() {
    let mut plant = Plant::new(&undisturbed(TUMBLING.into(), 0.01), 0.0).unwrap();
    let body = *plant.body();
    let energy = |plant: &Plant| plant.rates().dot(&(body.inertia * plant.rates())) / 2.0;
    let momentum = |plant: &Plant| (body.inertia * plant.rates()).norm();
    let (energy_0, momentum_0) = (energy(&plant), momentum(&plant));
    let rates_0 = plant.rates();
    for k in 0..10 {
        plant.advance(f64::from(k), f64::from(k + 1), Vector3::zeros()).unwrap();
        assert!((energy(&plant) / energy_0 - 1.0).abs() < 1e-13);
        assert!((momentum(&plant) / momentum_0 - 1.0).abs() < 1e-13);
    }
    assert!((plant.rates() - rates_0).norm() > 0.01, "the body does not tumble");
}

#[test]
fn oracle_integration_has_order_four() {
    let end = |step: f64| {
        let mut plant = Plant::new(&undisturbed(Vector6::from(TUMBLING) * 3.0, step), 0.0).unwrap();
        plant
            .advance_with(0.0, 4.0, &Command::default(), |t| {
                Vector3::new(1e5 * t.sin(), 2e5 * t.cos(), -1e5 * (2.0 * t).sin()).into()
            })
            .unwrap();
        plant.state
    };
    let exact = end(0.002);
    let error = |step| (end(step) - exact).norm();
    for step in [0.2, 0.1, 0.05] {
        let order = (error(step) / error(step / 2.0)).log2();
        assert!((order - 4.0).abs() < 0.2, "order {order} at {step} s");
    }
}

#[test]
fn oracle_constant_moment_about_a_principal_axis() {
    // Motion about the pitch axis at beta = 0, sigma free: q = M t / Iyy, alpha = alpha_0 + M t² /
    // 2 Iyy.
    let mut plant =
        Plant::new(&undisturbed(Vector6::new(0.1, 0.0, 0.3, 0.0, 0.0, 0.0), 0.01), 0.0).unwrap();
    let inertia = plant.body().inertia[(1, 1)];
    assert_eq!(inertia, 1303212.0 * 1.05);
    plant.advance(0.0, 3.0, Vector3::new(0.0, 1e5, 0.0)).unwrap();
    assert!((plant.rates() - Vector3::new(0.0, 1e5 * 3.0 / inertia, 0.0)).amax() < 1e-14);
    assert!((plant.angles() - Vector3::new(0.1 + 1e5 * 4.5 / inertia, 0.0, 0.3)).amax() < 1e-14);
}

#[test]
fn oracle_delta_is_an_acceleration_of_x_omega() {
    let body = *Plant::new(&config(), 0.0).unwrap().body();
    let (state, moment, delta) =
        (State::from(TUMBLING), Vector3::new(1e4, 2e4, 3e4), Vector3::new(0.03, -0.02, 0.01));
    for kinematics in [Kinematics::Printed, Kinematics::Exact] {
        // Differences along the motion give d(Rω)/dt, with and without Δ.
        let x_omega_rate = |delta: Vector3<f64>| {
            let h = 1e-5;
            let f =
                derivative(&body, kinematics, &state, &Load { moment, delta, ..Load::default() });
            let x_omega = |state: State| {
                kinematics.r(&vehicle::plant::angles(&state)) * vehicle::plant::rates(&state)
            };
            (x_omega(state + f * h) - x_omega(state - f * h)) / (2.0 * h)
        };
        assert!((x_omega_rate(delta) - x_omega_rate(Vector3::zeros()) - delta).amax() < 1e-9);
    }
}

fn long_and_short_steps(config: &Config) -> impl Iterator<Item = (State, State)> {
    let [mut long, mut short] = [0, 1].map(|_| Plant::new(config, 0.0).unwrap());
    let time = |tick: u32| f64::from(tick) * 0.04;
    (0..25).map(move |k| {
        long.advance(time(5 * k), time(5 * k + 5), moment(k)).unwrap();
        for j in 5 * k..5 * k + 5 {
            short.advance(time(j), time(j + 1), moment(k)).unwrap();
        }
        (long.state, short.state)
    })
}

#[test]
fn one_long_step_equals_five_short_ones_bit_for_bit() {
    for kind in [DisturbanceKind::White, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment]
    {
        let mut config = config();
        config.disturbance.kind = kind;
        assert!(long_and_short_steps(&config).all(|(long, short)| long == short), "{kind:?}");
    }
}

#[test]
fn one_long_step_equals_five_short_ones_if_the_disturbance_cuts_elsewhere() {
    for config in kinds() {
        for (long, short) in long_and_short_steps(&config) {
            assert!(
                (long - short).amax() < 1e-11,
                "{:?}: {}",
                config.disturbance.kind,
                long - short
            );
        }
    }
}

#[test]
fn a_clock_that_is_accumulated_makes_no_slivers() {
    let config = config();
    let [mut exact, mut accumulated] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
    let mut time = 0.0;
    for k in 0..1250 {
        exact.advance(f64::from(k) * 0.04, f64::from(k + 1) * 0.04, Vector3::zeros()).unwrap();
        let mut calls = 0;
        let count = |_| {
            calls += 1;
            Input::default()
        };
        accumulated.advance_with(time, time + 0.04, &Command::default(), count).unwrap();
        assert_eq!(calls, 1 + 4 * 4, "step {k}");
        time += 0.04;
        if exact.angles().y.abs() > 1.2 {
            return;
        }
        assert!((exact.state - accumulated.state).amax() < 1e-11, "step {k}");
    }
}

#[test]
fn a_last_step_short_by_rounding_is_taken() {
    let mut plant = Plant::new(&config(), 0.0).unwrap();
    plant.advance(0.0, 0.04 - 1e-17, Vector3::zeros()).unwrap();
    let before = plant.clone();
    plant.advance(0.04, 0.04, Vector3::repeat(1e5)).unwrap();
    assert_eq!(plant, before);
    plant.advance(0.04, 0.04 + 1e-12, Vector3::repeat(1e5)).unwrap();
    assert!((plant.state - before.state).amax() < 1e-12);
}

#[test]
fn start_time_may_be_anything() {
    for start in [-7.3, 0.0, 100.1] {
        let mut config = config();
        config.disturbance.start = start;
        let mut plant = Plant::new(&config, start).unwrap();
        plant.advance(start, start + 2.0, Vector3::zeros()).unwrap();
        let mut origin = config.clone();
        origin.disturbance.start = 0.0;
        let mut reference = Plant::new(&origin, 0.0).unwrap();
        reference.advance(0.0, 2.0, Vector3::zeros()).unwrap();
        assert!((plant.state - reference.state).amax() < 1e-12, "start {start}");
    }
}

/// Returns a plant under this disturbance with the bound of crmpc-2022.
fn disturbed(disturbance: Disturbance) -> Plant {
    let bound = config().disturbance.bound;
    let disturbance = Disturbance { bound, start: 0.5, ..disturbance };
    Plant::new(&Config { disturbance, ..config() }, 0.0).unwrap()
}

#[test]
fn oracle_square_and_constant_as_tables_bit_for_bit() {
    let direction = Vector3::new(1.0, -0.3, 0.8);
    let tabulated = |period: f64, rows: &[(f64, f64)]| {
        let row = |&(time, sign)| Row { time, direction: direction * sign };
        let table = DisturbanceTable { period, rows: rows.iter().map(row).collect() };
        disturbed(Disturbance { kind: DisturbanceKind::Table, table, ..Disturbance::default() })
    };
    let disturbed_by = |kind, square_period| {
        disturbed(Disturbance { kind, direction, square_period, ..Disturbance::default() })
    };
    // The jumps k · period / 2 of the square wave and the table's repetition · period + time are
    // the same numbers if period / 2 is a short binary fraction, and otherwise rounded differently.
    for (kind, square_period, period, rows, bound) in [
        (DisturbanceKind::Square, 1.5, 1.5, vec![(0.0, 1.0), (0.75, -1.0)], 0.0),
        (DisturbanceKind::Square, 0.7, 0.7, vec![(0.0, 1.0), (0.35, -1.0)], 1e-14),
        (DisturbanceKind::Constant, 1.0, 0.0, vec![(0.0, 1.0)], 0.0),
    ] {
        let (mut kind, mut table) = (disturbed_by(kind, square_period), tabulated(period, &rows));
        for k in 0..125 {
            let [from, to] = [0.04 * f64::from(k), 0.04 * f64::from(k + 1)];
            kind.advance(from, to, moment(k / 5)).unwrap();
            table.advance(from, to, moment(k / 5)).unwrap();
            let difference = (kind.state - table.state).amax();
            assert!(difference <= bound, "{difference} at {to} s");
        }
    }
}

#[test]
fn oracle_a_table_gives_the_parabolas_of_its_rows_whatever_the_communication_step() {
    // At beta = 0, without roll and yaw, Δ_α is the second derivative of α.
    let rows = [(0.3, 1.0), (0.7001, -0.5), (1.15, 0.0), (1.3, -1.0)];
    let row = |(time, x)| Row { time, direction: Vector3::new(x, 0.0, 0.0) };
    let table = DisturbanceTable { period: 1.7, rows: rows.map(row).to_vec() };
    let disturbance = Disturbance {
        kind: DisturbanceKind::Table,
        bound: 0.03,
        table,
        start: 0.1,
        ..Disturbance::default()
    };
    let (mut alpha, mut rate, mut time) = (0.1, 0.0, 0.0);
    for (until, factor) in [0.0, 1.7].into_iter().flat_map(|begin| {
        [(0.3, 0.0), (0.7001, 1.0), (1.15, -0.5), (1.3, 0.0), (1.7, -1.0)]
            .map(move |(until, factor)| (0.1 + begin + until, factor))
    }) {
        let (t, delta) = (until - time, 0.03 * factor);
        alpha += rate * t + delta * t * t / 2.0;
        rate += delta * t;
        time = until;
    }
    for steps in [1, 7, 85, 1000] {
        let initial = Vector6::new(0.1, 0.0, 0.3, 0.0, 0.0, 0.0);
        let config = Config { disturbance: disturbance.clone(), ..undisturbed(initial, 0.01) };
        let mut plant = Plant::new(&config, 0.0).unwrap();
        let at = |k: u32| time * f64::from(k) / f64::from(steps);
        for k in 0..steps {
            plant.advance(at(k), at(k + 1), Vector3::zeros()).unwrap();
        }
        assert!((plant.angles().x - alpha).abs() < 1e-14, "{steps}: {}", plant.angles().x - alpha);
        assert!((plant.rates().y - rate).abs() < 1e-15, "{steps}: {}", plant.rates().y - rate);
    }
}

#[test]
fn communication_points_at_the_jumps_of_a_table_change_nothing() {
    let plant = || {
        disturbed(Disturbance {
            kind: DisturbanceKind::Table,
            table: table(),
            ..Disturbance::default()
        })
    };
    let [mut between, mut at_jumps] = [0, 1].map(|_| plant());
    let jumps = (0..4).flat_map(|repetition| {
        let begin = 0.5 + f64::from(repetition) * 0.9;
        [0.0, 0.113, 0.3141, 0.7].map(|time| begin + time)
    });
    let mut points: Vec<f64> = (1..=20).map(|k| 0.2 * f64::from(k)).chain(jumps).collect();
    points.sort_by(f64::total_cmp);
    points.dedup_by(|next, before| *next - *before < 1e-9);
    let mut from = 0.0;
    for k in 0..20 {
        let end = 0.2 * f64::from(k + 1);
        between.advance(0.2 * f64::from(k), end, moment(k)).unwrap();
        for &to in points.iter().filter(|&&point| point <= end) {
            if to > from {
                at_jumps.advance(from, to, moment(k)).unwrap();
                from = to;
            }
        }
        let difference = (between.state - at_jumps.state).amax();
        assert!(difference < 1e-13, "{difference} at {end} s");
    }
}

#[test]
fn state_dependent_disturbance_is_drawn_at_the_tick_and_held() {
    let mut config = config();
    config.disturbance.kind = DisturbanceKind::AgainstMoment;
    config.disturbance.period = 0.2;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    let push = Vector3::new(1e4, 1e4, 1e4);
    plant.advance(0.0, 0.04, push).unwrap();
    let held = plant.held().unwrap();
    plant.advance(0.04, 0.2, -push).unwrap();
    assert_eq!(plant.held().unwrap().delta(), held.delta());
    plant.advance(0.2, 0.24, -push).unwrap();
    assert_eq!(plant.held().unwrap().delta(), -held.delta());
}

#[test]
fn serialised_mid_run_it_goes_on_bit_for_bit() {
    for config in kinds() {
        let mut plant = Plant::new(&config, 0.0).unwrap();
        plant.advance(0.0, 0.5, moment(1)).unwrap();
        let text = toml::to_string(&plant).unwrap();
        let mut restored: Plant = toml::from_str(&text).unwrap();
        plant.advance(0.5, 1.5, moment(2)).unwrap();
        restored.advance(0.5, 1.5, moment(2)).unwrap();
        assert_eq!(plant, restored);
    }
}

#[test]
fn singular_attitude_and_wrong_input_stop_the_plant_with_a_reason() {
    // Without Ixz the yaw rate alone carries beta straight to 90°.
    let mut straight = undisturbed(Vector6::new(0.0, 1.5, 0.0, 0.0, 0.0, -0.5), 0.01);
    straight.inertia.Ixz = 0.0;
    let mut plant = Plant::new(&straight, 0.0).unwrap();
    let error = plant.advance(0.0, 2.0, Vector3::zeros()).unwrap_err();
    assert!(matches!(error, Error::Singular { .. }), "{error}");
    assert!(
        plant.state.iter().all(|value| value.is_finite())
            && plant.angles().y < std::f64::consts::FRAC_PI_2
    );

    let mut plant = Plant::new(&config(), 0.0).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        let error = plant.advance(0.0, 0.04, Vector3::repeat(bad)).unwrap_err();
        assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
        assert_eq!(plant.state, config().initial);
    }
}

#[test]
fn impossible_configurations_are_refused_by_name() {
    let change = |change: fn(&mut Config)| {
        let mut config = config();
        change(&mut config);
        Plant::new(&config, 0.0).unwrap_err().to_string()
    };
    for (message, name) in [
        (change(|c| c.inertia.Ixx = 0.0), "inertia.Ixx"),
        (change(|c| c.inertia.Iyy = f64::NAN), "inertia.Iyy"),
        (change(|c| c.inertia.Ixz = 1e6), "inertia.Ixz"),
        (change(|c| c.inertia.Izz = 3e6), "triangle"),
        (change(|c| c.inertia_scale = 0.0), "inertia.scale"),
        (change(|c| c.initial[1] = 1.6), "initial.beta"),
        (change(|c| c.initial[3] = f64::NAN), "initial"),
        (change(|c| c.step = 0.0), "integrator.step"),
        (change(|c| c.earth_rate = f64::NAN), "trajectory.earthRate"),
        (change(|c| c.disturbance.period = -1.0), "disturbance.period"),
    ] {
        assert!(message.contains(name), "{message}");
    }
}

proptest! {
    #[test]
    fn any_communication_points_lead_to_the_same_state(
        mut points in proptest::collection::vec(0.0..2.0, 0..40),
        kind in prop::sample::select(vec![DisturbanceKind::White, DisturbanceKind::Constant, DisturbanceKind::Sine, DisturbanceKind::Square, DisturbanceKind::Table]),
    ) {
        let mut config = kinds().find(|config| config.disturbance.kind == kind).unwrap();
        config.disturbance.end = 1.5;
        let [mut whole, mut parts] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
        let push = |t: f64| Vector3::new(2e4 * t.sin(), -1e4, 1e4 * t).into();
        whole.advance_with(0.0, 2.0, &Command::default(), push).unwrap();
        points.push(2.0);
        points.sort_by(f64::total_cmp);
        let mut from = 0.0;
        for to in points {
            parts.advance_with(from, to, &Command::default(), push).unwrap();
            from = to;
        }
        prop_assert!((whole.state - parts.state).amax() < 1e-11, "{}", whole.state - parts.state);
    }

    #[test]
    fn oracle_partial_derivatives_against_differences(
        values in proptest::array::uniform6(-1.0..1.0),
        pushes in proptest::array::uniform3(-1e5..1e5),
        deltas in proptest::array::uniform3(-0.04..0.04),
        turns in proptest::array::uniform3(-0.1..0.1),
    ) {
        let body = *Plant::new(&config(), 0.0).unwrap().body();
        let state = State::from(values);
        let load = Load {
            moment: Vector3::from(pushes),
            delta: Vector3::from(deltas),
            turn_rate: Vector3::from(turns),
        };
        for kinematics in [Kinematics::Printed, Kinematics::Exact] {
            let Partials { by_state, by_moment, by_turn_rate } =
                partial_derivatives(&body, kinematics, &state, &load);
            let f = |state: &State, load: &Load| derivative(&body, kinematics, state, load);
            for i in 0..6 {
                let h = State::from_fn(|j, _| if i == j { 1e-5 } else { 0.0 });
                let numeric = (f(&(state + h), &load) - f(&(state - h), &load)) / 2e-5;
                prop_assert!((numeric - by_state.column(i)).amax() < 1e-7, "state {}: {}", i, numeric - by_state.column(i));
            }
            for i in 0..3 {
                let h = Vector3::from_fn(|j, _| if i == j { 1e4 } else { 0.0 });
                let pushed = |by: f64| f(&state, &Load { moment: load.moment + h * by, ..load });
                let numeric = (pushed(1.0) - pushed(-1.0)) / 2e4;
                prop_assert!((numeric - by_moment.column(i)).amax() < 1e-16);
                let turned = |by: f64| f(&state, &Load { turn_rate: load.turn_rate + h * by, ..load });
                let numeric = (turned(1e-5) - turned(-1e-5)) / 0.2;
                prop_assert!((numeric - by_turn_rate.column(i)).amax() < 1e-12);
            }
        }
    }
}

#[test]
fn oracle_a_steady_climb_over_a_still_earth_shows_in_alpha_alone() {
    // In level flight to the north without bank and sideslip, α̇ = q − γ̇, so a positive γ̇ lowers
    // the angle of attack.
    let mut plant =
        Plant::new(&undisturbed(State::new(0.3, 0.0, 0.0, 0.0, 0.0, 0.0), 0.01), 0.0).unwrap();
    let climb = Trajectory { flight_path_angle_rate: 0.02, ..Trajectory::default() };
    plant
        .advance_with(0.0, 5.0, &Command::default(), |_| Input {
            trajectory: climb,
            ..Input::default()
        })
        .unwrap();
    assert!(
        (plant.state - State::new(0.2, 0.0, 0.0, 0.0, 0.0, 0.0)).amax() < 1e-14,
        "{}",
        plant.state
    );
}

#[test]
fn a_trajectory_at_rest_changes_no_bit() {
    let still = Trajectory {
        flight_path_angle: -0.1,
        heading: 0.7,
        latitude: 0.5,
        ..Trajectory::default()
    };
    let [mut plain, mut along] = [0, 1].map(|_| Plant::new(&config(), 0.0).unwrap());
    for k in 0..20 {
        let (from, to) = (0.2 * f64::from(k), 0.2 * f64::from(k + 1));
        plain.advance(from, to, moment(k)).unwrap();
        along
            .advance_with(from, to, &Command::default(), |_| Input {
                trajectory: still,
                ..moment(k).into()
            })
            .unwrap();
    }
    assert_eq!(plain, along);
}

#[test]
fn oracle_the_bank_angles_differ_by_the_integral_of_alpha_rate_times_sin_beta() {
    let end = |kinematics| {
        let config =
            Config { kinematics, ..undisturbed(State::new(0.1, 0.2, 0.3, 0.0, 0.02, 0.0), 0.01) };
        let mut plant = Plant::new(&config, 0.0).unwrap();
        plant.advance(0.0, 1.0, Vector3::zeros()).unwrap();
        plant.angles()
    };
    let difference = end(Kinematics::Exact) - end(Kinematics::Printed);
    // The torque-free rates are equal, and α, β do not depend on σ; σ differs by the integral of α̇
    // sin β.
    assert_eq!((difference.x, difference.y), (0.0, 0.0));
    assert!((difference.z - 0.02 * 0.2f64.sin()).abs() < 1e-4, "{}", difference.z);
}

/// Configuration of the undisturbed vehicle with actuators at the published flight condition.
fn actuated(initial: State, jet_mode: JetMode) -> Config {
    let dynamic_pressure = Effectors::published().reference_pressure;
    let actuators = actuators::Config {
        effectors: Effectors::published(),
        jet_mode,
        dynamic_pressure,
        aerodynamics_scale: 1.0,
    };
    Config { actuators: Some(actuators), ..undisturbed(initial, 0.05) }
}

fn flaps(deflection_deg: f64) -> Command {
    let mut command = Command::default();
    command.surfaces[4] = deflection_deg.to_radians();
    command.surfaces[5] = deflection_deg.to_radians();
    command
}

#[test]
fn oracle_flaps_turn_the_nose_at_their_rate_and_then_stay() {
    // At beta = 0 both flaps give a pure pitching moment: M = -2 · 5100 N m/deg · 10 deg/s · t up
    // to -2 deg at 0.2 s, then constant.
    let config = actuated(State::new(0.1, 0.0, 0.2, 0.0, 0.0, 0.0), JetMode::OnOff);
    let inertia = config.inertia.Iyy * config.inertia_scale;
    let mut plant = Plant::new(&config, 0.0).unwrap();
    plant.advance_with(0.0, 1.0, &flaps(-2.0), |_| Input::default()).unwrap();
    let (slope, full) = (2.0 * 5100.0 * 10.0 / inertia, 2.0 * 5100.0 * 2.0 / inertia);
    let q = slope * 0.2 * 0.2 / 2.0 + full * 0.8;
    let alpha = 0.1 + slope * 0.2f64.powi(3) / 6.0 + slope * 0.02 * 0.8 + full * 0.8 * 0.8 / 2.0;
    assert!((plant.rates() - Vector3::new(0.0, q, 0.0)).amax() < 1e-16, "{}", plant.rates().y - q);
    assert!((plant.angles().x - alpha).abs() < 1e-15, "{}", plant.angles().x - alpha);
    assert_eq!(plant.deflections, flaps(-2.0).surfaces);
}

#[test]
fn with_actuators_the_input_moment_does_not_act_and_without_them_commands_do_not() {
    let start = State::new(0.1, 0.05, 0.2, 0.01, 0.02, -0.01);
    let moment = Vector3::new(1e4, -2e4, 3e4);
    let end = |config: &Config, (moment, command): (Vector3<f64>, Command)| {
        let mut plant = Plant::new(config, 0.0).unwrap();
        plant.advance_with(0.0, 1.0, &command, |_| moment.into()).unwrap();
        plant.state
    };
    let mut command = flaps(5.0);
    command.jets[0] = 1.0;
    let [with, without] = [actuated(start, JetMode::OnOff), undisturbed(start, 0.05)];
    let (neither, both) = ((Vector3::zeros(), Command::default()), (moment, command));
    assert_eq!(end(&with, both), end(&with, (neither.0, command)));
    assert_eq!(end(&without, both), end(&without, (moment, neither.1)));
    assert_ne!(end(&with, both), end(&with, neither));
    assert_ne!(end(&without, both), end(&without, neither));
}

#[test]
fn one_long_step_equals_short_ones_with_actuators() {
    let start = State::new(0.1, 0.05, 0.2, 0.01, 0.02, -0.01);
    for jet_mode in [JetMode::OnOff, JetMode::Duty] {
        let config = Config { step: 1e-3, ..actuated(start, jet_mode) };
        let mut command = flaps(6.0);
        command.surfaces[0] = -0.05;
        (command.jets[2], command.jets[5]) = (0.7, 0.3);
        let input = Input::default();
        let [mut long, mut short] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
        long.advance_with(0.0, 2.0, &command, |_| input).unwrap();
        for k in 0..50 {
            short
                .advance_with(0.04 * f64::from(k), 0.04 * f64::from(k + 1), &command, |_| input)
                .unwrap();
        }
        assert!(
            (long.state - short.state).amax() < 1e-13,
            "{jet_mode:?}: {}",
            long.state - short.state
        );
    }
}

#[test]
fn a_command_that_is_no_number_is_an_error() {
    let mut plant = Plant::new(&actuated(State::zeros(), JetMode::OnOff), 0.0).unwrap();
    let refusal = plant
        .advance_with(0.0, 1.0, &flaps(f64::NAN), |_| Input::default())
        .unwrap_err()
        .to_string();
    assert!(refusal.contains("command"), "{refusal}");
    assert_eq!(plant.state, State::zeros());
}

#[test]
fn noise_does_not_depend_on_actuators() {
    let disturbance = config().disturbance;
    let [with, without] = [true, false].map(|with| {
        let config =
            Config { disturbance: disturbance.clone(), ..actuated(State::zeros(), JetMode::OnOff) };
        let config = if with { config } else { Config { actuators: None, ..config } };
        let mut plant = Plant::new(&config, 0.0).unwrap();
        plant.advance_with(0.0, 0.1, &flaps(0.15), |_| Input::default()).unwrap();
        plant.held().unwrap().delta()
    });
    assert_eq!(with, without);
    assert!(with.amax() > 0.0);
}

#[test]
fn oracle_a_delayed_moment_acts_that_much_later() {
    // The comparison plant gets the same moments without delay, in steps that begin where they
    // arrive.
    for delay in [1e-3, 0.04, 0.1, 0.117, 0.12, 1.0] {
        for config in kinds() {
            let mut delayed =
                Plant::new(&Config { moment_delay: delay, ..config.clone() }, 0.0).unwrap();
            let mut direct = Plant::new(&config, 0.0).unwrap();
            let (mut reached, mut arrived) = (0.0, 0);
            let acting =
                |arrived: u32| if arrived == 0 { Vector3::zeros() } else { moment(arrived - 1) };
            for k in 0..100 {
                let to = 0.04 * f64::from(k + 1);
                delayed.advance(0.04 * f64::from(k), to, moment(k)).unwrap();
                while 0.04 * f64::from(arrived) + delay < to + 1e-9 {
                    let arrival = 0.04 * f64::from(arrived) + delay;
                    direct.advance(reached, arrival, acting(arrived)).unwrap();
                    (reached, arrived) = (arrival, arrived + 1);
                }
                direct.advance(reached, to, acting(arrived)).unwrap();
                reached = reached.max(to);
                let kind = config.disturbance.kind;
                assert!((delayed.state - direct.state).amax() < 1e-11, "{delay} s, {kind:?}, {k}");
                let input = moment(k + 1).into();
                let held = delayed.in_force(to, &input, &Command::default());
                assert_eq!(
                    delayed.applied_moment(&input, &held),
                    acting(arrived),
                    "{delay} s, {kind:?}, {k}"
                );
            }
        }
    }
}

#[test]
fn a_delayed_moment_arrives_within_a_step_however_long() {
    let config = Config { moment_delay: 0.117, ..undisturbed(TUMBLING.into(), 0.001) };
    let [mut long, mut short] = [0, 1].map(|_| Plant::new(&config, 0.0).unwrap());
    for k in 0..4 {
        long.advance(f64::from(k), f64::from(k + 1), moment(k)).unwrap();
        for i in 0..100 {
            let at = |i: i32| f64::from(k) + 0.01 * f64::from(i);
            short.advance(at(i), at(i + 1), moment(k)).unwrap();
        }
        assert!((long.state - short.state).amax() < 1e-13, "{k}: {}", long.state - short.state);
    }
}

#[test]
fn a_delay_that_cannot_work_is_refused_by_name() {
    for moment_delay in [-0.1, 1.1, f64::NAN] {
        let text = Plant::new(&Config { moment_delay, ..config() }, 0.0).unwrap_err().to_string();
        assert!(text.contains("actuation.delay"), "{text}");
    }
    let with_actuators = Config { moment_delay: 0.1, ..actuated(State::zeros(), JetMode::OnOff) };
    let text = Plant::new(&with_actuators, 0.0).unwrap_err().to_string();
    assert!(text.contains("actuation.delay") && text.contains("actuators"), "{text}");
    let mut plant = Plant::new(&Config { moment_delay: 0.1, ..config() }, 0.0).unwrap();
    let profiles: [fn(f64) -> f64; 2] = [|t| t, |t| t * (t - 0.04)];
    for profile in profiles {
        let input = |time: f64| Vector3::new(0.0, 1e4 * profile(time), 0.0).into();
        let text =
            plant.advance_with(0.0, 0.04, &Command::default(), input).unwrap_err().to_string();
        assert!(text.contains("actuation.delay") && text.contains("derivatives"), "{text}");
    }
    let error = plant.advance(0.0, 0.04, Vector3::repeat(f64::NAN)).unwrap_err();
    assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
}

#[test]
fn oracle_a_converted_moment_acts_as_the_rounded_one_does() {
    let step = 700.0;
    let converted_config = Config { moment_resolution: step, ..config() };
    let delayed_config = Config { moment_delay: 0.05, ..config() };
    let delayed_converted_config = Config { moment_delay: 0.05, ..converted_config.clone() };
    for (with, without) in
        [(converted_config, config()), (delayed_converted_config, delayed_config)]
    {
        let [mut converted, mut rounded] =
            [&with, &without].map(|config| Plant::new(config, 0.0).unwrap());
        for k in 0..50 {
            let (from, to) = (0.04 * f64::from(k), 0.04 * f64::from(k + 1));
            converted.advance(from, to, moment(k)).unwrap();
            rounded.advance(from, to, (moment(k) / step).map(f64::round) * step).unwrap();
            assert_eq!(converted.state, rounded.state, "{k}");
        }
        let held = converted.in_force(2.0, &moment(50).into(), &Command::default());
        let applied = converted.applied_moment(&moment(50).into(), &held) / step;
        assert!((applied - applied.map(f64::round)).amax() < 1e-12 && applied.amax() > 1.0);
    }
}

#[test]
fn a_converter_that_cannot_work_is_refused_by_name() {
    for moment_resolution in [-1.0, f64::NAN] {
        let text =
            Plant::new(&Config { moment_resolution, ..config() }, 0.0).unwrap_err().to_string();
        assert!(text.contains("actuation.resolution"), "{text}");
    }
    let with_actuators =
        Config { moment_resolution: 1.0, ..actuated(State::zeros(), JetMode::OnOff) };
    let text = Plant::new(&with_actuators, 0.0).unwrap_err().to_string();
    assert!(text.contains("actuation.resolution") && text.contains("actuators"), "{text}");
    let mut plant = Plant::new(&Config { moment_resolution: 1.0, ..config() }, 0.0).unwrap();
    let ramp = |time: f64| Vector3::new(0.0, 1e4 * time, 0.0).into();
    let text = plant.advance_with(0.0, 0.04, &Command::default(), ramp).unwrap_err().to_string();
    assert!(text.contains("actuation.resolution") && text.contains("derivatives"), "{text}");
    let error = plant.advance(0.0, 0.04, Vector3::repeat(f64::NAN)).unwrap_err();
    assert!(matches!(error, Error::NotFinite { what: "moment", .. }), "{error}");
}

/// A plant whose sensors stand on a slow turntable.
fn on_a_turntable() -> Config {
    let data = SensorData::embedded();
    Config {
        sensors: Some(sensors::Config { triads: data.ideal, line: data.line, seed: 1 }),
        surroundings: data.surroundings,
        turntable: turntable::Config { bandwidth: 2.0, rate: 0.05, resolution: 1e-3 },
        ..config()
    }
}

#[test]
fn samples_on_a_turntable_do_not_depend_on_the_communication_step() {
    let [mut long, mut short] = [0, 1].map(|_| Plant::new(&on_a_turntable(), 0.0).unwrap());
    let mut on_the_vehicle =
        Plant::new(&Config { turntable: turntable::Config::default(), ..on_a_turntable() }, 0.0)
            .unwrap();
    for k in 0..25 {
        let time = 0.04 * f64::from(k);
        for plant in [&mut long, &mut on_the_vehicle] {
            plant.advance(time, time + 0.04, moment(k)).unwrap();
        }
        for i in 0..8 {
            let from = time + 0.005 * f64::from(i);
            short.advance(from, from + 0.005, moment(k)).unwrap();
        }
        let input = moment(k).into();
        let [at_long, at_short, at_vehicle] =
            [&long, &short, &on_the_vehicle].map(|plant| plant.measured(time + 0.04, &input));
        assert_eq!(at_long.number, at_short.number);
        for i in 0..3 {
            let scale = at_long.readings[i].amax();
            assert!((at_long.readings[i] - at_short.readings[i]).amax() <= 1e-9 * scale, "{k} {i}");
        }
        assert_ne!(at_long.readings, at_vehicle.readings, "{k}");
    }
}

#[test]
fn a_turntable_needs_sampled_sensors() {
    let config = Config { sensors: None, ..on_a_turntable() };
    let text = Plant::new(&config, 0.0).unwrap_err().to_string();
    assert!(text.contains("turntable.bandwidth = 2 Hz"), "{text}");
}
