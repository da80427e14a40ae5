//! A risk map of one's own: whatever is known of the ground becomes distributions, their bad tails become risk, and
//! the controller drives on the map without knowing who made it.
//!
//! `cargo run -p traversability --example own_risk_map`

use std::error::Error;

use traversability::{Bins, Cell, CvarLevel, GridGeometry, Pmf, Risk, RiskMap};

fn main() -> Result<(), Box<dyn Error>> {
    // On wet clay the vehicle gets 0.8 of the speed that it asks for, but sometimes anything from nothing to all.
    let wet_clay = Pmf::interpolated(&Bins::TRACTION, 0.8).ok_or("expected a number")?;
    let wet_clay = wet_clay.mixed_with(&Pmf::UNIFORM, 0.25);
    let worst_fifth = CvarLevel::new(0.2)?;
    let risk = Risk {
        linear_traction: wet_clay.lower_tail_cvar(&Bins::TRACTION, worst_fifth),
        angular_traction: 0.7,
        roll_rad: 0.05,
        pitch_rad: 0.05,
    };
    println!(
        "traction [-]: mean {:.2}, worst fifth {:.2}",
        wet_clay.mean(&Bins::TRACTION),
        risk.linear_traction
    );
    // By hand: the mean is 0.75 x 0.8 + 0.25 x 0.5. The uniform part leaves 0.25 / 12 in each of the eight bins below
    // 0.75, whose values sum to 2.45; what lacks to a fifth lies at 0.75.
    let by_hand = (0.25 / 12.0 * 2.45 + (0.2 - 8.0 * 0.25 / 12.0) * 0.75) / 0.2;
    assert!((wet_clay.mean(&Bins::TRACTION) - 0.725).abs() < 1e-4);
    assert!((risk.linear_traction - by_hand).abs() < 1e-4);

    // 12 x 12 m around the origin in cells of 0.25 m, eight headings: firm ground, a strip of clay, one rock.
    let geometry = GridGeometry::centred(0.25, 48, 48, 0.0, 0.0);
    let n_yaws = 8;
    let mut map = RiskMap::constant(geometry, n_yaws, Risk::NONE);
    let rock = geometry.cell_at(-3.0, 0.0).ok_or("expected a place on the map")?;
    map.fill(|risks, _ground| {
        for index in 0..geometry.n_cells() {
            let cell: Cell = geometry.cell(index);
            let here = &mut risks[index * n_yaws..][..n_yaws];
            if (0.0..2.0).contains(&geometry.centre_m(cell)[0]) {
                here.fill(risk);
            }
            if cell == rock {
                here.iter_mut().for_each(|risk| *risk = risk.blocked());
            }
        }
    });

    let view = map.view();
    for x_m in [-3.0, -1.0, 1.0, 7.0] {
        let Risk { linear_traction, roll_rad, .. } = view.risk_at(x_m, 0.0, 0.0);
        println!(
            "x = {x_m:4.1} m: linear traction {linear_traction:.2}, |roll| {:.0} degrees",
            roll_rad.to_degrees()
        );
    }
    assert!(view.risk_at(-3.0, 0.0, 0.0).is_blocked());
    assert_eq!(view.risk_at(1.0, 0.0, 0.0), risk);
    assert_eq!(view.risk_at(7.0, 0.0, 0.0), Risk::OUTSIDE);
    Ok(())
}
