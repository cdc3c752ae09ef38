//! Benchmarks through the C interface: `fmi2DoStep` of plant and controller, and the whole 50 s
//! loop of Chai 2022 through their libraries (white noise, inertia + 5 %).
//!
//! The loop contains only the work that every master must do, 1250 times: set the controller's
//! inputs, step it, read its moment, set the plant's moment and step the plant. Instantiation and
//! initialization are not timed, and nothing is recorded.

use conformance::interface::CO_SIMULATION;
use conformance::{Fmu, Instance, c, fmu};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};

const STEP: f64 = 0.04;
const TICKS: u32 = 1250;

/// Value references of a vector's components.
fn vector(fmu: &Fmu, name: &str, axes: [&str; 3]) -> [u32; 3] {
    axes.map(|axis| fmu.reference(&format!("{name}.{axis}")))
}

fn get<const N: usize>(from: &Instance, references: &[u32; N]) -> [f64; N] {
    let mut values = [f64::NAN; N];
    from.ok(c!(from, fmi2GetReal(from.component, references.as_ptr(), N, values.as_mut_ptr())));
    values
}

fn set<const N: usize>(to: &Instance, references: &[u32; N], values: &[f64; N]) {
    to.ok(c!(to, fmi2SetReal(to.component, references.as_ptr(), N, values.as_ptr())));
}

/// Plant and controller in a closed loop.
struct Loop {
    plant: Instance,
    controller: Instance,
    /// Value references of attitude and rates, of the plant and of the controller.
    motion: [[u32; 6]; 2],
    moment: [[u32; 3]; 2],
}

impl Loop {
    fn new(plant: &Fmu, controller: &Fmu, constraints: Option<&str>) -> Self {
        let motion = [plant, controller].map(|fmu| {
            let [alpha, beta, sigma] = vector(fmu, "attitude", ["alpha", "beta", "sigma"]);
            let [p, q, r] = vector(fmu, "rate", ["p", "q", "r"]);
            [alpha, beta, sigma, p, q, r]
        });
        let moment = [plant, controller].map(|fmu| vector(fmu, "moment", ["x", "y", "z"]));
        let (plant, controller) =
            (plant.instance(CO_SIMULATION), controller.instance(CO_SIMULATION));
        plant.choose("disturbance.kind", "white");
        plant.ok(plant.set_real(plant.fmu.reference("inertia.scale"), 1.05));
        if let Some(constraints) = constraints {
            controller.choose("constraints", constraints);
        }
        Self { plant: plant.initialized(), controller: controller.initialized(), motion, moment }
    }

    /// Steps the controller with the plant's attitude and rates, then the plant with the
    /// controller's moment.
    fn step(&self, tick: u32) {
        let time = f64::from(tick) * STEP;
        set(&self.controller, &self.motion[1], &get(&self.plant, &self.motion[0]));
        self.controller.ok(self.controller.step(time, STEP));
        set(&self.plant, &self.moment[0], &get(&self.controller, &self.moment[1]));
        self.plant.ok(self.plant.step(time, STEP));
    }

    fn run(&self) {
        for tick in 0..TICKS {
            self.step(tick);
        }
    }
}

fn loops(criterion: &mut Criterion) {
    let (plant, crmpc) = (fmu("ReentryPlant"), fmu("CRMPC"));
    let mut group = criterion.benchmark_group("fmi2DoStep");
    let alone = plant.instance(CO_SIMULATION).initialized();
    let (start, mut tick) = (alone.save(), 0);
    group.bench_function("ReentryPlant", |bencher| {
        bencher.iter(|| {
            // The plant starts again, so that it stays near its start without a controller.
            if tick == 25 {
                alone.restore(start);
                tick = 0;
            }
            alone.ok(alone.step(f64::from(tick) * STEP, STEP));
            tick += 1;
        });
    });
    // CRMPC optimises at tick 5; at the next tick it only applies feedback.
    for (name, tick) in [("CRMPC, optimising", 5), ("CRMPC, between", 6)] {
        let closed = Loop::new(&plant, &crmpc, None);
        for before in 0..tick {
            closed.step(before);
        }
        let motion = get(&closed.plant, &closed.motion[0]);
        let state = closed.controller.save();
        group.bench_function(name, |bencher| {
            // The step itself does the work.
            bencher.iter_batched(
                || {
                    closed.controller.restore(state);
                    set(&closed.controller, &closed.motion[1], &motion);
                },
                |()| closed.controller.ok(closed.controller.step(f64::from(tick) * STEP, STEP)),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();

    // A call that does nothing else shows what each call costs, as for its floating-point
    // environment.
    let moment = [plant.reference("moment.x")];
    criterion.bench_function("fmi2GetReal of an input", |bencher| {
        bencher.iter(|| get(&alone, &moment));
    });

    let mut group = criterion.benchmark_group("50 s through two FMUs");
    group.sample_size(20);
    for (name, controller, constraints) in [
        ("CRMPC robust", &crmpc, Some("robust")),
        ("CRMPC paper", &crmpc, Some("paper")),
        ("LQR", &fmu("LQR"), None),
    ] {
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                || Loop::new(&plant, controller, constraints),
                |closed| closed.run(),
                BatchSize::PerIteration,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, loops);
criterion_main!(benches);
