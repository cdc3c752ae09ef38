//! The attribute `#[setting(…)]`.

use crate::sentence::{camel, sentence};
use proc_macro2::{Group, Ident, TokenStream};
use quote::{ToTokens, format_ident, quote};
use syn::parse::ParseStream;
use syn::{Attribute, Expr, LitStr, Result, token};

/// Keys of the attribute on a field, on an enumeration or on a variant.
#[derive(Default)]
pub(crate) struct Keys {
    /// Keys without a value.
    flags: Vec<String>,
    pub(crate) name: Option<String>,
    text: Option<String>,
    used_with: Option<LitStr>,
    unit: Option<LitStr>,
    min: Option<Expr>,
    max: Option<Expr>,
    above: Option<Expr>,
    below: Option<Expr>,
    nominal: Option<Expr>,
    start: Option<Expr>,
    each: Option<TokenStream>,
    columns: Option<TokenStream>,
    units: Option<TokenStream>,
    nominals: Option<TokenStream>,
    /// Variant of `settings::Role`.
    role: Option<Ident>,
    derivative: Option<LitStr>,
    depends_on: Option<TokenStream>,
}

/// Parses a list: a constant, or an array in brackets.
fn list(value: ParseStream) -> Result<TokenStream> {
    if value.peek(token::Bracket) {
        return value.parse::<Group>().map(Group::into_token_stream);
    }
    value.parse::<Expr>().map(Expr::into_token_stream)
}

impl Keys {
    pub(crate) fn new(attributes: &[Attribute]) -> Result<Self> {
        let mut keys = Self::default();
        for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("setting"))
        {
            attribute.parse_nested_meta(|meta| {
                let key = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
                match key.as_str() {
                    "skip" | "part" | "rate" | "by_column" | "discrete" | "optional" => {
                        keys.flags.push(key);
                    }
                    "name" => keys.name = Some(meta.value()?.parse::<LitStr>()?.value()),
                    "text" => keys.text = Some(meta.value()?.parse::<LitStr>()?.value()),
                    "used_with" => keys.used_with = Some(meta.value()?.parse()?),
                    "unit" => keys.unit = Some(meta.value()?.parse()?),
                    "min" => keys.min = Some(meta.value()?.parse()?),
                    "max" => keys.max = Some(meta.value()?.parse()?),
                    "above" => keys.above = Some(meta.value()?.parse()?),
                    "below" => keys.below = Some(meta.value()?.parse()?),
                    "nominal" => keys.nominal = Some(meta.value()?.parse()?),
                    "start" => keys.start = Some(meta.value()?.parse()?),
                    "each" => keys.each = Some(list(meta.value()?)?),
                    "columns" => keys.columns = Some(list(meta.value()?)?),
                    "units" => keys.units = Some(list(meta.value()?)?),
                    "nominals" => keys.nominals = Some(list(meta.value()?)?),
                    "input" => keys.role = Some(format_ident!("Input")),
                    "output" => keys.role = Some(format_ident!("Output")),
                    "local" => keys.role = Some(format_ident!("Local")),
                    "file" => keys.role = Some(format_ident!("File")),
                    "derivative" => keys.derivative = Some(meta.value()?.parse()?),
                    "depends_on" => keys.depends_on = Some(list(meta.value()?)?),
                    _ => return Err(meta.error("no key of #[setting(…)]")),
                }
                Ok(())
            })?;
        }
        Ok(keys)
    }

    /// Whether a key without a value is there.
    pub(crate) fn has(&self, flag: &str) -> bool {
        self.flags.iter().any(|key| key == flag)
    }

    /// Returns name and sentence of what the attributes belong to.
    pub(crate) fn name_and_text(&self, ident: &str, attributes: &[Attribute]) -> (String, String) {
        let name = self.name.clone().unwrap_or_else(|| camel(ident));
        (name, self.text.clone().unwrap_or_else(|| sentence(attributes)))
    }

    /// Returns an expression for the `settings::About` of a field.
    pub(crate) fn about(&self, ident: &str, attributes: &[Attribute]) -> TokenStream {
        let (name, text) = self.name_and_text(ident, attributes);
        let option = |value: Option<TokenStream>| {
            let none = quote!(::core::option::Option::None);
            value.map_or(none, |value| quote!(::core::option::Option::Some(#value)))
        };
        let number =
            |value: &Option<Expr>| option(value.as_ref().map(|value| quote!((#value) as f64)));
        let [min, max, above, below, nominal, start] =
            [&self.min, &self.max, &self.above, &self.below, &self.nominal, &self.start]
                .map(number);
        let [unit, used_with, derivative] = [&self.unit, &self.used_with, &self.derivative]
            .map(|text| text.as_ref().map(LitStr::value).unwrap_or_default());
        let [each, columns, units, nominals] =
            [&self.each, &self.columns, &self.units, &self.nominals]
                .map(|list| list.clone().unwrap_or(quote!([])));
        let depends_on = option(self.depends_on.as_ref().map(|names| quote!(&#names)));
        let role = option(self.role.as_ref().map(|role| quote!(::settings::Role::#role)));
        let [part, rate, by_column, discrete, optional] =
            ["part", "rate", "by_column", "discrete", "optional"].map(|flag| self.has(flag));
        quote! {
            ::settings::About {
                name: #name,
                text: #text,
                unit: #unit,
                each: &#each,
                columns: &#columns,
                units: &#units,
                nominals: &#nominals,
                by_column: #by_column,
                is_part: #part,
                is_rate: #rate,
                min: #min,
                max: #max,
                above: #above,
                below: #below,
                nominal: #nominal,
                start: #start,
                used_with: #used_with,
                role: #role,
                is_discrete: #discrete,
                is_optional: #optional,
                derivative: #derivative,
                depends_on: #depends_on,
            }
        }
    }
}
