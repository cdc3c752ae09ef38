//! A figure for plotly.js, in which the reader can zoom and hide curves:
//! <https://plotly.com/javascript>.

use super::{Curve, Figure, Panel, Shape};
use serde_json::{Value, json};

/// Height of a row of panels, and of the space above and below all of them, px.
const ROW: usize = 270;
const ABOVE: usize = 70;
const BELOW: usize = 44;
/// Share of the width that is left between panels, and the height that is left between rows, px.
const GAP: f64 = 0.075;
const ROW_GAP: f64 = 60.0;
/// Number of significant digits of a coordinate, which is more than a screen can resolve.
const DIGITS: usize = 6;

/// Returns the source text of the library, which goes into a `script` element of the page once.
pub fn library() -> String {
    // The crate provides two script elements: plotly.js, and a library for formulas, which is not
    // needed.
    let scripts = plotly::Plot::offline_js_sources();
    let inside = scripts.split_once('>').map_or("", |(_, rest)| rest);
    inside.split_once("</script>").map_or(inside, |(first, _)| first).to_string()
}

fn rows(figure: &Figure) -> usize {
    figure.panels.len().div_ceil(figure.columns.max(1)).max(1)
}

/// Returns the height of a figure, px.
pub fn height(figure: &Figure) -> usize {
    ABOVE + ROW * rows(figure)
}

/// Returns the arguments `data` and `layout` of `Plotly.newPlot`.
pub fn plot(figure: &Figure) -> (Value, Value) {
    let (rows, columns, height) = (rows(figure), figure.columns.max(1), height(figure));
    let mut layout = json!({
        "height": height,
        "margin": { "l": 64, "r": 16, "t": ABOVE, "b": BELOW },
        // The legend stands above the panels and their headings.
        "legend": {
            "orientation": "h", "x": 0, "y": 1.0 + 26.0 / (height - ABOVE - BELOW) as f64, "yanchor": "bottom",
            "groupclick": "togglegroup",
        },
        "hovermode": "closest",
        "paper_bgcolor": "rgba(0,0,0,0)",
        "modebar": { "bgcolor": "rgba(0,0,0,0)", "color": "#9aa5b0", "activecolor": "#16324f" },
        "annotations": [],
    });
    let mut data = Vec::new();
    let mut named: Vec<&str> = Vec::new();
    let gap = ROW_GAP / height as f64;
    for (place, panel) in figure.panels.iter().enumerate() {
        let (row, column) = (place / columns, place % columns);
        let number = if place == 0 { String::new() } else { (place + 1).to_string() };
        let width = (1.0 - GAP * (columns - 1) as f64) / columns as f64;
        let left = column as f64 * (width + GAP);
        let tall = (1.0 - gap * (rows - 1) as f64) / rows as f64;
        let top = 1.0 - row as f64 * (tall + gap);
        let lowest = place + columns >= figure.panels.len();
        layout[format!("xaxis{number}")] = axis_x(panel, &number, [left, left + width], lowest);
        layout[format!("yaxis{number}")] = json!({
            "domain": [top - tall, top],
            "anchor": format!("x{number}"),
            "title": { "text": panel.y_label, "standoff": 4 },
            "zeroline": false,
            "gridcolor": "#e4e4e4",
            "range": round(panel.range(false)),
        });
        if !panel.title.is_empty()
            && let Some(annotations) = layout["annotations"].as_array_mut()
        {
            annotations.push(json!({
                "text": panel.title, "showarrow": false, "xref": "paper", "yref": "paper",
                "x": left + width / 2.0, "y": top, "xanchor": "center", "yanchor": "bottom",
            }));
        }
        for curve in &panel.curves {
            let first = !named.contains(&curve.name.as_str());
            if first {
                named.push(&curve.name);
            }
            trace(curve, panel, &number, first, &mut data);
        }
    }
    (data.into(), layout)
}

fn axis_x(panel: &Panel, number: &str, domain: [f64; 2], lowest: bool) -> Value {
    let mut axis = json!({
        "domain": domain,
        "anchor": format!("y{number}"),
        "zeroline": false,
        "gridcolor": "#e4e4e4",
    });
    let (low, high) = panel.range(true);
    if panel.log_x {
        axis["type"] = "log".into();
        axis["range"] = json!([low.log10(), high.log10()]);
    } else {
        axis["range"] = json!([low, high]);
    }
    if lowest {
        axis["title"] = json!({ "text": panel.x_label });
    }
    // Panels over the same range of the same quantity are zoomed together.
    if !number.is_empty()
        && !panel.log_x
        && panel.x_label.starts_with("time")
        && panel.x_range.is_none()
    {
        axis["matches"] = "x".into();
    }
    axis
}

