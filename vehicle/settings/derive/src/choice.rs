//! The derive macro `Choice`.

use crate::attribute::Keys;
use crate::sentence::meaning;
use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Fields, Result};

pub(crate) fn expand(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Enum(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "Choice is for enumerations"));
    };
    let ident = &input.ident;
    let mut items = Vec::new();
    for variant in &data.variants {
        if !matches!(variant.fields, Fields::Unit) {
            return Err(Error::new_spanned(variant, "a choice has no fields"));
        }
        let keys = Keys::new(&variant.attrs)?;
        let (name, text) = keys.name_and_text(&variant.ident.to_string(), &variant.attrs);
        let (variant, text) = (&variant.ident, meaning(&text));
        items.push(quote!((Self::#variant, #name, #text)));
    }
    let keys = Keys::new(&input.attrs)?;
    let (_, text) = keys.name_and_text(&ident.to_string(), &input.attrs);
    let name = keys.name.unwrap_or_else(|| ident.to_string());
    Ok(quote! {
        #[automatically_derived]
        impl ::settings::Choice for #ident {
            const NAME: &'static str = #name;
            const TEXT: &'static str = #text;
            const ITEMS: &'static [(Self, &'static str, &'static str)] = &[#(#items),*];
        }

        // SAFETY: The only field is the value itself.
        #[automatically_derived]
        #[allow(unsafe_code)]
        unsafe impl ::settings::Declared for #ident {
            fn declare(
                place: &::settings::Place,
                list: &mut ::std::vec::Vec<::settings::Setting>,
            ) {
                list.push(<Self as ::settings::Choice>::setting(place));
            }
        }
    })
}
