use super::*;
use serde::Deserialize;

fn source(files: &[(&str, &str)]) -> Result<Source, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let prefix = format!("{}/", folder.path().display());
    Source::load(&folder.path().join(files[0].0))
        .map_err(|error| error.to_string().replace(&prefix, ""))
}

fn whole(files: &[(&str, &str)]) -> toml::Table {
    source(files).unwrap().whole().parse().unwrap()
}

#[test]
fn tables_merge_by_their_keys_and_all_else_replaces() {
    let merged = whole(&[
        ("own.toml", "extends = \"base.toml\"\nlist = [3]\n[table]\nb = 3\n[table.inner]\nd = 4"),
        ("base.toml", "text = \"x\"\nlist = [1, 2]\n[table]\na = 1\nb = 2\n[table.inner]\nc = 3"),
    ]);
    let expected = "text = \"x\"\nlist = [3]\n[table]\na = 1\nb = 3\n[table.inner]\nc = 3\nd = 4";
    assert_eq!(merged, expected.parse().unwrap());
}

#[test]
fn a_later_base_has_precedence_and_a_common_one_counts_once() {
    let merged = whole(&[
        ("own.toml", "extends = [\"a.toml\", \"b.toml\"]"),
        ("a.toml", "extends = \"common.toml\"\nx = \"a\"\ny = \"a\""),
        ("b.toml", "extends = \"common.toml\"\ny = \"b\""),
        ("common.toml", "x = \"common\"\nz = \"common\""),
    ]);
    assert_eq!(merged, "x = \"a\"\ny = \"b\"\nz = \"common\"".parse().unwrap());
}

#[test]
fn a_parameter_of_a_base_can_be_unset_and_set_again() {
    let base = "[components.c.parameters]\n\"p.q\" = 1\n\"p.r\" = 2";
    let text = "extends = \"base.toml\"\nunset = [\"c.p.q\"]";
    let merged = whole(&[("own.toml", text), ("base.toml", base)]);
    assert_eq!(merged, "[components.c.parameters]\n\"p.r\" = 2".parse().unwrap());
    let last = "extends = \"own.toml\"\n[components.c.parameters]\n\"p.q\" = 3";
    let merged = whole(&[("last.toml", last), ("own.toml", text), ("base.toml", base)]);
    assert_eq!(merged["components"]["c"]["parameters"]["p.q"].as_integer(), Some(3));
    let text = "extends = \"base.toml\"\n\nunset = [\"c.p.s\"]";
    let message = source(&[("own.toml", text), ("base.toml", base)]).unwrap_err();
    assert!(
        message.starts_with("own.toml:3: unset: ") && message.contains("did you mean"),
        "{message}"
    );
}

#[test]
fn faults_name_the_file_they_are_in() {
    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Known {
        #[serde(rename = "a")]
        _a: i32,
    }
    let both = |text: &str, base: &str| {
        let text = format!("extends = \"base.toml\"\n{text}");
        source(&[("own.toml", &text), ("base.toml", base)])
    };
    for (text, base, at) in [
        ("a = 1", "\n\nb = 2", "base.toml:3: "),
        ("\nb = 1", "a = 2", "own.toml:3: "),
        ("", "\na = \"x\"", "base.toml:2: "),
    ] {
        let message = both(text, base).unwrap().read::<Known>().unwrap_err().to_string();
        assert!(message.contains(&format!("/{at}")), "{message}");
    }
    let message = both("", "a = 1\na =").unwrap_err();
    assert!(message.starts_with("base.toml:2: "), "{message}");
    let message = source(&[("own.toml", "\nextends = \"none.toml\"")]).unwrap_err();
    assert!(message.starts_with("own.toml:2: extends = \"none.toml\": "), "{message}");
    let message = source(&[("own.toml", "extends = 1")]).unwrap_err();
    assert!(message.starts_with("own.toml:1: extends: expected"), "{message}");
    let message = both("", "extends = \"own.toml\"").unwrap_err();
    assert!(
        message.starts_with("base.toml:1: extends = \"own.toml\": ") && message.contains("circle"),
        "{message}"
    );
}

#[test]
fn a_file_that_a_base_names_lies_beside_the_base() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    fs::create_dir(place("own")).unwrap();
    fs::write(place("base.toml"), "file = \"there.toml\"").unwrap();
    fs::write(place("there.toml"), "").unwrap();
    fs::write(place("own/own.toml"), "extends = \"../base.toml\"").unwrap();
    let source = Source::load(&place("own/own.toml")).unwrap();
    let there = |file: &str| source.beside(Path::new(file)).canonicalize().unwrap();
    assert_eq!(there("there.toml"), place("there.toml").canonicalize().unwrap());
    assert_eq!(source.beside(Path::new("nowhere.toml")), place("own/nowhere.toml"));
    // One beside the file itself comes first.
    fs::write(place("own/there.toml"), "").unwrap();
    assert_eq!(there("there.toml"), place("own/there.toml").canonicalize().unwrap());
}
