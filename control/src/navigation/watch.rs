//! What the measurements of one device have said so far: of the filter, and of the device itself.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use vehicle::math::exp;

/// Measurements in a row that show that the filter is wrong, or that a device agrees with itself
/// again.
pub(super) const RUN: u32 = 5;
/// Time without a contradiction after which the filter counts as right again, s.
pub(super) const RECOVERY: f64 = 60.0;
/// Times over which innovations are averaged, s.
const WINDOWS: [f64; 3] = [1.0, 10.0, 60.0];
/// Number of standard deviations by which such an average may exceed 1.
const SURPRISE: f64 = 6.0;
/// Number of standard deviations by which the mean of single innovations may depart from 0.
const DRIFT: f64 = 5.0;
/// Square beyond which an innovation counts no more: one outlier is forgotten within ten seconds.
const LARGEST: f64 = 25.0;
/// Multiple of the noise of a fix, and share of the way, by which the positions of a receiver may
/// depart from its velocities; time over which the departure is forgotten, s.
pub(super) const DEPARTURE: [f64; 2] = [6.0, 1e-3];
pub(super) const FORGOTTEN: f64 = 30.0;
/// Largest departure that is kept, as a multiple of the largest that agrees.
const LASTING: f64 = 4.0;

/// Measurements of one source so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Watch {
    /// Time of the last one, s.
    pub(super) at: f64,
    /// Number in a row that contradicted the filter, and that agreed among themselves.
    pub(super) refused: u32,
    pub(super) agreed: u32,
    /// Averages of the squares of the normalised innovations per component over [`WINDOWS`].
    averages: [f64; 3],
    /// Averages of single normalised innovations themselves, over the longer ones of these.
    means: [f64; 2],
    /// Number of components of a measurement.
    size: usize,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            at: f64::NEG_INFINITY,
            refused: 0,
            agreed: RUN,
            averages: [1.0; 3],
            means: [0.0; 2],
            size: 1,
        }
    }
}

impl Watch {
    /// Notes the squares of normalised innovations at `time` (s), and the sign of a single one.
    pub(super) fn note(&mut self, time: f64, squares: f64, sign: f64, size: usize) {
        // A gap counts as a second.
        let elapsed = (time - self.at).clamp(0.0, 1.0);
        (self.at, self.size) = (time, size);
        let squares = squares.min(LARGEST);
        for (average, window) in self.averages.iter_mut().zip(WINDOWS) {
            *average += (squares - *average) * (1.0 - exp(-elapsed / window));
        }
        if size == 1 {
            for (mean, window) in self.means.iter_mut().zip(&WINDOWS[1..]) {
                *mean += (sign * squares.sqrt() - *mean) * (1.0 - exp(-elapsed / window));
            }
        }
    }

    /// Returns whether the innovations are larger than chance makes them, and whether they are so over
    /// more than a second. The mean of n squares has
    /// the variance 2/n, and the weights of an average over a time T are those of (2 − a)/a
    /// measurements, with a the weight of one, if they come once a second.
    pub(super) fn is_surprised(&self) -> [bool; 2] {
        let number = |window: f64| {
            let weight = 1.0 - exp(-1.0 / window);
            self.size as f64 * (2.0 - weight) / weight
        };
        let squares = [0, 1, 2]
            .map(|i| self.averages[i] > 1.0 + SURPRISE * (2.0 / number(WINDOWS[i])).sqrt());
        let drifts = [0, 1].map(|i| self.means[i].abs() > DRIFT / number(WINDOWS[i + 1]).sqrt());
        let lasts = squares[2] || drifts.contains(&true);
        [lasts || squares.contains(&true), lasts]
    }
}

/// What a receiver of satellite navigation has said of its own motion, in inertial axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Heard {
    /// Time (s), position (m) and velocity (m/s) of the last fix, if there was one.
    last: Option<(f64, Vector3<f64>, Vector3<f64>)>,
    /// By how much its positions have moved beyond its velocities of late, m.
    departure: Vector3<f64>,
}

impl Heard {
    /// Takes a fix with this noise (m), whose position may be that of the fix before to the last bit.
    /// Returns whether it agrees with those before.
    pub(super) fn agrees(
        &mut self,
        fix: (f64, Vector3<f64>, Vector3<f64>),
        noise: f64,
        is_repeated: bool,
    ) -> bool {
        let (time, position, velocity) = fix;
        let Some((before, from, slower)) = self.last.replace(fix) else { return true };
        let elapsed = time - before;
        let way = (velocity + slower) * (elapsed / 2.0);
        let is_frozen = is_repeated && way.norm() > noise;
        if elapsed > FORGOTTEN && !is_frozen {
            self.departure = Vector3::zeros();
            return true;
        }
        let most = DEPARTURE[0] * noise + DEPARTURE[1] * way.norm();
        let departed = position - from - way;
        let has_jumped = is_frozen || !(elapsed > 0.0 && departed.norm() <= most);
        if has_jumped {
            // It may agree with itself at once where it is now; velocities that do not fit go on.
            self.departure = Vector3::zeros();
            return false;
        }
        self.departure = self.departure * exp(-elapsed / FORGOTTEN) + departed;
        let agrees = self.departure.norm() <= most;
        self.departure = self.departure.cap_magnitude(LASTING * most);
        agrees
    }
}
