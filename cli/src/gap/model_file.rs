//! The file of a controller's model.

use std::path::Path;

use bicycle::Model;
use formats::ConfigText;

use crate::UsageError;

/// A model's file, or the model that a vehicle's file or a shipped vehicle stands for.
pub(super) fn read(path: &Path) -> Result<Model, UsageError> {
    let name = path.to_string_lossy();
    let is_shipped = formats::shipped_vehicle_names().any(|shipped| shipped == name);
    let vehicle = || formats::read_vehicle(&name).map(|vehicle| Model::of(&vehicle));
    if is_shipped {
        return vehicle().map_err(UsageError::from_input);
    }
    let text = ConfigText::read(path).map_err(UsageError::from_input)?;
    let model = if text.has_key("geometry") { vehicle() } else { formats::parse_model(&text) };
    model.map_err(UsageError::from_input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_stands_for_its_model() {
        let shipped = read(Path::new("sedan")).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        std::fs::write(&path, formats::shipped_vehicle_text("sedan").unwrap()).unwrap();
        assert_eq!(read(&path).unwrap(), shipped);
        assert!(shipped.effects.is_empty());
        assert!(
            read(&folder.path().join("none.toml")).unwrap_err().0.contains("none.toml: expected a readable")
        );
    }
}
