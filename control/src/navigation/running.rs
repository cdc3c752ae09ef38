//! The navigation from sample to sample.

use super::air::{drag, side_force};
use super::device::Navigation;
use super::filter::{
    ACCELEROMETER, ATTITUDE, Covariance, DRAG, Error, Expected, GYROSCOPE, Measured, POSITION,
    SIDE, VELOCITY, WIND, Way, gravity_gradient, kept, propagated, updated,
};
use super::line::Line;
use super::settings::{Alignment, Settings};
use super::shown::Deviations;
use super::strapdown::{Felt, State, rotation};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::atmosphere::air_anywhere;
use vehicle::fixes::{GnssFix, StarFix};
use vehicle::frames::{Place, fixed_from_inertial};
use vehicle::math::{exp, hypot};
use vehicle::noise::{normal_pair, uniform};

/// Time over which the covariance is propagated at once, s.
const LONGEST_WAY: f64 = 0.2;
/// Time between two measurements of the air's forces, s.
const AIR_PERIOD: f64 = 1.0;
/// Corrections of attitude (rad) and wind (m/s) that are too small to be blended.
const SMALL_TILT: f64 = 2e-4;
const SMALL_WIND: f64 = 0.5;
/// Rejections in a row after which a fix is taken.
const REJECTIONS: u32 = 5;
/// Number of fixes over which the innovations are averaged.
const AVERAGED: f64 = 20.0;

/// State once a sample has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Running {
    pub(super) last: Line,
    /// State at the last sample.
    state: State,
    /// Biases of gyroscope (rad/s) and accelerometer (m/s²).
    pub(super) biases: [Vector3<f64>; 2],
    /// Wind to the north and to the east, m/s.
    wind: [f64; 2],
    /// Ratio of the side force to that of the model.
    side: f64,
    /// Logarithm of the ratio of the drag to that of the model.
    pub(super) drag: f64,
    pub(super) covariance: Covariance,
    /// Way since the last propagation of the covariance: its duration (s), the change of the
    /// velocity on it (m/s), and the distance from the centre at its beginning (m).
    way: (f64, Vector3<f64>, f64),
    /// What the shown state lacks of the filter's, and its rate.
    offset: [Error; 2],
    /// Time of the last fix, and of the last measurement of the air's forces, s.
    pub(super) fixed: f64,
    felt_air: f64,
    /// Rejections in a row, of satellite navigation and star tracker.
    refused: [u32; 2],
    pub(super) rejected: u32,
    /// Average of the squares of the innovations.
    pub(super) average: f64,
    pub(super) innovations: [f64; 4],
    pub(super) deviations: Deviations,
}

/// Where measurements come from, in the order of the innovations.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Source {
    Gnss,
    Star,
    Side,
    Drag,
}

impl Running {
    /// Returns the corrected readings of a sample.
    pub(super) fn felt(&self, line: &Line) -> Felt {
        Felt { rate: line.rate - self.biases[0], force: line.force - self.biases[1] }
    }

    /// Returns the state, the wind, and the corrections of rate and specific force that are to be
    /// shown.
    pub(super) fn blended(&self) -> (State, [f64; 2], [Vector3<f64>; 2]) {
        let offset = &self.offset[0];
        let mut state = self.state;
        moved(&mut state, offset, -1.0);
        let part = |from: usize| Vector3::from(offset.fixed_rows::<3>(from));
        let wind = [self.wind[0] - offset[WIND], self.wind[1] - offset[WIND + 1]];
        (state, wind, [part(GYROSCOPE), part(ACCELEROMETER)])
    }
}

