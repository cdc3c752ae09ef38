//! Variables of an entry flight.

use super::{ANGLES, AXES, PlantVariables, vector};
use crate::plant::MOTION;
use crate::roles::{Known, Quantity, Role, Unknown};
use fmi_export::table::{Real, input, output, parameter};
use vehicle::air::{ROWS, Row};
use vehicle::entry;

/// Names of the states of the motion.
pub(super) const MOTION_NAMES: [&str; 6] = [
    "motion.altitude",
    "motion.longitude",
    "motion.latitude",
    "motion.speed",
    "motion.flightPathAngle",
    "motion.heading",
];
/// Names of the inputs of an entry flight.
pub(super) const INPUT_NAMES: [&str; 7] = [
    "prescribed.alpha",
    "prescribed.beta",
    "prescribed.sigma",
    "prescribedRate.alpha",
    "prescribedRate.beta",
    "prescribedRate.sigma",
    "trim.alpha",
];
/// Names of the attitude angles, on which the air's forces depend.
const ATTITUDE: [&str; 3] = ["attitude.alpha", "attitude.beta", "attitude.sigma"];

/// Adds everything that belongs to an entry flight.
pub(super) fn entry(variables: PlantVariables) -> PlantVariables {
    let variables = quantities(rates(states(variables)));
    profile(inputs(variables).settings(|m| &mut m.parameters.entry))
        .settings(|m| &mut m.parameters.vehicle)
}

fn states(mut variables: PlantVariables) -> PlantVariables {
    for (i, (name, quantity)) in MOTION_NAMES.into_iter().zip(entry::QUANTITIES).enumerate() {
        let entry::Quantity { meaning, units: [unit, _], nominal, .. } = quantity;
        let real = output(name, meaning).real().unit(unit).nominal(nominal);
        variables =
            variables.real(real, move |m| &mut m.output.motion[i]).role(Role::state(MOTION + i));
    }
    variables
}

fn rates(mut variables: PlantVariables) -> PlantVariables {
    for (i, (state, quantity)) in MOTION_NAMES.into_iter().zip(entry::QUANTITIES).enumerate() {
        let entry::Quantity { name, units: [_, unit], nominal, .. } = quantity;
        let text = format!("Time derivative of {state}; 0 without an entry flight");
        let common = output(&format!("motionRate.{name}"), &text)
            .depends_on(MOTION_NAMES)
            .depends_on(ATTITUDE);
        let real = common.real().unit(unit).nominal(nominal / 100.0).derivative_of(state);
        variables = variables
            .real(real, move |m| &mut m.output.motion_rate[i])
            .role(Unknown::Derivative(MOTION + i));
    }
    variables
}

fn quantities(variables: PlantVariables) -> PlantVariables {
    let declare = |name: &str, text: &str, unit: &str, nominal: f64| -> Real {
        let common = output(name, text).depends_on(MOTION_NAMES).depends_on(ATTITUDE);
        let real = common.real().nominal(nominal);
        if unit.is_empty() { real } else { real.unit(unit) }
    };
    let variables = variables
        .real(declare("flow.mach", "Mach number", "", 10.0), |m| &mut m.output.passage.mach)
        .role(Unknown::Flight(Quantity::Mach))
        .real(declare("flow.speed", "Speed relative to the air", "m/s", 1e3), |m| {
            &mut m.output.passage.airspeed
        })
        .role(Unknown::Flight(Quantity::Airspeed))
        .real(declare("flow.density", "Density of the air", "kg/m3", 1e-3), |m| {
            &mut m.output.passage.density
        })
        .role(Unknown::Flight(Quantity::Density))
        .real(declare("flow.alpha", "Angle of attack relative to the air", "rad", 0.1), |m| {
            &mut m.output.passage.air_angles[0]
        })
        .role(Unknown::Flight(Quantity::AirAngle(0)))
        .real(declare("flow.beta", "Sideslip angle relative to the air", "rad", 0.1), |m| {
            &mut m.output.passage.air_angles[1]
        })
        .role(Unknown::Flight(Quantity::AirAngle(1)))
        .real(declare("load.lift", "Lift per mass; 0 without an entry flight", "m/s2", 10.0), |m| {
            &mut m.output.passage.lift
        })
        .role(Unknown::Flight(Quantity::Lift))
        .real(declare("load.drag", "Drag per mass; 0 without an entry flight", "m/s2", 10.0), |m| {
            &mut m.output.passage.drag
        })
        .role(Unknown::Flight(Quantity::Drag))
        .real(
            declare(
                "loadFactor",
                "Specific force in units of 9.80665 m/s2; 0 without an entry flight",
                "",
                1.0,
            ),
            |m| &mut m.output.load_factor,
        )
        .role(Unknown::Flight(Quantity::LoadFactor))
        .real(
            declare(
                "heating.flux",
                "Heat flux into the leading edge; 0 without an entry flight",
                "W/m2",
                1e5,
            ),
            |m| &mut m.output.heat_flux,
        )
        .role(Unknown::Flight(Quantity::HeatFlux))
        .real(declare("downrange", "Distance over ground from the start", "m", 1e6), |m| {
            &mut m.output.range
        })
        .role(Unknown::Flight(Quantity::Range));
    let moment = |axis: &str, meaning: &str| {
        let text =
            format!("Moment of the air about the {meaning} axis, without that of the surfaces");
        output(&format!("airMoment.{axis}"), &text)
            .depends_on(MOTION_NAMES)
            .depends_on(ATTITUDE)
            .depends_on(super::RATE_NAMES)
            .depends_on(["trim.alpha"])
            .real()
            .unit("N.m")
            .nominal(1e4)
    };
    vector(
        variables,
        AXES,
        moment,
        |i| Unknown::Flight(Quantity::AirMoment(i)).into(),
        |m| &mut m.output.air_moment,
    )
}

