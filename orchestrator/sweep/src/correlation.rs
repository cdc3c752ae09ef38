//! Correlations among the parameters that vary, as a Gaussian copula.

use crate::design::Place;
use crate::varied::Varied;
use crate::vary::Correlation;
use cosim::document::Source;
use cosim::error::Error;
use statrs::distribution::{ContinuousCDF, Normal};
use toml::Spanned;

/// Parameters that are correlated: their dimensions, and the Cholesky factor of the correlation of
/// their normal scores, row by row.
pub(crate) struct Correlated {
    dimensions: Vec<usize>,
    factor: Vec<Vec<f64>>,
}

impl Correlated {
    /// Replaces the quantiles of the correlated dimensions. Corners and levels stay.
    pub(crate) fn apply(&self, places: &mut [Place]) {
        let Ok(normal) = Normal::new(0.0, 1.0) else { return };
        let scores = self.dimensions.iter().map(|dimension| match places[*dimension] {
            Place::Quantile(unit) => {
                Some(normal.inverse_cdf(unit.clamp(f64::MIN_POSITIVE, 1.0 - f64::EPSILON / 2.0)))
            }
            _ => None,
        });
        let Some(scores) = scores.collect::<Option<Vec<f64>>>() else { return };
        for (dimension, row) in self.dimensions.iter().zip(&self.factor) {
            let score: f64 = row.iter().zip(&scores).map(|(factor, score)| factor * score).sum();
            places[*dimension] = Place::Quantile(normal.cdf(score).min(1.0 - f64::EPSILON / 2.0));
        }
    }
}

/// Reads the correlations between varied parameters.
pub(crate) fn correlation(
    correlations: &[Correlation],
    source: &Source,
    varied: &[Varied],
) -> Result<Option<Correlated>, Error> {
    let mut dimensions: Vec<usize> = Vec::new();
    let mut entries: Vec<([usize; 2], f64)> = Vec::new();
    for correlation in correlations {
        let span = correlation.between.span();
        let fault = |problem: String| source.error(&span, format!("[[correlation]] {problem}"));
        let mut pair = [0; 2];
        for (place, name) in pair.iter_mut().zip(correlation.between.get_ref()) {
            let names = varied.iter().map(|entry| entry.name.as_str());
            let located = Spanned::new(span.clone(), name.clone());
            source.check_names([&located], "parameter that varies", names)?;
            let dimension = varied.iter().position(|entry| entry.name == *name).unwrap_or(0);
            if !varied[dimension].distribution.is_ordered() {
                return Err(fault(format!(
                    "\"{name}\" cannot be correlated, because its values have no order"
                )));
            }
            if !dimensions.contains(&dimension) {
                dimensions.push(dimension);
            }
            *place = dimensions.iter().position(|other| *other == dimension).unwrap_or(0);
        }
        let coefficient = correlation.coefficient;
        if pair[0] == pair[1] || !(coefficient > -1.0 && coefficient < 1.0) {
            return Err(fault(format!(
                "coefficient = {coefficient}: two different parameters and a value between -1 and 1 are needed"
            )));
        }
        pair.sort_unstable();
        if entries.iter().any(|(other, _)| *other == pair) {
            let [a, b] = correlation.between.get_ref();
            return Err(fault(format!("\"{a}\" and \"{b}\" are correlated twice")));
        }
        entries.push((pair, coefficient));
    }
    if entries.is_empty() {
        return Ok(None);
    }
    let mut matrix = vec![vec![0.0; dimensions.len()]; dimensions.len()];
    matrix.iter_mut().enumerate().for_each(|(i, row)| row[i] = 1.0);
    for ([i, j], coefficient) in entries {
        (matrix[i][j], matrix[j][i]) = (coefficient, coefficient);
    }
    let factor = cholesky(&matrix).ok_or_else(|| {
        source.error(&(0..0), "[[correlation]] the coefficients contradict each other: their matrix is not positive definite")
    })?;
    Ok(Some(Correlated { dimensions, factor }))
}

/// Returns the lower triangular factor of a symmetric matrix, row by row; `None` if the matrix is
/// not positive definite. (`nalgebra` is built without matrices of any size here, so that the FMUs
/// compute the same everywhere.)
fn cholesky(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut factor: Vec<Vec<f64>> = Vec::new();
    for (i, row) in matrix.iter().enumerate() {
        let mut factor_row: Vec<f64> = Vec::new();
        for j in 0..=i {
            let other = factor.get(j).unwrap_or(&factor_row);
            let rest = row[j] - factor_row.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            let entry = if i == j { rest.sqrt() } else { rest / other[j] };
            if !entry.is_finite() || i == j && entry <= 0.0 {
                return None;
            }
            factor_row.push(entry);
        }
        factor.push(factor_row);
    }
    Some(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_cholesky_by_hand() {
        let factor =
            cholesky(&[vec![4.0, 2.0, 2.0], vec![2.0, 10.0, 4.0], vec![2.0, 4.0, 6.0]]).unwrap();
        assert_eq!(factor[0], [2.0]);
        assert_eq!(factor[1], [1.0, 3.0]);
        assert_eq!(factor[2], [1.0, 1.0, 2.0]);
        assert!(cholesky(&[vec![1.0, 2.0], vec![2.0, 1.0]]).is_none());
    }
}
