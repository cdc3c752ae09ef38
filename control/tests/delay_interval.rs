//! The deviation by commands that begin to act earlier or later than assumed, against simulations
//! of one axis.

use control::crmpc::{Carried, Constraints, Design, Deviation, Settings, Switching};
use control::error_dynamics::{Gain, response, transition};
use control::linearise;
use nalgebra::{Matrix3, Vector2, Vector3};
use vehicle::kinematics;

type V = Vector3<f64>;

/// Parts of a feedback period in which an axis is simulated.
const PARTS: i32 = 8;
const TICKS: i32 = 150;

fn settings(delay: i32, error: i32) -> Settings {
    let published = Settings::new(Constraints::Robust);
    let part = published.period_feedback / f64::from(PARTS);
    Settings {
        delay: f64::from(delay) * part,
        delay_error: f64::from(error) * part,
        feedback: Gain { k1: -1.5, k2: -4.0 },
        inertia_error: 0.0,
        disturbance_bound: 0.003,
        ..published
    }
}

/// Deviation of one axis. Times are in parts of a period.
struct Axis {
    settings: Settings,
    /// Delay that the law assumes.
    delay: i32,
    /// Deviation of the vehicle at each part of a period since the first measurement.
    vehicle: Vec<Vector2<f64>>,
    /// Deviation that the law sees at each tick, and K ô.
    seen: Vec<Vector2<f64>>,
    feedback: Vec<f64>,
}

impl Axis {
    /// Simulates the axis. `plan` is the plan's acceleration from each tick on; the one before the
    /// first is zero. `jump` is the jump of the rate by Δ in a part.
    fn new(
        (settings, delay, late): (&Settings, i32, i32),
        plan: impl Fn(i32) -> f64,
        jump: impl Fn(i32) -> f64,
    ) -> Self {
        let part = settings.period_feedback / f64::from(PARTS);
        let mut axis = Self {
            settings: *settings,
            delay,
            vehicle: vec![Vector2::zeros()],
            seen: Vec::new(),
            feedback: Vec::new(),
        };
        for i in 0..delay + TICKS * PARTS {
            if i % PARTS == 0 {
                axis.see(i, &plan);
            }
            let begun = |late: i32| (i - delay - late).div_euclid(PARTS);
            // The nominal trajectory has the plan's acceleration as assumed.
            let acts = axis.acceleration(begun(late), &plan) - plan(begun(0));
            let mut state = axis.vehicle[i as usize];
            // A jump of the rate belongs to the middle of the part.
            state += Vector2::new(0.5 * part * jump(i), jump(i));
            axis.vehicle.push(transition(part) * state + response(part) * acts);
        }
        axis
    }

    fn acceleration(&self, tick: i32, plan: &impl Fn(i32) -> f64) -> f64 {
        let feedback = usize::try_from(tick).ok().and_then(|tick| self.feedback.get(tick));
        plan(tick) + feedback.copied().unwrap_or(0.0)
    }

    /// The law predicts the measurement of part `i` over the delay that it assumes.
    fn see(&mut self, i: i32, plan: &impl Fn(i32) -> f64) {
        let part = self.settings.period_feedback / f64::from(PARTS);
        let mut state = self.vehicle[i as usize];
        for j in i..i + self.delay {
            let begun = (j - self.delay).div_euclid(PARTS);
            let assumed = self.acceleration(begun, plan) - plan(begun);
            state = transition(part) * state + response(part) * assumed;
        }
        self.seen.push(state);
        self.feedback.push((self.settings.feedback.row() * state).x);
    }

    /// Returns the deviation of the vehicle at a part after the first command should act.
    fn vehicle(&self, part: i32) -> Vector2<f64> {
        self.vehicle[(part + self.delay) as usize]
    }
}

const CASES: [(i32, i32); 4] = [(8, 2), (8, 8), (23, 2), (3, 3)];

