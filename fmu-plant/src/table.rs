//! Variable table of the FMU.

use crate::plant::{INDICATORS, ReentryPlant};
use fmi_export::{Description, VariableTable};
use model_description::DefaultExperiment;
use model_description::variable::Variable;
use vehicle::Scenario;

/// Variables that stand elsewhere than their fields: beginnings of their names, and that of the
/// variable before which they stand. Value references keep their places when fields move.
const PLACES: [(&str, &str); 23] = [
    ("deflection[", "trajectory."),
    ("flight.dynamicPressure", "trajectory."),
    ("surface[", "trajectory."),
    ("jet[", "trajectory."),
    ("deflectionRate[", "trajectory."),
    ("measured.", "sensor.set"),
    ("gnss.", "sensor.set"),
    ("star.", "sensor.set"),
    ("flight.standardDynamicPressure", "translation"),
    ("motion.", "translation"),
    ("motionRate.", "translation"),
    ("flow.", "translation"),
    ("load", "translation"),
    ("heating.", "translation"),
    ("downrange", "translation"),
    ("airMoment.", "translation"),
    ("prescribed.alpha", "translation"),
    ("prescribed.beta", "translation"),
    ("prescribed.sigma", "translation"),
    ("prescribedRate.", "translation"),
    ("trim.", "translation"),
    ("air.altitude[", "vehicle.file"),
    ("air.densityRatio[", "vehicle.file"),
];

/// Returns the description of the FMU.
pub(crate) fn description() -> Description<ReentryPlant> {
    let scenario = Scenario::crmpc2022();
    let table = VariableTable::new(|plant: &mut ReentryPlant| plant);
    let table = PLACES.iter().fold(table, |table, (beginning, next)| table.before(beginning, next));
    let table = table
        .before("air.wind.", "vehicle.file")
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
