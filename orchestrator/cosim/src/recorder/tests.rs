use super::*;
use fmi_master::description::Carrier;
use std::path::PathBuf;

const VALUES: [f64; 5] = [0.1 + 0.2, 1e-300, f64::MAX, -0.0, 5e-324];
/// Rows that are expected: every second tick, and the last one.
const ROWS: [usize; 4] = [0, 2, 3, 4];

fn column(name: &str, place: usize, carrier: Carrier) -> Column {
    Column { name: name.into(), place, carrier }
}

fn record(folder: &Path) -> PathBuf {
    let path = folder.join(FILE);
    let columns = vec![
        column("a.x[1,2]", 1, Carrier::Real),
        column("a.n", 0, Carrier::Integer),
        column("a.on", 2, Carrier::Boolean),
    ];
    let mut recorder = Recorder::create(&path, columns, 2).unwrap();
    for (tick, value) in VALUES.iter().enumerate() {
        let time = tick as f64 * 0.04;
        let values = [7.0, *value, f64::from(tick as u32 % 2)];
        recorder
            .observe(&Sample { tick: tick as u64, time, last: tick == 3, values: &values })
            .unwrap();
    }
    recorder.finish().unwrap();
    path
}

#[test]
fn text_reads_back_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let mut reader = csv::Reader::from_path(record(folder.path())).unwrap();
    assert_eq!(reader.headers().unwrap(), vec!["time", "a.x[1,2]", "a.n", "a.on"]);
    let rows: Vec<Vec<String>> =
        reader.records().map(|row| row.unwrap().iter().map(String::from).collect()).collect();
    let bits: Vec<u64> = rows.iter().map(|row| row[1].parse::<f64>().unwrap().to_bits()).collect();
    assert_eq!(bits, ROWS.map(|row| VALUES[row].to_bits()));
    assert_eq!(rows[2][2..], ["7", "1"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told_as_such() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    std::os::unix::fs::symlink("/dev/full", &path).unwrap();
    let mut recorder = Recorder::create(&path, vec![column("a.x", 0, Carrier::Real)], 1).unwrap();
    let row = |tick: u64| Sample { tick, time: tick as f64, last: false, values: &[0.1; 4] };
    let outcome = (0..100_000).try_for_each(|tick| recorder.observe(&row(tick)));
    let told = outcome.and_then(|()| recorder.finish()).unwrap_err().to_string();
    assert!(told.contains("No space left on device"), "{told}");
    assert!(recorder.finish().is_ok());
}
