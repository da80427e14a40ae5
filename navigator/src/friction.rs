//! How much the ground is known to hold: by place where a map tells, else by what covers it.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use terrain::{GridMap, TerrainClass};
use traversability::{FrictionLimit, Ground};

/// Friction that tyres can count on, by the class of the ground [-]; left out where nobody knows. Plans keep to it
/// where `controller.costs.grip_s` says so; see [`crate::Config::keep_to_friction`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrictionConfig {
    /// Of rigid ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open: Option<f64>,
    /// Of loose ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loose: Option<f64>,
    /// Of soft plants.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vegetation: Option<f64>,
}

impl FrictionConfig {
    /// The first setting that cannot be, with what would do.
    pub(crate) fn first_invalid(&self) -> Option<(&'static str, &'static str, f64)> {
        let told = [
            ("friction.open", self.open),
            ("friction.loose", self.loose),
            ("friction.vegetation", self.vegetation),
        ];
        told.into_iter()
            .filter_map(|(field, friction)| Some((field, "a number in (0, 2.5]", friction?)))
            .find(|(.., friction)| !(*friction > 0.0 && *friction <= 2.5))
    }

    fn of(&self, class: u8) -> Option<f64> {
        match TerrainClass::ALL.get(usize::from(class))? {
            TerrainClass::Open => self.open,
            TerrainClass::Loose => self.loose,
            TerrainClass::Vegetation => self.vegetation,
            TerrainClass::Obstacle => None,
        }
    }
}

/// All that is known of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownFriction {
    pub by_class: FrictionConfig,
    /// In the map frame; not finite where it does not know [-].
    pub by_place: Option<Arc<GridMap<f32>>>,
}

impl KnownFriction {
    /// Whether nobody knows anything.
    pub fn is_empty(&self) -> bool {
        self.by_class == FrictionConfig::default() && self.by_place.is_none()
    }

    /// Of a cell, from its centre [m].
    pub fn limit(&self, [x_m, y_m]: [f64; 2], ground: &Ground) -> FrictionLimit {
        let by_place = self.by_place.as_ref().and_then(|map| map.at(x_m, y_m)).copied();
        let by_place = by_place.filter(|friction| friction.is_finite());
        let told = by_place.or_else(|| self.by_class.of(ground.class).map(|friction| friction as f32));
        told.map_or(FrictionLimit::UNTOLD, FrictionLimit::new)
    }
}

#[cfg(test)]
mod tests {
    use terrain::GridGeometry;

    use super::*;

    #[test]
    fn a_place_that_is_known_counts_before_its_class() {
        let geometry = GridGeometry { resolution_m: 1.0, origin: [0, 0], n_rows: 1, n_cols: 2 };
        let mut map = GridMap::filled(geometry, f32::NAN);
        map.values_mut()[1] = 0.12;
        let by_class = FrictionConfig { open: Some(0.7), vegetation: Some(0.5), ..FrictionConfig::default() };
        let known = KnownFriction { by_class, by_place: Some(Arc::new(map)) };
        let told = |x_m: f64, class: TerrainClass| {
            known.limit([x_m, 0.5], &Ground { class: class as u8, ..Ground::default() }).hundredths()
        };
        // Known, not known, beyond the map; of loose ground nobody has said anything.
        assert_eq!([1.5, 0.5, 2.5].map(|x_m| told(x_m, TerrainClass::Open)), [12, 70, 70]);
        assert_eq!([1.5, 0.5].map(|x_m| told(x_m, TerrainClass::Vegetation)), [12, 50]);
        assert_eq!(told(0.5, TerrainClass::Loose), 0);
        assert!(!known.is_empty() && KnownFriction::default().is_empty());
    }

    #[test]
    fn friction_that_no_ground_has_is_refused() {
        for friction in [0.0, -0.1, 2.6, f64::NAN, f64::INFINITY] {
            let config = FrictionConfig { loose: Some(friction), ..FrictionConfig::default() };
            assert_eq!(config.first_invalid().map(|(field, ..)| field), Some("friction.loose"), "{friction}");
        }
        assert_eq!(FrictionConfig { open: Some(0.6), ..FrictionConfig::default() }.first_invalid(), None);
    }
}
