//! A yardstick: one update of the controller by hand, in NEON, every setting a constant.
//!
//! The work is that of `bound` in `mppi/counting/updates.rs`: white noise on the controls, control cost, a bicycle over
//! 81 x 96 x 13 risks, the price of attitude, time and distance to a goal with a latch, weights at a given temperature,
//! the sums of the cost terms and the mean. No options, no errors, no other model and no safety: it shows what the
//! instruction set can do, and is nothing to live in. `scripts/count-aarch64` compiles it and counts what it executes:
//!
//! ```bash
//! bound_of_an_update_on_arm UPDATES
//! ```
#![allow(unsafe_op_in_unsafe_fn)]

use std::arch::aarch64::*;
use std::array::from_fn;
use std::hint::black_box;

const N_ROLLOUTS: usize = 1024;
const N_STEPS: usize = 50;
const N_ROWS: usize = 96;
const N_COLS: usize = 81;
const N_YAWS: usize = 13;
/// Rollouts that are stored side by side.
const CHUNK: usize = 64;
/// Rollouts of a register. One is on its way at a time: the constants fill the others.
const WIDTH: usize = 4;

const STEP_S: f32 = 0.1;
const CELL_M: f32 = 0.5;
const WHEELBASE_M: f32 = 2.5;
const LOW: [f32; 2] = [0.0, -0.5];
const HIGH: [f32; 2] = [6.0, 0.5];
const STD: [f32; 2] = [1.0, 0.2236];
const TEMPERATURE_S: f32 = 1.0;
const ROLL_MAX_RAD: f32 = 0.468;
const PITCH_MAX_RAD: f32 = 0.468;
const ATTITUDE_S: f32 = 100.0;
const TRACTION_LEAST: f32 = 0.1;
/// Of a cell of distance, per step and at the end [s].
const DISTANCE_S: f32 = 0.5;
/// Squared distance at which the goal is reached [cells2].
const TOLERANCE_CELLS2: f32 = 1.0;
const GOAL_CELLS: [f32; 2] = [64.5, 76.0];
const START: [f32; 3] = [20.5, 28.0, 0.124_14];

const TAN: [f32; 6] = [0.999_998_2, 0.333_416_68, 0.132_286_44, 0.059_395_746, 0.008_769_429, 0.022_696_837];
const SINE: [f32; 6] = [6.283_183_6, -41.341_473, 81.597_18, -76.588_43, 41.236_626, -12.314_538];
const COSINE: [f32; 7] = [1.0, -19.739_204, 64.939_12, -85.450_165, 60.167_83, -25.968_313, 6.529_610_4];
const NOISE_SINE: [f32; 5] = [6.283_091, -41.332_71, 81.385_82, -74.571_49, 32.938_44];
const NOISE_COSINE: [f32; 6] = [0.999_999_2, -19.738_983, 64.928_73, -85.272_4, 58.794_04, -21.076_782];
/// Behind the coefficients, what makes a logarithm the square of a radius.
const LOG2: [f32; 6] = [1.442_094_7, -0.710_751, 0.420_602_8, -0.199_636_4, 0.047_706_24, -1.386_294_4];
const EXP2: [f32; 6] = [1.0, 0.693_146_94, 0.240_221_2, 0.055_507_134, 0.009_675_541, 0.001_327_647_2];

type V = float32x4_t;
type W = uint32x4_t;

#[inline(always)]
unsafe fn s(value: f32) -> V {
    vdupq_n_f32(value)
}

/// Up to eight coefficients, four to a register: the compiler is not told what they are, or it would spread them again.
#[derive(Clone, Copy)]
struct Polynomial([V; 2]);

impl Polynomial {
    unsafe fn new(coefficients: &[f32]) -> Self {
        let mut eight = [0.0; 8];
        eight[..coefficients.len()].copy_from_slice(coefficients);
        let eight = black_box(eight);
        Self([vld1q_f32(eight.as_ptr()), vld1q_f32(eight.as_ptr().add(4))])
    }

