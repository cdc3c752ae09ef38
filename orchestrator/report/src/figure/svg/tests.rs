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
fn a_path_is_short_and_leaves_out_points_on_one_another() {
    let points = [(0.0, 0.0), (0.05, 0.0), (10.0, -0.3), (10.4, 0.0), (10.4, 10.5)];
    assert_eq!(panel::path(&points), "M0 0l10-.4 .4 .4 0 10.6");
    assert_eq!(panel::path(&[]), "");
}

#[test]
fn what_is_not_finite_is_a_gap() {
    let mut broken = curve("c", Shape::Line);
    broken.x.extend([3.0, 4.0, 5.0]);
    broken.y.extend([f64::NAN, 1.0, 1.0]);
    assert_eq!(paths(&text(&figure(vec![broken], None)), "c").len(), 2);
}

#[test]
fn lines_differ_by_their_dashes_and_limits_are_named_at_the_line() {
    let curves = vec![
        curve("first", Shape::Line),
        curve("second", Shape::Line),
        curve("limit", Shape::Horizontal),
    ];
    let text = text(&figure(curves, None));
    let dashes = |name: &str| {
        let part = text.split(&format!("<path data-name=\"{name}\"")).nth(1).unwrap();
        part.split("/>").next().unwrap().contains("stroke-dasharray")
    };
    assert!(!dashes("first") && dashes("second"));
    assert!(!text.contains("data-name=\"limit\"><"), "limits are not in the legend");
    assert_eq!(text.matches(">limit</text>").count(), 1);
}

#[test]
fn names_cannot_end_an_element() {
    let text = text(&figure(vec![curve("</svg><script>", Shape::Line)], None));
    assert!(!text.contains("<script>") && text.matches("</svg>").count() == 2);
    assert!(text.contains("a &amp; b") && text.contains("&lt;t&gt;"));
}

/// Attributes of the first text that contains these words.
fn text_with<'a>(svg: &'a str, words: &str) -> &'a str {
    let end = svg.find(words).unwrap_or_else(|| panic!("{words} in {svg}"));
    &svg[svg[..end].rfind("<text").unwrap()..end]
}

/// Place and size of the axes of the first panel: x, y, width and height.
fn frame(svg: &str) -> Vec<f64> {
    let (_, rest) = svg.split_once("data-frame=\"").unwrap();
    let numbers = rest.split('"').next().unwrap().split(' ');
    numbers.map(|number| number.parse().unwrap()).collect()
}

#[test]
fn long_marks_have_exponents_and_push_the_axes_aside() {
    let scaled = |scale: f64| {
        let mut curve = curve("c", Shape::Line);
        curve.y.iter_mut().for_each(|y| *y *= -scale);
        text(&figure(vec![curve], None))
    };
    let small = scaled(1.0);
    assert_eq!(frame(&small)[0], 64.0);
    let large = scaled(1e300);
    assert!(large.contains(">−5e299<") && frame(&large)[0] > 64.0, "{large}");
    assert!(scaled(1e7).contains(">−5e6<"));
}

#[test]
fn names_of_limits_close_to_one_another_do_not_overlap() {
    let limit = |name: &str, y: f64| Curve { y: vec![y], ..curve(name, Shape::Horizontal) };
    let curves = vec![curve("c", Shape::Line), limit("first", 0.5), limit("second", 0.49)];
    let svg = text(&figure(curves, None));
    let place = |name: &str| -> (f64, f64) {
        let attributes = text_with(&svg, &format!(">{name}</text>"));
        let number = |key: &str| {
            let (_, rest) = attributes.split_once(&format!(" {key}=\"")).unwrap();
            rest.split('"').next().unwrap().parse::<f64>().unwrap()
        };
        (number("x"), number("y"))
    };
    let (first, second) = (place("first"), place("second"));
    let beside = first.0 - second.0 > 5.0 * 6.0;
    assert!(beside || (second.1 - first.1).abs() > 13.0, "{svg}");
    // The curve ends at the limits, so that no name stands there.
    assert!(first.0 < 986.0 - 4.0 || (first.1 - 175.0) > 13.0, "{svg}");
}

#[test]
fn a_name_stands_where_no_curve_crosses_it() {
    let mut wave = curve("c", Shape::Line);
    wave.x = (0..400).map(|k| f64::from(k) * 0.01).collect();
    // Close to the limit in the right half only.
    wave.y = wave
        .x
        .iter()
        .map(|x| if *x > 2.0 { 0.95 + 0.06 * (40.0 * x).sin() } else { 0.0 })
        .collect();
    let limit = Curve { y: vec![1.0], ..curve("limit of all", Shape::Horizontal) };
    let svg = text(&figure(vec![wave, limit], None));
    let (_, rest) = text_with(&svg, ">limit of all</text>").split_once(" x=\"").unwrap();
    let right: f64 = rest.split('"').next().unwrap().parse().unwrap();
    assert!((64.0..64.0 + 461.0).contains(&right), "{right}");
}

#[test]
fn magnitudes_have_a_logarithmic_axis() {
    let mut figure = figure(vec![curve("c", Shape::Line)], None);
    figure.panels[0].curves[0].y = vec![0.1, 10.0, 100.0];
    figure.panels[0].log_y = true;
    figure.panels[0].y_range = Some([0.1, 100.0]);
    let svg = text(&figure);
    assert_eq!(paths(&svg, "c"), ["M64 266l461-121.4 461-60.6"]);
    assert!(svg.contains(">0.1<") && svg.contains(">100<"));
}
