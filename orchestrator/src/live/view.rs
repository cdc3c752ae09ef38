//! Layout and drawing of the live view.

use super::scene::{self, Scene, Snapshot};
use cosim::pacing::pacer::Tally;
use cosim::system::Probed;
use cosim_report::figure;
use cosim_report::panels::Panel;
use fmi_master::quantity::rounded;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::{Marker, line};
use ratatui::text::{Line, Span};
use ratatui::widgets::{self, Axis, Block, Dataset, GraphType, LineGauge, Paragraph};
use std::time::{Duration, Instant};

/// The colours of figures, for terminals that have them all.
const COLORS: [Color; 6] = {
    let mut colors = [Color::Reset; 6];
    let mut place = 0;
    while place < colors.len() {
        let figure::Color(red, green, blue) = figure::Color::CURVES[place];
        colors[place] = Color::Rgb(red, green, blue);
        place += 1;
    }
    colors
};
/// Number of panels that are drawn as charts.
const CHARTS: usize = 2;
/// Largest number of points of a curve; when it is reached, every second point is dropped.
const POINTS: usize = 2000;

/// A curve, as pairs of time and value.
type Points = Vec<(f64, f64)>;

/// Points of a chart's curves and of the references that they follow.
#[derive(Debug, Default)]
struct Chart {
    values: Vec<Points>,
    references: Vec<Points>,
}

/// Everything that the view has seen of the run so far.
#[derive(Debug, Default)]
pub(crate) struct State {
    scene: Scene,
    now: Snapshot,
    began: Option<Instant>,
    elapsed: Duration,
    charts: Vec<Chart>,
    /// Whether the run was asked to end.
    pub(crate) ending: bool,
}

impl State {
    /// Creates a state that has seen no snapshot yet.
    pub(crate) fn new(scene: Scene) -> Self {
        let empty = |panel: &Panel| Chart {
            values: vec![Points::new(); panel.curves.len()],
            references: vec![Points::new(); panel.curves.len()],
        };
        let charts = scene.panels.iter().take(CHARTS).map(empty).collect();
        Self { scene, charts, ..Self::default() }
    }

    /// Adds a snapshot to the state.
    pub(crate) fn see(&mut self, snapshot: &Snapshot) {
        let began = *self.began.get_or_insert_with(Instant::now);
        self.see_after(snapshot, began.elapsed());
    }

    fn see_after(&mut self, snapshot: &Snapshot, elapsed: Duration) {
        let news = snapshot.time != self.now.time;
        self.now.clone_from(snapshot);
        self.elapsed = elapsed;
        let Some(time) = snapshot.time.filter(|_| news) else { return };
        for (panel, Chart { values, references }) in self.scene.panels.iter().zip(&mut self.charts)
        {
            let seen = &snapshot.values;
            values.iter_mut().zip(panel.values(seen)).for_each(|(curve, y)| curve.push((time, y)));
            let followed = panel.references(seen);
            references.iter_mut().zip(followed).for_each(|(curve, y)| curve.push((time, y)));
            for curve in values.iter_mut().chain(references).filter(|curve| curve.len() >= POINTS) {
                let mut keep = false;
                curve.retain(|_| {
                    keep = !keep;
                    keep
                });
            }
        }
    }

    /// Values at the last communication point that the view has seen, if it has seen one.
    fn values(&self) -> Option<&[f64]> {
        self.now.time.map(|_| self.now.values.as_slice())
    }
}

/// Draws the whole view into a frame.
pub(crate) fn draw(frame: &mut Frame, state: &State) {
    let numbers = numbers(state);
    let bars = bars(state);
    let mut lines = Vec::new();
    lines.extend(readings(state));
    lines.extend(guarantee(state));
    lines.extend(state.now.tally.iter().flat_map(|tally| deadlines(state, tally)));
    let heights = [2, numbers.len() as u16, bars.len() as u16, lines.len() as u16, 1];
    let [head, middle, number_area, bar_area, line_area, foot] = Layout::vertical([
        Constraint::Length(heights[0]),
        Constraint::Min(0),
        Constraint::Length(heights[1]),
        Constraint::Length(heights[2]),
        Constraint::Length(heights[3]),
        Constraint::Length(heights[4]),
    ])
    .areas(frame.area());
    header(frame, state, head);
    if state.charts.is_empty() {
        recorded(frame, state, middle);
    } else {
        charts(frame, state, middle);
    }
    frame.render_widget(Paragraph::new(numbers), number_area);
    for (bar, row) in bars.into_iter().zip(bar_area.rows()) {
        frame.render_widget(bar, row);
    }
    frame.render_widget(Paragraph::new(lines), line_area);
    let foot_text =
        if state.ending { "ending the run …" } else { "q: end the run, keep the results" };
    frame.render_widget(Paragraph::new(foot_text.dark_gray()), foot);
}

