//! The derive macro `Declared`.

use crate::attribute::Keys;
use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Member, Result, parse_quote};

pub(crate) fn expand(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Struct(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "Declared is for structures"));
    };
    let mut generics = input.generics.clone();
    let is_generic = generics.type_params().next().is_some();
    let mut declarations = Vec::new();
    for (index, field) in data.fields.iter().enumerate() {
        let keys = Keys::new(&field.attrs)?;
        if keys.has("skip") {
            continue;
        }
        // The only field of a tuple has no name.
        let name = field.ident.as_ref().map(ToString::to_string).unwrap_or_default();
        let about = keys.about(&name, &field.attrs);
        let member = field.ident.clone().map_or_else(|| Member::from(index), Member::from);
        let kind = &field.ty;
        if is_generic {
            let conditions = &mut generics.make_where_clause().predicates;
            conditions.push(parse_quote!(#kind: ::settings::Declared));
        }
        declarations.push(quote! {
            let offset = ::core::mem::offset_of!(Self, #member);
            <#kind as ::settings::Declared>::declare(&place.at(&#about, offset), list);
        });
    }
    let name = &input.ident;
    let (parameters, arguments, conditions) = generics.split_for_impl();
    Ok(quote! {
        // SAFETY: The offsets are those of the fields, each with the type that is declared there.
        #[automatically_derived]
        #[allow(unsafe_code)]
        unsafe impl #parameters ::settings::Declared for #name #arguments #conditions {
            fn declare(
                place: &::settings::Place,
                list: &mut ::std::vec::Vec<::settings::Setting>,
            ) {
                #(#declarations)*
            }
        }
    })
}
