//! Places in a row.

/// Runs of places: where there is none, one ends and another begins.
pub fn runs<T>(places: impl Iterator<Item = Option<T>>) -> Vec<Vec<T>> {
    let mut runs: Vec<Vec<T>> = Vec::new();
    let mut going_on = false;
    for place in places {
        let known = place.is_some();
        match (place, runs.last_mut()) {
            (Some(place), Some(last)) if going_on => last.push(place),
            (Some(place), _) => runs.push(vec![place]),
            (None, _) => {}
        }
        going_on = known;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_leaves_a_floor_comes_back_as_another_run() {
        let places = [Some(0), Some(1), None, Some(2), None, None];
        assert_eq!(runs(places.into_iter()), [vec![0, 1], vec![2]]);
    }
}
