//! Random numbers as pure functions of seed and tick: they do not depend on who asks for them, in
//! which order, or how often.

use crate::math::{ln, sin_cos};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// Returns the `N` numbers of a tick, uniform in [−1, 1), by a jump from the generator's start.
pub fn uniform<const N: usize>(seed: u64, tick: i64) -> [f64; N] {
    Stream::new(seed).at(tick)
}

/// The numbers of [`uniform`] for ticks that follow each other. It has a current tick, and a jump
/// to a nearby tick takes less time.
#[derive(Clone, Debug, PartialEq)]
pub struct Stream<const N: usize> {
    seed: u64,
    tick: i64,
    generator: Pcg64,
}

impl<const N: usize> Stream<N> {
    /// Makes the stream of a seed, at tick 0.
    pub fn new(seed: u64) -> Self {
        Self { seed, tick: 0, generator: Pcg64::seed_from_u64(seed) }
    }

    /// Seed of the numbers.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Moves to a tick.
    pub fn move_to(&mut self, tick: i64) {
        let ticks = i128::from(tick) - i128::from(self.tick);
        // Ticks further back step the generator backwards, because the distance is taken modulo
        // 2¹²⁸.
        self.generator.advance((N as i128 * ticks) as u128);
        self.tick = tick;
    }

    /// The `N` numbers of a tick, uniform in [−1, 1).
    pub fn at(&self, tick: i64) -> [f64; N] {
        let mut there = self.clone();
        there.move_to(tick);
        std::array::from_fn(|_| {
            (there.generator.next_u64() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        })
    }
}

/// Turns two uniform numbers in [−1, 1) into two independent normal ones of variance 1 by the
/// method of Box and Muller.
pub fn normal_pair([u, v]: [f64; 2]) -> [f64; 2] {
    // The argument of the logarithm lies in (0, 1], so the logarithm is finite.
    let radius = (-2.0 * ln((1.0 - u) / 2.0)).sqrt();
    let (sine, cosine) = sin_cos(std::f64::consts::PI * v);
    [radius * cosine, radius * sine]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_uniform_numbers_are_one_sequence_before_and_after_the_start() {
        let mut generator = Pcg64::seed_from_u64(7);
        generator.advance(9u128.wrapping_neg());
        for tick in -3..3 {
            let next: [u64; 3] = std::array::from_fn(|_| generator.next_u64() >> 11);
            let expected = next.map(|bits| bits as f64 / (1u64 << 52) as f64 - 1.0);
            assert_eq!(uniform(7, tick), expected, "tick {tick}");
        }
        assert!(uniform::<3>(7, i64::MIN).iter().all(|value| value.abs() <= 1.0));
    }

    #[test]
    fn oracle_numbers_do_not_depend_on_where_the_stream_stands() {
        let mut stream = Stream::<3>::new(7);
        for tick in [5, 6, 1250, -3, i64::MAX, i64::MIN, 0] {
            stream.move_to(tick);
            for target in [tick, tick.saturating_add(1), tick.saturating_sub(1), 0] {
                assert_eq!(stream.at(target), uniform(7, target), "from {tick} to {target}");
            }
        }
    }

    #[test]
    fn oracle_normal_numbers_have_the_moments_of_a_normal_distribution() {
        const COUNT: i64 = 100_000;
        let mut moments = [0.0; 4];
        let mut product = 0.0;
        for tick in 0..COUNT {
            let pair = normal_pair(uniform(3, tick));
            for value in pair {
                for (power, moment) in (1..).zip(&mut moments) {
                    *moment += value.powi(power) / (2 * COUNT) as f64;
                }
            }
            product += pair[0] * pair[1] / COUNT as f64;
        }
        // The bounds are five standard deviations of each estimate: variances 1, 2, 15 and 96 over
        // the number of values.
        let n = 2.0 * COUNT as f64;
        for (computed, expected, variance) in [
            (moments[0], 0.0, 1.0),
            (moments[1], 1.0, 2.0),
            (moments[2], 0.0, 15.0),
            (moments[3], 3.0, 96.0),
            (product, 0.0, 2.0),
        ] {
            assert!(
                (computed - expected).abs() < 5.0 * (variance / n).sqrt(),
                "{computed} {expected}"
            );
        }
        assert!(
            normal_pair([-1.0, 0.5])
                .into_iter()
                .chain(normal_pair([1f64.next_down(), 0.0]))
                .all(f64::is_finite)
        );
    }
}
