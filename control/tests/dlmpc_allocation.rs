//! No tick of DLMPC allocates memory, apart from the inside of the cone solver.
#![allow(unsafe_code)]

use crate::prelude::*;
use control::dlmpc::{Memory, Settings};
use std::alloc::{GlobalAlloc, Layout, System};

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

/// The system's allocator with a count per thread.
struct Counting;

// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        // SAFETY: the caller's promise is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise is passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn ticks_without_the_cone_solver_allocate_nothing() {
    let scenario = Scenario::crmpc2022();
    let mut truth: Vec<Measurement> = Vec::new();
    let mut controller = Dlmpc::new(Settings::published()).unwrap();
    let noise = disturbance(DisturbanceKind::White);
    let mut memory = Memory::default();
    simulate(&mut controller, &mut memory, 1.05, noise, |_, _, &now| truth.push(now));

    let reference = |time: f64| scenario.reference.at(time);
    let mut memory = controller.memory();
    let mut before = controller.memory();
    // The setup shows that the counter works.
    assert!(COUNT.get() > 0);
    let (mut unconstrained, mut constrained) = (0, 0);
    for (tick, measured) in (0..).zip(&truth) {
        let counted = COUNT.get();
        before.clone_from(&memory);
        let time = tick as f64 * FEEDBACK;
        controller.update(&mut memory, tick, time, measured, &reference);
        assert_eq!(COUNT.get() - counted, 0, "tick {tick}");
        if tick % controller.ratio() == 0 {
            unconstrained += usize::from(memory.report.status == SolverStatus::Unconstrained);
            constrained += usize::from(memory.report.status == SolverStatus::Constrained);
        }
    }
    assert!(unconstrained > 50 && constrained > 50, "{unconstrained} {constrained}");
}
