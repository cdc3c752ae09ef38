//! The paper's figures of merit, accumulated while the run goes on.

use crate::error::Error;
use crate::experiment::Roles;
use crate::guarantee::{self, Course};
use crate::master::{Observer, Sample};
use crate::realtime::report::RealTime;
use crate::wiring::{Part, Port, find};
use fmu_import::names;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The variables that the observers need; each is read once per communication point.
#[derive(Clone, Default)]
pub struct Probes {
    /// Ports of the variables that the master reads.
    pub ports: Vec<Port>,
}

impl Probes {
    /// Index of a variable among a sample's values. The variable is added if it is not yet there.
    pub fn place(&mut self, port: Port) -> usize {
        self.ports.iter().position(|known| *known == port).unwrap_or_else(|| {
            self.ports.push(port);
            self.ports.len() - 1
        })
    }
}

/// Indices, among a sample's values, of the variables that the figures of merit need. A variable
/// that the experiment does not have is `None`.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Attitude angles α, β and σ, rad.
    pub attitude: Option<[usize; 3]>,
    /// Reference of the attitude angles, rad.
    pub reference: Option<[usize; 3]>,
    /// Angular rates p, q and r, rad/s.
    pub rate: Option<[usize; 3]>,
    /// Control moment about the three axes, N m.
    pub moment: Option<[usize; 3]>,
    /// Duration of the solver's last solution, s.
    pub solver_time: Option<usize>,
    /// Number of solutions up to the sample.
    pub solver_solves: Option<usize>,
    /// Number of fallbacks up to the sample.
    pub solver_fallbacks: Option<usize>,
    /// Variables with which the controller reports on its guarantee.
    pub guarantee: Option<guarantee::Signals>,
    /// Period of the samples that enter the means: every n-th communication point.
    pub every: u64,
}

impl Default for Places {
    /// No variables at all; the means are taken over every communication point.
    fn default() -> Self {
        Self {
            attitude: None,
            reference: None,
            rate: None,
            moment: None,
            solver_time: None,
            solver_solves: None,
            solver_fallbacks: None,
            guarantee: None,
            every: 1,
        }
    }
}

/// Limits that the angular rate and the moment are compared with.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Upper bound of ‖ω‖, rad/s.
    pub rate: Option<f64>,
    /// Upper bound of ‖m‖, N m.
    pub moment: Option<f64>,
}

/// Default prefix of the solver's variables.
pub(crate) const SOLVER: &str = "controller.solver";

/// Default prefix of the variables that say whether the controller's guarantee is in force.
pub(crate) const GUARANTEE: &str = "controller.guarantee";

const ANGLES: [&str; 3] = ["alpha", "beta", "sigma"];
const RATES: [&str; 3] = ["p", "q", "r"];
const AXES: [&str; 3] = ["x", "y", "z"];

/// Finds the variables of the roles, and the ports of the two limits.
///
/// # Errors
/// If a role that the experiment states names variables that do not exist. A default that matches
/// no variable is left out.
pub fn places(
    roles: &Roles,
    parts: &[Part],
    probes: &mut Probes,
) -> Result<(Places, [Option<Port>; 2]), Error> {
    if roles.every == 0 {
        return Err(Error::experiment("[metrics] every = 0: at least 1"));
    }
    let mut triple = |role: &str, stated: &Option<String>, default: &str, names: [&str; 3]| {
        let prefix = stated.as_deref().unwrap_or(default);
        let mut ports = [None; 3];
        for (port, name) in ports.iter_mut().zip(names) {
            let path = format!("{prefix}.{name}");
            *port = find(&path, parts);
            if port.is_none() && stated.is_some() {
                return Err(unknown(role, &path, parts));
            }
        }
        Ok(match ports {
            [Some(a), Some(b), Some(c)] => Some([a, b, c].map(|port| probes.place(port))),
            _ => None,
        })
    };
    let mut places = Places {
        attitude: triple("attitude", &roles.attitude, "plant.attitude", ANGLES)?,
        reference: triple("reference", &roles.reference, "controller.reference", ANGLES)?,
        rate: triple("rate", &roles.rate, "plant.rate", RATES)?,
        moment: triple("moment", &roles.moment, "controller.moment", AXES)?,
        every: u64::from(roles.every),
        ..Places::default()
    };
    let single = |role: &str, stated: &Option<String>, default: &str, name: &str| {
        let path = format!("{}.{name}", stated.as_deref().unwrap_or(default));
        let port = find(&path, parts);
        if port.is_none() && stated.is_some() { Err(unknown(role, &path, parts)) } else { Ok(port) }
    };
    let mut solver =
        |name| single("solver", &roles.solver, SOLVER, name).map(|port| port.map(|port| probes.place(port)));
    places.solver_time = solver("time")?;
    places.solver_solves = solver("solves")?;
    places.solver_fallbacks = solver("fallbacks")?;
    let mut guarantee = |name| {
        single("guarantee", &roles.guarantee, GUARANTEE, name).map(|port| port.map(|port| probes.place(port)))
    };
    let (in_force, status) = (guarantee("inForce")?, guarantee("status")?);
    let margins = [guarantee("rateMargin")?, guarantee("momentMargin")?];
    places.guarantee = in_force.map(|in_force| guarantee::Signals { in_force, status, margins });
    if let Some(lost) = roles.lost_deg {
        if lost.is_nan() || lost <= 0.0 {
            return Err(Error::experiment(format!("[metrics] lost_deg = {lost}: above 0")));
        }
        if places.attitude.is_none() || places.reference.is_none() {
            return Err(Error::experiment("[metrics] lost_deg: there is no attitude with a reference"));
        }
    }
    let limit = |name| single("limit", &roles.limit, "controller.limit", name);
    Ok((places, [limit("rate")?, limit("moment")?]))
}

