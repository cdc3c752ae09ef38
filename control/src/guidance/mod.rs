//! Guidance of an entry flight to the terminal area: a predictor–corrector in the bank angle, P.
//! Lu, "Entry guidance: a unified method", Journal of Guidance, Control, and Dynamics 37(3) (2014).
//!
//! Once a second the guidance finds the magnitude of the bank angle with which the predicted flight
//! ends at the required distance from the target. The angle of attack follows a schedule over
//! speed. The sign of the bank angle is reversed when the heading has left a dead band about the
//! direction to the target. At every tick the reference of the attitude follows these commands
//! within limits on its rate and acceleration.

mod glide;
mod model;
mod predictor;
mod settings;
mod shaping;

use glide::Glide;
pub use glide::Loads;
pub use predictor::{Beginning, End, Predictor};
pub use settings::{
    Alpha, Bank, Damping, Ellipsoid, Filter, Initial, Limit, Reversal, Settings, Shaping, Target,
};
pub use shaping::{Limits, Shaped};

use crate::error::DesignError;
use ::settings::Declared;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, TAU};
use vehicle::aerodynamics::Aerodynamics;
use vehicle::axes::nearest;
use vehicle::entry::{MOTION, Motion, NOMINALS, UNITS, great_circle};
use vehicle::math::{atan2, cos, exp, sin_cos};
use vehicle::reference::Reference;

/// Time between two ticks, s.
pub const PERIOD: f64 = 0.04;
/// Ticks from one correction of the bank angle to the next.
const TICKS: u64 = 25;
/// Difference of the bank angle from which the predictor's slope follows, rad.
const PROBE: f64 = 0.01;
/// Largest change of the bank angle in one correction, rad.
const CORRECTION: f64 = 0.1;
/// Bisections by which the first bank angle is found.
const BISECTIONS: u32 = 20;
/// Energy that is left when the bank angle is no longer corrected, relative to that of a circular
/// orbit: a bank angle has hardly any influence on where the flight ends then.
const FROZEN: f64 = 0.01;
/// Corrections in a row after which a target counts as in reach again: in a skip the predicted range
/// changes by hundreds of kilometres within seconds.
const REGAINED: u64 = 30;
/// Largest specific force (m/s²) and number of turns that count as those of an entry flight.
const LARGEST_LOAD: f64 = 1e3;
const MOST_TURNS: f64 = 100.0;

/// Measurements of the guidance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Navigation {
    /// {}.
    #[setting(each = MOTION, units = UNITS, nominals = NOMINALS)]
    pub motion: Motion,
    /// Measured lift per mass.
    #[setting(name = "load.lift", unit = "m/s2", nominal = 10.0)]
    pub lift: f64,
    /// Measured drag per mass.
    #[setting(name = "load.drag", unit = "m/s2", nominal = 10.0)]
    pub drag: f64,
}

/// Commands of the guidance, and what is worth plotting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Command {
    /// Reference of the attitude.
    #[setting(each = OF_ANGLES)]
    pub reference: Reference,
    /// Angle of attack of the schedule.
    #[setting(name = "command.alpha", unit = "rad", nominal = 0.1)]
    pub alpha: f64,
    /// Bank angle before it is shaped.
    #[setting(name = "command.bank", unit = "rad", nominal = 1.0)]
    pub bank: f64,
    /// Distance over ground to the runway point.
    #[setting(unit = "m", nominal = 1e6)]
    pub range: f64,
    /// Direction to the runway point less the heading, positive to the right.
    #[setting(unit = "rad", nominal = 0.1)]
    pub heading_error: f64,
    /// By how much the predicted flight ends too far from the target.
    #[setting(unit = "m", nominal = 1e3)]
    pub miss: f64,
    /// Whether a bank angle brings the predicted flight within target.tolerance of the target.
    ///
    /// As long as the bank angle is corrected, it is one between the least and the largest.
    pub in_reach: bool,
    /// Present heat flux, load and dynamic pressure.
    pub loads: Loads,
    /// Heat load of the leading edge so far.
    #[setting(name = "loads.heatLoad", unit = "J/m2", nominal = 1e8)]
    pub heat_load: f64,
    /// Whether a limit makes the bank angle smaller.
    #[setting(name = "limits.active")]
    pub is_limited: bool,
    /// Whether the predicted flight keeps all limits.
    #[setting(name = "limits.feasible")]
    pub keeps_limits: bool,
}

