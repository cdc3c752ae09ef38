//! Limit on the moment and bound on the disturbance that change during a flight, as with dynamic
//! pressure.

use crate::harness::INERTIA_SCALES;
use crate::prelude::*;
use control::controller::Scheduled;

/// Shares of the limit and of the bound that are there at `time`, once up and down in 40 s.
fn shares(time: f64) -> (f64, f64) {
    let up = 0.5 - 0.5 * (TAU * time / 40.0).cos();
    (0.6 + 0.4 * up, 0.2 + 0.8 * up)
}

fn up_and_down(s: &Settings, time: f64) -> Scheduled {
    let (of_moment, of_disturbance) = shares(time);
    Scheduled {
        limit_moment: of_moment * s.limit_moment,
        disturbance_bound: of_disturbance * s.disturbance_bound,
        ..Scheduled::default()
    }
}

fn down_and_up(s: &Settings, time: f64) -> Scheduled {
    up_and_down(s, time + 20.0)
}

fn settings(delay: f64) -> Settings {
    let published = Settings::new(Constraints::Robust);
    Settings {
        delay,
        disturbance_bound: f64::to_radians(1.7 - 2.5 * delay),
        disturbance_parts: 8,
        limit_fall: 0.05 * published.limit_moment,
        ..published
    }
}

/// Returns flights with disturbances of every kind, from the start of Chai 2022 and from others.
fn flights(settings: &Settings) -> Vec<Flight> {
    let all = Waveform::all().into_iter().enumerate().map(|(i, disturbance)| Flight {
        disturbance,
        inertia_scale: INERTIA_SCALES[i % 2],
        scheduled: up_and_down,
        seed: i as u64,
        duration: 50.0,
        ..Flight::new(settings)
    });
    all.collect()
}

#[test]
fn oracle_the_guarantee_is_kept_while_limit_and_disturbance_change() {
    let mut largest = 0.0_f64;
    for delay in [0.0, 0.04, 0.117] {
        let shown = assert_kept(&format!("delay {delay}"), &flights(&settings(delay)));
        largest = shown.iter().map(|shown| shown.moment).fold(largest, f64::max);
    }
    assert!(largest > 0.8, "{largest}");
}

#[test]
fn oracle_the_guarantee_is_kept_wherever_the_nominal_motion_begins() {
    let published = settings(0.04);
    let disturbance_bound = 0.7 * published.disturbance_bound;
    let initial_state = InitialState::Nominal;
    let all = flights(&Settings { initial_state, disturbance_bound, ..published });
    for (flight, (contradiction, shown)) in all.iter().zip(in_parallel(&all, followed)) {
        let kept = contradiction == Contradiction::None && !shown.broken;
        assert!(kept && shown.in_force > 0.99, "{:?}: {shown:?}", flight.disturbance);
    }
}

#[test]
fn oracle_no_start_and_no_reference_breaks_a_limit_that_changes() {
    for delay in [0.0, 0.04, 0.117] {
        let random = |seed| Flight {
            scheduled: [up_and_down, down_and_up][seed as usize % 2],
            ..Flight::random(&settings(delay), seed)
        };
        let flights: Vec<Flight> = (0..60).map(random).collect();
        let flown = in_parallel(&flights, followed);
        let mut ended = 0;
        for (flight, (contradiction, shown)) in flights.iter().zip(flown) {
            // A plan that no later one replaces is followed for longer than its inputs allow.
            let is_told = contradiction == Contradiction::Schedule;
            ended += u32::from(is_told);
            let kept = !shown.broken && !shown.lost && (is_told || shown.withdrawn.is_none());
            assert!(kept, "{delay} {}: {contradiction:?} {shown:?}", flight.seed);
        }
        assert!(ended <= 3, "{ended}");
    }
}

/// Flies, and returns the first contradiction of the assumptions.
fn followed(flight: &Flight) -> (Contradiction, Shown) {
    let mut first = Contradiction::None;
    let shown = flight.fly_seen(|memory, _, _, _| {
        if first == Contradiction::None {
            first = memory.supervision.contradiction;
        }
    });
    (first, shown)
}

