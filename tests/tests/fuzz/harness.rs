//! Runs a target on inputs that follow from a seed and a number, and finds what panics or takes too much memory.

use std::fs::File;
use std::io::Write;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Instant;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// What inputs are drawn from.
pub type Rng = Xoshiro256PlusPlus;

/// How many inputs are tried on all targets together, in the proportions of an ordinary run.
const INPUTS: &str = "SUREFOOT_FUZZ_INPUTS";
/// How many of such a run are passed over, so that a long one can be done in parts.
const FIRST: &str = "SUREFOOT_FUZZ_FIRST";
/// What all inputs follow from, beside target and number.
const SEED: &str = "SUREFOOT_FUZZ_SEED";
/// One number of a target, to repeat what was found.
const ONLY: &str = "SUREFOOT_FUZZ_ONLY";
/// Inputs from which on a run is long enough to be reported on.
const LONG: u64 = 1_000_000;
/// Inputs from which on some must have been taken and some refused.
const ENOUGH: u64 = 200;

/// What became of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It was what it claims to be.
    Taken,
    /// It was refused with a reason.
    Refused,
}

impl Fate {
    /// The fate of what a reader returned.
    pub fn of<T, E>(result: &Result<T, E>) -> Self {
        if result.is_ok() { Self::Taken } else { Self::Refused }
    }
}

/// Most memory that a reader may hold at once while it reads an input.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// For every byte of the input.
    pub per_byte: u64,
    /// Whatever the input.
    pub always: u64,
}

/// A reader under test. It may keep a folder or settings between inputs, and nothing of an input.
pub type Reader = Box<dyn FnMut(&[u8]) -> Fate>;

/// Something that reads what others wrote.
pub struct Target {
    /// Name, also of its test.
    pub name: &'static str,
    /// Inputs of an ordinary run of the tests.
    pub n_inputs: u64,
    /// Memory that it may take.
    pub bound: Bound,
    /// Draws an input.
    pub input: fn(&mut Rng) -> Vec<u8>,
    /// Makes the reader.
    pub reader: fn() -> Reader,
}

/// The inputs of a run.
struct Plan {
    seed: u64,
    numbers: Range<u64>,
    is_long: bool,
}

impl Plan {
    /// As the environment says; `n_ordinary` inputs are tried on all targets in an ordinary run.
    fn told(target: &Target, n_ordinary: u64) -> Self {
        let seed = told(SEED).unwrap_or(1);
        if let Some(only) = told(ONLY) {
            return Self { seed, numbers: only..only + 1, is_long: false };
        }
        let (first, n) = (told(FIRST).unwrap_or(0), told(INPUTS).unwrap_or(n_ordinary));
        let numbers =
            share(first, target.n_inputs, n_ordinary)..share(first + n, target.n_inputs, n_ordinary);
        Self { seed, numbers, is_long: n >= LONG }
    }
}

/// Of so many inputs on all targets, those of one that has `n_own` of `n_ordinary`.
fn share(n: u64, n_own: u64, n_ordinary: u64) -> u64 {
    (u128::from(n) * u128::from(n_own) / u128::from(n_ordinary)) as u64
}

fn told(variable: &str) -> Option<u64> {
    let word = std::env::var(variable).ok()?;
    Some(word.parse().unwrap_or_else(|_| panic!("{variable}: expected a whole number, found {word:?}")))
}

/// The generator of one input.
fn stream(seed: u64, target: &str, number: u64) -> Rng {
    // FNV-1a tells the targets apart; the generator mixes its seed itself.
    let name = target.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    Rng::seed_from_u64(name ^ seed.rotate_left(40) ^ number)
}

/// Tries the target's share of the inputs and panics with all that is needed to repeat the first that it cannot take.
pub fn run(target: &Target, n_ordinary: u64) {
    let plan = Plan::told(target, n_ordinary);
    match attempt(target, &plan) {
        Ok(tally) => tally.check(target, &plan),
        Err(fault) => {
            let (name, number, seed) = (target.name, fault.number, plan.seed);
            let kept = place(&format!("fuzz-{name}-{number}"));
            std::fs::write(&kept, &fault.input).unwrap();
            panic!(
                "{name}, input {number} of {} bytes: {}\nkept as {}; {SEED}={seed} {ONLY}={number} cargo test -p \
                 tests --test fuzz -- --exact {name} repeats it",
                fault.input.len(),
                fault.what,
                kept.display()
            );
        }
    }
}

/// Tries one input on the target of this name: the bytes that were held at once, or what went wrong.
pub fn try_on(targets: &[Target], name: &str, input: &[u8]) -> Result<u64, String> {
    let target = targets.iter().find(|target| target.name == name).unwrap();
    judge(target, &mut (target.reader)(), input).map(|(_, held_bytes)| held_bytes)
}

/// What a target did to its inputs.
#[derive(Default)]
struct Tally {
    n_taken: u64,
    n_refused: u64,
    most_bytes: u64,
    most_share: f64,
    elapsed_s: f64,
}

/// An input that broke a reader.
struct Fault {
    number: u64,
    input: Vec<u8>,
    what: String,
}

