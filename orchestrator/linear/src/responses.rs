//! Responses of a component to short changes of its inputs, by differences.
//!
//! An input is changed during one step, by ±δ and by ±δ/2, from the same kept state. The central
//! differences of both, extrapolated to δ = 0 (Richardson), leave an error of the order δ⁴. Where
//! the component has no derivative, as at the edge of a constraint, the slopes to both sides do not
//! come closer as δ falls, and both are kept besides.

use crate::Matrix;
use crate::replay::{Change, Recorded};
use fmi_master::instance::{CallFailure, Instance};

/// Share of the difference between the slopes to both sides that is left when the change is halved,
/// above which there is an edge. A smooth component leaves a half, one with an edge all of it.
const FALLS: f64 = 0.75;
/// Difference of the slopes to both sides, relative to the largest slope, below which it does not
/// count.
const SAME: f64 = 1e-3;

/// Responses to changes at one step: one matrix, outputs by inputs, for each lag.
pub type Lags = Vec<Matrix>;

/// Responses of a component to changes at one step, in multiples of the typical magnitudes.
#[derive(Clone, Debug)]
pub struct Response {
    /// The responses by central differences.
    pub central: Lags,
    /// The responses to an increase and to a decrease, if they differ.
    pub sides: Option<[Lags; 2]>,
    /// Error of the central differences as far as the two changes show it, relative to the largest
    /// response.
    pub error: f64,
}

/// Typical magnitudes of a component's inputs and outputs.
pub struct Scales {
    /// Magnitudes of the inputs.
    pub inputs: Vec<f64>,
    /// Magnitudes of the outputs.
    pub outputs: Vec<f64>,
}

/// The inputs that are changed and the outputs that are read.
pub struct Probe<'a> {
    /// Inputs of the component as they were in the loop.
    pub recorded: &'a Recorded,
    /// Places of the changed inputs among the recorded ones.
    pub inputs: &'a [usize],
    /// Value references of the outputs.
    pub outputs: &'a [u32],
    /// Typical magnitudes of both.
    pub scales: &'a Scales,
    /// Change of an input in relation to its typical magnitude.
    pub change: f64,
}

/// Returns the difference of the responses at steps one period apart, relative to the largest.
pub(crate) fn difference(phases: &[Response], period: usize) -> f64 {
    let norm = |lags: &Lags| lags.iter().map(Matrix::amax).fold(0.0, f64::max);
    let largest = phases.iter().map(|phase| norm(&phase.central)).fold(f64::MIN_POSITIVE, f64::max);
    let pairs = phases.iter().zip(&phases[period..]);
    let differences = pairs.map(|(a, b)| {
        let lags = a.central.iter().zip(&b.central);
        lags.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max)
    });
    differences.fold(0.0, f64::max) / largest
}

/// Returns the lag at which the last output of those that respond begins to; `None` if none does.
pub(crate) fn beginning(lags: &Lags) -> Option<usize> {
    let begins = |row: usize| lags.iter().position(|matrix| matrix.row(row).amax() > 0.0);
    (0..lags[0].nrows()).filter_map(begins).max()
}

impl Probe<'_> {
    /// Takes the responses to changes at step `first`, up to `count` steps later.
    ///
    /// # Errors
    /// Returns an error if the instance fails.
    pub fn responses(
        &self,
        instance: &mut dyn Instance,
        first: usize,
        count: usize,
    ) -> Result<Response, CallFailure> {
        let (rows, columns) = (self.outputs.len(), self.inputs.len());
        let zeros = || vec![Matrix::zeros(rows, columns); count];
        let (mut central, mut up, mut down) = (zeros(), zeros(), zeros());
        let (mut error, mut has_edge) = (0.0_f64, false);
        let base = self.recorded.run(instance, first, count, None, self.outputs)?;
        for (column, &place) in self.inputs.iter().enumerate() {
            let mut changed = |by: f64| {
                let change = Change { place, by: by * self.scales.inputs[column] };
                let values =
                    self.recorded.run(instance, first, count, Some(change), self.outputs)?;
                // Differences from the base, per change, in typical magnitudes.
                Ok(Matrix::from_fn(rows, count, |row, lag| {
                    (values[lag][row] - base[lag][row]) / (by * self.scales.outputs[row])
                }))
            };
            let [whole, half] =
                [self.change, 0.5 * self.change].map(|by| Ok([changed(by)?, changed(-by)?]));
            let ([more, less], [more_half, less_half]): ([Matrix; 2], [Matrix; 2]) =
                (whole?, half?);
            let (mean, mean_half) = ((&more + &less) * 0.5, (&more_half + &less_half) * 0.5);
            let exact = (&mean_half * 4.0 - &mean) / 3.0;
            error = error.max((&mean_half - &mean).amax() / 3.0);
            let [bend, bend_half] = [&more - &less, &more_half - &less_half].map(|m| m.amax());
            has_edge |= bend_half > FALLS * bend && bend_half > SAME * exact.amax().max(1e-12);
            for lag in 0..count {
                central[lag].set_column(column, &exact.column(lag));
                up[lag].set_column(column, &more_half.column(lag));
                down[lag].set_column(column, &less_half.column(lag));
            }
        }
        let largest = central.iter().map(Matrix::amax).fold(f64::MIN_POSITIVE, f64::max);
        let sides = has_edge.then_some([up, down]);
        Ok(Response { central, sides, error: error / largest })
    }
}
