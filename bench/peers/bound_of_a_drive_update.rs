//! A yardstick: one update of `surefoot bench control --config drive` by hand, in AVX-512, with every setting a constant.
//!
//! The work is that of a drive: noise on rates that remembers itself, controls within the limits of acceleration and
//! steering rate, control cost, a bicycle over 81 x 96 x 13 risks, the price of attitude, lateral acceleration and
//! reverse, a latch at the goal, time to go and to turn at the end, the sums of every cost term, a temperature for an
//! effective sample size, the mean, and the mean's first steps looked at once more in double precision.
//! No options, no errors, no other model and no safety: it shows what a processor can do, and is nothing to live in.
//!
//! ```bash
//! rustc --edition 2024 -C opt-level=3 -C target-cpu=native bench/peers/bound_of_a_drive_update.rs
//! ./bound_of_a_drive_update THREADS UPDATES
//! ```
#![allow(unsafe_op_in_unsafe_fn)]

use std::arch::x86_64::*;
use std::hint::spin_loop;
use std::sync::atomic::{AtomicU32, Ordering::*};
use std::time::Instant;

const N_ROLLOUTS: usize = 1024;
const N_STEPS: usize = 50;
const N_ROWS: usize = 96;
const N_COLS: usize = 81;
const N_YAWS: usize = 13;
/// Rollouts of a register.
const WIDTH: usize = 16;
/// Registers on their way at a time.
const IN_FLIGHT: usize = 2;

const STEP_S: f32 = 0.1;
const CELL_M: f32 = 0.5;
const WHEELBASE_M: f32 = 2.5;
const LOW: [f32; 2] = [-0.5, -0.5236];
const HIGH: [f32; 2] = [3.0, 0.5236];
/// Largest change of speed and steering angle in a step.
const CHANGE: [f32; 2] = [0.15, 0.06];
/// Standard deviation of the noise on the rates, per step.
const STD: [f32; 2] = [0.15, 0.06];
/// exp(-0.1 s / 0.5 s).
const CORRELATION: f32 = 0.818_730_8;
const CONTROL_COST: f32 = 0.1;
const ATTITUDE_MAX_RAD: f32 = 0.471_24;
const ATTITUDE_S: f32 = 20.0;
const LATERAL_MAX_MPS2: f32 = 3.0;
const LATERAL_S: f32 = 20.0;
const REVERSE_S: f32 = 0.1;
const TURNING_S_PER_RAD: f32 = 1.5;
const TRACTION_LEAST: f32 = 0.1;
/// Squared distance at which the goal is reached [cells2].
const TOLERANCE_CELLS2: f32 = 1.0;
const GOAL_CELLS: [f32; 2] = [64.5, 76.0];
const START: [f32; 3] = [20.5, 28.0, 0.124_14];
const WANTED_SAMPLES: f32 = 0.05 * N_ROLLOUTS as f32;
const N_HALVINGS: usize = 14;

const TAN: [f32; 5] = [1.000_000_023, 0.333_328_856, 0.133_474_124, 0.052_436_003_5, 0.028_486_216_6];
const SIN_TURNS: [f32; 5] = [6.283_091, -41.332_71, 81.385_82, -74.571_49, 32.938_44];
const COS_TURNS: [f32; 6] = [0.999_999_2, -19.738_983, 64.928_73, -85.272_4, 58.794_04, -21.076_782];
const LOG2: [f32; 5] = [1.442_094_7, -0.710_751, 0.420_602_8, -0.199_636_4, 0.047_706_24];
const EXP2: [f32; 6] = [1.0, 0.693_146_94, 0.240_221_2, 0.055_507_134, 0.009_675_541, 0.001_327_647_2];
const ARC_SINE: [f32; 4] = [1.570_728_8, -0.212_114_4, 0.074_261, -0.018_729_3];

type V = __m512;

#[inline(always)]
unsafe fn s(value: f32) -> V {
    _mm512_set1_ps(value)
}

#[inline(always)]
unsafe fn horner<const N: usize>(z: V, coefficients: &[f32; N]) -> V {
    let mut sum = s(coefficients[N - 1]);
    for i in (0..N - 1).rev() {
        sum = _mm512_fmadd_ps(sum, z, s(coefficients[i]));
    }
    sum
}

