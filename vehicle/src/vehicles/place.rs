//! The place in a file to which an error belongs.

/// Returns the line of an error, counted from 1, and the error with its table and key in front. The
/// message may begin with the key at fault, which is then looked for behind the offset.
pub(super) fn located(text: &str, offset: Option<usize>, message: &str) -> (Option<usize>, String) {
    let message = message.trim();
    let named: &str = message.split([' ', ':', ',']).next().unwrap_or_default();
    let lines: Vec<&str> = text.lines().collect();
    let line_of =
        |offset: usize| text.get(..offset).map_or(0, |before| before.matches('\n').count());
    let (group, key) = named.rsplit_once('.').unwrap_or(("", named));
    let begin = offset
        .map(line_of)
        .or_else(|| lines.iter().position(|line| !group.is_empty() && header(line) == Some(group)));
    let Some(begin) = begin else { return (None, message.into()) };
    let is_key = |line: &str| {
        let rest = line.trim_start().strip_prefix(key).map(str::trim_start);
        !key.is_empty() && rest.is_some_and(|rest| rest.starts_with('='))
    };
    // The key lies in the table that begins there.
    let length = lines.iter().skip(begin + 1).take_while(|line| header(line).is_none()).count();
    let found = (begin..=begin + length).find(|&i| lines.get(i).is_some_and(|line| is_key(line)));
    let line = found.unwrap_or(begin);
    if !group.is_empty() {
        return (Some(line + 1), message.into());
    }
    let table = lines.iter().take(line + 1).rev().find_map(|line| header(line)).unwrap_or_default();
    let dot = if table.is_empty() { "" } else { "." };
    if found.is_some() {
        return (Some(line + 1), format!("{table}{dot}{message}"));
    }
    let written = lines.get(line).filter(|line| header(line).is_none());
    let place = match written.and_then(|line| line.split_once('=')) {
        Some((key, _)) => format!("{table}{dot}{}: ", key.trim()),
        None if table.is_empty() => String::new(),
        None => format!("{table}: "),
    };
    (Some(line + 1), place + message)
}

/// Returns the name of the table whose header a line is. Rows of a list begin with a bracket, too.
fn header(line: &str) -> Option<&str> {
    let name =
        line.trim_start().strip_prefix('[')?.trim_start_matches('[').split(']').next()?.trim();
    let is_name = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '-');
    (name.starts_with(char::is_alphabetic) && name.chars().all(is_name)).then_some(name)
}
