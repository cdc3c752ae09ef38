//! The problem with its norm constraints linearised, as a second-order cone program for Clarabel.
//! It serves as a check of [`super::riccati`] and as a substitute where that method fails.
//!
//! The unknowns are the scaled errors E_k, k = 0..=N. The inputs are eliminated, as the error of
//! the last derivative changes by h v_k = E_{k+1} − E_k − d_k.

use super::constraints::{LinearisedConstraints, StageConstraints};
use super::layout::Layout;
use super::problem::{Outcome, Problem, Solution, Start, of_axis};
use crate::conic_program::{ConicProgram, Optimum, Triplets};
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{self, NonnegativeConeT, SecondOrderConeT, ZeroConeT};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// The cone program together with its solver.
pub struct ConicSolver<const O: usize> {
    layout: Layout<O>,
    max_iterations: u32,
    program: ConicProgram,
    /// Positions of the coefficients of each stage's norm constraint in the matrix, and of its rows
    /// in the right side.
    state_slots: Vec<Slots<O>>,
    input_slots: Vec<Slots<O>>,
    start_row: usize,
    terminal_row: Option<usize>,
}

struct Slots<const O: usize> {
    row: usize,
    /// Positions of the block on E_k of the stage to which the norm constraint belongs.
    state: [[[usize; 3]; O]; 3],
    /// Positions of the block on the last derivative of E_{k+1} (input constraints).
    next: Option<[[usize; 3]; 3]>,
}

