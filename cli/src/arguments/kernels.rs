//! How much is computed at a time, and with which instructions.

use clap::{Args, ValueEnum};

use super::values;

/// How much is done at a time.
#[derive(Args, Clone, Copy, Debug)]
pub struct ThreadArguments {
    /// Threads, or drives, laps and trainings at a time, 1 to 256 [default: the machine's threads]; the result does not
    /// depend on it
    #[arg(long, value_name = "N", value_parser = values::thread_count, allow_hyphen_values = true)]
    pub threads: Option<usize>,
}

impl ThreadArguments {
    /// As many as asked for, else as the machine runs at once.
    pub fn count(&self) -> usize {
        self.threads.unwrap_or_else(values::machine_threads)
    }
}

/// How maps and controller compute.
#[derive(Args, Clone, Copy, Debug)]
pub struct KernelArguments {
    /// How much at a time.
    #[command(flatten)]
    pub threads: ThreadArguments,

    /// Instruction set of maps and controller; auto takes the best the machine has
    #[arg(long, value_enum, default_value_t = InstructionSet::Auto)]
    pub isa: InstructionSet,
}

/// Instruction set of every kernel between scan and command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InstructionSet {
    /// The best the machine has
    Auto,
    /// AVX-512, 16 lanes
    Avx512,
    /// AVX2 and FMA, 8 lanes
    Avx2,
    /// NEON of 64-bit ARM, 8 lanes
    Neon,
    /// Plain x86-64 or any other processor
    Portable,
}

impl From<InstructionSet> for mppi::Isa {
    fn from(asked: InstructionSet) -> Self {
        match asked {
            InstructionSet::Auto => Self::Auto,
            InstructionSet::Avx512 => Self::Avx512,
            InstructionSet::Avx2 => Self::Avx2,
            InstructionSet::Neon => Self::Neon,
            InstructionSet::Portable => Self::Portable,
        }
    }
}
