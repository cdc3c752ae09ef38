//! Runs of an instance with an input that moves.

use crate::interface::{EventInfo, MODEL_EXCHANGE};
use crate::{Bits, Instance, ok};
use std::ffi::c_int;
use std::ops::Range;

/// Returns the function that runs an instance of this interface.
pub fn driver(fmu_type: c_int) -> fn(&Instance, Range<u32>) -> Vec<Bits> {
    if fmu_type == MODEL_EXCHANGE { Instance::integrate } else { Instance::drive }
}

impl Instance {
    /// Value of the input at a tick of [`Instance::drive`]: small, and different at every tick.
    pub fn input_at(&self, tick: u32) -> f64 {
        let name = &self.fmu.description.variables[self.fmu.input() as usize].name;
        let size = if name == "moment.y" { 1e3 } else { 1e-4 };
        size * f64::from(tick)
    }

    /// Runs co-simulation with the proposed step over `ticks` and a moving input. Returns the
    /// results at each tick, read after the inputs of this tick were set.
    pub fn drive(&self, ticks: Range<u32>) -> Vec<Bits> {
        let h = self.fmu.description.default_experiment.step;
        let (input, results) = (self.fmu.input(), self.fmu.results());
        let mut rows = vec![];
        for tick in ticks {
            self.ok(self.set_real(input, self.input_at(tick)));
            rows.push(self.bits(&results));
            self.ok(self.step(f64::from(tick) * h, h));
        }
        rows
    }

    /// Runs model exchange with Euler steps of the proposed length, each from event mode to event
    /// mode. Returns the results at each tick.
    pub fn integrate(&self, ticks: Range<u32>) -> Vec<Bits> {
        let h = self.fmu.description.default_experiment.step;
        let n = self.fmu.description.states().len();
        let (mut x, mut derivatives) = (vec![0.0; n], vec![0.0; n]);
        let mut indicators = vec![0.0; self.fmu.description.event_indicators];
        let (input, results) = (self.fmu.input(), self.fmu.results());
        let mut rows = vec![];
        for tick in ticks {
            self.ok(self.set_real(input, self.input_at(tick)));
            let mut info = EventInfo::default();
            ok!(self, fmi2NewDiscreteStates(&mut info));
            assert_eq!((info.new_discrete_states_needed, info.terminate_simulation), (0, 0));
            ok!(self, fmi2EnterContinuousTimeMode());
            ok!(self, fmi2GetContinuousStates(x.as_mut_ptr(), n));
            ok!(self, fmi2GetDerivatives(derivatives.as_mut_ptr(), n));
            for (x, derivative) in x.iter_mut().zip(&derivatives) {
                *x += h * derivative;
            }
            ok!(self, fmi2SetTime(f64::from(tick + 1) * h));
            ok!(self, fmi2SetContinuousStates(x.as_ptr(), n));
            ok!(self, fmi2GetEventIndicators(indicators.as_mut_ptr(), indicators.len()));
            let (mut event, mut end) = (-1, -1);
            ok!(self, fmi2CompletedIntegratorStep(1, &mut event, &mut end));
            ok!(self, fmi2EnterEventMode());
            let mut row = self.bits(&results);
            row.extend(indicators.iter().map(|indicator| indicator.to_bits()));
            rows.push(row);
        }
        rows
    }
}
