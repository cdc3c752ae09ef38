//! `EntryNavigation`: motion, attitude and wind along an entry flight, from inertial sensors,
//! satellite navigation and star tracker, and from the forces of the air.

use control::navigation::{Health, Line, Memory, Navigation, Settings, Shown};
use controller_export::own_vehicle::OwnVehicle;
use controller_export::sampled::{SampledFmu, SampledInstance, Ticks};
use controller_export::table::{ANGLES, AXES, RATES, vector};
use fmi_export::table::{Common, Real, discrete_input, discrete_output, input};
use fmi_export::{Context, Description, Failure, VariableTable};
use model_description::DefaultExperiment;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use settings::Choice;
use vehicle::entry::{QUANTITIES, Quantity};
use vehicle::error::rounded_time;

/// The navigation as an FMU.
pub type EntryNavigation = SampledFmu<NavigationInstance>;

/// An instance of the navigation: its parameters, inputs and outputs.
#[derive(Serialize, Deserialize)]
pub struct NavigationInstance {
    pub(crate) settings: Settings,
    own: OwnVehicle,
    pub(crate) line: Line,
    pub(crate) shown: Shown,
    health: Health,
}

/// Longest flight that is expected, s.
const LONGEST: f64 = 3000.0;

impl SampledInstance for NavigationInstance {
    type Device = Navigation;
    type Memory = Memory;
    type Input = Line;
    type Output = ();

    fn description() -> Description<EntryNavigation> {
        Description {
            name: "EntryNavigation",
            description: "Navigation of an entry flight by strapdown and Kalman filter, with the wind by the side force and the altitude by the drag",
            documentation: include_str!("navigation.html").into(),
            version: env!("CARGO_PKG_VERSION"),
            model_exchange: false,
            event_indicators: 0,
            default_experiment: DefaultExperiment {
                start: 0.0,
                stop: LONGEST,
                tolerance: 1e-6,
                step: Settings::default().period,
            },
            table: outputs(inputs(VariableTable::new()))
                .settings(|m: &mut EntryNavigation| &mut m.settings)
                .settings(|m| &mut m.own),
        }
    }

    fn new() -> Self {
        Self {
            settings: Settings::default(),
            own: OwnVehicle::default(),
            // The air at the start of the flight, so that the navigation moves without a plant.
            line: Line { force: Vector3::new(0.0, 0.0, -1e-3), ..Line::default() },
            shown: Shown::default(),
            health: Health::default(),
        }
    }

    fn load(&mut self, context: &Context) -> Result<(), Failure> {
        self.own.load(context)
    }

    fn design(&self) -> Result<Navigation, Failure> {
        let aerodynamics = self.own.vehicle().aerodynamics.clone();
        Navigation::of(self.settings, aerodynamics)
            .map_err(|error| Failure::Error(error.to_string()))
    }

    fn problem(&self, before: &Self) -> Option<&'static str> {
        self.own.problem(&before.own)
    }

    fn is_designed(&self, navigation: &Navigation) -> bool {
        *navigation.settings() == self.settings
            && *navigation.aerodynamics() == self.own.vehicle().aerodynamics
    }

    fn period(navigation: &Navigation) -> f64 {
        navigation.settings().period
    }

    fn memory(navigation: &Navigation) -> Memory {
        navigation.memory()
    }

    fn evaluate(
        &self,
        navigation: &mut Navigation,
        ticks: &mut Ticks<Self>,
    ) -> Result<(), Failure> {
        let line = self.line;
        if let Some(name) = line.fault() {
            return Err(Failure::Error(format!("an input {name} is not a finite number")));
        }
        let time = ticks.next_time();
        ticks.evaluate_with(line, |memory, _| navigation.update(memory, time, &line));
        let Shown { motion, motion_rate, angles, .. } = &ticks.in_force().1.shown;
        if motion.iter().chain(motion_rate).chain(angles).all(|value| value.is_finite()) {
            return Ok(());
        }
        Err(Failure::Error(format!(
            "the navigated motion at t = {} s is not finite; check the inputs measured.*, gnss.* and star.*",
            rounded_time(time)
        )))
    }

    fn show(&mut self, _time: f64, _navigation: &Navigation, ((), memory): ((), &Memory)) {
        (self.shown, self.health) = (memory.shown, memory.health);
    }

    fn warning(before: &Memory, after: &Memory) -> Option<&'static str> {
        let becomes = |health: Health| after.health == health && before.health != health;
        if becomes(Health::Lost) {
            Some("no sample has arrived for half a second: the navigation is lost (see health)")
        } else if before.missed == 0 && after.missed > 0 {
            Some(
                "a sample never arrived: it was lost, or the plant's sensor.period is shorter than period, so that the noise of the samples is another one than the filter expects",
            )
        } else if becomes(Health::Degraded) {
            Some(
                "the attitude is known worse than health.deviation asks for: the inertial sensors cannot bridge the time without fixes (see health and deviation.*)",
            )
        } else if becomes(Health::Inconsistent) {
            Some(
                "the fixes contradict what the filter expects: sensor.set, the noise of fixes or the initial state is not that of the plant (see health and innovation.*)",
            )
        } else {
            None
        }
    }
}

