//! Which measurements the filter takes, and what follows from those that it does not.
//!
//! A device that contradicts itself, such as a receiver whose positions do not move as its
//! velocities say, is faulty, and waits until it agrees with itself again. One that agrees with
//! itself and contradicts the filter several times in a row shows that the filter is wrong: what it
//! measures begins anew there, with its own deviation plus the size of the disagreement.

use super::device::Navigation;
use super::filter::{
    self, ATTITUDE, CLOCK, Covariance, DRAG, Error, GYROSCOPE, Measured, POSITION, VELOCITY, WIND,
    updated,
};
use super::line::Contradiction;
use super::running::{Running, Source};
use super::strapdown::{State, rotation};
use super::watch::{DEPARTURE, FORGOTTEN, RECOVERY, RUN};
use nalgebra::Vector3;
use std::ops::Range;
use vehicle::fixes::{GnssFix, StarFix};
use vehicle::frames::fixed_from_inertial;
use vehicle::math::hypot;

/// Greatest offset of the receiver's clock that is estimated, and greatest time by which a state is
/// extrapolated to that of a measurement, s.
const CLOCK_RANGE: f64 = 0.25;
/// Standard deviation of the attitude from which another one is no jump of the star tracker, rad: only
/// a blind gyroscope leads to it while there are stars.
const BLIND_TILT: f64 = 0.02;
/// Standard deviation of the attitude from which a contradiction widens it no more, rad: a receiver
/// that is wrong for minutes would make it unknown.
const WIDEST: f64 = 0.004;
/// Factor by which standard deviations grow that have turned out too small.
const GROWTH: f64 = 4.0;
/// Standard deviations of the estimates of drag, wind, biases from which they are implausible.
const IMPLAUSIBLE: [f64; 3] = [4.0, 3.0, 5.0];

impl Navigation {
    /// Returns the state at a time (s) that need not be that of the last sample.
    fn state_at(&self, running: &Running, time: f64) -> Option<State> {
        let now = running.last.time;
        let is_near = (time - now).abs() <= CLOCK_RANGE;
        let kept =
            running.history.at(time, (now, &running.state)).filter(|_| is_near || time < now);
        let felt = running.felt(&running.last);
        let extrapolated =
            || running.state.after(&self.settings.planet, time - now, &felt, &felt).0;
        kept.or_else(|| is_near.then(extrapolated))
    }

    /// Takes a fix of satellite navigation at its own time, whose position may be that of the fix
    /// before.
    pub(super) fn take_gnss(&self, running: &mut Running, fix: &GnssFix, is_repeated: bool) {
        let planet = &self.settings.planet;
        let noise = &self.settings.fix;
        let silent = running.last.time - running.watches[0].at;
        if silent > FORGOTTEN && silent.is_finite() {
            // After a gap nobody knows whether the clock is as it was; at the first fix the initial
            // position shows it.
            let deviation = running.clock.abs().max(self.settings.guarded.clock / 2.0);
            running.covariance.fill_row(CLOCK, 0.0);
            running.covariance.fill_column(CLOCK, 0.0);
            running.covariance[(CLOCK, CLOCK)] = deviation * deviation;
        }
        let inertial = |time: f64| {
            let to_inertial = fixed_from_inertial(planet, time).transpose();
            let position = to_inertial * fix.position;
            (time, position, to_inertial * fix.velocity + rotation(planet).cross(&position))
        };
        // By its own clock, whatever that is found to be.
        let agrees = running.heard.agrees(inertial(fix.time), noise.position, is_repeated);
        let (time, position, velocity) = inertial(fix.time + running.clock);
        let (radius, speed) = (position.norm() / planet.radius, velocity.norm());
        let circular = (planet.gravitation / planet.radius).sqrt();
        let is_plausible = radius > 0.9 && radius < 2.0 && speed < 2.0 * circular;
        let Some(then) = self.state_at(running, time).filter(|_| is_plausible) else {
            return Self::refuse(running, Source::Gnss);
        };
        let felt = running.felt(&running.last);
        let over_ground = then.over_ground(planet);
        let turning = then.attitude * felt.force + planet.gravity_vector(&then.position)
            - rotation(planet).cross(&then.velocity);
        let off = [position - then.position, velocity - then.velocity];
        let measured: [Measured; 6] = std::array::from_fn(|i| {
            let (kind, axis) = (i / 3, i % 3);
            let deviation = [noise.position, noise.velocity][kind];
            let mut measured = Measured::state(POSITION + i, off[kind][axis], deviation);
            if kind == 0 {
                measured.row[VELOCITY + axis] = time - running.last.time;
            }
            measured.row[CLOCK] = [over_ground, turning][kind][axis];
            measured
        });
        // Of two that disagree, a filter that is suspect is the one that is wrong.
        if silent > FORGOTTEN && running.surprise.is_none() {
            running.hidden[0] = running.hidden[0].max(self.hidden(running, POSITION, &measured));
        }
        self.judge(running, &measured, Source::Gnss, agrees);
    }

