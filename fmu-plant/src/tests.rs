//! Tests of the unit through the interface that the shell uses.

mod sensors;

use crate::parameters::{Actuation, KINDS};
use crate::plant::{Output, ReentryPlant};
use crate::roles::{Known, Unknown};
use crate::table::role;
use fmi2_export::{Context, Failure, Inputs, LastEvent, Model, describe};
use model_description::variable::{self, Causality, Variability};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::disturbance::{DisturbanceKind, Row};
use vehicle::effectors::{Jets, Surfaces};
use vehicle::kinematics::{Kinematics, Trajectory};

const CONTEXT: Context = Context { start_time: 0.0, stop_time: None, resources: None };

/// Inputs for which the importer gave no derivatives.
struct Constant;

impl Inputs<ReentryPlant> for Constant {
    fn advance(&self, _: &mut ReentryPlant, _: f64) {}
    fn are_extrapolated(&self) -> bool {
        false
    }
}

/// Pitch moment that rises with time.
struct Ramp(f64);

impl Inputs<ReentryPlant> for Ramp {
    fn advance(&self, model: &mut ReentryPlant, time: f64) {
        model.input.moment.y = self.0 * time;
    }
    fn are_extrapolated(&self) -> bool {
        true
    }
}

fn started(set: impl Fn(&mut ReentryPlant)) -> ReentryPlant {
    let mut unit = ReentryPlant::new();
    set(&mut unit);
    unit.initialize(&CONTEXT).unwrap();
    unit
}

fn step(unit: &mut ReentryPlant, from: f64, to: f64) -> Result<(), Failure> {
    unit.step(from, to, &Constant, &mut |_| {})
}

fn outputs(unit: &mut ReentryPlant, time: f64) -> Output {
    unit.calculate(time, LastEvent::InputSet).unwrap();
    unit.output
}

/// Position of the first sensor reading in the table.
const MEASURED: usize = 113;

/// Calculated variables with their positions in the table.
fn calculated(unit: &mut ReentryPlant, time: f64) -> Vec<(usize, f64)> {
    let o = outputs(unit, time);
    let all = [
        o.angles,
        o.rates,
        o.angle_rates,
        o.angular_acceleration,
        o.applied_moment,
        o.delta,
        o.disturbance_moment,
    ];
    let rest = o.deflections.iter().copied().chain([o.dynamic_pressure]);
    let last = o.deflection_rates.iter().copied();
    let readings = o.measured.readings;
    let measured = readings.iter().flatten().copied().chain([o.measured.time]);
    let groups = (0..21)
        .zip(all.iter().flatten().copied())
        .chain((27..36).zip(rest))
        .chain((54..62).zip(last));
    groups.chain((MEASURED..).zip(measured)).collect()
}

#[test]
fn positions_and_names_agree() {
    let names: Vec<String> =
        describe::<ReentryPlant>().variables.into_iter().map(|variable| variable.name).collect();
    for (position, name) in names.iter().enumerate() {
        let group = name.split(['.', '[']).next().unwrap();
        let unknown = match role(position).unknown {
            Some(Unknown::State(0..3)) => "attitude",
            Some(Unknown::State(3..6)) => "rate",
            Some(Unknown::State(_)) => "deflection",
            Some(Unknown::Derivative(0..3)) => "attitudeRate",
            Some(Unknown::Derivative(3..6)) => "angularAcceleration",
            Some(Unknown::Derivative(_)) => "deflectionRate",
            Some(Unknown::AppliedMoment(_)) => "appliedMoment",
            Some(Unknown::Delta | Unknown::DisturbanceMoment(_)) => "disturbance",
            Some(Unknown::DynamicPressure) => "flight",
            Some(Unknown::Measured(_) | Unknown::MeasuredTime) => "measured",
            None => match role(position).known {
                Some(Known::Moment(_)) => "moment",
                Some(Known::DisturbanceMoment(_)) => "disturbanceMoment",
                Some(Known::Surface(_)) => "surface",
                Some(Known::Jet(_)) => "jet",
                Some(Known::Trajectory(_)) => "trajectory",
                _ => continue,
            },
        };
        assert_eq!(group, unknown, "{name} at {position}");
    }
    assert_eq!(
        names[0..6],
        ["attitude.alpha", "attitude.beta", "attitude.sigma", "rate.p", "rate.q", "rate.r"]
    );
    assert_eq!((names[22].as_str(), names[25].as_str()), ("moment.y", "disturbanceMoment.y"));
    assert_eq!((names[27].as_str(), names[34].as_str()), ("deflection[1]", "deflection[8]"));
    assert_eq!((names[36].as_str(), names[43].as_str()), ("surface[1]", "surface[8]"));
    assert_eq!((names[44].as_str(), names[53].as_str()), ("jet[1]", "jet[10]"));
    assert_eq!(
        (names[54].as_str(), names[61].as_str()),
        ("deflectionRate[1]", "deflectionRate[8]")
    );
    assert_eq!(
        (names[62].as_str(), names[68].as_str()),
        ("trajectory.flightPathAngle", "trajectory.latitudeRate")
    );
    assert_eq!(
        names[MEASURED..MEASURED + 11].iter().map(String::as_str).collect::<Vec<_>>(),
        [
            "measured.gyroscope.x",
            "measured.gyroscope.y",
            "measured.gyroscope.z",
            "measured.accelerometer.x",
            "measured.accelerometer.y",
            "measured.accelerometer.z",
            "measured.magnetometer.x",
            "measured.magnetometer.y",
            "measured.magnetometer.z",
            "measured.time",
            "measured.sample",
        ]
    );
    assert_eq!(role(MEASURED).unknown, Some(Unknown::Measured(0)));
    assert_eq!(role(MEASURED + 9).unknown, Some(Unknown::MeasuredTime));
    assert_eq!(role(MEASURED + 10).unknown, None, "an integer");
}

