//! Prints every optimisation of CRMPC over the 50 s scenario of Chai 2022 (white noise, inertia + 5
//! %), as one JSON object per line: the data that another solver needs to solve the same problem,
//! our optimum, and the time of each of our solvers. `scripts/bench` reads the output.
//!
//! Each sample is repeated from the same memory, and the smallest time counts. The solvers are
//! timed in turns, so that other load on the machine affects all alike.

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::crmpc::{Constraints, Memory, Settings};
use control::mpc::{Method, SolverSettings};
use control::{Controller, Crmpc};
use harness::{disturbance, settings, simulate};
use serde_json::json;
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
        let bounds = ways[1].1.bounds();
        let references: Vec<_> = (0..=settings.horizon)
            .map(|k| reference(time + k as f64 * settings.period_optimisation))
            .map(|at| [at.angles, at.rates, at.accelerations].map(<[f64; 3]>::from))
            .collect();
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
        let angle_rates = vehicle::kinematics::r(&measured.angles) * measured.rates;
        let start = [measured.angles.as_slice(), angle_rates.as_slice()].concat();
        let previous = before.started.then(|| {
            let plan = &before.plan;
            let states: Vec<_> = plan.states.iter().map(|x| <[f64; 6]>::from(*x)).collect();
            let accelerations: Vec<_> =
                plan.accelerations.iter().map(|a| <[f64; 3]>::from(*a)).collect();
            json!({ "states": states, "accelerations": accelerations })
        });
        let sample = json!({
            "set": set,
            "time": time,
            // The start is (Theta, x_omega).
            "start": start,
            "references": references,
            // The bounds are on the stages' rates, on the intervals' inputs, and on the last error
            // in the G-norm.
            "bounds": { "rate": bounds.rate, "input": bounds.input, "terminal": bounds.terminal },
            // This is the plan of the optimisation before, not shifted; it is empty at first.
            "previous": previous,
            "ways": by_way,
        });
        writeln!(out, "{sample}")?;
    }
    Ok(())
}
