//! The library of the FMU `ReentryPlant`.
#![deny(clippy::disallowed_methods)]

use fmu_plant::ReentryPlant;

fmi_export::export_fmus!(ReentryPlant);
