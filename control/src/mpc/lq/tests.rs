//! Tests of the unconstrained optimum against the normal equations, and data that other tests use.

use super::*;
use nalgebra::SVector;

pub(in crate::mpc) const N: usize = 20;
/// Number of all inputs together.
const INPUTS: usize = 3 * N;

pub(in crate::mpc) fn chain<const O: usize>() -> Chain<O> {
    Chain::new(0.2)
}

pub(in crate::mpc) fn cost<const O: usize>() -> Cost<O> {
    let end =
        SMatrix::<f64, O, O>::from_fn(|i, j| if i == j { 80.0 - 40.0 * i as f64 } else { 30.0 });
    Cost {
        state: std::array::from_fn(|i| Vector3::new(10.0, 7.0, 3.0) / (1.0 + i as f64)),
        input: Vector3::new(2.0, 1.0, 0.5),
        end: per_axis(&[end, end * 0.5, end * 2.0]),
    }
}

pub(in crate::mpc) fn start<const O: usize>() -> State<O> {
    std::array::from_fn(|i| Vector3::new(0.1, -0.2, 0.05) / (1.0 + i as f64))
}

/// Affine terms with a jump at stage 13.
pub(in crate::mpc) fn affine<const O: usize>() -> Vec<State<O>> {
    let d = |k: usize| if k == 13 { 0.08 } else { 1e-3 * k as f64 };
    (0..N)
        .map(|k| std::array::from_fn(|i| Vector3::new(d(k), -d(k), 0.5 * d(k)) / (1.0 + i as f64)))
        .collect()
}

pub(in crate::mpc) fn optimum<const O: usize>() -> (Unconstrained<O>, ErrorTrajectory<O>) {
    let mut lq = Unconstrained::new(N, &chain(), &cost());
    let mut trajectory = ErrorTrajectory::new(N);
    lq.solve(&start(), &affine(), &mut trajectory);
    (lq, trajectory)
}

/// Slope of the cost in every input, by differences of the cost of the resulting trajectory.
/// They are exact for a quadratic.
pub(in crate::mpc) fn slopes<const O: usize>(
    trajectory: &ErrorTrajectory<O>,
    terminal: f64,
) -> SVector<f64, INPUTS> {
    let (chain, affine) = (chain(), affine());
    let mut cost = cost::<O>();
    let value = |cost: &Cost<O>, trajectory: &ErrorTrajectory<O>, i: usize, change: f64| {
        let mut changed = trajectory.clone();
        changed.inputs[i / 3][i % 3] += change;
        changed.roll_out(&chain, &affine);
        cost.total(&changed)
    };
    cost.end = cost.end.map(|row| row.map(|block| block * (1.0 + terminal)));
    SVector::from_fn(|i, _| {
        (value(&cost, trajectory, i, 0.5) - value(&cost, trajectory, i, -0.5)) / 1.0
    })
}

fn assert_stationary<const O: usize>() {
    let (_, trajectory) = optimum::<O>();
    let mut still = trajectory.clone();
    still.inputs.fill(Vector3::zeros());
    let largest = slopes(&still, 0.0).amax();
    assert!(slopes(&trajectory, 0.0).amax() < 1e-11 * largest);
    // Newton's step from any point leads to the optimum: these are the normal equations.
    let slope = slopes(&still, 0.0);
    let columns: Vec<_> = (0..INPUTS)
        .map(|i| {
            let mut moved = still.clone();
            moved.inputs[i / 3][i % 3] += 1.0;
            slopes(&moved, 0.0) - slope
        })
        .collect();
    let solution =
        SMatrix::<f64, INPUTS, INPUTS>::from_columns(&columns).cholesky().unwrap().solve(&-slope);
    for (i, value) in solution.iter().enumerate() {
        assert!((trajectory.inputs[i / 3][i % 3] - value).abs() < 1e-10, "{i}");
    }
}

#[test]
fn oracle_optimum_solves_the_normal_equations() {
    assert_stationary::<1>();
    assert_stationary::<2>();
}

fn assert_parts_give_the_whole<const O: usize>() {
    let (mut lq, trajectory) = optimum::<O>();
    lq.arrive(&start(), &affine());
    for k in [O, O + 1, 7, 13, 14, N] {
        // The stationary point of arrival cost plus cost-to-go lies on the optimal trajectory,
        // and both directions lead back to that trajectory.
        let ((weight, mean), (to_go, slope)) = (lq.arrival(k), lq.to_go(k));
        for axis in 0..3 {
            let (weight, to_go): (SMatrix<f64, O, O>, _) =
                (of_axis(weight, axis), of_axis(to_go, axis));
            let part = |state: &State<O>| SVector::<f64, O>::from_fn(|i, _| state[i][axis]);
            let joint =
                (weight + to_go).try_inverse().unwrap() * (weight * part(&mean) - part(&slope));
            assert!((joint - part(&trajectory.states[k])).amax() < 1e-10, "stage {k}");
        }
        let mut again = ErrorTrajectory::new(N);
        again.states[k] = trajectory.states[k];
        lq.trace_back(k, &affine(), &mut again);
        lq.follow(k, &affine(), &mut again);
        assert!(again.distance(&trajectory) < 1e-10, "stage {k}: {}", again.distance(&trajectory));
    }
    // Tracking the optimum from another start gives the optimum from that start.
    let elsewhere: State<O> = std::array::from_fn(|i| start::<O>()[i] * 1.5);
    let (mut tracked, mut optimum) = (trajectory.clone(), trajectory.clone());
    tracked.states[0] = elsewhere;
    lq.track(&trajectory, &affine(), &mut tracked);
    lq.solve(&elsewhere, &affine(), &mut optimum);
    assert!(tracked.distance(&optimum) < 1e-12);
}

#[test]
fn oracle_parts_of_the_horizon_give_the_optimum_of_the_whole() {
    assert_parts_give_the_whole::<1>();
    assert_parts_give_the_whole::<2>();
}
