//! Generated SSP systems, whose values are those of the standard's arithmetic: SSP 2.0, sections 4
//! (units, transformations) and 5 (connections).

use crate::bench::Random;
use crate::prelude::*;
use std::fmt::Write as _;

/// Units of two quantities: name, base unit, factor, offset.
const UNITS: [[(&str, &str, f64, f64); 3]; 2] = [
    [
        ("K", "K", 1.0, 0.0),
        ("degC", "K", 1.0, 273.15),
        ("degF", "K", 5.0 / 9.0, 273.15 - 160.0 / 9.0),
    ],
    [("m", "m", 1.0, 0.0), ("mm", "m", 1e-3, 0.0), ("km", "m", 1e3, 0.0)],
];
/// Number of systems in an archive, and of archives.
const SYSTEMS: usize = 50;
const ARCHIVES: usize = 10;

/// A unit by its place among those of its quantity.
type Unit = Option<usize>;

/// A connection or a mapping: whether it suppresses the conversion of units, factor, offset.
#[derive(Clone, Copy)]
struct Passage(bool, f64, f64);

/// Definitions of all units, with this prefix of the elements.
fn definitions(prefix: &str) -> String {
    let units = UNITS.iter().flatten().map(|(name, base, factor, offset)| {
        format!("<{prefix}Unit name=\"{name}\"><{prefix}BaseUnit {base}=\"1\" factor=\"{factor:?}\" offset=\"{offset:?}\"/></{prefix}Unit>")
    });
    units.collect()
}

fn attribute(quantity: usize, unit: Unit) -> String {
    unit.map(|unit| format!(" unit=\"{}\"", UNITS[quantity][unit].0)).unwrap_or_default()
}

/// Returns the description of the FMU whose variables have a unit.
fn description(quantity: usize, unit: Unit) -> String {
    let unit = attribute(quantity, unit);
    let units = definitions("");
    let variable = |name: &str, reference: u8, kind: &str, start: &str| {
        format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {kind}><Real{unit}{start}/></ScalarVariable>"
        )
    };
    let start = " start=\"0\"";
    let variables = [
        variable("u", 0, "causality=\"input\" variability=\"continuous\"", start),
        variable("p", 1, "causality=\"parameter\" variability=\"fixed\"", start),
        variable("y", 2, "causality=\"output\" variability=\"continuous\"", ""),
    ]
    .concat();
    format!(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"Adder\" guid=\"g\"><CoSimulation modelIdentifier=\"model\" canHandleVariableCommunicationStepSize=\"true\"/><UnitDefinitions>{units}</UnitDefinitions><DefaultExperiment stepSize=\"1\"/><ModelVariables>{variables}</ModelVariables><ModelStructure><Outputs><Unknown index=\"3\" dependencies=\"1 2\"/></Outputs></ModelStructure></fmiModelDescription>"
    )
}

/// Name of the FMU whose variables have a unit.
fn fmu(quantity: usize, unit: Unit) -> String {
    format!("{quantity}{}", unit.map_or("none", |unit| UNITS[quantity][unit].0))
}

/// Converts a value where both units are known.
fn converted(quantity: usize, value: f64, from: Unit, to: Unit) -> f64 {
    let (Some(from), Some(to)) = (from, to) else { return value };
    let ((_, _, a, b), (_, _, c, d)) = (UNITS[quantity][from], UNITS[quantity][to]);
    (a * value + b - d) / c
}

impl Passage {
    fn new(random: &mut Random) -> Self {
        let is_linear = random.below(2) == 0;
        let factor = if is_linear { random.power(-1.0, 1.0) } else { 1.0 };
        let offset = if is_linear { random.between(-9.0, 9.0) } else { 0.0 };
        Self(random.below(4) == 0, factor, offset)
    }

    /// Returns the value and its unit where the passage ends.
    fn apply(self, quantity: usize, (value, unit): (f64, Unit), to: Unit) -> (f64, Unit) {
        let from = if self.0 { None } else { unit };
        (self.1 * converted(quantity, value, from, to) + self.2, to.or(unit))
    }

    fn attribute(self) -> &'static str {
        if self.0 { " suppressUnitConversion=\"true\"" } else { "" }
    }

    fn element(self) -> String {
        if (self.1, self.2) == (1.0, 0.0) {
            return String::new();
        }
        format!("<c:LinearTransformation factor=\"{:?}\" offset=\"{:?}\"/>", self.1, self.2)
    }
}

