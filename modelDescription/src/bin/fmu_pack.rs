//! `fmu-pack LIBRARY… --output DIR`: packs every FMU in the libraries into an archive.

use clap::Parser;
use model_description::library_file::LibraryFile;
use model_description::pack::{Extras, pack};
use model_description::{Error, ModelDescription, Version, library};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{fs, io};

/// Packs every FMU in the given libraries into an archive NAME.fmu for FMI 2.0, and with --fmi3
/// into another one for FMI 3.0.
///
/// Each library must be built with fmi-export. The program loads it and asks it for the
/// descriptions of its FMUs. Builds of the libraries for other platforms, given by --also, are only
/// read; they must be built from the same sources and export the same functions. A library may only
/// need libraries that every system of its platform has. The same input gives the same bytes. Exit
/// codes: 0 for success, 1 for an error in a library or file, 2 for an error in the command line.
#[derive(Parser)]
#[command(version, name = "fmu-pack")]
struct Arguments {
    /// Built libraries, for example target/release/libfmu_plant_library.so
    #[arg(required = true)]
    libraries: Vec<PathBuf>,
    /// Build of one of the libraries for another platform; can be repeated
    #[arg(long, value_name = "FILE")]
    also: Vec<PathBuf>,
    /// Packs only the libraries given by --also
    #[arg(long, requires = "also")]
    only_also: bool,
    /// Folder below binaries/ to use for a platform that has several in FMI 2.0
    #[arg(long, value_name = "NAME")]
    folder: Option<String>,
    /// Folder for the archives; it is created if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Folder for archives for FMI 3.0, which have the same names; none are packed without it
    #[arg(long, value_name = "DIR")]
    fmi3: Option<PathBuf>,
    /// Folder into which each modelDescription.xml is also written, as NAME.xml
    #[arg(long, value_name = "DIR")]
    xml_snapshot: Option<PathBuf>,
    /// Folder whose files are added to every archive under resources/
    #[arg(long, value_name = "DIR")]
    resources: Option<PathBuf>,
    /// Folder with an icon NAME.png for each FMU
    #[arg(long, value_name = "DIR")]
    icons: Option<PathBuf>,
    /// Licence text for documentation/licenses/; can be repeated
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
        add(&mut libraries, LibraryFile::read(path)?)?;
    }
    let fmus = || {
        libraries.iter().flat_map(|library| library.fmus.iter().map(|fmu| (fmu, &library.packed)))
    };
    let mut names = HashSet::new();
    if let Some((twice, _)) = fmus().find(|(fmu, _)| !names.insert(&fmu.name)) {
        return Err(Error::SameName(twice.name.clone()));
    }
    let Arguments { resources, licenses, icons, folder, .. } = arguments;
    let extras = Extras {
        resources: resources.clone(),
        licenses: licenses.clone(),
        icons: icons.clone(),
        folder: folder.clone(),
    };
    let output =
        [(Version::Fmi2, Some(&arguments.output)), (Version::Fmi3, arguments.fmi3.as_ref())];
    for (version, folder) in output {
        let Some(folder) = folder else { continue };
        make_folder(folder)?;
        for (fmu, files) in fmus() {
            let archive = pack(fmu, files, folder, &extras, version)?;
            println!("{}", archive.display());
        }
    }
    if let Some(folder) = &arguments.xml_snapshot {
        make_folder(folder)?;
        for (fmu, _) in fmus() {
            let path = folder.join(format!("{}.xml", fmu.name));
            fs::write(&path, fmu.to_xml(Version::Fmi2)?).map_err(at(&path))?;
        }
    }
    Ok(())
}

/// A library that this machine can load, and the files that go into the archives of its FMUs.
struct Library {
    fmus: Vec<ModelDescription>,
    loaded: LibraryFile,
    packed: Vec<LibraryFile>,
}

impl Library {
    fn open(path: &Path, leave_out: bool) -> Result<Self, Error> {
        // Reading comes before loading, so that a file for another platform is reported as such.
        let loaded = LibraryFile::read(path)?;
        let fmus = library::descriptions(path)?;
        let packed = if leave_out { vec![] } else { vec![loaded.clone()] };
        Ok(Self { fmus, loaded, packed })
    }
}

/// Adds a build for another platform to the library that is made of the same sources.
fn add(libraries: &mut [Library], also: LibraryFile) -> Result<(), Error> {
    let fault = |problem: String| Error::Library { path: also.path.clone(), problem };
    if also.sources.is_none() {
        return Err(fault("it has no digest of its sources: see fmi_build::link".into()));
    }
    let Some(library) = libraries.iter_mut().find(|library| library.loaded.sources == also.sources)
    else {
        return Err(fault(
            "it was built from other sources than the libraries: build them again".into(),
        ));
    };
    let unequal: Vec<_> = library.loaded.exports.symmetric_difference(&also.exports).collect();
    if !unequal.is_empty() {
        return Err(fault(format!("its exported functions differ: {unequal:?}")));
    }
    let taken =
        |other: &&LibraryFile| other.folders.iter().any(|folder| also.folders.contains(folder));
    if let Some(other) = library.packed.iter().find(taken) {
        return Err(fault(format!("it is for the same platform as {}", other.path.display())));
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