#[test]
fn limits_that_change_faster_than_declared_end_the_guarantee() {
    let declared = settings(0.0);
    let (contradiction, shown) = followed(&flights(&declared)[0]);
    assert!(contradiction == Contradiction::None && shown.in_force == 1.0, "{shown:?}");
    let undeclared = Settings { limit_fall: 0.0, ..declared };
    let (contradiction, shown) = followed(&flights(&undeclared)[0]);
    assert!(contradiction == Contradiction::Schedule && shown.in_force < 0.7, "{shown:?}");
    let flight = Flight {
        scheduled: |s, time| Scheduled {
            disturbance_bound: s.disturbance_bound * if time < 10.03 { 0.2 } else { 0.5 },
            ..Scheduled::default()
        },
        ..flights(&declared).remove(0)
    };
    let ended = |flight: &Flight| {
        let mut ended = None;
        flight.fly_seen(|memory, tick, _, _| {
            if ended.is_none() && memory.supervision.ended > 0 {
                ended = Some((tick, memory.supervision.contradiction));
            }
        });
        ended
    };
    assert_eq!(ended(&flight), Some((251, Contradiction::Schedule)));
    // At an optimisation the bound of the plan before counts, too.
    let flight = Flight { scheduled: jump_at_an_optimisation, ..flight };
    assert_eq!(ended(&flight), Some((250, Contradiction::Schedule)));
    let delayed = Settings {
        period_optimisation: 0.04,
        horizon: 60,
        disturbance_parts: 16,
        ..settings(0.12)
    };
    let flight = Flight { scheduled: jump_at_an_optimisation, ..flights(&delayed).remove(0) };
    assert_eq!(ended(&flight), Some((250, Contradiction::Schedule)));
}

fn jump_at_an_optimisation(s: &Settings, time: f64) -> Scheduled {
    let share = if time < 9.99 { 0.2 } else { 1.0 };
    Scheduled { disturbance_bound: share * s.disturbance_bound, ..Scheduled::default() }
}

#[test]
fn a_scheduled_disturbance_leaves_room_where_the_limit_is_low() {
    let declared = settings(0.0);
    // Without its parts the whole disturbance counts, for which a low limit has no room.
    let whole = Settings { disturbance_parts: 1, ..declared };
    let in_force = flights(&whole)[0].fly().in_force;
    assert!(in_force < 0.8, "{in_force}");
}

#[test]
fn oracle_a_part_of_the_disturbance_is_tightened_for_as_a_whole_one_of_its_size() {
    for delay in [0.0, 0.04] {
        let s = settings(delay);
        let design = Design::new(&s).unwrap();
        for level in 1..s.disturbance_parts {
            let part = (s.disturbance_parts - level) as f64 / s.disturbance_parts as f64;
            let disturbance_bound = s.disturbance_bound * part;
            let (feedback, disturbance_parts) = (design.feedback, 1);
            let alone = Settings { disturbance_bound, feedback, disturbance_parts, ..s };
            let alone = Design::new(&alone).unwrap();
            assert!(design.at_level(level) == &alone.tightening, "{level}");
        }
        assert!(design.at_level(s.disturbance_parts) == &design.tightening);
    }
}

#[test]
fn a_scheduled_limit_holds_for_every_law() {
    let Settings { body, p, q, period_feedback: period, .. } = settings(0.0);
    let mut law = Lqr::new(LqrSettings { body, period, p, q }).unwrap();
    let measured = |limit_moment| Measurement {
        angles: Vector3::new(0.3, 0.1, -0.2),
        scheduled: Scheduled { limit_moment, ..Scheduled::default() },
        ..Measurement::default()
    };
    let reference = |_: f64| Reference::default();
    let mut command = |limit| law.update(&mut (), 0, 0.0, &measured(limit), &reference);
    let whole = command(1e9);
    assert_eq!(command(0.5 * whole.norm()), saturated(whole, 0.5 * whole.norm()));
    assert_eq!(command(0.0), Vector3::zeros());
    assert_eq!(command(-1.0), Vector3::zeros());
    let mut crmpc = Crmpc::new(settings(0.0)).unwrap();
    let mut memory = crmpc.memory();
    let given = crmpc.update(&mut memory, 0, 0.0, &measured(0.0), &reference);
    assert_eq!(given, Vector3::zeros());
    assert_eq!(memory.supervision.status, GuaranteeStatus::Uncertified);
}
