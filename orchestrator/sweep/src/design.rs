//! The place of each case in the space of the varied parameters. It depends on the seed and the
//! number of the case alone, so that any case can be computed by itself.

use crate::vary::DesignKind;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use sobol::Sobol;
use sobol::params::JoeKuoD6;

/// Number of bits of a coordinate of Sobol's sequence.
const BITS: i32 = 32;

/// Coordinate of a case along one parameter that varies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// Probability with which the parameter is below the value, in [0, 1).
    Quantile(f64),
    /// Number of a level, from 0.
    Level(u64),
    /// The lower or, if true, the upper end.
    End(bool),
}

/// A design of experiments.
#[derive(Clone, Debug)]
pub struct Design {
    kind: DesignKind,
    seed: u64,
    cases: u64,
    /// Number of levels of each dimension in a factorial design, and 0 in others.
    levels: Vec<u64>,
    /// Direction numbers of Sobol's sequence for each dimension.
    directions: Vec<Vec<u32>>,
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
        let dimensions = levels.len() as u64;
        let cases = match kind {
            DesignKind::Factorial => {
                let product = levels.iter().try_fold(1_u64, |product, n| product.checked_mul(*n));
                let product = product.filter(|product| u32::try_from(*product).is_ok());
                let product =
                    product.ok_or("the levels have more combinations than can be flown")?;
                if let Some(cases) = cases.filter(|cases| *cases != product) {
                    return Err(format!(
                        "cases = {cases}, but the levels have {product} combinations: leave cases out"
                    ));
                }
                product
            }
            _ => cases.ok_or("cases is missing: it is the number of cases to fly")?,
        };
        let block = dimensions + 2;
        if kind == DesignKind::Sensitivity && (cases % block != 0 || cases / block < 2) {
            return Err(format!(
                "cases = {cases}: for {dimensions} parameters this design needs a multiple of {block}, at least {}",
                2 * block
            ));
        }
        if cases > u64::from(u32::MAX) {
            return Err(format!("cases = {cases}, but there can be at most {}", u32::MAX));
        }
        let directions = if kind == DesignKind::Sobol {
            let params = JoeKuoD6::standard();
            if levels.len() > params.max_dims {
                return Err(format!("Sobol's sequence has at most {} parameters", params.max_dims));
            }
            Sobol::<u32>::init_direction_vals::<u32>(levels.len(), BITS as usize, &params)
        } else {
            Vec::new()
        };
        Ok(Self { kind, seed, cases, levels, directions })
    }

    /// Returns the number of cases.
    pub fn cases(&self) -> u64 {
        self.cases
    }

    /// Returns the number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.levels.len()
    }

    /// Returns the place of a case in each dimension.
    pub fn place(&self, case: u64) -> Vec<Place> {
        match self.kind {
            DesignKind::Random => quantiles(self.random(case, 0)),
            DesignKind::LatinHypercube => self.latin(case),
            DesignKind::Sobol => self.sobol(case),
            DesignKind::Factorial => self.combination(case),
            DesignKind::Corners => self.corner(case),
            DesignKind::Sensitivity => self.exchanged(case),
        }
    }

    fn latin(&self, case: u64) -> Vec<Place> {
        let within = self.random(case, 0).into_iter().enumerate();
        quantiles(within.map(|(dimension, within)| {
            let stratum = permuted(case, self.cases, mixed(self.seed, dimension as u64));
            below_one((stratum as f64 + within) / self.cases as f64)
        }))
    }

    fn sobol(&self, case: u64) -> Vec<Place> {
        let within = self.random(case, 0).into_iter().enumerate();
        quantiles(within.map(|(dimension, within)| {
            let bits = self.sobol_bits(case as u32, dimension);
            below_one((f64::from(bits) + within) / 2.0_f64.powi(BITS))
        }))
    }

    fn combination(&self, case: u64) -> Vec<Place> {
        let mut rest = case;
        let mut places: Vec<u64> = self.levels.clone();
        // The last parameter changes fastest.
        for place in places.iter_mut().rev() {
            let count = *place;
            *place = rest % count;
            rest /= count;
        }
        places.into_iter().map(Place::Level).collect()
    }

    fn corner(&self, case: u64) -> Vec<Place> {
        let dimensions = self.dimensions();
        let corners = u32::try_from(dimensions).ok().and_then(|n| 1_u64.checked_shl(n));
        let random = self.random(case, 0);
        match corners.filter(|corners| *corners <= self.cases) {
            Some(corners) if case < corners => {
                (0..dimensions).map(|i| Place::End(case >> i & 1 == 1)).collect()
            }
            None if case.is_multiple_of(2) => {
                random.into_iter().map(|unit| Place::End(unit >= 0.5)).collect()
            }
            _ => quantiles(random),
        }
    }

    /// Returns a member of a sample: A, B, or A with one coordinate of B.
    fn exchanged(&self, case: u64) -> Vec<Place> {
        let sample = self.sample(case);
        let member = (case % self.block()) as usize;
        let mut point = self.random(sample, u64::from(member == 1));
        if let Some(dimension) = member.checked_sub(2) {
            point[dimension] = self.random(sample, 1)[dimension];
        }
        quantiles(point)
    }

    /// Returns the number of the sample that a case belongs to. The cases of a sample of a
    /// sensitivity design differ in nothing but their places.
    pub fn sample(&self, case: u64) -> u64 {
        match self.kind {
            DesignKind::Sensitivity => case / self.block(),
            _ => case,
        }
    }

    /// Returns the number of cases in a sample of a sensitivity design.
    fn block(&self) -> u64 {
        self.dimensions() as u64 + 2
    }

    /// Draws a uniform number for each dimension.
    fn random(&self, case: u64, which: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(mixed(self.seed, which));
        // Each case has a stream of its own.
        random.set_stream(case);
        let unit = |_| (random.next_u64() >> 11) as f64 / 2.0_f64.powi(53);
        (0..self.dimensions()).map(unit).collect()
    }

    /// Returns a coordinate of a point of Sobol's sequence, scrambled by Owen's method.
    fn sobol_bits(&self, index: u32, dimension: usize) -> u32 {
        let gray = index ^ (index >> 1);
        let directions = self.directions[dimension].iter().enumerate();
        let point = directions
            .filter(|(bit, _)| gray >> bit & 1 == 1)
            .fold(0, |point, (_, direction)| point ^ direction);
        scrambled(point, mixed(self.seed, dimension as u64))
    }
}