#[test]
fn the_description_holds() {
    let description = describe::<ReentryPlant>();
    description.check().unwrap();
    let motion = (0..6).map(|i| (i, i + 6));
    let deflections = (27..35).map(|i| (i, i + 27));
    assert_eq!(description.states(), motion.chain(deflections).collect::<Vec<_>>());
    assert_eq!(description.event_indicators, 8);
    for variable in
        description.variables.iter().filter(|variable| variable.causality == Causality::Input)
    {
        let discrete = ["surface[", "jet["].iter().any(|name| variable.name.starts_with(name));
        let expected = if discrete { Variability::Discrete } else { Variability::Continuous };
        assert_eq!(variable.variability, expected, "{}", variable.name);
    }
    let scenario = Scenario::crmpc2022();
    let start = |name: &str| match &description.variables[description.position(name).unwrap()].kind
    {
        variable::Kind::Real { start, .. } => start.unwrap(),
        variable::Kind::Integer { start, .. } | variable::Kind::Enumeration { start, .. } => {
            f64::from(start.unwrap())
        }
        _ => f64::NAN,
    };
    for (name, value) in [
        ("inertia.Ixx", scenario.inertia.Ixx),
        ("inertia.Ixz", scenario.inertia.Ixz),
        ("inertia.scale", scenario.inertia_scale),
        ("initial.beta", scenario.initial_angles.y),
        ("disturbance.bound", scenario.disturbance.bound),
        ("disturbance.period", scenario.disturbance.period),
        ("disturbance.kind", 2.0),
        ("moment.x", 0.0),
        ("integrator.step", 0.01),
        ("actuation", 1.0),
        ("kinematics", 1.0),
        ("trajectory.earthRate", 0.0),
        ("trajectory.latitude", 0.0),
        ("flight.altitude", 55e3),
        ("flight.mach", 9.8),
        ("aerodynamics.scale", 1.0),
    ] {
        assert_eq!(start(name), value, "{name}");
    }
    let described =
        |text: &str| text.len() > 8 && text.starts_with(|c: char| c.is_ascii_uppercase());
    for variable in &description.variables {
        assert!(described(&variable.description), "{}: {}", variable.name, variable.description);
    }
}

/// A general attitude with general rates, and surfaces slightly away from zero.
const STATES: [f64; 14] =
    [0.3, 0.2, -0.5, 0.08, -0.05, 0.06, -0.01, -0.02, -0.01, -0.01, 0.01, -0.01, 0.01, 0.01];

/// Iterates over all kinds of disturbance.
fn all_kinds() -> impl Iterator<Item = DisturbanceKind> {
    KINDS.items.iter().map(|(kind, ..)| *kind)
}

/// Returns a unit in model exchange after the first event, in a general attitude, with a
/// disturbance of this kind.
fn in_model_exchange(kind: DisturbanceKind) -> ReentryPlant {
    let mut unit = started(|unit| unit.parameters.kind = kind);
    unit.input.moment = Vector3::new(3e4, -2e4, 1e4);
    unit.input.disturbance_moment = Vector3::new(1e3, 2e3, -3e3);
    unit.set_continuous_states(&STATES);
    unit.new_discrete_states(0.0).unwrap();
    unit
}

/// Selects surfaces and jets as the source of the control moment.
fn actuate(unit: &mut ReentryPlant) {
    unit.parameters.actuation = Actuation::SurfacesAndJets;
    unit.command.surfaces = Surfaces::from([-5.0, -2.0, -1.0, -4.0, 3.0, -6.0, 1.0, 2.0]) * 0.02;
    unit.command.jets = Jets::repeat(0.5);
}

/// Returns a unit with actuators in model exchange; its jets take a duty cycle or switch.
fn actuated_in_model_exchange(duty: bool) -> ReentryPlant {
    let mut unit = in_model_exchange(DisturbanceKind::None);
    unit.parameters.jet_duty = duty;
    actuate(&mut unit);
    unit.initialize(&CONTEXT).unwrap();
    unit.set_continuous_states(&STATES);
    unit.new_discrete_states(0.0).unwrap();
    unit
}

/// Returns a unit in model exchange on a trajectory that turns in every way.
fn along_a_trajectory(kind: DisturbanceKind, kinematics: Kinematics) -> ReentryPlant {
    let mut unit = in_model_exchange(kind);
    unit.parameters.kinematics = kinematics;
    unit.parameters.earth_rate = 7.2921e-5;
    unit.initialize(&CONTEXT).unwrap();
    unit.set_continuous_states(&STATES);
    unit.input.trajectory = Trajectory {
        flight_path_angle: -0.1,
        heading: 0.8,
        latitude: 0.4,
        flight_path_angle_rate: 0.01,
        heading_rate: -0.02,
        longitude_rate: 0.03,
        latitude_rate: 0.01,
    };
    unit.new_discrete_states(0.0).unwrap();
    unit
}

/// Returns a unit in co-simulation at a communication point, with jets that take a duty cycle.
fn at_a_communication_point() -> ReentryPlant {
    let mut unit = started(|unit| {
        unit.parameters.kind = DisturbanceKind::None;
        unit.parameters.jet_duty = true;
        actuate(unit);
    });
    unit.set_continuous_states(&STATES);
    unit
}

/// Returns a unit in co-simulation on which a moment commanded earlier acts.
fn under_a_delayed_moment() -> ReentryPlant {
    let mut unit = delayed(0.01);
    unit.input.moment = Vector3::new(3e4, -2e4, 1e4);
    step(&mut unit, 0.0, 0.02).unwrap();
    unit
}

fn known_positions() -> impl Iterator<Item = usize> {
    (0..69).filter(|&position| role(position).known.is_some())
}

/// Adds a number to the state or input at a position in the table.
fn nudge(unit: &mut ReentryPlant, known: usize, by: f64) {
    match role(known).known.unwrap() {
        Known::State(i) => {
            let mut states = [0.0; 14];
            unit.continuous_states(&mut states);
            states[i] += by;
            unit.set_continuous_states(&states);
        }
        Known::Moment(i) => unit.input.moment[i] += by,
        Known::DisturbanceMoment(i) => unit.input.disturbance_moment[i] += by,
        Known::Surface(i) => unit.command.surfaces[i] += by,
        Known::Jet(j) => unit.command.jets[j] += by,
        Known::Trajectory(i) => {
            let t = &mut unit.input.trajectory;
            *[
                &mut t.flight_path_angle,
                &mut t.heading,
                &mut t.latitude,
                &mut t.flight_path_angle_rate,
                &mut t.heading_rate,
                &mut t.longitude_rate,
                &mut t.latitude_rate,
            ][i] += by;
        }
    }
}

