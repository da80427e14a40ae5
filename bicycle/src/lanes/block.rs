//! Numbers of many poses side by side.

use pulp::{Simd, bytemuck};

use super::SPAN;

/// Poses that are worked on together: three packs of the widest instruction set, so that in a matrix product every
/// weight that is read serves three sums.
pub const BLOCK: usize = 48;

/// Room of a [`Block`]: a span may begin at any of its lanes. Five lines of the cache, an odd number, so that many
/// blocks one after the other use all of it alike.
const ROOM: usize = 80;

/// One number of [`BLOCK`] poses; what follows them means nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Block(pub [f32; ROOM]);

impl Block {
    /// Zero everywhere.
    pub const ZERO: Self = Self([0.0; ROOM]);

    /// The same number in every lane.
    pub const fn filled(value: f32) -> Self {
        Self([value; ROOM])
    }

    /// The numbers of all poses.
    #[inline(always)]
    pub fn lanes(&self) -> &[f32; BLOCK] {
        self.0.first_chunk().unwrap_or(&[0.0; BLOCK])
    }

    /// The same to be written.
    #[inline(always)]
    pub fn lanes_mut(&mut self) -> &mut [f32] {
        &mut self.0[..BLOCK]
    }

    /// Numbers from a lane on, which must be one of the block's.
    #[inline(always)]
    pub fn span(&self, first_lane: usize) -> &[f32; SPAN] {
        self.0[first_lane..].first_chunk().unwrap_or(&[0.0; SPAN])
    }

    /// The same to be written. Whoever writes several one after the other may write more than he has: the next one
    /// overwrites what was too much.
    #[inline(always)]
    pub fn span_mut(&mut self, first_lane: usize) -> Option<&mut [f32; SPAN]> {
        self.0[first_lane..].first_chunk_mut()
    }

    /// Registers that hold the numbers of all poses.
    pub const fn n_registers<S: Simd>() -> usize {
        BLOCK / S::F32_LANES
    }

    /// One of them.
    #[inline(always)]
    pub fn get<S: Simd>(&self, register: usize) -> S::f32s {
        bytemuck::cast_slice::<f32, S::f32s>(&self.0)[register]
    }

    /// Writes one of them.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, register: usize, values: S::f32s) {
        bytemuck::cast_slice_mut::<f32, S::f32s>(&mut self.0)[register] = values;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Instructions, Lanes, OnLanes};

    /// Magnitudes of the numbers of a span, and whether any of them is above a limit.
    struct Magnitudes<'a> {
        block: &'a mut Block,
        first_lane: usize,
        limit: f32,
    }

    impl OnLanes for Magnitudes<'_> {
        type Output = bool;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> bool {
            let mut is_any_above = false;
            for offset in (0..SPAN).step_by(L::WIDTH) {
                let magnitude = lanes.real_of_span(self.block.span(self.first_lane), offset).abs();
                is_any_above |= lanes.any(lanes.real_single(self.limit).less(magnitude));
                if let Some(span) = self.block.span_mut(self.first_lane) {
                    lanes.to_span(magnitude.1, span, offset);
                }
            }
            is_any_above
        }
    }

    #[test]
    fn spans_are_read_and_written_from_any_lane_on_by_every_instruction_set() {
        let numbers = Block(std::array::from_fn(|lane| 0.5 - lane as f32));
        for instructions in Instructions::all() {
            for first_lane in [0, 1, 16, 29, BLOCK - 1, BLOCK + SPAN - 1] {
                let mut block = numbers;
                let largest = (first_lane + SPAN - 1) as f32 - 0.5;
                let mut run =
                    |limit| instructions.run_on_lanes(Magnitudes { block: &mut block, first_lane, limit });
                assert!(run(largest - 0.25) && !run(largest), "{instructions:?} {first_lane}");
                for (lane, number) in block.0.iter().enumerate() {
                    let is_in_span = (first_lane..first_lane + SPAN).contains(&lane);
                    let before = numbers.0[lane];
                    assert_eq!(*number, if is_in_span { before.abs() } else { before });
                }
            }
        }
    }
}
