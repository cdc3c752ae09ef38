//! Values on their way from instance to instance, which are read with one call per instance and
//! type.

use crate::delay::Reading;
use crate::description::Carrier;
use crate::instance::{Instance, Outcome};
use crate::quantity::Scaling;
use crate::wiring::{Port, Wire};
use std::collections::BTreeSet;

/// A connected real input at which the loop is opened.
pub struct OpenedInput {
    /// Place among the real inputs of the instance.
    place: usize,
    /// Value that arrived for the latest step.
    pub arrived: f64,
    /// Value that the instance receives instead, if there is one.
    pub given: Option<f64>,
}

/// An instance together with the data that the master needs to step it. Members are kept in the
/// order in which they are stepped.
pub struct Member {
    /// Name of the component in the experiment.
    pub name: String,
    /// Period of the instance: it steps at every n-th tick.
    pub every: u32,
    /// Whether its last step is fitted to the stop time. Otherwise all its steps are whole, and it
    /// is given the end of the last one.
    pub varies: bool,
    /// The instance itself, instantiated and with its parameters set.
    pub instance: Box<dyn Instance>,
}

/// Variables of one instance and type, which are read by one call into neighbouring places.
struct Read {
    carrier: Carrier,
    references: Vec<u32>,
    /// Index of the first value; the others follow.
    first: usize,
    integers: Vec<i32>,
}

/// All values that are read from the instances. Integers and booleans are kept as floats, which
/// hold them without loss.
pub(super) struct Values {
    ports: Vec<Port>,
    /// Reads of each instance: those of connected outputs, then those that only observers ask for.
    reads: Vec<[Vec<Read>; 2]>,
    pub(super) readings: Readings,
}

/// Values of all ports.
#[derive(Clone, Default)]
pub(super) struct Readings {
    /// Values at the communication point at which an instance stands before its step.
    before: Vec<f64>,
    /// Values that were read last.
    latest: Vec<f64>,
}

impl Values {
    /// Makes room for the values that this number of instances give to one another (`wired`) and to
    /// observers (`probed`).
    pub(super) fn new(instances: usize, wired: &[Port], probed: &[Port]) -> Self {
        let mut values =
            Self { ports: Vec::new(), reads: Vec::new(), readings: Readings::default() };
        for instance in 0..instances {
            let reads = [values.add(instance, wired), values.add(instance, probed)];
            values.reads.push(reads);
        }
        let zeros = vec![0.0; values.ports.len()];
        values.readings = Readings { before: zeros.clone(), latest: zeros };
        values
    }

    /// Adds those ports of an instance that are not there yet.
    fn add(&mut self, instance: usize, ports: &[Port]) -> Vec<Read> {
        let mut reads = Vec::new();
        for carrier in [Carrier::Real, Carrier::Integer, Carrier::Boolean] {
            let first = self.ports.len();
            for port in ports.iter().filter(|p| p.component == instance && p.carrier == carrier) {
                if !self.ports.contains(port) {
                    self.ports.push(*port);
                }
            }
            let references: Vec<u32> = self.ports[first..].iter().map(|p| p.reference).collect();
            if !references.is_empty() {
                let length = if carrier == Carrier::Real { 0 } else { references.len() };
                reads.push(Read { carrier, references, first, integers: vec![0; length] });
            }
        }
        reads
    }

    fn place(&self, port: &Port) -> usize {
        let place = self.ports.iter().position(|other| other == port);
        place.expect("every connected or probed output has a place")
    }

    /// Reads the connected outputs of an instance, and with `probed` also the variables that
    /// observers ask for.
    pub(super) fn read(
        &mut self,
        index: usize,
        instance: &mut dyn Instance,
        probed: bool,
    ) -> Outcome {
        let [wired, others] = &mut self.reads[index];
        let others = others.iter_mut().take(if probed { usize::MAX } else { 0 });
        for read in wired.iter_mut().chain(others) {
            let into = &mut self.readings.latest[read.first..read.first + read.references.len()];
            match read.carrier {
                Carrier::Real => instance.get_real(&read.references, into)?,
                Carrier::Integer => instance.get_integer(&read.references, &mut read.integers)?,
                Carrier::Boolean => instance.get_boolean(&read.references, &mut read.integers)?,
            }
            for (value, integer) in into.iter_mut().zip(&read.integers) {
                *value = f64::from(*integer);
            }
        }
        Ok(())
    }

    /// Keeps the values that an instance has at its communication point as those before its step.
    pub(super) fn arrive(&mut self, index: usize) {
        let Readings { before, latest } = &mut self.readings;
        for read in self.reads[index].iter().flatten() {
            let range = read.first..read.first + read.references.len();
            before[range.clone()].copy_from_slice(&latest[range]);
        }
    }
}

