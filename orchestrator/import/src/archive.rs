//! Unpacks an `.fmu` or `.ssp` archive without trusting it.

use crate::error::Error;
use crate::folder::TemporaryFolder;
use crate::folder::from_start;
use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;
use zip::ZipArchive;

/// Largest size of an archive's content when unpacked, bytes.
const SIZE_LIMIT: u64 = 1 << 30;
/// Largest number of entries in an archive, and of folders that they make.
const ENTRY_LIMIT: usize = 20_000;
/// Largest number of folders within one another.
const DEPTH_LIMIT: usize = 50;
/// Largest number of bytes of an entry's name.
const LONGEST_NAME: usize = 1000;
/// Number of characters of an entry's name that an error shows.
const LONGEST_NAME_SHOWN: usize = 200;

/// Unpacks an archive into a new temporary folder, which is removed when the returned value is
/// dropped.
///
/// # Errors
/// Returns an error if the file is not an archive, or if the archive has absolute paths, paths that
/// lead out of the folder, other contents of one name, links, encrypted entries, or more content or folders
/// than any FMU has.
pub fn unpack(path: &Path) -> Result<TemporaryFolder, Error> {
    unpack_limited(path, SIZE_LIMIT, ENTRY_LIMIT, str::to_string)
}

/// Unpacks an archive like [`unpack`]. A backslash in the name of an entry is read as a slash,
/// because some programs for Windows write it so.
///
/// # Errors
/// Returns the errors of [`unpack`].
pub fn unpack_with_backslashes(path: &Path) -> Result<TemporaryFolder, Error> {
    unpack_limited(path, SIZE_LIMIT, ENTRY_LIMIT, with_slashes)
}

/// Returns a path with slashes in place of backslashes.
pub fn with_slashes(path: &str) -> String {
    path.replace('\\', "/")
}

fn unpack_limited(
    path: &Path,
    size_limit: u64,
    entry_limit: usize,
    normalized: fn(&str) -> String,
) -> Result<TemporaryFolder, Error> {
    let refuse = |message: String| Error::Fmu { path: path.to_path_buf(), message };
    let file = File::open(from_start(path))
        .map_err(|source| refuse(format!("cannot be opened: {source}")))?;
    let mut archive = ZipArchive::new(file)
        .map_err(|source| refuse(format!("is not a zip archive: {source}")))?;
    if archive.has_duplicate_names() {
        let name =
            contradiction(path, archive.central_directory_start()).map_err(Error::file(path))?;
        if let Some(name) = name {
            let name = shown(&name);
            return Err(refuse(format!(
                "refused: two entries of the archive are called \"{name}\" and have other contents"
            )));
        }
    }
    let names = names(&mut archive, entry_limit, normalized).map_err(refuse)?;

    let folder = TemporaryFolder::new().map_err(Error::file(std::env::temp_dir()))?;
    let mut left = size_limit;
    for (index, name) in names.iter().enumerate() {
        let mut entry =
            archive.by_index(index).map_err(|source| refuse(format!("entry {index}: {source}")))?;
        // A message names the entry and where it goes, because the name of the temporary folder
        // means nothing to a reader.
        let fault = |source: io::Error| {
            let (name, into) = (shown(name), std::env::temp_dir());
            refuse(format!("entry \"{name}\" cannot be unpacked into {}: {source}", into.display()))
        };
        let target = folder.path().join(name);
        if name.ends_with('/') {
            fs::create_dir_all(&target).map_err(fault)?;
            continue;
        }
        if let Some(parent) = target.parent() {
            fs::create_dir_all(parent).map_err(fault)?;
        }
        let mut out = File::create_new(&target).map_err(fault)?;
        // The sizes that an archive declares may be wrong, so the bytes that are unpacked are
        // counted.
        let written = io::copy(&mut (&mut entry).take(left + 1), &mut out).map_err(fault)?;
        left = left.checked_sub(written).ok_or_else(|| {
            refuse(format!("refused: it unpacks to more than {} MiB", size_limit.div_ceil(1 << 20)))
        })?;
    }
    Ok(folder)
}

