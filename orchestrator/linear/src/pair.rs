//! Two components in series, as one component.
//!
//! An allocator divides a moment among effectors, none of which has a slope where its limit
//! changes; their joint effect is smooth nevertheless. So the response of both is used.

use crate::replay::Recorded;
use cosim::system::System;
use fmi_master::delay::Reading;
use fmi_master::description::Carrier;
use fmi_master::instance::{CallFailure, Instance, Outcome};
use fmi_master::wiring::{Port, Wire};

/// A connection within a pair, by places of its members.
#[derive(Clone, Copy, Debug)]
struct Inner {
    wire: Wire,
    from: usize,
    to: usize,
    reading: Reading,
}

/// Connections of two components to others. The references of the ports are
/// places in `table`, because the components' own may be equal.
#[derive(Clone, Debug)]
pub(crate) struct Joined {
    /// Indices of the components.
    pub components: [usize; 2],
    /// Inputs that are not connected within the pair, with their values in the run.
    pub recorded: Recorded,
    /// Those of them that are real numbers.
    pub inputs: Vec<Port>,
    /// Outputs of both that are real numbers and connected with others.
    pub outputs: Vec<Port>,
    inner: Vec<Inner>,
    /// Member and value reference of every port.
    table: Vec<(usize, u32)>,
}

impl Joined {
    /// Joins two components that step at the same time, one after the other, given the inputs that
    /// were recorded of each and their connected outputs. Returns `None` if the first hands nothing
    /// on to the second, or if not all that they exchange is free to be taken as one: real numbers,
    /// and none of them among the `opened` variables.
    pub(crate) fn new(
        system: &System,
        components: [usize; 2],
        recorded: [&Recorded; 2],
        outputs: [&[Port]; 2],
        opened: &[Port],
    ) -> Option<Self> {
        let member =
            |port: &Port| components.iter().position(|component| *component == port.component);
        let inner: Vec<Inner> = system
            .wires()
            .into_iter()
            .filter_map(|(wire, reading)| {
                let (from, to) = (member(&wire.from)?, member(&wire.to)?);
                Some(Inner { wire, from, to, reading })
            })
            .collect();
        let is_free = |inner: &Inner| {
            let Wire { from, to, .. } = inner.wire;
            from.carrier == Carrier::Real && !opened.contains(&from) && !opened.contains(&to)
        };
        if !inner.iter().any(|inner| inner.from == 0 && inner.to == 1) || !inner.iter().all(is_free)
        {
            return None;
        }
        let mut table = Vec::new();
        let mut listed = |port: &Port, member: usize| {
            table.push((member, port.reference));
            Port { reference: table.len() as u32 - 1, ..*port }
        };
        let mut both = Recorded {
            times: recorded[0].times.clone(),
            length: recorded[0].length,
            rows: vec![Vec::new(); recorded[0].rows.len().min(recorded[1].rows.len())],
            ..Recorded::default()
        };
        for (member, one) in recorded.iter().enumerate() {
            for (place, port) in one.ports.iter().enumerate() {
                if inner.iter().any(|inner| inner.wire.to == *port) {
                    continue;
                }
                both.ports.push(listed(port, member));
                for (row, values) in both.rows.iter_mut().zip(&one.rows) {
                    row.push(values[place]);
                }
            }
        }
        let inputs =
            both.ports.iter().filter(|port| port.carrier == Carrier::Real).copied().collect();
        let leaves = |port: &&Port| {
            let mut wires = system.wires().into_iter().map(|(wire, _)| wire);
            wires.any(|wire| wire.from == **port && member(&wire.to).is_none())
        };
        let outputs = outputs.iter().enumerate().flat_map(|(member, ports)| {
            let ports = ports.iter().filter(leaves);
            ports.map(|port| listed(port, member)).collect::<Vec<_>>()
        });
        let outputs = outputs.collect();
        Some(Self { components, recorded: both, inputs, outputs, inner, table })
    }
}

