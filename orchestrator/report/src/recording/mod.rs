//! Data of a run for its pictures: the recorded variables over time, the panels of its experiment,
//! its parameters and its outcome. It comes from the files of a run, or from the run itself.

pub mod asked;
mod cover;
mod effectors;
pub mod panels;
pub mod trajectory;
pub mod watch;

use cosim::experiment::{Observe, Vehicle};
use cosim::signal::Signal;
use fmi_master::names;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// A run as its pictures show it.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Short name that distinguishes the run from others.
    pub name: String,
    /// Title of the experiment.
    pub title: String,
    /// How the run ended.
    pub status: String,
    /// Times of the rows, s.
    pub time: Vec<f64>,
    /// Names of the recorded variables, in their order.
    pub recorded: Vec<String>,
    /// Recorded variables and parameters by name.
    pub tracks: BTreeMap<String, Track>,
    /// Measures and pictures of the experiment.
    pub observe: Observe,
    /// Values of all parameters.
    pub parameters: Vec<Parameter>,
    /// Lines of the run's summary.
    pub summary: Vec<SummaryLine>,
    /// Version of the program that flew the run, and similar facts, by heading.
    pub origin: Vec<(String, String)>,
}

/// A line of a run's summary.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SummaryLine {
    /// Heading, which names the measured quantity.
    pub heading: String,
    /// What the heading means, or an empty text.
    pub meaning: String,
    /// Values as text.
    pub text: String,
    /// Whether the quantity is within its limits; `None` if it has none.
    pub is_within: Option<bool>,
}

/// A variable over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track {
    /// Unit in which the variable is displayed, or an empty text.
    pub unit: String,
    /// Number of these units in one unit of the values.
    pub factor: f64,
    /// Items of an enumeration with their values.
    pub items: Vec<(String, i32)>,
    /// Values in the variable's own unit, one for each row.
    pub values: Vec<f64>,
}

/// A parameter with its value as text.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Full name, `component.parameter`.
    pub name: String,
    /// Value in the unit in which it is displayed, with that unit.
    pub text: String,
    /// Whether the experiment sets it; otherwise it is that of the FMU.
    pub is_set: bool,
}

/// A signal over time, in the unit in which it is displayed.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Unit of the values, or an empty text.
    pub unit: String,
    /// Values, one for each row.
    pub values: Vec<f64>,
}

impl Recording {
    /// Creates a recording from the content of `results.json` and the recorded variables. Numbers
    /// among the parameters are variables that never change.
    pub fn new(name: &str, metadata: &Value, time: Vec<f64>, tracks: Vec<(String, Track)>) -> Self {
        let text = |pointer: &str| {
            metadata.pointer(pointer).and_then(Value::as_str).unwrap_or_default().to_string()
        };
        let title = Some(text("/title")).filter(|title| !title.is_empty());
        let mut recording = Self {
            name: name.into(),
            title: title.unwrap_or_else(|| name.into()),
            status: text("/status"),
            time,
            recorded: tracks.iter().map(|(name, _)| name.clone()).collect(),
            tracks: tracks.into_iter().collect(),
            observe: observe(&metadata["experiment"]),
            origin: origin(metadata),
            ..Self::default()
        };
        for (component, content) in metadata["components"].as_object().into_iter().flatten() {
            recording.take_parameters(component, content);
        }
        recording
    }

    /// Takes the parameters of a component.
    fn take_parameters(&mut self, component: &str, content: &Value) {
        for (short, value) in content["parameters"].as_object().into_iter().flatten() {
            let name = format!("{component}.{short}");
            let (unit, factor) = display_unit(&content["display_units"][short.as_str()]);
            let text = match value.as_f64() {
                Some(number) if unit.is_empty() => number_text(number),
                Some(number) => format!("{} {unit}", number_text(factor * number)),
                None => value.as_str().map_or_else(|| value.to_string(), str::to_string),
            };
            let is_set = !content["set"][short.as_str()].is_null();
            self.parameters.push(Parameter { name: name.clone(), text, is_set });
            if let (Some(number), false) = (value.as_f64(), self.tracks.contains_key(&name)) {
                let values = vec![number; self.time.len()];
                self.tracks.insert(name, Track { unit, factor, items: Vec::new(), values });
            }
        }
    }

