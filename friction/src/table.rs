//! What was found, as a file holds it, for planners to read in place of the published coefficients.

use route::FrictionCurve;
use serde::{Deserialize, Serialize};

use crate::judge::{Grip, GroundFriction};

/// Friction by class of ground as one vehicle's drives showed it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrictionTable {
    /// Whose drives.
    pub vehicle: String,
    /// One for each class, under `[[ground]]`.
    pub ground: Vec<GroundFriction>,
}

/// A table that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, found {found}")]
pub struct TableError {
    /// Dotted path of the field, e.g. `ground[1].curve`.
    pub field: String,
    /// What would do.
    pub expected: String,
    /// What stands there.
    pub found: String,
}

impl FrictionTable {
    /// Refuses names that are none of [`FrictionCurve::PUBLISHED`] or stand twice, coefficients that no ground has, and
    /// intervals that do not hold their number.
    ///
    /// # Errors
    /// The first of these.
    pub fn validate(&self) -> Result<(), TableError> {
        let refuse = |field: String, expected: &str, found: String| {
            Err(TableError { field, expected: expected.to_owned(), found })
        };
        if self.ground.is_empty() {
            return refuse("ground".to_owned(), "at least one", "none".to_owned());
        }
        for (index, row) in self.ground.iter().enumerate() {
            let field = |name: &str| format!("ground[{index}].{name}");
            if FrictionCurve::published(&row.ground).is_none() {
                return refuse(field("ground"), &FrictionCurve::names(), row.ground.clone());
            }
            if self.ground[..index].iter().any(|other| other.ground == row.ground) {
                return refuse(field("ground"), "each ground once", format!("{} twice", row.ground));
            }
            if !row.curve.is_valid() {
                return refuse(field("curve"), FrictionCurve::EXPECTED, format!("{:?}", row.curve));
            }
            if !row.grip.is_valid() {
                return refuse(field("grip"), Grip::EXPECTED, format!("{:?}", row.grip));
            }
            if !(row.driven_s.is_finite() && row.at_limit_s.is_finite()) {
                return refuse(field("driven_s"), "finite times", format!("{} s", row.driven_s));
            }
        }
        Ok(())
    }

    /// The curve to plan with on a ground: this table's, or the published one.
    pub fn curve_or(&self, ground: &str, published: FrictionCurve) -> FrictionCurve {
        self.ground.iter().find(|row| row.ground == ground).map_or(published, |row| row.curve)
    }
}

impl Grip {
    const EXPECTED: &'static str = "0 <= low <= friction <= high <= 10";

    fn is_valid(&self) -> bool {
        let (low, friction, high) = match *self {
            Self::Measured { friction, low, high, .. } => (low, friction, high),
            Self::AtLeast { friction } => (friction, friction, friction),
        };
        0.0 <= low && low <= friction && friction <= high && high <= 10.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> FrictionTable {
        let row = GroundFriction {
            ground: "ice".to_owned(),
            driven_s: 30.0,
            at_limit_s: 4.0,
            grip: Grip::Measured { sliding_mps: 0.5, friction: 0.2, low: 0.18, high: 0.22 },
            curve: FrictionCurve::ICE,
        };
        FrictionTable { vehicle: "sedan".to_owned(), ground: vec![row] }
    }

    #[test]
    fn planners_get_what_was_found_and_else_what_was_published() {
        let mut table = table();
        table.ground[0].curve = FrictionCurve::ICE.scaled(0.5);
        assert_eq!(table.validate(), Ok(()));
        assert_eq!(table.curve_or("ice", FrictionCurve::ICE), FrictionCurve::ICE.scaled(0.5));
        assert_eq!(table.curve_or("mud", FrictionCurve::MUD), FrictionCurve::MUD);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        let refused = |change: &dyn Fn(&mut FrictionTable)| {
            let mut table = table();
            change(&mut table);
            table.validate().unwrap_err().to_string()
        };
        assert_eq!(refused(&|table| table.ground.clear()), "ground: expected at least one, found none");
        assert_eq!(
            refused(&|table| table.ground[0].ground = "lava".to_owned()),
            "ground[0].ground: expected asphalt, rock, dirt, grass, mud, sand, ice, found lava"
        );
        let twice = refused(&|table| table.ground.push(table.ground[0].clone()));
        assert_eq!(twice, "ground[1].ground: expected each ground once, found ice twice");
        let nan = refused(&|table| table.ground[0].curve.static_friction = f32::NAN);
        assert!(nan.starts_with("ground[0].curve: expected friction coefficients within"), "{nan}");
        let outside = Grip::Measured { sliding_mps: 0.5, friction: 0.2, low: 0.3, high: 0.4 };
        let found = refused(&|table| table.ground[0].grip = outside);
        assert!(found.starts_with("ground[0].grip: expected 0 <= low <= friction"), "{found}");
        let bound = refused(&|table| table.ground[0].grip = Grip::AtLeast { friction: f64::NAN });
        assert!(bound.starts_with("ground[0].grip"), "{bound}");
        let time = refused(&|table| table.ground[0].driven_s = f64::INFINITY);
        assert!(time.starts_with("ground[0].driven_s: expected finite times"), "{time}");
    }
}
