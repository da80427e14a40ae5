//! Models and tables as TOML.

use bicycle::Model;
use serde::Serialize;

/// The text that [`crate::parse_model`] reads back as the same model, to the last bit of every number.
///
/// Errors: a number that TOML cannot hold.
pub fn model_text(model: &Model) -> Result<String, toml::ser::Error> {
    toml_text(model)
}

/// The text that [`crate::ConfigText::parse`] reads back as the same table.
///
/// Errors: what is no table, and what TOML cannot hold.
pub fn toml_text(table: &impl Serialize) -> Result<String, toml::ser::Error> {
    toml::to_string(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ConfigText, parse_model, read_vehicle};
    use bicycle::Effect;

    #[test]
    fn a_model_comes_back_to_the_last_bit_with_repeated_effects_in_order() {
        let mut model = Model::of(&read_vehicle("rc_car").unwrap());
        let effect = |id, value| Effect::from_values(id, [value, 0.0, 0.0, 0.0]).unwrap();
        model.effects =
            vec![effect("steer_lag", 0.1 + 0.2), effect("speed_scale", 0.9), effect("steer_lag", 0.05)];
        let text = model_text(&model).unwrap();
        assert_eq!(parse_model(&ConfigText::new("m.toml", text)).unwrap(), model);
    }
}
