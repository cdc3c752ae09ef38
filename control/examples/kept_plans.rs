//! How far a kept plan is moved towards a far reference if no solver ever succeeds, for
//! `docs/proof.md`:
//!
//! ```text
//! cargo run --release -p reentry-control --example kept_plans
//! ```

use control::Measurement;
use control::controller::Controller;
use control::crmpc::{Constraints, Crmpc, Settings, SolverStatus};
use control::error_dynamics::Gain;
use nalgebra::Vector3;
use vehicle::reference::Reference;

fn main() {
    println!(
        "    K        delay, s   bound, deg/s2   horizon   least share   nearer by at least, deg"
    );
    for (k1, k2, delay, bound_deg, horizon) in [
        (-1.5, -4.0, 0.0, 2.0, 100),
        (-1.5, -4.0, 0.04, 2.0, 100),
        (-1.5, -4.0, 0.117, 2.0, 100),
        (-1.5, -4.0, 0.0, 2.3, 100),
        (-1.5, -4.0, 0.0, 2.0, 20),
        (-5.0, -5.0, 0.0, 2.0, 100),
        (-0.5, -5.0, 0.0, 2.0, 100),
        (-0.5, -5.0, 0.0, 2.5, 100),
    ] {
        let mut settings = Settings {
            feedback: Gain { k1, k2 },
            delay,
            disturbance_bound: f64::to_radians(bound_deg),
            horizon,
            ..Settings::new(Constraints::Robust)
        };
        // No search ends within one iteration.
        settings.solver.iteration_budget = 1;
        let (share, way) = kept(&settings);
        println!(
            "[{k1:4}, {k2:4}] {delay:8.3} {bound_deg:15.2} {horizon:9} {share:13.5} {:24.3}",
            way.to_degrees()
        );
    }
}

/// Returns the least move of a plan at rest if a search fails, over attitudes and directions: the
/// smallest share of the way to the optimum without constraints, and the least approach of its end
/// to a reference beyond the reach of the horizon, rad.
fn kept(settings: &Settings) -> (f64, f64) {
    let mut law = Crmpc::new(*settings).unwrap();
    let (ratio, period) = (law.design().ratio as u64, settings.period_feedback);
    let (mut least_share, mut least_way) = (1.0_f64, f64::INFINITY);
    for (from, to) in turns() {
        let mut memory = law.memory();
        let measured = Measurement { angles: from, ..Measurement::default() };
        for tick in 0..=ratio {
            let angles = if tick < ratio { from } else { to };
            let reference = |_| Reference { angles, ..Reference::default() };
            law.update(&mut memory, tick, tick as f64 * period, &measured, &reference);
        }
        if memory.report.status == SolverStatus::Unconstrained {
            continue;
        }
        assert_eq!(memory.report.status, SolverStatus::Kept, "{from:?} {to:?}");
        let plan = &memory.plan;
        let end = plan.states[settings.horizon].fixed_rows::<3>(0);
        let nearer = (to - from).norm() - (to - end).norm();
        // The distance to the optimum without constraints scales with its acceleration.
        let mut free = law.memory();
        let near = from + (to - from) * 1e-4;
        let reference = |_| Reference { angles: near, ..Reference::default() };
        law.update(&mut free, 0, 0.0, &measured, &reference);
        assert_eq!(free.report.status, SolverStatus::Unconstrained);
        let reached = law.reach().min((to - from).norm()) / (near - from).norm();
        let share = plan.accelerations[0].norm() / (free.plan.accelerations[0].norm() * reached);
        least_share = least_share.min(share);
        if (to - from).norm() > law.reach() {
            least_way = least_way.min(nearer);
        }
    }
    (least_share, least_way)
}

/// Returns turns from each attitude of a grid, far ones and near ones in the same directions. The
/// bank angle alone has no effect.
fn turns() -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> {
    let sideslips = [-10.0, -5.0, 0.0, 5.0, 10.0];
    (0..18 * 5 * 45 * 2).filter_map(move |i| {
        let from = Vector3::new(20.0 * f64::from(i / 450), sideslips[i as usize / 90 % 5], 0.0);
        let turn = |j: i32| f64::from(j % 3 - 1);
        let sideslip = sideslips[i as usize / 9 % 5] - from.y;
        let way = Vector3::new(60.0 * turn(i), sideslip, 120.0 * turn(i / 3));
        let size = if i / 45 % 2 == 0 { 1.0 } else { 0.2 };
        let to = from + way * size;
        (way.xz() != nalgebra::Vector2::zeros())
            .then(|| (from.map(f64::to_radians), to.map(f64::to_radians)))
    })
}
