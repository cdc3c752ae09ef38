//! Generated units for model exchange, whose events are those of their exact solutions.

use crate::bench::Random;
use crate::prelude::*;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Length of a run, s.
const SPAN: f64 = 2.0;
/// Number of event times that a unit keeps.
const KEPT: usize = 6;
const PARAMETERS: &str = "family action announcement begin speed rate aim threshold sign period";

/// A unit with the times since the start at which its events must come, each with the error (s)
/// that the rounding of its states may make.
struct Unit {
    values: [f64; Unit::VALUES],
    events: Vec<(f64, f64)>,
}

impl Unit {
    /// Number of its parameters.
    const VALUES: usize = 10;
}

/// What a unit is made of: family, action, announcement, start, speed, rate, aim.
type Made = [f64; 7];

/// What the units of all families have.
struct Frame {
    sign: f64,
    threshold: f64,
    /// Time of the first crossing, s.
    after: f64,
    period: f64,
}

impl Frame {
    fn new(random: &mut Random) -> Self {
        let thresholds = [0.0, random.power(-6.0, 9.0), random.power(-1.0, 1.0)];
        Self {
            sign: random.power(0.0, 0.0),
            threshold: thresholds[random.below(3)],
            after: random.between(0.01, 1.5 * SPAN),
            period: 10.0_f64.powf(random.between(-2.5, 0.3)),
        }
    }

    /// Makes a unit whose indicator has at least this slope at its events.
    fn unit(&self, made: Made, times: impl IntoIterator<Item = f64>, slope: f64) -> Unit {
        let Self { sign, threshold, period, .. } = *self;
        let mut values = [0.0; Unit::VALUES];
        values[..7].copy_from_slice(&made);
        values[7..].copy_from_slice(&[threshold, sign, period]);
        let error = 2.0 * f64::EPSILON * threshold.abs().max(made[3].abs()) / slope;
        Unit { values, events: times.into_iter().map(|time| (time, error)).collect() }
    }
}

/// Returns 1, 2, … and one more than the number of events that a unit keeps.
fn numbers() -> impl Iterator<Item = f64> {
    (1..=KEPT + 1).map(|number| number as f64)
}

fn with_one_state(random: &mut Random) -> Unit {
    let frame = Frame::new(random);
    let Frame { sign, threshold, after, period } = frame;
    let rate = random.power(-6.0, 6.0);
    match random.below(4) {
        0 => {
            // A crossing, once or again and again.
            let begin = threshold - rate * after;
            let (action, announcement) = (random.below(2), random.below(2) as f64);
            let after = (threshold - begin) / rate;
            let times =
                numbers().map(|number| number * after).take(if action == 1 { 9 } else { 1 });
            frame.unit([0.0, action as f64, announcement, begin, 0.0, rate, 0.0], times, rate.abs())
        }
        1 => {
            let (rate, scale) = (random.between(0.3, 20.0), threshold.abs().max(1.0));
            let aim = threshold + sign * scale * random.between(0.5, 2.0);
            let begin = aim + (threshold - aim) * (rate * after).exp().min(50.0);
            let after = ((begin - aim) / (threshold - aim)).ln() / rate;
            let slope = rate * (threshold - aim).abs() / 4.0;
            frame.unit([1.0, 0.0, 1.0, begin, 0.0, rate, aim], [after], slope)
        }
        2 => {
            // Time events, each of which sets back what has passed no threshold.
            let begin = threshold + sign * (1.0 + threshold.abs() + 3.0 * SPAN * rate.abs());
            let grows = random.below(2);
            let times = numbers().map(|number| {
                period * if grows == 1 { 0.5 * number * (number + 1.0) } else { number }
            });
            let announcement = 2.0 + grows as f64;
            frame.unit([0.0, 1.0, announcement, begin, 0.0, rate, 0.0], times, f64::INFINITY)
        }
        _ => {
            // An indicator that is 0 at the start, and stays there or leaves it at once.
            let rate = [0.0, rate][random.below(2)];
            let leaves = sign * rate > 0.0 && threshold.abs() < 1e3 * rate.abs();
            let rate = if leaves || rate == 0.0 { rate } else { -sign * rate.abs() };
            let times = leaves.then_some(0.0);
            frame.unit([0.0, 0.0, 0.0, threshold, 0.0, rate, 0.0], times, rate.abs())
        }
    }
}

fn with_two_states(random: &mut Random) -> Unit {
    let mut frame = Frame::new(random);
    let Frame { threshold, after, .. } = frame;
    if random.below(2) == 0 {
        let rate = random.between(0.5, 20.0);
        let size = threshold.abs().max(1e-3) * random.between(1.2, 5.0);
        let phase = (threshold / size).acos();
        let times = numbers().flat_map(|turn| {
            [phase, 2.0 * PI - phase].map(|angle| (angle + 2.0 * PI * (turn - 1.0)) / rate)
        });
        let slope = rate * size * phase.sin() / 4.0;
        return frame.unit([2.0, 0.0, 1.0, size, 0.0, rate, 0.0], times, slope);
    }
    // The height is above the threshold at first.
    frame.sign = 1.0;
    let rate = 10.0_f64.powf(random.between(-2.0, 3.0));
    let begin = threshold + 0.5 * rate * after * after;
    let fall = (2.0 * (begin - threshold) / rate).sqrt();
    let flights = numbers().scan(fall, |time, number| {
        *time += 2.0 * fall * 0.8_f64.powf(number);
        Some(*time)
    });
    let times = std::iter::once(fall).chain(flights);
    frame.unit([3.0, 2.0, 0.0, begin, 0.0, rate, 0.0], times, rate * fall * 0.2)
}

