//! Reads recorded runs from their files.

use crate::summary;
use cosim::error::Error;
use cosim::experiment::{MeasureKind, Observe};
use cosim::recorder::FILE;
use cosim_metrics::metrics::Metrics;
use cosim_report::recording::{Recording, Track, display_unit};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Columns of numbers with their names.
type Columns = Vec<(String, Vec<f64>)>;

/// Reads a run: a folder of results, or a file of recorded variables.
///
/// # Errors
/// Returns an error if there is no such run, or if a file is damaged.
pub(super) fn recording(path: &Path) -> Result<Recording, Error> {
    let file = table_of(path)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let metadata = json_of(&folder.join("results.json"))?;
    if !file.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv")) {
        let problem = format!(
            "{} is no table of recorded variables: name a folder of results, or a .csv file",
            file.display()
        );
        return Err(Error::experiment(problem));
    }
    let mut columns = text(&file)?.into_iter();
    let first = columns.next().filter(|(name, _)| name.eq_ignore_ascii_case("time"));
    let Some((_, time)) = first else {
        let problem = format!("{}: the first column must be called time", file.display());
        return Err(Error::experiment(problem));
    };
    check_time(&time, &file)?;
    let described = metadata["columns"].as_array().cloned().unwrap_or_default();
    let tracks = columns.map(|(name, values)| {
        let column = described.iter().find(|column| column["name"] == name.as_str());
        (name.clone(), track(column.unwrap_or(&Value::Null), values))
    });
    let name = match file.file_name().and_then(|name| name.to_str()) {
        Some(FILE) => fs::canonicalize(folder).ok(),
        _ => Some(file.with_extension("")),
    };
    let name = name.as_deref().and_then(Path::file_name).unwrap_or(file.as_os_str());
    let mut run =
        Recording::new(&name.to_string_lossy(), &metadata, time, tracks.collect::<Vec<_>>());
    let metrics = json_of(&folder.join("metrics.json"))?;
    if let Ok(metrics) = serde_json::from_value::<Metrics>(metrics) {
        let units = metric_units(&run);
        run.summary = summary::lines(&run.observe, &Metrics { units, ..metrics });
    }
    Ok(run)
}

/// Checks that time never goes backwards.
fn check_time(time: &[f64], file: &Path) -> Result<(), Error> {
    // The header is in the first row.
    let first = 2;
    let not_a_number = time.iter().position(|time| !time.is_finite());
    let backwards = time.windows(2).position(|pair| pair[1] < pair[0]).map(|before| before + 1);
    let problem = match (not_a_number, backwards) {
        (Some(row), _) => format!("row {}, time: {} is no time", row + first, time[row]),
        (None, Some(row)) => format!(
            "row {}, time: {} s comes after {} s, but time must not go backwards",
            row + first,
            time[row],
            time[row - 1]
        ),
        (None, None) => return Ok(()),
    };
    Err(Error::experiment(format!("{}, {problem}", file.display())))
}

/// Returns the file of recorded variables at a path.
fn table_of(path: &Path) -> Result<PathBuf, Error> {
    let below = Path::new("out").join(path);
    let mut tried = [path, &below].into_iter();
    let Some(found) = tried.find(|path| path.exists()) else {
        return Err(Error::experiment(format!(
            "there is no run {}, neither here nor below out: `orchestrator run EXPERIMENT` flies one",
            path.display()
        )));
    };
    if found.is_file() {
        return Ok(found.to_path_buf());
    }
    let file = found.join(FILE);
    if file.is_file() {
        return Ok(file);
    }
    Err(Error::experiment(format!("{} holds no {FILE}", found.display())))
}

/// Reads a JSON file; null if there is none.
fn json_of(path: &Path) -> Result<Value, Error> {
    if !path.is_file() {
        return Ok(Value::Null);
    }
    let text = fs::read_to_string(path).map_err(Error::file(path))?;
    serde_json::from_str(&text).map_err(|error| Error::file(path)(error.into()))
}

/// Makes a track of a column, which `results.json` describes.
fn track(column: &Value, values: Vec<f64>) -> Track {
    let (unit, factor) = display_unit(&column["display_unit"]);
    let items = column["items"].as_object().into_iter().flatten();
    let items =
        items.filter_map(|(value, name)| Some((name.as_str()?.into(), value.parse().ok()?)));
    Track { unit, factor, items: items.collect(), values }
}

