//! The resource location that an importer passes, a file URI in one of the forms that importers
//! use.

use percent_encoding::percent_decode_str;
use std::path::PathBuf;

/// Returns the folder to which `uri` points, without a trailing separator.
///
/// The function accepts `file:/p`, `file:///p`, `file:////p` and `file://localhost/p` with percent
/// encoding, and a plain path. `file:p` and `p` are relative to the working directory.
///
/// # Errors
/// Says why the URI cannot be used.
pub(crate) fn folder(uri: &str) -> Result<PathBuf, String> {
    let Some(rest) = strip_scheme(uri) else {
        return match uri.split_once("://") {
            Some((scheme, _)) => {
                Err(format!("resource location '{uri}' has scheme '{scheme}', not 'file'"))
            }
            None => Ok(PathBuf::from(uri)),
        };
    };
    let path = match rest.strip_prefix("//") {
        // If the URI names an authority, it must be this machine.
        Some(after) if !after.starts_with('/') => match after.split_once('/') {
            Some((host, path)) if host.eq_ignore_ascii_case("localhost") => path,
            _ => return Err(format!("resource location '{uri}' names another machine")),
        },
        _ => rest,
    };
    let relative = !rest.starts_with('/');
    let path = path.trim_matches('/');
    let path = percent_decode_str(path).decode_utf8().map_err(|_| {
        format!("resource location '{uri}' is not UTF-8 once its percent encoding is undone")
    })?;
    let drive = path.as_bytes().get(1) == Some(&b':');
    Ok(PathBuf::from(if drive || relative { path.into_owned() } else { format!("/{path}") }))
}

fn strip_scheme(uri: &str) -> Option<&str> {
    let (scheme, rest) = uri.split_at_checked(5)?;
    scheme.eq_ignore_ascii_case("file:").then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::folder;
    use std::path::Path;

    #[test]
    fn every_form_of_the_uri_gives_the_same_folder() {
        for uri in [
            "file:/tmp/a/resources",
            "file:///tmp/a/resources",
            "file:////tmp/a/resources",
            "file://localhost/tmp/a/resources",
            "FILE:///tmp/a/resources/",
            "/tmp/a/resources",
        ] {
            assert_eq!(folder(uri).as_deref(), Ok(Path::new("/tmp/a/resources")), "{uri}");
        }
    }

    #[test]
    fn percent_encoding_is_undone() {
        let expected = Path::new("/tmp/ein Raum/Größe/100%");
        for uri in [
            "file:///tmp/ein%20Raum/Gr%C3%B6%c3%9fe/100%25/",
            "file:///tmp/ein%20Raum/Größe/100%25",
        ] {
            assert_eq!(folder(uri).as_deref(), Ok(expected), "{uri}");
        }
        assert_eq!(
            folder("file:///C:/fmu/resources").as_deref(),
            Ok(Path::new("C:/fmu/resources"))
        );
    }

    #[test]
    fn a_relative_location_stays_relative() {
        for uri in ["file:a/resources/", "a/resources"] {
            assert_eq!(folder(uri).as_deref(), Ok(Path::new("a/resources")), "{uri}");
        }
    }

    #[test]
    fn what_cannot_be_read_is_refused() {
        assert!(folder("http://example.org/resources").unwrap_err().contains("'http'"));
        assert!(folder("file://server/share").unwrap_err().contains("another machine"));
        assert!(folder("file:///tmp/%FF").unwrap_err().contains("UTF-8"));
    }
}
