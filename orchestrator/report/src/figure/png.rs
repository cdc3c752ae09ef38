//! Converts a drawn SVG to PNG, with a font of its own, so that it looks the same on every machine.

use cosim::error::Error;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb::Database};
use std::path::Path;
use std::sync::Arc;

/// Number of pixels of the PNG for each one of the SVG.
const SCALE: f32 = 2.0;

/// Writes the text of an SVG file as a PNG file.
///
/// # Errors
/// Returns an error if the SVG cannot be drawn, or the file cannot be written.
pub fn write(svg: &str, path: &Path) -> Result<(), Error> {
    let failed = |reason: String| Error::file(path)(std::io::Error::other(reason));
    let mut fonts = Database::new();
    fonts.load_font_data(notosans::REGULAR_TTF.to_vec());
    fonts.set_sans_serif_family("Noto Sans");
    let options =
        Options { fontdb: Arc::new(fonts), font_family: "Noto Sans".into(), ..Options::default() };
    let tree = Tree::from_str(svg, &options).map_err(|error| failed(error.to_string()))?;
    let size =
        tree.size().to_int_size().scale_by(SCALE).ok_or_else(|| failed("it has no size".into()))?;
    let mut image =
        Pixmap::new(size.width(), size.height()).ok_or_else(|| failed("it has no size".into()))?;
    resvg::render(&tree, Transform::from_scale(SCALE, SCALE), &mut image.as_mut());
    image.save_png(path).map_err(|error| failed(error.to_string()))
}
