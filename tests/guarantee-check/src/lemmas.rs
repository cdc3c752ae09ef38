//! Inequalities of the geometry and of the inertia, each checked by branch and bound over its whole
//! domain.
//!
//! Directions are points on the surface of a cube. Each checked expression is homogeneous and even
//! in each vector, so three faces cover all directions of space and two sides those of the plane.
//! The domain of β is that of u = tan(β/2). A symmetric multilinear map attains its norm at equal
//! arguments (Banach 1938). Therefore ‖∂²W[o, x̂] v + ∂²W[o, v̂] x‖ ≤ b ‖o‖ ‖x‖ ‖v‖ for all x and v
//! follows from the case x = v, and likewise for third derivatives.

use crate::dual::{Dual, Number, Real};
use crate::identity;
use crate::interval::Interval;
use crate::kinematics::{Turn, Vector, cross, dot, sine_cosine, square, sum, times, turned, unit};
use crate::search::{Effort, supremum};
use control::crmpc::{
    CURVATURE, DRIFT_BY_ANGLES_TWICE, DRIFT_MIXED, Domain, FOURTH, Lemmas, Settings, TURN,
};
use control::linearise::TURN_BY_ANGLES;
use nalgebra::Matrix3;

/// Relative rounding error that the bounds are allowed, as in the controller's own checks.
pub const ROUNDING: f64 = 1e-9;

/// Result for one bound: the bound and an enclosure of the true value.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Inequality or quantity that is checked.
    pub statement: String,
    /// Bound b that the proof uses.
    pub bound: f64,
    /// Enclosure of the smallest bound that would be true. The upper end is rounded outwards. For
    /// the bounds of [`crate::dynamics`] the lower end comes from a search in plain floating-point
    /// numbers and only shows how tight the bound is.
    pub truth: Interval,
}

impl Finding {
    /// Whether the bound is certain to be true.
    pub fn holds(&self) -> bool {
        self.truth.high <= self.bound * (1.0 + ROUNDING)
    }

    /// Whether the bound is certain to be false.
    pub fn fails(&self) -> bool {
        self.truth.low > self.bound * (1.0 + ROUNDING)
    }

    /// Relative amount by which the bound could certainly be smaller.
    pub fn margin(&self) -> f64 {
        1.0 - self.truth.high / self.bound
    }
}

/// Enclosures of the largest values found by branch and bound, with which the bounds of the
/// dynamics are checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Suprema {
    /// Largest ‖Ẇ x‖ over unit vectors x.
    pub drift: Interval,
    /// Largest ‖∂²W[o, o′] y‖ over unit vectors.
    pub curvature: Interval,
    /// Largest ‖`∂W[o] y`‖ over unit vectors.
    pub turn: Interval,
    /// Largest ‖∂²W[o, v̂] x + ∂²W[o, x̂] v‖ over unit vectors.
    pub mixed: Interval,
    /// Largest ‖∂³W[o, o, x̂] x‖ over unit vectors.
    pub twice: Interval,
    /// Largest ‖∂⁴W[o, o, o, o] y‖ over unit vectors.
    pub fourth: Interval,
    /// Largest ‖ω × I ω‖ over unit vectors ω, kg m².
    pub spin: Interval,
    /// Largest ‖I⁻¹ (ω × I ω)‖ over unit vectors ω.
    pub spin_inverse: Interval,
    /// Largest ‖I y‖ over unit vectors y, kg m².
    pub largest: Interval,
    /// Largest ‖I⁻¹ y‖ over unit vectors y, 1/(kg m²).
    pub inverse: Interval,
    /// Largest ‖R y‖ over unit vectors y.
    pub r: Interval,
}

/// Direction in the plane, on side `chart` < 2 of the square.
fn plane<const N: usize>(chart: usize, a: Dual<N>) -> [Dual<N>; 2] {
    let one = Dual::constant(1);
    if chart == 0 { [one, a] } else { [a, one] }
}

/// Direction in space, on face `chart` < 3 of the cube.
fn space<const N: usize>(chart: usize, a: Dual<N>, b: Dual<N>) -> Vector<Dual<N>> {
    let one = Dual::constant(1);
    match chart {
        0 => [one, a, b],
        1 => [a, one, b],
        _ => [a, b, one],
    }
}

