//! Variable table of the FMU.

use crate::plant::{INDICATORS, ReentryPlant};
use fmi_export::{Description, VariableTable};
use model_description::DefaultExperiment;
use model_description::variable::Variable;
use vehicle::Scenario;

/// Returns the description of the FMU.
pub(crate) fn description() -> Description<ReentryPlant> {
    let scenario = Scenario::crmpc2022();
    let table = VariableTable::new(|plant: &mut ReentryPlant| plant)
        .change("attitudeRate.beta", |rate| {
            depend_on(rate, &["motion.*", "attitude.*", "trajectory.*", "rate.p", "rate.r"]);
        })
        .change("measured.accelerometer", at_rest)
        .change("measured.magnetometer", at_rest)
        // The air of a single row is the same at all altitudes.
        .change("air.altitude[1]", |altitude| {
            let second = |text: &str| text.replace("air.rows >= 1", "air.rows >= 2");
            altitude.description = second(&altitude.description);
            altitude.used_with = second(&altitude.used_with);
        });
    Description {
        documentation: include_str!("plant.html").into(),
        version: env!("CARGO_PKG_VERSION"),
        event_indicators: INDICATORS,
        default_experiment: DefaultExperiment {
            stop: scenario.duration,
            tolerance: 1e-8,
            step: scenario.disturbance.period,
            ..DefaultExperiment::default()
        },
        ..Description::new(
            "ReentryPlant",
            "Attitude dynamics of a re-entry vehicle under control moments and bounded disturbances",
            table,
        )
    }
}

fn depend_on(variable: &mut Variable, names: &[&str]) {
    variable.dependencies = names.iter().map(ToString::to_string).collect();
}

/// Declares a reading that does not depend on the rates, along an axis that has the name of its
/// direction.
fn at_rest(reading: &mut Variable) {
    depend_on(
        reading,
        &["attitude.*", "trajectory.flightPathAngle", "trajectory.heading", "motion.*"],
    );
    for (axis, direction) in [("roll", "forward"), ("pitch", "right"), ("yaw", "downward")] {
        reading.description = reading.description.replace(axis, direction);
    }
}
