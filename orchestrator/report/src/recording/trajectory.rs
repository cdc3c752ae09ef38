//! The flight of a run over its planet: altitude over speed with the corridor, and the ground
//! track.

use super::Recording;
use crate::coast;
use crate::figure::{Color, Curve, Panel, Shape};
use crate::run_page::thin;
use cosim::experiment::{Bound, Equilibrium};

/// Height of the panels, px.
const HEIGHT: f64 = 330.0;
/// Width of a panel's axes per height.
const ASPECT: f64 = 1.6;
/// Smallest extent of the map from south to north, deg.
const SMALLEST: f64 = 4.0;

/// A flight at some instants, in the units in which it is drawn.
pub(crate) struct Flight {
    /// Rows of these instants in the recording.
    pub rows: Vec<usize>,
    /// Speed, km/s, and altitude, km.
    pub energy: [Vec<f64>; 2],
    /// Longitude, without jumps by a whole turn, and latitude, deg.
    pub position: [Vec<f64>; 2],
}

/// Returns the flight of a run, if its variables are recorded.
pub(crate) fn flight(run: &Recording) -> Option<Flight> {
    let named = run.observe.trajectory.as_ref()?;
    let rows = thin::frames(run.time.len(), &[]);
    let at = |path: &str, factor: f64| values(run, path, &rows, factor);
    let [longitude, latitude] = &named.position;
    let energy = [at(&named.speed, 1e-3)?, at(&named.altitude, 1e-3)?];
    let degree = 1.0_f64.to_degrees();
    let mut position = [at(longitude, degree)?, at(latitude, degree)?];
    for row in 1..rows.len() {
        let turns = ((position[0][row] - position[0][row - 1]) / 360.0).round();
        position[0][row] -= 360.0 * turns;
    }
    Some(Flight { rows, energy, position })
}

/// Returns the panels of the flights of these runs, whose names distinguish several: altitude over
/// speed, and the ground track. There are none if no run has a trajectory.
pub fn panels(runs: &[Recording], names: &[String]) -> Vec<Panel> {
    let flights = runs.iter().enumerate().filter_map(|(place, run)| {
        let (name, color) = match runs {
            [_] => ("flight", Color::INK),
            _ => (names.get(place)?.as_str(), Color::CURVES[place % Color::CURVES.len()]),
        };
        Some((run, flight(run)?, name, color))
    });
    let flights: Vec<_> = flights.collect();
    let Some((run, first, ..)) = flights.first() else { return Vec::new() };
    let (mut energy, mut track) = (corridor(run, first, runs.len() == 1), Vec::new());
    for (run, flight, name, color) in &flights {
        let line = |[x, y]: &[Vec<f64>; 2]| {
            Curve::new(name, *color, Shape::Patterned(0), x.clone(), y.clone())
        };
        energy.push(line(&flight.energy));
        track.push(line(&flight.position));
        let color = if runs.len() == 1 { Color::CURVES[1] } else { *color };
        track.extend(reversals(run, flight, color));
    }
    track.extend(target(run, first));
    let (longitudes, latitudes) = region(&track);
    let (x, y) = coast::within(longitudes, latitudes);
    track.insert(0, Curve::new("", Color::GREY, Shape::Pale, x, y));
    let panel = |title: &str, x_label: &str, y_label: &str, curves| Panel {
        title: title.into(),
        height: Some(HEIGHT),
        ..Panel::new(x_label, y_label, curves)
    };
    vec![
        panel("Altitude over speed", "speed, km/s", "altitude, km", energy),
        Panel {
            x_range: Some(longitudes),
            y_range: Some(latitudes),
            ..panel("Ground track", "longitude, deg", "latitude, deg", track)
        },
    ]
}

/// Returns the values of a variable at some rows, multiplied by a factor.
fn values(run: &Recording, path: &str, rows: &[usize], factor: f64) -> Option<Vec<f64>> {
    let track = run.tracks.get(path)?;
    Some(rows.iter().map(|row| factor * track.values[*row]).collect())
}

