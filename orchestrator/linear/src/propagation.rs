//! The master's algorithm on matrices: every value is a row of factors, by which it follows from
//! the states at the beginning of a period and from what is put in at the opened signals.
//!
//! The order of the calls is that of [`cosim::master`], so that the delays are those of a run.

use crate::Matrix;
use crate::model::{OpenLoop, Signal, Step};
use crate::reduction::{held, reduced};
use crate::units::{Dynamics, Unit};
use cosim::delay::Reading;
use cosim::experiment::Coupling;

/// A connection between units, by places of units and of their outputs and inputs.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Unit and output that it comes from.
    pub from: (usize, usize),
    /// Unit and input that it goes to.
    pub to: (usize, usize),
    /// Factor on the way.
    pub factor: f64,
    /// When the output is read.
    pub reading: Reading,
    /// Opened signal that the connection carries.
    pub opened: Option<usize>,
}

/// The units of a loop with their connections.
#[derive(Clone, Debug)]
pub struct Net {
    /// Units, in the order in which they are stepped.
    pub units: Vec<Unit>,
    /// Connections.
    pub links: Vec<Link>,
    /// Way in which values are passed on.
    pub coupling: Coupling,
    /// Communication point at which the period begins.
    pub first: u64,
    /// Length of a communication step, s.
    pub length: f64,
    /// The opened signals.
    pub signals: Vec<Signal>,
}

/// A delay that is put into the closed loop at opened signals.
#[derive(Clone, Copy, Debug)]
pub struct Delay {
    /// The signal that is delayed; `None` for all.
    pub channel: Option<usize>,
    /// Number of whole steps of the units that receive them.
    pub steps: usize,
    /// Part of a further step. It must be zero unless all these units are continuous.
    pub part: f64,
}

fn lcm(a: u64, b: u64) -> u64 {
    let gcd = |mut a: u64, mut b: u64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    a / gcd(a, b) * b
}

impl Unit {
    /// Returns the number of communication points after which the unit repeats itself.
    fn period(&self) -> u64 {
        let steps = match &self.dynamics {
            Dynamics::Continuous(_) => 1,
            Dynamics::Sampled(steps) => steps.len() as u64,
        };
        self.every * steps
    }

    /// Returns the place of the step that begins at a communication point, or that was the last
    /// one before it.
    fn phase(&self, tick: u64) -> usize {
        let Dynamics::Sampled(steps) = &self.dynamics else { return 0 };
        let count = steps.len() as u64;
        // Less than one of its steps lies between the beginning of the loop's period and the first
        // step of the unit's.
        let steps = (tick + self.every * count - self.first) / self.every;
        (steps % count) as usize
    }

    /// Returns the number of states that the unit has before a communication point.
    fn states_at(&self, tick: u64) -> usize {
        match &self.dynamics {
            Dynamics::Continuous(system) => system.a.nrows(),
            Dynamics::Sampled(steps) if tick.is_multiple_of(self.every) => {
                steps[self.phase(tick)].a.ncols()
            }
            Dynamics::Sampled(steps) => steps[self.phase(tick)].a.nrows(),
        }
    }

    /// Returns whether the outputs follow from the states alone.
    fn shows_states(&self) -> bool {
        matches!(&self.dynamics, Dynamics::Continuous(system) if system.d.amax() == 0.0)
    }

    fn name_of(&self, state: usize) -> String {
        let known = self.states.get(state).cloned();
        let name = known.unwrap_or_else(|| format!("memory[{}]", state + 1));
        format!("{}.{name}", self.name)
    }
}

/// All values as rows of factors.
struct Rows<'a> {
    net: &'a Net,
    columns: usize,
    states: Vec<Matrix>,
    latest: Vec<Matrix>,
    before: Vec<Matrix>,
    /// What arrives at each opened signal.
    arriving: Matrix,
    /// Where what is put in at a communication point begins among the columns; `None` if the loop
    /// is closed.
    put_in: Option<usize>,
    delay: Option<Delay>,
    /// What arrived at the opened signals at the last steps, the newest first.
    queue: Vec<Matrix>,
    /// The opened signals that have arrived since the last communication point.
    arrived: Vec<bool>,
}

impl Net {
    /// Returns the number of communication points of the common period.
    pub fn period(&self) -> u64 {
        self.units.iter().map(Unit::period).fold(1, lcm)
    }

    /// Returns whether every unit that receives an opened signal is continuous, so that a delay
    /// may be any part of a step.
    pub fn takes_parts(&self) -> bool {
        let mut targets = self.links.iter().filter(|link| link.opened.is_some());
        targets.all(|link| matches!(self.units[link.to.0].dynamics, Dynamics::Continuous(_)))
    }