/// Returns the name of entries with other contents, by their checksums and sizes in the directory of
/// the archive, which begins at this place of the file.
fn contradiction(path: &Path, place: u64) -> io::Result<Option<String>> {
    /// Length of the fixed part of an entry of the directory, which begins with these bytes.
    const FIXED: usize = 46;
    const BEGIN: &[u8] = b"PK\x01\x02";
    let mut file = File::open(from_start(path))?;
    file.seek(SeekFrom::Start(place))?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)?;
    let (mut contents, mut rest) = (HashMap::new(), bytes.as_slice());
    while rest.starts_with(BEGIN) && rest.len() >= FIXED {
        let length = |at: usize| usize::from(u16::from_le_bytes([rest[at], rest[at + 1]]));
        let (name, others) = (length(28), length(30) + length(32));
        let Some(entry) = rest.get(..FIXED + name + others) else { break };
        let (name, content) = (&entry[FIXED..FIXED + name], &entry[16..28]);
        if *contents.entry(name).or_insert(content) != content {
            return Ok(Some(String::from_utf8_lossy(name).into_owned()));
        }
        rest = &rest[entry.len()..];
    }
    Ok(None)
}

/// Returns the names of the entries, or the reason why nothing of the archive is written.
fn names(
    archive: &mut ZipArchive<File>,
    limit: usize,
    normalized: fn(&str) -> String,
) -> Result<Vec<String>, String> {
    let count = archive.len();
    if count > limit {
        return Err(format!("refused: it has {count} entries, at most {limit} are allowed"));
    }
    let (mut names, mut folders) = (Vec::with_capacity(count), HashSet::new());
    for index in 0..count {
        let entry =
            archive.by_index_raw(index).map_err(|source| format!("entry {index}: {source}"))?;
        let name = std::str::from_utf8(entry.name_raw())
            .map_err(|_| format!("refused: the name of entry {index} is not UTF-8"))?;
        let name = normalized(name);
        let refuse = |reason: &str| format!("refused: entry \"{}\" {reason}", shown(&name));
        if let Some(reason) = unsafe_name(&name) {
            return Err(refuse(reason));
        }
        if entry.is_symlink() {
            return Err(refuse("is a symbolic link"));
        }
        let depth = name.split('/').filter(|part| !matches!(*part, "" | ".")).count();
        if depth > DEPTH_LIMIT {
            return Err(refuse(&format!(
                "is {depth} folders deep, at most {DEPTH_LIMIT} are allowed"
            )));
        }
        // Folders without an entry of their own are made as well.
        folders.extend(name.match_indices('/').map(|(end, _)| name[..end].to_string()));
        if folders.len() > limit {
            return Err(format!("refused: it has more than {limit} folders"));
        }
        names.push(name);
    }
    Ok(names)
}

/// Returns a name as a message shows it.
fn shown(name: &str) -> String {
    name.escape_default().take(LONGEST_NAME_SHOWN).collect()
}

