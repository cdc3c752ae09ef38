//! The constrained tracking problem, or a window of its horizon, as a second-order cone programme for Clarabel.
//!
//! Unknowns are the tracking errors E_k = x̃_k − x_r(t_k), k = 0..=N, scaled; the inputs are eliminated, as
//! v_k = (E_ω,k+1 − E_ω,k − d_ω,k)/h. The affine terms d_k carry the reference's curvature and jumps.

use crate::cone::{Programme, Triplets};
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{self, NonnegativeConeT, SecondOrderConeT, ZeroConeT};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3, Vector6};

/// A ball constraint ‖offset + J_θ E_(α,β) + J_ω E_ω + J_v v‖ ≤ bound on the motion of one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    /// Value at E = 0, v = 0.
    pub offset: Vector3<f64>,
    /// J_θ.
    pub by_angles: Matrix3x2<f64>,
    /// J_ω.
    pub by_rates: Matrix3<f64>,
    /// J_v.
    pub by_acceleration: Matrix3<f64>,
    /// Radius.
    pub bound: f64,
}

impl Default for Ball {
    fn default() -> Self {
        Self {
            offset: Vector3::zeros(),
            by_angles: Matrix3x2::zeros(),
            by_rates: Matrix3::zeros(),
            by_acceleration: Matrix3::zeros(),
            bound: 1.0,
        }
    }
}

/// How the programme's first stage is tied down.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Start {
    /// E_0 is given.
    Fixed,
    /// The given E_0 may differ from the programme's by a deviation o with |nᵀo| ≤ 1 for each of an axis's normals n.
    Within([Vec<Vector2<f64>>; 3]),
    /// Free, at the cost of arriving there from the true start.
    Arrival,
}

/// What does not change between samples.
#[derive(Clone, Debug)]
pub(super) struct Structure {
    /// Number of intervals.
    pub stages: usize,
    /// h, s.
    pub step: f64,
    /// P, diagonal.
    pub p: [f64; 6],
    /// Q, diagonal.
    pub q: [f64; 3],
    /// First stage.
    pub start: Start,
    /// Whether the last stage must lie in the terminal ball, and Lᵀ of its G = L Lᵀ per axis.
    pub terminal: Option<[Matrix2<f64>; 3]>,
    /// Typical angle error, rad.
    pub angle_scale: f64,
    /// Typical rate, rad/s.
    pub rate_scale: f64,
    /// Iteration limit.
    pub max_iterations: u32,
}

/// A quadratic cost EᵀW E + 2 wᵀE per axis, as (W, w).
pub(super) type AxisCosts = [(Matrix2<f64>, Vector2<f64>); 3];

/// What changes at every sample. The lengths are those of the structure.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample<'a> {
    /// The given E_0, for [`Start::Fixed`] and [`Start::Within`].
    pub start: Vector6<f64>,
    /// Cost of arriving at the first stage, for [`Start::Arrival`].
    pub arrival: &'a AxisCosts,
    /// Cost of going on from the last stage.
    pub to_go: &'a AxisCosts,
    /// d of each interval.
    pub affine: &'a [Vector6<f64>],
    /// State ball at the end of each interval.
    pub state_balls: &'a [Ball],
    /// Input ball of each interval.
    pub input_balls: &'a [Ball],
    /// Radius of the terminal ball in the G-norm.
    pub terminal_radius: f64,
}

/// The programme with its solver.
pub(super) struct ConeProblem {
    structure: Structure,
    programme: Programme,
    /// The quadratic cost without that of the two ends.
    inner_cost: Vec<f64>,
    /// Positions of angle², angle·rate and rate² per axis at the first and the last stage.
    end_costs: [[[usize; 3]; 3]; 2],
    /// Where each stage's ball coefficients stand in the matrix, and its rows in the right side.
    state_slots: Vec<Slots>,
    input_slots: Vec<Slots>,
    initial_row: usize,
    terminal_row: Option<usize>,
}

struct Slots {
    row: usize,
    /// Positions of the 3×5 block on (E_α, E_β, E_ω) of the stage the ball belongs to.
    here: [[usize; 5]; 3],
    /// Positions of the 3×3 block on E_ω of the next stage (input balls).
    next: Option<[[usize; 3]; 3]>,
}

