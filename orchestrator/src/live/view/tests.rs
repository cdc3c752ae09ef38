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
