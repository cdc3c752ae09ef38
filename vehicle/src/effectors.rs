//! Effectors of the vehicle: eight aerodynamic surfaces and ten jets, Wu 2015 (57)–(59), (63)–(65).

mod fault;
mod given;

pub use fault::{EffectorFault, EffectorFaultKind};
pub(crate) use given::{GivenJets, GivenSurfaces};

use crate::aerodynamics::{Flow, SurfaceTable};
use crate::axes::Entry;
use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

/// Number of aerodynamic surfaces of the vehicle.
pub const SURFACES: usize = 8;
/// Number of reaction control jets of the vehicle.
pub const JETS: usize = 10;

/// Names of the surfaces of the papers' vehicle.
pub const SURFACE_NAMES: [Entry; SURFACES] = [
    ("[1]", "left outer elevon"),
    ("[2]", "right outer elevon"),
    ("[3]", "left inner elevon"),
    ("[4]", "right inner elevon"),
    ("[5]", "left flap"),
    ("[6]", "right flap"),
    ("[7]", "left rudder"),
    ("[8]", "right rudder"),
];

/// Vector with one number for each surface.
pub type Surfaces = SVector<f64, SURFACES>;
/// Vector with one number for each jet.
pub type Jets = SVector<f64, JETS>;

/// Moments and limits of the surfaces and jets. Moments act about the body axes x forward, y right,
/// z down; a deflection with the trailing edge down is positive. Without a vehicle's file they are
/// those of Wu 2015.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effectors {
    /// Lower limits on the deflections (63), rad.
    pub min: Surfaces,
    /// Upper limits on the deflections (63), rad.
    pub max: Surfaces,
    /// Upper limits on the magnitudes of the deflection rates (63), rad/s.
    pub rate: Surfaces,
    /// Whether each surface may be used; otherwise it is kept at zero. In (65) all but the rudders
    /// may.
    pub allowed: [bool; SURFACES],
    /// Dynamic pressure for which `effectiveness` is given, Pa.
    pub reference_pressure: f64,
    /// Moment per deflection (matrix D_A, (58)), N m/rad; the values are representative, as the
    /// paper prints none.
    pub effectiveness: SMatrix<f64, 3, SURFACES>,
    /// Moment of each jet at full thrust (matrix D_RCS, (64)), N m.
    pub jet_moments: SMatrix<f64, 3, JETS>,
    /// Name of each aerodynamic surface.
    pub names: [String; SURFACES],
    /// Moments of surfaces that depend on the angle of attack and the Mach number. They add to
    /// those of `effectiveness`.
    pub tables: Vec<SurfaceTable>,
    /// Thrust of one jet when it is on, N.
    pub jet_force: f64,
    /// Replacement for the fourth column of `jet_moments` that mirrors the eighth, N m;
    /// [`Effectors::symmetric`] uses it.
    pub symmetric_jet_4: Vector3<f64>,
}

impl Effectors {
    /// Returns these effectors with jet 4 as the mirror image of jet 8: the printed 10944 N m
    /// breaks the symmetry of the other columns.
    #[must_use]
    pub fn symmetric(mut self) -> Self {
        self.jet_moments.set_column(3, &self.symmetric_jet_4);
        self
    }

    /// Returns the number of surfaces: those that a file leaves out come last and have no range.
    pub fn surfaces(&self) -> usize {
        let moves = |i: &usize| self.max[*i] > self.min[*i];
        (0..SURFACES).rev().find(moves).map_or(0, |last| last + 1)
    }

    /// Returns the number of jets: those that a file leaves out come last and have no moment.
    pub fn jets(&self) -> usize {
        let acts = |j: &usize| self.jet_moments.column(*j).amax() > 0.0;
        (0..JETS).rev().find(acts).map_or(0, |last| last + 1)
    }

    /// Refuses values out of range, also those of restored effectors, which may be corrupt. The
    /// message begins with the key at fault.
    pub(crate) fn check(&self) -> Result<(), String> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.reference_pressure) {
            let pressure = self.reference_pressure;
            return Err(format!("surfaces.reference_pressure: {pressure} Pa must be positive"));
        }
        if !positive(self.jet_force) {
            return Err(format!("jets.force: {} N must be positive", self.jet_force));
        }
        for (i, name) in self.names.iter().enumerate() {
            // Zero must lie within the limits because deflections start there.
            let holds_zero = self.min[i] <= 0.0 && 0.0 <= self.max[i];
            let turns = self.max[i].max(-self.min[i]) > std::f64::consts::PI;
            if turns || !holds_zero {
                return Err(format!(
                    "surfaces.min_deg: the limits min_deg and max_deg of '{name}' must hold 0 and lie within 180 degrees"
                ));
            }
            if !positive(self.rate[i]) {
                return Err(format!("surfaces.rate_deg_s: the rate of '{name}' must be positive"));
            }
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        if !finite(self.effectiveness.as_slice()) {
            return Err("surfaces.effectiveness_deg: holds a value that is not finite".into());
        }
        if !finite(self.jet_moments.as_slice()) || !finite(self.symmetric_jet_4.as_slice()) {
            return Err(
                "jets.moment: this or symmetric_jet_4 holds a value that is not finite".into()
            );
        }
        if self.tables.iter().all(|table| table.surface < SURFACES && table.fits()) {
            return Ok(());
        }
        Err("surfaces.table: a table is not full".into())
    }

    /// Surface effectiveness D_A of Wu 2015 (58) at a dynamic pressure (Pa), N m/rad. The moment of
    /// the surfaces is D_A δ_A, (57).
    pub fn effectiveness_at(&self, dynamic_pressure: f64) -> SMatrix<f64, 3, SURFACES> {
        self.effectiveness * (dynamic_pressure / self.reference_pressure)
    }

    /// Moment of the surfaces with tables in a flow (N m), for `deflections` (rad).
    pub fn moment_of_tables(&self, flow: &Flow, deflections: &Surfaces) -> Vector3<f64> {
        moment_of_tables(&self.tables, flow, deflections)
    }

    /// Moment D_RCS δ_RCS of Wu 2015 (57) in N m; `duty` runs from 0 (off) to 1 (full thrust).
    pub fn moment_of_jets(&self, duty: &Jets) -> Vector3<f64> {
        self.jet_moments * duty
    }
}

/// Moment of surfaces with these tables in a flow (N m), for `deflections` (rad).
pub(crate) fn moment_of_tables(
    tables: &[SurfaceTable],
    flow: &Flow,
    deflections: &Surfaces,
) -> Vector3<f64> {
    tables.iter().fold(Vector3::zeros(), |mut sum, table| {
        sum[table.axis] += table.moment(flow, deflections[table.surface]);
        sum
    })
}

#[cfg(test)]
mod tests;
