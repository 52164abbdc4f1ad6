//! Points, weights and D against the 60-digit oracle, and against what they must differentiate
//! exactly.

use serde_json::Value;
use stillpoint_shared::lgr::{self, LgrError};

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|number| number.as_str().unwrap().parse().unwrap())
        .collect()
}

fn assert_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    for (index, (found, expected)) in found.iter().zip(expected).enumerate() {
        let miss = (found - expected).abs();
        assert!(
            miss <= tolerance,
            "{what}[{index}]: {found} instead of {expected}, off by {miss:e}"
        );
    }
}

#[test]
fn agrees_with_the_oracle() {
    let oracle: Value = serde_json::from_str(include_str!("data/lgr_oracle.json")).unwrap();
    let sets = oracle["sets"].as_array().unwrap();
    assert_eq!(sets.len(), 8);
    for set in sets {
        let points = set["points"].as_u64().unwrap() as usize;
        let mut nodes = vec![0.0; points + 1];
        lgr::support_nodes(&mut nodes).unwrap();
        assert_close(
            &format!("nodes of {points}"),
            &nodes,
            &numbers(&set["nodes"]),
            1e-14,
        );

        let mut weights = vec![0.0; points];
        lgr::lgr_weights(&nodes[..points], &mut weights).unwrap();
        assert_close(
            &format!("weights of {points}"),
            &weights,
            &numbers(&set["quadrature_weights"]),
            1e-14,
        );

        let mut barycentric = vec![0.0; points + 1];
        lgr::barycentric_weights(&nodes, &mut barycentric).unwrap();
        let largest = barycentric
            .iter()
            .copied()
            .max_by(|a, b| a.abs().total_cmp(&b.abs()))
            .unwrap();
        let expected = numbers(&set["barycentric_weights"]);
        let sign = expected.iter().find(|weight| weight.abs() == 1.0).unwrap() * largest.signum();
        let scaled: Vec<f64> = barycentric
            .iter()
            .map(|weight| sign * weight / largest.abs())
            .collect();
        assert_close(
            &format!("barycentric weights of {points}"),
            &scaled,
            &expected,
            1e-13,
        );

        let mut matrix = vec![0.0; points * (points + 1)];
        lgr::differentiation_matrix(&nodes, &barycentric, &mut matrix).unwrap();
        let expected: Vec<f64> = set["differentiation"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(numbers)
            .collect();
        let largest = expected
            .iter()
            .fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
        assert_close(
            &format!("D of {points}"),
            &matrix,
            &expected,
            1e-13 * largest,
        );
    }
}

#[test]
fn differentiates_the_highest_power_for_every_number_of_points() {
    for points in 2..=32 {
        let mut nodes = vec![0.0; points + 1];
        lgr::support_nodes(&mut nodes).unwrap();
        assert!(nodes.is_sorted_by(|a, b| a < b), "{points}: {nodes:?}");
        let mut weights = vec![0.0; points + 1];
        lgr::barycentric_weights(&nodes, &mut weights).unwrap();
        let mut row = vec![0.0; points + 1];
        for i in 0..=points {
            lgr::differentiation_row(&nodes, &weights, i, &mut row).unwrap();
            let found: f64 = row
                .iter()
                .zip(&nodes)
                .map(|(entry, node)| entry * node.powi(points as i32))
                .sum();
            let expected = points as f64 * nodes[i].powi(points as i32 - 1);
            assert!(
                (found - expected).abs() < 1e-11 * (points * points) as f64,
                "{points}, row {i}: {found} {expected}"
            );
        }
    }
}

#[test]
fn integrates_exactly_to_degree_2n_minus_2() {
    for points in 2..=32 {
        let (mut nodes, mut weights) = (vec![0.0; points], vec![0.0; points]);
        lgr::lgr_nodes(&mut nodes).unwrap();
        lgr::lgr_weights(&nodes, &mut weights).unwrap();
        let degree = 2 * points as i32 - 2;
        let found: f64 = nodes
            .iter()
            .zip(&weights)
            .map(|(node, weight)| weight * node.powi(degree))
            .sum();
        assert!(
            (found - 2.0 / f64::from(degree + 1)).abs() < 1e-13,
            "{points}: {found}"
        );
    }
}

#[test]
fn wrong_lengths_are_named() {
    assert_eq!(
        lgr::lgr_nodes(&mut [0.0]),
        Err(LgrError::TooFewPoints {
            points: 1,
            least: 2
        })
    );
    assert_eq!(
        lgr::support_nodes(&mut []),
        Err(LgrError::TooFewPoints {
            points: 0,
            least: 2
        })
    );
    assert_eq!(
        lgr::lgr_weights(&[-1.0, 0.3], &mut [0.0]),
        Err(LgrError::Length {
            found: 1,
            expected: 2
        })
    );
    assert_eq!(
        lgr::barycentric_weights(&[-1.0], &mut [0.0; 3]),
        Err(LgrError::Length {
            found: 3,
            expected: 1
        })
    );
    let (nodes, weights) = ([-1.0, 0.0, 1.0], [0.5, -1.0, 0.5]);
    assert_eq!(
        lgr::differentiation_row(&nodes, &weights, 3, &mut [0.0; 3]),
        Err(LgrError::Row { row: 3, rows: 3 })
    );
    assert_eq!(
        lgr::differentiation_matrix(&nodes, &weights, &mut [0.0; 9]),
        Err(LgrError::Length {
            found: 9,
            expected: 6
        })
    );
}
