//! A first-order lag x' = (k u − x) / T. Its gain changes at a time event, and an event indicator
//! tells when x crosses 1. Every kind of variable occurs in it.

use fmi_export::table::{discrete_input, discrete_output, input, local, output, parameter};
use fmi_export::{
    Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, VariableTable,
};
use model_description::DefaultExperiment;
use serde::{Deserialize, Serialize};
use settings::Choice;

/// Number of Runge–Kutta steps in a communication step.
const SUBSTEPS: i32 = 4;
/// Limiter at the output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Choice)]
enum Shape {
    /// No limiter.
    Linear,
    /// Output limited to between -1 and 1.
    Saturated,
}

/// Model of the lag: its parameters, input, state and outputs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Lag {
    time_constant: f64,
    gain: f64,
    late_gain: f64,
    switch_time: f64,
    initial: f64,
    order: i32,
    inverted: bool,
    shape: Shape,
    label: String,

    u: f64,
    x: f64,
    switched: bool,
    offset: f64,
    /// Offset as of the last event in model exchange.
    offset_held: Option<f64>,

    derivative: f64,
    y: f64,
    gain_now: f64,
    description: String,
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
        let table = VariableTable::new()
            .real(
                parameter("timeConstant", "Time constant T").real().unit("s").min(1e-3).max(1e3),
                |m: &mut Self| &mut m.time_constant,
            )
            .real(parameter("gain.early", "Gain k before the switch").real(), |m| &mut m.gain)
            .real(parameter("gain.late", "Gain k after the switch").real(), |m| &mut m.late_gain)
            .real(parameter("switchTime", "Time at which the gain changes").real().unit("s"), |m| {
                &mut m.switch_time
            })
            .real(parameter("initial.x", "Initial state").real().unit("rad"), |m| &mut m.initial)
            .integer(
                parameter("order", "Order of the lag; only 1 is supported"),
                (Some(1), Some(2)),
                |m| &mut m.order,
            )
            .boolean(parameter("inverted", "If true, the sign of the gain is inverted"), |m| {
                &mut m.inverted
            })
            .choice(parameter("shape", Shape::TEXT), |m| &mut m.shape)
            .string(
                parameter("label", "Text that is passed on; \"boom\" makes the FMU panic"),
                |m| &mut m.label,
            )
            .real(input("u", "Input").real().unit("rad").min(-100.0).max(100.0), |m| &mut m.u)
            .real(output("x", "State").real().unit("rad").nominal(2.0), |m| &mut m.x)
            .real(
                local("der(x)", "Derivative of the state")
                    .depends_on(["u", "x"])
                    .real()
                    .unit("rad/s")
                    .derivative_of("x"),
                |m| &mut m.derivative,
            )
            .real(
                output("y", "Sum of state, input and offset, after the limiter")
                    .depends_on(["u", "x", "offset"])
                    .real()
                    .unit("rad"),
                |m| &mut m.y,
            )
            .real(discrete_output("gain.now", "Current gain k").real(), |m| &mut m.gain_now)
            .boolean(discrete_output("switched", "True after the gain has changed"), |m| {
                &mut m.switched
            })
            .string(discrete_output("text", "Label as passed on"), |m| &mut m.description)
            .real(
                discrete_input("offset", "Offset that is added to the output").real().unit("rad"),
                |m| &mut m.offset,
            );
        Description {
            name: "Lag",
            description: "First-order lag with a gain that changes at a time event",
            documentation: "<p>x' = (k u − x) / T, y = x + u + offset.</p>".into(),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: true,
            event_indicators: 1,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: 2.0,
                tolerance: 1e-6,
                step: 0.1,
            },
            table,
        }
    }

    fn new() -> Self {
        Self {
            time_constant: 0.5,
            gain: 2.0,
            late_gain: 1.0,
            switch_time: 1.25,
            initial: 0.5,
            order: 1,
            inverted: false,
            shape: Shape::Linear,
            label: "lag".into(),
            u: 0.0,
            x: 0.0,
            switched: false,
            offset: 0.0,
            offset_held: None,
            derivative: 0.0,
            y: 0.0,
            gain_now: 0.0,
            description: String::new(),
        }
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

    fn continuous_states(&self, states: &mut [f64]) {
        states[0] = self.x;
    }

    fn set_continuous_states(&mut self, states: &[f64]) {
        self.x = states[0];
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

    fn partial_derivative(
        &mut self,
        time: f64,
        unknown_variable: usize,
        known_variable: usize,
    ) -> Result<f64, Failure> {
        let gain = self.gain(time);
        match (unknown_variable, known_variable) {
            (11, 9) => Ok(gain / self.time_constant),
            (11, 10) => Ok(-1.0 / self.time_constant),
            (10, 10) | (12, 9 | 10) => Ok(1.0),
            _ => Ok(0.0),
        }
    }
}
