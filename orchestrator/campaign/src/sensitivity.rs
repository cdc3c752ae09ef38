//! Sensitivity of a measure to each varied parameter.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};
use sweep::vary::DesignKind;

/// Sensitivity of a measure to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Name of the parameter.
    pub parameter: String,
    /// Rank correlation of parameter and measure (Spearman); none if one of them is constant.
    pub rank_correlation: Option<f64>,
    /// Probability of a rank correlation at least as large if the two were independent.
    pub p_value: Option<f64>,
    /// Share of the measure's variance that the parameter explains by itself (Sobol's first-order
    /// index), if the design allows it.
    pub first_order: Option<f64>,
    /// Share of the variance in which the parameter takes part (total index).
    pub total: Option<f64>,
}

/// Computes the rank correlation of two samples, in which pairs with a value that is not a number
/// are left out, and its p-value.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let pairs = x.iter().zip(y).filter(|(x, y)| !x.is_nan() && !y.is_nan());
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.map(|(x, y)| (*x, *y)).unzip();
    let correlation = correlation(&ranks(&x), &ranks(&y))?;
    let freedom = x.len() as f64 - 2.0;
    if freedom < 1.0 {
        return None;
    }
    let rest = 1.0 - correlation * correlation;
    let t = if rest > 0.0 { correlation * (freedom / rest).sqrt() } else { f64::INFINITY };
    let t_distribution = StudentsT::new(0.0, 1.0, freedom).ok()?;
    Some((correlation, 2.0 * (1.0 - t_distribution.cdf(t.abs()))))
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

/// Computes the indices of all parameters, first-order and total, from a measure of the cases of a
/// design of the kind [`DesignKind::Sensitivity`]: first-order by Saltelli et al. 2010, total by
/// Jansen
/// 1999. Samples with a value that is not a number are left out.
pub fn indices(measure: &[f64], parameters: usize) -> Option<Vec<(f64, f64)>> {
    let block = parameters + 2;
    let samples: Vec<&[f64]> =
        measure.chunks_exact(block).filter(|sample| sample.iter().all(|v| v.is_finite())).collect();
    let n = samples.len() as f64;
    let both_points = || samples.iter().flat_map(|sample| sample[..2].iter());
    let mean = both_points().sum::<f64>() / (2.0 * n);
    let variance = both_points().map(|value| (value - mean).powi(2)).sum::<f64>() / (2.0 * n);
    if samples.len() < 2 || variance.is_nan() || variance <= 0.0 {
        return None;
    }
    let index = |parameter: usize| {
        let (mut first, mut total) = (0.0, 0.0);
        for sample in &samples {
            let (a, b, mixed) = (sample[0], sample[1], sample[2 + parameter]);
            // The mean is taken off, which changes nothing in theory and much of the noise.
            first += (b - mean) * (mixed - a);
            total += 0.5 * (a - mixed).powi(2);
        }
        (first / n / variance, total / n / variance)
    };
    Some((0..parameters).map(index).collect())
}

/// Computes the sensitivities of a measure to all parameters; `columns` holds the values of each
/// parameter by name.
pub fn sensitivities(
    design: DesignKind,
    columns: &[(String, Vec<f64>)],
    measure: &[f64],
) -> Vec<Sensitivity> {
    let indices =
        (design == DesignKind::Sensitivity).then(|| indices(measure, columns.len())).flatten();
    let sensitivity = |(place, (name, values)): (usize, &(String, Vec<f64>))| {
        let ranks = rank_correlation(values, measure);
        let index = indices.as_ref().map(|indices| indices[place]);
        Sensitivity {
            parameter: name.clone(),
            rank_correlation: ranks.map(|(correlation, _)| correlation),
            p_value: ranks.map(|(_, p)| p),
            first_order: index.map(|(first, _)| first),
            total: index.map(|(_, total)| total),
        }
    };
    columns.iter().enumerate().map(sensitivity).collect()
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
        assert!((r - 0.820_782_681_668_123_3).abs() < 1e-12, "{r}");
        assert!((p - 0.088_587_005_313_543_83).abs() < 1e-9, "{p}");
        assert_eq!(rank_correlation(&x, &[1.0, 8.0, 27.0, f64::NAN, 125.0]).unwrap().0, 1.0);
        assert_eq!(rank_correlation(&x, &[2.0; 5]), None);
    }

    #[test]
    fn published_indices_of_the_ishigami_function() {
        // Saltelli et al. 2008, a = 7, b = 0.1: S = 0.3139, 0.4424, 0; T = 0.5576, 0.4424, 0.2437.
        let samples = 1 << 14;
        let design =
            Design::new(DesignKind::Sensitivity, 3, Some(samples * 5), vec![0; 3]).unwrap();
        let ishigami = |case: u64| {
            let x: Vec<f64> = design
                .place(case)
                .iter()
                .map(|place| match place {
                    Place::Quantile(unit) => std::f64::consts::PI * (2.0 * unit - 1.0),
                    _ => f64::NAN,
                })
                .collect();
            x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
        };
        let measure: Vec<f64> = (0..design.cases()).map(ishigami).collect();
        let computed = indices(&measure, 3).unwrap();
        let published = [(0.3139, 0.5576), (0.4424, 0.4424), (0.0, 0.2437)];
        for ((first, total), (s, t)) in computed.into_iter().zip(published) {
            assert!((first - s).abs() < 0.03 && (total - t).abs() < 0.03, "{first} {total}");
        }
    }

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }
}
