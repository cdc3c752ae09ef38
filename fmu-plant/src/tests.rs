//! Tests of the instance through the interface that the shell uses.

mod sensors;

use crate::parameters::{Actuation, Initial};
use crate::plant::{Output, ReentryPlant};
use crate::roles::{Known, Unknown};
use crate::table::role;
use fmi2_export::{Context, Failure, Inputs, LastEvent, Model, describe};
use model_description::variable::{Causality, Variability, VariableKind};
use nalgebra::Vector3;
use settings::Choice;
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
    let mut instance = ReentryPlant::new();
    set(&mut instance);
    instance.initialize(&CONTEXT).unwrap();
    instance
}

fn step(instance: &mut ReentryPlant, from: f64, to: f64) -> Result<(), Failure> {
    instance.step(from, to, &Constant, &mut |_| {})
}

fn outputs(instance: &mut ReentryPlant, time: f64) -> Output {
    instance.calculate(time, LastEvent::InputSet).unwrap();
    instance.output
}

/// Position of the first sensor reading in the table.
const MEASURED: usize = 113;

/// Calculated variables with their positions in the table.
fn calculated(instance: &mut ReentryPlant, time: f64) -> Vec<(usize, f64)> {
    let o = outputs(instance, time);
    let vectors = [
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
        .zip(vectors.iter().flatten().copied())
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
        let unknown = match role(position).as_unknown {
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
            None => match role(position).as_known {
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
    assert_eq!(role(MEASURED).as_unknown, Some(Unknown::Measured(0)));
    assert_eq!(role(MEASURED + 9).as_unknown, Some(Unknown::MeasuredTime));
    assert_eq!(role(MEASURED + 10).as_unknown, None, "an integer");
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
        VariableKind::Real { start, .. } => start.unwrap(),
        VariableKind::Integer { start, .. } | VariableKind::Enumeration { start, .. } => {
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
    DisturbanceKind::ITEMS.iter().map(|(kind, ..)| *kind)
}

/// Returns an instance in model exchange after the first event, in a general attitude, with a
/// disturbance of this kind.
fn in_model_exchange(kind: DisturbanceKind) -> ReentryPlant {
    let mut instance = started(|instance| instance.parameters.kind = kind);
    instance.input.moment = Vector3::new(3e4, -2e4, 1e4);
    instance.input.disturbance_moment = Vector3::new(1e3, 2e3, -3e3);
    instance.set_continuous_states(&STATES);
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Selects surfaces and jets as the source of the control moment.
fn actuate(instance: &mut ReentryPlant) {
    instance.parameters.actuation = Actuation::SurfacesAndJets;
    instance.command.surfaces =
        Surfaces::from([-5.0, -2.0, -1.0, -4.0, 3.0, -6.0, 1.0, 2.0]) * 0.02;
    instance.command.jets = Jets::repeat(0.5);
}

/// Returns an instance with actuators in model exchange; its jets take a duty cycle or switch.
fn actuated_in_model_exchange(duty: bool) -> ReentryPlant {
    let mut instance = in_model_exchange(DisturbanceKind::None);
    instance.parameters.jet_duty = duty;
    actuate(&mut instance);
    instance.initialize(&CONTEXT).unwrap();
    instance.set_continuous_states(&STATES);
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Returns an instance in model exchange on a trajectory that turns in every way.
fn along_a_trajectory(kind: DisturbanceKind, kinematics: Kinematics) -> ReentryPlant {
    let mut instance = in_model_exchange(kind);
    instance.parameters.kinematics = kinematics;
    instance.parameters.earth_rate = 7.2921e-5;
    instance.initialize(&CONTEXT).unwrap();
    instance.set_continuous_states(&STATES);
    instance.input.trajectory = Trajectory {
        flight_path_angle: -0.1,
        heading: 0.8,
        latitude: 0.4,
        flight_path_angle_rate: 0.01,
        heading_rate: -0.02,
        longitude_rate: 0.03,
        latitude_rate: 0.01,
    };
    instance.new_discrete_states(0.0).unwrap();
    instance
}

/// Returns an instance in co-simulation at a communication point, with jets that take a duty cycle.
fn at_a_communication_point() -> ReentryPlant {
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.jet_duty = true;
        actuate(instance);
    });
    instance.set_continuous_states(&STATES);
    instance
}

/// Returns an instance in co-simulation on which a moment commanded earlier acts.
fn under_a_delayed_moment() -> ReentryPlant {
    let mut instance = delayed(0.01);
    instance.input.moment = Vector3::new(3e4, -2e4, 1e4);
    step(&mut instance, 0.0, 0.02).unwrap();
    instance
}

fn positions_of_knowns() -> impl Iterator<Item = usize> {
    (0..69).filter(|&position| role(position).as_known.is_some())
}

/// Adds a number to the state or input at a position in the table.
fn nudge(instance: &mut ReentryPlant, known_position: usize, by: f64) {
    match role(known_position).as_known.unwrap() {
        Known::State(i) => {
            let mut states = [0.0; 14];
            instance.continuous_states(&mut states);
            states[i] += by;
            instance.set_continuous_states(&states);
        }
        Known::Moment(i) => instance.input.moment[i] += by,
        Known::DisturbanceMoment(i) => instance.input.disturbance_moment[i] += by,
        Known::Surface(i) => instance.command.surfaces[i] += by,
        Known::Jet(j) => instance.command.jets[j] += by,
        Known::Trajectory(i) => {
            let t = &mut instance.input.trajectory;
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
    let instances = all_kinds()
        .map(in_model_exchange)
        .chain([false, true].map(actuated_in_model_exchange))
        .chain([
            along_a_trajectory(DisturbanceKind::None, Kinematics::Printed),
            along_a_trajectory(DisturbanceKind::Constant, Kinematics::Exact),
            along_a_trajectory(DisturbanceKind::AgainstMoment, Kinematics::Exact),
        ])
        .chain([at_a_communication_point(), under_a_delayed_moment()]);
    for (case, mut instance) in instances.enumerate() {
        for known_position in positions_of_knowns() {
            let by = match known_position {
                21..27 => 1e3,
                36..44 => 1e-3,
                44..54 => 0.1,
                _ => 1e-5,
            };
            nudge(&mut instance, known_position, by);
            let above = calculated(&mut instance, 0.02);
            nudge(&mut instance, known_position, -2.0 * by);
            let below = calculated(&mut instance, 0.02);
            nudge(&mut instance, known_position, by);
            let known_name = &description.variables[known_position].name;
            for ((unknown, above), (_, below)) in above.iter().zip(&below) {
                let exact = instance.partial_derivative(0.02, *unknown, known_position).unwrap();
                let numeric = (above - below) / (2.0 * by);
                let variable = &description.variables[*unknown];
                assert!(
                    (numeric - exact).abs() < 1e-9 * exact.abs().max(1.0),
                    "{case}: {} by {known_name}: {exact}, not {numeric}",
                    variable.name
                );
                if exact != 0.0 && *unknown != known_position {
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
    let mut instance = in_model_exchange(DisturbanceKind::None);
    for (unknown, known_position) in
        [(6, 69), (6, 6), (6, 35), (69, 0), (21, 21), (36, 36), (62, 62)]
    {
        assert!(
            instance.partial_derivative(0.0, unknown, known_position).is_err(),
            "{unknown} by {known_position}"
        );
    }
}

#[test]
fn outputs_are_right_from_initialization_on() {
    let mut instance = started(|_| {});
    let scenario = Scenario::crmpc2022();
    let output = outputs(&mut instance, 0.0);
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
        let mut instance = started(|instance| instance.parameters.kind = kind);
        instance.input.moment = Vector3::new(1e4, -1e4, 1e4);
        step(&mut instance, 0.0, 0.04).unwrap();
        instance.input.moment *= -1.0;
        let announced = outputs(&mut instance, 0.04).delta;
        step(&mut instance, 0.04, 0.08 - 1e-6).unwrap();
        assert_eq!(outputs(&mut instance, 0.08 - 1e-6).delta, announced, "kind {kind:?}");
    }
}

#[test]
fn looking_changes_nothing() {
    let [mut looked_at, mut left_alone] = [0, 1]
        .map(|_| started(|instance| instance.parameters.kind = DisturbanceKind::AgainstMoment));
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

fn states(instance: &ReentryPlant) -> States {
    let mut states = States::zeros();
    instance.continuous_states(states.as_mut_slice());
    states
}

fn indicators(instance: &mut ReentryPlant, time: f64) -> [f64; 8] {
    instance.calculate(time, LastEvent::InputSet).unwrap();
    let mut indicators = [f64::NAN; 8];
    instance.event_indicators(&mut indicators);
    indicators
}

/// Integrates accurately to `end`, or to the state event before it, which is located by bisection.
/// Returns the time reached.
fn integrate(instance: &mut ReentryPlant, begin: f64, end: f64) -> f64 {
    let crossed =
        |instance: &mut ReentryPlant, time| indicators(instance, time).iter().any(|z| *z <= 0.0);
    assert!(!crossed(instance, begin), "an event is due at {begin} s");
    let steps = vehicle::integrator::equal_steps(end - begin, 0.001);
    let h = (end - begin) / steps as f64;
    for i in 0..steps {
        let (time, y) = (begin + i as f64 * h, states(instance));
        let advance = |instance: &mut ReentryPlant, h: f64| {
            let mut f = |t: f64, y: &States| {
                instance.set_continuous_states(y.as_slice());
                let o = outputs(instance, t);
                let motion = o.angle_rates.iter().chain(o.angular_acceleration.iter());
                States::from_iterator(motion.chain(o.deflection_rates.iter()).copied())
            };
            let y = vehicle::integrator::rk4(&mut f, time, &y, h);
            instance.set_continuous_states(y.as_slice());
            crossed(instance, time + h)
        };
        if advance(instance, h) {
            let (mut before, mut after) = (0.0, h);
            while after - before > 1e-15 {
                let middle = 0.5 * (before + after);
                if advance(instance, middle) { after = middle } else { before = middle }
            }
            advance(instance, after);
            return time + after;
        }
    }
    end
}

/// Runs model exchange to `end` and returns the times of the events.
fn exchange(instance: &mut ReentryPlant, begin: f64, end: f64) -> Vec<f64> {
    let mut times = vec![begin];
    loop {
        let time = times[times.len() - 1];
        let next =
            instance.new_discrete_states(time).unwrap().next_event_time.unwrap_or(end).min(end);
        let reached = integrate(instance, time, next);
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
        let set = |instance: &mut ReentryPlant| {
            instance.parameters.kind = kind;
            instance.parameters.start = 0.3;
            instance.parameters.end = 1.7;
            instance.parameters.square_period = 0.9;
            tabulate(instance, 0.9, &TABLE);
            instance.input.moment = Vector3::new(2e4, -1e4, 1e4);
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
fn tabulate(instance: &mut ReentryPlant, period: f64, rows: &[(f64, [f64; 3])]) {
    instance.parameters.table.period = period;
    instance.parameters.table.used = rows.len();
    for (row, &(time, direction)) in instance.parameters.table.rows.iter_mut().zip(rows) {
        *row = Row { time, direction: direction.into() };
    }
}

/// Returns an instance under a table that does not repeat and begins at 0.3 s.
fn tabulated() -> ReentryPlant {
    started(|instance| {
        instance.parameters.kind = DisturbanceKind::Table;
        instance.parameters.start = 0.3;
        tabulate(instance, 0.0, &TABLE);
    })
}

#[test]
fn a_table_has_its_time_events_at_its_rows_and_shows_the_row_in_force() {
    let mut instance = tabulated();
    let expected = [0.0, 0.3, 0.3 + 0.05, 0.3 + 0.33, 0.3 + 0.61];
    assert_eq!(exchange(&mut instance, 0.0, 2.0), expected, "to the last bit");
    let bound = instance.parameters.bound;
    assert_eq!(outputs(&mut instance, 2.0).delta, Vector3::from(TABLE[2].1) * bound);
    // In co-simulation the last step holds two jumps.
    let mut instance = tabulated();
    for (from, to, direction) in
        [(0.0, 0.34, [0.0; 3]), (0.34, 0.4, TABLE[0].1), (0.4, 1.0, TABLE[2].1)]
    {
        step(&mut instance, from, to).unwrap();
        assert_eq!(outputs(&mut instance, to).delta, Vector3::from(direction) * bound, "{to}");
    }
}

#[test]
fn rows_of_the_table_that_are_not_used_are_ignored() {
    let [mut plain, mut other] = [0, 1].map(|_| tabulated());
    other.parameters.table.rows[3] = Row { time: -1.0, direction: Vector3::repeat(f64::NAN) };
    other.initialize(&CONTEXT).unwrap();
    for instance in [&mut plain, &mut other] {
        step(instance, 0.0, 2.0).unwrap();
    }
    assert_eq!(outputs(&mut plain, 2.0), outputs(&mut other, 2.0));
}

#[test]
fn a_state_saved_in_the_middle_of_the_table_goes_on_bit_for_bit() {
    let saved = |instance: &ReentryPlant| -> ReentryPlant {
        serde_json::from_str(&serde_json::to_string(instance).unwrap()).unwrap()
    };
    let mut instance = tabulated();
    step(&mut instance, 0.0, 0.5).unwrap();
    let mut restored = saved(&instance);
    for instance in [&mut instance, &mut restored] {
        step(instance, 0.5, 0.7).unwrap();
        step(instance, 0.7, 1.5).unwrap();
    }
    assert_eq!(outputs(&mut instance, 1.5), outputs(&mut restored, 1.5));
    let mut instance = tabulated();
    exchange(&mut instance, 0.0, 0.5);
    let mut restored = saved(&instance);
    assert_eq!(exchange(&mut instance, 0.5, 1.5), exchange(&mut restored, 0.5, 1.5));
    assert_eq!(outputs(&mut instance, 1.5), outputs(&mut restored, 1.5));
}

#[test]
fn oracle_model_exchange_agrees_with_co_simulation_under_surfaces_and_jets() {
    for (kind, duty) in [DisturbanceKind::None, DisturbanceKind::AgainstMoment]
        .into_iter()
        .flat_map(|kind| [(kind, false), (kind, true)])
    {
        let set = |instance: &mut ReentryPlant| {
            instance.parameters.kind = kind;
            instance.parameters.jet_duty = duty;
            actuate(instance);
        };
        let [mut cs, mut me] = [0, 1].map(|_| started(set));
        for k in 0..10 {
            let [begin, end] = [0.2 * f64::from(k), 0.2 * f64::from(k + 1)];
            for instance in [&mut cs, &mut me] {
                instance.command.jets[k as usize] = 0.9;
                instance.command.jets[9 - k as usize] = 0.2;
                instance.command.surfaces[4] = 0.1 * begin.sin();
            }
            step(&mut cs, begin, end).unwrap();
            exchange(&mut me, begin, end);
            let [cs, me] = [&mut cs, &mut me].map(|instance| outputs(instance, end));
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
    started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        actuate(instance);
        instance.command.surfaces = Surfaces::from(degrees).map(f64::to_radians);
    })
}

#[test]
fn published_rate_limit_and_state_events_where_surfaces_stop() {
    // Wu 2015, (63): 10 deg/s; commands beyond the limits of -25, 0 and 30 deg stop there.
    let mut instance = commanded(FAR);
    let events = exchange(&mut instance, 0.0, 4.0);
    let expected = [0.0, 0.3, 2.5, 3.0];
    assert_eq!(events.len(), expected.len(), "{events:?}");
    assert!(events.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{events:?}");
    let stop = [-25.0, 0.0, -3.0, 0.0, 30.0, 0.0, 0.0, 0.0].map(f64::to_radians);
    assert_eq!(outputs(&mut instance, 4.0).deflections, Surfaces::from(stop), "to the last bit");
    assert_eq!(indicators(&mut instance, 4.0), [1.0; 8]);
}

#[test]
fn between_events_indicators_are_the_time_left_whatever_trial_states_are_set() {
    let mut instance = commanded(FAR);
    instance.new_discrete_states(0.0).unwrap();
    let start = states(&instance);
    let expected = [2.5, 1.0, 0.3, 1.0, 3.0, 1.0, 1.0, 1.0];
    let near = |actual: [f64; 8], shift: f64| {
        let expected = [2.5 - shift, 1.0, 0.3 - shift, 1.0, 3.0 - shift, 1.0, 1.0, 1.0];
        assert!(actual.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-14), "{actual:?}");
    };
    near(indicators(&mut instance, 0.0), 0.0);
    let rates = outputs(&mut instance, 0.0).deflection_rates;
    for reach in [0.1, 0.3 + 1e-9, 0.4, 7.0] {
        let mut trial = start;
        for i in 0..8 {
            trial[6 + i] += rates[i] * reach;
        }
        instance.set_continuous_states(trial.as_slice());
        near(indicators(&mut instance, reach), reach);
        assert_eq!(outputs(&mut instance, reach).deflection_rates, rates);
    }
    instance.set_continuous_states(start.as_slice());
    assert_eq!(indicators(&mut instance, 0.0).map(|z| (z * 1e12).round() / 1e12), expected);
}

#[test]
fn an_event_puts_a_deflection_on_its_target_however_it_was_located() {
    // The third surface is at -3 deg after 0.3 s. An importer stops before, at, or after that.
    for (late, arrives) in
        [(-1e-3, false), (-1e-8, false), (-1e-12, true), (0.0, true), (1e-9, true), (0.04, true)]
    {
        let mut instance = commanded(FAR);
        instance.new_discrete_states(0.0).unwrap();
        let rates = outputs(&mut instance, 0.0).deflection_rates;
        let mut y = states(&instance);
        for i in 0..8 {
            y[6 + i] += rates[i] * (0.3 + late);
        }
        instance.set_continuous_states(y.as_slice());
        let before = states(&instance);
        let info = instance.new_discrete_states(0.3 + late).unwrap();
        let actual = outputs(&mut instance, 0.3 + late);
        assert_eq!(info.states_changed, states(&instance) != before, "{late}");
        assert_eq!(actual.deflection_rates[2] == 0.0, arrives, "{late}");
        if arrives {
            assert_eq!(actual.deflections[2], (-3f64).to_radians(), "{late}");
        }
        assert!(indicators(&mut instance, 0.3 + late).iter().all(|z| *z > 0.0), "{late}");
        // A second event at the same time, or a later one, changes nothing but the readings of the
        // sensors.
        let after = (states(&instance), actual);
        for time in [0.3 + late, 0.3 + late + 1e-6] {
            assert!(!instance.new_discrete_states(time).unwrap().states_changed);
            let actual = Output { measured: actual.measured, ..outputs(&mut instance, time) };
            assert_eq!((states(&instance), actual), after, "{late}");
        }
    }
}

#[test]
fn a_new_command_at_an_event_starts_from_the_old_target() {
    let mut instance = commanded(FAR);
    instance.new_discrete_states(0.0).unwrap();
    let mut y = states(&instance);
    y[6 + 2] = (-3.5f64).to_radians();
    instance.set_continuous_states(y.as_slice());
    instance.command.surfaces[2] = (-1f64).to_radians();
    assert!(instance.new_discrete_states(0.35).unwrap().states_changed);
    let actual = outputs(&mut instance, 0.35);
    assert_eq!(actual.deflections[2], (-3f64).to_radians());
    assert!((actual.deflection_rates[2].to_degrees() - 10.0).abs() < 1e-12);
}

#[test]
fn an_importer_may_restart_from_other_deflections() {
    let mut instance = commanded([0.0; 8]);
    instance.new_discrete_states(0.0).unwrap();
    let mut y = states(&instance);
    y[6 + 4] = 0.1;
    instance.set_continuous_states(y.as_slice());
    assert!(!instance.new_discrete_states(0.0).unwrap().states_changed);
    let actual = outputs(&mut instance, 0.0);
    assert_eq!(actual.deflections[4], 0.1);
    assert!((actual.deflection_rates[4].to_degrees() + 10.0).abs() < 1e-12);
}

#[test]
fn a_restored_instance_continues_with_moving_surfaces() {
    let mut instance = commanded(FAR);
    exchange(&mut instance, 0.0, 0.2);
    let saved = serde_json::to_string(&instance).unwrap();
    let mut restored: ReentryPlant = serde_json::from_str(&saved).unwrap();
    let events = exchange(&mut instance, 0.2, 1.0);
    assert_eq!(exchange(&mut restored, 0.2, 1.0), events);
    assert_eq!(outputs(&mut restored, 1.0), outputs(&mut instance, 1.0));
}

#[test]
fn published_moments_of_jets_act_from_the_communication_point_on() {
    // Wu 2015, (64): column 4 as printed and as the mirror image of column 8.
    for (symmetric, pitch) in [(false, 10944.0), (true, 11798.0)] {
        let mut instance = started(|instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.jet_symmetric = symmetric;
        });
        assert_eq!(outputs(&mut instance, 0.0).applied_moment, Vector3::zeros());
        instance.command.jets[3] = 1.0;
        assert_eq!(
            outputs(&mut instance, 0.0).applied_moment,
            Vector3::new(-6912.0, pitch, -11798.0)
        );
    }
}

#[test]
fn in_model_exchange_jets_switch_and_surfaces_turn_at_events_only() {
    let mut instance =
        started(|instance| instance.parameters.actuation = Actuation::SurfacesAndJets);
    instance.new_discrete_states(0.0).unwrap();
    instance.command.jets[0] = 1.0;
    instance.command.surfaces[4] = 0.1;
    let before = outputs(&mut instance, 0.01);
    assert_eq!((before.applied_moment, before.deflections), (Vector3::zeros(), Surfaces::zeros()));
    assert_eq!(before.deflection_rates, Surfaces::zeros());
    instance.new_discrete_states(0.01).unwrap();
    assert_eq!(outputs(&mut instance, 0.01).applied_moment, Vector3::new(0.0, -498.0, 19897.0));
    let reached = integrate(&mut instance, 0.01, 0.02);
    assert!((outputs(&mut instance, reached).deflections[4].to_degrees() - 0.1).abs() < 1e-12);
}

#[test]
fn oracle_dynamic_pressure_and_biases_of_aerodynamics_and_density() {
    let flaps = |scale: f64| {
        let mut instance = started(|instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.density_scale = scale;
            instance.parameters.aerodynamics_scale = scale;
            instance.command.surfaces[4] = 0.1;
            instance.command.surfaces[5] = 0.1;
        });
        step(&mut instance, 0.0, 1.0).unwrap();
        outputs(&mut instance, 1.0)
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
    for instance in [&mut plain, &mut commanded] {
        instance.input.moment = Vector3::new(1e4, -2e4, 3e4);
        step(instance, 0.0, 0.5).unwrap();
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
    let mut instance = in_model_exchange(DisturbanceKind::White);
    let held = outputs(&mut instance, 0.0).delta;
    for time in [0.01, 0.04, 0.041] {
        assert_eq!(outputs(&mut instance, time).delta, held);
    }
    assert_eq!(instance.new_discrete_states(0.04).unwrap().next_event_time, Some(0.08));
    assert_ne!(outputs(&mut instance, 0.04).delta, held);
}

#[test]
fn an_event_iteration_sees_the_latest_moment() {
    let mut instance =
        started(|instance| instance.parameters.kind = DisturbanceKind::AgainstMoment);
    instance.new_discrete_states(0.0).unwrap();
    let before = outputs(&mut instance, 0.0).delta;
    instance.input.moment = vehicle::kinematics::r_inverse(&instance.output.angles) * before * 1e7;
    instance.new_discrete_states(0.0).unwrap();
    assert_ne!(outputs(&mut instance, 0.0).delta, before);
    instance.input.moment = Vector3::zeros();
    instance.new_discrete_states(0.02).unwrap();
    assert_ne!(outputs(&mut instance, 0.02).delta, before, "between ticks the value is kept");
}

#[test]
fn oracle_input_derivatives_are_integrated() {
    // At beta = 0 a pitch moment k t alone gives q = k t² / 2 Iyy.
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.initial =
            Initial::new(Vector3::new(0.1, 0.0, 0.2), instance.parameters.initial.rates);
    });
    instance.step(0.0, 2.0, &Ramp(1e4), &mut |_| {}).unwrap();
    let exact = 1e4 * 2.0 * 2.0 / 2.0 / (1303212.0 * 1.05);
    assert!((outputs(&mut instance, 2.0).rates.y - exact).abs() < 1e-15);
}

#[test]
fn refusals_name_variables() {
    let changes: [fn(&mut ReentryPlant); 46] = [
        |instance| instance.parameters.inertia.Ixx = 0.0,
        |instance| instance.parameters.inertia.Ixz = 2e6,
        |instance| instance.parameters.inertia.Iyy = 1e7,
        |instance| instance.parameters.inertia_scale = 0.0,
        |instance| instance.parameters.initial.alpha = f64::NAN,
        |instance| instance.parameters.initial.beta = 1.6,
        |instance| instance.parameters.step = 0.0,
        |instance| instance.parameters.earth_rate = f64::NAN,
        |instance| instance.parameters.converter.delay = -1.0,
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.converter.delay = 0.1;
        },
        |instance| instance.parameters.converter.resolution = -1.0,
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.converter.resolution = 8.0;
        },
        |instance| {
            instance.parameters.actuation = Actuation::SurfacesAndJets;
            instance.parameters.aerodynamics_scale = -1.0;
        },
        |instance| instance.parameters.flight.altitude = 1e5,
        |instance| instance.parameters.flight.mach = -1.0,
        |instance| instance.parameters.bound = -1.0,
        |instance| instance.parameters.period = 0.0,
        |instance| instance.parameters.square_period = 0.0,
        |instance| instance.parameters.direction.x = 2.0,
        |instance| instance.parameters.end = -1.0,
        |instance| instance.parameters.waves[0].phase = f64::NAN,
        |instance| instance.parameters.table.used = 9,
        |instance| instance.parameters.table.period = -1.0,
        |instance| tabulate(instance, 0.0, &[(-1.0, [0.0; 3])]),
        |instance| tabulate(instance, 0.0, &[(1.0, [0.0; 3]), (1.0, [0.0; 3])]),
        |instance| tabulate(instance, 2.0, &[(0.0, [0.0; 3]), (1.0, [0.0; 3]), (2.0, [0.0; 3])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0; 3]), (1.0, [2.0, 0.0, 0.0])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0, -2.0, 0.0])]),
        |instance| tabulate(instance, 0.0, &[(0.0, [0.0, 0.0, f64::NAN])]),
        |instance| instance.parameters.sensing.surroundings.gravity = -1.0,
        |instance| instance.parameters.sensing.surroundings.field.x = f64::NAN,
        |instance| {
            instance.parameters.sensing.calibrates = true;
            instance.parameters.sensing.sequence.beta_amplitude = 1.5;
        },
        |instance| {
            instance.parameters.sensing.calibrates = true;
            instance.parameters.sensing.sequence.alpha_rate = f64::NAN;
        },
        |instance| instance.parameters.sensing.line.period = 0.0,
        |instance| instance.parameters.sensing.line.delay = 1e3,
        |instance| instance.parameters.sensing.line.drop_probability = 2.0,
        |instance| instance.parameters.sensing.triads[0].noise = -1.0,
        |instance| instance.parameters.sensing.triads[1].bandwidth = -1.0,
        |instance| instance.parameters.sensing.triads[2].range = -1.0,
        |instance| instance.parameters.sensing.triads[2].resolution = -1.0,
        |instance| instance.parameters.sensing.triads[0].matrix.fill(f64::NAN),
        |instance| instance.parameters.sensing.triads[1].bias.fill(f64::NAN),
        |instance| instance.parameters.sensing.triads[1].drift.fill(f64::NAN),
        |instance| instance.parameters.sensing.turntable.bandwidth = -1.0,
        |instance| instance.parameters.sensing.turntable.rate = -1.0,
        |instance| {
            instance.parameters.sensing.sensor_set = 0;
            instance.parameters.sensing.turntable.bandwidth = 10.0;
        },
    ];
    let refusal = |set: &fn(&mut ReentryPlant)| {
        let mut instance = ReentryPlant::new();
        instance.parameters.sensing.sensor_set = 2;
        set(&mut instance);
        instance.initialize(&CONTEXT).unwrap_err().to_string()
    };
    let actual: Vec<String> = changes.iter().map(refusal).collect();
    let expected: Vec<&str> = include_str!("tests/messages.txt").lines().collect();
    assert_eq!(actual, expected);
}

#[test]
fn impossible_parameters_are_refused_by_name() {
    let refusal = |set: fn(&mut ReentryPlant)| {
        let mut instance = ReentryPlant::new();
        set(&mut instance);
        instance.initialize(&CONTEXT).unwrap_err().to_string()
    };
    for (message, name) in [
        (refusal(|instance| instance.parameters.inertia.Ixx = 0.0), "inertia.Ixx"),
        (refusal(|instance| instance.parameters.inertia.Ixz = 2e6), "inertia.Ixz"),
        (refusal(|instance| instance.parameters.inertia.Iyy = 1e7), "inertia.Iyy"),
        (refusal(|instance| instance.parameters.end = -1.0), "disturbance.end"),
        (refusal(|instance| instance.parameters.flight.altitude = 1e5), "flight.altitude"),
    ] {
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn a_singular_attitude_is_an_error_in_co_simulation_and_discarded_in_model_exchange() {
    let mut singular = [0.0; 14];
    singular[1] = 1.6;
    let mut instance = in_model_exchange(DisturbanceKind::None);
    instance.set_continuous_states(&singular);
    assert!(
        matches!(instance.calculate(0.1, LastEvent::InputSet), Err(Failure::Discard(text)) if text.contains("singular"))
    );
    let mut instance = started(|_| {});
    instance.set_continuous_states(&singular);
    assert!(
        matches!(instance.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("singular"))
    );
    let mut instance = started(|instance| {
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.inertia.Ixz = 0.0;
        instance.parameters.initial =
            Initial::new(Vector3::new(0.0, 1.5, 0.0), instance.parameters.initial.rates);
        instance.parameters.initial.rates = Vector3::new(0.0, 0.0, -0.5);
    });
    assert!(
        matches!(step(&mut instance, 0.0, 1.0), Err(Failure::Error(text)) if text.contains("beta"))
    );
}

#[test]
fn a_wrong_moment_is_an_error_and_the_instance_starts_again() {
    let mut instance = started(|_| {});
    instance.input.moment.x = f64::NAN;
    assert!(
        matches!(instance.calculate(0.0, LastEvent::InputSet), Err(Failure::Error(text)) if text.contains("moment"))
    );
    assert!(
        matches!(step(&mut instance, 0.0, 0.04), Err(Failure::Error(text)) if text.contains("moment"))
    );
    instance.input.moment.x = 0.0;
    instance.initialize(&CONTEXT).unwrap();
    step(&mut instance, 0.0, 0.04).unwrap();
}

#[test]
fn before_initialization_it_says_so() {
    let mut instance = ReentryPlant::new();
    assert!(
        instance
            .calculate(0.0, LastEvent::InputSet)
            .unwrap_err()
            .to_string()
            .contains("initialized")
    );
    assert!(step(&mut instance, 0.0, 1.0).is_err());
    assert!(instance.new_discrete_states(0.0).is_err());
}

#[test]
fn outputs_need_no_start_and_inputs_have_one() {
    for variable in describe::<ReentryPlant>().variables {
        let VariableKind::Real { start, unit, .. } = &variable.kind else { continue };
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
    started(|instance| instance.parameters.converter.delay = delay)
}

#[test]
fn oracle_a_delayed_moment_is_shown_when_it_acts() {
    let mut instance = delayed(0.1);
    let pitch = |k: u32| Vector3::new(0.0, 1e4 * f64::from(k + 1), 0.0);
    for k in 0..20_u32 {
        let time = 0.04 * f64::from(k);
        instance.input.moment = pitch(k);
        // The delay of 0.1 s is two and a half steps.
        let acts = if k < 3 { Vector3::zeros() } else { pitch(k - 3) };
        assert_eq!(outputs(&mut instance, time).applied_moment, acts, "{k}");
        step(&mut instance, time, time + 0.04).unwrap();
    }
}

#[test]
fn moments_under_way_are_part_of_the_saved_state() {
    let mut instance = delayed(0.117);
    let mut restored: Option<ReentryPlant> = None;
    for k in 0..20_u32 {
        let time = 0.04 * f64::from(k);
        for instance in std::iter::once(&mut instance).chain(restored.as_mut()) {
            instance.input.moment = Vector3::new(1e4 * time.sin(), -1e4 * time.cos(), 5e3);
            step(instance, time, time + 0.04).unwrap();
        }
        if k == 7 {
            restored =
                Some(serde_json::from_str(&serde_json::to_string(&instance).unwrap()).unwrap());
        }
    }
    assert_eq!(outputs(&mut instance, 0.8), outputs(&mut restored.unwrap(), 0.8));
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
    let mut converted = started(|instance| instance.parameters.converter.resolution = 8.0);
    let in_model_exchange = text(converted.new_discrete_states(0.0).unwrap_err());
    assert!(in_model_exchange.contains("actuation.resolution = 8 N m"), "{in_model_exchange}");
    let mut actuated = ReentryPlant::new();
    actuated.parameters.converter.delay = 0.1;
    actuate(&mut actuated);
    let actuated = text(actuated.initialize(&CONTEXT).unwrap_err());
    assert!(actuated.contains("actuation.delay"), "{actuated}");
}
