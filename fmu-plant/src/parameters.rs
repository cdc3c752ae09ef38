//! Parameters of the FMU. Their defaults are the scenario of Chai 2022.

use crate::entry::{EntryParameters, VehicleFile};
use crate::sensing::{NEVER, Sensing};
use fmi_export::SettingsFile;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use vehicle::actuators::{self, JetMode};
use vehicle::atmosphere::{Air, Flight, air};
use vehicle::axes::{ANGLES, AXES, Entry, RATES};
use vehicle::disturbance::{
    Disturbance, DisturbanceKind, DisturbanceTable, MomentWave, Row, SineMoment,
};
use vehicle::dynamics::Inertia;
use vehicle::effectors::EffectorFault;
use vehicle::entry::{Motion, Passage};
use vehicle::error::Error;
use vehicle::kinematics::Kinematics;
use vehicle::plant::{BETA_LIMIT, Config, state};
use vehicle::transport;
use vehicle::{Scenario, Vehicle};

/// Default of the longest integration step, s.
const STEP: f64 = 0.01;

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

/// Parameters that a user sets before the simulation, in the order of the variable table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Parameters {
    /// Ratio of the actual {} of the inertia to that of the vehicle.
    #[setting(name = "inertia.ratio", each = INERTIA, min = 0.0, max = 10.0, nominal = 1.0)]
    pub(crate) inertia_ratios: [f64; 6],
    /// Ratio of the actual to the nominal inertia besides inertia.ratio: 1.05 means 5 % more.
    #[setting(name = "inertia.scale", min = 0.01, max = 100.0, nominal = 1.0)]
    pub(crate) inertia_scale: f64,
    pub(crate) initial: Initial,
    #[setting(name = "disturbance.kind")]
    pub(crate) kind: DisturbanceKind,
    /// Bound on the disturbance of the second time derivative of each attitude angle.
    #[setting(name = "disturbance.bound", unit = "rad/s2", min = 0.0, max = 10.0, nominal = 0.03)]
    #[setting(
        used_with = "disturbance.kind = white or constant or square or alongRate or againstMoment or table"
    )]
    pub(crate) bound: f64,
    /// Time for which disturbances of the kinds white, alongRate and againstMoment are held.
    #[setting(name = "disturbance.period", unit = "s", min = 1e-4, nominal = 0.04)]
    #[setting(used_with = "disturbance.kind = white or alongRate or againstMoment")]
    pub(crate) period: f64,
    /// Seed of the white noise; the same seed gives the same noise.
    #[setting(name = "disturbance.seed", min = 0, used_with = "disturbance.kind = white")]
    pub(crate) seed: u64,
    /// Factor on disturbance.bound.
    #[setting(name = "disturbance.direction", each = ANGLES, min = -1, max = 1, nominal = 1)]
    #[setting(used_with = "disturbance.kind = constant or square")]
    pub(crate) direction: Vector3<f64>,
    /// Period of the square wave, which starts with its positive half at disturbance.start.
    #[setting(name = "disturbance.square.period", unit = "s", min = 1e-3, nominal = 10.0)]
    #[setting(used_with = "disturbance.kind = square")]
    pub(crate) square_period: f64,
    /// Constant part of the sine disturbance moment.
    #[setting(name = "disturbance.sine.offset", each = AXES, unit = "N.m", nominal = 1e4)]
    #[setting(used_with = "disturbance.kind = sine")]
    pub(crate) sine_offset: Vector3<f64>,
    /// Sinusoidal part of the sine disturbance moment.
    #[setting(name = "disturbance.sine", each = WAVES, used_with = "disturbance.kind = sine")]
    pub(crate) waves: [MomentWave; 2],
    /// Time at which the disturbance starts.
    #[setting(name = "disturbance.start", unit = "s", used_with = "disturbance.kind != none")]
    pub(crate) start: f64,
    /// Time at which the disturbance ends.
    #[setting(name = "disturbance.end", unit = "s", used_with = "disturbance.kind != none")]
    pub(crate) end: f64,
    /// Maximum step size of the Runge-Kutta integration.
    #[setting(name = "integrator.step", unit = "s", min = 1e-5, max = 1.0, nominal = 0.01)]
    #[setting(used_with = "co-simulation")]
    pub(crate) step: f64,
    pub(crate) actuation: Actuation,
    #[setting(used_with = "translation = given")]
    pub(crate) flight: Flight,
    /// Ratio of the actual air density to that of the standard atmosphere: 0.9 means 10 % less.
    #[setting(name = "density.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    pub(crate) density_scale: f64,
    /// Ratio of the actual to the nominal effectiveness of the surfaces: 0.9 means 10 % less.
    #[setting(name = "aerodynamics.scale", min = 0.0, max = 10.0, nominal = 1.0)]
    #[setting(used_with = "actuation = surfacesAndJets")]
    pub(crate) aerodynamics_scale: f64,
    /// If true, jets give any thrust from 0 to 1; if false, they are fully on from a command of
    /// 0.5.
    #[setting(name = "jets.duty", used_with = "actuation = surfacesAndJets")]
    pub(crate) jet_duty: bool,
    /// If true, jet 4 mirrors jet 8; if false, it is as printed in (64) of Wu 2015, which is not
    /// symmetric.
    #[setting(name = "jets.symmetric", used_with = "actuation = surfacesAndJets")]
    pub(crate) jet_symmetric: bool,
    #[setting(name = "effector.fault", used_with = "actuation = surfacesAndJets")]
    pub(crate) effector_fault: EffectorFault,
    pub(crate) kinematics: Kinematics,
    /// Angular rate of the Earth: 7.2921e-5 rad/s, or 0 to neglect the rotation.
    #[setting(name = "trajectory.earthRate", unit = "rad/s", min = 0.0, max = 1.0, nominal = 1e-4)]
    #[setting(used_with = "translation = given")]
    pub(crate) earth_rate: f64,
    #[setting(name = "")]
    pub(crate) sensing: Sensing,
    #[setting(name = "")]
    pub(crate) converter: Converter,
    #[setting(name = "")]
    pub(crate) table: Table,
    #[setting(name = "")]
    pub(crate) entry: EntryParameters,
    #[setting(name = "")]
    pub(crate) vehicle: VehicleFile,
    #[setting(name = "")]
    pub(crate) settings: SettingsFile,
}

