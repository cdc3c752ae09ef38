//! Frequency responses: those of the linear model, and those that the nonlinear loop shows when a
//! sine is added at an opened signal.

use crate::Matrix;
use crate::linearise::{Linearised, Lineariser};
use crate::margins::disk::sensitivity;
use crate::model::OpenLoop;
use crate::realisation::least_squares;
use crate::spectrum::spectral_radius;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::system::System;
use fmi_master::clock::Clock;
use fmi_master::quantity::rounded;
use std::f64::consts::TAU;

/// Share of a transient that is left when the response is taken, and the longest wait for it, s.
const LEFT: f64 = 1e-6;
const LONGEST: f64 = 300.0;
/// Number of periods of the sine, and least number of periods of the loop, over which the response
/// is taken: frequencies that the loop mixes may be close to one another.
const PERIODS: f64 = 4.0;
const LOOP_PERIODS: f64 = 60.0;

/// A complex number.
pub type Complex = nalgebra::Complex<f64>;

/// Response of a loop at a frequency.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Frequency, rad/s.
    pub frequency: f64,
    /// Return ratio L that the loop showed in flight.
    pub measured: Complex,
    /// Return ratio L of the linear model.
    pub predicted: Complex,
}

/// Returns the return ratio L at one signal while the loops of the others are closed, at a
/// frequency (rad/s). It follows from the sensitivity S = 1/(1 + L).
pub fn return_ratio(open: &OpenLoop, channel: usize, frequency: f64) -> Complex {
    sensitivity(open, frequency)[(channel, channel)].inv() - 1.0
}

/// Adds a sine of this frequency (rad/s) and amplitude at an opened input, waits until the
/// transient is gone, and compares what the component then receives with what was added: their
/// ratio is S. A run without the sine is subtracted.
///
/// # Errors
/// Returns an error if the signal is no input, if the loop is unstable, if an instance fails, or if
/// the run was asked to end.
pub fn measure(
    lineariser: &Lineariser,
    found: &Linearised,
    channel: usize,
    frequency: f64,
    amplitude: f64,
    interrupt: &Interrupt,
) -> Result<Point, Error> {
    let open = &found.open;
    let input = lineariser.opened()[channel];
    let mut system = lineariser.system().clone();
    if system.variable_at(input).causality != "input" {
        let name = &open.signals[channel].name;
        return Err(Error::experiment(format!(
            "--open {name}: the sine must be added at an input, but this is an output"
        )));
    }
    let step = system.clock.step();
    let radius = open.closed(&vec![1.0; open.channels()]).map_or(1.0, |a| spectral_radius(&a));
    if radius >= 1.0 {
        let time = lineariser.system().clock.time(lineariser.first());
        let time = rounded(time);
        let problem = format!("the loop is unstable at t = {time} s, so that it has no response");
        return Err(Error::experiment(problem));
    }
    let settling = (LEFT.ln() / radius.ln() * open.period).clamp(0.0, LONGEST);
    let wait = (settling / step).ceil() as u64;
    let window = (PERIODS * TAU / frequency).max(LOOP_PERIODS * open.period);
    let count = (window / step).ceil() as u64;
    let last = lineariser.first() + wait + count;
    let start = system.clock.start();
    // No step begins at the stop time.
    let stop = start + (last + 1) as f64 * step;
    system.clock = Clock::new(start, stop, step).map_err(Error::experiment)?;
    let place = system.probe(&system.name(input)).map_err(Error::experiment)?.place;
    // The model holds its inputs from sample to sample.
    let held = (open.sampling() / step).round().max(1.0) as u64;
    let sine = |tick: u64| {
        let since = (tick - lineariser.first()) / held * held;
        amplitude * (frequency * since as f64 * step).sin()
    };
    let fly = |system: &System, adds: bool| {
        let mut run = system.start(interrupt)?;
        let mut received = Vec::new();
        for tick in 0..=last {
            if adds && tick >= lineariser.first() {
                run.master.add(input, sine(tick));
            }
            let value = run.advance(tick)?[place];
            if tick >= last - count {
                received.push(value);
            }
        }
        Ok::<Vec<f64>, Error>(received)
    };
    let (with, without) = (fly(&system, true)?, fly(&system, false)?);
    // Between samples the sine is held, which has images at other frequencies.
    let sampled: Vec<usize> = (0..with.len())
        .filter(|place| (last - count + *place as u64 - lineariser.first()).is_multiple_of(held))
        .collect();
    let time = |place: usize| (last - count + place as u64 - lineariser.first()) as f64 * step;
    let mixed: Vec<f64> =
        (0..open.samples).map(|k| frequency + TAU * k as f64 / open.period).collect();
    let times: Vec<f64> = sampled.iter().map(|place| time(*place)).collect();
    let received = sampled.iter().map(|place| with[*place] - without[*place]).collect();
    let put_in = sampled.iter().map(|place| sine(last - count + *place as u64)).collect();
    let [response, added] =
        [received, put_in].map(|values: Vec<f64>| first_of(&mixed, &times, &values));
    let measured = (response / added).inv() - 1.0;
    Ok(Point { frequency, measured, predicted: return_ratio(open, channel, frequency) })
}

/// Fits values at these times (s) by a constant and a sine of each frequency (rad/s). Returns the
/// complex amplitude of the first.
fn first_of(frequencies: &[f64], times: &[f64], values: &[f64]) -> Complex {
    let columns = 1 + 2 * frequencies.len();
    let matrix = Matrix::from_fn(times.len(), columns, |row, column| {
        let angle = |place: usize| frequencies[place / 2] * times[row];
        match column.checked_sub(1) {
            None => 1.0,
            Some(place) if place.is_multiple_of(2) => angle(place).cos(),
            Some(place) => -angle(place).sin(),
        }
    });
    let fit = least_squares(matrix, &Matrix::from_column_slice(times.len(), 1, values));
    Complex::new(fit[(1, 0)], fit[(2, 0)])
}