    /// Returns a variable by its full name.
    ///
    /// # Errors
    /// Returns an error with the nearest name if it is not recorded.
    pub fn track(&self, name: &str) -> Result<&Track, String> {
        self.tracks.get(name).ok_or_else(|| {
            let hint = names::hint(name, self.tracks.keys().map(String::as_str));
            format!("\"{name}\" is not recorded in {}{hint}", self.name)
        })
    }

    /// Returns a signal over time, in the unit in which its variables are displayed.
    ///
    /// # Errors
    /// Returns an error if a variable is not recorded, or if units differ.
    pub fn series(&self, signal: &Signal) -> Result<Series, String> {
        let mut tracks = Vec::new();
        let resolved = signal.resolve(|name| {
            let track = self.track(name)?;
            tracks.push(track);
            Ok((tracks.len() - 1, track.factor, track.unit.clone()))
        })?;
        let value = |row: usize| {
            let values: Vec<f64> = tracks.iter().map(|track| track.values[row]).collect();
            resolved.value(&values)
        };
        Ok(Series {
            values: (0..self.time.len()).map(value).collect(),
            unit: resolved.unit.clone(),
        })
    }

    /// Leaves out the rows before `from` and after `to`, s.
    #[must_use]
    pub fn within(mut self, from: Option<f64>, to: Option<f64>) -> Self {
        let is_in: Vec<bool> = self
            .time
            .iter()
            .map(|t| from.is_none_or(|from| *t >= from) && to.is_none_or(|to| *t <= to))
            .collect();
        let cut = |values: &mut Vec<f64>| {
            let mut rows = is_in.iter();
            values.retain(|_| rows.next() == Some(&true));
        };
        cut(&mut self.time);
        self.tracks.values_mut().for_each(|track| cut(&mut track.values));
        self
    }
}

/// Reads a display unit as `results.json` has it.
pub fn display_unit(value: &Value) -> (String, f64) {
    let name = value["name"].as_str().unwrap_or_default().to_string();
    (name, value["factor"].as_f64().unwrap_or(1.0))
}

/// Reads the section `[observe]` from the text of an experiment, with the vehicle as it was shown; it
/// is empty if there is none.
fn observe(experiment: &Value) -> Observe {
    #[derive(Default, Deserialize)]
    struct Section {
        #[serde(default)]
        observe: Observe,
    }
    let text = experiment["text"].as_str().unwrap_or_default();
    let Section { mut observe } = toml::from_str(text).unwrap_or_default();
    if let Ok(vehicle) = serde_json::from_value::<Vehicle>(experiment["vehicle"].clone()) {
        observe.vehicle = Some(vehicle);
    }
    observe
}

fn origin(metadata: &Value) -> Vec<(String, String)> {
    let mut origin = Vec::new();
    let mut add = |heading: &str, value: &Value| match value {
        Value::Null => {}
        Value::String(text) => origin.push((heading.to_string(), text.clone())),
        other => origin.push((heading.to_string(), other.to_string())),
    };
    add("experiment", &metadata["experiment"]["file"]);
    add("ended", &metadata["status"]);
    add("stop time, s", &metadata["simulation"]["stop"]);
    add("step, s", &metadata["simulation"]["step"]);
    for (name, component) in metadata["components"].as_object().into_iter().flatten() {
        add(name, &component["fmu"]);
    }
    add("orchestrator", &metadata["orchestrator"]);
    origin
}