#[inline(always)]
unsafe fn sqrt(x: V) -> V {
    _mm512_sqrt_ps(_mm512_max_ps(x, _mm512_setzero_ps()))
}

#[inline(always)]
unsafe fn clamp(x: V, low: V, high: V) -> V {
    _mm512_min_ps(_mm512_max_ps(x, low), high)
}

/// The part of turns that lies within half a turn.
#[inline(always)]
unsafe fn wrap(turns: V) -> V {
    _mm512_sub_ps(turns, _mm512_roundscale_ps::<0>(turns))
}

#[inline(always)]
unsafe fn sin_cos_turns(turns: V) -> (V, V) {
    let rest = wrap(turns);
    let square = _mm512_mul_ps(rest, rest);
    (_mm512_mul_ps(rest, horner(square, &SIN_TURNS)), horner(square, &COS_TURNS))
}

/// exp(x) for x <= 0, 0 below -60.
#[inline(always)]
unsafe fn exp(x: V) -> V {
    let scaled = _mm512_mul_ps(x, s(std::f32::consts::LOG2_E));
    let rest = wrap(scaled);
    let power = _mm512_scalef_ps(horner(rest, &EXP2), _mm512_sub_ps(scaled, rest));
    _mm512_maskz_mov_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(x, s(-60.0)), power)
}

/// Blackman and Vigna's xoshiro128+, one stream a lane.
#[derive(Clone, Copy)]
struct Generator([__m512i; 4]);

impl Generator {
    unsafe fn new(seed: u64) -> Self {
        let mut state = seed;
        let mut word = || {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z >> 32) as i32
        };
        Self([(); 4].map(|()| {
            let words: [i32; WIDTH] = std::array::from_fn(|_| word());
            _mm512_loadu_si512(words.as_ptr().cast())
        }))
    }

    #[inline(always)]
    unsafe fn uniform(&mut self) -> V {
        let [a, b, c, d] = self.0;
        let result = _mm512_add_epi32(a, d);
        let (c, d) = (_mm512_xor_si512(c, a), _mm512_xor_si512(d, b));
        let shifted = _mm512_slli_epi32::<9>(b);
        self.0 = [
            _mm512_xor_si512(a, d),
            _mm512_xor_si512(b, c),
            _mm512_xor_si512(c, shifted),
            _mm512_rol_epi32::<11>(d),
        ];
        _mm512_castsi512_ps(_mm512_or_si512(_mm512_srli_epi32::<9>(result), _mm512_set1_epi32(0x3f80_0000)))
    }

    #[inline(always)]
    unsafe fn normals(&mut self) -> [V; 2] {
        let u = _mm512_sub_ps(s(2.0), self.uniform());
        let rest = _mm512_sub_ps(_mm512_getmant_ps::<_MM_MANT_NORM_1_2, _MM_MANT_SIGN_ZERO>(u), s(1.0));
        let log2 = _mm512_fmadd_ps(horner(rest, &LOG2), rest, _mm512_getexp_ps(u));
        let radius = sqrt(_mm512_mul_ps(log2, s(-2.0 * std::f32::consts::LN_2)));
        let (sine, cosine) = sin_cos_turns(self.uniform());
        [_mm512_mul_ps(radius, cosine), _mm512_mul_ps(radius, sine)]
    }
}

#[derive(Clone, Copy, Default)]
struct SampleStep {
    base: [f32; 2],
    innovation: [f32; 2],
    gradient: [f32; 2],
}

/// Cost terms: control, running, attitude, lateral, reverse, terminal; last the steps beyond a limit.
const N_TERMS: usize = 7;

#[repr(C, align(64))]
struct Shared {
    controls: [[[f32; N_ROLLOUTS]; 2]; N_STEPS],
    terms: [[f32; N_ROLLOUTS]; N_TERMS],
    costs: [f32; N_ROLLOUTS],
    weights: [f32; N_ROLLOUTS],
    steps: [SampleStep; N_STEPS],
    plan: [[f32; 2]; N_STEPS],
    start: [f32; 2],
    temperature_s: f32,
    risks: Vec<[f32; 4]>,
    field: Vec<f32>,
    sums: [[[f32; 2]; N_STEPS]; 8],
    totals: [[f32; N_TERMS + 1]; 8],
}