/// Names of the entries of the inertia.
const INERTIA: [Entry; 6] = [
    (".Ixx", "roll moment"),
    (".Iyy", "pitch moment"),
    (".Izz", "yaw moment"),
    (".Ixz", "product of the roll and yaw axes"),
    (".Ixy", "product of the roll and pitch axes"),
    (".Iyz", "product of the pitch and yaw axes"),
];

/// Names of the two sinusoids of the disturbance moment.
const WAVES: [Entry; 2] = [(".first", "first"), (".second", "second")];

/// Largest initial angle of attack and bank angle, rad.
const TURN: f64 = 2.0 * std::f64::consts::PI;

/// Initial state of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Initial {
    /// Initial angle of attack.
    #[setting(unit = "rad", min = -TURN, max = TURN, nominal = 0.1)]
    pub(crate) alpha: f64,
    /// Initial sideslip angle.
    #[setting(unit = "rad", min = -BETA_LIMIT, max = BETA_LIMIT, nominal = 0.1)]
    pub(crate) beta: f64,
    /// Initial bank angle.
    #[setting(unit = "rad", min = -TURN, max = TURN, nominal = 0.1)]
    pub(crate) sigma: f64,
    /// Initial body rate.
    #[setting(name = "", each = RATES, unit = "rad/s", min = -10.0, max = 10.0, nominal = 0.05)]
    pub(crate) rates: Vector3<f64>,
}

impl Initial {
    pub(crate) fn new(angles: Vector3<f64>, rates: Vector3<f64>) -> Self {
        Self { alpha: angles.x, beta: angles.y, sigma: angles.z, rates }
    }

    /// Returns the initial angles Θ, rad.
    pub(crate) fn angles(&self) -> Vector3<f64> {
        Vector3::new(self.alpha, self.beta, self.sigma)
    }
}

/// Parameters of the converter of the input moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Converter {
    /// Delay of the input moment, which is then held over each communication step.
    #[setting(name = "actuation.delay", unit = "s", min = 0.0, max = transport::LONGEST, nominal = 0.1)]
    #[setting(used_with = "actuation = moment and co-simulation")]
    pub(crate) delay: f64,
    /// Quantization step of the input moment, which is then held over each communication step; 0
    /// for none.
    #[setting(name = "actuation.resolution", unit = "N.m", min = 0.0, nominal = 10.0)]
    #[setting(used_with = "actuation = moment and co-simulation")]
    pub(crate) resolution: f64,
}

/// Lookup table of the disturbance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub(crate) struct Table {
    /// Number of rows of the disturbance's lookup table that are used.
    #[setting(name = "disturbance.table.rows", min = 0, max = TABLE_ROWS)]
    #[setting(used_with = "disturbance.kind = table")]
    pub(crate) used: usize,
    /// Period with which the lookup table repeats from disturbance.start on; 0 holds the last row
    /// instead.
    #[setting(name = "disturbance.table.period", unit = "s", min = 0.0, nominal = 10.0)]
    #[setting(used_with = "disturbance.kind = table and disturbance.table.rows > 0")]
    pub(crate) period: f64,
    /// The rows.
    #[setting(name = "disturbance.table", by_column)]
    #[setting(used_with = "disturbance.kind = table and disturbance.table.rows >= {#}")]
    pub(crate) rows: [Row; TABLE_ROWS],
}