const OF_ANGLES: [(&str, &str); 3] = [
    (".alpha", "of the angle of attack"),
    (".beta", "of the sideslip angle"),
    (".sigma", "of the bank angle"),
];

/// State that is carried from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Whether a first bank angle was found.
    begun: bool,
    /// Magnitude of the bank angle that reaches the target, rad.
    magnitude: f64,
    /// Commanded magnitude, and the one before the last correction, from which the command moves on
    /// in a second: each step of the command would cost moment.
    commanded: f64,
    before: f64,
    /// Whether the vehicle turns to the left, which a positive bank angle does.
    to_left: bool,
    /// Tick of the last reversal.
    reversed: u64,
    /// Number of reversals.
    pub reversals: u64,
    /// Corrections in a row with the target in reach.
    reached: u64,
    /// Ratios of the measured to the predicted lift and drag.
    ratios: [f64; 2],
    alpha: Shaped,
    bank: Shaped,
    /// Commands of the last tick.
    pub command: Command,
}

/// Entry guidance.
#[derive(Clone, Debug)]
pub struct Guidance {
    settings: Settings,
    predictor: Predictor,
}

impl Memory {
    /// Returns whether the guidance has been evaluated.
    pub fn has_begun(&self) -> bool {
        self.begun
    }
}

impl Guidance {
    /// Makes a guidance of the papers' vehicle.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        Self::of(settings, Aerodynamics::papers())
    }

    /// Makes a guidance of a vehicle.
    ///
    /// # Errors
    /// Names the setting that is out of range, or the limit that the end of the flight exceeds.
    pub fn of(settings: Settings, aerodynamics: Aerodynamics) -> Result<Self, DesignError> {
        ::settings::check(&settings)?;
        settings.alpha.check()?;
        let predictor = Predictor::new(aerodynamics);
        let Target { altitude, speed, .. } = settings.target;
        let floor = Loads::at(&predictor.model, altitude, speed, settings.alpha.at(speed));
        // The heat flux is the largest long before.
        for (name, limit, floor) in [
            ("limit.load", settings.limit.load, floor.load),
            ("limit.pressure", settings.limit.pressure, floor.pressure),
        ] {
            if limit < floor {
                return Err(DesignError::LimitBelowTarget { name, limit, floor });
            }
        }
        Ok(Self { settings, predictor })
    }

    /// Returns the settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the air forces and moments of the vehicle.
    pub fn aerodynamics(&self) -> &Aerodynamics {
        self.predictor.model.aerodynamics()
    }

    /// Returns whether a memory can be used: all of its numbers are finite.
    pub fn fits(&self, memory: &Memory) -> bool {
        let Memory { magnitude, commanded, before, ratios, alpha, bank, command, .. } = *memory;
        let state = [magnitude, commanded, before, alpha.value, alpha.rate, bank.value, bank.rate];
        let Command { range, heading_error, miss, loads, heat_load, .. } = command;
        let shown = [command.alpha, command.bank, range, heading_error, miss, heat_load];
        let mut numbers = state.into_iter().chain(ratios).chain(shown).chain(loads.all());
        numbers.all(f64::is_finite)
    }

    /// Evaluates the guidance at the tick with this number. If the measurements are those of no
    /// entry flight, the last command is held, and neither target nor limits count as kept.
    pub fn update(&self, memory: &mut Memory, tick: u64, measured: &Navigation) -> Command {
        let mut next = *memory;
        let is_plausible = self.is_plausible(measured);
        if is_plausible {
            self.decide(&mut next, tick, measured);
        }
        if !(is_plausible && self.fits(&next)) {
            next = *memory;
            next.command = Command { in_reach: false, keeps_limits: false, ..next.command };
        }
        if !next.begun {
            next.alpha.value = self.settings.initial.alpha;
            next.bank.value = self.settings.initial.sigma;
            (next.command.alpha, next.command.bank) = (next.alpha.value, next.bank.value);
        }
        let Command { alpha, bank, .. } = next.command;
        let Shaping { bank_rate, bank_acceleration, alpha_rate, alpha_acceleration } =
            self.settings.shaping;
        let limits = Limits { rate: alpha_rate, acceleration: alpha_acceleration };
        next.alpha.follow(alpha, &limits, PERIOD);
        let limits = Limits { rate: bank_rate, acceleration: bank_acceleration };
        next.bank.follow(bank, &limits, PERIOD);
        let vector =
            |part: fn(&Shaped) -> f64| Vector3::new(part(&next.alpha), 0.0, part(&next.bank));
        next.command.reference = Reference {
            angles: vector(|shaped| shaped.value),
            rates: vector(|shaped| shaped.rate),
            accelerations: vector(|shaped| shaped.acceleration),
        };
        *memory = next;
        next.command
    }

    /// Returns whether measurements can be those of an entry flight. A navigation that has diverged
    /// gives others.
    pub fn is_plausible(&self, measured: &Navigation) -> bool {
        let [altitude, longitude, latitude, speed, path, heading] = measured.motion.into();
        let planet = &self.settings.planet;
        let circular = (planet.gravitation / planet.radius).sqrt();
        let most = MOST_TURNS * TAU;
        speed > 0.0
            && [
                (altitude, planet.radius),
                (longitude, most),
                (latitude, FRAC_PI_2),
                (speed, 2.0 * circular),
                (path, FRAC_PI_2),
                (heading, most),
                (measured.lift, LARGEST_LOAD),
                (measured.drag, LARGEST_LOAD),
            ]
            .iter()
            .all(|(value, largest)| value.abs() <= *largest)
    }

    /// Decides upon the commands of angle of attack and bank angle, before they are shaped.
    fn decide(&self, memory: &mut Memory, tick: u64, measured: &Navigation) {
        let [_, _, _, speed, _, heading] = measured.motion.into();
        let target = [self.settings.target.longitude, self.settings.target.latitude];
        let here = [measured.motion[1], measured.motion[2]];
        let (range, direction) = great_circle(&self.settings.planet.planet(), here, target);
        let heading_error = nearest(direction - heading, 0.0);
        let first = !memory.begun;
        if first {
            memory.ratios = [1.0; 2];
            // A positive heading error asks for a turn to the right.
            memory.to_left = heading_error < 0.0;
        }
        let mut command = Command { range, heading_error, ..memory.command };
        if first || tick.is_multiple_of(TICKS) {
            self.filter(memory, measured);
            memory.before = memory.commanded;
            self.correct(memory, measured, &mut command);
            self.reverse(memory, tick, speed, heading_error);
        }
        if first {
            memory.before = memory.commanded;
        }
        let share = (tick % TICKS + 1) as f64 / TICKS as f64;
        let magnitude = memory.before + share * (memory.commanded - memory.before);
        command.bank = if memory.to_left { magnitude } else { -magnitude };
        command.alpha = self.schedule(memory).at(speed);
        if first {
            memory.alpha.value = self.settings.initial.alpha;
            memory.bank.value = nearest(self.settings.initial.sigma, command.bank);
            memory.begun = true;
        }
        memory.command = command;
    }

    /// Compares measured and predicted lift and drag.
    fn filter(&self, memory: &mut Memory, measured: &Navigation) {
        let Filter { time, drag } = self.settings.filter;
        if !(measured.drag > drag && measured.lift.is_finite()) {
            return;
        }
        let [altitude, _, _, speed, ..]: [f64; 6] = measured.motion.into();
        let alpha = memory.alpha.value;
        let predicted = self.predictor.model.accelerations(altitude, speed, alpha);
        let share = 1.0 - exp(-(TICKS as f64) * PERIOD / time);
        let actual = [measured.lift, measured.drag];
        for ((ratio, actual), predicted) in memory.ratios.iter_mut().zip(actual).zip(predicted) {
            // A vehicle may have no lift.
            let latest = if predicted == 0.0 { 1.0 } else { (actual / predicted).clamp(0.3, 3.0) };
            *ratio += share * (latest - *ratio);
        }
    }

    /// Schedule of the angle of attack. Its end is moved so that the lift there is that of the
    /// model: the flight is in equilibrium at the altitude of the target then, not at another one.
    fn schedule(&self, memory: &Memory) -> Alpha {
        let alpha = self.settings.alpha;
        let [lift_ratio, _] = memory.ratios;
        let model = &self.predictor.model;
        let mach = model.mach(self.settings.target.altitude, self.settings.target.speed);
        let lift = |angle: f64| model.coefficients(angle, mach)[0];
        let mut schedule = alpha;
        let end = &mut schedule.schedule[0].angle;
        let slope = (lift(*end + PROBE) - lift(*end)) / PROBE;
        let change = lift(*end) * (1.0 / lift_ratio - 1.0) / slope;
        // Lift that does not depend on the angle cannot be had by another one.
        if change.is_finite() {
            *end += change.clamp(-alpha.adjustment, alpha.adjustment);
        }
        schedule
    }

    /// Corrects the magnitude of the bank angle by the predicted miss: Lu 2014, section III, with
    /// a Newton step whose slope is a difference. The command follows from it by the feedback of
    /// the altitude rate.
    fn correct(&self, memory: &mut Memory, measured: &Navigation, command: &mut Command) {
        let settings = &Settings { alpha: self.schedule(memory), ..self.settings };
        let [altitude, _, latitude, speed, path, heading] = measured.motion.into();
        let last = Predictor::last_energy(settings);
        let circular = settings.planet.gravitation / (2.0 * settings.planet.radius);
        let (sin_latitude, cos_latitude) = sin_cos(latitude);
        let radius = settings.planet.planet().surface(sin_latitude)[0] + altitude;
        let left = (last - Predictor::energy(settings, radius, speed)) / circular;
        let direction = heading + command.heading_error;
        let begin = Beginning {
            radius,
            speed,
            path,
            latitude: [sin_latitude, cos_latitude * cos(direction)],
            eastward: cos_latitude * sin_cos(direction).0,
            near_equator: cos_latitude * cos(settings.target.latitude),
            ratios: memory.ratios,
        };
        // Excess of the distance to the target at the end of a flight with this bank angle.
        let wanted = command.range - settings.target.range;
        let fly = |bank: f64| self.predictor.fly(settings, &begin, bank);
        let miss = |bank: f64| wanted - fly(bank).range;
        let largest = settings.bank.largest;
        if !memory.begun {
            let (mut low, mut high) = (0.0, largest);
            for _ in 0..BISECTIONS {
                let middle = f64::midpoint(low, high);
                if miss(middle) > 0.0 { high = middle } else { low = middle }
            }
            memory.magnitude = f64::midpoint(low, high);
        }
        let End { range, arrives, loads } = fly(memory.magnitude);
        let here = wanted - range;
        let tolerance = settings.target.tolerance;
        command.miss = here;
        let mut is_reached = arrives && here.abs() <= tolerance;
        if left.abs() >= FROZEN {
            // The plan with the largest bank angle is the shortest one, that with none the longest.
            is_reached = is_reached || miss(largest) >= -tolerance && miss(0.0) <= tolerance;
            let slope = (miss(memory.magnitude + PROBE) - here) / PROBE;
            // A larger bank angle makes the flight shorter. Where it does not, only the sign of the
            // correction is right.
            let change = if slope > 0.0 { -here / slope } else { -CORRECTION.copysign(here) };
            let change = change.clamp(-CORRECTION, CORRECTION);
            memory.magnitude = (memory.magnitude + change).clamp(0.0, largest);
        }
        memory.reached = match (is_reached, memory.begun) {
            (true, true) => memory.reached.saturating_add(1),
            (true, false) => REGAINED,
            (false, _) => 0,
        };
        command.in_reach = memory.reached >= REGAINED;
        let present = Glide {
            alpha: memory.alpha.value,
            accelerations: [measured.lift, measured.drag],
            ..self.predictor.glide(settings, &begin, memory.magnitude)
        };
        let model = &self.predictor.model;
        let now = present.loads(model);
        let least = present.least_rate(model, &settings.limit, &now);
        let (cosine, is_limited) = present.cosine(model, settings, least);
        memory.commanded = atan2((1.0 - cosine * cosine).sqrt(), cosine);
        if memory.begun {
            let mean = f64::midpoint(command.loads.heat_flux, now.heat_flux);
            command.heat_load += mean * TICKS as f64 * PERIOD;
        }
        (command.loads, command.is_limited) = (now, is_limited);
        let limits = settings.limit.all();
        let kept = loads.all().into_iter().zip(limits).all(|(load, limit)| load <= limit);
        command.keeps_limits = kept;
    }

    /// Reverses the bank angle when the heading has left its dead band and still moves away.
    fn reverse(&self, memory: &mut Memory, tick: u64, speed: f64, heading_error: f64) {
        let reversal = &self.settings.reversal;
        let turns_away = (heading_error > 0.0) == memory.to_left;
        let passed = tick.saturating_sub(memory.reversed) as f64 * PERIOD;
        let is_early = memory.reversals > 0 && passed < reversal.interval;
        if turns_away && heading_error.abs() > reversal.at(speed) && !is_early {
            memory.to_left = !memory.to_left;
            memory.reversed = tick;
            memory.reversals += 1;
        }
    }
}