impl Navigation {
    /// Returns the state at the first sample.
    pub(super) fn begin(&self, line: &Line) -> Running {
        let settings = &self.settings;
        let Alignment { attitude, position, velocity, seed } = settings.alignment;
        let mut place = Place::of(
            &settings.planet,
            &settings.initial.start.motion(),
            &settings.initial.angles,
            line.time,
        );
        let draws: [f64; 10] = uniform(seed, 0);
        let pairs = [0, 2, 4, 6, 8].map(|i| normal_pair([draws[i], draws[i + 1]]));
        let flat = pairs.as_flattened();
        let scale = if seed == 0 { 0.0 } else { 1.0 };
        let normal = |i: usize| Vector3::from_fn(|axis, _| scale * flat[i + axis]);
        let fix = &line.fixes.gnss;
        let has_fix = fix.number > 0;
        let [mut off, mut fast] = [position, velocity];
        if has_fix {
            let motion = Place { position: fix.position, velocity: fix.velocity, ..place }
                .motion(&settings.planet);
            place = Place {
                position: fix.position,
                velocity: fix.velocity,
                ..Place::of(&settings.planet, &motion, &settings.initial.angles, line.time)
            };
            [off, fast] = [settings.fix.position, settings.fix.velocity];
        } else {
            // Along the level axes, so that no longitude is special.
            let turned = place.level().transpose();
            place.position += turned * normal(0) * position;
            place.velocity += turned * normal(3) * velocity;
        }
        let mut state = State::at(&settings.planet, &place, line.time);
        state.attitude *= UnitQuaternion::from_scaled_axis(normal(6) * attitude);
        let mut tilt = attitude;
        if let Some(seen) = seen(line, &line.rate).filter(|_| line.fixes.star.number > 0) {
            (state.attitude, tilt) = (seen, settings.fix.attitude);
        }
        let mut covariance = Covariance::zeros();
        let [gyroscope, accelerometer] = self.errors.map(|errors| errors.instability);
        for (from, deviation) in [
            (POSITION, off),
            (VELOCITY, fast),
            (ATTITUDE, tilt),
            (GYROSCOPE, gyroscope.max(1e-12)),
            (ACCELEROMETER, accelerometer.max(1e-9)),
        ] {
            for i in from..from + 3 {
                covariance[(i, i)] = deviation * deviation;
            }
        }
        let (wind, drag) = (&settings.wind, &settings.drag);
        for (i, deviation) in [
            (WIND, wind.deviation),
            (WIND + 1, wind.deviation),
            (SIDE, wind.model),
            (DRAG, drag.model),
        ] {
            covariance[(i, i)] = deviation * deviation;
        }
        let deviations = self.deviations((line.time, &state), [0.0; 2], &covariance);
        Running {
            last: *line,
            state,
            biases: [Vector3::zeros(); 2],
            wind: [0.0; 2],
            side: 1.0,
            drag: 0.0,
            covariance,
            way: (0.0, Vector3::zeros(), state.position.norm()),
            offset: [Error::zeros(); 2],
            fixed: line.time,
            felt_air: line.time,
            refused: [0; 2],
            rejected: 0,
            average: 1.0,
            innovations: [0.0; 4],
            deviations,
        }
    }

    /// Takes the next sample, with the fixes that came with it.
    pub(super) fn take(&self, running: &mut Running, line: &Line) {
        let elapsed = line.time - running.last.time;
        if elapsed <= 0.0 {
            return;
        }
        let (from, to) = (running.felt(&running.last), running.felt(line));
        let (state, pushed) = running.state.after(&self.settings.planet, elapsed, &from, &to);
        let before = running.last.fixes;
        (running.state, running.last) = (state, *line);
        running.way.0 += elapsed;
        running.way.1 += pushed;
        self.decay(running, elapsed);
        let by_gnss = line.fixes.gnss.number > before.gnss.number;
        let by_star = line.fixes.star.number > before.star.number;
        let by_air = line.time - running.felt_air >= AIR_PERIOD - 1e-9;
        let is_due = running.way.0 >= LONGEST_WAY - 1e-9;
        if !(is_due || by_gnss || by_star || by_air) {
            return;
        }
        self.propagate(running);
        if by_gnss {
            let measured = self.by_gnss(running, &line.fixes.gnss);
            self.correct(running, &measured, Source::Gnss);
        }
        if by_star && let Some(measured) = self.by_star(running) {
            self.correct(running, &measured, Source::Star);
        }
        if by_air {
            running.felt_air = line.time;
            for source in [Source::Side, Source::Drag] {
                let measured = self.by_air(running, source).filter(Measured::is_finite);
                if let Some(measured) = measured {
                    self.correct(running, &[measured], source);
                }
            }
        }
        running.deviations =
            self.deviations((line.time, &running.state), running.wind, &running.covariance);
    }

