//! Layout and drawing of the live view.

use super::Snapshot;
use super::scene::Scene;
use crate::realtime::pacer::Tally;
use crate::report;
use fmu_import::quantity::rounded;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style, Stylize};
use ratatui::symbols::{Marker, line};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, LineGauge, Paragraph};
use std::time::{Duration, Instant};

const ANGLES: [&str; 3] = ["alpha", "beta", "sigma"];
const RATES: [&str; 3] = ["p", "q", "r"];
const AXES: [&str; 3] = ["x", "y", "z"];
const COLORS: [Color; 3] = [Color::LightBlue, Color::LightGreen, Color::LightRed];
/// Largest number of points of a curve; when it is reached, every second point is dropped.
const POINTS: usize = 2000;

/// Curves of three axes, as pairs of time and value.
type Courses = [Vec<(f64, f64)>; 3];

/// Everything that the view has seen of the run so far.
#[derive(Debug, Default)]
pub struct State {
    scene: Scene,
    now: Snapshot,
    began: Option<Instant>,
    elapsed: Duration,
    /// Angles and errors, deg, against time, s.
    attitude: Courses,
    reference: Courses,
    error: Courses,
    /// Whether the run was asked to end.
    pub ending: bool,
}

impl State {
    /// Creates a state that has seen no snapshot yet.
    pub fn new(scene: Scene) -> Self {
        Self { scene, ..Self::default() }
    }

    /// Adds a snapshot to the state.
    pub fn see(&mut self, snapshot: &Snapshot) {
        let began = *self.began.get_or_insert_with(Instant::now);
        self.see_after(snapshot, began.elapsed());
    }

    fn see_after(&mut self, snapshot: &Snapshot, elapsed: Duration) {
        let news = snapshot.time != self.now.time;
        self.now.clone_from(snapshot);
        self.elapsed = elapsed;
        let Some(time) = snapshot.time.filter(|_| news) else { return };
        let places = self.scene.places;
        for axis in 0..3 {
            let degrees = |places: Option<[usize; 3]>| places.map(|p| snapshot.values[p[axis]].to_degrees());
            let (attitude, reference) = (degrees(places.attitude), degrees(places.reference));
            self.attitude[axis].extend(attitude.map(|value| (time, value)));
            self.reference[axis].extend(reference.map(|value| (time, value)));
            self.error[axis].extend(attitude.zip(reference).map(|(a, r)| (time, a - r)));
        }
        for course in [&mut self.attitude, &mut self.reference, &mut self.error].into_iter().flatten() {
            if course.len() >= POINTS {
                let mut keep = false;
                course.retain(|_| {
                    keep = !keep;
                    keep
                });
            }
        }
    }

    fn triple(&self, places: Option<[usize; 3]>) -> Option<[f64; 3]> {
        self.now.time.and(places).map(|places| places.map(|place| self.now.values[place]))
    }

    fn value(&self, place: Option<usize>) -> Option<f64> {
        self.now.time.and(place).map(|place| self.now.values[place])
    }
}

/// Draws the whole view into a frame.
pub fn draw(frame: &mut Frame, state: &State) {
    let numbers = numbers(state);
    let bars = bars(state);
    let mut lines = Vec::new();
    lines.extend(solver(state));
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
    if state.scene.places.attitude.is_some() {
        charts(frame, state, middle);
    } else {
        recorded(frame, state, middle);
    }
    frame.render_widget(Paragraph::new(numbers), number_area);
    for (bar, row) in bars.into_iter().zip(bar_area.rows()) {
        frame.render_widget(bar, row);
    }
    frame.render_widget(Paragraph::new(lines), line_area);
    let foot_text = if state.ending { "ending the run …" } else { "q: end the run, keep the results" };
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
    let legend = |what: &'static str| {
        let mut spans = vec![Span::raw(what)];
        spans.extend(ANGLES.iter().zip(COLORS).map(|(name, color)| Span::styled(format!(" {name}"), color)));
        spans
    };
    let mut angles = legend("attitude, deg:");
    if state.scene.places.reference.is_none() {
        chart(frame, state, Line::from(angles), &[(&state.attitude, true)], area);
        return;
    }
    angles.push(Span::raw(" reference").dark_gray());
    let [left, right] = Layout::horizontal([Constraint::Ratio(1, 2); 2]).areas(area);
    chart(frame, state, Line::from(angles), &[(&state.reference, false), (&state.attitude, true)], left);
    chart(frame, state, Line::from(legend("error, deg:")), &[(&state.error, true)], right);
}

