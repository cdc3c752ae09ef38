//! The navigation from sample to sample.

use super::air::{drag, side_force};
use super::device::Navigation;
use super::filter::{
    ACCELEROMETER, ATTITUDE, CLOCK, Covariance, DRAG, Error, Expected, GYROSCOPE, LEAST_BIASES,
    Measured, POSITION, SIDE, UNSEEN, VELOCITY, WIND, Way, gravity_gradient, kept, propagated,
};
use super::history::History;
use super::line::{Contradiction, Line};
use super::settings::{Alignment, Settings};
use super::strapdown::{Felt, State};
use super::watch::{Heard, RECOVERY, Watch};
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use vehicle::atmosphere::air_anywhere;
use vehicle::fixes::Fixes;
use vehicle::frames::Place;
use vehicle::math::{exp, hypot};
use vehicle::noise::{normal_pair, uniform};

/// Time over which the covariance is propagated at once, s.
const LONGEST_WAY: f64 = 0.2;
/// Time between two measurements of the air's forces, s.
const AIR_PERIOD: f64 = 1.0;
/// Corrections of attitude (rad) and wind (m/s) that are too small to be blended.
const SMALL_TILT: f64 = 2e-4;
const SMALL_WIND: f64 = 0.5;
/// Equal samples in a row, with noise on them, that only a frozen sensor gives.
const STILL: u32 = 5;
/// Standard deviation of the attitude from which the filter's linear model fails: the air's forces then
/// show nothing, rad.
const LINEAR: f64 = 0.1;
/// Time since the last sample from which the motion counts as unseen and the navigation as lost,
/// and a clock that lags is not believed, s.
pub(super) const UNSEEN_AFTER: f64 = 0.5;

/// State once a sample has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Running {
    pub(super) last: Line,
    /// What is added to the given times of the samples, s.
    ahead: f64,
    /// State at the last sample.
    pub(super) state: State,
    /// Biases of gyroscope (rad/s) and accelerometer (m/s²).
    pub(super) biases: [Vector3<f64>; 2],
    /// Wind to the north and to the east, m/s.
    pub(super) wind: [f64; 2],
    /// Ratio of the side force to that of the model.
    side: f64,
    /// Logarithm of the ratio of the drag to that of the model.
    pub(super) drag: f64,
    pub(super) covariance: Covariance,
    /// Offset of the receiver's clock: true less given time of its fixes, s.
    pub(super) clock: f64,
    /// Way since the last propagation of the covariance: its duration (s), the change of the
    /// velocity on it (m/s), and the distance from the centre at its beginning (m).
    way: (f64, Vector3<f64>, f64),
    /// Time of it in which gyroscope and accelerometer showed nothing, s.
    blind: [f64; 2],
    /// Time between two samples of it times that for which some are missing, in sum, s².
    sparse: f64,
    /// Samples in a row that equal the one before, of both.
    still: [u32; 2],
    /// Past states.
    pub(super) history: History,
    /// What the shown state lacks of the filter's, and its rate.
    offset: [Error; 2],
    /// Time of the last fix, and of the last measurement of the air's forces, s.
    pub(super) fixed: f64,
    felt_air: f64,
    /// Measurements of each source so far.
    pub(super) watches: [Watch; 4],
    /// What the receiver has said of its motion; the errors by the last fix of the star tracker, and by
    /// the last one before it jumped (rad), with their times (s).
    pub(super) heard: Heard,
    pub(super) pointed: Option<(f64, Vector3<f64>)>,
    pub(super) steady: Option<(f64, Vector3<f64>)>,
    /// Largest offset of the receiver (m) and misalignment of the star tracker (rad) that their first
    /// fixes could hide; 0 before these.
    pub(super) hidden: [f64; 2],
    /// Disagreement with the filter of the positions (m) and attitudes (rad) with which it began
    /// anew, and the time of the last such event, s.
    pub(super) doubts: [f64; 2],
    pub(super) restarted: f64,
    /// Which force of the air has contradicted the filter, or that the attitude was lost, and when at
    /// last, s: fixes have not borne it out since.
    pub(super) surprise: Option<(Contradiction, f64)>,
    pub(super) rejected: u32,
    pub(super) innovations: [f64; 4],
}

