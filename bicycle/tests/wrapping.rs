//! Angles brought within half a turn, on every instruction set: the fast way is the plain way, and hides nothing.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use bicycle::lanes::{Lanes, Portable};
use proptest::prelude::*;

/// The wrapped angle by itself, and wrapped with a witness, of one angle, rate and witness.
fn both(angle: f32, rate: f32, witness: f32) -> Vec<[f32; 3]> {
    fn on<L: Lanes>(lanes: L, [angle, rate, witness]: [f32; 3], first: impl Fn(L::Value) -> f32) -> [f32; 3] {
        let value = |value: f32| lanes.real(f64::from(value)).1;
        let [turns, told] = lanes.wrap_witnessed(value(angle), value(rate), value(witness));
        [lanes.wrap_turns(value(angle)), turns, told].map(first)
    }
    let given = [angle, rate, witness];
    let mut found = vec![on(Portable, given, |value| value[0])];
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::cast;
        found.extend(pulp::x86::V3::try_new().map(|v3| on(v3, given, |v| cast::<_, [f32; 8]>(v)[0])));
        found.extend(pulp::x86::V4::try_new().map(|v4| on(v4, given, |v| cast::<_, [f32; 16]>(v)[0])));
    }
    #[cfg(target_arch = "aarch64")]
    found.extend(
        pulp::aarch64::Neon::try_new().map(|neon| on(neon, given, |v| pulp::cast::<_, [f32; 8]>(v)[0])),
    );
    found
}

proptest! {
    #[test]
    fn where_all_is_finite_the_angle_is_the_same_and_the_witness_as_it_was(
        angle in -1e6..1e6f32, rate in any::<f32>(), witness in -1e6..1e6f32,
    ) {
        prop_assume!(rate.is_finite());
        for [plain, turns, told] in both(angle, rate, witness) {
            prop_assert!(turns == plain && (-0.5..=0.5).contains(&turns) && told == witness);
        }
    }

    #[test]
    fn what_is_not_finite_is_told(turns in -0.5..0.5f32, witness in -1e6..1e6f32, step in 0.001..1.0f32) {
        for rate in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for [plain, wrapped, told] in both(rate.mul_add(step, turns), rate, witness) {
                prop_assert!(plain.is_nan(), "the plain way hides nothing either");
                prop_assert!(wrapped.is_nan() || told.is_nan());
            }
        }
    }
}
