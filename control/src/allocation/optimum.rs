//! The problem (60) of Wu 2015 subject to (59), (63), (65) as a second-order cone program.
//!
//! The unknowns are t, x and u: t bounds the norm, δ_A = middle + half ∘ x with −1 ≤ x ≤ 1, and
//! δ_RCS = u. The range of a surface within its limits of position and rate is middle ± half. A
//! surface that may not move has half = 0, so that the program always has an interior.

use crate::conic_program::{ConicProgram, Optimum, Triplets};
use clarabel::solver::SupportedConeT::{NonnegativeConeT, SecondOrderConeT};
use nalgebra::{SMatrix, Vector3};
use vehicle::effectors::{JETS, Jets, SURFACES, Surfaces};

/// Effectiveness D_A of the surfaces, Wu 2015 (58), N m/rad.
pub(super) type SurfaceMatrix = SMatrix<f64, 3, SURFACES>;

/// Typical moment, by which the cone is scaled, N m.
const MOMENT_SCALE: f64 = 1e4;
const COLUMNS: usize = 1 + SURFACES + JETS;
/// Number of rows of x ≤ 1, −x ≤ 1, u ≤ 1, −u ≤ 0.
const BOX_ROWS: usize = 2 * (SURFACES + JETS);

/// The weights of problem (60).
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    /// Weight W₁ of the moment, 1/(N m).
    pub moment: Vector3<f64>,
    /// Weight W₂ of the jets.
    pub jet: Jets,
    /// Our weight of ½ (deflection/range)², per surface in 1/rad².
    pub surface: Surfaces,
}

/// The cone program together with its solver.
pub(super) struct OptimalAllocation {
    program: ConicProgram,
    weights: Weights,
    /// Positions of the numbers of D_A in the matrix.
    surface_slots: [[usize; 3]; SURFACES],
}

impl OptimalAllocation {
    /// Sets up the program and its solver.
    ///
    /// # Errors
    /// Returns the solver's message if it refuses the data.
    pub(super) fn new(
        weights: Weights,
        jets: &SMatrix<f64, 3, JETS>,
        max_iterations: u32,
    ) -> Result<Self, String> {
        let mut cost = Triplets::default();
        for j in 0..SURFACES {
            cost.push(1 + j, 1 + j, 0.0);
        }
        let mut matrix = Triplets::default();
        let mut right_side = vec![1.0; BOX_ROWS + 4];
        for j in 1..COLUMNS {
            let row = 2 * (j - 1);
            matrix.push(row, j, 1.0);
            matrix.push(row + 1, j, -1.0);
            if j > SURFACES {
                right_side[row + 1] = 0.0;
            }
        }
        matrix.push(BOX_ROWS, 0, -1.0);
        right_side[BOX_ROWS] = 0.0;
        let mut surface_slots = [[0; 3]; SURFACES];
        for i in 0..3 {
            let row = BOX_ROWS + 1 + i;
            for (j, slots) in surface_slots.iter_mut().enumerate() {
                slots[i] = matrix.push(row, 1 + j, 0.0);
            }
            for j in 0..JETS {
                matrix.push(row, 1 + SURFACES + j, weights.moment[i] * jets[(i, j)] / MOMENT_SCALE);
            }
        }
        let (matrix, position) = matrix.compress(BOX_ROWS + 4, COLUMNS);
        for slot in surface_slots.iter_mut().flatten() {
            *slot = position[*slot];
        }
        let cones = [NonnegativeConeT(BOX_ROWS), SecondOrderConeT(4)];
        let cost = cost.compress(COLUMNS, COLUMNS).0;
        let mut program = ConicProgram::new(cost, matrix, right_side, &cones, max_iterations)?;
        program.linear_cost[0] = MOMENT_SCALE;
        program.linear_cost[1 + SURFACES..].copy_from_slice(weights.jet.as_slice());
        Ok(Self { program, weights, surface_slots })
    }

    /// Returns the optimum for `moment` (N m), if it is found, and the number of iterations.
    /// `matrix` is D_A in N m/rad; the deflections are within `low` and `high`, rad.
    pub(super) fn solve(
        &mut self,
        moment: &Vector3<f64>,
        matrix: &SurfaceMatrix,
        low: &Surfaces,
        high: &Surfaces,
    ) -> (Option<(Surfaces, Jets)>, u32) {
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let rest = moment - matrix * middle;
        let weight = self.weights.moment / MOMENT_SCALE;
        for (j, slots) in self.surface_slots.iter().enumerate() {
            let square = self.weights.surface[j] * half[j];
            self.program.cost[j] = square * half[j];
            self.program.linear_cost[1 + j] = square * middle[j];
            for (i, &slot) in slots.iter().enumerate() {
                self.program.matrix[slot] = weight[i] * matrix[(i, j)] * half[j];
            }
        }
        for i in 0..3 {
            self.program.right_side[BOX_ROWS + 1 + i] = weight[i] * rest[i];
        }
        let (solution, iterations) = self.program.solve();
        let optimum = solution.map(|Optimum { x, .. }| {
            let (x, u) = x[1..].split_at(SURFACES);
            let (x, u) = (Surfaces::from_column_slice(x), Jets::from_column_slice(u));
            (middle + half.component_mul(&x), u)
        });
        (optimum, iterations)
    }
}
