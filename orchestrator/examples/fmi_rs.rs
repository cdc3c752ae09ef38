//! Runs FMUs with fmi-rs alone: its importer, its simulation of one FMU, and two instances that are
//! connected by hand. The results are written as CSV.
//!
//! The usage is `fmi_rs KIND FMU STEP STOP OUT` or `fmi_rs loop CONTROLLER PLANT STEP STOP OUT`.
//! KIND is `cs` or `me` for FMI 2.0, and for FMI 3.0 `cs3`, `me3` or `events3`, which is
//! co-simulation with event mode.

use fmi_rs::fmi2::builder::FMU2Builder;
use fmi_rs::fmi2::types::fmi2Status;
use fmi_rs::fmi2::{CS, FMU2};
use fmi_rs::fmi3::LibraryKind;
use fmi_rs::fmi3::builder::FMU3Builder;
use fmi_rs::model_description::{fmi2::Causality, fmi3};
use fmi_rs::sim::fmi2::recorder::Recorder;
use fmi_rs::sim::fmi2::{SimulationSettings, Trajectories, cs, csv, me};
use fmi_rs::sim::fmi3 as sim3;
use fmi_rs::sim::solver::ForwardEulerFactory;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

/// Variables that the plant passes to the controller, and variables that the controller passes to
/// the plant.
const STATE: [&str; 6] =
    ["attitude.alpha", "attitude.beta", "attitude.sigma", "rate.p", "rate.q", "rate.r"];
const MOMENT: [&str; 3] = ["moment.x", "moment.y", "moment.z"];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        [kind @ ("cs" | "me"), fmu, step, stop, out] => {
            alone(kind, fmu, step.parse()?, stop.parse()?, out)
        }
        [kind @ ("cs3" | "me3" | "events3"), fmu, step, stop, out] => {
            alone_in_fmi3(kind, fmu, step.parse()?, stop.parse()?, out)
        }
        ["loop", controller, plant, step, stop, out] => {
            closed_loop(controller, plant, step.parse()?, stop.parse()?, out)
        }
        _ => Err(
            "usage: fmi_rs cs|me|cs3|me3|events3 FMU STEP STOP OUT, or fmi_rs loop CONTROLLER PLANT STEP STOP OUT"
                .into(),
        ),
    }
}

/// Simulates one FMU with its start values, with the library's own simulation. Model exchange uses
/// the library's Euler method.
#[expect(clippy::arc_with_non_send_sync, reason = "what the library wants")]
fn alone(kind: &str, path: &str, step: f64, stop: f64, out: &str) -> Result<(), Box<dyn Error>> {
    let opened = FMU2Builder::new(&path)?;
    let description = Arc::new(opened.model_description);
    let outputs = description.modelVariables.iter().enumerate();
    let outputs = outputs.filter(|(_, variable)| variable.causality == Causality::Output);
    let trajectories =
        Trajectories::new(description.clone(), outputs.map(|(index, _)| index).collect());
    let recorder = Arc::new(Recorder::new(trajectories));
    let settings = SimulationSettings {
        unzipdir: opened.unzipdir.path().to_path_buf(),
        model_description: description,
        start_time: 0.0,
        stop_time: stop,
        logging_on: true,
        set_stop_time: true,
        output_interval: step,
        log_time_scale: false,
        tolerance: 1e-6,
        set_tolerance: false,
        start_values: Vec::new(),
        log_fmi_calls: false,
        input_file: None,
        early_return_allowed: false,
        event_mode_used: false,
        log_file: None,
        initial_fmu_state_file: None,
        final_fmu_state_file: None,
    };
    if kind == "cs" {
        cs::simulate(&settings, None, recorder.clone())?;
    } else {
        me::simulate(
            &settings,
            &ForwardEulerFactory { fixed_step_size: step },
            None,
            recorder.clone(),
        )?;
    }
    csv::write_csv(&recorder.trajectories.borrow(), out)?;
    Ok(())
}

