//! NEON, packs of two registers.
#![cfg(target_arch = "aarch64")]

use super::{Kernel, Row, lookup};
use pulp::aarch64::Neon;
use pulp::{cast, f32x4, u32x4};
use std::array::from_fn;
use traversability::Risk;

type Pack = [f32x4; 2];
type Words = [u32x4; 2];

impl Kernel for Neon {
    type Bits = Words;
    const IN_FLIGHT: usize = 1;

    #[inline(always)]
    fn load(self, row: &Row, offset: usize) -> Pack {
        cast!(row.0.as_chunks::<8>().0[offset / 8])
    }
    #[inline(always)]
    fn store(self, row: &mut Row, offset: usize, value: Pack) {
        row.0.as_chunks_mut::<8>().0[offset / 8] = cast!(value);
    }
    #[inline(always)]
    fn load_lanes(self, values: &[f32; 16]) -> Pack {
        cast!(values.as_chunks::<8>().0[0])
    }
    #[inline(always)]
    fn count_from(self, first: u32) -> Words {
        let lanes: [u32; 8] = from_fn(|lane| lane as u32);
        self.add_bits(self.word(first), cast!(lanes))
    }
    #[inline(always)]
    fn word(self, value: u32) -> Words {
        [cast!(self.neon.vdupq_n_u32(value)); 2]
    }
    #[inline(always)]
    fn add_bits(self, a: Words, b: Words) -> Words {
        from_fn(|half| cast!(self.neon.vaddq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn mul_bits(self, a: Words, b: Words) -> Words {
        from_fn(|half| cast!(self.neon.vmulq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn xor_bits(self, a: Words, b: Words) -> Words {
        from_fn(|half| cast!(self.neon.veorq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn or_bits(self, a: Words, b: Words) -> Words {
        from_fn(|half| cast!(self.neon.vorrq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn and_bits(self, a: Words, b: Words) -> Words {
        from_fn(|half| cast!(self.neon.vandq_u32(cast!(a[half]), cast!(b[half]))))
    }
    #[inline(always)]
    fn shl<const N: u32>(self, a: Words) -> Words {
        let by = self.neon.vdupq_n_s32(N as i32);
        a.map(|a| cast!(self.neon.vshlq_u32(cast!(a), by)))
    }
    #[inline(always)]
    fn shr<const N: u32>(self, a: Words) -> Words {
        // Shifts to the left by less than nothing are shifts to the right.
        let by = self.neon.vdupq_n_s32(-(N as i32));
        a.map(|a| cast!(self.neon.vshlq_u32(cast!(a), by)))
    }
    #[inline(always)]
    fn as_value(self, bits: Words) -> Pack {
        cast!(bits)
    }
    #[inline(always)]
    fn as_bits(self, value: Pack) -> Words {
        cast!(value)
    }
    #[inline(always)]
    fn truncate(self, value: Pack) -> Words {
        value.map(|value| cast!(self.neon.vcvtq_s32_f32(cast!(value))))
    }
    #[inline(always)]
    fn truncate_up_to(self, value: Pack, last: Pack) -> Words {
        // To words without a sign, negative numbers and NaN become 0.
        let words = |pack: Pack| pack.map(|value| self.neon.vcvtq_u32_f32(cast!(value)));
        let (words, last) = (words(value), words(last));
        from_fn(|half| cast!(self.neon.vminq_u32(words[half], last[half])))
    }
    #[inline(always)]
    fn truncate_within(self, value: Pack, last: Pack) -> Words {
        self.truncate_up_to(value, last)
    }
    #[inline(always)]
    fn convert(self, bits: Words) -> Pack {
        bits.map(|bits| cast!(self.neon.vcvtq_f32_s32(cast!(bits))))
    }
    #[inline(always)]
    fn risks(self, table: &[Risk], indices: Words) -> [Pack; 4] {
        lookup::aarch64::risks8(self, table, indices)
    }
    #[inline(always)]
    fn gather(self, table: &[f32], indices: Words) -> Pack {
        let indices: [u32; 8] = cast!(indices);
        cast!(lookup::entries(table, indices))
    }
    #[inline(always)]
    fn words(self, bits: Words) -> [u32; 16] {
        let eight: [u32; 8] = cast!(bits);
        from_fn(|lane| eight[lane % 8])
    }
    #[inline(always)]
    fn sum(self, value: Pack) -> f32 {
        let lanes: [f32; 8] = cast!(value);
        let four: [f32; 4] = from_fn(|i| lanes[i] + lanes[i + 4]);
        (four[0] + four[2]) + (four[1] + four[3])
    }
    #[inline(always)]
    fn smallest(self, value: Pack) -> f32 {
        let lanes: [f32; 8] = cast!(value);
        lanes.into_iter().fold(f32::INFINITY, f32::min)
    }
}
