//! Numbers in which a formula can be evaluated, and functions on a box with their derivatives with
//! respect to its coordinates (forward differentiation).

use crate::interval::Interval;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers in which the formulas can be evaluated: intervals, plain and exact numbers, and any of
/// them with derivatives.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Makes the number of an integer; it does not depend on the coordinates.
    fn constant(value: i32) -> Self;

    /// Returns the square x² of the number.
    #[must_use]
    fn squared(self) -> Self {
        self * self
    }
}

/// Numbers with sine and cosine.
pub trait Real: Number {
    /// Makes the number that an interval encloses; it does not depend on the coordinates.
    fn fixed(value: Interval) -> Self;

    /// Returns the sine and the cosine of an angle, rad.
    fn sin_cos(self) -> (Self, Self);
}

impl Number for f64 {
    fn constant(value: i32) -> Self {
        value.into()
    }
}

impl Real for f64 {
    fn fixed(value: Interval) -> Self {
        value.middle()
    }
    fn sin_cos(self) -> (Self, Self) {
        self.sin_cos()
    }
}

impl Number for Interval {
    fn constant(value: i32) -> Self {
        Self::point(value.into())
    }
    fn squared(self) -> Self {
        self.square()
    }
}

impl Real for Interval {
    fn fixed(value: Interval) -> Self {
        value
    }
    fn sin_cos(self) -> (Self, Self) {
        self.sin_cos()
    }
}

/// Values of a function on a box, and those of its N partial derivatives. If these are numbers with
/// derivatives themselves, the second derivatives are among them.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize, T = Interval> {
    /// Values of the function.
    pub value: T,
    /// Values of the partial derivatives.
    pub slope: [T; N],
}

impl<const N: usize, T: Number> Dual<N, T> {
    /// Makes coordinate `i` of a box, whose range is `value`.
    pub fn coordinate(i: usize, value: T) -> Self {
        let slope = std::array::from_fn(|j| T::constant(i32::from(i == j)));
        Self { value, slope }
    }
}

impl<const N: usize, T: Number> Number for Dual<N, T> {
    fn constant(value: i32) -> Self {
        Self { value: T::constant(value), slope: [T::constant(0); N] }
    }
    fn squared(self) -> Self {
        let twice = self.value + self.value;
        Self { value: self.value.squared(), slope: self.slope.map(|slope| twice * slope) }
    }
}

impl<const N: usize, T: Real> Real for Dual<N, T> {
    fn fixed(value: Interval) -> Self {
        Self { value: T::fixed(value), slope: [T::constant(0); N] }
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sine, cosine) = self.value.sin_cos();
        (
            Self { value: sine, slope: self.slope.map(|slope| cosine * slope) },
            Self { value: cosine, slope: self.slope.map(|slope| -(sine * slope)) },
        )
    }
}

impl<const N: usize, T: Number> Neg for Dual<N, T> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, slope: self.slope.map(Neg::neg) }
    }
}

impl<const N: usize, T: Number> Add for Dual<N, T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let slope = std::array::from_fn(|i| self.slope[i] + other.slope[i]);
        Self { value: self.value + other.value, slope }
    }
}

impl<const N: usize, T: Number> Sub for Dual<N, T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<const N: usize, T: Number> Mul for Dual<N, T> {
    type Output = Self;
    // Multiplies two functions by the product rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn mul(self, other: Self) -> Self {
        let slope = |i: usize| self.slope[i] * other.value + self.value * other.slope[i];
        Self { value: self.value * other.value, slope: std::array::from_fn(slope) }
    }
}

impl<const N: usize, T: Number> Div for Dual<N, T> {
    type Output = Self;
    // Divides two functions by the quotient rule.
    #[allow(clippy::suspicious_arithmetic_impl)]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let slope = |i: usize| (self.slope[i] - value * other.slope[i]) / other.value;
        Self { value, slope: std::array::from_fn(slope) }
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

    #[test]
    fn oracle_second_derivatives_of_a_product_and_of_a_sine() {
        // f = x² y at (3, 2): f_xx = 2 y, f_xy = 2 x, f_yy = 0.
        type Twice<T> = Dual<2, Dual<2, T>>;
        let variable =
            |i: usize, value: f64| Twice::coordinate(i, Dual::coordinate(i, Interval::from(value)));
        let f = variable(0, 3.0).squared() * variable(1, 2.0);
        let first = [0, 1].map(|i| f.slope[i].value);
        assert!(f.value.value.contains(18.0) && first[0].contains(12.0) && first[1].contains(9.0));
        let second = [(0, 0, 4.0), (0, 1, 6.0), (1, 0, 6.0), (1, 1, 0.0)];
        assert!(second.iter().all(|&(i, j, expected)| f.slope[i].slope[j].contains(expected)));
        let (sine, cosine) = Twice::coordinate(0, Dual::coordinate(0, 0.3_f64)).sin_cos();
        assert!((sine.slope[0].slope[0] + 0.3_f64.sin()).abs() < 1e-15);
        assert!((cosine.slope[0].slope[0] + 0.3_f64.cos()).abs() < 1e-15);
    }
}
