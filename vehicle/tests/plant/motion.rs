//! Equations of motion: conservation laws, order, closed forms, and the trajectory's turning.

use super::{TUMBLING, config, moment, undisturbed};
use crate::prelude::*;
use vehicle::plant::{Load, derivative};

#[test]
fn oracle_torque_free_motion_conserves_energy_and_angular_momentum() {
    let mut plant = Plant::new(&undisturbed(TUMBLING.into(), 0.01), 0.0).unwrap();
    let body = *plant.body();
    let energy = |plant: &Plant| plant.rates().dot(&(body.inertia * plant.rates())) / 2.0;
    let momentum = |plant: &Plant| (body.inertia * plant.rates()).norm();
    let (energy_0, momentum_0) = (energy(&plant), momentum(&plant));
    let rates_0 = plant.rates();
    for k in 0..10 {
        plant.advance(f64::from(k), f64::from(k + 1), Vector3::zeros()).unwrap();
        assert!((energy(&plant) / energy_0 - 1.0).abs() < 1e-13);
        assert!((momentum(&plant) / momentum_0 - 1.0).abs() < 1e-13);
    }
    assert!((plant.rates() - rates_0).norm() > 0.01, "the body does not tumble");
}

#[test]
fn oracle_integration_has_order_four() {
    let end = |step: f64| {
        let mut plant = Plant::new(&undisturbed(Vector6::from(TUMBLING) * 3.0, step), 0.0).unwrap();
        plant
            .advance_with(0.0, 4.0, &Command::default(), |t| {
                Vector3::new(1e5 * t.sin(), 2e5 * t.cos(), -1e5 * (2.0 * t).sin()).into()
            })
            .unwrap();
        plant.state
    };
    let exact = end(0.002);
    let error = |step| (end(step) - exact).norm();
    for step in [0.2, 0.1, 0.05] {
        let order = (error(step) / error(step / 2.0)).log2();
        assert!((order - 4.0).abs() < 0.2, "order {order} at {step} s");
    }
}

#[test]
fn oracle_constant_moment_about_a_principal_axis() {
    // Motion about the pitch axis at beta = 0, sigma free: q = M t / Iyy, alpha = alpha_0 + M t² /
    // 2 Iyy.
    let mut plant =
        Plant::new(&undisturbed(Vector6::new(0.1, 0.0, 0.3, 0.0, 0.0, 0.0), 0.01), 0.0).unwrap();
    let inertia = plant.body().inertia[(1, 1)];
    assert_eq!(inertia, 1303212.0 * 1.05);
    plant.advance(0.0, 3.0, Vector3::new(0.0, 1e5, 0.0)).unwrap();
    assert!((plant.rates() - Vector3::new(0.0, 1e5 * 3.0 / inertia, 0.0)).amax() < 1e-14);
    assert!((plant.angles() - Vector3::new(0.1 + 1e5 * 4.5 / inertia, 0.0, 0.3)).amax() < 1e-14);
}

#[test]
fn oracle_delta_is_an_acceleration_of_x_omega() {
    let body = *Plant::new(&config(), 0.0).unwrap().body();
    let (state, moment, delta) =
        (State::from(TUMBLING), Vector3::new(1e4, 2e4, 3e4), Vector3::new(0.03, -0.02, 0.01));
    for kinematics in [Kinematics::Printed, Kinematics::Exact] {
        // Differences along the motion give d(Rω)/dt, with and without Δ.
        let x_omega_rate = |delta: Vector3<f64>| {
            let h = 1e-5;
            let f =
                derivative(&body, kinematics, &state, &Load { moment, delta, ..Load::default() });
            let x_omega = |state: State| {
                kinematics.r(&vehicle::plant::angles(&state)) * vehicle::plant::rates(&state)
            };
            (x_omega(state + f * h) - x_omega(state - f * h)) / (2.0 * h)
        };
        assert!((x_omega_rate(delta) - x_omega_rate(Vector3::zeros()) - delta).amax() < 1e-9);
    }
}

#[test]
fn oracle_a_steady_climb_over_a_still_earth_shows_in_alpha_alone() {
    // In level flight to the north without bank and sideslip, α̇ = q − γ̇, so a positive γ̇ lowers
    // the angle of attack.
    let mut plant =
        Plant::new(&undisturbed(State::new(0.3, 0.0, 0.0, 0.0, 0.0, 0.0), 0.01), 0.0).unwrap();
    let climb = Trajectory { flight_path_angle_rate: 0.02, ..Trajectory::default() };
    let climbing = Input { trajectory: climb, ..Input::default() };
    plant.advance_with(0.0, 5.0, &Command::default(), |_| climbing).unwrap();
    assert!((plant.state - State::x() * 0.2).amax() < 1e-14, "{}", plant.state);
}

#[test]
fn a_trajectory_at_rest_changes_no_bit() {
    let still = Trajectory {
        flight_path_angle: -0.1,
        heading: 0.7,
        latitude: 0.5,
        ..Trajectory::default()
    };
    let [mut plain, mut along] = [0, 1].map(|_| Plant::new(&config(), 0.0).unwrap());
    for k in 0..20 {
        let (from, to) = (0.2 * f64::from(k), 0.2 * f64::from(k + 1));
        plain.advance(from, to, moment(k)).unwrap();
        let input = Input { trajectory: still, ..moment(k).into() };
        along.advance_with(from, to, &Command::default(), |_| input).unwrap();
    }
    assert_eq!(plain, along);
}

#[test]
fn oracle_the_bank_angles_differ_by_the_integral_of_alpha_rate_times_sin_beta() {
    let end = |kinematics| {
        let config =
            Config { kinematics, ..undisturbed(State::new(0.1, 0.2, 0.3, 0.0, 0.02, 0.0), 0.01) };
        let mut plant = Plant::new(&config, 0.0).unwrap();
        plant.advance(0.0, 1.0, Vector3::zeros()).unwrap();
        plant.angles()
    };
    let difference = end(Kinematics::Exact) - end(Kinematics::Printed);
    // The torque-free rates are equal, and α, β do not depend on σ; σ differs by the integral of α̇
    // sin β.
    assert_eq!((difference.x, difference.y), (0.0, 0.0));
    assert!((difference.z - 0.02 * 0.2f64.sin()).abs() < 1e-4, "{}", difference.z);
}
