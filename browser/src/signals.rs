//! The signals that a flight records.

/// Outputs of the controllers that guarantee limits: the status, and the contradiction of an
/// assumption.
pub const GUARANTEE: [&str; 2] =
    ["controller.guarantee.status", "controller.guarantee.contradiction"];

/// Columns of a flight: time, the angles that the law receives, body rates, reference, moment, others,
/// and the guarantee as numbers of items; in SI units.
macro_rules! columns {
    ($alpha:literal, $beta:literal; $($other:literal),*) => {
        &[
            "time", $alpha, $beta, "plant.attitude.sigma", "plant.rate.p", "plant.rate.q", "plant.rate.r",
            "controller.reference.alpha", "controller.reference.beta", "controller.reference.sigma",
            "controller.moment.x", "controller.moment.y", "controller.moment.z",
            $($other,)* GUARANTEE[0], GUARANTEE[1],
        ]
    };
}

/// Columns of a flight in which the attitude follows a given reference.
pub const ATTITUDE: &[&str] = columns!("plant.attitude.alpha", "plant.attitude.beta";);

/// Columns of an entry flight, whose law receives the angles relative to the air.
pub const ENTRY: &[&str] = columns!("plant.flow.alpha", "plant.flow.beta";
    "plant.motion.altitude", "plant.motion.longitude", "plant.motion.latitude", "plant.motion.speed",
    "plant.load.lift", "plant.flow.density", "plant.loadFactor", "plant.heating.flux",
    "plant.flight.dynamicPressure", "guidance.range", "guidance.reversals");

/// Parameter that asks a controller for its plan.
pub const PLAN_SHOWN: &str = "plan.shown";
/// Variable that changes with each plan.
const PLAN_BEGAN: &str = "controller.plan.began";
/// Number of points at which a plan is shown, and what is shown of each.
const PLAN_POINTS: usize = 25;
const PLAN_QUANTITIES: [&str; 5] = ["time", "rate", "rateBound", "moment", "momentBound"];

/// Returns the variables that show a plan, quantity by quantity.
pub fn plan() -> Vec<String> {
    let points = |quantity| {
        (1..=PLAN_POINTS).map(move |point| format!("controller.plan.{quantity}[{point}]"))
    };
    [PLAN_BEGAN.to_string()]
        .into_iter()
        .chain(PLAN_QUANTITIES.into_iter().flat_map(points))
        .collect()
}
