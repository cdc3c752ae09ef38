//! Power series of time, in which derivatives along a trajectory are exact.

use crate::dual::Number;
use crate::kinematics::Vector;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Truncated power series c₀ + c₁ t + c₂ t² + ….
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Series(pub(super) [f64; 3]);

impl Series {
    pub(super) fn line(from: f64, slope: f64) -> Self {
        Self([from, slope, 0.0])
    }

    pub(super) fn sin_cos(self) -> (Self, Self) {
        let Self([angle, first, second]) = self;
        let (s, c) = angle.sin_cos();
        let half = 0.5 * first * first;
        (Self([s, c * first, c * second - s * half]), Self([c, -s * first, -s * second - c * half]))
    }
}

impl Number for Series {
    fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0])
    }
    fn squared(self) -> Self {
        self * self
    }
}

impl Neg for Series {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(Neg::neg))
    }
}

impl Add for Series {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl Sub for Series {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Series {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        Self([a * d, a * e + b * d, a * f + b * e + c * d])
    }
}

impl Div for Series {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let ([a, b, c], [d, e, f]) = (self.0, other.0);
        let first = a / d;
        let second = (b - first * e) / d;
        Self([first, second, (c - first * f - second * e) / d])
    }
}

pub(super) fn vector(value: &Vector<f64>) -> Vector<Series> {
    value.map(Series::constant)
}

pub(super) fn coefficient(value: &Vector<Series>, i: usize) -> Vector<f64> {
    value.map(|value| value.0[i])
}

/// Vector that begins at `x` and changes by `v` per unit of time.
pub(super) fn line(x: &Vector<f64>, v: &Vector<f64>) -> Vector<Series> {
    std::array::from_fn(|i| Series::line(x[i], v[i]))
}
