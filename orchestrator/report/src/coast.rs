//! The coasts of the Earth, for maps.

use crate::figure::clip::{Point, clipped};

const COASTS: &str = include_str!("coast.txt");
/// Parts of a degree in which the coasts are stored.
const PARTS: f64 = 20.0;

/// Returns the coasts within a region as one line with gaps, which are not numbers: longitudes and
/// latitudes, deg. The longitudes of the region may lie beyond ±180 deg.
pub(crate) fn within(longitudes: [f64; 2], latitudes: [f64; 2]) -> (Vec<f64>, Vec<f64>) {
    let (low, high) = ((longitudes[0], latitudes[0]), (longitudes[1], latitudes[1]));
    let mut line: Vec<Point> = Vec::new();
    for coast in COASTS.lines().filter(|line| !line.starts_with('#')) {
        let points = points(coast);
        for turn in [-360.0, 0.0, 360.0] {
            for pair in points.windows(2) {
                let [a, b] = [pair[0], pair[1]].map(|(x, y)| (x + turn, y));
                let Some((begin, end)) = clipped(a, b, low, high) else { continue };
                if line.last() != Some(&begin) {
                    line.extend([(f64::NAN, f64::NAN), begin]);
                }
                line.push(end);
            }
        }
    }
    line.into_iter().unzip()
}

/// Reads the points of a coast, deg.
fn points(coast: &str) -> Vec<Point> {
    let numbers: Vec<f64> = coast.split(' ').filter_map(|number| number.parse().ok()).collect();
    let mut at = (0.0, 0.0);
    let (steps, _) = numbers.as_chunks::<2>();
    let next = |step: &[f64; 2]| {
        at = (at.0 + step[0], at.1 + step[1]);
        (at.0 / PARTS, at.1 / PARTS)
    };
    steps.iter().map(next).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance of a place from the nearest point of the coast around it, deg.
    fn distance(longitude: f64, latitude: f64) -> f64 {
        let around = |at: f64| [at - 2.0, at + 2.0];
        let (x, y) = within(around(longitude), around(latitude));
        let away = |(x, y): (&f64, &f64)| (x - longitude).hypot(y - latitude);
        x.iter().zip(&y).map(away).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn published_places_at_the_sea_lie_at_the_coast() {
        // Capes whose positions every atlas has: Good Hope, Comorin, Finisterre, Canaveral, York.
        for (longitude, latitude) in
            [(18.47, -34.36), (77.54, 8.08), (-9.27, 42.88), (-80.54, 28.46), (142.53, -10.69)]
        {
            let away = distance(longitude, latitude);
            assert!(away < 0.4, "{longitude} {latitude}: {away}");
            assert!((distance(longitude + 360.0, latitude) - away).abs() < 1e-9);
        }
        // Far from any coast.
        assert_eq!(distance(80.0, 50.0), f64::INFINITY);
    }

    #[test]
    fn nothing_lies_outside_the_region() {
        let (x, y) = within([170.0, 200.0], [-50.0, 10.0]);
        assert!(x.len() > 100 && x.len() == y.len());
        let within = |values: &[f64], low, high| {
            values.iter().all(|value| value.is_nan() || (low..=high).contains(value))
        };
        assert!(within(&x, 170.0, 200.0) && within(&y, -50.0, 10.0));
    }
}
