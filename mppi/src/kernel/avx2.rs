//! AVX2 with FMA.
#![cfg(target_arch = "x86_64")]

use super::{Kernel, Row, lookup};
use pulp::x86::V3;
use pulp::{cast, f32x8, u32x8};
use traversability::Risk;

impl Kernel for V3 {
    type Bits = u32x8;
    const IN_FLIGHT: usize = 1;

    #[inline(always)]
    fn load(self, row: &Row, offset: usize) -> f32x8 {
        cast!(row.0.as_chunks::<8>().0[offset / 8])
    }
    #[inline(always)]
    fn store(self, row: &mut Row, offset: usize, value: f32x8) {
        row.0.as_chunks_mut::<8>().0[offset / 8] = cast!(value);
    }
    #[inline(always)]
    fn load_lanes(self, values: &[f32; 16]) -> f32x8 {
        cast!(values.as_chunks::<8>().0[0])
    }
    #[inline(always)]
    fn count_from(self, first: u32) -> u32x8 {
        let lanes: [u32; 8] = std::array::from_fn(|lane| lane as u32);
        self.add_bits(self.word(first), cast!(lanes))
    }
    #[inline(always)]
    fn word(self, value: u32) -> u32x8 {
        self.splat_u32x8(value)
    }
    #[inline(always)]
    fn add_bits(self, a: u32x8, b: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_add_epi32(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn mul_bits(self, a: u32x8, b: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_mullo_epi32(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn xor_bits(self, a: u32x8, b: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_xor_si256(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn or_bits(self, a: u32x8, b: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_or_si256(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn and_bits(self, a: u32x8, b: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_and_si256(cast!(a), cast!(b)))
    }
    #[inline(always)]
    fn shl<const N: u32>(self, a: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_sllv_epi32(cast!(a), cast!(self.word(N))))
    }
    #[inline(always)]
    fn shr<const N: u32>(self, a: u32x8) -> u32x8 {
        cast!(self.avx2._mm256_srlv_epi32(cast!(a), cast!(self.word(N))))
    }
    #[inline(always)]
    fn as_value(self, bits: u32x8) -> f32x8 {
        cast!(bits)
    }
    #[inline(always)]
    fn as_bits(self, value: f32x8) -> u32x8 {
        cast!(value)
    }
    #[inline(always)]
    fn truncate(self, value: f32x8) -> u32x8 {
        cast!(self.avx._mm256_cvttps_epi32(cast!(value)))
    }
    #[inline(always)]
    fn convert(self, bits: u32x8) -> f32x8 {
        cast!(self.avx._mm256_cvtepi32_ps(cast!(bits)))
    }
    #[inline(always)]
    fn risks(self, table: &[Risk], indices: u32x8) -> [f32x8; 4] {
        lookup::x86::risks8(self, table, indices)
    }
    #[inline(always)]
    fn gather(self, table: &[f32], indices: u32x8) -> f32x8 {
        let indices: [u32; 8] = cast!(indices);
        cast!(lookup::entries(table, indices))
    }
    #[inline(always)]
    fn words(self, bits: u32x8) -> [u32; 16] {
        let eight: [u32; 8] = cast!(bits);
        std::array::from_fn(|lane| eight[lane % 8])
    }
    #[inline(always)]
    fn sum(self, value: f32x8) -> f32 {
        let lanes: [f32; 8] = cast!(value);
        let four: [f32; 4] = std::array::from_fn(|i| lanes[i] + lanes[i + 4]);
        (four[0] + four[2]) + (four[1] + four[3])
    }
    #[inline(always)]
    fn smallest(self, value: f32x8) -> f32 {
        let lanes: [f32; 8] = cast!(value);
        lanes.into_iter().fold(f32::INFINITY, f32::min)
    }
}
