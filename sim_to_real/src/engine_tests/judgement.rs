//! Odds, probabilities, credible sets, the price of a second effect and the rule of the unknown.

use super::effect;
use crate::answer::{Support, Verdict};
use crate::attitude::AttitudeEvidence;
use crate::attitude::tests::dragged;
use crate::baseline::Null;
use crate::causes::Explanation;
use crate::judgement::{Judgement, Single, Weighed};
use crate::limits_shown::LimitsShown;
use crate::score_test::Chance;
use proptest::prelude::*;

const SINGLES: [(&str, f64); 5] = [
    ("steer_lag", 0.2),
    ("steer_delay", 0.1),
    ("steer_gain", 0.9),
    ("speed_scale", 0.9),
    ("rolling_drag", 0.3),
];

/// A null of loss 1.
fn null() -> Null {
    Null {
        error: 1.0,
        loss: 1.0,
        chance: Chance::default(),
        gain_of_two: 0.0,
        limits_shown: LimitsShown::default(),
        cells: Vec::new(),
        starts: Vec::new(),
    }
}

/// An effect that divides the loss by so much, and which both drives ask for in proportion.
fn single((id, value): (&str, f64), none: f64, loss: f64) -> Single {
    let gain = (none / loss).ln();
    let strength = 20.0 * gain.max(0.0).sqrt();
    let support = Support { gain, strength, least_strength: 0.7 * strength, nominal: 0.0, attitude: 0.0 };
    Single { explanation: Explanation::new(vec![effect(id, value)], loss), support }
}

/// Singles of the list with these losses, sorted as they come.
fn weighed(none: f64, losses: &[f64], pair: Option<f64>) -> Weighed {
    let mut singles: Vec<Single> =
        SINGLES.iter().zip(losses).map(|(&own, &loss)| single(own, none, loss)).collect();
    singles.sort_by(|a, b| a.explanation.loss.total_cmp(&b.explanation.loss));
    let both = [SINGLES[0], SINGLES[3]].map(|(id, value)| effect(id, value));
    let pairs = pair.map(|loss| Explanation::new(both.to_vec(), loss)).into_iter().collect();
    of(none, singles, pairs)
}

/// Of numbers that all robots have.
fn of(none: f64, singles: Vec<Single>, pairs: Vec<Explanation>) -> Weighed {
    let attitude = AttitudeEvidence::default();
    Weighed { none: Explanation::new(Vec::new(), none), singles, pairs, numbers_ratio: 1.0, attitude }
}

fn judged(none: f64, losses: &[f64], pair: Option<f64>) -> Judgement {
    weighed(none, losses, pair).judge(&null())
}

fn announced(judgement: &Judgement) -> Vec<&str> {
    judgement.announced.iter().map(|effect| effect.description().id).collect()
}

fn score(judgement: &Judgement, id: &str) -> f64 {
    judgement.ranking.iter().find(|ranked| ranked.id == id).unwrap().score
}

#[test]
fn a_gain_that_drives_hardly_ask_for_is_nothing_and_a_large_one_is_announced() {
    let at = |gain: f64| judged(1.3, &[1.3 * (-gain).exp(), 1.3, 1.3, 1.3, 1.3], None);
    assert_eq!(at(0.0).verdict, Verdict::None);
    assert_eq!(at(0.01).verdict, Verdict::None);
    assert_eq!(announced(&at(0.2)), ["steer_lag"]);
    // Once announced, it stays so for every larger gain.
    let first = (0..60).find(|k| at(0.01 * f64::from(*k)).verdict != Verdict::None).unwrap();
    assert!((first..60).all(|k| announced(&at(0.01 * f64::from(k))) == ["steer_lag"]), "from {first}");
}

/// What one drive asks for and the other does not, and what nominal drives ask for, is believed less.
#[test]
fn what_drives_do_not_agree_on_is_believed_less() {
    let announced_with = |change: &dyn Fn(&mut Support)| {
        let mut weighed = weighed(1.3, &[1.13, 1.3, 1.3, 1.3, 1.3], None);
        change(&mut weighed.singles[0].support);
        let judgement = weighed.judge(&null());
        (announced(&judgement).len(), score(&judgement, "steer_lag"))
    };
    let (n, whole) = announced_with(&|_| ());
    let (n_of_one, of_one) = announced_with(&|support| support.least_strength = 0.0);
    let (_, of_nominal) = announced_with(&|support| support.nominal = 0.5);
    assert_eq!((n, n_of_one), (1, 0));
    assert!(of_one < whole && of_nominal < whole, "{whole} {of_one} {of_nominal}");
}

