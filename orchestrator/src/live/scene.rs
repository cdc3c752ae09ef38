//! What there is to show of an experiment: follows from the names of its variables.

use crate::description::Kind;
use crate::metrics::{self, Limits, Places, Probes};
use crate::run::Plan;
use crate::wiring;

/// Everything that does not change while the run goes on.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Title of the experiment.
    pub title: String,
    /// Start and stop, s.
    pub span: [f64; 2],
    /// Factor of real time that was asked for.
    pub factor: Option<f64>,
    /// Components in their order.
    pub components: Vec<String>,
    /// Variables with a role.
    pub places: Places,
    /// Limits of rate and moment.
    pub limits: Limits,
    /// State of the solver.
    pub status: Option<Shown>,
    /// Its number of iterations.
    pub iterations: Option<usize>,
    /// Status of the controller's guarantee.
    pub guarantee: Option<Shown>,
    /// The recorded variables.
    pub recorded: Vec<Shown>,
}

/// A variable as it is shown.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shown {
    /// `component.variable`.
    pub name: String,
    /// Where it stands among the probed values.
    pub place: usize,
    /// Unit, or nothing.
    pub unit: String,
    /// Items of an enumeration.
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

    /// The value with its unit, or the name of its item.
    pub fn text(&self, values: &[f64]) -> String {
        self.text_of(values.get(self.place).copied().unwrap_or(f64::NAN))
    }

    /// The same for any value of the variable.
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