fn unknown(role: &str, path: &str, parts: &[Part]) -> Error {
    let known: Vec<String> = parts
        .iter()
        .flat_map(|part| part.description.variables.iter().map(|v| format!("{}.{}", part.name, v.name)))
        .collect();
    let hint = names::hint(path, known.iter().map(String::as_str));
    Error::experiment(format!("[metrics] {role}: there is no variable \"{path}\"{hint}"))
}

/// The figures of merit as `metrics.json` holds them. A figure is `None` (null) if the experiment
/// lacks the quantity.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Attitude error √(mean of ‖Θ − Θ_r‖²) over the communication points before each step, deg.
    pub ems_deg: Option<f64>,
    /// Control effort √(mean of ‖m/M̄‖²) over the same points.
    pub cms: Option<f64>,
    /// Largest ‖ω‖ over all communication points, deg/s.
    pub max_rate_deg_s: Option<f64>,
    /// Upper bound of ‖ω‖, deg/s.
    pub rate_limit_deg_s: Option<f64>,
    /// Largest ‖m‖/M̄ over all communication points.
    pub max_moment_ratio: Option<f64>,
    /// Upper bound M̄ of the moment, N m.
    pub moment_limit: Option<f64>,
    /// The larger of two ratios: largest ‖ω‖ and largest ‖m‖, each divided by its bound.
    pub worst_limit_ratio: Option<f64>,
    /// Mean duration of a solution of the solver, ms.
    pub solver_ms_mean: Option<f64>,
    /// 99th percentile of the durations of the solutions, ms.
    pub solver_ms_p99: Option<f64>,
    /// Longest duration of a solution, ms.
    pub solver_ms_max: Option<f64>,
    /// Number of solutions of the solver.
    pub solves: Option<u64>,
    /// Number of times that the controller fell back.
    pub fallbacks: Option<u64>,
    /// Share of the communication points at which the controller's guarantee was in force.
    pub guarantee_share: Option<f64>,
    /// First time at which the guarantee was no longer in force, s; null if it was never lost.
    pub guarantee_lost_at: Option<f64>,
    /// Status of the guarantee when it was first lost, or the last status if it never was.
    pub guarantee_status: Option<String>,
    /// Smallest share of the rate limit that was left beyond the reserve while the guarantee was in
    /// force.
    pub guarantee_rate_margin_min: Option<f64>,
    /// Smallest share of the moment limit that was left beyond the reserve while the guarantee was
    /// in force.
    pub guarantee_moment_margin_min: Option<f64>,
    /// Whether a limit was exceeded while the guarantee was in force, which is a defect.
    pub guarantee_broken: Option<bool>,
    /// Simulated time divided by elapsed time.
    pub real_time_factor: Option<f64>,
    /// Elapsed wall-clock time, s.
    pub wall_s: f64,
    /// Largest delay of a feedback loop in addition to the units' own, s; null if there is no loop.
    pub loop_delay_s: Option<f64>,
    /// Number of communication points that the run reached.
    pub samples: u64,
    /// Whether the run reached its stop time. A lost attitude ends a single run, but not the runs
    /// of a study.
    pub completed: bool,
    /// First time at which the attitude was lost, s; null if it never was, or if the experiment
    /// does not define when it is lost.
    #[serde(default)]
    pub lost_at: Option<f64>,
    /// Mean computing time of each component per step of its own, µs, if it was measured.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub step_us: BTreeMap<String, f64>,
    /// Timing of the run against the wall clock, if it was paced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_time: Option<RealTime>,
}