fn with_three_states(random: &mut Random) -> Unit {
    let frame = Frame::new(random);
    let Frame { sign, threshold, after, .. } = frame;
    let [rate, speed] = [0; 2].map(|_| random.power(-3.0, 3.0).copysign(sign));
    let rise = |time: f64| speed * time + rate * time.powi(3) / 6.0;
    let begin = threshold - rise(after);
    let (mut low, mut high) = (0.0, 2.0 * after);
    for _ in 0..100 {
        let middle = f64::midpoint(low, high);
        let is_below = rise(middle).abs() < (threshold - begin).abs();
        *(if is_below { &mut low } else { &mut high }) = middle;
    }
    let slope = (speed + 0.5 * rate * high * high).abs() / 4.0;
    frame.unit([4.0, 0.0, 0.0, begin, speed, rate, 0.0], [high], slope)
}

/// Returns the description of a unit with so many states.
fn description(states: usize) -> String {
    let mut text = String::from(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"Generated\" guid=\"g\" numberOfEventIndicators=\"1\"><ModelExchange modelIdentifier=\"model\"/><ModelVariables>",
    );
    let mut add = |name: String, reference: usize, kind: &str, real: String| {
        let _ = write!(
            text,
            "<ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {kind}><Real{real}/></ScalarVariable>"
        );
    };
    let mut structure = [String::new(), String::new()];
    for state in 0..states {
        let index = 2 * state + 1;
        add(format!("x{state}"), 30 + state, "variability=\"continuous\"", String::new());
        let derivative = format!(" derivative=\"{index}\"");
        add(format!("d{state}"), 40 + state, "variability=\"continuous\"", derivative);
        let _ = write!(structure[1], "<Unknown index=\"{}\"/>", index + 1);
    }
    for (place, name) in PARAMETERS.split(' ').enumerate() {
        let kind = "causality=\"parameter\" variability=\"fixed\"";
        add(name.to_string(), place, kind, " start=\"0\"".into());
    }
    for place in 0..=KEPT {
        let kind = "causality=\"output\" variability=\"discrete\"";
        add(format!("t{place}"), 20 + place, kind, String::new());
        let index = 2 * states + Unit::VALUES + place + 1;
        let _ = write!(structure[0], "<Unknown index=\"{index}\"/>");
    }
    let [outputs, derivatives] = structure;
    text + &format!(
        "</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{derivatives}</Derivatives></ModelStructure></fmiModelDescription>"
    )
}

/// Returns an experiment that begins at a time (s) and steps these units.
fn experiment(units: &[Unit], start: f64, step: f64) -> String {
    let order: Vec<String> = (0..units.len()).map(|number| format!("u{number}")).collect();
    let stop = start + SPAN;
    let mut text = format!(
        "title = \"generated\"\n[simulation]\nstart = {start:?}\nstop = {stop:?}\nstep = {step}\norder = {order:?}\n"
    );
    for (name, unit) in order.iter().zip(units) {
        let _ = writeln!(
            text,
            "[components.{name}]\nfmu = \"Model.fmu\"\ntolerance = 1e-13\n[components.{name}.parameters]"
        );
        for (name, value) in PARAMETERS.split(' ').zip(unit.values) {
            let _ = writeln!(text, "{name} = {value:?}");
        }
    }
    let recorded: Vec<String> = order.iter().map(|name| format!("{name}.t*")).collect();
    text + &format!("[record]\nvariables = {recorded:?}\n")
}

/// Returns whether a unit has told its events, which have begun at a time, s.
fn is_right(unit: &Unit, start: f64, count: usize, told: &[f64]) -> bool {
    let within = |place: usize| {
        let (time, error) = unit.events[place];
        let ulps = 8.0 * f64::EPSILON * (start + time).abs();
        (place + 1) as f64 * (error + ulps.max(1e-9))
    };
    let number = |side: f64| {
        let times = unit.events.iter().enumerate();
        times.filter(|(place, (time, _))| time + side * within(*place) <= SPAN).count()
    };
    let (least, most) = (number(1.0), number(-1.0));
    let mut pairs = told.iter().zip(&unit.events).take(count.min(KEPT)).enumerate();
    let are_near =
        pairs.all(|(place, (told, (time, _)))| (told - start - time).abs() <= within(place));
    are_near && least <= count && (count <= most || least > KEPT)
}

#[test]
fn oracle_events_of_generated_units_come_at_those_of_their_solutions() {
    let mut random = Random(65);
    let mut faults = Vec::new();
    for states in 1..=3 {
        let text = description(states);
        let recipe = Recipe {
            files: ["generated.c", "exchange.xml", "linux64"],
            flags: &["-lm"],
            description: &|_| text.clone(),
            ..Recipe::default()
        };
        let bench = Bench::made("", &recipe);
        for start in [0.0, -1.0, 1234.5, 1.7e9, 2e9] {
            let unit = [with_one_state, with_two_states, with_three_states][states - 1];
            let units: Vec<Unit> = (0..14).map(|_| unit(&mut random)).collect();
            let step = [0.01, 0.1, 0.5, 2.0][random.below(4)];
            fs::write(bench.path("loop.toml"), experiment(&units, start, step)).unwrap();
            bench.flown(&["--quiet"]);
            let results = bench.results();
            let row = results.lines().last().unwrap().split(',').skip(1);
            let row: Vec<f64> = row.map(|cell| cell.parse().unwrap()).collect();
            for (unit, told) in units.iter().zip(row.chunks(KEPT + 1)) {
                if !is_right(unit, start, told[0] as usize, &told[1..]) {
                    let Unit { values, events } = unit;
                    faults.push(format!("{values:?} from {start} by {step}: {told:?}, {events:?}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} of 210 units:\n{}", faults.len(), faults.join("\n"));
}
