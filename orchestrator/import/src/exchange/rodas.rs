//! Integration of stiff and other ordinary differential equations by Rodas5P, a Rosenbrock method of
//! order 5 with an error estimate and an interpolation of order 4.
//!
//! Method and coefficients: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and
//! numerical benchmarks within the Julia Differential Equations package, BIT Numerical Mathematics
//! 63, 27 (2023). Form of the stages and choice of the step: E. Hairer, G. Wanner, Solving Ordinary
//! Differential Equations II, 2nd edition, section IV.7. Powers are taken from `libm`, because
//! those of the system differ in their last bits.
//!
//! Libraries were tried. diffsol 0.18 brings faer, whose kernels the processor chooses, and ties a
//! solver to borrowed equations, which cannot be kept and restored. The Radau5 of
//! differential-equations 0.7 leaves the scale of the error empty for states whose number is known
//! at run time only, and panics.

use super::model::Refusal;
use fmi_master::instance::CallFailure;
use fmi_master::quantity::rounded;
use nalgebra::{DMatrix, DVector};

/// A system of ordinary differential equations.
pub(super) trait System {
    /// Name of the call that computes the derivatives, in failures.
    const CALL: &'static str;
    /// Computes the derivatives by time, at a time (s) and for these states.
    fn derivatives(
        &mut self,
        time: f64,
        states: &[f64],
        derivatives: &mut [f64],
    ) -> Result<(), Refusal>;
    /// Computes the Jacobian matrix of the derivatives by the states.
    fn jacobian(&mut self, at: &Point, jacobian: &mut DMatrix<f64>) -> Result<(), Refusal>;
}

/// States at a time (s), with their derivatives.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Point {
    pub(super) time: f64,
    pub(super) states: Vec<f64>,
    /// What rounding has left out of the states, so that slow changes of large states add up.
    pub(super) rests: Vec<f64>,
    pub(super) derivatives: Vec<f64>,
}

/// A step, with the change of the states and the coefficients of what they are within it.
pub(super) struct Step {
    pub(super) begin: Point,
    pub(super) end: Point,
    change: DVector<f64>,
    inner: [DVector<f64>; 3],
}

impl Step {
    /// A step without states.
    pub(super) fn empty(begin: &Point, time: f64) -> Self {
        let end = Point { time, ..Point::default() };
        Self { begin: begin.clone(), end, change: <_>::default(), inner: <_>::default() }
    }

    /// Returns the part of the step after which this time (s) comes.
    pub(super) fn part(&self, time: f64) -> f64 {
        (time - self.begin.time) / (self.end.time - self.begin.time)
    }

    /// Interpolates time and states of a point at a time (s) within the step. The change since its
    /// begin is rounded once, so that a small one does not turn back.
    pub(super) fn interpolate(&self, time: f64, point: &mut Point) {
        if time >= self.end.time {
            return point.clone_from(&self.end);
        }
        point.time = time;
        let part = self.part(time);
        let [first, second, third] = &self.inner;
        for i in 0..self.change.len() {
            let inner = first[i] + part * (second[i] + part * third[i]);
            let change = part * (self.change[i] + (1.0 - part) * inner);
            (point.states[i], point.rests[i]) = self.begin.changed(i, change);
        }
    }
}

impl Point {
    /// Becomes another point whose states have changed.
    fn change(&mut self, from: &Self, change: &DVector<f64>) {
        for (place, change) in change.iter().enumerate() {
            (self.states[place], self.rests[place]) = from.changed(place, *change);
        }
    }

    /// Returns a state and its rest after a change, by the sum of two numbers without an error: D. E.
    /// Knuth, The Art of Computer Programming, volume 2, section 4.2.2, theorem B.
    fn changed(&self, place: usize, change: f64) -> (f64, f64) {
        let (state, change) = (self.states[place], self.rests[place] + change);
        let sum = state + change;
        let added = sum - state;
        (sum, (state - (sum - added)) + (change - added))
    }
}

/// The integrator with what it remembers from step to step.
#[derive(Clone)]
pub(super) struct Rodas {
    /// Relative tolerance of the error of a step.
    tolerance: f64,
    /// Typical magnitudes of the states.
    pub(super) nominals: Vec<f64>,
    /// Length of the next step, s.
    pub(super) next: f64,
}

impl Rodas {
    /// Makes an integrator with this relative tolerance.
    pub(super) fn new(tolerance: f64) -> Self {
        Self { tolerance, nominals: Vec::new(), next: f64::INFINITY }
    }

