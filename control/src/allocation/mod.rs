//! Control allocation: deflections and jets that give the commanded moment, and the moments that
//! they can give. The methods are those of Wu et al. (2015), section 5, and the selector of Jia et
//! al., section IV.

pub mod attainable;
mod optimum;
pub mod pwpf;
mod settings;

pub use settings::{JetCommand, Method, Settings};

use crate::clock::Instant;
use crate::error::DesignError;
use ::settings::{Choice, Declared};
use attainable::{Ball, Reach, largest_ball};
use nalgebra::{SMatrix, Vector3};
use optimum::{OptimalAllocation, Weights};
use pwpf::Modulator;
use serde::{Deserialize, Serialize};
use vehicle::aerodynamics::Flow;
use vehicle::axes::MOMENTS;
use vehicle::effectors::{
    EffectorFaultKind, Effectors, JETS, Jets, SURFACE_NAMES, SURFACES, Surfaces,
};

/// Effectiveness D_RCS of the jets, N m at full thrust.
type JetMatrix = SMatrix<f64, 3, JETS>;

/// Input of the allocation: the commanded moment and the flight condition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Command {
    /// Commanded {}.
    ///
    /// It is M_c in the paper.
    #[setting(each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub moment: Vector3<f64>,
    /// Dynamic pressure, to which the moments of the surfaces are proportional.
    #[setting(unit = "Pa", min = 0.0, nominal = 1e3)]
    pub dynamic_pressure: f64,
    /// Angle of attack, on which the moments of surfaces with tables in vehicle.file depend.
    #[setting(name = "flow.alpha", optional, unit = "rad", nominal = 0.1)]
    pub alpha: f64,
    /// Mach number, on which the moments of surfaces with tables in vehicle.file depend.
    #[setting(name = "flow.mach", optional, min = 0.0, nominal = 10.0)]
    pub mach: f64,
}

impl Command {
    /// Returns the flow past the surfaces.
    pub fn flow(&self) -> Flow {
        let Self { dynamic_pressure, alpha, mach, .. } = *self;
        Flow { dynamic_pressure, alpha, mach, ..Flow::default() }
    }
}

/// Origin of the allocation in force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Choice)]
pub enum AllocationStatus {
    /// No allocation yet.
    #[default]
    None,
    /// Optimum.
    Optimal,
    /// Previous allocation within the limits, because the optimisation failed.
    Fallback,
}

/// Report of an allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct AllocationReport {
    /// Origin of the allocation in force.
    pub status: AllocationStatus,
    /// Number of iterations in the last allocation.
    pub iterations: u32,
    /// Number of allocations so far that failed.
    pub fallbacks: u32,
    /// Wall-clock time of the last allocation; not reproducible.
    #[setting(unit = "s", nominal = 1e-4)]
    pub time: f64,
}

/// The state that the allocator carries from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Declared)]
pub struct Memory {
    /// Commanded deflection of the {}.
    ///
    /// It is δ_A in the paper.
    #[setting(name = "surface", each = SURFACE_NAMES, unit = "rad", nominal = 0.1)]
    pub surfaces: Surfaces,
    /// Command to jet {}: 1 for on and 0 for off, or the duty cycle with jets = duty.
    #[setting(name = "jet")]
    pub jets: Jets,
    /// Duty cycle of jet {} before modulation.
    ///
    /// It is δ_RCS of (60).
    #[setting(name = "jetDuty")]
    pub duty: Jets,
    /// {} achieved by the last allocation, with the jets' duty cycles before modulation.
    ///
    /// It is D δ.
    #[setting(name = "achievedMoment", each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub achieved: Vector3<f64>,
    /// {} missing in the last allocation: commanded minus achieved, before modulation.
    ///
    /// It is M_c − D δ.
    #[setting(each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub residual: Vector3<f64>,
    /// {} of the present commands to surfaces and jets, after modulation.
    #[setting(name = "modulatedMoment", each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub modulated: Vector3<f64>,
    /// {} of the surfaces in the last allocation.
    #[setting(name = "momentBySurfaces", each = MOMENTS, unit = "N.m", nominal = 1e5)]
    pub by_surfaces: Vector3<f64>,
    /// Outcome of the last allocation.
    #[setting(name = "solver")]
    pub report: AllocationReport,
    /// What surfaces and jets can give, leaving the rates of the surfaces aside.
    #[setting(depends_on = ["dynamicPressure", "flow.*"])]
    pub attainable: Ball,
    /// The same within one period, in which the rates of the surfaces limit them.
    #[setting(name = "attainable.momentInPeriod", unit = "N.m", nominal = 1e5)]
    #[setting(depends_on = ["dynamicPressure", "flow.*"])]
    pub in_period: f64,
    /// The same as attainable.moment for the surfaces alone.
    #[setting(name = "attainable.momentBySurfaces", unit = "N.m", nominal = 1e5)]
    #[setting(depends_on = ["dynamicPressure", "flow.*"])]
    pub surfaces_alone: f64,
    /// Modulators of the jets, one for each.
    #[setting(skip)]
    pub modulators: [Modulator; JETS],
}