fn length<const N: usize>(o: &[Dual<N>; 2]) -> Dual<N> {
    o[0].squared() + o[1].squared()
}

const SIDE: Interval = Interval::new(-1.0, 1.0);

/// Search that checks one inequality at a time and collects the findings.
struct Search {
    /// Domain of u = tan(β/2).
    u: Interval,
    gap: f64,
    boxes: usize,
    findings: Vec<Finding>,
}

impl Search {
    /// Checks √f ≤ `bound` over the box `sides` in each of `charts` charts, records the finding and
    /// returns the enclosure of the largest √f. `scale` is the unit of `bound`.
    fn check<const N: usize>(
        &mut self,
        statement: &str,
        bound: f64,
        scale: f64,
        charts: usize,
        sides: [Interval; N],
        f: impl Fn(usize, &[Dual<N>; N]) -> Dual<N>,
    ) -> Interval {
        let goal = (bound / scale).powi(2) * (1.0 + ROUNDING);
        let effort = Effort { gap: self.gap, goal, boxes: self.boxes };
        let truth = supremum(&f, charts, sides, effort).sqrt() * Interval::from(scale);
        self.findings.push(Finding { statement: statement.into(), bound, truth });
        truth
    }
}

fn turn<const N: usize>(u: Dual<N>) -> Turn<Dual<N>> {
    let (sine, cosine) = sine_cosine(u);
    Turn::new(sine, cosine)
}

/// Interval of tan(β/2) for |β| ≤ `sideslip` (rad).
pub fn half_angles(sideslip: f64) -> Interval {
    let (sine, cosine) = Interval::point(sideslip).sin_cos();
    let u = (sine / (Interval::ONE + cosine)).high;
    Interval::new(-u, u)
}

/// Rows of I divided by `scale`, for the inertia exactly as the settings hold it.
pub fn rows(inertia: &Matrix3<f64>, scale: f64) -> [Vector<Interval>; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| Interval::from(inertia[(i, j)]) / Interval::from(scale))
    })
}

/// Inverse by cofactors: its columns are vector products of the rows, divided by the determinant.
pub fn inverse(rows: &[Vector<Interval>; 3]) -> [Vector<Interval>; 3] {
    let columns = [cross(&rows[1], &rows[2]), cross(&rows[2], &rows[0]), cross(&rows[0], &rows[1])];
    let determinant = dot(&rows[0], &columns[0]);
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i] / determinant))
}

fn fixed<const N: usize>(rows: &[Vector<Interval>; 3]) -> [Vector<Dual<N>>; 3] {
    rows.map(|row| row.map(Dual::fixed))
}

/// Rows of ∂(ω × I ω)/∂ω, whose columns are e × I ω + ω × I e.
fn gyroscopic<const N: usize>(
    inertia: &[Vector<Dual<N>>; 3],
    omega: &Vector<Dual<N>>,
) -> [Vector<Dual<N>>; 3] {
    let momentum = times(inertia, omega);
    [0, 1, 2].map(|j| {
        let unit = unit(j);
        sum(cross(&unit, &momentum), cross(omega, &times(inertia, &unit)))
    })
}

/// Returns settings whose limits are the domain of the bounds.
pub(crate) fn over_the_domain(s: &Settings, lemmas: &Lemmas) -> Settings {
    let Domain { rate: limit_rate, sideslip: sideslip_domain } = lemmas.dynamics.domain;
    Settings { limit_rate, sideslip_domain, ..*s }
}

/// Checks the bounds of the geometry and of the inertia over their domain. The search aims for
/// enclosures of the relative width `gap`.
pub fn check(s: &Settings, lemmas: &Lemmas, gap: f64) -> (Vec<Finding>, Suprema) {
    let s = &over_the_domain(s, lemmas);
    let u = half_angles(s.sideslip_domain);
    let mut search = Search { u, gap, boxes: 4_000_000, findings: Vec::new() };
    let [drift, curvature, turn, mixed, twice, fourth] = geometry(&mut search, lemmas);
    let r = lemma1(&mut search, lemmas, s.sideslip_domain);
    let (spin, spin_inverse, largest, inverse) = inertia(&mut search, s, lemmas);
    induced_norm(&mut search, s, lemmas);
    let suprema = Suprema {
        drift,
        curvature,
        turn,
        mixed,
        twice,
        fourth,
        spin,
        spin_inverse,
        largest,
        inverse,
        r,
    };
    (search.findings, suprema)
}

