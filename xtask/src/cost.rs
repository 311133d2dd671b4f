//! Instructions over a walk, told for each sample.

/// Instructions over the samples of one phase of the walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// How many samples.
    pub samples: u64,
    /// Over all of them.
    pub instructions: u64,
}

/// What a setting costs while the foot moves and while it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phases {
    /// The filter predicts only.
    pub swinging: Cost,
    /// The filter predicts and is corrected.
    pub standing: Cost,
}

impl Cost {
    /// Instructions for each sample.
    pub fn mean(self) -> f64 {
        self.instructions as f64 / self.samples.max(1) as f64
    }
}

impl Phases {
    /// Of the whole walk.
    pub fn both(self) -> Cost {
        let Self { swinging, standing } = self;
        Cost {
            samples: swinging.samples + standing.samples,
            instructions: swinging.instructions + standing.instructions,
        }
    }

    /// For each sample, over those of the other: swinging, standing, both.
    fn shares_of(self, other: Self) -> [f64; 3] {
        let means = |phases: Self| [phases.swinging, phases.standing, phases.both()].map(Cost::mean);
        let (one, other) = (means(self), means(other));
        [0, 1, 2].map(|index| one[index] / other[index])
    }

    /// While the foot moves, over that of the other.
    pub fn share_of_predictions(self, other: Self) -> f64 {
        self.shares_of(other)[0]
    }
}

/// Two settings and their ratio, as lines for people.
pub fn table(default: Phases, documented: Phases) -> String {
    let mut text = format!("{:<12} {:>10} {:>10} {:>10}\n", "setting", "swinging", "standing", "mean");
    for (name, phases) in [("default", default), ("documented", documented)] {
        let [a, b, c] = [phases.swinging, phases.standing, phases.both()].map(Cost::mean);
        text += &format!("{name:<12} {a:>10.0} {b:>10.0} {c:>10.0}\n");
    }
    let [a, b, c] = default.shares_of(documented);
    text + &format!("{:<12} {a:>10.3} {b:>10.3} {c:>10.3}\n", "ratio")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn phases(swinging: (u64, u64), standing: (u64, u64)) -> Phases {
        let cost = |(samples, instructions)| Cost { samples, instructions };
        Phases { swinging: cost(swinging), standing: cost(standing) }
    }

    #[test]
    fn means_are_weighted_by_samples() {
        assert_eq!(phases((1, 100), (3, 60)).both().mean(), 40.0);
        assert_eq!(Cost::default().mean(), 0.0);
    }

    #[test]
    fn the_ratio_stands_under_its_columns() {
        let text = table(phases((1, 50), (1, 200)), phases((1, 100), (1, 400)));
        let ratio: Vec<&str> = text.lines().last().map(|line| line.split_whitespace().collect()).unwrap_or_default();
        assert_eq!(ratio, ["ratio", "0.500", "0.500", "0.500"]);
        assert_eq!(phases((1, 50), (1, 0)).share_of_predictions(phases((1, 100), (1, 1))), 0.5);
    }
}
