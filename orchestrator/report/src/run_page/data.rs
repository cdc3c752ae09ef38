//! The numbers of a page as JSON: curves, and the vehicle over time.

use super::numbers::{DIGITS, TIME_DIGITS, numbers, rounded};
use super::{plans, thin};
use crate::recording::panels::{Panel, Role, symbols};
use crate::recording::trajectory;
use crate::recording::{Recording, Track, share_text};
use cosim::experiment::Vehicle;
use serde_json::{Map, Value, json};
use std::iter;

/// Returns the data that the scripts of a page draw.
pub(super) fn page(runs: &[Recording], panels: &[Panel], vehicles: &[usize]) -> Value {
    let run = |(place, run): (usize, &Recording)| {
        let is_shown = vehicles.contains(&place);
        json!({
            "name": run.name,
            "time": numbers(thin::times(&run.time), TIME_DIGITS),
            "vehicle": is_shown.then(|| vehicle(run)).flatten(),
            "guarantee": guarantee(run),
            "guaranteed": guaranteed(run),
            "flight": flight(run),
            "plans": is_shown.then(|| plans::of(run)).flatten(),
        })
    };
    let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
    let panel = |panel: &Panel| {
        let curves = panel.curves.iter().map(|curve| {
            let role = match curve.role {
                Role::Signal => "signal",
                Role::Reference => "reference",
                Role::OwnReference => "own reference",
                Role::Norm => "norm",
            };
            json!({
                "name": panel.legend(curve, &names), "run": curve.run, "place": curve.place, "role": role,
                "values": numbers(thin::values(&curve.values), DIGITS),
            })
        });
        let limits = panel.limits.iter().map(|limit| {
            let name = panel.limit_name(limit, &names);
            json!({ "name": name, "value": rounded(limit.value, DIGITS) })
        });
        json!({
            "label": symbols(&panel.label), "unit": panel.unit,
            "limits": limits.collect::<Vec<_>>(),
            "magnitudes": panel.magnitudes,
            "curves": curves.collect::<Vec<_>>(),
        })
    };
    json!({
        "runs": runs.iter().enumerate().map(run).collect::<Vec<_>>(),
        "panels": panels.iter().map(panel).collect::<Vec<_>>(),
    })
}

/// Returns the places of a run on the panels of its flight.
fn flight(run: &Recording) -> Option<Value> {
    let flight = trajectory::flight(run)?;
    let places = |line: &[Vec<f64>; 2]| {
        line.iter().map(|values| numbers(values.iter().copied(), DIGITS)).collect::<Vec<_>>()
    };
    let time = numbers(flight.rows.iter().map(|row| run.time[*row]), TIME_DIGITS);
    Some(json!({ "time": time, "places": [places(&flight.energy), places(&flight.position)] }))
}

/// Returns whether the attitude of a vehicle is recorded.
pub(super) fn has_vehicle(run: &Recording) -> bool {
    let named = run.observe.vehicle.as_ref();
    named.is_some_and(|vehicle| vehicle.attitude.iter().all(|path| run.tracks.contains_key(path)))
        && !run.time.is_empty()
}

