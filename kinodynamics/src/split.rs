//! Splitting a drive into data to learn from and data to choose by.
//!
//! Neighbouring windows share nearly all of their samples: a random split would let a model choose by what it has learned.
//! Whole blocks of time are kept apart instead, with the samples between them in neither.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::label::Example;

/// Length of a block [s].
const BLOCK_S: f64 = 10.0;
/// Beginning of every block that is left out: the half second that a window looks back, and the latency [s].
const LEFT_OUT_S: f64 = 0.7;

/// Places of the examples of one half each.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Split {
    /// To learn from.
    pub training: Vec<usize>,
    /// To choose by.
    pub validation: Vec<usize>,
}

/// Every tenth block of ten seconds, drawn by the seed, is to choose by; at least one.
pub fn block_split(examples: &[Example], seed: u64) -> Split {
    let block = |example: &Example| (example.run, (example.time_s / BLOCK_S) as usize);
    let mut blocks: Vec<(usize, usize)> = examples.iter().map(block).collect();
    blocks.dedup();
    blocks.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    let n_validation = blocks.len().div_ceil(10);
    let mut validation_blocks = blocks[..n_validation].to_vec();
    validation_blocks.sort_unstable();
    let mut split = Split { training: Vec::new(), validation: Vec::new() };
    for (index, example) in examples.iter().enumerate() {
        if example.time_s % BLOCK_S < LEFT_OUT_S {
            continue;
        }
        match validation_blocks.binary_search(&block(example)) {
            Ok(_) => split.validation.push(index),
            Err(_) => split.training.push(index),
        }
    }
    split
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> Vec<Example> {
        let example = |run: usize, k: usize| Example {
            time_s: 0.05 * k as f64,
            driven: [1.0, 0.5],
            commanded: [0.5, 1.0],
            window: Vec::new(),
            run,
            ground: None,
        };
        (0..3).flat_map(|run| (0..2000).map(move |k| example(run, k))).collect()
    }

    #[test]
    fn no_window_of_one_half_reaches_into_the_other() {
        let examples = examples();
        let split = block_split(&examples, 3);
        for left in &split.validation {
            for right in &split.training {
                let (left, right) = (&examples[*left], &examples[*right]);
                let apart_s = (left.time_s - right.time_s).abs();
                assert!(left.run != right.run || apart_s > 0.6, "{} {}", left.time_s, right.time_s);
            }
        }
    }

    #[test]
    fn a_tenth_of_the_blocks_is_to_choose_by_and_the_seed_says_which() {
        let examples = examples();
        let [first, again, other] = [3, 3, 4].map(|seed| block_split(&examples, seed));
        assert_eq!(first, again);
        assert_ne!(first, other);
        // 3 of 30 blocks, of each 186 of 200 examples: 0.7 s are left out.
        assert_eq!((first.validation.len(), first.training.len()), (3 * 186, 27 * 186));
    }
}
