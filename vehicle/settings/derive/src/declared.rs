//! The derive macro `Declared`.

use crate::attribute::Keys;
use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Result, parse_quote};

pub(crate) fn expand(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Struct(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "Declared is for structures"));
    };
    let mut generics = input.generics.clone();
    for parameter in input.generics.type_params() {
        let ident = &parameter.ident;
        generics.make_where_clause().predicates.push(parse_quote!(#ident: ::settings::Declared));
    }
    let (mut declarations, mut fields) = (Vec::new(), Vec::new());
    for field in &data.fields {
        let Some(ident) = &field.ident else {
            return Err(Error::new_spanned(field, "the fields of settings have names"));
        };
        let keys = Keys::new(&field.attrs)?;
        if keys.skip {
            continue;
        }
        let about = keys.about(&ident.to_string(), &field.attrs);
        let kind = &field.ty;
        declarations.push(quote! {
            <#kind as ::settings::Declared>::declare(&place.at(&#about), list);
        });
        fields.push(quote! {
            let index = match ::settings::Declared::field(&mut self.#ident, index) {
                ::core::result::Result::Ok(field) => {
                    return ::core::result::Result::Ok(field);
                }
                ::core::result::Result::Err(rest) => rest,
            };
        });
    }
    let name = &input.ident;
    let (parameters, arguments, conditions) = generics.split_for_impl();
    Ok(quote! {
        #[automatically_derived]
        impl #parameters ::settings::Declared for #name #arguments #conditions {
            fn declare(
                place: &::settings::Place,
                list: &mut ::std::vec::Vec<::settings::Setting>,
            ) {
                #(#declarations)*
            }

            fn field(
                &mut self,
                index: usize,
            ) -> ::core::result::Result<::settings::Field<'_>, usize> {
                #(#fields)*
                ::core::result::Result::Err(index)
            }
        }
    })
}
