//! `fmu-pack LIBRARY… --output DIR`: makes one `.fmu` of every unit in the libraries.

use clap::Parser;
use model_description::pack::{Extras, pack};
use model_description::{Error, ModelDescription, library};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{fs, io};

/// Makes one NAME.fmu of every FMI 2.0 unit in the given libraries.
///
/// Each library, built with fmi2-export, is opened and asked for the descriptions of its units. The
/// same input gives the same bytes. Exit code 0: done; 1: a library or file is at fault; 2: the
/// command line is.
#[derive(Parser)]
#[command(version, name = "fmu-pack")]
struct Arguments {
    /// Built libraries, for example target/release/libfmu_plant.so
    #[arg(required = true)]
    libraries: Vec<PathBuf>,
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
    let mut units: Vec<(&Path, ModelDescription)> = vec![];
    for path in &arguments.libraries {
        units.extend(library::descriptions(path)?.into_iter().map(|unit| (path.as_path(), unit)));
    }
    let mut names = HashSet::new();
    if let Some((_, twice)) = units.iter().find(|(_, unit)| !names.insert(&unit.name)) {
        return Err(Error::SameName(twice.name.clone()));
    }
    let Arguments { resources, licenses, icons, .. } = arguments;
    let extras =
        Extras { resources: resources.clone(), licenses: licenses.clone(), icons: icons.clone() };
    make_folder(&arguments.output)?;
    for (library, unit) in &units {
        let archive = pack(unit, library, &arguments.output, &extras)?;
        println!("{}", archive.display());
    }
    if let Some(folder) = &arguments.xml_snapshot {
        make_folder(folder)?;
        for (_, unit) in &units {
            let path = folder.join(format!("{}.xml", unit.name));
            fs::write(&path, unit.to_xml()?).map_err(at(&path))?;
        }
    }
    Ok(())
}

fn make_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(at(path))
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> Error {
    move |source| Error::File { path: path.to_owned(), source }
}
