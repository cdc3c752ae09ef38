//! Interval arithmetic that is rounded outwards.
//!
//! An operation rounded to nearest is off by at most half a unit in the last place, so the next
//! numbers below and above the rounded result enclose the exact one. This needs no control of the
//! processor's rounding and no particular processor.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Interval of all real numbers from `low` to `high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Smallest number of the interval.
    pub low: f64,
    /// Largest number of the interval.
    pub high: f64,
}

impl Interval {
    /// Interval that contains only zero.
    pub const ZERO: Self = Self::point(0.0);
    /// Interval that contains only one.
    pub const ONE: Self = Self::point(1.0);
    /// Interval of all numbers, the result if nothing is known.
    pub const ALL: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// Makes the interval that contains only `value`.
    pub const fn point(value: f64) -> Self {
        Self { low: value, high: value }
    }

    /// Makes the interval from `low` to `high`.
    pub const fn new(low: f64, high: f64) -> Self {
        Self { low, high }
    }

    /// Encloses an exact result, given its rounded ends; the result is [`Interval::ALL`] if an end
    /// is NaN.
    fn outward(low: f64, high: f64) -> Self {
        if low.is_nan() || high.is_nan() {
            Self::ALL
        } else {
            Self { low: low.next_down(), high: high.next_up() }
        }
    }

    /// Returns a number within the interval, near its middle.
    pub fn middle(self) -> f64 {
        f64::midpoint(self.low, self.high)
    }

    /// Upper bound of the width `high − low`.
    pub fn width(self) -> f64 {
        (self.high - self.low).next_up()
    }

    /// Encloses the square x².
    #[must_use]
    pub fn square(self) -> Self {
        let size = self.abs();
        Self { low: (size * size).low.max(0.0), high: (size * size).high }
    }

    /// Encloses the absolute value |x|.
    #[must_use]
    pub fn abs(self) -> Self {
        if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            -self
        } else {
            Self { low: 0.0, high: self.high.max(-self.low) }
        }
    }

    /// Encloses √x for the part of the interval that is not negative.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = Self::outward(self.low.max(0.0).sqrt(), self.high.max(0.0).sqrt());
        Self { low: root.low.max(0.0), high: root.high }
    }

    /// Encloses the maximum max(x, y).
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.max(other.high) }
    }

    /// Encloses the minimum min(x, y).
    #[must_use]
    pub fn min(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.min(other.high) }
    }

    /// Smallest interval that contains both intervals.
    #[must_use]
    pub fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether `value` lies in the interval.
    pub fn contains(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// Encloses eˣ for x ≥ 0; the result is [`Interval::ALL`] for others.
    #[must_use]
    pub fn exp(self) -> Self {
        if !(self.low >= 0.0 && self.high < f64::INFINITY) {
            return Self::ALL;
        }
        if self.high > 1.0 {
            return (self * Self::from(0.5)).exp().square();
        }
        // The remainder after xⁿ/n! is below that term for x ≤ 1 and n ≥ 2.
        let (mut sum, mut term) = (Self::ONE, Self::ONE);
        for n in 1..=20_u8 {
            term = term * self / Self::from(f64::from(n));
            sum = sum + term;
        }
        sum + Self::new(0.0, term.high)
    }

    /// Encloses sin x and cos x, x in rad.
    pub fn sin_cos(self) -> (Self, Self) {
        let middle = self.middle();
        if !middle.is_finite() || middle.abs() > 1e3 {
            return (Self::ONE.to_both_sides(), Self::ONE.to_both_sides());
        }
        // By doubling a part of the middle that is at most 1, which is exact.
        let (mut part, mut doublings) = (middle.abs(), 0);
        while part > 1.0 {
            (part, doublings) = (0.5 * part, doublings + 1);
        }
        let (sine, cosine) = Self::point(part).sin_cos_by_series();
        let doubled = |(s, c): (Self, Self), _| ((s + s) * c, Self::ONE - (s + s) * s);
        let (sine, cosine) = (0..doublings).fold((sine, cosine), doubled);
        let (s, c) = (if middle < 0.0 { -sine } else { sine }, cosine);
        if self.low == self.high {
            return (s, c);
        }
        // sin(m + δ) = sin m cos δ + cos m sin δ with |sin δ| ≤ |δ| and 1 − δ²/2 ≤ cos δ ≤ 1.
        let reach = (self - Self::point(middle)).abs().upper();
        let low = (Self::ONE - Self::from(0.5) * reach.square()).low;
        let (sine, cosine) = (reach.to_both_sides(), Self::new(low.max(-1.0), 1.0));
        let within = |value: Self| Self::new(value.low.max(-1.0), value.high.min(1.0));
        (within(s * cosine + c * sine), within(c * cosine - s * sine))
    }

    /// Encloses sin x and cos x for 0 ≤ x ≤ 1.
    fn sin_cos_by_series(self) -> (Self, Self) {
        // Both series alternate with decreasing terms, so each remainder is smaller than the first
        // term left out.
        let square = self.square();
        let (mut sine, mut cosine) = (Self::ZERO, Self::ZERO);
        let (mut odd, mut even) = (self, Self::ONE);
        for n in 1..=10_u8 {
            (sine, cosine) = (sine + odd, cosine + even);
            let n = 2.0 * f64::from(n);
            even = -(even * square) / Self::from((n - 1.0) * n);
            odd = -(odd * square) / Self::from(n * (n + 1.0));
        }
        (sine + odd.abs().to_both_sides(), cosine + even.abs().to_both_sides())
    }

    /// Keeps the upper end of a bound.
    #[must_use]
    pub fn upper(self) -> Self {
        Self::point(self.high)
    }

    /// Interval of all numbers whose size is within this bound.
    #[must_use]
    pub fn to_both_sides(self) -> Self {
        Self::new(-self.high, self.high)
    }

    /// Divides the interval into `count` parts.
    pub fn parts(self, count: u32) -> impl Iterator<Item = Self> + Clone {
        let share = move |i: u32| f64::from(i) / f64::from(count);
        let at = move |i: u32| self.low + (self.high - self.low) * share(i);
        let end = move |i: u32| if i == count { self.high } else { at(i) };
        (0..count).map(move |i| Self::new(at(i), end(i + 1)))
    }
}

