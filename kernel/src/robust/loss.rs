//! Losses: how much a squared residual counts.

use crate::Real;
use crate::real::lit;

/// The weight of a squared residual in an iteratively reweighted least-squares step, and its cost.
///
/// Scales are in the residual's unit. Cost and weight agree: the weight is the derivative of the cost by the squared
/// residual.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Loss<T> {
    /// rho(s) = s.
    Squared,
    /// rho(s) = min(s, k^2): what lies beyond `k` counts as an outlier.
    Truncated(T),
    /// rho(s) = s up to k^2, then 2 k sqrt(s) - k^2 (P. Huber, 1964).
    Huber(T),
    /// rho(s) = k^2 ln(1 + s / k^2).
    Cauchy(T),
    /// Tukey's biweight: rho(s) = k^2 / 3 (1 - (1 - s / k^2)^3) up to k^2, constant beyond.
    Tukey(T),
    /// Geman and McClure: rho(s) = s / (1 + s / k^2).
    GemanMcClure(T),
}

impl<T: Real> Loss<T> {
    /// The squared residual from which on the weight is zero; none where it never is.
    #[inline]
    #[must_use]
    pub fn support(&self) -> Option<T> {
        match *self {
            Self::Truncated(k) | Self::Tukey(k) => Some(k * k),
            _ => None,
        }
    }

    /// `(cost, weight)` of a squared residual.
    ///
    /// The weight is the derivative of the cost by the squared residual: that of iteratively reweighted least squares.
    ///
    /// # Input
    /// A squared residual, not negative, in the unit of `k` squared.
    ///
    /// # Examples
    /// ```
    /// use epipole::robust::loss::Loss;
    /// assert_eq!(Loss::Huber(2.0_f64).evaluate(1.0), (1.0, 1.0));
    /// assert_eq!(Loss::Huber(2.0_f64).evaluate(16.0), (2.0 * 2.0 * 4.0 - 4.0, 0.5));
    /// ```
    #[cfg_attr(not(small), inline)]
    #[cfg_attr(small, inline(never))]
    #[must_use]
    pub fn evaluate(&self, squared: T) -> (T, T) {
        let (one, zero) = (T::ONE, T::ZERO);
        match *self {
            Self::Squared => (squared, one),
            Self::Truncated(k) => {
                let limit = k * k;
                if squared < limit { (squared, one) } else { (limit, zero) }
            }
            Self::Huber(k) => {
                let limit = k * k;
                if squared <= limit {
                    (squared, one)
                } else {
                    let r = crate::real::sqrt(squared);
                    (T::TWO * k * r - limit, k / r)
                }
            }
            Self::Cauchy(k) => {
                let limit = k * k;
                let u = one + squared / limit;
                (limit * crate::real::ln(u), one / u)
            }
            Self::Tukey(k) => {
                let limit = k * k;
                let third = limit / lit::<T>(3.0);
                if squared < limit {
                    let u = one - squared / limit;
                    (third * (one - u * u * u), u * u)
                } else {
                    (third, zero)
                }
            }
            Self::GemanMcClure(k) => {
                let u = one / (one + squared / (k * k));
                (squared * u, u * u)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Loss;

    #[test]
    fn weight_is_the_derivative_of_the_cost() {
        for loss in [
            Loss::Squared,
            Loss::Truncated(2.0),
            Loss::Huber(1.5),
            Loss::Cauchy(1.2),
            Loss::Tukey(3.0),
            Loss::GemanMcClure(2.0f64),
        ] {
            for s in [0.1, 1.0, 2.0, 3.0, 5.0, 20.0] {
                let h = 1e-6;
                let slope = (loss.evaluate(s + h).0 - loss.evaluate(s - h).0) / (2.0 * h);
                assert!((slope - loss.evaluate(s).1).abs() < 1e-8, "{loss:?} at {s}");
            }
        }
    }
}
