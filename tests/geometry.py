"""Geometry of figures as Chromium draws them: what a reader could not read."""

from pathlib import Path

# Room by which texts may touch the edge of the picture or each other, px.
TOUCH = 1.0
# Of an SVG in a page: texts that are cut or that lie on one another or on a curve, and axes with too few marks.
FAULTS = """touch => {
  const faults = [], root = document.querySelector("svg"), edge = root.getBoundingClientRect();
  const texts = [...root.querySelectorAll("text")].filter(text => text.textContent.trim()).map(text => {
    const {left, right, top, bottom} = text.getBoundingClientRect();
    return {text: text.textContent, left: left + touch, right: right - touch, top: top + touch + 2, bottom: bottom - touch - 2};
  });
  const meets = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  for (const [place, text] of texts.entries()) {
    const {left, right, top, bottom} = text;
    if (left < edge.left || right > edge.right || top < edge.top || bottom > edge.bottom) faults.push(`cut: ${text.text}`);
    for (const other of texts.slice(place + 1)) if (meets(text, other)) faults.push(`on one another: ${text.text}; ${other.text}`);
  }
  for (const path of root.querySelectorAll("svg.curves path[fill=none]")) {
    const matrix = path.getScreenCTM(), length = path.getTotalLength();
    const frame = path.closest("svg").getBoundingClientRect();
    const near = texts.filter(text => meets(text, frame));
    if (!near.length) continue;
    const hit = new Set();
    for (let at = 0; at <= length; at += 1.5) {
      const {x, y} = path.getPointAtLength(at).matrixTransform(matrix);
      if (y < frame.top || y > frame.bottom) continue;
      for (const text of near) if (x > text.left && x < text.right && y > text.top && y < text.bottom) hit.add(text.text);
    }
    for (const text of hit) faults.push(`on the curve ${path.dataset.name}: ${text}`);
  }
  for (const marks of root.querySelectorAll(".marks-x, .marks-y")) {
    const count = marks.querySelectorAll("text").length;
    if (count < 3) faults.push(`${count} marks: ${marks.textContent}`);
  }
  return faults;
}"""


def faults(page, path: Path) -> list[str]:
    """What is wrong with a figure, drawn in a page of Chromium."""
    page.set_content(path.read_text(encoding="utf-8"))
    return page.evaluate(FAULTS, TOUCH)
