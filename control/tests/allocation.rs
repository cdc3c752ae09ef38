//! Control allocation compared with the limits and the optimum of Wu et al. (2015) and with the
//! selector of Jia et al.

use crate::prelude::*;
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{NonnegativeConeT, ZeroConeT};
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver};
use control::allocation::attainable::{Ball, Reach, largest_ball};
use control::allocation::pwpf::{Modulator, Pwpf};
use control::allocation::{AllocationStatus, Command, JetCommand, Memory, Method, Settings};
use vehicle::effectors::{EffectorFault, EffectorFaultKind, Effectors, SURFACES};

/// Pressure at which the effectiveness is as printed, Pa.
const PRESSURE: f64 = 2859.0;
const METHODS: [Method; 2] = [Method::Optimal, Method::Blending];

fn settings(method: Method, jets: JetCommand) -> Settings {
    Settings { method, jets, ..Settings::published() }
}

fn allocator(method: Method) -> Allocator {
    Allocator::new(settings(method, JetCommand::Duty)).unwrap()
}

fn command(moment: [f64; 3], dynamic_pressure: f64) -> Command {
    Command { moment: Vector3::from(moment), dynamic_pressure, ..Command::default() }
}

/// Returns the memory after `samples` samples of a constant command.
fn settled(allocator: &mut Allocator, samples: u64, command: &Command) -> Memory {
    let mut memory = Memory::default();
    for tick in 0..samples {
        allocator.update(&mut memory, tick, 0.0, command);
        assert_eq!(memory.report.status, AllocationStatus::Optimal, "{tick}");
    }
    memory
}

/// Checks (59) with the numbers of (63), and (65), in degrees.
fn assert_within_limits(before: &Memory, after: &Memory, what: &str) {
    let min = [-25.0, -25.0, -25.0, -25.0, -10.0, -10.0, 0.0, 0.0];
    let max = [0.0, 0.0, 0.0, 0.0, 30.0, 30.0, 0.0, 0.0];
    for i in 0..SURFACES {
        let (old, new) = (before.surfaces[i].to_degrees(), after.surfaces[i].to_degrees());
        // The tolerance covers the rounding of degrees alone.
        assert!(new >= min[i] - 1e-13 && new <= max[i] + 1e-13, "{what}: surface {i} at {new} deg");
        assert!((new - old).abs() <= 0.1 + 1e-13, "{what}: surface {i}: {old} {new} deg");
    }
    assert!(after.duty.iter().all(|duty| (0.0..=1.0).contains(duty)), "{what}");
    assert_eq!(after.surfaces.rows(6, 2).amax(), 0.0, "{what}: rudders");
}

#[test]
fn published_limits_hold_at_every_sample_of_200_random_cases() {
    let mut random = Random::new(1);
    let mut symmetric = |size: f64| random.between(-size, size);
    for case in 0..200 {
        for method in METHODS {
            let mut allocator = allocator(method);
            let mut memory = Memory::default();
            let size = 10f64.powf(5.0 + symmetric(1.5));
            let mut command = command([0.0; 3], 1500.0 + symmetric(1500.0));
            for tick in 0..50 {
                if tick % 10 == 0 {
                    command.moment = Vector3::from_fn(|_, _| symmetric(size));
                }
                let before = memory;
                allocator.update(&mut memory, tick, 0.0, &command);
                let what = format!("case {case}, {method:?}, sample {tick}");
                assert_eq!(memory.report.status, AllocationStatus::Optimal, "{what}");
                assert_within_limits(&before, &memory, &what);
                let matrix = Effectors::published();
                let achieved = matrix.effectiveness_at(command.dynamic_pressure) * memory.surfaces
                    + matrix.moment_of_jets(&memory.duty);
                assert!((achieved - memory.achieved).norm() <= 1e-9 * size, "{what}");
                assert!(
                    (command.moment - achieved - memory.residual).norm() <= 1e-9 * size,
                    "{what}"
                );
            }
        }
    }
}

