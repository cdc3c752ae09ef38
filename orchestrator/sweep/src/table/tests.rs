use super::*;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use std::fs::{self, File};

fn table(rows: Range<i32>) -> CaseTable {
    let column = |name: &str, values| Column { name: name.into(), values };
    CaseTable {
        columns: vec![
            column("case", Values::Integer(rows.clone().map(i64::from).collect())),
            column(
                "plant.x",
                Values::Real(rows.clone().map(|i| Some(f64::from(i) / 7.0)).collect()),
            ),
            column(
                "late",
                Values::Real(rows.clone().map(|i| (i % 3 > 0).then_some(f64::from(i))).collect()),
            ),
            column("seed", Values::Integer(rows.clone().map(|i| i64::from(i) - 5).collect())),
            column("kept", Values::Flag(rows.clone().map(|i| i % 2 == 0).collect())),
            column("status", Values::Text(rows.map(|i| format!("ende {} °", i % 4)).collect())),
        ],
    }
}

#[test]
fn a_file_has_the_rows_and_the_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/a.parquet");
    let whole = table(0..20_000);
    whole.write(&path, "{}".into()).unwrap();
    assert_eq!(fs::read_dir(folder.path().join("deep")).unwrap().count(), 1);
    let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata();
    let entry = &metadata.key_value_metadata().unwrap()[0];
    assert_eq!((entry.key.as_str(), entry.value.as_deref()), ("units", Some("{}")));
    let mut rows = 0;
    for (at, row) in reader.get_row_iter(None).unwrap().enumerate() {
        for ((name, field), column) in row.unwrap().get_column_iter().zip(&whole.columns) {
            assert_eq!(*name, column.name);
            match (field, &column.values) {
                (Field::Double(value), Values::Real(values)) => {
                    assert_eq!(Some(*value), values[at]);
                }
                (Field::Null, Values::Real(values)) => assert_eq!(values[at], None),
                (Field::Long(value), Values::Integer(values)) => assert_eq!(*value, values[at]),
                (Field::Bool(value), Values::Flag(values)) => assert_eq!(*value, values[at]),
                (Field::Str(value), Values::Text(values)) => assert_eq!(*value, values[at]),
                (field, values) => panic!("{field} of {values:?}"),
            }
        }
        rows += 1;
    }
    assert_eq!(rows, 20_000);
}

#[test]
fn rows_are_added_in_order() {
    let mut whole = CaseTable::default();
    for rows in [0..1, 1..8192, 8192..9000] {
        whole.append(table(rows));
    }
    assert_eq!(whole, table(0..9000));
    assert!(whole.has_cases(&(0..9000)) && !whole.has_cases(&(1..9001)));
}