impl ConeProblem {
    /// Sets the programme up.
    ///
    /// # Errors
    /// The solver's own message if it refuses the data, for example weights that are not positive semidefinite.
    pub(super) fn new(structure: Structure) -> Result<Self, String> {
        let n = structure.stages;
        let (sa, sw) = (structure.angle_scale, structure.rate_scale);
        let h = structure.step;
        let angle = |k: usize, i: usize| 6 * k + i;
        let rate = |k: usize, i: usize| 6 * k + 3 + i;

        let (cost, end_costs) = cost_matrix(&structure);

        let mut a = Triplets::default();
        let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
        let mut row = 0;
        // E_θ,k+1 − E_θ,k − h/2 (E_ω,k + E_ω,k+1) = d_θ,k − h/2 d_ω,k, divided by the angle scale.
        for k in 0..n {
            for i in 0..3 {
                a.push(row, angle(k + 1, i), 1.0);
                a.push(row, angle(k, i), -1.0);
                a.push(row, rate(k, i), -0.5 * h * sw / sa);
                a.push(row, rate(k + 1, i), -0.5 * h * sw / sa);
                row += 1;
            }
        }
        cones.push(ZeroConeT(row));
        let initial_row = row;
        match &structure.start {
            Start::Fixed => {
                for i in 0..6 {
                    a.push(row, i, 1.0);
                    row += 1;
                }
                cones.push(ZeroConeT(6));
            }
            Start::Within(normals) => {
                // ±nᵀ(E_given − E_0) ≤ 1
                for (i, normals) in normals.iter().enumerate() {
                    for (normal, sign) in normals.iter().flat_map(|normal| [(normal, 1.0), (normal, -1.0)]) {
                        a.push(row, angle(0, i), -sign * normal.x * sa);
                        a.push(row, rate(0, i), -sign * normal.y * sw);
                        row += 1;
                    }
                }
                cones.push(NonnegativeConeT(row - initial_row));
            }
            Start::Arrival => {}
        }
        let mut ball = |a: &mut Triplets, k: usize, next: bool| {
            let column = |j: usize| if j < 2 { angle(k, j) } else { rate(k, j - 2) };
            let here = std::array::from_fn(|i| std::array::from_fn(|j| a.push(row + 1 + i, column(j), 0.0)));
            let next = next.then(|| {
                std::array::from_fn(|i| std::array::from_fn(|j| a.push(row + 1 + i, rate(k + 1, j), 0.0)))
            });
            let slots = Slots { row, here, next };
            row += 4;
            cones.push(SecondOrderConeT(4));
            slots
        };
        let mut state_slots: Vec<Slots> = (1..=n).map(|k| ball(&mut a, k, false)).collect();
        let mut input_slots: Vec<Slots> = (0..n).map(|k| ball(&mut a, k, true)).collect();
        let terminal_row = structure.terminal.map(|roots| {
            // ‖Lᵀ E_N‖ ≤ ε, divided by the angle scale.
            for (i, root) in roots.iter().enumerate() {
                for j in 0..2 {
                    a.push(row + 1 + 2 * i + j, angle(n, i), -root[(j, 0)]);
                    a.push(row + 1 + 2 * i + j, rate(n, i), -root[(j, 1)] * sw / sa);
                }
            }
            cones.push(SecondOrderConeT(7));
            row += 7;
            row - 7
        });

        let columns = 6 * (n + 1);
        let (matrix, position) = a.compress(row, columns);
        for slots in state_slots.iter_mut().chain(&mut input_slots) {
            for i in slots.here.iter_mut().flatten().chain(slots.next.iter_mut().flatten().flatten()) {
                *i = position[*i];
            }
        }
        let mut right_side = vec![0.0; row];
        // A strictly feasible placeholder, so that the solver's setup sees finite data.
        for slots in state_slots.iter().chain(&input_slots) {
            right_side[slots.row] = 1.0;
        }
        let programme = Programme::new(cost, matrix, right_side, &cones, structure.max_iterations)?;
        Ok(Self {
            structure,
            inner_cost: programme.cost.clone(),
            programme,
            end_costs,
            state_slots,
            input_slots,
            initial_row,
            terminal_row,
        })
    }

    /// Solves one sample; writes the errors of all its stages into `errors` if it is solved. Returns whether it is, and the
    /// iterations.
    pub(super) fn solve(&mut self, sample: &Sample, errors: &mut [Vector6<f64>]) -> (bool, u32) {
        self.update(sample);
        let (sa, sw) = (self.structure.angle_scale, self.structure.rate_scale);
        let (solution, iterations) = self.programme.solve();
        for (error, x) in errors.iter_mut().zip(solution.unwrap_or_default().chunks_exact(6)) {
            *error = Vector6::new(x[0] * sa, x[1] * sa, x[2] * sa, x[3] * sw, x[4] * sw, x[5] * sw);
        }
        (solution.is_some(), iterations)
    }

