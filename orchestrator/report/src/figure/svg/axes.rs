//! Where the values of a panel are drawn.

/// Place of a panel with its labels, px.
#[derive(Clone, Copy)]
pub(super) struct Area {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
    /// Height of the legend between the title and the axes.
    pub legend: f64,
}

/// A panel's axes: ranges of the values, and where they are drawn.
pub(super) struct Axes {
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    /// Whether the horizontal and the vertical axis are logarithmic.
    pub(super) log: [bool; 2],
    pub(super) frame: Area,
}

impl Axes {
    pub(super) fn x_at(&self, value: f64) -> f64 {
        self.frame.x + share(value, self.x, self.log[0]) * self.frame.width
    }

    pub(super) fn y_at(&self, value: f64) -> f64 {
        self.frame.y + (1.0 - share(value, self.y, self.log[1])) * self.frame.height
    }

    /// Returns the runs of points of a curve that can be drawn, px.
    pub(super) fn runs(&self, xs: &[f64], ys: &[f64]) -> Vec<Vec<(f64, f64)>> {
        let mut runs = vec![Vec::new()];
        for (x, y) in xs.iter().zip(ys) {
            if (self.x.0..=self.x.1).contains(x) && y.is_finite() && (!self.log[1] || *y > 0.0) {
                let point = (self.x_at(*x), self.y_at(*y));
                runs.last_mut().expect("there is a run").push(point);
            } else if !runs.last().is_some_and(Vec::is_empty) {
                runs.push(Vec::new());
            }
        }
        runs.retain(|run| !run.is_empty());
        runs
    }
}

/// Returns where a value lies on an axis between its ends, at 0 and 1.
fn share(value: f64, (low, high): (f64, f64), is_logarithmic: bool) -> f64 {
    let place = |value: f64| if is_logarithmic { value.log10() } else { value };
    (place(value) - place(low)) / (place(high) - place(low))
}