    /// Returns the time between two steps of the units that receive opened signals, s.
    pub fn receiving_step(&self) -> f64 {
        let targets = self.links.iter().filter(|link| link.opened.is_some());
        let every = targets.map(|link| self.units[link.to.0].every).max().unwrap_or(1);
        every as f64 * self.length
    }

    /// Returns the open loop.
    pub fn open(&self) -> OpenLoop {
        let channels = self.signals.len();
        let ticks = self.period();
        let (mut rows, names) = Rows::start(self, ticks as usize * channels, None);
        let states = names.len();
        let mut arriving = Vec::new();
        for tick in 0..ticks {
            rows.put_in = Some(states + tick as usize * channels);
            rows.round(self.first + tick);
            arriving.push(rows.arriving.clone());
        }
        let end = rows.end();
        let after = end.columns(0, states).into_owned();
        let stacked = |from: usize, count: usize| {
            let mut all = Matrix::zeros(arriving.len() * channels, count);
            for (tick, rows) in arriving.iter().enumerate() {
                all.rows_mut(tick * channels, channels).copy_from(&rows.columns(from, count));
            }
            all
        };
        let inputs = ticks as usize * channels;
        let step = Step {
            a: after,
            b: end.columns(states, inputs).into_owned(),
            c: stacked(0, states),
            d: stacked(states, inputs),
        };
        let (step, samples) = held(step, ticks as usize, channels);
        let (step, kept) = reduced(step);
        OpenLoop {
            step,
            period: ticks as f64 * self.length,
            samples,
            signals: self.signals.clone(),
            states: kept.into_iter().map(|state| names[state].clone()).collect(),
        }
    }

    /// Returns the matrix A of the closed loop over its period, with a delay.
    pub fn closed(&self, delay: Delay) -> Matrix {
        let (mut rows, names) = Rows::start(self, 0, Some(delay));
        let ticks = self.period();
        for tick in 0..ticks {
            rows.round(self.first + tick);
        }
        let end = rows.end();
        let a = end.columns(0, names.len()).into_owned();
        let none = |rows, columns| Matrix::zeros(rows, columns);
        let step = Step { b: none(a.nrows(), 0), c: none(0, a.ncols()), d: none(0, 0), a };
        // What nothing depends on cannot make the loop unstable.
        let Step { a, .. } = step;
        let kept: Vec<usize> = (0..a.ncols()).filter(|i| a.column(*i).amax() > 0.0).collect();
        a.select_rows(&kept).select_columns(&kept)
    }
}

impl<'a> Rows<'a> {
    /// Begins a period. Returns the names of the states.
    fn start(net: &'a Net, inputs: usize, delay: Option<Delay>) -> (Self, Vec<String>) {
        let mut names = Vec::new();
        let mut sizes = Vec::new();
        for unit in &net.units {
            let count = unit.states_at(net.first);
            names.extend((0..count).map(|state| unit.name_of(state)));
            let outputs = if unit.shows_states() { 0 } else { unit.outputs.len() };
            for kind in ["held", "held before"] {
                names.extend(
                    (0..outputs)
                        .map(|place| format!("{}.output[{}] ({kind})", unit.name, place + 1)),
                );
            }
            // A connection may read what was there before the last step.
            sizes.push((count, outputs));
        }
        let channels = net.signals.len();
        let queued = delay.map_or(0, |delay| delay.steps + 1);
        for age in 0..queued {
            names.extend(
                (0..channels).map(|c| format!("{} ({} steps ago)", net.signals[c].name, age + 1)),
            );
        }
        let columns = names.len() + inputs;
        let mut next = 0;
        let mut unity = |count: usize| {
            let mut rows = Matrix::zeros(count, columns);
            for row in 0..count {
                rows[(row, next + row)] = 1.0;
            }
            next += count;
            rows
        };
        let (mut states, mut latest, mut before) = (Vec::new(), Vec::new(), Vec::new());
        for (unit, (count, outputs)) in net.units.iter().zip(sizes) {
            states.push(unity(count));
            if let (Dynamics::Continuous(system), true) = (&unit.dynamics, unit.shows_states()) {
                let shown = &system.c * &states[states.len() - 1];
                latest.push(shown.clone());
                before.push(shown);
            } else {
                latest.push(unity(outputs));
                before.push(unity(outputs));
            }
        }
        let queue = (0..queued).map(|_| unity(channels)).collect();
        let arriving = Matrix::zeros(channels, columns);
        let arrived = vec![false; channels];
        let rows = Self {
            net,
            columns,
            states,
            latest,
            before,
            arriving,
            put_in: None,
            delay,
            queue,
            arrived,
        };
        (rows, names)
    }

