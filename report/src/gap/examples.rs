//! A diagnosis with a steering lag, for tests.

use std::collections::BTreeMap;

use sim_to_real::{
    BeforeAfter, Condition, ConditionBin, ConditionTable, Division, Estimate, GroundResidual, LeftBin,
    LeftOver, NamedEffect, PartEstimate, Place, QuantityError, Ranked, ResidualState, Shrink, Spectrum,
    Steering, Support, SwingOver, Verdict,
};

use super::{HeldOutSample, HeldOutStrip};
use sim_to_real::{Answer, Findings, GroundMap, ResidualCell};

pub(crate) fn answer() -> Answer {
    let estimate = Estimate { value: 0.21, low: 0.18, high: 0.24 };
    let parameters = BTreeMap::from([("time_constant_s".to_owned(), estimate)]);
    let support = Support { gain: 0.8, strength: 9.3, least_strength: 8.1, nominal: 0.02, attitude: 0.0 };
    let ranked = |(id, score): (&str, f64)| Ranked { id: id.to_owned(), score, support: Some(support) };
    let ranking = [("steer_lag", 0.93), ("steer_delay", 0.05), ("backlash", 0.01), ("understeer", 0.001)];
    Answer {
        schema_version: sim_to_real::SCHEMA_VERSION,
        case: "steering <late>".to_owned(),
        steering: Steering::Angle,
        verdict: Verdict::Effects,
        effects: vec![NamedEffect { id: "steer_lag".to_owned(), form: None, parameters }],
        by_part: by_part(),
        left: Vec::new(),
        swing: None,
        leaning: None,
        ranking: ranking.map(ranked).to_vec(),
        credible_set: vec!["steer_lag".to_owned(), "steer_delay".to_owned()],
        places: vec![Place { condition: Condition::SteeringChange, share: 0.61 }],
        shrink: Shrink {
            metric: "normalised held-out rollout error".to_owned(),
            before: Some(2.1),
            after: Some(0.4),
            floor: 0.35,
            closed: Some(0.97),
            closed_low: Some(0.9),
            closed_high: Some(1.0),
            predicted_closed: Some(0.95),
            learned_bound_closed: None,
            position_error_2s_m: Some(BeforeAfter { before: 0.289, after: 0.101 }),
        },
        errors_by_quantity: [(ResidualState::Yaw, 0.021, 0.004), (ResidualState::Along, 0.2, 0.05)]
            .map(|(quantity, before, after)| QuantityError {
                quantity,
                unit: quantity.unit().to_owned(),
                horizon_s: 2.0,
                before,
                after,
                floor: 0.003,
            })
            .to_vec(),
        pose_sensor: None,
        controller_model: None,
        in_simulator: None,
        advice: vec!["drive steps of the steering & sines".to_owned()],
    }
}

/// A lag that grows along the drives, and is told badly by the first of them.
fn by_part() -> Vec<PartEstimate> {
    let part = |division, [from, to]: [Option<f64>; 2], [value, half]: [f64; 2]| PartEstimate {
        effect: "steer_lag".to_owned(),
        parameter: "time_constant_s".to_owned(),
        division,
        from,
        to,
        n_rollouts: 90,
        estimate: Estimate { value, low: value - half, high: value + half },
    };
    let quarters = (0..4).map(|k| {
        let ends = [k, k + 1].map(|k| Some(0.25 * f64::from(k)));
        part(Division::Time, ends, [0.15 + 0.04 * f64::from(k), 0.02])
    });
    let others = [
        part(Division::Drive, [Some(1.0); 2], [0.25, 2.0]),
        part(Division::Drive, [Some(2.0); 2], [0.2, 0.02]),
        part(Division::Steering, [None, Some(0.0)], [0.21, 0.02]),
        part(Division::Steering, [Some(0.0), None], [0.22, 0.02]),
    ];
    quarters.chain(others).collect()
}

/// A yaw rate that falls short to the right and a speed that does on class 2.
pub(crate) fn left() -> Vec<LeftOver> {
    let bin = |[low, high]: [f64; 2], mean: f64| LeftBin { low, high, n: 40, mean, null_mean: Some(0.001) };
    let side = (0..8).map(|k| {
        let ends = [k, k + 1].map(|k| 0.75 * f64::from(k) - 3.0);
        bin(ends, -0.04 + 0.01 * f64::from(k))
    });
    let class = (0..3).map(|k| {
        let ends = [k, k + 1].map(|k| f64::from(k) - 0.5);
        LeftBin { null_mean: None, ..bin(ends, -0.15 * f64::from(k)) }
    });
    let shape =
        |quantity, condition, share, bins| LeftOver { quantity, condition, horizon_s: 1.2, share, bins };
    vec![
        shape(ResidualState::YawRate, Condition::LateralAcceleration, 0.31, side.collect()),
        shape(ResidualState::ForwardSpeed, Condition::TerrainClass, 0.12, class.collect()),
    ]
}

