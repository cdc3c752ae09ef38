//! Reference table: points over time and the cubic spline through them, which is twice continuously
//! differentiable and ends with the not-a-knot condition.

use crate::axes::{REPEATS, nearest};
use crate::error::Error;
use crate::reference::Reference;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::io::Read;
use std::path::Path;

/// Points and the second derivatives of the spline there. Before the first and after the last point
/// the angles are held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LookupTable {
    times: Vec<f64>,
    angles: Vec<Vector3<f64>>,
    curvatures: Vec<Vector3<f64>>,
}

/// Column headings allowed for each quantity, each with its factor to SI units.
const COLUMNS: [(&str, &[(&str, f64)]); 4] = [
    ("time", &[("time_s", 1.0)]),
    ("alpha", &[("alpha_rad", 1.0), ("alpha_deg", DEGREE)]),
    ("beta", &[("beta_rad", 1.0), ("beta_deg", DEGREE)]),
    ("sigma", &[("sigma_rad", 1.0), ("sigma_deg", DEGREE)]),
];
/// Largest number of points in a table: 10 000 s at 10 Hz.
const MOST_POINTS: usize = 100_000;
const DEGREE: f64 = std::f64::consts::PI / 180.0;

impl LookupTable {
    /// Makes the spline through `angles` (rad) at strictly increasing `times` (s); both have the
    /// same length.
    ///
    /// # Errors
    /// Refuses a table without points, with unequal lengths, with a value that is not finite, or
    /// with times that do not increase.
    pub fn new(times: Vec<f64>, angles: Vec<Vector3<f64>>) -> Result<Self, Error> {
        check(&times, &angles)?;
        let curvatures = curvatures(&times, &angles);
        Ok(Self { times, angles, curvatures })
    }

    /// Refuses a table that [`LookupTable::new`] could not have made, because a restored table may
    /// be corrupt.
    ///
    /// # Errors
    /// Reports the same errors as [`LookupTable::new`], and second derivatives that are missing or
    /// not finite.
    pub fn check(&self) -> Result<(), Error> {
        check(&self.times, &self.angles)?;
        let finite = self.curvatures.iter().flatten().all(|value| value.is_finite());
        if self.curvatures.len() == self.times.len() && finite {
            return Ok(());
        }
        Err(Error::parameter("reference table", "must have one finite curvature for each time"))
    }

    /// Reads a CSV file with the headings `time_s` and, in any order, `alpha_deg` or `alpha_rad`,
    /// and likewise `beta_…` and `sigma_…`. Lines that begin with `#` are comments. From point to
    /// point α and σ turn the shorter way, so that a file which counts them from −180° to 180° has
    /// no jump.
    ///
    /// # Errors
    /// Names the file, line and column at fault.
    pub fn from_csv_file(path: &Path) -> Result<Self, Error> {
        let file = path.display().to_string();
        match std::fs::File::open(path) {
            Ok(reader) => Self::from_csv(&file, reader),
            Err(error) => {
                Err(Error::Table { file, line: None, column: None, problem: error.to_string() })
            }
        }
    }

    /// Reads a table in the form of [`LookupTable::from_csv_file`] from any reader; `file` names it
    /// in messages.
    ///
    /// # Errors
    /// Names the file, line and column at fault.
    pub fn from_csv(file: &str, reader: impl Read) -> Result<Self, Error> {
        let refuse = |line: Option<u64>, column: Option<&str>, problem: String| Error::Table {
            file: file.into(),
            line,
            column: column.map(String::from),
            problem,
        };
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(reader);
        let headings =
            reader.headers().map_err(|error| refuse(Some(1), None, error.to_string()))?.clone();
        let heading_line = headings.position().map(csv::Position::line);
        let mut columns = Vec::new();
        for (quantity, forms) in COLUMNS {
            let allowed = || forms.iter().map(|form| form.0).collect::<Vec<_>>().join(" or ");
            let matching: Vec<_> = headings
                .iter()
                .enumerate()
                .filter_map(|(i, heading)| {
                    forms.iter().find(|form| form.0 == heading).map(|form| (i, form.1))
                })
                .collect();
            match matching[..] {
                [column] => columns.push(column),
                [] => {
                    return Err(refuse(
                        heading_line,
                        Some(quantity),
                        format!("is missing; its heading is {}", allowed()),
                    ));
                }
                _ => {
                    return Err(refuse(
                        heading_line,
                        Some(quantity),
                        format!("is given twice; keep one {}", allowed()),
                    ));
                }
            }
        }
        if let Some(unknown) =
            headings.iter().enumerate().find(|(i, _)| columns.iter().all(|column| column.0 != *i))
        {
            return Err(refuse(
                heading_line,
                Some(unknown.1),
                "is not a column of a reference table; remove it".into(),
            ));
        }

        let (mut times, mut angles) = (Vec::new(), Vec::<Vector3<f64>>::new());
        for record in reader.records() {
            let record = record.map_err(|error| {
                refuse(error.position().map(csv::Position::line), None, error.to_string())
            })?;
            let line = record.position().map(csv::Position::line);
            if record.len() != headings.len() {
                let problem =
                    format!("{} values where the headings name {}", record.len(), headings.len());
                return Err(refuse(line, None, problem));
            }
            let mut row = [0.0; 4];
            for (value, (column, factor)) in row.iter_mut().zip(&columns) {
                let text = &record[*column];
                let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
                let number = number.ok_or_else(|| {
                    refuse(line, headings.get(*column), format!("'{text}' is not a finite number"))
                })?;
                *value = number * factor;
            }
            let [time, alpha, beta, sigma] = row;
            if times.last().is_some_and(|&last| last >= time) {
                return Err(refuse(
                    line,
                    Some("time_s"),
                    format!("{time} does not come after the line before"),
                ));
            }
            if times.len() == MOST_POINTS {
                return Err(refuse(line, None, too_many()));
            }
            let before = angles.last().copied().unwrap_or_default();
            let point = Vector3::new(alpha, beta, sigma);
            times.push(time);
            angles.push(Vector3::from_fn(|i, _| {
                let turns = REPEATS[i] && times.len() > 1;
                if turns { nearest(point[i], before[i]) } else { point[i] }
            }));
        }
        if times.is_empty() {
            return Err(refuse(None, None, "no points below the headings".into()));
        }
        Self::new(times, angles)
    }