    /// Propagates the covariance over the way since the last time, and lets the estimated biases
    /// and the wind fade as the filter expects of the true ones.
    fn propagate(&self, running: &mut Running) {
        let (time, pushed, from) = running.way;
        let radius = running.state.position.norm();
        let way = Way {
            time,
            pushed,
            attitude: running.state.attitude.to_rotation_matrix().into_inner(),
            gradient: gravity_gradient(self.settings.planet.gravitation, &running.state.position),
            climbed: radius - from,
        };
        let Settings { period, wind, drag, .. } = &self.settings;
        let expected = Expected { errors: &self.errors, period: *period, wind, drag };
        running.covariance = propagated(&running.covariance, &way, &expected);
        for (bias, errors) in running.biases.iter_mut().zip(&self.errors) {
            *bias *= kept(errors, time);
        }
        let [kept, kept_drag] = expected.kept_in_climb(way.climbed);
        running.wind = running.wind.map(|part| part * kept);
        running.side = 1.0 + (running.side - 1.0) * kept;
        running.drag *= kept_drag;
        running.way = (0.0, Vector3::zeros(), radius);
    }

    /// Returns what a fix of satellite navigation shows.
    fn by_gnss(&self, running: &Running, fix: &GnssFix) -> [Measured; 6] {
        let planet = &self.settings.planet;
        let to_inertial = fixed_from_inertial(planet, fix.time).transpose();
        let velocity =
            to_inertial * fix.velocity + rotation(planet).cross(&(to_inertial * fix.position));
        // A fix may come with a later sample, if that of its instant was lost.
        let position = to_inertial * fix.position + velocity * (running.last.time - fix.time);
        let [off, fast] = [position - running.state.position, velocity - running.state.velocity];
        let noise = &self.settings.fix;
        std::array::from_fn(|i| {
            if i < 3 {
                Measured::state(POSITION + i, off[i], noise.position)
            } else {
                Measured::state(VELOCITY + i - 3, fast[i - 3], noise.velocity)
            }
        })
    }

    /// Returns what a fix of the star tracker shows.
    fn by_star(&self, running: &Running) -> Option<[Measured; 3]> {
        let seen = seen(&running.last, &running.felt(&running.last).rate)?;
        let error = (seen * running.state.attitude.inverse()).scaled_axis();
        let noise = self.settings.fix.attitude;
        Some(std::array::from_fn(|i| Measured::state(ATTITUDE + i, error[i], noise)))
    }

    /// Returns what the side force or the drag shows.
    fn by_air(&self, running: &Running, source: Source) -> Option<Measured> {
        if source == Source::Drag && self.settings.drag.model == 0.0 {
            return None;
        }
        let (motion, to_level) = self.level((running.last.time, &running.state));
        let altitude = motion[0];
        let [_, air] = self.relative(&running.state, &to_level, running.wind);
        let felt = running.felt(&running.last);
        let force = (&felt.force, self.errors[1].noise);
        if source == Source::Drag {
            let up = running.state.position.normalize();
            return drag(&self.aerodynamics, &air, (altitude, &up), force, running.drag);
        }
        let mach = air.velocity.norm() / air_anywhere(altitude).sound_speed;
        side_force(&self.aerodynamics, &air, mach, force, running.side)
    }