fn chart(frame: &mut Frame, state: &State, title: Line, courses: &[(&Courses, bool)], area: Rect) {
    let datasets = courses.iter().flat_map(|(courses, colored)| {
        courses.iter().zip(COLORS).map(|(course, color)| {
            let color = if *colored { color } else { Color::DarkGray };
            Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line).style(color).data(course)
        })
    });
    let values = courses.iter().flat_map(|(courses, _)| courses.iter().flatten()).map(|(_, value)| *value);
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let (low, high) = if low < high { (low, high) } else { (-1.0, 1.0) };
    let axis = |[low, high]: [f64; 2], decimals: usize| {
        let labels = [low, high].map(|end| format!("{end:.decimals$}"));
        Axis::default().bounds([low, high]).labels(labels).style(Style::new().dark_gray())
    };
    let decimals = if high - low < 5.0 { 2 } else { 0 };
    let chart = Chart::new(datasets.collect())
        .block(Block::bordered().title(title).border_style(Style::new().dark_gray()))
        .x_axis(axis(state.scene.span, 0))
        .y_axis(axis([low, high], decimals));
    frame.render_widget(chart, area);
}

fn recorded(frame: &mut Frame, state: &State, area: Rect) {
    let width = state.scene.recorded.iter().map(|shown| shown.name.chars().count()).max().unwrap_or(0);
    let values: &[f64] = if state.now.time.is_some() { &state.now.values } else { &[] };
    let lines: Vec<Line> = state
        .scene
        .recorded
        .iter()
        .map(|shown| Line::from(format!("{:<width$}  {}", shown.name, shown.text(values))))
        .collect();
    let block = Block::bordered().title("recorded").border_style(Style::new().dark_gray());
    frame.render_widget(Paragraph::new(lines).block(block), area);
}

/// Rows of three numbers each.
fn numbers(state: &State) -> Vec<Line<'static>> {
    let places = &state.scene.places;
    let (attitude, reference) = (state.triple(places.attitude), state.triple(places.reference));
    let error = attitude.zip(reference).map(|(a, r)| [0, 1, 2].map(|axis: usize| a[axis] - r[axis]));
    let degrees = |values: Option<[f64; 3]>| values.map(|values| values.map(f64::to_degrees));
    let kilo = state.triple(places.moment).map(|values| values.map(|value| value / 1e3));
    [
        ("attitude", ANGLES, "deg", degrees(attitude)),
        ("reference", ANGLES, "deg", degrees(reference)),
        ("error", ANGLES, "deg", degrees(error)),
        ("rate", RATES, "deg/s", degrees(state.triple(places.rate))),
        ("moment", AXES, "kN m", kilo),
    ]
    .into_iter()
    .filter_map(|(label, names, unit, values)| {
        let mut spans = vec![Span::raw(format!("{label:<10}"))];
        for ((name, value), color) in names.into_iter().zip(values?).zip(COLORS) {
            spans.push(Span::styled(format!(" {name:>6}"), color));
            spans.push(Span::raw(format!(" {value:>10.4}")));
        }
        spans.push(Span::raw(format!(" {unit}")).dark_gray());
        Some(Line::from(spans))
    })
    .collect()
}

