//! Small dense systems of equations in place, without allocation.

/// Solves A x = b by elimination with partial pivoting; `a` is row-major and lost, `b` becomes x.
///
/// `None` if A is singular or holds NaN.
pub(super) fn solve(a: &mut [f64], b: &mut [f64]) -> Option<()> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i * n + k].abs().total_cmp(&a[j * n + k].abs()))?;
        if pivot != k {
            for column in k..n {
                a.swap(k * n + column, pivot * n + column);
            }
            b.swap(k, pivot);
        }
        let (upper, lower) = a.split_at_mut((k + 1) * n);
        let row = &upper[k * n..];
        let inverse = 1.0 / row[k];
        if !inverse.is_finite() {
            return None;
        }
        let (known, rest) = b.split_at_mut(k + 1);
        for (below, right) in lower.chunks_exact_mut(n).zip(rest) {
            let factor = below[k] * inverse;
            for column in k + 1..n {
                below[column] -= factor * row[column];
            }
            *right -= factor * known[k];
        }
    }
    for k in (0..n).rev() {
        let row = &a[k * n..(k + 1) * n];
        let sum: f64 = (k + 1..n).map(|column| row[column] * b[column]).sum();
        b[k] = (b[k] - sum) / row[k];
    }
    b.iter().all(|x| x.is_finite()).then_some(())
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn solves_with_a_zero_pivot_and_refuses_singular_systems() {
        let mut a = [0.0, 2.0, 1.0, 1.0, 1.0, 0.0, 2.0, 0.0, 3.0];
        let mut b = [7.0, 3.0, 11.0];
        assert_eq!(solve(&mut a, &mut b), Some(()));
        assert!(
            b.iter()
                .zip([1.0, 2.0, 3.0])
                .all(|(x, e)| (x - e).abs() < 1e-14)
        );
        assert_eq!(solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0]), None);
        assert_eq!(solve(&mut [f64::NAN, 2.0, 2.0, 4.0], &mut [1.0, 1.0]), None);
    }
}