#[test]
fn a_second_effect_has_its_own_price() {
    let losses = [2.0, 3.5, 3.8, 3.9, 4.0];
    assert_eq!(announced(&judged(4.0, &losses, Some(1.95))), ["steer_lag"]);
    assert_eq!(announced(&judged(4.0, &losses, Some(1.0))), ["steer_lag", "speed_scale"]);
    // 1.76 is 0.128 below the single in the logarithm, 1.79 is 0.111.
    assert_eq!(announced(&judged(4.0, &losses, Some(1.76))).len(), 2);
    assert_eq!(announced(&judged(4.0, &losses, Some(1.79))).len(), 1);
    let credible = judged(4.0, &losses, Some(1.0)).credible_set;
    assert_eq!(credible, ["steer_lag", "speed_scale"], "of a pair, its members");
}

/// Two effects are as probable as the first one alone times what the second adds: where nothing supports the first, a second
/// that gains little more than its price does not make up for that.
#[test]
fn a_second_effect_does_not_make_up_for_a_first_that_nothing_supports() {
    let announced_of = |pair: f64| {
        let mut weighed = weighed(2.0, &[1.99, 2.0, 2.0, 2.0, 2.0], Some(pair));
        weighed.singles[0].support =
            Support { gain: 0.0, strength: 0.0, least_strength: 0.0, nominal: 0.0, attitude: 0.0 };
        announced(&weighed.judge(&null())).len()
    };
    // 0.17 and 0.5 in the logarithm.
    assert_eq!((announced_of(1.99 * (-0.17_f64).exp()), announced_of(1.99 * (-0.5_f64).exp())), (0, 2));
}

/// What halves a rest of a hundredth is no second effect: of 73, 0.94 are left, and 0.47 are 0.6 per cent. The same pair
/// counts where there was less to explain, 0.47 of 20 being 2.4.
#[test]
fn a_second_effect_that_mends_the_first_is_none() {
    let announced_of = |none: f64| judged(none, &[0.94, 8.0, 68.0, 70.0, 72.0], Some(0.47)).announced.len();
    assert_eq!((announced_of(73.0), announced_of(20.0)), (1, 2));
}

/// Two effects that do the same to the rollouts are told apart by how the body leans, and one that hardly shows there is told.
#[test]
fn how_the_body_leans_tells_a_drag_from_a_scale_of_the_speed() {
    let announced_of = |attitude: f64, loss: f64| {
        let mut weighed = weighed(1.3, &[1.3, 1.3, 1.3, loss - 0.001, loss], None);
        let drag = weighed.singles.iter_mut().find(|single| single.explanation.ids() == ["rolling_drag"]);
        drag.unwrap().support.attitude = attitude;
        weighed.judge(&null()).announced.first().map(|effect| effect.description().id)
    };
    assert_eq!((announced_of(0.0, 1.1), announced_of(5.0, 1.1)), (Some("speed_scale"), Some("rolling_drag")));
    assert_eq!((announced_of(0.0, 1.28), announced_of(7.0, 1.28)), (None, Some("rolling_drag")));
}