/// Simulates one FMU of FMI 3.0 in the same way.
#[expect(clippy::arc_with_non_send_sync, reason = "what the library wants")]
fn alone_in_fmi3(
    kind: &str,
    path: &str,
    step: f64,
    stop: f64,
    out: &str,
) -> Result<(), Box<dyn Error>> {
    let opened = FMU3Builder::new(&path)?;
    let description = Arc::new(opened.model_description);
    let outputs = description.modelVariables.iter().enumerate();
    let outputs = outputs.filter(|(_, variable)| variable.causality == fmi3::Causality::Output);
    let trajectories =
        sim3::Trajectories::new(description.clone(), outputs.map(|(index, _)| index).collect());
    let recorder = Arc::new(sim3::recorder::Recorder::new(trajectories));
    let settings = sim3::SimulationSettings {
        unzipdir: opened.unzipdir.path().to_path_buf(),
        model_description: description,
        library_kind: LibraryKind::Native,
        enable_dae: false,
        start_time: 0.0,
        stop_time: stop,
        visible: false,
        logging_on: true,
        set_stop_time: true,
        output_interval: step,
        log_time_scale: false,
        tolerance: 1e-6,
        set_tolerance: false,
        start_values: Vec::new(),
        log_fmi_calls: false,
        intermediate_update: false,
        input_file: None,
        early_return_allowed: kind == "events3",
        event_mode_used: kind == "events3",
        log_file: None,
        initial_fmu_state_file: None,
        final_fmu_state_file: None,
    };
    if kind == "me3" {
        let euler = ForwardEulerFactory { fixed_step_size: step };
        sim3::me::simulate(&settings, &euler, None, recorder.clone())?;
    } else {
        sim3::cs::simulate(&settings, None, recorder.clone())?;
    }
    sim3::csv::write_csv(&recorder.trajectories.borrow(), out)?;
    Ok(())
}

/// An instance that is stepped by hand, with the value references of its outputs and inputs.
struct Instance {
    fmu: Arc<FMU2<CS>>,
    state: Vec<u32>,
    moment: Vec<u32>,
    _folder: tempfile::TempDir,
}

impl Instance {
    fn new(path: &str) -> Result<Self, Box<dyn Error>> {
        let opened = FMU2Builder::new(&Path::new(path))?;
        let references = |names: &[&str]| -> Result<Vec<u32>, Box<dyn Error>> {
            let reference =
                |name: &&str| Ok(opened.model_description.variable_by_name(name)?.valueReference);
            names.iter().map(reference).collect()
        };
        let (state, moment) = (references(&STATE)?, references(&MOMENT)?);
        Ok(Instance {
            fmu: opened.instantiate_cs("instance")?,
            state,
            moment,
            _folder: opened.unzipdir,
        })
    }
}

fn done(status: fmi2Status) -> Result<(), Box<dyn Error>> {
    if status == fmi2Status::Ok { Ok(()) } else { Err(format!("{status:?}").into()) }
}

/// Simulates a closed loop. In each step the state goes to the controller, which is stepped; then
/// its moment goes to the plant, which is stepped. Nothing is read between setting and stepping.
fn closed_loop(
    controller: &str,
    plant: &str,
    step: f64,
    stop: f64,
    out: &str,
) -> Result<(), Box<dyn Error>> {
    let (controller, plant) = (Instance::new(controller)?, Instance::new(plant)?);
    let (mut state, mut moment) = ([0.0; 6], [0.0; 3]);
    for instance in [&controller, &plant] {
        done(instance.fmu.setupExperiment(None, 0.0, None))?;
        done(instance.fmu.enterInitializationMode())?;
    }
    done(plant.fmu.getReal(&plant.state, &mut state))?;
    done(controller.fmu.setReal(&controller.state, &state))?;
    done(controller.fmu.getReal(&controller.moment, &mut moment))?;
    done(plant.fmu.setReal(&plant.moment, &moment))?;
    for instance in [&controller, &plant] {
        done(instance.fmu.exitInitializationMode())?;
    }
    let mut file = BufWriter::new(File::create(out)?);
    writeln!(file, "time,{},{}", STATE.join(","), MOMENT.join(","))?;
    let steps = (stop / step).round() as u32;
    for tick in 0..=steps {
        let time = f64::from(tick) * step;
        done(plant.fmu.getReal(&plant.state, &mut state))?;
        if tick < steps {
            done(controller.fmu.setReal(&controller.state, &state))?;
            done(controller.fmu.doStep(time, step, 0))?;
            done(controller.fmu.getReal(&controller.moment, &mut moment))?;
            done(plant.fmu.setReal(&plant.moment, &moment))?;
            done(plant.fmu.doStep(time, step, 0))?;
        }
        let values = state.iter().chain(&moment).map(f64::to_string).collect::<Vec<_>>();
        writeln!(file, "{time},{}", values.join(","))?;
    }
    Ok(())
}
