//! Targets for fuzzing: everything that reads foreign text or files, and the C interface of the
//! FMUs. A target returns for any input; a panic, a crash, a hang or memory without bound is a
//! fault.
#![allow(clippy::missing_panics_doc, reason = "a target fails by panicking")]

mod bytes;
mod calls;
mod state;

pub use calls::calls;
pub use state::state;

use campaign::definition::Campaign;
use cosim::experiment::{Experiment, Overrides};
use cosim::ssp;
use fmi_master::description::InterfaceKind;
use fmi_master::quantity;
use fmu_import::description;
use fmu_import::faults::faults;
use fmu_import::fmu::Fmu;
use fmu_import::xml;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use study::definition::Study;
use tempfile::TempDir;
use vehicle::Vehicle;
use vehicle::aerodynamics::Flow;
use vehicle::effectors::Surfaces;
use vehicle::table::LookupTable;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Folder for the files of targets that read files: in memory, where the system has it.
static FOLDER: LazyLock<TempDir> = LazyLock::new(|| {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { memory } else { &std::env::temp_dir() };
    TempDir::with_prefix_in("fuzz-", folder).expect("a temporary folder")
});

/// Writes a file, and returns its path.
fn file(name: &str, data: &[u8]) -> PathBuf {
    let path = FOLDER.path().join(name);
    std::fs::write(&path, data).expect("room for a file");
    path
}

/// Reads a model description, and lists its faults.
pub fn description(data: &[u8]) {
    let Ok(text) = xml::decode(data) else { return };
    let Ok(description) = description::parse(&text) else { return };
    for fault in faults(&description) {
        assert!(!fault.is_empty() && !fault.contains('\n'), "{fault}");
    }
    for (position, variable) in description.variables.iter().enumerate() {
        let (first, same) = description.find(&variable.name).expect("a name that exists");
        assert!(first <= position && same.name == variable.name);
    }
}

/// Unpacks an archive and reads its description.
pub fn archive(data: &[u8]) {
    if let Ok(fmu) = Fmu::open(&file("a.fmu", data)) {
        fmu.platforms();
    }
}

/// Reads an experiment.
pub fn experiment(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    if let Ok(mut experiment) = Experiment::parse(&FOLDER.path().join("e.toml"), text.into()) {
        let _ = experiment.apply(&Overrides::default());
        assert!(!experiment.source.whole().is_empty());
    }
}

/// Reads a study.
pub fn study(data: &[u8]) {
    let _ = Study::load(&file("study.toml", data));
}

/// Reads a campaign.
pub fn campaign(data: &[u8]) {
    let _ = Campaign::load(&file("campaign.toml", data));
}

/// Converts a quantity: the first line is the quantity, the second the unit to convert it to.
pub fn quantity(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let (text, unit) = text.split_once('\n').unwrap_or((text, "rad"));
    if let Ok(value) = quantity::convert(text, Some(unit), &[]) {
        assert!(!value.is_nan(), "{text:?} in {unit:?}");
    }
}

/// Reads an SSP archive that holds this system structure.
pub fn ssp(data: &[u8]) {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let written = archive
        .start_file("SystemStructure.ssd", SimpleFileOptions::default())
        .and_then(|()| Ok(archive.write_all(data)?))
        .and_then(|()| archive.finish());
    let bytes = written.expect("an archive in memory").into_inner();
    let _ = ssp::load(&file("a.ssp", &bytes), &Overrides::default());
}

/// Function that accepts any bytes.
pub type Target = fn(&[u8]);

/// All targets with their names, which are those of the folders of `corpus/`.
pub const TARGETS: [(&str, Target); 11] = [
    ("archive", archive),
    ("calls", calls),
    ("campaign", campaign),
    ("description", description),
    ("experiment", experiment),
    ("quantity", quantity),
    ("ssp", ssp),
    ("state", state),
    ("study", study),
    ("table", table),
    ("vehicle", vehicle),
];

/// Reads the file of a vehicle, whose forces and moments are then computed.
pub fn vehicle(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(vehicle) = Vehicle::from_toml("v.toml", text) else { return };
    assert!(vehicle.fits());
    for (alpha, mach) in [(-1.0, 0.0), (0.0, 1.0), (0.5, 6.0), (3.0, 1e9)] {
        let flow = Flow { dynamic_pressure: 1e3, mach, speed: 1e3, alpha, beta: 0.1 };
        vehicle.aerodynamics.forces(&flow);
        let rates = Surfaces::repeat(0.1).fixed_rows::<3>(0).into_owned();
        vehicle.aerodynamics.moment(&flow, &rates, 0.1);
        if let Some(effectors) = &vehicle.effectors {
            effectors.moment_of_tables(&flow, &Surfaces::repeat(alpha));
        }
    }
}

/// Reads a lookup table of reference values, and one that is a component, whose outputs are finite
/// at any time.
pub fn table(data: &[u8]) {
    let _ = LookupTable::from_csv("t.csv", data);
    let Ok(fmu) = Fmu::open(&file("t.csv", data)) else { return };
    let instance = fmu.instantiate("t", InterfaceKind::CoSimulation);
    let mut instance = instance.expect("a lookup table needs no library");
    let description = &fmu.description;
    let (_, interpolation) = description.find("interpolation").expect("every lookup table has it");
    for mode in [1, 2] {
        instance.reset().expect("nothing is wrong");
        instance.set_integer(&[interpolation.reference], &[mode]).expect("1 is hold, 2 is linear");
        instance.enter_initialization(0.0, 1.0).expect("the rows are in order");
        for time in [-1e9, 0.0, 0.5, 1.0, 7.0, 1e9] {
            instance.do_step(time, 0.0).expect("a step does nothing else");
            for output in description.variables.iter().filter(|v| v.causality == "output") {
                let mut value = [0.0];
                instance.get_real(&[output.reference], &mut value).expect("the variable is there");
                assert!(value[0].is_finite(), "{} at {time} s", output.name);
            }
        }
    }
}