/// What an archive holds so far, and the values that its variables must have.
#[derive(Default)]
struct Archive {
    elements: String,
    connections: String,
    expected: Vec<(String, f64)>,
}

impl Archive {
    /// Adds a chain of two to four adders, each of which may be in a system of its own.
    fn add_chain(&mut self, random: &mut Random, number: usize) {
        let quantity = random.below(2);
        let unit = |random: &mut Random| (random.below(3) > 0).then(|| random.below(3));
        let mut before: Option<(String, f64, Unit)> = None;
        for place in 0..2 + random.below(3) {
            let name = format!("c{number}_{place}");
            let own = unit(random);
            let [u, y] = [0; 2].map(|_| unit(random));
            let (of_u, of_y) = (u.or(own), y.or(own));
            // The parameter, which may be mapped.
            let (given, value) = (unit(random), random.between(-5.0, 5.0));
            let mapping = (random.below(2) == 0).then(|| Passage::new(random));
            let (p, _) =
                mapping.unwrap_or(Passage(false, 1.0, 0.0)).apply(quantity, (value, given), own);
            let mapped = mapping.map_or(String::new(), |mapping| {
                format!("<ParameterMapping><m:ParameterMapping><m:MappingEntry source=\"p\" target=\"p\"{}>{}</m:MappingEntry></m:ParameterMapping></ParameterMapping>", mapping.attribute(), mapping.element())
            });
            let bound = format!(
                "<ParameterBindings><ParameterBinding><ParameterValues><v:ParameterSet><v:Parameters><v:Parameter name=\"p\"><v:Real value=\"{value:?}\"{}/></v:Parameter></v:Parameters></v:ParameterSet></ParameterValues>{mapped}</ParameterBinding></ParameterBindings>",
                attribute(quantity, given)
            );
            let connectors = |u: Unit, y: Unit| {
                let [u, y] = [("u", "input", u), ("y", "output", y)].map(|(name, kind, unit)| {
                    format!(
                        "<Connector name=\"{name}\" kind=\"{kind}\"><c:Real{}/></Connector>",
                        attribute(quantity, unit)
                    )
                });
                format!("<Connectors>{u}{y}</Connectors>")
            };
            let component = |name: &str| {
                format!(
                    "<Component name=\"{name}\" source=\"{}.fmu\">{}{bound}</Component>",
                    fmu(quantity, own),
                    connectors(u, y)
                )
            };
            let [inward, outward] = [0; 2].map(|_| Passage::new(random));
            let is_nested = random.below(2) == 0;
            let (around_u, around_y) = (unit(random), unit(random));
            let full = if is_nested {
                let _ = write!(
                    self.elements,
                    "<System name=\"{name}\">{}<Elements>{}</Elements><Connections><Connection startConnector=\"u\" endElement=\"a\" endConnector=\"u\"{}>{}</Connection><Connection startElement=\"a\" startConnector=\"y\" endConnector=\"y\"{}>{}</Connection></Connections></System>",
                    connectors(around_u, around_y),
                    component("a"),
                    inward.attribute(),
                    inward.element(),
                    outward.attribute(),
                    outward.element()
                );
                format!("{name}/a")
            } else {
                self.elements += &component(&name);
                name.clone()
            };
            // The value that comes in, by the units of the connectors on its way.
            let mut input = 0.0;
            if let Some((start, value, unit)) = before {
                let passage = Passage::new(random);
                let _ = write!(
                    self.connections,
                    "<Connection startElement=\"{start}\" startConnector=\"y\" endElement=\"{name}\" endConnector=\"u\"{}>{}</Connection>",
                    passage.attribute(),
                    passage.element()
                );
                let mut come = (value, unit);
                if is_nested {
                    come = passage.apply(quantity, come, around_u.or(of_u));
                    come = inward.apply(quantity, come, of_u);
                } else {
                    come = passage.apply(quantity, come, of_u);
                }
                input = converted(quantity, come.0, come.1, own);
            }
            let output = input + p;
            self.expected.extend([(format!("{full}.u"), input), (format!("{full}.y"), output)]);
            let mut leaves = (converted(quantity, output, own, of_y), of_y);
            if is_nested {
                leaves = outward.apply(quantity, leaves, around_y.or(of_y));
            }
            before = Some((name, leaves.0, leaves.1));
        }
    }

    fn structure(&self) -> String {
        let units = definitions("c:");
        let Self { elements, connections, .. } = self;
        format!(
            "<SystemStructureDescription xmlns=\"d\" xmlns:c=\"c\" xmlns:v=\"v\" xmlns:m=\"m\" name=\"generated\" version=\"2.0\"><System name=\"s\"><Elements>{elements}</Elements><Connections>{connections}</Connections></System><Units>{units}</Units><DefaultExperiment startTime=\"0\" stopTime=\"1\"/></SystemStructureDescription>"
        )
    }
}