impl<const O: usize> ConicSolver<O> {
    /// Sets up the program and its solver.
    ///
    /// # Errors
    /// Returns the solver's message if it refuses the data, for example weights that are not
    /// positive semidefinite.
    pub fn new(layout: Layout<O>, max_iterations: u32) -> Result<Self, String> {
        let Layout { horizon: n, scale, .. } = &layout;
        let n = *n;
        let top = O - 1;

        let mut a = Triplets::default();
        let mut cones: Vec<SupportedConeT<f64>> = Vec::new();
        let mut row = add_chain(&layout, &mut a);
        if row > 0 {
            cones.push(ZeroConeT(row));
        }
        let start_row = row;
        match &layout.start {
            None => {
                for i in 0..3 * O {
                    a.push(row, i, 1.0);
                    row += 1;
                }
                cones.push(ZeroConeT(3 * O));
            }
            Some(normals) => {
                // Faces of the initial set: ±nᵀ(E_given − E_0) ≤ 1.
                for (axis, normals) in normals.iter().enumerate() {
                    for (normal, sign) in
                        normals.iter().flat_map(|normal| [(normal, 1.0), (normal, -1.0)])
                    {
                        for i in 0..O {
                            a.push(row, column::<O>(0, i, axis), -sign * normal[i] * scale[i]);
                        }
                        row += 1;
                    }
                }
                cones.push(NonnegativeConeT(row - start_row));
            }
        }
        let mut add_cone = |a: &mut Triplets, k: usize, next: bool| {
            let mut block = |k: usize, i: usize, component: usize| {
                std::array::from_fn(|axis| {
                    a.push(row + 1 + component, column::<O>(k, i, axis), 0.0)
                })
            };
            let state =
                std::array::from_fn(|component| std::array::from_fn(|i| block(k, i, component)));
            let next = next.then(|| std::array::from_fn(|component| block(k + 1, top, component)));
            let slots = Slots { row, state, next };
            row += 4;
            cones.push(SecondOrderConeT(4));
            slots
        };
        let stages = if layout.constrains_states { n } else { 0 };
        let mut state_slots: Vec<Slots<O>> =
            (1..=stages).map(|k| add_cone(&mut a, k, false)).collect();
        let mut input_slots: Vec<Slots<O>> = (0..n).map(|k| add_cone(&mut a, k, true)).collect();
        let terminal_row = layout.terminal.then(|| {
            // Terminal constraint ‖Lᵀ E_N‖ ≤ ε with G = L Lᵀ, divided by the scale.
            for axis in 0..3 {
                let root = square_root(&of_axis(&layout.cost.end, axis));
                for i in 0..O {
                    for j in 0..O {
                        a.push(
                            row + 1 + O * axis + i,
                            column::<O>(n, j, axis),
                            -root[(i, j)] * scale[j] / scale[0],
                        );
                    }
                }
            }
            cones.push(SecondOrderConeT(1 + 3 * O));
            row += 1 + 3 * O;
            row - 1 - 3 * O
        });

        let (matrix, position) = a.compress(row, 3 * O * (n + 1));
        for slots in state_slots.iter_mut().chain(&mut input_slots) {
            let next = slots.next.iter_mut().flatten().flatten();
            for i in slots.state.iter_mut().flatten().flatten().chain(next) {
                *i = position[*i];
            }
        }
        let mut right_side = vec![0.0; row];
        // Strictly feasible placeholders give the solver finite data for its setup.
        for slots in state_slots.iter().chain(&input_slots) {
            right_side[slots.row] = 1.0;
        }
        let cost = cost_matrix(&layout);
        let program = ConicProgram::new(cost, matrix, right_side, &cones, max_iterations)?;
        Ok(Self {
            layout,
            max_iterations,
            program,
            state_slots,
            input_slots,
            start_row,
            terminal_row,
        })
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
        let Layout { chain, scale, horizon: n, .. } = &self.layout;
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
        for k in 0..*n {
            let moved = trajectory.states[k + 1][O - 1]
                - trajectory.states[k][O - 1]
                - problem.affine[k][O - 1];
            trajectory.inputs[k] = moved / chain.step;
        }
        trajectory.roll_out(chain, problem.affine);
        // The dual of ‖y‖ ≤ 1 is the multiplier of ½(‖y‖² − 1) for the whole cost; the factor ½
        // converts it to half the cost.
        multipliers.clear();
        for (multiplier, slots) in multipliers.state.iter_mut().zip(&self.state_slots) {
            *multiplier = 0.5 * duals[slots.row];
        }
        for (multiplier, slots) in multipliers.input.iter_mut().zip(&self.input_slots) {
            *multiplier = 0.5 * duals[slots.row];
        }
        if let (Some(row), Some(radius)) = (self.terminal_row, problem.end.radius) {
            multipliers.terminal = 0.5 * duals[row] * radius / scale[0];
        }
        if let Start::Within(given, normals) = &problem.start {
            let mut row = self.start_row;
            for (axis, normals) in normals.iter().enumerate() {
                for normal in normals {
                    let force = 0.5 * (duals[row] - duals[row + 1]);
                    let deviation: f64 = (0..O)
                        .map(|i| normal[i] * (given[i][axis] - trajectory.states[0][i][axis]))
                        .sum();
                    for i in 0..O {
                        multipliers.start[i][axis] -= normal[i] * force;
                    }
                    multipliers.start_gap += 0.5
                        * (duals[row] * (deviation - 1.0).abs()
                            + duals[row + 1] * (deviation + 1.0).abs());
                    row += 2;
                }
            }
        }
        Outcome::Solved(iterations)
    }

