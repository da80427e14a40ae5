//! What to drive next: the commands that would tell apart what the drives so far leave open, by expected
//! discrimination.

mod discrimination;
pub(crate) mod family;
pub(crate) mod simulation;

use crate::answer::Verdict;
use crate::baseline::{Baseline, GapError, drives_of};
use crate::causes::{Explanation, Trial, candidates};
use crate::diagnosis::Diagnosis;
use crate::drive::{Drive, STEP_S, VX, WZ, X, Y};
use crate::machine::Machine;
use crate::unseen::unseen;
use bicycle::{Column, Command, DriveLog, DriveRow, Effect};
use discrimination::{Contest, Rival, SoFar, Sums, expected_log_probability};
use family::{Envelope, Piece, held};
use simulation::measured_drive;

/// Explanations that one manoeuvre is designed for, at most.
const N_RIVALS: usize = 5;
/// Shortest and longest manoeuvre [s].
const LENGTHS_S: [f64; 2] = [18.0, 26.0];
/// Beyond this probability of the truth a manoeuvre needs no further piece.
const ENOUGH: f64 = 0.98;
/// Straight driving before every piece, and before the first from standstill [s].
const LEADS_S: [f64; 2] = [1.0, 2.5];
/// Straight driving after the last piece: the longest rollout [s].
const TAIL_S: f64 = 2.0;
/// What the vehicle was seen to do this share of the time or more may be asked of it.
const SEEN: f64 = 0.995;
/// Bounds that are no bounds.
const LEAST_SPEED_MPS: f64 = 0.2;
const LEAST_LATERAL_MPS2: f64 = 0.3;
const LEAST_STEERING_RAD: f64 = 0.05;
/// Odds that are worth a drive.
const WORTH_DRIVING: f64 = 3.0;
/// Odds beyond this are told as this.
const TELLABLE_ODDS: f64 = 1e4;

/// Commands that tell explanations apart, as they were designed.
#[derive(Clone, Debug, PartialEq)]
pub struct Manoeuvre {
    /// One command every 0.02 s, from standstill; each holds until the next.
    pub commands: Vec<Command>,
    /// What it separates; `none` stands for no effect.
    pub separates: Vec<String>,
    /// Its pieces in plain words.
    pub pieces: Vec<String>,
    /// Odds of the truth against the likeliest other explanation after it, for the truth that is hardest to tell [-].
    pub odds: f64,
    /// The same on the drives so far [-].
    pub odds_so_far: f64,
    /// Level ground that it takes, ahead and to the sides of the start together [m].
    pub room_m: [f64; 2],
}

/// Designs the drive that separates what the diagnosis leaves open: the names of the credible set, which of an unknown
/// cause are those that come nearest, or where it found nothing, no effect from those that the drives could not have shown. `None` where nothing is open, where the machine
/// was not driven by speed and steering commands, or where nothing that it may drive would help. It is asked for no more
/// speed, steering and lateral acceleration than it showed in the nominal drives `sim`, or without any in the real ones.
///
/// # Errors
/// Drives that could not be diagnosed either.
pub fn design_manoeuvre(
    baseline: &Baseline,
    machine: &Machine,
    diagnosis: &Diagnosis,
    (sim, real): (&[DriveLog], &[DriveLog]),
) -> Result<Option<Manoeuvre>, GapError> {
    let is_commanded = |log: &DriveLog| {
        [Column::CmdSpeed, Column::CmdSteer].iter().all(|needed| log.columns().any(|own| own == *needed))
    };
    if !real.iter().all(is_commanded) {
        return Ok(None);
    }
    let drives = drives_of("real", machine, real)?;
    let all: Vec<&Drive> = drives.iter().collect();
    let trial = baseline.trial(&all);
    let Some((rivals, contests)) = rivals(baseline, diagnosis, &trial, &all) else { return Ok(None) };
    let nominal = if sim.is_empty() { drives.clone() } else { drives_of("nominal", machine, sim)? };
    let envelope = Envelope::of(machine, &nominal);
    let design = Design { baseline, machine, all, trial, rivals, contests };
    let Some(pieces) = design.greedy(envelope.family()) else { return Ok(None) };
    Ok(design.finished(&pieces).filter(|manoeuvre| manoeuvre.odds >= WORTH_DRIVING))
}

