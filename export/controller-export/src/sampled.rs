//! An instance that works at ticks: its steps from tick to tick, and its restoration.

use control::schedule::Sampled;
use fmi_export::{Context, Description, EventInfo, Failure, Inputs, LastEvent, Model, Restoration};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::ops::{Deref, DerefMut};

/// Warning at the first tick whose inputs are not those of its instant.
const STALE: &str = "a tick within a step used inputs that had been set before it: step with the period of the ticks, or with a whole fraction of it";

/// The ticks of an instance with their memory.
pub type Ticks<I> = Sampled<
    <I as SampledInstance>::Memory,
    <I as SampledInstance>::Input,
    <I as SampledInstance>::Output,
>;

/// An instance that works at ticks: its parameters, inputs and outputs, and the device that is
/// built from them.
pub trait SampledInstance: Serialize + DeserializeOwned + Send + Sized + 'static {
    /// Device that computes at the ticks. Apart from the memory it keeps nothing that a later tick
    /// could notice.
    type Device: Send;
    /// State that is carried from tick to tick.
    type Memory: Clone + Default + Serialize + DeserializeOwned + Send;
    /// Input on which a tick depends, besides the memory.
    type Input: Clone + Default + PartialEq + Serialize + DeserializeOwned + Send;
    /// Output that a tick computes, besides the memory.
    type Output: Copy + Default + Serialize + DeserializeOwned + Send;

    /// Returns the description of the FMU, see [`Model::description`].
    fn description() -> Description<SampledFmu<Self>>;

    /// Returns the instance with its start values, see [`Model::new`].
    fn new() -> Self;

    /// Loads the files that the parameters name.
    ///
    /// # Errors
    /// Returns an error that names the parameter at fault.
    fn load(&mut self, _context: &Context) -> Result<(), Failure> {
        Ok(())
    }

    /// Builds the device from the parameters.
    ///
    /// # Errors
    /// Returns an error that names the parameter at fault.
    fn design(&self) -> Result<Self::Device, Failure>;

    /// Returns whether [`Self::design`] would build the same device again.
    fn is_designed(&self, _device: &Self::Device) -> bool {
        false
    }

    /// Returns the time between two ticks (s), with which the schedule is built.
    fn period(device: &Self::Device) -> f64;

    /// Returns the memory for the first tick.
    fn memory(_device: &Self::Device) -> Self::Memory {
        Self::Memory::default()
    }

    /// Evaluates the first uncommitted tick with the present inputs, which are stale if they were set
    /// at an earlier instant.
    ///
    /// # Errors
    /// Returns an error that names the input at fault.
    fn evaluate(
        &self,
        device: &mut Self::Device,
        ticks: &mut Ticks<Self>,
        is_stale: bool,
    ) -> Result<(), Failure>;

    /// Returns the output that is shown at the start time, if it is not that of the first tick
    /// because this tick's output acts later.
    fn output_before_the_first(_device: &Self::Device) -> Option<Self::Output> {
        None
    }

    /// Returns a warning for the log if something went wrong between two ticks.
    fn warning(_before: &Self::Memory, _after: &Self::Memory) -> Option<&'static str> {
        None
    }

    /// Sets the outputs at `time` (s) from the output and memory in force.
    fn show(&mut self, time: f64, device: &Self::Device, in_force: (Self::Output, &Self::Memory));

    /// Returns whether the shape of a restored memory fits this device.
    fn fits(_device: &Self::Device, _memory: &Self::Memory) -> bool {
        true
    }

    /// Returns the fault of a restored instance, apart from its ticks.
    fn problem(&self, _before: &Self) -> Option<&'static str> {
        None
    }
}

/// An instance that works at ticks, in the form that FMI requires. Its parts are in boxes, because
/// a host may have little stack.
#[derive(Serialize, Deserialize)]
#[serde(bound = "")]
pub struct SampledFmu<I: SampledInstance> {
    instance: Box<I>,
    /// Ticks of the instance; present from initialization on.
    ticks: Option<Box<Ticks<I>>>,
    /// Whether the log has told that ticks lie within steps.
    has_told: bool,
    #[serde(skip)]
    device: Option<Box<I::Device>>,
}

impl<I: SampledInstance> Deref for SampledFmu<I> {
    type Target = I;
    fn deref(&self) -> &I {
        &self.instance
    }
}

impl<I: SampledInstance> DerefMut for SampledFmu<I> {
    fn deref_mut(&mut self) -> &mut I {
        &mut self.instance
    }
}

/// Takes the device that is there, if the instance would build the same one, or builds it.
fn designed<I: SampledInstance>(
    instance: &I,
    present: &mut Option<Box<I::Device>>,
) -> Result<Box<I::Device>, Failure> {
    let same = |device: &mut Box<I::Device>| instance.is_designed(device);
    present.take_if(same).map_or_else(|| instance.design().map(Box::new), Ok)
}

