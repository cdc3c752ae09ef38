//! Tests with a small FMU described by hand: its GUID, checks, XML, page and archive.

use model_description::library_file::LibraryFile;
use model_description::pack::{Extras, pack};
use model_description::unit::Unit;
use model_description::variable::{
    Causality, EnumerationType, Variability, Variable, VariableKind,
};
use model_description::{DefaultExperiment, ModelDescription, Version};
use std::fs;
use std::io::Read;
use std::path::Path;

/// A library for Linux of which only the file matters.
fn library_file(path: &Path) -> LibraryFile {
    let path = path.to_owned();
    let (exports, tuples) = ([].into(), vec!["x86_64-linux"]);
    LibraryFile { path, folders: &["linux64"], tuples, suffix: "so", exports, sources: None }
}

fn variable(
    name: &str,
    causality: Causality,
    variability: Variability,
    kind: VariableKind,
) -> Variable {
    let description = format!("What <{name}> & co. are");
    Variable {
        name: name.into(),
        description,
        causality,
        variability,
        kind,
        dependencies: vec![],
        used_with: String::new(),
        is_optional: false,
    }
}

fn real(start: Option<f64>) -> VariableKind {
    with_unit(Unit::new("rad"), start, None)
}

fn with_unit(unit: Unit, start: Option<f64>, derivative_of: Option<&str>) -> VariableKind {
    let derivative_of = derivative_of.map(String::from);
    VariableKind::Real {
        unit: Some(unit),
        min: None,
        max: None,
        nominal: None,
        start,
        derivative_of,
    }
}

/// A number between 0 and 10 without a unit.
fn limited(start: f64) -> VariableKind {
    let (min, max, start) = (Some(0.0), Some(10.0), Some(start));
    VariableKind::Real { unit: None, min, max, nominal: None, start, derivative_of: None }
}

fn shape(start: i32) -> VariableKind {
    let enumeration_type = EnumerationType {
        name: "Shape".into(),
        description: "How".into(),
        items: vec![("flat".into(), "Nothing".into()), ("steep".into(), "Much".into())],
    };
    VariableKind::Enumeration { enumeration_type, start: Some(start) }
}

fn rate(derivative_of: &str) -> VariableKind {
    with_unit(Unit::new("rad/s"), None, Some(derivative_of))
}

/// An FMU with these positions: 0 parameter, 1 enumeration, 2 input, 3 state, 4 derivative, 5
/// output with feedthrough.
fn fmu() -> ModelDescription {
    use Causality::{Input, Local, Output, Parameter};
    use Variability::{Continuous, Discrete, Fixed};
    let count = VariableKind::Integer { min: None, max: None, start: None };
    let mut variables = vec![
        variable("gain", Parameter, Fixed, limited(2.5)),
        variable("shape", Parameter, Fixed, shape(2)),
        variable("u[1]", Input, Continuous, real(Some(std::f64::consts::PI / 180.0))),
        variable("angle", Output, Continuous, real(None)),
        variable("der(angle)", Local, Continuous, rate("angle")),
        variable("y", Output, Continuous, real(None)),
        variable("count", Output, Discrete, count),
    ];
    for (i, names) in [(4, vec!["u[1]"]), (5, vec!["angle", "u[1]"])] {
        variables[i].dependencies = names.into_iter().map(String::from).collect();
    }
    ModelDescription {
        name: "Small".into(),
        description: "A small FMU".into(),
        documentation: "<p>Not much.</p>".into(),
        version: "1.2.3".into(),
        co_simulation: true,
        model_exchange: true,
        event_indicators: 0,
        default_experiment: DefaultExperiment {
            start: 0.0,
            stop: 50.0,
            tolerance: 1e-4,
            step: 0.04,
        },
        variables,
    }
}

#[test]
fn the_guid_is_a_uuid_that_follows_every_change() {
    let guid = fmu().guid();
    assert_eq!(guid, fmu().guid());
    let parts: Vec<_> = guid.split('-').collect();
    assert_eq!(parts.iter().map(|part| part.len()).collect::<Vec<_>>(), [8, 4, 4, 4, 12]);
    assert!(guid.chars().all(|c| c == '-' || c.is_ascii_digit() || ('a'..='f').contains(&c)));
    let mut other = fmu();
    other.variables[0].description.push('.');
    assert_ne!(other.guid(), guid);
    let mut other = fmu();
    other.version = "1.2.4".into();
    assert_ne!(other.guid(), guid);
}