/// Returns the reason why an entry of this name must not be written; `None` if it may be.
pub fn unsafe_name(name: &str) -> Option<&'static str> {
    if name.is_empty() {
        Some("has no name")
    } else if name.len() > LONGEST_NAME {
        Some("has a name of more than 1000 bytes")
    } else if name.starts_with('/') || name.contains(':') {
        Some("is an absolute path")
    } else if name.contains('\\') {
        Some("uses backslashes; FMI requires forward slashes")
    } else if name.contains('\0') {
        Some("contains a zero byte")
    } else if name.split('/').any(|part| part == "..") {
        Some("leads out of the archive")
    } else if name.ends_with("/.") || name == "." {
        Some("names a folder, not a file")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::write::SimpleFileOptions;

    fn archive(entries: &[(&str, &[u8])]) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        let mut zip = zip::ZipWriter::new(file.as_file_mut());
        for (name, content) in entries {
            zip.start_file(*name, SimpleFileOptions::default()).unwrap();
            zip.write_all(content).unwrap();
        }
        zip.finish().unwrap();
        file
    }

    fn refusal(file: &tempfile::NamedTempFile) -> String {
        unpack_limited(file.path(), 1000, 10, str::to_string).unwrap_err().to_string()
    }

    #[test]
    fn folders_and_files_may_begin_with_the_folder_itself() {
        let file = archive(&[
            ("./", b""),
            ("./modelDescription.xml", b"<x/>"),
            ("./binaries/./a b/ü", b"1"),
        ]);
        let folder = unpack(file.path()).unwrap();
        assert_eq!(fs::read(folder.path().join("modelDescription.xml")).unwrap(), b"<x/>");
        assert_eq!(fs::read(folder.path().join("binaries/a b/ü")).unwrap(), b"1");
        let twice = archive(&[("a", b"1"), ("./a", b"2")]);
        assert!(refusal(&twice).contains("entry \"./a\" cannot be unpacked"));
    }

    #[test]
    fn paths_that_lead_outside_are_refused() {
        for name in ["../evil", "a/../../evil", "/etc/evil", "C:/evil", "a\\..\\evil", "a/."] {
            let message = refusal(&archive(&[(name, b"x")]));
            assert!(message.contains("refused: entry"), "{name}: {message}");
            assert_eq!(message.lines().count(), 1);
        }
    }

    #[test]
    fn backslashes_are_read_as_slashes_only_if_asked_for() {
        let file = archive(&[("a\\", b""), ("a\\b.txt", b"1")]);
        assert!(refusal(&file).contains("backslashes"));
        let folder = unpack_with_backslashes(file.path()).unwrap();
        assert_eq!(fs::read(folder.path().join("a/b.txt")).unwrap(), b"1");
        for name in ["..\\evil", "a\\..\\..\\evil", "\\\\server\\evil", "C:\\evil"] {
            let message = unpack_with_backslashes(archive(&[(name, b"x")]).path()).unwrap_err();
            assert!(message.to_string().contains("refused: entry"), "{message}");
        }
        let twice = archive(&[("a/b", b"1"), ("a\\b", b"2")]);
        let message = unpack_with_backslashes(twice.path()).unwrap_err().to_string();
        assert!(message.contains("entry \"a/b\" cannot be unpacked"), "{message}");
    }

    #[test]
    fn bombs_are_refused_by_what_comes_out() {
        assert!(
            refusal(&archive(&[("a", &[0; 600]), ("b", &[0; 600])]))
                .contains("unpacks to more than")
        );
        let many: Vec<String> = (0..11).map(|i| format!("f{i}")).collect();
        let entries: Vec<(&str, &[u8])> =
            many.iter().map(|name| (name.as_str(), &b""[..])).collect();
        assert!(refusal(&archive(&entries)).contains("11 entries"));
        let file = archive(&entries[..10]);
        assert!(unpack_limited(file.path(), 1000, 10, str::to_string).is_ok());
    }

    #[test]
    fn folders_are_bounded_in_number_and_depth_also_where_no_entry_stands_for_them() {
        let deep = |depth: usize| format!("{}x", "a/".repeat(depth - 1));
        for name in [deep(DEPTH_LIMIT), format!("{}y", "./".repeat(100))] {
            unpack(archive(&[(&name, b"")]).path()).unwrap();
        }
        let message = refusal(&archive(&[("first", b""), (&deep(51), b"")]));
        assert!(message.ends_with("is 51 folders deep, at most 50 are allowed"), "{message}");
        // Three entries make twelve folders.
        let names = ["a", "b", "c"].map(|name| format!("{name}/1/2/3/x"));
        let entries = names.each_ref().map(|name| (name.as_str(), &b""[..]));
        assert!(refusal(&archive(&entries)).contains("more than 10 folders"));
        assert!(unpack_limited(archive(&entries[..2]).path(), 1000, 10, str::to_string).is_ok());
    }

    #[test]
    fn duplicate_names_are_refused_unless_their_contents_are_the_same() {
        // The writer refuses to make such an archive, so rename an entry of a good one in place.
        let doubled = |second: &[u8]| {
            let file = archive(&[("aaaa", b"1"), ("bbbb", second)]);
            let bytes = fs::read(file.path()).unwrap();
            let mut renamed = bytes.clone();
            for start in 0..bytes.len() - 4 {
                if &bytes[start..start + 4] == b"bbbb" {
                    renamed[start..start + 4].copy_from_slice(b"aaaa");
                }
            }
            assert_ne!(bytes, renamed);
            fs::write(file.path(), renamed).unwrap();
            file
        };
        let message = refusal(&doubled(b"2"));
        assert!(message.contains("two entries of the archive are called \"aaaa\""), "{message}");
        let folder = unpack(doubled(b"1").path()).unwrap();
        assert_eq!(fs::read(folder.path().join("aaaa")).unwrap(), b"1");
    }
}
