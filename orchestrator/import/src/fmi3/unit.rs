//! An instance of FMI 3.0 for either interface.

#![allow(unsafe_code)]

use super::functions::{Functions, InterfaceFunctions, call};
use super::layout::Layout;
use super::values::Lists;
use crate::exchange::ContinuousModel;
use crate::fmi::Text;
use crate::folder::TemporaryFolder;
use crate::functions::{c_texts, text_of};
use crate::library::{FmuInstance, foreign};
use crate::log::Log;
use crate::logs::{self, Listed};
use fmi_master::description::{Place, ScalarType};
use fmi_master::instance::{CallFailure, Instance, Outcome};
use std::rc::Rc;

/// An instance of an FMU of FMI 3.0, in this process. It makes no steps itself.
pub(crate) struct Fmi3Unit {
    pub(super) calls: FmuInstance<Functions>,
    pub(super) layout: Rc<Layout>,
    lists: Lists,
}

impl Fmi3Unit {
    /// Makes an instance with the name in its log. The path of the `resources` ends in a separator.
    /// `folder` holds the unpacked archive, if it would vanish otherwise.
    pub(crate) fn new(
        functions: Functions,
        layout: Rc<Layout>,
        log: Rc<Log>,
        (token, resources): (&str, &str),
        folder: Option<Rc<TemporaryFolder>>,
    ) -> Result<Self, String> {
        let texts = c_texts([&log.component, token, resources])?;
        let [name, token, resources] = [0, 1, 2].map(|place| texts[place].as_ptr());
        let listed = Listed::new(&log);
        let environment = Rc::as_ptr(&log).cast_mut().cast();
        // SAFETY: FMI 3.0 gives the functions these types; the texts outlive the call, and the log
        // is kept alive as long as the instance.
        let handle = foreign(&log, "instantiate", || unsafe {
            match functions.interface {
                InterfaceFunctions::ModelExchange(functions) => (functions.instantiate)(
                    name,
                    token,
                    resources,
                    false,
                    true,
                    environment,
                    logs::receive,
                ),
                InterfaceFunctions::CoSimulation(functions) => (functions.instantiate)(
                    name,
                    token,
                    resources,
                    false,
                    true,
                    layout.has_events,
                    layout.has_events,
                    std::ptr::null(),
                    0,
                    environment,
                    logs::receive,
                    std::ptr::null(),
                ),
            }
        });
        let calls = FmuInstance::made(handle, functions, None, listed, log, folder)?;
        Ok(Self { calls, layout, lists: Lists::default() })
    }
}

impl ContinuousModel for Fmi3Unit {
    type Functions = Functions;

    fn unit(&mut self) -> &mut FmuInstance<Functions> {
        &mut self.calls
    }
}

impl Instance for Fmi3Unit {
    fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Outcome {
        self.lists.get(&mut self.calls, &self.layout, references, values)
    }

    fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.lists.get(&mut self.calls, &self.layout, references, values)
    }

    fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Outcome {
        self.lists.get(&mut self.calls, &self.layout, references, values)
    }

    fn set_real(&mut self, references: &[u32], values: &[f64]) -> Outcome {
        self.lists.set(&mut self.calls, &self.layout, references, values)
    }

    fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.lists.set(&mut self.calls, &self.layout, references, values)
    }

    fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Outcome {
        self.lists.set(&mut self.calls, &self.layout, references, values)
    }

    fn set_string(&mut self, reference: u32, value: &str) -> Outcome {
        let Place { reference, element, length, .. } = self.layout.place(reference);
        let [gets, sets] = [false, true].map(|sets| call(ScalarType::String, sets));
        let Functions { get, set, .. } = self.calls.functions();
        let [get, set] = [get, set].map(|functions| functions[ScalarType::String as usize]);
        let (Some(get), Some(set)) = (get, set) else {
            return Err(CallFailure::new(sets, "its library sets no texts"));
        };
        let mut texts: Vec<Text> = vec![std::ptr::null(); length];
        if length > 1 {
            // SAFETY: the instance is alive, and there is room for all elements.
            self.calls.call(gets, |_, handle| unsafe {
                get(handle, &raw const reference, 1, texts.as_mut_ptr().cast(), length)
            })?;
        }
        let mut others: Vec<String> = texts.into_iter().map(text_of).collect();
        others[element] = value.to_string();
        let copies = others.iter().map(|text| c_texts([text]));
        let copies = copies.collect::<Result<Vec<_>, _>>();
        let copies = copies.map_err(|message| CallFailure::new(sets, message))?;
        let mut texts: Vec<Text> = copies.iter().map(|[text]| text.as_ptr()).collect();
        // SAFETY: the instance is alive, and all elements are there.
        self.calls.call(sets, |_, handle| unsafe {
            set(handle, &raw const reference, 1, texts.as_mut_ptr().cast(), length)
        })
    }

    fn enter_initialization(&mut self, start: f64, stop: f64) -> Outcome {
        let tolerance = self.calls.tolerance;
        // SAFETY: the instance is alive, and the function has the type FMI gives it.
        self.calls.call("enterInitializationMode", |functions, handle| unsafe {
            let (is_told, tolerance) = (tolerance.is_some(), tolerance.unwrap_or(0.0));
            (functions.enter_initialization_mode)(handle, is_told, tolerance, start, true, stop)
        })
    }

    fn exit_initialization(&mut self) -> Outcome {
        self.calls.begin()
    }

    fn do_step(&mut self, _time: f64, _step: f64) -> Outcome {
        Err(CallFailure::new("doStep", "it is an instance for model exchange"))
    }

    fn terminate(&mut self) -> Outcome {
        self.calls.end()
    }

    fn reset(&mut self) -> Outcome {
        self.calls.start_anew()
    }

    fn save(&mut self, number: usize) -> Outcome {
        self.calls.keep(number)
    }

    fn restore(&mut self, number: usize) -> Outcome {
        self.calls.go_back(number)
    }
}