#[test]
fn oracle_partial_derivatives_against_differences_and_declared_dependencies() {
    let description = describe::<ReentryPlant>();
    let units = all_kinds()
        .map(in_model_exchange)
        .chain([false, true].map(actuated_in_model_exchange))
        .chain([
            along_a_trajectory(DisturbanceKind::None, Kinematics::Printed),
            along_a_trajectory(DisturbanceKind::Constant, Kinematics::Exact),
            along_a_trajectory(DisturbanceKind::AgainstMoment, Kinematics::Exact),
        ])
        .chain([at_a_communication_point(), under_a_delayed_moment()]);
    for (case, mut unit) in units.enumerate() {
        for known in known_positions() {
            let by = match known {
                21..27 => 1e3,
                36..44 => 1e-3,
                44..54 => 0.1,
                _ => 1e-5,
            };
            nudge(&mut unit, known, by);
            let above = calculated(&mut unit, 0.02);
            nudge(&mut unit, known, -2.0 * by);
            let below = calculated(&mut unit, 0.02);
            nudge(&mut unit, known, by);
            let known_name = &description.variables[known].name;
            for ((unknown, above), (_, below)) in above.iter().zip(&below) {
                let exact = unit.partial_derivative(0.02, *unknown, known).unwrap();
                let numeric = (above - below) / (2.0 * by);
                let variable = &description.variables[*unknown];
                assert!(
                    (numeric - exact).abs() < 1e-9 * exact.abs().max(1.0),
                    "{case}: {} by {known_name}: {exact}, not {numeric}",
                    variable.name
                );
                if exact != 0.0 && *unknown != known {
                    assert!(
                        variable.dependencies.contains(known_name),
                        "{} depends on {known_name}",
                        variable.name
                    );
                }
            }
        }
    }
    let mut duty = at_a_communication_point();
    assert!((duty.partial_derivative(0.0, 14, 44).unwrap() - 19897.0).abs() < 1e-9, "yaw by jet 1");
    let mut exact = along_a_trajectory(DisturbanceKind::None, Kinematics::Exact);
    assert!(exact.partial_derivative(0.0, 8, 63).unwrap() != 0.0, "bank rate by heading");
    assert!(
        (exact.partial_derivative(0.0, 6, 65).unwrap() + 0.5f64.cos() / 0.2f64.cos()).abs() < 1e-15
    );
}

#[test]
fn derivatives_by_parameters_are_refused() {
    let mut unit = in_model_exchange(DisturbanceKind::None);
    for (unknown, known) in [(6, 69), (6, 6), (6, 35), (69, 0), (21, 21), (36, 36), (62, 62)] {
        assert!(unit.partial_derivative(0.0, unknown, known).is_err(), "{unknown} by {known}");
    }
}

#[test]
fn outputs_are_right_from_initialization_on() {
    let mut unit = started(|_| {});
    let scenario = Scenario::crmpc2022();
    let output = outputs(&mut unit, 0.0);
    assert_eq!((output.angles, output.rates), (scenario.initial_angles, scenario.initial_rates));
    assert!(output.delta.amax() > 0.0 && output.delta.amax() <= scenario.disturbance.bound);
    // At rest ω̇ = R⁻¹ Δ holds.
    let expected = vehicle::kinematics::r_inverse(&output.angles) * output.delta;
    assert!((output.angular_acceleration - expected).amax() < 1e-15);
}

#[test]
fn at_a_tick_the_outputs_show_the_disturbance_of_the_step_to_come() {
    for kind in [DisturbanceKind::White, DisturbanceKind::AlongRate, DisturbanceKind::AgainstMoment]
    {
        let mut unit = started(|unit| unit.parameters.kind = kind);
        unit.input.moment = Vector3::new(1e4, -1e4, 1e4);
        step(&mut unit, 0.0, 0.04).unwrap();
        unit.input.moment *= -1.0;
        let announced = outputs(&mut unit, 0.04).delta;
        step(&mut unit, 0.04, 0.08 - 1e-6).unwrap();
        assert_eq!(outputs(&mut unit, 0.08 - 1e-6).delta, announced, "kind {kind:?}");
    }
}

#[test]
fn looking_changes_nothing() {
    let [mut looked_at, mut left_alone] =
        [0, 1].map(|_| started(|unit| unit.parameters.kind = DisturbanceKind::AgainstMoment));
    for k in 0..50 {
        let [from, to] = [0.04 * f64::from(k), 0.04 * f64::from(k + 1)];
        looked_at.input.moment = Vector3::repeat(-1e4);
        outputs(&mut looked_at, from);
        let moment = Vector3::new(1e4 * from.sin(), 0.0, 1e4);
        looked_at.input.moment = moment;
        left_alone.input.moment = moment;
        step(&mut looked_at, from, to).unwrap();
        step(&mut left_alone, from, to).unwrap();
    }
    assert_eq!(outputs(&mut looked_at, 2.0), outputs(&mut left_alone, 2.0));
}

type States = nalgebra::SVector<f64, 14>;

fn states(unit: &ReentryPlant) -> States {
    let mut states = States::zeros();
    unit.continuous_states(states.as_mut_slice());
    states
}

fn indicators(unit: &mut ReentryPlant, time: f64) -> [f64; 8] {
    unit.calculate(time, LastEvent::InputSet).unwrap();
    let mut indicators = [f64::NAN; 8];
    unit.event_indicators(&mut indicators);
    indicators
}

