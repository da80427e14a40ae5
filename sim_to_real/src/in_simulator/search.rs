//! One lever at a time, fitted by few runs: a scan, then the way to either neighbour of the best halved again and again.

use super::lever::Lever;
use super::replay::Setting;
use super::trial::Trial;

/// So many levers, the best of the scan, are fitted further, and of these as many as the second number to the end: a scan
/// shows at least 62 % of what a lever can do.
const N_REFINED: [usize; 2] = [8, 5];
/// Halvings, and how many of them the first number of levers take part in.
const N_ROUNDS: usize = 6;
const N_FIRST_ROUNDS: usize = 2;

/// A lever with every place that was tried, from low to high.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) lever: Lever,
    tried: Vec<Tried>,
}

/// A place, and the loss of every stretch there.
#[derive(Clone, Debug)]
struct Tried {
    place: f64,
    losses: Vec<f64>,
}

/// Levers beside what is known, best first; `without` are the losses with what is known alone.
pub(super) fn fitted<E>(
    trial: &Trial<'_, E>,
    (known, without): (&Setting, &[f64]),
    levers: &[Lever],
) -> Result<Vec<Fitted>, E> {
    let at_neutral = |lever: &Lever| Fitted {
        lever: lever.clone(),
        tried: vec![Tried { place: lever.neutral(), losses: without.to_vec() }],
    };
    let mut all: Vec<Fitted> = levers.iter().map(at_neutral).collect();
    let scan = |fitted: &Fitted| fitted.lever.tried();
    try_places(trial, known, &mut all, scan)?;
    for round in 0..N_ROUNDS {
        sort(&mut all);
        let n_refined = N_REFINED[usize::from(round >= N_FIRST_ROUNDS)].min(all.len());
        try_places(trial, known, &mut all[..n_refined], Fitted::halfway)?;
    }
    sort(&mut all);
    Ok(all)
}

/// A lever fitted on, alone, until what its place is off by is no second cause.
pub(super) fn polished<E>(trial: &Trial<'_, E>, fitted: &Fitted) -> Result<Fitted, E> {
    halved(trial, &Setting::new(), [fitted.clone()], N_ROUNDS)
}

/// A lever fitted again near where it is, beside what is known.
pub(super) fn refitted<E>(
    trial: &Trial<'_, E>,
    known: &Setting,
    (fitted, losses): (&Fitted, &[f64]),
) -> Result<Fitted, E> {
    let [low, high] = fitted.neighbours();
    let middle = fitted.place();
    let reach = 4.0 * (high - middle).max(middle - low);
    let [first, last] = fitted.lever.ends();
    let start =
        Fitted { lever: fitted.lever.clone(), tried: vec![Tried { place: middle, losses: losses.to_vec() }] };
    let mut one = [start];
    try_places(trial, known, &mut one, |_| vec![(middle - reach).max(first), (middle + reach).min(last)])?;
    halved(trial, known, one, N_ROUNDS / 2)
}

/// The way from the best place of a lever to either neighbour, halved so many times.
fn halved<E>(
    trial: &Trial<'_, E>,
    known: &Setting,
    mut one: [Fitted; 1],
    n_rounds: usize,
) -> Result<Fitted, E> {
    for _ in 0..n_rounds {
        try_places(trial, known, &mut one, Fitted::halfway)?;
    }
    let [found] = one;
    Ok(found)
}

fn sort(all: &mut [Fitted]) {
    all.sort_by(|a, b| a.loss().total_cmp(&b.loss()));
}

/// Tries places of many levers in one batch.
fn try_places<E>(
    trial: &Trial<'_, E>,
    known: &Setting,
    all: &mut [Fitted],
    places: impl Fn(&Fitted) -> Vec<f64>,
) -> Result<(), E> {
    let places: Vec<Vec<f64>> = all.iter().map(places).collect();
    let with = |lever: &Lever, place: f64| -> Setting {
        known.iter().cloned().chain([(lever.clone(), place)]).collect()
    };
    let settings: Vec<Setting> = all
        .iter()
        .zip(&places)
        .flat_map(|(fitted, places)| places.iter().map(|&place| with(&fitted.lever, place)))
        .collect();
    let mut losses = trial.losses(&settings)?.into_iter();
    for (fitted, places) in all.iter_mut().zip(&places) {
        let tried = places.iter().zip(losses.by_ref()).map(|(&place, losses)| Tried { place, losses });
        fitted.tried.extend(tried);
        fitted.tried.sort_by(|a, b| a.place.total_cmp(&b.place));
    }
    Ok(())
}

impl Fitted {
    fn best(&self) -> usize {
        let order =
            |a: &usize, b: &usize| mean(&self.tried[*a].losses).total_cmp(&mean(&self.tried[*b].losses));
        (0..self.tried.len()).min_by(order).unwrap_or(0)
    }

    /// The best place.
    pub(super) fn place(&self) -> f64 {
        self.tried[self.best()].place
    }

    /// Loss of every stretch at the best place.
    pub(super) fn losses(&self) -> &[f64] {
        &self.tried[self.best()].losses
    }

    pub(super) fn loss(&self) -> f64 {
        mean(self.losses())
    }

    /// The places tried next to the best one; beyond the last of them, the lever's end.
    fn neighbours(&self) -> [f64; 2] {
        let (best, [first, last]) = (self.best(), self.lever.ends());
        let below = if best == 0 { first } else { self.tried[best - 1].place };
        let above = self.tried.get(best + 1).map_or(last, |tried| tried.place);
        [below, above]
    }

    fn halfway(&self) -> Vec<f64> {
        let place = self.place();
        let ways = self.neighbours().map(|other| 0.5 * (place + other));
        ways.into_iter().filter(|way| (way - place).abs() > 1e-9).collect()
    }

    /// Loss of every stretch at the place that is best for the other parts of the drives.
    pub(super) fn foretold(&self, parts: &[usize]) -> Vec<f64> {
        let n_parts = parts.iter().max().map_or(0, |last| last + 1);
        let elsewhere = |tried: &Tried, part: usize| {
            let others = tried.losses.iter().zip(parts).filter(|(_, own)| **own != part);
            others.map(|(loss, _)| loss).sum::<f64>()
        };
        let best_elsewhere = |part: usize| {
            let order = |a: &&Tried, b: &&Tried| elsewhere(a, part).total_cmp(&elsewhere(b, part));
            self.tried.iter().min_by(order)
        };
        let best: Vec<Option<&Tried>> = (0..n_parts).map(best_elsewhere).collect();
        let of = |(stretch, part): (usize, &usize)| best[*part].map_or(f64::INFINITY, |t| t.losses[stretch]);
        parts.iter().enumerate().map(of).collect()
    }
}

/// Mean; of nothing, 0.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
