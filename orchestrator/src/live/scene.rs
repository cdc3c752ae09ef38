//! The contents of the view, derived from the names of an experiment's variables.

use crate::metrics::{self, Limits, Places, Probes};
use crate::run::Plan;
use crate::wiring;
use fmu_import::description::Kind;

/// Everything that does not change while the run goes on.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Title of the experiment.
    pub title: String,
    /// Start and stop time of the run, s.
    pub span: [f64; 2],
    /// Requested real-time factor, if the run is paced.
    pub factor: Option<f64>,
    /// Names of the components, in their order.
    pub components: Vec<String>,
    /// Places of the variables that have a role in the figures of merit.
    pub places: Places,
    /// Limits of angular rate and moment.
    pub limits: Limits,
    /// Variable with the state of the solver.
    pub status: Option<Shown>,
    /// Place of the solver's number of iterations.
    pub iterations: Option<usize>,
    /// Variable with the status of the controller's guarantee.
    pub guarantee: Option<Shown>,
    /// The variables that are recorded.
    pub recorded: Vec<Shown>,
}

/// A variable that the view shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// Full name of the variable, `component.variable`.
    pub name: String,
    /// Index of the variable among the probed values.
    pub place: usize,
    /// Unit of the variable, or an empty text.
    pub unit: String,
    /// Items of an enumeration with their values.
    pub items: Vec<(String, i32)>,
}

impl Shown {
    fn find(path: &str, plan: &Plan, probes: &mut Probes) -> Option<Self> {
        let parts = plan.parts();
        let port = wiring::find(path, &parts)?;
        let place = probes.place(port);
        let (unit, items) = match &parts[port.component].description.variables[port.variable].kind {
            Kind::Real { unit, .. } => (unit.clone().unwrap_or_default(), Vec::new()),
            Kind::Enumeration { items } => (String::new(), items.clone()),
            _ => (String::new(), Vec::new()),
        };
        Some(Self { name: path.into(), place, unit, items })
    }

    /// Formats the variable's current value with its unit, or as the name of its item.
    pub fn text(&self, values: &[f64]) -> String {
        self.text_of(values.get(self.place).copied().unwrap_or(f64::NAN))
    }

    /// Formats any value of the variable with its unit, or as the name of its item.
    pub fn text_of(&self, value: f64) -> String {
        match self.items.iter().find(|(_, item)| f64::from(*item) == value) {
            Some((name, _)) => name.clone(),
            None if value == value.trunc() && value.abs() < 1e6 => format!("{value} {}", self.unit),
            None if (1e-3..1e6).contains(&value.abs()) => format!("{value:.4} {}", self.unit),
            None => format!("{value:.4e} {}", self.unit),
        }
    }
}

impl Scene {
    /// Finds what there is; `probes` grows by what is read for the view only.
    pub fn new(plan: &Plan, places: Places, factor: Option<f64>, probes: &mut Probes) -> Self {
        let experiment = &plan.experiment;
        let solver = experiment.metrics.solver.as_deref().unwrap_or(metrics::SOLVER);
        let status = Shown::find(&format!("{solver}.status"), plan, probes);
        let iterations = Shown::find(&format!("{solver}.iterations"), plan, probes);
        let guarantee = experiment.metrics.guarantee.as_deref().unwrap_or(metrics::GUARANTEE);
        let guarantee = Shown::find(&format!("{guarantee}.status"), plan, probes);
        let recorded =
            plan.columns.iter().filter_map(|column| Shown::find(&column.name, plan, probes)).collect();
        Self {
            title: experiment.title.clone(),
            span: [plan.clock.start(), plan.clock.stop()],
            factor,
            components: plan.order.clone(),
            places,
            limits: Limits::default(),
            status,
            iterations: iterations.map(|shown| shown.place),
            guarantee,
            recorded,
        }
    }
}