/// Returns the vehicle at some instants of the run, in SI units and radians.
fn vehicle(run: &Recording) -> Option<Value> {
    let named: &Vehicle = run.observe.vehicle.as_ref()?;
    let frames = frames(run, named);
    let at_frames = |track: &Track, factor: f64| {
        numbers(frames.iter().map(|row| factor * track.values[*row]), DIGITS)
    };
    // All of them or none: half a vector has no norm.
    let list = |paths: &[String]| {
        let tracks = paths.iter().map(|path| run.tracks.get(path));
        let tracks = tracks.collect::<Option<Vec<_>>>().filter(|tracks| !tracks.is_empty())?;
        Some(tracks.into_iter().map(|track| at_frames(track, 1.0)).collect::<Vec<_>>())
    };
    let three = |paths: &Option<[String; 3]>| list(paths.as_ref()?);
    let limit = |path: &Option<String>| {
        let track = run.tracks.get(path.as_ref()?)?;
        track.values.last().copied().filter(|limit| limit.is_finite() && *limit > 0.0)
    };
    let deflection = |(place, path): (usize, &String)| {
        let track = run.tracks.get(path)?;
        let name = named.surface(place);
        Some(json!({ "name": name, "unit": track.unit, "values": at_frames(track, track.factor) }))
    };
    let mut value = Map::new();
    let mut put = |key: &str, content: Value| {
        if !content.is_null() {
            value.insert(key.into(), content);
        }
    };
    put("time", json!(numbers(frames.iter().map(|row| run.time[*row]), TIME_DIGITS)));
    put("angles", json!(list(&named.attitude)));
    put("reference", json!(three(&named.reference)));
    put("rates", json!(three(&named.rate)));
    put("rateLimit", json!(limit(&named.rate_limit)));
    put("moment", json!(three(&named.moment)));
    put("momentLimit", json!(limit(&named.moment_limit)));
    put("flaps", json!(named.flaps.as_ref().and_then(|flaps| list(flaps))));
    put("jets", json!(list(&named.jets)));
    put(
        "surfaces",
        json!(named.deflections.iter().enumerate().filter_map(deflection).collect::<Vec<_>>()),
    );
    Some(Value::Object(value))
}

/// Returns the rows at which a vehicle is shown, with every peak of its rates and its moment, and
/// every loss of its guarantee.
fn frames(run: &Recording, named: &Vehicle) -> Vec<usize> {
    let norm = |paths: &Option<[String; 3]>| {
        let tracks = paths.iter().flatten().map(|path| run.tracks.get(path));
        let tracks = tracks.collect::<Option<Vec<&Track>>>().unwrap_or_default();
        let square = |row: usize| tracks.iter().map(|track| track.values[row].powi(2)).sum();
        (0..run.time.len()).map(square).collect()
    };
    let in_force = run.observe.guarantee.as_ref().and_then(|named| run.tracks.get(&named.in_force));
    let lost = in_force.map(|track| track.values.iter().map(|is| -is).collect());
    let quantities: Vec<_> =
        [norm(&named.rate), norm(&named.moment)].into_iter().chain(lost).collect();
    thin::frames(run.time.len(), &quantities)
}

/// Returns whether the guarantee is in force, and why, from each row on at which that changes; null
/// if it is not recorded.
fn guarantee(run: &Recording) -> Value {
    let Some(named) = &run.observe.guarantee else { return Value::Null };
    let Some(in_force) = run.tracks.get(&named.in_force) else { return Value::Null };
    let status = named.status.as_ref().and_then(|status| run.tracks.get(status));
    let differs = |row: usize| {
        let mut tracks = iter::once(in_force).chain(status);
        row == 0 || tracks.any(|track| track.values[row] as i64 != track.values[row - 1] as i64)
    };
    let rows: Vec<usize> = (0..run.time.len()).filter(|row| differs(*row)).collect();
    let values =
        |track: &Track| rows.iter().map(|row| track.values[*row] as i64).collect::<Vec<_>>();
    let items: Map<String, Value> = status
        .iter()
        .flat_map(|track| &track.items)
        .map(|(name, value)| (value.to_string(), json!(words(name))))
        .collect();
    let time = numbers(rows.iter().map(|row| run.time[*row]), TIME_DIGITS);
    let held = in_force.values.iter().filter(|is| **is != 0.0).count();
    let share = share_text(held as f64 / run.time.len().max(1) as f64);
    let (in_force, status) = (values(in_force), status.map(values));
    json!({ "time": time, "inForce": in_force, "status": status, "items": items, "share": share })
}

/// Returns what the summary says of the guarantee, without its margins.
fn guaranteed(run: &Recording) -> Option<&str> {
    let line = run.summary.iter().find(|line| line.heading == "guarantee")?;
    line.text.split(',').next()
}

/// Writes the name of an item as words: "inForce" as "in force".
fn words(item: &str) -> String {
    let mut text = String::new();
    for letter in item.chars() {
        if letter.is_uppercase() {
            text.push(' ');
        }
        text.extend(letter.to_lowercase());
    }
    text
}
