//! Reads a study and checks everything that can be checked without running anything.

use crate::definition::Study;
use crate::drawings::{Drawn, Figure, Panel};
use crate::runs::Run;
use crate::{grid, rows};
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::Experiment;
use serde::de::DeserializeOwned;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use sweep::vary::Vary;

/// Reads a study in which lists are expanded, and no run extends another one.
fn spelled_out<T: DeserializeOwned>(source: &Source) -> Result<T, Error> {
    source.read_with(|mut table| {
        let study = table.get_mut();
        let expanded = rows::expand(study).and_then(|()| rows::inherit(study));
        expanded.map_err(|(span, message)| source.error(&span, message))?;
        source.take(table)
    })
}

impl Study {
    /// Reads a study and its files of values.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, is not TOML, or names an item that does not
    /// exist.
    pub fn load(path: &Path) -> Result<Self, Error> {
        Self::load_with(path, None)
    }

    /// Reads a study with at most `cases` cases of each run, and its files of values.
    ///
    /// # Errors
    /// The errors are those of [`Self::load`].
    pub fn load_with(path: &Path, cases: Option<u64>) -> Result<Self, Error> {
        let source = Source::load(path)?;
        let mut study: Self = spelled_out(&source)?;
        study.source = source;
        for grid in std::mem::take(&mut study.grids) {
            let runs = grid.runs(&study.source)?;
            study.runs.extend(runs);
        }
        study.expand()?;
        for file in &study.value_files {
            study.values.load(&study.source.beside(file))?;
        }
        study.learn_of_experiments();
        study.check()?;
        let most = cases.unwrap_or(u64::MAX).max(1);
        study.most_cases = study.runs.iter().any(|run| run.count() > most).then_some(most);
        for run in &mut study.runs {
            run.cases = Some(run.count().min(most));
            run.vary = Vary::counted(&run.seeds).into_iter().collect();
        }
        Ok(study)
    }

    /// Returns the text of a study with all that it extends, and with every list spelled out.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, is not TOML, or names a list or a run that does
    /// not exist.
    pub fn spelled_out(path: &Path) -> Result<String, Error> {
        Ok(spelled_out::<toml::Table>(&Source::load(path)?)?.to_string())
    }

    /// Reads the metrics that the experiments define, and which parameters they set that runs do
    /// not have. An experiment that cannot be read is reported later, when it is to be run.
    fn learn_of_experiments(&mut self) {
        let mut experiments: BTreeMap<PathBuf, Option<Experiment>> = BTreeMap::new();
        for run in &mut self.runs {
            let path = self.source.beside(&run.experiment);
            let read =
                experiments.entry(path).or_insert_with_key(|path| Experiment::load(path).ok());
            if let Some(experiment) = read {
                run.observe.clone_from(&experiment.observe);
                let set = run.without.iter().filter(|name| experiment.sets(name));
                run.unset.extend(set.cloned());
            }
        }
    }

    /// Replaces patterns by the ids of runs.
    fn expand(&mut self) -> Result<(), Error> {
        let ids: Vec<&str> = self.runs.iter().map(|run| run.id.get_ref().as_str()).collect();
        let mut lists = Vec::new();
        for figure in &mut self.figures {
            lists.push(&mut figure.runs);
            for panel in &mut figure.panels {
                lists.extend(&mut panel.runs);
                let lines = panel.across.iter_mut().flat_map(|across| &mut across.lines);
                lists.extend(lines.map(|line| &mut line.runs));
            }
        }
        lists.extend(self.overviews.iter_mut().map(|overview| &mut overview.runs));
        for names in lists {
            *names = grid::expand(names, &ids).map_err(|name| {
                self.source.error(&name.span(), format!("no [[run]] fits \"{}\"", name.get_ref()))
            })?;
            self.source.check_names(&*names, "[[run]]", ids.iter().copied())?;
        }
        Ok(())
    }

