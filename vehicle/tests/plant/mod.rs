//! Tests of the plant: conservation laws, order, cuts, reproducibility and refusals.

mod actuation;
mod communication;
mod disturbance;
mod motion;
mod refusals;

use crate::prelude::*;
use vehicle::actuators::{self, JetMode};
use vehicle::disturbance::{MomentWave, Row, SineMoment};
use vehicle::effectors::{EffectorFault, Effectors};
use vehicle::fixes::Devices;
use vehicle::{sensors, turntable};

fn config() -> Config {
    Scenario::crmpc2022().config(0.01)
}

fn undisturbed(initial: State, step: f64) -> Config {
    Config { initial, step, disturbance: Disturbance::default(), ..config() }
}

const TUMBLING: [f64; 6] = [0.2, 0.1, -0.5, 0.08, -0.05, 0.06];

/// One plant for each kind of disturbance, all with the data of crmpc-2022.
fn kinds() -> impl Iterator<Item = Config> {
    use DisturbanceKind::{AgainstMoment, AlongRate, Constant, None, Sine, Square, Table, White};
    [None, White, Constant, Sine, Square, AlongRate, AgainstMoment, Table].into_iter().map(|kind| {
        let wave = |frequency| MomentWave {
            amplitude: Vector3::new(1e4, 2e4, -1e4),
            frequency,
            phase: 0.2,
        };
        let sine = SineMoment { offset: Vector3::repeat(5e3), waves: vec![wave(1.0), wave(0.1)] };
        let disturbance = Disturbance {
            kind,
            sine,
            square_period: 0.7,
            table: table(),
            start: 0.5,
            end: 3.3,
            ..config().disturbance
        };
        Config { disturbance, ..config() }
    })
}

/// Returns a table with jumps between the communication points of any test.
fn table() -> DisturbanceTable {
    let rows = [(0.113, [1.0, 0.0, -1.0]), (0.3141, [-0.4, 0.7, 1.0]), (0.7, [0.0, -1.0, 0.2])];
    let row = |(time, direction)| Row { time, direction: Vector3::from(direction) };
    DisturbanceTable { period: 0.9, rows: rows.map(row).to_vec() }
}

fn moment(k: u32) -> Vector3<f64> {
    let t = f64::from(k) * 0.2;
    Vector3::new(2e4 * t.sin(), -1e4 * (0.7 * t).cos(), 3e4 * (0.3 * t).sin())
}

/// Configuration of the undisturbed vehicle with actuators at the published flight condition.
fn actuated(initial: State, jet_mode: JetMode) -> Config {
    let dynamic_pressure = Effectors::published().reference_pressure;
    let actuators = actuators::Config {
        effectors: Effectors::published(),
        jet_mode,
        dynamic_pressure,
        mach: 9.8,
        aerodynamics_scale: 1.0,
        fault: EffectorFault::default(),
    };
    Config { actuators: Some(actuators), ..undisturbed(initial, 0.05) }
}

fn flaps(deflection_deg: f64) -> Command {
    let mut command = Command::default();
    command.surfaces[4] = deflection_deg.to_radians();
    command.surfaces[5] = deflection_deg.to_radians();
    command
}

/// A plant whose sensors are mounted on a slow turntable.
fn on_a_turntable() -> Config {
    let data = SensorData::embedded();
    Config {
        sensors: Some(sensors::Config {
            triads: data.ideal,
            line: data.line,
            devices: Devices::default(),
            seed: 1,
        }),
        surroundings: data.surroundings,
        turntable: turntable::Config { bandwidth: 2.0, rate: 0.05, resolution: 1e-3 },
        ..config()
    }
}
