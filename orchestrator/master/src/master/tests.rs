use super::*;
use crate::description::Carrier;
use crate::instance::{Instance, Outcome};
use crate::quantity::Scaling;
use std::cell::RefCell;
use std::rc::Rc;

type Journal = Rc<RefCell<Vec<String>>>;

/// Variable 0 is the input and variable 1 the output. A `gain` has direct feedthrough: output =
/// 2 · input. The output of an `integrator` is its state, which grows by h · input at each
/// step. Both refuse to be read between setting and stepping, as FMI 2.0.5, section 4.2.1, allows.
struct Mock {
    name: &'static str,
    direct: bool,
    /// Whether initialization has ended, and whether an input was set since the last step.
    runs: bool,
    is_set: bool,
    input: f64,
    state: f64,
    kept: Vec<[f64; 2]>,
    fails_after: f64,
    journal: Journal,
}

impl Mock {
    fn note(&self, what: &str) {
        self.journal.borrow_mut().push(format!("{} {what}", self.name));
    }
}

impl Instance for Mock {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        assert!(!(self.runs && self.is_set), "{} is read after it was set", self.name);
        for (reference, value) in references.iter().zip(values.iter_mut()) {
            *value = match (reference, self.direct) {
                (0, _) => self.input,
                (_, true) => 2.0 * self.input,
                (_, false) => self.state,
            };
        }
        Ok(())
    }
    fn get_integer(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
        unreachable!("no such variables")
    }
    fn get_boolean(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
        unreachable!("no such variables")
    }
    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        assert_eq!(references, [0]);
        self.input = values[0];
        self.is_set = true;
        self.note(&format!("set {}", self.input));
        Ok(())
    }
    fn set_integer(&mut self, _: &[u32], _: &[i32]) -> Outcome {
        unreachable!("no such variables")
    }
    fn set_boolean(&mut self, _: &[u32], _: &[i32]) -> Outcome {
        unreachable!("no such variables")
    }
    fn set_string(&mut self, _: u32, _: &str) -> Outcome {
        unreachable!("no such variables")
    }
    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        self.note(&format!("enter {start}..{stop}"));
        Ok(())
    }
    fn exit_initialization(&mut self) -> Outcome {
        (self.runs, self.is_set) = (true, false);
        self.note("exit");
        Ok(())
    }
    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        if time >= self.fails_after {
            return Err(CallFailure::new("doStep", "out of propellant"));
        }
        self.state += step * self.input;
        self.is_set = false;
        self.note(&format!("step {time}+{step}"));
        Ok(())
    }
    fn terminate(&mut self) -> Outcome {
        self.note("terminate");
        Ok(())
    }
    fn reset(&mut self) -> Outcome {
        (self.input, self.state) = (0.0, 0.0);
        self.note("reset");
        Ok(())
    }
    fn save(&mut self, number: usize) -> Outcome {
        self.kept.truncate(number);
        self.kept.push([self.input, self.state]);
        Ok(())
    }
    fn restore(&mut self, number: usize) -> Outcome {
        [self.input, self.state] = self.kept[number];
        Ok(())
    }
}

fn port(component: usize, reference: u32) -> Port {
    Port { component, variable: reference as usize, reference, carrier: Carrier::Real }
}

fn wire(from: usize, to: usize) -> Wire {
    Wire { from: port(from, 1), to: port(to, 0), scaling: Scaling::default() }
}

/// Order of the loop, which has no delay.
const IN_ORDER: [&str; 2] = ["gain", "integrator"];

#[derive(Default)]
struct Rows(Vec<Vec<f64>>);

impl Watcher for Rows {
    type Error = Failed;

    fn after(&mut self, sample: &Sample, outcome: Result<(), Failed>) -> Result<(), Failed> {
        self.0.push([&[sample.time], sample.values].concat());
        outcome
    }
}

