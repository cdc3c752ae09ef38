//! Declarations of nested structures, arrays and choices.

use nalgebra::{Matrix3, SMatrix, Vector3};
use settings::{Choice, Declared, Field, Kind, Role, change, check, names, read, settings, start};
use toml::{Table, Value};

const AXES: [(&str, &str); 3] = [(".x", "roll axis"), (".y", "pitch axis"), (".z", "yaw axis")];

/// Way to act.
#[derive(Clone, Copy, Debug, Default, PartialEq, Choice)]
enum Mode {
    /// No action.
    #[default]
    Off,
    /// R is used as it is.
    #[setting(name = "full")]
    All,
}

#[derive(Clone, Debug, Default, PartialEq, Declared)]
struct Layer {
    /// Thickness of the layer.
    #[setting(part, above = 0.0, start = 0.5)]
    thickness: f64,
    /// Gain.
    #[setting(part, rate, each = AXES, below = 10.0)]
    gain: Vector3<f64>,
    /// Exponent.
    ///
    /// This paragraph is for readers of the code.
    #[setting(part, unit = "1", max = 1.0)]
    exponent: f64,
}

#[derive(Clone, Debug, Default, PartialEq, Declared)]
struct Law {
    #[setting(skip)]
    _body: u8,
    mode: Mode,
    /// Number of steps.
    #[setting(name = "steps", min = 1, max = 100, start = 20)]
    count: usize,
    /// Outer loop.
    #[setting(unit = "rad")]
    outer: Layer,
    /// Inner loop.
    #[setting(unit = "rad/s")]
    inner: Layer,
    /// Matrix of the sensor.
    matrix: Matrix3<f64>,
    /// Weights.
    #[setting(name = "weight.P")]
    weights: [f64; 2],
    /// Name of a file.
    file: String,
    /// Whether it is on.
    is_on: bool,
}

fn table(text: &str) -> Table {
    toml::from_str(text).unwrap()
}

#[test]
fn names_texts_and_units_follow_from_the_fields() {
    let list = settings::<Law>();
    let shown: Vec<(&str, &str, &str)> = list
        .iter()
        .map(|setting| &setting.place)
        .map(|place| (place.name.as_str(), place.text.as_str(), place.unit.as_ref()))
        .collect();
    assert_eq!(
        shown[..8],
        [
            ("mode", "Way to act", ""),
            ("steps", "Number of steps", ""),
            ("outer.thickness", "Outer loop: thickness of the layer", "rad"),
            ("outer.gain.x", "Outer loop: gain (roll axis)", "rad/s"),
            ("outer.gain.y", "Outer loop: gain (pitch axis)", "rad/s"),
            ("outer.gain.z", "Outer loop: gain (yaw axis)", "rad/s"),
            ("outer.exponent", "Outer loop: exponent", ""),
            ("inner.thickness", "Inner loop: thickness of the layer", "rad/s"),
        ]
    );
    assert_eq!(shown[8].2, "rad/s2");
    assert_eq!(shown[12], ("matrix[1,1]", "Matrix of the sensor (row 1, column 1)", ""));
    let last = ["weight.P[1]", "weight.P[2]", "file", "isOn"];
    assert_eq!(names::<Law>()[21..], last);
    let Kind::Choice(items, _) = &list[0].kind else { panic!("a choice") };
    assert_eq!(items.items, [("off", "no action"), ("full", "R is used as it is")]);
}

#[test]
fn files_set_what_they_name_in_the_units_that_they_write() {
    let mut law = Law::default();
    let text = "mode = 'full'\nsteps = 7\nouter.thickness = '90 deg'\ninner.gain = { x = '180 deg/s2' }\n\
        weight.P = [1, 2.5]\n\"matrix[2,3]\" = -1.0\nfile = 'a.csv'\nisOn = true";
    read(&mut law, &table(text)).unwrap();
    assert_eq!((law.mode, law.count, law.weights), (Mode::All, 7, [1.0, 2.5]));
    assert_eq!(law.outer.thickness, 90_f64.to_radians());
    assert_eq!(law.inner.gain.x, 180_f64.to_radians());
    assert_eq!(law.matrix[(1, 2)], -1.0);
    assert!(law.is_on && law.file == "a.csv");
}

#[test]
fn what_no_setting_can_be_is_refused_by_name() {
    for (text, refusal) in [
        ("mode = 'some'", "mode: \"some\" is not one of off, full"),
        ("steps = -1", "steps: -1 is not a number that it can hold"),
        ("steps = 1.5", "steps: 1.5 is not an integer"),
        ("outer.width = 1", "outer.width: there is no such setting"),
        ("outer.thickness = '1 m'", "outer.thickness: \"1 m\" is not a number in rad"),
        ("outer.thickness = true", "outer.thickness: true is not a number"),
        ("isOn = 1", "isOn: 1 is not true or false"),
        ("file = 1", "file: 1 is not a text"),
        ("weight.P = [1, 2, 3]", "weight.P[3]: there is no such setting"),
    ] {
        let error = read(&mut Law::default(), &table(text)).unwrap_err().to_string();
        assert!(error.starts_with(refusal), "{error}");
    }
    let error = change(&mut Law::default(), "steps", &Value::from("x")).unwrap_err();
    assert_eq!(error.name, "steps");
}