    /// Takes a fix of the star tracker at its own time, whose attitude may be that of the fix before.
    pub(super) fn take_star(&self, running: &mut Running, fix: &StarFix, is_repeated: bool) {
        let then = self.state_at(running, fix.time);
        let (Some(then), Some(seen)) = (then, fix.rotation()) else {
            return Self::refuse(running, Source::Star);
        };
        let error = (seen.inverse() * then.attitude.inverse()).scaled_axis();
        let noise = self.settings.fix.attitude;
        let before = running.pointed;
        // From the first of equal fixes on, to which noise adds nothing.
        let (repeats, jump) = if is_repeated { (before, 1.0) } else { (None, 2.0 * DEPARTURE[0]) };
        running.pointed = repeats.or(Some((fix.time, error)));
        let turned = |(time, before): (f64, Vector3<f64>)| {
            (fix.time - time, (error - before).norm() - jump * noise)
        };
        // What the gyroscope makes of the difference of two fixes is small within seconds, unless it was
        // blind.
        let tilt = running.tilt();
        let goes_on = before.map(turned).is_none_or(|(elapsed, beyond)| {
            elapsed > FORGOTTEN || elapsed > 0.0 && beyond <= 0.0 || tilt > BLIND_TILT
        });
        // The gyroscope does not jump: a star tracker that does is wrong until it has jumped back.
        if tilt > BLIND_TILT {
            running.steady = None;
        } else if !goes_on {
            let drift = self.errors[0].instability;
            running.steady = running.steady.or(before).filter(|steady| {
                let (elapsed, beyond) = turned(*steady);
                beyond > drift * elapsed
            });
        }
        let agrees = goes_on && running.steady.is_none();
        let by_clock = self.settings.guarded.clock * running.felt(&running.last).rate.norm();
        let noise = hypot(noise, by_clock);
        let measured: [Measured; 3] =
            std::array::from_fn(|i| Measured::state(ATTITUDE + i, error[i], noise));
        if running.hidden[1] == 0.0 {
            running.hidden[1] = self.hidden(running, ATTITUDE, &measured);
        }
        self.judge(running, &measured, Source::Star, agrees);
    }

    /// Returns the mean of the normalised squares of this many components from which a measurement
    /// is refused. The mean of several departs less from 1 than a single one.
    fn gate(&self, size: usize) -> f64 {
        (self.settings.fix.gate + 3.0 * (size - 1) as f64) / size as f64
    }

    /// Returns the largest error of three measured states, from `from` on, with which a measurement is
    /// still taken.
    fn hidden(&self, running: &Running, from: usize, measured: &[Measured]) -> f64 {
        let predicted = running.covariance.diagonal().fixed_rows::<3>(from).max();
        let squares = self.gate(measured.len()) * measured.len() as f64;
        (squares * (predicted + measured[0].variance)).sqrt()
    }

    /// Refuses a measurement of a device that contradicts itself.
    fn refuse(running: &mut Running, source: Source) {
        running.rejected += 1;
        let now = running.last.time;
        if source == Source::Gnss && now - running.restarted < RECOVERY {
            // The filter began anew by what has contradicted itself.
            running.surprise = Some((Contradiction::Gnss, now));
        }
        let watch = &mut running.watches[source as usize];
        (watch.agreed, watch.refused) = (0, 0);
    }

    /// Corrects the filter by measurements, unless they contradict it or their device itself.
    pub(super) fn judge(
        &self,
        running: &mut Running,
        measured: &[Measured],
        source: Source,
        agrees: bool,
    ) {
        let size = measured.len();
        let (error, covariance, squares) = updated(&running.covariance, measured);
        running.innovations[source as usize] = squares.min(f64::MAX);
        let watch = &mut running.watches[source as usize];
        watch.note(running.last.time, squares, measured[0].residual.signum(), size);
        let force = [None, None, Some(Contradiction::Side), Some(Contradiction::Drag)];
        if let Some(force) = force[source as usize].filter(|_| watch.is_surprised()[1]) {
            running.surprise = Some((force, running.last.time));
        }
        if !agrees {
            return Self::refuse(running, source);
        }
        watch.agreed = (watch.agreed + 1).min(RUN);
        if watch.agreed < RUN {
            running.rejected += 1;
            return;
        }
        let gate = self.gate(size);
        if squares <= gate {
            watch.refused = 0;
            if source == Source::Gnss && watch.is_surprised()[1] {
                // It leads the filter astray in small steps.
                running.surprise = Some((Contradiction::Gnss, running.last.time));
            }
            Self::apply(running, &error, &covariance, source);
            return;
        }
        watch.refused += 1;
        running.rejected += u32::from(size > 1);
        if watch.refused < RUN {
            return;
        }
        watch.refused = 0;
        match source {
            Source::Gnss if Self::explain_by_clock(running, measured, gate) => {}
            Source::Gnss => Self::restart(running, measured, POSITION, source),
            Source::Star => Self::restart(running, measured, ATTITUDE, source),
            Source::Side => widen(&mut running.covariance, WIND..DRAG),
            Source::Drag => widen(&mut running.covariance, DRAG..CLOCK),
        }
    }

