//! A campaign in a folder with all files that its cases need, so that another machine can fly them.

use crate::plan::Plan;
use cosim::error::Error;
use cosim::files;
use cosim::system::CheckedComponent;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use toml::Table;

/// Name of the campaign's file in the folder.
pub const CAMPAIGN: &str = "campaign.toml";
/// Folder of the FMUs that share the process of this program. They also do so on a machine where
/// `--fmu-dir` names the folder.
const TRUSTED: &str = "fmu";
const EXPERIMENT: &str = "experiment.toml";

/// Writes the campaign, its experiment and its FMUs into a folder. What the files extend is merged
/// into them. Parts that are flown with these files fit the campaign that they were made from.
///
/// # Errors
/// Returns an error if a file cannot be written.
pub fn write(plan: &Plan, folder: &Path) -> Result<(), Error> {
    let keep = |name: &str, content: &[u8]| files::write(&folder.join(name), content);
    let system = plan.sweep.system(&mut BTreeMap::new())?;
    // Components that share an FMU share its copy.
    let mut copies: BTreeMap<&Path, String> = BTreeMap::new();
    let mut fmus = Table::new();
    for CheckedComponent { name, fmu, is_isolated, .. } in &system.components {
        let number = copies.len();
        if !copies.contains_key(fmu.path.as_path()) {
            let file = fmu.path.file_name().unwrap_or_default().to_string_lossy();
            // FMUs of different folders may have the same name.
            let copy = format!("{number}-{file}");
            let copy = if *is_isolated { copy } else { format!("{TRUSTED}/{copy}") };
            keep(&copy, &fs::read(&fmu.path).map_err(Error::file(&fmu.path))?)?;
            copies.insert(&fmu.path, copy);
        }
        fmus.insert(name.clone(), copies[fmu.path.as_path()].clone().into());
    }
    let text = toml::from_str(plan.campaign.source.whole());
    let mut campaign: Table = text.map_err(|error| plan.campaign.fault(error.to_string()))?;
    campaign.remove("extends");
    campaign.insert("experiment".into(), EXPERIMENT.into());
    campaign.insert("fmu".into(), fmus.into());
    let campaign = toml::to_string(&campaign);
    let campaign = campaign.map_err(|error| plan.campaign.fault(error.to_string()))?;
    keep(EXPERIMENT, system.experiment.source.whole().as_bytes())?;
    keep(CAMPAIGN, campaign.as_bytes())
}