    /// Two neighbours of a register: the one plus the other times z.
    #[inline(always)]
    unsafe fn pair<const LOW: i32, const HIGH: i32>(four: V, z: V) -> V {
        vfmaq_laneq_f32::<HIGH>(vdupq_laneq_f32::<LOW>(four), z, four)
    }

    /// The first four and what follows them, over the fourth power of z.
    #[inline(always)]
    unsafe fn close(&self, z: V, square: V, rest: V) -> V {
        let upper = vfmaq_f32(Self::pair::<2, 3>(self.0[0], z), square, rest);
        vfmaq_f32(Self::pair::<0, 1>(self.0[0], z), square, upper)
    }

    #[inline(always)]
    unsafe fn of_five(&self, z: V) -> V {
        let square = vmulq_f32(z, z);
        let upper = vfmaq_laneq_f32::<0>(Self::pair::<2, 3>(self.0[0], z), square, self.0[1]);
        vfmaq_f32(Self::pair::<0, 1>(self.0[0], z), square, upper)
    }

    #[inline(always)]
    unsafe fn of_six(&self, z: V, square: V) -> V {
        self.close(z, square, Self::pair::<0, 1>(self.0[1], z))
    }

    #[inline(always)]
    unsafe fn of_seven(&self, z: V, square: V) -> V {
        let rest = vfmaq_laneq_f32::<2>(Self::pair::<0, 1>(self.0[1], z), square, self.0[1]);
        self.close(z, square, rest)
    }
}

/// The part of turns that lies within half a turn.
#[inline(always)]
unsafe fn wrap(turns: V) -> V {
    vsubq_f32(turns, vrndnq_f32(turns))
}

#[inline(always)]
unsafe fn where_holds(mask: W, value: V) -> V {
    vreinterpretq_f32_u32(vandq_u32(mask, vreinterpretq_u32_f32(value)))
}

/// Blackman and Vigna's xoshiro128+, one stream a lane.
#[derive(Clone, Copy)]
struct Generator([W; 4]);

impl Generator {
    unsafe fn new(seed: u64) -> Self {
        let mut state = seed;
        let mut word = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 32) as u32
        };
        Self(from_fn(|_| {
            let words: [u32; WIDTH] = from_fn(|_| word());
            unsafe { vld1q_u32(words.as_ptr()) }
        }))
    }

    /// Uniform in [1, 2).
    #[inline(always)]
    unsafe fn uniform(&mut self) -> V {
        let [a, b, c, d] = self.0;
        let (c, d) = (veorq_u32(c, a), veorq_u32(d, b));
        let turned = vsriq_n_u32::<21>(vshlq_n_u32::<11>(d), d);
        let result = vaddq_u32(a, self.0[3]);
        self.0 = [veorq_u32(a, d), veorq_u32(b, c), veorq_u32(c, vshlq_n_u32::<9>(b)), turned];
        vreinterpretq_f32_u32(vsraq_n_u32::<9>(vdupq_n_u32(0x3f80_0000), result))
    }

    /// Two normal numbers, by the polynomials of a logarithm, a sine and a cosine.
    #[inline(always)]
    unsafe fn normals(&mut self, [log2, sine, cosine]: &[Polynomial; 3]) -> [V; 2] {
        let u = vreinterpretq_u32_f32(vsubq_f32(s(2.0), self.uniform()));
        let exponent = vaddq_f32(vcvtq_f32_u32(vshrq_n_u32::<23>(u)), s(-127.0));
        let mantissa = vorrq_u32(vandq_u32(u, vdupq_n_u32(0x007f_ffff)), vdupq_n_u32(0x3f80_0000));
        let rest = vaddq_f32(vreinterpretq_f32_u32(mantissa), s(-1.0));
        let logarithm = vfmaq_f32(exponent, rest, log2.of_five(rest));
        let radius = vsqrtq_f32(vmaxq_f32(vmulq_laneq_f32::<1>(logarithm, log2.0[1]), s(0.0)));
        let turns = wrap(self.uniform());
        let square = vmulq_f32(turns, turns);
        let (sine, cosine) = (sine.of_five(square), cosine.of_six(square, vmulq_f32(square, square)));
        [vmulq_f32(radius, cosine), vmulq_f32(radius, vmulq_f32(turns, sine))]
    }
}