#[test]
fn oracle_duty_cycles_of_the_modulator() {
    // The exact times are T_on = T_m ln[(u_on + K_m (1 − r))/(u_off + K_m (1 − r))] and T_off = T_m
    // ln[(K_m r − u_off)/(K_m r − u_on)].
    let pwpf = Settings::published().pwpf;
    let duty_cycle = |duty: f64| {
        let mut state = Modulator::default();
        let mut fired = 0;
        // The count covers a whole number of seconds after the first pulse.
        for step in 0..101_000 {
            state = pwpf.advance(state, duty);
            fired += i32::from(state.on && step >= 1000);
        }
        f64::from(fired) / 1e5
    };
    let [gain, time, on, off] = [pwpf.gain, pwpf.time_constant, pwpf.on, pwpf.off];
    for (duty, rounded) in [(0.2, 0.13), (0.5, 0.43), (0.8, 0.73), (1.0, 0.94)] {
        let pulse = time * ((on + gain * (1.0 - duty)) / (off + gain * (1.0 - duty))).ln();
        let pause = time * ((gain * duty - off) / (gain * duty - on)).ln();
        let exact = pulse / (pulse + pause);
        assert!((exact - rounded).abs() <= 0.005, "{duty}: {exact}");
        // Pulse and pause each end up to one evaluation of 1 ms late.
        let computed = duty_cycle(duty);
        let slack = pwpf.period / (pulse + pause);
        assert!((computed - exact).abs() <= slack, "{duty}: {computed} instead of {exact}");
        assert!((computed - rounded).abs() <= 0.006, "{duty}: {computed} instead of {rounded}");
    }
    // The dead band is u_on/K_m.
    assert_eq!(duty_cycle(0.0999), 0.0);
    assert!(duty_cycle(0.1001) > 0.0);
}

/// Returns the describing function of two opposed jets: the first harmonic of their thrust (from −1
/// to 1) over a sine that is commanded, as magnitude and phase (rad). The amplitude of the sine is
/// a duty cycle, its frequency in rad/s; each jet gets one half-wave.
///
/// A. Gelb and W. E. Vander Velde, "Multiple-input describing functions and nonlinear system
/// design", 1968.
fn describing_function(pwpf: &Pwpf, amplitude: f64, frequency: f64) -> (f64, f64) {
    // The first period is left out.
    let (periods, samples) = (8.0, (TAU / (frequency * pwpf.period)).round());
    let mut jets = [Modulator::default(); 2];
    let (mut in_phase, mut ahead) = (0.0, 0.0);
    for k in 0..(samples * (1.0 + periods)) as u64 {
        let (sine, cosine) = (TAU * (k as f64 / samples).fract()).sin_cos();
        // What is commanded at a sample acts until the next one, as in the allocator.
        let thrust = f64::from(u8::from(jets[0].on)) - f64::from(u8::from(jets[1].on));
        if k >= samples as u64 {
            in_phase += thrust * sine;
            ahead += thrust * cosine;
        }
        for (jet, sign) in jets.iter_mut().zip([1.0, -1.0]) {
            *jet = pwpf.advance(*jet, (sign * amplitude * sine).clamp(0.0, 1.0));
        }
    }
    let share = 2.0 / (amplitude * samples * periods);
    (share * in_phase.hypot(ahead), ahead.atan2(in_phase))
}

