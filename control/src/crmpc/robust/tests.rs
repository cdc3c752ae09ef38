//! The check of a motion compared with the bounds that it estimates.

use super::*;
use crate::crmpc::settings::Constraints;
use crate::error_dynamics::Gain;
use crate::linearise::{self, InverseKinematics};
use crate::mpc::{self, Bounded, ErrorTrajectory};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;
use vehicle::kinematics;

fn robust() -> Robust {
    let settings = Settings::new(Constraints::Robust).resolved().unwrap();
    Robust::new(&settings, &Design::new(&settings).unwrap())
}

/// A wave of (Θ̃, x̃_ω, a) over the horizon, which is all that the check needs of a motion.
fn wave() -> impl Strategy<Value = ErrorTrajectory<2>> {
    let component = || (-1.0..1.0, -1.0..1.0, 0.0..0.3, 0.0..6.3);
    let sizes = ((-2.0..0.0), (-3.0..-0.8), (-3.0..-0.8));
    (sizes, prop::collection::vec(component(), 9)).prop_map(
        |((angle, rate, acceleration), components)| {
            let mut motion = ErrorTrajectory::new(100);
            let at = |k: usize, first: usize, decade: f64| {
                Vector3::from_fn(|i, _| {
                    let (mean, amplitude, frequency, phase) = components[first + i];
                    10.0_f64.powf(decade)
                        * (mean + amplitude * f64::sin(phase + frequency * k as f64))
                })
            };
            for (k, state) in motion.states.iter_mut().enumerate() {
                *state = [at(k, 0, angle), at(k, 3, rate)];
            }
            for (k, input) in motion.inputs.iter_mut().enumerate() {
                *input = at(k, 6, acceleration);
            }
            motion
        },
    )
}

fn run(cases: u32, property: impl Fn(ErrorTrajectory<2>) -> Result<(), TestCaseError>) {
    let random = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(config, random).run(&wave(), property).unwrap();
}

fn count(of: &Cell<[usize; 2]>, which: bool) {
    let mut counts = of.get();
    counts[usize::from(which)] += 1;
    of.set(counts);
}

#[test]
fn oracle_the_check_of_the_horizon_finds_what_exact_bounds_find() {
    let (violations, by_size) = (Cell::new([0; 2]), Cell::new([0; 2]));
    run(5000, |motion| {
        let n = motion.inputs.len();
        let robust = robust();
        let [mut checked, mut exact] = [(); 2].map(|()| mpc::Bounds::unlimited(n));
        let found = robust.violated(&motion, 0..n, &mut checked);
        robust.bounds_about(&motion, 0..n, &mut exact);
        let (of_rate, of_moment) = robust.reserves();
        let violates = |&k: &usize| {
            let input = motion.inputs.get(k + 1).copied().unwrap_or_default();
            let (rate, _) = robust.nonempty((exact.state[k + 1], 1.0));
            let (_, moment) = robust.nonempty((1.0, exact.input[k]));
            let of_end = robust.squares(k + 1, &motion.states[k + 1], &input, (rate, 1.0)).0;
            let of_input = robust.squares(k, &motion.states[k], &motion.inputs[k], (1.0, moment)).1;
            of_end.sqrt() * rate > exact.state[k + 1] + of_rate
                || of_input.sqrt() * moment > exact.input[k] + of_moment
        };
        let expected = (0..n).find(violates).zip((0..n).rfind(violates));
        count(&violations, found.is_some());
        let expected = expected.map(|(first, last)| first..last + 1);
        prop_assert_eq!(&found, &expected);
        // Bounds of the intervals between violated ones stay unchanged.
        for k in (0..n).filter(|k| !expected.as_ref().is_some_and(|range| range.contains(k))) {
            prop_assert!(checked.state[k + 1] <= exact.state[k + 1] + 1e-12, "{}", k);
            prop_assert!(checked.input[k] <= exact.input[k] + 1e-6, "{}", k);
            count(&by_size, checked.input[k] < exact.input[k]);
        }
        Ok(())
    });
    // Both outcomes must occur, and both ways of deciding them.
    let least = |of: &Cell<[usize; 2]>| of.get().into_iter().min().unwrap();
    assert!(least(&violations) > 40 && least(&by_size) > 4000, "{violations:?} {by_size:?}");
}