/// Where the noise of a step is added, its standard deviations, and what a unit of control costs.
#[derive(Clone, Copy, Default)]
#[repr(C)]
struct SampleStep {
    base: [f32; 2],
    std: [f32; 2],
    gradient: [f32; 2],
}

/// Cost terms: control, running, attitude, terminal; last the steps beyond a limit.
const N_TERMS: usize = 5;

#[derive(Clone)]
#[repr(C, align(64))]
struct Chunk {
    controls: [[[f32; CHUNK]; 2]; N_STEPS],
    terms: [[f32; CHUNK]; N_TERMS],
    costs: [f32; CHUNK],
    weights: [f32; CHUNK],
}

unsafe fn sample(chunk: &mut Chunk, steps: &[SampleStep; N_STEPS], nominal_cost: f32, seed: u64) {
    let polynomials = [Polynomial::new(&LOG2), Polynomial::new(&NOISE_SINE), Polynomial::new(&NOISE_COSINE)];
    for first in (0..CHUNK).step_by(WIDTH) {
        let mut stream = Generator::new(seed + first as u64);
        let mut cost = s(-nominal_cost);
        for (step, rows) in steps.iter().zip(&mut chunk.controls) {
            let fresh = stream.normals(&polynomials);
            let four = vld1q_f32((&raw const *step).cast());
            let gradient = vld1_f32(step.gradient.as_ptr());
            let speed = vfmaq_laneq_f32::<2>(vdupq_laneq_f32::<0>(four), fresh[0], four);
            let steering = vfmaq_laneq_f32::<3>(vdupq_laneq_f32::<1>(four), fresh[1], four);
            let speed = vminq_f32(vmaxq_f32(speed, s(LOW[0])), s(HIGH[0]));
            let steering = vminq_f32(vmaxq_f32(steering, s(LOW[1])), s(HIGH[1]));
            cost = vfmaq_lane_f32::<0>(cost, speed, gradient);
            cost = vfmaq_lane_f32::<1>(cost, steering, gradient);
            vst1q_f32(rows[0].as_mut_ptr().add(first), speed);
            vst1q_f32(rows[1].as_mut_ptr().add(first), steering);
        }
        vst1q_f32(chunk.terms[0].as_mut_ptr().add(first), cost);
    }
}

/// Four numbers of every lane's pose, one load of 16 bytes a lane and transposes.
#[inline(always)]
unsafe fn look_up(risks: *const f32, index: W) -> [V; 4] {
    let row = |place: u32| unsafe { vld1q_f32(risks.add(4 * place as usize)) };
    let (r0, r1) = (row(vgetq_lane_u32::<0>(index)), row(vgetq_lane_u32::<1>(index)));
    let (r2, r3) = (row(vgetq_lane_u32::<2>(index)), row(vgetq_lane_u32::<3>(index)));
    let even = [vtrn1q_f32(r0, r1), vtrn1q_f32(r2, r3)].map(|two| unsafe { vreinterpretq_f64_f32(two) });
    let odd = [vtrn2q_f32(r0, r1), vtrn2q_f32(r2, r3)].map(|two| unsafe { vreinterpretq_f64_f32(two) });
    [
        vreinterpretq_f32_f64(vtrn1q_f64(even[0], even[1])),
        vreinterpretq_f32_f64(vtrn1q_f64(odd[0], odd[1])),
        vreinterpretq_f32_f64(vtrn2q_f64(even[0], even[1])),
        vreinterpretq_f32_f64(vtrn2q_f64(odd[0], odd[1])),
    ]
}

