//! The bins over which traversability is distributed.

/// Number of bins of every distribution (PIETRA: B = 12).
pub const N_BINS: usize = 12;

/// A partition of a parameter's range into [`N_BINS`] bins, each with the value that stands for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bins {
    values: [f32; N_BINS],
    edges: [f32; N_BINS + 1],
}

impl Bins {
    /// Traction: an atom at 0, ten bins of width 0.1, an atom at 1, the layout of the published traction maps
    /// of PIETRA's authors: values 0, 0.05, 0.15, ..., 0.95, 1; edges 0, 0, 0.1, ..., 0.9, 1, 1.
    ///
    /// The atom at 0 holds exactly what is <= 0, the atom at 1 exactly what is >= 1.
    pub const TRACTION: Self = Self {
        values: [0.0, 0.05, 0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85, 0.95, 1.0],
        edges: [0.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.0],
    };

    /// |roll| and |pitch| [rad]: twelve bins of 5 degrees from 0 to 60, so that the usual limits of 30 and
    /// 45 degrees are edges; values in the middle of the bins. Larger angles belong to the last bin.
    pub const ATTITUDE: Self = Self { values: middles(), edges: edges() };

    /// Width of every bin of [`Bins::ATTITUDE`] [rad].
    pub const ATTITUDE_WIDTH_RAD: f32 = (5.0 / 180.0 * std::f64::consts::PI) as f32;

    /// The value that stands for each bin, ascending.
    pub const fn values(&self) -> &[f32; N_BINS] {
        &self.values
    }

    /// Bin b reaches from edge b to edge b + 1; equal edges make an atom.
    pub const fn edges(&self) -> &[f32; N_BINS + 1] {
        &self.edges
    }

    /// The bin that holds a value: `edges[b] <= value < edges[b + 1]`. Values beyond the range belong to the
    /// outermost bins; `None` for NaN.
    pub fn bin_of(&self, value: f32) -> Option<usize> {
        if value.is_nan() {
            return None;
        }
        let lower_atom = self.edges[0] == self.edges[1];
        if lower_atom && value <= self.edges[0] {
            return Some(0);
        }
        let inner = &self.edges[1..N_BINS];
        Some(inner.iter().take_while(|&&edge| value >= edge).count())
    }
}

/// Angles of attitude bins, computed in f64 so that the table is rounded once.
const fn multiples<const N: usize>(start_deg: f64) -> [f32; N] {
    let mut angles_rad = [0.0; N];
    let mut k = 0;
    while k < N {
        angles_rad[k] = ((start_deg + 5.0 * k as f64) * (std::f64::consts::PI / 180.0)) as f32;
        k += 1;
    }
    angles_rad
}

const fn middles() -> [f32; N_BINS] {
    multiples(2.5)
}

const fn edges() -> [f32; N_BINS + 1] {
    multiples(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attitude_limits_are_edges() {
        let edges = Bins::ATTITUDE.edges();
        assert_eq!(edges[6], 30f32.to_radians());
        assert_eq!(edges[9], 45f32.to_radians());
        assert_eq!(edges[12], 60f32.to_radians());
        assert_eq!(Bins::ATTITUDE_WIDTH_RAD, 5f32.to_radians());
    }

    #[test]
    fn every_value_lies_in_its_own_bin() {
        for bins in [Bins::TRACTION, Bins::ATTITUDE] {
            for (bin, &value) in bins.values().iter().enumerate() {
                assert_eq!(bins.bin_of(value), Some(bin));
                let (low, high) = (bins.edges()[bin], bins.edges()[bin + 1]);
                assert!((value - (low + high) / 2.0).abs() < 1e-6, "bin {bin}");
            }
        }
    }

    #[test]
    fn edges_belong_to_the_bin_above_and_the_ends_are_atoms() {
        let traction = Bins::TRACTION;
        let cases = [
            (-0.5, 0),
            (0.0, 0),
            (1e-6, 1),
            (0.1, 2),
            (0.5, 6),
            (0.999_999, 10),
            (1.0, 11),
            (3.0, 11),
            (f32::INFINITY, 11),
            (f32::NEG_INFINITY, 0),
        ];
        for (value, bin) in cases {
            assert_eq!(traction.bin_of(value), Some(bin), "{value}");
        }
        assert_eq!(Bins::ATTITUDE.bin_of(0.0), Some(0));
        assert_eq!(Bins::ATTITUDE.bin_of(30f32.to_radians()), Some(6));
        assert_eq!(Bins::ATTITUDE.bin_of(2.0), Some(11));
        assert_eq!(traction.bin_of(f32::NAN), None);
    }
}