/// The allocator: settings and solver. All state that later ticks depend on is in [`Memory`].
///
/// ```
/// use control::allocation::{Allocator, Command, Memory, Settings};
/// use nalgebra::Vector3;
///
/// let mut allocator = Allocator::new(Settings::published())?;
/// let mut memory = Memory::default();
/// let moment = Vector3::new(1e3, -2e3, 5e2);
/// let command = Command { moment, dynamic_pressure: 7e3, ..Command::default() };
/// allocator.update(&mut memory, 0, 0.0, &command);
/// assert!(memory.residual.norm() < 1.0, "surfaces and jets give the moment: {}", memory.residual);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Allocator {
    settings: Settings,
    /// Smallest and largest deflections, rad.
    limits: (Surfaces, Surfaces),
    /// Number of ticks per allocation.
    ratio: u64,
    problem: OptimalAllocation,
    /// The allocation problem without jets, for blending.
    without_jets: OptimalAllocation,
    /// Moment of a jet that stays on, N m.
    always: Vector3<f64>,
    /// The allocator from the time on at which a surface or a jet fails.
    failed: Option<Box<Self>>,
}

/// Remainder of the moment, as a fraction of it, that counts as rounding.
const NEGLIGIBLE: f64 = 1e-7;

impl Allocator {
    /// Checks the settings and sets up the solver.
    ///
    /// # Errors
    /// Returns an error that names the setting at fault.
    pub fn new(settings: Settings) -> Result<Self, DesignError> {
        let ratio = settings.ratio()?;
        let failed = if settings.fault.kind == EffectorFaultKind::None {
            None
        } else {
            let (settings, always) = settings.failed();
            Some(Box::new(Self { always, ..Self::new(settings)? }))
        };
        let limits = settings.limits();
        let range = limits.1 - limits.0;
        let weight =
            |range: f64| if range > 0.0 { settings.weight_surface / (range * range) } else { 0.0 };
        let weights = Weights {
            moment: settings.weight_moment,
            jet: Jets::repeat(settings.weight_jet),
            surface: range.map(weight),
        };
        let jets = &settings.effectors.jet_moments;
        let problem = |weights, jets: &JetMatrix| {
            OptimalAllocation::new(weights, jets, settings.max_iterations)
                .map_err(DesignError::Solver)
        };
        let alone = Weights { moment: weights.moment.component_mul(&scarcity(jets)), ..weights };
        let (problem, without_jets) =
            (problem(weights, jets)?, problem(alone, &JetMatrix::zeros())?);
        let always = Vector3::zeros();
        Ok(Self { settings, limits, ratio, problem, without_jets, always, failed })
    }

    /// Returns the settings of the allocator.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the time between ticks, s: the modulator's period, or the period of the allocation
    /// if nothing is modulated.
    pub fn period(&self) -> f64 {
        match self.settings.jets {
            JetCommand::Pwpf => self.settings.pwpf.period,
            JetCommand::Duty => self.settings.period,
        }
    }

    /// Returns the number of ticks per allocation.
    pub fn ratio(&self) -> u64 {
        self.ratio
    }