impl Default for Parameters {
    fn default() -> Self {
        let scenario = Scenario::crmpc2022();
        let tvsmc = Scenario::tvsmc2015();
        let sine = tvsmc.disturbance.sine;
        let Disturbance { kind, bound, period, seed, direction, square_period, start, end, .. } =
            scenario.disturbance;
        let wave = |i: usize| sine.waves.get(i).copied().unwrap_or_default();
        Self {
            inertia_ratios: [1.0; 6],
            inertia_scale: scenario.inertia_scale,
            initial: Initial::new(scenario.initial_angles, scenario.initial_rates),
            kind,
            bound,
            period,
            seed,
            direction,
            square_period,
            sine_offset: sine.offset,
            waves: [wave(0), wave(1)],
            start,
            end: end.min(NEVER),
            step: STEP,
            kinematics: Kinematics::Printed,
            earth_rate: 0.0,
            actuation: Actuation::default(),
            flight: tvsmc.flight.unwrap_or(Flight { altitude: 0.0, mach: 0.0 }),
            density_scale: 1.0,
            aerodynamics_scale: 1.0,
            jet_duty: false,
            jet_symmetric: false,
            effector_fault: EffectorFault::default(),
            sensing: Sensing::default(),
            converter: Converter::default(),
            table: Table::default(),
            entry: EntryParameters::default(),
            vehicle: VehicleFile::default(),
            settings: SettingsFile::default(),
        }
    }
}

impl Parameters {
    /// Dynamic pressure of the fixed flight condition with the density scale, Pa.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    fn dynamic_pressure(&self) -> Result<f64, Error> {
        Ok(self.flight.dynamic_pressure()? * self.density_scale)
    }

    /// Fixed flight condition, without forces, and the motion that belongs to it.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    pub(crate) fn fixed(&self) -> Result<(Passage, Motion), Error> {
        let Flight { altitude, mach } = self.flight;
        let known_pressure = self.flight.dynamic_pressure()?;
        let Air { density, sound_speed, .. } = air(altitude)?;
        let airspeed = mach * sound_speed;
        let passage = Passage {
            density: density * self.density_scale,
            known_pressure,
            dynamic_pressure: self.dynamic_pressure()?,
            mach,
            airspeed,
            ..Passage::default()
        };
        Ok((passage, Motion::new(altitude, 0.0, 0.0, airspeed, 0.0, 0.0)))
    }

    /// Lookup table of the disturbance, with the rows that are used.
    fn table(&self) -> Result<DisturbanceTable, Error> {
        let Table { used, period, rows } = &self.table;
        let rows = rows.get(..*used).ok_or_else(|| Error::Parameter {
            name: "disturbance.table.rows".into(),
            problem: format!("= {used} must lie between 0 and {TABLE_ROWS}"),
        })?;
        Ok(DisturbanceTable { period: *period, rows: rows.to_vec() })
    }

    /// Configuration of the actuators, or `None` if the control moment is an input.
    fn actuators(&self, vehicle: &Vehicle) -> Result<Option<actuators::Config>, Error> {
        if self.actuation == Actuation::Moment {
            return Ok(None);
        }
        let effectors = vehicle.effectors.clone().unwrap_or_default();
        Ok(Some(actuators::Config {
            effectors: if self.jet_symmetric { effectors.symmetric() } else { effectors },
            jet_mode: if self.jet_duty { JetMode::Duty } else { JetMode::OnOff },
            dynamic_pressure: self.dynamic_pressure()?,
            mach: self.flight.mach,
            aerodynamics_scale: self.aerodynamics_scale,
            fault: self.effector_fault,
        }))
    }

    /// Configuration of the plant that these parameters describe, with the vehicle of a file if
    /// there is one.
    ///
    /// # Errors
    /// Names the parameter that is out of range.
    #[allow(non_snake_case)]
    pub(crate) fn config(&self, file: Option<&Vehicle>) -> Result<Config, Error> {
        let vehicle = file.unwrap_or_else(|| Vehicle::papers());
        let Inertia { Ixx, Iyy, Izz, Ixz, Ixy, Iyz } = vehicle.inertia;
        let [xx, yy, zz, xz, xy, yz] = self.inertia_ratios;
        Ok(Config {
            inertia: Inertia {
                Ixx: Ixx * xx,
                Iyy: Iyy * yy,
                Izz: Izz * zz,
                Ixz: Ixz * xz,
                Ixy: Ixy * xy,
                Iyz: Iyz * yz,
            },
            inertia_scale: self.inertia_scale,
            initial: state(&self.initial.angles(), &self.initial.rates),
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
            motion: if self.entry.is_entry() { self.entry.start.motion() } else { self.fixed()?.1 },
            entry: self.entry.config(self.density_scale, vehicle),
            kinematics: self.kinematics,
            earth_rate: self.earth_rate,
            actuators: self.actuators(vehicle)?,
            moment_delay: self.converter.delay,
            moment_resolution: self.converter.resolution,
            surroundings: self.sensing.surroundings,
            sensors: self.sensing.sensors(),
            turntable: self.sensing.turntable,
            step: self.step,
        })
    }
}
