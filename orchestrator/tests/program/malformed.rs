//! Files that are no archives, and archives with false content: each is refused in one line.

use crate::prelude::*;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Names and contents of an archive's entries.
type Entries = Vec<(String, Vec<u8>)>;

/// Signatures of the parts of a zip archive, and the place of a field in them.
const LOCAL: &[u8] = b"PK\x03\x04";
const CENTRAL: &[u8] = b"PK\x01\x02";
const END: &[u8] = b"PK\x05\x06";

/// Returns the bytes with others at a place behind the last occurrence of a signature.
fn with(mut bytes: Vec<u8>, signature: &[u8], place: usize, others: &[u8]) -> Vec<u8> {
    let start = bytes.windows(4).rposition(|window| window == signature).unwrap();
    bytes[start + place..start + place + others.len()].copy_from_slice(others);
    bytes
}

fn half(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.truncate(bytes.len() / 2);
    bytes
}

type Damage = fn(Vec<u8>) -> Vec<u8>;

/// Files that are no archive, or damaged ones, with a part of the message about them.
const FILES: &[(&str, Damage, &str)] = &[
    ("nothing", |_| vec![], "is not a zip archive"),
    ("one byte", |_| vec![b'P'], "is not a zip archive"),
    ("signature only", |_| LOCAL.to_vec(), "is not a zip archive"),
    ("text", |_| b"an engineer's note\n".repeat(100), "is not a zip archive"),
    ("zeros", |_| vec![0; 5000], "is not a zip archive"),
    ("gzip", |_| [&[0x1f, 0x8b, 8, 0][..], &[7; 500]].concat(), "is not a zip archive"),
    ("first half", half, "is not a zip archive"),
    ("no end", |b| b[..b.len() - 22].to_vec(), "is not a zip archive"),
    ("last byte missing", |b| b[..b.len() - 1].to_vec(), "is not a zip archive"),
    ("second half", |b| b[b.len() / 2..].to_vec(), ""),
    ("directory elsewhere", |b| with(b, END, 16, &[0, 0, 0, 0x70]), "is not a zip archive"),
    ("directory destroyed", |b| with(b, CENTRAL, 0, b"XXXX"), ""),
    ("header destroyed", |b| with(b, LOCAL, 0, b"XXXX"), ""),
    ("65535 entries", |b| with(b, END, 8, &[0xff; 4]), ""),
    ("no entries", |b| with(b, END, 8, &[0; 4]), ""),
    ("wrong checksum", |b| with(b, CENTRAL, 16, &[1, 2, 3, 4]), "cannot be unpacked"),
    ("unknown compression", |b| with(b, CENTRAL, 10, &[99, 0]), ""),
    ("a lie about a size", |b| with(b, CENTRAL, 24, &[10, 0, 0, 0]), ""),
    ("a link", |b| with(b, CENTRAL, 38, &[0, 0, 0xff, 0xa1]), "symbolic link"),
    ("encrypted", |b| with(b, CENTRAL, 8, &[1, 0]), ""),
    ("garbage inside", |b| with(b, LOCAL, 200, &[0xa5; 300]), "cannot be unpacked"),
    ("header far away", |b| with(b, CENTRAL, 42, &[0xff, 0xff, 0xff, 0x7f]), ""),
];

type Change = fn(&mut Entries);

