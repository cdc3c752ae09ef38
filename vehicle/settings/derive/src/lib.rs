//! Derive macros `Declared` and `Choice` of the crate `settings`, which explains them.

mod attribute;
mod choice;
mod declared;
mod sentence;

use proc_macro::TokenStream;
use syn::{DeriveInput, parse_macro_input};

/// Declares the fields of a structure as settings: see the trait `settings::Declared`.
#[proc_macro_derive(Declared, attributes(setting))]
pub fn declared(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    declared::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}

/// Declares the variants of an enumeration as the values of a setting: see the trait
/// `settings::Choice`.
#[proc_macro_derive(Choice, attributes(setting))]
pub fn choice(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    choice::expand(&input).unwrap_or_else(|error| error.to_compile_error()).into()
}
