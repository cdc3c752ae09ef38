//! The plan that CRMPC shows, with the bounds that its certificate has checked: what a picture of
//! the guarantee draws.

use crate::prelude::*;
use control::closed_loop::fly;
use control::crmpc::{PlanPoint, points};

/// Number of flights, and length of each, s.
const FLIGHTS: u64 = 100;
const LENGTH: f64 = 12.0;
/// Rounding of the sums that are compared, as a share of a limit.
const ROUNDING: f64 = 1e-9;

fn shown() -> Settings {
    Settings { shows_plan: true, ..settings(Constraints::Robust) }
}

/// Returns a flight with its own start, kind of disturbance and size, up to the bound.
fn scenario(seed: u64) -> Scenario {
    let mut random = Random::new(seed);
    let mut scenario = Scenario { duration: LENGTH, ..Scenario::crmpc2022() };
    scenario.initial_angles += random.vector() * 6f64.to_radians();
    let disturbance = &mut scenario.disturbance;
    disturbance.seed = seed;
    disturbance.kind = [
        DisturbanceKind::White,
        DisturbanceKind::AlongRate,
        DisturbanceKind::AgainstMoment,
        DisturbanceKind::Constant,
    ][seed as usize % 4];
    if seed.is_multiple_of(3) {
        disturbance.bound *= random.between(0.0, 1.0);
    }
    scenario
}

/// Returns the largest share of a limit by which the flown norms left the tube about the plan in
/// force, and how close they came to its edge, as a share of its width.
fn leaves_tube(seed: u64) -> (f64, f64) {
    let settings = shown();
    let mut law = Crmpc::new(settings).unwrap();
    let mut memory = law.memory();
    let (mut outside, mut closest) = (f64::NEG_INFINITY, 0.0_f64);
    let mut before: Option<(f64, [PlanPoint; 2])> = None;
    let Settings { limit_rate, limit_moment, period_optimisation: h, .. } = settings;
    fly(&mut law, &mut memory, settings.period_feedback, &scenario(seed), |sample| {
        let Memory { guarantee, shown, planned, .. } = sample.memory;
        assert_eq!(*guarantee, GuaranteeStatus::InForce, "{seed}");
        let mut take = |flown: f64, plan: f64, bound: f64, limit: f64| {
            let (away, tube) = ((flown - plan).abs(), limit - bound);
            outside = outside.max((away - tube) / limit);
            closest = closest.max(away / tube);
        };
        // The rates at the end of an interval are those that its own plan led to.
        if let Some((began, [_, end])) = before.filter(|(began, _)| *began < *planned) {
            assert!((planned - began - h).abs() < 1e-9);
            take(sample.measured.rates.norm(), end.rate, end.rate_bound, limit_rate);
        }
        before = Some((*planned, [shown[0], shown[1]]));
        take(sample.moment.norm(), shown[0].moment, shown[0].moment_bound, limit_moment);
        // A plan under guarantee keeps the bounds that are shown, at all points.
        for point in shown {
            assert!(point.rate <= point.rate_bound + ROUNDING * limit_rate, "{seed}: {point:?}");
            assert!(point.moment <= point.moment_bound + ROUNDING * limit_moment, "{point:?}");
        }
    })
    .unwrap();
    (outside, closest)
}

/// The tube of the plan in force contains the flight at every tick of 100 flights under guarantee.
/// It is no wider than needed by orders of magnitude: some flight comes near its edge.
#[test]
fn oracle_the_shown_tube_contains_the_flight() {
    let seeds: Vec<u64> = (0..FLIGHTS).collect();
    let flown = crate::harness::in_parallel(&seeds, |&seed| leaves_tube(seed));
    let outside = flown.iter().map(|flight| flight.0).fold(f64::NEG_INFINITY, f64::max);
    let closest = flown.iter().map(|flight| flight.1).fold(0.0, f64::max);
    assert!(outside <= ROUNDING, "{outside}");
    assert!(closest > 0.4, "{closest}");
}

/// Showing the plan changes no command, and the margins that were shown before are those of its
/// first interval.
#[test]
fn a_shown_plan_changes_no_command() {
    let commands = |settings: Settings| {
        let mut law = Crmpc::new(settings).unwrap();
        let mut memory = law.memory();
        let mut commands = Vec::new();
        fly(&mut law, &mut memory, settings.period_feedback, &scenario(1), |sample| {
            commands.push(sample.moment);
            let Memory { shown, margins, .. } = sample.memory;
            assert_eq!(shown.len(), if settings.shows_plan { 25 } else { 0 });
            let Some([first, second]) = shown.first_chunk() else { return };
            let rate = (second.rate_bound - second.rate) / settings.limit_rate;
            let moment = (first.moment_bound - first.moment) / settings.limit_moment;
            assert!((rate - margins.rate).abs() < ROUNDING, "{rate} {margins:?}");
            assert!((moment - margins.moment).abs() < ROUNDING, "{moment} {margins:?}");
        })
        .unwrap();
        commands
    };
    assert_eq!(commands(shown()), commands(settings(Constraints::Robust)));
}

/// With the paper's sets, which bound other norms, the limits themselves are shown.
#[test]
fn the_papers_sets_leave_the_whole_limits() {
    let settings = Settings { shows_plan: true, ..settings(Constraints::Paper) };
    let mut law = Crmpc::new(settings).unwrap();
    let mut memory = law.memory();
    let scenario = Scenario { duration: 1.0, ..scenario(1) };
    fly(&mut law, &mut memory, settings.period_feedback, &scenario, |sample| {
        let shown = &sample.memory.shown;
        assert!(shown.iter().all(|point| point.rate_bound == settings.limit_rate));
        assert!(shown.iter().all(|point| point.moment_bound == settings.limit_moment));
        assert!(shown[0].moment > 0.0 && shown[points(settings.horizon).len() - 1].rate < 0.1);
    })
    .unwrap();
}