/// Reads a CSV file.
fn text(path: &Path) -> Result<Columns, Error> {
    let failed = |error: csv::Error| {
        if error.is_io_error() {
            Error::file(path)(error.into())
        } else {
            Error::experiment(format!("{}: {error}", path.display()))
        }
    };
    let mut reader = csv::Reader::from_path(path).map_err(failed)?;
    let heads = reader.headers().map_err(failed)?;
    let mut columns: Columns = heads.iter().map(|name| (name.into(), Vec::new())).collect();
    for (row, record) in reader.records().enumerate() {
        let record = record.map_err(failed)?;
        for (cell, (name, values)) in record.iter().zip(&mut columns) {
            // A blank cell is a missing value, at which a curve has a gap.
            let number = if cell.trim().is_empty() { "NaN" } else { cell.trim() }.parse();
            values.push(number.map_err(|_| {
                Error::experiment(format!(
                    "{}, row {}, {name}: \"{cell}\" is not a number",
                    path.display(),
                    row + 2
                ))
            })?);
        }
    }
    Ok(columns)
}

/// Returns the units of those metrics whose signals are recorded.
fn metric_units(run: &Recording) -> BTreeMap<String, String> {
    let observe: &Observe = &run.observe;
    let unit = |name: &String| {
        let measure = &observe.metrics[name];
        let of_signals = || {
            let signal = observe.list(measure.signals.get_ref()).ok()?.first()?;
            Some(run.series(signal).ok()?.unit)
        };
        match (measure.kind, &measure.unit) {
            (MeasureKind::Settling | MeasureKind::Leaving, _) => Some("s".to_string()),
            (MeasureKind::Share | MeasureKind::Pulses | MeasureKind::Rises, _) => None,
            (_, Some(unit)) => Some(unit.name.clone()),
            _ => of_signals(),
        }
    };
    observe.metrics.keys().filter_map(|name| Some((name.clone(), unit(name)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(name: &str, content: &str) -> Result<Recording, Error> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        recording(&path)
    }

    #[test]
    fn a_cell_that_is_no_number_is_refused() {
        let fault = read("results.csv", "time,a.mode\n0,slow\n").unwrap_err();
        assert!(fault.to_string().contains("row 2, a.mode: \"slow\" is not a number"), "{fault}");
    }

    #[test]
    fn a_blank_cell_is_a_gap_but_no_time() {
        let run = read("mine.csv", "time,a,b\n0,1,2\n1,,NaN\n2, ,4\n3,5,nan\n").unwrap();
        let gaps =
            |name: &str| run.track(name).unwrap().values.iter().map(|v| v.is_nan()).collect();
        let (a, b): (Vec<bool>, Vec<bool>) = (gaps("a"), gaps("b"));
        assert_eq!((a, b), (vec![false, true, true, false], vec![false, true, false, true]));
        let fault = read("a.csv", "time,a\n0,1\n,2\n").unwrap_err().to_string();
        assert!(fault.ends_with("a.csv, row 3, time: NaN is no time"), "{fault}");
    }

    #[test]
    fn a_column_may_be_called_as_another_program_likes() {
        let run = read("mine.csv", "time,b\n0,1\n1,3\n1,4\n").unwrap();
        assert_eq!(run.track("b").unwrap().values, [1.0, 3.0, 4.0]);
        let panels = cosim_report::recording::asked::of_experiments(&[run]).unwrap();
        assert_eq!((panels.len(), panels[0].label.as_str()), (1, "b"));
    }

    #[test]
    fn what_is_no_curve_over_time_is_refused_by_row_and_column() {
        let fault = |table: &str| read("a.csv", table).unwrap_err().to_string();
        let backwards = fault("time,a.x\n0,1\n2,3\n1,2\n");
        let said = "a.csv, row 4, time: 1 s comes after 2 s, but time must not go backwards";
        assert!(backwards.ends_with(said), "{backwards}");
        let unknown = fault("time,a.x\n0,1\nNaN,3\n");
        assert!(unknown.ends_with("a.csv, row 3, time: NaN is no time"), "{unknown}");
    }

    #[test]
    fn what_is_no_table_of_a_run_is_refused() {
        let fault = read("a.csv", "x,y\n0,1\n").unwrap_err().to_string();
        assert!(fault.contains("the first column must be called time"), "{fault}");
        for (name, content) in [("metrics.json", "{}"), ("a.csv", "time,x\n0,1\n0\n")] {
            let fault = read(name, content).unwrap_err();
            assert!(fault.exit_code() == 2 && fault.to_string().contains(name), "{fault}");
        }
        let fault = read("a.parquet", "PAR1 and nothing else").unwrap_err().to_string();
        assert!(fault.contains("a.parquet is no table of recorded variables"), "{fault}");
    }
}
