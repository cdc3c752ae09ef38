//! Mistyped names and the nearest right name, and patterns with a `*`.

/// Returns the name among `names` that is nearest to `wrong`: one that differs in a few letters, or
/// one whose prefix was left out.
pub fn nearest<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let tolerance = (wrong.chars().count() / 3).clamp(1, 4);
    let lower = wrong.to_lowercase();
    names
        .into_iter()
        .filter_map(|name| {
            let candidate = name.to_lowercase();
            let tail = !lower.is_empty() && candidate.ends_with(&format!(".{lower}"));
            let distance = if tail { 1 } else { strsim::damerau_levenshtein(&lower, &candidate) };
            (distance <= tolerance).then_some((distance, name))
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, name)| name)
}

/// Returns a hint for a message: `; did you mean "x"?` if one of `names` is near, and otherwise a
/// list of `names`.
pub fn hint<'a>(wrong: &str, names: impl IntoIterator<Item = &'a str> + Clone) -> String {
    const LISTED: usize = 12;
    if let Some(name) = nearest(wrong, names.clone()) {
        return format!("; did you mean \"{name}\"?");
    }
    let mut names: Vec<&str> = names.into_iter().collect();
    if names.len() > LISTED {
        // Those that begin as the wrong one does are most likely meant.
        let begins_alike =
            |name: &&str| name.bytes().zip(wrong.bytes()).take_while(|(a, b)| a == b).count();
        names.sort_by_key(|name| std::cmp::Reverse(begins_alike(name)));
    }
    match names.len() {
        0 => "; there are none".into(),
        n if n <= LISTED => format!("; there are: {}", names.join(", ")),
        n => format!("; there are {n}: {}, …", names[..LISTED].join(", ")),
    }
}

/// Returns whether `pattern` matches `name`: either they are the same, or the name begins and ends
/// as the pattern does before and after its `*`.
pub fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((first, last)) => name.strip_prefix(first).is_some_and(|rest| rest.ends_with(last)),
    }
}

/// Splits `component.variable` at the first dot.
pub fn split(path: &str) -> Option<(&str, &str)> {
    path.split_once('.')
        .filter(|(component, variable)| !component.is_empty() && !variable.is_empty())
}

/// Finds patterns that match exactly the `open` ones among the `inputs`: a group is named by its
/// prefix if all of its inputs are open.
pub fn patterns<'a>(open: &[&str], inputs: &(impl Iterator<Item = &'a str> + Clone)) -> String {
    let mut patterns: Vec<String> = Vec::new();
    for name in open {
        let group = name.rsplit_once('.').map(|(prefix, _)| format!("{prefix}.*"));
        let whole = |pattern: &String| {
            inputs.clone().filter(|name| matches(pattern, name)).all(|name| open.contains(&name))
        };
        let pattern = group.filter(whole).unwrap_or_else(|| (*name).to_string());
        if !patterns.contains(&pattern) {
            patterns.push(pattern);
        }
    }
    patterns.iter().map(|pattern| format!("\"{pattern}\"")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 4] =
        ["inertia.scale", "disturbance.kind", "disturbance.bound", "initial.p"];

    #[test]
    fn nearest_finds_swapped_missing_and_wrong_letters() {
        for wrong in ["inertia.scael", "inertia.scal", "Inertia.Scale", "intertia.scale", "scale"] {
            assert_eq!(nearest(wrong, NAMES), Some("inertia.scale"), "{wrong}");
        }
        assert_eq!(nearest("horizon", NAMES), None);
    }

    #[test]
    fn hint_lists_the_names_when_none_is_near() {
        assert_eq!(hint("x", ["alpha", "beta"]), "; there are: alpha, beta");
        assert_eq!(hint("x", []), "; there are none");
    }

    #[test]
    fn patterns_match_below_their_prefix_only() {
        assert!(matches("attitude.*", "attitude.alpha"));
        assert!(!matches("attitude.*", "attitudeRate.alpha"));
        assert!(!matches("attitude", "attitude.alpha"));
        assert!(matches("*", "anything"));
        assert!(matches("delay-*-lqr", "delay-040-lqr"));
        assert!(!matches("delay-*-lqr", "delay-040-lqr-predicted"));
        assert!(!matches("ab*bc", "abc"));
    }
}
