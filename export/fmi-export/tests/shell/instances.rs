//! Tests of instantiation, of several instances and FMUs side by side, and of panics.

use crate::support::*;
use std::ffi::{CStr, c_char, c_void};
use std::ptr::{null, null_mut};
use std::sync::Mutex;
use std::sync::atomic::{AtomicPtr, Ordering};

#[test]
fn a_reset_keeps_the_model_unless_it_has_failed() {
    const COUNT: u32 = 2;
    const RESETS: u32 = 4;
    let counter = Instance::new("Counter", CO_SIMULATION);
    for resets in 1..4 {
        counter.initialize();
        assert_eq!(counter.step(0.0, 0.1), FmiStatus::Ok);
        assert_eq!(c!(fmi2Reset(counter.component)), FmiStatus::Ok);
        counter.enter_initialization();
        assert_eq!((counter.integer(RESETS), counter.real(COUNT)), (2 * resets - 1, 0.0));
        assert_eq!(c!(fmi2Reset(counter.component)), FmiStatus::Ok);
    }
    // A refused value puts it into the error state.
    assert_eq!(counter.set_real(COUNT, 1.0), FmiStatus::Error);
    assert_eq!(c!(fmi2Reset(counter.component)), FmiStatus::Ok);
    counter.enter_initialization();
    assert_eq!(counter.integer(RESETS), 0);
}

#[test]
fn a_panic_is_fatal_for_the_instance_only() {
    const DEFECT: u32 = 0;
    const COUNT: u32 = 2;
    type Provoke = fn(&Instance) -> FmiStatus;
    let bystander = Instance::stepping();
    let places: [(&CStr, Provoke); 3] = [
        (c"initialize", |instance| c!(fmi2ExitInitializationMode(instance.component))),
        (c"calculate", |instance| instance.get_real(COUNT).0),
        (c"step", |instance| {
            assert_eq!(c!(fmi2ExitInitializationMode(instance.component)), FmiStatus::Ok);
            instance.step(0.0, 0.1)
        }),
    ];
    for (place, provoke) in places {
        let instance = Instance::new("Counter", CO_SIMULATION);
        assert_eq!(instance.set_string(DEFECT, place), FmiStatus::Ok);
        instance.enter_initialization();
        assert_eq!(provoke(&instance), FmiStatus::Fatal);
        instance.said(&["defect in the FMU: defect in", place.to_str().unwrap()]);
        assert_eq!(instance.messages().last().unwrap().status, FmiStatus::Fatal);
        // From now on every call returns the same status until the instance is freed.
        assert_eq!(c!(fmi2Reset(instance.component)), FmiStatus::Fatal);
        assert_eq!(instance.get_real(COUNT).0, FmiStatus::Fatal);
        assert_eq!(instance.step(0.0, 0.1), FmiStatus::Fatal);
    }
    assert_eq!(bystander.step(0.0, 0.1), FmiStatus::Ok);
}

/// State of a logger that calls its instance back, with the answers that it got.
#[derive(Default)]
struct Caller {
    component: AtomicPtr<c_void>,
    answers: Mutex<Vec<FmiStatus>>,
    /// Answers to another thread that calls at the same time.
    other: Mutex<Option<Vec<FmiStatus>>>,
}

fn call_all(component: *mut c_void) -> Vec<FmiStatus> {
    let mut value = 0.0;
    let mut state = null_mut();
    vec![
        c!(fmi2GetReal(component, &Y, 1, &mut value)),
        c!(fmi2DoStep(component, 0.0, 1.0, 1)),
        c!(fmi2GetFMUstate(component, &mut state)),
        c!(fmi2Reset(component)),
    ]
}

#[allow(unsafe_code)]
extern "C-unwind" fn calls_back(
    environment: *mut c_void,
    _: *const c_char,
    _: FmiStatus,
    _: *const c_char,
    _: *const c_char,
) {
    // SAFETY: the environment is the address of a `Caller` that the test keeps alive, and whose
    // fields change only by atomic operations or behind locks.
    let caller = unsafe { &*environment.cast::<Caller>() };
    let component = caller.component.load(Ordering::SeqCst);
    caller.answers.lock().unwrap().extend(call_all(component));
    c!(fmi2FreeInstance(component));
    let address = component as usize;
    let other = std::thread::spawn(move || call_all(address as *mut c_void));
    *caller.other.lock().unwrap() = Some(other.join().unwrap());
}

#[test]
fn calls_during_a_call_are_refused_whoever_makes_them() {
    let caller = Caller::default();
    let callbacks = callbacks(calls_back, &raw const caller);
    let guid = guid("Lag");
    let component =
        c!(fmi2Instantiate(c"it".as_ptr(), CO_SIMULATION, guid.as_ptr(), null(), &callbacks, 0, 0));
    caller.component.store(component, Ordering::SeqCst);
    assert_eq!(c!(fmi2SetupExperiment(component, 0, 0.0, 0.0, 0, 0.0)), FmiStatus::Ok);
    assert_eq!(c!(fmi2EnterInitializationMode(component)), FmiStatus::Ok);
    assert_eq!(c!(fmi2ExitInitializationMode(component)), FmiStatus::Ok);
    assert!(caller.answers.lock().unwrap().is_empty(), "nothing was said yet");
    // The error is logged, and every call that the logger and the other thread try meanwhile is
    // refused.
    assert_eq!(c!(fmi2SetReal(component, &X, 1, &1.0)), FmiStatus::Error);
    assert_eq!(*caller.answers.lock().unwrap(), [FmiStatus::Error; 4]);
    assert_eq!(*caller.other.lock().unwrap(), Some(vec![FmiStatus::Error; 4]));
    // The instance is unchanged and free again.
    let mut value = f64::NAN;
    assert_eq!(c!(fmi2GetReal(component, &U, 1, &mut value)), FmiStatus::Ok);
    assert_eq!(c!(fmi2Reset(component)), FmiStatus::Ok);
    c!(fmi2FreeInstance(component));
}
