//! A drive on one thread, for whoever counts what each process of `surefoot up` has to do: vehicle, ground and settings
//! are those of a drive for which nobody says otherwise. Between the parts it asks for its parent, which marks a place for
//! `scripts/instructions.c`.
//!
//! `cargo run --release -p bench --example roles -- physics|pietra portable|neon|avx2|avx512 N`, N cycles of 0.1 s

use std::error::Error;
use std::os::unix::process::parent_id;

use bench::closed_loop::{ClosedLoop, Drive, MapSource, Method};
use bicycle::lanes::Isa;
use bicycle::{Applied, AppliedBy, Command, Model};
use navigator::{Config, MessageId, Navigator, OdometryMessage, ScanMessage};
use scenarios::{EpisodeConfig, RockFieldConfig, Task};
use traversability::CvarLevel;

/// Futures of a decision that are told of.
const FUTURES_TOLD: usize = 32;
const SEED: u64 = 1;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [method, isa, n_cycles] = words.as_slice() else {
        return Err("expected a method, an instruction set and a number of cycles".into());
    };
    let method = [Method::Physics, Method::Pietra].into_iter().find(|known| known.name() == method);
    let isa = Isa::SETS.into_iter().find(|known| format!("{known:?}").eq_ignore_ascii_case(isa));
    let isa = isa.ok_or_else(|| format!("expected an instruction set of {:?}", Isa::SETS))?;
    let mut closed = start(method.ok_or("expected physics or pietra")?, isa)?;
    let mut applied = Applied { command: Command::default(), since_ns: 0, by: AppliedBy::Command };
    let mut told_m = 0.0;
    for sequence in 1..=n_cycles.parse()? {
        told_m += cycle(&mut closed, &mut applied, MessageId { epoch_ns: 1, sequence })?;
    }
    println!("{:?} {told_m}", closed.episode.motion());
    Ok(())
}

fn start(method: Method, isa: Isa) -> Result<ClosedLoop, Box<dyn Error>> {
    let vehicle = formats::read_vehicle("pietra_full_size")?;
    let mut config = Config::for_vehicle(&vehicle);
    (config.controller.isa, config.controller.n_threads) = (isa, 1);
    Ok(ClosedLoop::new(Drive {
        task: Task::rock_field(&RockFieldConfig::default(), SEED)?,
        vehicle: &vehicle,
        model: Model::of(&vehicle),
        config,
        episode: EpisodeConfig::for_vehicle(&vehicle),
        method,
        networks: None,
        corrector: None,
        map_source: MapSource::Sensed,
        level: CvarLevel::new(0.6)?,
        seed: SEED,
    })?)
}

/// One cycle: marks lie before mapping, assessing, control, its futures and the plant, and behind it.
fn cycle(closed: &mut ClosedLoop, applied: &mut Applied, id: MessageId) -> Result<f64, Box<dyn Error>> {
    let ClosedLoop { episode, navigator } = closed;
    let observation = episode.observe();
    let (now_ns, odometry) = (observation.valid_at_ns, observation.odometry);
    navigator.hear_odometry(&OdometryMessage { id, odometry, applied: *applied });
    if let Some(scan) = &observation.scan {
        navigator.hear_scan(ScanMessage { id, sensor: 0, scan: scan.as_ref().clone() });
    }
    navigator.lead(now_ns);
    mark();
    navigator.survey(now_ns)?;
    mark();
    navigator.assess()?;
    mark();
    let decision = navigator.answer(now_ns).decision;
    mark();
    let told_m = futures(navigator);
    mark();
    episode.apply(&decision)?;
    mark();
    let command = decision.command(applied.command);
    if command != applied.command {
        *applied = Applied { command, since_ns: now_ns, by: AppliedBy::Command };
    }
    Ok(told_m)
}

fn mark() {
    std::hint::black_box(parent_id());
}

/// Works out where every so many-th future of the last decision leads, and adds all of it up.
fn futures(navigator: &Navigator) -> f64 {
    let Some(map) = navigator.risk_map() else { return 0.0 };
    let controller = navigator.controller();
    let stride = controller.n_rollouts() / FUTURES_TOLD;
    let told = (0..FUTURES_TOLD).filter_map(|number| controller.sampled_states(number * stride, map));
    told.flat_map(|(_, states)| states).map(|state| state.x_m + state.y_m).sum()
}
