//! Packing of an FMU's archive. The same input gives the same bytes, because entries are
//! sorted and times and permissions are fixed.

use crate::library_file::{LibraryFile, slices};
use crate::{Error, LICENSE, ModelDescription, Version};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

/// Contents of the archives besides the model, and where the libraries go.
#[derive(Clone, Debug, Default)]
pub struct Extras {
    /// Folder whose files go under `resources/`.
    pub resources: Option<PathBuf>,
    /// Paths of licence texts for `documentation/licenses/`.
    pub licenses: Vec<PathBuf>,
    /// Folder of icons, with `NAME.png` for the FMU of that name, and maybe `NAME.svg`.
    pub icons: Option<PathBuf>,
    /// Only folder below `binaries/` that receives libraries; all folders of a platform if it is
    /// `None`.
    pub folder: Option<String>,
}

/// Text that keeps the folder in the archive, because some importers pass no resource location for
/// an FMU without it.
const RESOURCES_README: &str =
    "This folder holds files that an FMU reads during initialization. This FMU needs none.\n";

/// Writes the archive `NAME.fmu` of one FMU for a version of FMI into the folder `output` and
/// returns its path. `libraries` are the builds of the FMU's library, one for each platform.
///
/// # Errors
/// Reports a description that contradicts itself, or a file that cannot be read or written.
pub fn pack(
    description: &ModelDescription,
    libraries: &[LibraryFile],
    output: &Path,
    extras: &Extras,
    version: Version,
) -> Result<PathBuf, Error> {
    let name = &description.name;
    let mut entries = vec![
        ("modelDescription.xml".to_string(), description.to_xml(version)?.into_bytes()),
        ("documentation/index.html".to_string(), description.to_html(version).into_bytes()),
    ];
    for LibraryFile { path, folders, tuples, suffix, .. } in libraries {
        let content = read(path)?;
        let entry = |folder| (format!("binaries/{folder}/{name}.{suffix}"), content.clone());
        let chosen = |folder: &&&str| extras.folder.as_ref().is_none_or(|only| only == **folder);
        if version == Version::Fmi2 {
            entries.extend(folders.iter().filter(chosen).map(entry));
            continue;
        }
        let parts = slices(&content)
            .map_err(|error| Error::Library { path: path.clone(), problem: error.to_string() })?;
        let entry = |(tuple, part): (&&str, &[u8])| {
            (format!("binaries/{tuple}/{name}.{suffix}"), part.to_vec())
        };
        entries.extend(tuples.iter().zip(parts).map(entry));
    }
    add_icons(&mut entries, description, extras, version)?;
    add_licenses(&mut entries, &extras.licenses)?;
    let before = entries.len();
    if let Some(resources) = &extras.resources {
        add_folder(&mut entries, "resources", resources)?;
    }
    if entries.len() == before {
        entries.push(("resources/README.txt".into(), RESOURCES_README.into()));
    }
    // The description comes first, as readers of streams expect; the rest is sorted by name.
    entries[1..].sort();

    let path = output.join(format!("{name}.fmu"));
    // The archive gets another name first, so that nobody ever opens half an archive.
    let partial = output.join(format!("{name}.fmu.part"));
    let file =
        File::create(&partial).map_err(|source| Error::File { path: partial.clone(), source })?;
    write_archive(BufWriter::new(file), &entries)
        .map_err(|source| Error::Archive { path: path.clone(), source })?;
    fs::rename(&partial, &path).map_err(|source| Error::File { path: path.clone(), source })?;
    Ok(path)
}

fn write_archive(
    file: BufWriter<File>,
    entries: &[(String, Vec<u8>)],
) -> zip::result::ZipResult<()> {
    // Above 9, zopfli compresses: some seconds an archive, for what is shipped.
    let level = if std::env::var_os("FMU_PACK_SMALL").is_some() { 10 } else { 9 };
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(level))
        .last_modified_time(DateTime::default());
    let mut archive = ZipWriter::new(file);
    for (name, content) in entries {
        let mode = if name.starts_with("binaries/") { 0o755 } else { 0o644 };
        archive.start_file(name.as_str(), options.unix_permissions(mode))?;
        archive.write_all(content)?;
    }
    archive.finish()?.flush()?;
    Ok(())
}

/// Adds the icon where this version of FMI has it, and the terminals of FMI 3.0.
fn add_icons(
    entries: &mut Vec<(String, Vec<u8>)>,
    description: &ModelDescription,
    extras: &Extras,
    version: Version,
) -> Result<(), Error> {
    let icon = |icons: &PathBuf, suffix| icons.join(format!("{}.{suffix}", description.name));
    if version == Version::Fmi2 {
        if let Some(icons) = &extras.icons {
            entries.push(("model.png".into(), read(&icon(icons, "png"))?));
        }
        return Ok(());
    }
    let folder = "terminalsAndIcons";
    let terminals = description.terminals_to_xml().into_bytes();
    entries.push((format!("{folder}/terminalsAndIcons.xml"), terminals));
    if let Some(icons) = &extras.icons {
        entries.push((format!("{folder}/icon.png"), read(&icon(icons, "png"))?));
        let drawing = icon(icons, "svg");
        if drawing.is_file() {
            entries.push((format!("{folder}/icon.svg"), read(&drawing)?));
        }
    }
    Ok(())
}

/// Adds the licence texts. FMI demands one entry point `license.txt`; several texts stand beside
/// it.
fn add_licenses(entries: &mut Vec<(String, Vec<u8>)>, licenses: &[PathBuf]) -> Result<(), Error> {
    let folder = "documentation/licenses";
    if let [only] = licenses {
        entries.push((format!("{folder}/license.txt"), read(only)?));
        return Ok(());
    }
    let mut entry_point = format!("SPDX-License-Identifier: {LICENSE}\n");
    for path in licenses {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        entry_point.extend(["See ", &name, ".\n"]);
        entries.push((format!("{folder}/{name}"), read(path)?));
    }
    if !licenses.is_empty() {
        entries.push((format!("{folder}/license.txt"), entry_point.into_bytes()));
    }
    Ok(())
}

fn add_folder(
    entries: &mut Vec<(String, Vec<u8>)>,
    prefix: &str,
    folder: &Path,
) -> Result<(), Error> {
    let failed = |source| Error::File { path: folder.to_owned(), source };
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = format!("{prefix}/{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            add_folder(entries, &name, &path)?;
        } else {
            entries.push((name, read(&path)?));
        }
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    fs::read(path).map_err(|source| Error::File { path: path.to_owned(), source })
}