/// What the sampling reads; the scores are rows of the inverse covariance of a Gauss-Markov sequence times the plan.
fn prepare(shared: &mut Shared) {
    let change =
        |t: usize, c: usize| shared.plan[t][c] - if t == 0 { shared.start[c] } else { shared.plan[t - 1][c] };
    let fresh = (1.0 - CORRELATION * CORRELATION).sqrt();
    let mut scores = [[0.0; 2]; N_STEPS + 1];
    for t in 0..N_STEPS {
        for c in 0..2 {
            let is_rim = t == 0 || t + 1 == N_STEPS;
            let middle = if is_rim { 1.0 } else { 1.0 + CORRELATION * CORRELATION };
            let before = if t == 0 { 0.0 } else { change(t - 1, c) };
            let after = if t + 1 == N_STEPS { 0.0 } else { change(t + 1, c) };
            let sum = middle * change(t, c) - CORRELATION * (before + after);
            scores[t][c] = sum / (STD[c] * STD[c] * fresh * fresh);
        }
    }
    let weight_s = CONTROL_COST * shared.temperature_s;
    for t in 0..N_STEPS {
        let share = if t == 0 { 1.0 } else { fresh };
        let step = SampleStep {
            base: [0, 1].map(|c| change(t, c)),
            innovation: STD.map(|std| std * share),
            gradient: [0, 1].map(|c| weight_s * (scores[t][c] - scores[t + 1][c])),
        };
        shared.steps[t] = step;
    }
}

unsafe fn sample(shared: *mut Shared, [low, high]: [usize; 2], generator: &mut Generator) {
    let mut streams = *generator;
    let mut nominal_cost = 0.0;
    for (step, plan) in (*shared).steps.iter().zip(&(*shared).plan) {
        nominal_cost += step.gradient[0] * plan[0] + step.gradient[1] * plan[1];
    }
    let mut k = low;
    while k < high {
        let mut noise = [[_mm512_setzero_ps(); 2]; IN_FLIGHT];
        let mut control = [[s((*shared).start[0]), s((*shared).start[1])]; IN_FLIGHT];
        let mut cost = [s(-nominal_cost); IN_FLIGHT];
        for t in 0..N_STEPS {
            let step = &(*shared).steps[t];
            for g in 0..IN_FLIGHT {
                let fresh = streams.normals();
                for c in 0..2 {
                    let added = _mm512_mul_ps(fresh[c], s(step.innovation[c]));
                    noise[g][c] = _mm512_fmadd_ps(noise[g][c], s(CORRELATION), added);
                    let held = control[g][c];
                    let wished = _mm512_add_ps(held, _mm512_add_ps(noise[g][c], s(step.base[c])));
                    let change = s(CHANGE[c]);
                    let wished = clamp(wished, _mm512_sub_ps(held, change), _mm512_add_ps(held, change));
                    control[g][c] = clamp(wished, s(LOW[c]), s(HIGH[c]));
                    cost[g] = _mm512_fmadd_ps(control[g][c], s(step.gradient[c]), cost[g]);
                    let to = (*shared).controls[t][c].as_mut_ptr().add(k + WIDTH * g);
                    _mm512_store_ps(to, control[g][c]);
                }
            }
        }
        for g in 0..IN_FLIGHT {
            _mm512_store_ps((*shared).terms[0].as_mut_ptr().add(k + WIDTH * g), cost[g]);
        }
        k += WIDTH * IN_FLIGHT;
    }
    *generator = streams;
    if low == 0 {
        plant_plan(&mut *shared);
    }
}

/// The plan itself is the first rollout.
fn plant_plan(shared: &mut Shared) {
    let mut control = shared.start;
    let mut cost = 0.0;
    for t in 0..N_STEPS {
        for c in 0..2 {
            let wished = shared.plan[t][c].max(control[c] - CHANGE[c]).min(control[c] + CHANGE[c]);
            control[c] = wished.max(LOW[c]).min(HIGH[c]);
            cost += (control[c] - shared.plan[t][c]) * shared.steps[t].gradient[c];
            shared.controls[t][c][0] = control[c];
        }
    }
    shared.terms[0][0] = cost;
}

