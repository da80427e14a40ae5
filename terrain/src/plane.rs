//! Least-squares planes through heights.

/// Running sums of h = a + g . (x, y) over samples around a centre.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PlaneSums {
    n: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
    h: f64,
    xh: f64,
    yh: f64,
    hh: f64,
}

/// A plane h = height + gradient . (x, y), and how badly it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plane {
    /// Height at the centre.
    pub height: f64,
    /// Change of height per unit of x and of y.
    pub gradient: [f64; 2],
    /// Sum of squared residuals.
    pub residual_sum: f64,
    /// Variance of the height at the centre in units of one sample's variance.
    pub leverage: f64,
    /// Number of samples.
    pub n: usize,
}

impl PlaneSums {
    pub(crate) fn add(&mut self, x: f64, y: f64, h: f64) {
        self.n += 1.0;
        self.x += x;
        self.y += y;
        self.xx += x * x;
        self.xy += x * y;
        self.yy += y * y;
        self.h += h;
        self.xh += x * h;
        self.yh += y * h;
        self.hh += h * h;
    }

    pub(crate) fn n(&self) -> usize {
        self.n as usize
    }

    pub(crate) fn mean(&self) -> f64 {
        self.h / self.n
    }

    /// How far the samples lie from the centre on average, as a vector's length.
    pub(crate) fn distance_of_mean(&self) -> f64 {
        libm::hypot(self.x / self.n, self.y / self.n)
    }

    /// Standard deviation of the heights, with n degrees of freedom; `None` below two samples.
    pub(crate) fn deviation(&self) -> Option<f64> {
        (self.n >= 2.0).then(|| ((self.hh - self.h * self.h / self.n).max(0.0) / self.n).sqrt())
    }

    /// The plane of least squares; `None` when the samples lie on a line, so that the tilt is not determined.
    pub(crate) fn fit(&self) -> Option<Plane> {
        let (mean_x, mean_y, mean_h) = (self.x / self.n, self.y / self.n, self.h / self.n);
        let (sxx, syy) = (self.xx - self.x * mean_x, self.yy - self.y * mean_y);
        let (sxy, shh) = (self.xy - self.x * mean_y, self.hh - self.h * mean_h);
        let (sxh, syh) = (self.xh - self.x * mean_h, self.yh - self.y * mean_h);
        let determinant = sxx * syy - sxy * sxy;
        if self.n < 3.0 || determinant <= 1e-6 * (sxx + syy) * (sxx + syy) {
            return None;
        }
        let gradient = [(sxh * syy - syh * sxy) / determinant, (syh * sxx - sxh * sxy) / determinant];
        Some(Plane {
            height: mean_h - gradient[0] * mean_x - gradient[1] * mean_y,
            gradient,
            residual_sum: (shh - gradient[0] * sxh - gradient[1] * syh).max(0.0),
            leverage: 1.0 / self.n
                + (mean_x * mean_x * syy - 2.0 * mean_x * mean_y * sxy + mean_y * mean_y * sxx) / determinant,
            n: self.n(),
        })
    }
}
