//! The learning benchmark on made-up footprints: closed forms, and the same report for any number of threads.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use bench::collection::HeightScale;
use bench::learning::{Absurd, Chosen, Ground, Plan, Report, Request, Row, Testbed, judge};
use evidential::{
    Dataset, DatasetOrigin, Example, FeatureLayout, Method, PARAMETER_BINS, Selection, Selections, Settings,
    fingerprint,
};
use scenarios::RockFieldConfig;
use traversability::N_BINS;

/// Ground up to here is in distribution [m].
const EVEN_M: f32 = 0.3;

/// Footprints whose first feature is their unevenness; traction falls and angles rise with it, and the physics prior
/// knows all but angular traction, of which every third is missing.
fn dataset(n: usize, [from_m, to_m]: [f32; 2]) -> Dataset {
    let vehicle = formats::read_vehicle("pietra_full_size").unwrap();
    let layout = FeatureLayout::for_vehicle(&vehicle.geometry);
    let example = |k: usize| {
        let unevenness_m = from_m + (to_m - from_m) * (k as f32 * 0.618_034).fract();
        let mut features = vec![0.0; layout.n_features()];
        features.iter_mut().take(20).for_each(|feature| *feature = unevenness_m);
        let angular = if k.is_multiple_of(3) { f32::NAN } else { 1.0 - 0.9 * unevenness_m };
        let measured = [1.0 - unevenness_m, angular, 0.8 * unevenness_m, 0.5 * unevenness_m];
        let prior = std::array::from_fn(|head| {
            let bin = if head == 1 { None } else { PARAMETER_BINS[head].bin_of(measured[head]) };
            std::array::from_fn(|b| bin.map_or(1.0 / N_BINS as f32, |bin| f32::from(u8::from(b == bin))))
        });
        Example { features, measured, prior, unevenness_m, drive: k as u32 % 8, pose: [0.0; 3] }
    };
    let origin = DatasetOrigin {
        vehicle: vehicle.name.clone(),
        layout,
        prior: physics_prior::PriorConfig::default(),
        drives: (0..8).map(|drive| format!("drive {drive}")).collect(),
        provenance: String::new(),
    };
    Dataset { origin, examples: (0..n).map(example).collect() }
}

fn testbed() -> Testbed {
    let request = Request {
        vehicle: formats::read_vehicle("pietra_full_size").unwrap(),
        field: RockFieldConfig::testbed(),
        seed: 1,
        n_maps: 2,
        n_trials: 4,
        n_threads: 1,
    };
    Testbed {
        training: dataset(300, [0.0, EVEN_M]),
        validation: dataset(100, [0.01, EVEN_M]),
        test: dataset(400, [0.0, 1.0]),
        elsewhere: dataset(300, [0.0, 1.0]),
        unevenness_max_m: EVEN_M,
        height_scale: HeightScale { scale: 1.5, share: 0.7, rounds: Vec::new() },
        request,
    }
}

fn measured(n_threads: usize) -> Report {
    let (testbed, plan) = (testbed(), Plan::new(&Selections::default(), 2, Some(3)));
    let trained = plan.train(&testbed, "here", n_threads, &|| false, &|_| ()).unwrap();
    judge(&testbed, &plan, &trained, n_threads).unwrap()
}

/// EMD2 of the uniform distribution to a bin: sum of (k/12)^2 below it and of ((12 - k)/12)^2 from it on.
fn uniform_error(bin: usize) -> f64 {
    let share = |k: usize| k as f64 / N_BINS as f64;
    let below: f64 = (1..=bin).map(|k| share(k).powi(2)).sum();
    below + (bin + 1..=N_BINS).map(|k| share(N_BINS - k).powi(2)).sum::<f64>()
}

#[test]
fn priors_have_the_errors_of_their_closed_forms() {
    let report = measured(2);
    let (testbed, uniform) = (testbed(), report.row(Row::UniformPrior));
    let domains = [(true, &uniform.in_distribution), (false, &uniform.out_of_distribution)];
    for (is_even, domain) in domains {
        for (head, found) in domain.heads.iter().enumerate() {
            let there = testbed.test.examples.iter().filter(|e| (e.unevenness_m <= EVEN_M) == is_even);
            let bins: Vec<usize> =
                there.filter_map(|e| PARAMETER_BINS[head].bin_of(e.measured[head])).collect();
            let expected = bins.iter().map(|&bin| uniform_error(bin)).sum::<f64>() / bins.len() as f64;
            assert!((found.mean - expected).abs() < 1e-9, "{head}: {} {expected}", found.mean);
            assert_eq!(found.deviation, 0.0);
        }
    }
    let physics = &report.row(Row::PhysicsPrior).out_of_distribution;
    for head in [0, 2, 3] {
        assert!(physics.heads[head].mean < 1e-9 && physics.excess[head] < 0.0, "{head}");
    }
    assert!((physics.heads[1].mean - uniform.out_of_distribution.heads[1].mean).abs() < 1e-6);
    let n_even = testbed.test.examples.iter().filter(|example| example.unevenness_m <= EVEN_M).count();
    assert_eq!(report.testbed.n_test_in_distribution, n_even);
    assert_eq!(report.unevenness_bins.iter().map(|bin| bin.n).sum::<usize>(), 400);
    let evidence = report.evidence_of(Row::Pietra).unwrap();
    assert_eq!(evidence.on(Ground::InDistribution).unwrap().n, n_even);
    assert_eq!(evidence.on(Ground::Absurd(Absurd::Noise)).unwrap().n, n_even);
    assert!(report.evidence_of(Row::Vanilla).is_none() && report.evidence_of(Row::Switch).is_none());
}

#[test]
fn report_does_not_depend_on_the_number_of_threads() {
    // NaN where nothing was measured equals itself in words alone.
    assert_eq!(format!("{:?}", measured(1)), format!("{:?}", measured(3)));
}

#[test]
fn interruption_leaves_no_tables() {
    let plan = Plan::new(&Selections::default(), 1, Some(3));
    let refused = plan.train(&testbed(), "here", 2, &|| true, &|_| ()).unwrap_err();
    assert_eq!(refused.to_string(), "interrupted before all trainings were done");
}

#[test]
fn parameters_say_what_data_they_were_chosen_on() {
    let testbed = testbed();
    let selection = |method: Method| Selection {
        settings: Settings::new(method, 1),
        validation_emd2: [0.0; 4],
        validation_total: 0.0,
        validation_deviation: 0.0,
        validation_standard_error: 0.0,
        n_seeds: 1,
    };
    let chosen = |data: String| {
        let selections = Method::ALL.map(selection).to_vec();
        let plan = Plan::new(&Selections { data, selections, ..Selections::default() }, 1, Some(1));
        let trained = plan.train(&testbed, "here", 2, &|| false, &|_| ()).unwrap();
        judge(&testbed, &plan, &trained, 2).unwrap().chosen
    };
    assert_eq!(chosen(fingerprint(&testbed.training, &testbed.validation).unwrap()), Chosen::SearchHere);
    assert_eq!(chosen("other".to_owned()), Chosen::SearchElsewhere);
    assert_eq!(measured(1).chosen, Chosen::Defaults);
}