    /// Evaluates the tick with number `tick`, at `time` (s). An allocation is computed at every
    /// [`Self::ratio`]-th tick; the jets may switch at each.
    pub fn update(&mut self, memory: &mut Memory, tick: u64, time: f64, command: &Command) {
        let fault = self.settings.fault.at(time).0;
        if let Some(failed) = self.failed.as_mut().filter(|_| fault != EffectorFaultKind::None) {
            return failed.update(memory, tick, time, command);
        }
        let modulated = self.settings.jets == JetCommand::Pwpf;
        if modulated && tick > 0 {
            for (state, &duty) in memory.modulators.iter_mut().zip(&memory.duty) {
                *state = self.settings.pwpf.advance(*state, duty);
            }
        }
        if tick.is_multiple_of(self.ratio) {
            self.allocate(memory, command);
        }
        memory.jets = if modulated {
            Jets::from_iterator(memory.modulators.iter().map(|state| f64::from(u8::from(state.on))))
        } else {
            memory.duty
        };
        memory.modulated =
            memory.by_surfaces + self.settings.effectors.moment_of_jets(&memory.jets) + self.always;
    }

    fn allocate(&mut self, memory: &mut Memory, command: &Command) {
        let begin = Instant::now();
        let Command { moment: commanded, dynamic_pressure, .. } = *command;
        let effectors = &self.settings.effectors;
        let mut matrix = effectors.effectiveness_at(dynamic_pressure);
        // Wu 2015, (59) for one period: the range, and the part of it that the rate permits.
        let change = self.settings.effectors.rate * self.settings.period;
        let before = clamp(&memory.surfaces, &self.limits.0, &self.limits.1);
        let limits = self.limits(&before);
        let (min, max) = &limits;
        let mut low = (before - change).sup(min);
        let mut high = (before + change).inf(max);
        let finite = commanded.iter().all(|value| value.is_finite())
            && dynamic_pressure.is_finite()
            && (command.alpha * command.mach).is_finite();
        // Tables of surfaces are linearised over the deflections in reach: exact at their ends.
        let mut moment = commanded - self.always;
        if !effectors.tables.is_empty() {
            let (slopes, offset) = secant(effectors, &command.flow(), &low, &high);
            matrix += slopes;
            moment -= offset;
        }
        if finite {
            let in_period = (&matrix, &(commanded - moment));
            self.attain(memory, command, in_period, (&low, &high), &limits);
        }
        let mut first = 0;
        if finite && self.settings.method == Method::Blending {
            // Jia et al., section IV: the surfaces give as much as they can; below the threshold
            // they return to zero.
            let mut target = Surfaces::zeros();
            if dynamic_pressure >= self.settings.threshold {
                let (optimum, iterations) = self.without_jets.solve(&moment, &matrix, &low, &high);
                (target, first) = (optimum.map_or(before, |(surfaces, _)| surfaces), iterations);
            }
            low = clamp(&target, &low, &high);
            high = low;
        }
        let rest = (moment - matrix * low).component_mul(&self.settings.weight_moment).norm();
        let total = moment.component_mul(&self.settings.weight_moment).norm();
        let (optimum, iterations) = if !finite {
            (None, 0)
        } else if low == high && rest <= NEGLIGIBLE * total {
            // No moment is left for the jets.
            (Some((low, Jets::zeros())), 0)
        } else {
            self.problem.solve(&moment, &matrix, &low, &high)
        };
        let (surfaces, duty) = optimum.unwrap_or((before, memory.duty));
        memory.surfaces = clamp(&surfaces, &low, &high);
        memory.duty = duty.map(|duty| duty.clamp(0.0, 1.0));
        memory.by_surfaces = effectors.effectiveness_at(dynamic_pressure) * memory.surfaces
            + effectors.moment_of_tables(&command.flow(), &memory.surfaces);
        memory.achieved = memory.by_surfaces + effectors.moment_of_jets(&memory.duty) + self.always;
        memory.residual = commanded - memory.achieved;
        memory.report = AllocationReport {
            status: if optimum.is_some() {
                AllocationStatus::Optimal
            } else {
                AllocationStatus::Fallback
            },
            iterations: first + iterations,
            time: begin.elapsed().as_secs_f64(),
            fallbacks: memory.report.fallbacks.saturating_add(u32::from(optimum.is_none())),
        };
    }
}

