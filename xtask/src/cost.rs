//! Instructions, told for each sample or each step of a filter.

/// Instructions over a number of samples or steps.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// How many samples or steps.
    pub count: u64,
    /// Over all of them.
    pub instructions: u64,
}

impl Cost {
    /// Instructions for each.
    pub fn mean(self) -> f64 {
        self.instructions as f64 / self.count.max(1) as f64
    }

    /// Both together.
    pub fn and(self, other: Self) -> Self {
        Self { count: self.count + other.count, instructions: self.instructions + other.instructions }
    }
}

/// Costs of the default and of the documented setting in the same columns, and their ratios, as lines for people.
pub fn table(title: &str, columns: &[(&str, Cost, Cost)]) -> String {
    let row = |name: &str, cells: &dyn Fn(&(&str, Cost, Cost)) -> String| {
        let cells: String = columns.iter().map(|column| format!(" {:>12}", cells(column))).collect();
        format!("  {name:<12}{cells}\n")
    };
    let mut text = format!("{title}\n");
    text += &row("", &|(name, ..)| (*name).to_owned());
    text += &row("default", &|(_, default, _)| format!("{:.0}", default.mean()));
    text += &row("documented", &|(_, _, documented)| format!("{:.0}", documented.mean()));
    text += &row("ratio", &|(_, default, documented)| format!("{:.3}", default.mean() / documented.mean()));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(count: u64, instructions: u64) -> Cost {
        Cost { count, instructions }
    }

    #[test]
    fn means_are_weighted() {
        assert_eq!(cost(1, 100).and(cost(3, 60)).mean(), 40.0);
        assert_eq!(Cost::default().mean(), 0.0);
    }

    #[test]
    fn the_ratio_stands_under_its_column() {
        let text = table("title", &[("one", cost(1, 50), cost(1, 100)), ("two", cost(2, 200), cost(1, 400))]);
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
        assert_eq!(lines[1], ["one", "two"]);
        assert_eq!(lines[2], ["default", "50", "100"]);
        assert_eq!(lines[4], ["ratio", "0.500", "0.250"]);
    }
}
