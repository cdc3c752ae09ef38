//! Effectors of the vehicle: eight aerodynamic surfaces and ten jets, Wu 2015 (57)–(59), (63)–(65).

use crate::data;
use crate::error::Error;
use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

/// Number of aerodynamic surfaces of the vehicle.
pub const SURFACES: usize = 8;
/// Number of reaction control jets of the vehicle.
pub const JETS: usize = 10;

/// Vector with one number for each surface.
pub type Surfaces = SVector<f64, SURFACES>;
/// Vector with one number for each jet.
pub type Jets = SVector<f64, JETS>;

const EFFECTORS: (&str, &str) = ("effectors.toml", include_str!("../data/effectors.toml"));

/// Moments and limits of the surfaces and jets. Moments act about the body axes x forward, y right,
/// z down; a deflection with the trailing edge down is positive.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Effectors {
    /// Surface effectiveness D_A of Wu 2015 (58) at the reference dynamic pressure, N m/rad. The
    /// values are representative, as the paper prints none.
    pub effectiveness: SMatrix<f64, 3, SURFACES>,
    /// Dynamic pressure for which `effectiveness` holds, Pa.
    pub reference_pressure: f64,
    /// Lower limit of each deflection, rad.
    pub min: Surfaces,
    /// Upper limit of each deflection, rad.
    pub max: Surfaces,
    /// Largest deflection rate of each surface in either direction, rad/s.
    pub rate: Surfaces,
    /// Whether control may use each surface, Wu 2015 (65).
    pub allowed: [bool; SURFACES],
    /// Name of each aerodynamic surface.
    pub names: [String; SURFACES],
    /// Jet effectiveness D_RCS of Wu 2015 (64): the moment of each jet at full thrust, N m.
    pub jet_moments: SMatrix<f64, 3, JETS>,
    /// Thrust of one jet when it is on, N.
    pub jet_force: f64,
    /// Replacement for the fourth column of `jet_moments` that mirrors the eighth, N m;
    /// [`Effectors::symmetric`] uses it.
    pub symmetric_jet_4: Vector3<f64>,
}

impl Effectors {
    /// Effectors of Wu 2015, section 6, as printed, with a representative effectiveness of the
    /// surfaces.
    pub fn published() -> Self {
        static READ: LazyLock<Effectors> = LazyLock::new(|| embedded(EFFECTORS));
        READ.clone()
    }

    /// Returns these effectors with jet 4 as the mirror image of jet 8: the printed 10944 N m
    /// breaks the symmetry of the other columns.
    #[must_use]
    pub fn symmetric(mut self) -> Self {
        self.jet_moments.set_column(3, &self.symmetric_jet_4);
        self
    }

    /// Reads the effectors from a text in the form of `data/effectors.toml`; `file` names it in
    /// messages.
    ///
    /// # Errors
    /// Says which entry is missing, unknown or out of range.
    pub fn from_toml(file: &str, text: &str) -> Result<Self, Error> {
        let refuse = |problem: String| Error::Effectors { file: file.into(), problem };
        let parsed: File = toml::from_str(text).map_err(|error| refuse(error.to_string()))?;
        parsed.into_effectors().map_err(refuse)
    }

    fn check(&self) -> Result<(), String> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.reference_pressure) {
            return Err(format!(
                "surfaces.reference_pressure = {} Pa must be positive",
                self.reference_pressure
            ));
        }
        if !positive(self.jet_force) {
            return Err(format!("jets.force = {} N must be positive", self.jet_force));
        }
        for (i, name) in self.names.iter().enumerate() {
            // Zero must lie within the limits because deflections start there.
            let holds_zero = self.min[i] <= 0.0 && 0.0 <= self.max[i];
            if !(holds_zero && self.min[i].is_finite() && self.max[i].is_finite()) {
                return Err(format!(
                    "surfaces.min_deg, max_deg: the limits of '{name}' must be finite and hold 0"
                ));
            }
            if !positive(self.rate[i]) {
                return Err(format!("surfaces.rate_deg_s: the rate of '{name}' must be positive"));
            }
        }
        let finite = |mut values: std::slice::Iter<f64>| values.all(|value| value.is_finite());
        if !finite(self.effectiveness.as_slice().iter()) {
            return Err("surfaces.effectiveness_deg holds a value that is not finite".into());
        }
        if !finite(self.jet_moments.as_slice().iter())
            || !finite(self.symmetric_jet_4.as_slice().iter())
        {
            return Err("jets.moment or symmetric_jet_4 holds a value that is not finite".into());
        }
        Ok(())
    }

    /// Surface effectiveness D_A of Wu 2015 (58) at a dynamic pressure (Pa), N m/rad.
    pub fn effectiveness_at(&self, dynamic_pressure: f64) -> SMatrix<f64, 3, SURFACES> {
        self.effectiveness * (dynamic_pressure / self.reference_pressure)
    }

    /// Moment D_A δ_A of Wu 2015 (57) in N m, for `deflections` (rad) at a dynamic pressure (Pa).
    pub fn moment_of_surfaces(
        &self,
        deflections: &Surfaces,
        dynamic_pressure: f64,
    ) -> Vector3<f64> {
        self.effectiveness * deflections * (dynamic_pressure / self.reference_pressure)
    }

    /// Moment D_RCS δ_RCS of Wu 2015 (57) in N m; `duty` runs from 0 (off) to 1 (full thrust).
    pub fn moment_of_jets(&self, duty: &Jets) -> Vector3<f64> {
        self.jet_moments * duty
    }
}

