//! Which trainings there are, and their working off.

use std::ops::ControlFlow;

use evidential::{
    Checkpoint, Dataset, Method, Selections, Settings, TrainError, TrainingEnd, fingerprint, train,
};
use rayon::prelude::*;
use serde::Serialize;

use super::{LearningError, Testbed};

/// What a training is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// The tables: even ground of the training maps.
    Tables,
    /// The best achievable error: all ground of other maps of the test's kind.
    Achievable,
}

/// One training to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// What for.
    pub subject: Subject,
    /// Method, seed and parameters.
    pub settings: Settings,
}

/// A training that is done.
#[derive(Clone, Debug)]
pub struct Trained {
    /// What was asked.
    pub planned: Planned,
    /// The networks.
    pub checkpoint: Checkpoint,
    /// Passes over the data, the flow's own included.
    pub n_epochs: usize,
}

/// Where the parameters of the methods come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Chosen {
    /// A search on the validation data of this testbed, shipped with the program.
    SearchHere,
    /// A search on other validation data, shipped with the program.
    SearchElsewhere,
    /// No search has been shipped: the defaults.
    Defaults,
}

/// All trainings.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// In the order in which they are done.
    pub trainings: Vec<Planned>,
    /// Seeds of each.
    pub n_seeds: u64,
    /// [`fingerprint`] of the data that the parameters were searched on; `None` for defaults.
    searched_on: Option<String>,
}

impl Plan {
    /// Every method with the seeds 1 to `n_seeds`, with the parameters that were selected for it, and as often the
    /// best achievable error; `n_epochs` bounds the passes of both phases.
    pub fn new(selections: &Selections, n_seeds: u64, n_epochs: Option<usize>) -> Self {
        let is_selected = |method: &Method| selections.settings(*method, 1).is_some();
        let is_searched = Method::ALL.iter().all(is_selected);
        let settings = |method: Method, seed: u64| {
            let selected = if is_searched { selections.settings(method, seed) } else { None };
            bounded(selected.unwrap_or_else(|| Settings::new(method, seed)), n_epochs)
        };
        let of_seed = |seed: u64| {
            let tables = Method::ALL.map(|method| (Subject::Tables, settings(method, seed)));
            tables.into_iter().chain([(Subject::Achievable, settings(Method::Vanilla, seed))])
        };
        let trainings = (1..=n_seeds).flat_map(of_seed);
        let trainings = trainings.map(|(subject, settings)| Planned { subject, settings }).collect();
        Self { trainings, n_seeds, searched_on: is_searched.then(|| selections.data.clone()) }
    }

    /// Where the parameters come from.
    pub(super) fn chosen(&self, testbed: &Testbed) -> Chosen {
        let Some(searched_on) = &self.searched_on else { return Chosen::Defaults };
        // Data that cannot be written cannot have been searched on.
        match fingerprint(&testbed.training, &testbed.validation) {
            Ok(here) if here == *searched_on => Chosen::SearchHere,
            _ => Chosen::SearchElsewhere,
        }
    }

    /// Parameters of the methods.
    pub(super) fn settings_of_the_first_seed(&self) -> Vec<Settings> {
        let first = |planned: &&Planned| planned.subject == Subject::Tables && planned.settings.seed == 1;
        self.trainings.iter().filter(first).map(|planned| planned.settings.clone()).collect()
    }