    /// Returns the reference at `time` (s).
    pub fn at(&self, time: f64) -> Reference {
        let last = self.times.len() - 1;
        if !(time >= self.times[0] && time <= self.times[last]) || last == 0 {
            let end = if time > self.times[0] { last } else { 0 };
            return Reference { angles: self.angles[end], ..Reference::default() };
        }
        let i = self.times.partition_point(|&knot| knot <= time).clamp(1, last) - 1;
        let h = self.times[i + 1] - self.times[i];
        let (a, b) = ((self.times[i + 1] - time) / h, (time - self.times[i]) / h);
        let (y0, y1) = (self.angles[i], self.angles[i + 1]);
        let (c0, c1) = (self.curvatures[i], self.curvatures[i + 1]);
        Reference {
            angles: y0 * a + y1 * b + (c0 * (a * a * a - a) + c1 * (b * b * b - b)) * (h * h / 6.0),
            rates: (y1 - y0) / h
                + (c1 * (3.0 * b * b - 1.0) - c0 * (3.0 * a * a - 1.0)) * (h / 6.0),
            accelerations: c0 * a + c1 * b,
        }
    }
}

fn check(times: &[f64], angles: &[Vector3<f64>]) -> Result<(), Error> {
    let refuse = |problem: String| Err(Error::parameter("reference table", problem));
    if times.len() > MOST_POINTS {
        return refuse(too_many());
    }
    if times.is_empty() || times.len() != angles.len() {
        return refuse(format!(
            "has {} times and {} attitudes; at least one of each is needed",
            times.len(),
            angles.len()
        ));
    }
    if !times.iter().chain(angles.iter().flatten()).all(|value| value.is_finite()) {
        return refuse("holds a value that is not finite".into());
    }
    if let Some([before, after, ..]) = times.windows(2).find(|pair| pair[0] >= pair[1]) {
        return refuse(format!("has time {after} s after {before} s; times must increase"));
    }
    Ok(())
}

fn too_many() -> String {
    format!("has more than {MOST_POINTS} points; keep fewer, the spline is smooth between them")
}

/// Second derivatives of the spline at the knots `x`. The third derivative is continuous at the
/// second knot and at the last but one. Three points give a parabola, two a line.
fn curvatures(x: &[f64], y: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let n = x.len();
    let mut c = vec![Vector3::zeros(); n];
    if n < 3 {
        return c;
    }
    let h = |i: usize| x[i + 1] - x[i];
    let slope = |i: usize| (y[i + 1] - y[i]) / h(i);
    if n == 3 {
        c.fill((slope(1) - slope(0)) * (2.0 / (h(0) + h(1))));
        return c;
    }
    // Interior knots i: h₋ c[i-1] + 2 (h₋ + h₊) c[i] + h₊ c[i+1] = 6 (slope₊ − slope₋); the end
    // knots are eliminated.
    let (mut upper, mut right) = (vec![0.0; n], vec![Vector3::zeros(); n]);
    for i in 1..n - 1 {
        let (before, after) = (h(i - 1), h(i));
        let (mut low, mut middle, mut high) = (before, 2.0 * (before + after), after);
        if i == 1 {
            middle += before * (1.0 + before / after);
            high -= before * before / after;
            low = 0.0;
        }
        if i == n - 2 {
            middle += after * (1.0 + after / before);
            low -= after * after / before;
            high = 0.0;
        }
        let pivot = middle - low * upper[i - 1];
        upper[i] = high / pivot;
        right[i] = ((slope(i) - slope(i - 1)) * 6.0 - right[i - 1] * low) / pivot;
    }
    for i in (1..n - 1).rev() {
        c[i] = right[i] - c[i + 1] * upper[i];
    }
    c[0] = c[1] * (1.0 + h(0) / h(1)) - c[2] * (h(0) / h(1));
    c[n - 1] = c[n - 2] * (1.0 + h(n - 2) / h(n - 3)) - c[n - 3] * (h(n - 2) / h(n - 3));
    c
}
