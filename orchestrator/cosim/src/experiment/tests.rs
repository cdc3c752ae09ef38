use super::*;

#[test]
fn pages_show_the_surfaces_and_jets_of_the_vehicle_that_flies() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../experiments/entry");
    let shown = |name: &str| {
        let vehicle = Experiment::load(&folder.join(name)).unwrap().observe.vehicle.unwrap();
        let names: Vec<String> =
            (0..vehicle.deflections.len()).map(|at| vehicle.surface(at).into()).collect();
        (names, vehicle.jets.len(), vehicle.flaps.is_some())
    };
    let (papers, jets, has_flaps) = shown("surfaces-and-jets.toml");
    assert_eq!((papers.len(), jets, has_flaps), (8, 10, true));
    let own = ["left elevon", "right elevon", "body flap"].map(String::from).to_vec();
    assert_eq!(shown("own-vehicle.toml"), (own, 8, false));
    assert_eq!(shown("capsule.toml"), (Vec::new(), 6, false));
}
