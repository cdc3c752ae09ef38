//! The place of each case in the space of the varied parameters. It depends on the seed and the
//! number of the case alone, so that any case can be computed by itself.

use crate::vary::DesignKind;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// A design of experiments.
#[derive(Clone, Debug)]
pub struct Design {
    kind: DesignKind,
    seed: u64,
    cases: u64,
    /// Number of values of each dimension in the design `levels`, and 0 in others.
    levels: Vec<u64>,
}

impl Design {
    /// Creates a design with as many dimensions as `levels` has entries.
    ///
    /// # Errors
    /// Returns an error if the number of cases does not suit the design, or is missing.
    pub fn new(
        kind: DesignKind,
        seed: u64,
        cases: Option<u64>,
        levels: Vec<u64>,
    ) -> Result<Self, String> {
        let cases = match kind {
            DesignKind::Levels => {
                let product = levels.iter().try_fold(1_u64, |product, n| product.checked_mul(*n));
                let product = product.filter(|product| u32::try_from(*product).is_ok());
                let product =
                    product.ok_or("the values have more combinations than can be flown")?;
                if let Some(cases) = cases.filter(|cases| *cases != product) {
                    return Err(format!(
                        "cases = {cases}, but the values have {product} combinations: leave cases out"
                    ));
                }
                product
            }
            _ => cases.ok_or("cases is missing: it is the number of cases to fly")?,
        };
        if cases > u64::from(u32::MAX) {
            return Err(format!("cases = {cases}, but there can be at most {}", u32::MAX));
        }
        Ok(Self { kind, seed, cases, levels })
    }

    /// Returns the number of cases.
    pub fn cases(&self) -> u64 {
        self.cases
    }

    /// Returns the number of dimensions.
    fn dimensions(&self) -> usize {
        self.levels.len()
    }

    /// Returns the place of a case: along each dimension the probability with which the parameter
    /// is below the value, from 0 to 1.
    pub fn place(&self, case: u64) -> Vec<f64> {
        match self.kind {
            DesignKind::Random => self.random(case),
            DesignKind::Levels => self.combination(case),
            DesignKind::Corners => self.corner(case),
        }
    }

    fn combination(&self, case: u64) -> Vec<f64> {
        let mut rest = case;
        let mut units = vec![0.0; self.dimensions()];
        // The last parameter changes fastest.
        for (unit, count) in units.iter_mut().zip(&self.levels).rev() {
            // The middle of the value's share of the probability.
            *unit = ((rest % count) as f64 + 0.5) / *count as f64;
            rest /= count;
        }
        units
    }

    fn corner(&self, case: u64) -> Vec<f64> {
        let dimensions = self.dimensions();
        let corners = u32::try_from(dimensions).ok().and_then(|n| 1_u64.checked_shl(n));
        let random = self.random(case);
        match corners.filter(|corners| *corners <= self.cases) {
            Some(corners) if case < corners => {
                (0..dimensions).map(|i| (case >> i & 1) as f64).collect()
            }
            None if case.is_multiple_of(2) => random.into_iter().map(f64::round).collect(),
            _ => random,
        }
    }

    /// Draws a uniform number for each dimension.
    fn random(&self, case: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(mixed(self.seed));
        // Each case has a stream of its own.
        random.set_stream(case);
        let unit = |_| (random.next_u64() >> 11) as f64 / 2.0_f64.powi(53);
        (0..self.dimensions()).map(unit).collect()
    }
}

/// Turns a seed into one that looks random: the first number of SplitMix64.
fn mixed(seed: u64) -> u64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn design(kind: DesignKind, cases: u64, dimensions: usize) -> Design {
        Design::new(kind, 7, Some(cases), vec![0; dimensions]).unwrap()
    }

    #[test]
    fn a_case_depends_on_the_seed_and_its_number_alone() {
        for kind in [DesignKind::Random, DesignKind::Corners] {
            let (short, long) = (design(kind, 100, 3), design(kind, 1000, 3));
            assert_eq!(short.place(57), long.place(57));
            assert_ne!(short.place(57), short.place(58));
        }
        let other = Design::new(DesignKind::Random, 8, Some(100), vec![0; 3]).unwrap();
        assert_ne!(other.place(57), design(DesignKind::Random, 100, 3).place(57));
    }

    #[test]
    fn the_levels_have_every_combination_once() {
        let design = Design::new(DesignKind::Levels, 1, None, vec![2, 3, 4]).unwrap();
        assert_eq!(design.cases(), 24);
        let combinations: BTreeSet<String> =
            (0..24).map(|case| format!("{:?}", design.place(case))).collect();
        assert_eq!(combinations.len(), 24);
        assert_eq!(design.place(1), [0.25, 0.5 / 3.0, 0.375]);
        let error = Design::new(DesignKind::Levels, 1, Some(25), vec![2, 3, 4]).unwrap_err();
        assert!(error.contains("24 combinations"), "{error}");
    }

    #[test]
    fn corners_come_first_or_every_other_time() {
        let few = design(DesignKind::Corners, 20, 3);
        let corners: BTreeSet<String> =
            (0..8).map(|case| format!("{:?}", few.place(case))).collect();
        assert_eq!(corners.len(), 8);
        let is_corner = |place: &[f64]| place.iter().all(|unit| *unit == 0.0 || *unit == 1.0);
        assert!((8..20).all(|case| !is_corner(&few.place(case))));
        let many = design(DesignKind::Corners, 20, 30);
        for case in 0..20 {
            assert_eq!(is_corner(&many.place(case)), case % 2 == 0);
        }
    }
}
