//! Sensitivity of a measure to each varied parameter, and the share of the noise.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use sweep::statistics::CONFIDENCE;
use sweep::vary::DesignKind;

/// A number that was estimated from a sample, with its interval at [`CONFIDENCE`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Estimate {
    /// Estimated value.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Sensitivity of a measure to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Name of the parameter.
    pub parameter: String,
    /// Rank correlation of parameter and measure (Spearman); none if one of them is constant.
    pub rank_correlation: Option<Estimate>,
    /// Probability of a rank correlation at least as large if the two were independent.
    pub p_value: Option<f64>,
    /// Share of the measure's variance that the parameter explains by itself (Sobol's first-order
    /// index), if the design allows it.
    pub first_order: Option<Estimate>,
    /// Share of the variance in which the parameter takes part (total index).
    pub total: Option<Estimate>,
}

/// A parameter that varies, with its values in all cases.
#[derive(Clone, Debug)]
pub struct Input {
    /// Name of the parameter.
    pub name: String,
    /// Whether its values are seeds.
    pub is_seed: bool,
    /// Values in the order of the cases.
    pub values: Vec<f64>,
}

/// Computes the rank correlation of two samples, in which pairs with a value that is not a number
/// are left out, and its p-value. The interval is that of Bonett and Wright (2000).
pub fn rank_correlation(x: &[f64], y: &[f64]) -> Option<(Estimate, f64)> {
    let pairs = x.iter().zip(y).filter(|(x, y)| !x.is_nan() && !y.is_nan());
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.map(|(x, y)| (*x, *y)).unzip();
    let value = correlation(&ranks(&x), &ranks(&y))?;
    let freedom = x.len() as f64 - 2.0;
    if freedom < 1.0 {
        return None;
    }
    let rest = 1.0 - value * value;
    let t = if rest > 0.0 { value * (freedom / rest).sqrt() } else { f64::INFINITY };
    let t_distribution = StudentsT::new(0.0, 1.0, freedom).ok()?;
    let width = Normal::standard().inverse_cdf(0.5 + CONFIDENCE / 2.0)
        * ((1.0 + value * value / 2.0) / (freedom - 1.0)).sqrt();
    // Fisher's transformation of 1 is infinite: there, it is taken of the next smaller value.
    let n = x.len() as f64;
    let nearest = 1.0 - 12.0 / (n * (n * n - 1.0));
    let centre = value.clamp(-nearest, nearest).atanh();
    // Three pairs are too few.
    let end = |sign: f64| if n > 3.0 { (centre + sign * width).tanh() } else { sign };
    let (low, high) = (end(-1.0).min(value), end(1.0).max(value));
    Some((Estimate { value, low, high }, 2.0 * (1.0 - t_distribution.cdf(t.abs()))))
}

/// Returns the rank of each value; equal values share the mean of their ranks.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut below = 0.0;
    for tied in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let count = tied.len() as f64;
        for index in tied {
            ranks[*index] = below + (count - 1.0) / 2.0;
        }
        below += count;
    }
    ranks
}

fn correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        let (x, y) = (x - mean_x, y - mean_y);
        xx += x * x;
        yy += y * y;
        xy += x * y;
    }
    (xx > 0.0 && yy > 0.0).then(|| (xy / (xx * yy).sqrt()).clamp(-1.0, 1.0))
}

/// Sobol's indices of a measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Indices {
    /// First-order and total index of each parameter.
    pub parameters: Vec<[Estimate; 2]>,
    /// First-order index of the noise of the seeds, which varies in each sample besides the
    /// parameters.
    pub noise: Estimate,
}

/// Computes the indices of all parameters from a measure of the cases of a design of the kind
/// [`DesignKind::Sensitivity`]: first-order by Saltelli et al. 2010, total by Jansen 1999. The two
/// points of a sample share their seeds and nothing else, so that their covariance is the variance
/// of the noise. Samples with a value that is not a number are left out.
pub fn indices(measure: &[f64], parameters: usize) -> Option<Indices> {
    let block = parameters + 2;
    let samples: Vec<&[f64]> =
        measure.chunks_exact(block).filter(|sample| sample.iter().all(|v| v.is_finite())).collect();
    let n = samples.len() as f64;
    let mean = samples.iter().flat_map(|sample| &sample[..2]).sum::<f64>() / (2.0 * n);
    let share = |part: &dyn Fn(&[f64]) -> f64| {
        let square =
            |sample: &[f64]| f64::midpoint((sample[0] - mean).powi(2), (sample[1] - mean).powi(2));
        ratio(samples.iter().map(|sample| (part(sample), square(sample))))
    };
    // The mean is subtracted, which changes nothing in theory but removes much of the noise.
    let noise = share(&|sample| (sample[0] - mean) * (sample[1] - mean))?;
    let index = |parameter: usize| {
        let first = |sample: &[f64]| (sample[1] - mean) * (sample[2 + parameter] - sample[0]);
        let total = |sample: &[f64]| 0.5 * (sample[0] - sample[2 + parameter]).powi(2);
        Some([share(&first)?, share(&total)?])
    };
    Some(Indices { parameters: (0..parameters).map(index).collect::<Option<_>>()?, noise })
}

