//! Work in parts that have nothing to do with each other, some at a time.

use crate::process::Failure;
use std::num::NonZero;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Does all parts, so many at a time, and tells what came of them in their order. No part is begun after one has failed; the
/// first failure is told, once those that were begun have ended.
pub fn each<P: Send, T: Send>(
    parts: Vec<P>,
    jobs: usize,
    work: impl Fn(P) -> Result<T, Failure> + Sync,
) -> Result<Vec<T>, Failure> {
    let jobs = jobs.clamp(1, parts.len().max(1));
    let waiting = Mutex::new(parts.into_iter().enumerate());
    let done = Mutex::new((Vec::new(), None));
    let worker = || {
        while done.lock().is_ok_and(|done| done.1.is_none()) {
            // Nobody panics while he holds it.
            let next = waiting.lock().ok().and_then(|mut waiting| waiting.next());
            let Some((index, part)) = next else { return };
            let result = work(part);
            if let Ok(mut done) = done.lock() {
                match result {
                    Ok(value) => done.0.push((index, value)),
                    Err(failure) => _ = done.1.get_or_insert(failure),
                }
            }
        }
    };
    thread::scope(|scope| (0..jobs).for_each(|_| _ = scope.spawn(worker)));
    let (mut values, failure) = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    values.sort_by_key(|&(index, _)| index);
    failure.map_or_else(|| Ok(values.into_iter().map(|(_, value)| value).collect()), Err)
}

/// How many parts that only compute are done at a time.
pub fn processors() -> usize {
    thread::available_parallelism().map_or(1, NonZero::get)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn results_come_in_the_order_of_the_parts() {
        let slow_first = |part: u64| {
            thread::sleep(Duration::from_millis(30 - 10 * part));
            Ok(part)
        };
        for jobs in [0, 1, 2, 7] {
            assert_eq!(each(vec![0, 1, 2], jobs, slow_first).unwrap(), [0, 1, 2], "{jobs} at a time");
        }
    }

    #[test]
    fn nothing_is_begun_after_a_failure() {
        let begun = Mutex::new(Vec::new());
        let second_fails = |part: u32| {
            begun.lock().unwrap().push(part);
            if part == 1 { Err(Failure::Found("the second".into())) } else { Ok(()) }
        };
        assert_eq!(each(vec![0, 1, 2, 3], 1, second_fails).unwrap_err().to_string(), "the second");
        assert_eq!(begun.into_inner().unwrap(), [0, 1]);
    }
}
