//! The air through which a vehicle enters: its density, its speed of sound, and winds.

use crate::atmosphere::air_anywhere;
use crate::axes::{HORIZONTAL, LEVEL};
use crate::error::{Error, finite, not_negative, positive};
use crate::math::{cos, exp};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::{Choice, Declared};
use std::f64::consts::TAU;

/// Number of rows of the air's profile over altitude for which there are settings.
pub const ROWS: usize = 6;

/// Density of the air over altitude.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
#[serde(rename_all = "camelCase")]
pub enum Density {
    /// the US Standard Atmosphere 1976, continued above 120 km at constant temperature.
    #[default]
    Standard,
    /// air.seaLevelDensity times the exponential of minus altitude over air.scaleHeight; the speed
    /// of sound stays that of the standard atmosphere.
    Exponential,
}

/// Air with its deviations from what an on-board computer knows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Air {
    /// Density of the air over altitude.
    #[setting(name = "air.density")]
    pub density: Density,
    /// Density at zero altitude of exponential air.
    #[setting(name = "air.seaLevelDensity", unit = "kg/m3", min = 0.0, nominal = 1.0)]
    #[setting(used_with = "air.density = exponential")]
    pub sea_level_density: f64,
    /// Height over which the density of exponential air falls by the factor e.
    #[setting(name = "air.scaleHeight", unit = "m", min = 1.0, nominal = 1e4)]
    #[setting(used_with = "air.density = exponential")]
    pub scale_height: f64,
    /// Number of rows of the air's profile that are used.
    #[setting(name = "air.rows", min = 0, max = ROWS)]
    pub rows: usize,
    /// Rows of the profile.
    #[setting(name = "air", by_column, used_with = "air.rows >= {#}")]
    pub profile: [Row; ROWS],
    /// Discrete gust.
    #[setting(name = "gust")]
    pub gust: Gust,
    /// Ratio of the density to that of the undisturbed air, at all altitudes.
    #[setting(skip)]
    pub scale: f64,
}

/// Deviations at one altitude. They are linear between the rows and constant beyond them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Row {
    /// Altitude of a row of the air's profile (row {#}).
    #[setting(unit = "m", nominal = 1e4)]
    pub altitude: f64,
    /// Ratio of the density to that of the undisturbed air (row {#}).
    #[setting(name = "densityRatio", min = 0.0, nominal = 1.0)]
    pub density: f64,
    /// Wind {} (row {#}).
    #[setting(each = HORIZONTAL, unit = "m/s", nominal = 10.0)]
    pub wind: [f64; 2],
}

/// A discrete gust, whose velocity grows and falls again as 1 − cos.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gust {
    /// Largest velocity of the gust, which blows in this direction.
    #[setting(name = "", each = LEVEL, unit = "m/s", nominal = 10.0)]
    pub velocity: Vector3<f64>,
    /// Time at which the gust begins.
    #[setting(unit = "s", nominal = 100.0)]
    #[setting(used_with = "(~.north != 0 or ~.east != 0 or ~.down != 0)")]
    pub start: f64,
    /// Duration of the gust.
    #[setting(unit = "s", min = 1e-3, nominal = 10.0)]
    #[setting(used_with = "(~.north != 0 or ~.east != 0 or ~.down != 0)")]
    pub duration: f64,
}

/// The air at one place and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditions {
    /// Density, kg/m³.
    pub density: f64,
    /// Density as an on-board computer knows it, without the deviations, kg/m³.
    pub known_density: f64,
    /// Speed of sound, m/s.
    pub sound_speed: f64,
    /// Velocity of the air to the north, to the east and down, m/s.
    pub wind: Vector3<f64>,
}

/// Air of the standard atmosphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Undisturbed {
    density: f64,
    sound_speed: f64,
}

impl Undisturbed {
    fn at(altitude: f64) -> Self {
        let crate::atmosphere::Air { density, sound_speed, .. } = air_anywhere(altitude);
        Self { density, sound_speed }
    }
}

