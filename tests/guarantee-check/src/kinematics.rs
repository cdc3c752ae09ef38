//! W = R⁻¹ with its derivatives, and the gyroscopic moment, written anew for this check.
//!
//! W y = T(α) V(β) y with V y = [p, t, q] = [−c (s y₁ + y₃), c² y₁ − s y₃, y₂], s = sin β, c = cos
//! β. T is orthogonal and turns p and q into each other: ∂T/∂α = T J with J [p, t, q] = [q, 0, −p].
//! Hence ∂ⁱ⁺ʲ(W y)/∂αⁱ∂βʲ = T Jⁱ ∂ʲ(V y)/∂βʲ. Norms without the inertia therefore depend on β
//! alone, and all of them are computed with T = 1.

use crate::dual::Number;

/// Vector with three components.
pub type Vector<T> = [T; 3];

/// Returns the sine and cosine of an angle δ from u = tan(δ/2).
pub fn sine_cosine<T: Number>(u: T) -> (T, T) {
    let one = T::constant(1);
    let square = u.squared();
    let scale = one / (one + square);
    ((u + u) * scale, (one - square) * scale)
}

/// Returns the scalar product of a and b.
pub fn dot<T: Number>(a: &Vector<T>, b: &Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Returns the squared norm ‖a‖².
pub fn square<T: Number>(a: &Vector<T>) -> T {
    a[0].squared() + a[1].squared() + a[2].squared()
}

/// Returns the sum a + b.
pub fn sum<T: Number, const M: usize>(a: [T; M], b: [T; M]) -> [T; M] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Returns the product a x of a number and a vector.
pub fn scaled<T: Number, const M: usize>(a: T, x: [T; M]) -> [T; M] {
    x.map(|x| a * x)
}

/// Returns the vector product of a and b.
pub fn cross<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns the unit vector along axis `i`.
pub fn unit<T: Number>(i: usize) -> Vector<T> {
    std::array::from_fn(|j| T::constant(i32::from(i == j)))
}

/// Returns the product M x, given the rows of M.
pub fn times<T: Number>(rows: &[Vector<T>; 3], x: &Vector<T>) -> Vector<T> {
    std::array::from_fn(|i| dot(&rows[i], x))
}

/// W and its derivatives at one sideslip angle, all without T.
#[derive(Clone, Copy, Debug)]
pub struct Turn<T> {
    sine: T,
    cosine: T,
    /// Values of sin 2β and cos 2β.
    double: (T, T),
}

impl<T: Number> Turn<T> {
    /// Makes W at the sideslip angle with this sine and cosine.
    pub fn new(sine: T, cosine: T) -> Self {
        let product = sine * cosine;
        Self { sine, cosine, double: (product + product, cosine.squared() - sine.squared()) }
    }

    /// Derivative ∂ʲ(V y)/∂βʲ for j ≤ 4, from V y = [−½ y₁ sin 2β − y₃ cos β, ½ y₁ (1 + cos 2β) −
    /// y₃ sin β, y₂].
    pub fn by_sideslip(&self, order: usize, y: &Vector<T>) -> Vector<T> {
        let Self { sine: s, cosine: c, double: (s2, c2) } = *self;
        let [two, four, eight] = [2, 4, 8].map(T::constant);
        match order {
            0 => [-(c * (s * y[0] + y[2])), c.squared() * y[0] - s * y[2], y[1]],
            1 => [s * y[2] - c2 * y[0], -(s2 * y[0] + c * y[2]), T::constant(0)],
            2 => [two * s2 * y[0] + c * y[2], s * y[2] - two * c2 * y[0], T::constant(0)],
            3 => [four * c2 * y[0] - s * y[2], four * s2 * y[0] + c * y[2], T::constant(0)],
            _ => [-(eight * s2 * y[0] + c * y[2]), eight * c2 * y[0] - s * y[2], T::constant(0)],
        }
    }

    /// Partial derivative ∂ⁱ⁺ʲ(W y)/∂αⁱ∂βʲ, without T.
    pub fn derivative(&self, by_alpha: usize, by_beta: usize, y: &Vector<T>) -> Vector<T> {
        let mut value = self.by_sideslip(by_beta, y);
        for _ in 0..by_alpha {
            value = [value[2], T::constant(0), -value[0]];
        }
        value
    }

    /// Derivative ∂ⁿW[o, o′, …] y of W y along the given changes of (α, β), one after the other.
    pub fn along(&self, directions: &[[T; 2]], y: &Vector<T>) -> Vector<T> {
        self.partly(directions, (0, 0), y)
    }

    fn partly(&self, directions: &[[T; 2]], taken: (usize, usize), y: &Vector<T>) -> Vector<T> {
        match directions {
            [] => self.derivative(taken.0, taken.1, y),
            [first, rest @ ..] => {
                let by_alpha = self.partly(rest, (taken.0 + 1, taken.1), y);
                let by_beta = self.partly(rest, (taken.0, taken.1 + 1), y);
                sum(scaled(first[0], by_alpha), scaled(first[1], by_beta))
            }
        }
    }

    /// Product R y for a vector y without T.
    pub fn r(&self, y: &Vector<T>) -> Vector<T> {
        let Self { sine: s, cosine: c, .. } = *self;
        [y[1] - y[0] * s / c, y[2], -(y[0] * c) - y[1] * s]
    }

    /// Drift term Ẇ x = ∂W[x₁, x₂] x.
    pub fn drift(&self, x: &Vector<T>) -> Vector<T> {
        let Self { sine: s, cosine: c, .. } = *self;
        let once = s * x[0] + x[2];
        let twice = s * x[0] + once;
        [s * x[1] * twice, -(c * x[1] * twice), c * x[0] * once]
    }
}

/// Product T(α) [p, t, q], given the sine and cosine of α.
pub fn turned<T: Number>(sine: T, cosine: T, y: &Vector<T>) -> Vector<T> {
    [cosine * y[0] + sine * y[2], y[1], sine * y[0] - cosine * y[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::linearise::{InverseKinematics, body_rates};
    use nalgebra::Vector3;

    #[test]
    fn oracle_the_same_kinematics_as_those_of_the_controller() {
        let (alpha, beta, x) = (0.3_f64, -0.2_f64, [0.5, -0.7, 0.4]);
        let angles = Vector3::new(alpha, beta, 0.1);
        let turn = Turn::new(beta.sin(), beta.cos());
        let with_t = |y: Vector<f64>| Vector3::from(turned(alpha.sin(), alpha.cos(), &y));
        let theirs = InverseKinematics::at(&angles).body_rates(&x.into());
        assert!((theirs.0 - with_t(turn.along(&[], &x))).norm() < 1e-15);
        for (i, direction) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
            assert!((theirs.1[i] - with_t(turn.along(&[direction], &x))).norm() < 1e-15);
        }
        let drift: Vector<f64> = turn.along(&[[x[0], x[1]]], &x);
        assert!((Vector3::from(turn.drift(&x)) - Vector3::from(drift)).norm() < 1e-15);
        let back = turn.r(&turn.along(&[], &x));
        assert!((Vector3::from(back) - Vector3::from(x)).norm() < 1e-15);
    }

    #[test]
    fn oracle_higher_derivatives_agree_with_differences() {
        let (beta, x, step) = (-0.2_f64, [0.5, -0.7, 0.4], 1e-5);
        for (direction, before) in [
            ([0.6, -0.8], vec![]),
            ([0.6, -0.8], vec![[0.3, 0.9]]),
            ([1.0, 0.5], vec![[0.3, 0.9], [0.2, -1.0]]),
        ] {
            let at = |size: f64| {
                let (alpha, beta) = (size * direction[0], beta + size * direction[1]);
                let turn = Turn::new(beta.sin(), beta.cos());
                // The turn by a small α in the frame without T is T(0)⁻¹ T(α).
                let y: Vector<f64> = turn.along(&before, &x);
                let (s, c) = alpha.sin_cos();
                Vector3::new(c * y[0] + s * y[2], y[1], c * y[2] - s * y[0])
            };
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            let mut directions = vec![direction];
            directions.extend(&before);
            let exact = Turn::new(beta.sin(), beta.cos()).along(&directions, &x);
            assert!((numeric - Vector3::from(exact)).norm() < 1e-8, "{numeric} {exact:?}");
        }
        let angles = Vector3::new(0.0, beta, 0.0);
        assert!(
            (body_rates(&angles, &x.into()).norm()
                - square(&Turn::new(beta.sin(), beta.cos()).along(&[], &x)).sqrt())
            .abs()
                < 1e-15
        );
    }
}