/// Accumulates the figures of merit.
pub struct Merit {
    places: Places,
    limits: Limits,
    /// Sums of squares over the points before each step: attitude error, then moment. `steps` is
    /// the number of these points.
    sums: [f64; 2],
    steps: u64,
    largest: [f64; 2],
    solves: f64,
    solver_seconds: Vec<f64>,
    fallbacks: Option<f64>,
    guarantee: Option<Course>,
    /// Names of the guarantee's statuses, with their values.
    statuses: Vec<(String, i32)>,
    samples: u64,
    completed: bool,
    loss: Loss,
}

/// Defines when an attitude is lost and whether that ends the run.
#[derive(Clone, Copy, Debug, Default)]
struct Loss {
    /// Largest ‖Θ − Θ_r‖ that does not count as a loss of attitude, rad.
    beyond: Option<f64>,
    ends_run: bool,
    /// First time at which the bound was exceeded, s.
    at: Option<f64>,
}

/// Square of a vector's length.
pub(crate) fn norm_squared(values: &[f64], places: [usize; 3]) -> f64 {
    places.iter().map(|&place| values[place] * values[place]).sum()
}

impl Merit {
    /// Creates an accumulator without samples. `points` is the largest possible number of
    /// communication points.
    pub fn new(places: Places, limits: Limits, points: u64) -> Self {
        // This is enough room for a usual run; a longer run allocates more.
        let capacity = if places.solver_time.is_some() { points.min(1 << 16) as usize } else { 0 };
        Self {
            places,
            limits,
            sums: [0.0; 2],
            steps: 0,
            largest: [0.0; 2],
            solves: 0.0,
            solver_seconds: Vec::with_capacity(capacity),
            fallbacks: None,
            guarantee: Course::new(places, limits),
            statuses: Vec::new(),
            samples: 0,
            completed: false,
            loss: Loss::default(),
        }
    }

    /// Sets the distance from the reference beyond which the attitude counts as lost, deg.
    #[must_use]
    pub fn with_loss(mut self, beyond_deg: Option<f64>) -> Self {
        self.loss.beyond = beyond_deg.map(f64::to_radians);
        self
    }

    /// Makes a lost attitude end the run.
    #[must_use]
    pub fn ending_when_lost(mut self) -> Self {
        self.loss.ends_run = true;
        self
    }

    /// Gives the statuses of the guarantee their names.
    #[must_use]
    pub fn with_statuses(self, statuses: Vec<(String, i32)>) -> Self {
        Self { statuses, ..self }
    }

    /// Duration of each solution, s, in the order of time.
    pub fn solver_seconds(&self) -> &[f64] {
        &self.solver_seconds
    }

