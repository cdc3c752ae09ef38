//! Signals of a run that the figures of a study draw.

use cosim::signal::Signal;
use cosim::system::Parameters;
use linear::curves::ResponseCurves;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Results of a part besides its numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Curves {
    /// Signals of the run's first case, if it belongs to the part.
    pub series: Option<Series>,
    /// Parameters of all components in the first case, if it belongs to the part.
    pub parameters: Parameters,
    /// Smallest and largest value of each signal over the cases, at each communication point.
    pub spread: BTreeMap<Signal, Spread>,
}

/// Time series of signals.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Simulated times of the communication points, s.
    pub time: Vec<f64>,
    /// Values at these times, in the unit in which they are shown.
    pub signals: BTreeMap<Signal, Vec<f64>>,
    /// Frequency responses of the loop, if a figure draws them.
    pub response: Option<ResponseCurves>,
}

/// Smallest and largest value at each communication point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest value at each communication point.
    pub low: Vec<f64>,
    /// Largest value at each communication point.
    pub high: Vec<f64>,
}

/// Extends the bands of signals so that they also cover others.
pub(crate) fn widen(
    bands: &mut BTreeMap<Signal, Spread>,
    others: impl IntoIterator<Item = (Signal, Spread)>,
) {
    for (signal, other) in others {
        let Some(band) = bands.get_mut(&signal) else {
            bands.insert(signal, other);
            continue;
        };
        band.low.iter_mut().zip(other.low).for_each(|(least, low)| *least = least.min(low));
        band.high.iter_mut().zip(other.high).for_each(|(most, high)| *most = most.max(high));
    }
}

/// Returns the bands of one run, which have no width.
pub(crate) fn bands<'a>(
    signals: impl Iterator<Item = (&'a Signal, &'a Vec<f64>)>,
) -> Vec<(Signal, Spread)> {
    let band = |values: &Vec<f64>| Spread { low: values.clone(), high: values.clone() };
    signals.map(|(signal, values)| (signal.clone(), band(values))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_holds_all_values() {
        let mut bands = BTreeMap::new();
        let signal = Signal::try_from("a.b".to_string()).unwrap();
        for values in [vec![1.0, 5.0], vec![2.0, 3.0]] {
            let spread = Spread { low: values.clone(), high: values };
            widen(&mut bands, [(signal.clone(), spread)]);
        }
        assert_eq!(bands[&signal], Spread { low: vec![1.0, 3.0], high: vec![2.0, 5.0] });
    }
}