impl Envelope {
    /// What the vehicle was seen to do in nominal drives, within its limits.
    fn of(machine: &Machine, nominal: &[Drive]) -> Self {
        let most = |of: &dyn Fn(&Drive, usize) -> f64| {
            let all = nominal.iter().flat_map(|drive| (0..drive.commands.len()).map(move |row| (drive, row)));
            let mut values: Vec<f64> =
                all.map(|(drive, row)| of(drive, row)).filter(|value| value.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            let last = values.len().saturating_sub(1);
            values.get((SEEN * last as f64) as usize).copied().unwrap_or(0.0)
        };
        let speed = most(&|drive, row| drive.smooth[VX][row]);
        let lateral = most(&|drive, row| (drive.smooth[VX][row] * drive.smooth[WZ][row]).abs());
        let steering = most(&|drive, row| f64::from(drive.commands[row].steering_rad).abs());
        Self {
            wheelbase_m: machine.wheelbase_m,
            speed_max_mps: speed.min(machine.speed_max_mps).max(LEAST_SPEED_MPS),
            steering_max_rad: steering.min(machine.steering_max_rad).max(LEAST_STEERING_RAD),
            lateral_acceleration_max_mps2: lateral.max(LEAST_LATERAL_MPS2),
        }
    }
}

/// Explanations and which of them to hold against which.
fn rivals(
    baseline: &Baseline,
    diagnosis: &Diagnosis,
    trial: &Trial<'_>,
    drives: &[&Drive],
) -> Option<(Vec<Rival>, Vec<Contest>)> {
    let named = |causes: Vec<Effect>| {
        let name = causes.first().map_or("none", |cause| cause.description().id);
        Rival::new(trial, name.to_owned(), causes)
    };
    if diagnosis.verdict != Verdict::None && diagnosis.effects.len() < 2 {
        let open = candidates().filter(|own| diagnosis.credible_set.iter().any(|id| id == own.id));
        let fitted = open.filter_map(|description| trial.with_one_more(&[], description));
        let mut fitted: Vec<Explanation> = fitted.collect();
        fitted.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        fitted.truncate(N_RIVALS);
        let rivals: Vec<Rival> = fitted.into_iter().map(|own| named(own.causes)).collect();
        let n = rivals.len();
        let contests = (0..n).flat_map(|a| (0..n).filter(move |&b| b != a).map(move |b| (a, b))).collect();
        return (n > 1).then_some((rivals, contests));
    }
    if diagnosis.verdict == Verdict::None {
        let hidden = unseen(baseline, drives, &[]).into_iter().filter(|effect| !effect.uses_ground());
        let hidden: Vec<Rival> = hidden.take(2 * N_RIVALS).map(|effect| named(vec![effect])).collect();
        let n = hidden.len();
        let none = Rival::new(trial, "none".to_owned(), Vec::new());
        // Those that the drives could not have shown have the loss of none by construction.
        let hidden = hidden.into_iter().map(|rival| rival.made_likely_as(&none));
        let rivals: Vec<Rival> = std::iter::once(none.clone()).chain(hidden).collect();
        return (n > 0).then(|| (rivals, (1..=n).map(|truth| (truth, 0)).collect()));
    }
    None
}

/// A piece with what it tells of every contest.
struct Weighed {
    piece: Piece,
    sums: Vec<Sums>,
}

struct Design<'a> {
    baseline: &'a Baseline,
    machine: &'a Machine,
    all: Vec<&'a Drive>,
    trial: Trial<'a>,
    rivals: Vec<Rival>,
    contests: Vec<Contest>,
}

impl<'a> Design<'a> {
    fn so_far(&self) -> SoFar {
        SoFar { n: self.trial.residuals(&[]).len(), true_loss: self.baseline.null.loss }
    }

    /// What a rival would measure of commands; `None` where its model leaves the numbers or the drive is too short.
    fn measured(&self, rival: &Rival, start: (f64, &[Command])) -> Option<Drive> {
        let effects = rival.effects(&self.baseline.effects);
        let log = measured_drive(self.machine.wheelbase_m, &effects, start, &|_| bicycle::GroundSample::FIRM)
            .ok()?;
        let level = Machine { ground: None, ..self.machine.clone() };
        drives_of("designed", &level, &[log]).ok()?.pop()
    }

