//! The problem with its norm constraints linearised, as a second-order cone program for Clarabel.
//! It serves as a check of [`super::riccati`] and as a substitute where that method fails.
//!
//! The unknowns are the scaled errors E_k, k = 0..=N. The inputs are eliminated, as the error of
//! the last derivative changes by h v_k = E_{k+1} − E_k − d_k.

use super::constraints::{LinearisedConstraints, StageConstraints};
use super::layout::Layout;
use super::problem::{Outcome, Problem, Solution, Start, State, of_axis, zero_state};
use crate::conic_program::{ConicProgram, Optimum, Triplets};
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{self, SecondOrderConeT, ZeroConeT};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// The cone program together with its solver.
pub struct ConicSolver<const O: usize> {
    layout: Layout<O>,
    max_iterations: u32,
    program: ConicProgram,
    rows: Rows,
    /// Position of each entry of the rows among the values of the program's matrix.
    position: Vec<usize>,
    /// First row of the norm constraints, four for each: those on states, then those on inputs.
    first_norm: usize,
}

/// The rows A x + s = b of a problem with their cones. Problems of one layout have the same entries
/// with other values.
#[derive(Default)]
struct Rows {
    a: Triplets,
    b: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl<const O: usize> ConicSolver<O> {
    /// Sets up the program and its solver.
    ///
    /// # Errors
    /// Returns the solver's message if it refuses the data, for example weights that are not
    /// positive semidefinite.
    pub fn new(layout: Layout<O>, max_iterations: u32) -> Result<Self, String> {
        let n = layout.horizon;
        // A problem at rest gives the solver finite data for its setup.
        let (affine, constraints) = (vec![zero_state(); n], LinearisedConstraints::new(n));
        let at_rest = layout.problem(&zero_state(), &affine, &constraints, None);
        let mut rows = Rows::default();
        let first_norm = rows.set(&layout, &at_rest);
        let (matrix, position) = rows.a.compress(rows.b.len(), 3 * O * (n + 1));
        let (cost, right_side) = (cost_matrix(&layout), rows.b.clone());
        let program = ConicProgram::new(cost, matrix, right_side, &rows.cones, max_iterations)?;
        Ok(Self { layout, max_iterations, program, rows, position, first_norm })
    }

    /// Solves `problem` within the given number of iterations and time (s). The trajectory in
    /// `solution` is replaced if the optimum is found.
    pub fn solve(
        &mut self,
        problem: &Problem<O, LinearisedConstraints<O>>,
        solution: &mut Solution<O>,
        (iterations, seconds): (u32, f64),
    ) -> Outcome {
        self.update(problem);
        self.program.limit(iterations.min(self.max_iterations), seconds);
        let Layout { chain, scale, horizon: n, constrains_states, terminal, .. } = &self.layout;
        let (optimum, iterations) = self.program.solve();
        let Some(Optimum { x, duals }) = optimum else { return Outcome::Failed(iterations) };
        let Solution { trajectory, multipliers } = solution;
        for (k, x) in x.chunks_exact(3 * O).enumerate() {
            trajectory.states[k] = std::array::from_fn(|i| {
                Vector3::new(x[3 * i], x[3 * i + 1], x[3 * i + 2]) * scale[i]
            });
        }
        if let Start::Fixed(given) = problem.start {
            trajectory.states[0] = given;
        }
        trajectory.set_inputs(*n, chain, problem.affine);
        trajectory.roll_out(chain, problem.affine);
        // The dual of ‖y‖ ≤ 1 is the multiplier of ½(‖y‖² − 1) for the whole cost; the factor ½
        // converts it to half the cost.
        multipliers.clear();
        let norm_duals = &duals[self.first_norm..];
        let stages = if *constrains_states { *n } else { 0 };
        let mut norms = norm_duals.iter().step_by(4).map(|dual| 0.5 * dual);
        for (interval, dual) in multipliers.intervals[..stages].iter_mut().zip(&mut norms) {
            interval[0] = dual;
        }
        for (interval, dual) in multipliers.intervals.iter_mut().zip(norms) {
            interval[1] = dual;
        }
        if let (true, Some(radius)) = (*terminal, problem.end.radius) {
            multipliers.terminal = 0.5 * norm_duals[4 * (stages + n)] * radius / scale[0];
        }
        Outcome::Solved(iterations)
    }

    /// Writes the problem into the program.
    fn update(&mut self, problem: &Problem<O, LinearisedConstraints<O>>) {
        let Self { layout, program, rows, position, .. } = self;
        rows.set(layout, problem);
        rows.a.write(position, &mut program.matrix);
        program.right_side.copy_from_slice(&rows.b);
        let Layout { chain, cost, scale, .. } = layout;
        let (top, h) = (O - 1, chain.step);
        program.linear_cost.fill(0.0);
        for (k, d) in problem.affine.iter().enumerate() {
            for axis in 0..3 {
                // Part V/h² (E_{k+1} − E_k − d)² of the last derivative.
                let slope = 2.0 * cost.input[axis] / (h * h) * d[top][axis] * scale[top];
                program.linear_cost[column::<O>(k, top, axis)] += slope;
                program.linear_cost[column::<O>(k + 1, top, axis)] -= slope;
            }
        }
    }
}

impl Rows {
    /// Sets all rows, and returns the first row of the norm constraints.
    fn set<const O: usize>(
        &mut self,
        layout: &Layout<O>,
        problem: &Problem<O, LinearisedConstraints<O>>,
    ) -> usize {
        self.a.clear();
        self.b.clear();
        self.cones.clear();
        self.add_chain(layout, problem.affine);
        self.add_start(layout, &problem.start);
        let first_norm = self.b.len();
        let Layout { chain, scale, horizon: n, .. } = layout;
        let (top, stages) = (O - 1, problem.constraints.stages());
        if layout.constrains_states {
            for (k, StageConstraints { state, .. }) in stages.iter().enumerate().skip(1) {
                self.add_norm(k, &state.by_state, None, &state.value, scale);
            }
        }
        for (k, StageConstraints { input, .. }) in stages[..*n].iter().enumerate() {
            let by_difference = input.by_input / chain.step;
            let mut by_state = input.by_state;
            by_state[top] -= by_difference;
            let value = input.value - by_difference * problem.affine[k][top];
            self.add_norm(k, &by_state, Some(&by_difference), &value, scale);
        }
        if layout.terminal {
            self.add_terminal(layout, problem.end.radius.unwrap_or_default());
        }
        first_norm
    }