#[test]
fn oracle_the_worst_disturbance_reaches_no_further() {
    for (delay, error) in CASES {
        let settings = settings(delay, error);
        let tightening = Design::new(&settings).unwrap().tightening;
        let exact = Design::new(&Settings { delay_error: 0.0, ..settings }).unwrap().tightening;
        let part = settings.period_feedback / f64::from(PARTS);
        let mut closest: f64 = 0.0;
        for late in [-error, -error / 2, error / 2, error] {
            let parts = delay + TICKS * PARTS;
            let (mut seen, mut feedback) = (vec![Vector2::zeros(); 200], vec![0.0; 200]);
            let mut vehicle = vec![Vector2::zeros(); parts as usize + 1];
            // By superposition the worst disturbance has the sign of the response everywhere.
            for at in 0..parts {
                let jump = |i: i32| if i == at { part * settings.disturbance_bound } else { 0.0 };
                let axis = Axis::new((&settings, delay, late), |_| 0.0, jump);
                let add = |sum: &mut Vector2<f64>, value: &Vector2<f64>| *sum += value.abs();
                seen.iter_mut().zip(&axis.seen).for_each(|(sum, value)| add(sum, value));
                vehicle.iter_mut().zip(&axis.vehicle).for_each(|(sum, value)| add(sum, value));
                feedback.iter_mut().zip(&axis.feedback).for_each(|(sum, k)| *sum += k.abs());
            }
            for tick in 0..TICKS {
                let (bound, n) = (tightening.at(tick as usize), tick as usize);
                let more = bound.feedback / exact.at(n).feedback.max(1e-9);
                assert!(feedback[n] <= bound.feedback + 1e-12, "{delay} {late} {tick}");
                assert!(seen[n].x <= bound.seen_angle && seen[n].y <= bound.seen_rate);
                let vehicle_state = vehicle[(delay + tick * PARTS) as usize];
                assert!(
                    vehicle_state.x <= bound.angle && vehicle_state.y <= bound.rate,
                    "{delay} {late} {tick}"
                );
                if n + 1 == TICKS as usize {
                    closest = closest.max(feedback[n] / bound.feedback);
                    assert!(more > 1.0);
                }
            }
        }
        // The bound is not much too large either, where an interval is a part of a period.
        assert!(error == PARTS || closest > 0.85, "{delay} {error} {closest}");
    }
}

/// Returns the propagated deviation at each stage.
fn carried(switching: &Switching, plan: &impl Fn(i32) -> f64, ratio: i32) -> Vec<Carried> {
    let mut carried = Carried::zeros();
    let stages = 0..TICKS / ratio;
    let stage = |i: i32| {
        let change = plan(i * ratio) - plan(i * ratio - 1);
        let begun = switching.begin(&carried, change.abs());
        carried = switching.next(&begun);
        begun
    };
    stages.map(stage).collect()
}

#[test]
fn oracle_changes_of_the_plan_leave_no_more_than_is_carried_along() {
    let ratio = 5;
    let waveforms: [fn(i32) -> f64; 4] = [
        |stage| if stage < 0 { 0.0 } else { 1.0 },
        |stage| if stage == 2 { 1.0 } else { 0.0 },
        |stage| if stage < 0 { 0.0 } else { f64::from(stage % 2) },
        |stage| if stage < 0 { 0.0 } else { f64::from(stage * stage * 7 % 11) / 11.0 },
    ];
    for (delay, error) in CASES {
        let settings = settings(delay, error);
        let tightening = Design::new(&settings).unwrap().tightening;
        let switching = tightening.switching.unwrap();
        let mut closest: f64 = 0.0;
        for (late, waveform) in [-error, -1, 1, error]
            .into_iter()
            .flat_map(|late| waveforms.map(|waveform| (late, waveform)))
        {
            let plan = |tick: i32| waveform(tick.div_euclid(ratio));
            let axis = Axis::new((&settings, delay, late), plan, |_| 0.0);
            let carried_changes = carried(&switching, &plan, ratio);
            for (stage, begun) in (0_i32..).zip(&carried_changes) {
                let bound = switching.deviation(begun);
                let next = carried_changes.get(stage as usize + 1).copied().unwrap_or_default();
                let early = switching.begun_early(&next);
                for tick in stage * ratio..(stage + 1) * ratio {
                    let n = tick as usize;
                    assert!(axis.seen[n].x.abs() <= bound.seen_angle + 1e-12);
                    assert!(axis.seen[n].y.abs() <= bound.seen_rate + 1e-12);
                    let feedback = axis.feedback[n].abs();
                    assert!(feedback <= bound.feedback_norm + 1e-12, "{delay} {late} {tick}");
                    closest = closest.max(feedback / bound.feedback_norm);
                    for part in tick * PARTS..(tick + 1) * PARTS {
                        let vehicle_state = axis.vehicle(part);
                        assert!(vehicle_state.x.abs() <= bound.angle + early.0 + 1e-12);
                        assert!(
                            vehicle_state.y.abs() <= bound.rate + early.1 + 1e-12,
                            "{delay} {late}"
                        );
                    }
                }
            }
        }
        assert!(error == PARTS || closest > 0.5, "{delay} {error} {closest}");
    }
}

