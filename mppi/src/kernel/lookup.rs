//! Reading tables at indices that come out of a pack.
//!
//! Every function here clamps the indices itself, so that no bit pattern that the arithmetic before it can make,
//! NaN included, reads beyond the table.

use traversability::{Ground, Risk};

/// The rows of a risk table at these indices; beyond the table, its last row.
#[inline(always)]
pub(super) fn rows<const N: usize>(table: &[Risk], indices: [u32; N]) -> [[f32; 4]; N] {
    let last = last_index(table);
    indices.map(|index| {
        // SAFETY: `last_index` has checked that the table is not empty, and the index is at most its last one.
        let risk = unsafe { table.get_unchecked((index as usize).min(last)) };
        [risk.linear_traction, risk.angular_traction, risk.roll_rad, risk.pitch_rad]
    })
}

/// The entries of a table at these indices; beyond the table, its last entry.
#[inline(always)]
pub(super) fn entries<const N: usize>(table: &[f32], indices: [u32; N]) -> [f32; N] {
    let last = last_index(table);
    indices.map(|index| {
        // SAFETY: `last_index` has checked that the table is not empty, and the index is at most its last one.
        unsafe { *table.get_unchecked((index as usize).min(last)) }
    })
}

/// Gradient east, gradient north, class and friction at these indices; beyond the table, of its last entry.
#[inline(always)]
pub(super) fn grounds<const N: usize>(table: &[Ground], indices: [u32; N]) -> [[f32; 4]; N] {
    let last = last_index(table);
    indices.map(|index| {
        // SAFETY: `last_index` has checked that the table is not empty, and the index is at most its last one.
        let ground = unsafe { table.get_unchecked((index as usize).min(last)) };
        [ground.gradient[0], ground.gradient[1], f32::from(ground.class), ground.friction.friction()]
    })
}

/// Fastest speed that the ground at these indices allows [m/s]; beyond the table, of its last entry.
#[inline(always)]
pub(super) fn fastest_mps<const N: usize>(table: &[Ground], indices: [u32; N]) -> [f32; N] {
    let last = last_index(table);
    indices.map(|index| {
        // SAFETY: `last_index` has checked that the table is not empty, and the index is at most its last one.
        unsafe { table.get_unchecked((index as usize).min(last)) }.speed.mps()
    })
}

/// Index of the last entry; panics for an empty table.
#[inline(always)]
fn last_index<T>(table: &[T]) -> usize {
    assert!(!table.is_empty(), "a table to look up in has entries");
    table.len() - 1
}

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
const _: () = assert!(size_of::<Risk>() == 16 && align_of::<Risk>() == 4);

/// Largest index as a word; tables beyond 2^32 entries are read as if they ended there.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[inline(always)]
fn last_word<T>(table: &[T]) -> u32 {
    u32::try_from(last_index(table)).unwrap_or(u32::MAX)
}