/// What all rollouts share: what is multiplied with lies four to a register.
struct Settings {
    risks: *const f32,
    tangent: Polynomial,
    sine: Polynomial,
    cosine: Polynomial,
    /// One over the wheelbase, cells of a step, turns of a step, yaws of a turn.
    factors: V,
    /// Columns, yaws.
    strides: W,
    /// Cost of a cell of distance, of time.
    prices: V,
}

impl Settings {
    unsafe fn new(risks: &[[f32; 4]]) -> Self {
        let turns = STEP_S / std::f32::consts::TAU;
        let factors = black_box([1.0 / WHEELBASE_M, STEP_S / CELL_M, turns, N_YAWS as f32]);
        let strides = black_box([N_COLS as u32, N_YAWS as u32, 0, 0]);
        let prices = black_box([DISTANCE_S, STEP_S, 0.0, 0.0]);
        Self {
            risks: risks.as_ptr().cast(),
            tangent: Polynomial::new(&TAN),
            sine: Polynomial::new(&SINE),
            cosine: Polynomial::new(&COSINE),
            factors: vld1q_f32(factors.as_ptr()),
            strides: vld1q_u32(strides.as_ptr()),
            prices: vld1q_f32(prices.as_ptr()),
        }
    }
}

/// One register of rollouts.
struct Flight {
    x: V,
    y: V,
    turns: V,
    under_way: W,
    running: V,
    /// Less the steps beyond a limit.
    tilted: W,
}

impl Flight {
    unsafe fn new() -> Self {
        let [x, y, turns] = START.map(|value| unsafe { s(value) });
        Self { x, y, turns, under_way: vdupq_n_u32(u32::MAX), running: s(0.0), tilted: vdupq_n_u32(0) }
    }

    #[inline(always)]
    unsafe fn step(&mut self, settings: &Settings, [speed, steering]: [V; 2]) {
        let factors = settings.factors;
        let [linear, angular, roll, pitch] = look_up(settings.risks, self.pose(settings));
        let linear = vmaxq_f32(linear, s(TRACTION_LEAST));
        let angular = vmaxq_f32(angular, s(TRACTION_LEAST));
        let within = vandq_u32(vcleq_f32(roll, s(ROLL_MAX_RAD)), vcleq_f32(pitch, s(PITCH_MAX_RAD)));
        self.tilted = vaddq_u32(self.tilted, vbicq_u32(self.under_way, within));
        let square = vmulq_f32(steering, steering);
        let tangent = vmulq_f32(steering, settings.tangent.of_six(square, vmulq_f32(square, square)));
        let yaw_rate = vmulq_f32(vmulq_laneq_f32::<0>(speed, factors), vmulq_f32(tangent, angular));
        let advance = vmulq_f32(vmulq_laneq_f32::<1>(speed, factors), linear);
        let square = vmulq_f32(self.turns, self.turns);
        let fourth = vmulq_f32(square, square);
        let sine = vmulq_f32(self.turns, settings.sine.of_six(square, fourth));
        self.x = vfmaq_f32(self.x, advance, settings.cosine.of_seven(square, fourth));
        self.y = vfmaq_f32(self.y, advance, sine);
        self.turns = wrap(vfmaq_laneq_f32::<2>(self.turns, yaw_rate, factors));
        let square = self.square();
        let (distance, prices) = (vsqrtq_f32(square), settings.prices);
        let price = vfmaq_laneq_f32::<0>(vdupq_laneq_f32::<1>(prices), distance, prices);
        self.running = vaddq_f32(self.running, where_holds(self.under_way, price));
        self.under_way = vandq_u32(self.under_way, vcgtq_f32(square, s(TOLERANCE_CELLS2)));
    }

