//! Convex programmes as Clarabel takes them: minimise x'Px / 2 + q'x where A x + s = b and s lies in cones.

use clarabel::algebra::CscMatrix;
#[cfg(test)]
use clarabel::solver::SecondOrderConeT;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver as _, NonnegativeConeT, SolverStatus, SupportedConeT,
};

/// A row of `b - A x`: an affine function of the variables.
#[derive(Clone, Debug, Default)]
pub(crate) struct Affine {
    pub constant: f64,
    /// Index of a variable and its factor.
    pub terms: Vec<(usize, f64)>,
}

impl Affine {
    pub fn new(constant: f64, terms: &[(usize, f64)]) -> Self {
        Self { constant, terms: terms.to_vec() }
    }
}

/// Rows as they are added, with the cone that each belongs to.
pub(crate) struct Programme {
    n_variables: usize,
    quadratic: Triplets,
    linear: Vec<f64>,
    rows: Triplets,
    constants: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

#[derive(Default)]
struct Triplets {
    rows: Vec<usize>,
    cols: Vec<usize>,
    values: Vec<f64>,
}

impl Triplets {
    fn push(&mut self, row: usize, col: usize, value: f64) {
        self.rows.push(row);
        self.cols.push(col);
        self.values.push(value);
    }
}

impl Programme {
    pub fn new(n_variables: usize) -> Self {
        Self {
            n_variables,
            quadratic: Triplets::default(),
            linear: vec![0.0; n_variables],
            rows: Triplets::default(),
            constants: Vec::new(),
            cones: Vec::new(),
        }
    }

    /// Adds `factor` times a variable to what is minimised.
    pub fn minimise(&mut self, variable: usize, factor: f64) {
        self.linear[variable] += factor;
    }

    /// Adds the square of a linear function to what is minimised.
    pub fn minimise_square(&mut self, terms: &[(usize, f64)]) {
        for (a, by_a) in terms {
            // The upper triangle is what the solver reads.
            for (b, by_b) in terms.iter().filter(|(b, _)| b >= a) {
                self.quadratic.push(*a, *b, 2.0 * by_a * by_b);
            }
        }
    }

    /// Asks for rows that are not negative.
    pub fn not_negative(&mut self, rows: &[Affine]) {
        self.push(rows);
        self.cones.push(NonnegativeConeT(rows.len()));
    }

    /// Asks that the first row be no less than the length of the vector of the others.
    #[cfg(test)]
    pub fn no_shorter(&mut self, rows: &[Affine]) {
        self.push(rows);
        self.cones.push(SecondOrderConeT(rows.len()));
    }

    fn push(&mut self, rows: &[Affine]) {
        for affine in rows {
            let row = self.constants.len();
            self.constants.push(affine.constant);
            for (variable, factor) in &affine.terms {
                self.rows.push(row, *variable, -factor);
            }
        }
    }

    /// The variables at the least; `None` where the solver finds none.
    pub fn solve(self) -> Option<Vec<f64>> {
        let n = self.n_variables;
        let matrix = |n_rows: usize, triplets: Triplets| {
            CscMatrix::new_from_triplets(n_rows, n, triplets.rows, triplets.cols, triplets.values)
        };
        let quadratic = matrix(n, self.quadratic);
        let rows = matrix(self.constants.len(), self.rows);
        let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
        let solver =
            DefaultSolver::new(&quadratic, &self.linear, &rows, &self.constants, &self.cones, settings);
        let mut solver = solver.ok()?;
        solver.solve();
        let is_solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        is_solved.then_some(solver.solution.x)
    }
}
