//! Random numbers that are the same on every machine.
//!
//! PCG from its library; the normal distribution is made here because the library's takes its logarithm from the
//! platform as soon as any other crate switches `num-traits/std` on, and then the last bit differs between machines.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::Rng;

/// A source of random numbers for one purpose.
#[derive(Clone, Debug)]
pub struct Random {
    source: Pcg64Mcg,
    spare: Option<f64>,
}

/// What a stream of random numbers is for; each purpose has its own, so that one does not shift another.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// How the person walks.
    Gait,
    /// What the unit's biases and scale factors are.
    Unit,
    /// Noise of the accelerometer.
    AccelNoise,
    /// How the standing foot rocks.
    Rocking,
    /// Noise of the gyroscope.
    GyroNoise,
    /// What a simulated line does to what the laptop writes.
    ToShoe,
    /// What it does to what the shoe writes.
    FromShoe,
    /// Steps that nobody walked.
    MadeUpSteps,
    /// How wide the rooms of a made-up building are.
    Rooms,
    /// What is wrong with the steps of a phone.
    PhoneSteps,
    /// Where somebody goes in a building.
    Route,
}

impl Random {
    /// The numbers for `purpose` under `seed`.
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        // The generator takes an odd state: the purpose keeps clear of the lowest bit, the seed of the purpose.
        let state = (u128::from(seed) << 64) + ((purpose as u128) << 1) + 1;
        let mut source = Pcg64Mcg::new(state);
        // Neighbouring states yield much the same at first; a few turns part them.
        for _ in 0..16 {
            source.next_u64();
        }
        Self { source, spare: None }
    }

    /// Even over 0 <= x < 1.
    pub fn unit(&mut self) -> f64 {
        (self.source.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64)
    }

    /// Even over -1 <= x < 1.
    pub fn symmetric(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Normal with mean 0 and variance 1 (Marsaglia's polar method).
    pub fn normal(&mut self) -> f64 {
        if let Some(spare) = self.spare.take() {
            return spare;
        }
        loop {
            let (x, y) = (self.symmetric(), self.symmetric());
            let square = x * x + y * y;
            if square < 1.0 && square > 0.0 {
                let factor = libm::sqrt(-2.0 * libm::log(square) / square);
                self.spare = Some(y * factor);
                return x * factor;
            }
        }
    }

    /// Three independent [`Random::normal`].
    pub fn normals(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.normal())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_has_mean_zero_and_variance_one() {
        let mut random = Random::new(1, Purpose::Gait);
        let n = 100_000;
        let (mut sum, mut squares, mut beyond) = (0.0, 0.0, 0);
        for _ in 0..n {
            let x = random.normal();
            sum += x;
            squares += x * x;
            beyond += u32::from(x.abs() > 2.0);
        }
        // Four standard errors: 1/sqrt(n), sqrt(2/n), and of the share beyond 2 sigma (4.55 %).
        assert!((sum / f64::from(n)).abs() < 0.013);
        assert!((squares / f64::from(n) - 1.0).abs() < 0.018);
        assert!((f64::from(beyond) / f64::from(n) - 0.0455).abs() < 0.0027);
    }

    #[test]
    fn seeds_and_purposes_give_different_numbers() {
        let purposes = [Purpose::Gait, Purpose::Unit, Purpose::AccelNoise, Purpose::GyroNoise, Purpose::Rocking];
        let mut first = Vec::new();
        for seed in (0..200).chain([u64::MAX - 1, u64::MAX]) {
            first.extend(purposes.map(|purpose| Random::new(seed, purpose).unit()));
        }
        let mean = first.iter().sum::<f64>() / first.len() as f64;
        // Four standard errors of 1010 even numbers.
        assert!((mean - 0.5).abs() < 0.037, "{mean}");
        first.sort_by(f64::total_cmp);
        // The closest two of 1010 even numbers are 1e-6 apart on average; equal ones are a fault.
        assert!(first.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