/// Integrates accurately to `end`, or to the state event before it, which is located by bisection.
/// Returns the time reached.
fn integrate(unit: &mut ReentryPlant, begin: f64, end: f64) -> f64 {
    let crossed = |unit: &mut ReentryPlant, time| indicators(unit, time).iter().any(|z| *z <= 0.0);
    assert!(!crossed(unit, begin), "an event is due at {begin} s");
    let steps = vehicle::integrator::equal_steps(end - begin, 0.001);
    let h = (end - begin) / steps as f64;
    for i in 0..steps {
        let (time, y) = (begin + i as f64 * h, states(unit));
        let advance = |unit: &mut ReentryPlant, h: f64| {
            let mut f = |t: f64, y: &States| {
                unit.set_continuous_states(y.as_slice());
                let o = outputs(unit, t);
                let motion = o.angle_rates.iter().chain(o.angular_acceleration.iter());
                States::from_iterator(motion.chain(o.deflection_rates.iter()).copied())
            };
            let y = vehicle::integrator::rk4(&mut f, time, &y, h);
            unit.set_continuous_states(y.as_slice());
            crossed(unit, time + h)
        };
        if advance(unit, h) {
            let (mut before, mut after) = (0.0, h);
            while after - before > 1e-15 {
                let middle = 0.5 * (before + after);
                if advance(unit, middle) { after = middle } else { before = middle }
            }
            advance(unit, after);
            return time + after;
        }
    }
    end
}

/// Runs model exchange to `end` and returns the times of the events.
fn exchange(unit: &mut ReentryPlant, begin: f64, end: f64) -> Vec<f64> {
    let mut times = vec![begin];
    loop {
        let time = times[times.len() - 1];
        let next = unit.new_discrete_states(time).unwrap().next_event_time.unwrap_or(end).min(end);
        let reached = integrate(unit, time, next);
        if reached >= end {
            return times;
        }
        times.push(reached);
    }
}