type Variables = VariableTable<EntryNavigation>;

/// Names of the inputs, which are those of outputs of the plant.
const INPUTS: [&str; 22] = [
    "measured.gyroscope.x",
    "measured.gyroscope.y",
    "measured.gyroscope.z",
    "measured.accelerometer.x",
    "measured.accelerometer.y",
    "measured.accelerometer.z",
    "measured.time",
    "measured.sample",
    "gnss.position.x",
    "gnss.position.y",
    "gnss.position.z",
    "gnss.velocity.x",
    "gnss.velocity.y",
    "gnss.velocity.z",
    "gnss.time",
    "gnss.fix",
    "star.attitude.w",
    "star.attitude.x",
    "star.attitude.y",
    "star.attitude.z",
    "star.time",
    "star.fix",
];

fn inputs(table: Variables) -> Variables {
    let part = |name: &'static str, text: &'static str, unit: &'static str, nominal: f64| {
        move |axis: &str, _: &str| -> Real {
            let common = input(&format!("{name}.{axis}"), &format!("{text} {axis}"));
            common.real().unit(unit).nominal(nominal)
        }
    };
    let seconds = |name: &str| {
        let text = "Time at which the latest sample or fix was taken";
        input(name, text).real().unit("s").nominal(1.0)
    };
    let number = |name: &str| {
        discrete_input(
            name,
            "Number of the latest sample or fix, counted from 1; 0 before the first",
        )
    };
    let rate = part("measured.gyroscope", "Angular rate measured about", "rad/s", 0.05);
    let force = part("measured.accelerometer", "Specific force measured along", "m/s2", 10.0);
    let position =
        part("gnss.position", "Position by satellite navigation along planet-fixed", "m", 1e6);
    let velocity =
        part("gnss.velocity", "Velocity by satellite navigation along planet-fixed", "m/s", 1e3);
    let table = vector(table, AXES, rate, |m| &mut m.line.rate);
    let table = vector(table, AXES, force, |m| &mut m.line.force)
        .real(seconds("measured.time"), |m| &mut m.line.time)
        .integer(number("measured.sample"), (Some(0), None), |m| &mut m.line.sample);
    let table = vector(table, AXES, position, |m| &mut m.line.fixes.gnss.position);
    let mut table = vector(table, AXES, velocity, |m| &mut m.line.fixes.gnss.velocity)
        .real(seconds("gnss.time"), |m| &mut m.line.fixes.gnss.time)
        .integer(number("gnss.fix"), (Some(0), None), |m| &mut m.line.fixes.gnss.number);
    for (i, name) in ["w", "x", "y", "z"].into_iter().enumerate() {
        let text =
            format!("Part {name} of the star tracker's quaternion from inertial to body axes");
        let real = input(&format!("star.attitude.{name}"), &text).real().nominal(1.0);
        table = table.real(real, move |m| &mut m.line.fixes.star.attitude[i]);
    }
    table.real(seconds("star.time"), |m| &mut m.line.fixes.star.time).integer(
        number("star.fix"),
        (Some(0), None),
        |m| &mut m.line.fixes.star.number,
    )
}

fn sampled(name: &str, text: &str) -> Common {
    discrete_output(name, text).depends_on(INPUTS)
}

fn real(name: &str, text: &str, unit: &str, nominal: f64) -> Real {
    sampled(name, text).real().unit(unit).nominal(nominal)
}

/// Names and meanings of the angles relative to the air, and of the directions of the wind.
const FLOW: [(&str, &str); 2] = [
    ("alpha", "angle of attack relative to the air"),
    ("beta", "sideslip angle relative to the air"),
];
const WIND: [(&str, &str); 2] = [("north", "wind to the north"), ("east", "wind to the east")];

fn outputs(table: Variables) -> Variables {
    quality(state(table))
}