    /// Figures of merit of the samples seen so far. `wall` is the elapsed and `simulated` the
    /// simulated time, both s.
    pub fn metrics(&self, wall: f64, simulated: f64, loop_delay: Option<f64>) -> Metrics {
        let Places { attitude, reference, rate, moment, .. } = self.places;
        let root_mean = |sum: f64| (self.steps > 0).then(|| (sum / self.steps as f64).sqrt());
        let mut times = self.solver_seconds.clone();
        times.sort_by(f64::total_cmp);
        let milliseconds = |seconds: Option<&f64>| seconds.map(|seconds| seconds * 1e3);
        // The percentile is taken by nearest rank.
        let p99 = (times.len() * 99).div_ceil(100).checked_sub(1).and_then(|rank| times.get(rank));
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        let max_rate = rate.map(|_| self.largest[0].sqrt());
        let max_moment_ratio = moment.and(self.limits.moment).map(|limit| self.largest[1].sqrt() / limit);
        let guarantee = self.guarantee.as_ref();
        let status = |value: f64| {
            let item = self.statuses.iter().find(|(_, item)| f64::from(*item) == value);
            item.map_or_else(|| value.to_string(), |(name, _)| name.clone())
        };
        let max_rate_ratio = max_rate.zip(self.limits.rate).map(|(rate, limit)| rate / limit);
        Metrics {
            ems_deg: attitude.and(reference).and_then(|_| root_mean(self.sums[0])).map(f64::to_degrees),
            cms: moment.and(self.limits.moment).and_then(|limit| root_mean(self.sums[1]).map(|m| m / limit)),
            max_rate_deg_s: max_rate.map(f64::to_degrees),
            rate_limit_deg_s: self.limits.rate.map(f64::to_degrees),
            max_moment_ratio,
            moment_limit: self.limits.moment,
            worst_limit_ratio: max_rate_ratio.into_iter().chain(max_moment_ratio).reduce(larger),
            solver_ms_mean: milliseconds(times.first().map(|_| &mean)),
            solver_ms_p99: milliseconds(p99),
            solver_ms_max: milliseconds(times.last()),
            solves: self.places.solver_solves.map(|_| self.solves as u64),
            fallbacks: self.fallbacks.map(|count| count as u64),
            guarantee_share: guarantee.and_then(Course::share),
            guarantee_lost_at: guarantee.and_then(|course| course.lost).map(|loss| loss.time),
            guarantee_status: guarantee.and_then(Course::status).map(status),
            guarantee_rate_margin_min: guarantee.and_then(|course| course.margins[0]),
            guarantee_moment_margin_min: guarantee.and_then(|course| course.margins[1]),
            guarantee_broken: guarantee.filter(|course| course.is_checked()).map(|course| course.broken),
            real_time_factor: (wall > 0.0).then(|| simulated / wall),
            wall_s: wall,
            loop_delay_s: loop_delay,
            samples: self.samples,
            completed: self.completed,
            lost_at: self.loss.at,
            step_us: BTreeMap::new(),
            real_time: None,
        }
    }
}

/// Returns the larger value. Unlike `f64::max` it does not hide a value that is not a number.
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

