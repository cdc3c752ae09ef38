//! Satellite navigation and star tracker, which give fixes of position, velocity and attitude.
//!
//! A fix is taken with the first sample of the other sensors at or after each multiple of its
//! period, and it travels with this sample on the line.

use crate::axes::{Entry, QUATERNION};
use crate::error::{Error, not_negative};
use crate::fault::{Fault, FaultKind};
use crate::frames::Place;
use crate::noise::{normal_pair, uniform};
use crate::time::tick_tolerance;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use settings::Declared;

/// Most by which a fault makes samples of the inertial sensors late, s.
pub const LATEST: f64 = 1.0;

/// Receiver of satellite navigation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Gnss {
    /// Time between two fixes of the satellite navigation; 0 for none.
    #[setting(unit = "s", min = 0.0, nominal = 1.0)]
    pub period: f64,
    /// Standard deviation of the position of a fix, along each axis.
    #[setting(name = "noise.position", unit = "m", min = 0.0, nominal = 5.0)]
    #[setting(used_with = "~.period > 0")]
    #[setting(file)]
    pub position_noise: f64,
    /// Standard deviation of the velocity of a fix, along each axis.
    #[setting(name = "noise.velocity", unit = "m/s", min = 0.0, nominal = 0.1)]
    #[setting(used_with = "~.period > 0")]
    #[setting(file)]
    pub velocity_noise: f64,
    /// Altitude at which the plasma begins to hold back the signals; it ends at blackout.bottom.
    #[setting(name = "blackout.top", unit = "m", nominal = 1e5, used_with = "~.period > 0", file)]
    pub blackout_top: f64,
    /// Altitude below which the signals are received again.
    #[setting(name = "blackout.bottom", unit = "m", nominal = 1e5, used_with = "~.period > 0")]
    #[setting(file)]
    pub blackout_bottom: f64,
    /// Fault of the receiver: {}
    #[setting(used_with = "~.period > 0")]
    pub fault: Fault,
}

/// Star tracker.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct StarTracker {
    /// Time between two fixes of the star tracker; 0 for none.
    #[setting(unit = "s", min = 0.0, nominal = 1.0)]
    pub period: f64,
    /// Standard deviation of the attitude of a fix, about each axis.
    #[setting(unit = "rad", min = 0.0, nominal = 1e-4, used_with = "~.period > 0", file)]
    pub noise: f64,
    /// Altitude above which the star tracker sees stars.
    #[setting(name = "altitude", unit = "m", nominal = 1e5, used_with = "~.period > 0", file)]
    pub least_altitude: f64,
    /// Fault of the star tracker: {}
    #[setting(used_with = "~.period > 0")]
    pub fault: Fault,
}

/// Both devices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Declared)]
pub struct Devices {
    /// Satellite navigation.
    #[setting(used_with = "translation = entry")]
    pub gnss: Gnss,
    /// Star tracker.
    #[setting(used_with = "translation = entry")]
    pub star: StarTracker,
    /// Fault of gyroscope and accelerometer with their line: {}
    #[setting(name = "inertial.fault")]
    pub inertial: Fault,
}

impl Default for Devices {
    /// Returns a receiver with the blackout of an entry, and no star tracker.
    fn default() -> Self {
        Self {
            gnss: Gnss {
                period: 1.0,
                position_noise: 5.0,
                velocity_noise: 0.1,
                blackout_top: 85e3,
                blackout_bottom: 45e3,
                fault: Fault::default(),
            },
            // Some ten seconds of arc.
            star: StarTracker {
                period: 0.0,
                noise: 5e-5,
                least_altitude: 90e3,
                fault: Fault::default(),
            },
            inertial: Fault::default(),
        }
    }
}

/// Latest fix of the satellite navigation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct GnssFix {
    /// Position along the {}, of the latest fix.
    #[setting(each = FIXED, unit = "m", nominal = 1e6)]
    pub position: Vector3<f64>,
    /// Velocity relative to the planet along the {}, of the latest fix.
    #[setting(each = FIXED, unit = "m/s", nominal = 1e3)]
    pub velocity: Vector3<f64>,
    /// Time at which the latest fix was taken.
    #[setting(unit = "s", nominal = 1.0)]
    pub time: f64,
    /// Number of the latest fix, counted from 1; 0 before the first.
    #[setting(name = "fix", min = 0)]
    pub number: i32,
}

/// Planet-fixed axes.
const FIXED: [Entry; 3] =
    [(".x", "axis through longitude 0"), (".y", "axis through 90 deg east"), (".z", "polar axis")];

/// Latest fix of the star tracker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct StarFix {
    /// Part {} of the quaternion from inertial to body axes, of the latest fix; the inertial axes
    /// are the planet's at time 0.
    #[setting(each = QUATERNION, nominal = 1.0)]
    pub attitude: [f64; 4],
    /// Time at which the latest fix was taken.
    #[setting(unit = "s", nominal = 1.0)]
    pub time: f64,
    /// Number of the latest fix, counted from 1; 0 before the first.
    #[setting(name = "fix", min = 0)]
    pub number: i32,
}

/// Latest fixes of both devices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Fixes {
    /// Of the satellite navigation.
    pub gnss: GnssFix,
    /// Of the star tracker.
    pub star: StarFix,
}