    /// Returns the rows of all states at the end of the period, in the order of the names.
    fn end(self) -> Matrix {
        let mut parts: Vec<Matrix> = Vec::new();
        for (place, unit) in self.net.units.iter().enumerate() {
            parts.push(self.states[place].clone());
            if !unit.shows_states() {
                parts.push(self.latest[place].clone());
                parts.push(self.before[place].clone());
            }
        }
        parts.extend(self.queue);
        let mut all = Matrix::zeros(parts.iter().map(Matrix::nrows).sum(), self.columns);
        let mut next = 0;
        for part in parts {
            all.rows_mut(next, part.nrows()).copy_from(&part);
            next += part.nrows();
        }
        all
    }

    fn round(&mut self, tick: u64) {
        let net = self.net;
        let begins = |unit: &Unit| tick.is_multiple_of(unit.every);
        self.arrived.fill(false);
        for (place, unit) in net.units.iter().enumerate() {
            if begins(unit) {
                self.before[place] = self.latest[place].clone();
            }
        }
        let units = net.units.iter().enumerate().filter(|(_, unit)| begins(unit));
        match net.coupling {
            Coupling::Sequential => {
                for (place, _) in units {
                    let inputs = self.gather(place);
                    self.step(place, tick, &inputs);
                }
            }
            Coupling::Jacobi => {
                let gathered: Vec<_> =
                    units.map(|(place, _)| (place, self.gather(place))).collect();
                for (place, inputs) in gathered {
                    self.step(place, tick, &inputs);
                }
            }
        }
        if self.delay.is_some() && self.arrived.contains(&true) {
            self.queue.rotate_right(1);
            self.queue[0] = self.arriving.clone();
        }
    }

    /// Returns the inputs of a unit over the first part of a step and over the rest. Both are the
    /// same, unless a delay ends within the step.
    fn gather(&mut self, unit: usize) -> [Matrix; 2] {
        let count = self.net.units[unit].inputs.len();
        let mut inputs = [Matrix::zeros(count, self.columns), Matrix::zeros(count, self.columns)];
        for link in self.net.links.iter().filter(|link| link.to.0 == unit) {
            let source = match link.reading {
                Reading::BeforeStep => &self.before[link.from.0],
                Reading::AfterStep => &self.latest[link.from.0],
            };
            let value = source.row(link.from.1) * link.factor;
            let mut both = [value.clone(), value.clone()];
            if let Some(channel) = link.opened {
                self.arriving.set_row(channel, &value);
                self.arrived[channel] = true;
                if let Some(first) = self.put_in {
                    both = [0, 1].map(|_| {
                        let mut row = Matrix::zeros(1, self.columns);
                        row[(0, first + channel)] = 1.0;
                        row.row(0).into_owned()
                    });
                }
                if let Some(delay) = self.delay
                    && delay.channel.is_none_or(|delayed| delayed == channel)
                {
                    let ago = |steps: usize| match steps.checked_sub(1) {
                        None => value.clone(),
                        Some(place) => self.queue[place].row(channel).into_owned(),
                    };
                    both = [ago(delay.steps + 1), ago(delay.steps)];
                }
            }
            for (rows, value) in inputs.iter_mut().zip(&both) {
                let sum = rows.row(link.to.1) + value;
                rows.set_row(link.to.1, &sum);
            }
        }
        inputs
    }

    fn step(&mut self, unit: usize, tick: u64, [older, newer]: &[Matrix; 2]) {
        let model = &self.net.units[unit];
        let part = self.delay.map_or(0.0, |delay| delay.part);
        let state = &self.states[unit];
        let (state, output) = match &model.dynamics {
            Dynamics::Sampled(steps) => {
                let step = &steps[model.phase(tick)];
                (&step.a * state + &step.b * newer, &step.c * state + &step.d * newer)
            }
            Dynamics::Continuous(system) => {
                let length = model.every as f64 * self.net.length;
                let mut state = state.clone();
                if part > 0.0 {
                    let first = system.step(part * length);
                    state = &first.a * state + &first.b * older;
                }
                let rest = system.step((1.0 - part) * length);
                let output = &rest.c * &state + &rest.d * newer;
                (&rest.a * state + &rest.b * newer, output)
            }
        };
        (self.states[unit], self.latest[unit]) = (state, output);
    }
}
