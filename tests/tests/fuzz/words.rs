//! The command line: whole calls of which words are broken.

use clap::{CommandFactory, FromArgMatches};
use cli::arguments::Arguments;
use rand::RngExt;

use crate::harness::{Fate, Reader, Rng};
use crate::mutate::{self, once_in, one_of};

/// Calls that hold every kind of value, options and values apart.
const CALLS: [&str; 16] = [
    "drive --world rocks --start -3,4.5,0.7 --goal 10,-2 --alpha 0.6 --seed 3 --time-limit 60 --threads 2",
    "drive --world arena --bush-height 0.2 --deviation steering_delay=0.2 --deviation slope_pull=0.8,-0.1",
    "drive --world hill.npz --deviation flat_tyre=2,0.9,0.5,0.02 --deviation motor_droop --isa portable",
    "drive --commands a.csv --pace fast --method pietra --out o --json j.json",
    "up --run field-2_b --rate 10 --command-age 0.3 --live 127.0.0.1:8765 --learn",
    "up --role control --live [::1]:0 --world rocks --seed 18446744073709551615",
    "bench learned-map --threads 2 --updates 50 --networks 32-32:8,64-64:8,96-64:16",
    "bench navigation --alpha 0.3,0.6,1 --maps 2 --pairs 3 --seed 4 --field f.toml --shard 1/3 --resume --methods physics,pietra --time-limit 120 --out o",
    "bench navigation --merge a,b --out o",
    "bench navigation --planner mine=true --planner-timeout 5 --methods nominal --maps 1 --pairs 1 --time-limit 0.1 --out o",
    "bench risk --densities 0,0.4,1 --alpha 0.2,1 --runs 200 --seed 1 --isa avx2 --out o",
    "bench correction --methods plain,corrected-blind,adapted --runs 50 --minutes 30 --epochs 50 --seed 1 --out o",
    "collect --world rocks --maps 10 --trials 20 --test-height-scale 1.5 --elevation-origin 3,-4 --out a",
    "train traversability --method pietra,vanilla --train a --validation b --hidden 96,64 --latent 16 --out w",
    "gap diagnose --sim a.csv --sim b.csv --real c.mcap --heldout d.csv --vehicle v.toml --json a.json",
    "replay a.mcap b.mcap --weights w",
];

/// A call, a word a line.
pub fn command_line(rng: &mut Rng) -> Vec<u8> {
    let call = one_of(rng, &CALLS);
    let mut words: Vec<String> = call.split(' ').map(str::to_owned).collect();
    for _ in 0..rng.random_range(0..3) {
        let (place, other) = (rng.random_range(0..words.len()), rng.random_range(0..words.len()));
        match rng.random_range(0..8) {
            0 => drop(words.remove(place)),
            1 => words.insert(place, words[other].clone()),
            2 => words.swap(place, other),
            _ => words[place] = String::from_utf8_lossy(&mutate::text(rng, &words[place])).into_owned(),
        }
        if words.is_empty() {
            break;
        }
    }
    if once_in(rng, 20) {
        words.push("--".to_owned());
    }
    words.join("\n").into_bytes()
}

/// Parses the call, and says what is wrong with it.
pub fn read_command_line() -> Reader {
    let mut command = Arguments::command();
    command.build();
    Box::new(move |input| {
        let text = std::str::from_utf8(input).unwrap();
        let words = ["surefoot"].into_iter().chain(text.split('\n'));
        let matches = command.try_get_matches_from_mut(words);
        match matches.and_then(|matches| Arguments::from_arg_matches(&matches)) {
            Ok(_) => Fate::Taken,
            Err(error) => {
                drop(error.to_string());
                Fate::Refused
            }
        }
    })
}
