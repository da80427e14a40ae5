//! What was announced for what.

use formats::GapKind;
use serde::Serialize;
use sim_to_real::Verdict;

use super::DiagnosedCase;

/// Counts of cases by what had been added and what was announced first. Pairs are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Confusion {
    /// What had been added, `none` among it.
    pub truths: Vec<String>,
    /// What was announced first, `none` and `unknown` among it.
    pub answers: Vec<String>,
    /// Cases, a row for each truth.
    pub counts: Vec<Vec<usize>>,
}

impl Confusion {
    pub(super) fn of_diagnosed(diagnosed: &[DiagnosedCase]) -> Self {
        let singles = diagnosed.iter().filter(|case| case.label.kind != GapKind::Pair);
        Self::of(singles.map(|case| (truth(case), answer(case))).collect())
    }

    /// Of what had been added and what was announced first, case by case.
    pub fn of(pairs: Vec<(String, String)>) -> Self {
        let truths = in_order(pairs.iter().map(|(truth, _)| truth));
        let answers = in_order(pairs.iter().map(|(_, answer)| answer));
        let count = |truth: &String, answer: &String| {
            pairs.iter().filter(|(was, told)| was == truth && told == answer).count()
        };
        let counts =
            truths.iter().map(|truth| answers.iter().map(|answer| count(truth, answer)).collect()).collect();
        Self { truths, answers, counts }
    }
}

fn truth(case: &DiagnosedCase) -> String {
    case.label.effects.first().cloned().unwrap_or_else(|| "none".to_owned())
}

fn answer(case: &DiagnosedCase) -> String {
    match (case.answer.verdict, case.answer.effects.first()) {
        (Verdict::None, _) | (Verdict::Effects, None) => "none".to_owned(),
        (Verdict::Unknown, _) | (_, None) => "unknown".to_owned(),
        (_, Some(effect)) => effect.id.clone(),
    }
}

/// Each once: effects in the catalogue's order, then what is none of it, `none` and `unknown` last.
fn in_order<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut names: Vec<String> = names.cloned().collect();
    let catalogue = bicycle::effect::CATALOGUE;
    let place = |name: &String| match name.as_str() {
        "none" => usize::MAX - 1,
        "unknown" => usize::MAX,
        name => catalogue.iter().position(|effect| effect.id == name).unwrap_or(catalogue.len()),
    };
    names.sort_by(|a, b| place(a).cmp(&place(b)).then_with(|| a.cmp(b)));
    names.dedup();
    names
}
