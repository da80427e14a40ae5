//! Shares of right answers with their intervals.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Hit, truth};
use crate::statistics::wilson_interval;

/// How many of how many.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Share {
    /// What of.
    pub name: String,
    /// How many were.
    pub n_hit: usize,
    /// Of how many.
    pub n: usize,
    /// Their ratio; `None` of nothing.
    pub share: Option<f64>,
    /// 95 % Wilson interval.
    pub wilson: [f64; 2],
}

impl Share {
    fn of(name: impl Into<String>, answers: impl IntoIterator<Item = bool>) -> Self {
        let (mut n_hit, mut n) = (0, 0);
        for is_hit in answers {
            n += 1;
            n_hit += usize::from(is_hit);
        }
        let share = (n > 0).then(|| n_hit as f64 / n as f64);
        Self { name: name.into(), n_hit, n, share, wilson: wilson_interval(n_hit, n) }
    }
}

fn is_physical(hit: &Hit) -> bool {
    hit.truth.iter().all(|id| truth::PHYSICAL.contains(&id.as_str()))
}

/// Everything that is counted over the whole set.
pub(super) fn overall(hits: &[Hit]) -> Vec<Share> {
    let share = |name: &str, of: fn(&Hit) -> Option<bool>| Share::of(name, hits.iter().filter_map(of));
    let physical = |hit: &Hit| hit.is_first_right.filter(|_| is_physical(hit));
    vec![
        share("single effect, first name right", |hit| hit.is_first_right),
        Share::of("single effect made by physics, first name right", hits.iter().filter_map(physical)),
        share("single effect, among the first two names", |hit| hit.is_in_first_two),
        share("single effect, in the credible set", |hit| hit.is_credible),
        share("single or pair, exactly what was added announced", |hit| hit.is_exact),
        share("pair, both announced", |hit| hit.are_both_named),
        share("nothing added, an effect announced", |hit| hit.is_false_alarm),
        share("unknown that no effect can stand for, flagged", |hit| hit.is_flagged),
        share("unknown that an effect can stand for, flagged or that named", |hit| {
            hit.is_flagged_or_mimicked
        }),
        share("single or pair, first place right", |hit| hit.is_place_right),
        Share::of(
            "parameter inside its 90 % interval",
            hits.iter().flat_map(|hit| hit.parameters.iter().map(|parameter| parameter.is_covered)),
        ),
    ]
}

/// First names of single effects by size, style, whether the gap is seen on held-out drives, plant and effect.
pub(super) fn broken_down(hits: &[Hit]) -> Vec<Share> {
    let mut groups: BTreeMap<(usize, String), Vec<bool>> = BTreeMap::new();
    for hit in hits {
        let Some(is_right) = hit.is_first_right else { continue };
        let keys = [
            format!("size {}", hit.magnitude),
            format!("style {}", hit.style),
            format!("gap on held-out drives {}", if hit.closed.is_some() { "seen" } else { "within noise" }),
            format!("plant {}", hit.plant),
            hit.truth.concat(),
        ];
        for (order, key) in keys.into_iter().enumerate() {
            groups.entry((order, key)).or_default().push(is_right);
        }
    }
    groups.into_iter().map(|((_, name), answers)| Share::of(name, answers)).collect()
}
