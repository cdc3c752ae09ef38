use super::*;
use fmi_master::instance::Instance;

const FILE: &str = "\u{feff}time,gust.x [N.m],plain\r\n\
                    # a comment\r\n\
                    1,10,0.5\r\n\
                    2,20,1.5\r\n\
                    2,-20,1.5\r\n\
                    4,0,2.5\r\n";

fn opened(text: &str) -> (LookupTableInstance, fmi_master::description::ModelDescription) {
    let table = LookupTable::parse(text.as_bytes()).unwrap();
    let description = table.description("gusts").unwrap();
    (LookupTableInstance::new("gusts", table), description)
}

fn at(instance: &mut LookupTableInstance, time: f64) -> (f64, f64) {
    instance.do_step(time - 0.1, 0.1).unwrap();
    let mut values = [0.0; 2];
    instance.get_real(&[0, 1], &mut values).unwrap();
    (values[0], values[1])
}

fn reference(description: &fmi_master::description::ModelDescription, name: &str) -> u32 {
    description.find(name).unwrap_or_else(|| panic!("{name}")).1.reference
}

#[test]
fn oracle_rows_hold_until_the_next_one() {
    let (mut instance, _) = opened(FILE);
    instance.enter_initialization(0.0, 5.0).unwrap();
    for (time, row) in [
        (0.0, (10.0, 0.5)),
        (1.0, (10.0, 0.5)),
        (1.999, (10.0, 0.5)),
        // Of two rows at the same time the later one holds.
        (2.0, (-20.0, 1.5)),
        (0.1 + 0.2 + 1.7, (-20.0, 1.5)),
        (4.0, (0.0, 2.5)),
        (9.0, (0.0, 2.5)),
    ] {
        assert_eq!(at(&mut instance, time), row, "at {time} s");
    }
}

#[test]
fn oracle_lines_between_rows_and_jumps_at_equal_times() {
    let (mut instance, description) = opened(FILE);
    instance.set_integer(&[reference(&description, "interpolation")], &[2]).unwrap();
    instance.enter_initialization(0.0, 5.0).unwrap();
    for (time, row) in [
        (0.5, (10.0, 0.5)),
        (1.25, (12.5, 0.75)),
        (2.0, (-20.0, 1.5)),
        (3.0, (-10.0, 2.0)),
        (4.5, (0.0, 2.5)),
    ] {
        assert_eq!(at(&mut instance, time), row, "at {time} s");
    }
}

#[test]
fn times_and_values_are_parameters_until_the_run_begins() {
    let (mut instance, description) = opened(FILE);
    let variable = description.find("gust.x[3]").unwrap().1;
    let kind = &variable.kind;
    assert_eq!(kind.unit(), Some("N.m"), "{kind:?}");
    assert_eq!(variable.start.as_deref(), Some("-20"));
    instance
        .set_real(&[variable.reference, reference(&description, "time[4]")], &[7.0, 3.0])
        .unwrap();
    instance.enter_initialization(0.0, 5.0).unwrap();
    assert_eq!(at(&mut instance, 2.5), (7.0, 1.5));
    assert_eq!(at(&mut instance, 3.0), (0.0, 2.5));
    instance.reset().unwrap();
    instance.set_real(&[reference(&description, "time[1]")], &[3.0]).unwrap();
    let order = instance.enter_initialization(0.0, 5.0).unwrap_err();
    assert_eq!(order.message, "time[2] = 2 s is earlier than time[1] = 3 s");
    instance.reset().unwrap();
    instance.enter_initialization(0.0, 5.0).unwrap();
    assert_eq!(at(&mut instance, 3.0), (-20.0, 1.5));
}

#[test]
fn large_tables_have_no_parameters_for_their_values() {
    let rows = "0,1\n".repeat(500);
    assert!(opened(&format!("time,x\n{rows}")).1.find("x[500]").is_some());
    assert!(opened(&format!("time,x\n{rows}0,1\n")).1.find("x[1]").is_none());
}

#[test]
fn faults_name_line_and_column() {
    let fault = |text: &str| {
        let table = LookupTable::parse(text.as_bytes());
        table.and_then(|table| table.description("gusts").map(drop)).unwrap_err()
    };
    for (text, message) in [
        ("", "is not a lookup table: the first column is \"\", not \"time\""),
        ("time;x\n0;1\n", "is not a lookup table: there must be commas between the columns"),
        ("t,x\n0,1\n", "is not a lookup table: the first column is \"t\", not \"time\""),
        ("time\n0\n", "is a lookup table without columns beside \"time\""),
        ("time,x\n", "is a lookup table without rows"),
        ("time,\n0,1\n", "is a lookup table with a column that has no name"),
        ("time,x,x\n0,1,1\n", "is a lookup table in which \"x\" has two meanings"),
        (
            "time,interpolation\n0,1\n",
            "is a lookup table in which \"interpolation\" has two meanings",
        ),
        ("time,x\n0,1\n1\n", "line 3 has 1 values for 2 columns"),
        ("time,x\n0,1\n1,2,3\n", "line 3 has 3 values for 2 columns"),
        ("time,x\nnow,1\n", "line 2: \"time\" is \"now\", it must be a finite number"),
        (
            "time,x\n1,1\n0,1\n",
            "line 3: \"time\" is \"0\", it must be no earlier than in the row before",
        ),
        ("time,x\n0,NaN\n", "line 2: \"x\" is \"NaN\", it must be a finite number"),
        ("time,x [N.m]\n0,1 kN\n", "line 2: \"x [N.m]\" is \"1 kN\", it must be a finite number"),
    ] {
        assert_eq!(fault(text), message, "{text}");
    }
    let binary = LookupTable::parse(b"time,x\n0,\xff\n").unwrap_err();
    assert!(binary.starts_with("is not a lookup table: "), "{binary}");
}
