//! Fewer points for the same line on paper.

/// A point in the units of the picture.
pub(super) type Point = [f64; 2];

/// Cuts a line to `low..=high` in x and splits it where a value is missing.
pub(super) fn runs(points: impl Iterator<Item = Point>, low: f64, high: f64) -> Vec<Vec<Point>> {
    let mut runs: Vec<Vec<Point>> = vec![vec![]];
    let mut last: Option<Point> = None;
    for point in points {
        let run_is_open = |runs: &Vec<Vec<Point>>| runs.last().is_some_and(|r| !r.is_empty());
        if !(point[0].is_finite() && point[1].is_finite()) {
            if run_is_open(&runs) {
                runs.push(vec![]);
            }
            last = None;
            continue;
        }
        let current = runs.len() - 1;
        let run = &mut runs[current];
        match last {
            Some(a) if a[0] < low && point[0] > low => run.push(between(a, point, low)),
            _ => {}
        }
        if (low..=high).contains(&point[0]) {
            run.push(point);
        } else if let Some(a) = last
            && a[0] < high
            && point[0] > high
        {
            run.push(between(a, point, high));
        }
        last = Some(point);
    }
    runs.retain(|r| !r.is_empty());
    runs
}

fn between(a: Point, b: Point, x: f64) -> Point {
    [x, a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0])]
}

/// Keeps of every column of width `column` the first, lowest, highest and last point: what a screen would show.
pub(super) fn columns(points: &[Point], column: f64) -> Vec<Point> {
    let key = |p: &Point| (p[0] / column).floor() as i64;
    let mut kept = Vec::new();
    for bin in points.chunk_by(|a, b| key(a) == key(b)) {
        let extreme = |pick: fn(f64, f64) -> bool| {
            let mut best = 0;
            for (i, p) in bin.iter().enumerate() {
                if pick(p[1], bin[best][1]) {
                    best = i;
                }
            }
            best
        };
        let mut chosen = [
            0,
            extreme(|a, b| a < b),
            extreme(|a, b| a > b),
            bin.len() - 1,
        ];
        chosen.sort_unstable();
        let mut last = None;
        for i in chosen {
            if last != Some(i) {
                kept.push(bin[i]);
            }
            last = Some(i);
        }
    }
    kept
}

/// Drops points that lie within `tolerance` of the line between their neighbours (Ramer, Douglas, Peucker).
pub(super) fn straighten(points: &[Point], tolerance: f64) -> Vec<Point> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((a, b)) = open.pop() {
        let mut farthest = (tolerance, None);
        for i in a + 1..b {
            let distance = distance(points[i], points[a], points[b]);
            if distance > farthest.0 {
                farthest = (distance, Some(i));
            }
        }
        if let Some(i) = farthest.1 {
            keep[i] = true;
            open.extend([(a, i), (i, b)]);
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(p, _)| *p).collect()
}

/// Distance from a point to a segment.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let (d, r) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length2 = d[0] * d[0] + d[1] * d[1];
    let along = if length2 > 0.0 {
        ((r[0] * d[0] + r[1] * d[1]) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (r[0] - along * d[0]).hypot(r[1] - along * d[1])
}

#[cfg(test)]
mod tests {
    use super::{Point, columns, distance, runs, straighten};

    fn wave(count: usize) -> Vec<Point> {
        (0..count)
            .map(|i| i as f64 / count as f64 * 400.0)
            .map(|x| [x, 80.0 * (x / 9.0).sin()])
            .collect()
    }

    #[test]
    fn few_points_show_the_same_line() {
        let full = wave(100_000);
        let thin = straighten(&columns(&full, 1.0), 0.1);
        assert!(thin.len() < 1000, "{}", thin.len());
        for p in full.iter().step_by(97) {
            let next = thin
                .partition_point(|q| q[0] < p[0])
                .clamp(1, thin.len() - 1);
            let near = (next.saturating_sub(2)..(next + 2).min(thin.len() - 1))
                .map(|i| distance(*p, thin[i], thin[i + 1]))
                .fold(f64::INFINITY, f64::min);
            assert!(near < 0.7, "{p:?} {near}");
        }
    }

    #[test]
    fn extremes_survive() {
        let mut line = wave(50_000);
        line[12_345][1] = 500.0;
        let thin = straighten(&columns(&line, 1.0), 0.1);
        assert!(thin.iter().any(|p| p[1] == 500.0));
    }

    #[test]
    fn windows_cut_and_gaps_split() {
        let line = [
            [0.0, 0.0],
            [1.0, 1.0],
            [2.0, f64::NAN],
            [3.0, 3.0],
            [5.0, 5.0],
        ];
        let found = runs(line.into_iter(), 0.5, 4.0);
        assert_eq!(
            found,
            [vec![[0.5, 0.5], [1.0, 1.0]], vec![[3.0, 3.0], [4.0, 4.0]]]
        );
        assert_eq!(
            runs([[0.0, 0.0], [9.0, 9.0]].into_iter(), 4.0, 5.0),
            [[[4.0, 4.0], [5.0, 5.0]]]
        );
        assert!(runs([[f64::NAN, 0.0]].into_iter(), 0.0, 1.0).is_empty());
    }
}
