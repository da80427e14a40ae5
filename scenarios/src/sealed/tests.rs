use std::collections::BTreeSet;
use std::sync::LazyLock;

use bicycle::{Column, DriveLog, Vehicle};

use super::*;

fn base() -> Vehicle {
    toml::from_str(include_str!("../../vehicles/rc_car.toml")).unwrap()
}

static MACHINE: LazyLock<TestMachine> = LazyLock::new(|| TestMachine::draw(&base(), "m", 5).unwrap());

fn column(log: &DriveLog, column: Column) -> Vec<f64> {
    log.runs().next().unwrap().column(column).unwrap().to_vec()
}

#[test]
fn machines_of_different_seeds_differ_and_each_is_one() {
    let wheelbases: Vec<f64> = (0..20)
        .map(|seed| {
            let machine = TestMachine::draw(&base(), "m", seed).unwrap();
            machine.vehicle.validate().unwrap();
            let froude = machine.speeds_mps[1].powi(2) / (9.81 * machine.vehicle.geometry.wheelbase_m);
            assert!((1.2..2.0).contains(&froude), "{froude}");
            machine.vehicle.geometry.wheelbase_m
        })
        .collect();
    for [a, b] in wheelbases.array_windows() {
        assert!((a - b).abs() > 1e-6);
    }
    assert!(wheelbases.iter().all(|wheelbase_m| (0.14..0.24).contains(wheelbase_m)), "{wheelbases:?}");
}

#[test]
fn hills_have_every_class_and_slopes_that_can_be_driven() {
    for seed in 0..5 {
        let world = TestMachine::draw(&base(), "m", seed).unwrap().world;
        let n_cells = world.patches.values().len();
        for class in
            [terrain::TerrainClass::Open, terrain::TerrainClass::Loose, terrain::TerrainClass::Vegetation]
        {
            let n = world.patches.values().iter().filter(|patch| patch.class == class).count();
            assert!(n > n_cells / 20, "{class:?}: {n} of {n_cells}");
        }
        let bounds = world.bounds();
        let slopes = (0..2000).map(|i| {
            let share = |k: i32| f64::from((i * k) % 1999) / 1999.0;
            let [x_m, y_m] = [0, 1].map(|axis| {
                let [low_m, high_m] = [bounds.south_west_m[axis], bounds.north_east_m[axis]];
                low_m + share([37, 101][axis]) * (high_m - low_m)
            });
            let [east, north] = world.gradient(x_m, y_m);
            east.hypot(north)
        });
        let steepest = slopes.fold(0.0, f64::max);
        assert!((0.1..0.5).contains(&steepest), "{steepest}");
    }
}

#[test]
fn a_drive_is_as_long_and_as_rich_as_its_style_says() {
    let [rich, poor, track] =
        [Style::Rich, Style::Poor, Style::Track].map(|style| test_drive(&MACHINE, &[], style, 1).unwrap());
    let different = |log: &DriveLog| {
        let speeds =
            column(log, Column::CmdSpeed).into_iter().map(|speed_mps| (speed_mps * 1e4).round() as i64);
        speeds.collect::<BTreeSet<_>>().len()
    };
    assert_eq!(rich.n_rows(), 2000);
    assert!(different(&rich) > 8 && different(&track) > 8 && different(&poor) == 1);
    let reversals = |log: &DriveLog| {
        let steering = column(log, Column::CmdSteer);
        steering.array_windows().filter(|[a, b]| a * b < 0.0).count()
    };
    assert!(
        reversals(&rich) > 20 && reversals(&rich) > reversals(&poor),
        "{} {}",
        reversals(&rich),
        reversals(&poor)
    );
    for log in [rich, poor, track] {
        let most_m = column(&log, Column::X)
            .into_iter()
            .chain(column(&log, Column::Y))
            .fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(most_m < MACHINE.half_side_m(), "{most_m}");
        assert!(column(&log, Column::CmdSteer).iter().all(|rad| rad.abs() <= MACHINE.steering_max_rad));
        assert!(column(&log, Column::Yaw).iter().all(|rad| rad.abs() < std::f64::consts::PI + 1e-4));
    }
}