/// Four numbers of every lane's pose, one load of 16 bytes a lane and transposes.
#[inline(always)]
unsafe fn look_up(risks: *const f32, index: __m512i) -> [V; 4] {
    let mut places = [0_i32; WIDTH];
    _mm512_storeu_si512(places.as_mut_ptr().cast(), index);
    let load = |lane: usize| unsafe { _mm_load_ps(risks.offset(4 * places[lane] as isize)) };
    let four = |first: usize| unsafe {
        let row = _mm512_castps128_ps512(load(first));
        let row = _mm512_insertf32x4::<1>(row, load(first + 4));
        let row = _mm512_insertf32x4::<2>(row, load(first + 8));
        _mm512_insertf32x4::<3>(row, load(first + 12))
    };
    let rows = [four(0), four(1), four(2), four(3)];
    let low = [0, 2].map(|r| unsafe { _mm512_castps_pd(_mm512_unpacklo_ps(rows[r], rows[r + 1])) });
    let high = [0, 2].map(|r| unsafe { _mm512_castps_pd(_mm512_unpackhi_ps(rows[r], rows[r + 1])) });
    [
        _mm512_castpd_ps(_mm512_unpacklo_pd(low[0], low[1])),
        _mm512_castpd_ps(_mm512_unpackhi_pd(low[0], low[1])),
        _mm512_castpd_ps(_mm512_unpacklo_pd(high[0], high[1])),
        _mm512_castpd_ps(_mm512_unpackhi_pd(high[0], high[1])),
    ]
}

unsafe fn roll_out(shared: *mut Shared, [low, high]: [usize; 2], totals: &mut [f32; N_TERMS + 1]) {
    let (zero, one) = (_mm512_setzero_ps(), s(1.0));
    let risks = (*shared).risks.as_ptr().cast::<f32>();
    let mut sums = [zero; N_TERMS + 1];
    let mut k = low;
    while k < high {
        let mut x = [s(START[0]); IN_FLIGHT];
        let mut y = [s(START[1]); IN_FLIGHT];
        let mut turns = [s(START[2]); IN_FLIGHT];
        let mut under_way = [0xffff_u16; IN_FLIGHT];
        let [mut running, mut tilted, mut lateral, mut reverse] = [[zero; IN_FLIGHT]; 4];
        for t in 0..N_STEPS {
            for g in 0..IN_FLIGHT {
                let at = |c: usize| unsafe {
                    _mm512_load_ps((*shared).controls[t][c].as_ptr().add(k + WIDTH * g))
                };
                let (speed, steering) = (at(0), at(1));
                let col = _mm512_cvttps_epi32(clamp(x[g], zero, s(N_COLS as f32 - 1.0)));
                let row = _mm512_cvttps_epi32(clamp(y[g], zero, s(N_ROWS as f32 - 1.0)));
                let behind = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(turns[g], zero);
                let positive = _mm512_mask_add_ps(turns[g], behind, turns[g], one);
                let yaw = _mm512_mul_ps(positive, s(N_YAWS as f32));
                let yaw = _mm512_cvttps_epi32(_mm512_min_ps(yaw, s(N_YAWS as f32 - 1.0)));
                let cell = _mm512_add_epi32(_mm512_mullo_epi32(row, _mm512_set1_epi32(N_COLS as i32)), col);
                let pose = _mm512_add_epi32(_mm512_mullo_epi32(cell, _mm512_set1_epi32(N_YAWS as i32)), yaw);
                let [linear, angular, roll, pitch] = look_up(risks, pose);
                let linear = _mm512_max_ps(linear, s(TRACTION_LEAST));
                let angular = _mm512_max_ps(angular, s(TRACTION_LEAST));
                let tangent = _mm512_mul_ps(steering, horner(_mm512_mul_ps(steering, steering), &TAN));
                let curving = _mm512_mul_ps(tangent, angular);
                let yaw_rate = _mm512_mul_ps(_mm512_mul_ps(speed, s(1.0 / WHEELBASE_M)), curving);
                let advance = _mm512_mul_ps(_mm512_mul_ps(speed, s(STEP_S / CELL_M)), linear);
                let (sine, cosine) = sin_cos_turns(turns[g]);
                x[g] = _mm512_fmadd_ps(advance, cosine, x[g]);
                y[g] = _mm512_fmadd_ps(advance, sine, y[g]);
                turns[g] = wrap(_mm512_fmadd_ps(yaw_rate, s(STEP_S / std::f32::consts::TAU), turns[g]));
                let alive = under_way[g];
                let over = _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(alive, roll, s(ATTITUDE_MAX_RAD))
                    | _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(alive, pitch, s(ATTITUDE_MAX_RAD));
                tilted[g] = _mm512_mask_add_ps(tilted[g], over, tilted[g], one);
                let sideways = _mm512_abs_ps(_mm512_mul_ps(speed, yaw_rate));
                let slides = _mm512_mask_cmp_ps_mask::<_CMP_NLE_UQ>(alive, sideways, s(LATERAL_MAX_MPS2));
                lateral[g] = _mm512_mask_add_ps(lateral[g], slides, lateral[g], s(LATERAL_S));
                let back = _mm512_mask_cmp_ps_mask::<_CMP_LT_OQ>(alive, speed, zero);
                reverse[g] = _mm512_mask_add_ps(reverse[g], back, reverse[g], s(REVERSE_S));
                running[g] = _mm512_mask_add_ps(running[g], alive, running[g], s(STEP_S));
                let dx = _mm512_sub_ps(x[g], s(GOAL_CELLS[0]));
                let dy = _mm512_sub_ps(y[g], s(GOAL_CELLS[1]));
                let square = _mm512_fmadd_ps(dx, dx, _mm512_mul_ps(dy, dy));
                under_way[g] = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(alive, square, s(TOLERANCE_CELLS2));
            }
        }
        for g in 0..IN_FLIGHT {
            let to_go = _mm512_maskz_mov_ps(under_way[g], time_to_go(&(*shared).field, x[g], y[g], turns[g]));
            let attitude = _mm512_mul_ps(tilted[g], s(ATTITUDE_S));
            let control = _mm512_load_ps((*shared).terms[0].as_ptr().add(k + WIDTH * g));
            let terms = [control, running[g], attitude, lateral[g], reverse[g], to_go, tilted[g]];
            let mut total = zero;
            for (term, value) in terms.into_iter().enumerate() {
                total = if term + 1 < N_TERMS { _mm512_add_ps(total, value) } else { total };
                sums[term] = _mm512_add_ps(sums[term], value);
                _mm512_store_ps((*shared).terms[term].as_mut_ptr().add(k + WIDTH * g), value);
            }
            let keeps = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(_mm512_add_ps(tilted[g], lateral[g]), s(1e-9));
            sums[N_TERMS] = _mm512_mask_add_ps(sums[N_TERMS], keeps, sums[N_TERMS], one);
            _mm512_store_ps((*shared).costs.as_mut_ptr().add(k + WIDTH * g), total);
        }
        k += WIDTH * IN_FLIGHT;
    }
    *totals = sums.map(|sum| unsafe { _mm512_reduce_add_ps(sum) });
}

