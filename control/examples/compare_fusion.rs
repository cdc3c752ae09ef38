//! Compares fusion filters of several crates on the same calibrated readings of the MEMS set:
//!
//! ```text
//! cargo run --release -p reentry-control --example compare_fusion
//! ```
//!
//! It also prints the errors of the estimator with its defaults. The output contains attitude
//! errors at rest and in the scenario of Chai 2022, with the gyroscope's bias known and with
//! 0.2 deg/s of it left on each axis, and time and allocations of an update.

#[path = "../tests/harness/mod.rs"]
mod harness;

use ahrs::{Ahrs as _, Madgwick, Mahony};
use control::estimation::fusion::{Fusion, Gains, triad};
use control::estimation::{Settings, angles, mems_corrections};
use harness::platform::{
    CALIBRATION_DURATION, PERIOD, Truth, calibrated, errors, estimates, felt, lines, mems, rest,
    rms, scenario,
};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::Instant;
use vehicle::platform::Readings;
use vehicle::sensor_data::SensorData;

/// An allocator that counts allocations.
struct Counting;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

#[allow(unsafe_code)]
// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Relaxed);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A function that returns the attitude after a sample: body axes from magnetic north, east, down.
type Step = Box<dyn FnMut(&Readings) -> Rotation3<f64>>;

/// A function that starts a filter from an attitude.
type Begin = Box<dyn Fn(&Rotation3<f64>) -> Step>;

/// A filter that takes part in the comparison.
struct Filter {
    name: String,
    begin: Begin,
}

fn filter(name: String, begin: impl Fn(&Rotation3<f64>) -> Step + 'static) -> Filter {
    Filter { name, begin: Box::new(begin) }
}

fn north_west_up() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

fn east_north_up() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
}

/// Returns the rotation to body axes from north, east, down, from a quaternion (w, x, y, z) that
/// leads from the body to other Earth axes.
fn from_quaternion([w, x, y, z]: [f64; 4], earth: &Matrix3<f64>) -> Rotation3<f64> {
    let to_earth =
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
    Rotation3::from_matrix_unchecked(to_earth.matrix().transpose() * earth)
}

fn to_quaternion(attitude: &Rotation3<f64>, earth: &Matrix3<f64>) -> [f64; 4] {
    let to_earth = Rotation3::from_matrix_unchecked(earth * attitude.matrix().transpose());
    let q = UnitQuaternion::from_rotation_matrix(&to_earth);
    [q.w, q.i, q.j, q.k]
}

fn array(vector: &Vector3<f64>) -> [f64; 3] {
    (*vector).into()
}

fn ours(gains: Gains) -> Filter {
    let name = format!("ahrs Mahony, level field, {} {}", gains.proportional, gains.integral);
    filter(name, move |start| {
        let mut fusion = Fusion::new(start, f64::INFINITY);
        Box::new(move |[rate, force, field]| {
            fusion.step(&gains, PERIOD, rate, Some((force, field)));
            fusion.attitude()
        })
    })
}

fn mahony(proportional: f64, integral: f64) -> Filter {
    filter(format!("ahrs Mahony, {proportional} {integral}"), move |start| {
        let mut mahony = Mahony::new(PERIOD, proportional, integral);
        let [w, x, y, z] = to_quaternion(start, &north_west_up());
        *mahony.quat.as_mut_unchecked() = [x, y, z, w].into();
        Box::new(move |readings| {
            let [rate, force, field] = readings.map(|reading| array(&reading).into());
            mahony.update(&rate, &force, &field).expect("a force and a field");
            let [x, y, z, w] = mahony.quat.as_ref().coords.into();
            from_quaternion([w, x, y, z], &north_west_up())
        })
    })
}