#[test]
fn a_drive_follows_its_commands_and_is_the_same_every_time() {
    let log = test_drive(&MACHINE, &[], Style::Poor, 3).unwrap();
    assert_eq!(log, test_drive(&MACHINE, &[], Style::Poor, 3).unwrap());
    assert_ne!(log, test_drive(&MACHINE, &[], Style::Poor, 4).unwrap());
    let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
    let ratio = mean(column(&log, Column::Vx)) / mean(column(&log, Column::CmdSpeed));
    assert!((0.8..1.1).contains(&ratio), "{ratio}");
    // The pose moves as the velocity says.
    let [x_m, y_m, vx_mps, yaw_rad] =
        [Column::X, Column::Y, Column::Vx, Column::Yaw].map(|c| column(&log, c));
    let way_m: f64 = (0..1999)
        .map(|i| (x_m[i + 1] - x_m[i]) * yaw_rad[i].cos() + (y_m[i + 1] - y_m[i]) * yaw_rad[i].sin())
        .sum();
    let integral_m = 0.02 * vx_mps.iter().sum::<f64>();
    assert!((way_m / integral_m - 1.0).abs() < 0.03, "{way_m} {integral_m}");
}

#[test]
fn every_effect_and_unknown_can_be_made_in_every_size() {
    let mut rng = stream(1, &[]);
    for id in EFFECTS {
        let sizes = Magnitude::ALL.map(|size| effects::make(id, size, &MACHINE, &mut rng));
        for made in &sizes {
            assert!(!made.injection.is_empty(), "{id}");
            made.deviations.iter().for_each(|deviation| deviation.validate().unwrap());
        }
        assert_ne!(sizes[0], sizes[2], "{id}");
    }
    for id in UNKNOWNS {
        let made = unknowns::make(id, &MACHINE, &mut rng);
        assert_eq!(made.deviations.len(), 1, "{id}");
        made.deviations[0].validate().unwrap();
    }
}

#[test]
fn effects_of_a_label_are_what_the_plant_does() {
    let mut rng = stream(2, &[]);
    let gain = effects::make("steer_gain", Magnitude::Large, &MACHINE, &mut rng);
    let [(key, ratio)] = gain.injection[..] else { panic!("{gain:?}") };
    assert_eq!(
        (key, &gain.deviations[..]),
        ("st_gain", &[Deviation::SteeringRatio { left: ratio, right: ratio }][..])
    );
    // 1.2 kg/m3 / 2 times the area over the mass.
    let drag = effects::make("quad_drag", Magnitude::Small, &MACHINE, &mut rng);
    let Deviation::DragArea { area_m2 } = drag.deviations[0] else { panic!("{drag:?}") };
    assert!((0.6 * area_m2 / MACHINE.mass_kg() / drag.injection[0].1 - 1.0).abs() < 1e-12);
}

#[test]
fn many_cases_hold_every_kind_in_about_its_share_and_pairs_of_different_parts() {
    let cases: Vec<DrawnCase> = (0..4000).map(|seed| DrawnCase::draw(&MACHINE, seed)).collect();
    let count = |amount: Amount| cases.iter().filter(|case| case.amount == amount).count() as f64;
    for (amount, share) in SHARES {
        // Three standard deviations of a binomial.
        let band = 3.0 * (4000.0 * share * (1.0 - share)).sqrt();
        assert!((count(amount) - 4000.0 * share).abs() < band, "{amount:?}: {}", count(amount));
    }
    for case in &cases {
        let n_expected = match case.amount {
            Amount::None => 0,
            Amount::Single | Amount::Unknown => 1,
            Amount::Pair => 2,
        };
        assert_eq!(case.effects.len(), n_expected);
        assert_eq!(case.deviations.len(), n_expected);
        if let [a, b] = case.effects[..] {
            assert_ne!(effects::group(a), effects::group(b));
        }
    }
    let named: BTreeSet<&str> = cases.iter().flat_map(|case| case.effects.clone()).collect();
    assert_eq!(named.len(), EFFECTS.len() + UNKNOWNS.len());
}