impl Allocator {
    /// Returns the smallest and largest deflections (rad): a surface that does not move stays
    /// `before` (rad).
    fn limits(&self, before: &Surfaces) -> (Surfaces, Surfaces) {
        let rate = &self.settings.effectors.rate;
        let within = |limits: &Surfaces| {
            Surfaces::from_fn(|i, _| if rate[i] > 0.0 { limits[i] } else { before[i] })
        };
        (within(&self.limits.0), within(&self.limits.1))
    }

    /// Finds the moments that can be attained. The model of the surfaces within one period is given:
    /// its slopes, its moment at zero deflection (N m), and the deflections in reach; and the
    /// smallest and largest deflections.
    fn attain(
        &self,
        memory: &mut Memory,
        command: &Command,
        in_period: (&SMatrix<f64, 3, SURFACES>, &Vector3<f64>),
        reach: (&Surfaces, &Surfaces),
        (min, max): &(Surfaces, Surfaces),
    ) {
        let effectors = &self.settings.effectors;
        let rests = self.settings.method == Method::Blending
            && command.dynamic_pressure < self.settings.threshold;
        let at_rest = clamp(&Surfaces::zeros(), min, max);
        let (min, max) = if rests { (&at_rest, &at_rest) } else { (min, max) };
        let reach = if rests { (min, max) } else { reach };
        let mut matrix = effectors.effectiveness_at(command.dynamic_pressure);
        let mut offset = self.always;
        if !effectors.tables.is_empty() {
            let (slopes, at_zero) = secant(effectors, &command.flow(), min, max);
            matrix += slopes;
            offset += at_zero;
        }
        let with_jets = |matrix: &SMatrix<f64, 3, SURFACES>, low: &Surfaces, high: &Surfaces| {
            std::array::from_fn::<Reach, { SURFACES + JETS }, _>(|i| {
                match i.checked_sub(SURFACES) {
                    None => (matrix.column(i).into(), low[i], high[i]),
                    Some(jet) => (effectors.jet_moments.column(jet).into(), 0.0, 1.0),
                }
            })
        };
        let all = with_jets(&matrix, min, max);
        memory.attainable = largest_ball(&all, &offset);
        memory.surfaces_alone = largest_ball(&all[..SURFACES], &offset).radius;
        memory.in_period =
            largest_ball(&with_jets(in_period.0, reach.0, reach.1), in_period.1).radius;
    }
}

/// Returns a linear model of the surfaces with tables between the lowest and the highest
/// deflections in reach (rad): slopes, N m/rad, and the moment at zero deflection, N m.
fn secant(
    effectors: &Effectors,
    flow: &Flow,
    low: &Surfaces,
    high: &Surfaces,
) -> (SMatrix<f64, 3, SURFACES>, Vector3<f64>) {
    let (mut slopes, mut offset) = (SMatrix::zeros(), Vector3::zeros());
    for table in &effectors.tables {
        let (i, j) = (table.axis, table.surface);
        let (from, to) = (low[j], high[j]);
        let at_low = table.moment(flow, from);
        let slope = if to > from { (table.moment(flow, to) - at_low) / (to - from) } else { 0.0 };
        slopes[(i, j)] += slope;
        offset[i] += at_low - slope * from;
    }
    (slopes, offset)
}

/// Returns the scarcity of the jets' moment about each axis, relative to the axis where they give
/// most. Moment that the surfaces do not provide about a scarce axis has a larger weight. Without
/// jets all values are 1.
fn scarcity(jets: &JetMatrix) -> Vector3<f64> {
    let authority = Vector3::from_fn(|i, _| {
        let (up, down) = jets
            .row(i)
            .iter()
            .fold((0.0, 0.0), |(up, down), &m: &f64| (up + m.max(0.0), down - m.min(0.0)));
        f64::min(up, down)
    });
    authority.map(|moment| if moment > 0.0 { authority.max() / moment } else { 1.0 })
}

fn clamp(values: &Surfaces, low: &Surfaces, high: &Surfaces) -> Surfaces {
    values.sup(low).inf(high)
}