/// Of a pair that is named, the one that is likelier alone comes first, however it was found.
#[test]
fn the_likelier_of_two_is_named_first() {
    let named = |attitude: f64| {
        let mut singles = vec![single(SINGLES[3], 4.0, 2.0), single(SINGLES[4], 4.0, 2.1)];
        singles[1].support.attitude = attitude;
        let both = [SINGLES[3], SINGLES[4]].map(|(id, value)| effect(id, value));
        let judgement = of(4.0, singles, vec![Explanation::new(both.to_vec(), 1.0)]).judge(&null());
        announced(&judgement).into_iter().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(named(0.0), ["speed_scale", "rolling_drag"]);
    assert_eq!(named(5.0), ["rolling_drag", "speed_scale"]);
}

/// A drag that takes a hundredth off is no second effect, unless the body leans against it: by 10 standard deviations,
/// 9 / 2 ln(108 / 8) - 1 = 10.7, where gain and price are (0.01 - 0.12) / 0.035 = -3.1.
#[test]
fn a_second_that_the_body_leans_against_needs_no_share() {
    let announced_with = |attitude: AttitudeEvidence| {
        let singles = vec![single(SINGLES[0], 73.0, 0.94), single(SINGLES[4], 73.0, 72.0)];
        let both = [SINGLES[0], SINGLES[4]].map(|(id, value)| effect(id, value));
        let pair = Explanation::new(both.to_vec(), 0.94 * (-0.01_f64).exp());
        Weighed { attitude, ..of(73.0, singles, vec![pair]) }.judge(&null()).announced.len()
    };
    assert_eq!((announced_with(dragged(0.0)), announced_with(dragged(10.0))), (1, 2));
}

/// A second effect that shapes the same answer is dearer: 0.25 in the logarithm is enough for a gain, and for neither a delay
/// nor understeer.
#[test]
fn a_second_effect_in_the_same_answer_is_dearer() {
    let with = |second: (&str, f64)| {
        let pair = Explanation::new(vec![effect("steer_lag", 0.2), effect(second.0, second.1)], 2.0);
        let singles = vec![single(SINGLES[0], 6.0, 2.0 * 0.25_f64.exp())];
        of(6.0, singles, vec![pair]).judge(&null()).announced.len()
    };
    assert_eq!([SINGLES[1], ("understeer", 0.01), SINGLES[2]].map(with), [1, 1, 2]);
}

/// Nothing worth a name is explained and much is left: unknown. Much is left beside a name beyond doubt: both. Little is left:
/// effects.
#[test]
fn what_exceeds_the_floor_and_a_share_of_the_gap_is_unknown() {
    let with = |loss: f64| judged(20.0, &[loss, 19.9, 19.9, 19.9, 19.9], None);
    assert_eq!(with(1.1).verdict, Verdict::Effects);
    // 9.3 of 19 are left, 0.49; 16 of 19 are.
    for loss in [10.3, 17.0] {
        assert_eq!(with(loss).verdict, Verdict::EffectsAndUnknown);
        assert_eq!(announced(&with(loss)), ["steer_lag"]);
    }
    let nothing = with(19.5);
    assert_eq!(nothing.verdict, Verdict::Unknown);
    assert!(nothing.announced.is_empty());
    // Three floors above it and nothing gained at all.
    assert_eq!(judged(9.0, &[9.0; 5], None).verdict, Verdict::Unknown);
    // In reach of the null a rest is no unknown, whatever its share.
    assert_eq!(judged(1.2, &[1.2; 5], None).verdict, Verdict::None);
}

/// Where the best explanation is a limit that nominal drives never came near, nothing is announced, and no rival takes its
/// place.
#[test]
fn a_limit_that_nominal_drives_would_not_have_shown_is_no_sign() {
    let at = |value: f64| {
        let singles = vec![single(("accel_limit", value), 2.0, 1.0), single(SINGLES[0], 2.0, 1.1)];
        let null = Null { limits_shown: LimitsShown::from_iter([effect("accel_limit", 2.0)]), ..null() };
        of(2.0, singles, Vec::new()).judge(&null)
    };
    assert_eq!(announced(&at(1.9)), ["accel_limit"]);
    assert!(announced(&at(2.1)).is_empty());
}

/// Beside such a limit the other effect of a pair is announced as it would be alone; beside a limit that was reached, both.
#[test]
fn a_limit_that_would_not_have_shown_takes_no_other_name_with_it() {
    let at = |value: f64| {
        let limit = effect("accel_limit", value);
        let pair = Explanation::new(vec![effect("steer_lag", 0.2), limit], 1.0);
        let singles = vec![single(SINGLES[0], 3.0, 1.6), single(("accel_limit", value), 3.0, 2.9)];
        let null = Null { limits_shown: LimitsShown::from_iter([effect("accel_limit", 2.0)]), ..null() };
        of(3.0, singles, vec![pair]).judge(&null)
    };
    assert_eq!(announced(&at(1.9)), ["steer_lag", "accel_limit"]);
    assert_eq!(announced(&at(2.1)), ["steer_lag"]);
}

/// One that foretells other drives a tenth worse has half a tenth more energy.
#[test]
fn what_foretells_worse_has_more_energy() {
    let own = Explanation { foretold_loss: 1.1, ..Explanation::new(vec![effect("steer_lag", 0.2)], 1.0) };
    assert!((own.energy() - 0.5 * 1.1_f64.ln()).abs() < 1e-12);
}

proptest! {
    /// Without pairs no two effects are true together: their probabilities and that of none add up to one.
    #[test]
    fn probabilities_add_up(none in 1.0..3.0_f64, losses in prop::collection::vec(0.8..3.0_f64, 5)) {
        let judgement = judged(none, &losses, None);
        let sum: f64 = judgement.ranking.iter().map(|ranked| ranked.score).sum();
        prop_assert!(sum <= 1.0 + 1e-9);
        prop_assert!(judgement.ranking.windows(2).all(|pair| pair[0].score >= pair[1].score));
        prop_assert!(judgement.ranking.iter().all(|ranked| (0.0..=1.0).contains(&ranked.score)));
        // Where none is out of the question nothing is left for it.
        let certain = judged(1e3, &losses, None);
        let sum: f64 = certain.ranking.iter().map(|ranked| ranked.score).sum();
        prop_assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    }

    /// With a pair the expected number of effects lies between none and two, and a better pair makes its members
    /// likelier and nobody else.
    #[test]
    fn a_better_pair_makes_its_members_likelier(losses in prop::collection::vec(1.0..3.0_f64, 5), pair in 0.5..2.0_f64) {
        let [worse, better] = [1.1 * pair, pair].map(|loss| judged(4.0, &losses, Some(loss)));
        for judgement in [&worse, &better] {
            let sum: f64 = judgement.ranking.iter().map(|ranked| ranked.score).sum();
            prop_assert!((0.0..=2.0 + 1e-9).contains(&sum));
        }
        for (place, (id, _)) in SINGLES.iter().enumerate() {
            let gained = score(&better, id) - score(&worse, id);
            prop_assert!(if [0, 3].contains(&place) { gained >= -1e-9 } else { gained <= 1e-9 }, "{id}: {gained}");
        }
    }

    /// The set holds the best single; what is in it fits at least as well as what is not; a worse rival never enters.
    #[test]
    fn credible_sets_are_monotone(losses in prop::collection::vec(1.0..1.6_f64, 5), worse in 1.0..1.5_f64) {
        let before = judged(3.0, &losses, None);
        let mut order: Vec<usize> = (0..5).collect();
        order.sort_by(|a, b| losses[*a].total_cmp(&losses[*b]));
        let names: Vec<&str> = order.iter().map(|place| SINGLES[*place].0).collect();
        let n = before.credible_set.len();
        prop_assert!(n >= 1);
        prop_assert_eq!(&before.credible_set, &names[..n]);
        // Of what is probable without none, the set holds 0.85 or has four names.
        let of = |ids: &[&str]| ids.iter().map(|id| score(&before, id)).sum::<f64>();
        prop_assert!(n == 4 || of(&names[..n]) >= 0.85 * of(&names) - 1e-9);
        prop_assert!(n == 1 || of(&names[..n - 1]) < 0.85 * of(&names));
        let rival = order[4];
        let mut changed = losses.clone();
        changed[rival] *= worse;
        let after = judged(3.0, &changed, None);
        let holds = |judgement: &Judgement| judgement.credible_set.iter().any(|id| id == SINGLES[rival].0);
        prop_assert!(holds(&before) || !holds(&after));
    }
}

/// Numbers that no effect changes make the logarithms of all losses less, here 1.2 times; what is found is the same.
#[test]
fn numbers_that_no_effect_changes_hide_none() {
    let (none, losses, pair) = (3.0, [1.9, 2.2, 2.5, 2.4, 2.9], 1.1);
    let without = weighed(none, &losses, Some(pair));
    let less = |loss: f64| loss.powf(1.0 / 1.2);
    let mut with = Weighed { numbers_ratio: 1.2, ..weighed(less(none), &losses.map(less), Some(less(pair))) };
    let supports = without.singles.iter().map(|single| single.support);
    with.singles.iter_mut().zip(supports).for_each(|(single, support)| single.support = support);
    let [without, with] = [without, with].map(|weighed| weighed.judge(&null()));
    assert_eq!(announced(&with), ["steer_lag", "speed_scale"]);
    assert_eq!(announced(&without), announced(&with));
    for (id, _) in SINGLES {
        assert!((score(&without, id) - score(&with, id)).abs() < 1e-9, "{id}");
    }
}