#[test]
fn values_out_of_range_are_refused_by_name() {
    let good: Law = start();
    assert_eq!((good.count, good.outer.thickness), (20, 0.5));
    check(&good).unwrap();
    let refusal = |change: fn(&mut Law)| {
        let mut law = good.clone();
        change(&mut law);
        check(&law).unwrap_err().to_string()
    };
    assert_eq!(refusal(|law| law.count = 0), "steps = 0 must be at least 1");
    assert_eq!(refusal(|law| law.count = 101), "steps = 101 must be at most 100");
    assert_eq!(refusal(|law| law.inner.thickness = 0.0), "inner.thickness = 0 must be above 0");
    assert_eq!(refusal(|law| law.outer.gain.y = 10.0), "outer.gain.y = 10 must be below 10");
    assert_eq!(refusal(|law| law.outer.exponent = 1.5), "outer.exponent = 1.5 must be at most 1");
    let text = refusal(|law| law.matrix[(0, 0)] = f64::NAN);
    assert_eq!(text, "matrix[1,1] = NaN must be a finite number");
}

const SIDES: [(&str, &str); 2] = [(".left", "left side"), (".right", "right side")];

#[derive(Clone, Copy, Debug, Default, Declared)]
struct Row {
    /// Time of row {#}.
    #[setting(unit = "s")]
    time: f64,
    /// Force on the {} (row {#}).
    #[setting(name = "", each = SIDES)]
    force: [f64; 2],
}

#[derive(Clone, Copy, Debug, Default, Declared)]
struct Motion {
    /// Angle of the {}.
    #[setting(name = "", unit = "rad")]
    angles: [f64; 2],
    /// Rate of the {}.
    #[setting(name = "+Rate", unit = "rad/s", derivative = "motion{.}")]
    rates: [f64; 2],
}

#[derive(Clone, Debug, Default, Declared)]
struct Machine {
    /// {} at present.
    #[setting(output, each = SIDES, depends_on = ["u*"])]
    motion: Motion,
    /// Table.
    #[setting(by_column, used_with = "rows >= {#}")]
    table: [Row; 2],
    /// {} by the {}.
    #[setting(each = AXES, columns = SIDES)]
    moment: SMatrix<f64, 3, 2>,
    /// {}.
    #[setting(each = SIDES, columns = AXES, units = ["m", "km"], nominals = [1.0, 2.0])]
    points: [Vector3<f64>; 2],
    /// Switch of the {}: {.}.
    #[setting(input, discrete, optional, each = SIDES)]
    switches: [bool; 2],
}

#[test]
fn sentences_and_names_of_entries_follow_from_the_structure() {
    let list = settings::<Machine>();
    let shown: Vec<(&str, &str)> = list
        .iter()
        .map(|setting| (setting.place.name.as_str(), setting.place.text.as_str()))
        .collect();
    assert_eq!(
        shown[..11],
        [
            ("motion.left", "Angle of the left side at present"),
            ("motion.right", "Angle of the right side at present"),
            ("motionRate.left", "Rate of the left side at present"),
            ("motionRate.right", "Rate of the right side at present"),
            ("table.time[1]", "Time of row 1"),
            ("table.time[2]", "Time of row 2"),
            ("table.left[1]", "Force on the left side (row 1)"),
            ("table.left[2]", "Force on the left side (row 2)"),
            ("table.right[1]", "Force on the right side (row 1)"),
            ("table.right[2]", "Force on the right side (row 2)"),
            ("moment[1,1]", "Roll axis by the left side"),
        ]
    );
    assert_eq!(shown[16], ("points.left.x", "Left side (roll axis)"));
    assert_eq!(shown[22], ("switches.left", "Switch of the left side: .left"));
    assert_eq!(list[5].place.used_with, "rows >= 2");
    assert_eq!((list[19].place.unit.as_ref(), list[19].place.nominal), ("km", Some(2.0)));
}

#[test]
fn roles_and_dependencies_are_those_of_the_structure() {
    let list = settings::<Machine>();
    let rate = &list[3].place;
    assert_eq!((rate.role, rate.derivative.as_str()), (Role::Output, "motion.right"));
    assert_eq!(rate.depends_on, ["u*"]);
    let switch = &list[22].place;
    assert!(switch.role == Role::Input && switch.is_discrete && switch.is_optional);
    assert_eq!(list[4].place.role, Role::Parameter);
}

#[test]
fn each_field_is_reached_by_its_offset() {
    let mut machine = Machine::default();
    let list = settings::<Machine>();
    for index in 0..list.len() {
        match list.field(&mut machine, index) {
            Field::Real(field) => *field = index as f64,
            Field::Boolean(field) => *field = true,
            _ => unreachable!("there are numbers and switches only"),
        }
    }
    let Machine { motion, table, moment, points, switches } = machine;
    assert_eq!((motion.angles, motion.rates), ([0.0, 1.0], [2.0, 3.0]));
    assert_eq!(table.map(|row| row.time), [4.0, 5.0]);
    assert_eq!(table.map(|row| row.force), [[6.0, 8.0], [7.0, 9.0]]);
    assert_eq!(moment.row(2).iter().copied().collect::<Vec<_>>(), [14.0, 15.0]);
    assert_eq!(points[1], Vector3::new(19.0, 20.0, 21.0));
    assert!(switches[0] && switches[1]);
}
