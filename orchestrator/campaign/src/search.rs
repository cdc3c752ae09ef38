//! Looks for the worst case: an evolution strategy (CMA-ES) with restarts moves through the
//! space of the varied parameters towards larger values of a measure.

mod page;

use crate::definition::Search;
use crate::flight::{CaseStatus, Flight, Row, table};
use crate::plan::Plan;
use crate::prepare::Recorded;
use cmaes::{CMAESOptions, DVector};
use cosim::error::Error as Single;
use cosim::files;
use cosim::interrupt::Interrupt;
use cosim::system::Opened;
use cosim_metrics::folder::Folder;
use cosim_metrics::progress::Parts;
use parking_lot::Mutex;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Instant;
use sweep::error::Error;
use sweep::runner::{self, Options};

/// Step size of a search at its beginning, as a share of the range of each parameter.
const STEP: f64 = 0.3;
/// Number of the case that all cases of a search use, so that seeds stay the same.
const CASE: u64 = 0;

/// Names of the files of a search's results.
const FILES: [&str; 5] =
    ["search.json", "search.parquet", "worst.toml", "report.html", "history.svg"];

/// Outcome of a search.
#[derive(Clone, Debug, Serialize)]
pub struct SearchOutcome {
    /// Title of the campaign.
    pub title: String,
    /// Measure whose largest value was looked for.
    pub measure: String,
    /// Unit of the measure, or an empty text.
    pub unit: String,
    /// Largest value that was found.
    pub largest: f64,
    /// Limits that the worst case breaks.
    pub broken: Vec<String>,
    /// How the worst case ended.
    pub status: &'static str,
    /// Number of cases that were flown.
    pub cases: u64,
    /// Number of searches from different starts.
    pub searches: u64,
    /// Number of cases in which an FMU failed. They are in the table with their messages.
    pub failed: u64,
    /// Why the search ended.
    pub ended: String,
    /// Folder of the results.
    #[serde(skip)]
    pub out: PathBuf,
    /// Elapsed time, s.
    #[serde(skip)]
    pub elapsed: f64,
}

/// A place that is to be flown, and the channel for its result.
struct Order {
    point: Vec<f64>,
    reply: Sender<Result<Row, Single>>,
}

/// A case that was tried: its place and its result.
#[derive(Serialize, Deserialize)]
struct Tried {
    point: Vec<f64>,
    value: f64,
    row: Row,
}

/// Looks for the worst case of a campaign.
///
/// # Errors
/// Returns an error if the campaign does not say what to look for, if a file cannot be written, or
/// if the first generation was ended.
pub fn search(plan: &Plan, options: &Options) -> Result<SearchOutcome, Error> {
    let begin = Instant::now();
    let source = &plan.campaign.source;
    let search = plan.campaign.search.as_ref().ok_or_else(|| {
        let problem = "[search] is missing: it names the measure whose largest value is looked for";
        source.error(&(0..0), problem)
    })?;
    for varied in &plan.sweep.varied {
        varied.distribution.check_ends().map_err(|problem| varied.refusal(&problem, source))?;
    }
    let out = options.out.clone();
    let out = out.unwrap_or_else(|| PathBuf::from("out").join(format!("{}-worst", plan.name())));
    if out.join("search.json").exists() && !options.fresh {
        let message = format!(
            "{} holds the results of an earlier search: --fresh replaces them, --out chooses another folder",
            out.display()
        );
        return Err(Single::experiment(message).into());
    }
    let folder = Folder::take(&out)?;
    // Results of an earlier search would not fit this one if it ends early.
    folder.remove(&FILES)?;
    let mut names = plan.recorded.iter().map(|recorded| &recorded.name);
    let measure = names.position(|name| name == search.largest.get_ref()).unwrap_or_default();
    let system = plan.sweep.system(&mut Opened::default())?;
    let quiet = options.quiet || system.is_closed;
    let look = || look_in_threads(plan, search, measure, (options, quiet));
    let Found { searches, ended, tried } = system.apart(&options.interrupt, look)?;
    let worst = tried.iter().filter(|case| !case.value.is_nan());
    let worst = worst.max_by(|a, b| a.value.total_cmp(&b.value)).or(tried.first());
    let worst = worst.ok_or_else(|| Single::experiment("no case was flown"))?;
    let Recorded { name, unit, .. } = &plan.recorded[measure];
    write_tried(plan, &tried, worst, name, &out)?;
    let limits = plan.campaign.limits.iter().zip(&worst.row.limits_kept);
    let broken = limits.filter(|(_, is_kept)| !**is_kept).map(|(limit, _)| limit.id.clone());
    let outcome = SearchOutcome {
        title: plan.campaign.title.clone(),
        measure: name.clone(),
        unit: unit.clone(),
        largest: worst.value,
        broken: broken.collect(),
        status: worst.row.status.name(),
        cases: tried.len() as u64,
        searches,
        failed: tried.iter().filter(|case| case.row.status == CaseStatus::Failed).count() as u64,
        ended,
        out,
        elapsed: begin.elapsed().as_secs_f64(),
    };
    let title = format!("{}, the worst case that a search found", plan.campaign.title);
    let text = plan.sweep.experiment_of(&title, &worst.row.values)?;
    files::write(&outcome.out.join("worst.toml"), text)?;
    page::write(plan, &outcome, &tried, &worst.row)?;
    files::write_json(&outcome.out.join("search.json"), &outcome)?;
    Ok(outcome)
}

