//! Endings of the names of vectors' entries, each with the meaning of the entry; and which angles
//! repeat after a whole turn.

use std::f64::consts::TAU;

pub use settings::Entry;

/// Components of Θ by name.
pub const ANGLES: [Entry; 3] =
    [(".alpha", "angle of attack"), (".beta", "sideslip angle"), (".sigma", "bank angle")];
/// Components of Θ by number.
pub const NUMBERED_ANGLES: [Entry; 3] =
    [("[1]", "angle of attack"), ("[2]", "sideslip angle"), ("[3]", "bank angle")];
/// Components of ω by name.
pub const RATES: [Entry; 3] = [(".p", "roll rate"), (".q", "pitch rate"), (".r", "yaw rate")];
/// Components of ω by number.
pub const NUMBERED_RATES: [Entry; 3] =
    [("[1]", "roll rate"), ("[2]", "pitch rate"), ("[3]", "yaw rate")];
/// Level axes by name.
pub const LEVEL: [Entry; 3] =
    [(".north", "to the north"), (".east", "to the east"), (".down", "downward")];
/// Horizontal axes by name.
pub const HORIZONTAL: [Entry; 2] = [(".north", "to the north"), (".east", "to the east")];
/// Angles of the flow past the vehicle by name.
pub const FLOW: [Entry; 2] = [(".alpha", "angle of attack"), (".beta", "sideslip angle")];
/// Parts of a quaternion by name.
pub const QUATERNION: [Entry; 4] = [(".w", "w"), (".x", "x"), (".y", "y"), (".z", "z")];
/// Body axes by number.
pub const NUMBERED_AXES: [Entry; 3] =
    [("[1]", "roll axis"), ("[2]", "pitch axis"), ("[3]", "yaw axis")];
/// Body axes by name.
pub const AXES: [Entry; 3] = [(".x", "roll axis"), (".y", "pitch axis"), (".z", "yaw axis")];
/// Components of a moment by name.
pub const MOMENTS: [Entry; 3] =
    [(".x", "roll moment"), (".y", "pitch moment"), (".z", "yaw moment")];
/// Axes that have no name but their letter.
pub const LETTERS: [Entry; 3] = [(".x", "x"), (".y", "y"), (".z", "z")];
/// Components of (Θ, Θ̇) by number.
pub const NUMBERED_STATE: [Entry; 6] = [
    ("[1]", "angle of attack"),
    ("[2]", "sideslip angle"),
    ("[3]", "bank angle"),
    ("[4]", "derivative of the angle of attack"),
    ("[5]", "derivative of the sideslip angle"),
    ("[6]", "derivative of the bank angle"),
];

/// Which of α, β and σ repeat after a whole turn.
pub const REPEATS: [bool; 3] = [true, false, true];

/// Returns the number of whole turns that brings `angle` nearest to `to` (rad).
pub fn turns(angle: f64, to: f64) -> f64 {
    let turns = ((to - angle) / TAU).round();
    if turns.is_finite() { turns } else { 0.0 }
}

/// Returns the angle after whole turns, rad. Without turns it keeps its bits.
pub fn turned(angle: f64, turns: f64) -> f64 {
    if turns == 0.0 { angle } else { angle + turns * TAU }
}

/// Returns `angle` as the turn nearest to `to` (rad): itself if it is within half a turn.
pub fn nearest(angle: f64, to: f64) -> f64 {
    turned(angle, turns(angle, to))
}