/// Estimates the ratio of the means of two quantities, which is a share, from pairs of them. The
/// interval is that of the ratio's linear expansion, by Student's distribution; it is cut off at 0
/// and 1, between which a share lies.
fn ratio(pairs: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Estimate> {
    let (mut n, mut parts, mut wholes) = (0.0, 0.0, 0.0);
    for (part, whole) in pairs.clone() {
        (n, parts, wholes) = (n + 1.0, parts + part, wholes + whole);
    }
    let value = parts / wholes;
    if n < 2.0 || !value.is_finite() {
        return None;
    }
    let residuals: f64 = pairs.map(|(part, whole)| (part - value * whole).powi(2)).sum();
    let deviation = (residuals * n / (n - 1.0)).sqrt() / wholes;
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(0.5 + CONFIDENCE / 2.0);
    let cut = |value: f64| value.clamp(0.0, 1.0);
    let (low, high) = (cut(value - t * deviation), cut(value + t * deviation));
    Some(Estimate { value: cut(value), low, high })
}

/// Computes the sensitivities of a measure to all parameters that are no seeds, and the share of
/// its variance due to the noise of the seeds, if the design gives it.
pub fn sensitivities(
    design: DesignKind,
    inputs: &[Input],
    measure: &[f64],
) -> (Vec<Sensitivity>, Option<Estimate>) {
    let indices =
        (design == DesignKind::Sensitivity).then(|| indices(measure, inputs.len())).flatten();
    // Of the points of a sample, the first two share no parameter: the others repeat theirs.
    let block = inputs.len() + 2;
    let independent = |values: &[f64]| -> Vec<f64> {
        let values = values.iter().enumerate();
        let own = values.filter(|(case, _)| indices.is_none() || case % block < 2);
        own.map(|(_, value)| *value).collect()
    };
    let measured = independent(measure);
    let sensitivity = |(place, input): (usize, &Input)| {
        let ranks = rank_correlation(&independent(&input.values), &measured);
        let index = indices.as_ref().map(|indices| indices.parameters[place]);
        Sensitivity {
            parameter: input.name.clone(),
            rank_correlation: ranks.map(|(correlation, _)| correlation),
            p_value: ranks.map(|(_, p)| p),
            first_order: index.map(|[first, _]| first),
            total: index.map(|[_, total]| total),
        }
    };
    // An order of seeds has no meaning.
    let ordered = inputs.iter().enumerate().filter(|(_, input)| !input.is_seed);
    let has_noise = inputs.iter().any(|input| input.is_seed);
    let noise = indices.as_ref().map(|indices| indices.noise).filter(|_| has_noise);
    (ordered.map(sensitivity).collect(), noise)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sweep::design::{Design, Place};

    #[test]
    fn oracle_rank_correlation_by_hand() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        // scipy.stats.spearmanr([1, 2, 3, 4, 5], [5, 6, 7, 8, 7])
        let (r, p) = rank_correlation(&x, &[5.0, 6.0, 7.0, 8.0, 7.0]).unwrap();
        assert!((r.value - 0.820_782_681_668_123_3).abs() < 1e-12, "{r:?}");
        assert!((p - 0.088_587_005_313_543_83).abs() < 1e-9, "{p}");
        // tanh(atanh(r) -+ 1.959964 sqrt((1 + r^2 / 2) / 2))
        assert!((r.low + 0.416_291).abs() < 1e-5 && (r.high - 0.992_046).abs() < 1e-5, "{r:?}");
        let (r, _) = rank_correlation(&x, &[1.0, 8.0, 27.0, f64::NAN, 125.0]).unwrap();
        // Four pairs in order are weak evidence.
        assert!(r.value == 1.0 && r.low < 0.0 && r.high == 1.0, "{r:?}");
        assert_eq!(rank_correlation(&x, &[2.0; 5]), None);
    }

    /// The function of Ishigami, whose places are those of a design.
    fn ishigami(places: &[Place]) -> f64 {
        let x: Vec<f64> = places
            .iter()
            .map(|place| match place {
                Place::Quantile(unit) => std::f64::consts::PI * (2.0 * unit - 1.0),
                _ => f64::NAN,
            })
            .collect();
        x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
    }

    // Saltelli et al. 2008, a = 7, b = 0.1: S = 0.3139, 0.4424, 0; T = 0.5576, 0.4424, 0.2437.
    const PUBLISHED: [[f64; 2]; 3] = [[0.3139, 0.5576], [0.4424, 0.4424], [0.0, 0.2437]];

    fn sensitivity(seed: u64, samples: u64, dimensions: usize) -> Design {
        let cases = samples * (dimensions as u64 + 2);
        Design::new(DesignKind::Sensitivity, seed, Some(cases), vec![0; dimensions]).unwrap()
    }

    #[test]
    fn published_indices_of_the_ishigami_function() {
        let design = sensitivity(3, 1 << 14, 3);
        let measure: Vec<f64> =
            (0..design.cases()).map(|case| ishigami(&design.place(case))).collect();
        let computed = indices(&measure, 3).unwrap();
        for (estimates, published) in computed.parameters.iter().zip(PUBLISHED) {
            for (estimate, published) in estimates.iter().zip(published) {
                assert!((estimate.value - published).abs() < 0.03, "{estimate:?} {published}");
            }
        }
        assert!(computed.noise.value < 0.03, "{:?}", computed.noise);
    }

    #[test]
    fn oracle_the_share_of_the_noise_is_what_remains() {
        // The variance of Ishigami's function is 13.8446, that of noise between -15 and 15 is 75.
        let (design, noise) = (sensitivity(5, 4000, 4), sensitivity(6, 4000, 4));
        let value = |case: u64| {
            let sample = 6 * design.sample(case);
            let Place::Quantile(unit) = noise.place(sample)[0] else { return f64::NAN };
            ishigami(&design.place(case)) + 15.0 * (2.0 * unit - 1.0)
        };
        let measure: Vec<f64> = (0..design.cases()).map(value).collect();
        let input = |name: &str, is_seed| Input {
            name: name.into(),
            is_seed,
            values: (0..design.cases()).map(|case| case as f64).collect(),
        };
        let inputs = [input("a", false), input("b", false), input("c", false), input("s", true)];
        let (rows, noise) = sensitivities(DesignKind::Sensitivity, &inputs, &measure);
        let share = 75.0 / (75.0 + 13.8446);
        let noise = noise.unwrap();
        assert!(noise.low <= share && share <= noise.high, "{noise:?} {share}");
        assert!(noise.high - noise.low < 0.1, "{noise:?}");
        assert_eq!(rows.len(), 3);
        // The places of cases do not depend on the function, and are as many as independent points.
        let ranks = rows[0].rank_correlation.unwrap();
        assert!((ranks.high - ranks.low - 2.0 * 1.96 / 8000_f64.sqrt()).abs() < 1e-3, "{ranks:?}");
        for (row, published) in rows.iter().zip(PUBLISHED) {
            let first = row.first_order.unwrap();
            let expected = published[0] * (1.0 - share);
            assert!(first.low <= expected && expected <= first.high, "{first:?} {expected}");
        }
        let (_, none) = sensitivities(DesignKind::Sensitivity, &inputs[..3], &measure[..100]);
        assert_eq!(none, None);
    }

    #[test]
    fn oracle_an_interval_covers_about_as_often_as_it_says() {
        for (samples, least) in [(16, 0.85), (64, 0.9), (256, 0.92)] {
            let (mut covered, mut all) = (0.0, 0.0);
            for seed in 0..100 {
                let design = sensitivity(seed, samples, 3);
                let measure: Vec<f64> =
                    (0..design.cases()).map(|case| ishigami(&design.place(case))).collect();
                let computed = indices(&measure, 3).unwrap();
                for (estimates, published) in computed.parameters.iter().zip(PUBLISHED) {
                    for (estimate, published) in estimates.iter().zip(published) {
                        assert!(0.0 <= estimate.low && estimate.low <= estimate.value);
                        assert!(estimate.value <= estimate.high && estimate.high <= 1.0);
                        let is_within = (estimate.low..=estimate.high).contains(&published);
                        covered += f64::from(u8::from(is_within));
                        all += 1.0;
                    }
                }
            }
            assert!(covered / all > least, "{samples}: {}", covered / all);
        }
    }

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }
}
