//! Which instruction set the kernels run on: a wish, and the proof that the machine has it.

use serde::{Deserialize, Serialize};

use super::{Lanes, Portable};

/// Which instructions every kernel between scan and command uses.
///
/// Results are the same on every machine that has the set, and differ in rounding between sets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Isa {
    /// The best that the machine has.
    #[default]
    Auto,
    /// AVX-512 (F, BW, CD, DQ, VL).
    Avx512,
    /// AVX2 with FMA.
    Avx2,
    /// NEON, which every 64-bit ARM processor has.
    Neon,
    /// What every machine has: the same results on all of them.
    Portable,
}

impl Isa {
    /// Every set by its name, the widest first.
    pub const SETS: [Self; 4] = [Self::Avx512, Self::Avx2, Self::Neon, Self::Portable];
}

/// An instruction set that the machine is known to have.
#[derive(Clone, Copy, Debug)]
pub enum Instructions {
    /// AVX-512 (F, BW, CD, DQ, VL).
    #[cfg(target_arch = "x86_64")]
    Avx512(pulp::x86::V4),
    /// AVX2 with FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(pulp::x86::V3),
    /// NEON.
    #[cfg(target_arch = "aarch64")]
    Neon(pulp::aarch64::Neon),
    /// What every machine has.
    Portable,
}

/// A piece of work that is written for packs of any width.
pub trait OnLanes {
    /// What comes of it.
    type Output;
    /// Does it; must be inlined whole to run on the instructions of `lanes`.
    fn run<L: Lanes>(self, lanes: L) -> Self::Output;
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
struct Vectorized<L, W>(L, W);

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
impl<L: Lanes, W: OnLanes> pulp::NullaryFnOnce for Vectorized<L, W> {
    type Output = W::Output;
    #[inline(always)]
    fn call(self) -> W::Output {
        self.1.run(self.0)
    }
}

/// An instruction set that the machine lacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("isa: expected an instruction set of this machine ({}), found {}", of_machine(), name(self.isa))]
pub struct IsaAbsent {
    /// What was asked for.
    pub isa: Isa,
}

impl Instructions {
    /// The instructions that were wished for.
    ///
    /// # Errors
    /// The machine lacks them.
    pub fn find(isa: Isa) -> Result<Self, IsaAbsent> {
        match isa {
            Isa::Auto => Ok(Self::widest()),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => pulp::x86::V4::try_new().map(Self::Avx512).ok_or(IsaAbsent { isa }),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => pulp::x86::V3::try_new().map(Self::Avx2).ok_or(IsaAbsent { isa }),
            #[cfg(target_arch = "aarch64")]
            Isa::Neon => pulp::aarch64::Neon::try_new().map(Self::Neon).ok_or(IsaAbsent { isa }),
            Isa::Portable => Ok(Self::Portable),
            #[cfg(not(target_arch = "x86_64"))]
            Isa::Avx512 | Isa::Avx2 => Err(IsaAbsent { isa }),
            #[cfg(not(target_arch = "aarch64"))]
            Isa::Neon => Err(IsaAbsent { isa }),
        }
    }

    /// The widest that the machine has.
    pub fn widest() -> Self {
        Isa::SETS.into_iter().find_map(|isa| Self::find(isa).ok()).unwrap_or(Self::Portable)
    }

    /// All that the machine has, the widest first.
    pub fn all() -> impl Iterator<Item = Self> {
        Isa::SETS.into_iter().filter_map(|isa| Self::find(isa).ok())
    }

    /// Which set it is; never [`Isa::Auto`].
    pub fn isa(self) -> Isa {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => Isa::Avx512,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => Isa::Avx2,
            #[cfg(target_arch = "aarch64")]
            Self::Neon(_) => Isa::Neon,
            Self::Portable => Isa::Portable,
        }
    }

    /// Runs work that is written in registers of any width. On [`Instructions::Portable`] they hold one number, whose
    /// `mul_add` would ask the platform's library: write products and sums apart there.
    #[inline]
    pub fn run<W: pulp::WithSimd>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => pulp::Simd::vectorize(simd, work),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => pulp::Simd::vectorize(simd, work),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(simd) => pulp::Simd::vectorize(simd, work),
            Self::Portable => work.with_simd(pulp::Scalar),
        }
    }

    /// Runs work that is written for packs of any width.
    #[inline]
    pub fn run_on_lanes<W: OnLanes>(self, work: W) -> W::Output {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(lanes) => lanes.vectorize(Vectorized(lanes, work)),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(lanes) => lanes.vectorize(Vectorized(lanes, work)),
            #[cfg(target_arch = "aarch64")]
            Self::Neon(lanes) => lanes.vectorize(Vectorized(lanes, work)),
            Self::Portable => work.run(Portable),
        }
    }
}

fn name(isa: Isa) -> &'static str {
    match isa {
        Isa::Auto => "auto",
        Isa::Avx512 => "avx512",
        Isa::Avx2 => "avx2",
        Isa::Neon => "neon",
        Isa::Portable => "portable",
    }
}

/// Names of the sets that the machine has.
fn of_machine() -> String {
    let names: Vec<&str> = Instructions::all().map(|instructions| name(instructions.isa())).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_is_what_was_asked_for_and_the_widest_is_of_the_machine() {
        for isa in Isa::SETS {
            match Instructions::find(isa) {
                Ok(found) => assert_eq!(found.isa(), isa),
                Err(absent) => assert!(absent.to_string().ends_with(name(isa)), "{absent}"),
            }
        }
        let found: Vec<Isa> = Instructions::all().map(Instructions::isa).collect();
        assert_eq!(found.last(), Some(&Isa::Portable));
        assert_eq!(Instructions::find(Isa::Auto).map(Instructions::isa), Ok(found[0]));
    }
}
