//! From an experiment to the linear model of its loop at an instant.
//!
//! The loop is opened, and a short change is put in at each opened signal. What then arrives at all
//! of them is the response of the open loop, which is realised as a model of the fewest states.

use crate::Matrix;
use crate::culprit::culprit;
use crate::flights::{Flights, Pulse, Response};
use crate::margins::rate;
use crate::model::{OpenLoop, Step};
use crate::opening::Opening;
use crate::realisation::{Lags, realise};
use crate::spectrum::dominant;
use cosim::error::Error;
use cosim::interrupt::Interrupt;
use cosim::run::Run;
use cosim::system::System;
use fmi_master::clock::Clock;
use fmi_master::instance::CallFailure;
use fmi_master::quantity::rounded;
use fmu_import::warnings;
use serde::{Deserialize, Serialize};

/// Longest period that is looked for: a time (s), but so many samples at least and at most.
const LONGEST_PERIOD: f64 = 0.25;
const LONGEST: [usize; 2] = [25, 50];
/// Time over which responses are followed at least, s. A delay may be as long.
const LONGEST_TIME: f64 = 1.0;
/// Samples after which the state of a model shows in all that was put in: the number that is tried
/// first, and the largest.
const MEMORY: [usize; 2] = [24, 200];
/// Number of samples, from the first response on, that are compared to find a period.
const COMPARED: usize = 6;
/// Changes that are tried, in relation to the typical magnitude of a signal. A loop that is not
/// smooth needs a small one, and one that iterates a larger one, which also is less rounded.
const CHANGES: [f64; 7] = [1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 1e-8, 1e-9];
/// Change that shows when the loop responds, in relation to the same.
const SHOWS: f64 = 1e-3;
/// Change that shows which component rounds its outputs.
const SMALL: f64 = 1e-7;
/// Largest number of parts of a sample that are told apart.
const PARTS: u64 = 5;
/// Difference of responses, relative to the largest, that counts as none. Differences of periods
/// count as equal if they are in this relation to the least one.
const EQUAL: f64 = 1e-6;
const AS_EQUAL: f64 = 3.0;
/// Difference of the responses of two periods, or to changes of two sizes, relative to the largest,
/// above which there is no linear model.
const REPEATS: f64 = 0.1;
/// Least share of the responses that a state must add.
const SMALLEST: f64 = 1e-9;
/// Error of a model in relation to that of the responses.
const ERRORS: f64 = 10.0;
/// Difference of a model from the responses, relative to the largest, from which on it does not
/// describe them.
const DEVIATES: f64 = 0.02;
/// Factor from the rate of a motion that the responses just show to the one that counts.
const CERTAIN: f64 = 3.0;

/// A linearised loop.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Linearised {
    /// Time of the instant, s.
    pub time: f64,
    /// The open loop.
    pub open: OpenLoop,
    /// The open loop for increases and for decreases of the signals, if these differ.
    pub sides: Option<[OpenLoop; 2]>,
    /// How the model was found.
    pub note: String,
}

/// Linearises runs of a system at one instant.
pub struct Lineariser {
    system: System,
    opening: Opening,
}

/// Linearises an experiment at `time` (s), with the loop opened at signals that are named as
/// `component.variable` or `component.prefix.*`: connected inputs, or outputs with all their
/// connections.
///
/// # Errors
/// Returns the errors of [`Lineariser::new`] and [`Lineariser::linearise`].
pub fn linearise(
    system: System,
    time: f64,
    open: &[String],
    interrupt: &Interrupt,
) -> Result<Linearised, Error> {
    let lineariser = Lineariser::new(system, time, open)?;
    let collection = warnings::collect();
    let mut run = lineariser.system.start(interrupt)?;
    let found = lineariser.linearise(&mut run);
    drop(collection);
    found
}

/// What a trial shows of a loop.
struct Trial {
    /// Change with the most exact responses, in relation to the typical magnitudes.
    change: f64,
    /// Number of samples after which the responses repeat.
    period: usize,
    /// Difference of the responses of two periods, relative to the largest.
    drift: f64,
}

/// A model, and how far it is from the responses, relative to the largest.
struct Realised {
    found: Linearised,
    deviation: f64,
    /// Deviation that the error of the responses explains.
    expected: f64,
}