/// Time to go, between four cells of the field, and what it takes to turn to where it falls.
#[inline(always)]
unsafe fn time_to_go(field: &[f32], x: V, y: V, turns: V) -> V {
    let one = s(1.0);
    let place = |cells: V, n: usize| unsafe {
        let place = clamp(_mm512_sub_ps(cells, s(0.5)), _mm512_setzero_ps(), s((n - 1) as f32));
        let whole = _mm512_cvttps_epi32(_mm512_min_ps(place, s((n - 2) as f32)));
        (whole, _mm512_sub_ps(place, _mm512_cvtepi32_ps(whole)))
    };
    let ((col, east), (row, north)) = (place(x, N_COLS), place(y, N_ROWS));
    let corner = _mm512_add_epi32(_mm512_mullo_epi32(row, _mm512_set1_epi32(N_COLS as i32)), col);
    let at = |offset: usize| unsafe { _mm512_i32gather_ps::<4>(corner, field.as_ptr().add(offset)) };
    let along = |west: V, rise: V| unsafe { _mm512_fmadd_ps(rise, east, west) };
    let (west, upper_west) = (at(0), at(N_COLS));
    let (rise, upper_rise) = (_mm512_sub_ps(at(1), west), _mm512_sub_ps(at(N_COLS + 1), upper_west));
    let (south, upper) = (along(west, rise), along(upper_west, upper_rise));
    let northward = _mm512_sub_ps(upper, south);
    let eastward = _mm512_fmadd_ps(_mm512_sub_ps(upper_rise, rise), north, rise);
    let (sine, cosine) = sin_cos_turns(turns);
    let slope = sqrt(_mm512_fmadd_ps(eastward, eastward, _mm512_mul_ps(northward, northward)));
    let facing = _mm512_fmadd_ps(eastward, cosine, _mm512_mul_ps(northward, sine));
    let away = clamp(_mm512_div_ps(facing, _mm512_max_ps(slope, s(1e-6))), s(-1.0), one);
    let sine = sqrt(_mm512_fmadd_ps(away, s(0.5), s(0.5)));
    let cosine = sqrt(_mm512_mul_ps(_mm512_sub_ps(one, away), s(0.5)));
    let complement = _mm512_mul_ps(sqrt(_mm512_sub_ps(one, sine)), horner(sine, &ARC_SINE));
    let angle = _mm512_sub_ps(s(std::f32::consts::FRAC_PI_2), complement);
    let lost = _mm512_fnmadd_ps(sine, cosine, angle);
    let seconds = _mm512_fmadd_ps(northward, north, south);
    _mm512_fmadd_ps(lost, s(2.0 * TURNING_S_PER_RAD), seconds)
}