    /// One piece after the other, each the one that makes the truth likeliest in expectation.
    fn greedy(&self, family: Vec<Piece>) -> Option<Vec<Piece>> {
        let mut left: Vec<Weighed> = family.into_iter().filter_map(|piece| self.weighed(piece)).collect();
        let so_far = self.so_far();
        let expected = |sums: &[Sums]| expected_log_probability(&self.rivals, &self.contests, sums, so_far);
        let none = |&(_, rival): &Contest| Sums::none(parameters(&self.rivals[rival]));
        let mut sums: Vec<Sums> = self.contests.iter().map(none).collect();
        let with = |sums: &[Sums], own: &Weighed| -> Vec<Sums> {
            sums.iter().zip(&own.sums).map(|(so_far, own)| so_far.plus(own)).collect()
        };
        let (mut chosen, mut length_s): (Vec<Piece>, f64) = (Vec::new(), 0.0);
        while length_s < LENGTHS_S[1] && (length_s < LENGTHS_S[0] || expected(&sums) < ENOUGH.ln()) {
            let gains = left.iter().map(|own| expected(&with(&sums, own)));
            let best = gains.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
            let own = left.swap_remove(best);
            sums = with(&sums, &own);
            length_s += LEADS_S[0] + own.piece.commands.len() as f64 * STEP_S;
            chosen.push(own.piece);
        }
        Some(chosen)
    }

    fn weighed(&self, piece: Piece) -> Option<Weighed> {
        let first = f64::from(piece.commands.first()?.speed_mps);
        let last = f64::from(piece.commands.last()?.speed_mps);
        // The settling time of a drive before the piece, the longest rollout after it.
        let mut commands = held(&[(1.5, first, 0.0)]);
        commands.extend(&piece.commands);
        commands.extend(held(&[(TAIL_S, last, 0.0)]));
        let measured: Option<Vec<Drive>> =
            self.rivals.iter().map(|truth| self.measured(truth, (first, &commands))).collect();
        let measured = measured?;
        let sums = self.contests.iter().map(|&(truth, rival)| {
            Sums::of(&self.baseline.trial(&[&measured[truth]]), &self.rivals[rival].causes)
        });
        let sums = sums.collect();
        Some(Weighed { piece, sums })
    }

    /// The pieces in one drive, judged as a diagnosis of all drives together would.
    fn finished(&self, pieces: &[Piece]) -> Option<Manoeuvre> {
        let commands = joined(pieces);
        let measured: Option<Vec<Drive>> =
            self.rivals.iter().map(|truth| self.measured(truth, (0.0, &commands))).collect();
        let measured = measured?;
        let so_far = self.so_far();
        let mut odds = [f64::INFINITY; 2];
        for &(truth, rival) in &self.contests {
            let (truth_losses, rival_losses) = (
                self.best_losses(&self.rivals[truth].causes, &measured[truth], Fit::Kept),
                self.best_losses(&self.rivals[rival].causes, &measured[truth], Fit::Renewed),
            );
            let is_hidden = self.rivals[truth].loss == self.rivals[rival].loss;
            let truth_loss = if is_hidden { rival_losses.real } else { truth_losses.real };
            let n = rival_losses.n_designed;
            let excess = (rival_losses.designed - truth_losses.designed).max(0.0) * n as f64;
            let after = so_far.log_odds([truth_loss, rival_losses.real], (excess, n));
            let before = so_far.log_odds([self.rivals[truth].loss, self.rivals[rival].loss], (0.0, 0));
            odds = [odds[0].min(before), odds[1].min(after)];
        }
        let told = |log_odds: f64| log_odds.exp().min(TELLABLE_ODDS);
        Some(Manoeuvre {
            separates: self.rivals.iter().map(|rival| rival.name.clone()).collect(),
            pieces: pieces.iter().map(|piece| piece.meaning.clone()).collect(),
            odds_so_far: told(odds[0]),
            odds: told(odds[1]),
            room_m: room(&measured),
            commands,
        })
    }

