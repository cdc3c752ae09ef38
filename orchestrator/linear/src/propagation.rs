//! The master's algorithm on matrices: every value is a row of factors, by which it follows from
//! the states at the beginning of a period and from the values injected at the opened signals.
//!
//! The order of the calls is that of [`fmi_master::master`], so that the delays are those of a run.

use crate::Matrix;
use crate::components::{Component, Dynamics};
use crate::continuous::Steps;
use crate::model::{OpenLoop, Signal, Step};
use crate::reduction::{held, merged, reduced};
use cosim::experiment::Coupling;
use fmi_master::delay::Reading;

/// A connection between components, by places of components and of their outputs and inputs.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Component and output that it comes from.
    pub from: (usize, usize),
    /// Component and input that it goes to.
    pub to: (usize, usize),
    /// Factor on the way.
    pub factor: f64,
    /// When the output is read.
    pub reading: Reading,
    /// Opened signal that the connection carries.
    pub opened: Option<usize>,
}

/// The components of a loop with their connections.
#[derive(Clone, Debug)]
pub struct Net {
    /// Components, in the order in which they are stepped.
    pub components: Vec<Component>,
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
    /// Number of communication steps for which the opened signals are held, from the beginning of a
    /// period.
    pub held: u64,
    /// Time, s. It must be a whole number of steps of the components that receive the signals,
    /// unless all of them are continuous.
    pub time: f64,
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

/// All values as rows of factors.
struct Rows<'a> {
    net: &'a Net,
    /// Number of states at the beginning of a period, which are the first columns.
    states: usize,
    columns: usize,
    state: Vec<Matrix>,
    latest: Vec<Matrix>,
    before: Vec<Matrix>,
    /// Value that arrives at each opened signal.
    arriving: Matrix,
    /// First column of the values injected at a communication point; `None` if the loop is closed.
    put_in: Option<usize>,
    /// Delay of each component's inputs.
    delays: Vec<Vec<Steps>>,
    /// Steps of each continuous component from one change of its inputs to the next, with the share
    /// of its communication step at which they begin.
    parts: Vec<Vec<(f64, Step)>>,
    /// Inputs of each component at its last steps, the newest first.
    history: Vec<Vec<Matrix>>,
    /// Number of communication steps for which the values at the opened signals are held.
    held: u64,
}

impl Net {
    /// Returns the number of communication points of the common period.
    pub fn period(&self) -> u64 {
        self.components.iter().map(Component::period).fold(1, lcm)
    }

    /// Returns the components that receive an opened signal, or any of them.
    fn receivers(&self, channel: Option<usize>) -> impl Iterator<Item = &Component> {
        let is_meant = move |opened: usize| channel.is_none_or(|channel| channel == opened);
        let links = self.links.iter().filter(move |link| link.opened.is_some_and(is_meant));
        links.map(|link| &self.components[link.to.0])
    }

    /// Returns whether every component that receives an opened signal, or any of them, is
    /// continuous, so that a delay may be any part of a step.
    pub fn takes_parts(&self, channel: Option<usize>) -> bool {
        self.receivers(channel).all(|one| matches!(one.dynamics, Dynamics::Continuous(_)))
    }

    /// Returns the time between two steps of the components that receive an opened signal, or any
    /// of them, s.
    pub fn receiving_step(&self, channel: Option<usize>) -> f64 {
        let every = self.receivers(channel).map(|one| one.every).max().unwrap_or(1);
        every as f64 * self.length
    }

    /// Returns the delay of each input of a component.
    fn delays(&self, component: usize, delay: Option<Delay>) -> Vec<Steps> {
        let model = &self.components[component];
        let own = match &model.dynamics {
            Dynamics::Continuous(system) => system.delay,
            Dynamics::Sampled(_) => 0.0,
        };
        let more = |input: usize| {
            let delay = delay?;
            let into = |link: &&Link| link.to == (component, input);
            let channel = self.links.iter().find(into)?.opened?;
            delay.channel.is_none_or(|delayed| delayed == channel).then_some(delay.time)
        };
        let step = model.every as f64 * self.length;
        let inputs = 0..model.inputs.len();
        inputs.map(|input| Steps::of(own + more(input).unwrap_or(0.0), step)).collect()
    }

