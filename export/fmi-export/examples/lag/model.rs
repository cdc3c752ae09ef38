//! A first-order lag x' = (k u − x) / T. Its gain changes at a time event, and an event indicator
//! tells when x crosses 1. Every kind of variable occurs in it.

use fmi_export::{
    Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, VariableTable,
};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};

/// Number of Runge–Kutta steps in a communication step.
const SUBSTEPS: i32 = 4;
/// Limiter at the output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Choice)]
enum Shape {
    /// No limiter.
    #[default]
    Linear,
    /// Output limited to between -1 and 1.
    Saturated,
}

/// Model of the lag: its parameters, input, state and outputs.
#[derive(Clone, Debug, Default, Serialize, Deserialize, Declared)]
pub struct Lag {
    /// Time constant T.
    #[setting(unit = "s", min = 1e-3, max = 1e3, start = 0.5)]
    time_constant: f64,
    /// Gain k before the switch.
    #[setting(name = "gain.early", start = 2.0)]
    gain: f64,
    /// Gain k after the switch.
    #[setting(name = "gain.late", start = 1.0)]
    late_gain: f64,
    /// Time at which the gain changes.
    #[setting(unit = "s", start = 1.25)]
    switch_time: f64,
    /// Initial state.
    #[setting(name = "initial.x", unit = "rad", start = 0.5)]
    initial: f64,
    /// Order of the lag; only 1 is supported.
    #[setting(min = 1, max = 2, start = 1)]
    order: i32,
    /// If true, the sign of the gain is inverted.
    inverted: bool,
    shape: Shape,
    /// Text that is passed on; "boom" makes the FMU panic.
    label: String,

    /// Input.
    #[setting(input, unit = "rad", min = -100.0, max = 100.0)]
    u: f64,
    /// State.
    #[setting(output, unit = "rad", nominal = 2.0)]
    x: f64,
    /// Derivative of the state.
    #[setting(name = "der(x)", local, unit = "rad/s", derivative = "x", depends_on = ["u", "x"])]
    derivative: f64,
    /// Sum of state, input and offset, after the limiter.
    #[setting(output, unit = "rad", depends_on = ["u", "x", "offset"])]
    y: f64,
    /// Current gain k.
    #[setting(name = "gain.now", output, discrete)]
    gain_now: f64,
    /// True after the gain has changed.
    #[setting(output)]
    switched: bool,
    /// Label as passed on.
    #[setting(name = "text", output)]
    description: String,
    /// Offset that is added to the output.
    #[setting(input, discrete, unit = "rad")]
    offset: f64,
    /// Offset as of the last event in model exchange.
    #[setting(skip)]
    offset_held: Option<f64>,
}

impl Lag {
    fn gain(&self, time: f64) -> f64 {
        let gain = if time >= self.switch_time { self.late_gain } else { self.gain };
        if self.inverted { -gain } else { gain }
    }

    fn rate(&self, x: f64, gain: f64) -> f64 {
        (gain * self.u - x) / self.time_constant
    }

    /// Integrates the state between two times that have no event between them.
    fn integrate(&mut self, from: f64, to: f64, inputs: &dyn Inputs<Self>) {
        let gain = self.gain(from);
        let h = (to - from) / f64::from(SUBSTEPS);
        for k in 0..SUBSTEPS {
            let t = from + f64::from(k) * h;
            let x = self.x;
            inputs.advance(self, t);
            let k1 = self.rate(x, gain);
            inputs.advance(self, t + h / 2.0);
            let k2 = self.rate(x + h / 2.0 * k1, gain);
            let k3 = self.rate(x + h / 2.0 * k2, gain);
            inputs.advance(self, t + h);
            let k4 = self.rate(x + h * k3, gain);
            self.x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        }
    }
}

impl Model for Lag {
    fn description() -> Description<Self> {
        Description {
            documentation: "<p>x' = (k u − x) / T, y = x + u + offset.</p>".into(),
            version: env!("CARGO_PKG_VERSION"),
            event_indicators: 1,
            default_experiment: DefaultExperiment { stop: 2.0, step: 0.1, ..Default::default() },
            ..Description::new(
                "Lag",
                "First-order lag with a gain that changes at a time event",
                VariableTable::new(|model| model),
            )
        }
    }

    fn new() -> Self {
        Self { label: "lag".into(), ..settings::start() }
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        if self.order != 1 {
            return Err(Failure::Error(format!("order = {}, but only 1 is supported", self.order)));
        }
        self.x = self.initial;
        self.switched = context.start_time >= self.switch_time;
        self.offset_held = None;
        Ok(())
    }

    fn calculate(&mut self, time: f64, _last: LastEvent) -> Result<(), Failure> {
        self.gain_now = self.gain(time);
        self.derivative = self.rate(self.x, self.gain_now);
        self.y = self.x + self.u + self.offset_held.unwrap_or(self.offset);
        if self.shape == Shape::Saturated {
            self.y = self.y.clamp(-1.0, 1.0);
        }
        self.description.clone_from(&self.label);
        Ok(())
    }

    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        assert!(self.label != "boom", "the label is boom");
        if self.label == "refuse" && to - from > 0.5 {
            return Err(Failure::Discard("steps above 0.5 s are too long".into()));
        }
        if from < self.switch_time && self.switch_time <= to {
            self.integrate(from, self.switch_time, inputs);
            self.integrate(self.switch_time, to, inputs);
            self.switched = true;
            log("the gain changed by 50 %");
        } else {
            self.integrate(from, to, inputs);
        }
        Ok(())
    }

    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure> {
        self.switched = time >= self.switch_time;
        self.offset_held = Some(self.offset);
        let next = (!self.switched).then_some(self.switch_time);
        Ok(EventInfo { next_event_time: next, ..EventInfo::default() })
    }

    fn event_indicators(&self, indicators: &mut [f64]) {
        indicators[0] = self.x - 1.0;
    }
}
