use super::super::timer::fake::Fake;
use super::*;
use crate::interrupt::Request;

const MS: Duration = Duration::from_millis(1);

/// Paces components with these periods (ticks) through 10 ticks of 1 s at factor 100, that is,
/// of 10 ms. `work` gives the time (ms) that a component computes at a tick. Returns the report
/// and the instant at which each tick began, ms.
fn paced(
    on_miss: OnMiss,
    every: &[u32],
    jitter: Duration,
    work: impl Fn(usize, u64) -> u32,
) -> (Result<(), Error>, RealTime, Vec<u128>) {
    let timer = Rc::new(Fake { jitter, ..Fake::default() });
    // The origin of the timer differs from the start of the run.
    timer.pass(12345 * MS);
    let clock = Clock::new(5.0, 15.0, 1.0).unwrap();
    let settings = Settings { factor: "100".parse().unwrap(), on_miss };
    let spent: Vec<Rc<Spent>> = every.iter().map(|_| Rc::default()).collect();
    let components = ["controller", "plant"].into_iter().zip(every).zip(&spent);
    let components =
        components.map(|((name, every), spent)| (name.to_string(), *every, Rc::clone(spent)));
    let mut pacer = Pacer::new(settings, clock, timer.clone(), Interrupt::default(), components);
    let mut begins = Vec::new();
    let mut outcome = Ok(());
    for tick in 0..=clock.ticks() {
        pacer.wait(tick);
        begins.push(timer.now().as_millis() - 12345);
        for (index, (&every, spent)) in every.iter().zip(&spent).enumerate() {
            let every = u64::from(every);
            if tick.is_multiple_of(every) && tick + every <= clock.ticks() {
                let begin = timer.now();
                timer.pass(work(index, tick) * MS);
                spent.add(begin, timer.now());
            }
        }
        outcome = pacer.check(tick);
        // The observers take this time.
        timer.pass(MS);
        if outcome.is_err() {
            break;
        }
    }
    pacer.finish();
    (outcome, pacer.report(), begins)
}

fn near(value: f64, expected: f64) {
    assert!((value - expected).abs() <= 1e-3 * expected, "{value} {expected}");
}

#[test]
fn oracle_a_run_that_keeps_up_begins_every_tick_in_time() {
    let (outcome, report, begins) = paced(OnMiss::Stop, &[1, 1], Duration::ZERO, |_, _| 4);
    outcome.unwrap();
    assert_eq!(begins, (0..=10).map(|tick| tick * 10).collect::<Vec<_>>());
    assert_eq!((report.deadlines, report.misses, report.lag), (20, 0, Lag::default()));
    assert_eq!(report.done_about_it(), None);
    let plant = &report.components["plant"];
    assert_eq!(plant.step_ms.count, 10);
    near(plant.period_ms, 10.0);
    near(plant.step_ms.median, 4.0);
    // The controller computes for 4 ms before the plant does.
    near(plant.response_ms.max, 8.0);
    near(report.orchestrator_ms.median, 1.0);
    near(report.elapsed_s, 0.101);
}

#[test]
fn oracle_wake_up_jitter_is_measured_where_there_was_a_wait_and_adds_up_to_nothing() {
    let (_, report, begins) = paced(OnMiss::CatchUp, &[1, 5], 2 * MS, |_, _| 1);
    assert_eq!(begins[10], 102);
    let [controller, plant] =
        ["controller", "plant"].map(|name| report.components[name].wake_up_ms.clone());
    assert_eq!((controller.count, plant.count), (9, 1));
    near(controller.min, 2.0);
    near(controller.max, 2.0);
}

/// A component computes for 25 ms at tick 3 and for 1 ms otherwise.
fn one_long_step(_: usize, tick: u64) -> u32 {
    if tick == 3 { 25 } else { 1 }
}

#[test]
fn oracle_catching_up_returns_to_the_original_time_base() {
    let (outcome, report, begins) = paced(OnMiss::CatchUp, &[1], Duration::ZERO, one_long_step);
    outcome.unwrap();
    // Tick 3 is computed at 55 ms and observed at 56; the next two ticks end at 58 and 60,
    // after which there is time to wait.
    assert_eq!(begins, [0, 10, 20, 30, 56, 58, 60, 70, 80, 90, 100]);
    // The values of tick 3 came at 55 instead of 40 and those of tick 4 at 57 instead of 50;
    // those of tick 5, at 59, are in time.
    assert_eq!((report.misses, report.lag.late_starts), (2, 2));
    let [first, worst] = [report.first_miss.as_ref().unwrap(), report.worst_miss.as_ref().unwrap()];
    assert_eq!((first, first.component.as_str(), first.time), (worst, "controller", 8.0));
    near(first.late_ms, 15.0);
    near(report.lag.largest_ms, 16.0);
    assert_eq!(report.lag.at_end_ms, 0.0);
    near(report.elapsed_s, 0.101);
    assert!(
        report
            .done_about_it()
            .unwrap()
            .contains("2 times without waiting; at most 16.000 ms behind, 0.000 ms")
    );
}

#[test]
fn oracle_stopping_names_component_time_and_delay() {
    let (outcome, report, begins) = paced(OnMiss::Stop, &[1], Duration::ZERO, one_long_step);
    let message = outcome.unwrap_err().to_string();
    assert!(
        message.starts_with("controller missed its deadline at t = 8 s by 15.000 ms"),
        "{message}"
    );
    assert_eq!((begins.len(), report.misses), (4, 1));
}

#[test]
fn oracle_a_slow_component_has_the_time_to_its_own_next_tick_and_is_blamed_for_what_others_miss() {
    // The plant steps every 5 ticks of 10 ms and takes 25 ms, which is in time. The controller
    // steps at every tick, before it.
    let work = |index: usize, tick: u64| if index == 1 && tick == 5 { 25 } else { 1 };
    let (_, report, begins) = paced(OnMiss::CatchUp, &[1, 5], Duration::ZERO, work);
    assert_eq!(begins[5..9], [50, 77, 79, 81]);
    let [controller, plant] = ["controller", "plant"].map(|name| &report.components[name]);
    near(plant.period_ms, 50.0);
    assert_eq!((plant.misses, controller.misses, report.deadlines), (0, 1, 12));
    // The controller's values of tick 6, due at 70, came at 78.
    let miss = report.first_miss.unwrap();
    assert_eq!((miss.component.as_str(), miss.time), ("controller", 11.0));
    near(miss.late_ms, 8.0);
    // The communication point began at 77 ms.
    near(miss.lag_ms, 17.0);
    assert_eq!((miss.longest.as_str(), miss.longest_time), ("plant", 10.0));
    near(miss.longest_ms, 25.0);
}

#[test]
fn a_request_to_end_cuts_a_wait_short() {
    let timer = Rc::new(Fake::default());
    let settings = Settings { factor: "1e-300".parse().unwrap(), on_miss: OnMiss::CatchUp };
    let interrupt = Interrupt::default();
    let clock = Clock::new(0.0, 10.0, 1.0).unwrap();
    let mut pacer = Pacer::new(settings, clock, timer, interrupt.clone(), std::iter::empty());
    pacer.wait(0);
    interrupt.ask(Request::INTERRUPT);
    pacer.wait(1);
    assert_eq!(interrupt.asked(), Some(Request::INTERRUPT));
}
