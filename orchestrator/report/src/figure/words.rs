//! Texts of a figure fitted to the room that they have. Their width is estimated from the number
//! of their letters, since a figure must not depend on fonts.

/// Characters after which a text is broken if a word alone is longer than a line.
const JOINTS: [char; 6] = ['/', '.', '_', '-', '(', ','];

/// Returns the number of letters of a text.
pub(super) fn letters(text: &str) -> usize {
    text.chars().count()
}

/// Breaks a text into at most `lines` lines of at most `room` letters. If it is longer, its middle
/// is left out, so that a unit at the end stays.
pub(super) fn wrapped(text: &str, room: usize, lines: usize) -> Vec<String> {
    (1..=letters(text))
        .rev()
        .map(|length| broken(&shortened(text, length), room))
        .find(|broken| broken.len() <= lines)
        .unwrap_or_default()
}

/// Returns a text of at most `room` letters, in which dots replace a part that is left out.
pub(super) fn shortened(text: &str, room: usize) -> String {
    let length = letters(text);
    if length <= room {
        return text.into();
    }
    let end = room.saturating_sub(1) / 2;
    let begin = room.saturating_sub(1) - end;
    let all = || text.chars();
    all().take(begin).chain(['…']).chain(all().skip(length - end)).collect()
}

/// Breaks a text between its words at plain spaces, and words that are longer than a line within
/// themselves.
fn broken(text: &str, room: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ').filter(|word| !word.is_empty()) {
        match lines.last_mut() {
            Some(line) if letters(line) + 1 + letters(word) <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.extend(pieces(word, room)),
        }
    }
    lines
}

/// Breaks a word into pieces of at most `room` letters, after joints as far as it has any.
fn pieces(word: &str, room: usize) -> Vec<String> {
    let mut rest: Vec<char> = word.chars().collect();
    let mut pieces = Vec::new();
    while rest.len() > room.max(1) {
        let joint = rest[..room.max(1)].iter().rposition(|letter| JOINTS.contains(letter));
        // A piece that is too short helps nobody.
        let end = joint.map(|joint| joint + 1).filter(|end| 2 * end > room);
        pieces.push(rest.drain(..end.unwrap_or(room.max(1))).collect());
    }
    pieces.push(rest.into_iter().collect());
    pieces
}