/// Makes the interval that contains only `value`.
pub(crate) fn number(value: f64) -> Interval {
    Interval::point(value)
}

impl From<f64> for Interval {
    fn from(value: f64) -> Self {
        Self::point(value)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }
}

// A zero operand is passed through exactly, so that no subnormal numbers arise, which would be
// slow.
impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        if self == Self::ZERO {
            other
        } else if other == Self::ZERO {
            self
        } else {
            Self::outward(self.low + other.low, self.high + other.high)
        }
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        if self == Self::ZERO || other == Self::ZERO {
            return Self::ZERO;
        }
        if self == Self::ONE {
            return other;
        }
        if other == Self::ONE {
            return self;
        }
        let ends = [
            self.low * other.low,
            self.low * other.high,
            self.high * other.low,
            self.high * other.high,
        ];
        if ends.iter().any(|end| end.is_nan()) {
            return Self::ALL;
        }
        let low = ends[0].min(ends[1]).min(ends[2].min(ends[3]));
        let high = ends[0].max(ends[1]).max(ends[2].max(ends[3]));
        Self::outward(low, high)
    }
}

impl Div for Interval {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        if other.contains(0.0) {
            return Self::ALL;
        }
        let inverse = Self::outward(1.0 / other.high, 1.0 / other.low);
        self * inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_operations_enclose_exact_results() {
        let (third, tenth) =
            (Interval::ONE / Interval::from(3.0), Interval::ONE / Interval::from(10.0));
        // As real numbers, 3 · (1/3) = 1 and 0.3 − 3 · 0.1 = 0, though not as rounded ones.
        assert!((third * Interval::from(3.0)).contains(1.0));
        assert!(tenth.contains(0.1) && tenth.low < tenth.high && tenth.width() < 1e-16);
        let zero = tenth + tenth + tenth - Interval::from(3.0) * tenth;
        assert!(zero.contains(0.0) && zero.width() < 1e-15);
        let mixed = Interval::new(-2.0, 3.0);
        assert!(mixed.square().low == 0.0 && (mixed.square().high - 9.0).abs() < 1e-14);
        assert_eq!(Interval::ONE / mixed, Interval::ALL);
        assert!(Interval::from(2.0).sqrt().square().contains(2.0));
    }

    #[test]
    fn oracle_series_enclose_the_functions() {
        for i in 0..=100 {
            let x = f64::from(i) / 100.0;
            let (sine, cosine) = Interval::point(x).sin_cos();
            let exp = Interval::point(x).exp();
            for (computed, expected) in [(sine, x.sin()), (cosine, x.cos()), (exp, x.exp())] {
                assert!(
                    computed.low <= expected + 1e-15
                        && computed.high >= expected - 1e-15
                        && computed.width() < 1e-13
                );
            }
            assert!((sine.square() + cosine.square()).contains(1.0));
        }
        for i in -200..=200 {
            let angle = f64::from(i) * 0.0371;
            let (s, c) = Interval::new(angle - 0.01, angle + 0.02).sin_cos();
            for inside in [angle - 0.01, angle, angle + 0.02] {
                assert!(s.contains(inside.sin()) && c.contains(inside.cos()), "{angle}");
            }
            assert!(s.width() < 0.032 && c.width() < 0.032);
            assert!(Interval::point(angle).sin_cos().0.width() < 1e-13);
        }
    }
}
