//! Upper bound of the moment that the law commands anywhere in a box of states.
//!
//! With o the deviation of angles and rates and k that of the acceleration, the moment is linear in
//! k. At each corner of k it is expanded in o to first order about the nominal state; interval
//! enclosures of the second derivatives over the whole box bound the rest.

use crate::body::{Attitude, Body};
use crate::dual::{Dual, Real};
use crate::interval::Interval;
use crate::kinematics::{self, dot, square};

type Vector = kinematics::Vector<Interval>;

/// Number of coordinates: angle of attack, sideslip, and the derivatives of the three angles.
pub(super) const COORDINATES: usize = 5;

/// Function of the coordinates with its first and second derivatives.
type Jet = Dual<COORDINATES, Dual<COORDINATES>>;

/// States and accelerations for which the moment is bounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    /// Angle of attack and sideslip (rad) and x_ω (rad/s) in the middle.
    pub(super) centre: [Interval; COORDINATES],
    /// Half widths about the middle.
    pub(super) radii: [Interval; COORDINATES],
    /// Bounds on the norms of further deviations of the angles (rad) and of the rates (rad/s).
    pub(super) norms: [Interval; 2],
    /// Acceleration in the middle, rad/s², and half widths about it.
    pub(super) acceleration: Vector,
    pub(super) feedback: Vector,
}

impl Range {
    /// Largest deviation of each coordinate.
    fn reach(&self) -> [Interval; COORDINATES] {
        std::array::from_fn(|i| self.radii[i] + self.norms[usize::from(i >= 2)])
    }

    /// Smallest range with the coordinates of both.
    pub(super) fn hull(&self, other: &Self) -> Self {
        let wider = |a: Interval, b: Interval| a.max(b).upper();
        Self {
            centre: std::array::from_fn(|i| self.centre[i].hull(other.centre[i])),
            radii: std::array::from_fn(|i| wider(self.radii[i], other.radii[i])),
            norms: std::array::from_fn(|i| wider(self.norms[i], other.norms[i])),
            acceleration: std::array::from_fn(|i| self.acceleration[i].hull(other.acceleration[i])),
            feedback: std::array::from_fn(|i| wider(self.feedback[i], other.feedback[i])),
        }
    }
}

/// Upper bound of the remainder of the first-order expansion, as a norm, N m.
pub(super) fn remainder(body: &Body, range: &Range) -> Interval {
    let reach = range.reach();
    let coordinate = |i: usize| {
        let value = range.centre[i] + reach[i].to_both_sides();
        Jet::coordinate(i, Dual::coordinate(i, value))
    };
    let acceleration =
        |i: usize| Jet::fixed(range.acceleration[i] + range.feedback[i].to_both_sides());
    let rates = [2, 3, 4].map(coordinate);
    let moment = body.at([0, 1].map(coordinate)).moment(&rates, &[0, 1, 2].map(acceleration));
    square(&moment.map(|component| second_order(&component, &reach))).sqrt().upper()
}

/// Upper bound of ½ |oᵀ H o| over |o_i| ≤ `radii`.
fn second_order(function: &Jet, radii: &[Interval; COORDINATES]) -> Interval {
    let row = |(slope, radius): (&Dual<COORDINATES>, &Interval)| {
        let parts = slope.slope.iter().zip(radii).map(|(bend, other)| bend.abs() * *other);
        parts.fold(Interval::ZERO, |sum, part| sum + part) * *radius
    };
    let rows = function.slope.iter().zip(radii).map(row);
    rows.fold(Interval::ZERO, |sum, row| sum + row) * Interval::from(0.5)
}

impl Range {
    /// The two halves of the range along the wider of the two angles, in which all deviations of
    /// the angles are parts of the box.
    fn halves(&self) -> [Self; 2] {
        let reach = self.reach();
        let wider = usize::from(reach[1].high > reach[0].high);
        let half = reach[wider] * Interval::from(0.5);
        let mut whole = *self;
        (whole.radii[0], whole.radii[1], whole.norms[0]) = (reach[0], reach[1], Interval::ZERO);
        whole.radii[wider] = half;
        [-half, half].map(|shift| {
            let mut part = whole;
            part.centre[wider] = part.centre[wider] + shift;
            part
        })
    }
}

