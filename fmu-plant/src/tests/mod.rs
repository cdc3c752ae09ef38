//! Tests of the instance through the interface that the shell uses.

mod actuators;
mod dependencies;
mod entry;
mod model_exchange;
mod outputs;
mod own_vehicle;
mod prelude;
mod refusals;
mod sensors;

use fmi_export::{Context, Inputs};
use prelude::*;
use settings::Choice;
use vehicle::disturbance::Row;
use vehicle::effectors::Jets;

const CONTEXT: Context = Context { start_time: 0.0, stop_time: None, resources: None };

/// Inputs for which the importer gave no derivatives.
struct Constant;

impl Inputs<ReentryPlant> for Constant {
    fn advance(&self, _: &mut ReentryPlant, _: f64) {}
    fn are_extrapolated(&self) -> bool {
        false
    }
    fn integrate(&self, _: &mut ReentryPlant, _: f64, _: f64) -> Result<(), Failure> {
        unreachable!("the plant integrates its states itself")
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

/// Takes so many steps of a length (s) from 0 on. Returns what ends them, if anything.
fn fly(instance: &mut ReentryPlant, length: f64, steps: u32) -> Option<Failure> {
    let at = |k: u32| f64::from(k) * length;
    (0..steps).find_map(|k| step(instance, at(k), at(k + 1)).err())
}

fn outputs(instance: &mut ReentryPlant, time: f64) -> Output {
    instance.calculate(time, LastEvent::InputSet).unwrap();
    instance.output
}

/// A general attitude with general rates, and surfaces slightly away from zero.
const STATES: [f64; STATE_COUNT] = [
    0.3, 0.2, -0.5, 0.08, -0.05, 0.06, -0.01, -0.02, -0.01, -0.01, 0.01, -0.01, 0.01, 0.01, 55e3,
    0.2, -0.3, 3172.0, -0.02, 1.1,
];
/// Number of states: attitude, rates, deflections and motion.
const STATE_COUNT: usize = 20;

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

/// Sets the rows of the disturbance's table, and its period in s.
fn tabulate(parameters: &mut Parameters, period: f64, rows: &[(f64, [f64; 3])]) {
    parameters.table.period = period;
    parameters.table.used = rows.len();
    for (row, &(time, direction)) in parameters.table.rows.iter_mut().zip(rows) {
        *row = Row { time, direction: direction.into() };
    }
}

fn delayed(delay: f64) -> ReentryPlant {
    started(|instance| instance.parameters.converter.delay = delay)
}
