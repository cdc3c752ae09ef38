//! Flights from one kept state, with the loop opened.

use crate::Matrix;
use crate::opening::Opening;
use cosim::error::Error;
use cosim::run::Run;

/// Share of the difference between the slopes to both sides that is left when the change is halved,
/// above which there is an edge. A smooth loop leaves a half, one with an edge all of it.
const FALLS: f64 = 0.75;
/// Difference of the slopes to both sides, relative to the largest slope, below which it does not
/// count; and the same in relation to the error of the slopes.
const LEVEL: f64 = 1e-3;
const ERRORS: f64 = 10.0;

/// Responses of all signals to a change at one sample, in typical magnitudes: signals by lags.
pub(crate) struct Response {
    /// Response by central differences.
    pub(crate) central: Matrix,
    /// Responses to an increase and to a decrease.
    pub(crate) sides: [Matrix; 2],
    /// Whether these two differ.
    pub(crate) has_edge: bool,
    /// Error of the central differences.
    pub(crate) error: f64,
}

/// When signals change: in one of the equal parts of a sample whose state is kept. Without parts,
/// they change from there on.
#[derive(Clone, Copy)]
pub(crate) struct Pulse {
    pub(crate) sample: usize,
    pub(crate) part: u64,
    pub(crate) parts: u64,
}

impl Pulse {
    /// For a whole sample.
    pub(crate) fn whole(sample: usize) -> Self {
        Self { sample, part: 0, parts: 1 }
    }
}

/// Flies on from the instant at which a run stands.
///
/// All receivers of the opened signals get the values that they had in the closed loop, which was
/// recorded before, and in one sample, or a part of it, the change in addition.
pub(crate) struct Flights<'a> {
    opening: &'a Opening,
    run: &'a mut Run,
    /// Communication point at which the first sample begins, and number of them in a sample.
    pub(crate) first: u64,
    pub(crate) ticks: u64,
    /// Values that each receiver has at each communication point of the closed loop.
    recorded: Vec<Vec<f64>>,
}

impl<'a> Flights<'a> {
    /// Keeps the state of a run that stands at its communication point `first`.
    pub(crate) fn new(opening: &'a Opening, run: &'a mut Run, first: u64) -> Result<Self, Error> {
        let ticks = opening.held;
        let mut flights = Self { opening, run, first, ticks, recorded: Vec::new() };
        flights.keep(0, first)?;
        Ok(flights)
    }

    /// Lets samples begin `later` ticks after the instant, and last for so many `ticks`.
    pub(crate) fn resample(&mut self, later: u64, ticks: u64) -> Result<(), Error> {
        self.go_back(0, self.first)?;
        for tick in self.first..self.first + later {
            self.run.advance(tick)?;
        }
        (self.first, self.ticks) = (self.first + later, ticks);
        self.keep(0, self.first)
    }

    /// Flies `samples` with the loop closed, and keeps the states at the first ones.
    pub(crate) fn record(&mut self, samples: usize, kept: usize) -> Result<(), Error> {
        self.go_back(0, self.first)?;
        self.recorded.clear();
        for place in 0..samples as u64 * self.ticks {
            let (sample, tick) = (place / self.ticks, self.first + place);
            if place.is_multiple_of(self.ticks) && sample < kept as u64 {
                self.keep(sample as usize, tick)?;
            }
            // Opens the inputs, which get what arrives there.
            self.arrived();
            self.run.advance(tick)?;
            let arrived = self.arrived();
            self.recorded.push(arrived);
        }
        Ok(())
    }

    /// Flies `count` samples with the loop opened, the first being that of the pulse, in which each
    /// signal changes by a multiple of its typical magnitude. Returns the changes that arrive at
    /// each signal, signals by samples.
    pub(crate) fn fly(
        &mut self,
        pulse: Pulse,
        change: &[f64],
        count: usize,
    ) -> Result<Matrix, Error> {
        self.fly_seen(pulse, change, count, |_| ())
    }

