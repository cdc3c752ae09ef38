//! Tests of the effectors' data.

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
        assert_eq!(effectors.names[i], SURFACE_NAMES[i].1);
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
    near(effectors.effectiveness_at(2859.0) * deflections, at_reference);
    near(effectors.effectiveness_at(1429.5) * deflections, at_reference.map(|moment| moment / 2.0));
    near(effectors.effectiveness_at(0.0) * deflections, [0.0; 3]);
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
