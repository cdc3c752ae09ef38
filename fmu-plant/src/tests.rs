//! The unit through the interface that the shell uses.

use crate::plant::{Output, ReentryPlant};
use crate::table::{Known, Unknown};
use fmi2_export::{Context, Failure, Inputs, Model, describe};
use model_description::variable::{Causality, Kind};
use nalgebra::Vector3;
use vehicle::Scenario;

const CONTEXT: Context = Context { start_time: 0.0, stop_time: None, resources: None };

/// Inputs that the importer gave no derivatives for.
struct Constant;

impl Inputs<ReentryPlant> for Constant {
    fn advance(&self, _: &mut ReentryPlant, _: f64) {}
}

/// A pitch moment that rises with time.
struct Ramp(f64);

impl Inputs<ReentryPlant> for Ramp {
    fn advance(&self, model: &mut ReentryPlant, time: f64) {
        model.input.moment.y = self.0 * time;
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
    unit.calculate(time).unwrap();
    unit.output
}

/// The calculated variables in the order of the table.
fn calculated(unit: &mut ReentryPlant, time: f64) -> Vec<f64> {
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
    all.iter().flatten().copied().collect()
}

#[test]
fn positions_and_names_agree() {
    let names: Vec<String> =
        describe::<ReentryPlant>().variables.into_iter().map(|variable| variable.name).collect();
    for (position, name) in names.iter().enumerate() {
        let group = name.split('.').next().unwrap();
        let unknown = match Unknown::of(position) {
            Some(Unknown::State(0..3)) => "attitude",
            Some(Unknown::State(_)) => "rate",
            Some(Unknown::Derivative(0..3)) => "attitudeRate",
            Some(Unknown::Derivative(_)) => "angularAcceleration",
            Some(Unknown::AppliedMoment(_)) => "appliedMoment",
            Some(Unknown::Delta | Unknown::DisturbanceMoment(_)) => "disturbance",
            None => match Known::of(position) {
                Some(Known::Moment(_)) => "moment",
                Some(Known::DisturbanceMoment(_)) => "disturbanceMoment",
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
}

#[test]
fn the_description_holds() {
    let description = describe::<ReentryPlant>();
    description.check().unwrap();
    assert_eq!(description.states(), [(0, 6), (1, 7), (2, 8), (3, 9), (4, 10), (5, 11)]);
    let scenario = Scenario::crmpc2022();
    let start = |name: &str| match &description.variables[description.position(name).unwrap()].kind {
        Kind::Real { start, .. } => start.unwrap(),
        Kind::Integer { start, .. } | Kind::Enumeration { start, .. } => f64::from(start.unwrap()),
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
    ] {
        assert_eq!(start(name), value, "{name}");
    }
    let described = |text: &str| text.len() > 8 && text.starts_with(|c: char| c.is_ascii_uppercase());
    for variable in &description.variables {
        assert!(described(&variable.description), "{}: {}", variable.name, variable.description);
    }
}

/// A unit in model exchange, after the first event, in a general attitude, with all kinds in turn.
fn in_model_exchange(kind: i32) -> ReentryPlant {
    let mut unit = started(|unit| unit.parameters.kind = kind);
    unit.input.moment = Vector3::new(3e4, -2e4, 1e4);
    unit.input.disturbance_moment = Vector3::new(1e3, 2e3, -3e3);
    unit.set_continuous_states(&[0.3, 0.2, -0.5, 0.08, -0.05, 0.06]);
    unit.new_discrete_states(0.0).unwrap();
    unit
}

fn known_positions() -> impl Iterator<Item = usize> {
    (0..27).filter(|&position| Known::of(position).is_some())
}

/// Adds to a state or input by its position in the table.
fn nudge(unit: &mut ReentryPlant, known: usize, by: f64) {
    match Known::of(known).unwrap() {
        Known::State(i) => {
            let mut states = [0.0; 6];
            unit.continuous_states(&mut states);
            states[i] += by;
            unit.set_continuous_states(&states);
        }
        Known::Moment(i) => unit.input.moment[i] += by,
        Known::DisturbanceMoment(i) => unit.input.disturbance_moment[i] += by,
    }
}

#[test]
fn oracle_partial_derivatives_against_differences_and_declared_dependencies() {
    let description = describe::<ReentryPlant>();
    for kind in 1..=7 {
        for known in known_positions() {
            let by = if known < 6 { 1e-5 } else { 1e3 };
            let mut unit = in_model_exchange(kind);
            nudge(&mut unit, known, by);
            let above = calculated(&mut unit, 0.02);
            nudge(&mut unit, known, -2.0 * by);
            let below = calculated(&mut unit, 0.02);
            nudge(&mut unit, known, by);
            let known_name = &description.variables[known].name;
            for (unknown, (above, below)) in above.iter().zip(&below).enumerate() {
                let exact = unit.partial_derivative(0.02, unknown, known).unwrap();
                let numeric = (above - below) / (2.0 * by);
                let variable = &description.variables[unknown];
                assert!(
                    (numeric - exact).abs() < 1e-9,
                    "{} by {known_name}: {exact}, not {numeric}",
                    variable.name
                );
                if exact != 0.0 && unknown != known {
                    assert!(
                        variable.dependencies.contains(known_name),
                        "{} depends on {known_name}",
                        variable.name
                    );
                }
            }
        }
    }
}

#[test]
fn derivatives_by_parameters_are_refused() {
    let mut unit = in_model_exchange(1);
    for (unknown, known) in [(6, 27), (6, 6), (27, 0), (21, 21)] {
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
    // At rest ω̇ = R⁻¹ Δ
    let expected = vehicle::kinematics::r_inverse(&output.angles) * output.delta;
    assert!((output.angular_acceleration - expected).amax() < 1e-15);
}

#[test]
fn at_a_tick_the_outputs_show_the_disturbance_of_the_step_to_come() {
    for kind in [2, 6, 7] {
        let mut unit = started(|unit| unit.parameters.kind = kind);
        unit.input.moment = Vector3::new(1e4, -1e4, 1e4);
        step(&mut unit, 0.0, 0.04).unwrap();
        unit.input.moment *= -1.0;
        let announced = outputs(&mut unit, 0.04).delta;
        step(&mut unit, 0.04, 0.08 - 1e-6).unwrap();
        assert_eq!(outputs(&mut unit, 0.08 - 1e-6).delta, announced, "kind {kind}");
    }
}

#[test]
fn looking_changes_nothing() {
    let [mut looked_at, mut left_alone] = [0, 1].map(|_| started(|unit| unit.parameters.kind = 7));
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

/// Model exchange with an accurate integrator between the events, against co-simulation.
#[test]
fn oracle_model_exchange_agrees_with_co_simulation() {
    for kind in 1..=7 {
        let set = |unit: &mut ReentryPlant| {
            unit.parameters.kind = kind;
            unit.parameters.start = 0.3;
            unit.parameters.end = 1.7;
            unit.parameters.square_period = 0.9;
            unit.input.moment = Vector3::new(2e4, -1e4, 1e4);
        };
        let [mut cs, mut me] = [0, 1].map(|_| started(set));
        for k in 0..50 {
            step(&mut cs, 0.04 * f64::from(k), 0.04 * f64::from(k + 1)).unwrap();
        }
        let mut time = 0.0;
        let mut events = 0;
        while time < 2.0 {
            let next = me.new_discrete_states(time).unwrap().next_event_time.unwrap_or(2.0).min(2.0);
            events += 1;
            let mut y = nalgebra::Vector6::zeros();
            me.continuous_states(y.as_mut_slice());
            let steps = vehicle::integrator::equal_steps(next - time, 0.001);
            let h = (next - time) / steps as f64;
            for i in 0..steps {
                let mut f = |t: f64, y: &nalgebra::Vector6<f64>| {
                    me.set_continuous_states(y.as_slice());
                    nalgebra::Vector6::from_column_slice(&calculated(&mut me, t)[6..12])
                };
                y = vehicle::integrator::rk4(&mut f, time + i as f64 * h, &y, h);
            }
            me.set_continuous_states(y.as_slice());
            time = next;
        }
        let (cs, me) = (outputs(&mut cs, 2.0), outputs(&mut me, 2.0));
        assert!((cs.angles - me.angles).amax() < 1e-11, "kind {kind}: {}", cs.angles - me.angles);
        assert!((cs.rates - me.rates).amax() < 1e-11, "kind {kind}: {}", cs.rates - me.rates);
        let expected = [1, 38, 3, 3, 6, 38, 38][kind as usize - 1];
        assert_eq!(events, expected, "kind {kind}");
    }
}

#[test]
fn between_events_the_disturbance_is_held_even_beyond_a_tick() {
    let mut unit = in_model_exchange(2);
    let held = outputs(&mut unit, 0.0).delta;
    for time in [0.01, 0.04, 0.041] {
        assert_eq!(outputs(&mut unit, time).delta, held);
    }
    assert_eq!(unit.new_discrete_states(0.04).unwrap().next_event_time, Some(0.08));
    assert_ne!(outputs(&mut unit, 0.04).delta, held);
}

#[test]
fn an_event_iteration_sees_the_latest_moment() {
    let mut unit = started(|unit| unit.parameters.kind = 7);
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
    // At beta = 0 a pitch moment k t alone gives q = k t² / 2 Iyy
    let mut unit = started(|unit| {
        unit.parameters.kind = 1;
        unit.parameters.initial_angles = Vector3::new(0.1, 0.0, 0.2);
    });
    unit.step(0.0, 2.0, &Ramp(1e4), &mut |_| {}).unwrap();
    let exact = 1e4 * 2.0 * 2.0 / 2.0 / (1303212.0 * 1.05);
    assert!((outputs(&mut unit, 2.0).rates.y - exact).abs() < 1e-15);
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
    ] {
        assert!(message.contains(name), "{message}");
    }
}

#[test]
fn a_singular_attitude_is_an_error_in_co_simulation_and_discarded_in_model_exchange() {
    let singular = [0.0, 1.6, 0.0, 0.0, 0.0, 0.0];
    let mut unit = in_model_exchange(1);
    unit.set_continuous_states(&singular);
    assert!(matches!(unit.calculate(0.1), Err(Failure::Discard(text)) if text.contains("singular")));
    let mut unit = started(|_| {});
    unit.set_continuous_states(&singular);
    assert!(matches!(unit.calculate(0.0), Err(Failure::Error(text)) if text.contains("singular")));
    let mut unit = started(|unit| {
        unit.parameters.kind = 1;
        unit.parameters.inertia.Ixz = 0.0;
        unit.parameters.initial_angles = Vector3::new(0.0, 1.5, 0.0);
        unit.parameters.initial_rates = Vector3::new(0.0, 0.0, -0.5);
    });
    assert!(matches!(step(&mut unit, 0.0, 1.0), Err(Failure::Error(text)) if text.contains("beta")));
}

#[test]
fn a_wrong_moment_is_an_error_and_the_unit_starts_again() {
    let mut unit = started(|_| {});
    unit.input.moment.x = f64::NAN;
    assert!(matches!(unit.calculate(0.0), Err(Failure::Error(text)) if text.contains("moment")));
    assert!(matches!(step(&mut unit, 0.0, 0.04), Err(Failure::Error(text)) if text.contains("moment")));
    unit.input.moment.x = 0.0;
    unit.initialize(&CONTEXT).unwrap();
    step(&mut unit, 0.0, 0.04).unwrap();
}

#[test]
fn before_initialization_it_says_so() {
    let mut unit = ReentryPlant::new();
    assert!(unit.calculate(0.0).unwrap_err().to_string().contains("initialized"));
    assert!(step(&mut unit, 0.0, 1.0).is_err());
    assert!(unit.new_discrete_states(0.0).is_err());
}

#[test]
fn outputs_need_no_start_and_inputs_have_one() {
    for variable in describe::<ReentryPlant>().variables {
        let Kind::Real { start, unit, .. } = &variable.kind else { continue };
        assert_eq!(start.is_none(), variable.causality == Causality::Output, "{}", variable.name);
        let plain = [
            "inertia.scale",
            "disturbance.direction.alpha",
            "disturbance.direction.beta",
            "disturbance.direction.sigma",
        ];
        assert_eq!(unit.is_none(), plain.contains(&variable.name.as_str()), "{}", variable.name);
    }
}
