//! `surefoot gap diagnose`: read, screen, calibrate, diagnose, predict; only then open the held-out drives and verify.

use std::path::Path;

use bicycle::Model;
use report::gap::Told;
use sim_to_real::{
    Answer, Baseline, Case, ControllerModel, Diagnosed, Diagnosis, Drives, PoseSensor, Verification,
    WithoutSimulator, controller_model, diagnose, diagnose_without_simulator, verify,
};

use super::in_simulator::Decider;
use super::outputs::Outputs;
use super::progress::Progress;
use super::request::Request;
use super::{baseline, drives, follow_up, machine, model_file};
use crate::arguments::GapDiagnoseArguments;
use crate::{LimitExceeded, UsageError, summary};

/// The drives of a case with what was found of the robot's pose sensor, and taken out of them.
struct Asked {
    case: Case,
    pose_sensor: Option<PoseSensor>,
}

/// The held-out drives and what they say; without any there is nothing.
struct Verified {
    heldout: Drives,
    verification: Option<Verification>,
}

pub(super) fn run(arguments: &GapDiagnoseArguments) -> anyhow::Result<()> {
    let request = Request::of(arguments)?;
    if arguments.fail_above.is_some() && request.heldout.is_empty() {
        return Err(
            UsageError("--fail-above: expected held-out drives to measure, found none".to_owned()).into()
        );
    }
    let own_model = arguments.model.as_deref().map(model_file::read).transpose()?;
    let outputs = Outputs::prepare(arguments)?;
    let mut doubts = request.doubtful_names()?;
    let Asked { case, pose_sensor } = read(&request, &mut doubts)?;
    let mut decider = Decider::start(&arguments.simulator, &case.machine, &case.sim.logs)?;
    let folder = arguments.baseline_cache.clone().or_else(baseline::default_folder);
    let (baseline, diagnosis) = diagnosed_against(&case, folder.as_deref(), &mut doubts)?;
    let mut predicted = diagnosis.answer(request.name.as_deref().unwrap_or(&case.machine.name));
    predicted.pose_sensor = pose_sensor;
    let diagnosed = Diagnosed { case: &case, baseline: &baseline, diagnosis: &diagnosis };
    predicted.controller_model = Some(for_controller(&diagnosed, own_model.as_ref())?);
    follow_up::advise(&diagnosed, &mut predicted, (arguments, &outputs))?;
    decider.decide(&mut predicted, &case.machine, (&case.sim.logs, &case.real.logs))?;
    outputs.write_json("prediction.json", &predicted)?;

    // From here on the prediction cannot change any more.
    let verified = open_heldout(&request, (&diagnosed, pose_sensor), &mut doubts)?;
    let complete = |verification: &Verification| verification.complete(predicted.clone());
    let mut answer = verified.verification.as_ref().map_or_else(|| predicted.clone(), complete);
    decider.verify(&mut answer, &case.machine, &verified.heldout.logs)?;
    let n_runs = decider.finish();
    follow_up::bound(&diagnosed, &mut answer, (arguments, &outputs), &verified.heldout.logs)?;
    answer.advice.extend(doubts.iter().map(|doubt| format!("check {doubt}")));
    let told = Told {
        case: &case,
        heldout: &verified.heldout,
        verification: verified.verification.as_ref(),
        diagnosis: &diagnosis,
        answer: &answer,
        doubts: &doubts,
    };
    write(&told, &outputs)?;
    say(&told, &outputs, n_runs);
    arguments.fail_above.map_or(Ok(()), |limit| held_to(limit, &answer))
}

/// Errors: the gap is larger than what is allowed.
fn held_to(limit: f64, answer: &Answer) -> anyhow::Result<()> {
    match answer.gap_ratio() {
        Some(ratio) if ratio <= limit => Ok(()),
        found => {
            let found = found.map_or("none".to_owned(), |ratio| format!("{ratio:.2}"));
            let whose = "times the simulator's error on its own drives";
            Err(LimitExceeded(format!("--fail-above: expected at most {limit} {whose}, found {found}"))
                .into())
        }
    }
}

