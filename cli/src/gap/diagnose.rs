//! `surefoot gap diagnose`: read, screen, calibrate, diagnose, predict; only then open the held-out drives and verify.

use std::path::Path;

use bicycle::DriveLog;
use report::Picture;
use report::gap::{Page, Pictures, Reference};
use sim_to_real::{
    Answer, Baseline, Diagnosis, Machine, Verification, WithoutSimulator, diagnose,
    diagnose_without_simulator, verify,
};

use super::follow_up::Diagnosed;
use super::in_simulator::Decider;
use super::outputs::Outputs;
use super::progress::Progress;
use super::request::Request;
use super::{baseline, drives, machine, predictions};
use crate::arguments::GapDiagnoseArguments;
use crate::{LimitExceeded, UsageError, summary};

/// What a diagnosis is made from.
struct Inputs {
    machine: Machine,
    sim: Vec<DriveLog>,
    real: Vec<DriveLog>,
}

/// The held-out drives and what they say; without any there is nothing.
struct Verified {
    heldout: Vec<DriveLog>,
    verification: Option<Verification>,
}

pub(super) fn run(arguments: &GapDiagnoseArguments) -> anyhow::Result<()> {
    let request = Request::of(arguments)?;
    if arguments.fail_above.is_some() && request.heldout.is_empty() {
        return Err(
            UsageError("--fail-above: expected held-out drives to measure, found none".to_owned()).into()
        );
    }
    let outputs = Outputs::prepare(arguments)?;
    let mut doubts = request.doubtful_names()?;
    let inputs = read(&request, &mut doubts)?;
    let mut decider = Decider::start(&arguments.simulator, &inputs.machine, &inputs.sim)?;
    let folder = arguments.baseline_cache.clone().or_else(baseline::default_folder);
    let (baseline, diagnosis) = diagnosed_against(&inputs, folder.as_deref(), &mut doubts)?;
    let mut predicted = diagnosis.answer(request.name.as_deref().unwrap_or(&inputs.machine.name));
    let diagnosed = Diagnosed {
        baseline: &baseline,
        machine: &inputs.machine,
        diagnosis: &diagnosis,
        sim: &inputs.sim,
        real: &inputs.real,
    };
    diagnosed.advise(&mut predicted, (arguments, &outputs))?;
    decider.decide(&mut predicted, &inputs.machine, (&inputs.sim, &inputs.real))?;
    outputs.write_json("prediction.json", &predicted)?;

    // From here on the prediction cannot change any more.
    let verified = open_heldout(&request, &inputs, &baseline, &diagnosis, &mut doubts)?;
    let complete = |verification: &Verification| verification.complete(predicted.clone());
    let mut answer = verified.verification.as_ref().map_or_else(|| predicted.clone(), complete);
    decider.verify(&mut answer, &inputs.machine, &verified.heldout)?;
    let n_runs = decider.finish();
    diagnosed.bound(&mut answer, (arguments, &outputs), &verified.heldout)?;
    answer.advice.extend(doubts.iter().map(|doubt| format!("check {doubt}")));
    let report = Report {
        request: &request,
        inputs: &inputs,
        answer: &answer,
        diagnosis: &diagnosis,
        doubts: &doubts,
        n_runs,
    };
    report.write(&outputs, &verified)?;
    report.say(&outputs);
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
    inputs: &Inputs,
    folder: Option<&Path>,
    doubts: &mut Vec<String>,
) -> Result<(Baseline, Diagnosis), UsageError> {
    let Inputs { machine, sim, real } = inputs;
    if sim.is_empty() {
        let searching = Progress::search();
        let found = diagnose_without_simulator(machine, real);
        searching.finish();
        let WithoutSimulator { baseline, diagnosis } = found.map_err(UsageError::from_input)?;
        return Ok((baseline, diagnosis));
    }
    let baseline =
        baseline::load_or_calibrate(machine, sim, folder, doubts).map_err(UsageError::from_input)?;
    let searching = Progress::search();
    let diagnosis = diagnose(&baseline, machine, real);
    searching.finish();
    Ok((baseline, diagnosis.map_err(UsageError::from_input)?))
}

fn read(request: &Request, doubts: &mut Vec<String>) -> Result<Inputs, UsageError> {
    let names = &request.names;
    let (sim, real) =
        (drives::read(&request.sim, names, doubts)?, drives::read(&request.real, names, doubts)?);
    let machine = machine::read(&request.vehicle, &[&sim[..], &real[..]].concat())?;
    let sim = drives::screened(&machine, &request.sim, sim, doubts)?;
    let real = drives::screened(&machine, &request.real, real, doubts)?;
    drives::refuse_mixed_steering(&machine, &[(&sim, &request.sim), (&real, &request.real)])?;
    drives::screen_together(&machine, &sim, &real, doubts)?;
    Ok(Inputs { machine, sim, real })
}

