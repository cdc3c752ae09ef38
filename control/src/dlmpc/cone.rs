//! The constrained outer problem, or a window of its horizon, as a second-order cone programme.
//!
//! Unknowns are the angle errors E_k = Θ_k − Θ_r(t_k), k = 0..=N, scaled; the commands are eliminated, as
//! v_k − Θ̇_r,k = (E_k+1 − E_k − d_k)/h.

use crate::cone::{Programme, Triplets};
use clarabel::solver::SupportedConeT::{self, SecondOrderConeT, ZeroConeT};
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// The body rates of one interval, offset + J_θ E_(α,β) + J_v (v − Θ̇_r).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rates {
    /// Value at E = 0, v = Θ̇_r.
    pub offset: Vector3<f64>,
    /// J_θ.
    pub by_angles: Matrix3x2<f64>,
    /// J_v.
    pub by_command: Matrix3<f64>,
}

/// How the programme's first stage is tied down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// E_0 is given.
    Fixed,
    /// Free, at the cost of arriving there from the true start.
    Arrival,
}

/// What does not change between samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Structure {
    /// Number of intervals.
    pub stages: usize,
    /// h, s.
    pub step: f64,
    /// P, diagonal.
    pub p: [f64; 3],
    /// Q, diagonal.
    pub q: [f64; 3],
    /// First stage.
    pub start: Start,
    /// Bound on the norm of the body rates, rad/s.
    pub limit: f64,
    /// Typical angle error, rad.
    pub angle_scale: f64,
    /// Iteration limit.
    pub max_iterations: u32,
}

/// A quadratic cost W E² + 2 w E per axis, as (W, w).
pub(super) type AxisCosts = [(f64, f64); 3];

/// What changes at every sample. The lengths are those of the structure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<'a> {
    /// The given E_0, for [`Start::Fixed`].
    pub start: Vector3<f64>,
    /// Cost of arriving at the first stage, for [`Start::Arrival`].
    pub arrival: AxisCosts,
    /// Cost of going on from the last stage, its own included.
    pub to_go: AxisCosts,
    /// d of each interval.
    pub affine: &'a [Vector3<f64>],
    /// Body rates of each interval.
    pub rates: &'a [Rates],
}

/// The programme with its solver.
pub(super) struct ConeProblem {
    structure: Structure,
    programme: Programme,
    /// The quadratic cost without that of the two ends, and where theirs is added.
    inner_cost: Vec<f64>,
    end_costs: [[usize; 3]; 2],
    slots: Vec<Slots>,
}

/// Where the numbers of one interval's ball stand.
struct Slots {
    row: usize,
    /// Blocks on the errors at the interval's beginning and at its end.
    here: [[usize; 3]; 3],
    next: [[usize; 3]; 3],
}

impl ConeProblem {
    /// Sets the programme up.
    ///
    /// # Errors
    /// The solver's own message if it refuses the data.
    pub(super) fn new(structure: Structure) -> Result<Self, String> {
        let Structure { stages: n, step: h, p, q, start, angle_scale: scale, .. } = structure;
        let mut cost = Triplets::default();
        let mut end_costs = [[0; 3]; 2];
        for k in 0..=n {
            for i in 0..3 {
                let intervals = if k == 0 || k == n { 1.0 } else { 2.0 };
                let own = if k == n { 0.0 } else { p[i] };
                let square = own + intervals * q[i] / (h * h);
                let slot = cost.push(3 * k + i, 3 * k + i, 2.0 * square * scale * scale);
                if k == 0 || k == n {
                    end_costs[usize::from(k == n)][i] = slot;
                }
                if k > 0 {
                    cost.push(3 * (k - 1) + i, 3 * k + i, -2.0 * q[i] / (h * h) * scale * scale);
                }
            }
        }
        let columns = 3 * (n + 1);
        let (cost, position) = cost.compress(columns, columns);
        for slot in end_costs.iter_mut().flatten() {
            *slot = position[*slot];
        }

        let mut matrix = Triplets::default();
        let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
        let mut row = 0;
        if start == Start::Fixed {
            for i in 0..3 {
                matrix.push(i, i, 1.0);
            }
            cones.push(ZeroConeT(3));
            row = 3;
        }
        let mut slots = Vec::with_capacity(n);
        for k in 0..n {
            let mut block = |k: usize| {
                std::array::from_fn(|i| std::array::from_fn(|j| matrix.push(row + 1 + i, 3 * k + j, 0.0)))
            };
            slots.push(Slots { row, here: block(k), next: block(k + 1) });
            cones.push(SecondOrderConeT(4));
            row += 4;
        }
        let (matrix, position) = matrix.compress(row, columns);
        let mut right_side = vec![0.0; row];
        for Slots { row, here, next } in &mut slots {
            for slot in here.iter_mut().chain(next).flatten() {
                *slot = position[*slot];
            }
            right_side[*row] = 1.0;
        }
        let programme = Programme::new(cost, matrix, right_side, &cones, structure.max_iterations)?;
        Ok(Self { structure, inner_cost: programme.cost.clone(), programme, end_costs, slots })
    }

    /// Solves one sample; writes the errors of all its stages into `errors` if it is solved. Returns whether it is, and the
    /// iterations.
    pub(super) fn solve(&mut self, sample: &Sample, errors: &mut [Vector3<f64>]) -> (bool, u32) {
        self.update(sample);
        let scale = self.structure.angle_scale;
        let (solution, iterations) = self.programme.solve();
        for (error, x) in errors.iter_mut().zip(solution.unwrap_or_default().chunks_exact(3)) {
            *error = Vector3::new(x[0], x[1], x[2]) * scale;
        }
        (solution.is_some(), iterations)
    }

    fn update(&mut self, sample: &Sample) {
        let Structure { step: h, q, start, limit, angle_scale: scale, .. } = self.structure;
        let Programme { cost, linear_cost, matrix, right_side, .. } = &mut self.programme;
        linear_cost.fill(0.0);
        for (k, d) in sample.affine.iter().enumerate() {
            for i in 0..3 {
                // (Q/h²)(E_k+1 − E_k − d)²
                let slope = 2.0 * q[i] / (h * h) * d[i] * scale;
                linear_cost[3 * k + i] += slope;
                linear_cost[3 * (k + 1) + i] -= slope;
            }
        }
        cost.copy_from_slice(&self.inner_cost);
        let last = linear_cost.len() - 3;
        let mut add = |end: usize, stage: usize, costs: &AxisCosts| {
            for (i, (weight, slope)) in costs.iter().enumerate() {
                cost[self.end_costs[end][i]] += 2.0 * weight * scale * scale;
                linear_cost[stage + i] += 2.0 * slope * scale;
            }
        };
        add(1, last, &sample.to_go);
        match start {
            Start::Fixed => {
                right_side[..3].copy_from_slice((sample.start / scale).as_slice());
            }
            Start::Arrival => add(0, 0, &sample.arrival),
        }
        for ((slots, rates), d) in self.slots.iter().zip(sample.rates).zip(sample.affine) {
            let next = rates.by_command / h;
            let offset = (rates.offset - next * d) / limit;
            for i in 0..3 {
                for j in 0..3 {
                    let by_angle = if j < 2 { rates.by_angles[(i, j)] } else { 0.0 };
                    matrix[slots.here[i][j]] = (next[(i, j)] - by_angle) * scale / limit;
                    matrix[slots.next[i][j]] = -next[(i, j)] * scale / limit;
                }
                right_side[slots.row + 1 + i] = offset[i];
            }
        }
    }
}
