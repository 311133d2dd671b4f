//! Points, segments and outlines of a plan. **Units:** m; **Frame:** building.

/// A point.
pub type Point = [f64; 2];
/// From one point to another.
pub type Segment = [Point; 2];
/// Corners in order; the last is joined to the first.
pub type Outline = Vec<Point>;

/// Distance of two points.
pub fn distance(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// From a point to another. **Units:** rad; counted from x over y.
pub fn direction(from: Point, to: Point) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

/// The same angle within half a turn. **Units:** rad.
pub fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::PI;
    // What is within it keeps its bits.
    if angle.abs() <= PI { angle } else { (angle + PI).rem_euclid(2.0 * PI) - PI }
}

/// Length of a segment.
pub fn length(segment: &Segment) -> f64 {
    distance(segment[0], segment[1])
}

/// A point on the way from `a` to `b`: at 0 and 1 the ends.
pub fn between(a: Point, b: Point, part: f64) -> Point {
    [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])]
}

/// The sides of an outline.
pub fn sides(outline: &[Point]) -> impl Iterator<Item = Segment> + '_ {
    (0..outline.len()).map(|i| [outline[i], outline[(i + 1) % outline.len()]])
}

/// Area of an outline, positive when its corners go round counter-clockwise. **Units:** m².
pub fn area(outline: &[Point]) -> f64 {
    sides(outline).map(|[a, b]| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
}

/// Centre of gravity of an outline; of its corners when it has no area.
pub fn centre(outline: &[Point]) -> Point {
    let Some(&origin) = outline.first() else { return [0.0; 2] };
    let (mut sum, mut twice) = ([0.0; 2], 0.0);
    for [a, b] in sides(outline) {
        let (a, b) = ([a[0] - origin[0], a[1] - origin[1]], [b[0] - origin[0], b[1] - origin[1]]);
        let cross = a[0] * b[1] - a[1] * b[0];
        twice += cross;
        sum = [sum[0] + (a[0] + b[0]) * cross, sum[1] + (a[1] + b[1]) * cross];
    }
    if twice.abs() < 1e-9 {
        let count = outline.len() as f64;
        return [0, 1].map(|axis| outline.iter().map(|point| point[axis]).sum::<f64>() / count);
    }
    [0, 1].map(|axis| origin[axis] + sum[axis] / (3.0 * twice))
}

/// Whether an outline holds a point: a line from it crosses the border an odd number of times.
pub fn contains(outline: &[Point], [x, y]: Point) -> bool {
    let crossed = |[a, b]: &Segment| (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0];
    sides(outline).filter(crossed).count() % 2 == 1
}

/// The point of a segment that is nearest to `point`.
pub fn nearest(segment: &Segment, point: Point) -> Point {
    let [a, b] = *segment;
    let along = [b[0] - a[0], b[1] - a[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let to = [point[0] - a[0], point[1] - a[1]];
    let part = if squared > 0.0 { ((along[0] * to[0] + along[1] * to[1]) / squared).clamp(0.0, 1.0) } else { 0.0 };
    between(a, b, part)
}

/// Where two segments cross, as parts of both; nothing when they are parallel or do not meet.
pub fn crossing(a: &Segment, b: &Segment) -> Option<(f64, f64)> {
    let along_a = [a[1][0] - a[0][0], a[1][1] - a[0][1]];
    let along_b = [b[1][0] - b[0][0], b[1][1] - b[0][1]];
    let cross = along_a[0] * along_b[1] - along_a[1] * along_b[0];
    if cross == 0.0 {
        return None;
    }
    let to = [b[0][0] - a[0][0], b[0][1] - a[0][1]];
    let part_a = (to[0] * along_b[1] - to[1] * along_b[0]) / cross;
    let part_b = (to[0] * along_a[1] - to[1] * along_a[0]) / cross;
    ((0.0..=1.0).contains(&part_a) && (0.0..=1.0).contains(&part_b)).then_some((part_a, part_b))
}

/// What is left of a segment outside of an outline.
pub fn outside_of(segment: &Segment, outline: &[Point]) -> Vec<Segment> {
    let mut cuts: Vec<f64> = sides(outline).filter_map(|side| crossing(segment, &side)).map(|(part, _)| part).collect();
    cuts.extend([0.0, 1.0]);
    cuts.sort_by(f64::total_cmp);
    let [a, b] = *segment;
    let pieces = cuts.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9);
    let kept = pieces.filter(|pair| !contains(outline, between(a, b, (pair[0] + pair[1]) / 2.0)));
    let mut left: Vec<Segment> = Vec::new();
    for pair in kept {
        let piece = [between(a, b, pair[0]), between(a, b, pair[1])];
        match left.last_mut() {
            Some(last) if distance(last[1], piece[0]) < 1e-9 => last[1] = piece[1],
            _ => left.push(piece),
        }
    }
    left
}

/// Lower left and upper right corner of all points; nothing without points.
pub fn bounds(points: impl IntoIterator<Item = Point>) -> Option<[Point; 2]> {
    points.into_iter().fold(None, |bounds, point| {
        let [low, high] = bounds.unwrap_or([point; 2]);
        Some([[low[0].min(point[0]), low[1].min(point[1])], [high[0].max(point[0]), high[1].max(point[1])]])
    })
}

/// A line with the points only at which it bends: what is left out lies within `off` of the rest. The ends stay.
///
/// # Source
/// Douglas and Peucker (1973).
pub fn simplified(points: &[Point], off: f64) -> Vec<Point> {
    fn inner(points: &[Point], off: f64, found: &mut Vec<Point>) {
        let &[first, .., last] = points else { return };
        let far = points.iter().map(|&point| distance(nearest(&[first, last], point), point));
        let farthest = far.enumerate().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
        if let Some((at, _)) = farthest.filter(|(_, far)| *far > off) {
            inner(&points[..=at], off, found);
            found.push(points[at]);
            inner(&points[at..], off, found);
        }
    }
    let mut found: Vec<Point> = points.first().copied().into_iter().collect();
    inner(points, off, &mut found);
    if points.len() > 1 {
        found.extend(points.last());
    }
    found
}

/// The line along the middle of a long outline, a door for instance: from the middle of one short end to the other.
pub fn middle_line(outline: &[Point]) -> Option<Segment> {
    let middle = centre(outline);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for point in outline {
        let [x, y] = [point[0] - middle[0], point[1] - middle[1]];
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let along = [angle.cos(), angle.sin()];
    let places = outline.iter().map(|point| (point[0] - middle[0]) * along[0] + (point[1] - middle[1]) * along[1]);
    let (low, high) =
        places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
    let at = |place: f64| [middle[0] + place * along[0], middle[1] + place * along[1]];
    (high > low).then(|| [at(low), at(high)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SQUARE: [Point; 4] = [[1.0, 1.0], [3.0, 1.0], [3.0, 2.0], [1.0, 2.0]];

    #[test]
    fn an_outline_has_area_centre_and_middle() {
        assert_eq!((area(&SQUARE), centre(&SQUARE)), (2.0, [2.0, 1.5]));
        assert_eq!(area(&[[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]), -0.5);
        assert_eq!(centre(&[[0.0, 0.0], [2.0, 0.0]]), [1.0, 0.0]);
        let line = middle_line(&SQUARE).unwrap();
        assert!(distance(line[0], [1.0, 1.5]) < 1e-12 && distance(line[1], [3.0, 1.5]) < 1e-12);
    }

    #[test]
    fn a_wall_is_cut_by_a_door() {
        let left = outside_of(&[[0.0, 1.5], [5.0, 1.5]], &SQUARE);
        assert_eq!(left, [[[0.0, 1.5], [1.0, 1.5]], [[3.0, 1.5], [5.0, 1.5]]]);
        assert_eq!(outside_of(&[[1.5, 1.5], [2.0, 1.5]], &SQUARE), Vec::<Segment>::new());
        assert_eq!(outside_of(&[[0.0, 5.0], [5.0, 5.0]], &SQUARE).len(), 1);
    }

    proptest! {
        #[test]
        fn what_is_cut_and_what_is_left_make_the_whole(
            ends in proptest::array::uniform2(proptest::array::uniform2(0.0_f64..4.0)),
            corners in proptest::collection::vec(proptest::array::uniform2(0.0_f64..4.0), 3..6),
        ) {
            let left = outside_of(&ends, &corners);
            prop_assert!(left.iter().map(length).sum::<f64>() <= length(&ends) + 1e-9);
            for piece in &left {
                prop_assert!(!contains(&corners, between(piece[0], piece[1], 0.37)) || length(piece) < 1e-6
                    || sides(&corners).any(|side| crossing(piece, &side).is_some()));
            }
        }
    }
}
