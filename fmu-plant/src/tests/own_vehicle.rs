//! A vehicle from a file.

use super::entry::entering;
use super::model_exchange::flown;
use super::prelude::*;
use super::{CONTEXT, actuate, outputs, started, step};
use fmi_export::Restoration;
use std::path::PathBuf;

/// The papers' vehicle as one file: air, surfaces and jets.
const PAPERS: &str = concat!(
    include_str!("../../../vehicle/data/papers.toml"),
    include_str!("../../../vehicle/data/effectors.toml"),
);
/// A vehicle with inertia, tables of surfaces and a lever arm.
const SMALL: &str = include_str!("../../../vehicle/src/vehicles/small.toml");

/// A file in the folder of temporary files, which is removed at the end of the test.
struct Written(PathBuf);

impl Written {
    fn new(name: &str, text: &str) -> Self {
        let path = std::env::temp_dir().join(format!("{name}-{}.toml", std::process::id()));
        std::fs::write(&path, text).unwrap();
        Self(path)
    }

    fn select(&self, instance: &mut ReentryPlant) {
        instance.parameters.vehicle.file = self.0.display().to_string();
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A flight of the small vehicle by its surfaces.
fn small(file: &Written) -> ReentryPlant {
    started(|instance| {
        entering(instance);
        file.select(instance);
    })
}

#[test]
fn the_papers_vehicle_from_a_file_flies_bit_for_bit_as_the_built_in_one() {
    let file = Written::new("papers", PAPERS);
    let [mut built_in, mut read] = [false, true].map(|by_file| {
        started(|instance| {
            entering(instance);
            if by_file {
                file.select(instance);
            }
        })
    });
    for k in 0..100 {
        let (from, to) = (0.04 * f64::from(k), 0.04 * f64::from(k + 1));
        for instance in [&mut built_in, &mut read] {
            step(instance, from, to).unwrap();
        }
        let [one, other] = [&mut built_in, &mut read].map(|instance| outputs(instance, to));
        assert_eq!(serde_json::to_string(&one).unwrap(), serde_json::to_string(&other).unwrap());
    }
}

#[test]
fn a_vehicle_with_tables_flies_alike_in_model_exchange() {
    let file = Written::new("exchanged", SMALL);
    let ([cs, me], _) = flown(|instance| {
        entering(instance);
        file.select(instance);
    });
    // The slopes of the tables jump, so that two integrations differ more than with smooth data.
    assert!((cs.angles - me.angles).amax() < 1e-5, "{}", cs.angles - me.angles);
    assert!(cs.deflections[0].abs() > 0.05, "the flap moves");
}

#[test]
fn the_inertia_of_the_file_applies_also_without_an_entry() {
    let file = Written::new("inertia", SMALL);
    let mut instance = started(|instance| {
        file.select(instance);
        instance.parameters.kind = DisturbanceKind::None;
        instance.parameters.inertia_scale = 1.0;
        instance.parameters.initial.rates.fill(0.0);
        instance.input.moment.x = 9000.0;
    });
    assert_eq!(outputs(&mut instance, 0.0).angular_acceleration.x, 1.0);
}

/// A file, further settings, and what the refusal says.
type Case<'a> = (&'a Written, fn(&mut ReentryPlant), &'a str);

#[test]
fn a_file_that_cannot_be_flown_is_refused() {
    let bare = SMALL.split("[surfaces]").next().unwrap();
    let bare = Written::new("bare", bare);
    let refused = |file: &Written, set: fn(&mut ReentryPlant)| {
        let mut instance = ReentryPlant::new();
        set(&mut instance);
        file.select(&mut instance);
        instance.initialize(&CONTEXT).err().map(|failure| failure.to_string())
    };
    let cases: [Case; 2] = [
        (&bare, actuate, "neither surfaces nor jets"),
        (&Written(PathBuf::from("/no/such.toml")), |_| {}, "vehicle.file: /no/such.toml: "),
    ];
    for (file, set, text) in cases {
        let message = refused(file, set).unwrap();
        assert!(message.contains(text), "{message}");
    }
}

#[test]
fn a_saved_state_does_not_fit_another_file() {
    let file = Written::new("saved", SMALL);
    let instance = small(&file);
    let saved = serde_json::to_string(&instance).unwrap();
    let restore = |before: &mut ReentryPlant| {
        let mut restored: ReentryPlant = serde_json::from_str(&saved).unwrap();
        restored.restored(Restoration {
            before,
            time: 0.0,
            start_time: 0.0,
            initialized: true,
            failed: false,
        })
    };
    assert_eq!(restore(&mut small(&file)), Ok(()));
    // The file is not read again.
    std::fs::write(&file.0, SMALL.replace("kilograms = 10000.0", "kilograms = 11000.0")).unwrap();
    assert_eq!(restore(&mut ReentryPlant::new()), Ok(()));
    let refusal = restore(&mut small(&file)).unwrap_err().to_string();
    assert!(refusal.contains("vehicle.file had another content"), "{refusal}");
}
