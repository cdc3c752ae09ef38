//! Tests of the FMUs through the trait that the FMI shell uses.

mod messages;
mod own_vehicle;

use crate::crmpc::CrmpcLaw;
use crate::dlmpc::DlmpcLaw;
use crate::lqr::LqrLaw;
use crate::tvsmc::{self, TvsmcLaw};
use crate::{BtvsmcDo, Crmpc, Dlmpc, Lqr};
use controller_export::reference::Choice;
use controller_export::{ControllerFmu, Law};
use fmi_export::{Context, Failure, Inputs, LastEvent, Model};
use nalgebra::Vector3;
use vehicle::Scenario;
use vehicle::reference::Reference;

/// Inputs that stay constant.
struct Held;

impl<M> Inputs<M> for Held {
    fn advance(&self, _model: &mut M, _time: f64) {}
    fn are_extrapolated(&self) -> bool {
        false
    }
    fn integrate(&self, _model: &mut M, _from: f64, _to: f64) -> Result<(), Failure> {
        unreachable!("sampled instances have no states")
    }
}

fn context() -> Context<'static> {
    Context { start_time: 0.0, stop_time: None, resources: None }
}

fn ready<M: Model>(change: impl FnOnce(&mut M)) -> M {
    let mut instance = M::new();
    change(&mut instance);
    instance.initialize(&context()).unwrap();
    instance
}

fn step<M: Model>(instance: &mut M, from: f64, to: f64) {
    // Inputs that jump contradict the assumptions of CRMPC, and no command explains them. Steps are
    // longer than a period.
    let expected = ["the guarantee is", "another loop delay", "a tick within a step"];
    let is_expected = |text: &str| expected.iter().any(|part| text.contains(part));
    instance.step(from, to, &Held, &mut |text| assert!(is_expected(text), "{text}")).unwrap();
    instance.calculate(to, LastEvent::InputSet).unwrap();
}

fn refusal<M: Model>(change: impl FnOnce(&mut M)) -> String {
    let mut instance = M::new();
    change(&mut instance);
    match instance.initialize(&context()) {
        Err(failure) => failure.to_string(),
        Ok(()) => String::new(),
    }
}

/// Asserts that the moments of every optimisation period are the same, in however many of these
/// `parts` it is stepped.
fn assert_any_communication_steps_give_the_same_moments<L: Law>(delay: f64, parts: &[u32]) {
    let moments = |parts: u32| -> Vec<_> {
        let mut instance =
            ready(|instance: &mut ControllerFmu<L>| instance.parameters.latency.action = delay);
        let mut period = |k: u32| {
            let at = |part: u32| (f64::from(k) + f64::from(part) / f64::from(parts)) * 0.2;
            (0..parts).for_each(|part| step(&mut instance, at(part), at(part + 1)));
            instance.output.moment
        };
        (0..10).map(&mut period).collect()
    };
    for more in &parts[1..] {
        assert_eq!(moments(*more), moments(parts[0]), "{more} steps of an optimisation period");
    }
}

#[test]
fn any_communication_steps_give_the_same_moments() {
    for delay in [0.0_f64, 0.117] {
        // Beyond 0.053 s the guarantee cannot be given. CRMPC judges measurements of the present,
        // which repeat here although the rates are not 0, and plans by its judgement. Those of a
        // longer step are known to be old, and judged by nothing.
        for parts in [[1, 3], [5, 10]] {
            let within = delay.min(0.05);
            assert_any_communication_steps_give_the_same_moments::<CrmpcLaw>(within, &parts);
        }
        let parts = [1, 3, 5, 10];
        assert_any_communication_steps_give_the_same_moments::<DlmpcLaw>(delay, &parts);
        assert_any_communication_steps_give_the_same_moments::<TvsmcLaw<tvsmc::SotvsmcDo>>(
            delay, &parts,
        );
    }
}

/// A law that is stepped as its FMU proposes sees every measurement. Longer steps are told, once.
#[test]
fn ticks_with_old_inputs_are_told() {
    fn told<L: Law>() {
        let period = L::period(&L::settings());
        assert_eq!(
            <ControllerFmu<L>>::description().default_experiment.step,
            period,
            "{}",
            L::NAME
        );
        for (length, expected) in
            [(period, 0), (period / 2.0, 0), (1.25 * period, 1), (4.0 * period, 1)]
        {
            let mut instance: ControllerFmu<L> = ready(|_| ());
            let mut count = 0;
            for k in 0..20 {
                let [from, to] = [f64::from(k), f64::from(k + 1)].map(|k| k * length);
                let mut log =
                    |text: &str| count += i32::from(text.contains("a tick within a step"));
                instance.step(from, to, &Held, &mut log).unwrap();
            }
            assert_eq!(count, expected, "{}: {length} s", L::NAME);
        }
    }
    told::<CrmpcLaw>();
    told::<DlmpcLaw>();
    told::<LqrLaw>();
    told::<TvsmcLaw<tvsmc::SotvsmcDo>>();
}

