//! Worlds with their picture: the same for the same seed, friction within what the grounds allow, looks held out.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use scenarios::{Looks, PAINTED_GROUNDS, PaintedConfig, PaintedWorld, WorldError, painted_world};

fn painted(seed: u64, looks: Looks) -> PaintedWorld {
    painted_world(&PaintedConfig { seed, looks, side_m: 100.0, cell_m: 0.5 }).unwrap()
}

/// Mean colour of a ground over several worlds.
fn mean_colour(ground: u8, looks: Looks) -> [f64; 3] {
    let (mut sum, mut n) = ([0.0; 3], 0.0);
    for seed in 0..6 {
        let painted = painted(seed, looks);
        for (found, colour) in painted.grounds.values().iter().zip(painted.colours.values()) {
            if *found == ground {
                n += 1.0;
                sum = std::array::from_fn(|i| sum[i] + f64::from(colour[i]));
            }
        }
    }
    sum.map(|sum| sum / n)
}

#[test]
fn a_world_is_its_seed_and_holds_all_grounds_in_many_colours() {
    let (first, again, other) =
        (painted(1, Looks::Known), painted(1, Looks::Known), painted(2, Looks::Known));
    assert_eq!(first.colours.values(), again.colours.values());
    assert_ne!(first.colours.values(), other.colours.values());
    for ground in 0..7_u8 {
        let of_it = || first.grounds.values().iter().filter(|found| **found == ground);
        assert!(of_it().count() > 200, "{}", PAINTED_GROUNDS[usize::from(ground)].0);
        let first_colour = first
            .grounds
            .values()
            .iter()
            .position(|found| *found == ground)
            .map(|i| first.colours.values()[i]);
        let mut colours = first.grounds.values().iter().zip(first.colours.values());
        assert!(colours.any(|(found, colour)| *found == ground && Some(*colour) != first_colour));
    }
    let is_colour = |colour: &[f32; 3]| colour.iter().all(|part| (0.0..=1.0).contains(part));
    assert!(first.colours.values().iter().all(is_colour));
}

/// Unmixed dry ground holds 0.9 to 1.1 of what is published, wet ground 0.75 of that, mixed ground what lies between two:
/// none holds less than 0.75 * 0.9 of the least or more than 1.1 of the most.
#[test]
fn friction_is_the_published_one_within_a_tenth_but_for_wet_and_mixed_ground() {
    let painted = painted(3, Looks::Known);
    let cells = painted.grounds.values().iter().zip(painted.world.patches.values());
    let mut n_within = 0;
    for (ground, patch) in cells {
        let published = PAINTED_GROUNDS[usize::from(*ground)].1;
        let factor = patch.friction.static_friction / published.static_friction;
        n_within += usize::from((0.9..=1.1).contains(&factor));
        assert!((0.75 * 0.9 * 0.4..=1.1 * 0.98).contains(&patch.friction.static_friction), "{factor}");
    }
    let share = n_within as f64 / painted.grounds.values().len() as f64;
    assert!((0.5..0.95).contains(&share), "{share}");
}

#[test]
fn held_out_looks_are_others() {
    for ground in 0..7 {
        let [known, held_out] = [Looks::Known, Looks::HeldOut].map(|looks| mean_colour(ground, looks));
        let off: f64 = known.iter().zip(held_out).map(|(a, b)| (a - b).powi(2)).sum();
        assert!(off.sqrt() > 0.02, "{ground}: {known:?} {held_out:?}");
    }
}

#[test]
fn a_lidar_sees_blades_that_no_wheel_feels() {
    let painted = painted(4, Looks::Known);
    let relief_m = |ground: u8| {
        let cells = painted.grounds.values().iter().zip(painted.seen_heights_m.values());
        let off: Vec<f64> = cells
            .zip(painted.world.heights.values())
            .filter(|((found, _), _)| **found == ground)
            .map(|((_, seen_m), height_m)| f64::from(seen_m - height_m).powi(2))
            .collect();
        (off.iter().sum::<f64>() / off.len() as f64).sqrt()
    };
    let (grass_m, ice_m) = (relief_m(3), relief_m(6));
    assert!(grass_m > 0.02 && ice_m < 0.012, "{grass_m} {ice_m}");
}

#[test]
fn a_side_of_no_cells_is_refused() {
    let config = PaintedConfig { seed: 0, looks: Looks::Known, side_m: 0.5, cell_m: 0.5 };
    assert!(matches!(painted_world(&config), Err(WorldError::TooSmall { .. })));
    let nan = PaintedConfig { cell_m: f64::NAN, ..config };
    assert!(painted_world(&nan).is_err());
}