/// Returns the curves that bound the corridor of a flight, as far as their variables are recorded.
/// The density at which a quantity has its limit follows from the flight's own values, and the
/// altitude of this density from the air through which it flew.
fn corridor(run: &Recording, flight: &Flight, is_alone: bool) -> Vec<Curve> {
    let Some(named) = &run.observe.trajectory else { return Vec::new() };
    let at = |path: &str| values(run, path, &flight.rows, 1.0);
    let Some(density) = named.density.as_deref().and_then(at) else { return Vec::new() };
    let air = Air::new(&density, &flight.energy[1]);
    let mut curves = Vec::new();
    let mut add = |name: &str, densities: Vec<f64>, shape| {
        let own = Color::CURVES[curves.len() % Color::CURVES.len()];
        // The colours of several runs distinguish these.
        let color = if is_alone { own } else { Color::LIMIT };
        let altitude = densities.into_iter().map(|density| air.altitude(density)).collect();
        curves.push(Curve::new(name, color, shape, flight.energy[0].clone(), altitude));
    };
    for (place, Bound { name, of, limit, power }) in named.corridor.iter().enumerate() {
        let (Some(values), Some(limits)) = (at(of), at(limit)) else { continue };
        let ratios = limits.iter().zip(&values).map(|(limit, value)| limit / value);
        let bound = density.iter().zip(ratios).map(|(density, r)| density * r.powf(1.0 / power));
        add(name, bound.collect(), Shape::Patterned(place + 1));
    }
    if let Some(needed) = named.equilibrium.as_ref().and_then(|named| glide(run, named, flight)) {
        let bound = density.iter().zip(needed).map(|(density, ratio)| density * ratio).collect();
        add("equilibrium glide", bound, Shape::Patterned(named.corridor.len() + 1));
    }
    curves
}

/// Returns the ratio of the lift that holds the vehicle without bank to its lift.
fn glide(run: &Recording, named: &Equilibrium, flight: &Flight) -> Option<Vec<f64>> {
    let at = |path: &str| values(run, path, &flight.rows, 1.0);
    let (lift, radius, mu) = (at(&named.lift)?, at(&named.radius)?, at(&named.gravitation)?);
    let [speed, altitude] = &flight.energy;
    let ratio = |row: usize| {
        let distance = radius[row] + 1e3 * altitude[row];
        let needed = mu[row] / distance.powi(2) - (1e3 * speed[row]).powi(2) / distance;
        needed / lift[row]
    };
    Some((0..flight.rows.len()).map(ratio).collect())
}

/// Altitude over density of the air through which a flight went.
struct Air(Vec<(f64, f64)>);

impl Air {
    fn new(densities: &[f64], altitudes: &[f64]) -> Self {
        let pairs = densities.iter().map(|density| density.ln()).zip(altitudes.iter().copied());
        let mut pairs: Vec<_> = pairs.filter(|pair| pair.0.is_finite()).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        Self(pairs)
    }

    /// Returns the altitude at which the air has a density; not a number outside of the flight.
    fn altitude(&self, density: f64) -> f64 {
        let wanted = density.ln();
        let after = self.0.partition_point(|pair| pair.0 < wanted);
        let (Some(before), Some(next)) =
            (after.checked_sub(1).map(|before| self.0[before]), self.0.get(after))
        else {
            return f64::NAN;
        };
        before.1 + (next.1 - before.1) * (wanted - before.0) / (next.0 - before.0)
    }
}

/// Returns the places at which the bank was reversed.
fn reversals(run: &Recording, flight: &Flight, color: Color) -> Option<Curve> {
    let counter = run.observe.trajectory.as_ref()?.reversals.as_ref()?;
    let counts = values(run, counter, &flight.rows, 1.0)?;
    let rises = (1..counts.len()).filter(|row| counts[*row] > counts[*row - 1]);
    let rises: Vec<usize> = rises.collect();
    let [x, y] = &flight.position;
    let at = |values: &[f64]| rises.iter().map(|row| values[*row]).collect();
    Some(Curve::new("bank reversal", color, Shape::Dots, at(x), at(y)))
}

/// Returns the target, with the longitude nearest to the end of the flight.
fn target(run: &Recording, flight: &Flight) -> Option<Curve> {
    let [longitude, latitude] = run.observe.trajectory.as_ref()?.target.as_ref()?;
    let last = |path: &str| run.tracks.get(path)?.values.last().map(|value| value.to_degrees());
    let (longitude, latitude) = (last(longitude)?, last(latitude)?);
    let turns = ((flight.position[0].last()? - longitude) / 360.0).round();
    let x = vec![longitude + 360.0 * turns];
    Some(Curve::new("target", Color::INK, Shape::Crosses, x, vec![latitude]))
}

/// Returns the region of a map around these curves, to the scale of its middle latitude: ranges of
/// longitude and latitude, deg.
fn region(curves: &[Curve]) -> ([f64; 2], [f64; 2]) {
    let extent = |values: fn(&Curve) -> &[f64]| {
        let all = curves.iter().flat_map(values).copied().filter(|value| value.is_finite());
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let (x, y) = (extent(|curve| &curve.x), extent(|curve| &curve.y));
    let middle = f64::midpoint(y[0], y[1]);
    let stretch = middle.to_radians().cos().max(0.1) / ASPECT;
    let height = (1.2 * (y[1] - y[0])).max(1.15 * (x[1] - x[0]) * stretch).max(SMALLEST);
    let around = |[low, high]: [f64; 2], size: f64| {
        let centre = f64::midpoint(low, high);
        [centre - size / 2.0, centre + size / 2.0]
    };
    (around(x, height / stretch), around(y, height))
}

#[cfg(test)]
mod tests;