/// The weights' sum and effective sample size.
#[inline(always)]
unsafe fn weigh_at(shared: &mut Shared, least_s: V, temperature_s: f32) -> (f32, f32) {
    let inverse = s(1.0 / temperature_s);
    let (mut sum, mut squares) = ([_mm512_setzero_ps(); 2], [_mm512_setzero_ps(); 2]);
    for k in (0..N_ROLLOUTS).step_by(2 * WIDTH) {
        for half in 0..2 {
            let cost = _mm512_load_ps(shared.costs.as_ptr().add(k + WIDTH * half));
            let weight = exp(_mm512_mul_ps(_mm512_sub_ps(least_s, cost), inverse));
            sum[half] = _mm512_add_ps(sum[half], weight);
            squares[half] = _mm512_fmadd_ps(weight, weight, squares[half]);
            _mm512_store_ps(shared.weights.as_mut_ptr().add(k + WIDTH * half), weight);
        }
    }
    let total = _mm512_reduce_add_ps(_mm512_add_ps(sum[0], sum[1]));
    (total, total * total / _mm512_reduce_add_ps(_mm512_add_ps(squares[0], squares[1])))
}

/// Finds the temperature as halving does, without those halvings that others decide, and weighs; returns the weights' sum.
unsafe fn weigh(shared: &mut Shared) -> f32 {
    let mut least = s(f32::MAX);
    for k in (0..N_ROLLOUTS).step_by(WIDTH) {
        least = _mm512_min_ps(least, _mm512_load_ps(shared.costs.as_ptr().add(k)));
    }
    let least = s(_mm512_reduce_min_ps(least));
    let span = [shared.temperature_s / 1024.0, shared.temperature_s * 1024.0];
    let [mut too_cold, mut too_hot] = span;
    let (mut guess, mut power, mut before) = (shared.temperature_s, 1.0, None::<[f32; 2]>);
    shared.temperature_s = loop {
        let [mut low, mut high] = span;
        for _ in 0..N_HALVINGS {
            let middle = (low * high).sqrt();
            let is_low = middle <= too_cold || (middle < too_hot && middle < guess);
            (low, high) = if is_low { (middle, high) } else { (low, middle) };
        }
        let tried = if low > too_cold { low } else { high };
        if tried >= too_hot {
            break (low * high).sqrt().clamp(1e-3, 1e4);
        }
        let samples = weigh_at(shared, least, tried).1;
        *(if samples < WANTED_SAMPLES { &mut too_cold } else { &mut too_hot }) = tried;
        if let Some([temperature, n]) = before {
            power = ((samples / n).ln() / (tried / temperature).ln()).clamp(0.05, 20.0);
        }
        before = Some([tried, samples]);
        guess = tried * (WANTED_SAMPLES / samples).powf(1.0 / power);
        if !(too_cold < guess && guess < too_hot) {
            guess = (too_cold * too_hot).sqrt();
        }
    };
    weigh_at(shared, least, shared.temperature_s).0
}

