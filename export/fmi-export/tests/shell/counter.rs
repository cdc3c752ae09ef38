//! The second FMU of the library, for co-simulation only. It has a defect for every place where a
//! panic can start.

use fmi_export::{Context, Description, Failure, Inputs, LastEvent, Model, VariableTable};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared, Place, Setting};

/// Time (s) at which the simulation ends with the defect `end`.
pub(crate) const ENDS_AT: f64 = 0.75;

/// Whether the count is even. The enumeration below leaves one out, as an FMU's author might.
#[derive(Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
enum Parity {
    #[default]
    Even,
    Odd,
}

impl Choice for Parity {
    const NAME: &'static str = "Parity";
    const TEXT: &'static str = "Parity of the count";
    const ITEMS: &'static [(Self, &'static str, &'static str)] = &[(Self::Even, "even", "")];
}

// SAFETY: The only field is the value itself.
#[allow(unsafe_code, reason = "the derive macro would list all items")]
unsafe impl Declared for Parity {
    fn declare(place: &Place, list: &mut Vec<Setting>) {
        list.push(Self::setting(place));
    }
}

/// Model that counts its steps.
#[derive(Default, Serialize, Deserialize, Declared)]
pub(crate) struct Counter {
    /// Where to panic.
    defect: String,
    /// What a step adds.
    #[setting(input, start = 1.0)]
    increment: f64,
    #[setting(skip)]
    count: f64,
    /// Sum of the increments.
    #[setting(name = "count", output, discrete)]
    seen: f64,
    #[setting(output)]
    parity: Parity,
    /// Resets of this model.
    #[setting(output)]
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
            version: "1",
            default_experiment: DefaultExperiment { step: 0.1, ..DefaultExperiment::default() },
            ..Description::new("Counter", "Counts its steps", VariableTable::new(|model| model))
        }
    }

    fn new() -> Self {
        settings::start()
    }

    fn reset(&mut self) {
        *self = Self { resets: self.resets + 1, ..Self::new() };
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        self.meet("initialize");
        if self.defect == "parameter" {
            return Err(Failure::Error("defect = parameter is not allowed".into()));
        }
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
