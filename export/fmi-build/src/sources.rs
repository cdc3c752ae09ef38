//! Digest of all sources of a library.

use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// Parts of a package in a local folder that the compiler reads.
const PARTS: [&str; 4] = ["Cargo.toml", "build.rs", "data", "src"];

/// Returns the digest of the sources of the package that is being built, as 64 hexadecimal digits.
/// It covers the names and versions of all dependencies, and all files of those in local folders,
/// but neither the platform nor the paths of the folders.
pub(crate) fn digest() -> Result<String, String> {
    let manifest = PathBuf::from(variable("CARGO_MANIFEST_DIR")?).join("Cargo.toml");
    // A change of the versions of dependencies may change only this file of the project.
    let workspace = cargo(&["locate-project", "--workspace", "--message-format=plain"], &manifest)?;
    let locked = Path::new(workspace.trim_end()).with_file_name("Cargo.lock");
    if locked.exists() {
        println!("cargo::rerun-if-changed={}", locked.display());
    }
    let mut digest = Sha256::new();
    for package in packages(&manifest)? {
        let (name, folder) = match package.split_once(" (") {
            Some((name, folder)) => (name, Path::new(folder.trim_end_matches(')'))),
            None => (package.as_str(), Path::new("")),
        };
        digest.update(name);
        // The name of a package from a registry or repository is followed by its address.
        if !folder.is_dir() {
            continue;
        }
        // Cargo regards a path that does not exist as changed.
        for part in PARTS.map(|part| folder.join(part)).iter().filter(|part| part.exists()) {
            println!("cargo::rerun-if-changed={}", part.display());
            for file in files(part).map_err(|error| format!("{}: {error}", part.display()))? {
                let content = fs::read(&file).map_err(|e| format!("{}: {e}", file.display()))?;
                let within = file.strip_prefix(folder).unwrap_or(&file);
                digest.update(within.to_string_lossy().replace('\\', "/"));
                digest.update(content.len().to_le_bytes());
                digest.update(content);
            }
        }
    }
    let mut digits = String::with_capacity(64);
    for byte in digest.finalize() {
        write!(digits, "{byte:02x}").expect("writing to a string");
    }
    Ok(digits)
}

/// Returns the package that is being built and all that it depends on, as cargo prints them.
fn packages(manifest: &Path) -> Result<BTreeSet<String>, String> {
    let what = ["tree", "--frozen", "--prefix=none", "--edges=normal,build", "--target=all"];
    let tree = cargo(&what, manifest)?;
    // Cargo marks a package that occurs in the tree repeatedly.
    Ok(tree.lines().map(|line| line.trim_end_matches(" (*)").to_string()).collect())
}

/// Returns what cargo prints about the package of a manifest.
fn cargo(what: &[&str], manifest: &Path) -> Result<String, String> {
    let done = Command::new(variable("CARGO")?)
        .args(what)
        .arg("--manifest-path")
        .arg(manifest)
        // These flags are for the target platform, but cargo would try them on the host.
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .env_remove("RUSTFLAGS")
        .output()
        .map_err(|error| format!("cargo {}: {error}", what[0]))?;
    if !done.status.success() {
        let words = String::from_utf8_lossy(&done.stderr).replace('\n', " ");
        return Err(format!("cargo {}: {words}", what[0]));
    }
    Ok(String::from_utf8_lossy(&done.stdout).into_owned())
}

fn variable(name: &str) -> Result<OsString, String> {
    env::var_os(name).ok_or_else(|| format!("cargo did not set {name}"))
}

/// Returns all files at or below a path, sorted; none if it does not exist.
fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    if path.is_file() {
        return Ok(vec![path.to_owned()]);
    }
    if !path.is_dir() {
        return Ok(vec![]);
    }
    let entries = fs::read_dir(path)?.collect::<io::Result<Vec<_>>>()?;
    let mut paths = vec![];
    for entry in entries {
        paths.extend(files(&entry.path())?);
    }
    paths.sort();
    Ok(paths)
}
