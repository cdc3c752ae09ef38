//! Branch and bound, which encloses the largest value of a function on boxes.

use crate::dual::Dual;
use crate::interval::Interval;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Box in one of the charts that cover the domain.
struct Piece<const N: usize> {
    chart: usize,
    sides: [Interval; N],
    /// Upper bound of the function's values on the box.
    upper: f64,
    /// Index of the side that is halved next.
    cut: usize,
}

impl<const N: usize> PartialEq for Piece<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const N: usize> Eq for Piece<N> {}

impl<const N: usize> PartialOrd for Piece<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const N: usize> Ord for Piece<N> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.upper.total_cmp(&other.upper)
    }
}

/// Function whose largest value is sought, given the chart and the coordinates in it.
pub trait Objective<const N: usize>: Fn(usize, &[Dual<N>; N]) -> Dual<N> {}

impl<const N: usize, F: Fn(usize, &[Dual<N>; N]) -> Dual<N>> Objective<N> for F {}

/// Effort after which the search ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Relative width of the enclosure, measured by its larger end. The search ends when this width
    /// is reached and `goal` is decided.
    pub gap: f64,
    /// Value that the function must not exceed, if that is to be decided.
    pub goal: f64,
    /// Largest number of boxes that are examined.
    pub boxes: usize,
}

/// Encloses the largest value of `f` over the box `sides` in each of `charts` charts.
///
/// The function on a box is enclosed by its natural extension and by the mean value form, f(c) +
/// f′(X) (X − c). Along a coordinate in which the derivative keeps its sign, the largest value is
/// at an end, and the box shrinks to that end.
pub fn supremum<const N: usize>(
    f: &impl Objective<N>,
    charts: usize,
    sides: [Interval; N],
    effort: Effort,
) -> Interval {
    let mut largest = f64::NEG_INFINITY;
    let mut heap = BinaryHeap::new();
    let mut looked = 0;
    for chart in 0..charts {
        heap.push(look(f, chart, sides, &mut largest));
    }
    while let Some(worst) = heap.pop() {
        let close = worst.upper - largest <= effort.gap * worst.upper.abs();
        let decided = worst.upper <= effort.goal || largest > effort.goal;
        if (close && decided) || looked >= effort.boxes {
            return Interval::new(largest, worst.upper);
        }
        let Some(halves) = halves(worst.sides, worst.cut) else {
            return Interval::new(largest, worst.upper);
        };
        for half in halves {
            looked += 1;
            let piece = look(f, worst.chart, half, &mut largest);
            heap.push(Piece { upper: piece.upper.min(worst.upper), ..piece });
        }
    }
    Interval::ALL
}

/// Halves the box at side `cut`, or returns `None` if that side cannot be halved.
fn halves<const N: usize>(sides: [Interval; N], cut: usize) -> Option<[[Interval; N]; 2]> {
    let Interval { low, high } = sides[cut];
    let middle = sides[cut].middle();
    (low < middle && middle < high).then(|| {
        let (mut below, mut above) = (sides, sides);
        (below[cut].high, above[cut].low) = (middle, middle);
        [below, above]
    })
}

fn look<const N: usize>(
    f: &impl Objective<N>,
    chart: usize,
    mut sides: [Interval; N],
    largest: &mut f64,
) -> Piece<N> {
    let at = |sides: &[Interval; N]| {
        let coordinates: [Dual<N>; N] = std::array::from_fn(|i| Dual::coordinate(i, sides[i]));
        f(chart, &coordinates)
    };
    let on_box = at(&sides);
    let mut shrunk = false;
    for (side, slope) in sides.iter_mut().zip(&on_box.slope) {
        let end = if slope.low >= 0.0 { side.high } else { side.low };
        if side.low < side.high && (slope.low >= 0.0 || slope.high <= 0.0) {
            *side = Interval::point(end);
            shrunk = true;
        }
    }
    let on_box = if shrunk { at(&sides) } else { on_box };
    let centre = sides.map(|side| Interval::point(side.middle()));
    let at_centre = at(&centre).value;
    *largest = largest.max(at_centre.low);
    let mut mean = at_centre;
    let (mut cut, mut most) = (0, -1.0);
    for i in 0..N {
        let part = on_box.slope[i] * (sides[i] - centre[i]);
        mean = mean + part;
        let width = if sides[i].low < sides[i].high { part.width() } else { -1.0 };
        if width > most {
            (cut, most) = (i, width);
        }
    }
    // Infinite derivatives make the mean value form useless, but not wrong.
    let upper = on_box.value.high.min(mean.high);
    Piece { chart, sides, upper, cut }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Number;

    #[test]
    fn oracle_largest_value_of_a_polynomial() {
        // The function x y (1 − x − y) is largest at x = y = 1/3, where it is 1/27.
        let f = |_: usize, [x, y]: &[Dual<2>; 2]| *x * *y * (Dual::constant(1) - *x - *y);
        let unit = Interval::new(0.0, 1.0);
        let effort = Effort { gap: 1e-9, goal: f64::INFINITY, boxes: 100_000 };
        let largest = supremum(&f, 1, [unit, unit], effort);
        assert!(
            largest.low <= 1.0 / 27.0 && largest.high >= 1.0 / 27.0 && largest.width() < 1e-9,
            "{largest:?}"
        );
    }
}