    fn update(&mut self, problem: &Problem<O, LinearisedConstraints<O>>) {
        let Layout { chain, cost, scale, .. } = &self.layout;
        let top = O - 1;
        let h = chain.step;
        self.program.linear_cost.fill(0.0);
        for (k, d) in problem.affine.iter().enumerate() {
            for axis in 0..3 {
                // Part V/h² (E_{k+1} − E_k − d)² of the last derivative.
                let slope = 2.0 * cost.input[axis] / (h * h) * d[top][axis] * scale[top];
                self.program.linear_cost[3 * (O * k + top) + axis] += slope;
                self.program.linear_cost[3 * (O * (k + 1) + top) + axis] -= slope;
                for i in 0..top {
                    self.program.right_side[3 * (top * k + i) + axis] =
                        (d[i][axis] - chain.b[i] / h * d[top][axis]) / scale[i];
                }
            }
        }
        match &problem.start {
            Start::Fixed(given) => {
                for i in 0..3 * O {
                    self.program.right_side[self.start_row + i] =
                        given[i / 3][i % 3] / scale[i / 3];
                }
            }
            Start::Arrival(..) => {}
            Start::Within(given, normals) => {
                let mut row = self.start_row;
                for (axis, normals) in normals.iter().enumerate() {
                    for normal in normals {
                        let at: f64 = (0..O).map(|i| normal[i] * given[i][axis]).sum();
                        self.program.right_side[row] = 1.0 - at;
                        self.program.right_side[row + 1] = 1.0 + at;
                        row += 2;
                    }
                }
            }
        }
        let stages = problem.constraints.stages();
        for (slots, StageConstraints { state, .. }) in self.state_slots.iter().zip(&stages[1..]) {
            write_constraint(&mut self.program, slots, &state.by_state, &state.value, scale);
        }
        for (k, (slots, StageConstraints { input, .. })) in
            self.input_slots.iter().zip(stages).enumerate()
        {
            let by_difference = input.by_input / h;
            let mut by_state = input.by_state;
            by_state[top] -= by_difference;
            let value = input.value - by_difference * problem.affine[k][top];
            write_constraint(&mut self.program, slots, &by_state, &value, scale);
            for (i, places) in slots.next.iter().flatten().enumerate() {
                for (j, &place) in places.iter().enumerate() {
                    self.program.matrix[place] = -by_difference[(i, j)] * scale[top];
                }
            }
        }
        if let (Some(row), Some(radius)) = (self.terminal_row, problem.end.radius) {
            self.program.right_side[row] = radius / scale[0];
        }
    }
}

fn write_constraint<const O: usize>(
    program: &mut ConicProgram,
    slots: &Slots<O>,
    by_state: &[Matrix3<f64>; O],
    value: &Vector3<f64>,
    scale: &[f64; O],
) {
    for (component, places) in slots.state.iter().enumerate() {
        for (i, places) in places.iter().enumerate() {
            for (axis, &place) in places.iter().enumerate() {
                program.matrix[place] = -by_state[i][(component, axis)] * scale[i];
            }
        }
        program.right_side[slots.row + 1 + component] = value[component];
    }
    program.right_side[slots.row] = 1.0;
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

/// Adds the chain below its last derivative with v eliminated, divided by the scale. Returns the
/// number of its rows.
fn add_chain<const O: usize>(layout: &Layout<O>, a: &mut Triplets) -> usize {
    let Layout { chain, horizon, scale, .. } = layout;
    let (top, mut row) = (O - 1, 0);
    for k in 0..*horizon {
        for i in 0..top {
            let by_input = chain.b[i] / chain.step;
            for axis in 0..3 {
                a.push(row, column::<O>(k + 1, i, axis), 1.0);
                let by_end = -by_input * scale[top] / scale[i];
                a.push(row, column::<O>(k + 1, top, axis), by_end);
                for j in i..O {
                    let by_state =
                        if j == top { chain.a[(i, j)] - by_input } else { chain.a[(i, j)] };
                    a.push(row, column::<O>(k, j, axis), -by_state * scale[j] / scale[i]);
                }
                row += 1;
            }
        }
    }
    row
}

/// Returns P of ½ xᵀP x for the cost Σ EᵀW E + V/h² (ΔE)² + E_NᵀG E_N: upper triangle, scaled.
fn cost_matrix<const O: usize>(layout: &Layout<O>) -> CscMatrix<f64> {
    let Layout { chain, cost, horizon: n, scale, .. } = layout;
    let (top, h2) = (O - 1, chain.step * chain.step);
    let mut triplets = Triplets::default();
    for k in 0..=*n {
        let column = |i: usize, axis: usize| 3 * (O * k + i) + axis;
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