/// All cases of a search.
#[derive(Serialize, Deserialize)]
struct Found {
    /// Number of searches from different starts.
    searches: u64,
    /// Why the last one ended.
    ended: String,
    tried: Vec<Tried>,
}

/// Searches with threads that fly the cases.
fn look_in_threads(
    plan: &Plan,
    search: &Search,
    measure: usize,
    (options, quiet): (&Options, bool),
) -> Result<Found, Single> {
    let progress = Parts::new("cases", &plan.campaign.title, search.cases, 0, quiet);
    let (orders, waiting) = channel::<Order>();
    let waiting = Mutex::new(waiting);
    let searched = Searched {
        plan,
        measure,
        progress: &progress,
        tried: Mutex::default(),
        failure: Mutex::default(),
    };
    let result = std::thread::scope(|scope| {
        for _ in 0..runner::threads(options.jobs, [&plan.sweep]) {
            scope.spawn(|| serve(plan, &options.interrupt, &waiting));
        }
        let result = look(&searched, search, &orders);
        // The threads end when no more cases can be ordered.
        drop(orders);
        result
    });
    progress.finish();
    let (searches, ended) = result?;
    Ok(Found { searches, ended: ended.into(), tried: searched.tried.into_inner() })
}

/// Writes the table of all cases, of which the worst must have a value of the measure.
fn write_tried(
    plan: &Plan,
    tried: &[Tried],
    worst: &Tried,
    measure: &str,
    out: &Path,
) -> Result<(), Error> {
    let rows: Vec<Row> = tried.iter().map(|case| case.row.clone()).collect();
    let path = out.join("search.parquet");
    table(plan, &rows).write(&path, plan.units())?;
    if !worst.value.is_nan() {
        return Ok(());
    }
    let Row { message, status, .. } = &worst.row;
    let reason = if message.is_empty() { status.name() } else { message };
    Err(Error::Failed(format!(
        "no case has a value of {measure}, so that there is no worst one: {reason} ({} has all cases)",
        path.display()
    )))
}

/// Flies the ordered cases until no more can be ordered.
fn serve(plan: &Plan, interrupt: &Interrupt, waiting: &Mutex<Receiver<Order>>) {
    let mut flight: Option<Flight> = None;
    loop {
        let Ok(order) = waiting.lock().recv() else { return };
        let mut fly = || {
            let current = match flight.take() {
                Some(flight) => flight,
                None => Flight::new(plan, false, interrupt)?,
            };
            let values = plan.sweep.values_at(&order.point, CASE);
            flight.insert(current).fly_with(CASE, values)
        };
        // If the search no longer waits for the result, it is discarded.
        let _ = order.reply.send(fly());
    }
}

