//! Tests of vehicles as files.

use super::*;
use crate::aerodynamics::Flow;
use crate::air::Air;
use crate::effectors::Surfaces;
use crate::entry;
use crate::translation::Planet;
use nalgebra::Vector3;

/// A small vehicle with every kind of term.
const SMALL: &str = include_str!("small.toml");

fn refusal(from: &str, to: &str) -> String {
    assert!(SMALL.contains(from), "{from}");
    let error = Vehicle::from_toml("my.toml", &SMALL.replacen(from, to, 1)).unwrap_err();
    error.to_string()
}

fn flow() -> Flow {
    Flow { dynamic_pressure: 1e3, mach: 5.0, speed: 1500.0, alpha: 15_f64.to_radians(), beta: 0.0 }
}

#[test]
fn every_fault_has_its_file_line_and_key() {
    // The line is the first one that begins with these words in the changed file.
    for (from, to, line, named) in [
        ("kilograms = 10000.0", "kilograms = -1.0", "mass", "reference.mass: must be positive"),
        ("kilograms = 10000.0", "kilograms = nan", "mass", "reference.mass: must be finite"),
        ("kilograms = 10000.0", "tons = 10.0", "mass", "tons"),
        ("area =", "aera =", "aera", "aera"),
        ("Ixx = 9000.0", "Ixx = 0.0", "Ixx", "inertia.Ixx: must be positive"),
        ("Izz = 60000.0", "Izz = 90000.0", "Ixx", "triangle"),
        (
            "[2.0, 10.0]",
            "[10.0, 2.0]",
            "mach",
            "forces.lift.table.mach must increase, but 2 follows",
        ),
        ("[0.0, 20.0]", "[0.0, 0.0]", "alpha_deg", "alpha_deg must increase"),
        (
            "mach = [2.0, 10.0]",
            "mach = [2.0]",
            "values = [[0.0",
            "one for each of the 1 Mach numbers",
        ),
        ("[0.0, 0.5],", "[0.0],", "values = [[0.0]", "values: row 1 has 1 values"),
        ("[0.0, 0.5],", "[0.0, inf],", "values = [[0.0, inf]", "row 1 holds a value"),
        ("polynomial = [0.1]", "polynomial = [nan]", "polynomial", "forces.drag.polynomial holds"),
        (
            "polynomial = [0.1]",
            "polynomial = [0.1]\nper_degree = true",
            "per_degree",
            "forces.drag.per_degree is for derivatives",
        ),
        ("polynomial = [0.1]", "", "[forces.drag]", "either polynomial or table"),
        ("[10.0, 20.0], mach", "[20.0], mach", "table =", "moments.pitch.table: values: row 1"),
        ("min_deg = [-20.0, -30.0]", "min_deg = [-20.0]", "min_deg", "surfaces.min_deg has 1"),
        ("min_deg = [-20.0, -30.0]", "min_deg = [-5e3, -30.0]", "min_deg", "within 180 degrees"),
        ("[2.0, 10.0]", "[-2.0, 10.0]", "mach", "mach holds -2, which must be at least 0"),
        ("[0.0, 20.0]", "[0.0, 5e3]", "alpha_deg", "holds 5000, which must be at most 180"),
        (
            "polynomial = [0.1]",
            "polynomial = [0.1, -0.01]",
            "polynomial = [0.1, -0.01]",
            "forces.drag.polynomial gives",
        ),
        ("min_deg = [-20.0, -30.0]", "min_deg = [1.0, -30.0]", "min_deg", "must hold 0"),
        ("rate_deg_s = [20.0,", "rate_deg_s = [0.0,", "rate_deg_s", "'flap' must be positive"),
        ("surface = \"flap\"", "surface = \"flop\"", "surface", "there is no 'flop'"),
        ("axis = \"pitch\"", "axis = \"nod\"", "axis", "nod"),
        ("[[-0.01, -0.02]],", "[[-0.01]],", "values = [\n", "surfaces.table.values: row 1 has 1"),
        ("[[0.0, 0.0]],", "[[0.1, 0.0]],", "values = [\n", "at zero deflection"),
        ("force = 400.0", "force = 0.0", "force", "jets.force: must be positive"),
        ("[300.0, -300.0],", "[300.0],", "moment = [", "jets.moment: a row"),
        ("Invented for a test", " ", "source", "reference.source: is empty"),
        ("span = { metres = 6.0 }", "", "[reference]", "reference.span and chord are missing"),
    ] {
        let changed = SMALL.replacen(from, to, 1);
        let lines = changed[..changed.find(&format!("\n{line}")).unwrap()].matches('\n').count();
        let text = refusal(from, to);
        assert!(text.starts_with(&format!("my.toml, line {}: ", lines + 2)), "{to}: {text}");
        assert!(text.contains(named), "{to}: {text}");
    }
}