/// Rate and moment against their limits.
fn bars(state: &State) -> Vec<LineGauge<'static>> {
    let places = &state.scene.places;
    let norm = |places| state.triple(places).map(|v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt());
    [
        ("rate", norm(places.rate), state.scene.limits.rate, 1_f64.to_degrees(), "deg/s"),
        ("moment", norm(places.moment), state.scene.limits.moment, 1e-3, "kN m"),
    ]
    .into_iter()
    .filter_map(|(name, norm, limit, scale, unit)| {
        let (norm, limit) = (norm?, limit?);
        let ratio = norm / limit;
        let color = if ratio <= 0.9 {
            Color::LightGreen
        } else if ratio <= 1.0 {
            Color::LightYellow
        } else {
            Color::LightRed
        };
        let label = format!(
            "{name:<10} {:>9.3} of {:.3} {unit:<5} {:>6.1} %",
            norm * scale,
            limit * scale,
            ratio * 100.0
        );
        // What is not a number is not within a limit.
        let filled = if ratio.is_nan() { 1.0 } else { ratio.clamp(0.0, 1.0) };
        let gauge = LineGauge::default().filled_symbol(line::THICK_HORIZONTAL).ratio(filled).label(label);
        Some(gauge.filled_style(color).unfilled_style(Color::DarkGray))
    })
    .collect()
}

fn solver(state: &State) -> Option<Line<'static>> {
    let Scene { places, status, iterations, .. } = &state.scene;
    let mut parts = Vec::new();
    parts.extend(state.now.time.and(status.as_ref()).map(|status| status.text(&state.now.values)));
    parts.extend(state.value(places.solver_time).map(|time| format!("{:.3} ms", time * 1e3)));
    parts.extend(state.value(*iterations).map(|count| format!("{count} iterations")));
    parts.extend(state.value(places.solver_solves).map(|count| format!("{count} solutions")));
    parts.extend(state.value(places.solver_fallbacks).map(|count| format!("{count} fallbacks")));
    (!parts.is_empty()).then(|| Line::from(format!("{:<10} {}", "solver", parts.join(", "))))
}

/// Whether the limits are guaranteed at present; red once that was lost or broken.
fn guarantee(state: &State) -> Option<Line<'static>> {
    let course = state.now.guarantee?;
    let status = |value: f64| {
        let shown = state.scene.guarantee.as_ref();
        shown.map_or(String::new(), |shown| format!(" ({})", shown.text_of(value)))
    };
    let now = if course.is_in_force(&state.now.values) {
        format!("in force{}", report::margins(course.margins_at(&state.now.values)))
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
        spans.push(Span::raw(format!(", time base shifted by {:.1} ms", milliseconds(tally.slipped))));
    }
    let last = tally.last.map(|miss| {
        let name = |index: usize| state.scene.components.get(index).map_or("", String::as_str);
        Line::from(format!(
            "{:<10} {} at t = {} s by {:.3} ms; longest step: {}, {:.3} ms",
            "last miss",
            name(miss.component),
            miss.time,
            milliseconds(miss.late),
            name(miss.longest.component),
            milliseconds(miss.longest.duration)
        ))
    });
    [Line::from(spans)].into_iter().chain(last).collect()
}

#[cfg(test)]
mod tests {
    use super::super::scene::Shown;
    use super::*;
    use crate::guarantee::{Course, Signals};
    use crate::master::{Observer, Sample};
    use crate::metrics::{Limits, Places};
    use crate::realtime::pacer::{Miss, Step};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Cell;

