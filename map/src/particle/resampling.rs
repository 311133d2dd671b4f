//! Drawing particles anew by their weight (Foot, 5.5), and how many of them.

use super::cloud::Particle;
use super::random::Stream;

/// Draws `count` particles with the low-variance method (Foot, 5.25 - 5.27): one random number, then even steps along the
/// sum of the weights. `drawn` gets them, in the order of their parents and with weight 1; `sink` is told for each which
/// parent it has. Returns how many different parents there are.
///
/// Nothing is drawn when no particle has any weight.
pub(super) fn draw(
    particles: &[Particle],
    count: usize,
    stream: &mut Stream,
    drawn: &mut Vec<Particle>,
    mut sink: impl FnMut(usize),
) -> usize {
    drawn.clear();
    let total: f64 = particles.iter().map(|particle| f64::from(particle.weight)).sum();
    if !(total > 0.0 && total.is_finite()) {
        return 0;
    }
    let spacing = total / count as f64;
    let mut mark = spacing * (1.0 - stream.unit_f64());
    let (mut sum, mut parents) = (0.0, 0);
    for (index, particle) in particles.iter().enumerate() {
        sum += f64::from(particle.weight);
        let before = drawn.len();
        while mark <= sum && drawn.len() < count {
            drawn.push(Particle { weight: 1.0, ..*particle });
            sink(index);
            mark += spacing;
        }
        parents += usize::from(drawn.len() > before);
    }
    // The last mark lies at the very end of the sum, and rounding may put it beyond.
    if let Some(last) = particles.iter().rposition(|particle| particle.weight > 0.0) {
        while drawn.len() < count {
            drawn.push(Particle { weight: 1.0, ..particles[last] });
            sink(last);
        }
    }
    parents
}

/// How many particles a cloud needs that occupies `bins` bins, so that with 99 % the error (Kullback-Leibler divergence)
/// stays below `error` (Fox, "Adapting the sample size in particle filters through KLD-sampling", Int. J. Robotics Research
/// 22, 2003, equation 7: the approximation of Wilson and Hilferty).
pub(super) fn needed(bins: usize, error: f32) -> usize {
    /// The 99 % point of the normal distribution.
    const Z: f64 = 2.326;
    if bins < 2 {
        return 1;
    }
    let freedoms = (bins - 1) as f64;
    let part = 2.0 / (9.0 * freedoms);
    let cube = (1.0 - part + part.sqrt() * Z).powi(3);
    (freedoms / (2.0 * f64::from(error)) * cube).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::super::random::Purpose;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn each_is_drawn_as_often_as_its_weight_says_up_to_one(
            weights in proptest::collection::vec(prop_oneof![Just(0.0_f32), 1e-3_f32..1.0, 1.0_f32..1e4], 1..200),
            count in 1_usize..2_000,
            seed in any::<u64>(),
        ) {
            let total: f64 = weights.iter().map(|&weight| f64::from(weight)).sum();
            let particles: Vec<_> =
                weights.iter().map(|&weight| Particle { weight, ..Particle::default() }).collect();
            let (mut drawn, mut times) = (Vec::new(), vec![0_u32; weights.len()]);
            let mut stream = Stream::new(seed, Purpose::Draw, 0, 0);
            let parents = draw(&particles, count, &mut stream, &mut drawn, |parent| times[parent] += 1);
            if total == 0.0 {
                prop_assert!(drawn.is_empty() && parents == 0);
                return Ok(());
            }
            prop_assert_eq!(drawn.len(), count);
            prop_assert_eq!(parents, times.iter().filter(|&&times| times > 0).count());
            for (&times, &weight) in times.iter().zip(&weights) {
                let expected = f64::from(weight) / total * count as f64;
                prop_assert!((f64::from(times) - expected).abs() < 1.0 + 1e-6 * expected, "{} {}", times, expected);
                prop_assert!(weight > 0.0 || times == 0);
            }
        }
    }

    #[test]
    fn the_bound_is_that_of_the_chi_square_distribution() {
        // Half the 99 % point of chi-square over the error: 16.81 for 6 and 135.81 for 100 degrees of freedom.
        assert!((needed(7, 0.05) as f64 - 168.1).abs() < 2.0, "{}", needed(7, 0.05));
        assert!((needed(101, 0.05) as f64 - 1_358.1).abs() < 3.0, "{}", needed(101, 0.05));
        assert_eq!(needed(1, 0.05), 1);
    }
}