    /// Corrects the filter by measurements. The shown state stays where it is.
    fn correct(&self, running: &mut Running, measured: &[Measured], source: Source) {
        let (error, covariance, squares) = updated(&running.covariance, measured);
        let i = source as usize;
        running.innovations[i] = squares;
        if matches!(source, Source::Gnss | Source::Star) {
            running.average += (squares.min(self.settings.fix.gate) - running.average) / AVERAGED;
            let is_far = squares > self.settings.fix.gate;
            if is_far && running.refused[i] < REJECTIONS {
                running.refused[i] += 1;
                running.rejected += 1;
                return;
            }
            running.refused[i] = 0;
            running.fixed = running.last.time;
        } else if squares > self.settings.fix.gate {
            return;
        }
        running.covariance = covariance;
        moved(&mut running.state, &error, 1.0);
        let part = |from: usize| Vector3::from(error.fixed_rows::<3>(from));
        running.biases[0] += part(GYROSCOPE);
        running.biases[1] += part(ACCELEROMETER);
        running.wind = [running.wind[0] + error[WIND], running.wind[1] + error[WIND + 1]];
        running.side += error[SIDE];
        running.drag += error[DRAG];
        // A corrected altitude is no climb through another wind.
        running.way.2 = running.state.position.norm();
        // Small corrections by the side force always come, and would be late if they were blended.
        let [tilt, wind] = [part(ATTITUDE).norm(), hypot(error[WIND], error[WIND + 1])];
        if source != Source::Side || tilt > SMALL_TILT || wind > SMALL_WIND {
            running.offset[0] += error;
        }
    }

    /// Lets the offset of the shown state fade as a critically damped oscillator at rest does.
    fn decay(&self, running: &mut Running, elapsed: f64) {
        let blend = self.settings.blend;
        if blend == 0.0 {
            running.offset = [Error::zeros(); 2];
            return;
        }
        let [offset, rate] = running.offset;
        let share = elapsed / blend;
        let kept = exp(-share);
        let slope = rate + offset / blend;
        running.offset = [(offset + slope * elapsed) * kept, (rate - slope * share) * kept];
    }

    /// Returns true less estimated state, apart from the biases, which are zero in it.
    pub(super) fn error_of(&self, running: &Running, truth: &Place, wind: [f64; 2]) -> Error {
        let truth = State::at(&self.settings.planet, truth, running.last.time);
        let mut error = Error::zeros();
        let mut set = |from: usize, part: Vector3<f64>| {
            error.fixed_rows_mut::<3>(from).copy_from(&part);
        };
        set(POSITION, truth.position - running.state.position);
        set(VELOCITY, truth.velocity - running.state.velocity);
        set(ATTITUDE, (truth.attitude * running.state.attitude.inverse()).scaled_axis());
        set(GYROSCOPE, -running.biases[0]);
        set(ACCELEROMETER, -running.biases[1]);
        for i in 0..2 {
            error[WIND + i] = wind[i] - running.wind[i];
        }
        error
    }
}

/// Returns the rotation from the body axes to the inertial ones that the star tracker has seen,
/// turned on at a rate (rad/s) to the time of the sample.
fn seen(line: &Line, rate: &Vector3<f64>) -> Option<UnitQuaternion<f64>> {
    let StarFix { time, .. } = line.fixes.star;
    let turned = UnitQuaternion::from_scaled_axis(rate * (line.time - time));
    Some(line.fixes.star.rotation()?.inverse() * turned)
}

/// Moves a state by a multiple of an error.
fn moved(state: &mut State, error: &Error, factor: f64) {
    let part = |from: usize| Vector3::from(error.fixed_rows::<3>(from)) * factor;
    state.position += part(POSITION);
    state.velocity += part(VELOCITY);
    state.attitude = UnitQuaternion::from_scaled_axis(part(ATTITUDE)) * state.attitude;
}
