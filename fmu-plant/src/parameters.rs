//! Parameters of the FMU. Their defaults are the scenario of Chai 2022.

use fmi2_export::Enumeration;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use vehicle::Scenario;
use vehicle::actuators::{self, JetMode};
use vehicle::atmosphere::Flight;
use vehicle::calibration::Sequence;
use vehicle::disturbance::{
    Disturbance, DisturbanceKind, DisturbanceTable, MomentWave, Row, SineMoment,
};
use vehicle::dynamics::Inertia;
use vehicle::effectors::Effectors;
use vehicle::error::Error;
use vehicle::kinematics::Kinematics;
use vehicle::plant::{Config, state};
use vehicle::platform::Surroundings;
use vehicle::sensor_data::SensorData;
use vehicle::sensors::{self, Line};
use vehicle::triad::Triad;
use vehicle::turntable;

/// Default of the longest integration step, s.
const STEP: f64 = 0.01;
/// Time (s) that no simulation reaches. It replaces an infinite number, which not all FMI importers
/// can read.
const NEVER: f64 = 1e15;

/// Number of rows of the disturbance's lookup table for which there are variables.
pub(crate) const TABLE_ROWS: usize = 8;

/// Source of the control moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub(crate) enum Actuation {
    /// The input moment acts, delayed by actuation.delay and rounded to actuation.resolution.
    #[default]
    Moment,
    /// The inputs surface and jet command eight aerodynamic surfaces and ten jets.
    SurfacesAndJets,
}

/// Value of `sensor.set` without sampling: the FMU outputs the readings of ideal sensors.
pub(crate) const NO_SENSORS: i32 = 0;
/// Value of `sensor.set` for sampled sensors without errors.
const IDEAL_SENSORS: i32 = 1;
/// Value of `sensor.set` for sampled sensors with the errors given by the parameters.
pub(crate) const MEMS_SENSORS: i32 = 2;

/// Parameters that a user sets before the simulation, named as in the variable table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Parameters {
    pub(crate) inertia: Inertia,
    pub(crate) inertia_scale: f64,
    pub(crate) initial_angles: Vector3<f64>,
    pub(crate) initial_rates: Vector3<f64>,
    pub(crate) kind: DisturbanceKind,
    pub(crate) bound: f64,
    pub(crate) period: f64,
    pub(crate) seed: u64,
    pub(crate) direction: Vector3<f64>,
    pub(crate) square_period: f64,
    pub(crate) sine_offset: Vector3<f64>,
    pub(crate) waves: [MomentWave; 2],
    /// Number of rows of the lookup table that are used.
    pub(crate) table_rows: usize,
    pub(crate) table_period: f64,
    pub(crate) table: [Row; TABLE_ROWS],
    pub(crate) start: f64,
    pub(crate) end: f64,
    pub(crate) step: f64,
    pub(crate) kinematics: Kinematics,
    pub(crate) earth_rate: f64,
    pub(crate) actuation: Actuation,
    pub(crate) moment_delay: f64,
    pub(crate) moment_resolution: f64,
    pub(crate) flight: Flight,
    pub(crate) density_scale: f64,
    pub(crate) aerodynamics_scale: f64,
    pub(crate) jet_duty: bool,
    pub(crate) jet_symmetric: bool,
    pub(crate) sensor_set: i32,
    pub(crate) triads: [Triad; 3],
    pub(crate) line: Line,
    pub(crate) sensor_seed: u64,
    pub(crate) turntable: turntable::Config,
    pub(crate) surroundings: Surroundings,
    pub(crate) calibrates: bool,
    pub(crate) sequence: Sequence,
}