impl Lineariser {
    /// Prepares a system to be linearised at `time` (s), with the loop opened at these signals.
    ///
    /// # Errors
    /// Returns an error if the time is not a communication point, or if a signal is not connected.
    pub fn new(mut system: System, time: f64, open: &[String]) -> Result<Self, Error> {
        let opening = Opening::new(&mut system, time, open)?;
        let (start, step) = (system.clock.start(), system.clock.step());
        let sample = LONGEST_PERIOD.max(opening.held as f64 * step);
        let samples = 2 * LONGEST[1] + 2 * MEMORY[1] + COMPARED;
        // No step that is repeated reaches the stop time, so that all of them are whole.
        let stop = system.clock.time(opening.first) + samples as f64 * sample + LONGEST_TIME;
        system.clock = Clock::new(start, start + ((stop - start) / step).ceil() * step, step)
            .map_err(Error::experiment)?;
        Ok(Self { system, opening })
    }

    /// Returns the system, from which runs are started.
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Linearises a run of the system after its initialisation.
    ///
    /// # Errors
    /// Returns an error if an instance fails or keeps no states, if the loop does not respond, or
    /// has no linear model, or if the run was asked to end.
    pub fn linearise(&self, run: &mut Run) -> Result<Linearised, Error> {
        let model = |run: &mut Run| {
            let first = self.opening.first;
            for tick in 0..first {
                run.advance(tick)?;
            }
            let _silence = warnings::silence();
            self.model(&mut Flights::new(&self.opening, run, first)?)
        };
        model(run).map_err(|error| match error {
            Error::EndedByInstance { component, time, message } => {
                let message = format!("{message}, but a linear model needs its motion beyond");
                Error::Call { component, time, failure: CallFailure::answer("linearise", message) }
            }
            error => error,
        })
    }

    fn model(&self, flights: &mut Flights) -> Result<Linearised, Error> {
        self.find_sample(flights)?;
        let trial = self.trial(flights)?;
        let mut memory = MEMORY[0].max(2 * trial.period);
        let mut best = self.realised(flights, &trial, memory)?;
        // The memory of a loop takes as many samples to show as it is long.
        while best.deviation > best.expected && memory < MEMORY[1] {
            memory = (2 * memory).min(MEMORY[1]);
            let next = self.realised(flights, &trial, memory)?;
            if next.deviation < best.deviation {
                best = next;
            }
        }
        let unstable = self.is_unstable(&best.found.open);
        // An unstable loop leaves the instant fast, and needs no exact model.
        let most = if matches!(unstable, Ok(true)) { REPEATS } else { DEVIATES };
        if best.deviation > most {
            let problem = format!(
                "a linear model is {:.0} % off the response to a change: its samples of {} s show too little of the motion, or the loop changes meanwhile",
                1e2 * best.deviation,
                rounded(self.sampling(flights))
            );
            return Err(self.failure_in(flights, problem));
        }
        unstable?;
        Ok(best.found)
    }

    /// Realises a model of the loop from responses in which the changes of the last samples count.
    fn realised(
        &self,
        flights: &mut Flights,
        trial: &Trial,
        memory: usize,
    ) -> Result<Realised, Error> {
        let Trial { change, period, drift } = *trial;
        let sampling = self.sampling(flights);
        let count = window(sampling).max(2 * memory);
        flights.record(period + count, period)?;
        let phases = self.responses(flights, trial, count)?;
        let lags = |of: &dyn Fn(&Response) -> &Matrix| -> Vec<Lags> {
            phases.iter().map(|phase| joined(phase, of)).collect()
        };
        let central = lags(&|response| &response.central);
        let largest = largest(&central);
        if largest == 0.0 {
            return Err(self.silent(flights, count));
        }
        let all = || phases.iter().flatten();
        let noise = all().map(|one| one.error / largest).fold(0.0, f64::max);
        if noise > DEVIATES {
            let problem =
                format!("responses to changes of different sizes differ by {:.0} %", 1e2 * noise);
            return Err(self.failure_in(flights, problem));
        }
        let tolerance = SMALLEST.max(drift).max(noise);
        let steps = realise(&central, memory, tolerance);
        let deviation = deviation(&steps, &central) / largest;
        // A loop that changes from period to period has changed by the sum at the end.
        let error = (ERRORS * noise).max(drift * (count / period) as f64);
        // A motion of the rate s differs from none by about (s t)²/2 after the time t.
        let seen = 2.0 * error.max(deviation).max(SMALLEST);
        let slowest = CERTAIN * seen.sqrt() / (count as f64 * sampling);
        let open = |steps: &[Step]| OpenLoop::new(steps, &self.opening.signals, sampling, slowest);
        let side = |side: usize| {
            open(&realise(&lags(&|response| &response.sides[side]), memory, tolerance))
        };
        let has_edge = all().any(|response| response.has_edge);
        let repeats = if period == 1 {
            String::new()
        } else {
            format!(", which repeat after {period} of them")
        };
        let note = format!(
            "responses to changes of {change:.0e} of the typical magnitudes, for {count} samples of {} s{repeats}; their relative error is {:.0e}, that of the model {deviation:.0e}",
            rounded(sampling),
            noise.max(drift)
        );
        let found = Linearised {
            time: self.system.clock.time(self.opening.first),
            open: open(&steps),
            sides: has_edge.then(|| [side(0), side(1)]),
            note,
        };
        Ok(Realised { found, deviation, expected: EQUAL.max(error) })
    }

