//! The plans under guarantee as JSON, for the picture of plan, tube and bound.

use super::numbers::{DIGITS, TIME_DIGITS, numbers};
use crate::recording::{Recording, Track};
use serde_json::{Value, json};

/// Quantities of a plan after its times, with the factor to the unit of the picture: norm of the
/// rates and its bound, deg/s, norm of the moment and its bound, kN m.
const QUANTITIES: [(&str, f64); 4] = [
    ("rate", 180.0 / std::f64::consts::PI),
    ("rateBound", 180.0 / std::f64::consts::PI),
    ("moment", 1e-3),
    ("momentBound", 1e-3),
];

/// Returns each plan once, at the row at which it begins; nothing if none are recorded.
pub(super) fn of(run: &Recording) -> Option<Vec<Value>> {
    let group = run.observe.guarantee.as_ref()?.plan.as_ref()?;
    let began = run.tracks.get(&format!("{group}.began"))?;
    let points = |quantity: &str| -> Vec<&Track> {
        let named = (1..).map(|point| run.tracks.get(&format!("{group}.{quantity}[{point}]")));
        named.map_while(|track| track).collect()
    };
    let times = points("time");
    let quantities = QUANTITIES.map(|(quantity, factor)| (points(quantity), factor));
    if times.is_empty() || quantities.iter().any(|(tracks, _)| tracks.len() != times.len()) {
        return None;
    }
    let mut plans = vec![];
    let mut last = None;
    for (row, begin) in began.values.iter().enumerate() {
        // A plan that is none begins at no time or keeps its points at zero.
        let is_plan = times.iter().any(|track| track.values[row] > 0.0);
        if last == Some(begin) || !is_plan {
            continue;
        }
        last = Some(begin);
        let at = |tracks: &[&Track], factor: f64, digits| {
            numbers(tracks.iter().map(|track| factor * track.values[row]), digits)
        };
        let [rate, rate_bound, moment, moment_bound] =
            quantities.each_ref().map(|(tracks, factor)| at(tracks, *factor, DIGITS));
        plans.push(json!({
            "began": numbers([*begin], TIME_DIGITS)[0],
            "at": at(&times, 1.0, DIGITS),
            "norms": [rate, moment],
            "bounds": [rate_bound, moment_bound],
        }));
    }
    (!plans.is_empty()).then_some(plans)
}