#[test]
fn shipped_vehicles_have_the_inertia_of_their_papers() {
    let inertia = |name: &str| Vehicle::read(Path::new(name)).unwrap().inertia;
    assert_eq!(inertia("chai2022"), Scenario::crmpc2022().inertia);
    assert_eq!(inertia("wu2015"), Scenario::tvsmc2015().inertia);
    assert_eq!(inertia("jia"), Scenario::two_loop().inertia);
    assert!(SHIPPED.iter().all(|name| Vehicle::shipped(name).is_some_and(|it| it.fits())));
    assert_eq!(Vehicle::shipped("chai"), None);
}

/// C_m of the table at 15° and Mach 5, and the lever arm of the forces: halfway over the angle and
/// 3/8 of the way over the Mach number.
#[test]
fn oracle_moments_are_tables_and_the_lever_arm_of_the_forces() {
    let vehicle = Vehicle::from_toml("small.toml", SMALL).unwrap();
    let aerodynamics = &vehicle.aerodynamics;
    let moment = aerodynamics.moment(&flow(), &Vector3::zeros(), 0.1);
    let pitch = -0.013_125 * 1e3 * 20.0 * 4.0;
    assert!((moment - Vector3::new(0.0, pitch, 0.0)).amax() < 1e-9, "{moment}");
    // The forces act half a metre in front of the centre of mass: r × F has 0.5 (D sin α + L cos α)
    // about y.
    let config = entry::Config {
        planet: Planet::EARTH,
        aerodynamics: aerodynamics.clone(),
        deviations: entry::Deviations::default(),
        air: Air::default(),
        trim: entry::Trim::Anywhere,
        following: entry::Following { active: false, frequency: 1.0 },
        end: entry::End { altitude: 0.0, speed: 0.0 },
    };
    let motion = entry::Motion::new(40e3, 0.0, 0.0, 1500.0, 0.0, 0.0);
    let angles = Vector3::new(15_f64.to_radians(), 0.0, 0.4);
    let passage = config.passage(0.0, &motion, &angles);
    let moment = config.moment(&passage, &Vector3::zeros(), 0.0);
    let about_the_point = aerodynamics.moment(&passage.flow(), &Vector3::zeros(), 0.0);
    let (sine, cosine) = angles.x.sin_cos();
    let arm = 0.5 * 10_000.0 * (passage.drag * sine + passage.lift * cosine);
    assert!((moment - about_the_point - Vector3::new(0.0, arm, 0.0)).amax() < 1e-9 * arm);
}

#[test]
fn oracle_surfaces_with_tables_are_linear_between_their_points() {
    let effectors = Vehicle::from_toml("small.toml", SMALL).unwrap().effectors.unwrap();
    let mut deflections = Surfaces::zeros();
    // Half of the way to 20 deg, halfway over the angle of attack.
    deflections[0] = 10_f64.to_radians();
    let pitch = 0.5 * -0.015 * 1e3 * 20.0 * 4.0;
    let moment = effectors.moment_of_tables(&flow(), &deflections);
    assert!((moment - Vector3::new(0.0, pitch, 0.0)).amax() < 1e-9, "{moment}");
    deflections[0] = 90_f64.to_radians();
    assert!((effectors.moment_of_tables(&flow(), &deflections).y - 2.0 * pitch).abs() < 1e-9);
}

#[test]
fn surfaces_and_jets_that_a_vehicle_lacks_do_nothing() {
    let effectors = Vehicle::from_toml("small.toml", SMALL).unwrap().effectors.unwrap();
    assert_eq!(&effectors.names[1..3], ["rudder", "none"]);
    assert_eq!(&effectors.allowed[..3], [true, true, false]);
    assert_eq!(effectors.max[2], 0.0);
    assert_eq!(effectors.jet_moments.column(2).amax(), 0.0);
    assert_eq!(effectors.jet_moments.column(1)[0], -300.0);
}

#[test]
fn every_vehicle_of_the_program_keeps_to_the_schema_of_its_file() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../orchestrator/schema/vehicle.json");
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(stored == schema(), "{} is out of date: run scripts/update-generated", path.display());
}

#[test]
#[ignore = "scripts/update-generated runs it"]
fn write_the_schema() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../orchestrator/schema/vehicle.json");
    std::fs::write(path, schema()).unwrap();
}

/// The JSON Schema of a vehicle's file.
fn schema() -> String {
    let settings = schemars::generate::SchemaSettings::draft07();
    let schema = settings.into_generator().into_root_schema_for::<Given>();
    serde_json::to_string_pretty(&schema).unwrap() + "\n"
}
