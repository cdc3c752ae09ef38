//! The errors of a model's crate name fields; this module replaces them by the variables that the
//! user of an FMU sees.

/// Pairs of the path of a field and the name of its variable, or of a group of them. A pair also
/// stands for what lies below the field. `[]` in both stands for any index, which a field counts
/// from 0 and a variable from 1. Fields without a pair have the names of their variables.
pub type Fields = [(&'static str, &'static str)];

/// Returns the message of an error in which fields stand in backticks, with the names of their
/// variables instead.
///
/// ```
/// use fmi2_export::fields::by_variable;
///
/// let fields =
///     [("period", "period.feedback"), ("gates[0]", "gyroscope"), ("rows[].time", "time[]")];
/// let error = "`gates[0].range` = 0, `period` = 0 and `rows[1].time` = 0 must be positive";
/// assert_eq!(
///     by_variable(&error, &fields),
///     "gyroscope.range = 0, period.feedback = 0 and time[2] = 0 must be positive"
/// );
/// ```
pub fn by_variable(error: &impl ToString, fields: &Fields) -> String {
    let name = |field: &str| {
        let below = |(path, variable): &(&str, &str)| {
            let (variable, rest) = match path.split_once("[]") {
                None => ((*variable).to_owned(), field.strip_prefix(path)?),
                Some((array, part)) => {
                    let (index, rest) =
                        field.strip_prefix(array)?.strip_prefix('[')?.split_once(']')?;
                    let number = index.parse::<usize>().ok()?.checked_add(1)?;
                    (variable.replace("[]", &format!("[{number}]")), rest.strip_prefix(part)?)
                }
            };
            (rest.is_empty() || rest.starts_with('.')).then(|| format!("{variable}{rest}"))
        };
        // The longest path comes closest to the field.
        let names = fields.iter().filter_map(|pair| Some((pair.0.len(), below(pair)?)));
        names.max().map_or_else(|| field.to_owned(), |(_, name)| name)
    };
    let error = error.to_string();
    let parts = error.split('`').enumerate();
    parts.map(|(i, part)| if i % 2 == 1 { name(part) } else { part.to_owned() }).collect()
}
