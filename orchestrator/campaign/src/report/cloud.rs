//! The worst case over the median and the band of the other cases, for each signal that the
//! experiment draws.

use crate::flight::Flight;
use crate::plan::Plan;
use cosim::error::Error;
use cosim::run::{Observer, Sample};
use cosim_report::figure::{self, Color, Curve, Figure, Legend, Shape};
use cosim_report::panels::Panel;

/// Number of cases that the band is made of.
const CASES: u64 = 100;
/// Approximate number of points of the band. The worst case has all of its own: a peak may last for
/// a single step.
const POINTS: u64 = 250;
/// Largest number of panels.
const PANELS: usize = 12;

const BAND: Color = Color::CURVES[0];
const WORST: Color = Color::CURVES[1];

/// Values of all curves of all panels over time.
#[derive(Default)]
struct Track {
    time: Vec<f64>,
    values: Vec<Vec<f64>>,
}

struct Watch<'a> {
    panels: &'a [Panel],
    stride: u64,
    track: Track,
}

impl Observer for Watch<'_> {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        if !sample.tick.is_multiple_of(self.stride) {
            return Ok(());
        }
        self.track.time.push(sample.time);
        let values = self.panels.iter().flat_map(|panel| panel.values(sample.values));
        for (place, value) in values.enumerate() {
            if place == self.track.values.len() {
                self.track.values.push(Vec::new());
            }
            self.track.values[place].push(value);
        }
        Ok(())
    }
}

/// Draws the worst case over the band of the first cases, flown with these instances. There is no
/// figure if the experiment draws nothing.
pub(super) fn draw(
    plan: &Plan,
    mut flight: Flight,
    worst: u64,
    cases: u64,
) -> Result<Option<Figure>, Error> {
    let panels = Panel::resolve_all(flight.system())?;
    if panels.is_empty() {
        return Ok(None);
    }
    let stride = (flight.system().clock.ticks() / POINTS).max(1);
    let mut track = |case: u64, stride: u64| {
        let mut watch = Watch { panels: &panels, stride, track: Track::default() };
        flight.fly_with(case, plan.sweep.values(case), &mut [&mut watch])?;
        Ok::<Track, Error>(watch.track)
    };
    let bad = track(worst, 1)?;
    let others =
        (0..cases.min(CASES)).map(|case| track(case, stride)).collect::<Result<Vec<_>, _>>()?;
    let Some(longest) = others.iter().max_by_key(|track| track.time.len()) else { return Ok(None) };
    let time = &longest.time;
    let mut drawn = Vec::new();
    let mut place = 0;
    for panel in &panels {
        for curve in &panel.curves {
            if drawn.len() < PANELS {
                let [low, median, high] = bands(&others, place, time.len());
                let name = |text: &str| text.to_string();
                let line = |text: &str, color, shape, x: &[f64], y: Vec<f64>| Curve {
                    name: name(text),
                    color,
                    shape,
                    x: x.to_vec(),
                    y,
                };
                let worst_values = bad.values.get(place).cloned().unwrap_or_default();
                let unit =
                    if panel.unit.is_empty() { String::new() } else { format!(", {}", panel.unit) };
                drawn.push(figure::Panel {
                    x_label: "time, s".into(),
                    y_label: format!("{} {}{unit}", panel.label, curve.name),
                    curves: vec![
                        line("5 % to 95 %", BAND, Shape::Band(high), time, low),
                        line("median", BAND, Shape::Line, time, median),
                        line(&format!("case {worst}"), WORST, Shape::Line, &bad.time, worst_values),
                    ],
                    ..figure::Panel::default()
                });
            }
            place += 1;
        }
    }
    let title =
        format!("The worst case, over the median and the band of the first {} cases", others.len());
    Ok(Some(Figure { title, columns: 3.min(drawn.len()), legend: Legend::Above, panels: drawn }))
}

/// Returns the 5 %, 50 % and 95 % quantiles of a curve at each time, over the cases that got there.
fn bands(tracks: &[Track], place: usize, times: usize) -> [Vec<f64>; 3] {
    let mut bands = [Vec::new(), Vec::new(), Vec::new()];
    for time in 0..times {
        let values = tracks.iter().filter_map(|track| track.values.get(place)?.get(time));
        let mut values: Vec<f64> = values.copied().filter(|value| value.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        for (band, share) in bands.iter_mut().zip([0.05, 0.5, 0.95]) {
            let rank = (share * values.len() as f64).ceil() as usize;
            band.push(values.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN));
        }
    }
    bands
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_bands_by_hand() {
        let track = |value: f64| Track { time: vec![0.0, 1.0], values: vec![vec![value, -value]] };
        let tracks: Vec<Track> = (1..=20).map(|i| track(f64::from(i))).collect();
        assert_eq!(bands(&tracks, 0, 2), [vec![1.0, -20.0], vec![10.0, -11.0], vec![19.0, -2.0]]);
    }
}
