//! Opens `.fmu` archives, checks their libraries, and instantiates them for co-simulation or model
//! exchange. Lookup tables are opened like archives.

use crate::archive;
use crate::crash;
use crate::error::Error;
use crate::exchange;
use crate::faults;
use crate::fmi3::Layout;
use crate::folder::TemporaryFolder;
use crate::law::{LawInstance, Ports};
use crate::loading::{self, Kind, Made, Refusal};
use crate::log::Log;
use crate::lookup_table::{self, LookupTable, LookupTableInstance};
use fmi_master::description::{InterfaceKind, ModelDescription};
use fmi_master::instance::Instance;
use fmi_rs::SHARED_LIBRARY_EXTENSION;
use fmi_rs::fmi2::PLATFORM;
use fmi_rs::fmi3::native::PLATFORM_TUPLE;
use object::{Architecture, BinaryFormat, FileKind, Object, ObjectSegment};
use std::cell::{Cell, OnceCell};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use url::Url;

/// An unpacked archive or a lookup table, of which several instances can be made.
pub struct Fmu {
    /// Path of the archive or lookup table.
    pub path: PathBuf,
    /// The model description in the archive, or that of the lookup table.
    pub description: ModelDescription,
    content: Content,
}

enum Content {
    Archive(Archive),
    LookupTable(LookupTable),
    /// A law in another program, for which a controller stands in.
    Law(Rc<Fmu>, Ports),
}

/// An unpacked archive.
struct Archive {
    folder: Rc<TemporaryFolder>,
    /// Whether the library for this platform has been checked.
    is_sound: Cell<bool>,
    /// Layouts of FMI 3.0 for co-simulation and for model exchange, once an instance was made.
    layouts: [OnceCell<Rc<Layout>>; 2],
}