#[test]
fn oracle_bounds_by_size_hold_from_any_stage() {
    let tightest = Cell::new(0.0_f64);
    run(100, |motion| {
        let robust = robust();
        let point = |k| robust.stages.point(&motion, k);
        for k in 0..motion.inputs.len() {
            let (here, next) = (point(k), point(k + 1));
            let anchor = robust.anchor(&point(k - k % 10));
            let (estimate, exact) =
                (robust.estimate(k, &here, &next, &anchor), robust.interval(k, &here, &next));
            let rounding = 1.0 + 1e-12;
            prop_assert!(estimate.moment * rounding >= exact.moment, "{}", k);
            prop_assert!(estimate.rate * rounding >= exact.rate, "{}", k);
            prop_assert!(estimate.moment_bound <= exact.moment_bound * rounding, "{}", k);
            prop_assert!(estimate.rate_bound <= exact.rate_bound * rounding, "{}", k);
            let known = anchor.motion.moment(&here.acceleration).norm();
            if estimate.moment > known {
                let share = (exact.moment - known) / (estimate.moment - known);
                tightest.set(tightest.get().max(share));
            }
        }
        Ok(())
    });
    assert!(tightest.get() > 0.3, "{tightest:?}");
}

/// Random numbers of a repeatable sequence.
struct Random(u64);

impl Random {
    /// Draws a number uniformly from [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    fn direction(&mut self) -> Vector3<f64> {
        let vector = Vector3::from_fn(|_, _| self.between(-1.0, 1.0));
        vector.try_normalize(0.1).unwrap_or_else(|| self.direction())
    }

    /// Draws a vector in the ball of this radius, often on its surface.
    fn within_ball(&mut self, radius: f64) -> Vector3<f64> {
        self.direction() * radius * self.between(0.0, 2.0).min(1.0)
    }
}

/// One interval of a plan, with a held.
struct Stage {
    angles: Vector3<f64>,
    rates: Vector3<f64>,
    acceleration: Vector3<f64>,
}

impl Stage {
    /// Returns the angles and rates after this time.
    fn at(&self, time: f64) -> (Vector3<f64>, Vector3<f64>) {
        let Self { angles, rates, acceleration: a } = self;
        (angles + (rates + a * (0.5 * time)) * time, rates + a * time)
    }

    /// Returns the stage with rates and acceleration scaled by `size`.
    fn scaled(&self, size: f64) -> Self {
        let Self { angles, rates, acceleration } = self;
        Self { angles: *angles, rates: rates * size, acceleration: acceleration * size }
    }

    fn is_certified(&self, robust: &Robust) -> bool {
        let Settings { period_optimisation: h, .. } = robust.settings;
        let (angles, rates) = self.at(h);
        let here = Point::new(self.angles, self.rates, self.acceleration);
        let next = Point::new(angles, rates, Vector3::zeros());
        let rates = here.motion(&robust.settings.body);
        let by_angles = norm_of_columns(&rates.rates_by_angles);
        let reserves = robust.reserves();
        robust.interval(0, &here, &next).keeps(reserves)
            && rates.rates.norm() <= robust.rate_bound(0, by_angles, &here, &here) + reserves.0
            && robust.keeps_sideslip(
                0,
                [here.angles.y, here.rates.y],
                here.acceleration.y,
                next.angles.y,
            )
    }
}