    /// Adds the chain below its last derivative with v eliminated, divided by the scale.
    fn add_chain<const O: usize>(&mut self, layout: &Layout<O>, affine: &[State<O>]) {
        let Layout { chain, scale, .. } = layout;
        let top = O - 1;
        for (k, d) in affine.iter().enumerate() {
            for i in 0..top {
                let by_input = chain.b[i] / chain.step;
                for axis in 0..3 {
                    let row = self.b.len();
                    self.a.push(row, column::<O>(k + 1, i, axis), 1.0);
                    let by_end = -by_input * scale[top] / scale[i];
                    self.a.push(row, column::<O>(k + 1, top, axis), by_end);
                    for j in i..O {
                        let by_state =
                            if j == top { chain.a[(i, j)] - by_input } else { chain.a[(i, j)] };
                        let by_state = -by_state * scale[j] / scale[i];
                        self.a.push(row, column::<O>(k, j, axis), by_state);
                    }
                    self.b.push((d[i][axis] - by_input * d[top][axis]) / scale[i]);
                }
            }
        }
        if !self.b.is_empty() {
            self.cones.push(ZeroConeT(self.b.len()));
        }
    }

    /// Adds the first state's value. Only windows have an arrival cost instead, and they are not
    /// solved here.
    fn add_start<const O: usize>(&mut self, layout: &Layout<O>, start: &Start<O>) {
        let Start::Fixed(given) = start else { return };
        for i in 0..3 * O {
            self.a.push(self.b.len(), i, 1.0);
            self.b.push(given[i / 3][i % 3] / layout.scale[i / 3]);
        }
        self.cones.push(ZeroConeT(3 * O));
    }

