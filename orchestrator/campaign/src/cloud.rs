//! The worst case over the median and the band of the other cases, for each signal that the
//! experiment draws.

use crate::flight::Flight;
use crate::plan::Plan;
use cosim::error::Error;
use cosim::signal::Resolved;
use cosim::variation::SettingValue;
use cosim_metrics::progress::Parts;
use cosim_report::figure::{self, Color, Curve, Figure, Shape, with_unit};
use cosim_report::panels::Panel;
use sweep::closed;
use sweep::runner::{self, Options};
use sweep::threads::Worked;
use sweep::track::Track;

/// Number of cases that the band is made of.
const CASES: u64 = 100;
/// Approximate number of points of the band. The worst case has all of its own: a peak may last for
/// a single step.
const POINTS: u64 = 250;
/// Largest number of panels.
const PANELS: usize = 12;

const BAND: Color = Color::CURVES[0];
const WORST: Color = Color::CURVES[1];

/// Draws the worst case, which has a name and these values, over the band of the first of so many
/// cases. All are flown again on all threads. There is no figure if the experiment draws nothing.
pub(crate) fn draw(
    plan: &Plan,
    name: &str,
    worst: (u64, &[SettingValue]),
    cases: u64,
    options: &Options,
) -> Result<Option<Figure>, Error> {
    let begin = || {
        let mut flight = Flight::new(plan, false, &options.interrupt)?;
        flight.leave_out_margins();
        let panels = Panel::resolve_all(flight.system())?;
        Ok::<_, Error>((flight, panels))
    };
    let (mut flight, panels) = begin()?;
    let curves: Vec<_> = curves(&panels).collect();
    if curves.is_empty() {
        return Ok(None);
    }
    let stride = (flight.system().clock.ticks() / POINTS).max(1);
    let first = (0..cases.min(CASES)).map(|case| (case, plan.sweep.values(case), stride));
    let worst = (worst.0, worst.1.to_vec(), 1);
    let flights: Vec<_> = std::iter::once(worst).chain(first).collect();
    let title = format!("{}, curves of the report", plan.campaign.title);
    let progress = Parts::new("flights", &title, flights.len() as u64, 0, options.quiet);
    let threads = runner::threads(options.jobs, [&plan.sweep]);
    let fly = |(flight, panels): &mut (Flight, Vec<Panel>),
               (case, values, stride): &(u64, Vec<SettingValue>, u64)| {
        let signals = self::curves(panels).map(|(_, (_, signal))| signal.clone()).collect();
        let mut track = Track::new(signals, *stride);
        flight.fly_with(*case, values.clone(), &mut [&mut track])?;
        Ok(track)
    };
    progress.draw_here();
    let (system, closing) = (flight.system().clone(), flight.system().closing());
    let keep = |_: &_, track| {
        progress.advance(1);
        Ok(track)
    };
    let failed = |_: &_, ended| system.ended(ended, &options.interrupt);
    let apart = (closing.as_ref(), &options.interrupt);
    let Worked { results, failures } =
        closed::on_parts(&flights, threads, apart, begin, fly, keep, failed, |_| false);
    progress.finish();
    if let Some(error) = failures.into_values().next() {
        return Err(error);
    }
    let mut tracks = results.into_values();
    let Some(mut bad) = tracks.next() else { return Ok(None) };
    let others: Vec<Track> = tracks.collect();
    let Some(longest) = others.iter().max_by_key(|track| track.time.len()) else { return Ok(None) };
    let time = &longest.time;
    let panels = curves.iter().enumerate().map(|(place, (panel, (curve, _)))| {
        let scaled = |values: Vec<f64>| values.into_iter().map(|v| v * panel.factor).collect();
        let [low, median, high] = bands(&others, place, time.len()).map(scaled);
        let values = scaled(std::mem::take(&mut bad.values[place]));
        let curves = vec![
            Curve::new("5 % to 95 %", BAND, Shape::Band(high), time.clone(), low),
            Curve::new("median", BAND, Shape::Line, time.clone(), median),
            Curve::new(name, WORST, Shape::Line, bad.time.clone(), values),
        ];
        let label = with_unit(&format!("{} {curve}", panel.label), &panel.unit);
        figure::Panel::new("time, s", &label, curves)
    });
    let title =
        format!("The worst case, over the median and the band of the first {} cases", others.len());
    Ok(Some(Figure::new(title, 3, panels.collect())))
}

/// Returns the curves that are drawn, each with its panel.
fn curves(panels: &[Panel]) -> impl Iterator<Item = (&Panel, &(String, Resolved))> {
    panels.iter().flat_map(|panel| panel.curves.iter().map(move |c| (panel, c))).take(PANELS)
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
        let track = |value: f64| {
            let mut track = Track::new(Vec::new(), 1);
            track.time = vec![0.0, 1.0];
            track.values = vec![vec![value, -value]];
            track
        };
        let tracks: Vec<Track> = (1..=20).map(|i| track(f64::from(i))).collect();
        assert_eq!(bands(&tracks, 0, 2), [vec![1.0, -20.0], vec![10.0, -11.0], vec![19.0, -2.0]]);
    }
}
