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
        let named = |Fault { line, column, problem }| Error::Table {
            file: file.into(),
            line,
            column,
            problem,
        };
        let (times, angles) = points(reader).map_err(named)?;
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

/// What is wrong with a file, with the number of the line and the heading of the column.
struct Fault {
    line: Option<u64>,
    column: Option<String>,
    problem: String,
}

impl Fault {
    fn new(place: Option<&csv::Position>, column: Option<&str>, problem: String) -> Self {
        Self { line: place.map(csv::Position::line), column: column.map(String::from), problem }
    }
}

/// Position of a column, and the factor of its values to SI units.
type Column = (usize, f64);

/// Reads the times and angles of a file.
fn points(reader: impl Read) -> Result<(Vec<f64>, Vec<Vector3<f64>>), Fault> {
    let unreadable = |error: csv::Error| Fault::new(error.position(), None, error.to_string());
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .flexible(true)
        .from_reader(reader);
    let headings = reader.headers().map_err(unreadable)?.clone();
    let columns = columns(&headings)?;
    let (mut times, mut angles) = (Vec::new(), Vec::<Vector3<f64>>::new());
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let [time, alpha, beta, sigma] = row(&record, &headings, columns)?;
        let fault = |column, problem| Err(Fault::new(record.position(), column, problem));
        if times.last().is_some_and(|&last| last >= time) {
            let problem = format!("{time} does not come after the line before");
            return fault(Some("time_s"), problem);
        }
        if times.len() == MOST_POINTS {
            return fault(None, too_many());
        }
        let point = Vector3::new(alpha, beta, sigma);
        let before = angles.last().copied().unwrap_or(point);
        let turned = |i: usize, _| if REPEATS[i] { nearest(point[i], before[i]) } else { point[i] };
        times.push(time);
        angles.push(Vector3::from_fn(turned));
    }
    if times.is_empty() {
        return Err(Fault::new(None, None, "no points below the headings".into()));
    }
    Ok((times, angles))
}

/// Finds the columns of time, α, β and σ.
fn columns(headings: &csv::StringRecord) -> Result<[Column; 4], Fault> {
    let fault = |column, problem| Fault::new(headings.position(), Some(column), problem);
    let mut columns = [(0, 0.0); 4];
    for (column, (quantity, forms)) in columns.iter_mut().zip(COLUMNS) {
        let allowed = forms.iter().map(|form| form.0).collect::<Vec<_>>().join(" or ");
        let factor = |heading| forms.iter().find(|form| form.0 == heading).map(|form| form.1);
        let mut matching =
            headings.iter().enumerate().filter_map(|(i, heading)| Some((i, factor(heading)?)));
        *column = matching
            .next()
            .ok_or_else(|| fault(quantity, format!("is missing; its heading is {allowed}")))?;
        if matching.next().is_some() {
            return Err(fault(quantity, format!("is given twice; keep one {allowed}")));
        }
    }
    let is_unknown = |(i, _): &(usize, &str)| columns.iter().all(|column| column.0 != *i);
    match headings.iter().enumerate().find(is_unknown) {
        Some((_, heading)) => {
            Err(fault(heading, "is not a column of a reference table; remove it".into()))
        }
        None => Ok(columns),
    }
}

/// Reads a line, in SI units.
fn row(
    record: &csv::StringRecord,
    headings: &csv::StringRecord,
    columns: [Column; 4],
) -> Result<[f64; 4], Fault> {
    let place = record.position();
    if record.len() != headings.len() {
        let (values, named) = (record.len(), headings.len());
        let problem = format!("{values} values where the headings name {named}");
        return Err(Fault::new(place, None, problem));
    }
    let mut row = [0.0; 4];
    for (value, (column, factor)) in row.iter_mut().zip(columns) {
        let text = &record[column];
        let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
        let problem = || format!("'{text}' is not a finite number");
        *value =
            factor * number.ok_or_else(|| Fault::new(place, headings.get(column), problem()))?;
    }
    Ok(row)
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