    /// Place in the risk map. As a word, what is negative is 0 and what is too large the largest.
    #[inline(always)]
    unsafe fn pose(&self, settings: &Settings) -> W {
        let col = vminq_u32(vcvtq_u32_f32(self.x), vdupq_n_u32(N_COLS as u32 - 1));
        let row = vminq_u32(vcvtq_u32_f32(self.y), vdupq_n_u32(N_ROWS as u32 - 1));
        let positive = vsubq_f32(self.turns, vrndmq_f32(self.turns));
        let yaw = vcvtq_u32_f32(vmulq_laneq_f32::<3>(positive, settings.factors));
        let yaw = vminq_u32(yaw, vdupq_n_u32(N_YAWS as u32 - 1));
        let cell = vmlaq_laneq_u32::<0>(col, row, settings.strides);
        vmlaq_laneq_u32::<1>(yaw, cell, settings.strides)
    }

    /// Squared distance to the goal [cells2].
    #[inline(always)]
    unsafe fn square(&self) -> V {
        let dx = vsubq_f32(self.x, s(GOAL_CELLS[0]));
        let dy = vsubq_f32(self.y, s(GOAL_CELLS[1]));
        vfmaq_f32(vmulq_f32(dy, dy), dx, dx)
    }
}

unsafe fn roll_out(chunk: &mut Chunk, settings: &Settings) {
    for first in (0..CHUNK).step_by(WIDTH) {
        let mut flight = Flight::new();
        for rows in &chunk.controls {
            let controls = [0, 1].map(|c| unsafe { vld1q_f32(rows[c].as_ptr().add(first)) });
            flight.step(settings, controls);
        }
        let control = vld1q_f32(chunk.terms[0].as_ptr().add(first));
        let tilted = vcvtq_f32_u32(vsubq_u32(vdupq_n_u32(0), flight.tilted));
        let attitude = vmulq_f32(tilted, s(ATTITUDE_S));
        let rest = vmulq_f32(vsqrtq_f32(flight.square()), s(DISTANCE_S));
        let rest = where_holds(flight.under_way, rest);
        let terms = [control, flight.running, attitude, rest, tilted];
        for (row, value) in chunk.terms.iter_mut().zip(terms) {
            vst1q_f32(row.as_mut_ptr().add(first), value);
        }
        let total = vaddq_f32(vaddq_f32(control, flight.running), vaddq_f32(attitude, rest));
        vst1q_f32(chunk.costs.as_mut_ptr().add(first), total);
    }
}

/// exp(x) for x <= 0, 0 below -60.
#[inline(always)]
unsafe fn exp(x: V, exp2: &Polynomial) -> V {
    let scaled = vmulq_f32(vmaxq_f32(x, s(-60.0)), s(std::f32::consts::LOG2_E));
    let rest = wrap(scaled);
    let whole = vcvtq_s32_f32(vsubq_f32(scaled, rest));
    let power = vreinterpretq_f32_s32(vshlq_n_s32::<23>(vaddq_s32(whole, vdupq_n_s32(127))));
    let value = vmulq_f32(exp2.of_six(rest, vmulq_f32(rest, rest)), power);
    where_holds(vcgtq_f32(x, s(-60.0)), value)
}

/// Weighs the rollouts of a chunk and adds up the weights and the cost terms.
unsafe fn weigh(chunk: &mut Chunk, least: V, exp2: &Polynomial, sums: &mut [V; N_TERMS + 1]) {
    for first in (0..CHUNK).step_by(WIDTH) {
        let cost = vld1q_f32(chunk.costs.as_ptr().add(first));
        let weight = exp(vmulq_f32(vsubq_f32(least, cost), s(1.0 / TEMPERATURE_S)), exp2);
        vst1q_f32(chunk.weights.as_mut_ptr().add(first), weight);
        for (sum, row) in sums.iter_mut().zip(chunk.terms.iter().chain([&chunk.weights])) {
            *sum = vaddq_f32(*sum, vld1q_f32(row.as_ptr().add(first)));
        }
    }
}

