//! Fixed-step integration of ẏ = f(t, y).

use nalgebra::SVector;

/// Takes one step of the classic fourth-order Runge–Kutta method, from `time` over `h` (both in s).
pub fn rk4<const N: usize>(
    f: &mut impl FnMut(f64, &SVector<f64, N>) -> SVector<f64, N>,
    time: f64,
    y: &SVector<f64, N>,
    h: f64,
) -> SVector<f64, N> {
    let k1 = f(time, y);
    let k2 = f(time + h / 2.0, &(y + k1 * (h / 2.0)));
    let k3 = f(time + h / 2.0, &(y + k2 * (h / 2.0)));
    let k4 = f(time + h, &(y + k3 * h));
    y + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0)
}

/// Number of equal steps, at least one, that make up `length`, none of them longer than `step`
/// beyond rounding.
pub fn equal_steps(length: f64, step: f64) -> u64 {
    ((length / step * (1.0 - crate::time::TOLERANCE)).ceil() as u64).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_time_dependent_cubic_is_integrated_exactly() {
        let y = rk4(
            &mut |t, _| SVector::<f64, 1>::new(4.0 * t.powi(3)),
            0.5,
            &SVector::<f64, 1>::new(0.0625),
            1.5,
        );
        assert!((y[0] - 16.0).abs() < 1e-13);
    }

    #[test]
    fn equal_steps_ignore_rounding() {
        assert_eq!(equal_steps(0.04, 0.01), 4);
        assert_eq!(equal_steps(0.12 - 0.08, 0.01), 4);
        assert_eq!(equal_steps(0.16 - 0.12, 0.01), 4);
        assert_eq!(equal_steps(0.041, 0.01), 5);
        assert_eq!(equal_steps(1e-17, 0.01), 1);
        assert_eq!(equal_steps(0.005, 0.01), 1);
    }
}
