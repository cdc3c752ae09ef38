//! Intervals with first and second derivatives with respect to angle of attack, sideslip and the
//! three rates.

use crate::dual::Number;
use crate::interval::Interval;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number of coordinates: angle of attack, sideslip, and the derivatives of the three angles.
pub(super) const COORDINATES: usize = 5;
const PAIRS: usize = COORDINATES * (COORDINATES + 1) / 2;

/// Enclosure of a function's values on a box, with those of its first and second derivatives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jet {
    pub(super) value: Interval,
    pub(super) slope: [Interval; COORDINATES],
    /// Second derivatives by the coordinates i ≤ j, row by row.
    bend: [Interval; PAIRS],
}

/// Returns the place of the second derivative by the coordinates i ≤ j.
const fn place(i: usize, j: usize) -> usize {
    i * COORDINATES - i * (i + 1) / 2 + j
}

impl Jet {
    /// Makes a value that does not depend on the coordinates.
    pub(super) const fn fixed(value: Interval) -> Self {
        Self { value, slope: [Interval::ZERO; COORDINATES], bend: [Interval::ZERO; PAIRS] }
    }

    /// Makes a function of coordinate `i` alone, from its value and derivatives.
    pub(super) fn of_coordinate(
        i: usize,
        value: Interval,
        first: Interval,
        second: Interval,
    ) -> Self {
        let mut jet = Self::fixed(value);
        jet.slope[i] = first;
        jet.bend[place(i, i)] = second;
        jet
    }

    /// Upper bound of ½ |oᵀ H o| over |o_i| ≤ `radii`.
    pub(super) fn remainder(&self, radii: &[Interval; COORDINATES]) -> Interval {
        let half = Interval::from(0.5);
        let mut sum = Interval::ZERO;
        for i in 0..COORDINATES {
            sum = sum + half * self.bend[place(i, i)].abs() * radii[i].square();
            for j in i + 1..COORDINATES {
                sum = sum + self.bend[place(i, j)].abs() * radii[i] * radii[j];
            }
        }
        sum
    }
}

impl Number for Jet {
    fn constant(value: f64) -> Self {
        Self::fixed(Interval::point(value))
    }
    fn squared(self) -> Self {
        self * self
    }
}

impl Neg for Jet {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: self.slope.map(Neg::neg), bend: self.bend.map(Neg::neg) }
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: std::array::from_fn(|i| self.slope[i] + other.slope[i]),
            bend: std::array::from_fn(|i| self.bend[i] + other.bend[i]),
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Jet {
    type Output = Self;
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Self) -> Self {
        let mut bend = [Interval::ZERO; PAIRS];
        for i in 0..COORDINATES {
            for j in i..COORDINATES {
                let at = place(i, j);
                bend[at] = self.bend[at] * other.value
                    + self.value * other.bend[at]
                    + self.slope[i] * other.slope[j]
                    + self.slope[j] * other.slope[i];
            }
        }
        let slope = |i: usize| self.slope[i] * other.value + self.value * other.slope[i];
        Self { value: self.value * other.value, slope: std::array::from_fn(slope), bend }
    }
}

impl Div for Jet {
    type Output = Self;
    // Nothing here divides by a function of the coordinates; the result is right, if wide.
    fn div(self, other: Self) -> Self {
        let depends = other.slope.iter().chain(&other.bend).any(|&slope| slope != Interval::ZERO);
        let by = if depends { Interval::ALL } else { Interval::ONE / other.value };
        self * Self::fixed(by)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_second_derivatives_of_a_product() {
        // f = x² y at (3, 2): f_xx = 2 y, f_xy = 2 x, f_yy = 0.
        let variable = |i: usize, value: f64| {
            Jet::of_coordinate(i, value.into(), Interval::ONE, Interval::ZERO)
        };
        let (x, y) = (variable(0, 3.0), variable(3, 2.0));
        let f = x.squared() * y;
        assert!(f.value.contains(18.0) && f.slope[0].contains(12.0) && f.slope[3].contains(9.0));
        assert!(f.bend[place(0, 0)].contains(4.0) && f.bend[place(0, 3)].contains(6.0));
        let radii = [0.5, 0.0, 0.0, 0.25, 0.0].map(Interval::from);
        // ½ · 4 · 0.25 + 6 · 0.125
        assert!(f.remainder(&radii).contains(1.25));
    }
}
