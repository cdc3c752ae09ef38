//! Logging, and the life cycle of an instance from its initialization to its end.

use super::component::{Component, run, run_always};
use crate::call::table;
use crate::instance::Instance;
use crate::model::Failure;
use crate::pointer::{slice, text};
use crate::types::FmiStatus;
use std::ffi::{c_char, c_int};

pub unsafe fn fmi2SetDebugLogging(
    component: Component,
    logging_on: c_int,
    n_categories: usize,
    categories: *const *const c_char,
) -> FmiStatus {
    let body = |instance: &mut Instance| {
        // SAFETY: the importer vouches for the array, as `slice` requires.
        let categories = unsafe { slice("categories", categories, n_categories) }?;
        // SAFETY: the standard demands NUL-terminated texts, and `text` refuses null.
        let names = categories
            .iter()
            .map(|&name| unsafe { text("categories", name) })
            .collect::<Result<Vec<_>, _>>();
        let names = names.map_err(Failure::Error)?;
        if let Some(unknown) = instance.logger().choose(logging_on != 0, &names) {
            instance.warn(&format!("there is no log category '{unknown}'"));
        }
        Ok(())
    };
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SET_DEBUG_LOGGING, body) }
}

pub unsafe fn fmi2SetupExperiment(
    component: Component,
    tolerance_defined: c_int,
    tolerance: f64,
    start_time: f64,
    stop_time_defined: c_int,
    stop_time: f64,
) -> FmiStatus {
    let tolerance = (tolerance_defined != 0).then_some(tolerance);
    let stop = (stop_time_defined != 0).then_some(stop_time);
    let body = |instance: &mut Instance| instance.setup_experiment(start_time, stop, tolerance);
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::SETUP_EXPERIMENT, body) }
}

pub unsafe fn fmi2EnterInitializationMode(component: Component) -> FmiStatus {
    let body = Instance::enter_initialization_mode;
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run_always(component, &table::ENTER_INITIALIZATION_MODE, body) }
}

pub unsafe fn fmi2ExitInitializationMode(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run(component, &table::EXIT_INITIALIZATION_MODE, Instance::exit_initialization_mode) }
}

pub unsafe fn fmi2Terminate(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run_always(component, &table::TERMINATE, Instance::terminate) }
}

pub unsafe fn fmi2Reset(component: Component) -> FmiStatus {
    // SAFETY: the importer vouches for `component`, as `run` requires.
    unsafe { run_always(component, &table::RESET, Instance::reset) }
}
