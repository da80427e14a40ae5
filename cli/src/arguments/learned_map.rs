//! `surefoot bench learned-map`.

use std::path::PathBuf;
use std::str::FromStr;

use bench::learned_map::Sizes;
use clap::Args;

use super::values;

/// How to measure the risk map of what was learned.
#[derive(Args, Clone, Debug)]
#[command(after_long_help = AFTER_HELP)]
pub struct BenchLearnedMapArguments {
    /// How maps and controller compute.
    #[command(flatten)]
    pub kernels: super::KernelArguments,

    /// Maps to build of every network
    #[arg(long, value_name = "N", value_parser = values::update_count, default_value = "50",
          allow_hyphen_values = true)]
    pub updates: usize,

    /// Sizes of the networks: widths of the encoder's hidden layers, then of the latent; several, separated by commas
    #[arg(long, value_name = "W-W:H,..", value_delimiter = ',', default_value = "96-64:16")]
    pub networks: Vec<NetworkSizes>,

    /// Also drive past what this real scan has seen: .npz with xyz [point, 3] in metres, sensor frame
    #[arg(long, value_name = "FILE")]
    pub scan: Option<PathBuf>,

    /// Where the numbers go, besides the terminal.
    #[command(flatten)]
    pub copy: super::JsonArguments,
}

/// Widths as they are written: `96-64:16`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NetworkSizes(pub Sizes);

/// Widths beyond this are no networks for a control computer.
const WIDTH_MAX: usize = 4096;

impl FromStr for NetworkSizes {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "expected widths from 1 to {WIDTH_MAX} as hidden-hidden:latent, such as 96-64:16, found {word:?}"
            )
        };
        let width = |word: &str| word.parse().ok().filter(|width| (1..=WIDTH_MAX).contains(width));
        let (hidden, latent) = word.split_once(':').ok_or_else(expected)?;
        let encoder_hidden = hidden.split('-').map(width).collect::<Option<_>>().ok_or_else(expected)?;
        let n_latent = width(latent).ok_or_else(expected)?;
        Ok(Self(Sizes { encoder_hidden, n_latent, ..Sizes::default() }))
    }
}

pub(super) const LONG_ABOUT: &str = "\
Measures the risk map of what was learned over 81 x 96 cells and 13 yaws of a small vehicle, from the elevation map \
through features, networks, flow, physics prior and posterior to CVaR: built whole, and brought up to date after one \
contiguous block of 2 % of the cells has changed. What a map costs does not depend on the values of the weights: the \
networks are untrained.";

const AFTER_HELP: &str = "\
Prints JSON, and with --json writes it to a file too:
  threads, updates, isa, poses, changed_cells
  networks  of each: sizes, multiply_adds per footprint, memory_mb, and min, median, p99 of
    ms        full, changed
    alone_ms  prior, networks: these parts by themselves
  scan      with --scan: fuse_ms, update_ms, and judged_share, the share of the
            poses that an update judged anew

Example:
  surefoot bench learned-map --threads 2 --networks 32-32:8,64-64:8,96-64:16";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_they_are_written() {
        let NetworkSizes(sizes) = "96-64:16".parse().unwrap();
        assert_eq!(sizes, Sizes::default());
        let NetworkSizes(sizes) = "8:2".parse().unwrap();
        assert_eq!((sizes.encoder_hidden, sizes.n_latent), (vec![8], 2));
        for wrong in ["", "96-64", "96-64:", ":4", "0:4", "9-x:4", "8:4097", "8--8:4"] {
            let told = wrong.parse::<NetworkSizes>().unwrap_err();
            assert!(told.contains("expected") && told.contains(wrong), "{told}");
        }
    }
}