/// Formats a number with at most six significant digits.
pub fn number_text(number: f64) -> String {
    let digits = format!("{number:.5e}");
    let rounded: f64 = digits.parse().unwrap_or(number);
    match rounded.abs() {
        size if size != 0.0 && !(1e-4..1e7).contains(&size) => format!("{rounded:e}"),
        _ => format!("{rounded}"),
    }
}

/// Formats a share in percent, rounded down: only the whole is 100 %.
pub fn share_text(share: f64) -> String {
    // A share of 0.57 is 57 %, whatever its last bit.
    number_text((1e4 * share + 1e-6).floor() / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn recording() -> Recording {
        let metadata = json!({
            "title": "a loop",
            "status": "completed",
            "components": { "law": {
                "parameters": { "limit": 0.1, "mode": "fast" },
                "set": { "limit": 0.1 },
                "display_units": { "limit": { "name": "deg", "factor": 57.0 } },
            } },
            "experiment": {
                "text": "title = \"a loop\"\n[observe]\nsummary = [\"x\"]\nvehicle = { attitude = [\"a\", \"b\", \"c\"] }",
                "vehicle": { "attitude": ["a", "b", "c"], "deflections": ["d"], "surfaces": ["own flap"] },
            },
        });
        let track = |factor, unit: &str, values: &[f64]| Track {
            unit: unit.into(),
            factor,
            items: Vec::new(),
            values: values.to_vec(),
        };
        let tracks = [
            ("plant.a".to_string(), track(10.0, "deg", &[3.0, 0.0, 1.0])),
            ("plant.b".to_string(), track(10.0, "deg", &[4.0, 1.0, 0.0])),
            ("plant.c".to_string(), track(1.0, "s", &[1.0, 2.0, 4.0])),
        ];
        Recording::new("run", &metadata, vec![0.0, 1.0, 2.0], tracks.to_vec())
    }

    fn signal(text: &str) -> Signal {
        Signal::try_from(text.to_string()).unwrap()
    }

    #[test]
    fn oracle_signals_in_display_units() {
        let recording = recording();
        let values = |text: &str| recording.series(&signal(text)).unwrap();
        assert_eq!(values("norm(plant.a, plant.b)").values, [50.0, 10.0, 10.0]);
        assert_eq!(values("plant.a - plant.b").values, [-10.0, -10.0, 10.0]);
        assert_eq!(values("plant.a").unit, "deg");
        let ratio = values("plant.a / law.limit");
        assert!(ratio.unit.is_empty() && (ratio.values[0] - 30.0 / 5.7).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_recorded_is_named_with_the_nearest() {
        let error = recording().series(&signal("plant.aa")).unwrap_err();
        assert_eq!(error, "\"plant.aa\" is not recorded in run; did you mean \"plant.a\"?");
        let error = recording().series(&signal("plant.a - plant.c")).unwrap_err();
        assert!(error.contains(" mixes "), "{error}");
    }

    #[test]
    fn a_window_cuts_every_track() {
        let cut = recording().within(Some(0.5), Some(1.5));
        assert_eq!(cut.time, [1.0]);
        assert!(cut.tracks.values().all(|track| track.values.len() == 1));
    }

    #[test]
    fn parameters_have_their_display_units_and_say_whether_they_are_set() {
        let parameters = recording().parameters;
        let parameter = |name: &str, text: &str, is_set| Parameter {
            name: name.into(),
            text: text.into(),
            is_set,
        };
        assert_eq!(
            parameters,
            [parameter("law.limit", "5.7 deg", true), parameter("law.mode", "fast", false)]
        );
        let observe = recording().observe;
        assert_eq!(observe.summary, ["x"]);
        assert_eq!(observe.vehicle.unwrap().surface(0), "own flap");
    }

    #[test]
    fn a_share_is_rounded_down() {
        let texts = [1.0, 0.57, 0.999_999, 1.0 / 3.0, 1e-6].map(share_text);
        assert_eq!(texts, ["100", "57", "99.99", "33.33", "0"]);
    }
}