    fn best_losses(&self, causes: &[Effect], designed: &Drive, fit: Fit) -> Losses {
        let together: Vec<&Drive> = self.all.iter().copied().chain([designed]).collect();
        let trial = self.baseline.trial(&together);
        let start = Explanation::new(causes.to_vec(), trial.loss(causes));
        let best = match (fit, parameters_of(causes)) {
            (Fit::Kept, _) | (_, 0) => start,
            (Fit::Renewed, 1) => trial.searched(start),
            (Fit::Renewed, _) => trial.refined(start),
        };
        let on_designed = self.baseline.trial(&[designed]);
        Losses {
            real: self.trial.loss(&best.causes),
            designed: on_designed.loss(&best.causes),
            n_designed: on_designed.residuals(&[]).len(),
        }
    }
}

/// Whether parameters stay as the drives so far gave them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fit {
    Kept,
    Renewed,
}

/// Mean losses on the drives so far and on a designed one.
struct Losses {
    real: f64,
    designed: f64,
    n_designed: usize,
}

fn parameters(rival: &Rival) -> usize {
    parameters_of(&rival.causes)
}

fn parameters_of(causes: &[Effect]) -> usize {
    causes.iter().map(|cause| cause.description().parameters.len()).sum()
}

/// The pieces with straight driving before and after each, then a standstill.
fn joined(pieces: &[Piece]) -> Vec<Command> {
    let mut commands = Vec::new();
    let mut lead_s = LEADS_S[1];
    let mut last = 0.0;
    for piece in pieces {
        let first = piece.commands.first().map_or(last, |command| f64::from(command.speed_mps));
        commands.extend(held(&[(lead_s, first, 0.0)]));
        commands.extend(&piece.commands);
        last = piece.commands.last().map_or(first, |command| f64::from(command.speed_mps));
        lead_s = LEADS_S[0];
    }
    commands.extend(held(&[(TAIL_S, last, 0.0), (1.0, 0.0, 0.0)]));
    commands
}

/// The largest extent of any of the drives, along and across the heading at the start [m].
fn room(drives: &[Drive]) -> [f64; 2] {
    let extent = |quantity: usize| {
        let one = |drive: &Drive| {
            let values = &drive.measured[quantity];
            let ends = values.iter().fold([f64::MAX, f64::MIN], |[a, b], v| [a.min(*v), b.max(*v)]);
            ends[1] - ends[0]
        };
        drives.iter().map(one).fold(0.0, f64::max)
    };
    [extent(X), extent(Y)]
}

impl Manoeuvre {
    /// Length [s].
    pub fn duration_s(&self) -> f64 {
        self.commands.len() as f64 * STEP_S
    }

    /// The commands as a drive log with the columns `t`, `cmd_speed` and `cmd_steer`.
    pub fn commands_log(&self) -> DriveLog {
        let mut log = DriveLog::default();
        for (row, command) in self.commands.iter().enumerate() {
            let row = DriveRow::new(row as f64 * STEP_S)
                .with(Column::CmdSpeed, f64::from(command.speed_mps))
                .with(Column::CmdSteer, f64::from(command.steering_rad));
            // Times grow and designed commands are finite.
            if log.push("", &row).is_err() {
                break;
            }
        }
        log
    }

    /// What to drive and why, for a person; `file` is where the commands stand.
    pub fn advice(&self, file: &str) -> String {
        let [first, others @ ..] = &self.separates[..] else { return String::new() };
        let what = match first.as_str() {
            "none" => format!("these drives could not have shown {}: they would show", listed(others)),
            _ => format!("these drives leave {} open: to tell them apart drive", listed(&self.separates)),
        };
        let [along, across] = self.room_m.map(|length| length.ceil());
        let odds = |odds: f64| {
            if odds >= TELLABLE_ODDS { "more than 10000".to_owned() } else { format!("{odds:.3}") }
        };
        format!(
            "{what} in {file}, {:.0} s on level ground of {along:.0} x {across:.0} m ({}); expected odds of the truth \
             against any other then: {} to 1 or better, now {} to 1",
            self.duration_s(),
            self.pieces.join("; "),
            odds(self.odds),
            odds(self.odds_so_far),
        )
    }
}

fn listed(names: &[String]) -> String {
    match names {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        _ => names.concat(),
    }
}
