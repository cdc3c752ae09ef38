//! Roles of the variables in the equations, so that nothing depends on their positions in the
//! variable table.

use fmi_export::VariableTable;
use fmi_export::table::{Common, Real};
use settings::Declared;

/// Quantity of the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Quantity {
    DynamicPressure,
    /// Dynamic pressure as an on-board computer knows it.
    KnownPressure,
    Mach,
    Airspeed,
    Density,
    /// Angle of attack or sideslip relative to the air.
    AirAngle(usize),
    Lift,
    Drag,
    LoadFactor,
    HeatFlux,
    Range,
    AirMoment(usize),
}

/// Role of a calculated variable. States and derivatives are counted in the order attitude, rates,
/// deflections, motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unknown {
    State(usize),
    Derivative(usize),
    AppliedMoment(usize),
    Delta(usize),
    DisturbanceMoment(usize),
    Flight(Quantity),
    Measured(usize),
    /// Time of a sample, or a part of a fix, which depend on nothing.
    MeasuredTime,
}

/// Role of a state or an input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Known {
    State(usize),
    Moment(usize),
    DisturbanceMoment(usize),
    Surface(usize),
    Jet(usize),
    Trajectory(usize),
    /// Prescribed angles, and their rates.
    Prescribed(usize),
    Trim,
}

/// Role of a variable in the equations. Parameters have no role.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Role {
    pub(crate) as_unknown: Option<Unknown>,
    pub(crate) as_known: Option<Known>,
}

impl Role {
    /// A state is calculated, and derivatives by it exist.
    pub(crate) fn state(i: usize) -> Self {
        Self { as_unknown: Some(Unknown::State(i)), as_known: Some(Known::State(i)) }
    }
}

impl From<Unknown> for Role {
    fn from(unknown: Unknown) -> Self {
        Self { as_unknown: Some(unknown), as_known: None }
    }
}

impl From<Known> for Role {
    fn from(input_or_state: Known) -> Self {
        Self { as_unknown: None, as_known: Some(input_or_state) }
    }
}

/// Variable table with the role of each variable.
pub(crate) struct Variables<M> {
    pub(crate) table: VariableTable<M>,
    pub(crate) roles: Vec<Role>,
}

impl<M: 'static> Variables<M> {
    pub(crate) fn new() -> Self {
        Self { table: VariableTable::new(), roles: Vec::new() }
    }

    fn add(mut self, declare: impl FnOnce(VariableTable<M>) -> VariableTable<M>) -> Self {
        self.roles.push(Role::default());
        Self { table: declare(self.table), ..self }
    }

    /// Gives the last variable its role.
    pub(crate) fn role(mut self, role: impl Into<Role>) -> Self {
        if let Some(last) = self.roles.last_mut() {
            *last = role.into();
        }
        self
    }

    pub(crate) fn real(
        self,
        declaration: Real,
        field: impl Fn(&mut M) -> &mut f64 + Send + Sync + 'static,
    ) -> Self {
        self.add(|table| table.real(declaration, field))
    }

    pub(crate) fn integer<I: Copy + TryFrom<i32> + TryInto<i32>>(
        self,
        common: Common,
        limits: (Option<i32>, Option<i32>),
        field: impl Fn(&mut M) -> &mut I + Copy + Send + Sync + 'static,
    ) -> Self {
        self.add(|table| table.integer(common, limits, field))
    }

    /// Adds the declared settings of a part of the model, which have no role.
    pub(crate) fn settings<S: Declared + 'static>(
        self,
        part: impl Fn(&mut M) -> &mut S + Send + Sync + 'static,
    ) -> Self {
        let mut roles = self.roles;
        roles.extend(settings::names::<S>().iter().map(|_| Role::default()));
        Self { table: self.table.settings(part), roles }
    }
}
