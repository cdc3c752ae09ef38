//! The attribute `#[setting(…)]`.

use crate::sentence::{camel, sentence};
use proc_macro2::TokenStream;
use quote::quote;
use syn::{Attribute, Expr, LitStr, Result};

/// Keys of the attribute on a field, on an enumeration or on a variant.
#[derive(Default)]
pub(crate) struct Keys {
    /// The field is no setting.
    pub(crate) skip: bool,
    /// The sentence of the field continues that of the field that holds its structure.
    part: bool,
    /// The unit is that of the time derivative of the field that holds the structure.
    rate: bool,
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
    each: Option<Expr>,
}

impl Keys {
    pub(crate) fn new(attributes: &[Attribute]) -> Result<Self> {
        let mut keys = Self::default();
        for attribute in attributes.iter().filter(|attribute| attribute.path().is_ident("setting"))
        {
            attribute.parse_nested_meta(|meta| {
                let key = meta.path.get_ident().map(ToString::to_string).unwrap_or_default();
                match key.as_str() {
                    "skip" => keys.skip = true,
                    "part" => keys.part = true,
                    "rate" => keys.rate = true,
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
                    "each" => keys.each = Some(meta.value()?.parse()?),
                    _ => return Err(meta.error("no key of #[setting(…)]")),
                }
                Ok(())
            })?;
        }
        Ok(keys)
    }

    /// Returns name and sentence of what the attributes belong to.
    pub(crate) fn name_and_text(&self, ident: &str, attributes: &[Attribute]) -> (String, String) {
        let name = self.name.clone().unwrap_or_else(|| camel(ident));
        (name, self.text.clone().unwrap_or_else(|| sentence(attributes)))
    }

    /// Returns an expression for the `settings::About` of a field.
    pub(crate) fn about(&self, ident: &str, attributes: &[Attribute]) -> TokenStream {
        let (name, text) = self.name_and_text(ident, attributes);
        let number = |value: &Option<Expr>| {
            let none = quote!(::core::option::Option::None);
            let some = |value| quote!(::core::option::Option::Some((#value) as f64));
            value.as_ref().map_or(none, some)
        };
        let [min, max, above, below, nominal, start] =
            [&self.min, &self.max, &self.above, &self.below, &self.nominal, &self.start]
                .map(number);
        let [unit, used_with] = [&self.unit, &self.used_with]
            .map(|text| text.as_ref().map(LitStr::value).unwrap_or_default());
        let (part, rate) = (self.part, self.rate);
        let each = self.each.as_ref().map_or(quote!([]), |each| quote!(#each));
        quote! {
            ::settings::About {
                name: #name,
                text: #text,
                unit: #unit,
                each: &#each,
                is_part: #part,
                is_rate: #rate,
                min: #min,
                max: #max,
                above: #above,
                below: #below,
                nominal: #nominal,
                start: #start,
                used_with: #used_with,
            }
        }
    }
}
