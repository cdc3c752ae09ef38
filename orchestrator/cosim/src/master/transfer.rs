//! Transfers values between units, with one call per unit and type.

use crate::wiring::{Port, Wire};
use fmu_import::description::Carrier;
use fmu_import::quantity::Scaling;
use fmu_import::unit::{CoSimulationUnit, Outcome, UnitFailure};
use std::ops::Range;

/// A unit together with what the master must know to step it. Members are kept in the order in
/// which their inputs are set.
pub struct Member {
    /// Name of the component in the experiment.
    pub name: String,
    /// Period of the unit: it steps at every n-th tick.
    pub every: u32,
    /// Whether its steps are begun before any other is waited for, because it has a process of its
    /// own.
    pub ahead: bool,
    /// The unit itself, instantiated and with its parameters set.
    pub unit: Box<dyn CoSimulationUnit>,
}

/// All values of one type that one unit receives: they are read with one get call per source and
/// written with one set call.
struct Bundle<T> {
    references: Vec<u32>,
    values: Vec<T>,
    sources: Vec<(usize, Vec<u32>, Range<usize>)>,
}

impl<T: Copy + Default> Bundle<T> {
    fn new(wires: &[Wire], target: usize, carrier: Carrier) -> Self {
        let mut wires: Vec<&Wire> =
            wires.iter().filter(|w| w.to.component == target && w.to.carrier == carrier).collect();
        wires.sort_by_key(|wire| wire.from.component);
        let mut sources: Vec<(usize, Vec<u32>, Range<usize>)> = Vec::new();
        for (place, wire) in wires.iter().enumerate() {
            match sources.last_mut() {
                Some((source, references, range)) if *source == wire.from.component => {
                    references.push(wire.from.reference);
                    range.end = place + 1;
                }
                _ => {
                    sources.push((
                        wire.from.component,
                        vec![wire.from.reference],
                        place..place + 1,
                    ));
                }
            }
        }
        Self {
            references: wires.iter().map(|wire| wire.to.reference).collect(),
            values: vec![T::default(); wires.len()],
            sources,
        }
    }
}

/// All values that one unit receives, grouped by type.
pub(super) struct Inputs {
    real: Bundle<f64>,
    integer: Bundle<i32>,
    boolean: Bundle<i32>,
    /// Indices of the real inputs whose values are converted on the way, with their scaling.
    scaled: Vec<(usize, Scaling)>,
}

impl Inputs {
    pub(super) fn new(wires: &[Wire], target: usize) -> Self {
        let real: Bundle<f64> = Bundle::new(wires, target, Carrier::Real);
        let scaling = |reference: u32| {
            let is_it = |w: &&Wire| w.to.component == target && w.to.reference == reference;
            wires
                .iter()
                .filter(|w| w.to.carrier == Carrier::Real)
                .find(is_it)
                .map(|wire| wire.scaling)
        };
        let scaled = real.references.iter().enumerate();
        let scaled = scaled.filter_map(|(place, &reference)| Some((place, scaling(reference)?)));
        Self {
            scaled: scaled.filter(|(_, scaling)| *scaling != Scaling::default()).collect(),
            real,
            integer: Bundle::new(wires, target, Carrier::Integer),
            boolean: Bundle::new(wires, target, Carrier::Boolean),
        }
    }

    /// Reads the sources of the inputs. An error carries the index of the member whose call failed.
    pub(super) fn gather(&mut self, members: &mut [Member]) -> Result<(), (usize, UnitFailure)> {
        for (source, references, range) in &self.real.sources {
            let values = &mut self.real.values[range.clone()];
            members[*source]
                .unit
                .get_real(references, values)
                .map_err(|failure| (*source, failure))?;
        }
        for (place, scaling) in &self.scaled {
            self.real.values[*place] = scaling.of(self.real.values[*place]);
        }
        for (source, references, range) in &self.integer.sources {
            let values = &mut self.integer.values[range.clone()];
            members[*source]
                .unit
                .get_integer(references, values)
                .map_err(|failure| (*source, failure))?;
        }
        for (source, references, range) in &self.boolean.sources {
            let values = &mut self.boolean.values[range.clone()];
            members[*source]
                .unit
                .get_boolean(references, values)
                .map_err(|failure| (*source, failure))?;
        }
        Ok(())
    }

    pub(super) fn scatter(&self, unit: &mut dyn CoSimulationUnit) -> Outcome {
        if !self.real.references.is_empty() {
            unit.set_real(&self.real.references, &self.real.values)?;
        }
        if !self.integer.references.is_empty() {
            unit.set_integer(&self.integer.references, &self.integer.values)?;
        }
        if !self.boolean.references.is_empty() {
            unit.set_boolean(&self.boolean.references, &self.boolean.values)?;
        }
        Ok(())
    }
}

/// Reads the probed variables for the observers, with one call per unit and type.
pub(super) struct Probe {
    reads: Vec<Read>,
    pub(super) values: Vec<f64>,
}

struct Read {
    component: usize,
    carrier: Carrier,
    references: Vec<u32>,
    /// Index of each value among the probed values.
    places: Vec<usize>,
    reals: Vec<f64>,
    integers: Vec<i32>,
}

impl Probe {
    pub(super) fn new(ports: &[Port]) -> Self {
        let mut reads: Vec<Read> = Vec::new();
        for (place, port) in ports.iter().enumerate() {
            let known = reads
                .iter_mut()
                .find(|r| r.component == port.component && r.carrier == port.carrier);
            if let Some(read) = known {
                read.references.push(port.reference);
                read.places.push(place);
            } else {
                reads.push(Read {
                    component: port.component,
                    carrier: port.carrier,
                    references: vec![port.reference],
                    places: vec![place],
                    reals: Vec::new(),
                    integers: Vec::new(),
                });
            }
        }
        for read in &mut reads {
            match read.carrier {
                Carrier::Real => read.reals = vec![0.0; read.places.len()],
                Carrier::Integer | Carrier::Boolean => read.integers = vec![0; read.places.len()],
            }
        }
        Self { reads, values: vec![0.0; ports.len()] }
    }

    pub(super) fn read(&mut self, members: &mut [Member]) -> Result<(), (usize, UnitFailure)> {
        for read in &mut self.reads {
            let unit = &mut members[read.component].unit;
            match read.carrier {
                Carrier::Real => unit.get_real(&read.references, &mut read.reals),
                Carrier::Integer => unit.get_integer(&read.references, &mut read.integers),
                Carrier::Boolean => unit.get_boolean(&read.references, &mut read.integers),
            }
            .map_err(|failure| (read.component, failure))?;
            for (value, place) in read.reals.iter().zip(&read.places) {
                self.values[*place] = *value;
            }
            for (value, place) in read.integers.iter().zip(&read.places) {
                self.values[*place] = f64::from(*value);
            }
        }
        Ok(())
    }
}