/// Place among the values, with the time of the reading that counts.
#[derive(Clone, Copy)]
struct Place {
    index: usize,
    reading: Reading,
}

impl Place {
    fn value(self, values: &Values) -> f64 {
        match self.reading {
            Reading::BeforeStep => values.readings.before[self.index],
            Reading::AfterStep => values.readings.latest[self.index],
        }
    }
}

/// Values that observers see.
pub(super) struct Row {
    places: Vec<Place>,
    pub(super) values: Vec<f64>,
}

impl Row {
    /// Makes a row of `probes`.
    pub(super) fn new(values: &Values, probes: &[(Port, Reading)]) -> Self {
        let place = |(port, reading): &(Port, Reading)| Place {
            index: values.place(port),
            reading: *reading,
        };
        Self { places: probes.iter().map(place).collect(), values: vec![0.0; probes.len()] }
    }

    pub(super) fn fill(&mut self, values: &Values) {
        for (value, place) in self.values.iter_mut().zip(&self.places) {
            *value = place.value(values);
        }
    }
}

/// All values that one instance receives, grouped by type.
pub(super) struct Inputs {
    real: Bundle<f64>,
    integer: Bundle<i32>,
    boolean: Bundle<i32>,
    /// Instances that give any of the values.
    pub(super) sources: Vec<usize>,
    opened: Vec<OpenedInput>,
}

/// Inputs of one type: they are written by one call.
struct Bundle<T> {
    references: Vec<u32>,
    places: Vec<(Place, Scaling)>,
    values: Vec<T>,
}

impl<T: Copy + Default> Bundle<T> {
    fn new(values: &Values, wires: &[(Wire, Reading)], target: usize, carrier: Carrier) -> Self {
        let wires =
            wires.iter().filter(|(w, _)| w.to.component == target && w.to.carrier == carrier);
        let place = |&(wire, reading): &(Wire, Reading)| {
            (Place { index: values.place(&wire.from), reading }, wire.scaling)
        };
        let references: Vec<u32> = wires.clone().map(|(wire, _)| wire.to.reference).collect();
        let values = vec![T::default(); references.len()];
        Self { references, places: wires.map(place).collect(), values }
    }

    /// Takes the values over; `convert` is exact for what was read.
    fn gather(&mut self, values: &Values, convert: impl Fn(f64) -> T) {
        for (value, (place, scaling)) in self.values.iter_mut().zip(&self.places) {
            let read = place.value(values);
            *value =
                convert(if *scaling == Scaling::default() { read } else { scaling.apply(read) });
        }
    }
}

impl Inputs {
    pub(super) fn new(values: &Values, wires: &[(Wire, Reading)], target: usize) -> Self {
        let given = wires.iter().filter(|(wire, _)| wire.to.component == target);
        let sources: BTreeSet<usize> = given.map(|(wire, _)| wire.from.component).collect();
        Self {
            real: Bundle::new(values, wires, target, Carrier::Real),
            integer: Bundle::new(values, wires, target, Carrier::Integer),
            boolean: Bundle::new(values, wires, target, Carrier::Boolean),
            sources: sources.into_iter().collect(),
            opened: Vec::new(),
        }
    }

    /// Opens the loop at a real input, unless it is opened already.
    pub(super) fn opened(&mut self, reference: u32) -> &mut OpenedInput {
        let place = self.real.references.iter().position(|other| *other == reference);
        let place = place.expect("a connected real input");
        let index = self.opened.iter().position(|opened| opened.place == place);
        let index = index.unwrap_or_else(|| {
            self.opened.push(OpenedInput { place, arrived: 0.0, given: None });
            self.opened.len() - 1
        });
        &mut self.opened[index]
    }

    pub(super) fn gather(&mut self, values: &Values) {
        self.real.gather(values, |value| value);
        for OpenedInput { place, arrived, given } in &mut self.opened {
            let value = &mut self.real.values[*place];
            *arrived = *value;
            *value = given.unwrap_or(*value);
        }
        self.integer.gather(values, |value| value as i32);
        self.boolean.gather(values, |value| value as i32);
    }

    pub(super) fn scatter(&self, instance: &mut dyn Instance) -> Outcome {
        if !self.real.references.is_empty() {
            instance.set_real(&self.real.references, &self.real.values)?;
        }
        if !self.integer.references.is_empty() {
            instance.set_integer(&self.integer.references, &self.integer.values)?;
        }
        if !self.boolean.references.is_empty() {
            instance.set_boolean(&self.boolean.references, &self.boolean.values)?;
        }
        Ok(())
    }
}