unsafe fn average(shared: *const Shared, [low, high]: [usize; 2], sums: &mut [[f32; 2]; N_STEPS]) {
    let mut counting = [0; N_ROLLOUTS / WIDTH];
    let mut n = 0;
    for k in (low..high).step_by(WIDTH) {
        let weight = _mm512_load_ps((*shared).weights.as_ptr().add(k));
        counting[n] = k;
        n += usize::from(_mm512_cmp_ps_mask::<_CMP_NEQ_OQ>(weight, _mm512_setzero_ps()) != 0);
    }
    for (rows, sums) in (*shared).controls.iter().zip(sums) {
        let mut sum = [_mm512_setzero_ps(); 2];
        for &k in &counting[..n] {
            let weight = _mm512_load_ps((*shared).weights.as_ptr().add(k));
            for c in 0..2 {
                sum[c] = _mm512_fmadd_ps(weight, _mm512_load_ps(rows[c].as_ptr().add(k)), sum[c]);
            }
        }
        *sums = sum.map(|sum| unsafe { _mm512_reduce_add_ps(sum) });
    }
}

/// Whether the plan keeps the limits of attitude until the vehicle could stand, in double precision.
fn is_within_limits(shared: &Shared) -> bool {
    let [mut x, mut y, turns] = START.map(f64::from);
    let mut yaw_rad = turns * std::f64::consts::TAU;
    let n_steps = (f64::from(shared.plan[0][0].max(1.0)) / 1.5 / f64::from(STEP_S)).ceil() as usize + 1;
    for &[speed, steering] in &shared.plan[..n_steps.min(N_STEPS)] {
        let risk = |x: f64, y: f64, yaw_rad: f64| {
            let yaw = (yaw_rad / std::f64::consts::TAU).rem_euclid(1.0) * N_YAWS as f64;
            let (row, col) = ((y as usize).min(N_ROWS - 1), (x as usize).min(N_COLS - 1));
            shared.risks[(row * N_COLS + col) * N_YAWS + (yaw as usize).min(N_YAWS - 1)]
        };
        let [linear, angular, ..] = risk(x, y, yaw_rad).map(|value| f64::from(value.max(TRACTION_LEAST)));
        let (speed, steering) = (f64::from(speed), f64::from(steering));
        let advance = speed * linear * f64::from(STEP_S / CELL_M);
        (x, y) = (x + advance * yaw_rad.cos(), y + advance * yaw_rad.sin());
        yaw_rad += speed / f64::from(WHEELBASE_M) * steering.tan() * angular * f64::from(STEP_S);
        let [_, _, roll, pitch] = risk(x, y, yaw_rad);
        if roll > ATTITUDE_MAX_RAD || pitch > ATTITUDE_MAX_RAD {
            return false;
        }
    }
    true
}

static PHASE: AtomicU32 = AtomicU32::new(0);
static N_DONE: AtomicU32 = AtomicU32::new(0);
const OVER: u32 = u32::MAX;

/// A thread's share of a phase.
unsafe fn work(shared: *mut Shared, phase: u32, [id, n_threads]: [usize; 2], generator: &mut Generator) {
    let share = [id, id + 1].map(|k| k * N_ROLLOUTS / n_threads);
    match phase {
        0 => sample(shared, share, generator),
        1 => roll_out(shared, share, &mut (*shared).totals[id]),
        _ => average(shared, share, &mut (*shared).sums[id]),
    }
}

fn all(shared: *mut Shared, phase: u32, n_threads: usize, generator: &mut Generator) {
    if n_threads > 1 {
        N_DONE.store(0, Release);
        let number = PHASE.load(Relaxed) / 4 + 1;
        PHASE.store(4 * number + phase, Release);
    }
    unsafe { work(shared, phase, [0, n_threads], generator) };
    while (N_DONE.load(Acquire) as usize) + 1 < n_threads {
        spin_loop();
    }
}