/// One 16-byte row of the table.
///
/// # Safety
/// `index` is an index of the table that `start` points to.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
#[inline(always)]
unsafe fn row(start: *const Risk, index: u32) -> pulp::f32x4 {
    // SAFETY: a Risk is four adjacent f32 (repr(C), 16 bytes), `f32x4` has the same layout, every bit pattern
    // is a valid f32, and the caller vouches for the index; the read does not ask for alignment.
    unsafe { start.add(index as usize).cast::<pulp::f32x4>().read_unaligned() }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod x86 {
    use super::{last_word, row};
    use pulp::x86::{V3, V4};
    use pulp::{cast, f32x8, f32x16, u32x8, u32x16};
    use traversability::Risk;

    /// Sixteen rows, one 16-byte load each, turned into four columns.
    #[inline(always)]
    pub(crate) fn risks16(simd: V4, table: &[Risk], indices: u32x16) -> [f32x16; 4] {
        let avx = simd.avx512f;
        let last = cast!(simd.splat_u32x16(last_word(table)));
        let clamped: [u32; 16] = cast!(avx._mm512_min_epu32(cast!(indices), last));
        let start = table.as_ptr();
        // SAFETY: the table is not empty and all indices were just clamped to its last one.
        let load = |lane: usize| unsafe { row(start, clamped[lane]) };
        // Row i of a quarter ends up beside rows i + 4, i + 8, i + 12, so that two unpacks transpose all.
        let quarter = |i: usize| {
            let first = avx._mm512_castps128_ps512(cast!(load(i)));
            let second = avx._mm512_insertf32x4::<1>(first, cast!(load(i + 4)));
            let third = avx._mm512_insertf32x4::<2>(second, cast!(load(i + 8)));
            avx._mm512_insertf32x4::<3>(third, cast!(load(i + 12)))
        };
        let (r0, r1, r2, r3) = (quarter(0), quarter(1), quarter(2), quarter(3));
        let (low01, high01) = (avx._mm512_unpacklo_ps(r0, r1), avx._mm512_unpackhi_ps(r0, r1));
        let (low23, high23) = (avx._mm512_unpacklo_ps(r2, r3), avx._mm512_unpackhi_ps(r2, r3));
        [
            cast!(avx._mm512_unpacklo_pd(cast!(low01), cast!(low23))),
            cast!(avx._mm512_unpackhi_pd(cast!(low01), cast!(low23))),
            cast!(avx._mm512_unpacklo_pd(cast!(high01), cast!(high23))),
            cast!(avx._mm512_unpackhi_pd(cast!(high01), cast!(high23))),
        ]
    }

    /// Eight rows, one 16-byte load each, turned into four columns.
    #[inline(always)]
    pub(crate) fn risks8(simd: V3, table: &[Risk], indices: u32x8) -> [f32x8; 4] {
        let avx = simd.avx;
        let last = cast!(simd.splat_u32x8(last_word(table)));
        let clamped: [u32; 8] = cast!(simd.avx2._mm256_min_epu32(cast!(indices), last));
        let start = table.as_ptr();
        // SAFETY: the table is not empty and all indices were just clamped to its last one.
        let load = |lane: usize| unsafe { row(start, clamped[lane]) };
        let half = |i: usize| {
            let first = avx._mm256_castps128_ps256(cast!(load(i)));
            avx._mm256_insertf128_ps::<1>(first, cast!(load(i + 4)))
        };
        let (r0, r1, r2, r3) = (half(0), half(1), half(2), half(3));
        let (low01, high01) = (avx._mm256_unpacklo_ps(r0, r1), avx._mm256_unpackhi_ps(r0, r1));
        let (low23, high23) = (avx._mm256_unpacklo_ps(r2, r3), avx._mm256_unpackhi_ps(r2, r3));
        [
            cast!(avx._mm256_unpacklo_pd(cast!(low01), cast!(low23))),
            cast!(avx._mm256_unpackhi_pd(cast!(low01), cast!(low23))),
            cast!(avx._mm256_unpacklo_pd(cast!(high01), cast!(high23))),
            cast!(avx._mm256_unpackhi_pd(cast!(high01), cast!(high23))),
        ]
    }
}

#[cfg(target_arch = "aarch64")]
pub(super) mod aarch64 {
    use super::{last_word, row};
    use pulp::aarch64::Neon;
    use pulp::{cast, f32x4, u32x4};
    use traversability::Risk;

    /// Eight rows, one 16-byte load each, turned into four columns.
    #[inline(always)]
    pub(crate) fn risks8(simd: Neon, table: &[Risk], indices: [u32x4; 2]) -> [[f32x4; 2]; 4] {
        let last = simd.neon.vdupq_n_u32(last_word(table));
        let clamped: [[u32; 4]; 2] = indices.map(|four| cast!(simd.neon.vminq_u32(cast!(four), last)));
        let start = table.as_ptr();
        let halves = clamped.map(|four| {
            // SAFETY: the table is not empty and all indices were just clamped to its last one.
            columns(simd, four.map(|index| unsafe { row(start, index) }))
        });
        std::array::from_fn(|column| halves.map(|columns| columns[column]))
    }

    /// Four rows turned into four columns.
    #[inline(always)]
    fn columns(simd: Neon, [r0, r1, r2, r3]: [f32x4; 4]) -> [f32x4; 4] {
        let neon = simd.neon;
        let (even01, odd01) = (neon.vtrn1q_f32(cast!(r0), cast!(r1)), neon.vtrn2q_f32(cast!(r0), cast!(r1)));
        let (even23, odd23) = (neon.vtrn1q_f32(cast!(r2), cast!(r3)), neon.vtrn2q_f32(cast!(r2), cast!(r3)));
        [
            cast!(neon.vtrn1q_f64(cast!(even01), cast!(even23))),
            cast!(neon.vtrn1q_f64(cast!(odd01), cast!(odd23))),
            cast!(neon.vtrn2q_f64(cast!(even01), cast!(even23))),
            cast!(neon.vtrn2q_f64(cast!(odd01), cast!(odd23))),
        ]
    }
}
