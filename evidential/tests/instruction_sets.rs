//! Maps on every instruction set of the machine: the prior's are the same bits, the learned ones differ in rounding.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

mod untrained;

use std::sync::Arc;

use bicycle::lanes::{Instructions, Isa};
use evidential::{BeliefMap, Learned, Method, Unfamiliar};
use physics_prior::{Assumption, PriorMap};
use terrain::{GridGeometry, GridMap, SurfaceCell};
use traversability::{CvarLevel, Risk};
use untrained::{CAR, checkpoint, rough};

const SURFACE: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-4, 7], n_rows: 36, n_cols: 42 };
const RISK: GridGeometry = GridGeometry { resolution_m: 0.1, origin: [-2, 8], n_rows: 33, n_cols: 37 };
const N_YAWS: usize = 7;

fn numbers(risk: &Risk) -> [f32; 4] {
    [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad]
}

fn learned_risks(surface: &GridMap<SurfaceCell>, method: Method, instructions: Instructions) -> Vec<Risk> {
    let checkpoint = Arc::new(checkpoint(method, 5));
    let level = CvarLevel::new(0.4).unwrap();
    let learned = Learned { checkpoint, unfamiliar: Unfamiliar::Fuse, obstacle_margin_m: 0.0, level };
    let mut map = BeliefMap::new(&CAR, &learned, 0.1, RISK, N_YAWS, instructions).unwrap();
    map.update_all(surface).unwrap();
    map.risk_map().view().risks.to_vec()
}

#[test]
fn a_learned_map_differs_in_rounding_from_the_portable_one() {
    let surface = rough(SURFACE, 2);
    for method in [Method::Pietra, Method::Vanilla] {
        let portable = learned_risks(&surface, method, Instructions::Portable);
        for instructions in Instructions::all() {
            let risks = learned_risks(&surface, method, instructions);
            let differences = risks.iter().zip(&portable).flat_map(|(risk, expected)| {
                let (found, expected) = (numbers(risk), numbers(expected));
                [0, 1, 2, 3].map(|part| (found[part] - expected[part]).abs())
            });
            let largest = differences.fold(0.0, f32::max);
            assert!(largest < 2e-5, "{method:?}, {instructions:?}: {largest}");
            assert_eq!(largest > 0.0, instructions.isa() != Isa::Portable, "its own kernels made it");
        }
    }
}

#[test]
fn the_priors_map_is_the_same_bits_on_every_instruction_set() {
    let surface = rough(SURFACE, 3);
    let assumption = Assumption::Physics {
        prior: checkpoint(Method::Pietra, 5).sidecar.prior,
        level: CvarLevel::new(0.4).unwrap(),
    };
    let risks = |instructions: Instructions| {
        let mut map = PriorMap::new(&CAR, &assumption, 0.1, RISK, N_YAWS, instructions).unwrap();
        map.update_all(&surface).unwrap();
        map.risk_map().view().risks.iter().map(|risk| numbers(risk).map(f32::to_bits)).collect::<Vec<_>>()
    };
    let portable = risks(Instructions::Portable);
    for instructions in Instructions::all() {
        assert!(risks(instructions) == portable, "{instructions:?}");
    }
}