/// Archives whose content is not as FMI demands.
const CONTENTS: &[(&str, Change, &str)] = &[
    ("no entry", Vec::clear, "modelDescription.xml"),
    ("no description", |e| drop(e.remove(0)), "modelDescription.xml"),
    ("description in a folder", |e| e[0].0.insert_str(0, "model/"), "modelDescription.xml"),
    ("name in capitals", |e| e[0].0.make_ascii_uppercase(), "modelDescription.xml"),
    ("empty description", |e| e[0].1.clear(), "modelDescription.xml"),
    ("no XML", |e| e[0].1 = b"name = model".to_vec(), "modelDescription.xml"),
    ("XML cut off", |e| e[0].1 = half(e[0].1.clone()), "modelDescription.xml"),
    ("no UTF-8", |e| change(e, "\"Model\"", b"\"Mod\xff\xfe\""), "modelDescription.xml"),
    ("zero bytes", |e| e[0].1 = vec![0; 3000], "modelDescription.xml"),
    ("another root", |e| change(e, "fmiModelDescription", b"html"), "modelDescription.xml"),
    ("no version", |e| change(e, "fmiVersion", b"fmiVersio"), "fmiVersion"),
    ("FMI 1.0", |e| change(e, "fmiVersion=\"2.0\"", b"fmiVersion=\"1.0\""), "FMI 1.0"),
    ("FMI 4.0", |e| change(e, "fmiVersion=\"2.0\"", b"fmiVersion=\"4.0\""), "FMI 4.0"),
    ("another GUID", |e| change(e, "guid=\"", b"guid=\"x"), "another GUID"),
    ("no interface", |e| change(e, "<CoSimulation", b"<CoSimulatio"), ""),
    ("zero in an identifier", |e| change(e, "\"model\"", b"\"model&#0;\""), ""),
    ("a text as number", |e| change(e, "valueReference=\"1\"", b"valueReference=\"1.5\""), "1.5"),
    ("lacking interface", |e| change(e, "<CoSimulation", b"<ModelExchange"), "undefined symbol"),
    ("no identifier", |e| change(e, "modelIdentifier", b"modelIdentifie"), "modelIdentifier"),
    ("identifier of no file", |e| change(e, "\"model\"", b"\"other\""), "other"),
    ("reference of text", |e| change(e, "Reference=\"0\"", b"Reference=\"first\""), "first"),
    ("negative reference", |e| change(e, "valueReference=\"0\"", b"valueReference=\"-1\""), "-1"),
    ("no name", |e| change(e, "<ScalarVariable name", b"<ScalarVariable nam"), "name"),
    ("type that is none", |e| change(e, "<Real", b"<Complex"), "has no type"),
    ("attribute twice", |e| change(e, "fmiVersion=", b"fmiVersion=\"2.0\" fmiVersion="), ""),
    ("entities of entities", entities, "modelDescription.xml"),
    ("deep nesting", nesting, "modelDescription.xml"),
    ("no library", |e| drop(e.remove(1)), "has no library for linux64"),
    ("library for Windows", |e| e[1].0 = "binaries/win64/model.dll".into(), "linux64"),
    ("empty library", |e| e[1].1.clear(), "binaries/linux64/model.so"),
    ("library of text", |e| e[1].1 = b"#!/bin/sh\n".to_vec(), "binaries/linux64/model.so"),
    ("library cut off", |e| e[1].1 = half(e[1].1.clone()), "is damaged or not a library"),
    ("another processor", |e| e[1].1[18] = 0xb7, "is for Aarch64 (Elf), this program needs"),
    ("32 bits", |e| e[1].1[4] = 1, "binaries/linux64/model.so"),
    ("a function lacks", |e| rename(e, b"fmi2DoStep", b"fmi2DoStop"), "symbol: fmi2DoStep"),
    ("path outside", |e| e.push(("../evil".into(), vec![1])), "../evil"),
    ("absolute path", |e| e.push(("/evil".into(), vec![1])), "/evil"),
    ("backslashes", |e| e.push(("a\\evil".into(), vec![1])), "backslashes"),
    ("file below a file", |e| e.push(("modelDescription.xml/evil".into(), vec![1])), "evil"),
    ("folder of a file's name", |e| e.push(("binaries/linux64".into(), vec![1])), "linux64"),
    ("long name", |e| e.push(("n".repeat(5000), vec![1])), "name of more than 1000 bytes"),
    ("many entries", |e| e.extend((0..30_000).map(|k| (format!("f/{k}"), vec![]))), "30002 entr"),
];

/// Replaces the first occurrence of a text in the description.
fn change(entries: &mut Entries, from: &str, to: &[u8]) {
    let text = &entries[0].1;
    let place = text.windows(from.len()).position(|window| window == from.as_bytes());
    let place = place.unwrap_or_else(|| panic!("no {from}"));
    entries[0].1 = [&text[..place], to, &text[place + from.len()..]].concat();
}