/// The standard atmosphere along a short path, as a parabola through three points: to evaluate its
/// powers would take most of the time of an integration step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlongTheWay {
    middle: f64,
    half: f64,
    nodes: [Undisturbed; 3],
}

impl AlongTheWay {
    /// Makes the parabola for a path from an altitude that is likely to change by `change` (m).
    pub(crate) fn new(altitude: f64, change: f64) -> Self {
        let half = (0.5 * change.abs()).max(1.0).copysign(change);
        let middle = altitude + half;
        let nodes = [altitude, middle, middle + half].map(Undisturbed::at);
        Self { middle, half, nodes }
    }

    pub(crate) fn at(&self, altitude: f64) -> Undisturbed {
        let x = (altitude - self.middle) / self.half;
        let [first, second, third] = &self.nodes;
        let between = |value: fn(&Undisturbed) -> f64| {
            let (a, b, c) = (value(first), value(second), value(third));
            b + x * ((c - a) / 2.0 + x * (f64::midpoint(a, c) - b))
        };
        Undisturbed {
            density: between(|air| air.density),
            sound_speed: between(|air| air.sound_speed),
        }
    }
}

impl Default for Air {
    fn default() -> Self {
        Self {
            density: Density::Standard,
            sea_level_density: 1.225_57,
            scale_height: 7254.24,
            rows: 0,
            profile: [Row { density: 1.0, ..Row::default() }; ROWS],
            gust: Gust { velocity: Vector3::zeros(), start: 0.0, duration: 10.0 },
            scale: 1.0,
        }
    }
}

impl Air {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the value at fault.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name: String, problem: String| Err(Error::parameter(name, problem));
        not_negative("air.seaLevelDensity", self.sea_level_density, "")?;
        not_negative("density.scale", self.scale, "")?;
        positive("air.scaleHeight", self.scale_height, "")?;
        positive("gust.duration", self.gust.duration, "")?;
        let Gust { velocity, start, .. } = &self.gust;
        finite("gust", velocity.iter().chain([start]))?;
        let Some(used) = self.profile.get(..self.rows) else {
            return refuse(
                "air.rows".into(),
                format!("= {} must lie between 0 and {ROWS}", self.rows),
            );
        };
        for (i, row) in used.iter().enumerate() {
            let number = i + 1;
            not_negative(format!("air.densityRatio[{number}]"), row.density, "")?;
            for (part, direction) in row.wind.iter().zip(["north", "east"]) {
                if !part.is_finite() {
                    let name = format!("air.wind.{direction}[{number}]");
                    return refuse(name, "is not finite".into());
                }
            }
            let follows = i == 0 || row.altitude > used[i - 1].altitude;
            if !(row.altitude.is_finite() && follows) {
                let problem = format!("= {} m must lie above the row before", row.altitude);
                return refuse(format!("air.altitude[{number}]"), problem);
            }
        }
        Ok(())
    }

    /// Returns the air at `time` (s) and `altitude` (m).
    pub fn at(&self, time: f64, altitude: f64) -> Conditions {
        self.deviating(time, altitude, &Undisturbed::at(altitude))
    }

    /// Returns the air at `time` (s) and `altitude` (m), given the standard atmosphere there.
    pub(crate) fn deviating(&self, time: f64, altitude: f64, standard: &Undisturbed) -> Conditions {
        let known_density = match self.density {
            Density::Standard => standard.density,
            Density::Exponential => self.sea_level_density * exp(-altitude / self.scale_height),
        };
        let row = self.row(altitude);
        let [north, east] = row.wind;
        Conditions {
            density: known_density * self.scale * row.density,
            known_density,
            sound_speed: standard.sound_speed,
            wind: Vector3::new(north, east, 0.0) + self.gust.at(time),
        }
    }

    /// Deviations at an altitude.
    fn row(&self, altitude: f64) -> Row {
        let rows = &self.profile[..self.rows.min(ROWS)];
        let (Some(lowest), Some(highest)) = (rows.first(), rows.last()) else {
            return Row { density: 1.0, ..Row::default() };
        };
        let next = rows.partition_point(|row| row.altitude <= altitude);
        let (below, above) = match next {
            0 => return *lowest,
            next if next == rows.len() => return *highest,
            next => (rows[next - 1], rows[next]),
        };
        let share = (altitude - below.altitude) / (above.altitude - below.altitude);
        let between = |low: f64, high: f64| low + share * (high - low);
        Row {
            altitude,
            density: between(below.density, above.density),
            wind: [0, 1].map(|i| between(below.wind[i], above.wind[i])),
        }
    }
}