fn geometry(search: &mut Search, lemmas: &Lemmas) -> [Interval; 6] {
    let u = search.u;
    let three = [u, SIDE, SIDE];
    let (statement, bound) = ("‖Ẇ x‖ ≤ b ‖x‖²", lemmas.dynamics.geometry.drift);
    let drift = search.check(statement, bound, 1.0, 3, three, |chart, &[u, a, b]| {
        let x = space(chart, a, b);
        square(&turn(u).drift(&x)) / square(&x).squared()
    });
    let statement = "‖∂(Ẇ x)/∂x‖ ≤ b ‖x‖ (Frobenius)";
    let bound = lemmas.dynamics.geometry.drift_by_rates;
    search.check(statement, bound, 1.0, 3, three, |chart, &[u, a, b]| {
        let (x, turn) = (space(chart, a, b), turn(u));
        let column = |j: usize| {
            let unit = unit(j);
            let by_turn = turn.along(&[[x[0], x[1]]], &unit);
            square(&sum(by_turn, turn.along(&[[unit[0], unit[1]]], &x)))
        };
        (column(0) + column(1) + column(2)) / square(&x)
    });
    let statement = "‖∂²(W y)/∂(α, β)²‖ ≤ b ‖y‖ (Frobenius)";
    let curvature = search.check(statement, CURVATURE, 1.0, 3, three, |chart, &[u, a, b]| {
        let (y, turn) = (space(chart, a, b), turn(u));
        let squared = |i, j| square(&turn.derivative(i, j, &y));
        (squared(2, 0) + squared(1, 1) + squared(1, 1) + squared(0, 2)) / square(&y)
    });
    let statement = "‖∂(W y)/∂(α, β)‖ ≤ b ‖y‖ (Frobenius)";
    search.check(statement, TURN_BY_ANGLES, 1.0, 3, three, |chart, &[u, a, b]| {
        let (y, turn) = (space(chart, a, b), turn(u));
        (square(&turn.derivative(1, 0, &y)) + square(&turn.derivative(0, 1, &y))) / square(&y)
    });
    let four = [u, SIDE, SIDE, SIDE];
    let statement = "‖∂W[o]‖ ≤ b ‖o‖";
    let by_turn = search.check(statement, TURN, 1.0, 6, four, |chart, &[u, o, a, b]| {
        let (o, y) = (plane(chart % 2, o), space(chart / 2, a, b));
        square(&turn(u).along(&[o], &y)) / (length(&o) * square(&y))
    });
    let statement = "‖∂²(Ẇ x)/∂(α, β)∂x‖ ≤ b ‖x‖";
    let mixed = search.check(statement, DRIFT_MIXED, 1.0, 6, four, |chart, &[u, o, a, b]| {
        let (o, x) = (plane(chart % 2, o), space(chart / 2, a, b));
        let value = turn(u).along(&[o, [x[0], x[1]]], &x);
        Dual::constant(4) * square(&value) / (length(&o) * square(&x).squared())
    });
    let statement = "‖∂²(Ẇ x)/∂(α, β)²‖ ≤ b ‖x‖²";
    let twice =
        search.check(statement, DRIFT_BY_ANGLES_TWICE, 1.0, 6, four, |chart, &[u, o, a, b]| {
            let (o, x) = (plane(chart % 2, o), space(chart / 2, a, b));
            let value = turn(u).along(&[o, o, [x[0], x[1]]], &x);
            square(&value) / (length(&o) * square(&x)).squared()
        });
    let statement = "‖∂⁴(W y)/∂(α, β)⁴‖ ≤ b ‖y‖";
    let fourth = search.check(statement, FOURTH, 1.0, 6, four, |chart, &[u, o, a, b]| {
        let (o, y) = (plane(chart % 2, o), space(chart / 2, a, b));
        let value = turn(u).along(&[o, o, o, o], &y);
        square(&value) / (length(&o).squared().squared() * square(&y))
    });
    [drift, curvature, by_turn, mixed, twice, fourth]
}