/// Against the calibrated simulator; without nominal drives against the bare kinematic bicycle.
fn diagnosed_against(
    case: &Case,
    folder: Option<&Path>,
    doubts: &mut Vec<String>,
) -> Result<(Baseline, Diagnosis), UsageError> {
    let Case { machine, sim, real } = case;
    if sim.logs.is_empty() {
        let searching = Progress::search();
        let found = diagnose_without_simulator(machine, &real.logs);
        searching.finish();
        let WithoutSimulator { baseline, diagnosis } = found.map_err(UsageError::from_input)?;
        return Ok((baseline, diagnosis));
    }
    let baseline =
        baseline::load_or_calibrate(machine, &sim.logs, folder, doubts).map_err(UsageError::from_input)?;
    let searching = Progress::search();
    let diagnosis = diagnose(&baseline, machine, &real.logs);
    searching.finish();
    Ok((baseline, diagnosis.map_err(UsageError::from_input)?))
}

/// What a controller's model is to hold: what was announced, fitted beside the effects of the user's own model or beside
/// those that the simulator's drives calibrated.
fn for_controller(diagnosed: &Diagnosed<'_>, own: Option<&Model>) -> Result<ControllerModel, UsageError> {
    let Diagnosed { case, baseline, diagnosis } = *diagnosed;
    let effects = own.map(|model| &model.effects[..]);
    controller_model((baseline, diagnosis), &case.machine, &case.real.logs, effects)
        .map_err(UsageError::from_input)
}

fn read(request: &Request, doubts: &mut Vec<String>) -> Result<Asked, UsageError> {
    let mapping = &request.mapping;
    let (sim, real) =
        (drives::read(&request.sim, mapping, doubts)?, drives::read(&request.real, mapping, doubts)?);
    let machine = machine::read(&request.vehicle, &[&sim.logs[..], &real.logs[..]].concat())?;
    let unknowns = &request.pose_unknowns;
    let estimated =
        || PoseSensor::estimated(&real, machine.wheelbase_m, unknowns).map_err(UsageError::from_input);
    let pose_sensor = if unknowns.is_empty() { None } else { Some(estimated()?) };
    let real = without(pose_sensor, real);
    let case = Case::screened(machine, sim, real, doubts).map_err(UsageError::from_input)?;
    Ok(Asked { case, pose_sensor })
}

/// Drives of the robot without what was found of its pose sensor.
fn without(pose_sensor: Option<PoseSensor>, drives: Drives) -> Drives {
    match pose_sensor {
        Some(found) => found.taken_out_of(drives),
        None => drives,
    }
}

/// Opens the drives that nothing has looked at so far and judges the diagnosis on them.
fn open_heldout(
    request: &Request,
    (diagnosed, pose_sensor): (&Diagnosed<'_>, Option<PoseSensor>),
    doubts: &mut Vec<String>,
) -> Result<Verified, UsageError> {
    let Diagnosed { case, baseline, diagnosis } = *diagnosed;
    let heldout = without(pose_sensor, drives::read(&request.heldout, &request.mapping, doubts)?);
    let heldout = case.heldout(heldout, doubts).map_err(UsageError::from_input)?;
    let judged = || verify(baseline, &case.machine, diagnosis, &heldout.logs);
    let verification =
        if heldout.logs.is_empty() { None } else { Some(judged().map_err(UsageError::from_input)?) };
    Ok(Verified { heldout, verification })
}

fn write(told: &Told<'_>, outputs: &Outputs) -> anyhow::Result<()> {
    outputs.write_json("answer.json", told.answer)?;
    if let (Some(path), Some(csv)) = (&outputs.predictions, told.predictions_csv()) {
        formats::write_bytes_atomic(path, csv.as_bytes())?;
    }
    let Some(folder) = &outputs.folder else { return Ok(()) };
    let pictures = told.pictures()?;
    for picture in &pictures {
        formats::write_bytes_atomic(&folder.join(picture.file), &picture.png)?;
    }
    let page = told.page(&pictures, &summary::program());
    Ok(formats::write_bytes_atomic(&folder.join("report.html"), page.as_bytes())?)
}

/// `n_runs` are the drives that the user's own simulator was sent through, if there is one.
fn say(told: &Told<'_>, outputs: &Outputs, n_runs: Option<usize>) {
    for doubt in told.doubts {
        eprintln!("surefoot: {doubt}");
    }
    print!("{}", told.text());
    if let Some(n_runs) = n_runs {
        println!("  {n_runs} drives in the simulator");
    }
    let report = outputs.in_folder("report.html");
    for path in [report.as_ref(), outputs.json.as_ref(), outputs.predictions.as_ref()].into_iter().flatten() {
        println!("  {}", path.display());
    }
}