fn assert_same_motion(cs: &Output, me: &Output, case: &str) {
    assert!((cs.angles - me.angles).amax() < 1e-11, "{case}: {}", cs.angles - me.angles);
    assert!((cs.rates - me.rates).amax() < 1e-11, "{case}: {}", cs.rates - me.rates);
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation() {
    for kind in all_kinds() {
        let set = |unit: &mut ReentryPlant| {
            unit.parameters.kind = kind;
            unit.parameters.start = 0.3;
            unit.parameters.end = 1.7;
            unit.parameters.square_period = 0.9;
            tabulate(unit, 0.9, &TABLE);
            unit.input.moment = Vector3::new(2e4, -1e4, 1e4);
        };
        let [mut cs, mut me] = [0, 1].map(|_| started(set));
        for k in 0..50 {
            step(&mut cs, 0.04 * f64::from(k), 0.04 * f64::from(k + 1)).unwrap();
        }
        let events = exchange(&mut me, 0.0, 2.0);
        assert_same_motion(
            &outputs(&mut cs, 2.0),
            &outputs(&mut me, 2.0),
            &format!("kind {kind:?}"),
        );
        let expected = [1, 38, 3, 3, 6, 38, 38, 9][kind as usize];
        assert_eq!(events.len(), expected, "kind {kind:?}");
    }
}

/// Rows of a table: times (s) and directions.
const TABLE: [(f64, [f64; 3]); 3] =
    [(0.05, [1.0, 0.0, -1.0]), (0.33, [-0.5, 1.0, 0.0]), (0.61, [0.0, -1.0, 0.7])];

/// Sets the rows of the disturbance's table, and its period in s.
fn tabulate(unit: &mut ReentryPlant, period: f64, rows: &[(f64, [f64; 3])]) {
    unit.parameters.table_period = period;
    unit.parameters.table_rows = rows.len();
    for (row, &(time, direction)) in unit.parameters.table.iter_mut().zip(rows) {
        *row = Row { time, direction: direction.into() };
    }
}

/// Returns a unit under a table that does not repeat and begins at 0.3 s.
fn tabulated() -> ReentryPlant {
    started(|unit| {
        unit.parameters.kind = DisturbanceKind::Table;
        unit.parameters.start = 0.3;
        tabulate(unit, 0.0, &TABLE);
    })
}

#[test]
fn a_table_has_its_time_events_at_its_rows_and_shows_the_row_in_force() {
    let mut unit = tabulated();
    let expected = [0.0, 0.3, 0.3 + 0.05, 0.3 + 0.33, 0.3 + 0.61];
    assert_eq!(exchange(&mut unit, 0.0, 2.0), expected, "to the last bit");
    let bound = unit.parameters.bound;
    assert_eq!(outputs(&mut unit, 2.0).delta, Vector3::from(TABLE[2].1) * bound);
    // In co-simulation the last step holds two jumps.
    let mut unit = tabulated();
    for (from, to, direction) in
        [(0.0, 0.34, [0.0; 3]), (0.34, 0.4, TABLE[0].1), (0.4, 1.0, TABLE[2].1)]
    {
        step(&mut unit, from, to).unwrap();
        assert_eq!(outputs(&mut unit, to).delta, Vector3::from(direction) * bound, "{to}");
    }
}

#[test]
fn rows_of_the_table_that_are_not_used_are_ignored() {
    let [mut plain, mut other] = [0, 1].map(|_| tabulated());
    other.parameters.table[3] = Row { time: -1.0, direction: Vector3::repeat(f64::NAN) };
    other.initialize(&CONTEXT).unwrap();
    for unit in [&mut plain, &mut other] {
        step(unit, 0.0, 2.0).unwrap();
    }
    assert_eq!(outputs(&mut plain, 2.0), outputs(&mut other, 2.0));
}

#[test]
fn a_state_saved_in_the_middle_of_the_table_goes_on_bit_for_bit() {
    let saved = |unit: &ReentryPlant| -> ReentryPlant {
        serde_json::from_str(&serde_json::to_string(unit).unwrap()).unwrap()
    };
    let mut unit = tabulated();
    step(&mut unit, 0.0, 0.5).unwrap();
    let mut restored = saved(&unit);
    for unit in [&mut unit, &mut restored] {
        step(unit, 0.5, 0.7).unwrap();
        step(unit, 0.7, 1.5).unwrap();
    }
    assert_eq!(outputs(&mut unit, 1.5), outputs(&mut restored, 1.5));
    let mut unit = tabulated();
    exchange(&mut unit, 0.0, 0.5);
    let mut restored = saved(&unit);
    assert_eq!(exchange(&mut unit, 0.5, 1.5), exchange(&mut restored, 0.5, 1.5));
    assert_eq!(outputs(&mut unit, 1.5), outputs(&mut restored, 1.5));
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation_under_surfaces_and_jets() {
    for (kind, duty) in [DisturbanceKind::None, DisturbanceKind::AgainstMoment]
        .into_iter()
        .flat_map(|kind| [(kind, false), (kind, true)])
    {
        let set = |unit: &mut ReentryPlant| {
            unit.parameters.kind = kind;
            unit.parameters.jet_duty = duty;
            actuate(unit);
        };
        let [mut cs, mut me] = [0, 1].map(|_| started(set));
        for k in 0..10 {
            let [begin, end] = [0.2 * f64::from(k), 0.2 * f64::from(k + 1)];
            for unit in [&mut cs, &mut me] {
                unit.command.jets[k as usize] = 0.9;
                unit.command.jets[9 - k as usize] = 0.2;
                unit.command.surfaces[4] = 0.1 * begin.sin();
            }
            step(&mut cs, begin, end).unwrap();
            exchange(&mut me, begin, end);
            let [cs, me] = [&mut cs, &mut me].map(|unit| outputs(unit, end));
            assert_same_motion(&cs, &me, &format!("kind {kind:?}, duty {duty}, tick {k}"));
            assert!(
                (cs.deflections - me.deflections).amax() < 1e-13,
                "{}",
                cs.deflections - me.deflections
            );
            assert!((cs.applied_moment - me.applied_moment).amax() < 1e-7);
        }
    }
}

/// Commands beyond the limits, at the limits and within them.
const FAR: [f64; 8] = [-90.0, 4.0, -3.0, 0.0, 90.0, 0.0, 0.0, 0.0];

fn commanded(degrees: [f64; 8]) -> ReentryPlant {
    started(|unit| {
        unit.parameters.kind = DisturbanceKind::None;
        actuate(unit);
        unit.command.surfaces = Surfaces::from(degrees).map(f64::to_radians);
    })
}

#[test]
fn published_rate_limit_and_state_events_where_surfaces_stop() {
    // Wu 2015, (63): 10 deg/s; commands beyond the limits of -25, 0 and 30 deg stop there.
    let mut unit = commanded(FAR);
    let events = exchange(&mut unit, 0.0, 4.0);
    let expected = [0.0, 0.3, 2.5, 3.0];
    assert_eq!(events.len(), expected.len(), "{events:?}");
    assert!(events.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{events:?}");
    let stop = [-25.0, 0.0, -3.0, 0.0, 30.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    assert_eq!(outputs(&mut unit, 4.0).deflections, Surfaces::from(stop), "to the last bit");
    assert_eq!(indicators(&mut unit, 4.0), [1.0; 8]);
}

#[test]
fn between_events_indicators_are_the_time_left_whatever_trial_states_are_set() {
    let mut unit = commanded(FAR);
    unit.new_discrete_states(0.0).unwrap();
    let start = states(&unit);
    let expected = [2.5, 1.0, 0.3, 1.0, 3.0, 1.0, 1.0, 1.0];
    let near = |found: [f64; 8], shift: f64| {
        let expected = [2.5 - shift, 1.0, 0.3 - shift, 1.0, 3.0 - shift, 1.0, 1.0, 1.0];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?}");
    };
    near(indicators(&mut unit, 0.0), 0.0);
    let rates = outputs(&mut unit, 0.0).deflection_rates;
    for reach in [0.1, 0.3 + 1e-9, 0.4, 7.0] {
        let mut trial = start;
        for i in 0..8 {
            trial[6 + i] += rates[i] * reach;
        }
        unit.set_continuous_states(trial.as_slice());
        near(indicators(&mut unit, reach), reach);
        assert_eq!(outputs(&mut unit, reach).deflection_rates, rates);
    }
    unit.set_continuous_states(start.as_slice());
    assert_eq!(indicators(&mut unit, 0.0).map(|z| (z * 1e12).round() / 1e12), expected);
}

#[test]
fn an_event_puts_a_deflection_on_its_target_however_it_was_located() {
    // The third surface is at -3 deg after 0.3 s. An importer stops before, at, or after that.
    for (late, arrives) in
        [(-1e-3, false), (-1e-8, false), (-1e-12, true), (0.0, true), (1e-9, true), (0.04, true)]
    {
        let mut unit = commanded(FAR);
        unit.new_discrete_states(0.0).unwrap();
        let rates = outputs(&mut unit, 0.0).deflection_rates;
        let mut y = states(&unit);
        for i in 0..8 {
            y[6 + i] += rates[i] * (0.3 + late);
        }
        unit.set_continuous_states(y.as_slice());
        let before = states(&unit);
        let info = unit.new_discrete_states(0.3 + late).unwrap();
        let found = outputs(&mut unit, 0.3 + late);
        assert_eq!(info.states_changed, states(&unit) != before, "{late}");
        assert_eq!(found.deflection_rates[2] == 0.0, arrives, "{late}");
        if arrives {
            assert_eq!(found.deflections[2], (-3f64).to_radians(), "{late}");
        }
        assert!(indicators(&mut unit, 0.3 + late).iter().all(|z| *z > 0.0), "{late}");
        // A second event at the same time, or a later one, changes nothing but the readings of the
        // sensors.
        let after = (states(&unit), found);
        for time in [0.3 + late, 0.3 + late + 1e-6] {
            assert!(!unit.new_discrete_states(time).unwrap().states_changed);
            let found = Output { measured: found.measured, ..outputs(&mut unit, time) };
            assert_eq!((states(&unit), found), after, "{late}");
        }
    }
}

#[test]
fn a_new_command_at_an_event_starts_from_the_old_target() {
    let mut unit = commanded(FAR);
    unit.new_discrete_states(0.0).unwrap();
    let mut y = states(&unit);
    y[6 + 2] = (-3.5f64).to_radians();
    unit.set_continuous_states(y.as_slice());
    unit.command.surfaces[2] = (-1f64).to_radians();
    assert!(unit.new_discrete_states(0.35).unwrap().states_changed);
    let found = outputs(&mut unit, 0.35);
    assert_eq!(found.deflections[2], (-3f64).to_radians());
    assert!((found.deflection_rates[2].to_degrees() - 10.0).abs() < 1e-12);
}

#[test]
fn an_importer_may_restart_from_other_deflections() {
    let mut unit = commanded([0.0; 8]);
    unit.new_discrete_states(0.0).unwrap();
    let mut y = states(&unit);
    y[6 + 4] = 0.1;
    unit.set_continuous_states(y.as_slice());
    assert!(!unit.new_discrete_states(0.0).unwrap().states_changed);
    let found = outputs(&mut unit, 0.0);
    assert_eq!(found.deflections[4], 0.1);
    assert!((found.deflection_rates[4].to_degrees() + 10.0).abs() < 1e-12);
}

#[test]
fn a_restored_unit_goes_on_with_moving_surfaces() {
    let mut unit = commanded(FAR);
    exchange(&mut unit, 0.0, 0.2);
    let saved = serde_json::to_string(&unit).unwrap();
    let mut restored: ReentryPlant = serde_json::from_str(&saved).unwrap();
    let events = exchange(&mut unit, 0.2, 1.0);
    assert_eq!(exchange(&mut restored, 0.2, 1.0), events);
    assert_eq!(outputs(&mut restored, 1.0), outputs(&mut unit, 1.0));
}

#[test]
fn published_moments_of_jets_act_from_the_communication_point_on() {
    // Wu 2015, (64): column 4 as printed and as the mirror image of column 8.
    for (symmetric, pitch) in [(false, 10944.0), (true, 11798.0)] {
        let mut unit = started(|unit| {
            unit.parameters.actuation = Actuation::SurfacesAndJets;
            unit.parameters.jet_symmetric = symmetric;
        });
        assert_eq!(outputs(&mut unit, 0.0).applied_moment, Vector3::zeros());
        unit.command.jets[3] = 1.0;
        assert_eq!(outputs(&mut unit, 0.0).applied_moment, Vector3::new(-6912.0, pitch, -11798.0));
    }
}

#[test]
fn in_model_exchange_jets_switch_and_surfaces_turn_at_events_only() {
    let mut unit = started(|unit| unit.parameters.actuation = Actuation::SurfacesAndJets);
    unit.new_discrete_states(0.0).unwrap();
    unit.command.jets[0] = 1.0;
    unit.command.surfaces[4] = 0.1;
    let before = outputs(&mut unit, 0.01);
    assert_eq!((before.applied_moment, before.deflections), (Vector3::zeros(), Surfaces::zeros()));
    assert_eq!(before.deflection_rates, Surfaces::zeros());
    unit.new_discrete_states(0.01).unwrap();
    assert_eq!(outputs(&mut unit, 0.01).applied_moment, Vector3::new(0.0, -498.0, 19897.0));
    let reached = integrate(&mut unit, 0.01, 0.02);
    assert!((outputs(&mut unit, reached).deflections[4].to_degrees() - 0.1).abs() < 1e-12);
}

#[test]
fn oracle_dynamic_pressure_and_biases_of_aerodynamics_and_density() {
    let flaps = |scale: f64| {
        let mut unit = started(|unit| {
            unit.parameters.actuation = Actuation::SurfacesAndJets;
            unit.parameters.density_scale = scale;
            unit.parameters.aerodynamics_scale = scale;
            unit.command.surfaces[4] = 0.1;
            unit.command.surfaces[5] = 0.1;
        });
        step(&mut unit, 0.0, 1.0).unwrap();
        outputs(&mut unit, 1.0)
    };
    let [nominal, biased] = [1.0, 0.9].map(flaps);
    // Flight at 55 km and Mach 9.8 in the US Standard Atmosphere 1976.
    assert!((nominal.dynamic_pressure - 2858.9).abs() < 0.05, "{}", nominal.dynamic_pressure);
    assert!((biased.dynamic_pressure / nominal.dynamic_pressure - 0.9).abs() < 1e-14);
    let pitch = -2.0 * 5100.0 * 0.1f64.to_degrees() * 2858.9 / 2859.0;
    assert!((nominal.applied_moment - Vector3::new(0.0, pitch, 0.0)).amax() < 2e-5 * pitch.abs());
    assert!((biased.applied_moment - nominal.applied_moment * 0.81).amax() < 1e-9);
}

#[test]
fn with_a_moment_actuators_stay_at_rest_and_commands_do_nothing() {
    let [mut plain, mut commanded] = [0, 1].map(|_| started(|_| {}));
    commanded.command.surfaces = Surfaces::repeat(-0.1);
    commanded.command.jets = Jets::repeat(1.0);
    for unit in [&mut plain, &mut commanded] {
        unit.input.moment = Vector3::new(1e4, -2e4, 3e4);
        step(unit, 0.0, 0.5).unwrap();
    }
    let output = outputs(&mut commanded, 0.5);
    assert_eq!(output, outputs(&mut plain, 0.5));
    assert_eq!(
        (output.applied_moment, output.deflections),
        (plain.input.moment, Surfaces::zeros())
    );
}

#[test]
fn between_events_the_disturbance_is_held_even_beyond_a_tick() {
    let mut unit = in_model_exchange(DisturbanceKind::White);
    let held = outputs(&mut unit, 0.0).delta;
    for time in [0.01, 0.04, 0.041] {
        assert_eq!(outputs(&mut unit, time).delta, held);
    }
    assert_eq!(unit.new_discrete_states(0.04).unwrap().next_event_time, Some(0.08));
    assert_ne!(outputs(&mut unit, 0.04).delta, held);
}

#[test]
fn an_event_iteration_sees_the_latest_moment() {
    let mut unit = started(|unit| unit.parameters.kind = DisturbanceKind::AgainstMoment);
    unit.new_discrete_states(0.0).unwrap();
    let before = outputs(&mut unit, 0.0).delta;
    unit.input.moment = vehicle::kinematics::r_inverse(&unit.output.angles) * before * 1e7;
    unit.new_discrete_states(0.0).unwrap();
    assert_ne!(outputs(&mut unit, 0.0).delta, before);
    unit.input.moment = Vector3::zeros();
    unit.new_discrete_states(0.02).unwrap();
    assert_ne!(outputs(&mut unit, 0.02).delta, before, "between ticks the value is kept");
}

#[test]
fn oracle_input_derivatives_are_integrated() {
    // At beta = 0 a pitch moment k t alone gives q = k t² / 2 Iyy.
    let mut unit = started(|unit| {
        unit.parameters.kind = DisturbanceKind::None;
        unit.parameters.initial_angles = Vector3::new(0.1, 0.0, 0.2);
    });
    unit.step(0.0, 2.0, &Ramp(1e4), &mut |_| {}).unwrap();
    let exact = 1e4 * 2.0 * 2.0 / 2.0 / (1303212.0 * 1.05);
    assert!((outputs(&mut unit, 2.0).rates.y - exact).abs() < 1e-15);
}

#[test]
fn refusals_name_variables() {
    let changes: [fn(&mut ReentryPlant); 46] = [
        |unit| unit.parameters.inertia.Ixx = 0.0,
        |unit| unit.parameters.inertia.Ixz = 2e6,
        |unit| unit.parameters.inertia.Iyy = 1e7,
        |unit| unit.parameters.inertia_scale = 0.0,
        |unit| unit.parameters.initial_angles.x = f64::NAN,
        |unit| unit.parameters.initial_angles.y = 1.6,
        |unit| unit.parameters.step = 0.0,
        |unit| unit.parameters.earth_rate = f64::NAN,
        |unit| unit.parameters.moment_delay = -1.0,
        |unit| {
            unit.parameters.actuation = Actuation::SurfacesAndJets;
            unit.parameters.moment_delay = 0.1;
        },
        |unit| unit.parameters.moment_resolution = -1.0,
        |unit| {
            unit.parameters.actuation = Actuation::SurfacesAndJets;
            unit.parameters.moment_resolution = 8.0;
        },
        |unit| {
            unit.parameters.actuation = Actuation::SurfacesAndJets;
            unit.parameters.aerodynamics_scale = -1.0;
        },
        |unit| unit.parameters.flight.altitude = 1e5,
        |unit| unit.parameters.flight.mach = -1.0,
        |unit| unit.parameters.bound = -1.0,
        |unit| unit.parameters.period = 0.0,
        |unit| unit.parameters.square_period = 0.0,
        |unit| unit.parameters.direction.x = 2.0,
        |unit| unit.parameters.end = -1.0,
        |unit| unit.parameters.waves[0].phase = f64::NAN,
        |unit| unit.parameters.table_rows = 9,
        |unit| unit.parameters.table_period = -1.0,
        |unit| tabulate(unit, 0.0, &[(-1.0, [0.0; 3])]),
        |unit| tabulate(unit, 0.0, &[(1.0, [0.0; 3]), (1.0, [0.0; 3])]),
        |unit| tabulate(unit, 2.0, &[(0.0, [0.0; 3]), (1.0, [0.0; 3]), (2.0, [0.0; 3])]),
        |unit| tabulate(unit, 0.0, &[(0.0, [0.0; 3]), (1.0, [2.0, 0.0, 0.0])]),
        |unit| tabulate(unit, 0.0, &[(0.0, [0.0, -2.0, 0.0])]),
        |unit| tabulate(unit, 0.0, &[(0.0, [0.0, 0.0, f64::NAN])]),
        |unit| unit.parameters.surroundings.gravity = -1.0,
        |unit| unit.parameters.surroundings.field.x = f64::NAN,
        |unit| {
            unit.parameters.calibrates = true;
            unit.parameters.sequence.beta_amplitude = 1.5;
        },
        |unit| {
            unit.parameters.calibrates = true;
            unit.parameters.sequence.alpha_rate = f64::NAN;
        },
        |unit| unit.parameters.line.period = 0.0,
        |unit| unit.parameters.line.delay = 1e3,
        |unit| unit.parameters.line.drop_probability = 2.0,
        |unit| unit.parameters.triads[0].noise = -1.0,
        |unit| unit.parameters.triads[1].bandwidth = -1.0,
        |unit| unit.parameters.triads[2].range = -1.0,
        |unit| unit.parameters.triads[2].resolution = -1.0,
        |unit| unit.parameters.triads[0].matrix.fill(f64::NAN),
        |unit| unit.parameters.triads[1].bias.fill(f64::NAN),
        |unit| unit.parameters.triads[1].drift.fill(f64::NAN),
        |unit| unit.parameters.turntable.bandwidth = -1.0,
        |unit| unit.parameters.turntable.rate = -1.0,
        |unit| {
            unit.parameters.sensor_set = 0;
            unit.parameters.turntable.bandwidth = 10.0;
        },
    ];
    let refusal = |set: &fn(&mut ReentryPlant)| {
        let mut unit = ReentryPlant::new();
        unit.parameters.sensor_set = 2;
        set(&mut unit);
        unit.initialize(&CONTEXT).unwrap_err().to_string()
    };
    let found: Vec<String> = changes.iter().map(refusal).collect();
    let expected: Vec<&str> = include_str!("tests/messages.txt").lines().collect();
    assert_eq!(found, expected);
}

#[test]
fn impossible_parameters_are_refused_by_name() {
    let refusal = |set: fn(&mut ReentryPlant)| {
        let mut unit = ReentryPlant::new();
        set(&mut unit);
        unit.initialize(&CONTEXT).unwrap_err().to_string()
    };
    for (message, name) in [
        (refusal(|unit| unit.parameters.inertia.Ixx = 0.0), "inertia.Ixx"),
        (refusal(|unit| unit.parameters.inertia.Ixz = 2e6), "inertia.Ixz"),
        (refusal(|unit| unit.parameters.inertia.Iyy = 1e7), "inertia.Iyy"),
        (refusal(|unit| unit.parameters.end = -1.0), "disturbance.end"),
        (refusal(|unit| unit.parameters.flight.altitude = 1e5), "flight.altitude"),
    ] {
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn a_singular_attitude_is_an_error_in_co_simulation_and_discarded_in_model_exchange() {
    let mut singular = [0.0; 14];
    singular[1] = 1.6;
    let mut unit = in_model_exchange(DisturbanceKind::None);
    unit.set_continuous_states(&singular);
    assert!(
        matches!(unit.calculate(0.1, LastEvent::InputSet), Err(Failure::Discard(text)) if text.contains("singular"))
    );
    let mut unit = started(|_| {});
    unit.set_continuous_states(&singular);
    assert!(
        matches!(unit.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("singular"))
    );
    let mut unit = started(|unit| {
        unit.parameters.kind = DisturbanceKind::None;
        unit.parameters.inertia.Ixz = 0.0;
        unit.parameters.initial_angles = Vector3::new(0.0, 1.5, 0.0);
        unit.parameters.initial_rates = Vector3::new(0.0, 0.0, -0.5);
    });
    assert!(
        matches!(step(&mut unit, 0.0, 1.0), Err(Failure::Error(text)) if text.contains("beta"))
    );
}

#[test]
fn a_wrong_moment_is_an_error_and_the_unit_starts_again() {
    let mut unit = started(|_| {});
    unit.input.moment.x = f64::NAN;
    assert!(
        matches!(unit.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("moment"))
    );
    assert!(
        matches!(step(&mut unit, 0.0, 0.04), Err(Failure::Error(text)) if text.contains("moment"))
    );
    unit.input.moment.x = 0.0;
    unit.initialize(&CONTEXT).unwrap();
    step(&mut unit, 0.0, 0.04).unwrap();
}

#[test]
fn before_initialization_it_says_so() {
    let mut unit = ReentryPlant::new();
    assert!(
        unit.calculate(0.0, LastEvent::InputSet).unwrap_err().to_string().contains("initialized")
    );
    assert!(step(&mut unit, 0.0, 1.0).is_err());
    assert!(unit.new_discrete_states(0.0).is_err());
}

#[test]
fn outputs_need_no_start_and_inputs_have_one() {
    for variable in describe::<ReentryPlant>().variables {
        let variable::Kind::Real { start, unit, .. } = &variable.kind else { continue };
        assert_eq!(start.is_none(), variable.causality == Causality::Output, "{}", variable.name);
        let plain = [
            "inertia.scale",
            "disturbance.direction.alpha",
            "disturbance.direction.beta",
            "disturbance.direction.sigma",
            "flight.mach",
            "density.scale",
            "aerodynamics.scale",
            "sensor.drop.probability",
        ];
        let group = variable.name.split('[').next().unwrap();
        let plain_group =
            ["jet", "disturbance.table.alpha", "disturbance.table.beta", "disturbance.table.sigma"]
                .contains(&group)
                || group.ends_with(".matrix");
        assert_eq!(
            unit.is_none(),
            plain_group || plain.contains(&variable.name.as_str()),
            "{}",
            variable.name
        );
    }
}

fn delayed(delay: f64) -> ReentryPlant {
    started(|unit| unit.parameters.moment_delay = delay)
}

#[test]
fn oracle_a_delayed_moment_is_shown_when_it_acts() {
    let mut unit = delayed(0.1);
    let pitch = |k: u32| Vector3::new(0.0, 1e4 * f64::from(k + 1), 0.0);
    for k in 0..20_u32 {
        let time = 0.04 * f64::from(k);
        unit.input.moment = pitch(k);
        // The delay of 0.1 s is two and a half steps.
        let acts = if k < 3 { Vector3::zeros() } else { pitch(k - 3) };
        assert_eq!(outputs(&mut unit, time).applied_moment, acts, "{k}");
        step(&mut unit, time, time + 0.04).unwrap();
    }
}

#[test]
fn moments_under_way_are_part_of_the_saved_state() {
    let mut unit = delayed(0.117);
    let mut restored: Option<ReentryPlant> = None;
    for k in 0..20_u32 {
        let time = 0.04 * f64::from(k);
        for unit in std::iter::once(&mut unit).chain(restored.as_mut()) {
            unit.input.moment = Vector3::new(1e4 * time.sin(), -1e4 * time.cos(), 5e3);
            step(unit, time, time + 0.04).unwrap();
        }
        if k == 7 {
            restored = Some(serde_json::from_str(&serde_json::to_string(&unit).unwrap()).unwrap());
        }
    }
    assert_eq!(outputs(&mut unit, 0.8), outputs(&mut restored.unwrap(), 0.8));
}

#[test]
fn a_delay_is_refused_by_name_where_it_cannot_work() {
    let text = |failure: Failure| failure.to_string();
    let in_model_exchange = text(delayed(0.1).new_discrete_states(0.0).unwrap_err());
    assert!(
        in_model_exchange.contains("actuation.delay")
            && in_model_exchange.contains("co-simulation")
    );
    assert!(delayed(0.0).new_discrete_states(0.0).is_ok());
    let ramp = text(delayed(0.1).step(0.0, 0.04, &Ramp(1e5), &mut |_| {}).unwrap_err());
    assert!(ramp.contains("actuation.delay") && ramp.contains("derivatives"), "{ramp}");
    let mut converted = started(|unit| unit.parameters.moment_resolution = 8.0);
    let in_model_exchange = text(converted.new_discrete_states(0.0).unwrap_err());
    assert!(in_model_exchange.contains("actuation.resolution = 8 N m"), "{in_model_exchange}");
    let mut actuated = ReentryPlant::new();
    actuated.parameters.moment_delay = 0.1;
    actuate(&mut actuated);
    let actuated = text(actuated.initialize(&CONTEXT).unwrap_err());
    assert!(actuated.contains("actuation.delay"), "{actuated}");
}
