use super::*;
use cosim::pacing::pacer::{Miss, Step};
use cosim::run::{Observer, Sample};
use cosim::signal::Resolved;
use cosim_metrics::guarantee::{GuaranteeRecord, GuaranteeSignals};
use cosim_report::panels::Curve;
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Cell;

/// Returns the drawn view, line by line without trailing spaces.
fn picture(state: &State, width: u16, height: u16) -> Vec<String> {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| draw(frame, state)).unwrap();
    let buffer = terminal.backend().buffer();
    let cells = buffer.content().chunks(usize::from(width));
    cells
        .map(|row| row.iter().map(Cell::symbol).collect::<String>().trim_end().to_string())
        .collect()
}

fn panel(
    name: &str,
    names: [&str; 3],
    unit: &str,
    factor: f64,
    places: [usize; 3],
    minus: Option<[usize; 3]>,
) -> Panel {
    let signal = |place: usize| Resolved { factor, ..Resolved::variable(place) };
    let curve = |axis: usize| Curve {
        name: names[axis].into(),
        signal: minus.filter(|_| name == "error").map_or(signal(places[axis]), |minus| Resolved {
            factor,
            ..Resolved::difference(places[axis], minus[axis])
        }),
        reference: minus.filter(|_| name == "attitude").map(|minus| signal(minus[axis])),
    };
    let curves = [0, 1, 2].map(curve).into();
    Panel {
        name: name.into(),
        label: name.into(),
        unit: unit.into(),
        factor: 1.0,
        curves,
        limit: None,
    }
}

fn probed(name: &str, place: usize, unit: &str, items: &[(&str, i32)]) -> Probed {
    let items = items.iter().map(|(name, item)| ((*name).to_string(), *item)).collect();
    Probed { name: name.into(), place, unit: unit.into(), items }
}

fn scene() -> Scene {
    let angles = ["alpha", "beta", "sigma"];
    let degrees = 1_f64.to_degrees();
    let limited = |panel: Panel, place: usize, factor: f64| {
        let limit = Some(Resolved { factor, ..Resolved::variable(place) });
        Panel { limit, ..panel }
    };
    let rate = panel("rate", ["p", "q", "r"], "deg/s", degrees, [6, 7, 8], None);
    let moment = panel("moment", ["x", "y", "z"], "kN m", 1e-3, [9, 10, 11], None);
    Scene {
        title: "CRMPC".into(),
        span: [0.0, 50.0],
        factor: Some(1.0),
        components: vec!["controller".into(), "plant".into()],
        panels: vec![
            panel("attitude", angles, "deg", degrees, [0, 1, 2], Some([3, 4, 5])),
            panel("error", angles, "deg", degrees, [0, 1, 2], Some([3, 4, 5])),
            limited(rate, 17, degrees),
            limited(moment, 18, 1e-3),
        ],
        readings: vec![(
            "solver".into(),
            vec![
                probed("controller.solver.status", 15, "", &[("optimal", 1)]),
                probed("controller.solver.time", 12, "s", &[]),
                probed("controller.solver.iterations", 16, "", &[]),
            ],
        )],
        guarantee: None,
        recorded: Vec::new(),
    }
}

fn snapshot(time: f64) -> Snapshot {
    let mut values: Vec<f64> =
        [3.0, 1.0, 0.0, 2.0, 0.0, 0.0, 3.0, 4.0, 0.0].map(f64::to_radians).to_vec();
    values.extend([0.0, 6e4, -8e4, 0.0019, 7.0, 0.0, 1.0, 11.0, 5_f64.to_radians(), 1e5]);
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
    assert!(
        picture[1].starts_with("t = 10.00 s of 50 s, 1.00 of 1 times real time ━"),
        "{}",
        picture[1]
    );
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
    // Both norms are at their limits: ‖(3, 4, 0)‖ = 5 of 5, and ‖(0, 60, -80)‖ = 100 of 100.
    assert!(
        picture[18].starts_with("rate           5.000 of 5.000 deg/s  100.0 % ━"),
        "{}",
        picture[18]
    );
    assert!(
        picture[19].starts_with("moment       100.000 of 100.000 kN m   100.0 % ━"),
        "{}",
        picture[19]
    );
    assert_eq!(
        picture[20..],
        [
            "solver     optimal, time 0.0019 s, iterations 11",
            "deadlines  1 of 500 missed, this step began 0.060 ms late",
            "last miss  plant at t = 9.96 s by 2.500 ms; longest step: controller, 42.000 ms",
            "q: end the run, keep the results",
        ]
    );
    // Braille dots in both charts show that the curves are drawn.
    let dots = |columns: std::ops::Range<usize>| {
        let rows =
            picture[3..12].iter().map(|row| row.chars().skip(columns.start).take(columns.len()));
        rows.flatten().any(|symbol| ('\u{2801}'..='\u{28ff}').contains(&symbol))
    };
    assert!(dots(1..49) && dots(51..99), "{picture:#?}");
}