/// Upper bound of the moment over a range, N m, of which parts are examined until it is within
/// `limit` or they have been halved `halvings` times.
pub(super) fn divided(body: &Body, range: &Range, limit: f64, halvings: u32) -> f64 {
    let bound = (Interval::from(largest(body, range)) + remainder(body, range)).high;
    if bound <= limit || halvings == 0 {
        return bound;
    }
    let mut most = 0.0_f64;
    for half in range.halves() {
        most = most.max(divided(body, &half, limit, halvings - 1));
        if most > limit {
            break;
        }
    }
    most
}

/// The moment and its derivatives in the middle of a range.
struct Expansion {
    value: Vector,
    slopes: [Vector; COORDINATES],
    /// Change by the half width of each component of the acceleration, and the derivatives of this
    /// change by the angles.
    columns: [Vector; 3],
    column_slopes: [[Vector; 2]; 3],
}

impl Expansion {
    fn new(body: &Body, range: &Range) -> Self {
        let coordinate = |i: usize| Dual::coordinate(i, range.centre[i]);
        let at: Attitude<Dual<COORDINATES>> = body.at([0, 1].map(coordinate));
        let rates = [2, 3, 4].map(coordinate);
        let moment = at.moment(&rates, &range.acceleration.map(Dual::fixed));
        let column = |i: usize| at.column(i).map(|entry| entry.value * range.feedback[i]);
        let slope = |i: usize, j: usize| at.column(i).map(|e| e.slope[j] * range.feedback[i]);
        Self {
            value: moment.map(|component| component.value),
            slopes: std::array::from_fn(|j| moment.map(|component| component.slope[j])),
            columns: std::array::from_fn(column),
            column_slopes: std::array::from_fn(|i| std::array::from_fn(|j| slope(i, j))),
        }
    }

    /// Returns the value at a corner of the acceleration, and the derivatives there.
    fn corner(&self, corner: usize) -> (Vector, [Vector; COORDINATES]) {
        let (mut value, mut slopes) = (self.value, self.slopes);
        for i in 0..3 {
            let add = |to: &mut Vector, part: &Vector| {
                let sign = |x: Interval| if corner >> i & 1 == 0 { x } else { -x };
                *to = std::array::from_fn(|c| to[c] + sign(part[c]));
            };
            add(&mut value, &self.columns[i]);
            add(&mut slopes[0], &self.column_slopes[i][0]);
            add(&mut slopes[1], &self.column_slopes[i][1]);
        }
        (value, slopes)
    }
}

/// Upper bound of the first-order expansion's norm over the range, N m.
pub(super) fn largest(body: &Body, range: &Range) -> f64 {
    let expansion = Expansion::new(body, range);
    let corner = |corner: usize| {
        let (value, slopes) = expansion.corner(corner);
        farthest(&value, &slopes, range)
    };
    (0..8).map(corner).fold(0.0, f64::max)
}

/// Upper bound of ‖v + Σ slopes_i o_i‖. The changes are split into parts along v and across it.
fn farthest(value: &Vector, slopes: &[Vector; COORDINATES], range: &Range) -> f64 {
    let size = square(value).sqrt();
    let zero = Interval::ZERO;
    if size.low <= 0.0 {
        return far(size, slopes, range);
    }
    let unit = value.map(|component| component / size);
    let (mut along, mut across) = (zero, zero);
    let mut squares = [[zero; 2]; 2];
    for (i, slope) in slopes.iter().enumerate() {
        let part = dot(&unit, slope).abs();
        let rest = (square(slope) - part.square()).max(zero);
        along = along + part * range.radii[i];
        across = across + rest.sqrt() * range.radii[i];
        let sums = &mut squares[usize::from(i >= 2)];
        *sums = [sums[0] + part.square(), sums[1] + rest];
    }
    for (sums, size) in squares.iter().zip(&range.norms) {
        along = along + sums[0].sqrt() * *size;
        across = across + sums[1].sqrt() * *size;
    }
    ((size + along).square() + across.square()).sqrt().high
}

/// The same bound by the triangle inequality.
fn far(size: Interval, slopes: &[Vector; COORDINATES], range: &Range) -> f64 {
    let lengths = slopes.map(|slope| square(&slope));
    let boxed = (0..COORDINATES).map(|i| lengths[i].sqrt() * range.radii[i]);
    let angles = (lengths[0] + lengths[1]).sqrt() * range.norms[0];
    let rates = (lengths[2] + lengths[3] + lengths[4]).sqrt() * range.norms[1];
    boxed.fold(size + angles + rates, |sum, part| sum + part).high
}