impl Observer for Merit {
    fn observe(&mut self, sample: &Sample) -> Result<(), Error> {
        let Sample { tick, values, last, .. } = *sample;
        let angle = match (self.places.attitude, self.places.reference) {
            (Some(attitude), Some(reference)) => {
                attitude.iter().zip(reference).map(|(&a, r)| (values[a] - values[r]).powi(2)).sum()
            }
            _ => 0.0,
        };
        let moment = self.places.moment.map_or(0.0, |places| norm_squared(values, places));
        let rate = self.places.rate.map_or(0.0, |places| norm_squared(values, places));
        if !last && tick % self.places.every == 0 {
            self.sums[0] += angle;
            self.sums[1] += moment;
            self.steps += 1;
        }
        self.largest = [larger(self.largest[0], rate), larger(self.largest[1], moment)];

        if let Some(solves) = self.places.solver_solves {
            if let Some(time) = self.places.solver_time
                && values[solves] > self.solves
            {
                self.solver_seconds.push(values[time]);
            }
            self.solves = values[solves];
        }
        self.fallbacks = self.places.solver_fallbacks.map(|place| values[place]);
        if let Some(course) = &mut self.guarantee {
            course.observe(sample)?;
        }
        self.samples += 1;
        self.completed |= last;
        // An attitude that is not a number counts as lost, too.
        if let Some(beyond) = self.loss.beyond
            && self.loss.at.is_none()
            && (angle.is_nan() || angle > beyond * beyond)
        {
            self.loss.at = Some(sample.time);
            if self.loss.ends_run {
                return Err(Error::Lost { time: sample.time, beyond_deg: beyond.to_degrees() });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fmu_import::description::{Kind, ModelDescription, Variable};

    fn merit() -> Merit {
        let places = Places {
            attitude: Some([0, 1, 2]),
            reference: Some([3, 4, 5]),
            rate: Some([6, 7, 8]),
            moment: Some([9, 10, 11]),
            solver_time: Some(12),
            solver_solves: Some(13),
            solver_fallbacks: Some(14),
            ..Places::default()
        };
        Merit::new(places, Limits { rate: Some(0.1), moment: Some(10.0) }, 3)
    }

    fn feed(merit: &mut Merit, rows: &[[f64; 15]]) {
        for (tick, row) in rows.iter().enumerate() {
            let sample =
                Sample { tick: tick as u64, time: tick as f64, last: tick + 1 == rows.len(), values: row };
            merit.observe(&sample).unwrap();
        }
    }

    #[test]
    fn oracle_figures_of_merit_by_hand() {
        let mut merit = merit();
        feed(
            &mut merit,
            &[
                // The error is (3, 4, 0) rad, with square 25, and the moment (6, 8, 0), with square
                // 100.
                [3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05, 6.0, 8.0, 0.0, 0.001, 1.0, 0.0],
                // The error is (0, 0, 1), with square 1. There is no new solution, so its time is
                // not counted twice.
                [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.03, 0.04, 0.0, 0.0, 0.0, 0.001, 1.0, 1.0],
                // The stop counts for the largest values and the solver, but not for the means.
                [9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 12.0, 0.0, 0.0, 0.003, 2.0, 1.0],
            ],
        );
        let metrics = merit.metrics(0.5, 2.0, Some(0.0));
        let near = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} {b}");
        near(metrics.ems_deg, 13.0_f64.sqrt().to_degrees());
        near(metrics.cms, 0.5_f64.sqrt());
        near(metrics.max_rate_deg_s, 0.2_f64.to_degrees());
        near(metrics.max_moment_ratio, 1.2);
        near(metrics.solver_ms_mean, 2.0);
        near(metrics.solver_ms_p99, 3.0);
        near(metrics.solver_ms_max, 3.0);
        near(metrics.real_time_factor, 4.0);
        assert_eq!((metrics.solves, metrics.fallbacks, metrics.samples), (Some(2), Some(1), 3));
        assert!(metrics.completed);
    }

    #[test]
    fn oracle_means_of_every_second_point_and_largest_values_of_all() {
        let mut merit = merit();
        merit.places.every = 2;
        let row = |alpha: f64, p: f64| {
            let mut row = [0.0; 15];
            (row[0], row[6]) = (alpha, p);
            row
        };
        feed(&mut merit, &[row(3.0, 0.0), row(100.0, 0.2), row(4.0, 0.0), row(100.0, 0.0)]);
        let metrics = merit.metrics(0.5, 2.0, None);
        assert!((metrics.ems_deg.unwrap() - 12.5_f64.sqrt().to_degrees()).abs() < 1e-12);
        assert!((metrics.max_rate_deg_s.unwrap() - 0.2_f64.to_degrees()).abs() < 1e-12);
    }

    #[test]
    fn a_value_that_is_not_a_number_is_not_hidden() {
        let mut merit = merit();
        let mut rows = [[1.0; 15]; 3];
        rows[1][6] = f64::NAN;
        feed(&mut merit, &rows);
        assert!(merit.metrics(1.0, 1.0, None).max_rate_deg_s.unwrap().is_nan());
    }

    #[test]
    fn an_attitude_is_lost_beyond_its_bound_or_where_it_is_no_number() {
        let row = |alpha: f64| {
            let mut row = [0.0; 15];
            row[0] = alpha;
            row
        };
        let bound = 1.0_f64.to_degrees();
        let mut kept = merit().with_loss(Some(bound));
        feed(&mut kept, &[row(0.5), row(-1.0), row(1.0)]);
        let metrics = kept.metrics(1.0, 1.0, None);
        assert_eq!((metrics.lost_at, metrics.completed), (None, true));
        for lost in [1.1, f64::NAN] {
            let mut merit = merit().with_loss(Some(bound));
            feed(&mut merit, &[row(0.5), row(lost), row(2.0), row(0.0)]);
            let metrics = merit.metrics(1.0, 1.0, None);
            assert_eq!((metrics.lost_at, metrics.completed), (Some(1.0), true));
        }
        let mut ending = merit().with_loss(Some(bound)).ending_when_lost();
        let sample = Sample { tick: 3, time: 0.1 + 0.2, last: false, values: &row(2.0) };
        let error = ending.observe(&sample).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().starts_with("attitude lost at t = 0.3 s: further than 57.29"), "{error}");
    }

    #[test]
    fn what_is_missing_is_null() {
        let mut merit = Merit::new(Places::default(), Limits::default(), 1);
        feed(&mut merit, &[[0.0; 15]]);
        let json = serde_json::to_value(merit.metrics(0.0, 0.0, None)).unwrap();
        for key in ["ems_deg", "cms", "max_rate_deg_s", "max_moment_ratio", "solver_ms_mean", "solver_ms_p99"]
        {
            assert!(json[key].is_null(), "{key}");
        }
        for key in ["solver_ms_max", "fallbacks", "real_time_factor"] {
            assert!(json.as_object().unwrap()[key].is_null(), "{key}");
        }
        for what in ["share", "lost_at", "status", "rate_margin_min", "moment_margin_min", "broken"] {
            let key = format!("guarantee_{what}");
            assert!(json.as_object().unwrap()[&key].is_null(), "{key}");
        }
    }

    #[test]
    fn the_guarantee_is_among_the_figures_of_merit() {
        let signals = guarantee::Signals { in_force: 0, status: Some(1), margins: [Some(2), Some(3)] };
        let places = Places { moment: Some([4, 5, 6]), guarantee: Some(signals), ..Places::default() };
        let limits = Limits { rate: None, moment: Some(10.0) };
        let statuses = vec![("inForce".to_string(), 1), ("exceeded".to_string(), 5)];
        let mut merit = Merit::new(places, limits, 4).with_statuses(statuses);
        let mut rows = [[0.0; 15]; 4];
        rows[0][..5].copy_from_slice(&[1.0, 1.0, 0.25, 0.5, 11.0]);
        rows[1][..5].copy_from_slice(&[1.0, 1.0, 0.5, 0.125, 1.0]);
        rows[2][..5].copy_from_slice(&[0.0, 5.0, 0.0, 0.0, 1.0]);
        rows[3][..5].copy_from_slice(&[0.0, 2.0, 0.0, 0.0, 1.0]);
        feed(&mut merit, &rows);
        let metrics = merit.metrics(1.0, 1.0, None);
        assert_eq!((metrics.guarantee_share, metrics.guarantee_lost_at), (Some(0.5), Some(2.0)));
        assert_eq!(metrics.guarantee_status.as_deref(), Some("exceeded"));
        assert_eq!(metrics.guarantee_rate_margin_min, Some(0.25));
        assert_eq!(metrics.guarantee_moment_margin_min, Some(0.125));
        assert_eq!(metrics.guarantee_broken, Some(true));
    }

    /// Places in a component `law` and a component `controller`, both of which have these
    /// variables.
    fn places_with(names: &[&str], roles: &Roles) -> Result<Places, Error> {
        let variables = names.iter().enumerate().map(|(reference, name)| Variable {
            name: (*name).into(),
            reference: reference as u32,
            description: String::new(),
            causality: "output".into(),
            variability: "discrete".into(),
            kind: Kind::Boolean,
            start: None,
        });
        let description = ModelDescription { variables: variables.collect(), ..ModelDescription::default() };
        let parts = ["controller", "law"].map(|name| Part { name, description: &description });
        places(roles, &parts, &mut Probes::default()).map(|(places, _)| places)
    }

    #[test]
    fn a_guarantee_is_used_where_there_is_one_and_wanted_where_it_is_named() {
        let names = ["x.inForce", "x.status", "x.rateMargin", "x.momentMargin"];
        let by_default = names.map(|name| name.replace('x', "guarantee"));
        let by_default: Vec<&str> = by_default.iter().map(String::as_str).collect();
        let none = Roles::default();
        let all = guarantee::Signals { in_force: 0, status: Some(1), margins: [Some(2), Some(3)] };
        assert_eq!(places_with(&by_default, &none).unwrap().guarantee, Some(all));
        let bare = guarantee::Signals { in_force: 0, status: None, margins: [None; 2] };
        assert_eq!(places_with(&by_default[..1], &none).unwrap().guarantee, Some(bare));
        assert_eq!(places_with(&names, &none).unwrap().guarantee, None);
        let named = Roles { guarantee: Some("law.x".into()), ..Roles::default() };
        assert_eq!(places_with(&names, &named).unwrap().guarantee, Some(all));
        let message = places_with(&names[..3], &named).unwrap_err().to_string();
        assert!(
            message.contains("[metrics] guarantee: there is no variable \"law.x.momentMargin\""),
            "{message}"
        );
    }
}