fn header(frame: &mut Frame, state: &State, area: Rect) {
    let [start, stop] = state.scene.span;
    let [title, progress] = Layout::vertical([Constraint::Length(1); 2]).areas(area);
    frame.render_widget(Paragraph::new(state.scene.title.as_str().bold()), title);
    let time = state.now.time.unwrap_or(start);
    let elapsed = state.elapsed.as_secs_f64();
    let factor = if elapsed > 0.0 { (time - start) / elapsed } else { 0.0 };
    let asked = state.scene.factor.map_or(String::new(), |asked| format!(" of {asked}"));
    let label = format!("t = {time:.2} s of {stop} s, {factor:.2}{asked} times real time");
    let gauge = LineGauge::default()
        .ratio(((time - start) / (stop - start)).clamp(0.0, 1.0))
        .label(label)
        .filled_symbol(line::THICK_HORIZONTAL)
        .filled_style(Style::new().light_cyan())
        .unfilled_style(Style::new().dark_gray());
    frame.render_widget(gauge, progress);
}

fn charts(frame: &mut Frame, state: &State, area: Rect) {
    let areas = Layout::horizontal(vec![Constraint::Fill(1); state.charts.len()]).split(area);
    for ((panel, drawn), area) in state.scene.panels.iter().zip(&state.charts).zip(areas.iter()) {
        let mut title = vec![Span::raw(format!("{}, {}:", panel.name, panel.unit))];
        let legend = panel.curves.iter().zip(colors());
        title.extend(legend.map(|(curve, color)| Span::styled(format!(" {}", curve.name), color)));
        if panel.has_references() {
            title.push(Span::raw(" reference").dark_gray());
        }
        chart(frame, state, Line::from(title), drawn, *area);
    }
}

fn colors() -> impl Iterator<Item = Color> {
    COLORS.into_iter().cycle()
}

fn chart(frame: &mut Frame, state: &State, title: Line, drawn: &Chart, area: Rect) {
    let pale = drawn.references.iter().map(|curve| (curve, Color::DarkGray));
    let curves: Vec<(&Points, Color)> = pale.chain(drawn.values.iter().zip(colors())).collect();
    let datasets = curves.iter().map(|(curve, color)| {
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(*color)
            .data(curve)
    });
    let values = curves.iter().flat_map(|(curve, _)| curve.iter()).map(|(_, value)| *value);
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let (low, high) = if low < high { (low, high) } else { (-1.0, 1.0) };
    let axis = |[low, high]: [f64; 2], decimals: usize| {
        let labels = [low, high].map(|end| format!("{end:.decimals$}"));
        Axis::default().bounds([low, high]).labels(labels).style(Style::new().dark_gray())
    };
    let decimals = if high - low < 5.0 { 2 } else { 0 };
    let chart = widgets::Chart::new(datasets.collect())
        .block(Block::bordered().title(title).border_style(Style::new().dark_gray()))
        .x_axis(axis(state.scene.span, 0))
        .y_axis(axis([low, high], decimals));
    frame.render_widget(chart, area);
}

fn recorded(frame: &mut Frame, state: &State, area: Rect) {
    let width =
        state.scene.recorded.iter().map(|shown| shown.name.chars().count()).max().unwrap_or(0);
    let values = state.values().unwrap_or_default();
    let lines: Vec<Line> = state
        .scene
        .recorded
        .iter()
        .map(|shown| Line::from(format!("{:<width$}  {}", shown.name, scene::text(shown, values))))
        .collect();
    let block = Block::bordered().title("recorded").border_style(Style::new().dark_gray());
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// Returns a row of numbers for each panel, followed by a row for the references if there are any.
fn numbers(state: &State) -> Vec<Line<'static>> {
    let Some(values) = state.values() else { return Vec::new() };
    let row = |label: &str, panel: &Panel, values: Vec<f64>| {
        let mut spans = vec![Span::raw(format!("{label:<10}"))];
        for ((curve, value), color) in panel.curves.iter().zip(values).zip(colors()) {
            spans.push(Span::styled(format!(" {:>6}", curve.name), color));
            spans.push(Span::raw(format!(" {value:>10.4}")));
        }
        spans.push(Span::raw(format!(" {}", panel.unit)).dark_gray());
        Line::from(spans)
    };
    let rows = state.scene.panels.iter().flat_map(|panel| {
        let values_row = row(&panel.name, panel, panel.values(values).collect());
        let followed = panel.has_references();
        let followed =
            followed.then(|| row("reference", panel, panel.references(values).collect()));
        [Some(values_row), followed].into_iter().flatten()
    });
    rows.collect()
}

