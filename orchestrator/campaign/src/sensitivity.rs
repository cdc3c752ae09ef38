//! Sensitivity of a measure to each varied parameter.

use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Sensitivity of a measure to a parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sensitivity {
    /// Name of the parameter.
    pub parameter: String,
    /// Rank correlation of parameter and measure (Spearman); none if one of them is constant.
    pub rank_correlation: Option<f64>,
    /// Probability of a rank correlation at least as large if the two were independent.
    pub p_value: Option<f64>,
}

/// A parameter that varies, with its values in all cases.
#[derive(Clone, Debug)]
pub(crate) struct Input {
    /// Name of the parameter.
    pub name: String,
    /// Whether its values are seeds.
    pub is_seed: bool,
    /// Values in the order of the cases.
    pub values: Vec<f64>,
}

/// Computes the rank correlation of two samples, in which pairs with a value that is not a number
/// are left out, and its p-value.
pub(crate) fn rank_correlation(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
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
    // No order of ranks is rarer than one of n!, and its reverse.
    let rarest = 2.0 / (2..=x.len()).map(|k| k as f64).product::<f64>();
    let p_value = (2.0 * (1.0 - t_distribution.cdf(t.abs()))).max(rarest);
    Some((value, p_value))
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

/// Computes the sensitivities of a measure to all parameters that are no seeds.
pub(crate) fn sensitivities(inputs: &[Input], measure: &[f64]) -> Vec<Sensitivity> {
    let sensitivity = |input: &Input| {
        let ranks = rank_correlation(&input.values, measure);
        Sensitivity {
            parameter: input.name.clone(),
            rank_correlation: ranks.map(|(correlation, _)| correlation),
            p_value: ranks.map(|(_, p)| p),
        }
    };
    // An order of seeds has no meaning.
    inputs.iter().filter(|input| !input.is_seed).map(sensitivity).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_rank_correlation_by_hand() {
        let x = [1.0, 2.0, 3.0, 4.0, 5.0];
        // scipy.stats.spearmanr([1, 2, 3, 4, 5], [5, 6, 7, 8, 7])
        let (r, p) = rank_correlation(&x, &[5.0, 6.0, 7.0, 8.0, 7.0]).unwrap();
        assert!((r - 0.820_782_681_668_123_3).abs() < 1e-12, "{r}");
        assert!((p - 0.088_587_005_313_543_83).abs() < 1e-9, "{p}");
        let (r, p) = rank_correlation(&x, &[1.0, 8.0, 27.0, f64::NAN, 125.0]).unwrap();
        // Four pairs in order are weak evidence.
        assert!(r == 1.0 && (p - 2.0 / 24.0).abs() < 1e-15, "{r} {p}");
        assert_eq!(rank_correlation(&x, &[2.0; 5]), None);
    }

    #[test]
    fn equal_values_share_their_ranks() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }
}
