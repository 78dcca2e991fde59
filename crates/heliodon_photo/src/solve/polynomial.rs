//! Real roots of polynomials in one unknown.

/// The value of a polynomial, coefficients from the constant up.
pub(super) fn value(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, &c| sum * x + c)
}

/// The product of two.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut all = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            all[i + j] += x * y;
        }
    }
    all
}

/// The real roots, rising. Between two neighbouring extrema a polynomial crosses zero at most once, so the derivative's roots, found the same
/// way, bracket all of them: slower than companion matrices, but it misses none and needs no complex numbers. A double root, which touches
/// zero, may be found twice, once or not at all.
pub(super) fn real_roots(coefficients: &[f64]) -> Vec<f64> {
    let largest = coefficients.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    let mut degree = coefficients.len().saturating_sub(1);
    while degree > 0 && coefficients[degree].abs() <= largest * 1e-14 {
        degree -= 1;
    }
    if degree == 0 || !largest.is_finite() {
        return Vec::new();
    }
    let coefficients = &coefficients[..=degree];
    if degree == 1 {
        return vec![-coefficients[0] / coefficients[1]];
    }
    let derivative: Vec<f64> = (1..=degree).map(|i| coefficients[i] * i as f64).collect();
    // Cauchy's bound
    let bound = 1.0 + coefficients[..degree].iter().fold(0.0f64, |m, c| m.max((c / coefficients[degree]).abs()));
    let mut stops = vec![-bound];
    stops.extend(real_roots(&derivative).into_iter().filter(|x| x.abs() < bound));
    stops.push(bound);
    let mut roots: Vec<f64> = Vec::new();
    for pair in stops.windows(2) {
        let root = bracketed(coefficients, &derivative, pair[0], pair[1]);
        roots.extend(root.filter(|r| roots.last() != Some(r)));
    }
    roots
}

/// The root between two places where the polynomial has different signs: Newton's method, kept inside by bisection.
fn bracketed(coefficients: &[f64], derivative: &[f64], mut low: f64, mut high: f64) -> Option<f64> {
    let (at_low, at_high) = (value(coefficients, low), value(coefficients, high));
    if at_low == 0.0 {
        return Some(low);
    }
    if at_high == 0.0 {
        return Some(high);
    }
    if (at_low < 0.0) == (at_high < 0.0) {
        return None;
    }
    let mut x = 0.5 * (low + high);
    for _ in 0..200 {
        let y = value(coefficients, x);
        if y == 0.0 {
            return Some(x);
        }
        if (y < 0.0) == (at_low < 0.0) {
            low = x;
        } else {
            high = x;
        }
        let newton = x - y / value(derivative, x);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= f64::EPSILON * x.abs().max(f64::MIN_POSITIVE) || high - low <= f64::EPSILON * x.abs() {
            return Some(next);
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_roots_of_a_product_are_found() {
        let wanted = [-30.0, -2.5, -0.1, 0.0, 0.75, 1.0, 3.0, 9.0];
        let all = wanted.iter().fold(vec![1.0], |p, r| product(&p, &[-r, 1.0]));
        let all = product(&all, &[1.0, 0.0, 1.0]);
        let found = real_roots(&all);
        assert_eq!(found.len(), wanted.len());
        for (f, w) in found.iter().zip(wanted) {
            assert!((f - w).abs() < 1e-8, "{f} for {w}");
        }
        assert!(real_roots(&[1.0, 0.0, 1.0]).is_empty());
        assert!(real_roots(&[3.0]).is_empty());
        assert!(real_roots(&[]).is_empty());
        assert_eq!(real_roots(&[2.0, 1.0, 0.0]), [-2.0]);
    }
}