/// Replaces every occurrence of a name in the library.
fn rename(entries: &mut Entries, from: &[u8], to: &[u8]) {
    let library = &mut entries[1].1;
    for place in 0..library.len() - from.len() {
        if library[place..].starts_with(from) {
            library[place..place + to.len()].copy_from_slice(to);
        }
    }
}

fn entities(entries: &mut Entries) {
    let more = (1..40).map(|k| format!("<!ENTITY a{k} \"&a{};&a{};\">", k - 1, k - 1));
    let parts: Vec<_> = std::iter::once("<!DOCTYPE f [<!ENTITY a0 \"ha\">".into())
        .chain(more)
        .chain(["]><fmiModelDescription fmiVersion=\"2.0\" modelName=\"&a39;\"/>".into()])
        .collect();
    entries[0].1 = parts.concat().into_bytes();
}

fn nesting(entries: &mut Entries) {
    let text = ["<fmiModelDescription fmiVersion=\"2.0\">", &"<a>".repeat(200_000)].concat();
    entries[0].1 = text.into_bytes();
}

/// Runs the loop with the archive that lies there. Returns what is wrong with the refusal.
fn problem(bench: &Bench, name: &str, says: &str) -> Option<String> {
    let folder = bench.path("temporary");
    fs::create_dir_all(&folder).unwrap();
    let begin = Instant::now();
    let output = bench.command(&["run", "loop.toml"]).env("TMPDIR", &folder).output().unwrap();
    let errors = String::from_utf8(output.stderr).unwrap();
    let checks = [
        ("exit code", output.status.code() == Some(2)),
        // Before it there may be a warning of what would be wrong besides.
        ("one error", errors.lines().filter(|line| line.starts_with("error: ")).count() == 1),
        ("short lines", errors.lines().count() < 3 && errors.len() < 1000),
        ("names the archive", errors.contains("Model.fmu")),
        (says, errors.contains(says)),
        ("time", begin.elapsed() < PATIENCE),
        ("no temporary file", fs::read_dir(&folder).unwrap().count() == 0),
        ("no results", !bench.path("out").exists()),
    ];
    let failed = checks.iter().find(|(_, holds)| !holds)?.0;
    Some(format!("{name}: {failed}: {:?} {errors}", output.status))
}

#[test]
fn damaged_archives_are_refused_by_name() {
    let bench = Bench::new();
    let archive = bench.path("Model.fmu");
    let good = fs::read(&archive).unwrap();
    let mut problems = Vec::new();
    for (name, damage, says) in FILES {
        fs::write(&archive, damage(good.clone())).unwrap();
        problems.extend(problem(&bench, name, says));
    }
    fs::remove_file(&archive).unwrap();
    problems.extend(problem(&bench, "no file", "there is no file"));
    fs::create_dir(&archive).unwrap();
    problems.extend(problem(&bench, "a folder", "is a folder"));
    assert!(problems.is_empty(), "{problems:#?}");
}

#[test]
fn archives_with_wrong_content_are_refused_by_name() {
    let bench = Bench::new();
    let archive = bench.path("Model.fmu");
    let mut whole = ZipArchive::new(fs::File::open(&archive).unwrap()).unwrap();
    let mut good = Entries::new();
    for index in 0..whole.len() {
        let mut entry = whole.by_index(index).unwrap();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).unwrap();
        good.push((entry.name().unwrap().into_owned(), content));
    }
    let mut problems = Vec::new();
    for (name, change, says) in CONTENTS {
        let mut entries = good.clone();
        change(&mut entries);
        let mut zip = ZipWriter::new(fs::File::create(&archive).unwrap());
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        for (entry, content) in &entries {
            zip.start_file(entry.as_str(), stored).unwrap();
            zip.write_all(content).unwrap();
        }
        zip.finish().unwrap();
        problems.extend(problem(&bench, name, says));
    }
    assert!(problems.is_empty(), "{problems:#?}");
}