/// Adds the navigated state.
fn state(mut table: Variables) -> Variables {
    for (i, Quantity { name, meaning, units, nominal }) in QUANTITIES.into_iter().enumerate() {
        let motion = real(&format!("motion.{name}"), meaning, units[0], nominal);
        table = table.real(motion, move |m| &mut m.shown.motion[i]);
    }
    for (i, Quantity { name, units, nominal, .. }) in QUANTITIES.into_iter().enumerate() {
        let text = format!("Rate of motion.{name}");
        let rate = real(&format!("motionRate.{name}"), &text, units[1], nominal);
        table = table.real(rate, move |m| &mut m.shown.motion_rate[i]);
    }
    let angle = |axis: &str, meaning: &str| {
        let text = format!("Navigated {meaning} relative to the ground velocity");
        real(&format!("attitude.{axis}"), &text, "rad", 0.1)
    };
    let rate = |axis: &str, meaning: &str| {
        let text = format!("Navigated body {meaning} rate");
        real(&format!("rate.{axis}"), &text, "rad/s", 0.05)
    };
    let table = vector(table, ANGLES, angle, |m| &mut m.shown.angles);
    let mut table = vector(table, RATES, rate, |m| &mut m.shown.rates)
        .real(real("load.lift", "Measured lift per mass", "m/s2", 10.0), |m| &mut m.shown.lift)
        .real(real("load.drag", "Measured drag per mass", "m/s2", 10.0), |m| &mut m.shown.drag);
    for (i, (axis, meaning)) in FLOW.into_iter().enumerate() {
        let angle = real(&format!("flow.{axis}"), &format!("Navigated {meaning}"), "rad", 0.1);
        table = table.real(angle, move |m| &mut m.shown.flow[i]);
    }
    for (i, (direction, meaning)) in WIND.into_iter().enumerate() {
        let wind = real(&format!("wind.{direction}"), &format!("Estimated {meaning}"), "m/s", 10.0);
        table = table.real(wind, move |m| &mut m.shown.wind[i]);
    }
    let ratio = "Estimated ratio of lift and drag to those of the model in the standard atmosphere";
    table.real(sampled("drag.ratio", ratio).real().nominal(1.0), |m| &mut m.shown.drag_ratio)
}

/// Adds what says how good the navigated state is.
fn quality(table: Variables) -> Variables {
    let deviation = |name: &str, meaning: &str, unit: &str, nominal: f64| {
        let text = format!("Predicted standard deviation of the {meaning}");
        real(&format!("deviation.{name}"), &text, unit, nominal)
    };
    let angle = |axis: &str, meaning: &str| {
        let meaning = format!("{meaning} relative to the ground velocity");
        deviation(&format!("attitude.{axis}"), &meaning, "rad", 0.01)
    };
    let mut table = vector(table, ANGLES, angle, |m| &mut m.shown.deviations.angles);
    for (i, (axis, meaning)) in FLOW.into_iter().enumerate() {
        table = table.real(deviation(&format!("flow.{axis}"), meaning, "rad", 0.01), move |m| {
            &mut m.shown.deviations.flow[i]
        });
    }
    for (i, (direction, meaning)) in WIND.into_iter().enumerate() {
        table = table
            .real(deviation(&format!("wind.{direction}"), meaning, "m/s", 10.0), move |m| {
                &mut m.shown.deviations.wind[i]
            });
    }
    table = table
        .real(deviation("position", "position, root mean square over the axes", "m", 10.0), |m| {
            &mut m.shown.deviations.position
        })
        .real(deviation("velocity", "velocity, root mean square over the axes", "m/s", 0.1), |m| {
            &mut m.shown.deviations.velocity
        })
        .real(deviation("altitude", "altitude", "m", 10.0), |m| &mut m.shown.deviations.altitude)
        .real(
            sampled("deviation.drag", "Predicted standard deviation of drag.ratio, relative to it")
                .real()
                .nominal(0.1),
            |m| &mut m.shown.deviations.drag,
        );
    let sources = [
        ("gnss", "fix of satellite navigation"),
        ("star", "fix of the star tracker"),
        ("side", "side force"),
        ("drag", "drag"),
    ];
    for (i, (name, text)) in sources.into_iter().enumerate() {
        let text = format!(
            "Square of the normalised innovation per component of the latest {text}, 1 on average"
        );
        let square = sampled(&format!("innovation.{name}"), &text).real();
        table = table.real(square, move |m| &mut m.shown.innovations[i]);
    }
    let bias = |name: &'static str, unit: &'static str, nominal: f64| {
        move |axis: &str, _: &str| {
            let text = format!("Estimated bias of the {name} about or along {axis}");
            real(&format!("bias.{name}.{axis}"), &text, unit, nominal)
        }
    };
    let table = vector(table, AXES, bias("gyroscope", "rad/s", 1e-5), |m| &mut m.shown.biases[0]);
    let rejected = sampled("rejectedFixes", "Number of fixes so far that were rejected");
    vector(table, AXES, bias("accelerometer", "m/s2", 1e-2), |m| &mut m.shown.biases[1])
        .integer(rejected, (Some(0), None), |m| &mut m.shown.rejected)
        .choice(sampled("health", Health::TEXT), |m| &mut m.health)
}
