//! The part of a line that lies within a rectangle.

/// A point, or the lower or upper corner of a rectangle: x and y.
pub(crate) type Point = (f64, f64);

/// Returns the part of the line from `a` to `b` that lies within the rectangle between two corners;
/// `None` if it passes the rectangle (Y.-D. Liang and B. Barsky, ACM Transactions on Graphics 3(1),
/// 1984).
pub(crate) fn clipped(a: Point, b: Point, low: Point, high: Point) -> Option<(Point, Point)> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    let axes = [(a.0, b.0 - a.0, low.0, high.0), (a.1, b.1 - a.1, low.1, high.1)];
    for (start, length, low, high) in axes {
        if length == 0.0 {
            if !(low..=high).contains(&start) {
                return None;
            }
            continue;
        }
        let (first, second) = ((low - start) / length, (high - start) / length);
        from = from.max(first.min(second));
        to = to.min(first.max(second));
    }
    let at = |share: f64| (a.0 + share * (b.0 - a.0), a.1 + share * (b.1 - a.1));
    (from <= to).then(|| (at(from), at(to)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_at_the_edges_of_the_rectangle() {
        let cut = |a, b| clipped(a, b, (0.0, 0.0), (2.0, 1.0));
        assert_eq!(cut((-1.0, 0.5), (3.0, 0.5)), Some(((0.0, 0.5), (2.0, 0.5))));
        assert_eq!(cut((1.0, 0.5), (1.0, 5.0)), Some(((1.0, 0.5), (1.0, 1.0))));
        assert_eq!(cut((1.0, 0.5), (1.0, 0.5)), Some(((1.0, 0.5), (1.0, 0.5))));
        assert_eq!(cut((-1.0, 0.5), (0.5, 2.5)), None);
        assert_eq!(cut((3.0, 0.5), (3.0, 0.6)), None);
    }
}
