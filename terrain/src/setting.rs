//! Settings that are out of their range.

/// A number that a configuration cannot hold: the error of every configuration here and in the crates that build on
/// this one.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{field}: expected {expected}, found {found}")]
pub struct SettingError {
    /// Name of the field.
    pub field: &'static str,
    /// The range that would do.
    pub expected: &'static str,
    /// The value that was given.
    pub found: f64,
}

impl SettingError {
    /// Refuses the first of these fields, each a name and its value, that is not `allowed`.
    ///
    /// # Errors
    /// That field, with what would do.
    pub fn check(
        fields: &[(&'static str, f64)],
        expected: &'static str,
        allowed: impl Fn(f64) -> bool,
    ) -> Result<(), Self> {
        match fields.iter().find(|(_, value)| !allowed(*value)) {
            Some(&(field, found)) => Err(Self { field, expected, found }),
            None => Ok(()),
        }
    }

    /// The same of numbers that must be finite besides.
    ///
    /// # Errors
    /// The first that is not, with what would do.
    pub fn check_finite(
        fields: &[(&'static str, f64)],
        expected: &'static str,
        allowed: impl Fn(f64) -> bool,
    ) -> Result<(), Self> {
        Self::check(fields, expected, |value| value.is_finite() && allowed(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_field_out_of_range_is_told_with_its_number() {
        let fields = [("near_m", 1.0), ("far_m", -2.0), ("farther_m", -3.0)];
        let refused = SettingError::check(&fields, "a number >= 0", |value| value >= 0.0).unwrap_err();
        assert_eq!(refused.to_string(), "far_m: expected a number >= 0, found -2");
        assert_eq!(SettingError::check(&fields[..1], "a number >= 0", |value| value >= 0.0), Ok(()));
    }

    #[test]
    fn what_must_be_finite_is_refused_where_it_is_not() {
        let above_zero = |value: f64| value > 0.0;
        for wrong in [f64::INFINITY, f64::NAN, -1.0] {
            assert!(
                SettingError::check_finite(&[("gain", wrong)], "a finite number > 0", above_zero).is_err()
            );
        }
        assert_eq!(SettingError::check(&[("gain", f64::INFINITY)], "a number > 0", above_zero), Ok(()));
    }
}