#[test]
fn regress_the_describing_function_is_that_of_the_page_on_margins() {
    let frequencies = [0.5, 1.0, 2.0, 4.0, 8.0];
    let table = [
        (0.15, [(0.39, 2.0), (0.39, 2.0), (0.35, 3.0), (0.36, -5.0), (0.37, -25.0)]),
        (0.2, [(0.56, 0.0), (0.56, 0.0), (0.54, 1.0), (0.54, -5.0), (0.54, -19.0)]),
        (0.3, [(0.71, 1.0), (0.71, 1.0), (0.71, -1.0), (0.68, -1.0), (0.63, -2.0)]),
        (0.5, [(0.83, 0.0), (0.83, -1.0), (0.82, 0.0), (0.82, -2.0), (0.82, -7.0)]),
        (1.0, [(0.92, 0.0), (0.92, 0.0), (0.92, -1.0), (0.91, -2.0), (0.91, -2.0)]),
    ];
    for (amplitude, row) in table {
        for (frequency, (gain, phase_deg)) in frequencies.into_iter().zip(row) {
            let (found, phase) =
                describing_function(&Settings::published().pwpf, amplitude, frequency);
            let (gain_off, phase_off) = (found - gain, phase.to_degrees() - phase_deg);
            assert!(
                gain_off.abs() < 0.0051 && phase_off.abs() < 0.51,
                "{amplitude}, {frequency} rad/s: {found}, {phase} rad"
            );
        }
    }
}

#[test]
fn oracle_the_describing_function_at_low_frequency_is_that_of_the_duty_cycles() {
    let pwpf = Settings::published().pwpf;
    let [gain, on, off] = [pwpf.gain, pwpf.on, pwpf.off];
    let duty = |command: f64| {
        if command <= on / gain {
            return 0.0;
        }
        let pulse = ((on + gain * (1.0 - command)) / (off + gain * (1.0 - command))).ln();
        let pause = ((gain * command - off) / (gain * command - on)).ln();
        pulse / (pulse + pause)
    };
    for amplitude in [0.15, 0.3, 1.0] {
        // (2/π A) ∫ d(A sin θ) sin θ dθ over half a period, of the exact duty cycle d.
        let parts = 20_000;
        let angle = |k: i32| (f64::from(k) + 0.5) * std::f64::consts::PI / f64::from(parts);
        let integral: f64 =
            (0..parts).map(|k| duty(amplitude * angle(k).sin()) * angle(k).sin()).sum();
        let exact = 2.0 * integral / (f64::from(parts) * amplitude);
        let (found, phase) = describing_function(&pwpf, amplitude, 0.02);
        assert!((found / exact - 1.0).abs() < 0.02, "{amplitude}: {found} instead of {exact}");
        assert!(phase.abs() < 0.03, "{amplitude}: {phase}");
    }
}

#[test]
fn surfaces_alone_give_what_they_can_once_the_rate_let_them() {
    let commanded = command([1e4, -1e4, -3e3], PRESSURE);
    let mut optimal = allocator(Method::Optimal);
    let memory = settled(&mut optimal, 1, &commanded);
    assert!(memory.duty.sum() > 0.1, "the rate leaves most to the jets at first");
    assert!(memory.residual.norm() < 1e-3 && memory.surfaces.amax() <= 0.1f64.to_radians());
    let memory = settled(&mut optimal, 300, &commanded);
    assert!(memory.duty.sum() < 1e-6 && memory.residual.norm() < 1e-3, "{memory:?}");
}

#[test]
fn blending_uses_surfaces_first_and_above_the_threshold_only() {
    let mut blending = allocator(Method::Blending);
    let threshold = Settings::published().threshold;
    let commanded = [1e4, -1e4, -3e3];
    let memory = settled(&mut blending, 300, &command(commanded, threshold - 1.0));
    assert_eq!(memory.surfaces.amax(), 0.0);
    assert!(memory.duty.sum() > 0.5 && memory.residual.norm() < 1e-3);

    let memory = settled(&mut blending, 300, &command(commanded, PRESSURE));
    assert!(memory.duty.sum() < 1e-6 && memory.residual.norm() < 1e-3, "{memory:?}");

    // The moment exceeds the position limits, so that the remainder goes to the jets.
    let commanded = command([0.0, -3.2e5, 0.0], PRESSURE);
    let memory = settled(&mut blending, 600, &commanded);
    let effectors = Effectors::published();
    // An interior-point solution comes only close to a limit.
    assert!((memory.surfaces[4] - effectors.max[4]).abs() < 1e-6, "{}", memory.surfaces);
    let rest = commanded.moment - effectors.effectiveness_at(PRESSURE) * memory.surfaces;
    assert!((effectors.moment_of_jets(&memory.duty) - (rest - memory.residual)).norm() < 1e-6);
    assert!(memory.duty.sum() > 1.0);
}