impl Tally {
    fn n(&self) -> u64 {
        self.n_taken + self.n_refused
    }

    fn check(&self, target: &Target, plan: &Plan) {
        if plan.is_long {
            self.tell(target);
        }
        let is_fair = self.n_taken > 0 && self.n_refused > 0;
        let (name, taken, refused) = (target.name, self.n_taken, self.n_refused);
        assert!(
            self.n() < ENOUGH || is_fair,
            "{name}: expected inputs of both kinds, {taken} taken, {refused} refused"
        );
    }

    /// A line for people, past the capture of the test's output.
    fn tell(&self, target: &Target) {
        let line = format!(
            "{:24} {:9} inputs, {:7.0} per s, {:4.1} % taken, at most {:.3} MB and {:4.1} % of the bound\n",
            target.name,
            self.n(),
            self.n() as f64 / self.elapsed_s,
            1e2 * self.n_taken as f64 / self.n().max(1) as f64,
            self.most_bytes as f64 * 1e-6,
            1e2 * self.most_share,
        );
        std::io::stderr().write_all(line.as_bytes()).unwrap();
    }
}

fn attempt(target: &Target, plan: &Plan) -> Result<Tally, Fault> {
    let mut read = (target.reader)();
    let began = Instant::now();
    let mut tally = Tally::default();
    // What ends the process, as memory that the system does not have, leaves no message: the number stays in a file.
    let current = File::create(place(&format!("fuzz-{}-current", target.name))).unwrap();
    for number in plan.numbers.clone() {
        current.write_all_at(format!("{number:20}\n").as_bytes(), 0).unwrap();
        let input = (target.input)(&mut stream(plan.seed, target.name, number));
        let (fate, bytes) = match judge(target, &mut read, &input) {
            Ok(judged) => judged,
            Err(what) => return Err(Fault { number, input, what }),
        };
        match fate {
            Fate::Taken => tally.n_taken += 1,
            Fate::Refused => tally.n_refused += 1,
        }
        tally.most_bytes = tally.most_bytes.max(bytes);
        tally.most_share = tally.most_share.max(bytes as f64 / limit(target, &input) as f64);
        tally.elapsed_s = began.elapsed().as_secs_f64();
        if plan.is_long && tally.n() % LONG == 0 {
            tally.tell(target);
        }
    }
    Ok(tally)
}

fn limit(target: &Target, input: &[u8]) -> u64 {
    target.bound.always + target.bound.per_byte * input.len() as u64
}

/// The input's fate and the bytes that were held at once on its account.
fn judge(target: &Target, read: &mut Reader, input: &[u8]) -> Result<(Fate, u64), String> {
    let mut fate = Ok(Fate::Refused);
    let allocated = allocation_counter::measure(|| fate = catch_unwind(AssertUnwindSafe(|| read(input))));
    let fate = fate.map_err(|panic| format!("panicked: {}", words_of(panic.as_ref())))?;
    let (held, limit) = (allocated.bytes_max, limit(target, input));
    if held > limit {
        return Err(format!("expected at most {limit} bytes to be held, found {held}"));
    }
    Ok((fate, held))
}

fn words_of(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "without a message".to_owned())
}

/// Where files of the tests lie.
fn place(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target(reader: fn() -> Reader) -> Target {
        fn input(rng: &mut Rng) -> Vec<u8> {
            rand::RngExt::random::<u64>(rng).to_le_bytes().to_vec()
        }
        let bound = Bound { per_byte: 4, always: 64 };
        Target { name: "planted", n_inputs: 1000, bound, input, reader }
    }

    fn found(reader: fn() -> Reader) -> Option<Fault> {
        attempt(&target(reader), &Plan { seed: 1, numbers: 0..1000, is_long: false }).err()
    }

    #[test]
    fn a_reader_that_panics_now_and_then_is_found_with_its_input() {
        let fault = found(|| {
            Box::new(|input| {
                assert!(!input.contains(&7), "seven");
                Fate::Taken
            })
        });
        let Fault { number, input, what } = fault.unwrap();
        assert_eq!(what, "panicked: seven");
        assert_eq!(input, (target(|| unreachable!()).input)(&mut stream(1, "planted", number)));
        assert!(input.contains(&7));
    }

    #[test]
    fn a_reader_that_believes_a_length_is_found() {
        fn held(n: u8) -> Fate {
            drop(std::hint::black_box(vec![0u8; usize::from(n)]));
            Fate::Taken
        }
        let fault = found(|| Box::new(|input| held(input[0])));
        assert_eq!(fault.map(|fault| fault.what.starts_with("expected at most 96 bytes")), Some(true));
        let careful = found(|| Box::new(|input| held(input[0] % 97)));
        assert!(careful.is_none());
    }

    #[test]
    fn parts_of_a_long_run_are_the_whole() {
        let ends = [0, 10, 20, 30].map(|n| share(n, 7, 30));
        assert_eq!(ends, [0, 2, 4, 7]);
        assert_eq!(share(u64::MAX, 1 << 20, 1 << 20), u64::MAX);
    }
}