impl Default for Parameters {
    fn default() -> Self {
        let scenario = Scenario::crmpc2022();
        let tvsmc = Scenario::tvsmc2015();
        let sine = tvsmc.disturbance.sine;
        let Disturbance { kind, bound, period, seed, direction, square_period, start, end, .. } =
            scenario.disturbance;
        let sensors = SensorData::embedded();
        let mut line = sensors.line;
        line.drop_window.end = line.drop_window.end.min(NEVER);
        let wave = |i: usize| sine.waves.get(i).copied().unwrap_or_default();
        Self {
            inertia: scenario.inertia,
            inertia_scale: scenario.inertia_scale,
            initial_angles: scenario.initial_angles,
            initial_rates: scenario.initial_rates,
            kind,
            bound,
            period,
            seed,
            direction,
            square_period,
            sine_offset: sine.offset,
            waves: [wave(0), wave(1)],
            table_rows: 0,
            table_period: 0.0,
            table: [Row::default(); TABLE_ROWS],
            start,
            end: end.min(NEVER),
            step: STEP,
            kinematics: Kinematics::Printed,
            earth_rate: 0.0,
            actuation: Actuation::default(),
            moment_delay: 0.0,
            moment_resolution: 0.0,
            flight: tvsmc.flight.unwrap_or(Flight { altitude: 0.0, mach: 0.0 }),
            density_scale: 1.0,
            aerodynamics_scale: 1.0,
            jet_duty: false,
            jet_symmetric: false,
            sensor_set: NO_SENSORS,
            triads: sensors.mems,
            line,
            sensor_seed: 1,
            turntable: turntable::Config::default(),
            surroundings: sensors.surroundings,
            calibrates: false,
            sequence: sensors.calibration,
        }
    }
}

impl Parameters {
    /// Dynamic pressure of the flight with the density scale, Pa.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub(crate) fn dynamic_pressure(&self) -> Result<f64, Error> {
        Ok(self.flight.dynamic_pressure()? * self.density_scale)
    }

    /// Lookup table of the disturbance, with the rows that are used.
    fn table(&self) -> Result<DisturbanceTable, Error> {
        let rows = self.table.get(..self.table_rows).ok_or_else(|| Error::Parameter {
            name: "disturbance.table.rows".into(),
            problem: format!("= {} must lie between 0 and {TABLE_ROWS}", self.table_rows),
        })?;
        Ok(DisturbanceTable { period: self.table_period, rows: rows.to_vec() })
    }

    /// Configuration of the actuators, or `None` if the control moment is an input.
    fn actuators(&self) -> Result<Option<actuators::Config>, Error> {
        if self.actuation == Actuation::Moment {
            return Ok(None);
        }
        let effectors = Effectors::published();
        Ok(Some(actuators::Config {
            effectors: if self.jet_symmetric { effectors.symmetric() } else { effectors },
            jet_mode: if self.jet_duty { JetMode::Duty } else { JetMode::OnOff },
            dynamic_pressure: self.dynamic_pressure()?,
            aerodynamics_scale: self.aerodynamics_scale,
        }))
    }

    /// Configuration of the sampled sensors, or `None` if the FMU outputs the readings of ideal
    /// sensors.
    fn sensors(&self) -> Option<sensors::Config> {
        let triads = match self.sensor_set {
            NO_SENSORS => return None,
            IDEAL_SENSORS => {
                let ideal = SensorData::embedded().ideal;
                // Freezing is not an error of the sensor set, so the ideal set keeps it.
                std::array::from_fn(|i| Triad { freeze: self.triads[i].freeze, ..ideal[i] })
            }
            _ => self.triads,
        };
        Some(sensors::Config { triads, line: self.line, seed: self.sensor_seed })
    }

    /// Configuration of the plant that these parameters describe.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub(crate) fn config(&self) -> Result<Config, Error> {
        Ok(Config {
            inertia: self.inertia,
            inertia_scale: self.inertia_scale,
            initial: state(&self.initial_angles, &self.initial_rates),
            disturbance: Disturbance {
                kind: self.kind,
                bound: self.bound,
                period: self.period,
                seed: self.seed,
                direction: self.direction,
                square_period: self.square_period,
                sine: SineMoment { offset: self.sine_offset, waves: self.waves.to_vec() },
                table: self.table()?,
                start: self.start,
                end: self.end,
            },
            kinematics: self.kinematics,
            earth_rate: self.earth_rate,
            actuators: self.actuators()?,
            moment_delay: self.moment_delay,
            moment_resolution: self.moment_resolution,
            calibration: self.calibrates.then_some(self.sequence),
            surroundings: self.surroundings,
            sensors: self.sensors(),
            turntable: self.turntable,
            step: self.step,
        })
    }
}