/// Writes an archive, runs it, and returns the names and the values of the last row.
fn last_row(bench: &Bench, structure: &str, fmus: &[(String, Vec<u8>)]) -> (Vec<String>, Vec<f64>) {
    let mut zip = zip::ZipWriter::new(fs::File::create(bench.path("x.ssp")).unwrap());
    let entries = fmus.iter().map(|(name, bytes)| (name.as_str(), bytes.as_slice()));
    for (name, bytes) in entries.chain([("SystemStructure.ssd", structure.as_bytes())]) {
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
    bench.says(&["run", "x.ssp", "--force", "--quiet", "--step", "1"]);
    let text = bench.text("out/x/results.csv");
    let mut lines = text.lines().map(|line| line.split(','));
    let names = lines.next().unwrap().map(String::from).collect();
    let last = lines.next_back().unwrap();
    (names, last.map(|cell| cell.parse().unwrap()).collect())
}

#[test]
fn connections_may_be_restricted_to_elements_of_arrays() {
    let bench = Bench::made("", &Recipe { files: FMI3, ..Recipe::default() });
    let fmu = fs::read(bench.path("Model.fmu")).unwrap();
    let [a, b, c] =
        ["a", "b", "c"].map(|name| format!("<Component name=\"{name}\" source=\"Model.fmu\"/>"));
    let crossed = [(1, 2), (2, 1)].map(|(from, to)| {
        format!("<Connection startElement=\"a\" startConnector=\"y\" startIndices=\"{from}\" endElement=\"b\" endConnector=\"u\" endIndices=\"{to}\"/>")
    });
    let archive = Archive {
        elements: format!(
            "{a}{b}<System name=\"s\"><Connectors><Connector name=\"x\" kind=\"input\"><c:Float64 unit=\"mm\"/><Dimension size=\"2\"/></Connector></Connectors><Elements>{c}</Elements><Connections><Connection startConnector=\"x\" endElement=\"c\" endConnector=\"u\"/></Connections></System>"
        ),
        connections: crossed.concat()
            + "<Connection startElement=\"b\" startConnector=\"y\" endElement=\"s\" endConnector=\"x\"><c:LinearTransformation offset=\"1\"/></Connection>",
        ..Archive::default()
    };
    let (names, last) = last_row(&bench, &archive.structure(), &[("Model.fmu".into(), fmu)]);
    let value = |name: &str| last[names.iter().position(|found| found == name).unwrap()];
    assert_eq!([value("b.u[1]"), value("b.u[2]")], [value("a.y[2]"), value("a.y[1]")]);
    assert_ne!(value("b.u[1]"), value("b.u[2]"));
    // A millimetre is added at the of the system's connector.
    for element in ["[1]", "[2]"] {
        let expected = value(&format!("b.y{element}")) + 1e-3;
        assert!((value(&format!("s/c.u{element}")) - expected).abs() < 1e-12);
    }
}

#[test]
fn oracle_generated_systems_have_the_values_of_the_standard() {
    let mut random = Random(2);
    let mut fmus = Vec::new();
    for quantity in 0..2 {
        for unit in [None, Some(0), Some(1), Some(2)] {
            let recipe = Recipe {
                files: ["adder.c", "exchange.xml", "linux64"],
                description: &|_| description(quantity, unit),
                ..Recipe::default()
            };
            let bytes = fs::read(Bench::made("", &recipe).path("Model.fmu")).unwrap();
            fmus.push((format!("{}.fmu", fmu(quantity, unit)), bytes));
        }
    }
    let bench = Bench::new();
    let mut faults = Vec::new();
    for _ in 0..ARCHIVES {
        let mut archive = Archive::default();
        for number in 0..SYSTEMS {
            archive.add_chain(&mut random, number);
        }
        let (names, last) = last_row(&bench, &archive.structure(), &fmus);
        for (name, expected) in &archive.expected {
            let place = names.iter().position(|found| found == name).unwrap();
            let allowed = 1e-10 * (1.0 + expected.abs());
            if (last[place] - expected).abs() > allowed {
                faults.push(format!("{name}: {} for {expected}", last[place]));
            }
        }
    }
    let count = faults.len();
    assert!(faults.is_empty(), "{count} values: {}", faults[..count.min(9)].join(", "));
}