/// Cases that a search has tried so far.
struct Searched<'a> {
    plan: &'a Plan,
    /// Position of the measure among the recorded numbers.
    measure: usize,
    progress: &'a Parts,
    tried: Mutex<Vec<Tried>>,
    failure: Mutex<Option<Single>>,
}

impl Searched<'_> {
    /// Flies the case at a point, whose coordinates are cut off at 0 and 1. The strategy looks for
    /// the smallest value; a case without a value counts as the worst point.
    fn evaluate(&self, point: &DVector<f64>, orders: &Sender<Order>) -> f64 {
        let point: Vec<f64> = point.iter().map(|unit| unit.clamp(0.0, 1.0)).collect();
        let (reply, result) = channel();
        if orders.send(Order { point: point.clone(), reply }).is_err() {
            return f64::MAX;
        }
        let row = match result.recv() {
            Ok(Ok(row)) => row,
            Ok(Err(error)) => {
                self.failure.lock().get_or_insert(error);
                return f64::MAX;
            }
            Err(_) => return f64::MAX,
        };
        self.progress.advance(1);
        let value = row.numbers[self.measure].unwrap_or(f64::NAN);
        self.tried.lock().push(Tried { point, value, row });
        if value.is_nan() { f64::MAX } else { -value }
    }

    /// Sorts the cases of the last generation, which the threads finish in any order, behind those
    /// before it. Returns the number of all cases.
    fn sort(&self, before: usize) -> usize {
        let mut tried = self.tried.lock();
        tried[before..].sort_by(|a, b| {
            let mut orders = a.point.iter().zip(&b.point).map(|(a, b)| a.total_cmp(b));
            orders.find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
        });
        tried.len()
    }

    /// Returns why the search is to end after this generation, if it is.
    fn ended(&self, search: &Search) -> Result<Option<&'static str>, Single> {
        match self.failure.lock().take() {
            Some(Single::Interrupted { .. }) => return Ok(Some("it was interrupted")),
            Some(error) => return Err(error),
            None => {}
        }
        let is_over = self.tried.lock().len() as u64 >= search.cases;
        Ok(is_over.then_some("all cases are used up"))
    }
}

/// Searches from one start after another until something ends the work. Returns the number of
/// searches and what ended them.
fn look(
    searched: &Searched,
    search: &Search,
    orders: &Sender<Order>,
) -> Result<(u64, &'static str), Single> {
    let plan = searched.plan;
    let dimensions = plan.sweep.varied.len();
    let mut sorted = 0;
    let mut random = ChaCha8Rng::seed_from_u64(plan.campaign.seed);
    let mut unit = || (random.next_u64() >> 11) as f64 / 2.0_f64.powi(53);
    let usual = 4 + (3.0 * (dimensions as f64).ln()).floor() as usize;
    for number in 0.. {
        // The first search begins in the middle, further ones anywhere and with more cases in each
        // generation.
        let start: Vec<f64> =
            (0..dimensions).map(|_| if number == 0 { 0.5 } else { unit() }).collect();
        let mut strategy = CMAESOptions::new(start, STEP)
            .population_size(usual << number.min(4))
            .tol_x(1e-6)
            .seed(plan.campaign.seed.wrapping_add(number))
            .build(|point: &DVector<f64>| searched.evaluate(point, orders))
            .map_err(|error| Single::experiment(format!("[search] {error:?}")))?;
        loop {
            let is_over = strategy.next_parallel().is_some();
            sorted = searched.sort(sorted);
            if let Some(ended) = searched.ended(search)? {
                return Ok((number + 1, ended));
            }
            if is_over {
                break;
            }
        }
    }
    Ok((0, ""))
}
