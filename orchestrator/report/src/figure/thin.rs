//! Curves thinned to what a screen shows.

/// Returns the points of a line, px, with at most four for each column of a pixel: the first, the
/// lowest, the highest and the last.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let column = first.0.floor();
        let count = rest.iter().take_while(|point| point.0.floor() == column).count();
        let (inside, others) = rest.split_at(count);
        rest = others;
        if count <= 4 {
            kept.extend_from_slice(inside);
            continue;
        }
        let by = |a: &usize, b: &usize| inside[*a].1.total_cmp(&inside[*b].1);
        let lowest = (0..count).min_by(by).unwrap_or(0);
        let highest = (0..count).max_by(by).unwrap_or(0);
        let mut places = [0, lowest, highest, count - 1];
        places.sort_unstable();
        for (k, place) in places.iter().enumerate() {
            if k == 0 || places[k - 1] != *place {
                kept.push(inside[*place]);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_in_a_column_of_many_points_is_kept() {
        let mut points: Vec<(f64, f64)> = (0..10_000).map(|k| (f64::from(k) * 0.01, 0.0)).collect();
        points[5050].1 = 7.0;
        points[5051].1 = -3.0;
        let kept = thinned(&points);
        assert!(kept.len() <= 400, "{}", kept.len());
        assert!(kept.contains(&points[5050]) && kept.contains(&points[5051]));
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }
}
