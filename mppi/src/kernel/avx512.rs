//! AVX-512.
#![cfg(target_arch = "x86_64")]

use super::{Kernel, Row, lookup};
use pulp::x86::V4;
use pulp::{cast, f32x16, u32x16};
use traversability::Risk;

impl Kernel for V4 {
    type Bits = u32x16;
    const IN_FLIGHT: usize = 2;

    #[inline(always)]
    fn load(self, row: &Row, offset: usize) -> f32x16 {
        cast!(row.0.as_chunks::<16>().0[offset / 16])
    }
    #[inline(always)]
    fn store(self, row: &mut Row, offset: usize, value: f32x16) {
        row.0.as_chunks_mut::<16>().0[offset / 16] = cast!(value);
    }
    #[inline(always)]
    fn load_lanes(self, values: &[f32; 16]) -> f32x16 {
        cast!(values.as_chunks::<16>().0[0])
    }
    #[inline(always)]
    fn count_from(self, first: u32) -> u32x16 {
        let lanes: [u32; 16] = std::array::from_fn(|lane| lane as u32);
        self.add_bits(self.word(first), cast!(lanes))
    }
    #[inline(always)]
    fn word(self, value: u32) -> u32x16 {
        self.splat_u32x16(value)
    }
    #[inline(always)]
    fn add_bits(self, a: u32x16, b: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_add_epi32(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn mul_bits(self, a: u32x16, b: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_mullo_epi32(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn xor_bits(self, a: u32x16, b: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_xor_si512(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn or_bits(self, a: u32x16, b: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_or_si512(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn and_bits(self, a: u32x16, b: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_and_si512(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn shl<const N: u32>(self, a: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_sllv_epi32(cast!(a), cast!(self.word(N))))
    }
    #[inline(always)]
    fn shr<const N: u32>(self, a: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_srlv_epi32(cast!(a), cast!(self.word(N))))
    }
    #[inline(always)]
    fn rotate<const N: u32, const M: u32>(self, a: u32x16) -> u32x16 {
        cast!(self.avx512f._mm512_rolv_epi32(cast!(a), cast!(self.word(N))))
    }
    #[inline(always)]
    fn split(self, value: f32x16) -> (f32x16, f32x16) {
        let exponent = cast!(self.avx512f._mm512_getexp_ps(cast!(value)));
        // Mantissa in [1, 2), sign of the source.
        let mantissa = cast!(self.avx512f._mm512_getmant_ps::<0, 0>(cast!(value)));
        (exponent, self.sub_f32x16(mantissa, self.splat_f32x16(1.0)))
    }
    #[inline(always)]
    fn as_value(self, bits: u32x16) -> f32x16 {
        cast!(bits)
    }
    #[inline(always)]
    fn as_bits(self, value: f32x16) -> u32x16 {
        cast!(value)
    }
    #[inline(always)]
    fn truncate(self, value: f32x16) -> u32x16 {
        cast!(self.avx512f._mm512_cvttps_epi32(cast!(value)))
    }
    #[inline(always)]
    fn convert(self, bits: u32x16) -> f32x16 {
        cast!(self.avx512f._mm512_cvtepi32_ps(cast!(bits)))
    }
    #[inline(always)]
    fn risks(self, table: &[Risk], indices: u32x16) -> [f32x16; 4] {
        lookup::x86::risks16(self, table, indices)
    }
    #[inline(always)]
    fn gather(self, table: &[f32], indices: u32x16) -> f32x16 {
        let indices: [u32; 16] = cast!(indices);
        cast!(lookup::entries(table, indices))
    }
    #[inline(always)]
    fn words(self, bits: u32x16) -> [u32; 16] {
        cast!(bits)
    }
    #[inline(always)]
    fn sum(self, value: f32x16) -> f32 {
        let lanes: [f32; 16] = cast!(value);
        let eight: [f32; 8] = std::array::from_fn(|i| lanes[i] + lanes[i + 8]);
        let four: [f32; 4] = std::array::from_fn(|i| eight[i] + eight[i + 4]);
        (four[0] + four[2]) + (four[1] + four[3])
    }
    #[inline(always)]
    fn sums(self, values: [f32x16; 4]) -> [f32; 4] {
        let avx512f = self.avx512f;
        let [a, b, c, d] = values.map(|value| cast!(value));
        let add = |x, y| avx512f._mm512_add_ps(x, y);
        // Quarters of a register: the upper half of each value onto its lower, then the upper quarter.
        let halved = |x, y| {
            let (low, high) =
                (avx512f._mm512_shuffle_f32x4::<0x44>(x, y), avx512f._mm512_shuffle_f32x4::<0xEE>(x, y));
            add(low, high)
        };
        let (ab, cd) = (halved(a, b), halved(c, d));
        let low = avx512f._mm512_shuffle_f32x4::<0x88>(ab, cd);
        let quarters = add(low, avx512f._mm512_shuffle_f32x4::<0xDD>(ab, cd));
        // What is left of a value is a quarter of its own.
        let pairs = add(quarters, avx512f._mm512_permute_ps::<0b01_00_11_10>(quarters));
        let sums: [f32; 16] = cast!(add(pairs, avx512f._mm512_permute_ps::<0b10_11_00_01>(pairs)));
        [sums[0], sums[4], sums[8], sums[12]]
    }
    #[inline(always)]
    fn smallest(self, value: f32x16) -> f32 {
        let lanes: [f32; 16] = cast!(value);
        lanes.into_iter().fold(f32::INFINITY, f32::min)
    }
}