fn madgwick(beta: f64) -> Filter {
    filter(format!("ahrs Madgwick, {beta}"), move |start| {
        let mut madgwick = Madgwick::new(PERIOD, beta);
        let [w, x, y, z] = to_quaternion(start, &north_west_up());
        *madgwick.quat.as_mut_unchecked() = [x, y, z, w].into();
        Box::new(move |readings| {
            let [rate, force, field] = readings.map(|reading| array(&reading).into());
            madgwick.update(&rate, &force, &field).expect("a force and a field");
            let [x, y, z, w] = madgwick.quat.as_ref().coords.into();
            from_quaternion([w, x, y, z], &north_west_up())
        })
    })
}

fn fusion(gain: f32, learns: bool) -> Filter {
    let name = format!("fusion-ahrs, {gain}, {}", if learns { "bias learned" } else { "no bias" });
    filter(name, move |start| {
        let settings = fusion_ahrs::AhrsSettings { gain, ..fusion_ahrs::AhrsSettings::default() };
        let mut fusion = fusion_ahrs::Ahrs::with_settings(settings);
        let [w, x, y, z] = to_quaternion(start, &north_west_up()).map(|value| value as f32);
        fusion.set_quaternion(fusion_ahrs::Quaternion::new(w, x, y, z));
        fusion.skip_startup();
        let mut bias = fusion_ahrs::Bias::new();
        let vector = |reading: Vector3<f64>| {
            let [x, y, z] = array(&reading).map(|value| value as f32);
            fusion_ahrs::Vector::new(x, y, z)
        };
        Box::new(move |[rate, force, field]| {
            let rate = vector(rate.map(f64::to_degrees));
            let rate = if learns { bias.update(rate) } else { rate };
            fusion.update(rate, vector(*force), vector(field * 1e6));
            let q = fusion.quaternion();
            from_quaternion([q.w, q.x, q.y, q.z].map(f64::from), &north_west_up())
        })
    })
}

fn vqf(tau_acc: f64, tau_mag: f64, rest: bool) -> Filter {
    let name =
        format!("vqf-rs, {tau_acc} s, {tau_mag} s, {}", if rest { "rest seen" } else { "no rest" });
    filter(name, move |_| {
        let parameters = vqf_rs::Params {
            tau_acc,
            tau_mag,
            rest_bias_est_enabled: rest,
            // The filter accepts a field as known only after turning at 20 deg/s, and leaves it out
            // until then.
            mag_dist_rejection_enabled: false,
            ..vqf_rs::Params::default()
        };
        let mut vqf = vqf_rs::VQF::new(PERIOD, None, None, Some(parameters));
        Box::new(move |[rate, force, field]| {
            vqf.update(array(rate), array(force), Some(array(field)));
            let vqf_rs::Quaternion(w, x, y, z) = vqf.quat_9d();
            from_quaternion([w, x, y, z], &east_north_up())
        })
    })
}

/// Returns the attitude errors (root mean square of their norm, deg) after the first second, and
/// nanoseconds and allocations of an update.
fn run(filter: &Filter, trajectory: &[Truth], readings: &[Readings]) -> (f64, f64, f64) {
    let declination = {
        let field = SensorData::embedded().surroundings.field;
        Rotation3::from_axis_angle(&Vector3::z_axis(), -field.y.atan2(field.x))
    };
    let [_, force, field] = &felt(&trajectory[0]);
    let mut step = (filter.begin)(&triad(force, field).expect("a force and a field"));
    let mut estimates = Vec::with_capacity(trajectory.len());
    let (allocations, begin) = (ALLOCATIONS.load(Relaxed), Instant::now());
    for readings in readings {
        estimates.push(step(readings));
    }
    let count = estimates.len() as f64;
    let time = begin.elapsed().as_nanos() as f64 / count;
    let allocations = (ALLOCATIONS.load(Relaxed) - allocations) as f64 / count;
    let errors = trajectory.iter().zip(&estimates).map(|(truth, rotation)| {
        let error = angles(&(rotation * declination)) - truth.angles;
        (truth.time, error)
    });
    (rms(1.0, errors).norm(), time, allocations)
}