fn inputs(variables: PlantVariables) -> PlantVariables {
    let prescribed = |name: &'static str, unit: &'static str, what: &'static str| {
        move |axis: &str, meaning: &str| {
            let common = input(&format!("{name}.{axis}"), &format!("{what} {meaning}"));
            let common = common.used_with("translation = entry and prescribed.active = true");
            common.real().unit(unit).nominal(0.1)
        }
    };
    let variables = vector(
        variables,
        ANGLES,
        prescribed("prescribed", "rad", "Prescribed"),
        |i| Known::Prescribed(i).into(),
        |m| &mut m.input.prescribed.angles,
    );
    let variables = vector(
        variables,
        ANGLES,
        prescribed("prescribedRate", "rad/s", "Time derivative of the prescribed"),
        |i| Known::Prescribed(3 + i).into(),
        |m| &mut m.input.prescribed.rates,
    );
    let trim = input("trim.alpha", "Angle of attack at which the vehicle is trimmed").used_with(
        "translation = entry and aerodynamics.vehicle = papers and aerodynamics.trim = input",
    );
    variables.real(trim.real().unit("rad").nominal(0.1), |m| &mut m.input.trim).role(Known::Trim)
}

/// Column of the air's profile: name, meaning, unit, least value, nominal value, and field.
type Column =
    (&'static str, &'static str, &'static str, Option<f64>, f64, fn(&mut Row) -> &mut f64);
const COLUMNS: [Column; 4] = [
    ("air.altitude", "Altitude of a row of the air's profile", "m", None, 1e4, |row| {
        &mut row.altitude
    }),
    (
        "air.densityRatio",
        "Ratio of the density to that of the undisturbed air",
        "",
        Some(0.0),
        1.0,
        |row| &mut row.density,
    ),
    ("air.wind.north", "Wind to the north", "m/s", None, 10.0, |row| &mut row.wind[0]),
    ("air.wind.east", "Wind to the east", "m/s", None, 10.0, |row| &mut row.wind[1]),
];

/// Adds the rows of the air's profile column by column, as FMI wants the elements of an array one
/// after the other.
fn profile(mut variables: PlantVariables) -> PlantVariables {
    for (name, meaning, unit, least, nominal, field) in COLUMNS {
        for i in 0..ROWS {
            let text = format!("{meaning} (row {})", i + 1);
            // The air of a single row is the same at all altitudes.
            let rows = if name == "air.altitude" { (i + 1).max(2) } else { i + 1 };
            let common = parameter(&format!("{name}[{}]", i + 1), &text)
                .used_with(&format!("translation = entry and air.rows >= {rows}"));
            let mut real = common.real().nominal(nominal);
            if !unit.is_empty() {
                real = real.unit(unit);
            }
            if let Some(least) = least {
                real = real.min(least);
            }
            variables =
                variables.real(real, move |m| field(&mut m.parameters.entry.air.profile[i]));
        }
    }
    variables
}
