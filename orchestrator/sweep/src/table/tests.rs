use super::*;
use std::fs;

fn table(rows: std::ops::Range<i32>) -> CaseTable {
    let column = |name: &str, values| Column { name: name.into(), values };
    CaseTable {
        columns: vec![
            column("case", Values::Count(rows.clone().map(i64::from).collect())),
            column("plant.x", Values::Real(rows.clone().map(|i| f64::from(i) / 7.0).collect())),
            column(
                "late",
                Values::Optional(
                    rows.clone().map(|i| (i % 3 > 0).then_some(f64::from(i))).collect(),
                ),
            ),
            column("seed", Values::Integer(rows.clone().map(|i| i - 5).collect())),
            column("kept", Values::Flag(rows.clone().map(|i| i % 2 == 0).collect())),
            column("status", Values::Text(rows.map(|i| format!("ende {} °", i % 4)).collect())),
        ],
    }
}

#[test]
fn rows_are_read_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/a.parquet");
    let whole = table(0..20_000);
    let mut writer = Writer::create(&path, &[("units", "{}".into())]).unwrap();
    writer.add(whole.clone()).unwrap();
    assert!(!path.exists());
    writer.finish().unwrap();
    let reader = Reader::open(&path).unwrap();
    assert_eq!((reader.rows(), reader.metadata("units")), (20_000, Some("{}")));
    assert_eq!(reader.table().unwrap(), whole);
    assert_eq!(reader.column("late").unwrap(), *whole.column("late").unwrap());
    assert!(reader.column("lat").unwrap_err().to_string().contains("no column \"lat\""));
}

#[test]
fn the_bytes_do_not_depend_on_the_pieces() {
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, pieces: &[i32]| {
        let path = folder.path().join(name);
        let mut writer = Writer::create(&path, &[]).unwrap();
        let mut start = 0;
        for piece in pieces {
            writer.add(table(start..start + piece)).unwrap();
            start += piece;
        }
        writer.finish().unwrap();
        fs::read(path).unwrap()
    };
    let whole = written("whole", &[20_000]);
    assert_eq!(written("pieces", &[1, 8191, 250, 9000, 2558]), whole);
}

#[test]
fn an_unfinished_file_is_removed() {
    let folder = tempfile::tempdir().unwrap();
    let mut writer = Writer::create(&folder.path().join("a.parquet"), &[]).unwrap();
    writer.add(table(0..10_000)).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    drop(writer);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_changed_value_has_another_digest() {
    let digest = table(0..10).digest();
    let mut other = table(0..10);
    if let Values::Real(values) = &mut other.columns[1].values {
        values[3] += 1e-15;
    }
    assert_ne!(other.digest(), digest);
}

#[test]
fn no_changed_bit_goes_unseen_or_ends_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.parquet");
    let whole = table(0..12);
    let mut writer = Writer::create(&path, &[("digest", whole.digest())]).unwrap();
    writer.add(whole.clone()).unwrap();
    writer.finish().unwrap();
    let sound = fs::read(&path).unwrap();
    let mut seen = 0;
    for bit in 0..8 * sound.len() {
        let mut broken = sound.clone();
        broken[bit / 8] ^= 1 << (bit % 8);
        fs::write(&path, &broken).unwrap();
        let reader = Reader::open(&path);
        let read = reader.and_then(|reader| Ok((reader.table()?, reader)));
        match read {
            Ok((rows, reader)) if reader.metadata("digest") == Some(&rows.digest()) => {
                assert_eq!(rows, whole, "bit {bit}");
            }
            _ => seen += 1,
        }
    }
    assert!(seen > 4 * sound.len(), "{seen} of {}", 8 * sound.len());
}