/// Sizes of a deviation of which all but the moment are compared.
fn sizes(deviation: &Deviation) -> [f64; 7] {
    let Deviation {
        angle,
        rate,
        seen_angle,
        seen_rate,
        middle_angle,
        middle_rate,
        feedback_norm,
        ..
    } = *deviation;
    [angle, rate, seen_angle, seen_rate, middle_angle, middle_rate, feedback_norm]
}

#[test]
fn oracle_changes_at_every_optimisation_leave_as_much_as_is_expected_for_ever() {
    for (delay, error) in CASES {
        let switching = Design::new(&settings(delay, error)).unwrap().tightening.switching.unwrap();
        // Change at the beginning of the motion, and the size of each later change.
        for (first, each) in [(1.0, 0.0), (0.0, 1.0), (1.0, 0.1)] {
            let mut carried = switching.begin(&Carried::zeros(), first);
            let bounds = sizes(&switching.forever(&carried, each));
            let mut largest = [0.0; 7];
            for _ in 0..300 {
                for (i, size) in sizes(&switching.deviation(&carried)).into_iter().enumerate() {
                    assert!(size <= bounds[i] * (1.0 + 1e-9), "{delay} {error} {first} {i}");
                    largest[i] = f64::max(largest[i], size);
                }
                carried = switching.begin(&switching.next(&carried), each);
            }
            // Changes of one size add up to the bound itself.
            let near = |i: usize| largest[i] >= bounds[i] * (1.0 - 1e-6);
            assert!(first > 0.0 || (0..7).all(near), "{delay} {error}: {largest:?} {bounds:?}");
        }
    }
}

/// Returns the acceleration of x_ω under a moment, from the moment that each acceleration needs.
fn acceleration(s: &Settings, angles: &V, rates: &V, moment: &V) -> V {
    let needed = |a: &V| linearise::moment(&s.body, angles, rates, a);
    let without = needed(&V::zeros());
    let columns = [V::x(), V::y(), V::z()].map(|unit| needed(&unit) - without);
    Matrix3::from_columns(&columns).try_inverse().unwrap() * (moment - without)
}

#[test]
fn oracle_a_pulse_is_as_large_as_inertia_and_turn_make_it() {
    for share in [0.0, 0.1] {
        let settings = Settings { inertia_error: share, disturbance_bound: 0.0, ..settings(8, 2) };
        let switching = Design::new(&settings).unwrap().tightening.switching.unwrap();
        let [none, one] = [0.0, 1.0].map(|change| switching.pulse_of_command(change));
        let least = settings.delay_error / (1.0 - share);
        assert!(one - none >= least && one - none < 1.5 * least, "{} {least}", one - none);
        // The vehicle turns on under the older moment for a period. The worst state was sought.
        let mut random = Random(7);
        let mut largest: f64 = 0.0;
        for _ in 0..20_000 {
            let mut vector = |size: f64| random.direction() * size;
            let (spin, moment) = (vector(settings.limit_rate), vector(settings.limit_moment));
            let side = vector(settings.sideslip_domain).y.signum();
            let angles = V::new(3.2 * vector(1.0).x, side * settings.sideslip_domain * 0.98, 0.0);
            let rates = kinematics::r(&angles) * spin;
            let at = |angles: &V, rates: &V| acceleration(&settings, angles, rates, &moment);
            let (a, tau) = (at(&angles, &rates), settings.period_feedback);
            let after = angles + (rates + a * (0.5 * tau)) * tau;
            largest = largest.max((at(&after, &(rates + a * tau)) - a).norm());
        }
        assert!(largest <= switching.turn, "{largest} {}", switching.turn);
        assert!(largest > 0.3 * switching.turn, "{largest} {}", switching.turn);
    }
}

/// Random numbers of a repeatable sequence.
struct Random(u64);

impl Random {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn direction(&mut self) -> V {
        V::from_fn(|_, _| self.between(-1.0, 1.0)).normalize()
    }
}
