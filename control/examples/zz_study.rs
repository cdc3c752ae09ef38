//! scratch
use control::{Controller, Crmpc, Measurement};
use control::crmpc::*;
use nalgebra::Vector3;
use vehicle::scenario::Scenario;
use vehicle::plant::*;
use vehicle::disturbance::Kind;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let get = |k: &str| args.iter().position(|a| a == k).map(|i| args[i + 1].clone());
    let scenario = Scenario::crmpc2022();
    let body = scenario.inertia.body(1.0).unwrap();
    let mut s = Settings::crmpc2022(&scenario, body);
    if get("--set").as_deref() == Some("paper") { s.constraints = Constraints::Paper }
    if get("--init").as_deref() == Some("tube") { s.initial_state = InitialState::Tube }
    if let Some(b) = get("--bound") { s.disturbance_bound = b.parse::<f64>().unwrap().to_radians() }
    if let Some(b) = get("--ie") { s.inertia_error = b.parse::<f64>().unwrap() }
    if let Some(b) = get("--k") { let k: f64 = b.parse().unwrap(); s.feedback = control::sampled::Gain { k1: k, k2: k } }
    let mut c = Crmpc::new(s).unwrap();
    if args.iter().any(|a| a == "-v") { println!("{:#?}", c.design().paper); println!("{:?} {:?}", c.design().reach, c.design().g[0]); 
      println!("{:?}", &c.design().tightening.at_stage[..6]); println!("{:?}", &c.design().tightening.within_stage[..6]); println!("{:?} {:?}", c.design().tightening.disturbance, c.design().invariant.as_ref().map(|i| i.reach()))}
    let seeds: u64 = get("--seeds").map_or(1, |x| x.parse().unwrap());
    let kind = match get("--kind").as_deref() { Some("none") => Kind::None, Some("constant") => Kind::Constant, Some("square") => Kind::Square, Some("along") => Kind::AlongRate, Some("against") => Kind::AgainstMoment, _ => Kind::White };
    let mut tall = vec![];
    let (mut we, mut wr, mut wm, mut fb, mut sume) = (0.0f64, 0.0f64, 0.0f64, 0, 0.0);
    for seed in 1..=seeds {
        let mut cfg = scenario.config(0.01);
        cfg.disturbance.kind = kind;
        cfg.disturbance.seed = seed;
        if let Some(b) = get("--scale") { cfg.inertia_scale = b.parse().unwrap() }
        if let Some(b) = get("--sq") { cfg.disturbance.square_period = b.parse().unwrap() }
        if let Some(b) = get("--dir") { let v: Vec<f64> = b.split(',').map(|x| x.parse().unwrap()).collect(); cfg.disturbance.direction = Vector3::new(v[0], v[1], v[2]); }
        let mut p = Plant::new(&cfg, 0.0).unwrap();
        let mut mem = Memory::default();
        let (mut ee, mut cc, mut mr, mut mm) = (0.0, 0.0, 0.0f64, 0.0f64);
        let n = 1250;
        let (mut un, mut co) = (0, 0);
        for k in 0..n {
            let t = k as f64 * 0.04;
            let r = |t: f64| scenario.reference.at(t);
            let y = Measurement { angles: p.angles(), rates: p.rates() };
            let m = c.update(&mut mem, k, t, &y, &r);
            if k % 5 == 0 { tall.push(mem.report.time * 1e3);
              match mem.report.status { Status::Unconstrained => un += 1, Status::Constrained => co += 1, _ => { if args.iter().any(|a| a == "-v") {println!("fallback at {t} rate {}", y.rates.norm().to_degrees())} } }
              if seed == 1 && get("--trace").is_some() { println!("{t:.2} {:?} it {} J {:.5} {:.3}ms w {:.3} m {:.3} E {:.3?}", mem.report.status, mem.report.iterations, mem.report.cost, mem.report.time*1e3, y.rates.norm().to_degrees(), m.norm()/1.356e5, (y.angles - r(t).angles).map(f64::to_degrees).as_slice()); } }
            ee += (y.angles - r(t).angles).norm_squared(); cc += (m.norm() / 1.356e5).powi(2);
            mm = mm.max(m.norm() / 1.356e5);
            for i in 0..4 { p.advance(t + i as f64 * 0.01, t + (i + 1) as f64 * 0.01, m).unwrap(); mr = mr.max(p.rates().norm()); }
        }
        let ems = (ee / n as f64).sqrt().to_degrees();
        if seeds <= 3 { println!("seed {seed}: EMS {ems:.4} CMS {:.4} rate {:.4} m {:.4} fb {} unc {un} con {co}", (cc / n as f64).sqrt(), mr.to_degrees(), mm, mem.report.fallbacks); }
        we = we.max(ems); wr = wr.max(mr.to_degrees()); wm = wm.max(mm); fb += mem.report.fallbacks; sume += ems;
    }
    tall.sort_by(f64::total_cmp);
    println!("EMS mean {:.4} max {we:.4} rate {wr:.4} m {wm:.4} fallbacks {fb}; time mean {:.3} p99 {:.3} max {:.3}", sume / seeds as f64, tall.iter().sum::<f64>() / tall.len() as f64, tall[tall.len() * 99 / 100], tall[tall.len() - 1]);
}
