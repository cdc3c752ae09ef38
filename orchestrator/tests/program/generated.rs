//! Generated units for model exchange, whose events are those of their exact solutions.

use crate::bench::{Bench, Random, Recipe};
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Length of a run, s.
const SPAN: f64 = 2.0;
/// Number of event times that a unit keeps.
const KEPT: usize = 6;
const PARAMETERS: [&str; 10] = [
    "family",
    "action",
    "announcement",
    "begin",
    "speed",
    "rate",
    "aim",
    "threshold",
    "sign",
    "period",
];

/// A unit with the times since the start at which its events must come, each with the error (s)
/// that the rounding of its states may make.
struct Unit {
    values: [f64; 10],
    events: Vec<(f64, f64)>,
}

/// Makes a unit with so many states.
fn unit(random: &mut Random, states: usize) -> Unit {
    let sign = random.power(0.0, 0.0);
    let threshold = [0.0, random.power(-6.0, 9.0), random.power(-1.0, 1.0)][random.below(3)];
    let after = random.between(0.01, 1.5 * SPAN);
    let period = 10.0_f64.powf(random.between(-2.5, 0.3));
    let made = |family,
                action,
                announcement,
                begin: f64,
                speed,
                rate,
                aim,
                times: Vec<f64>,
                slope: f64| Unit {
        values: [family, action, announcement, begin, speed, rate, aim, threshold, sign, period],
        events: times
            .into_iter()
            .map(|time| (time, 2.0 * f64::EPSILON * threshold.abs().max(begin.abs()) / slope))
            .collect(),
    };
    let repeated = |time: f64| (1..=KEPT + 1).map(|n| n as f64 * time).collect();
    match (states, random.below(4)) {
        (1, 0) => {
            // A crossing, once or again and again.
            let rate = random.power(-6.0, 6.0);
            let begin = threshold - rate * after;
            let after = (threshold - begin) / rate;
            let resets = random.below(2) == 1;
            let times = if resets { repeated(after) } else { vec![after] };
            made(
                0.0,
                f64::from(u8::from(resets)),
                random.below(2) as f64,
                begin,
                0.0,
                rate,
                0.0,
                times,
                rate.abs(),
            )
        }
        (1, 1) => {
            let (rate, scale) = (random.between(0.3, 20.0), threshold.abs().max(1.0));
            let aim = threshold + sign * scale * random.between(0.5, 2.0);
            let begin = aim + (threshold - aim) * (rate * after).exp().min(50.0);
            let after = ((begin - aim) / (threshold - aim)).ln() / rate;
            made(
                1.0,
                0.0,
                1.0,
                begin,
                0.0,
                rate,
                aim,
                vec![after],
                rate * (threshold - aim).abs() / 4.0,
            )
        }
        (1, 2) => {
            // Time events, which set back what has passed no threshold.
            let rate = random.power(-6.0, 6.0);
            let begin = threshold + sign * (1.0 + threshold.abs() + 3.0 * SPAN * rate.abs());
            let grows = random.below(2) == 1;
            let times = (1..=KEPT + 1).map(|n| {
                let n = n as f64;
                period * if grows { 0.5 * n * (n + 1.0) } else { n }
            });
            made(
                0.0,
                1.0,
                if grows { 3.0 } else { 2.0 },
                begin,
                0.0,
                rate,
                0.0,
                times.collect(),
                f64::INFINITY,
            )
        }
        (1, _) => {
            // An indicator that is 0 at the start, and stays there or leaves it at once.
            let rate = [0.0, random.power(-6.0, 6.0)][random.below(2)];
            let leaves = sign * rate > 0.0 && threshold.abs() < 1e3 * rate.abs();
            let stays = rate == 0.0;
            let rate = if leaves || stays { rate } else { -sign * rate.abs() };
            made(
                0.0,
                0.0,
                0.0,
                threshold,
                0.0,
                rate,
                0.0,
                if leaves { vec![0.0] } else { vec![] },
                rate.abs(),
            )
        }
        (2, 0 | 1) => {
            let rate = random.between(0.5, 20.0);
            let size = threshold.abs().max(1e-3) * random.between(1.2, 5.0);
            let phase = (threshold / size).acos();
            let times = (0..=KEPT / 2).flat_map(|turn| {
                [phase, 2.0 * PI - phase].map(|angle| (angle + 2.0 * PI * turn as f64) / rate)
            });
            made(
                2.0,
                0.0,
                1.0,
                size,
                0.0,
                rate,
                0.0,
                times.collect(),
                rate * size * phase.sin() / 4.0,
            )
        }
        (2, _) => {
            let rate = 10.0_f64.powf(random.between(-2.0, 3.0));
            let begin = threshold + 0.5 * rate * after * after;
            let fall = (2.0 * (begin - threshold) / rate).sqrt();
            let mut times = vec![fall];
            for n in 0..KEPT as i32 {
                times.push(times[n as usize] + 2.0 * fall * 0.8_f64.powi(n + 1));
            }
            let mut unit = made(3.0, 2.0, 0.0, begin, 0.0, rate, 0.0, times, rate * fall * 0.2);
            // The height is above the threshold at first.
            unit.values[8] = 1.0;
            unit
        }
        _ => {
            let (rate, speed) = (random.power(-3.0, 3.0), random.power(-3.0, 3.0));
            let (rate, speed) = (rate.copysign(sign), speed.copysign(sign));
            let rise = |time: f64| speed * time + rate * time.powi(3) / 6.0;
            let begin = threshold - rise(after);
            let (mut low, mut high) = (0.0, 2.0 * after);
            while f64::midpoint(low, high) > low && f64::midpoint(low, high) < high {
                let middle = f64::midpoint(low, high);
                if rise(middle).abs() < (threshold - begin).abs() {
                    low = middle
                } else {
                    high = middle
                }
            }
            made(
                4.0,
                0.0,
                0.0,
                begin,
                speed,
                rate,
                0.0,
                vec![high],
                (speed + 0.5 * rate * high * high).abs() / 4.0,
            )
        }
    }
}