impl Gust {
    /// Velocity of the gust at `time` (s), m/s.
    fn at(&self, time: f64) -> Vector3<f64> {
        let share = (time - self.start) / self.duration;
        if !(0.0..1.0).contains(&share) {
            return Vector3::zeros();
        }
        self.velocity * ((1.0 - cos(TAU * share)) / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_deviations_are_linear_between_the_rows() {
        let mut air = Air { rows: 2, ..Air::default() };
        air.profile[0] = Row { altitude: 2e4, density: 0.9, wind: [10.0, -20.0] };
        air.profile[1] = Row { altitude: 6e4, density: 1.1, wind: [30.0, 0.0] };
        for (altitude, ratio, wind) in [
            (1e4, 0.9, [10.0, -20.0]),
            (3e4, 0.95, [15.0, -15.0]),
            (6e4, 1.1, [30.0, 0.0]),
            (9e4, 1.1, [30.0, 0.0]),
        ] {
            let here = air.at(0.0, altitude);
            assert!((here.density / here.known_density - ratio).abs() < 1e-12);
            assert!((here.wind - Vector3::new(wind[0], wind[1], 0.0)).norm() < 1e-12);
        }
        let still = Air::default().at(0.0, 5.5e4);
        assert!((still.density / 5.681e-4 - 1.0).abs() < 1e-4 && still.wind.norm() == 0.0);
    }

    #[test]
    fn oracle_a_gust_rises_to_its_velocity_and_falls() {
        let velocity = Vector3::new(0.0, 8.0, 0.0);
        let air = Air { gust: Gust { velocity, start: 10.0, duration: 4.0 }, ..Air::default() };
        for (time, east) in [(9.9, 0.0), (11.0, 4.0), (12.0, 8.0), (13.0, 4.0), (14.0, 0.0)] {
            assert!((air.at(time, 3e4).wind.y - east).abs() < 1e-12, "{time}");
        }
    }

    #[test]
    fn oracle_a_parabola_is_the_standard_atmosphere_along_a_short_way() {
        for altitude in [1.2e5, 9e4, 6e4, 3e4] {
            for (change, relative) in [(-4.0, 1e-10), (-100.0, 1e-6), (0.0, 1e-10)] {
                let way = AlongTheWay::new(altitude, change);
                for share in [0.0, 0.3, 0.5, 1.0] {
                    let here = altitude + share * change;
                    let (near, exact) = (way.at(here), Undisturbed::at(here));
                    assert!((near.density / exact.density - 1.0).abs() < relative, "{altitude}");
                    assert!((near.sound_speed / exact.sound_speed - 1.0).abs() < relative);
                }
            }
        }
    }

    #[test]
    fn rows_out_of_order_are_refused_by_name() {
        let mut air = Air { rows: 2, ..Air::default() };
        let refusal = air.check().unwrap_err().to_string();
        assert!(refusal.contains("air.altitude[2]"), "{refusal}");
        air.rows = 7;
        assert!(air.check().unwrap_err().to_string().contains("air.rows"));
    }

    #[test]
    fn oracle_air_is_continuous_at_the_top() {
        let [below, above] =
            [119_999.0, 120_001.0].map(|altitude| Air::default().at(0.0, altitude));
        assert!((above.density / below.density - 1.0).abs() < 3e-4);
        assert!(Air::default().at(0.0, 2e5).density > 0.0);
    }
}