    /// Does all trainings, `n_threads` at a time, each on one thread; the result does not depend on it. `is_interrupted`
    /// is asked after every pass, `on_trained` hears of every training as it ends, in any order and on any thread.
    ///
    /// # Errors
    /// Data or settings that cannot be trained, a loss that is not finite, an interruption.
    pub fn train(
        &self,
        testbed: &Testbed,
        revision: &str,
        n_threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        on_trained: &(dyn Fn(&Trained) + Sync),
    ) -> Result<Vec<Trained>, LearningError> {
        for Planned { settings, .. } in &self.trainings {
            let method = settings.method.name();
            settings.validate().map_err(|source| LearningError::Settings { method, source })?;
        }
        let elsewhere = testbed.elsewhere_split();
        let one = |planned: &Planned| {
            let [training, validation] = match planned.subject {
                Subject::Tables => [&testbed.training, &testbed.validation],
                Subject::Achievable => [&elsewhere[0], &elsewhere[1]],
            };
            let trained = planned.train([training, validation], revision, is_interrupted)?;
            on_trained(&trained);
            Ok(trained)
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build()?;
        pool.install(|| self.trainings.par_iter().with_max_len(1).map(one).collect())
    }
}

fn bounded(settings: Settings, n_epochs: Option<usize>) -> Settings {
    let most = n_epochs.unwrap_or(usize::MAX);
    Settings {
        epochs_max: settings.epochs_max.min(most),
        flow_epochs_max: settings.flow_epochs_max.min(most),
        ..settings
    }
}

impl Planned {
    /// Method and seed, for people.
    pub fn name(&self) -> String {
        let of = match self.subject {
            Subject::Tables => "",
            Subject::Achievable => " for the best achievable error",
        };
        format!("{}{of}, seed {}", self.settings.method.name(), self.settings.seed)
    }

    fn train(
        &self,
        [training, validation]: [&Dataset; 2],
        revision: &str,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<Trained, LearningError> {
        let failed =
            |source: TrainError| LearningError::Training { training: self.name(), source: Box::new(source) };
        if is_interrupted() {
            return Err(LearningError::Interrupted);
        }
        let outcome =
            train(training, validation, &self.settings, revision, &mut |_| match is_interrupted() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            });
        let outcome = outcome.map_err(failed)?;
        match outcome.end {
            TrainingEnd::Interrupted => Err(LearningError::Interrupted),
            TrainingEnd::Finished => Ok(Trained {
                planned: self.clone(),
                n_epochs: outcome.curves.len(),
                checkpoint: outcome.checkpoint,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_is_trained_with_every_seed_and_the_best_achievable_too() {
        let plan = Plan::new(&Selections::default(), 3, Some(1));
        assert_eq!((plan.trainings.len(), &plan.searched_on), (3 * 7, &None));
        for planned in &plan.trainings {
            assert!((planned.settings.epochs_max, planned.settings.flow_epochs_max) == (1, 1));
        }
        let achievable = plan.trainings.iter().filter(|planned| planned.subject == Subject::Achievable);
        let settings: Vec<_> = achievable.map(|p| (p.settings.method, p.settings.seed)).collect();
        assert_eq!(settings, [1, 2, 3].map(|seed| (Method::Vanilla, seed)));
        assert_eq!(plan.trainings[0].name(), "pietra, seed 1");
    }

    #[test]
    fn selections_count_only_if_every_method_has_one() {
        let selection = |method: Method| evidential::Selection {
            settings: Settings { learning_rate: 2e-4, ..Settings::new(method, 9) },
            validation_emd2: [0.0; 4],
            validation_total: 0.0,
            validation_deviation: 0.0,
            validation_standard_error: 0.0,
            n_seeds: 1,
        };
        let mut selections = Selections {
            selections: vec![selection(Method::Evora)],
            data: "data".to_owned(),
            ..Selections::default()
        };
        let plan = Plan::new(&selections, 1, None);
        assert_eq!(plan.searched_on, None);
        assert!(plan.trainings.iter().all(|p| p.settings == Settings::new(p.settings.method, 1)));
        selections.selections = Method::ALL.map(selection).to_vec();
        let plan = Plan::new(&selections, 1, None);
        assert_eq!(plan.searched_on.as_deref(), Some("data"));
        assert!(plan.trainings.iter().all(|p| (p.settings.learning_rate, p.settings.seed) == (2e-4, 1)));
    }
}
