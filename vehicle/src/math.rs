//! Elementary functions that give the same bits on every platform.
//!
//! `f64::sin` and its like call the C library of the platform, and these libraries differ in the
//! last digit. The FMUs therefore use the functions of this module, which are plain arithmetic in
//! Rust's `libm`. `sqrt`, `abs`, `floor` and the like are exact everywhere and need no substitute.
//!
//! ```
//! use vehicle::math::sin_cos;
//!
//! let (sine, cosine) = sin_cos(0.5);
//! assert_eq!(sine.to_bits(), 0x3fde_aee8_744b_05f0);
//! ```

pub use libm::{
    asin, atan2, cbrt, cos, exp, exp2, expm1 as exp_m1, hypot, log as ln, pow as powf, sin,
    sincos as sin_cos, tan,
};
/// xⁿ for n ≥ 0 by multiplications; the precision of `f64::powi` is left open.
pub use num_traits::pow as powi;
