//! The signals that a flight records.

/// Columns of the signals, in this order; in SI units, the guarantee as numbers of items.
pub const COLUMNS: [&str; 15] = [
    "time",
    "plant.attitude.alpha",
    "plant.attitude.beta",
    "plant.attitude.sigma",
    "plant.rate.p",
    "plant.rate.q",
    "plant.rate.r",
    "controller.reference.alpha",
    "controller.reference.beta",
    "controller.reference.sigma",
    "controller.moment.x",
    "controller.moment.y",
    "controller.moment.z",
    "controller.guarantee.status",
    "controller.guarantee.contradiction",
];

/// Outputs of the controllers that guarantee limits: the status, and the contradiction of an
/// assumption.
pub const GUARANTEE: [&str; 2] = [COLUMNS[13], COLUMNS[14]];

/// Values of all columns at one communication point.
pub type Row = [f64; COLUMNS.len()];
