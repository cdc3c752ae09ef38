//! What an FMU can do, as the attributes of its interfaces.

use super::{Xml, leaf};
use crate::ModelDescription;
use crate::Version::{self, Fmi2, Fmi3};
use std::io;

/// Interface to which an attribute belongs, or both of them, or both if the FMU has states.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Exchange,
    Stepped,
    Both,
    States,
}
use Place::{Both, Exchange, States, Stepped};

#[rustfmt::skip]
const ATTRIBUTES: [(Version, Place, &str, &str); 16] = [
    (Fmi2, Exchange, "completedIntegratorStepNotNeeded", "true"),
    (Fmi2, Stepped, "canHandleVariableCommunicationStepSize", "true"),
    (Fmi2, Stepped, "canInterpolateInputs", "true"),
    (Fmi2, Stepped, "maxOutputDerivativeOrder", "0"),
    (Fmi2, Stepped, "canBeInstantiatedOnlyOncePerProcess", "false"),
    (Fmi2, Both, "canNotUseMemoryManagementFunctions", "true"),
    (Fmi2, Both, "canGetAndSetFMUstate", "true"),
    (Fmi2, Both, "canSerializeFMUstate", "true"),
    (Fmi2, States, "providesDirectionalDerivative", "true"),
    (Fmi3, Stepped, "canHandleVariableCommunicationStepSize", "true"),
    (Fmi3, Stepped, "mightReturnEarlyFromDoStep", "true"),
    (Fmi3, Stepped, "hasEventMode", "true"),
    (Fmi3, Both, "canGetAndSetFMUState", "true"),
    (Fmi3, Both, "canSerializeFMUState", "true"),
    (Fmi3, States, "providesDirectionalDerivatives", "true"),
    (Fmi3, States, "providesAdjointDerivatives", "true"),
];

impl ModelDescription {
    pub(super) fn write_interfaces(&self, xml: &mut Xml, version: Version) -> io::Result<()> {
        let interfaces = [
            (self.model_exchange, Exchange, "ModelExchange"),
            (self.co_simulation, Stepped, "CoSimulation"),
        ];
        for (_, own, element) in interfaces.into_iter().filter(|(is_there, _, _)| *is_there) {
            let mut attributes = vec![("modelIdentifier", self.name.clone())];
            for (of, place, name, value) in ATTRIBUTES {
                let has = place == own
                    || place == Both
                    || place == States && self.directional_derivatives();
                if of == version && has {
                    attributes.push((name, value.into()));
                }
            }
            leaf(xml, element, attributes)?;
        }
        Ok(())
    }
}