/// Returns the state before the first tick. As a separate function, this does not add its need of
/// stack to that of the design.
#[inline(never)]
#[expect(clippy::unnecessary_box_returns, reason = "a caller would hold it on its stack")]
fn first<I: SampledInstance>(start: f64, device: &I::Device) -> Box<Ticks<I>> {
    Box::new(Sampled::new(start, I::period(device), I::memory(device)))
}

/// Returns the error for a saved state that no instance can have been in.
fn misfit(problem: &str) -> Result<(), Failure> {
    Err(Failure::Error(format!("the saved state does not fit: {problem}")))
}

impl<I: SampledInstance> SampledFmu<I> {
    /// Returns instance, device and ticks, which are present from initialization on.
    fn parts(&mut self) -> Result<(&I, &mut I::Device, &mut Ticks<I>), Failure> {
        match (&mut self.device, &mut self.ticks) {
            (Some(device), Some(ticks)) => Ok((&self.instance, device, ticks)),
            _ => Err(Failure::Error("the instance is not initialized".into())),
        }
    }
}

impl<I: SampledInstance> Model for SampledFmu<I> {
    fn description() -> Description<Self> {
        I::description()
    }

    fn new() -> Self {
        Self { instance: Box::new(I::new()), ticks: None, has_told: false, device: None }
    }

    fn reset(&mut self) {
        *self = Self { device: self.device.take(), ..Self::new() };
    }

    fn initialize(&mut self, context: &Context) -> Result<(), Failure> {
        self.instance.load(context)?;
        let device = designed(&*self.instance, &mut self.device)?;
        vehicle::time::check_resolution(context.start_time, I::period(&device))
            .map_err(|error| Failure::Error(error.to_string()))?;
        (self.ticks, self.device) = (Some(first::<I>(context.start_time, &device)), Some(device));
        Ok(())
    }

    /// A due tick is evaluated, except after a step: the outputs are then those of the tick that
    /// was committed, which acted over that step. Within a step of the importer its inputs are
    /// stale.
    fn calculate(&mut self, time: f64, last: LastEvent) -> Result<(), Failure> {
        let (instance, device, ticks) = self.parts()?;
        let holds = last == LastEvent::Step && ticks.has_committed();
        if !holds && ticks.is_due(time) {
            instance.evaluate(device, ticks, last == LastEvent::Event)?;
        }
        if let (Some(device), Some(ticks)) = (&self.device, &self.ticks) {
            let (output, memory) = ticks.in_force();
            let before = (last == LastEvent::Initialization)
                .then(|| I::output_before_the_first(device))
                .flatten();
            self.instance.show(time, device, (before.unwrap_or(output), memory));
        }
        Ok(())
    }

    /// Evaluates and commits every tick from `from` up to, but not at, `to`, with the inputs at
    /// that time. At a tick after `from` they are stale, unless they are extrapolated.
    fn step(
        &mut self,
        from: f64,
        to: f64,
        inputs: &dyn Inputs<Self>,
        log: &mut dyn FnMut(&str),
    ) -> Result<(), Failure> {
        loop {
            let (_, _, ticks) = self.parts()?;
            let Some(tick) = ticks.next_before(to) else { return Ok(()) };
            inputs.advance(self, tick.max(from));
            let (instance, device, ticks) = self.parts()?;
            let are_current = ticks.is_due(from) && inputs.are_current();
            let is_stale = !are_current && !inputs.are_extrapolated();
            instance.evaluate(device, ticks, is_stale)?;
            ticks.commit();
            if let Some(text) = ticks.last_change(I::warning) {
                log(text);
            }
            if is_stale && !std::mem::replace(&mut self.has_told, true) {
                log(STALE);
            }
        }
    }

    /// Returns the time of the next tick. Ticks are evaluated when an output is read, and committed
    /// by steps.
    fn new_discrete_states(&mut self, time: f64) -> Result<EventInfo, Failure> {
        let (_, _, ticks) = self.parts()?;
        let next_event_time = Some(ticks.next_after(time));
        Ok(EventInfo { next_event_time, ..EventInfo::default() })
    }

    fn restored(&mut self, from: Restoration<'_, Self>) -> Result<(), Failure> {
        let Some(ticks) = self.ticks.as_ref().filter(|_| from.initialized) else { return Ok(()) };
        if let Some(problem) = self.instance.problem(&from.before.instance) {
            return misfit(problem);
        }
        let device = designed(&*self.instance, &mut from.before.device)?;
        let times = (from.start_time, from.time);
        if ticks.fits(times, I::period(&device), from.failed, |memory| I::fits(&device, memory)) {
            self.device = Some(device);
            return Ok(());
        }
        // The other instance gets back the device that was taken from it.
        from.before.device.get_or_insert(device);
        misfit("its ticks do not match its time, or its memory has another shape")
    }
}