fn new_shared() -> *mut Shared {
    let layout = std::alloc::Layout::new::<Shared>();
    // SAFETY: zeros are numbers; the vectors are written before anybody reads them.
    let shared = unsafe { std::alloc::alloc_zeroed(layout) }.cast::<Shared>();
    let mut state = 12_345_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let pose = |_| [0.5 + 0.5 * random(), 0.5 + 0.5 * random(), 0.6 * random(), 0.6 * random()];
    let mut risks: Vec<[f32; 4]> = Vec::with_capacity(N_ROWS * N_COLS * N_YAWS);
    risks.extend((0..N_ROWS * N_COLS * N_YAWS).map(pose));
    assert!(risks.as_ptr() as usize % 16 == 0, "large allocations are aligned to 16 bytes");
    let seconds = |index: usize| {
        let [dx, dy] = [(index % N_COLS) as f32 - GOAL_CELLS[0], (index / N_COLS) as f32 - GOAL_CELLS[1]];
        dx.hypot(dy) * CELL_M
    };
    let field = (0..N_ROWS * N_COLS).map(seconds).collect();
    unsafe {
        (&raw mut (*shared).risks).write(risks);
        (&raw mut (*shared).field).write(field);
        (*shared).plan = [[1.0, 0.0]; N_STEPS];
        (*shared).start = [1.0, 0.0];
        (*shared).temperature_s = 1.0;
    }
    shared
}

/// One update; `lap` hears of the end of noise, rollouts and the rest.
fn update(
    shared: *mut Shared,
    n_threads: usize,
    generator: &mut Generator,
    mut lap: impl FnMut(usize),
) -> bool {
    let own = unsafe { &mut *shared };
    own.plan.copy_within(1.., 0);
    prepare(own);
    all(shared, 0, n_threads, generator);
    lap(0);
    all(shared, 1, n_threads, generator);
    lap(1);
    let sum = unsafe { weigh(own) };
    all(shared, 2, n_threads, generator);
    own.plan = std::array::from_fn(|t| {
        [0, 1].map(|c| own.sums[..n_threads].iter().map(|sums| sums[t][c]).sum::<f32>() / sum)
    });
    let is_within = is_within_limits(own);
    lap(2);
    is_within
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() {
    let [n_threads, n_updates] =
        [1, 2].map(|place| std::env::args().nth(place).and_then(|word| word.parse::<usize>().ok()).unwrap());
    let shared = new_shared();
    let address = shared as usize;
    let threads: Vec<_> = (1..n_threads)
        .map(|id| {
            std::thread::spawn(move || {
                let mut generator = unsafe { Generator::new(id as u64) };
                let mut last = 0;
                loop {
                    let phase = PHASE.load(Acquire);
                    match phase {
                        OVER => return,
                        phase if phase == last => spin_loop(),
                        phase => {
                            last = phase;
                            unsafe {
                                work(address as *mut Shared, phase % 4, [id, n_threads], &mut generator)
                            };
                            N_DONE.fetch_add(1, AcqRel);
                        }
                    }
                }
            })
        })
        .collect();
    let mut generator = unsafe { Generator::new(7) };
    let mut laps_ms = [(); 3].map(|()| Vec::new());
    let (mut times_ms, mut n_within) = (Vec::new(), 0);
    for cycle in 0..n_updates + 50 {
        let start = Instant::now();
        let mut ends_ms = [0.0; 3];
        let lap = |part: usize| ends_ms[part] = start.elapsed().as_secs_f64() * 1e3;
        n_within += usize::from(update(shared, n_threads, &mut generator, lap));
        if cycle >= 50 {
            times_ms.push(ends_ms[2]);
            laps_ms[0].push(ends_ms[0]);
            laps_ms[1].push(ends_ms[1] - ends_ms[0]);
            laps_ms[2].push(ends_ms[2] - ends_ms[1]);
        }
    }
    PHASE.store(OVER, Release);
    threads.into_iter().for_each(|thread| thread.join().unwrap());
    let least_ms = times_ms.iter().copied().fold(f64::INFINITY, f64::min);
    let [noise_ms, rollouts_ms, rest_ms] = laps_ms.map(median);
    let median_ms = median(times_ms);
    let [speed_mps, steering_rad] = unsafe { (*shared).plan[0] };
    let mean_terms_s = unsafe { (*shared).totals[0] }.map(|sum| sum * n_threads as f32 / N_ROLLOUTS as f32);
    println!("{n_threads} threads: least {least_ms:.4} ms, median {median_ms:.4} ms");
    println!("medians: noise {noise_ms:.4} ms, rollouts {rollouts_ms:.4} ms, the rest {rest_ms:.4} ms");
    println!(
        "plan {speed_mps:.3} m/s {steering_rad:.3} rad, within limits {n_within}, terms {mean_terms_s:?}"
    );
}
