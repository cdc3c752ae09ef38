//! Intervals with their derivatives with respect to the coordinates of a box (forward
//! differentiation).

use crate::interval::Interval;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers in which the formulas can be evaluated: intervals, intervals with derivatives, or plain
/// numbers.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Makes a number that does not depend on the coordinates.
    fn constant(value: f64) -> Self;

    /// Returns the square x² of the number.
    #[must_use]
    fn squared(self) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn squared(self) -> Self {
        self * self
    }
}

impl Number for Interval {
    fn constant(value: f64) -> Self {
        Self::point(value)
    }
    fn squared(self) -> Self {
        self.square()
    }
}

/// Enclosure of the values of a function on a box and of its N partial derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    /// Enclosure of the function's values.
    pub value: Interval,
    /// Enclosures of the partial derivatives.
    pub slope: [Interval; N],
}

impl<const N: usize> Dual<N> {
    /// Makes a value that does not depend on the coordinates.
    pub fn fixed(value: Interval) -> Self {
        Self { value, slope: [Interval::ZERO; N] }
    }

    /// Makes coordinate `i` of a box, whose range is `value`.
    pub fn coordinate(i: usize, value: Interval) -> Self {
        let mut slope = [Interval::ZERO; N];
        slope[i] = Interval::ONE;
        Self { value, slope }
    }
}

impl<const N: usize> Number for Dual<N> {
    fn constant(value: f64) -> Self {
        Self::fixed(Interval::point(value))
    }
    fn squared(self) -> Self {
        let twice = self.value + self.value;
        Self { value: self.value.square(), slope: self.slope.map(|slope| twice * slope) }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: self.slope.map(Neg::neg) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            slope: std::array::from_fn(|i| self.slope[i] + other.slope[i]),
        }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    // Multiplies two functions by the product rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: std::array::from_fn(|i| {
                self.slope[i] * other.value + self.value * other.slope[i]
            }),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    // Divides two functions by the quotient rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            slope: std::array::from_fn(|i| (self.slope[i] - value * other.slope[i]) / other.value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_derivatives_of_a_quotient() {
        // The function x²/(x + y) has at (2, 1) the value 4/3 and the derivatives
        // (x² + 2xy)/(x + y)² = 8/9 and −x²/(x + y)² = −4/9.
        let [x, y] = [2.0, 1.0].map(Interval::point);
        let (x, y) = (Dual::<2>::coordinate(0, x), Dual::coordinate(1, y));
        let f = x.squared() / (x + y);
        for (computed, expected) in
            [(f.value, 4.0 / 3.0), (f.slope[0], 8.0 / 9.0), (f.slope[1], -4.0 / 9.0)]
        {
            assert!(
                computed.contains(expected) && computed.width() < 1e-14,
                "{computed:?} {expected}"
            );
        }
    }
}