#[test]
fn moments_are_held_between_ticks() {
    let mut instance: Lqr = ready(|_| ());
    step(&mut instance, 0.0, 0.05);
    let held = instance.output.moment;
    instance.input.angles *= 2.0;
    step(&mut instance, 0.05, 0.07);
    assert_eq!(instance.output.moment, held);
    step(&mut instance, 0.07, 0.08);
    assert_ne!(instance.output.moment, held);
}

#[test]
fn the_external_reference_is_followed() {
    let moment = |delay: f64, change: fn(&mut Reference)| {
        let mut instance: Lqr = ready(|instance: &mut Lqr| {
            instance.parameters.reference.profile = Choice::External;
            instance.parameters.latency.action = delay;
        });
        let angles = instance.input.angles;
        instance.input.reference = Reference { angles, ..Reference::default() };
        change(&mut instance.input.reference);
        instance.calculate(0.0, LastEvent::InputSet).unwrap();
        assert!(delay > 0.0 || instance.output.reference == instance.input.reference);
        instance.output.moment
    };
    for delay in [0.0, 0.1] {
        assert_eq!(moment(delay, |_| ()), Vector3::zeros(), "at rest on the reference");
        // A positive error of alpha requires a pitch-up moment, and so does its acceleration.
        assert!(moment(delay, |reference| reference.angles.x += 0.01).y > 0.0);
        assert!(moment(delay, |reference| reference.accelerations.x = 0.01).y > 0.0);
    }
}

#[test]
fn the_achieved_moment_counts_only_if_it_is_used() {
    let after = |used: bool, achieved: f64| {
        let mut instance: BtvsmcDo = ready(|instance: &mut BtvsmcDo| {
            instance.settings.law.achieved_moment_used = used;
            instance.input.achieved_moment = Vector3::repeat(achieved);
        });
        instance.calculate(0.0, LastEvent::InputSet).unwrap();
        step(&mut instance, 0.0, 0.1);
        instance.output.moment
    };
    assert_eq!(after(false, 0.0), after(false, 1e5));
    assert_ne!(after(true, 0.0), after(true, 1e5));
    assert_ne!(after(true, 0.0), after(false, 0.0));
}

#[test]
fn a_time_budget_of_any_length_is_accepted() {
    for budget in [1e9, 1e19, 1e300, f64::MAX] {
        let mut crmpc = ready(|crmpc: &mut Crmpc| crmpc.settings.solver.time_budget = budget);
        let mut dlmpc = ready(|dlmpc: &mut Dlmpc| dlmpc.settings.solver.time_budget = budget);
        crmpc.calculate(0.0, LastEvent::InputSet).unwrap();
        dlmpc.calculate(0.0, LastEvent::InputSet).unwrap();
        assert!(crmpc.output.moment.norm() > 0.0 && dlmpc.output.moment.norm() > 0.0, "{budget} s");
    }
}

/// The law sees rates relative to the trajectory at its inputs, Wu 2015 (1).
#[test]
fn oracle_a_known_trajectory_is_taken_out_of_the_rates() {
    let told = |rate: f64, rates: Vector3<f64>| {
        let mut instance = ready::<Lqr>(|instance| {
            let input = &mut instance.input;
            input.rates = rates;
            input.trajectory.heading = 0.7;
            input.trajectory.flight_path_angle = -0.02;
            input.trajectory.heading_rate = rate;
        });
        instance.calculate(0.0, LastEvent::InputSet).unwrap();
        instance.output.moment
    };
    let (rates, rate) = (Vector3::new(0.02, -0.01, 0.03), 0.006);
    let angles = Scenario::crmpc2022().initial_angles;
    // A heading that turns, with the cosine of the flight path angle, turns the trajectory's axes
    // about the axis down.
    let turn = Vector3::new(-rate * (-0.02_f64).sin(), 0.0, rate * (-0.02_f64).cos());
    let known = vehicle::kinematics::Kinematics::Printed.turn(&angles) * turn;
    let relative = rates + vehicle::kinematics::r_inverse(&angles) * known;
    let (with, expected) = (told(rate, rates), told(0.0, relative));
    assert!((with - expected).amax() < 1e-9 * expected.amax(), "{with} {expected}");
    assert!((with - told(0.0, rates)).amax() > 1e3);
}

#[test]
fn oracle_a_known_moment_is_left_out_of_the_command_before_its_limit() {
    let told = |known: Vector3<f64>, saturation: bool| {
        let mut instance = ready::<Lqr>(|instance| {
            instance.input.known_moment = known;
            instance.parameters.saturation = saturation;
        });
        instance.calculate(0.0, LastEvent::InputSet).map(|()| instance.output.moment)
    };
    let free = told(Vector3::zeros(), false).unwrap();
    let limit = ready::<Lqr>(|_| ()).parameters.limit_moment;
    for known in [Vector3::zeros(), Vector3::new(9e4, -4e4, 2e4)] {
        let rest = free - known;
        assert!(rest.norm() > limit);
        assert!((told(known, false).unwrap() - rest).amax() < 1e-9 * free.amax());
        let expected = rest * (limit / rest.norm());
        assert!((told(known, true).unwrap() - expected).amax() < 1e-9 * limit);
    }
    let Err(Failure::Error(text)) = told(Vector3::repeat(f64::NAN), true) else {
        panic!("accepted")
    };
    assert!(text.contains("not finite"), "{text}");
}