/// Adds up the weighed controls of a chunk that counts.
unsafe fn average(chunk: &Chunk, sums: &mut [[f32; 2]; N_STEPS]) {
    if chunk.weights.iter().all(|&weight| weight == 0.0) {
        return;
    }
    for (rows, sums) in chunk.controls.iter().zip(sums) {
        let mut sum = [s(0.0); 2];
        for first in (0..CHUNK).step_by(WIDTH) {
            let weight = vld1q_f32(chunk.weights.as_ptr().add(first));
            for (sum, row) in sum.iter_mut().zip(rows) {
                *sum = vfmaq_f32(*sum, weight, vld1q_f32(row.as_ptr().add(first)));
            }
        }
        let pairs = vpaddq_f32(sum[0], sum[1]);
        let both = vpaddq_f32(pairs, pairs);
        *sums = [sums[0] + vgetq_lane_f32::<0>(both), sums[1] + vgetq_lane_f32::<1>(both)];
    }
}

/// One update: moves the plan, and tells the sums of the cost terms and of the weights.
unsafe fn update(
    chunks: &mut [Chunk],
    plan: &mut [[f32; 2]; N_STEPS],
    settings: &Settings,
    cycle: u64,
) -> [f32; 6] {
    plan.copy_within(1.., 0);
    let mut nominal_cost = 0.0;
    let steps = plan.map(|base| {
        let gradient = from_fn(|c| TEMPERATURE_S * base[c] / (STD[c] * STD[c]));
        nominal_cost += gradient[0] * base[0] + gradient[1] * base[1];
        SampleStep { base, std: STD, gradient }
    });
    let mut least = s(f32::MAX);
    for (index, chunk) in chunks.iter_mut().enumerate() {
        sample(chunk, &steps, nominal_cost, (cycle << 32) + (index * CHUNK) as u64);
        roll_out(chunk, settings);
        for first in (0..CHUNK).step_by(WIDTH) {
            least = vminq_f32(least, vld1q_f32(chunk.costs.as_ptr().add(first)));
        }
    }
    let (least, exp2) = (s(vminvq_f32(least)), Polynomial::new(&EXP2));
    let (mut sums, mut controls) = ([s(0.0); N_TERMS + 1], [[0.0; 2]; N_STEPS]);
    for chunk in chunks {
        weigh(chunk, least, &exp2, &mut sums);
        average(chunk, &mut controls);
    }
    let sums = sums.map(|sum| unsafe { vaddvq_f32(sum) });
    *plan = controls.map(|sum| sum.map(|sum| sum / sums[N_TERMS]));
    sums
}

fn random_risks() -> Vec<[f32; 4]> {
    let mut state = 12_345_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let pose = |_| [0.5 + 0.5 * random(), 0.5 + 0.5 * random(), 0.5 * random(), 0.5 * random()];
    (0..N_ROWS * N_COLS * N_YAWS).map(pose).collect()
}

fn main() {
    let n_updates: u64 = std::env::args().nth(1).and_then(|word| word.parse().ok()).unwrap();
    let risks = random_risks();
    let (controls, row) = ([[[0.0; CHUNK]; 2]; N_STEPS], [0.0; CHUNK]);
    let mut chunks =
        vec![Chunk { controls, terms: [row; N_TERMS], costs: row, weights: row }; N_ROLLOUTS / CHUNK];
    let mut plan = [[1.0, 0.0]; N_STEPS];
    let mut sums = [0.0; N_TERMS + 1];
    for cycle in 0..n_updates {
        // SAFETY: every 64-bit ARM processor has NEON, and places in the map are bounded by its size.
        sums = unsafe { update(&mut chunks, &mut plan, &Settings::new(&risks), cycle) };
    }
    println!("plan {:?}, sums {sums:?}", plan[0]);
}
