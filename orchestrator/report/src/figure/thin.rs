//! Curves thinned to the points that a screen shows.

/// Height by which a line may miss a point that is left out, px.
const MISSED: f64 = 0.05;

/// Returns the points of a line, px, that a screen shows. The line keeps its ends.
pub(super) fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    straightened(&extremes(points))
}

/// Returns the points of a line without those that lie on the line between the others (E. Bristol,
/// "Swinging door trending", ISA 1990).
fn straightened(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut kept: Vec<(f64, f64)> = points.first().copied().into_iter().collect();
    // Slopes with which a line from the last kept point passes all points since then.
    let mut slopes = (f64::NEG_INFINITY, f64::INFINITY);
    for pair in points.windows(2) {
        let [before, point] = [pair[0], pair[1]];
        let slope = |from: (f64, f64), by: f64| (point.1 + by - from.1) / (point.0 - from.0);
        let mut from = kept[kept.len() - 1];
        let is_passed = (slopes.0..=slopes.1).contains(&slope(from, 0.0));
        if !(is_passed && point.0 > before.0) {
            if from != before {
                kept.push(before);
            }
            from = before;
            slopes = (f64::NEG_INFINITY, f64::INFINITY);
        }
        slopes = if point.0 > from.0 {
            (slopes.0.max(slope(from, -MISSED)), slopes.1.min(slope(from, MISSED)))
        } else {
            // No line passes a point that is not further on.
            (f64::INFINITY, f64::NEG_INFINITY)
        };
    }
    if let Some(end) = points.last().filter(|end| kept.last() != Some(end)) {
        kept.push(*end);
    }
    kept
}

/// Returns the points of a line with at most two for each column of a pixel: the lowest and the
/// highest, in their order. The line keeps its ends.
fn extremes(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
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
        let (first, second) = (inside[lowest.min(highest)], inside[lowest.max(highest)]);
        if inside.is_sorted_by(|a, b| a.1 <= b.1) || inside.is_sorted_by(|a, b| a.1 >= b.1) {
            kept.push(first);
            kept.extend(Some(second).filter(|second| *second != first));
        } else {
            // Where in its column a peak lies cannot be seen, and even places are shorter.
            kept.extend([(column + 0.2, first.1), (column + 0.8, second.1)]);
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
        assert!(kept.len() <= 6, "{}", kept.len());
        assert!(kept.contains(&(50.2, 7.0)) && kept.contains(&(50.8, -3.0)), "{kept:?}");
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert_eq!([kept[0], kept[kept.len() - 1]], [points[0], points[9999]]);
    }

    /// Height of a line above a place, by linear interpolation.
    fn at(line: &[(f64, f64)], x: f64) -> f64 {
        let after = line.iter().position(|point| point.0 >= x).unwrap_or(line.len() - 1).max(1);
        let [a, b] = [line[after - 1], line[after]];
        a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)
    }

    #[test]
    fn a_smooth_line_passes_every_point_that_is_left_out() {
        let wave = |x: f64| 80.0 * (x / 30.0).sin() + 5.0 * (x / 7.0).cos();
        let points: Vec<(f64, f64)> =
            (0..1200).map(|k| f64::from(k) * 0.5).map(|x| (x, wave(x))).collect();
        let kept = thinned(&points);
        assert!(kept.len() < 400, "{}", kept.len());
        for (x, y) in points {
            assert!((at(&kept, x) - y).abs() <= MISSED * 1.001, "{x}");
        }
    }

    #[test]
    fn stairs_keep_their_corners_and_loops_all_points() {
        let stairs =
            [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 5.0), (3.0, 5.0), (4.0, 5.0), (4.0, 1.0)];
        assert_eq!(straightened(&stairs), [stairs[0], stairs[2], stairs[3], stairs[5], stairs[6]]);
        let back = [(0.0, 0.0), (-1.0, 1.0), (-2.0, 1.5), (-1.5, 3.0)];
        assert_eq!(straightened(&back), back);
    }
}