/// Returns the description of a unit with so many states.
fn description(states: usize) -> String {
    let mut text = String::from(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"Generated\" guid=\"g\" numberOfEventIndicators=\"1\"><ModelExchange modelIdentifier=\"model\"/><ModelVariables>",
    );
    for state in 0..states {
        let (x, d) = (30 + state, 40 + state);
        let _ = write!(
            text,
            "<ScalarVariable name=\"x{state}\" valueReference=\"{x}\" variability=\"continuous\"><Real/></ScalarVariable><ScalarVariable name=\"d{state}\" valueReference=\"{d}\" variability=\"continuous\"><Real derivative=\"{}\"/></ScalarVariable>",
            2 * state + 1
        );
    }
    for (place, name) in PARAMETERS.iter().enumerate() {
        let _ = write!(
            text,
            "<ScalarVariable name=\"{name}\" valueReference=\"{place}\" causality=\"parameter\" variability=\"fixed\"><Real start=\"0\"/></ScalarVariable>"
        );
    }
    for place in 0..=KEPT {
        let _ = write!(
            text,
            "<ScalarVariable name=\"t{place}\" valueReference=\"{}\" causality=\"output\" variability=\"discrete\"><Real/></ScalarVariable>",
            20 + place
        );
    }
    let unknowns = |places: &mut dyn Iterator<Item = usize>| {
        places.map(|place| format!("<Unknown index=\"{place}\"/>")).collect::<String>()
    };
    let outputs = unknowns(&mut (0..=KEPT).map(|place| 2 * states + PARAMETERS.len() + place + 1));
    let derivatives = unknowns(&mut (0..states).map(|state| 2 * state + 2));
    text + &format!(
        "</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{derivatives}</Derivatives></ModelStructure></fmiModelDescription>"
    )
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
            let units: Vec<Unit> = (0..14).map(|_| unit(&mut random, states)).collect();
            let order: Vec<String> = (0..units.len()).map(|number| format!("u{number}")).collect();
            let step = [0.01, 0.1, 0.5, 2.0][random.below(4)];
            let mut text = format!(
                "title = \"generated\"\n[simulation]\nstart = {start:?}\nstop = {:?}\nstep = {step}\norder = {order:?}\n",
                start + SPAN
            );
            for (number, unit) in units.iter().enumerate() {
                let _ = writeln!(
                    text,
                    "[components.u{number}]\nfmu = \"Model.fmu\"\ntolerance = 1e-13\n[components.u{number}.parameters]"
                );
                for (name, value) in PARAMETERS.iter().zip(unit.values) {
                    let _ = writeln!(text, "{name} = {value:?}");
                }
            }
            let recorded: Vec<String> = order.iter().map(|name| format!("{name}.t*")).collect();
            let _ = writeln!(text, "[record]\nvariables = {recorded:?}");
            std::fs::write(bench.path("loop.toml"), text).unwrap();
            bench.flown(&["--quiet"]);
            let results = bench.results();
            let row = results.lines().last().unwrap().split(',').skip(1);
            let row: Vec<f64> = row.map(|cell| cell.parse().unwrap()).collect();
            for (unit, told) in units.iter().zip(row.chunks(KEPT + 1)) {
                let (count, told) = (told[0] as usize, &told[1..]);
                let within = |place: usize| {
                    let (time, error) = unit.events[place];
                    let ulps = 8.0 * f64::EPSILON / 2.0 * (start + time).abs().max(SPAN) * 2.0;
                    (place + 1) as f64 * (error + ulps.max(1e-9))
                };
                let (mut least, mut most) = (0, 0);
                for (place, (time, _)) in unit.events.iter().enumerate() {
                    least += usize::from(time + within(place) <= SPAN);
                    most += usize::from(time - within(place) <= SPAN);
                }
                let is_many = unit.events.len() > KEPT && least > KEPT;
                let wrong = told.iter().zip(&unit.events).take(count.min(KEPT)).enumerate().find(
                    |(place, (told, (time, _)))| (*told - start - time).abs() > within(*place),
                );
                if count < least || (count > most && !is_many) || wrong.is_some() {
                    faults.push(format!(
                        "{:?} from {start} by {step}: {count} events, {told:?}, expected {:?}",
                        unit.values, unit.events
                    ));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{} of 210 units:\n{}", faults.len(), faults.join("\n"));
}
