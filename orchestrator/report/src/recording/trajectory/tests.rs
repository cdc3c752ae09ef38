use super::*;
use crate::recording::Track;
use cosim::experiment::Observe;

/// A flight down through air whose density falls by the factor e every 7 km, over the date line.
fn descent() -> Recording {
    let observe = r#"
        altitude = "p.h"
        speed = "p.v"
        position = ["p.lon", "p.lat"]
        target = ["g.lon", "g.lat"]
        reversals = "g.reversals"
        density = "p.rho"
        corridor = [
            { name = "heat flux", of = "p.flux", limit = "g.flux", power = 0.5 },
            { name = "load", of = "p.load", limit = "g.load" },
            { name = "none", of = "p.none", limit = "g.load" },
        ]
        equilibrium = { lift = "p.lift", radius = "g.radius", gravitation = "g.mu" }"#;
    let trajectory = Some(toml::from_str(observe).unwrap());
    let rows = 101;
    let over = |value: fn(f64) -> f64| (0..rows).map(|row| value(f64::from(row) / 100.0)).collect();
    let altitude = |s: f64| 100e3 - 80e3 * s;
    let tracks: [(&str, Vec<f64>); 15] = [
        ("p.h", over(altitude)),
        ("p.v", over(|s| 7500.0 - 6500.0 * s)),
        ("p.lon", over(|s| (170.0 + 20.0 * s + if s > 0.5 { -360.0 } else { 0.0 }).to_radians())),
        ("p.lat", over(|s| (10.0 * s).to_radians())),
        ("g.lon", over(|_| -169.0_f64.to_radians())),
        ("g.lat", over(|_| 10.0_f64.to_radians())),
        ("g.reversals", over(|s| if s > 0.3 { 1.0 } else { 0.0 })),
        ("p.rho", over(|s| (-(100e3 - 80e3 * s) / 7e3).exp())),
        // Proportional to the root of the density, and to the density.
        ("p.flux", over(|s| (-(100e3 - 80e3 * s) / 14e3).exp())),
        ("g.flux", over(|_| (-50.0_f64 / 14.0).exp())),
        ("p.load", over(|s| (-(100e3 - 80e3 * s) / 7e3).exp())),
        ("g.load", over(|_| (-30.0_f64 / 7.0).exp())),
        // Twice what is needed without speed.
        ("p.lift", over(|s| 2.0 * 3.986e14 / (6.478e6 - 80e3 * s).powi(2))),
        ("g.radius", over(|_| 6.378e6)),
        ("g.mu", over(|_| 3.986e14)),
    ];
    let track = |values| Track { factor: 1.0, values, ..Track::default() };
    Recording {
        time: (0..rows).map(f64::from).collect(),
        tracks: tracks.map(|(name, values)| (name.to_string(), track(values))).into(),
        observe: Observe { trajectory, ..Observe::default() },
        ..Recording::default()
    }
}

fn curve<'a>(panel: &'a Panel, name: &str) -> &'a Curve {
    panel.curves.iter().find(|curve| curve.name == name).unwrap()
}

#[test]
fn oracle_the_corridor_lies_where_exponential_air_has_the_density_of_each_limit() {
    let panels = panels(&[descent()], &["run".into()]);
    let names: Vec<&str> = panels[0].curves.iter().map(|curve| curve.name.as_str()).collect();
    // A limit whose quantity is not recorded is left out.
    assert_eq!(names, ["heat flux", "load", "equilibrium glide", "flight"]);
    for (name, altitude) in [("heat flux", 50.0), ("load", 30.0)] {
        let bound = curve(&panels[0], name);
        assert!(bound.y.iter().all(|y| (y - altitude).abs() < 1e-6), "{name}: {:?}", bound.y);
    }
    // Where the speed holds half of the weight, the needed lift is a quarter of the flight's: the
    // air there is that of ln 4 scale heights above the flight.
    let glide = curve(&panels[0], "equilibrium glide");
    let half = |row: &usize| (1e3 * glide.x[*row]).powi(2) < 3.986e14 / (6.378e6 + 50e3) / 2.0;
    let row = (0..101).find(half).unwrap();
    let altitude = 100.0 - 0.8 * row as f64;
    assert!((glide.y[row] - altitude - 7.0 * 4.0_f64.ln()).abs() < 0.3, "{}", glide.y[row]);
}

#[test]
fn a_ground_track_over_the_date_line_has_no_jump_and_its_target_beside_it() {
    let panels = panels(&[descent()], &["run".into()]);
    let [track, target, reversal] =
        ["flight", "target", "bank reversal"].map(|name| curve(&panels[1], name));
    assert!(track.x.windows(2).all(|pair| (pair[1] - pair[0] - 0.2).abs() < 1e-9));
    assert!((target.x[0] - 191.0).abs() < 1e-9);
    assert!(reversal.x.len() == 1 && (reversal.x[0] - 176.2).abs() < 1e-9, "{:?}", reversal.x);
    let ([west, east], [south, north]) = (panels[1].x_range.unwrap(), panels[1].y_range.unwrap());
    assert!(west < 170.0 && east > 191.0 && south < 0.0 && north > 10.0);
    // A degree of latitude is as long as one of longitude at the equator.
    let stretch = (east - west) / (north - south) / ASPECT;
    assert!((stretch * 5.0_f64.to_radians().cos() - 1.0).abs() < 1e-9);
}

#[test]
fn a_run_without_a_position_has_no_flight() {
    let mut run = descent();
    run.tracks.remove("p.lon");
    assert_eq!(panels(&[run, Recording::default()], &["a".into(), "b".into()]).len(), 0);
}
