//! The theory of Wu 2015 in numbers: its lemmas and theorems with the implemented laws put into
//! them, and the misprints that show where its bounds do not hold. A bound on a random draw is at
//! most twice the largest value of ten thousand draws.

mod boundary_layer;
mod dynamics;
mod flight;
mod lemmas;
mod observer;
mod second_order;

/// Returns |x|^a sgn(x).
fn sig(x: f64, a: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.abs().powf(a) * x.signum() }
}

/// Integrates `f` from `from` to `to` by Simpson's rule.
fn simpson(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const HALVES: u32 = 4000;
    let h = (to - from) / f64::from(2 * HALVES);
    let at = |k: u32| f(from + f64::from(k) * h);
    let middles: f64 = (0..HALVES).map(|k| at(2 * k + 1)).sum();
    let inner: f64 = (1..HALVES).map(|k| at(2 * k)).sum();
    h / 3.0 * (at(0) + 4.0 * middles + 2.0 * inner + at(2 * HALVES))
}