/// Residuals that grow with the change of steering and lie in the north.
pub(crate) fn findings() -> Findings {
    let conditions = [
        (Condition::SteeringChange, 0.61, 1.2),
        (Condition::LateralAcceleration, 0.2, 9.0),
        (Condition::Speed, 0.05, 6.0),
        (Condition::Heading, 0.01, 3.1),
        (Condition::TerrainClass, -0.01, 2.0),
        (Condition::Pitch, 0.0, 0.2),
        (Condition::Constant, 0.02, 0.0),
    ];
    let table = |(condition, share, reach): (Condition, f64, f64)| ConditionTable {
        condition,
        share,
        null_share: 0.04,
        announced_share: (share > 0.0).then_some(0.9 * share),
        bins: (0..8)
            .map(|bin| ConditionBin {
                low: reach * f64::from(bin) / 8.0,
                high: reach * f64::from(bin + 1) / 8.0,
                n: 40,
                mean_square: 1.0 + share * f64::from(bin * bin),
                null_mean_square: if bin == 7 { f64::NAN } else { 1.0 },
            })
            .collect(),
    };
    Findings {
        conditions: conditions.map(table).to_vec(),
        residuals: cells(),
        map: ground_residuals(),
        spectrum: Some(spectrum()),
    }
}

/// One line among many.
fn spectrum() -> Spectrum {
    let frequencies: Vec<f64> = (0..400).map(|k| 0.5 + 0.0125 * f64::from(k)).collect();
    let nominal = frequencies.iter().map(|own| 1.5 + (40.0 * own).sin()).collect();
    let real = frequencies.iter().map(|own| if (own - 1.3).abs() < 0.01 { 120.0 } else { 1.0 }).collect();
    Spectrum { over: SwingOver::Time, frequencies, real, nominal }
}

pub(crate) fn cells() -> Vec<ResidualCell> {
    let states = [
        ResidualState::Along,
        ResidualState::Across,
        ResidualState::Yaw,
        ResidualState::ForwardSpeed,
        ResidualState::YawRate,
        ResidualState::SideSpeed,
    ];
    let of_state = |(place, state): (usize, ResidualState)| {
        [0.3, 0.6, 1.2, 2.0].map(|horizon_s| ResidualCell {
            state,
            horizon_s,
            before: 1.0 + place as f64 * (1.0 - (-horizon_s / 0.4_f64).exp()),
            after: 1.1 + 0.05 * place as f64,
            floor: 1.0,
        })
    };
    states.into_iter().enumerate().flat_map(of_state).collect()
}

fn ground_residuals() -> Vec<GroundResidual> {
    let at = |k: usize| {
        let angle = 0.05 * k as f64;
        let (x_m, y_m) = (30.0 * angle.sin(), 20.0 * (2.0 * angle).sin());
        GroundResidual { x_m, y_m, before: 1.0 + (y_m / 5.0).max(0.0), after: 1.0 + 0.1 * angle.cos().abs() }
    };
    (0..400).map(at).collect()
}

pub(crate) fn strip() -> HeldOutStrip {
    let sample = |k: usize| {
        let time_s = 2.7 + 0.2 * k as f64;
        let rate = |lag_s: f64| 0.4 * (0.9 * (time_s - lag_s)).sin();
        let speed = |lag_s: f64| 4.0 + (0.3 * (time_s - lag_s)).sin();
        HeldOutSample {
            time_s,
            yaw_rate_radps: [rate(0.2), rate(0.0), rate(0.21)],
            speed_mps: [speed(0.0), speed(0.01), speed(0.0)],
            position_error_m: [0.3 * rate(0.0).abs() + 0.02, 0.03],
        }
    };
    HeldOutStrip {
        drive: "real_heldout.csv".to_owned(),
        horizon_s: 1.2,
        samples: (0..180).map(sample).collect(),
    }
}

pub(crate) fn ground() -> GroundMap {
    let n_nodes = [60, 60];
    let node = |index: usize| ((index / 60) as f64, (index % 60) as f64);
    let height = |index| (0.2 * node(index).0).sin() + (0.15 * node(index).1).cos();
    let class = |index| if node(index).0 > 40.0 { 2 } else { u8::from(node(index).1 < 15.0) };
    GroundMap {
        origin_m: [-30.0, -25.0],
        resolution_m: 1.0,
        n_nodes,
        height_m: (0..3600).map(|index| height(index) as f32).collect(),
        class: (0..3600).map(class).collect(),
    }
}