fn embedded((file, text): (&str, &str)) -> Effectors {
    // This cannot fail: a test reads the embedded file.
    let effectors = data::embedded::<File>(file, text).into_effectors();
    effectors.unwrap_or_else(|problem| panic!("{file}: {problem}"))
}

// The structures below mirror the file, with the units printed in the paper named in the keys.

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    surfaces: FileSurfaces,
    jets: FileJets,
}

impl File {
    fn into_effectors(self) -> Result<Effectors, String> {
        let Self { surfaces, jets } = self;
        let effectors = Effectors {
            effectiveness: matrix(&surfaces.effectiveness_deg) * 1f64.to_degrees(),
            reference_pressure: surfaces.reference_pressure,
            min: Surfaces::from(surfaces.min_deg).map(f64::to_radians),
            max: Surfaces::from(surfaces.max_deg).map(f64::to_radians),
            rate: Surfaces::from(surfaces.rate_deg_s).map(f64::to_radians),
            allowed: surfaces.allowed,
            names: surfaces.names,
            jet_moments: matrix(&jets.moment),
            jet_force: jets.force,
            symmetric_jet_4: jets.symmetric_jet_4,
        };
        effectors.check()?;
        Ok(effectors)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSurfaces {
    names: [String; SURFACES],
    min_deg: [f64; SURFACES],
    max_deg: [f64; SURFACES],
    rate_deg_s: [f64; SURFACES],
    allowed: [bool; SURFACES],
    reference_pressure: f64,
    effectiveness_deg: [[f64; SURFACES]; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileJets {
    force: f64,
    moment: [[f64; JETS]; 3],
    symmetric_jet_4: Vector3<f64>,
}

fn matrix<const N: usize>(rows: &[[f64; N]; 3]) -> SMatrix<f64, 3, N> {
    SMatrix::from_fn(|i, j| rows[i][j])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vector3<f64>, b: [f64; 3]) {
        assert!((a - Vector3::from(b)).amax() < 1e-9, "{a} is not {b:?}");
    }

    #[test]
    fn published_limits_of_the_surfaces() {
        // Wu 2015, (63)
        let effectors = Effectors::published();
        for (i, (min, max)) in
            [(-25.0, 0.0), (-25.0, 0.0), (-25.0, 0.0), (-25.0, 0.0), (-10.0, 30.0), (-10.0, 30.0)]
                .into_iter()
                .chain([(-30.0, 30.0); 2])
                .enumerate()
        {
            assert!((effectors.min[i].to_degrees() - min).abs() < 1e-12);
            assert!((effectors.max[i].to_degrees() - max).abs() < 1e-12);
            assert!((effectors.rate[i].to_degrees() - 10.0).abs() < 1e-12);
            assert_eq!(effectors.allowed[i], i < 6, "(65)");
        }
    }

    #[test]
    fn published_moments_of_the_jets() {
        // Wu 2015, (64), column by column
        let columns = [
            [0.0, -498.0, 19897.0],
            [-2048.0, 0.0, -15723.0],
            [11625.0, -9466.0, -9465.0],
            [-6912.0, 10944.0, -11798.0],
            [0.0, -498.0, -19897.0],
            [2054.0, 0.0, 15723.0],
            [-11623.0, -9465.0, 9465.0],
            [6912.0, 11798.0, 11798.0],
            [0.0, -498.0, -19897.0],
            [0.0, -498.0, 19897.0],
        ];
        let effectors = Effectors::published();
        for (j, column) in columns.into_iter().enumerate() {
            let mut duty = Jets::zeros();
            duty[j] = 1.0;
            near(effectors.moment_of_jets(&duty), column);
            duty[j] = 0.25;
            near(effectors.moment_of_jets(&duty), column.map(|moment| 0.25 * moment));
        }
        assert_eq!(effectors.jet_force, 3559.0);
    }

    #[test]
    fn published_thrust_and_moments_in_either_unit() {
        // (64) is printed without a unit; N m is assumed. The thrust is 800 lbf and the moment
        // limit of Chai 2022 10⁵ ft lbf, which suggests ft lbf.
        let (lbf, ft_lbf) = (4.448_221_615_260_5, 1.355_817_948_331_4);
        let effectors = Effectors::published();
        let limit = crate::Scenario::crmpc2022().limit_moment;
        let mut duty = Jets::zeros();
        duty[0] = 1.0;
        let yaw = effectors.moment_of_jets(&duty).z;
        assert!((effectors.jet_force / lbf - 800.0).abs() < 0.1);
        assert!((limit / ft_lbf - 1e5).abs() < 14.0);
        for (unit, lever, share) in [(1.0, 5.59, 0.147), (ft_lbf, 7.58, 0.199)] {
            assert!((yaw * unit / effectors.jet_force - lever).abs() < 5e-3);
            assert!((yaw * unit / limit - share).abs() < 5e-4);
        }
    }

    #[test]
    fn jets_are_mirror_images_up_to_8_newton_metres_but_the_fourth() {
        let mirrored = |jets: &Effectors, (left, right): (usize, usize)| {
            let [a, b] = [left, right].map(|jet| jets.jet_moments.column(jet - 1).into_owned());
            (a - Vector3::new(-b.x, b.y, -b.z)).amax()
        };
        let printed = Effectors::published();
        for pair in [(1, 5), (10, 9), (2, 6), (3, 7)] {
            assert!(mirrored(&printed, pair) < 8.0, "{pair:?}");
        }
        assert_eq!(mirrored(&printed, (4, 8)), 854.0);
        let symmetric = printed.clone().symmetric();
        assert_eq!(mirrored(&symmetric, (4, 8)), 0.0);
        for jet in [0, 1, 2, 4, 5, 6, 7, 8, 9] {
            assert_eq!(symmetric.jet_moments.column(jet), printed.jet_moments.column(jet));
        }
    }

    #[test]
    fn surfaces_act_per_degree_and_with_dynamic_pressure() {
        let effectors = Effectors::published();
        let mut deflections = Surfaces::zeros();
        deflections[4] = 2f64.to_radians();
        deflections[1] = -1f64.to_radians();
        let at_reference = [2750.0 + 2800.0, -10200.0 + 1750.0, -2000.0 - 650.0];
        near(effectors.moment_of_surfaces(&deflections, 2859.0), at_reference);
        near(
            effectors.moment_of_surfaces(&deflections, 1429.5),
            at_reference.map(|moment| moment / 2.0),
        );
        assert_eq!(
            effectors.effectiveness_at(1429.5) * deflections,
            effectors.moment_of_surfaces(&deflections, 1429.5)
        );
        near(effectors.moment_of_surfaces(&deflections, 0.0), [0.0; 3]);
    }

    /// The columns of mirrored surfaces form pairs like those of the jets.
    #[test]
    fn left_and_right_surfaces_are_mirror_images() {
        let effectors = Effectors::published();
        for left in [0, 2, 4, 6] {
            let [a, b] = [left, left + 1].map(|i| effectors.effectiveness.column(i).into_owned());
            assert_eq!(a, Vector3::new(-b.x, b.y, -b.z));
        }
    }

    #[test]
    fn oracle_the_reference_pressure_is_that_of_the_published_flight_condition() {
        // 55 km, Mach 9.8: 0.7 p Ma² with p = 42.525 Pa of the US Standard Atmosphere 1976
        let pressure = 0.7 * 42.525 * 9.8f64.powi(2);
        assert!((Effectors::published().reference_pressure - pressure).abs() < 0.5);
    }

    #[test]
    fn a_bad_file_is_refused_by_name() {
        for (from, to, named) in [
            ("force = 3559.0", "force = 0.0", "jets.force"),
            ("force = 3559.0", "thrust = 3559.0", "thrust"),
            ("reference_pressure = 2859.0", "reference_pressure = -1.0", "reference_pressure"),
            ("max_deg = [0.0,", "max_deg = [-1.0,", "left outer elevon"),
            ("rate_deg_s = [10.0, 10.0,", "rate_deg_s = [10.0, 0.0,", "right outer elevon"),
            ("[2800.0,", "[nan,", "effectiveness_deg"),
            ("[0.0, -2048.0,", "[inf, -2048.0,", "jets.moment"),
            ("true, false, false]", "true, false]", "allowed"),
        ] {
            assert!(EFFECTORS.1.contains(from), "{from}");
            let message =
                Effectors::from_toml("my.toml", &EFFECTORS.1.replacen(from, to, 1)).unwrap_err();
            let message = message.to_string();
            assert!(message.contains("my.toml") && message.contains(named), "{message}");
        }
    }
}
