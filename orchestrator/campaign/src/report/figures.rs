//! Histograms, empirical distributions and scatter plots of a campaign's cases.

use crate::findings::{Findings, breaking};
use crate::plan::Plan;
use crate::prepare::Recorded;
use cosim::error::Error;
use cosim_report::figure::{Color, Curve, Figure, Legend, Panel, Shape, with_unit};
use std::collections::BTreeSet;
use sweep::table::Reader;
use sweep::varied::Varied;

const FIRST: Color = Color::CURVES[0];
const SECOND: Color = Color::CURVES[1];
/// Largest number of bins of a histogram.
const BINS: usize = 60;
/// Approximate largest number of points of a curve or of dots in a panel.
const POINTS: usize = 600;
/// Largest number of cases that are marked in a panel.
const MARKED: usize = 300;
/// Largest number of values of a parameter whose cases are spread to strips.
const STRIPS: usize = 5;
/// Largest number of parameters and of measures whose scatter plots are drawn.
const PARAMETERS: usize = 12;
const MEASURES: usize = 3;

fn label(measure: &Recorded) -> String {
    with_unit(&measure.words, &measure.unit)
}

fn panel(x_label: &str, y_label: &str, curves: Vec<Curve>) -> Panel {
    Panel { x_label: x_label.into(), y_label: y_label.into(), curves, ..Panel::default() }
}