/// Checks the bounds of ‖W‖ and ‖R‖.
fn lemma1(search: &mut Search, lemmas: &Lemmas, sideslip: f64) -> Interval {
    let proven = identity::lemma1();
    let (one, r) = if proven {
        (Interval::ONE, Interval::ONE / Interval::point(sideslip).sin_cos().1)
    } else {
        (Interval::ALL, Interval::ALL)
    };
    search.findings.push(Finding {
        statement: "‖W‖ ≤ b (exact identity)".into(),
        bound: 1.0,
        truth: one,
    });
    search.findings.push(Finding {
        statement: "‖R‖ ≤ b (exact identity)".into(),
        bound: lemmas.dynamics.geometry.r,
        truth: r,
    });
    r
}

fn inertia(
    search: &mut Search,
    s: &Settings,
    lemmas: &Lemmas,
) -> (Interval, Interval, Interval, Interval) {
    // The inertia is divided by its largest moment, so that all numbers are near one.
    let scale = lemmas.dynamics.largest;
    let rows = rows(&s.body.inertia, scale);
    let inverse = fixed::<2>(&inverse(&rows));
    let rows = fixed::<2>(&rows);
    let two = [SIDE, SIDE];
    let statement = "‖I y‖ ≤ b ‖y‖";
    let largest = search.check(statement, scale, scale, 3, two, |chart, &[a, b]| {
        let y = space(chart, a, b);
        square(&times(&rows, &y)) / square(&y)
    });
    let (statement, bound) = ("‖I⁻¹ y‖ ≤ b ‖y‖", 1.0 / lemmas.dynamics.smallest);
    let of_inverse = search.check(statement, bound, 1.0 / scale, 3, two, |chart, &[a, b]| {
        let y = space(chart, a, b);
        square(&times(&inverse, &y)) / square(&y)
    });
    let statement = "‖∂(ω × I ω)/∂ω‖ ≤ b ‖ω‖ (Frobenius)";
    search.check(statement, lemmas.gyroscopic.0, scale, 3, two, |chart, &[a, b]| {
        let omega = space(chart, a, b);
        let [x, y, z] = gyroscopic(&rows, &omega);
        (square(&x) + square(&y) + square(&z)) / square(&omega)
    });
    let statement = "‖∂(I⁻¹ (ω × I ω))/∂ω‖ ≤ b ‖ω‖ (Frobenius)";
    search.check(statement, lemmas.gyroscopic.1, 1.0, 3, two, |chart, &[a, b]| {
        let omega = space(chart, a, b);
        let [x, y, z] = gyroscopic(&rows, &omega).map(|column| square(&times(&inverse, &column)));
        (x + y + z) / square(&omega)
    });
    let spread = lemmas.dynamics.largest - lemmas.dynamics.smallest;
    let gyroscopic_moment = |omega: &Vector<Dual<2>>| cross(omega, &times(&rows, omega));
    let statement = "‖ω × I ω‖ ≤ b ‖ω‖²";
    let spin = search.check(statement, 0.5 * spread, scale, 3, two, |chart, &[a, b]| {
        let omega = space(chart, a, b);
        square(&gyroscopic_moment(&omega)) / square(&omega).squared()
    });
    let statement = "‖I⁻¹ (ω × I ω)‖ ≤ b ‖ω‖²";
    let bound = 0.5 * spread / lemmas.dynamics.smallest;
    let spin_inverse = search.check(statement, bound, 1.0, 3, two, |chart, &[a, b]| {
        let omega = space(chart, a, b);
        square(&times(&inverse, &gyroscopic_moment(&omega))) / square(&omega).squared()
    });
    (spin, spin_inverse, largest, of_inverse)
}

fn induced_norm(search: &mut Search, s: &Settings, lemmas: &Lemmas) {
    let unit = lemmas.dynamics.largest;
    let rows = fixed::<2>(&rows(&s.body.inertia, unit));
    // There are two charts of α, half a turn apart, and four corners up to their common sign.
    let sides = [search.u, SIDE];
    let statement = "‖I W s‖ ≤ b over the corners s of the unit box";
    search.check(statement, lemmas.induced_norm, unit, 8, sides, |chart, &[u, v]| {
        let one = Dual::constant(1);
        let sign = |bit: usize| Dual::constant(if chart & bit == 0 { 1 } else { -1 });
        let corner = [one, sign(1), sign(2)];
        let (sine, cosine) = sine_cosine(v);
        let y = turn(u).along(&[], &corner);
        square(&times(&rows, &turned(sign(4) * sine, sign(4) * cosine, &y)))
    });
}
