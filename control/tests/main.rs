//! Tests of the crate, in one program.

mod allocation;
mod arrival;
mod closed_loop;
#[path = "../../export/fmi-export/tests/counting/mod.rs"]
mod counting;
mod delay;
mod delay_estimate;
mod design;
mod dlmpc;
mod dlmpc_allocation;
mod estimation;
mod faults;
mod feasible_starts;
mod forecast;
mod guarantee;
mod guidance;
mod hard_optimisations;
mod harness;
mod known_moment;
mod known_turn;
mod lost_measurement;
mod navigation;
mod optimisation;
mod platform_functions;
mod prelude;
mod scheduled_limits;
mod shown_plan;
mod sliding;
mod sliding_theory;
mod sliding_two_loop;
mod slow_errors;
mod solvers;
