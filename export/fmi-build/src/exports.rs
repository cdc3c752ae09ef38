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
/// Functions of FMI 3.0, without the prefix `fmi3` that all of them carry.
const FMI3: &str = "
    ActivateModelPartition CompletedIntegratorStep DeserializeFMUState DoStep EnterConfigurationMode
    EnterContinuousTimeMode EnterEventMode EnterInitializationMode EnterStepMode
    EvaluateDiscreteStates ExitConfigurationMode ExitInitializationMode FreeFMUState FreeInstance
    GetAdjointDerivative GetBinary GetBoolean GetClock GetContinuousStateDerivatives
    GetContinuousStates GetDirectionalDerivative GetEventIndicators GetFMUState GetFloat32
    GetFloat64 GetInt16 GetInt32 GetInt64 GetInt8 GetIntervalDecimal GetIntervalFraction
    GetNominalsOfContinuousStates GetNumberOfContinuousStates GetNumberOfEventIndicators
    GetNumberOfVariableDependencies GetOutputDerivatives GetShiftDecimal GetShiftFraction GetString
    GetUInt16 GetUInt32 GetUInt64 GetUInt8 GetVariableDependencies GetVersion
    InstantiateCoSimulation InstantiateModelExchange InstantiateScheduledExecution Reset
    SerializeFMUState SerializedFMUStateSize SetBinary SetBoolean SetClock SetContinuousStates
    SetDebugLogging SetFMUState SetFloat32 SetFloat64 SetInt16 SetInt32 SetInt64 SetInt8
    SetIntervalDecimal SetIntervalFraction SetShiftDecimal SetShiftFraction SetString SetTime
    SetUInt16 SetUInt32 SetUInt64 SetUInt8 Terminate UpdateDiscreteStates";
/// Functions by which `fmu-pack` asks for the descriptions of the FMUs.
const DESCRIPTIONS: [&str; 2] = ["fmu_model_descriptions", "fmu_free_model_descriptions"];

/// Writes the list of exported functions as a module definition file.
pub(crate) fn write(file: &Path) -> io::Result<()> {
    let mut text = String::from("EXPORTS\n");
    for (prefix, functions) in [("fmi2", FMI2), ("fmi3", FMI3)] {
        for function in functions.split_whitespace() {
            text.extend(["    ", prefix, function, "\n"]);
        }
    }
    for function in DESCRIPTIONS {
        text.extend(["    ", function, "\n"]);
    }
    fs::write(file, text)
}
