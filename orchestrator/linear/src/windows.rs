//! Numbers of steps over which a component is evaluated.

/// Longest period of a component that is looked for: a time in s, but so many of its steps at least
/// and at most.
const LONGEST_PERIOD: f64 = 0.25;
const LONGEST: [usize; 2] = [25, 50];
/// Time over which responses are evaluated, and longest delay of a component, s. It limits the
/// longest period, too.
pub(crate) const LONGEST_TIME: f64 = 1.0;
/// Number of steps whose responses a model reproduces twice over: the first that is tried, and the
/// largest, as the time to realise a model grows with its third power.
pub(crate) const BLOCKS: usize = 24;
pub(crate) const MOST_BLOCKS: usize = 200;
/// Number of responses, from the first one on, that are compared to find a period or a delay.
pub(crate) const COMPARED: usize = 6;

/// Returns the number of steps of which the inputs of a component must be known. Responses are
/// taken from the steps of two periods on, and those of a component that remembers its inputs as
/// long as the longest delay for twice this delay.
pub(crate) fn needed_steps(length: f64) -> usize {
    let (longest, window) = (longest_period(length), longest_response(length));
    let blocks = (2 * longest).max(window.clamp(BLOCKS, MOST_BLOCKS));
    (2 * longest + 2 * blocks).max(longest + window)
}

/// Returns the number of steps over which a model is compared with the motion of a vehicle.
pub(crate) fn compared_steps(length: f64) -> usize {
    (LONGEST_TIME / length).ceil() as usize
}

/// Returns the number of steps within which the longest delay ends and the response after it shows.
pub(crate) fn longest_response(length: f64) -> usize {
    compared_steps(length) + 2 * COMPARED
}

pub(crate) fn longest_period(length: f64) -> usize {
    let steps = |time: f64| (time / length + 1e-9) as usize;
    steps(LONGEST_PERIOD).clamp(LONGEST[0], LONGEST[1]).min(steps(LONGEST_TIME)).max(1)
}
