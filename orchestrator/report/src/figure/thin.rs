//! Curves thinned to what a screen shows.

/// Returns the points of a line, px, with at most two for each column of a pixel: the lowest and
/// the highest, in their order. The line keeps its ends.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    let mut rest = points.get(1..).unwrap_or_default();
    while let Some(first) = rest.first() {
        let column = first.0.floor();
        let count = rest.iter().take_while(|point| point.0.floor() == column).count();
        let (inside, others) = rest.split_at(count);
        rest = others;
        if count <= 2 {
            kept.extend_from_slice(inside);
            continue;
        }
        let by = |a: &usize, b: &usize| inside[*a].1.total_cmp(&inside[*b].1);
        let lowest = (0..count).min_by(by).unwrap_or(0);
        let highest = (0..count).max_by(by).unwrap_or(0);
        kept.push(inside[lowest.min(highest)]);
        if lowest != highest {
            kept.push(inside[lowest.max(highest)]);
        }
    }
    if let (Some(last), Some(end)) = (kept.last(), points.last())
        && last != end
    {
        kept.push(*end);
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
        assert!(kept.len() <= 202, "{}", kept.len());
        assert!(kept.contains(&points[5050]) && kept.contains(&points[5051]));
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!([kept[0], kept[kept.len() - 1]], [points[0], points[9999]]);
    }
}