#[test]
fn contradictions_are_found_and_name_the_variable() {
    type Change = fn(&mut ModelDescription);
    let cases: &[(Change, &str)] = &[
        (|fmu| fmu.name = "a b".into(), "C identifier"),
        (|fmu| fmu.variables[5].name = "angle".into(), "'angle' is declared twice"),
        (|fmu| fmu.variables[2].name = "u[1".into(), "'u[1' is not a structured name"),
        (|fmu| fmu.variables[2].name = "1u".into(), "not a structured name"),
        (|fmu| fmu.variables[5].dependencies.push("gain".into()), "'y' depends on 'gain'"),
        (|fmu| fmu.variables[5].dependencies.push("v".into()), "'y' depends on 'v'"),
        (|fmu| fmu.variables[2].kind = real(None), "'u[1]' needs a start value"),
        (|fmu| fmu.variables[5].kind = real(Some(1.0)), "'y' is calculated and has a start value"),
        (|fmu| fmu.variables[6].variability = Variability::Continuous, "'count' is not a Real"),
        (|fmu| fmu.variables[0].variability = Variability::Discrete, "'gain' must be both a para"),
        (|fmu| fmu.variables[0].kind = limited(11.0), "'gain' has a start value outside its"),
        (|fmu| fmu.variables[1].kind = shape(0), "'shape' has a start value outside its limits"),
        (|fmu| fmu.variables[4].kind = rate("gain"), "'der(angle)' is the derivative of 'gain'"),
        (
            |fmu| {
                let unit = Unit { m: 1, ..Unit::new("rad") };
                fmu.variables[5].kind = with_unit(unit, None, None);
            },
            "'y' defines unit 'rad' differently",
        ),
        (|fmu| fmu.default_experiment.step = f64::NAN, "default experiment"),
    ];
    assert!(fmu().check().is_ok());
    for (change, part) in cases {
        let mut changed = fmu();
        change(&mut changed);
        let text = changed.to_xml(Version::Fmi2).expect_err(part).to_string();
        assert!(text.contains(part), "no '{part}' in '{text}'");
    }
}

#[test]
fn the_xml_says_what_the_variable_table_says() {
    let xml = fmu().to_xml(Version::Fmi2).unwrap();
    for part in [
        "fmiVersion=\"2.0\"",
        &format!("guid=\"{}\"", fmu().guid()),
        "<ModelExchange modelIdentifier=\"Small\"",
        "<CoSimulation modelIdentifier=\"Small\"",
        "<DisplayUnit name=\"deg\" factor=\"57.29577951308232\"/>",
        "<BaseUnit s=\"-1\" rad=\"1\"/>",
        "<Item name=\"steep\" value=\"2\" description=\"Much\"/>",
        "<DefaultExperiment startTime=\"0.0\" stopTime=\"50.0\" tolerance=\"0.0001\" stepSize=\"0.04\"/>",
        "description=\"What &lt;gain&gt; &amp; co. are\"",
        "<Real min=\"0.0\" max=\"10.0\" start=\"2.5\"/>",
        "<Enumeration declaredType=\"Shape\" start=\"2\"/>",
        "<Real unit=\"rad\" displayUnit=\"deg\" start=\"0.017453292519943295\"/>",
        "<Real unit=\"rad/s\" displayUnit=\"deg/s\" derivative=\"4\"/>",
    ] {
        assert!(xml.contains(part), "no {part} in\n{xml}");
    }
    assert!(!xml.contains("xmlns"));
    assert!(!xml.contains("initial="));
}

fn entries(path: &Path) -> Vec<(String, String)> {
    let mut archive = zip::ZipArchive::new(fs::File::open(path).unwrap()).unwrap();
    let length = archive.len();
    let read = |i| {
        let mut entry = archive.by_index(i).unwrap();
        let mut text = String::new();
        entry.read_to_string(&mut text).unwrap();
        (entry.name().unwrap().into_owned(), text)
    };
    (0..length).map(read).collect()
}

