//! The closed loop of an experiment, with its instances and their connections.

use crate::error::Error;
use crate::fmu::Warnings;
use crate::scenario::{self, Scenario, problem, read};
use crate::signals::{GUARANTEE, PLAN_SHOWN, plan};
use fmi_master::clock::Clock;
use fmi_master::delay;
use fmi_master::master::{Master, Member};
use fmi_master::settings::Setting;
use fmi_master::wiring::{self, Fault, Part, Port, Written, connect};
use serde::Deserialize;
use toml::{Table, Value};

/// Component that controls, and the parameter by which the loop is stepped, s.
const CONTROLLER: &str = "controller";
const PERIOD: &str = "period.feedback";
/// Limits of the norms of body rates and moment.
const LIMITS: [&str; 2] = ["controller.limit.rate", "controller.limit.moment"];

/// A connection, or several that are written as one.
#[derive(Deserialize)]
struct Connection {
    from: String,
    to: String,
}

/// Names of an enumeration's items, with their values.
pub type Items = Vec<(String, i32)>;

/// A loop whose parameters are set.
pub struct ClosedLoop {
    /// Instances with their connections.
    pub master: Master,
    /// Warnings of the instances.
    pub warnings: Warnings,
    /// Variables that hold the limits of body rates and moment.
    pub limits: Vec<Port>,
    /// Items of the variables by which the controller reports its guarantee; none if it gives no
    /// guarantee.
    pub guarantee: [Items; 2],
    /// Tracking error beyond which the attitude counts as lost, deg.
    pub lost_beyond: f64,
    /// The flight.
    pub scenario: &'static Scenario,
}

impl ClosedLoop {
    /// Makes the loop of an experiment, which is stepped by the period of its controller.
    ///
    /// # Errors
    /// Names the parameter at fault.
    pub fn new(experiment: &Table, scenario: &'static Scenario) -> Result<Self, Error> {
        let order: Vec<String> = read(experiment, "simulation.order")?;
        let (mut parts, mut fmus) = (vec![], vec![]);
        for name in &order {
            let fmu: String = read(experiment, &format!("components.{name}.fmu"))?;
            let fmu = scenario::fmu(fmu.trim_end_matches(".fmu"))?;
            parts.push(Part { name, description: fmu.description() });
            fmus.push(fmu);
        }
        let mut wires = vec![];
        for Connection { from, to } in read::<Vec<_>>(experiment, "connections")? {
            let wrong = |text: String| problem(&from, &text);
            let from = Written::new(&from, &parts).map_err(wrong)?;
            let to = Written::new(&to, &parts).map_err(wrong)?;
            let connected = connect(&from, &to, None);
            wires.extend(connected.map_err(|(Fault::From(text) | Fault::To(text))| wrong(text))?);
        }

        let (mut members, mut settings, mut step) = (vec![], vec![], None);
        let warnings = Warnings::default();
        for (index, (part, fmu)) in parts.iter().zip(fmus).enumerate() {
            let parameters: Table =
                read(experiment, &format!("components.{}.parameters", part.name))?;
            let setting = |(name, written): (&String, &Value)| {
                let setting = Setting::new(name, written, index, *part, &wires, false);
                setting.map_err(|text| problem(&format!("{}.{name}", part.name), &text))
            };
            let mut own = parameters.iter().map(setting).collect::<Result<Vec<_>, _>>()?;
            // It changes nothing but the variables that show the plan.
            let plans = part.description.variables.iter().any(|one| one.name == PLAN_SHOWN);
            if plans && scenario.shows_plans {
                own.push(setting((&PLAN_SHOWN.into(), &Value::Boolean(true)))?);
            }
            if part.name == CONTROLLER {
                step = delay::duration(PERIOD, *part, &own);
            }
            settings.push(own);
            let (name, instance) = (part.name.into(), Box::new(fmu.instance(&warnings)));
            members.push(Member { name, every: 1, varies: false, instance });
        }

        let stop = read(experiment, "simulation.stop")?;
        let clock = Clock::new(0.0, stop, step.unwrap_or_default());
        let clock = clock.map_err(|text| problem(&format!("{CONTROLLER}.{PERIOD}"), &text))?;
        let find = |path: &&str| {
            let found = wiring::find(path, &parts);
            found.ok_or_else(|| problem(path, "there is no such variable"))
        };
        let limits = LIMITS.iter().map(find).collect::<Result<_, _>>()?;
        let columns = scenario.columns;
        let always = &columns[1..columns.len() - GUARANTEE.len()];
        let mut probes = always.iter().map(find).collect::<Result<Vec<_>, _>>()?;
        let guarantee = GUARANTEE.map(|path| wiring::find(path, &parts));
        probes.extend(guarantee.iter().flatten());
        if scenario.shows_plans {
            probes.extend(plan().iter().filter_map(|path| wiring::find(path, &parts)));
        }
        let items = |port: Port| {
            parts[port.component].description.variables[port.variable].kind.items().to_vec()
        };
        let guarantee = guarantee.map(|port| port.map(items).unwrap_or_default());
        let coupling = read(experiment, "simulation.coupling").unwrap_or_default();
        let readings = delay::readings_of_wires(&parts, &wires, coupling);
        let probes = delay::readings_of_probes(&parts, &wires, &probes);
        let mut master = Master::new(clock, coupling, members, &readings, &probes);
        let ender: Option<String> = read(experiment, "simulation.ends_with").ok();
        master.set_ender(ender.and_then(|ender| order.iter().position(|name| *name == ender)));
        master.set_parameters(&settings)?;
        let lost_beyond = read(experiment, "observe.loss.beyond")?;
        Ok(Self { master, warnings, limits, guarantee, lost_beyond, scenario })
    }
}
