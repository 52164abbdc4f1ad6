//! Derivative types against closed forms, and the pattern against the derivatives.

use super::{Dual, Pattern, Scalar, SecondDual};

/// f(x, y) = atan2(y, x)·√(1 + x²) + exp(−x y) sin y / (2 + cos x) + acos(x/4).
fn sample<S: Scalar>(x: S, y: S) -> S {
    let (sin_y, _) = y.sin_cos();
    let (_, cos_x) = x.sin_cos();
    y.atan2(x) * (x.square() + 1.0).sqrt()
        + (-(x * y)).exp() * sin_y / (cos_x + 2.0)
        + (x * 0.25).acos()
}

#[test]
fn derivatives_agree_with_complex_free_central_differences() {
    for &(x, y) in &[(0.7, 1.9), (-1.3, 0.4), (2.1, -0.8), (-0.2, -1.1)] {
        let exact = sample(
            SecondDual::<2, 3>::seed(x, 0),
            SecondDual::<2, 3>::seed(y, 1),
        );
        let first = sample(Dual::<2>::seed(x, 0), Dual::<2>::seed(y, 1));
        assert_eq!(exact.value, sample(x, y));
        assert_eq!(first.value, exact.value);
        let h = 1e-5;
        let gradient_at = |x, y| sample(Dual::<2>::seed(x, 0), Dual::<2>::seed(y, 1)).gradient;
        let differences = [
            (sample(x + h, y) - sample(x - h, y)) / (2.0 * h),
            (sample(x, y + h) - sample(x, y - h)) / (2.0 * h),
        ];
        for (i, difference) in differences.iter().enumerate() {
            assert!((exact.gradient[i] - first.gradient[i]).abs() < 1e-13);
            assert!((exact.gradient[i] - difference).abs() < 1e-8, "{i}");
        }
        let (px, mx) = (gradient_at(x + h, y), gradient_at(x - h, y));
        let (py, my) = (gradient_at(x, y + h), gradient_at(x, y - h));
        let second = [
            (px[0] - mx[0]) / (2.0 * h),
            (py[0] - my[0]) / (2.0 * h),
            (py[1] - my[1]) / (2.0 * h),
        ];
        for (i, difference) in second.iter().enumerate() {
            assert!((exact.hessian[i] - difference).abs() < 1e-7, "{i}");
        }
    }
}

#[test]
fn pattern_sees_linear_and_nonlinear_dependence() {
    let v: Vec<Pattern> = (0..4).map(|i| Pattern::seed(0.5, i)).collect();
    let f = v[0] * 3.0 + v[1] * v[2] + v[3].sqrt();
    assert_eq!(f.first, 0b1111);
    assert_eq!(f.second[0], 0);
    assert_eq!(f.second[1], 0b0100);
    assert_eq!(f.second[2], 0b0010);
    assert_eq!(f.second[3], 0b1000);
}

#[test]
fn outside_the_domain_is_nan_not_a_panic() {
    assert!(Scalar::acos(Dual::<1>::seed(1.5, 0)).value.is_nan());
    assert!(Scalar::sqrt(-1.0_f64).is_nan());
}
