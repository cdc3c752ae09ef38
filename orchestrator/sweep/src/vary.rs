//! The parameters that vary from case to case.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::{Spanned, Value};

/// A parameter that varies from case to case, or several, with the distribution of the values.
/// Exactly one of the keys from `uniform` to `case` is given. A number may be a text with a unit
/// (`"5 deg"`), or with a percent sign, which denotes percent of the value in the experiment.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Parameter, or input without a connection, as `component.parameter`. Several in a list all
    /// get the same value.
    #[schemars(with = "Option<OneOrMore>")]
    pub parameter: Option<Spanned<OneOrMore>>,
    /// Parameters that each get a value of their own from the same distribution.
    #[serde(default)]
    #[schemars(with = "Vec<String>")]
    pub each: Vec<Spanned<String>>,
    /// Whether the values of `each` are sorted in ascending order, as switching times must be.
    #[serde(default)]
    pub sorted: bool,
    /// Smallest and largest value of a uniform distribution.
    #[schemars(with = "Option<[cosim::experiment::Scalar; 2]>")]
    pub uniform: Option<[Value; 2]>,
    /// Mean and standard deviation of a normal distribution.
    pub normal: Option<Normal>,
    /// Values that are equally likely, unless `weights` are given: numbers, texts, items of an
    /// enumeration or truth values.
    #[schemars(with = "Option<Vec<cosim::experiment::Scalar>>")]
    pub list: Option<Vec<Value>>,
    /// First of consecutive integers: the parameter is this number plus that of the case, as for
    /// seeds. With another `seed` of the file than 1 they begin elsewhere.
    pub case: Option<i64>,
    /// Probabilities of the values of `list`, which are scaled to a sum of 1.
    pub weights: Option<Vec<f64>>,
}

/// The one distribution that a [`Vary`] asks for.
pub(crate) enum Asked<'a> {
    Uniform(&'a [Value; 2]),
    Normal(&'a Normal),
    List { values: &'a [Value], weights: Option<&'a [f64]> },
    Case(i64),
}

impl Vary {
    /// Returns the variation of parameters that are all 1 in the first case, 2 in the next one, and
    /// so on; `None` if there are no parameters.
    pub fn counted(parameters: &[Spanned<String>]) -> Option<Self> {
        let first = parameters.first()?;
        let names = parameters.iter().map(|name| name.get_ref().clone()).collect();
        let parameter = Some(Spanned::new(first.span(), OneOrMore::More(names)));
        Some(Self { parameter, case: Some(1), ..Self::default() })
    }

    /// Returns the names of all parameters.
    pub fn names(&self) -> impl Iterator<Item = &String> {
        let shared = self.parameter.iter().flat_map(|names| names.get_ref().names());
        self.each.iter().map(Spanned::get_ref).chain(shared)
    }

    /// Returns the distribution that the keys ask for.
    ///
    /// # Errors
    /// Returns an error if there is not exactly one, or if it is no list but has weights.
    pub(crate) fn asked(&self) -> Result<Asked<'_>, String> {
        let list = |values| Asked::List { values, weights: self.weights.as_deref() };
        let keys = [
            ("uniform", self.uniform.as_ref().map(Asked::Uniform)),
            ("normal", self.normal.as_ref().map(Asked::Normal)),
            ("list", self.list.as_deref().map(list)),
            ("case", self.case.map(Asked::Case)),
        ];
        let names = keys.each_ref().map(|(name, _)| *name).join(", ");
        let given = keys.into_iter().filter_map(|(name, asked)| Some((name, asked?)));
        let (given, mut asked): (Vec<&str>, Vec<Asked>) = given.unzip();
        match asked.pop() {
            Some(asked) if given.len() == 1 => match asked {
                Asked::List { .. } => Ok(asked),
                _ if self.weights.is_some() => Err("weights are for a list only".into()),
                _ => Ok(asked),
            },
            none => {
                let said = none.map_or("none".into(), |_| given.join(" and "));
                Err(format!("one distribution is needed ({names}), but there is {said}"))
            }
        }
    }
}

/// A single name, or a list of names.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, JsonSchema, Serialize)]
#[serde(untagged)]
pub enum OneOrMore {
    /// A single name.
    One(String),
    /// Several names.
    More(Vec<String>),
}

impl OneOrMore {
    /// Returns the names.
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::More(names) => names,
        }
    }
}

/// A normal distribution.
#[derive(Clone, Debug, Deserialize, JsonSchema, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    /// Mean of the distribution.
    #[schemars(with = "cosim::experiment::Scalar")]
    pub mean: Value,
    /// Standard deviation of the distribution.
    #[schemars(with = "cosim::experiment::Scalar")]
    pub deviation: Value,
    /// Lower and upper bound at which the distribution is truncated.
    #[schemars(with = "Option<[cosim::experiment::Scalar; 2]>")]
    pub within: Option<[Value; 2]>,
}

/// Design that places the cases in the space of the varied parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize, JsonSchema, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DesignKind {
    /// Each case is drawn independently of all others.
    #[default]
    Random,
    /// All combinations of the values of the varied parameters.
    Levels,
    /// The corners of the parameter space, and random cases. If there are more corners than cases,
    /// every other case is a corner that is chosen at random.
    Corners,
}

/// Everything that differs between the cases of a sweep, as a file describes it.
#[derive(Clone, Debug)]
pub struct Variation<'a> {
    /// Parameters that vary.
    pub vary: &'a [Vary],
    /// Design that places the cases.
    pub design: DesignKind,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Number of cases, which the design `levels` may leave out.
    pub cases: Option<u64>,
    /// Parameters that the file sets to one value in all cases.
    pub set: Vec<&'a str>,
}
