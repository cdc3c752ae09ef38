//! `fmu-pack LIBRARY… --output DIR`: makes one `.fmu` of every unit in the libraries.

use clap::Parser;
use model_description::binary::Binary;
use model_description::pack::{Extras, pack};
use model_description::{Error, ModelDescription, library};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{fs, io};

/// Makes one NAME.fmu of every FMI 2.0 unit in the given libraries.
///
/// Each library, built with fmi2-export, is opened and asked for the descriptions of its units. Its
/// builds for other platforms, given by --also, are only read: they must be made of the same
/// sources and export the same functions. No library may need others than every system of its
/// platform has. The same input gives the same bytes. Exit code 0: done; 1: a library or file is at
/// fault; 2: the command line is.
#[derive(Parser)]
#[command(version, name = "fmu-pack")]
struct Arguments {
    /// Built libraries, for example target/release/libfmu_plant.so
    #[arg(required = true)]
    libraries: Vec<PathBuf>,
    /// Build of one of the libraries for another platform; may be given several times
    #[arg(long, value_name = "FILE")]
    also: Vec<PathBuf>,
    /// Leaves the libraries themselves out of the archives, which then hold those of --also alone
    #[arg(long, requires = "also")]
    only_also: bool,
    /// Puts libraries into this folder below binaries/ alone, where a platform has several
    #[arg(long, value_name = "NAME")]
    folder: Option<String>,
    /// Folder for the archives; made if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Folder that also receives each modelDescription.xml as NAME.xml
    #[arg(long, value_name = "DIR")]
    xml_snapshot: Option<PathBuf>,
    /// Folder whose files go under resources/ in every archive
    #[arg(long, value_name = "DIR")]
    resources: Option<PathBuf>,
    /// Folder with an icon NAME.png of each unit
    #[arg(long, value_name = "DIR")]
    icons: Option<PathBuf>,
    /// Licence text for documentation/licenses/; may be given several times
    #[arg(long = "license", value_name = "FILE")]
    licenses: Vec<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("fmu-pack: {error}");
            ExitCode::from(1)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Error> {
    let mut libraries = vec![];
    for path in &arguments.libraries {
        libraries.push(Library::open(path, arguments.only_also)?);
    }
    for path in &arguments.also {
        add(&mut libraries, Binary::read(path)?)?;
    }
    let units = || libraries.iter().flat_map(|of| of.units.iter().map(|unit| (unit, &of.packed)));
    let mut names = HashSet::new();
    if let Some((twice, _)) = units().find(|(unit, _)| !names.insert(&unit.name)) {
        return Err(Error::SameName(twice.name.clone()));
    }
    let Arguments { resources, licenses, icons, folder, .. } = arguments;
    let extras = Extras {
        resources: resources.clone(),
        licenses: licenses.clone(),
        icons: icons.clone(),
        folder: folder.clone(),
    };
    make_folder(&arguments.output)?;
    for (unit, binaries) in units() {
        let archive = pack(unit, binaries, &arguments.output, &extras)?;
        println!("{}", archive.display());
    }
    if let Some(folder) = &arguments.xml_snapshot {
        make_folder(folder)?;
        for (unit, _) in units() {
            let path = folder.join(format!("{}.xml", unit.name));
            fs::write(&path, unit.to_xml()?).map_err(at(&path))?;
        }
    }
    Ok(())
}

/// A library that this machine can open, and what goes into the archives of its units.
struct Library {
    units: Vec<ModelDescription>,
    own: Binary,
    packed: Vec<Binary>,
}

impl Library {
    fn open(path: &Path, leave_out: bool) -> Result<Self, Error> {
        // Reading comes first: a file for another platform is told as such.
        let own = Binary::read(path)?;
        let units = library::descriptions(path)?;
        let packed = if leave_out { vec![] } else { vec![own.clone()] };
        Ok(Self { units, own, packed })
    }
}

/// Adds a build for another platform to the library that is made of the same sources.
fn add(libraries: &mut [Library], also: Binary) -> Result<(), Error> {
    let fault = |problem: String| Error::Binary { path: also.path.clone(), problem };
    if also.sources.is_none() {
        return Err(fault("has no digest of its sources: see fmi2_build::link".into()));
    }
    let Some(library) = libraries.iter_mut().find(|library| library.own.sources == also.sources)
    else {
        return Err(fault("is made of other sources than the libraries: build them again".into()));
    };
    let unequal: Vec<_> = library.own.exports.symmetric_difference(&also.exports).collect();
    if !unequal.is_empty() {
        return Err(fault(format!("differs in its exported functions: {unequal:?}")));
    }
    let taken = |other: &&Binary| other.folders.iter().any(|folder| also.folders.contains(folder));
    if let Some(other) = library.packed.iter().find(taken) {
        return Err(fault(format!("is for the same platform as {}", other.path.display())));
    }
    library.packed.push(also);
    Ok(())
}

fn make_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(at(path))
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> Error {
    move |source| Error::File { path: path.to_owned(), source }
}
