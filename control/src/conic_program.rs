//! Second-order cone programs for Clarabel that are set up once and then updated in place. Only
//! numbers change from sample to sample, never the sparsity.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// A sparse matrix that is collected entry by entry; the position of each entry in compressed
/// columns is recorded.
#[derive(Default)]
pub(crate) struct Triplets {
    entries: Vec<(usize, usize, f64)>,
}

impl Triplets {
    pub(crate) fn push(&mut self, row: usize, column: usize, value: f64) -> usize {
        self.entries.push((row, column, value));
        self.entries.len() - 1
    }

    /// Removes all entries, and keeps their memory.
    pub(crate) fn clear(&mut self) {
        self.entries.clear();
    }

    /// Writes the values of the entries to their `position` among `values`.
    pub(crate) fn write(&self, position: &[usize], values: &mut [f64]) {
        for (&(.., value), &place) in self.entries.iter().zip(position) {
            values[place] = value;
        }
    }

    /// Returns the matrix, and for each pushed entry its position among the values.
    pub(crate) fn compress(&self, rows: usize, columns: usize) -> (CscMatrix<f64>, Vec<usize>) {
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

/// The program: minimise ½ xᵀP x + qᵀx subject to A x + s = b, with s in a product of cones. The
/// vectors are the solver's data, which may be changed between solutions.
pub(crate) struct ConicProgram {
    solver: Box<DefaultSolver<f64>>,
    /// Values of P, upper triangle in compressed columns.
    pub(crate) cost: Vec<f64>,
    /// Linear cost vector q.
    pub(crate) linear_cost: Vec<f64>,
    /// Values of A in compressed columns.
    pub(crate) matrix: Vec<f64>,
    /// Right side vector b.
    pub(crate) right_side: Vec<f64>,
}

/// An optimum: the vector x and the duals of the rows of A.
pub(crate) struct Optimum<'a> {
    pub(crate) x: &'a [f64],
    pub(crate) duals: &'a [f64],
}

impl ConicProgram {
    /// Sets up the solver for these sparsity patterns.
    ///
    /// # Errors
    /// Returns the solver's message if it refuses the data, for example weights that are not
    /// positive semidefinite.
    pub(crate) fn new(
        cost: CscMatrix<f64>,
        matrix: CscMatrix<f64>,
        right_side: Vec<f64>,
        cones: &[SupportedConeT<f64>],
        max_iterations: u32,
    ) -> Result<Self, String> {
        let linear_cost = vec![0.0; cost.n];
        let settings = solver_settings(max_iterations);
        let solver = DefaultSolver::new(&cost, &linear_cost, &matrix, &right_side, cones, settings)
            .map(Box::new)
            .map_err(|error| error.to_string())?;
        Ok(Self { solver, cost: cost.nzval, linear_cost, matrix: matrix.nzval, right_side })
    }

    /// Limits the iterations and the time (s) of the next solutions.
    pub(crate) fn limit(&mut self, iterations: u32, seconds: f64) {
        let settings = self.solver.settings();
        // Unchanged limits need no update, which would allocate.
        if (settings.max_iter, settings.time_limit) != (iterations, seconds) {
            let settings =
                DefaultSettings { max_iter: iterations, time_limit: seconds, ..settings.clone() };
            // Both settings may be changed at any time.
            let _ = self.solver.update_settings(settings);
        }
    }

    /// Solves with the present data. Returns the optimum with its duals, if there is one, and the
    /// iterations.
    pub(crate) fn solve(&mut self) -> (Option<Optimum<'_>>, u32) {
        let accepted = self.solver.update_P(&self.cost).is_ok()
            && self.solver.update_q(&self.linear_cost).is_ok()
            && self.solver.update_A(&self.matrix).is_ok()
            && self.solver.update_b(&self.right_side).is_ok();
        if !accepted {
            return (None, 0);
        }
        self.solver.solve();
        let solution = &self.solver.solution;
        let solved = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        (solved.then_some(Optimum { x: &solution.x, duals: &solution.z }), solution.iterations)
    }
}

/// Largest gap and residuals of a solution that is accepted.
const ACCEPTED: f64 = 1e-6;

/// Returns the solver's settings: data are updated in place, which forbids presolve, and they are
/// scaled by hand.
fn solver_settings(max_iter: u32) -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_iter,
        presolve_enable: false,
        equilibrate_enable: false,
        input_sparse_dropzeros: false,
        iterative_refinement_enable: true,
        // Steps to a relative 1e-8 need no more, and every refinement costs a solution.
        iterative_refinement_reltol: 1e-9,
        iterative_refinement_abstol: 1e-9,
        // A solution of this accuracy, which rounding stopped short of 1e-8, still counts as an
        // optimum; anything coarser does not.
        reduced_tol_gap_abs: ACCEPTED,
        reduced_tol_gap_rel: ACCEPTED,
        reduced_tol_feas: ACCEPTED,
        direct_solve_method: "qdldl".into(),
        max_threads: 1,
        ..DefaultSettings::default()
    }
}