/// Largest shares of the limits on moment, rates and sideslip that the stage needs at any instant,
/// for all deviations of docs/guarantee.md and at `samples` instants per feedback period, with the
/// derivatives at that instant.
fn needs(robust: &Robust, stage: &Stage, samples: usize, random: &mut Random) -> [f64; 4] {
    let Settings { body, limit_moment, limit_rate, period_feedback: tau, sideslip_domain, .. } =
        robust.settings;
    let Design { tightening, largest_inertia, smallest_inertia, ratio, .. } = &robust.design;
    let spread = largest_inertia - smallest_inertia;
    let a = stage.acceleration;
    let curvature = 10.0_f64.sqrt();
    let mut largest = [0.0_f64; 4];
    let mut note = |i: usize, share: f64| largest[i] = largest[i].max(share);
    for tick in 0..*ratio {
        let (now, then) = (tightening.at(robust.age + tick), tightening.at(robust.age + tick + 1));
        let begin = tick as f64 * tau;
        let (angles, rates) = stage.at(begin + 0.5 * tau);
        let at = InverseKinematics::at(&angles).linearise(&body, &rates, &a).moment;
        let (angle, rate, x) = (now.middle_angle, now.middle_rate, rates.norm());
        let turned = now.feedback * largest_inertia * (2.0_f64 * 3.0).sqrt() * angle;
        let induced_norm =
            now.feedback * super::super::robust::largest_over_box(&at.by_acceleration);
        let further = x + rate;
        let drift = robust.dynamics.geometry.drift;
        let second = 0.5 * largest_inertia * curvature * a.norm() * angle * angle
            + (largest_inertia * drift + 0.5 * spread) * rate * rate
            + (largest_inertia * 2.0 * curvature + 4.0 * spread) * further * angle * rate
            + 0.5 * (largest_inertia * 8.0 + 12.0 * spread) * further * further * angle * angle;
        let moment = at.value.norm()
            + at.by_angles.norm() * angle
            + at.by_rates.norm() * rate
            + (induced_norm + turned).min(now.feedback * tightening.induced_norm)
            + now.feedback_norm * largest_inertia
            + now.feedback_moment
            + second;
        note(0, moment / limit_moment);
        // A deviation within these bounds, and the moment that the law commands there.
        let box_part = random.direction().map(|x| x.signum() * now.feedback);
        let turn = random.within_ball(angle);
        let commanded = linearise::moment(
            &body,
            &(angles + Vector3::new(turn.x, turn.y, 0.0)),
            &(rates + random.within_ball(rate)),
            &(a + box_part + random.within_ball(now.feedback_norm)),
        );
        note(3, (commanded.norm() + now.feedback_moment) / limit_moment);
        for sample in 0..=samples {
            let share = sample as f64 / samples as f64;
            let (angles, rates) = stage.at(begin + share * tau);
            let between = |from: f64, to: f64| from + share * (to - from);
            let (angle, rate) = (between(now.angle, then.angle), between(now.rate, then.rate));
            let (omega, by_angles) = InverseKinematics::at(&angles).body_rates(&rates);
            let norm = omega.norm()
                + rate
                + norm_of_columns(&by_angles) * angle
                + 0.5 * curvature * rates.norm() * angle * angle;
            note(1, norm / limit_rate);
            note(2, (angles.y.abs() + angle) / sideslip_domain);
        }
    }
    largest
}