/// Opens the drives that nothing has looked at so far and judges the diagnosis on them.
fn open_heldout(
    request: &Request,
    inputs: &Inputs,
    baseline: &Baseline,
    diagnosis: &Diagnosis,
    doubts: &mut Vec<String>,
) -> Result<Verified, UsageError> {
    let heldout = drives::read(&request.heldout, &request.names, doubts)?;
    let heldout = drives::screened(&inputs.machine, &request.heldout, heldout, doubts)?;
    let of_both = [(&inputs.real[..], &request.real[..]), (&heldout[..], &request.heldout[..])];
    drives::refuse_mixed_steering(&inputs.machine, &of_both)?;
    let seen_paths: Vec<_> = request.sim.iter().chain(&request.real).collect();
    let seen = [&inputs.sim[..], &inputs.real[..]].concat();
    drives::refuse_seen(&heldout, &request.heldout, &seen, &seen_paths)?;
    let judged = || verify(baseline, &inputs.machine, diagnosis, &heldout);
    let verification =
        if heldout.is_empty() { None } else { Some(judged().map_err(UsageError::from_input)?) };
    Ok(Verified { heldout, verification })
}

/// Everything that files and terminal tell.
struct Report<'a> {
    request: &'a Request,
    inputs: &'a Inputs,
    answer: &'a Answer,
    diagnosis: &'a Diagnosis,
    doubts: &'a [String],
    /// Drives that the user's own simulator was sent through, if there is one.
    n_runs: Option<usize>,
}

impl Report<'_> {
    fn write(&self, outputs: &Outputs, verified: &Verified) -> anyhow::Result<()> {
        outputs.write_json("answer.json", self.answer)?;
        if let (Some(path), Some(verification)) = (&outputs.predictions, &verified.verification) {
            let names = predictions::run_names(&verified.heldout, &self.request.heldout);
            let csv = predictions::csv(&verification.predictions, &names);
            formats::write_bytes_atomic(path, csv.as_bytes())?;
        }
        let Some(folder) = &outputs.folder else { return Ok(()) };
        let pictures = self.pictures(verified)?;
        for picture in &pictures {
            formats::write_bytes_atomic(&folder.join(picture.file), &picture.png)?;
        }
        let page = report::gap::page(&Page {
            answer: self.answer,
            drives: &self.told_drives(),
            doubts: self.doubts,
            pictures: &pictures,
            reference: self.reference(),
            program: &format!("surefoot {}, revision {}", env!("CARGO_PKG_VERSION"), summary::revision()),
        });
        Ok(formats::write_bytes_atomic(&folder.join("report.html"), page.as_bytes())?)
    }

    fn pictures(&self, verified: &Verified) -> anyhow::Result<Vec<Picture>> {
        let verification = verified.verification.as_ref();
        let names = predictions::run_names(&verified.heldout, &self.request.heldout);
        let strip = verification.and_then(|v| predictions::strip(&v.predictions, &verified.heldout, &names));
        let shown = Pictures {
            reference: self.reference(),
            answer: self.answer,
            findings: &self.diagnosis.findings,
            heldout_residuals: verification.map_or(&[], |verification| &verification.residuals),
            ground: self.inputs.machine.ground.as_ref(),
            heldout: strip.as_ref(),
        };
        Ok(report::gap::pictures(&shown)?)
    }

    fn reference(&self) -> Reference {
        if self.inputs.sim.is_empty() { Reference::Bicycle } else { Reference::Simulator }
    }

    fn say(&self, outputs: &Outputs) {
        for doubt in self.doubts {
            eprintln!("surefoot: {doubt}");
        }
        print!("{}", report::gap::text(self.answer, &self.told_drives()));
        if let Some(n_runs) = self.n_runs {
            println!("  {n_runs} drives in the simulator");
        }
        let report = outputs.in_folder("report.html");
        for path in
            [report.as_ref(), outputs.json.as_ref(), outputs.predictions.as_ref()].into_iter().flatten()
        {
            println!("  {}", path.display());
        }
    }

    /// `veh_b: 4 nominal drives, 2 real drives, 1 held-out drive`.
    fn told_drives(&self) -> String {
        let request = self.request;
        let kinds = [(&request.sim, "nominal"), (&request.real, "real"), (&request.heldout, "held-out")];
        let counted = kinds.map(|(drives, what)| match drives.len() {
            1 => format!("1 {what} drive"),
            n => format!("{n} {what} drives"),
        });
        format!("{}: {}", self.inputs.machine.name, counted.join(", "))
    }
}