    /// Makes a step from a point. It ends at the time `end` (s) or before it.
    pub(super) fn step<S: System>(
        &mut self,
        system: &mut S,
        from: &Point,
        end: f64,
    ) -> Result<Step, CallFailure> {
        let (count, span) = (from.states.len(), end - from.time);
        // One last step that is a little longer is better than two.
        let mut length = if self.next > 0.99 * span { span } else { self.next };
        let shortest = 16.0 * f64::EPSILON * from.time.abs().max(end.abs());
        let mut jacobian = DMatrix::zeros(count, count);
        system.jacobian(from, &mut jacobian).map_err(Refusal::failure)?;
        let (mut is_retried, mut discarded) = (false, None);
        loop {
            let at = if length == span { end } else { from.time + length };
            let factor = match self.trial(system, from, at, &jacobian) {
                Ok((step, error)) => {
                    let factor = (0.9 * libm::pow(error, -0.2)).clamp(0.2, 6.0);
                    if error < 1.0 {
                        let next = length * if is_retried { factor.min(1.0) } else { factor };
                        // A span that shortens a step says nothing about the next one.
                        let is_cut = length == span && !is_retried && self.next.is_finite();
                        self.next = if is_cut { next.max(self.next) } else { next };
                        return Ok(step);
                    }
                    if error.is_finite() { factor } else { 0.25 }
                }
                Err(Refusal::Discarded(failure)) => {
                    discarded = Some(failure);
                    0.25
                }
                Err(Refusal::Failed(failure)) => return Err(failure),
            };
            is_retried = true;
            length *= factor;
            if length <= shortest {
                return Err(discarded.unwrap_or_else(|| {
                    let time = rounded(from.time);
                    let text = format!("the integration needs steps below {shortest:.0e} s at t = {time} s: the derivatives are not finite, or jump without an event");
                    CallFailure::new(S::CALL, text)
                }));
            }
        }
    }

    /// Tries a step to the time `at`. Returns it with its error as a multiple of the tolerance.
    fn trial(
        &self,
        system: &mut impl System,
        from: &Point,
        at: f64,
        jacobian: &DMatrix<f64>,
    ) -> Result<(Step, f64), Refusal> {
        let (count, length) = (from.states.len(), at - from.time);
        let zero = DVector::zeros(count);
        let slope = slope(system, from, length)?;
        let diagonal = DMatrix::from_diagonal_element(count, count, 1.0 / (GAMMA * length));
        let matrix = (diagonal - jacobian).lu();
        let mut stages: Vec<DVector<f64>> = Vec::with_capacity(STATES.len());
        let mut value = DVector::from_column_slice(&from.derivatives);
        let mut change = zero.clone();
        let mut end = from.clone();
        for (stage, row) in VALUES.iter().enumerate() {
            if stage > 0 {
                change = sum(&zero, STATES[stage], &stages);
                end.change(from, &change);
                let time = (from.time + TIMES[stage] * length).min(at);
                system.derivatives(time, &end.states, value.as_mut_slice())?;
            }
            value += sum(&zero, row, &stages) / length;
            value += &slope * (SLOPES[stage] * length);
            // A singular matrix gives stages that are not finite, and so a shorter step.
            if !matrix.solve_mut(&mut value) {
                value.fill(f64::NAN);
            }
            stages.push(value.clone());
        }
        // The last stage is the difference to the solution of order 4.
        change += &value;
        end.change(from, &change);
        end.time = at;
        let mut error = self.measured([&from.states, &end.states], &value);
        if error < 1.0 {
            system.derivatives(at, &end.states, &mut end.derivatives)?;
            if end.derivatives.iter().any(|value| !value.is_finite()) {
                error = f64::NAN;
            }
        }
        let inner = INNER.map(|row| sum(&zero, &row, &stages));
        Ok((Step { begin: from.clone(), end, change, inner }, error))
    }

    /// Returns the root of the mean of the squares of an error, each value as a multiple of what
    /// the tolerance allows at the states at begin and end: Hairer and Wanner, volume I, (4.10).
    fn measured(&self, [begin, end]: [&[f64]; 2], error: &DVector<f64>) -> f64 {
        let squares = error.iter().enumerate().map(|(place, error)| {
            let magnitude = begin[place].abs().max(end[place].abs());
            (error / (self.tolerance * (self.nominals[place] + magnitude))).powi(2)
        });
        (squares.sum::<f64>() / error.len() as f64).sqrt()
    }
}

/// Returns a vector plus the sum of the stages with these weights.
fn sum(start: &DVector<f64>, weights: &[f64], stages: &[DVector<f64>]) -> DVector<f64> {
    weights.iter().zip(stages).fold(start.clone(), |sum, (weight, stage)| sum + stage * *weight)
}