/// Instances of both components.
pub(crate) struct Pair<'a, 'b> {
    joined: &'a Joined,
    members: [&'b mut dyn Instance; 2],
    /// Values set since the last step: reference, type and value. It reaches the members when they
    /// step, because nothing may be read after it.
    set: Vec<(u32, Carrier, f64)>,
    /// Member whose call came last.
    pub(crate) last: usize,
}

impl<'a, 'b> Pair<'a, 'b> {
    /// Combines two instances into one.
    pub(crate) fn new(joined: &'a Joined, members: [&'b mut dyn Instance; 2]) -> Self {
        Self { joined, members, set: Vec::new(), last: 0 }
    }

    fn member(&mut self, member: usize) -> &mut dyn Instance {
        self.last = member;
        &mut *self.members[member]
    }

    fn each(&mut self, mut call: impl FnMut(&mut dyn Instance) -> Outcome) -> Outcome {
        (0..2).try_for_each(|member| call(self.member(member)))
    }

    /// Passes on the values that are read at this time of a round.
    fn hand_on(&mut self, reading: Reading, from: usize) -> Result<Vec<(Port, f64)>, CallFailure> {
        let joined = self.joined;
        let meant = joined.inner.iter().filter(|one| one.reading == reading && one.from == from);
        meant
            .map(|Inner { wire, .. }| {
                let mut value = [0.0];
                self.member(from).get_real(&[wire.from.reference], &mut value)?;
                Ok((wire.to, wire.scaling.apply(value[0])))
            })
            .collect()
    }
}

impl Instance for Pair<'_, '_> {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        for (reference, value) in references.iter().zip(values) {
            let (member, own) = self.joined.table[*reference as usize];
            self.member(member).get_real(&[own], std::slice::from_mut(value))?;
        }
        Ok(())
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        self.set
            .extend(references.iter().zip(values).map(|(r, value)| (*r, Carrier::Real, *value)));
        Ok(())
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let values = references.iter().zip(values);
        self.set.extend(values.map(|(r, value)| (*r, Carrier::Integer, f64::from(*value))));
        Ok(())
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        let values = references.iter().zip(values);
        self.set.extend(values.map(|(r, value)| (*r, Carrier::Boolean, f64::from(*value))));
        Ok(())
    }

    fn do_step(&mut self, time: f64, step: f64) -> Outcome {
        let mut handed = self.hand_on(Reading::BeforeStep, 0)?;
        handed.extend(self.hand_on(Reading::BeforeStep, 1)?);
        let set = std::mem::take(&mut self.set);
        for member in 0..2 {
            for (reference, carrier, value) in &set {
                let (of, own) = self.joined.table[*reference as usize];
                if of != member {
                    continue;
                }
                let instance = self.member(member);
                match carrier {
                    Carrier::Real => instance.set_real(&[own], &[*value])?,
                    Carrier::Integer => instance.set_integer(&[own], &[*value as i32])?,
                    Carrier::Boolean => instance.set_boolean(&[own], &[*value as i32])?,
                }
            }
            let component = self.joined.components[member];
            let (references, values): (Vec<u32>, Vec<f64>) = handed
                .iter()
                .filter(|(port, _)| port.component == component)
                .map(|(port, value)| (port.reference, *value))
                .unzip();
            if !references.is_empty() {
                self.member(member).set_real(&references, &values)?;
            }
            self.member(member).do_step(time, step)?;
            handed.extend(self.hand_on(Reading::AfterStep, member)?);
        }
        Ok(())
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.each(|instance| instance.save(number))
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.set.clear();
        self.each(|instance| instance.restore(number))
    }

    // A run is begun and ended by the instances' own master, which asks for nothing else.

    fn get_integer(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
        Err(CallFailure::new("getInteger", "not of a pair"))
    }

    fn get_boolean(&mut self, _: &[u32], _: &mut [i32]) -> Outcome {
        Err(CallFailure::new("getBoolean", "not of a pair"))
    }

    fn set_string(&mut self, _: u32, _: &str) -> Outcome {
        Err(CallFailure::new("setString", "not of a pair"))
    }

    fn enter_initialization(&mut self, _: f64, _: f64) -> Outcome {
        Err(CallFailure::new("enterInitializationMode", "not of a pair"))
    }

    fn exit_initialization(&mut self) -> Outcome {
        Err(CallFailure::new("exitInitializationMode", "not of a pair"))
    }
}