    /// The picture, line by line without trailing spaces.
    fn picture(state: &State, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, state)).unwrap();
        let buffer = terminal.backend().buffer();
        let cells = buffer.content().chunks(usize::from(width));
        cells.map(|row| row.iter().map(Cell::symbol).collect::<String>().trim_end().to_string()).collect()
    }

    fn scene() -> Scene {
        Scene {
            title: "CRMPC".into(),
            span: [0.0, 50.0],
            factor: Some(1.0),
            components: vec!["controller".into(), "plant".into()],
            places: Places {
                attitude: Some([0, 1, 2]),
                reference: Some([3, 4, 5]),
                rate: Some([6, 7, 8]),
                moment: Some([9, 10, 11]),
                solver_time: Some(12),
                solver_solves: Some(13),
                solver_fallbacks: Some(14),
                ..Places::default()
            },
            limits: Limits { rate: Some(5_f64.to_radians()), moment: Some(1e5) },
            status: Some(Shown { place: 15, items: vec![("optimal".into(), 1)], ..Shown::default() }),
            iterations: Some(16),
            guarantee: None,
            recorded: Vec::new(),
        }
    }

    fn snapshot(time: f64) -> Snapshot {
        let mut values: Vec<f64> =
            [3.0, 1.0, 0.0, 2.0, 0.0, 0.0, 3.0, 4.0, 0.0].map(f64::to_radians).to_vec();
        values.extend([0.0, 6e4, -8e4, 0.0019, 7.0, 0.0, 1.0, 11.0]);
        let miss = Miss {
            component: 1,
            time: 9.96,
            late: Duration::from_micros(2500),
            lag: Duration::ZERO,
            longest: Step { component: 0, time: 9.96, duration: Duration::from_millis(42) },
        };
        let lag = Duration::from_micros(60);
        let tally = Tally { deadlines: 500, misses: 1, last: Some(miss), lag, slipped: Duration::ZERO };
        Snapshot { time: Some(time), values, tally: Some(tally), guarantee: None }
    }

    #[test]
    fn a_picture_shows_angles_limits_solver_and_deadlines() {
        let mut state = State::new(scene());
        state.see_after(&snapshot(0.0), Duration::ZERO);
        state.see_after(&snapshot(10.0), Duration::from_secs(10));
        let picture = picture(&state, 100, 24);
        assert_eq!(picture[0], "CRMPC");
        assert!(picture[1].starts_with("t = 10.00 s of 50 s, 1.00 of 1 times real time ━"), "{}", picture[1]);
        assert!(picture[2].contains("attitude, deg: alpha beta sigma reference"), "{}", picture[2]);
        assert!(picture[2].contains("error, deg: alpha beta sigma"), "{}", picture[2]);
        let expected = [
            "attitude    alpha     3.0000   beta     1.0000  sigma     0.0000 deg",
            "reference   alpha     2.0000   beta     0.0000  sigma     0.0000 deg",
            "error       alpha     1.0000   beta     1.0000  sigma     0.0000 deg",
            "rate            p     3.0000      q     4.0000      r     0.0000 deg/s",
            "moment          x     0.0000      y    60.0000      z   -80.0000 kN m",
        ];
        assert_eq!(picture[13..18], expected);
        // ‖(3, 4, 0)‖ of 5 and ‖(0, 60, -80)‖ of 100: both at their limits.
        assert!(picture[18].starts_with("rate           5.000 of 5.000 deg/s  100.0 % ━"), "{}", picture[18]);
        assert!(
            picture[19].starts_with("moment       100.000 of 100.000 kN m   100.0 % ━"),
            "{}",
            picture[19]
        );
        assert_eq!(
            picture[20..],
            [
                "solver     optimal, 1.900 ms, 11 iterations, 7 solutions, 0 fallbacks",
                "deadlines  1 of 500 missed, this step began 0.060 ms late",
                "last miss  plant at t = 9.96 s by 2.500 ms; longest step: controller, 42.000 ms",
                "q: end the run, keep the results",
            ]
        );
        // The curves are there: braille dots in both charts.
        let dots = |columns: std::ops::Range<usize>| {
            let rows = picture[3..12].iter().map(|row| row.chars().skip(columns.start).take(columns.len()));
            rows.flatten().any(|symbol| ('\u{2801}'..='\u{28ff}').contains(&symbol))
        };
        assert!(dots(1..49) && dots(51..99), "{picture:#?}");
    }

    #[test]
    fn the_guarantee_has_a_line_that_turns_red_when_it_is_lost() {
        let items = [("inForce", 1), ("none", 2), ("exceeded", 5)].map(|(name, item)| (name.into(), item));
        let signals = Signals { in_force: 0, status: Some(1), margins: [Some(2), Some(3)] };
        let places = Places { guarantee: Some(signals), ..Places::default() };
        let guarantee = Some(Shown { place: 1, items: items.to_vec(), ..Shown::default() });
        let mut state = State::new(Scene { span: [0.0, 1.0], places, guarantee, ..Scene::default() });
        let mut course = Course::new(places, Limits::default()).unwrap();
        let mut told = |time: f64, values: [f64; 4]| {
            course.observe(&Sample { tick: 0, time, last: false, values: &values }).unwrap();
            let snapshot = Snapshot {
                time: Some(time),
                values: values.to_vec(),
                guarantee: Some(course),
                ..Snapshot::default()
            };
            state.see_after(&snapshot, Duration::ZERO);
            let line = super::guarantee(&state).unwrap();
            let is_red = line.spans[1].style.fg == Some(Color::LightRed);
            assert_eq!(picture(&state, 100, 10)[8], line.to_string());
            (line.to_string(), is_red)
        };
        assert_eq!(told(0.0, [0.0, 2.0, 0.0, 0.0]), ("guarantee  not in force (none)".into(), false));
        let line = "guarantee  in force, margins 3.1 % (rate), 1.2 % (moment)";
        assert_eq!(told(0.04, [1.0, 1.0, 0.031, 0.012]), (line.into(), false));
        let line = "guarantee  not in force (exceeded); lost at t = 0.12 s (exceeded)";
        assert_eq!(told(3.0 * 0.04, [0.0, 5.0, 0.0, 0.0]), (line.into(), true));
        let line = "guarantee  in force, margins 2.0 % (rate), 1.0 % (moment); lost at t = 0.12 s (exceeded)";
        assert_eq!(told(0.16, [1.0, 1.0, 0.02, 0.01]), (line.into(), true));
    }

    #[test]
    fn without_variables_that_have_a_role_what_is_recorded_is_shown() {
        let shown = |name: &str, place, unit: &str| Shown {
            name: name.into(),
            place,
            unit: unit.into(),
            items: Vec::new(),
        };
        let recorded = vec![shown("gain.output", 0, "m"), shown("plant.steps", 1, "")];
        let mut state =
            State::new(Scene { title: "loop".into(), span: [0.0, 3.0], recorded, ..Scene::default() });
        let before = picture(&state, 60, 10);
        assert!(before[3].contains("gain.output") && before[3].contains("NaN"), "{before:#?}");
        let snapshot = Snapshot { time: Some(3.0), values: vec![0.125, 7.0], ..Snapshot::default() };
        state.see_after(&snapshot, Duration::from_secs(1));
        let after = picture(&state, 60, 10);
        assert!(after[1].starts_with("t = 3.00 s of 3 s, 3.00 times real time"), "{after:#?}");
        assert!(after[3].starts_with("│gain.output  0.1250 m"), "{after:#?}");
        assert!(after[4].starts_with("│plant.steps  7"), "{after:#?}");
    }

    #[test]
    fn what_is_not_a_number_and_what_has_no_room_does_no_harm() {
        let mut state = State::new(scene());
        let mut bad = snapshot(1.0);
        bad.values.fill(f64::NAN);
        state.see_after(&bad, Duration::ZERO);
        assert!(picture(&state, 100, 24)[18].contains("NaN %"));
        for (width, height) in [(1, 1), (10, 3), (40, 8), (300, 100)] {
            picture(&state, width, height);
        }
    }

    #[test]
    fn a_long_run_keeps_its_whole_course() {
        let mut state = State::new(scene());
        for tick in 0..10 * POINTS {
            state.see_after(&snapshot(tick as f64), Duration::ZERO);
        }
        let course = &state.attitude[0];
        assert!(course.len() <= POINTS && course.len() >= POINTS / 2);
        assert_eq!(course[0].0, 0.0);
        assert!(course.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }
}
