//! The parts in one object.

use bicycle::{Decision, Model};
use bus::ages::AgeLimits;
use bus::message::{DecisionRecord, Source};
use bus::payload::{RiskParts, cell_numbers, content_hash};
use navigator::{
    Assessor, Belief, Config, MessageId, Navigator, OdometryMessage, PilotAges, RiskMessage, ScanMessage,
    Setup, Surface,
};
use runtime::convert::decision_record;
use traversability::CvarLevel;

use super::schedule::{BEGAN_NS, Step};
use crate::corrector::CORRECTOR;
use crate::fixture::{ALPHA, SEED, ages, machine, task};

/// Of a map: the content, and of a risk map also what it says of itself, without the lives of publishers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Made {
    Surface { content: u64 },
    Risk { map_source: u64, content: u64, surface: u64, stuck: u64, times_ns: [u64; 2], goal: [u64; 2] },
    Decision { bits: u64, record: Shown },
}

/// What is shown of a decision when two differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    pub cycle: u64,
    pub decision: u32,
    pub reason: u32,
    pub map_source: u64,
    pub risk: u64,
    pub correction: u32,
}

pub fn config() -> Config {
    let (_, mut config) = machine();
    config.controller.recovery.patience_s = 1.0;
    config
}

pub fn navigator() -> Navigator {
    let ((vehicle, _), config, task) = (machine(), config(), task());
    let (model, level) = (Model::of(&vehicle), CvarLevel::new(ALPHA).unwrap());
    let physics = Assessor::new(&vehicle, &model.limits, &config, &Belief::Physics, level).unwrap();
    let AgeLimits { learned_ns, mission_ns, learning_silence_ns, .. } = ages();
    Navigator::new(Setup {
        geometry: &vehicle.geometry,
        model,
        config,
        belief: Belief::Physics,
        surface: Surface::Sensed,
        level,
        seed: SEED,
        goal_m: task.goal_m,
        tolerance_m: task.goal_tolerance_m,
    })
    .unwrap()
    .with_ages(PilotAges { learned_ns, mission_ns })
    .with_stand_in(physics, learning_silence_ns, BEGAN_NS)
    .with_corrector(&CORRECTOR)
    .unwrap()
}

/// The parts in one object.
pub struct InProcess {
    pub navigator: Navigator,
    sequences: [u64; 2],
    told: [u64; 3],
}

impl InProcess {
    pub fn new() -> Self {
        Self { navigator: navigator(), sequences: [0; 2], told: [0; 3] }
    }

    /// Returns what was made, and the decision.
    pub fn step(&mut self, at_ns: u64, step: &Step) -> (Vec<Made>, Option<Decision>) {
        let navigator = &mut self.navigator;
        let mut id = |place: usize| {
            self.sequences[place] += 1;
            MessageId { epoch_ns: 1, sequence: self.sequences[place] }
        };
        let mut made = Vec::new();
        let mut decided = None;
        match step {
            Step::Odometry(odometry, applied) => {
                navigator.hear_odometry(&OdometryMessage {
                    id: id(0),
                    odometry: *odometry,
                    applied: *applied,
                });
            }
            Step::Imu(samples) => navigator.hear_imu(samples),
            Step::Scan(scan) => {
                navigator.hear_scan(ScanMessage { id: id(1), sensor: 0, scan: scan.as_ref().clone() });
            }
            Step::Order(order) => navigator.order(order.clone(), at_ns).unwrap(),
            Step::Lead => navigator.lead(at_ns),
            Step::Survey => {
                navigator.survey(at_ns).unwrap();
                let cells: Vec<[f32; 8]> = navigator.surface().values().iter().map(cell_numbers).collect();
                // Before anything was seen there is no map to tell of.
                let has_seen = navigator.scans().fused > 0;
                made.push(Made::Surface { content: if has_seen { content_hash(&cells) } else { 0 } });
                made.extend(navigator.stand_in_map().and_then(|map| risk(&mut self.told[1], 2, &map)));
            }
            Step::Assess => {
                navigator.assess().unwrap();
                made.extend(navigator.risk().and_then(|map| risk(&mut self.told[0], 1, &map)));
            }
            Step::Decide => {
                let answer = navigator.answer(at_ns);
                decided = Some(answer.decision);
                made.push(decision(&decision_record(&answer)));
            }
        }
        (made, decided)
    }
}

/// A risk map that has not been told of before.
pub fn risk(told: &mut u64, map_source: u64, message: &RiskMessage<'_>) -> Option<Made> {
    let header = message.header;
    if std::mem::replace(told, header.id.sequence) == header.id.sequence {
        return None;
    }
    let (map, times) = message.content.unwrap();
    let parts = RiskParts::new(&map.geometry, map.n_yaws, times.turning_s.len() / map.ground.len());
    let mut payload: Vec<[f32; 4]> =
        (0..parts.n_elements()).map(|place| parts.element(&map, place)).collect();
    let [seconds, turning_s] = parts.times_mut(&mut payload);
    seconds.copy_from_slice(times.seconds);
    turning_s.copy_from_slice(times.turning_s);
    Some(Made::Risk {
        map_source,
        content: content_hash(&payload),
        surface: header.surface.sequence,
        stuck: header.stuck.sequence,
        times_ns: [header.valid_at_ns, header.frame_at_ns],
        goal: header.destination.goal_m.map(f64::to_bits),
    })
}

/// All bits of a decision but the lives of publishers.
pub fn decision(record: &DecisionRecord) -> Made {
    let nameless = |source: Source| Source { epoch_ns: 0, ..source };
    let bare = DecisionRecord {
        odometry: nameless(record.odometry),
        risk: nameless(record.risk),
        mission: nameless(record.mission),
        learned: nameless(record.learned),
        physics: nameless(record.physics),
        // In one object they have the name of their map, which also tells of jumps.
        tracks: Source { epoch_ns: 0, sequence: u64::from(record.tracks != Source::default()) },
        imu: nameless(record.imu),
        ..*record
    };
    let DecisionRecord { cycle, map_source, correction, .. } = bare;
    let (decision, reason) = (bare.command.decision, bare.command.reason);
    let record = Shown { cycle, decision, reason, map_source, risk: bare.risk.sequence, correction };
    Made::Decision { bits: content_hash(std::slice::from_ref(&bare)), record }
}
