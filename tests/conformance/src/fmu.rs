//! The libraries that cargo has built, and their FMUs.

use crate::interface::{CO_SIMULATION, Interface, MODEL_EXCHANGE};
use crate::log::{Log, callbacks};
use crate::{Instance, c};
use model_description::ModelDescription;
use model_description::variable::{Causality, Variability, Variable, VariableKind};
use std::ffi::{CStr, CString, c_int};
use std::path::PathBuf;
use std::ptr::null;
use std::sync::Arc;

/// Path of a crate's library, where cargo puts it for this program: beside it or in its folder
/// `deps`.
pub fn library(krate: &str) -> PathBuf {
    let file = format!("{}{krate}{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let program = std::env::current_exe().expect("the path of this program");
    let folders = program.ancestors().skip(1).take(2);
    let mut places =
        folders.flat_map(|folder| [folder.join("deps").join(&file), folder.join(&file)]);
    places
        .find(|path| path.is_file())
        .unwrap_or_else(|| panic!("{file} is not near {}", program.display()))
}

/// One FMU of a library.
#[derive(Clone)]
pub struct Fmu {
    /// Functions of the library that holds the FMU.
    pub interface: Arc<Interface>,
    /// Model description of the FMU.
    pub description: ModelDescription,
    guid: CString,
}

/// Opens the libraries and lists their FMUs, the plant first.
pub fn fmus() -> Vec<Fmu> {
    let open = |krate| {
        let path = library(krate);
        let interface = Arc::new(Interface::open(&path).unwrap_or_else(|error| panic!("{error}")));
        let descriptions = model_description::library::descriptions(&path)
            .unwrap_or_else(|error| panic!("{error}"));
        descriptions.into_iter().map(move |description| Fmu {
            interface: interface.clone(),
            guid: CString::new(description.guid()).expect("hexadecimal digits"),
            description,
        })
    };
    ["fmu_plant_library", "fmu_optimising", "fmu_feedback"].into_iter().flat_map(open).collect()
}

/// Lists every FMU with each of its interface types.
pub fn fmus_and_interfaces() -> impl Iterator<Item = (Fmu, c_int)> {
    fmus()
        .into_iter()
        .flat_map(|fmu| fmu.interfaces().iter().map(move |&fmu_type| (fmu.clone(), fmu_type)))
}

/// Returns the FMU with that name.
pub fn fmu(name: &str) -> Fmu {
    fmus().into_iter().find(|fmu| fmu.name() == name).unwrap_or_else(|| panic!("no FMU {name}"))
}

impl Fmu {
    /// Model name of the FMU.
    pub fn name(&self) -> &str {
        &self.description.name
    }

    /// GUID of the FMU as C text.
    pub fn guid(&self) -> &CStr {
        &self.guid
    }

    /// Interface types that the FMU supports.
    pub fn interfaces(&self) -> &'static [c_int] {
        if self.description.model_exchange {
            &[MODEL_EXCHANGE, CO_SIMULATION]
        } else {
            &[CO_SIMULATION]
        }
    }

    /// Value references of the variables for which `is_chosen` holds.
    pub fn references(&self, is_chosen: impl Fn(&Variable) -> bool) -> Vec<u32> {
        let variables = self.description.variables.iter().zip(0..);
        variables
            .filter(|(variable, _)| is_chosen(variable))
            .map(|(_, reference)| reference)
            .collect()
    }

    /// Value reference of the variable with that name.
    pub fn reference(&self, name: &str) -> u32 {
        *self
            .references(|variable| variable.name == name)
            .first()
            .unwrap_or_else(|| panic!("no {name}"))
    }

    /// Value reference of a continuous input whose change affects every FMU.
    pub fn input(&self) -> u32 {
        let is_input = |name: &&str| {
            !self.references(|v| v.name == *name && v.causality == Causality::Input).is_empty()
        };
        let name = ["moment.y", "rate.q", "measured.gyroscope.y", "motion.heading"]
            .into_iter()
            .find(is_input);
        self.reference(name.expect("one of these inputs"))
    }

    /// Value references of all calculated variables except wall-clock times.
    pub fn results(&self) -> Vec<u32> {
        self.references(|variable| {
            variable.is_calculated() && !variable.description.starts_with("Wall-clock time")
        })
    }

    /// Makes an instance whose folder of resources does not exist.
    pub fn instance(&self, fmu_type: c_int) -> Instance {
        let instance =
            self.instantiate(Some(c"it"), fmu_type, Some(&self.guid), Some(c"file:///nowhere"));
        assert!(!instance.component.is_null(), "{}: {:?}", self.name(), instance.messages());
        instance
    }

    /// Makes an instance with these arguments; its component is null if it was refused. The
    /// callbacks are freed as soon as the call returns, as some importers do.
    pub fn instantiate(
        &self,
        name: Option<&CStr>,
        fmu_type: c_int,
        guid: Option<&CStr>,
        resources: Option<&CStr>,
    ) -> Instance {
        let pointer = |text: Option<&CStr>| text.map_or(null(), CStr::as_ptr);
        let log: Box<Log> = Box::default();
        let callbacks = Box::new(callbacks(&log));
        let component = c!(
            self,
            fmi2Instantiate(
                pointer(name),
                fmu_type,
                pointer(guid),
                pointer(resources),
                &raw const *callbacks,
                0,
                1
            )
        );
        Instance { interface: self.interface.clone(), fmu: self.clone(), component, log }
    }
}

/// Whether a variable is a Real that may change at any time.
pub fn is_continuous_real(variable: &Variable) -> bool {
    matches!(variable.kind, VariableKind::Real { .. })
        && variable.variability == Variability::Continuous
}