    /// Checks everything that can be wrong without running anything.
    fn check(&self) -> Result<(), Error> {
        let mut ids = BTreeSet::new();
        for run in &self.runs {
            self.check_run(run, ids.insert(run.id.get_ref()))?;
        }
        let mut ids = BTreeSet::new();
        for measure in &self.measures {
            let id = &measure.id;
            let fault = if id.is_empty() {
                Some("a measure of a study needs an id".into())
            } else if !ids.insert(id) {
                Some("there is another measure with this id".into())
            } else {
                measure.fault()
            };
            if let Some(fault) = fault {
                return Err(self.fault(format!("[[measure]] id = \"{id}\": {fault}")));
            }
        }
        let bounded = self.within.iter().map(|within| &within.signals);
        let lists = bounded.chain(self.measures.iter().map(|measure| &measure.signals));
        self.source.check_names(lists, "[signals]", self.signals.keys().map(String::as_str))?;
        for figure in &self.figures {
            for panel in &figure.panels {
                self.check_panel(figure, panel).map_err(|problem| {
                    let (id, label) = (&figure.id, &panel.label);
                    self.fault(format!("[[figure]] id = \"{id}\", panel \"{label}\": {problem}"))
                })?;
            }
        }
        let papers = self.tables.iter().flat_map(|table| &table.rows);
        let papers = papers.filter_map(|row| row.paper.as_ref());
        for quantity in self.within.iter().map(|within| &within.bound).chain(papers) {
            self.number(quantity)?;
        }
        Ok(())
    }

    fn check_run(&self, run: &Run, is_first: bool) -> Result<(), Error> {
        let id = run.id.get_ref();
        let fault = match run.cases {
            _ if id.is_empty() || !id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') => {
                Some("an id consists of letters, digits and -")
            }
            _ if !is_first => Some("there is another run with this id"),
            _ if run.experiment.as_os_str().is_empty() => Some("experiment is missing"),
            _ if !run.set_for.is_empty() => Some("set_for is a key of a scenario in a grid"),
            Some(0) => Some("cases = 0, but it must be at least 1"),
            Some(_) if run.seeds.is_empty() => Some("cases needs seeds"),
            None if !run.seeds.is_empty() => Some("seeds need cases, their number"),
            _ => None,
        };
        if let Some(fault) = fault {
            let message = format!("[[run]] id = \"{id}\": {fault}");
            return Err(self.source.error(&run.id.span(), message));
        }
        let bounds = self.within.iter().map(|within| within.id.as_str());
        self.source.check_names(&run.within, "[[within]]", bounds)?;
        let measures = self.measures.iter().map(|measure| measure.id.as_str());
        self.source.check_names(&run.measures, "[[measure]]", measures)
    }

    fn check_panel(&self, figure: &Figure, panel: &Panel) -> Result<(), String> {
        if let Drawn::Response(_) = panel.drawn()?
            && let Some(run) = self.runs_of(figure, panel).find(|run| run.observe.margins.is_none())
        {
            let id = run.id.get_ref();
            return Err(format!(
                "response needs [observe.margins], which the experiment of the run \"{id}\" does not have"
            ));
        }
        let mut lines = panel.bounds.iter().chain(&panel.marks);
        lines.try_for_each(|line| line.positions(&self.values).map(drop))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_of_a_study_have_ids_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.toml");
        let head =
            "title = \"\"\npaper = \"\"\nsummary = \"\"\nvalues = []\n[signals]\nx = [\"a.b\"]\n";
        let loaded = |measures: &[&str]| {
            let measure =
                |id: &&str| format!("[[measure]]\n{id}\nkind = \"rms\"\nsignals = \"x\"\n");
            let text = measures.iter().map(measure).fold(head.to_string(), |text, one| text + &one);
            std::fs::write(&path, text).unwrap();
            Study::load(&path).map_err(|error| error.to_string())
        };
        assert!(loaded(&["id = \"a\"", "id = \"b\""]).is_ok());
        assert!(loaded(&[""]).unwrap_err().contains("needs an id"));
        let twice = loaded(&["id = \"a\"", "id = \"a\""]).unwrap_err();
        assert!(twice.contains("\"a\": there is another measure with this id"), "{twice}");
    }
}
