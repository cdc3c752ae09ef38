//! The functions that the library of an FMU exports.

use std::path::Path;
use std::{fs, io};

/// Functions of FMI 2.0, without the prefix `fmi2` that all of them carry.
const FMI2: &str = "
    CancelStep CompletedIntegratorStep DeSerializeFMUstate DoStep EnterContinuousTimeMode
    EnterEventMode EnterInitializationMode ExitInitializationMode FreeFMUstate FreeInstance
    GetBoolean GetBooleanStatus GetContinuousStates GetDerivatives GetDirectionalDerivative
    GetEventIndicators GetFMUstate GetInteger GetIntegerStatus GetNominalsOfContinuousStates GetReal
    GetRealOutputDerivatives GetRealStatus GetStatus GetString GetStringStatus GetTypesPlatform
    GetVersion Instantiate NewDiscreteStates Reset SerializeFMUstate SerializedFMUstateSize
    SetBoolean SetContinuousStates SetDebugLogging SetFMUstate SetInteger SetReal
    SetRealInputDerivatives SetString SetTime SetupExperiment Terminate";
/// Functions by which `fmu-pack` asks for the descriptions of the FMUs.
const DESCRIPTIONS: [&str; 2] = ["fmu_model_descriptions", "fmu_free_model_descriptions"];

/// Writes the list of exported functions as a module definition file.
pub(crate) fn write(file: &Path) -> io::Result<()> {
    let mut text = String::from("EXPORTS\n");
    for function in FMI2.split_whitespace() {
        text.extend(["    fmi2", function, "\n"]);
    }
    for function in DESCRIPTIONS {
        text.extend(["    ", function, "\n"]);
    }
    fs::write(file, text)
}