    /// Finds the communication points between which nothing that arrives changes, because a
    /// controller samples. Samples then begin and end with these.
    fn find_sample(&self, flights: &mut Flights) -> Result<(), Error> {
        let step = self.sampling(flights);
        let longest = (LONGEST_PERIOD / step + 1e-9) as usize;
        if longest < 2 {
            return Ok(());
        }
        let count = window(step) + 4 * longest;
        flights.record(count, 0)?;
        let response = flights.fly(Pulse::whole(0), &self.direction(SHOWS), count)?;
        let least = EQUAL * response.amax();
        let changes: Vec<usize> = (1..count)
            .filter(|lag| (response.column(*lag) - response.column(lag - 1)).amax() > least)
            .collect();
        let [begin, _, _, ..] = changes[..] else { return Ok(()) };
        let divides =
            |group: &usize| changes.iter().all(|lag| (lag - begin).is_multiple_of(*group));
        let group = (1..=longest).rev().find(divides).unwrap_or(1);
        let held = self.opening.held;
        flights.resample((begin % group) as u64 * held, group as u64 * held)
    }

    /// Finds the change with the most exact responses, and the period of the loop.
    fn trial(&self, flights: &mut Flights) -> Result<Trial, Error> {
        let sampling = self.sampling(flights);
        let longest = ((LONGEST_PERIOD / sampling + 1e-9) as usize).clamp(LONGEST[0], LONGEST[1]);
        flights.record(2 * longest + window(sampling), 2 * longest)?;
        let (at, begin) = self.first_response(flights, longest, window(sampling))?;
        let count = begin + COMPARED;
        let mut best = (CHANGES[0], f64::INFINITY);
        for change in CHANGES {
            let (pulse, direction) = (Pulse::whole(at), self.direction(1.0));
            // A component may refuse a large change.
            let tried = flights.response(pulse, &direction, change, window(sampling));
            let Ok(response) = tried else { continue };
            let error = response.error / response.central.amax().max(f64::MIN_POSITIVE);
            if error < best.1 {
                best = (change, error);
            }
            if error <= EQUAL {
                break;
            }
        }
        let change = best.0;
        let (mut responses, mut drifts): (Vec<Matrix>, Vec<f64>) = (Vec::new(), Vec::new());
        while drifts.last().is_none_or(|drift| *drift > EQUAL) && drifts.len() < longest {
            let period = drifts.len() + 1;
            for sample in responses.len()..longest + period {
                let (pulse, direction) = (Pulse::whole(sample), self.direction(1.0));
                let [more, less] = flights.difference(pulse, &direction, change, count)?;
                responses.push((more + less) * 0.5);
            }
            let largest = responses.iter().map(Matrix::amax).fold(f64::MIN_POSITIVE, f64::max);
            let pairs = responses.iter().zip(&responses[period..]);
            drifts.push(pairs.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max) / largest);
        }
        let least = drifts.iter().copied().fold(f64::INFINITY, f64::min);
        let equal = EQUAL.max(AS_EQUAL * least);
        let place = drifts.iter().position(|drift| *drift <= equal).unwrap_or(0);
        let drift = drifts[place];
        if drift > REPEATS {
            let problem = format!(
                "responses to a change do not repeat within {longest} steps of {} s, but differ by {:.0} %: the loop has no linear model here, or a longer period",
                rounded(sampling),
                1e2 * drift
            );
            return Err(self.failure_in(flights, problem));
        }
        Ok(Trial { change, period: place + 1, drift })
    }

    /// Finds a sample at which the loop responds to a change, and the lag at which all signals do
    /// that respond. A component may look at its inputs at some samples only.
    fn first_response(
        &self,
        flights: &mut Flights,
        longest: usize,
        count: usize,
    ) -> Result<(usize, usize), Error> {
        for sample in 0..longest {
            let response = flights.fly(Pulse::whole(sample), &self.direction(SHOWS), count)?;
            let begins = response.row_iter().filter_map(|row| row.iter().position(|by| *by != 0.0));
            if let Some(begin) = begins.max() {
                return Ok((sample, begin));
            }
        }
        Err(self.silent(flights, count))
    }

    /// Returns the error of a loop that does not respond within so many samples.
    fn silent(&self, flights: &mut Flights, count: usize) -> Error {
        let problem = format!(
            "the loop does not respond to a change of {} within {} s",
            self.opening.signals[0].name,
            rounded(count as f64 * self.sampling(flights))
        );
        self.failure_in(flights, problem)
    }

    /// Takes the responses at each sample of a period: to a change of each signal in its first part,
    /// then in its second, and so on.
    fn responses(
        &self,
        flights: &mut Flights,
        trial: &Trial,
        count: usize,
    ) -> Result<Vec<Vec<Response>>, Error> {
        let channels = self.opening.signals.len();
        let steps = flights.ticks / self.opening.held;
        // A loop with a period of several samples would take long.
        let most = if trial.period == 1 { PARTS } else { 1 };
        let parts = (1..=most).rev().find(|parts| steps.is_multiple_of(*parts)).unwrap_or(1);
        let mut one = |sample: usize, change: usize| {
            let mut direction = vec![0.0; channels];
            direction[change % channels] = 1.0;
            let pulse = Pulse { sample, part: (change / channels) as u64, parts };
            flights.response(pulse, &direction, trial.change, count)
        };
        let changes = parts as usize * channels;
        let mut phase = |sample| (0..changes).map(|change| one(sample, change)).collect();
        (0..trial.period).map(&mut phase).collect()
    }

    /// Returns a change of all signals at a time, by different multiples of their typical
    /// magnitudes.
    fn direction(&self, change: f64) -> Vec<f64> {
        (0..self.opening.signals.len()).map(|signal| change / (1.0 + 0.3 * signal as f64)).collect()
    }

    /// Returns the time between two samples, s.
    fn sampling(&self, flights: &Flights) -> f64 {
        flights.ticks as f64 * self.system.clock.step()
    }

    /// Returns whether the closed loop is unstable.
    ///
    /// # Errors
    /// Returns an error if the responses do not show it.
    fn is_unstable(&self, open: &OpenLoop) -> Result<bool, Error> {
        let closed = open.closed(&vec![1.0; open.channels()]);
        let Some(eigenvalue) = closed.map(|a| dominant(&a)) else { return Ok(true) };
        let rate = rate(eigenvalue, open);
        if eigenvalue.norm() < 1.0 || rate > open.slowest {
            return Ok(eigenvalue.norm() >= 1.0);
        }
        Err(self.failure(format!(
            "the stability of the loop is undecided, because the error of the responses hides a motion of {rate:.1e}/s"
        )))
    }

    /// Returns an error that names the component because of which there is no linear model, if
    /// there is one.
    fn failure_in(&self, flights: &mut Flights, problem: String) -> Error {
        let count = window(self.sampling(flights));
        let changes = [SMALL, 0.5 * CHANGES[0], CHANGES[0]].map(|change| self.direction(change));
        match culprit(&self.opening, flights, &changes, count) {
            Ok(Some((component, why))) => self.failure_of(component, format!("{problem}; {why}")),
            Ok(None) => self.failure(problem),
            Err(error) => error,
        }
    }

    fn failure(&self, message: String) -> Error {
        self.failure_of(self.opening.receivers[0].port.component, message)
    }

    fn failure_of(&self, component: usize, message: String) -> Error {
        let component = self.system.components[component].name.clone();
        let time = self.system.clock.time(self.opening.first);
        Error::Call { component, time, failure: CallFailure::answer("linearise", message) }
    }
}