    /// Corrects the filter by an offset of the receiver's clock, if that explains a fix.
    fn explain_by_clock(running: &mut Running, measured: &[Measured], gate: f64) -> bool {
        let mut open = running.covariance;
        open[(CLOCK, CLOCK)] = CLOCK_RANGE * CLOCK_RANGE;
        let (error, covariance, squares) = updated(&open, measured);
        let explains = squares <= gate && (running.clock + error[CLOCK]).abs() <= CLOCK_RANGE;
        if explains {
            Self::apply(running, &error, &covariance, Source::Gnss);
        }
        explains
    }

    /// Begins anew with the states from `from` on that are measured. The others keep their values,
    /// and after a second contradiction within a minute their deviations grow, up to [`WIDEST`].
    fn restart(running: &mut Running, measured: &[Measured], from: usize, source: Source) {
        let mut error = Error::zeros();
        let mut covariance = running.covariance;
        // The velocities, on which the positions depend, come last.
        for (i, Measured { row, residual, .. }) in measured.iter().enumerate().rev() {
            error[from + i] = residual - row.dot(&error);
        }
        for (i, Measured { variance, .. }) in measured.iter().enumerate() {
            let group: Vector3<f64> = error.fixed_rows::<3>(from + i - i % 3).into();
            covariance.fill_row(from + i, 0.0);
            covariance.fill_column(from + i, 0.0);
            covariance[(from + i, from + i)] = variance + group.norm_squared() / 3.0;
        }
        let now = running.last.time;
        if now - running.restarted < RECOVERY && running.tilt() < WIDEST {
            widen(&mut covariance, if from == ATTITUDE { GYROSCOPE } else { ATTITUDE }..WIND);
        }
        if running.surprise.is_none() {
            let doubt = &mut running.doubts[usize::from(from == ATTITUDE)];
            *doubt = doubt.max(error.fixed_rows::<3>(from).norm());
        }
        running.restarted = now;
        Self::apply(running, &error, &covariance, source);
    }

    /// Returns what contradicts what at `time` (s), and whether it is the filter that the fixes
    /// contradict.
    pub(super) fn contradiction(&self, running: &Running, time: f64) -> (Contradiction, bool) {
        let [gnss, star, side, drag] = &running.watches;
        for (watch, device) in [(gnss, Contradiction::Gnss), (star, Contradiction::Star)] {
            if time - watch.at > RECOVERY {
                continue;
            }
            if watch.agreed < RUN {
                return (device, false);
            }
            if watch.refused > 0 || watch.is_surprised()[0] {
                return (device, true);
            }
        }
        let sensors = [Contradiction::Gyroscope, Contradiction::Accelerometer];
        let [by_drag, by_wind, by_bias] = IMPLAUSIBLE;
        for (i, sensor) in sensors.into_iter().enumerate() {
            let largest = by_bias * self.errors[i].instability.max(filter::LEAST_BIASES[i]);
            if running.is_blind()[i] || running.biases[i].amax() > largest {
                return (sensor, false);
            }
        }
        let settings = &self.settings;
        let wind = running.wind[0].abs().max(running.wind[1].abs());
        if let Some((force, _)) = running.surprise {
            return (force, false);
        }
        if side.is_surprised()[0] || wind > by_wind * settings.wind.deviation {
            return (Contradiction::Side, false);
        }
        if drag.is_surprised()[0] || running.drag.abs() > by_drag * settings.drag.model {
            return (Contradiction::Drag, false);
        }
        let recovers = time - running.restarted < RECOVERY;
        (if recovers { Contradiction::Gnss } else { Contradiction::None }, recovers)
    }
}

/// Widens the deviations of states, with their correlations.
fn widen(covariance: &mut Covariance, states: Range<usize>) {
    for i in states {
        covariance.row_mut(i).scale_mut(GROWTH);
        covariance.column_mut(i).scale_mut(GROWTH);
    }
}
