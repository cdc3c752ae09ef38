//! Draws every `.svg` of a folder as a `.png` beside it: `render FOLDER`.

use cosim_report::figure::png;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: render FOLDER")?;
    for entry in Path::new(&folder).read_dir()? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "svg") {
            png::write(&std::fs::read_to_string(&path)?, &path.with_extension("png"))?;
        }
    }
    Ok(())
}
