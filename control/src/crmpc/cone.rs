//! The constrained tracking problem as a second-order cone programme for Clarabel.
//!
//! Unknowns are the tracking errors E_k = x̃_k − x_r(t_k), k = 0..=N, scaled; the inputs are eliminated, as
//! v_k = (E_ω,k+1 − E_ω,k − d_ω,k)/h. The affine terms d_k carry the reference's curvature and jumps. Set up once, then
//! updated in place: only numbers change from sample to sample, never the sparsity.

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{self, SecondOrderConeT, ZeroConeT};
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3, Vector6};

/// A ball constraint ‖offset + J_θ E_(α,β) + J_ω E_ω + J_v v‖ ≤ bound on the motion of one stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
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

/// What does not change between samples.
#[derive(Clone, Debug)]
pub struct Structure {
    /// N.
    pub horizon: usize,
    /// h, s.
    pub step: f64,
    /// P, diagonal.
    pub p: [f64; 6],
    /// Q, diagonal.
    pub q: [f64; 3],
    /// Terminal weight G per axis.
    pub g: [Matrix2<f64>; 3],
    /// Shape X of the set {o : oᵀX⁻¹o ≤ 1} that measured − nominal lies in at the first stage; `None` if the nominal
    /// motion starts at the measured state.
    pub initial: Option<Matrix2<f64>>,
    /// Typical angle error, rad.
    pub angle_scale: f64,
    /// Typical rate, rad/s.
    pub rate_scale: f64,
    /// Iteration limit.
    pub max_iterations: u32,
}

/// What changes at every sample.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// Measured tracking error.
    pub start: Vector6<f64>,
    /// d_0 … d_{N−1}.
    pub affine: &'a [Vector6<f64>],
    /// State ball of stages 1 … N (index 0 belongs to stage 1).
    pub state_balls: &'a [Ball],
    /// Input ball of stages 0 … N−1.
    pub input_balls: &'a [Ball],
    /// Radius of the terminal ball in the G-norm.
    pub terminal_radius: f64,
}

/// The programme with its solver.
pub struct ConeProblem {
    structure: Structure,
    solver: DefaultSolver<f64>,
    linear_cost: Vec<f64>,
    /// Values of A in the solver's order.
    matrix: Vec<f64>,
    right_side: Vec<f64>,
    /// Where each stage's ball coefficients stand in `matrix`, and its rows in `right_side`.
    state_slots: Vec<Slots>,
    input_slots: Vec<Slots>,
    initial_row: usize,
    terminal_row: usize,
    /// Lᵀ with G = L Lᵀ, per axis.
    terminal_root: [Matrix2<f64>; 3],
    /// X^{-1/2} of the initial set.
    initial_root: Option<Matrix2<f64>>,
}

struct Slots {
    row: usize,
    /// Positions of the 3×5 block on (E_α, E_β, E_ω) of the stage the ball belongs to.
    here: [[usize; 5]; 3],
    /// Positions of the 3×3 block on E_ω of the next stage (input balls).
    next: Option<[[usize; 3]; 3]>,
}

/// Collects a sparse matrix entry by entry, remembering where each entry ends up in compressed columns.
#[derive(Default)]
struct Triplets {
    entries: Vec<(usize, usize, f64)>,
}

impl Triplets {
    fn push(&mut self, row: usize, column: usize, value: f64) -> usize {
        self.entries.push((row, column, value));
        self.entries.len() - 1
    }

    /// The matrix, and for each pushed entry its position among the values.
    fn compress(&self, rows: usize, columns: usize) -> (CscMatrix<f64>, Vec<usize>) {
        let mut order: Vec<usize> = (0..self.entries.len()).collect();
        order.sort_by_key(|&i| (self.entries[i].1, self.entries[i].0));
        let mut position = vec![0; order.len()];
        let mut starts = vec![0; columns + 1];
        let (mut row_indices, mut values) = (Vec::new(), Vec::new());
        for (place, &i) in order.iter().enumerate() {
            let (row, column, value) = self.entries[i];
            position[i] = place;
            starts[column + 1] += 1;
            row_indices.push(row);
            values.push(value);
        }
        for column in 0..columns {
            starts[column + 1] += starts[column];
        }
        (CscMatrix::new(rows, columns, starts, row_indices, values), position)
    }
}