    fn update(&mut self, sample: &Sample) {
        let Structure { stages: n, step: h, q, angle_scale: sa, rate_scale: sw, .. } = self.structure;
        self.programme.linear_cost.fill(0.0);
        for (k, d) in sample.affine.iter().enumerate() {
            for i in 0..3 {
                // (Q/h)(E_ω,k+1 − E_ω,k − d_ω)²
                let slope = 2.0 * q[i] / h * d[3 + i] * sw;
                self.programme.linear_cost[6 * k + 3 + i] += slope;
                self.programme.linear_cost[6 * (k + 1) + 3 + i] -= slope;
                self.programme.right_side[3 * k + i] = (d[i] - 0.5 * h * d[3 + i]) / sa;
            }
        }
        self.programme.cost.copy_from_slice(&self.inner_cost);
        self.add_cost(1, sample.to_go);
        let given = &sample.start;
        match &self.structure.start {
            Start::Fixed => {
                for i in 0..6 {
                    self.programme.right_side[self.initial_row + i] = given[i] / if i < 3 { sa } else { sw };
                }
            }
            Start::Within(normals) => {
                let mut row = self.initial_row;
                for (i, normals) in normals.iter().enumerate() {
                    let given = Vector2::new(given[i], given[3 + i]);
                    for normal in normals {
                        self.programme.right_side[row] = 1.0 - normal.dot(&given);
                        self.programme.right_side[row + 1] = 1.0 + normal.dot(&given);
                        row += 2;
                    }
                }
            }
            Start::Arrival => self.add_cost(0, sample.arrival),
        }
        for (slots, ball) in self.state_slots.iter().zip(sample.state_balls) {
            write_ball(
                &mut self.programme.matrix,
                &mut self.programme.right_side,
                slots,
                ball,
                &ball.by_rates,
                &ball.offset,
                sa,
                sw,
            );
        }
        for (k, (slots, ball)) in self.input_slots.iter().zip(sample.input_balls).enumerate() {
            // v_k = (E_ω,k+1 − E_ω,k − d_ω,k)/h
            let by_difference = ball.by_acceleration / h;
            let by_rates = ball.by_rates - by_difference;
            let offset = ball.offset - by_difference * sample.affine[k].fixed_rows::<3>(3);
            write_ball(
                &mut self.programme.matrix,
                &mut self.programme.right_side,
                slots,
                ball,
                &by_rates,
                &offset,
                sa,
                sw,
            );
            for (i, places) in slots.next.iter().flatten().enumerate() {
                for (j, &place) in places.iter().enumerate() {
                    self.programme.matrix[place] = -by_difference[(i, j)] * sw / ball.bound;
                }
            }
        }
        if let Some(row) = self.terminal_row {
            self.programme.right_side[row] = sample.terminal_radius / sa;
        }
        debug_assert_eq!(sample.affine.len(), n);
    }

    /// Adds a cost at the first (0) or the last (1) stage.
    fn add_cost(&mut self, end: usize, costs: &AxisCosts) {
        let (sa, sw) = (self.structure.angle_scale, self.structure.rate_scale);
        let stage = 6 * self.structure.stages * end;
        for (i, (weight, slope)) in costs.iter().enumerate() {
            let [angle, mixed, rate] = self.end_costs[end][i];
            self.programme.cost[angle] += 2.0 * weight.m11 * sa * sa;
            self.programme.cost[mixed] += 2.0 * weight.m12 * sa * sw;
            self.programme.cost[rate] += 2.0 * weight.m22 * sw * sw;
            self.programme.linear_cost[stage + i] += 2.0 * slope.x * sa;
            self.programme.linear_cost[stage + 3 + i] += 2.0 * slope.y * sw;
        }
    }
}

#[allow(clippy::too_many_arguments)]
fn write_ball(
    matrix: &mut [f64],
    right_side: &mut [f64],
    slots: &Slots,
    ball: &Ball,
    by_rates: &Matrix3<f64>,
    offset: &Vector3<f64>,
    angle_scale: f64,
    rate_scale: f64,
) {
    let scale = 1.0 / ball.bound;
    for (i, places) in slots.here.iter().enumerate() {
        for j in 0..2 {
            matrix[places[j]] = -ball.by_angles[(i, j)] * angle_scale * scale;
        }
        for j in 0..3 {
            matrix[places[2 + j]] = -by_rates[(i, j)] * rate_scale * scale;
        }
        right_side[slots.row + 1 + i] = offset[i] * scale;
    }
    right_side[slots.row] = 1.0;
}

/// ½ xᵀ P x with the cost Σ h EᵀPE + (Q/h)(ΔE_ω)² over the intervals, upper triangle, scaled; and where the costs of
/// the first and the last stage are to be added.
fn cost_matrix(structure: &Structure) -> (CscMatrix<f64>, [[[usize; 3]; 3]; 2]) {
    let Structure { stages: n, step: h, p, q, angle_scale: sa, rate_scale: sw, .. } = structure;
    let mut cost = Triplets::default();
    let mut ends = [[[0; 3]; 3]; 2];
    for k in 0..=*n {
        for i in 0..3 {
            let (angle, rate) = (6 * k + i, 6 * k + 3 + i);
            let intervals = if k == 0 || k == *n { 1.0 } else { 2.0 };
            let counted = if k == *n { 0.0 } else { 1.0 };
            let by_angle = counted * 2.0 * h * p[i];
            let by_rate = counted * 2.0 * h * p[3 + i] + intervals * 2.0 * q[i] / h;
            let angle_slot = cost.push(angle, angle, by_angle * sa * sa);
            let rate_slot = cost.push(rate, rate, by_rate * sw * sw);
            if k == 0 || k == *n {
                ends[usize::from(k == *n)][i] = [angle_slot, cost.push(angle, rate, 0.0), rate_slot];
            }
            if k > 0 {
                cost.push(rate - 6, rate, -2.0 * q[i] / h * sw * sw);
            }
        }
    }
    let (matrix, position) = cost.compress(6 * (n + 1), 6 * (n + 1));
    for slot in ends.iter_mut().flatten().flatten() {
        *slot = position[*slot];
    }
    (matrix, ends)
}