fn main() {
    let mut filters = vec![ours(Gains { proportional: 0.5, integral: 0.02 })];
    filters.push(ours(Gains { proportional: 1.0, integral: 0.1 }));
    filters.extend([(0.5, 0.02), (1.0, 0.1), (2.0, 0.2)].map(|(p, i)| mahony(p, i)));
    filters.extend([0.01, 0.02, 0.05].map(madgwick));
    filters.extend(
        [(0.5, true), (0.5, false), (2.0, false)].map(|(gain, learns)| fusion(gain, learns)),
    );
    filters.extend(
        [(3.0, 9.0, true), (3.0, 9.0, false), (1.0, 1.0, false)]
            .map(|(acc, mag, rest)| vqf(acc, mag, rest)),
    );
    let corrections = mems_corrections();
    let seeds = 1..=10;
    let trajectories: Vec<_> = seeds.clone().map(scenario).collect();
    println!(
        "{:38} {:>9} {:>9} {:>9} {:>6} {:>6}",
        "RMS, deg", "at rest", "moving", "with bias", "ns", "allocs"
    );
    for filter in &filters {
        let mut sums = [0.0; 3];
        let (mut time, mut allocations) = (f64::INFINITY, 0.0f64);
        for (seed, scenario) in seeds.clone().zip(&trajectories) {
            let still = rest(50.0);
            for (sum, (trajectory, bias)) in
                sums.iter_mut().zip([(&still, 0.0), (scenario, 0.0), (scenario, 0.2)])
            {
                let readings: Vec<Readings> = samples(trajectory, &corrections, seed, bias);
                let (error, each, allocated) = run(filter, trajectory, &readings);
                *sum += error * error / 10.0;
                time = time.min(each);
                allocations = allocations.max(allocated);
            }
        }
        let [still, moving, biased] = sums.map(f64::sqrt);
        println!(
            "{:38} {still:9.4} {moving:9.4} {biased:9.4} {time:6.0} {allocations:6.1}",
            filter.name
        );
    }

    let settings = Settings { corrections, ..Settings::ours() };
    let whole = |name: &str, trajectory: &dyn Fn(usize) -> Vec<Truth>| {
        let mut squares = [Vector3::<f64>::zeros(); 2];
        for seed in seeds.clone() {
            let trajectory = trajectory(seed as usize - 1);
            let estimated = estimates(&settings, &lines(&trajectory, &mems(seed)));
            for (square, rms) in squares.iter_mut().zip(errors(&trajectory, &estimated, 0.0)) {
                *square += rms.component_mul(&rms) / 10.0;
            }
        }
        let [angles, rates] = squares.map(|square| square.map(f64::sqrt));
        println!(
            "estimator, {name}: angles {:.3} deg (norm), rates {:.3} {:.3} {:.3}, norm {:.3} deg/s",
            angles.norm(),
            rates.x,
            rates.y,
            rates.z,
            rates.norm()
        );
    };
    whole("at rest", &|_| rest(50.0));
    whole("moving", &|i| trajectories[i].clone());
    let magnetometer =
        SensorData::embedded().mems[2].matrix * SensorData::embedded().surroundings.field.norm();
    let left = seeds.map(|seed| {
        let matrix = calibrated(&mems(seed), CALIBRATION_DURATION).corrections[2].matrix;
        (matrix * magnetometer - Matrix3::identity()).singular_values().max()
    });
    println!("ellipsoid: largest norm of W A - I {:.1e}", left.fold(0.0, f64::max));
}

/// Returns calibrated readings at the tick at which they were taken, with `bias` (deg/s) left on
/// each axis.
fn samples(
    trajectory: &[Truth],
    corrections: &[control::estimation::ellipsoid::Correction; 3],
    seed: u64,
    bias: f64,
) -> Vec<Readings> {
    let mut config = mems(seed);
    config.line.delay = 0.0;
    let correct = |line: &control::estimation::Line| {
        let mut readings = [0, 1, 2].map(|i| corrections[i].apply(&line.readings[i]));
        readings[0].add_scalar_mut(bias.to_radians());
        readings
    };
    lines(trajectory, &config).iter().map(correct).collect()
}