/// Returns the outcome of the run, rows of time, the gain's output and the integrator's input
/// and output, and the journal of calls.
fn run(
    coupling: Coupling,
    order: [&'static str; 2],
    every: [u32; 2],
    [step, stop]: [f64; 2],
    fails_after: f64,
) -> (Result<(), Failed>, Vec<Vec<f64>>, Vec<String>) {
    let clock = Clock::new(0.0, stop, step).unwrap();
    let (mut master, journal) = master(clock, coupling, order, every, fails_after);
    let mut rows = Rows::default();
    let outcome = master.initialize().and_then(|()| master.run(&mut rows));
    let journal = journal.borrow().clone();
    (outcome, rows.0, journal)
}

fn master(
    clock: Clock,
    coupling: Coupling,
    order: [&'static str; 2],
    every: [u32; 2],
    fails_after: f64,
) -> (Master, Journal) {
    let journal = Journal::default();
    let members = order
        .iter()
        .zip(every)
        .map(|(&name, every)| {
            let direct = name == "gain";
            let state = if direct { 0.0 } else { 1.0 };
            let mock = Mock {
                name,
                direct,
                runs: false,
                is_set: false,
                input: 0.0,
                state,
                kept: Vec::new(),
                fails_after,
                journal: Rc::clone(&journal),
            };
            let name = name.to_string();
            Member { name, every, varies: true, instance: Box::new(mock) }
        })
        .collect();
    let gain = order.iter().position(|name| *name == "gain").unwrap();
    let integrator = 1 - gain;
    let of_gain = match coupling {
        Coupling::Sequential => Reading::AfterStep,
        Coupling::Jacobi => Reading::BeforeStep,
    };
    let wires = [(wire(integrator, gain), Reading::BeforeStep), (wire(gain, integrator), of_gain)];
    let probes = [
        (port(gain, 1), Reading::AfterStep),
        (port(integrator, 0), Reading::AfterStep),
        (port(integrator, 1), Reading::BeforeStep),
    ];
    (Master::new(clock, coupling, members, &wires, &probes), journal)
}

#[test]
fn oracle_sequential_coupling_in_the_order_of_the_loop_has_no_delay() {
    let (outcome, rows, _) = run(Coupling::Sequential, IN_ORDER, [1, 1], [1.0, 3.0], 1e9);
    outcome.unwrap();
    // The state follows x⁺ = x + 2x, and the moment recorded in each row belongs to the state
    // of that row. At the stop time no step begins, and the moment is that of the last step.
    let expected = [
        [0.0, 2.0, 2.0, 1.0],
        [1.0, 6.0, 6.0, 3.0],
        [2.0, 18.0, 18.0, 9.0],
        [3.0, 18.0, 18.0, 27.0],
    ];
    assert_eq!(rows, expected);
}

/// Rows of a loop with a delay of one step: the integrator receives 2·x of the tick before, and at
/// tick 0 the gain's output 2·x₀ of the initialization.
const DELAYED: [[f64; 4]; 4] =
    [[0.0, 2.0, 2.0, 1.0], [1.0, 6.0, 2.0, 3.0], [2.0, 10.0, 6.0, 5.0], [3.0, 10.0, 6.0, 11.0]];

#[test]
fn oracle_jacobi_and_the_other_order_delay_by_one_step() {
    let other = ["integrator", "gain"];
    for (coupling, order) in
        [(Coupling::Sequential, other), (Coupling::Jacobi, other), (Coupling::Jacobi, IN_ORDER)]
    {
        let (outcome, rows, _) = run(coupling, order, [1, 1], [1.0, 3.0], 1e9);
        outcome.unwrap();
        assert_eq!(rows, DELAYED, "{coupling:?} {order:?}");
    }
}

#[test]
fn a_run_goes_back_to_any_tick_and_an_opened_input_gets_what_it_is_given() {
    let clock = Clock::new(0.0, 20.0, 1.0).unwrap();
    for coupling in [Coupling::Sequential, Coupling::Jacobi] {
        for (order, every) in [
            (["gain", "integrator"], [1, 1]),
            (["integrator", "gain"], [1, 1]),
            (["gain", "integrator"], [1, 2]),
            (["gain", "integrator"], [3, 1]),
        ] {
            let (mut master, _) = master(clock, coupling, order, every, 1e9);
            master.initialize().unwrap();
            let input = port(order.iter().position(|name| *name == "integrator").unwrap(), 0);
            // A slow unit is within a step at some of these ticks.
            for tick in 0..5 {
                master.keep(tick, tick as f64).unwrap();
                master.advance(tick as u64).unwrap();
            }
            for first in 0..5 {
                let mut fly = |given: Option<&[f64]>| {
                    master.go_back(first, first as f64).unwrap();
                    let ticks = first as u64..first as u64 + 6;
                    let flown = ticks.clone().map(|tick| {
                        let given = given.map(|given| given[(tick - ticks.start) as usize]);
                        master.opened(input).given = given;
                        let row = master.advance(tick).unwrap().to_vec();
                        (row, master.opened(input).arrived)
                    });
                    flown.collect::<Vec<_>>().into_iter().unzip()
                };
                let (rows, arrived): (Vec<Vec<f64>>, Vec<f64>) = fly(None);
                assert_eq!(rows, fly(None).0);
                assert_eq!(rows, fly(Some(&arrived)).0);
                // The integrator does not move, and the gain's output stays in the end.
                let (still, arrived) = fly(Some(&[0.0; 6]));
                let last = still.last().unwrap();
                assert_eq!(arrived[5], 2.0 * last[2]);
                assert_eq!(still[3..], vec![still[5].clone(); 3]);
                assert!(rows[5][2] > last[2]);
            }
        }
    }
}

#[test]
fn units_are_set_stepped_and_read_in_this_order() {
    let (_, _, journal) = run(Coupling::Sequential, IN_ORDER, [1, 1], [1.0, 1.0], 1e9);
    let expected = [
        "gain enter 0..1",
        "integrator enter 0..1",
        "gain set 1",
        "integrator set 2",
        "gain exit",
        "integrator exit",
        "gain set 1",
        "gain step 0+1",
        "integrator set 2",
        "integrator step 0+1",
        "gain terminate",
        "integrator terminate",
    ];
    assert_eq!(journal, expected);
    let (_, _, journal) = run(Coupling::Jacobi, IN_ORDER, [1, 1], [1.0, 1.0], 1e9);
    assert_eq!(
        journal[6..10],
        ["gain set 1", "integrator set 2", "gain step 0+1", "integrator step 0+1"]
    );
}

#[test]
fn oracle_a_slow_unit_holds_its_outputs_and_shows_nothing_early() {
    let (outcome, rows, journal) = run(Coupling::Sequential, IN_ORDER, [1, 2], [1.0, 5.0], 1e9);
    outcome.unwrap();
    // The integrator has communication points at 0, 2 and 4 only, where x⁺ = x + 2·2x.
    let states: Vec<f64> = rows.iter().map(|row| row[3]).collect();
    assert_eq!(states, [1.0, 1.0, 5.0, 5.0, 25.0, 25.0]);
    let steps: Vec<&String> =
        journal.iter().filter(|line| line.starts_with("integrator step")).collect();
    assert_eq!(steps, ["integrator step 0+2", "integrator step 2+2"]);

    let (outcome, rows, _) = run(Coupling::Sequential, IN_ORDER, [2, 1], [1.0, 4.0], 1e9);
    outcome.unwrap();
    // The gain is sampled at 0, 2 and 4, and its output is held between.
    let held: Vec<f64> = rows.iter().map(|row| row[1]).collect();
    assert_eq!(held, [2.0, 2.0, 10.0, 10.0, 10.0]);
}

#[test]
fn a_failing_unit_is_named_with_time_and_words_and_the_rows_stay() {
    let (outcome, rows, _) = run(Coupling::Sequential, IN_ORDER, [1, 1], [1.0, 5.0], 2.0);
    let failure = CallFailure::new("doStep", "out of propellant");
    assert_eq!(outcome, Err(Failed { component: "gain".into(), time: 2.0, failure }));
    assert_eq!(rows.len(), 3);
}

proptest::proptest! {
    /// Instances that all step at every n-th tick give the same results as at every tick of a clock
    /// n times slower.
    #[test]
    fn oracle_equal_periods_are_a_slower_clock(n in 1u32..6, periods in 1u32..6, jacobi: bool, swap: bool) {
        let coupling = if jacobi { Coupling::Jacobi } else { Coupling::Sequential };
        let order = if swap { ["integrator", "gain"] } else { ["gain", "integrator"] };
        let stop = f64::from(n * periods) * 0.25;
        let (_, fine, _) = run(coupling, order, [n, n], [0.25, stop], 1e9);
        let (_, coarse, _) = run(coupling, order, [1, 1], [0.25 * f64::from(n), stop], 1e9);
        let sampled: Vec<Vec<f64>> = fine.into_iter().step_by(n as usize).collect();
        proptest::prop_assert_eq!(sampled, coarse);
    }
}
