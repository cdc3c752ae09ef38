use super::*;
use crate::figure::{Color, Panel};

fn figure(curves: Vec<Curve>, x_range: Option<[f64; 2]>) -> Figure {
    let panel = Panel {
        title: "<t>".into(),
        x_label: "time, s".into(),
        y_label: "y".into(),
        x_range,
        curves,
        ..Panel::default()
    };
    Figure { title: "a & b".into(), columns: 1, legend: Legend::Above, panels: vec![panel] }
}

fn curve(name: &str, shape: Shape) -> Curve {
    let (x, y) = (vec![0.0, 1.0, 2.0], vec![0.0, 1.0, 0.5]);
    Curve { name: name.into(), color: Color(1, 2, 3), shape, x, y }
}

/// The data of all paths of this curve.
fn paths<'a>(text: &'a str, name: &str) -> Vec<&'a str> {
    let begin = format!("<path data-name=\"{name}\"");
    let data = |part: &'a str| part.split(" d=\"").nth(1)?.split('"').next();
    text.split(&begin).skip(1).filter_map(data).collect()
}

#[test]
fn what_lies_outside_the_range_is_not_drawn() {
    let text = text(&figure(vec![curve("c", Shape::Line)], Some([0.0, 1.0])));
    let [data] = paths(&text, "c")[..] else { panic!("{text}") };
    // One point to begin with and one step from it.
    assert_eq!((data.matches('M').count(), data.matches('l').count()), (1, 1), "{data}");
    assert_eq!(data.split(['l', ' ', '-']).count(), 4, "{data}");
}

#[test]
fn what_is_not_finite_is_a_gap() {
    let mut broken = curve("c", Shape::Line);
    broken.x.extend([3.0, 4.0, 5.0]);
    broken.y.extend([f64::NAN, 1.0, 1.0]);
    assert_eq!(paths(&text(&figure(vec![broken], None)), "c").len(), 2);
}

#[test]
fn names_cannot_end_an_element() {
    let text = text(&figure(vec![curve("</svg><script>", Shape::Line)], None));
    assert!(!text.contains("<script>") && text.matches("</svg>").count() == 2);
    assert!(text.contains("a &amp; b") && text.contains("&lt;t&gt;"));
}