/// Returns the number of samples for which responses are followed at least.
fn window(sampling: f64) -> usize {
    (LONGEST_TIME / sampling).ceil() as usize + 2 * COMPARED
}

/// Joins the responses of all signals to each change, one matrix for each lag.
fn joined(phase: &[Response], of: &dyn Fn(&Response) -> &Matrix) -> Lags {
    let columns: Vec<&Matrix> = phase.iter().map(of).collect();
    (0..columns[0].ncols())
        .map(|lag| {
            let rows = columns[0].nrows();
            Matrix::from_fn(rows, columns.len(), |row, by| columns[by][(row, lag)])
        })
        .collect()
}

/// Returns how far the responses of a model are from those that it was made of.
fn deviation(steps: &[Step], phases: &[Lags]) -> f64 {
    let mut largest = 0.0_f64;
    for (phase, lags) in phases.iter().enumerate() {
        let mut state = steps[phase].b.clone();
        for (lag, given) in lags.iter().enumerate().skip(1) {
            let Step { a, c, .. } = &steps[(phase + lag) % steps.len()];
            largest = largest.max((c * &state - given).amax());
            state = a * &state;
        }
    }
    largest
}

/// Returns the largest response.
fn largest(phases: &[Lags]) -> f64 {
    phases.iter().flatten().map(Matrix::amax).fold(0.0, f64::max)
}