impl ConeProblem {
    /// Sets the programme up.
    ///
    /// # Errors
    /// The solver's own message if it refuses the data, for example weights that are not positive semidefinite.
    pub fn new(structure: Structure) -> Result<Self, String> {
        let n = structure.horizon;
        let (sa, sw) = (structure.angle_scale, structure.rate_scale);
        let h = structure.step;
        let angle = |k: usize, i: usize| 6 * k + i;
        let rate = |k: usize, i: usize| 6 * k + 3 + i;

        let cost = cost_matrix(&structure);

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
        let initial_root = structure.initial.map(|x| inverse_square_root(&x));
        if let Some(root) = initial_root {
            // ‖X^{-1/2} (E − E_measured)‖ ≤ 1 per axis.
            for i in 0..3 {
                for j in 0..2 {
                    a.push(row + 1 + j, angle(0, i), -root[(j, 0)] * sa);
                    a.push(row + 1 + j, rate(0, i), -root[(j, 1)] * sw);
                }
                row += 3;
                cones.push(SecondOrderConeT(3));
            }
        } else {
            for i in 0..6 {
                a.push(row, i, 1.0);
                row += 1;
            }
            cones.push(ZeroConeT(6));
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
        let terminal_row = row;
        let terminal_root = structure.g.map(|g| square_root(&g));
        for (i, root) in terminal_root.iter().enumerate() {
            for j in 0..2 {
                a.push(row + 1 + 2 * i + j, angle(n, i), 0.0 - root[(j, 0)]);
                a.push(row + 1 + 2 * i + j, rate(n, i), 0.0 - root[(j, 1)] * sw / sa);
            }
        }
        cones.push(SecondOrderConeT(7));
        row += 7;

        let columns = 6 * (n + 1);
        let (matrix, position) = a.compress(row, columns);
        for slots in state_slots.iter_mut().chain(&mut input_slots) {
            for i in slots.here.iter_mut().flatten().chain(slots.next.iter_mut().flatten().flatten()) {
                *i = position[*i];
            }
        }
        let linear_cost = vec![0.0; columns];
        let mut right_side = vec![0.0; row];
        // A strictly feasible placeholder, so that the solver's setup sees finite data.
        for slots in state_slots.iter().chain(&input_slots) {
            right_side[slots.row] = 1.0;
        }
        let settings = DefaultSettings {
            verbose: false,
            max_iter: structure.max_iterations,
            presolve_enable: false,
            equilibrate_enable: false,
            input_sparse_dropzeros: false,
            iterative_refinement_enable: true,
            direct_solve_method: "qdldl".into(),
            max_threads: 1,
            ..DefaultSettings::default()
        };
        let solver = DefaultSolver::new(&cost, &linear_cost, &matrix, &right_side, &cones, settings)
            .map_err(|error| error.to_string())?;
        Ok(Self {
            structure,
            solver,
            linear_cost,
            matrix: matrix.nzval,
            right_side,
            state_slots,
            input_slots,
            initial_row,
            terminal_row,
            terminal_root,
            initial_root,
        })
    }

    /// Solves one sample; writes E_0 … E_N into `errors` if the status is `Solved`. Returns status and iterations.
    pub fn solve(&mut self, sample: &Sample, errors: &mut [Vector6<f64>]) -> (SolverStatus, u32) {
        self.update(sample);
        let accepted = self.solver.update_q(&self.linear_cost).is_ok()
            && self.solver.update_A(&self.matrix).is_ok()
            && self.solver.update_b(&self.right_side).is_ok();
        if !accepted {
            return (SolverStatus::NumericalError, 0);
        }
        self.solver.solve();
        let solution = &self.solver.solution;
        if solution.status == SolverStatus::Solved {
            let (sa, sw) = (self.structure.angle_scale, self.structure.rate_scale);
            for (error, x) in errors.iter_mut().zip(solution.x.chunks_exact(6)) {
                *error = Vector6::new(x[0] * sa, x[1] * sa, x[2] * sa, x[3] * sw, x[4] * sw, x[5] * sw);
            }
        }
        (solution.status, solution.iterations)
    }

    fn update(&mut self, sample: &Sample) {
        let Structure { horizon: n, step: h, q, angle_scale: sa, rate_scale: sw, .. } = self.structure;
        self.linear_cost.fill(0.0);
        for (k, d) in sample.affine.iter().enumerate() {
            for i in 0..3 {
                // (Q/h)(E_ω,k+1 − E_ω,k − d_ω)²
                let slope = 2.0 * q[i] / h * d[3 + i] * sw;
                self.linear_cost[6 * k + 3 + i] += slope;
                self.linear_cost[6 * (k + 1) + 3 + i] -= slope;
                self.right_side[3 * k + i] = (d[i] - 0.5 * h * d[3 + i]) / sa;
            }
        }
        let start = &sample.start;
        if let Some(root) = self.initial_root {
            for i in 0..3 {
                let centre = root * Vector2::new(start[i], start[3 + i]);
                let row = self.initial_row + 3 * i;
                self.right_side[row] = 1.0;
                self.right_side[row + 1] = -centre.x;
                self.right_side[row + 2] = -centre.y;
            }
        } else {
            for i in 0..6 {
                self.right_side[self.initial_row + i] = start[i] / if i < 3 { sa } else { sw };
            }
        }
        for (slots, ball) in self.state_slots.iter().zip(sample.state_balls) {
            write_ball(&mut self.matrix, &mut self.right_side, slots, ball, &ball.by_rates, &ball.offset, sa, sw);
        }
        for (k, (slots, ball)) in self.input_slots.iter().zip(sample.input_balls).enumerate() {
            // v_k = (E_ω,k+1 − E_ω,k − d_ω,k)/h
            let by_difference = ball.by_acceleration / h;
            let by_rates = ball.by_rates - by_difference;
            let offset = ball.offset - by_difference * sample.affine[k].fixed_rows::<3>(3);
            write_ball(&mut self.matrix, &mut self.right_side, slots, ball, &by_rates, &offset, sa, sw);
            for (i, places) in slots.next.iter().flatten().enumerate() {
                for (j, &place) in places.iter().enumerate() {
                    self.matrix[place] = -by_difference[(i, j)] * sw / ball.bound;
                }
            }
        }
        // ‖Lᵀ E_N‖ ≤ ε, divided by the angle scale.
        self.right_side[self.terminal_row] = sample.terminal_radius / sa;
        debug_assert_eq!(sample.affine.len(), n);
    }

    /// Cost of errors E_0 … E_N: Σ h(EᵀPE + vᵀQv) + E_NᵀG E_N.
    pub fn cost(structure: &Structure, errors: &[Vector6<f64>], affine: &[Vector6<f64>]) -> f64 {
        let h = structure.step;
        let mut cost = 0.0;
        for (k, d) in affine.iter().enumerate() {
            let change = errors[k + 1] - errors[k] - d;
            for i in 0..3 {
                let v = change[3 + i] / h;
                cost += h
                    * (structure.p[i] * errors[k][i].powi(2)
                        + structure.p[3 + i] * errors[k][3 + i].powi(2)
                        + structure.q[i] * v * v);
            }
        }
        let last = errors[affine.len()];
        for (i, g) in structure.g.iter().enumerate() {
            let e = Vector2::new(last[i], last[3 + i]);
            cost += e.dot(&(g * e));
        }
        cost
    }

    /// ‖E‖_G.
    pub fn terminal_norm(&self, error: &Vector6<f64>) -> f64 {
        let square: f64 = (0..3)
            .map(|i| (self.terminal_root[i] * Vector2::new(error[i], error[3 + i])).norm_squared())
            .sum();
        square.sqrt()
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

/// ½ xᵀ P x with the cost Σ h EᵀPE + (Q/h)(ΔE_ω)² + E_NᵀG E_N, upper triangle, scaled.
fn cost_matrix(structure: &Structure) -> CscMatrix<f64> {
    let Structure { horizon: n, step: h, p, q, g, angle_scale: sa, rate_scale: sw, .. } = structure;
    let mut cost = Triplets::default();
    for k in 0..=*n {
        for i in 0..3 {
            let (angle, rate) = (6 * k + i, 6 * k + 3 + i);
            let neighbours = if k == 0 || k == *n { 1.0 } else { 2.0 };
            let mut by_angle = 2.0 * h * p[i];
            let mut by_rate = 2.0 * h * p[3 + i];
            if k == *n {
                (by_angle, by_rate) = (2.0 * g[i].m11, 2.0 * g[i].m22);
                cost.push(angle, rate, 2.0 * g[i].m12 * sa * sw);
            }
            cost.push(angle, angle, by_angle * sa * sa);
            cost.push(rate, rate, (by_rate + neighbours * 2.0 * q[i] / h) * sw * sw);
            if k > 0 {
                cost.push(rate - 6, rate, -2.0 * q[i] / h * sw * sw);
            }
        }
    }
    cost.compress(6 * (n + 1), 6 * (n + 1)).0
}

/// Lᵀ with G = L Lᵀ; zero where G is zero.
fn square_root(g: &Matrix2<f64>) -> Matrix2<f64> {
    g.cholesky().map_or_else(Matrix2::zeros, |factor| factor.l().transpose())
}

/// L⁻¹ with X = L Lᵀ, so that ‖L⁻¹ o‖² = oᵀX⁻¹o.
fn inverse_square_root(x: &Matrix2<f64>) -> Matrix2<f64> {
    x.cholesky().and_then(|factor| factor.l().try_inverse()).unwrap_or_else(Matrix2::identity)
}
