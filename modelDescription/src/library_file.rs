//! Built libraries read as files, for any platform: their platform, their exports and imports, and
//! the sources of which they were made. Nothing is loaded.

use crate::Error;
use object::elf::{FileHeader32, FileHeader64};
use object::read::elf::{ElfFile, FileHeader};
use object::read::macho::{FatArch, MachOFatFile32};
use object::{Architecture, BinaryFormat, Endianness, File, FileKind, Object, ObjectSection};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str;

/// A built library, without the code.
#[derive(Clone, Debug, PartialEq)]
pub struct LibraryFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Names of its folders below `binaries/` in an archive of FMI 2.0.
    pub folders: &'static [&'static str],
    /// Platform tuples of FMI 3.0, one for each architecture, which are its folders there.
    pub tuples: Vec<&'static str>,
    /// Suffix of its file name in an archive.
    pub suffix: &'static str,
    /// Names of the exported functions.
    pub exports: BTreeSet<String>,
    /// Digest of its sources, as `fmi_build::link` made it.
    pub sources: Option<String>,
}

/// Libraries that every Linux system has, without version.
const LINUX: &[&str] =
    &["ld-linux", "libc.so", "libdl.so", "libgcc_s.so", "libm.so", "libpthread.so", "librt.so"];
/// Libraries that every macOS system has.
const MACOS: &[&str] = &["/usr/lib/libSystem.B", "/usr/lib/libiconv.2"];
/// Libraries that every Windows system since version 10 has, in small letters.
const WINDOWS: &[&str] = &[
    "advapi32.",
    "api-ms-win-core-",
    "api-ms-win-crt-",
    "bcryptprimitives.",
    "kernel32.",
    "msvcrt.",
    "ntdll.",
    "ucrtbase.",
    "userenv.",
    "ws2_32.",
];

impl LibraryFile {
    /// Reads the library at `path`. A library for macOS may hold several architectures.
    ///
    /// # Errors
    /// Reports a file that cannot be read, is not a library for a platform that FMI defines, or
    /// needs libraries that a bare system lacks.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes =
            std::fs::read(path).map_err(|source| Error::File { path: path.to_owned(), source })?;
        let fault = |problem| Error::Library { path: path.to_owned(), problem };
        let slices = slices(&bytes).map_err(|error| fault(error.to_string()))?;
        let mut parts = slices.iter().map(|slice| Self::from_slice(path, slice).map_err(fault));
        let mut first =
            parts.next().unwrap_or_else(|| Err(fault("the file holds no library".into())))?;
        for part in parts {
            let part = part?;
            first.tuples.extend(&part.tuples);
            if (Self { tuples: first.tuples.clone(), ..part }) != first {
                return Err(fault("its architectures differ in sources or exports".into()));
            }
        }
        Ok(first)
    }

    fn from_slice(path: &Path, bytes: &[u8]) -> Result<Self, String> {
        let file = File::parse(bytes).map_err(|error| error.to_string())?;
        let (folders, tuple, suffix, bare) = platform(&file)?;
        let needed = needed(&file, bytes).map_err(|error| error.to_string())?;
        let foreign = |name: &&String| !bare.iter().any(|prefix| name.starts_with(prefix));
        if let Some(name) = needed.iter().find(foreign) {
            return Err(format!("it needs {name}, which not every system has"));
        }
        Ok(Self {
            path: path.to_owned(),
            folders,
            tuples: vec![tuple],
            suffix,
            exports: exports(&file).map_err(|error| error.to_string())?,
            sources: sources(&file).map_err(|error| error.to_string())?,
        })
    }
}

/// Returns the libraries of each architecture in a file.
pub(crate) fn slices(bytes: &[u8]) -> object::Result<Vec<&[u8]>> {
    if FileKind::parse(bytes)? == FileKind::MachOFat32 {
        let fat = MachOFatFile32::parse(bytes)?;
        return fat.arches().iter().map(|slice| slice.data(bytes)).collect();
    }
    Ok(vec![bytes])
}

type Platform = (&'static [&'static str], &'static str, &'static str, &'static [&'static str]);

/// Returns the platform's folders, tuple and file suffix, and the libraries that its systems have.
fn platform(file: &File) -> Result<Platform, String> {
    use Architecture::{Aarch64, I386, X86_64};
    Ok(match (file.format(), file.architecture()) {
        (BinaryFormat::Elf, X86_64) => (&["linux64"], "x86_64-linux", "so", LINUX),
        (BinaryFormat::Elf, I386) => (&["linux32"], "x86-linux", "so", LINUX),
        // FMI 2.0 has no name for this platform: some importers use one, some the other.
        (BinaryFormat::Elf, Aarch64) => {
            (&["aarch64-linux", "linux64"], "aarch64-linux", "so", LINUX)
        }
        (BinaryFormat::Pe, X86_64) => (&["win64"], "x86_64-windows", "dll", WINDOWS),
        (BinaryFormat::Pe, I386) => (&["win32"], "x86-windows", "dll", WINDOWS),
        (BinaryFormat::MachO, X86_64) => (&["darwin64"], "x86_64-darwin", "dylib", MACOS),
        (BinaryFormat::MachO, Aarch64) => (&["darwin64"], "aarch64-darwin", "dylib", MACOS),
        (format, architecture) => {
            return Err(format!("FMI 2.0 has no folder for {architecture:?} ({format:?})"));
        }
    })
}

/// Returns the names of the libraries that the loader loads for this one.
fn needed(file: &File, bytes: &[u8]) -> object::Result<BTreeSet<String>> {
    match file.format() {
        BinaryFormat::Elf if file.is_64() => elf_needed::<FileHeader64<Endianness>>(bytes),
        BinaryFormat::Elf => elf_needed::<FileHeader32<Endianness>>(bytes),
        BinaryFormat::Pe => {
            let names = file.imports()?.into_iter();
            Ok(names.map(|import| text(import.library()).to_lowercase()).collect())
        }
        _ => Ok(file.imports()?.into_iter().map(|import| text(import.library())).collect()),
    }
}

fn elf_needed<Elf>(bytes: &[u8]) -> object::Result<BTreeSet<String>>
where
    Elf: FileHeader<Endian = Endianness>,
{
    let file = ElfFile::<Elf>::parse(bytes)?;
    let table = file.elf_dynamic_table()?;
    let needed = table.iter().filter(|entry| entry.tag == object::elf::DT_NEEDED);
    needed.map(|entry| table.string(entry).map(text)).collect()
}

fn text(name: &[u8]) -> String {
    String::from_utf8_lossy(name).into_owned()
}

/// Returns the names of the exported functions, without the underscore that macOS puts before them.
fn exports(file: &File) -> object::Result<BTreeSet<String>> {
    let underscore = if file.format() == BinaryFormat::MachO { "_" } else { "" };
    let exports = file.exports()?.into_iter();
    Ok(exports
        .map(|export| text(export.name()))
        .map(|name| name.strip_prefix(underscore).map_or(name.clone(), str::to_string))
        .collect())
}

/// Returns the digest that `export_fmus!` put into the library.
fn sources(file: &File) -> object::Result<Option<String>> {
    let names = [".fmi2_sources", ".fmi2src", "__fmi2_sources"];
    let Some(section) = names.iter().find_map(|name| file.section_by_name(name)) else {
        return Ok(None);
    };
    let digest = section.data()?.get(..64).and_then(|digits| str::from_utf8(digits).ok());
    Ok(digest.filter(|digits| digits.bytes().all(|b| b.is_ascii_hexdigit())).map(str::to_string))
}
