//! Roles of the variables in the equations, which follow from their names.

use crate::plant::{ATTITUDE, MOTION, Output};
use settings::{Kind, settings};
use std::collections::HashMap;
use std::sync::LazyLock;
use vehicle::actuators::Command;
use vehicle::plant::Input;

/// Role of a calculated variable. States and derivatives are counted in the order attitude, rates,
/// deflections, motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unknown {
    State(usize),
    Derivative(usize),
    AppliedMoment(usize),
    DisturbanceMoment(usize),
    Measured(usize),
    /// Quantity of the flight.
    Flight,
    /// Disturbance, time of a sample, or part of a fix, which are held and depend on nothing.
    Held,
}

/// Role of a state or an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Known {
    State(usize),
    Moment(usize),
    DisturbanceMoment(usize),
    Surface(usize),
    Jet(usize),
    Trajectory(usize),
    /// Prescribed angles, and their rates.
    Prescribed(usize),
    Trim,
}

/// Role of a variable in the equations. Parameters have no role.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Role {
    pub(crate) as_unknown: Option<Unknown>,
    pub(crate) as_known: Option<Known>,
}

impl Role {
    /// A state is calculated, and derivatives by it exist.
    pub(crate) fn state(i: usize) -> Self {
        Self { as_unknown: Some(Unknown::State(i)), as_known: Some(Known::State(i)) }
    }
}

impl From<Unknown> for Role {
    fn from(unknown: Unknown) -> Self {
        Self { as_unknown: Some(unknown), as_known: None }
    }
}

impl From<Known> for Role {
    fn from(input_or_state: Known) -> Self {
        Self { as_unknown: None, as_known: Some(input_or_state) }
    }
}

/// Returns the role of the variable with this name.
pub(crate) fn role(name: &str) -> Role {
    static ROLES: LazyLock<HashMap<String, Role>> = LazyLock::new(roles);
    ROLES.get(name).copied().unwrap_or_default()
}

/// Returns the roles of all numbers among outputs and inputs.
fn roles() -> HashMap<String, Role> {
    let lists = (settings::<Output>(), settings::<Input>(), settings::<Command>());
    let declared = lists.0.iter().chain(lists.1.iter()).chain(lists.2.iter());
    let mut numbers = HashMap::new();
    let mut roles = HashMap::new();
    for setting in declared.filter(|setting| matches!(setting.kind, Kind::Real)) {
        let name = &setting.place.name;
        let group = name.rfind(['.', '[']).map_or(name.as_str(), |end| &name[..end]);
        let number = numbers.entry(group).or_insert(0);
        roles.insert(name.clone(), Role::of(group, *number));
        *number += 1;
    }
    roles
}

impl Role {
    /// Returns the role of the variable with this number in a group of variables.
    fn of(group: &str, i: usize) -> Self {
        match group {
            "attitude" => Self::state(i),
            "rate" => Self::state(3 + i),
            "deflection" => Self::state(ATTITUDE + i),
            "motion" => Self::state(MOTION + i),
            "attitudeRate" => Unknown::Derivative(i).into(),
            "angularAcceleration" => Unknown::Derivative(3 + i).into(),
            "deflectionRate" => Unknown::Derivative(ATTITUDE + i).into(),
            "motionRate" => Unknown::Derivative(MOTION + i).into(),
            "appliedMoment" => Unknown::AppliedMoment(i).into(),
            "disturbance.moment" => Unknown::DisturbanceMoment(i).into(),
            "measured.gyroscope" => Unknown::Measured(i).into(),
            "measured.accelerometer" => Unknown::Measured(3 + i).into(),
            "measured.magnetometer" => Unknown::Measured(6 + i).into(),
            "disturbance.delta" | "measured" | "gnss" | "gnss.position" | "gnss.velocity"
            | "star" | "star.attitude" => Unknown::Held.into(),
            "moment" => Known::Moment(i).into(),
            "disturbanceMoment" => Known::DisturbanceMoment(i).into(),
            "surface" => Known::Surface(i).into(),
            "jet" => Known::Jet(i).into(),
            "trajectory" => Known::Trajectory(i).into(),
            "prescribed" => Known::Prescribed(i).into(),
            "prescribedRate" => Known::Prescribed(3 + i).into(),
            "trim" => Known::Trim.into(),
            _ => Unknown::Flight.into(),
        }
    }
}