#[test]
fn blending_asks_no_more_of_the_surfaces_than_the_jets_can_make_up_for() {
    // The surfaces alone give 21.6 kN m on all axes at once. If each were cut to its limit
    // separately, they would cause roll and pitch moments that were not commanded, more than the
    // jets can cancel.
    for moment in [[5e4; 3], [-5e4; 3]] {
        let memory = settled(&mut allocator(Method::Blending), 600, &command(moment, PRESSURE));
        assert!(memory.residual.norm() < 1.0, "{memory:?}");
        let by_surfaces = Effectors::published().effectiveness_at(PRESSURE) * memory.surfaces;
        assert!(
            (by_surfaces - Vector3::from(moment)).norm() > 2e4,
            "jets are needed: {by_surfaces}"
        );
    }
}

#[test]
fn without_an_optimum_the_previous_allocation_is_kept_within_the_limits() {
    for method in METHODS {
        let mut memory = settled(&mut allocator(method), 40, &command([8e4, -1e5, -2e4], PRESSURE));
        let before = memory;
        let mut stopped =
            Allocator::new(Settings { max_iterations: 1, ..settings(method, JetCommand::Duty) })
                .unwrap();
        let commanded = command([-8e4, 1e5, 2e4], PRESSURE);
        stopped.update(&mut memory, 0, 0.0, &commanded);
        assert_eq!(memory.report.status, AllocationStatus::Fallback);
        assert_eq!((memory.report.fallbacks, memory.duty), (1, before.duty));
        assert_within_limits(&before, &memory, "stopped");
        if method == Method::Optimal {
            assert_eq!(memory.surfaces, before.surfaces);
        }
        for bad in [[f64::NAN, 0.0, 0.0], [f64::INFINITY, 0.0, 0.0], [0.0, 1e300, 0.0]] {
            let before = memory;
            allocator(method).update(&mut memory, 0, 0.0, &command(bad, PRESSURE));
            assert_within_limits(&before, &memory, "bad");
        }
        let before = memory;
        allocator(method).update(&mut memory, 0, 0.0, &command([0.0; 3], f64::NAN));
        assert_within_limits(&before, &memory, "bad");
        allocator(method).update(&mut memory, 1, 0.0, &commanded);
        assert_eq!(memory.report.status, AllocationStatus::Optimal, "it recovers");
    }
}

#[test]
fn jets_switch_between_allocations() {
    let mut allocator = Allocator::new(settings(Method::Optimal, JetCommand::Pwpf)).unwrap();
    assert_eq!((allocator.period(), allocator.ratio()), (0.001, 10));
    let mut memory = Memory::default();
    let commanded = command([0.0, 0.0, 2e4], 0.0);
    let mut mean = Vector3::zeros();
    let mut switched_between = 0;
    for tick in 0..20_000 {
        let before = memory;
        allocator.update(&mut memory, tick, 0.0, &commanded);
        assert!(memory.jets.iter().all(|&jet| jet == 0.0 || jet == 1.0));
        switched_between += u32::from(memory.jets != before.jets && tick % 10 != 0);
        mean += memory.modulated / 20_000.0;
    }
    assert!(switched_between > 100);
    // The dead band of the modulator reduces the moment: the jet fires less than its commanded duty
    // cycle.
    assert!(mean.z > 0.5 * commanded.moment.z && mean.z < commanded.moment.z, "{mean}");
}