impl Fmu {
    /// Unpacks an archive and reads its description, or reads a lookup table if the file is a
    /// `.csv`.
    ///
    /// # Errors
    /// Returns an error if the archive is unsafe or damaged, or is no FMU of FMI 2.0 or 3, or if
    /// the lookup table has a fault.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let refuse = |message: String| Error::Fmu { path: path.to_path_buf(), message };
        if lookup_table::is_lookup_table(path) {
            let table = LookupTable::open(path).map_err(refuse)?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let description = table.description(&name).map_err(refuse)?;
            let content = Content::LookupTable(table);
            return Ok(Self { path: path.to_path_buf(), description, content });
        }
        let folder = archive::unpack(path)?;
        let description = loading::read_description(folder.path()).map_err(refuse)?;
        let archive = Archive {
            folder: Rc::new(folder),
            is_sound: Cell::new(false),
            layouts: <_>::default(),
        };
        Ok(Self { path: path.to_path_buf(), description, content: Content::Archive(archive) })
    }

    /// Replaces the law of this controller by that of another program.
    ///
    /// # Errors
    /// Returns an error if the FMU lacks a variable that a law needs.
    pub fn flown_by_law(self: &Rc<Self>) -> Result<Self, Error> {
        let path = self.path.clone();
        let description = self.description.clone();
        let ports = Ports::find(&description)
            .map_err(|message| Error::Fmu { path: path.clone(), message })?;
        Ok(Self { path, description, content: Content::Law(Rc::clone(self), ports) })
    }

    /// Returns the platforms for which the archive has libraries, by FMI's names.
    pub fn platforms(&self) -> Vec<String> {
        match &self.content {
            Content::Archive(archive) => archive.platforms(),
            Content::LookupTable(_) => Vec::new(),
            Content::Law(stand_in, _) => stand_in.platforms(),
        }
    }

    /// Lists the faults of the archive that do not keep it from being opened: one line for each
    /// fault of the description and of the library for this platform, which is loaded.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = faults::faults(&self.description);
        let kinds = [InterfaceKind::CoSimulation, InterfaceKind::ModelExchange { tolerance: 1e-6 }];
        let Content::Archive(archive) = &self.content else { return faults };
        for kind in kinds.into_iter().filter(|kind| self.description.interface(*kind).is_some()) {
            let tried = self.try_instance(archive, kind);
            let (Ok(Some(fault)) | Err(fault)) = tried else { continue };
            // What keeps both interfaces from working is told once.
            if !faults.contains(&fault) {
                faults.push(fault);
            }
        }
        faults
    }

    /// Returns whether the file is a lookup table, which runs no code of its own.
    pub fn is_lookup_table(&self) -> bool {
        self.description.is_lookup_table
    }

    /// Returns the folder of the unpacked archive; a lookup table has none.
    pub fn folder(&self) -> Option<&Path> {
        match &self.content {
            Content::Archive(archive) => Some(archive.folder.path()),
            Content::LookupTable(_) => None,
            Content::Law(stand_in, _) => stand_in.folder(),
        }
    }

    /// Returns whether this project's fmu-pack made the FMU, as it says.
    pub fn is_made_by_fmu_pack(&self) -> bool {
        self.description.generation_tool.starts_with("fmu-pack ")
    }

    /// Returns whether the last step may have a length of its own, so that it ends exactly at the
    /// stop time. Lookup tables and the FMUs of this project tolerate the rounding of whole steps,
    /// and their results are those of whole steps, in every importer.
    pub fn fits_last_step(&self, kind: InterfaceKind) -> bool {
        let interface = self.description.interface(kind);
        (kind != InterfaceKind::CoSimulation
            || interface.is_some_and(|i| i.has("canHandleVariableCommunicationStepSize")))
            && !self.is_lookup_table()
            && !self.is_made_by_fmu_pack()
    }

    /// Finds the shared library of the FMU, and its name in the archive.
    ///
    /// # Errors
    /// Returns a line that says what is missing or wrong.
    fn library(&self, archive: &Archive, kind: InterfaceKind) -> Result<(PathBuf, String), String> {
        let description = &self.description;
        let interface = description.interface(kind).ok_or_else(|| {
            let only = [
                (&description.co_simulation, ", only co-simulation"),
                (&description.model_exchange, ", only model exchange"),
                (&description.scheduled_execution, ", only scheduled execution"),
            ];
            let only = only.iter().find(|(interface, _)| interface.is_some());
            let only = only.map_or("", |(_, only)| only);
            format!("offers no {0}{only}: export the model for {0}", kind.name())
        })?;
        let platforms = archive.platforms();
        let platform = if self.description.is_fmi3() { PLATFORM_TUPLE } else { PLATFORM };
        if !platforms.iter().any(|offered| offered == platform) {
            let offered = if platforms.is_empty() { "none".into() } else { platforms.join(", ") };
            return Err(format!("has no library for {platform}, only for: {offered}"));
        }
        let identifier = &interface.model_identifier;
        // The identifier becomes part of a path. FMI 2.0, section 2.2.7, requires a C identifier,
        // but other importers accept a hyphen in it.
        if identifier.is_empty() || identifier.contains(['/', '\\', '.', ':', '\0']) {
            return Err(format!(
                "the model identifier \"{}\" is refused: it must be the name of a file without folder and ending",
                identifier.escape_default()
            ));
        }
        let folder = archive.folder.path().join("binaries").join(platform);
        let name = format!("{identifier}{SHARED_LIBRARY_EXTENSION}");
        let (file, entry) = (folder.join(&name), format!("binaries/{platform}/{name}"));
        if !file.is_file() {
            let files = names_in(&folder);
            let files = if files.is_empty() { "nothing".into() } else { files.join(", ") };
            return Err(format!(
                "has no {entry}, which its model identifier names; the folder holds: {files}"
            ));
        }
        if !archive.is_sound.get() {
            check_library(&file).map_err(|reason| format!("{entry} {reason}"))?;
            archive.is_sound.set(true);
        }
        Ok((file, entry))
    }

    /// Loads the library and makes an instance called `name` of this kind.
    ///
    /// # Errors
    /// Returns an error if the FMU has no library for this platform or does not offer the
    /// interface, if the library cannot be loaded, or if the FMU refuses.
    pub fn instantiate(&self, name: &str, kind: InterfaceKind) -> Result<Box<dyn Instance>, Error> {
        let archive = match &self.content {
            Content::Archive(archive) => archive,
            Content::LookupTable(table) => {
                return Ok(Box::new(LookupTableInstance::new(name, table.clone())));
            }
            Content::Law(stand_in, ports) => {
                let stand_in = stand_in.instantiate(name, kind)?;
                return Ok(Box::new(LawInstance::new(stand_in, ports.clone())));
            }
        };
        let of_component = format!("the component \"{name}\"");
        let (instance, fault) = self
            .made(archive, (name, &of_component), kind)
            .map_err(|message| Error::Fmu { path: self.path.clone(), message })?;
        if let Some(fault) = fault {
            tracing::warn!("{}: {fault}", self.path.display());
        }
        Ok(instance)
    }

    /// Makes an instance and frees it. Returns what is wrong with the version of FMI that the
    /// library names.
    fn try_instance(
        &self,
        archive: &Archive,
        kind: InterfaceKind,
    ) -> Result<Option<String>, String> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let (instance, fault) = self.made(archive, (&name, "its instance"), kind)?;
        drop(instance);
        Ok(fault)
    }

    /// Makes an instance, which a refusal calls `title`. Returns it with what is wrong with the
    /// version of FMI that the library names.
    fn made(
        &self,
        archive: &Archive,
        (name, title): (&str, &str),
        kind: InterfaceKind,
    ) -> Result<Made, String> {
        let (file, entry) = self.library(archive, kind)?;
        let kind = archive.kind(&self.description, kind)?;
        let resources = archive.folder.path().join("resources");
        let resources: String = if kind.fmi3.is_some() {
            // A path that ends in a separator.
            resources.join("").display().to_string()
        } else {
            Url::from_directory_path(resources)
                .map_err(|()| "the temporary folder has no absolute path")?
                .into()
        };
        let guid = &self.description.guid;
        let named = (&**guid, &*resources);
        crash::is_loaded(&self.path);
        let (log, folder) = (Rc::new(Log::new(name)), Some(Rc::clone(&archive.folder)));
        let made = loading::loaded(&file, kind, log, named, folder);
        made.map_err(|refusal| match refusal {
            Refusal::Unloadable(reason) => archive.not_loaded(&entry, &reason),
            Refusal::Refused(reason) => format!("{title} {reason}"),
        })
    }
}

