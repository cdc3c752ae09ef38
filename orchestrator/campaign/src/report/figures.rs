//! Histograms and scatter plots of a campaign's cases.

use crate::findings::breaking;
use crate::plan::Plan;
use crate::prepare::Recorded;
use cosim_report::figure::{Color, Curve, Figure, Panel, Shape, with_unit};
use std::collections::BTreeSet;
use sweep::table::CaseTable;
use sweep::varied::Varied;

const FIRST: Color = Color::CURVES[0];
const SECOND: Color = Color::CURVES[1];
/// Largest number of bins of a histogram.
const BINS: usize = 60;
/// Approximate largest number of dots in a panel.
const POINTS: usize = 600;
/// Largest number of cases that are marked in a panel.
const MARKED: usize = 300;
/// Number of panels side by side.
const COLUMNS: usize = 3;
/// Largest number of parameters and of measures whose scatter plots are drawn.
const PARAMETERS: usize = 12;
const MEASURES: usize = 3;

fn label(measure: &Recorded) -> String {
    with_unit(&measure.words, &measure.unit)
}

/// Draws the histogram of each measure that differs from case to case.
pub(super) fn distributions(plan: &Plan, table: &CaseTable) -> Option<Figure> {
    let mut panels = Vec::new();
    for measure in &plan.recorded {
        let mut values = table.numbers(&measure.name);
        values.retain(|value| value.is_finite());
        values.sort_unstable_by(f64::total_cmp);
        let (Some(low), Some(high)) = (values.first().copied(), values.last().copied()) else {
            continue;
        };
        if low == high {
            continue;
        }
        let (edges, counts) = histogram(&values, low, high);
        let mut curves = vec![Curve::new("cases", FIRST, Shape::Steps, edges, counts)];
        let limits = plan.limits().filter(|(limit, _)| limit.measure.get_ref() == &measure.name);
        curves.extend(limits.map(|(limit, _)| {
            let at = vec![limit.bound().0];
            Curve::new("limit", Color::LIMIT, Shape::Vertical, at, vec![f64::NAN])
        }));
        panels.push(Panel::new(&label(measure), "number of cases", curves));
    }
    let title = format!("Distributions over {}", super::cases(table.rows() as u64));
    (!panels.is_empty()).then(|| Figure::new(title, COLUMNS, panels))
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
pub(super) fn scatters(plan: &Plan, table: &CaseTable) -> Vec<Figure> {
    let limits = plan.campaign.limits.iter();
    let bad: BTreeSet<usize> = limits.flat_map(|limit| breaking(table, limit)).collect();
    let mut shown: Vec<(&Varied, Vec<f64>)> = Vec::new();
    for varied in plan.sweep.varied.iter().filter(|varied| !varied.is_seed()) {
        let values = table.numbers(&varied.name);
        if shown.len() < PARAMETERS && values.iter().any(|value| value.is_finite()) {
            shown.push((varied, values));
        }
    }
    let limited = |measure: &&Recorded| {
        plan.limits().any(|(limit, _)| limit.measure.get_ref() == &measure.name)
    };
    let mut measures: Vec<&Recorded> = plan.recorded.iter().filter(limited).collect();
    measures.extend(plan.recorded.iter().filter(|measure| !limited(measure)));
    let stride = table.rows().div_ceil(POINTS).max(1);
    let mut figures = Vec::new();
    for measure in measures.into_iter().take(MEASURES) {
        let y = table.numbers(&measure.name);
        let finite = || y.iter().filter(|value| value.is_finite());
        if finite().all(|value| Some(value) == finite().next()) {
            continue;
        }
        let panels = shown.iter().map(|(varied, x)| {
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
            Panel { title, ..Panel::new("", &label(measure), curves) }
        });
        let panels: Vec<Panel> = panels.collect();
        if !panels.is_empty() {
            let title = format!("{} against the varied parameters", measure.words);
            figures.push(Figure::new(title, COLUMNS, panels));
        }
    }
    figures
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_a_histogram_by_hand() {
        let (edges, counts) = histogram(&[0.0, 0.1, 0.2, 0.5, 1.0], 0.0, 1.0);
        assert_eq!(counts, [2.0, 1.0, 1.0, 0.0, 1.0, 0.0]);
        assert!(
            edges.iter().zip([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]).all(|(a, b)| (a - b).abs() < 1e-12)
        );
    }
}