    /// Returns the steps of a continuous component from one change of its delayed inputs to the
    /// next, with the share of its communication step at which each begins.
    fn parts(&self, component: &Component, delays: &[Steps]) -> Vec<(f64, Step)> {
        let Dynamics::Continuous(system) = &component.dynamics else { return Vec::new() };
        let length = component.every as f64 * self.length;
        let mut ends: Vec<f64> = delays.iter().map(|delay| delay.part).collect();
        ends.extend([0.0, 1.0]);
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let parts = ends.windows(2);
        parts.map(|part| (part[0], system.step((part[1] - part[0]) * length))).collect()
    }

    /// Returns the open loop.
    pub fn open(&self) -> OpenLoop {
        let channels = self.signals.len();
        let ticks = self.period();
        let mut rows = Rows::start(self, ticks as usize * channels, None);
        let names = rows.names();
        let states = rows.states;
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
        let mut rows = Rows::start(self, 0, Some(delay));
        for tick in 0..self.period() {
            rows.round(self.first + tick);
        }
        let a = rows.end();
        // A state on which nothing depends cannot make the loop unstable.
        let kept: Vec<usize> = (0..a.ncols()).filter(|i| a.column(*i).amax() > 0.0).collect();
        merged(a.select_rows(&kept).select_columns(&kept))
    }
}

impl<'a> Rows<'a> {
    /// Begins a period.
    fn start(net: &'a Net, inputs: usize, delay: Option<Delay>) -> Self {
        let delays: Vec<Vec<Steps>> =
            (0..net.components.len()).map(|component| net.delays(component, delay)).collect();
        let counts = net.components.iter().zip(&delays).map(|(component, delays)| {
            let held = if component.shows_states() { 0 } else { 2 * component.outputs.len() };
            let past = remembered(delays) * component.inputs.len();
            component.states_at(net.first) + held + past
        });
        let states = counts.sum();
        let columns = states + inputs;
        let mut next = 0;
        let mut unity = |count: usize| {
            let mut rows = Matrix::zeros(count, columns);
            for row in 0..count {
                rows[(row, next + row)] = 1.0;
            }
            next += count;
            rows
        };
        let mut rows = Self {
            net,
            states,
            columns,
            state: Vec::new(),
            latest: Vec::new(),
            before: Vec::new(),
            arriving: Matrix::zeros(net.signals.len(), columns),
            put_in: None,
            parts: net.components.iter().zip(&delays).map(|(one, d)| net.parts(one, d)).collect(),
            delays,
            history: Vec::new(),
            held: delay.map_or(1, |delay| delay.held),
        };
        for (component, delays) in net.components.iter().zip(&rows.delays) {
            let state = unity(component.states_at(net.first));
            if let (Dynamics::Continuous(system), true) =
                (&component.dynamics, component.shows_states())
            {
                rows.latest.push(&system.c * &state);
                rows.before.push(&system.c * &state);
            } else {
                rows.latest.push(unity(component.outputs.len()));
                rows.before.push(unity(component.outputs.len()));
            }
            rows.state.push(state);
            rows.history
                .push((0..remembered(delays)).map(|_| unity(component.inputs.len())).collect());
        }
        rows
    }

    /// Returns the names of the states.
    fn names(&self) -> Vec<String> {
        let mut names = Vec::with_capacity(self.states);
        for (component, delays) in self.net.components.iter().zip(&self.delays) {
            names.extend(component.names(self.net.first));
            for age in 1..=remembered(delays) {
                let past = (1..=component.inputs.len())
                    .map(|input| format!("{}.input[{input}] ({age} steps ago)", component.name));
                names.extend(past);
            }
        }
        names
    }