impl Archive {
    /// Returns what an instance of this kind needs.
    fn kind(&self, description: &ModelDescription, kind: InterfaceKind) -> Result<Kind, String> {
        let exchange = match kind {
            InterfaceKind::CoSimulation => None,
            InterfaceKind::ModelExchange { tolerance } => {
                Some(exchange::Layout::new(description, tolerance)?)
            }
        };
        let layout = &self.layouts[usize::from(exchange.is_some())];
        if description.is_fmi3() && layout.get().is_none() {
            let made = Layout::new(description, exchange.is_some())?;
            layout.get_or_init(|| Rc::new(made));
        }
        Ok(Kind { fmi3: layout.get().cloned(), exchange })
    }

    fn platforms(&self) -> Vec<String> {
        let binaries = self.folder.path().join("binaries");
        names_in(&binaries).into_iter().filter(|name| binaries.join(name).is_dir()).collect()
    }

    /// Returns the reason why the system could not load a library.
    fn not_loaded(&self, entry: &str, reason: &str) -> String {
        let text = reason.trim_start_matches("dlopen failed: ");
        if let Some((missing, _)) = text.split_once(": cannot open shared object file") {
            return format!("{entry} needs {missing}, which is not on this system");
        }
        if runs_nothing(self.folder.path()) {
            return format!(
                "{entry} cannot be loaded from {}, whose files may not be run (noexec): set TMPDIR to another folder",
                self.folder.path().parent().unwrap_or(Path::new("/")).display()
            );
        }
        // The path of the temporary folder is removed, because it means nothing to a reader.
        format!("{entry}: {}", text.replace(&format!("{}/", self.folder.path().display()), ""))
    }
}

/// Returns whether a folder is on a file system from which nothing may be run.
#[cfg(unix)]
fn runs_nothing(folder: &Path) -> bool {
    use rustix::fs::{StatVfsMountFlags, statvfs};
    statvfs(folder).is_ok_and(|found| found.f_flag.contains(StatVfsMountFlags::NOEXEC))
}

#[cfg(not(unix))]
fn runs_nothing(_folder: &Path) -> bool {
    false
}

/// Returns the names of the entries of a folder, sorted. There are none if the folder does not
/// exist.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// Checks that a library is complete and made for this machine. Access to a missing part would kill
/// the program.
fn check_library(file: &Path) -> Result<(), String> {
    let bytes = std::fs::read(file).map_err(|error| format!("cannot be read: {error}"))?;
    let fault = |error: object::Error| format!("is damaged or not a library: {error}");
    // The file holds libraries for several architectures, among which the loader chooses.
    if matches!(FileKind::parse(&*bytes), Ok(FileKind::MachOFat32 | FileKind::MachOFat64)) {
        return Ok(());
    }
    let library = object::File::parse(&*bytes).map_err(fault)?;
    let target = (library.format(), library.architecture());
    if target != HOST {
        return Err(format!(
            "is for {:?} ({:?}), this program needs {:?} ({:?})",
            target.1, target.0, HOST.1, HOST.0
        ));
    }
    library.segments().try_for_each(|segment| segment.data().map(drop)).map_err(fault)
}

/// Format and architecture that a library needs to run on this machine.
const HOST: (BinaryFormat, Architecture) = (
    if cfg!(windows) {
        BinaryFormat::Pe
    } else if cfg!(target_os = "macos") {
        BinaryFormat::MachO
    } else {
        BinaryFormat::Elf
    },
    if cfg!(target_arch = "aarch64") {
        Architecture::Aarch64
    } else if cfg!(target_arch = "x86") {
        Architecture::I386
    } else {
        Architecture::X86_64
    },
);