#[test]
fn the_guarantee_has_a_line_that_turns_red_when_it_is_lost() {
    let signals = GuaranteeSignals {
        in_force: 0,
        status: Some(probed("s.status", 1, "", &[("inForce", 1), ("none", 2), ("exceeded", 5)])),
        margins: vec![("moment".into(), 3), ("rate".into(), 2)],
        keeps: Vec::new(),
    };
    let mut state = State::new(Scene { span: [0.0, 1.0], ..Scene::default() });
    let mut course = GuaranteeRecord::new(signals);
    let mut told = |time: f64, values: [f64; 4]| {
        course.observe(&Sample { tick: 0, time, last: false, values: &values }).unwrap();
        let snapshot = Snapshot {
            time: Some(time),
            values: values.to_vec(),
            guarantee: Some(course.clone()),
            ..Snapshot::default()
        };
        state.see_after(&snapshot, Duration::ZERO);
        let line = super::guarantee(&state).unwrap();
        let is_red = line.spans[1].style.fg == Some(Color::LightRed);
        assert_eq!(picture(&state, 100, 10)[8], line.to_string());
        (line.to_string(), is_red)
    };
    assert_eq!(told(0.0, [0.0, 2.0, 0.0, 0.0]), ("guarantee  not in force (none)".into(), false));
    let line = "guarantee  in force, margins 1.2 % (moment), 3.1 % (rate)";
    assert_eq!(told(0.04, [1.0, 1.0, 0.031, 0.012]), (line.into(), false));
    let line = "guarantee  not in force (exceeded); lost at t = 0.12 s (exceeded)";
    assert_eq!(told(3.0 * 0.04, [0.0, 5.0, 0.0, 0.0]), (line.into(), true));
    let line =
        "guarantee  in force, margins 1.0 % (moment), 2.0 % (rate); lost at t = 0.12 s (exceeded)";
    assert_eq!(told(0.16, [1.0, 1.0, 0.02, 0.01]), (line.into(), true));
}

#[test]
fn a_limit_that_is_exceeded_under_guarantee_is_a_defect_in_red() {
    let mut state = State::new(Scene { span: [0.0, 1.0], ..Scene::default() });
    let mut told = |broken: bool| {
        let mut course = GuaranteeRecord::new(GuaranteeSignals::default());
        course.broken = broken;
        let (values, guarantee) = (vec![1.0], Some(course));
        let snapshot = Snapshot { time: Some(0.0), values, guarantee, ..Snapshot::default() };
        state.see_after(&snapshot, Duration::ZERO);
        let line = super::guarantee(&state).unwrap();
        (line.to_string(), line.spans[1].style.fg == Some(Color::LightRed))
    };
    assert_eq!(told(false), ("guarantee  in force".into(), false));
    let defect = "guarantee  in force; DEFECT: a limit was EXCEEDED in force";
    assert_eq!(told(true), (defect.into(), true));
}

#[test]
fn without_panels_what_is_recorded_is_shown() {
    let recorded = vec![probed("gain.output", 0, "m", &[]), probed("plant.steps", 1, "", &[])];
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
    let course = &state.charts[0].values[0];
    assert!(course.len() <= POINTS && course.len() >= POINTS / 2);
    assert_eq!(course[0].0, 0.0);
    assert!(course.windows(2).all(|pair| pair[0].0 < pair[1].0));
}