/// Returns a bar for each panel with a limit, which compares the norm of its values with the limit.
fn bars(state: &State) -> Vec<LineGauge<'static>> {
    let values = state.values();
    let limited = state.scene.panels.iter().filter_map(|panel| {
        let limit = panel.limit_in(values?)?;
        let norm = panel.values(values?).map(|x| x * x).sum::<f64>().sqrt();
        Some((panel, norm, limit))
    });
    limited
        .map(|(panel, norm, limit)| {
            let ratio = norm / limit;
            let color = if ratio <= 0.9 {
                Color::LightGreen
            } else if ratio <= 1.0 + 1e-9 {
                Color::LightYellow
            } else {
                Color::LightRed
            };
            let label = format!(
                "{:<10} {norm:>9.3} of {limit:.3} {:<5} {:>6.1} %",
                panel.name,
                panel.unit,
                ratio * 100.0
            );
            // A value that is not a number is not within a limit, so the bar is drawn full.
            let filled = if ratio.is_nan() { 1.0 } else { ratio.clamp(0.0, 1.0) };
            let gauge = LineGauge::default()
                .filled_symbol(line::THICK_HORIZONTAL)
                .ratio(filled)
                .label(label);
            gauge.filled_style(color).unfilled_style(Color::DarkGray)
        })
        .collect()
}

/// Returns the lines of variables that the experiment names.
fn readings(state: &State) -> Vec<Line<'static>> {
    let Some(values) = state.values() else { return Vec::new() };
    let line = |(heading, variables): &(String, Vec<Probed>)| {
        let texts: Vec<String> = variables
            .iter()
            .map(|variable| {
                let name = variable.name.rsplit('.').next().unwrap_or_default();
                let text = scene::text(variable, values);
                if variable.items.is_empty() { format!("{name} {}", text.trim()) } else { text }
            })
            .collect();
        Line::from(format!("{heading:<10} {}", texts.join(", ")))
    };
    state.scene.readings.iter().map(line).collect()
}

/// Returns a line that says whether the guarantee is in force. It turns red once the guarantee was
/// lost or broken.
fn guarantee(state: &State) -> Option<Line<'static>> {
    let course = state.now.guarantee.as_ref()?;
    let status = |value: f64| format!(" ({})", course.name_of(value));
    let now = if course.is_in_force(&state.now.values) {
        format!("in force{}", course.margins_text(&course.margins_at(&state.now.values)))
    } else {
        format!("not in force{}", course.status_now().map_or(String::new(), status))
    };
    let lost = course.lost.map_or(String::new(), |loss| {
        let reason = loss.status.map_or(String::new(), status);
        format!("; lost at t = {} s{reason}", rounded(loss.time))
    });
    let broken = if course.broken { "; DEFECT: a limit was EXCEEDED in force" } else { "" };
    let text = Span::raw(now + &lost + broken);
    let text = if course.lost.is_some() || course.broken { text.light_red() } else { text };
    Some(Line::from(vec![Span::raw(format!("{:<10} ", "guarantee")), text]))
}

fn deadlines(state: &State, tally: &Tally) -> Vec<Line<'static>> {
    let milliseconds = |duration: Duration| duration.as_secs_f64() * 1e3;
    let count = format!("{} of {} missed", tally.misses, tally.deadlines);
    let mut spans = vec![
        Span::raw(format!("{:<10} ", "deadlines")),
        if tally.misses == 0 { Span::raw(count) } else { Span::raw(count).light_red() },
        Span::raw(format!(", this step began {:.3} ms late", milliseconds(tally.lag))),
    ];
    if !tally.slipped.is_zero() {
        spans.push(Span::raw(format!(
            ", time base shifted by {:.1} ms",
            milliseconds(tally.slipped)
        )));
    }
    let last = tally.last.map(|miss| {
        let name = |index: usize| state.scene.components.get(index).map_or("", String::as_str);
        Line::from(format!(
            "{:<10} {} at t = {} s by {:.3} ms; longest step: {}, {:.3} ms",
            "last miss",
            name(miss.component),
            rounded(miss.time),
            milliseconds(miss.late),
            name(miss.longest.component),
            milliseconds(miss.longest.duration)
        ))
    });
    [Line::from(spans)].into_iter().chain(last).collect()
}

#[cfg(test)]
mod tests;