    /// Flies as [`Self::fly`] does, and shows the probed values of each communication point.
    pub(crate) fn fly_seen(
        &mut self,
        pulse: Pulse,
        change: &[f64],
        count: usize,
        mut see: impl FnMut(&[f64]),
    ) -> Result<Matrix, Error> {
        let Opening { signals, receivers, seen, .. } = self.opening;
        let begin = pulse.sample as u64 * self.ticks;
        self.go_back(pulse.sample, self.first + begin)?;
        let mut response = Matrix::zeros(signals.len(), count);
        for tick in 0..count as u64 * self.ticks {
            let recorded = &self.recorded[(begin + tick) as usize];
            for (receiver, recorded) in receivers.iter().zip(recorded) {
                let size = receiver.factor * signals[receiver.signal].size;
                let is_changed = tick * pulse.parts / self.ticks == pulse.part;
                let by = if is_changed { change[receiver.signal] * size } else { 0.0 };
                self.run.master.opened(receiver.port).given = Some(recorded + by);
            }
            see(self.run.advance(self.first + begin + tick)?);
            if !tick.is_multiple_of(self.ticks) {
                continue;
            }
            for (row, place) in seen.iter().enumerate() {
                let receiver = &receivers[*place];
                let by = self.run.master.opened(receiver.port).arrived - recorded[*place];
                let lag = (tick / self.ticks) as usize;
                response[(row, lag)] = by / (receiver.factor * signals[row].size);
            }
        }
        for receiver in receivers {
            self.run.master.opened(receiver.port).given = None;
        }
        Ok(response)
    }

    /// Returns the mean response to a change and to its opposite, per change.
    pub(crate) fn difference(
        &mut self,
        pulse: Pulse,
        direction: &[f64],
        change: f64,
        count: usize,
    ) -> Result<[Matrix; 2], Error> {
        let mut by = |change: f64| {
            let changes: Vec<f64> = direction.iter().map(|share| share * change).collect();
            Ok::<_, Error>(self.fly(pulse, &changes, count)? / change)
        };
        Ok([by(change)?, by(-change)?])
    }

    /// Takes the responses to changes of these signals by ±δ and by ±δ/2. The central differences
    /// of both, extrapolated to δ = 0 (Richardson), leave an error of the order δ⁴. Where there is
    /// no derivative, as at the edge of a constraint, the slopes to both sides do not come closer
    /// as δ falls.
    pub(crate) fn response(
        &mut self,
        pulse: Pulse,
        direction: &[f64],
        change: f64,
        count: usize,
    ) -> Result<Response, Error> {
        let [more, less] = self.difference(pulse, direction, change, count)?;
        let [more_half, less_half] = self.difference(pulse, direction, 0.5 * change, count)?;
        let (mean, mean_half) = ((&more + &less) * 0.5, (&more_half + &less_half) * 0.5);
        let central = (&mean_half * 4.0 - &mean) / 3.0;
        let error = (mean_half - mean).amax() / 3.0;
        let [bend, bend_half] = [more - less, &more_half - &less_half].map(|m| m.amax());
        let counts = (LEVEL * central.amax()).max(ERRORS * error);
        let has_edge = bend_half > FALLS * bend && bend_half > counts;
        Ok(Response { central, sides: [more_half, less_half], has_edge, error })
    }

    /// Returns what arrived at each receiver at the last communication point.
    fn arrived(&mut self) -> Vec<f64> {
        let receivers = self.opening.receivers.iter();
        receivers.map(|receiver| self.run.master.opened(receiver.port).arrived).collect()
    }

    fn keep(&mut self, number: usize, tick: u64) -> Result<(), Error> {
        Ok(self.run.master.keep(number, self.run.master.clock().time(tick))?)
    }

    fn go_back(&mut self, number: usize, tick: u64) -> Result<(), Error> {
        Ok(self.run.master.go_back(number, self.run.master.clock().time(tick))?)
    }
}