fn trace(curve: &Curve, panel: &Panel, number: &str, first: bool, data: &mut Vec<Value>) {
    let color = curve.color.to_string();
    let mut trace = json!({
        "type": "scatter",
        "mode": "lines",
        "name": curve.name,
        "legendgroup": curve.name,
        "showlegend": first,
        "xaxis": format!("x{number}"),
        "yaxis": format!("y{number}"),
        "line": { "color": color, "width": 1.6 },
    });
    let (low, high) = panel.range(true);
    let (bottom, top) = panel.range(false);
    let (mut x, mut y) = (numbers(&curve.x), numbers(&curve.y));
    let dashed = json!({ "color": color, "width": 1.6, "dash": "dash" });
    match &curve.shape {
        Shape::Line => {}
        Shape::Pale => trace["line"] = json!({ "color": color, "width": 1 }),
        Shape::Dashed => trace["line"] = dashed,
        Shape::Horizontal => {
            (x, y) = (json!([low, high]), json!([y[0], y[0]]));
            trace["line"] = dashed;
        }
        Shape::Vertical => {
            (x, y) = (json!([x[0], x[0]]), json!([bottom, top]));
            trace["line"] = dashed;
        }
        Shape::Band(lower) => {
            let mut under = trace.clone();
            under["x"] = x.clone();
            under["y"] = numbers(lower);
            under["showlegend"] = false.into();
            under["hoverinfo"] = "skip".into();
            under["line"] = json!({ "color": color, "width": 0 });
            data.push(under);
            trace["line"] = json!({ "color": color, "width": 0 });
            trace["fill"] = "tonexty".into();
            trace["fillcolor"] = format!("{color}40").into();
        }
        Shape::Steps => {
            trace["line"] = json!({ "color": color, "width": 1.2, "shape": "hv" });
            trace["fill"] = "tozeroy".into();
            trace["fillcolor"] = format!("{color}60").into();
        }
        Shape::Dots => {
            trace["mode"] = "markers".into();
            trace["marker"] = json!({ "color": color, "size": 6, "opacity": 0.8 });
        }
        Shape::Crosses => {
            trace["mode"] = "markers".into();
            trace["marker"] = json!({ "color": color, "size": 13, "symbol": "x-thin", "line": { "color": color, "width": 3 } });
        }
    }
    trace["x"] = x;
    trace["y"] = y;
    data.push(trace);
}

/// Rounds values to as many digits as can be seen. A value that is not finite becomes a gap.
fn numbers(values: &[f64]) -> Value {
    let short = |value: &f64| {
        format!("{value:.*e}", DIGITS - 1).parse::<f64>().ok().filter(|v| v.is_finite())
    };
    values.iter().map(short).collect()
}

fn round((low, high): (f64, f64)) -> Value {
    numbers(&[low, high])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Color, Legend};

    fn curve(name: &str, shape: Shape) -> Curve {
        Curve {
            name: name.into(),
            color: Color::GREY,
            shape,
            x: vec![0.0, 1.0],
            y: vec![2.0, f64::NAN],
        }
    }

    fn figure(curves: Vec<Curve>) -> Figure {
        let panel = Panel {
            title: "t".into(),
            x_label: "time, s".into(),
            y_label: "y".into(),
            log_x: false,
            x_range: None,
            curves,
        };
        Figure {
            title: "f".into(),
            columns: 1,
            legend: Legend::Above,
            panels: vec![panel.clone(), panel],
        }
    }

    #[test]
    fn the_library_is_javascript_that_ends_no_script_element() {
        let text = library();
        assert!(text.len() > 1_000_000 && text.contains("Plotly") && !text.contains("</script"));
    }

    #[test]
    fn a_name_stands_in_the_legend_once() {
        let (data, _) = plot(&figure(vec![curve("a", Shape::Line), curve("b", Shape::Dots)]));
        let shown: Vec<bool> =
            data.as_array().unwrap().iter().map(|trace| trace["showlegend"] == true).collect();
        assert_eq!(shown, [true, true, false, false]);
    }

    #[test]
    fn what_is_not_finite_is_a_gap() {
        let (data, _) = plot(&figure(vec![curve("a", Shape::Line)]));
        assert!(data[0]["y"][1].is_null() && data[0]["y"][0] == 2.0);
    }
}
