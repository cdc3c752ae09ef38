//! Scenarios: vehicle, initial state, limits, disturbance and reference as data. Those of the
//! papers are embedded.

use crate::atmosphere::Flight;
use crate::data;
use crate::disturbance::{Disturbance, DisturbanceKind, DisturbanceTable, SineMoment};
use crate::dynamics::Inertia;
use crate::entry::Motion;
use crate::error::Error;
use crate::kinematics::Kinematics;
use crate::plant::{self, Config};
use crate::platform::Surroundings;
use crate::profile::{AngleProfile, Profile, Segment, Wave};
use crate::turntable;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

const CRMPC_2022: (&str, &str) = ("crmpc-2022.toml", include_str!("../data/crmpc-2022.toml"));
const TVSMC_2015: (&str, &str) = ("tvsmc-2015.toml", include_str!("../data/tvsmc-2015.toml"));
const TWO_LOOP_SMC: (&str, &str) = ("two-loop-smc.toml", include_str!("../data/two-loop-smc.toml"));

/// Scenario: a vehicle and the manoeuvre that it has to fly, in SI units and radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// Length of the experiment, s.
    pub duration: f64,
    /// Nominal inertia, which is the one that a controller knows.
    pub inertia: Inertia,
    /// Factor from the nominal inertia to that of the vehicle.
    pub inertia_scale: f64,
    /// Flight condition, if the scenario states one.
    pub flight: Option<Flight>,
    /// Attitude angles Θ at the start, rad.
    pub initial_angles: Vector3<f64>,
    /// Body rates ω at the start, rad/s.
    pub initial_rates: Vector3<f64>,
    /// Limit on ‖ω‖, rad/s; infinite if the scenario states none.
    pub limit_rate: f64,
    /// Limit on ‖m‖, N m; infinite if the scenario states none.
    pub limit_moment: f64,
    /// Disturbance of the vehicle, with its bound (rad/s²) and period (s).
    pub disturbance: Disturbance,
    /// Reference attitude Θ_r over time.
    pub reference: Profile,
}

impl Scenario {
    /// Scenario of Chai 2022, section 5.1.
    pub fn crmpc2022() -> Self {
        static READ: LazyLock<Scenario> = LazyLock::new(|| embedded(CRMPC_2022));
        READ.clone()
    }

    /// Scenario of Wu 2015, section 6.
    pub fn tvsmc2015() -> Self {
        static READ: LazyLock<Scenario> = LazyLock::new(|| embedded(TVSMC_2015));
        READ.clone()
    }

    /// Scenario of Jia, Zhou, Zhou, section V.
    pub fn two_loop() -> Self {
        static READ: LazyLock<Scenario> = LazyLock::new(|| embedded(TWO_LOOP_SMC));
        READ.clone()
    }

    /// Reads a scenario from the text of a file, which `file` names in messages. The files in
    /// `data/` show the form.
    ///
    /// # Errors
    /// Says which entry is missing, unknown or out of range, and where it stands.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Error> {
        let refuse = |problem: String| Error::Scenario { file: file.into(), problem };
        let parsed: File = toml::from_str(text).map_err(|error| refuse(error.to_string()))?;
        parsed.into_scenario().checked(file)
    }

    fn checked(self, file: &str) -> Result<Self, Error> {
        let refuse = |problem: String| Error::Scenario { file: file.into(), problem };
        let scenario = self;
        if let Profile::Piecewise(segments) = &scenario.reference {
            let in_order = segments.windows(2).all(|pair| pair[0].until < pair[1].until);
            if !in_order || segments.last().is_none_or(|last| last.until.is_finite()) {
                return Err(refuse(
                    "reference.segment: 'until' must increase, and only the last has none".into(),
                ));
            }
        }
        if let Some(flight) = scenario.flight {
            flight.dynamic_pressure().map_err(|error| refuse(error.to_string()))?;
        }
        plant::Plant::new(&scenario.config(1.0), 0.0).map_err(|error| refuse(error.to_string()))?;
        Ok(scenario)
    }

    /// Returns the plant's configuration for this scenario, with a control moment as input and
    /// integration steps no longer than `step` (s).
    pub fn config(&self, step: f64) -> Config {
        Config {
            inertia: self.inertia,
            inertia_scale: self.inertia_scale,
            initial: plant::state(&self.initial_angles, &self.initial_rates),
            disturbance: self.disturbance.clone(),
            kinematics: Kinematics::Printed,
            earth_rate: 0.0,
            actuators: None,
            moment_delay: 0.0,
            moment_resolution: 0.0,
            motion: Motion::zeros(),
            entry: None,
            surroundings: Surroundings::default(),
            sensors: None,
            turntable: turntable::Config::default(),
            step,
        }
    }
}

