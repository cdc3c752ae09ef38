//! The variable table that every controller has, and the form in which laws show values.

use crate::law::{ControllerFmu, Law};
use fmi_export::table::{Description, VariableTable};
use model_description::DefaultExperiment;
use model_description::condition::NEVER;
use model_description::variable::{Causality, Variable};
use nalgebra::Vector3;
use vehicle::Scenario;

/// Returns the description of a controller's FMU.
pub fn description<L: Law>() -> Description<ControllerFmu<L>> {
    Description {
        documentation: format!("{}{}", L::DOCUMENTATION, include_str!("wiring.html")),
        version: L::VERSION,
        default_experiment: DefaultExperiment {
            stop: Scenario::crmpc2022().duration,
            step: L::period(&L::settings()),
            ..DefaultExperiment::default()
        },
        ..Description::new(L::NAME, L::DESCRIPTION, L::outputs(table::<L>()))
    }
}

fn table<L: Law>() -> VariableTable<ControllerFmu<L>> {
    let settings = settings::names::<L::Settings>();
    let condition = |setting: &str, condition| {
        if settings.iter().any(|name| name == setting) { condition } else { NEVER }
    };
    let achieved = condition("achievedMoment.used", "achievedMoment.used = true");
    let parts = "constraints = robust and scheduled.disturbanceParts > 1";
    let parts = condition("scheduled.disturbanceParts", parts);
    let robust = condition("constraints", "constraints = robust");
    // The reference that is shown may be that of the inputs.
    let external = |variable: &mut Variable| {
        if variable.causality == Causality::Output {
            let name = variable.name.replacen("reference", "reference.external", 1);
            variable.dependencies = vec![name];
        }
    };
    let table = VariableTable::new(|model: &mut ControllerFmu<L>| &mut **model)
        .change("achievedMoment.", |variable| {
            if variable.causality == Causality::Input {
                variable.use_with(achieved);
            }
        })
        .change("scheduled.disturbanceBound", |variable| variable.use_with(parts))
        .change("scheduled.angleError", |variable| variable.use_with(robust))
        .change("reference", external);
    let has_file = settings::settings::<L::Settings>()
        .iter()
        .any(|setting| setting.place.role == settings::Role::File);
    let table = if has_file || L::PLANS { table } else { table.without("settings.file") };
    // Other laws ask for no later reference than that of the instant at which their moment acts.
    if L::PLANS { table } else { table.without("reference.preview") }
}

/// Returns a finite number for a value that is only shown and on which no controller depends.
/// Infinite values become the largest number of their sign, and values that are not a number become
/// the largest number.
pub fn shown(value: f64) -> f64 {
    if value.is_nan() { f64::MAX } else { value.clamp(-f64::MAX, f64::MAX) }
}

/// Returns the vector with [`shown`] applied to each component.
pub fn shown_vector(value: &Vector3<f64>) -> Vector3<f64> {
    value.map(shown)
}
