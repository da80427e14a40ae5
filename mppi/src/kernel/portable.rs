//! The instructions that every machine has.

use super::{Kernel, Row, lookup};
use bicycle::lanes::Portable;
use traversability::Risk;

type Words = [u32; 8];

#[inline(always)]
fn zip(a: Words, b: Words, of: impl Fn(u32, u32) -> u32) -> Words {
    std::array::from_fn(|i| of(a[i], b[i]))
}

impl Kernel for Portable {
    type Bits = Words;
    const IN_FLIGHT: usize = 1;

    #[inline(always)]
    fn load(self, row: &Row, offset: usize) -> [f32; 8] {
        row.0.as_chunks::<8>().0[offset / 8]
    }
    #[inline(always)]
    fn store(self, row: &mut Row, offset: usize, value: [f32; 8]) {
        row.0.as_chunks_mut::<8>().0[offset / 8] = value;
    }
    #[inline(always)]
    fn load_lanes(self, values: &[f32; 16]) -> [f32; 8] {
        std::array::from_fn(|i| values[i])
    }
    #[inline(always)]
    fn count_from(self, first: u32) -> Words {
        std::array::from_fn(|i| first.wrapping_add(i as u32))
    }
    #[inline(always)]
    fn word(self, value: u32) -> Words {
        [value; 8]
    }
    #[inline(always)]
    fn add_bits(self, a: Words, b: Words) -> Words {
        zip(a, b, u32::wrapping_add)
    }
    #[inline(always)]
    fn mul_bits(self, a: Words, b: Words) -> Words {
        zip(a, b, u32::wrapping_mul)
    }
    #[inline(always)]
    fn xor_bits(self, a: Words, b: Words) -> Words {
        zip(a, b, |a, b| a ^ b)
    }
    #[inline(always)]
    fn or_bits(self, a: Words, b: Words) -> Words {
        zip(a, b, |a, b| a | b)
    }
    #[inline(always)]
    fn and_bits(self, a: Words, b: Words) -> Words {
        zip(a, b, |a, b| a & b)
    }
    #[inline(always)]
    fn shl<const N: u32>(self, a: Words) -> Words {
        a.map(|a| a << N)
    }
    #[inline(always)]
    fn shr<const N: u32>(self, a: Words) -> Words {
        a.map(|a| a >> N)
    }
    #[inline(always)]
    fn as_value(self, bits: Words) -> [f32; 8] {
        bits.map(f32::from_bits)
    }
    #[inline(always)]
    fn as_bits(self, value: [f32; 8]) -> Words {
        value.map(f32::to_bits)
    }
    #[inline(always)]
    fn truncate(self, value: [f32; 8]) -> Words {
        value.map(|value| value as i32 as u32)
    }
    #[inline(always)]
    fn convert(self, bits: Words) -> [f32; 8] {
        bits.map(|bits| bits as i32 as f32)
    }
    #[inline(always)]
    fn risks(self, table: &[Risk], indices: Words) -> [[f32; 8]; 4] {
        let rows = lookup::rows(table, indices);
        std::array::from_fn(|column| rows.map(|row| row[column]))
    }
    #[inline(always)]
    fn gather(self, table: &[f32], indices: Words) -> [f32; 8] {
        lookup::entries(table, indices)
    }
    #[inline(always)]
    fn words(self, bits: Words) -> [u32; 16] {
        std::array::from_fn(|lane| bits[lane % 8])
    }
    #[inline(always)]
    fn sum(self, value: [f32; 8]) -> f32 {
        let halves: [f32; 4] = std::array::from_fn(|i| value[i] + value[i + 4]);
        (halves[0] + halves[2]) + (halves[1] + halves[3])
    }
    #[inline(always)]
    fn smallest(self, value: [f32; 8]) -> f32 {
        value.into_iter().fold(f32::INFINITY, f32::min)
    }
}