/// Largest multiple of a moment that effectors can give, by a linear program in their commands.
fn reach_along(effectors: &[Reach], offset: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    const SCALE: f64 = 1e4;
    let count = effectors.len();
    // The unknowns are the multiple and the commands; rows are the moment's axes, then both limits.
    let mut entries = vec![(0, 0, -direction.x), (1, 0, -direction.y), (2, 0, -direction.z)];
    let mut right_side: Vec<f64> = (-offset / SCALE).iter().copied().collect();
    for (j, (column, low, high)) in effectors.iter().enumerate() {
        entries.extend((0..3).map(|i| (i, 1 + j, column[i] / SCALE)));
        entries.extend([(3 + 2 * j, 1 + j, 1.0), (4 + 2 * j, 1 + j, -1.0)]);
        right_side.extend([*high, -low]);
    }
    let (rows, (columns, values)): (Vec<_>, (Vec<_>, Vec<_>)) =
        entries.into_iter().map(|(i, j, value)| (i, (j, value))).unzip();
    let matrix = CscMatrix::new_from_triplets(3 + 2 * count, 1 + count, rows, columns, values);
    let cost = CscMatrix::zeros((1 + count, 1 + count));
    let mut aim = vec![0.0; 1 + count];
    aim[0] = -1.0;
    let cones = [ZeroConeT(3), NonnegativeConeT(2 * count)];
    let tight = 1e-12;
    let settings = DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_abs(tight)
        .tol_gap_rel(tight)
        .tol_feas(tight)
        .build()
        .unwrap();
    let mut solver =
        DefaultSolver::new(&cost, &aim, &matrix, &right_side, &cones, settings).unwrap();
    solver.solve();
    solver.solution.x[0] * SCALE
}

#[test]
fn oracle_the_largest_ball_is_the_reach_of_a_linear_program_in_its_direction_and_less_in_others() {
    let mut random = Random::new(3);
    let printed = Effectors::published();
    for case in 0..40 {
        let pressure = if case == 0 { 0.0 } else { random.between(100.0, 2e4) };
        let matrix = printed.effectiveness_at(pressure);
        let jets = (0..10).map(|i| (printed.jet_moments.column(i).into_owned(), 0.0, 1.0));
        let effectors: Vec<Reach> = (0..SURFACES)
            .map(|i| (matrix.column(i).into_owned(), printed.min[i], printed.max[i]))
            .filter(|_| case > 0)
            .chain(jets)
            .collect();
        let offset = Vector3::from_fn(|_, _| random.between(-2e3, 2e3)) * f64::from(case % 2);
        let Ball { radius, axis } = largest_ball(&effectors, &offset);
        assert!(radius > 1e3 && (axis.norm() - 1.0).abs() < 1e-12, "{case}: {radius}");
        let reached = reach_along(&effectors, &offset, &axis);
        assert!((reached - radius).abs() <= 1e-9 * radius, "{case}: {reached} {radius}");
        for _ in 0..25 {
            let other = Vector3::from_fn(|_, _| random.between(-1.0, 1.0)).normalize();
            let reached = reach_along(&effectors, &offset, &other);
            assert!(reached >= radius * (1.0 - 1e-9), "{case}: {reached} {radius} {other}");
        }
    }
}

#[test]
fn effectors_that_leave_an_axis_without_moment_attain_no_ball() {
    let about = |x: f64, y: f64, z: f64| (Vector3::new(x, y, z), -1.0, 1.0);
    let no_yaw = [about(1.0, 0.0, 0.0), about(0.0, 1.0, 0.0), about(1.0, 1.0, 0.0)];
    assert_eq!(largest_ball(&no_yaw, &Vector3::zeros()).radius, 0.0);
    assert_eq!(largest_ball(&no_yaw[..1], &Vector3::zeros()), Ball::default());
    let box_of_three = [about(2.0, 0.0, 0.0), about(0.0, 3.0, 0.0), about(0.0, 0.0, 5.0)];
    let ball = largest_ball(&box_of_three, &Vector3::new(0.5, 0.0, 0.0));
    assert_eq!((ball.radius, ball.axis), (1.5, -Vector3::x()));
    // A moment that is there and cannot be cancelled leaves none.
    assert_eq!(largest_ball(&box_of_three, &Vector3::new(0.0, 4.0, 0.0)).radius, 0.0);
}

