//! Prints every optimisation of CRMPC over the 50 s scenario of Chai 2022 (white noise, inertia + 5
//! %), as one JSON object per line: the data that another solver needs to solve the same problem,
//! our optimum, and the time of each of our solvers. `scripts/bench` reads the output.
//!
//! Each sample is repeated from the same memory, and the smallest time counts. The solvers are
//! timed in turns, so that other load on the machine affects all alike.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::{Constraints, Memory, Posed, Settings};
use control::mpc::{Method, SolverSettings};
use control::{Controller, Crmpc};
use harness::{disturbance, settings, simulate};
use serde_json::{Value, json};
use std::hint::black_box;
use std::io::{self, Write};
use vehicle::disturbance::DisturbanceKind;
use vehicle::scenario::Scenario;

/// Number of repetitions of each sample, if the first argument gives none.
const REPETITIONS: usize = 20;

/// Relative inertia error of the vehicle.
const INERTIA_SCALE: f64 = 1.05;

fn main() -> io::Result<()> {
    let repetitions = std::env::args().nth(1).map_or(REPETITIONS, |text| {
        text.parse().unwrap_or_else(|_| panic!("'{text}' is not a number of repetitions"))
    });
    let mut out = io::stdout().lock();
    for (set, constraints) in [("robust", Constraints::Robust), ("paper", Constraints::Paper)] {
        write_samples(&mut out, set, &settings(constraints), repetitions)?;
    }
    Ok(())
}

/// Returns the bounds on the stages' rates, on the intervals' inputs, and on the last error in the
/// G-norm, which the robust set does not have.
fn bounds(Posed { bounds, .. }: &Posed) -> Value {
    json!({ "rate": bounds.rate, "input": bounds.input, "terminal": bounds.terminal })
}

/// Returns angles, rates and accelerations of the reference at each stage.
fn references(posed: &Posed) -> Vec<[[f64; 3]; 3]> {
    let rows = posed.references.iter();
    rows.map(|at| [at.angles, at.rates, at.accelerations].map(<[f64; 3]>::from)).collect()
}

/// Returns the trajectory of the last linearisation: states (Θ̃, x̃_ω) and accelerations.
fn nominal(posed: &Posed) -> Value {
    let Posed { references, linearisation_point: motion, .. } = posed;
    let states: Vec<_> = std::iter::zip(references, &motion.states)
        .map(|(at, [angles, rates])| [at.angles + angles, at.rates + rates].map(<[f64; 3]>::from))
        .collect();
    let accelerations: Vec<_> = std::iter::zip(references, &motion.inputs)
        .map(|(at, input)| <[f64; 3]>::from(at.accelerations + input))
        .collect();
    json!({ "states": states, "accelerations": accelerations })
}

fn write_samples(
    out: &mut impl Write,
    set: &str,
    settings: &Settings,
    repetitions: usize,
) -> io::Result<()> {
    let scenario = Scenario::crmpc2022();
    let reference = |time: f64| scenario.reference.at(time);
    let with = |change: fn(&mut SolverSettings)| {
        let mut settings = *settings;
        change(&mut settings.solver);
        Crmpc::new(settings).unwrap()
    };
    let mut ways = vec![
        ("shortcuts, riccati", with(|_| ())),
        ("riccati", with(|solver| solver.shortcuts = false)),
        ("cone", with(|solver| (solver.shortcuts, solver.method) = (false, Method::Cone))),
    ];
    let mut ticks: Vec<(u64, Memory, control::Measurement)> = Vec::new();
    let mut before = ways[0].1.memory();
    let mut memory = before.clone();
    simulate(
        &mut ways[0].1,
        &mut memory,
        INERTIA_SCALE,
        disturbance(DisturbanceKind::White),
        |after, tick, &measured| {
            ticks.push((tick, before.clone(), measured));
            before.clone_from(after);
        },
    );

    let ratio = ways[0].1.design().ratio as u64;
    for (tick, before, measured) in ticks.iter().filter(|(tick, ..)| tick % ratio == 0) {
        let time = *tick as f64 * settings.period_feedback;
        let mut reports = [before.report; 3];
        let mut best = [f64::INFINITY; 3];
        for _ in 0..repetitions.max(1) {
            for (i, (_, controller)) in ways.iter_mut().enumerate() {
                let mut memory = before.clone();
                black_box(controller.update(
                    &mut memory,
                    *tick,
                    time,
                    black_box(measured),
                    &reference,
                ));
                best[i] = best[i].min(memory.report.time);
                reports[i] = memory.report;
            }
        }
        let posed = ways[1].1.posed();
        let by_way: serde_json::Map<_, _> = std::iter::zip(&ways, std::iter::zip(reports, best))
            .map(|((name, _), (report, seconds))| {
                let figures = json!({
                    "seconds": seconds,
                    "iterations": report.iterations,
                    "cost": report.cost,
                    "residual": report.residual,
                    "status": format!("{:?}", report.status),
                });
                ((*name).to_string(), figures)
            })
            .collect();
        let cone = ways[2].1.posed();
        let previous = before.started.then(|| {
            let plan = &before.plan;
            let states: Vec<_> = plan.states.iter().map(|x| <[f64; 6]>::from(*x)).collect();
            let accelerations: Vec<_> =
                plan.accelerations.iter().map(|a| <[f64; 3]>::from(*a)).collect();
            json!({ "states": states, "accelerations": accelerations })
        });
        // The problem is that of the Riccati method. The cone solver linearises its norm
        // constraints about a point, and its bounds are those about it.
        let sample = json!({
            "set": set,
            "time": time,
            "start": posed.start.as_slice(),
            "references": references(&posed),
            "weights": {
                "state": posed.cost.state.map(<[f64; 3]>::from),
                "input": <[f64; 3]>::from(posed.cost.input),
                "end": posed.cost.end.map(|row| row.map(<[f64; 3]>::from)),
            },
            "bounds": bounds(&posed),
            "linearised": { "bounds": bounds(&cone), "point": nominal(&cone) },
            // This is the plan of the optimisation before, not shifted; it is empty at first.
            "previous": previous,
            "ways": by_way,
        });
        writeln!(out, "{sample}")?;
    }
    Ok(())
}