/// Returns the change of the derivatives by time where the states are held: by a parabola over a
/// small part of a step of this length (s), so that the method keeps its order.
fn slope(system: &mut impl System, from: &Point, length: f64) -> Result<DVector<f64>, Refusal> {
    // The times are rounded, and their distances then exact.
    let [near, far] = [1e-3, 2e-3].map(|part| from.time + part * length - from.time);
    let zero = DVector::zeros(from.states.len());
    if near <= 0.0 || far <= near {
        return Ok(zero);
    }
    let mut changes = [zero.clone(), zero];
    for (change, distance) in changes.iter_mut().zip([near, far]) {
        system.derivatives(from.time + distance, &from.states, change.as_mut_slice())?;
        *change -= DVector::from_column_slice(&from.derivatives);
    }
    let [first, second] = changes;
    Ok((first * (far / near) - second * (near / far)) / (far - near))
}

// Coefficients of the method: those of the diagonal, of the times, of the slopes, and by rows those
// of the stages' states, of the stages' values and of the interpolation.
const GAMMA: f64 = 0.211_937_563_194_290_14;
#[rustfmt::skip]
const TIMES: [f64; 8] = [
    0.0, 0.635_812_689_582_870_4, 0.409_579_839_339_753_5, 0.976_930_672_506_071_6,
    0.428_840_360_955_866_4, 1.0, 1.0, 1.0,
];
#[rustfmt::skip]
const SLOPES: [f64; 8] = [
    GAMMA, -0.423_875_126_388_580_27, -0.338_462_712_623_592_4, 1.804_645_287_288_273_4,
    2.325_825_639_765_069, 0.0, 0.0, 0.0,
];
#[rustfmt::skip]
const STATES: [&[f64]; 8] = [
    &[],
    &[3.0],
    &[2.849_394_379_747_939, 0.458_422_422_044_639_23],
    &[-6.954_028_509_809_101, 2.489_845_061_869_568, -10.358_996_098_473_584],
    &[2.802_998_627_562_896_4, 0.507_246_473_622_820_6, -0.398_831_254_177_052_4, -0.047_211_872_304_046_41],
    &SOLUTION,
    &[SOLUTION[0], SOLUTION[1], SOLUTION[2], SOLUTION[3], SOLUTION[4], 1.0],
    &[SOLUTION[0], SOLUTION[1], SOLUTION[2], SOLUTION[3], SOLUTION[4], 1.0, 1.0],
];
#[rustfmt::skip]
const SOLUTION: [f64; 5] = [
    -7.502_846_399_306_121, 2.561_846_144_803_919, -11.627_539_656_261_098,
    -0.182_687_676_599_422_56, 0.030_198_172_008_377_946,
];
#[rustfmt::skip]
const VALUES: [&[f64]; 8] = [
    &[],
    &[-14.155_112_264_123_755],
    &[-17.972_960_358_859_52, -2.859_693_295_451_294],
    &[147.121_502_757_117_16, -1.412_214_027_182_13, 71.689_402_513_023_58],
    &[165.435_170_248_716_76, -0.459_282_345_649_112_6, 42.909_383_369_586_03, -5.961_986_721_573_306],
    &[24.854_864_614_690_072, -3.000_922_700_283_218_6, 47.493_111_002_076_8, 5.581_419_782_155_812_5,
      -0.661_069_182_524_947_1],
    &[30.912_732_140_285_99, -3.120_824_334_993_797_4, 77.799_546_460_708_92, 34.286_460_282_947_83,
      -19.097_331_116_725_623, -28.087_943_162_872_662],
    &[37.802_771_233_905_63, -3.257_196_902_907_227_6, 112.269_188_494_963_27, 66.934_723_124_404_7,
      -40.066_189_370_910_02, -54.667_802_628_779_68, -9.488_616_523_096_27],
];
#[rustfmt::skip]
const INNER: [[f64; 8]; 3] = [
    [25.948_786_856_663_858, -2.557_972_484_584_623_5, 10.433_815_404_888_879, -2.367_925_102_268_520_4,
     0.524_948_541_321_073, 1.124_108_831_045_040_4, 0.427_287_619_443_187_4, -0.172_022_210_701_554_93],
    [-9.915_688_506_951_71, -0.968_994_459_411_515_4, 3.043_803_724_297_845_3, -24.495_224_566_215_796,
     20.176_138_334_709_044, 15.980_663_614_246_51, -6.789_040_303_419_874, -6.710_236_069_923_372],
    [11.419_903_575_922_262, 2.887_964_514_613_699_4, 72.921_379_959_960_29, 80.125_118_346_226_43,
     -52.072_871_366_152_654, -59.789_936_252_667_29, -0.155_826_842_827_519_13, 4.883_087_185_713_722],
];

#[cfg(test)]
mod tests;