/// Draws stages at the edge of their certificate and returns the largest needs, in the order of
/// [`needs`], with the share of the stages that come within a hundredth of each limit.
fn worst_of_random_stages(count: usize, samples: usize, period: f64) -> ([f64; 4], [f64; 3]) {
    let settings = Settings {
        period_optimisation: period,
        terminal: Gain { k1: -0.6, k2: -1.6 },
        ..Settings::new(Constraints::Robust).resolved().unwrap()
    };
    let mut robust = Robust::new(&settings, &Design::new(&settings).unwrap());
    let random = &mut Random(0x9e37_79b9_7f4a_7c15 ^ count as u64);
    let (mut worst, mut near) = ([0.0_f64; 4], [0.0; 3]);
    for _ in 0..count {
        robust.age = random.between(0.0, 80.0) as usize;
        let mut begin = || Stage {
            angles: Vector3::new(
                random.between(-3.2, 3.2),
                settings.sideslip_domain * random.between(-1.2, 1.2).clamp(-1.0, 1.0),
                0.0,
            ),
            rates: random.within_ball(1.5 * settings.limit_rate),
            acceleration: random
                .within_ball(2.0 * settings.limit_moment / robust.design.largest_inertia),
        };
        let mut stage = begin();
        while !stage.scaled(0.0).is_certified(&robust) {
            stage = begin();
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..16 {
            let middle = 0.5 * (low + high);
            if stage.scaled(middle).is_certified(&robust) { low = middle } else { high = middle }
        }
        let found = needs(&robust, &stage.scaled(low), samples, random);
        for i in 0..4 {
            worst[i] = worst[i].max(found[i]);
        }
        for i in 0..3 {
            near[i] += f64::from(u8::from(found[i] > 0.99)) / count as f64;
        }
    }
    (worst, near)
}

fn assert_stages_need_no_more_than_their_limits(count: usize) {
    for (period, samples) in [(0.08, 8), (0.2, 4), (0.4, 4), (1.0, 4)] {
        let (worst, near) = worst_of_random_stages(count, samples, period);
        println!("{count} stages of {period} s: largest needs {worst:?}, near a limit {near:?}");
        assert!(worst.iter().all(|need| *need <= 1.0 + 1e-12), "{period} s: {worst:?}");
        // Each limit ends the certificate of some stages. With long periods it is mostly the
        // moment.
        let seldom = near.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(seldom > 1e-3 || period > 0.3, "{period} s: {near:?}");
    }
}

#[test]
fn oracle_no_certified_stage_needs_more_than_its_limits_at_any_instant() {
    assert_stages_need_no_more_than_their_limits(2_500);
}

#[test]
#[ignore = "a million stages take a minute; their numbers are in docs/proof.md"]
fn oracle_no_certified_stage_of_a_million_needs_more_than_its_limits() {
    assert_stages_need_no_more_than_their_limits(250_000);
}

#[test]
fn oracle_rates_at_their_limit_are_never_shown_beyond_what_errors_explain() {
    let (settings, degree) = (Settings::new(Constraints::Robust), f64::to_radians(1.0));
    let settings = Settings {
        angle_error: 0.2 * degree,
        rate_error: 0.2 * degree,
        disturbance_bound: 0.2 * degree,
        feedback: Gain { k1: -0.5, k2: -1.5 },
        ..settings
    };
    let robust = Robust::new(&settings, &Design::new(&settings).unwrap());
    let (random, mut largest) = (&mut Random(11), 0.0_f64);
    for _ in 0..20_000 {
        let edge = random.between(-1.0, 1.0) * settings.sideslip_domain;
        let angles = Vector3::new(random.between(-3.2, 3.2), edge, 0.0);
        let rates = random.direction() * settings.limit_rate;
        let mut corner = |size: f64| random.direction().map(f64::signum) * size;
        let seen = angles + corner(settings.angle_error);
        let shown = kinematics::r(&angles) * rates + corner(settings.rate_error);
        largest = largest.max((kinematics::r_inverse(&seen) * shown).norm());
    }
    let (beyond, explained) = (settings.limit_rate, robust.design.tightening.explained.rate);
    assert!(largest <= explained, "{largest} {explained}");
    assert!(largest - beyond > 0.8 * (explained - beyond), "{largest} {explained}");
}

#[test]
fn oracle_rates_between_two_stages_exceed_their_line_by_no_more_than_is_counted() {
    let robust = robust();
    let Settings { limit_rate, limit_moment, sideslip_domain, period_optimisation: h, .. } =
        robust.settings;
    let most = limit_moment / robust.design.smallest_inertia;
    let (random, mut largest) = (&mut Random(5), 0.0_f64);
    for _ in 0..5_000 {
        let edge = random.between(-1.0, 1.0) * sideslip_domain;
        let stage = Stage {
            angles: Vector3::new(random.between(-3.2, 3.2), edge, 0.0),
            rates: random.within_ball(limit_rate),
            acceleration: random.within_ball(most),
        };
        let rate = |share: f64| {
            let (angles, rates) = stage.at(share * h);
            (InverseKinematics::at(&angles).body_rates(&rates).0.norm(), rates.norm())
        };
        let [(from, x), (to, y)] = [rate(0.0), rate(1.0)];
        let counted =
            robust.design.tightening.tick(0).rate_loss.within(x.max(y), stage.acceleration.norm());
        for share in [0.25, 0.5, 0.75] {
            let beyond = rate(share).0 - (from + share * (to - from));
            assert!(beyond <= counted, "{beyond} {counted}");
            largest = largest.max(beyond / counted);
        }
    }
    assert!(largest > 0.02, "{largest}");
}

#[test]
fn oracle_a_sideslip_that_falls_as_the_deviation_grows_keeps_its_domain_at_every_tick() {
    let mut robust = robust();
    let Settings { period_feedback: tau, period_optimisation: h, .. } = robust.settings;
    let domain = robust.settings.sideslip_domain;
    for age in 0..40 {
        robust.age = age;
        let off = |i: usize| robust.design.tightening.at(age + i).angle;
        let rate = (off(0) - off(robust.design.ratio)) / h;
        let keeps = |from: f64| robust.keeps_sideslip(0, [from, rate], 0.0, from + rate * h);
        let (mut low, mut high) = (0.0, domain);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if keeps(middle) { low = middle } else { high = middle }
        }
        let at = |i: usize| low + rate * i as f64 * tau + off(i);
        let largest = (0..=robust.design.ratio).map(at).fold(0.0, f64::max);
        assert!((largest - domain).abs() < 1e-9, "{age}: {largest} {domain}");
    }
}