/// Draws the histogram and the empirical distribution of each measure.
pub(super) fn distributions(
    plan: &Plan,
    findings: &Findings,
    table: &Reader,
) -> Result<Vec<Figure>, Error> {
    let mut figures = Vec::new();
    for measure in &plan.recorded {
        let mut values = table.column(&measure.name)?.numbers();
        values.retain(|value| value.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        let (Some(low), Some(high)) = (values.first().copied(), values.last().copied()) else {
            continue;
        };
        if low == high {
            continue;
        }
        let limits = plan.limits().filter(|(limit, _)| limit.measure.get_ref() == &measure.name);
        let limits: Vec<f64> =
            limits.filter_map(|(limit, _)| limit.at_most.or(limit.at_least)).collect();
        let marks = || {
            let mark = |limit: &f64| {
                Curve::new("limit", Color::LIMIT, Shape::Vertical, vec![*limit], vec![f64::NAN])
            };
            limits.iter().map(mark)
        };
        let (edges, counts) = histogram(&values, low, high);
        let mut bars = vec![Curve::new("cases", FIRST, Shape::Steps, edges, counts)];
        bars.extend(marks());
        let mut panels = vec![panel(&label(measure), "number of cases", bars)];
        let n = values.len();
        // Every value at the upper end, where values are few and matter most; fewer below.
        let tail = n.saturating_sub(POINTS / 3);
        let stride = tail.div_ceil(POINTS).max(1);
        let places = || (0..tail).step_by(stride).chain(tail..n);
        let x = places().map(|i| values[i]).collect();
        let y = places().map(|i| (i + 1) as f64 / n as f64).collect();
        let mut steps =
            vec![Curve::new("share of cases up to this value", SECOND, Shape::Line, x, y)];
        steps.extend(marks());
        panels.push(panel(&label(measure), "share of cases", steps));
        let title =
            format!("Distribution of {} over {}", measure.words, super::cases(findings.cases));
        figures.push(Figure { title, columns: 2, legend: Legend::Above, panels });
    }
    Ok(figures)
}

/// Returns the edges of a histogram's bins and the number of values in each; the last edge has no
/// values.
fn histogram(sorted: &[f64], low: f64, high: f64) -> (Vec<f64>, Vec<f64>) {
    let bins = ((sorted.len() as f64).sqrt().ceil() as usize).clamp(5, BINS);
    let width = (high - low) / bins as f64;
    let mut counts = vec![0.0; bins + 1];
    for value in sorted {
        let bin = (((value - low) / width) as usize).min(bins - 1);
        counts[bin] += 1.0;
    }
    ((0..=bins).map(|bin| low + bin as f64 * width).collect(), counts)
}

/// Draws measures against the parameters that vary, with the cases marked that broke a limit, were
/// lost or failed.
pub(super) fn scatters(plan: &Plan, table: &Reader) -> Result<Vec<Figure>, Error> {
    let mut bad = BTreeSet::new();
    for limit in &plan.campaign.limits {
        bad.extend(breaking(table, limit)?.into_iter().map(|case| case as usize));
    }
    let mut shown: Vec<(&Varied, Vec<f64>)> = Vec::new();
    for varied in plan.sweep.varied.iter().filter(|varied| !varied.is_seed()) {
        let values = table.column(&varied.name)?.numbers();
        if shown.len() < PARAMETERS && values.iter().any(|value| value.is_finite()) {
            shown.push((varied, values));
        }
    }
    let limited = |measure: &&Recorded| {
        plan.limits().any(|(limit, _)| limit.measure.get_ref() == &measure.name)
    };
    let mut measures: Vec<&Recorded> = plan.recorded.iter().filter(limited).collect();
    measures.extend(plan.recorded.iter().filter(|measure| !limited(measure)));
    let stride = (table.rows() as usize).div_ceil(POINTS).max(1);
    let mut figures = Vec::new();
    for measure in measures.into_iter().take(MEASURES) {
        let y = table.column(&measure.name)?.numbers();
        let finite = || y.iter().filter(|value| value.is_finite());
        if finite().all(|value| Some(value) == finite().next()) {
            continue;
        }
        let panels = shown.iter().map(|(varied, x)| {
            let x = strips(x);
            let pick = |cases: &mut dyn Iterator<Item = usize>| -> (Vec<f64>, Vec<f64>) {
                cases.filter(|i| y[*i].is_finite()).map(|i| (x[i], y[i])).unzip()
            };
            let (all_x, all_y) = pick(&mut (0..y.len()).step_by(stride));
            let (bad_x, bad_y) = pick(&mut bad.iter().copied().take(MARKED));
            let mut curves = vec![Curve::new("cases", FIRST, Shape::Dots, all_x, all_y)];
            if !bad_x.is_empty() {
                curves.push(Curve::new("broke a limit", SECOND, Shape::Dots, bad_x, bad_y));
            }
            let title = with_unit(&varied.name, &varied.unit);
            Panel { title, ..panel("", &label(measure), curves) }
        });
        let panels: Vec<Panel> = panels.collect();
        if !panels.is_empty() {
            let title = format!("{} against the varied parameters", measure.words);
            let columns = 3.min(panels.len());
            figures.push(Figure { title, columns, legend: Legend::Above, panels });
        }
    }
    Ok(figures)
}

/// Returns the values of a parameter as places in a scatter plot. Few values are spread to strips,
/// in which the cases can be told apart.
fn strips(values: &[f64]) -> Vec<f64> {
    let mut distinct: Vec<f64> = Vec::new();
    for value in values.iter().filter(|value| value.is_finite()) {
        if !distinct.contains(value) {
            distinct.push(*value);
        }
        if distinct.len() > STRIPS {
            return values.to_vec();
        }
    }
    distinct.sort_by(f64::total_cmp);
    let gaps = distinct.windows(2).map(|pair| pair[1] - pair[0]);
    let gap = gaps.reduce(f64::min).unwrap_or(0.0);
    // Fractions of multiples of the golden ratio are evenly spread.
    let shift = |place: usize| (place as f64 * 0.618_034).fract() - 0.5;
    values.iter().enumerate().map(|(place, value)| value + 0.4 * gap * shift(place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_of_a_parameter_become_strips_that_do_not_meet() {
        let two: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 0.0 } else { 3.0 }).collect();
        let spread = strips(&two);
        assert!(two.iter().zip(&spread).all(|(value, place)| (place - value).abs() < 0.61));
        assert!(spread[0] != spread[2] && spread[1] != spread[3]);
        let many: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(strips(&many), many);
        assert_eq!(strips(&[1.0, 1.0]), [1.0, 1.0]);
    }

    #[test]
    fn oracle_a_histogram_by_hand() {
        let (edges, counts) = histogram(&[0.0, 0.1, 0.2, 0.5, 1.0], 0.0, 1.0);
        assert_eq!(counts, [2.0, 1.0, 1.0, 0.0, 1.0, 0.0]);
        assert!(
            edges.iter().zip([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12)
        );
    }
}