    /// Adds a norm constraint at stage `k`, with the derivatives of its vector by the state and by
    /// the last derivative of the next state.
    fn add_norm<const O: usize>(
        &mut self,
        k: usize,
        by_state: &[Matrix3<f64>; O],
        by_next: Option<&Matrix3<f64>>,
        value: &Vector3<f64>,
        scale: &[f64; O],
    ) {
        let top = O - 1;
        self.b.push(1.0);
        for component in 0..3 {
            let row = self.b.len();
            for axis in 0..3 {
                for i in 0..O {
                    let by_state = -by_state[i][(component, axis)] * scale[i];
                    self.a.push(row, column::<O>(k, i, axis), by_state);
                }
                if let Some(by_next) = by_next {
                    let by_next = -by_next[(component, axis)] * scale[top];
                    self.a.push(row, column::<O>(k + 1, top, axis), by_next);
                }
            }
            self.b.push(value[component]);
        }
        self.cones.push(SecondOrderConeT(4));
    }

    /// Adds the terminal constraint ‖Lᵀ E_N‖ ≤ ε with G = L Lᵀ, divided by the scale.
    fn add_terminal<const O: usize>(&mut self, layout: &Layout<O>, radius: f64) {
        let Layout { cost, scale, horizon: n, .. } = layout;
        self.b.push(radius / scale[0]);
        for axis in 0..3 {
            let root = square_root(&of_axis(&cost.end, axis));
            for i in 0..O {
                for j in 0..O {
                    let by_state = -root[(i, j)] * scale[j] / scale[0];
                    self.a.push(self.b.len(), column::<O>(*n, j, axis), by_state);
                }
                self.b.push(0.0);
            }
        }
        self.cones.push(SecondOrderConeT(1 + 3 * O));
    }
}

/// Returns Lᵀ with G = L Lᵀ; it is zero where G is zero.
fn square_root<const O: usize>(g: &SMatrix<f64, O, O>) -> SMatrix<f64, O, O> {
    // nalgebra's Cholesky needs a dimension that is known at this point.
    let mut l = SMatrix::<f64, O, O>::zeros();
    for i in 0..O {
        for j in 0..=i {
            let rest = g[(i, j)] - (0..j).map(|m| l[(i, m)] * l[(j, m)]).sum::<f64>();
            l[(i, j)] = if i == j {
                rest.max(0.0).sqrt()
            } else if l[(j, j)] > 0.0 {
                rest / l[(j, j)]
            } else {
                0.0
            };
        }
    }
    l.transpose()
}

/// Column of the derivative `i` of an axis at the time k.
fn column<const O: usize>(k: usize, i: usize, axis: usize) -> usize {
    3 * (O * k + i) + axis
}

/// Returns P of ½ xᵀP x for the cost Σ EᵀW E + V/h² (ΔE)² + E_NᵀG E_N: upper triangle, scaled.
fn cost_matrix<const O: usize>(layout: &Layout<O>) -> CscMatrix<f64> {
    let Layout { chain, cost, horizon: n, scale, .. } = layout;
    let (top, h2) = (O - 1, chain.step * chain.step);
    let mut triplets = Triplets::default();
    for k in 0..=*n {
        let column = |i: usize, axis: usize| column::<O>(k, i, axis);
        let intervals = if k == 0 || k == *n { 1.0 } else { 2.0 };
        let weight = |i: usize, j: usize| match (k == *n, i == j) {
            (true, _) => cost.end[i][j],
            (false, true) => cost.state[i],
            (false, false) => Vector3::zeros(),
        };
        for axis in 0..3 {
            for i in 0..O {
                for j in i..O {
                    let moved = if i == top { intervals * cost.input[axis] / h2 } else { 0.0 };
                    let sum = weight(i, j)[axis] + moved;
                    triplets.push(
                        column(i, axis),
                        column(j, axis),
                        2.0 * sum * scale[i] * scale[j],
                    );
                }
            }
            if k > 0 {
                let before = column(top, axis) - 3 * O;
                let moved = -2.0 * cost.input[axis] / h2;
                triplets.push(before, column(top, axis), moved * scale[top] * scale[top]);
            }
        }
    }
    triplets.compress(3 * O * (n + 1), 3 * O * (n + 1)).0
}