#[test]
fn the_archive_is_complete_and_the_same_every_time() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("library"), "machine code").unwrap();
    fs::write(at("LICENSE-A"), "text a").unwrap();
    fs::write(at("LICENSE-B"), "text b").unwrap();
    fs::create_dir_all(at("data/deep")).unwrap();
    fs::write(at("data/z.csv"), "1").unwrap();
    fs::write(at("data/deep/a.csv"), "2").unwrap();
    let extras = Extras {
        resources: Some(at("data")),
        licenses: vec![at("LICENSE-A"), at("LICENSE-B")],
        icons: None,
        folder: None,
    };
    let path = pack(&fmu(), &[library_file(&at("library"))], folder.path(), &extras, Version::Fmi2)
        .unwrap();
    assert_eq!(path, at("Small.fmu"));
    let first = fs::read(&path).unwrap();
    let content = entries(&path);
    let names: Vec<_> = content.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names[0], "modelDescription.xml");
    assert!(names[1].starts_with("binaries/") && names[1].contains("/Small."));
    assert_eq!(
        names[2..],
        [
            "documentation/index.html",
            "documentation/licenses/LICENSE-A",
            "documentation/licenses/LICENSE-B",
            "documentation/licenses/license.txt",
            "resources/deep/a.csv",
            "resources/z.csv",
        ]
    );
    assert_eq!(content[1].1, "machine code");
    assert_eq!(content[0].1, fmu().to_xml(Version::Fmi2).unwrap());

    // Another time and another order of the folder still give the same bytes.
    std::thread::sleep(std::time::Duration::from_millis(20));
    fs::write(at("data/z.csv"), "1").unwrap();
    pack(&fmu(), &[library_file(&at("library"))], folder.path(), &extras, Version::Fmi2).unwrap();
    assert_eq!(fs::read(&path).unwrap(), first);
    assert!(!at("Small.fmu.part").exists());
}

#[test]
fn a_library_goes_into_every_folder_of_its_platform() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("library");
    fs::write(&library, "machine code").unwrap();
    let aarch64 = LibraryFile { folders: &["aarch64-linux", "linux64"], ..library_file(&library) };
    let path = pack(&fmu(), &[aarch64], folder.path(), &Extras::default(), Version::Fmi2).unwrap();
    assert!(entries(&path).iter().any(|(name, _)| name == "resources/README.txt"), "no resources");
    let names: Vec<_> = entries(&path).into_iter().map(|(name, _)| name).collect();
    for folder in ["aarch64-linux", "linux64"] {
        assert!(names.contains(&format!("binaries/{folder}/Small.so")), "{names:?}");
    }
    let aarch64 = LibraryFile { folders: &["aarch64-linux", "linux64"], ..library_file(&library) };
    let extras = Extras { folder: Some("linux64".into()), ..Extras::default() };
    let path = pack(&fmu(), &[aarch64], folder.path(), &extras, Version::Fmi2).unwrap();
    let binaries = entries(&path).into_iter().filter(|(name, _)| name.starts_with("binaries/"));
    assert_eq!(binaries.map(|(name, _)| name).collect::<Vec<_>>(), ["binaries/linux64/Small.so"]);
}

#[test]
fn units_have_the_dimensions_of_their_symbols() {
    for (name, [kg, m, s, ampere, rad]) in [
        ("rad/s2", [0, 0, -2, 0, 1]),
        ("N.m", [1, 2, -2, 0, 0]),
        ("N.m/rad", [1, 2, -2, 0, -1]),
        ("kg.m2", [1, 2, 0, 0, 0]),
        ("Pa", [1, -1, -2, 0, 0]),
        ("1/s", [0, 0, -1, 0, 0]),
        ("T/s", [1, 0, -3, -1, 0]),
        ("Hz", [0, 0, -1, 0, 0]),
    ] {
        let unit = Unit::new(name);
        assert!(unit.is_known(), "{name}");
        let dimension = [unit.kg, unit.m, unit.s, unit.ampere, unit.rad];
        assert_eq!(dimension, [kg, m, s, ampere, rad], "{name}");
    }
    for name in ["furlong", "rad/", "m^2", ""] {
        assert!(!Unit::new(name).is_known(), "{name}");
    }
}