    /// Returns the rows of all states at the end of the period, in the order of the names.
    fn end(self) -> Matrix {
        let mut parts: Vec<&Matrix> = Vec::new();
        for (place, component) in self.net.components.iter().enumerate() {
            parts.push(&self.state[place]);
            if !component.shows_states() {
                parts.extend([&self.latest[place], &self.before[place]]);
            }
            parts.extend(&self.history[place]);
        }
        let mut all = Matrix::zeros(parts.iter().map(|part| part.nrows()).sum(), self.columns);
        let mut next = 0;
        for part in parts {
            all.rows_mut(next, part.nrows()).copy_from(part);
            next += part.nrows();
        }
        all
    }

    fn round(&mut self, tick: u64) {
        let net = self.net;
        let begins = |component: &Component| tick.is_multiple_of(component.every);
        for (place, component) in net.components.iter().enumerate() {
            if begins(component) {
                self.before[place] = self.latest[place].clone();
            }
        }
        let components =
            net.components.iter().enumerate().filter(|(_, component)| begins(component));
        match net.coupling {
            Coupling::Sequential => {
                for (place, _) in components {
                    let inputs = self.gather(place, tick);
                    self.step(place, tick, inputs);
                }
            }
            Coupling::Jacobi => {
                let gathered: Vec<_> =
                    components.map(|(place, _)| (place, self.gather(place, tick))).collect();
                for (place, inputs) in gathered {
                    self.step(place, tick, inputs);
                }
            }
        }
    }

    /// Returns the inputs of a component.
    fn gather(&mut self, component: usize, tick: u64) -> Matrix {
        let mut inputs = Matrix::zeros(self.net.components[component].inputs.len(), self.columns);
        for link in self.net.links.iter().filter(|link| link.to.0 == component) {
            let source = match link.reading {
                Reading::BeforeStep => &self.before[link.from.0],
                Reading::AfterStep => &self.latest[link.from.0],
            };
            let mut value = source.row(link.from.1) * link.factor;
            if let Some(channel) = link.opened {
                if !(tick - self.net.first).is_multiple_of(self.held) {
                    // Exact to the last digit, so that remembered copies are found to be equal.
                    value = self.arriving.row(channel).into_owned();
                }
                self.arriving.set_row(channel, &value);
                if let Some(first) = self.put_in {
                    value.fill(0.0);
                    value[first + channel] = 1.0;
                }
            }
            inputs.set_row(link.to.1, &value);
        }
        inputs
    }

    fn step(&mut self, component: usize, tick: u64, inputs: Matrix) {
        let model = &self.net.components[component];
        let delays = &self.delays[component];
        let state = &self.state[component];
        // Value of each input over the part of the step that begins at `from`.
        let acting = |from: f64| {
            let mut acting = inputs.clone();
            for (row, delay) in delays.iter().enumerate() {
                let age = delay.whole + usize::from(from < delay.part);
                if age > 0 {
                    acting.set_row(row, &self.history[component][age - 1].row(row));
                }
            }
            acting
        };
        let (state, output) = match &model.dynamics {
            Dynamics::Sampled(steps) => {
                let step = &steps[model.phase(tick)];
                let acting = acting(1.0);
                (&step.a * state + &step.b * &acting, &step.c * state + &step.d * &acting)
            }
            Dynamics::Continuous(system) => {
                let mut state = state.clone();
                let mut output = Matrix::zeros(system.c.nrows(), self.columns);
                for (from, step) in &self.parts[component] {
                    let acting = acting(*from);
                    output = &step.c * &state + &step.d * &acting;
                    state = &step.a * &state + &step.b * &acting;
                }
                (state, output)
            }
        };
        (self.state[component], self.latest[component]) = (state, output);
        if let Some(oldest) = self.history[component].last_mut() {
            *oldest = inputs;
            self.history[component].rotate_right(1);
        }
    }
}

/// Returns the number of earlier inputs that a component with these delays needs.
fn remembered(delays: &[Steps]) -> usize {
    delays.iter().map(|delay| delay.remembered()).max().unwrap_or(0)
}
