//! Calibrates the MEMS set of the vehicle's data on the calibration flight of the tests, and
//! prints the file `control/data/sensor-calibration.toml`:
//!
//! ```text
//! cargo run --release -p reentry-control --example calibrate_sensors \
//!     >control/data/sensor-calibration.toml
//! ```

#[path = "../tests/harness/mod.rs"]
mod harness;

use control::estimation::Settings;
use harness::platform::{CALIBRATION_DURATION, CALIBRATION_SEED, calibrated, mems};

fn main() {
    println!(
        "# Corrections W (m - b) of the MEMS set of vehicle/data/sensors.toml, in SI units. From {CALIBRATION_DURATION} s of the calibration\n\
         # flight with seed {CALIBRATION_SEED}: gyroscope and accelerometer against the platform's own angles by linear least squares, the\n\
         # magnetometer by an ellipsoid. Written by the example calibrate_sensors."
    );
    let Settings { corrections, .. } = calibrated(&mems(CALIBRATION_SEED), CALIBRATION_DURATION);
    for (name, correction) in corrections.named() {
        println!("\n[{name}]\nmatrix = [");
        for row in correction.matrix.row_iter() {
            println!("    [{:?}, {:?}, {:?}],", row[0], row[1], row[2]);
        }
        let bias = correction.bias;
        println!("]\nbias = [{:?}, {:?}, {:?}]", bias.x, bias.y, bias.z);
    }
}