fn quantiles(units: impl IntoIterator<Item = f64>) -> Vec<Place> {
    units.into_iter().map(Place::Quantile).collect()
}

/// Rounding must not turn a number below 1 into 1.
fn below_one(unit: f64) -> f64 {
    unit.min(1.0 - f64::EPSILON / 2.0)
}

/// Mixes two numbers into one that looks random (the finalizer of SplitMix64).
fn mixed(a: u64, b: u64) -> u64 {
    let mut z = a.wrapping_add(b.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Owen's nested uniform scrambling: whether a bit is flipped depends on all bits above it.
fn scrambled(point: u32, key: u64) -> u32 {
    let mut scrambled = 0;
    for bit in (0..BITS as u32).rev() {
        // The bits above, with a mark in front so that their number counts, too.
        let above = (1_u64 << 32 | u64::from(point)) >> (bit + 1);
        let flip = mixed(key, above) & 1;
        scrambled |= (point >> bit & 1 ^ flip as u32) << bit;
    }
    scrambled
}

/// Returns the place of an element in a random permutation of `count` elements: a Feistel network
/// on the next even power of two, repeated until the place is below `count`.
fn permuted(element: u64, count: u64, key: u64) -> u64 {
    let bits = u64::BITS - count.saturating_sub(1).leading_zeros();
    let half = bits.div_ceil(2).max(1);
    let mask = (1_u64 << half) - 1;
    let mut place = element;
    loop {
        let (mut left, mut right) = (place >> half, place & mask);
        for round in 0..4 {
            (left, right) = (right, left ^ mixed(key ^ round, right) & mask);
        }
        place = left << half | right;
        if place < count {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn design(kind: DesignKind, cases: u64, dimensions: usize) -> Design {
        Design::new(kind, 7, Some(cases), vec![0; dimensions]).unwrap()
    }

    fn units(design: &Design, case: u64) -> Vec<f64> {
        let unit = |place: &Place| match place {
            Place::Quantile(unit) => *unit,
            other => panic!("{other:?}"),
        };
        design.place(case).iter().map(unit).collect()
    }

    #[test]
    fn a_case_depends_on_the_seed_and_its_number_alone() {
        for kind in [DesignKind::Random, DesignKind::Sobol, DesignKind::Corners] {
            let (short, long) = (design(kind, 100, 3), design(kind, 1000, 3));
            assert_eq!(short.place(57), long.place(57));
            assert_ne!(short.place(57), short.place(58));
        }
        let other = Design::new(DesignKind::Random, 8, Some(100), vec![0; 3]).unwrap();
        assert_ne!(other.place(57), design(DesignKind::Random, 100, 3).place(57));
    }

    #[test]
    fn a_latin_hypercube_has_one_case_in_each_stratum_of_each_parameter() {
        for cases in [1, 2, 7, 64, 1000] {
            let design = design(DesignKind::LatinHypercube, cases, 3);
            for dimension in 0..3 {
                let strata: BTreeSet<u64> = (0..cases)
                    .map(|case| (units(&design, case)[dimension] * cases as f64) as u64)
                    .collect();
                assert_eq!(strata.len() as u64, cases);
            }
        }
    }

    #[test]
    fn sobol_points_fill_each_box_of_equal_volume_once() {
        // Every elementary interval of a (0, 2)-sequence in base 2, which the first two dimensions
        // are; scrambling keeps this.
        let design = design(DesignKind::Sobol, 256, 2);
        for across in 0..=8 {
            let (x, y) = (2.0_f64.powi(across), 2.0_f64.powi(8 - across));
            let boxes: BTreeSet<(u64, u64)> = (0..256)
                .map(|case| units(&design, case))
                .map(|point| ((point[0] * x) as u64, (point[1] * y) as u64))
                .collect();
            assert_eq!(boxes.len(), 256);
        }
    }

    #[test]
    fn oracle_random_access_to_sobol_agrees_with_the_sequence() {
        let params = JoeKuoD6::standard();
        let mut design = design(DesignKind::Sobol, 64, 5);
        design.seed = 0;
        let bare = |index: u32, dimension: usize| {
            let gray = index ^ (index >> 1);
            let directions = design.directions[dimension].iter().enumerate();
            directions.filter(|(bit, _)| gray >> bit & 1 == 1).fold(0, |x, (_, d)| x ^ d)
        };
        for (index, point) in Sobol::<u32>::new(5, &params).take(64).enumerate() {
            let computed: Vec<u32> =
                (0..5).map(|dimension| bare(index as u32, dimension)).collect();
            assert_eq!(computed, point);
        }
    }

    #[test]
    fn a_factorial_design_has_every_combination_once() {
        let design = Design::new(DesignKind::Factorial, 1, None, vec![2, 3, 4]).unwrap();
        assert_eq!(design.cases(), 24);
        let combinations: BTreeSet<String> =
            (0..24).map(|case| format!("{:?}", design.place(case))).collect();
        assert_eq!(combinations.len(), 24);
        assert_eq!(design.place(1), [Place::Level(0), Place::Level(0), Place::Level(1)]);
        let error = Design::new(DesignKind::Factorial, 1, Some(25), vec![2, 3, 4]).unwrap_err();
        assert!(error.contains("24 combinations"), "{error}");
    }

    #[test]
    fn corners_come_first_or_every_other_time() {
        let few = design(DesignKind::Corners, 20, 3);
        let corners: BTreeSet<String> =
            (0..8).map(|case| format!("{:?}", few.place(case))).collect();
        assert_eq!(corners.len(), 8);
        assert!((8..20).all(|case| matches!(few.place(case)[0], Place::Quantile(_))));
        let many = design(DesignKind::Corners, 20, 30);
        for case in 0..20 {
            let is_corner = many.place(case).iter().all(|place| matches!(place, Place::End(_)));
            assert_eq!(is_corner, case % 2 == 0);
        }
    }

    #[test]
    fn the_pairs_of_a_sensitivity_design_differ_in_one_coordinate() {
        let design = design(DesignKind::Sensitivity, 20, 3);
        let point = |member| units(&design, 5 + member);
        for dimension in 0..3 {
            let (a, b, mixed) = (point(0), point(1), point(2 + dimension as u64));
            for other in 0..3 {
                assert_eq!(mixed[other], if other == dimension { b[other] } else { a[other] });
            }
        }
        // Within a sample everything else that varies by case, such as a seed, stays the same.
        let samples: Vec<u64> = (0..12).map(|case| design.sample(case)).collect();
        assert_eq!(samples, [0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 2, 2]);
        let error = Design::new(DesignKind::Sensitivity, 1, Some(21), vec![0; 3]).unwrap_err();
        assert!(error.contains("multiple of 5"), "{error}");
    }

    #[test]
    fn the_mean_of_sobol_points_is_far_closer_than_that_of_random_ones() {
        let off = |kind| {
            let design = design(kind, 4096, 6);
            let mean =
                (0..4096).map(|case| units(&design, case).iter().product::<f64>()).sum::<f64>();
            (mean / 4096.0 * 64.0 - 1.0).abs()
        };
        assert!(off(DesignKind::Sobol) < 0.01, "{}", off(DesignKind::Sobol));
        assert!(off(DesignKind::Random) < 0.1);
    }
}