#[test]
fn below_the_threshold_of_blending_jets_alone_attain_moments() {
    let at = |method: Method, pressure: f64| {
        settled(&mut allocator(method), 1, &command([1e2, 0.0, 0.0], pressure))
    };
    let threshold = Settings::published().threshold;
    let below = at(Method::Blending, 0.9 * threshold);
    assert_eq!(below.attainable, at(Method::Optimal, 0.0).attainable);
    assert_eq!(below.surfaces_alone, 0.0);
    let [above, twice] = [1.1, 2.2].map(|factor| at(Method::Blending, factor * threshold));
    assert!(above.attainable.radius > below.attainable.radius);
    // The surfaces are in proportion to the dynamic pressure, and within a period hardly move.
    assert!((twice.surfaces_alone / above.surfaces_alone - 2.0).abs() < 1e-12);
    assert!(above.in_period < above.attainable.radius);
}

/// A told failure of a surface or a jet is made up for by the others, and shrinks the ball; the
/// moments count what the failed one gives.
#[test]
fn a_failure_that_is_told_is_made_up_for() {
    use EffectorFaultKind::{Floating, JetOff, JetOn, Slow, Stuck};
    let settings = Settings {
        method: Method::Optimal,
        jets: JetCommand::Duty,
        period: 0.04,
        ..Settings::published()
    };
    let effectors = settings.effectors.clone();
    let mut command = Command {
        moment: Vector3::new(2e3, -9e3, 4e3),
        dynamic_pressure: 7e3,
        ..Command::default()
    };
    let settle = |allocator: &mut Allocator,
                  memory: &mut Memory,
                  ticks: std::ops::Range<u64>,
                  command: &Command| {
        for tick in ticks {
            allocator.update(memory, tick, 0.04 * tick as f64, command);
        }
    };
    for kind in [Stuck, Floating, Slow, JetOn, JetOff] {
        let fault = EffectorFault { kind, number: 6, start: 4.0, share: 0.1 };
        let mut allocator = Allocator::new(Settings { fault, ..settings.clone() }).unwrap();
        let mut memory = Memory::default();
        settle(&mut allocator, &mut memory, 0..100, &command);
        let before = memory;
        command.moment *= -1.0;
        settle(&mut allocator, &mut memory, 100..101, &command);
        let change = (memory.surfaces[5] - before.surfaces[5]).abs();
        let (largest, failed) = (effectors.rate[5] * settings.period, memory.surfaces[5]);
        assert!(memory.attainable.radius < before.attainable.radius || kind == Slow, "{kind:?}");
        settle(&mut allocator, &mut memory, 101..400, &command);
        assert!(memory.residual.norm() < 1.0, "{kind:?}: {}", memory.residual);
        let mut duty = memory.duty;
        match kind {
            Stuck => assert_eq!((change, memory.surfaces[5]), (0.0, before.surfaces[5])),
            Floating => assert_eq!((failed, memory.surfaces[5]), (0.0, 0.0)),
            Slow => assert!(change <= 0.1 * largest * (1.0 + 1e-9), "{change}"),
            JetOn => duty[5] = 1.0,
            _ => duty[5] = 0.0,
        }
        let given =
            effectors.effectiveness_at(7e3) * memory.surfaces + effectors.moment_of_jets(&duty);
        assert!((given - memory.achieved).norm() < 1e-6, "{kind:?}: {}", given - memory.achieved);
        command.moment *= -1.0;
    }
}