impl StarFix {
    /// Returns the rotation, unless the norm of the quaternion is far from 1.
    pub fn rotation(&self) -> Option<UnitQuaternion<f64>> {
        let [w, x, y, z] = self.attitude;
        let given = Quaternion::new(w, x, y, z);
        (given.norm() - 1.0).abs().le(&0.1).then(|| UnitQuaternion::new_normalize(given))
    }
}

impl Devices {
    /// Refuses values that are negative or not finite.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let Self { gnss, star, inertial } = self;
        let inertial_measures = [FaultKind::Gyroscope, FaultKind::Accelerometer];
        gnss.fault.check("gnss", &[FaultKind::Position, FaultKind::Velocity], gnss.period)?;
        star.fault.check("star", &[FaultKind::Attitude], star.period)?;
        inertial.check("inertial", &inertial_measures, LATEST)?;
        for (name, value) in [
            ("gnss.period", gnss.period),
            ("gnss.noise.position", gnss.position_noise),
            ("gnss.noise.velocity", gnss.velocity_noise),
            ("star.period", star.period),
            ("star.noise", star.noise),
        ] {
            not_negative(format!("sensor.{name}"), value, "")?;
        }
        let (top, bottom) = (gnss.blackout_top, gnss.blackout_bottom);
        if !(top.is_finite() && bottom <= top && star.least_altitude.is_finite()) {
            let problem = format!("= {bottom} m must not lie above blackout.top = {top} m");
            return Err(Error::parameter("sensor.gnss.blackout.bottom", problem));
        }
        Ok(())
    }

    /// Returns the latest fixes after the sample at `time` (s), a time `elapsed` (s) after the
    /// start and one `period` (s) after the sample before.
    pub(crate) fn taken(
        &self,
        (seed, tick): (u64, i64),
        (time, elapsed, period): (f64, f64, f64),
        (place, altitude): (&Place, f64),
        before: &Fixes,
    ) -> Fixes {
        let mut fixes = *before;
        let is_due = |every: f64| {
            let multiples = |at: f64| ((at + tick_tolerance(time, period)) / every).floor();
            every > 0.0 && (tick == 0 || multiples(elapsed) > multiples(elapsed - period))
        };
        let hears = altitude >= self.gnss.blackout_top || altitude <= self.gnss.blackout_bottom;
        let (receiver, tracker) = (&self.gnss.fault, &self.star.fault);
        let works = |fault: &Fault| !fault.is(FaultKind::Dropout, time);
        let by_gnss = is_due(self.gnss.period) && hears && works(receiver);
        let sees = altitude >= self.star.least_altitude;
        let by_star = is_due(self.star.period) && sees && works(tracker);
        if !(by_gnss || by_star) {
            return fixes;
        }
        // Another sequence than those of the sensors and of a disturbance with the same seed.
        let draws: [f64; 10] = uniform(seed.rotate_left(32) ^ 0x6e61_7669, tick);
        let [a, b, c, d, e] = [0, 2, 4, 6, 8].map(|i| normal_pair([draws[i], draws[i + 1]]));
        let next = |fault: &Fault, before: (i32, f64)| {
            if fault.restarts(before.1, time) { 1 } else { before.0.saturating_add(1) }
        };
        if by_gnss {
            // Along the level axes, so that no longitude is special.
            let turned = place.level().transpose();
            let off = Vector3::new(a[0], a[1], b[0]) * self.gnss.position_noise;
            let fast = Vector3::new(b[1], c[0], c[1]) * self.gnss.velocity_noise;
            let [away, faster] = [FaultKind::Position, FaultKind::Velocity]
                .map(|kind| Vector3::repeat(receiver.of(kind, time)));
            fixes.gnss = GnssFix {
                number: next(receiver, (before.gnss.number, before.gnss.time)),
                time: time + receiver.of(FaultKind::Clock, time),
                position: place.position + turned * (off + away),
                velocity: place.velocity + turned * (fast + faster),
            };
            if receiver.is(FaultKind::Frozen, time) && before.gnss.number > 0 {
                fixes.gnss.position = before.gnss.position;
                fixes.gnss.velocity = before.gnss.velocity;
            }
        }
        if by_star {
            let error = Vector3::new(d[0], d[1], e[0]) * self.star.noise
                + Vector3::repeat(tracker.of(FaultKind::Attitude, time));
            let seen = UnitQuaternion::from_scaled_axis(error) * place.attitude;
            let is_frozen = tracker.is(FaultKind::Frozen, time) && before.star.number > 0;
            fixes.star = StarFix {
                number: next(tracker, (before.star.number, before.star.time)),
                time: time + tracker.of(FaultKind::Clock, time),
                attitude: if is_frozen {
                    before.star.attitude
                } else {
                    [seen.w, seen.i, seen.j, seen.k]
                },
            };
        }
        fixes
    }

    /// Returns the fixes that have arrived at `time` (s), of those that had been taken at the sample
    /// before and at this one, and those that had arrived before.
    pub(crate) fn arrived(&self, time: f64, taken: [&Fixes; 2], before: &Fixes) -> Fixes {
        let has_come = |fault: &Fault, since: f64| {
            let late = fault.of(FaultKind::Late, time);
            late == 0.0 || time >= since + late - tick_tolerance(time, late)
        };
        let mut fixes = *before;
        for Fixes { gnss, star } in taken {
            if has_come(&self.gnss.fault, gnss.time) {
                fixes.gnss = *gnss;
            }
            if has_come(&self.star.fault, star.time) {
                fixes.star = *star;
            }
        }
        fixes
    }
}