fn embedded((file, text): (&str, &str)) -> Scenario {
    // This cannot fail: a test reads every embedded file.
    let scenario = data::embedded::<File>(file, text).into_scenario();
    scenario.checked(file).unwrap_or_else(|error| panic!("{error}"))
}

// The structures below mirror the files, with the units printed in the papers named in the keys.

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    duration: f64,
    inertia: FileInertia,
    initial: FileInitial,
    flight: Option<Flight>,
    #[serde(default)]
    limit: FileLimit,
    disturbance: FileDisturbance,
    reference: FileReference,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
struct FileInertia {
    Ixx: f64,
    Iyy: f64,
    Izz: f64,
    Ixz: f64,
    scale: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileInitial {
    angles_deg: Vector3<f64>,
    rates_deg_s: Vector3<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileLimit {
    rate_deg_s: Option<f64>,
    moment: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileDisturbance {
    kind: DisturbanceKind,
    #[serde(default)]
    bound_deg_s2: f64,
    period: f64,
    seed: Option<u64>,
    direction: Option<Vector3<f64>>,
    square_period: Option<f64>,
    #[serde(default)]
    sine: SineMoment,
    #[serde(default)]
    table: DisturbanceTable,
    start: Option<f64>,
    end: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileReference {
    segment: Vec<FileSegment>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSegment {
    until: Option<f64>,
    alpha: FileAngleProfile,
    beta: FileAngleProfile,
    sigma: FileAngleProfile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileAngleProfile {
    constant_deg: f64,
    #[serde(default)]
    wave: Vec<FileWave>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileWave {
    frequency: f64,
    #[serde(default)]
    sine_deg: f64,
    #[serde(default)]
    cosine_deg: f64,
}

impl File {
    fn into_scenario(self) -> Scenario {
        let FileInertia { Ixx, Iyy, Izz, Ixz, scale } = self.inertia;
        let segments = self.reference.segment.into_iter().map(FileSegment::into_segment).collect();
        Scenario {
            duration: self.duration,
            inertia: Inertia { Ixx, Iyy, Izz, Ixz, ..Inertia::default() },
            inertia_scale: scale,
            flight: self.flight,
            initial_angles: self.initial.angles_deg.map(f64::to_radians),
            initial_rates: self.initial.rates_deg_s.map(f64::to_radians),
            limit_rate: self.limit.rate_deg_s.map_or(f64::INFINITY, f64::to_radians),
            limit_moment: self.limit.moment.unwrap_or(f64::INFINITY),
            disturbance: self.disturbance.into_disturbance(),
            reference: Profile::Piecewise(segments),
        }
    }
}

impl FileDisturbance {
    fn into_disturbance(self) -> Disturbance {
        let neutral = Disturbance::default();
        Disturbance {
            kind: self.kind,
            bound: self.bound_deg_s2.to_radians(),
            period: self.period,
            seed: self.seed.unwrap_or(neutral.seed),
            direction: self.direction.unwrap_or(neutral.direction),
            square_period: self.square_period.unwrap_or(neutral.square_period),
            sine: self.sine,
            table: self.table,
            start: self.start.unwrap_or(neutral.start),
            end: self.end.unwrap_or(neutral.end),
        }
    }
}

impl FileSegment {
    fn into_segment(self) -> Segment {
        let angles = [self.alpha, self.beta, self.sigma].map(FileAngleProfile::into_profile);
        Segment { until: self.until.unwrap_or(f64::INFINITY), angles }
    }
}

impl FileAngleProfile {
    fn into_profile(self) -> AngleProfile {
        let wave = |wave: FileWave| Wave {
            frequency: wave.frequency,
            sine: wave.sine_deg.to_radians(),
            cosine: wave.cosine_deg.to_radians(),
        };
        AngleProfile {
            constant: self.constant_deg.to_radians(),
            waves: self.wave.into_iter().map(wave).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degrees(profile: &Profile, time: f64) -> Vector3<f64> {
        profile.at(time).angles.map(f64::to_degrees)
    }

    #[test]
    fn published_reference_of_crmpc2022() {
        let reference = Scenario::crmpc2022().reference;
        // Chai 2022, section 5.1, evaluated by hand at t = 0 and, with sin and cos of the printed
        // arguments, elsewhere
        let expected = [
            (0.0, 10.0, -25.0),
            (10.0, 10.0 + 2.5 * 5f64.sin(), -30.0 + 5.0 * 5f64.cos()),
            (25.0, 10.0 + 2.5 * 12.5f64.sin(), -30.0 + 5.0 * 12.5f64.cos()),
            (25.04, 10.0 + 0.5 * 6.26f64.cos(), -30.0 + 0.5 * 6.26f64.sin()),
            (50.0, 10.0 + 0.5 * 12.5f64.cos(), -30.0 + 0.5 * 12.5f64.sin()),
        ];
        for (time, alpha, sigma) in expected {
            let difference = degrees(&reference, time) - Vector3::new(alpha, 0.0, sigma);
            assert!(difference.norm() < 1e-12, "{difference} at {time}");
        }
    }

    #[test]
    fn published_jump_of_crmpc2022() {
        let reference = Scenario::crmpc2022().reference;
        let jump = degrees(&reference, 25.0 + 2e-7) - degrees(&reference, 25.0);
        assert!((jump - Vector3::new(0.67, 0.0, -5.0)).amax() < 0.006, "{jump}");
        // The first segment applies at the jump, however the 625th tick of 0.04 s is rounded.
        let accumulated = (0..625).fold(0.0, |time, _| time + 0.04);
        for time in [625.0 * 0.04, 125.0 * 0.2, 25f64.next_up(), accumulated] {
            assert!(
                (reference.at(time).angles - reference.at(25.0).angles).norm() < 1e-9,
                "{time}"
            );
        }
    }

    #[test]
    fn published_data_of_crmpc2022() {
        let scenario = Scenario::crmpc2022();
        assert_eq!(
            scenario.inertia,
            Inertia {
                Ixx: 588791.0,
                Iyy: 1303212.0,
                Izz: 1534163.0,
                Ixz: 24242.0,
                ..Inertia::default()
            }
        );
        assert!(
            (scenario.initial_angles.map(f64::to_degrees) - Vector3::new(7.5, 10.0, -30.0)).amax()
                < 1e-13
        );
        assert!((scenario.limit_rate - 0.0873).abs() < 5e-5);
        assert_eq!(scenario.limit_moment, 1.356e5);
        assert!((scenario.disturbance.bound - 0.0349).abs() < 1e-4);
        assert_eq!(scenario.disturbance.period, 0.04);
    }

    #[test]
    fn published_disturbance_and_command_of_tvsmc2015() {
        let scenario = Scenario::tvsmc2015();
        for time in [0.0, 3.0, 17.5] {
            let printed = (0.5 + (0.1f64 * time).sin() + time.sin()) * 1e4; // Wu 2015, (66)
            assert!((scenario.disturbance.moment(time) - Vector3::repeat(printed)).amax() < 1e-9);
            assert!(
                (degrees(&scenario.reference, time) - Vector3::new(30.0, 0.0, 60.0)).amax() < 1e-13
            );
        }
    }

    #[test]
    fn published_flight_condition_of_tvsmc2015() {
        assert_eq!(Scenario::tvsmc2015().flight, Some(Flight { altitude: 55e3, mach: 9.8 }));
        assert_eq!(Scenario::crmpc2022().flight, None);
    }

    #[test]
    fn two_loop_command_is_a_step_right_after_the_start() {
        let reference = Scenario::two_loop().reference;
        assert_eq!(degrees(&reference, 0.0), Vector3::zeros());
        assert!((degrees(&reference, 0.01) - Vector3::repeat(5.0)).amax() < 1e-13);
    }

    #[test]
    fn a_bad_file_is_refused_by_name() {
        let refusal = |from: &str, to: &str| {
            assert!(CRMPC_2022.1.contains(from));
            Scenario::from_toml("my.toml", &CRMPC_2022.1.replace(from, to)).unwrap_err().to_string()
        };
        for (from, to, named) in [
            ("Iyy = 1303212.0", "Iyyy = 1303212.0", "Iyyy"),
            ("rate_deg_s = 5.0", "rate = 5.0", "rate"),
            ("Ixz = 24242.0", "Ixz = 1e6", "inertia.Ixz"),
            ("Ixx = 588791.0", "Ixx = 1.0e5", "triangle"),
            ("period = 0.04", "period = 0.0", "disturbance.period"),
            ("until = 25.0", "", "until"),
            ("\"white\"", "\"pink\"", "pink"),
        ] {
            let message = refusal(from, to);
            assert!(message.contains("my.toml") && message.contains(named), "{message}");
        }
    }
}
