//! Reads a study and checks everything that can be checked without running anything.

use crate::definition::Study;
use crate::drawings::{Figure, Panel};
use crate::runs::Run;
use crate::{grid, rows};
use cosim::document::Source;
use cosim::error::Error;
use cosim::experiment::{Experiment, Observe};
use fmu_import::names;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Reads a study in which no table stands for several, and no run extends another one.
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
        study.check()?;
        let most = cases.unwrap_or(u64::MAX).max(1);
        study.most_cases = study.runs.iter().any(|run| run.count() > most).then_some(most);
        for run in &mut study.runs {
            run.cases = Some(run.count().min(most));
        }
        study.learn_metrics();
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

    /// Reads the metrics that the experiments define. An experiment that cannot be read is reported
    /// later, when it is to be run.
    fn learn_metrics(&mut self) {
        let mut observed: BTreeMap<PathBuf, Observe> = BTreeMap::new();
        for run in &mut self.runs {
            let path = self.source.beside(&run.experiment);
            let asked = observed.entry(path).or_insert_with_key(|path| {
                Experiment::load(path).map(|read| read.observe).unwrap_or_default()
            });
            run.observe.clone_from(asked);
        }
    }

    /// Replaces patterns by the ids of runs.
    fn expand(&mut self) -> Result<(), Error> {
        let ids: Vec<&str> = self.runs.iter().map(|run| run.id.get_ref().as_str()).collect();
        let panels = self.figures.iter_mut().flat_map(|figure| {
            let of_panels = figure.panels.iter_mut().flat_map(|panel| {
                let lines = panel.across.iter_mut().flat_map(|across| &mut across.lines);
                lines.map(|line| &mut line.runs).chain(&mut panel.runs)
            });
            of_panels.chain([&mut figure.runs])
        });
        for names in panels.chain(self.overviews.iter_mut().map(|overview| &mut overview.runs)) {
            *names = grid::expand(names, &ids).map_err(|name| {
                self.source.error(&name.span(), format!("no [[run]] fits \"{}\"", name.get_ref()))
            })?;
        }
        Ok(())
    }

    /// Checks everything that can be wrong without running anything.
    fn check(&self) -> Result<(), Error> {
        let ids: Vec<&str> = self.runs.iter().map(|run| run.id.get_ref().as_str()).collect();
        for (place, run) in self.runs.iter().enumerate() {
            let id = run.id.get_ref();
            let fault = |message: &str| {
                Err(self.source.error(&run.id.span(), format!("[[run]] id = \"{id}\": {message}")))
            };
            if id.is_empty() || !id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') {
                return fault("an id consists of letters, digits and -");
            }
            if ids[..place].contains(&id.as_str()) {
                return fault("there is another run with this id");
            }
            match run.cases {
                Some(0) => return fault("cases = 0, but it must be at least 1"),
                Some(_) if run.vary.is_empty() => return fault("cases needs vary"),
                None if !run.vary.is_empty() => return fault("vary needs cases, their number"),
                _ => {}
            }
            self.source.check_names(
                &run.within,
                "[[within]]",
                self.within.iter().map(|within| within.id.as_str()),
            )?;
            self.source.check_names(
                &run.measures,
                "[[measure]]",
                self.measures.iter().map(|measure| measure.id.as_str()),
            )?;
        }
        for within in &self.within {
            self.number(&within.bound)?;
        }
        for (place, measure) in self.measures.iter().enumerate() {
            let id = &measure.id;
            let fault = match measure.fault() {
                _ if id.is_empty() => Some("a measure of a study needs an id".into()),
                _ if self.measures[..place].iter().any(|other| other.id == *id) => {
                    Some("there is another measure with this id".into())
                }
                fault => fault,
            };
            if let Some(fault) = fault {
                let fault = format!("[[measure]] id = \"{}\": {fault}", measure.id);
                return Err(self.source.error(&(0..0), fault));
            }
        }
        let bounded = self.within.iter().map(|within| &within.signals);
        for list in bounded.chain(self.measures.iter().map(|measure| &measure.signals)) {
            self.source.check_names(
                [list],
                "[signals]",
                self.signals.keys().map(String::as_str),
            )?;
        }
        self.check_figures(&ids)?;
        for overview in &self.overviews {
            self.source.check_names(&overview.runs, "[[run]]", ids.iter().copied())?;
        }
        for quantity in
            self.tables.iter().flat_map(|table| &table.rows).filter_map(|row| row.paper.as_ref())
        {
            self.number(quantity)?;
        }
        Ok(())
    }

    fn check_figures(&self, ids: &[&str]) -> Result<(), Error> {
        if let Some(lead) = &self.lead
            && !self.figures.iter().any(|figure| figure.id == *lead)
        {
            let hint = names::hint(lead, self.figures.iter().map(|figure| figure.id.as_str()));
            let problem = format!("lead: there is no [[figure]] \"{lead}\"{hint}");
            return Err(self.source.error(&(0..0), problem));
        }
        for figure in &self.figures {
            self.source.check_names(&figure.runs, "[[run]]", ids.iter().copied())?;
            for panel in &figure.panels {
                let across = panel.across.iter().flat_map(|across| &across.lines);
                let through = across.flat_map(|line| &line.runs);
                let named = panel.runs.iter().flatten().chain(through);
                self.source.check_names(named, "[[run]]", ids.iter().copied())?;
                if let Some(problem) = self.fault_of(figure, panel) {
                    let place =
                        format!("[[figure]] id = \"{}\", panel \"{}\"", figure.id, panel.label);
                    return Err(self.source.error(&(0..0), format!("{place}: {problem}")));
                }
                let lines = panel.bounds.iter().chain(&panel.marks).map(|line| &line.at);
                let points = panel.points.iter().flat_map(|point| [&point.x, &point.y]);
                for quantity in lines.chain(points) {
                    self.number(quantity)?;
                }
            }
        }
        Ok(())
    }

    /// Returns what is wrong with a panel by itself.
    fn fault_of(&self, figure: &Figure, panel: &Panel) -> Option<String> {
        let drawn = [
            panel.signal.is_some(),
            !panel.signals.is_empty(),
            panel.histogram.is_some(),
            panel.scatter.is_some(),
            panel.response.is_some(),
            panel.across.is_some(),
        ];
        let count = drawn.iter().filter(|is| **is).count();
        if count != 1 && (count > 1 || panel.points.is_empty()) {
            return Some("a panel needs exactly one of signal, signals, histogram, scatter, across and response, or points alone".into());
        }
        let without = |run: &&Run| run.observe.margins.is_none();
        if panel.response.is_some()
            && let Some(run) = self.runs_of(figure, panel).find(without)
        {
            let id = run.id.get_ref();
            return Some(format!(
                "response needs [observe.margins], which the experiment of the run \"{id}\" does not have"
            ));
        }
        let is_disk = |alpha: f64| alpha > 0.0 && alpha < 2.0;
        panel.disk.filter(|alpha| !is_disk(*alpha)).map(|_| "disk must lie between 0 and 2".into())
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
