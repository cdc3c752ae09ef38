//! Closed loops of the FMUs in one WebAssembly module, for the page "Try it in the browser".
//!
//! The module has the models that the FMUs have, behind the same variable tables and the same
//! checks, and flies the experiments that the orchestrator runs. Its interface is numbers and JSON
//! in linear memory:
//!
//! | function | does |
//! |---|---|
//! | `reserve(n)` | makes room for a request of n bytes, and returns its address |
//! | `describe()` | answers with controllers, parameters and scenario ([`description`]) |
//! | `fly()` | flies the request; answers with the summary, and keeps the signals |
//! | `experiment()` | answers with the request as an experiment file (TOML) |
//! | `answer()`, `answer_length()` | address and length of the last answer, UTF-8 |
//! | `signals()`, `signals_length()` | address and number of the signals, as f64 |
//! | `plans()`, `plans_length()` | address and number of the plans' values ([`signals::plan`]), as f64 |
//!
//! It imports one function, `law` of the module `page`: the control law that the page computes
//! ([`own_law`]). A request is
//! `{"controller": "crmpc", "set": {"plant.disturbance.bound": "2 deg/s2"}}`, with values as in
//! experiment files. `describe`, `fly` and `experiment` return 1 if they succeeded.
//! Otherwise they return 0, and the answer says why. Addresses are valid until the next call of a
//! function other than these getters.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod closed_loop;
pub mod description;
pub mod error;
pub mod flight;
pub mod fmu;
pub mod own_law;
pub mod request;
pub mod scenario;
pub mod signals;
pub mod summary;
#[cfg(test)]
mod tests;

use error::Error;
use request::Request;
use std::cell::RefCell;

/// The memory that module and page share.
#[derive(Debug, Default)]
struct Shared {
    request: Vec<u8>,
    answer: String,
    signals: Vec<f64>,
    plans: Vec<f64>,
}

thread_local! {
    static SHARED: RefCell<Shared> = RefCell::default();
}

/// Stores the answer of `compute`, or why there is none.
fn respond(compute: impl FnOnce(&mut Shared) -> Result<String, Error>) -> i32 {
    SHARED.with_borrow_mut(|shared| {
        let outcome = compute(shared);
        let is_right = outcome.is_ok();
        shared.answer = outcome.unwrap_or_else(|error| error.to_string());
        i32::from(is_right)
    })
}

fn described(_: &mut Shared) -> Result<String, Error> {
    Ok(serde_json::to_string(&description::describe()?)?)
}

fn flown(shared: &mut Shared) -> Result<String, Error> {
    shared.signals.clear();
    shared.plans.clear();
    let (_, closed_loop) = Request::read(&shared.request)?.prepare()?;
    Ok(serde_json::to_string(&flight::fly(closed_loop, &mut shared.signals, &mut shared.plans)?)?)
}

fn written(shared: &mut Shared) -> Result<String, Error> {
    let (experiment, _) = Request::read(&shared.request)?.prepare()?;
    let text = toml::to_string(&experiment);
    text.map_err(|error| scenario::problem("the experiment", &error.to_string()))
}

/// The exported functions. They hand out addresses of memory that this module owns and read none
/// that they are given, so nothing else here is unsafe.
#[allow(unsafe_code, reason = "a name that is exported as it is counts as unsafe")]
mod exported {
    use super::{SHARED, Shared, described, flown, respond, written};

    fn look<T>(look: impl FnOnce(&Shared) -> T) -> T {
        SHARED.with_borrow(look)
    }

    #[unsafe(no_mangle)]
    extern "C" fn reserve(length: usize) -> *mut u8 {
        SHARED.with_borrow_mut(|shared| {
            shared.request.clear();
            shared.request.resize(length, 0);
            shared.request.as_mut_ptr()
        })
    }

    #[unsafe(no_mangle)]
    extern "C" fn describe() -> i32 {
        respond(described)
    }

    #[unsafe(no_mangle)]
    extern "C" fn fly() -> i32 {
        respond(flown)
    }

    #[unsafe(no_mangle)]
    extern "C" fn experiment() -> i32 {
        respond(written)
    }

    #[unsafe(no_mangle)]
    extern "C" fn answer() -> *const u8 {
        look(|shared| shared.answer.as_ptr())
    }

    #[unsafe(no_mangle)]
    extern "C" fn answer_length() -> usize {
        look(|shared| shared.answer.len())
    }

    #[unsafe(no_mangle)]
    extern "C" fn signals() -> *const f64 {
        look(|shared| shared.signals.as_ptr())
    }

    #[unsafe(no_mangle)]
    extern "C" fn signals_length() -> usize {
        look(|shared| shared.signals.len())
    }

    #[unsafe(no_mangle)]
    extern "C" fn plans() -> *const f64 {
        look(|shared| shared.plans.as_ptr())
    }

    #[unsafe(no_mangle)]
    extern "C" fn plans_length() -> usize {
        look(|shared| shared.plans.len())
    }
}
