//! Check of the bounds for experiments that claim the guarantee, with the settings of their files.
#![cfg(feature = "shipped")]

use guarantee_check::CheckReport;
use guarantee_check::shipped::Scan;
use std::path::Path;

const GAP: f64 = 3e-3;

#[test]
fn every_bound_holds_for_the_experiments() {
    let folder =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../orchestrator/experiments/crmpc-2022");
    let scan = Scan::new(&folder).unwrap();
    for experiment in ["crmpc-robust.toml", "estimator.toml"] {
        let shipped = scan.shipped.iter().find(|shipped| shipped.file.ends_with(experiment));
        let report = CheckReport::new(&shipped.unwrap().settings, GAP).unwrap();
        for (_, findings) in report.sections() {
            for finding in findings {
                assert!(finding.holds(), "{experiment}: {finding:?}");
            }
        }
        assert!(report.holds(), "{experiment}");
    }
}
