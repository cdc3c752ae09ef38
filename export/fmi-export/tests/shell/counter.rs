//! The second FMU of the library, for co-simulation only. It has a defect for every place where a
//! panic can start.

use fmi_export::table::{discrete_output, input, parameter};
use fmi_export::{Context, Description, Failure, Inputs, LastEvent, Model, VariableTable};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::Choice;
use std::path::Path;

/// Time (s) at which the simulation ends with the defect `end`.
pub(crate) const ENDS_AT: f64 = 0.75;

/// Whether the count is even. The enumeration below leaves one out, as an FMU's author might.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Parity {
    Even,
    Odd,
}

impl Choice for Parity {
    const NAME: &'static str = "Parity";
    const TEXT: &'static str = "Parity of the count";
    const ITEMS: &'static [(Self, &'static str, &'static str)] = &[(Self::Even, "even", "")];
}

/// Model that counts its steps.
#[derive(Serialize, Deserialize)]
pub(crate) struct Counter {
    defect: String,
    increment: f64,
    count: f64,
    seen: f64,
    resources: String,
    parity: Parity,
    resets: i32,
}

impl Counter {
    fn meet(&self, place: &str) {
        assert!(self.defect != place, "defect in {place}");
    }
}

impl Model for Counter {
    fn description() -> Description<Self> {
        Description {
            name: "Counter",
            description: "Counts its steps",
            documentation: String::new(),
            version: "1",
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: 1.0,
                tolerance: 1e-6,
                step: 0.1,
            },
            table: VariableTable::new()
                .string(parameter("defect", "Where to panic"), |m: &mut Self| &mut m.defect)
                .real(input("increment", "What a step adds").real(), |m| &mut m.increment)
                .real(discrete_output("count", "Sum of the increments").real(), |m| &mut m.seen)
                .string(discrete_output("resources", "The resource folder"), |m| &mut m.resources)
                .choice(discrete_output("parity", Parity::TEXT), |m| &mut m.parity)
                .integer(discrete_output("resets", "Resets of this model"), (None, None), |m| {
                    &mut m.resets
                }),
        }
    }

    fn new() -> Self {
        Self {
            defect: String::new(),
            increment: 1.0,
            count: 0.0,
            seen: 0.0,
            resources: String::new(),
            parity: Parity::Even,
            resets: 0,
        }
    }

    fn reset(&mut self) {
        *self = Self { resets: self.resets + 1, ..Self::new() };
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        self.meet("initialize");
        if self.defect == "parameter" {
            return Err(Failure::Error("defect = parameter is not allowed".into()));
        }
        self.resources = context
            .resources
            .map_or("none", |path: &Path| path.to_str().unwrap_or_default())
            .into();
        self.count = context.start_time;
        Ok(())
    }

    fn calculate(&mut self, _time: f64, _last: LastEvent) -> Result<(), Failure> {
        self.meet("calculate");
        self.seen = self.count;
        self.parity = if self.count % 2.0 == 0.0 { Parity::Even } else { Parity::Odd };
        Ok(())
    }

    fn step(
        &mut self,
        _from: f64,
        to: f64,
        _inputs: &dyn Inputs<Self>,
        _log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        self.meet("step");
        self.count += self.increment;
        if self.defect == "end" && to > ENDS_AT {
            return Err(Failure::Ended { time: ENDS_AT, reason: "the count is over".into() });
        }
        Ok(())
    }
}