/// Where measurements come from, in the order of the innovations.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
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

    /// Returns the number of samples that were missed before that of `line`, if it is a new one, and
    /// corrects its time, which is not after `now` (s), by the `period` (s) of the samples. A number
    /// that does not grow is that of a unit that began anew; if its clock did, too, its samples come
    /// now.
    pub(super) fn succeeds(&mut self, line: &mut Line, now: f64, period: f64) -> Option<u32> {
        let last = &self.last;
        if !line.is_plausible() || line.sample > 0 && line.sample == last.sample {
            return None;
        }
        let time = (line.time + self.ahead).min(now);
        let counted = line.sample.saturating_sub(last.sample);
        if time > last.time {
            line.time = time;
        } else if last.sample > 0 && counted > 0 {
            // The clock has been put back, and the number says how long ago the last sample was.
            let time = (last.time + f64::from(counted) * period).min(now);
            self.ahead = time - line.time;
            line.time = time;
        } else if now - last.time > UNSEEN_AFTER {
            self.ahead = now - line.time;
            line.time = now;
        } else {
            return None;
        }
        Some(u32::try_from(counted.saturating_sub(1)).unwrap_or(0))
    }

    /// Returns whether gyroscope and accelerometer show nothing: their samples repeat themselves.
    pub(super) fn is_blind(&self) -> [bool; 2] {
        self.still.map(|still| still >= STILL)
    }

    /// Returns the largest standard deviation of the attitude about an axis, rad.
    pub(super) fn tilt(&self) -> f64 {
        self.covariance.diagonal().fixed_rows::<3>(ATTITUDE).max().sqrt()
    }

    /// Returns the covariance of what is shown a time `age` (s) after the last sample: of the
    /// filter's state, what the blended one lacks of it, the disagreements that are not resolved, and
    /// what moves unseen.
    pub(super) fn shown_covariance(&self, age: f64) -> Covariance {
        let offset = &self.offset[0];
        let mut covariance = self.covariance + offset * offset.transpose();
        let unseen = if age > UNSEEN_AFTER { age } else { 0.0 };
        let [turned, pushed] = UNSEEN.map(|unknown| unknown * unseen);
        let [position, attitude] = self.doubts;
        for (from, deviation) in [
            (POSITION, hypot(position, pushed * unseen / 2.0)),
            (VELOCITY, pushed),
            (ATTITUDE, hypot(attitude, turned)),
        ] {
            for i in from..from + 3 {
                covariance[(i, i)] += deviation * deviation;
            }
        }
        covariance
    }

    /// Returns the state, the wind, and the corrections of rate and specific force that are to be
    /// shown.
    pub(super) fn blended(&self) -> (State, [f64; 2], [Vector3<f64>; 2]) {
        let offset = &self.offset[0];
        let mut state = self.state;
        state.correct(&-offset, 0.0);
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
        // Along the level axes, so that no longitude is special.
        let turned = place.level().transpose();
        place.position += turned * normal(0) * position;
        place.velocity += turned * normal(3) * velocity;
        let mut state = State::at(&settings.planet, &place, line.time);
        state.attitude *= UnitQuaternion::from_scaled_axis(normal(6) * attitude);
        let mut covariance = Covariance::zeros();
        let [gyroscope, accelerometer] = self.errors.map(|errors| errors.instability);
        for (from, deviation) in [
            (POSITION, position),
            (VELOCITY, velocity),
            (ATTITUDE, attitude),
            (GYROSCOPE, gyroscope.max(LEAST_BIASES[0])),
            (ACCELEROMETER, accelerometer.max(LEAST_BIASES[1])),
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
        let mut running = Running {
            last: *line,
            ahead: 0.0,
            state,
            biases: [Vector3::zeros(); 2],
            wind: [0.0; 2],
            side: 1.0,
            drag: 0.0,
            covariance,
            clock: 0.0,
            way: (0.0, Vector3::zeros(), state.position.norm()),
            blind: [0.0; 2],
            sparse: 0.0,
            still: [0; 2],
            history: History::default(),
            offset: [Error::zeros(); 2],
            fixed: line.time,
            felt_air: line.time,
            watches: [Watch::default(); 4],
            heard: Heard::default(),
            pointed: None,
            steady: None,
            hidden: [0.0; 2],
            doubts: [0.0; 2],
            restarted: f64::NEG_INFINITY,
            surprise: None,
            rejected: 0,
            innovations: [0.0; 4],
        };
        self.measure(&mut running, &Fixes::default());
        running
    }

    /// Takes the next sample, with the fixes that came with it.
    #[inline(never)]
    pub(super) fn take(&self, running: &mut Running, line: &Line) {
        let elapsed = line.time - running.last.time;
        running.history.keep(running.last.time, &running.state);
        let equal = [line.rate == running.last.rate, line.force == running.last.force];
        for (i, is_equal) in equal.into_iter().enumerate() {
            let is_still = is_equal && self.errors[i].noise > 0.0;
            running.still[i] = if is_still { running.still[i].saturating_add(1) } else { 0 };
            if running.is_blind()[i] || elapsed > UNSEEN_AFTER {
                running.blind[i] += elapsed;
            }
        }
        let missing = elapsed - self.settings.period;
        if missing > 0.5 * self.settings.period && elapsed <= UNSEEN_AFTER {
            running.sparse += elapsed * missing;
        }
        let (from, to) = (running.felt(&running.last), running.felt(line));
        let (state, pushed) = running.state.after(&self.settings.planet, elapsed, &from, &to);
        let before = running.last.fixes;
        (running.state, running.last) = (state, *line);
        running.way.0 += elapsed;
        running.way.1 += pushed;
        self.decay(running, elapsed);
        self.measure(running, &before);
    }

    /// Takes the measurements that are there at the last sample, given the fixes before it.
    fn measure(&self, running: &mut Running, before: &Fixes) {
        let Line { time, fixes: Fixes { gnss, star }, .. } = running.last;
        let is_new = |number: i32, before: i32| number > 0 && number != before;
        let by_gnss = is_new(gnss.number, before.gnss.number);
        let by_star = is_new(star.number, before.star.number);
        let by_air = time - running.felt_air >= AIR_PERIOD - 1e-9;
        let is_due = running.way.0 >= LONGEST_WAY - 1e-9;
        if !(is_due || by_gnss || by_star || by_air) {
            return;
        }
        self.propagate(running);
        if by_gnss {
            self.take_gnss(running, &gnss, gnss.position == before.gnss.position);
        }
        if by_star {
            self.take_star(running, &star, star.attitude == before.star.attitude);
        }
        let tilt = running.tilt();
        if tilt > LINEAR && running.is_blind()[0] {
            running.surprise = Some((Contradiction::Gyroscope, time));
        }
        if by_air {
            running.felt_air = time;
        }
        if by_air && tilt < LINEAR {
            for source in [Source::Side, Source::Drag] {
                let measured = self.by_air(running, source).filter(Measured::is_finite);
                if let Some(measured) = measured {
                    self.judge(running, &[measured], source, true);
                }
            }
        }
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
            blind: std::mem::take(&mut running.blind),
            sparse: std::mem::take(&mut running.sparse),
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

    /// Corrects the filter by an error of its state. The shown state stays where it is.
    pub(super) fn apply(
        running: &mut Running,
        error: &Error,
        covariance: &Covariance,
        source: Source,
    ) {
        let now = running.last.time;
        if matches!(source, Source::Gnss | Source::Star) {
            running.fixed = now;
            running.surprise = running.surprise.filter(|(_, at)| now - at < RECOVERY);
        }
        running.covariance = *covariance;
        running.state.correct(error, 0.0);
        running.history.correct(error, now);
        let part = |from: usize| Vector3::from(error.fixed_rows::<3>(from));
        running.biases[0] += part(GYROSCOPE);
        running.biases[1] += part(ACCELEROMETER);
        running.wind = [running.wind[0] + error[WIND], running.wind[1] + error[WIND + 1]];
        running.side += error[SIDE];
        running.drag += error[DRAG];
        running.clock += error[CLOCK];
        for (_, pointed) in [&mut running.pointed, &mut running.steady].into_iter().flatten() {
            *pointed -= part(ATTITUDE);
        }
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
