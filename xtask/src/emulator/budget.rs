//! What every part of the shoe may cost, and what it does cost.

use crate::cost::Cost;
use crate::in_root;
use crate::process::Failure;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The budgets: instructions that a part may take on average.
const FILE: &str = "firmware/instructions.toml";

/// Parts that together are the whole, and its name in the budget.
const WHOLE: (&str, &str) = ("second-", "second-of-walking");

/// Instructions by the name of the part.
pub type Budgets = BTreeMap<String, u64>;

/// The budgets that are kept.
pub fn read() -> Result<Budgets, Failure> {
    let path = in_root(FILE);
    let text = std::fs::read_to_string(&path).map_err(|source| Failure::File { path: FILE.into(), source })?;
    toml::from_str(&text).map_err(|error| Failure::Found(format!("{FILE}: {error}")))
}

/// A part as the emulator tells it: name, how often, instructions over all, the most of once.
fn part(line: &str) -> Option<(&str, Cost, u64)> {
    let mut words = line.split(' ');
    let name = words.next()?;
    let mut number = || words.next()?.parse().ok();
    Some((name, Cost { count: number()?, instructions: number()? }, number()?))
}

/// The table for people, and a line for each part that is over its budget or has none.
pub fn table(lines: &[&str], budgets: &Budgets) -> Result<(String, Vec<String>), Failure> {
    let mut parts: Vec<(&str, Cost, Option<u64>)> = Vec::new();
    for line in lines {
        let told = part(line).ok_or_else(|| Failure::Found(format!("the emulator told no cost: `{line}`")))?;
        parts.push((told.0, told.1, Some(told.2)));
    }
    let seconds = parts.iter().filter(|(name, ..)| name.starts_with(WHOLE.0)).map(|(_, cost, _)| *cost);
    let whole = seconds.reduce(|a, b| Cost { count: a.count, instructions: a.instructions + b.instructions });
    parts.extend(whole.map(|whole| (WHOLE.1, whole, None)));

    let mut text = String::from("\ninstructions at 2 kHz (Cortex-M4F)         mean         most       budget\n");
    let mut over = Vec::new();
    for (name, cost, most) in parts {
        let budget = budgets.get(name);
        let cell = |value: Option<u64>| value.map_or(String::new(), |value| value.to_string());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {name:<32}{:>12.0} {:>12} {:>12}", cost.mean(), cell(most), cell(budget.copied()));
        match budget {
            Some(&budget) if cost.mean() > budget as f64 => {
                over.push(format!("{name} takes {:.0} instructions, {FILE} allows {budget}", cost.mean()));
            }
            Some(_) => {}
            None => over.push(format!("{name} has no budget in {FILE}")),
        }
    }
    Ok((text, over))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budgets(entries: &[(&str, u64)]) -> Budgets {
        entries.iter().map(|&(name, budget)| (name.to_owned(), budget)).collect()
    }

    #[test]
    fn what_is_over_its_budget_or_has_none_is_named() {
        let budgets = budgets(&[("predict", 100), ("second-a", 50), ("second-b", 50), ("second-of-walking", 70)]);
        let lines = ["predict 10 1010 200", "second-a 2 80 60", "second-b 2 60 40", "wire 1 5 5"];
        let (text, over) = table(&lines, &budgets).unwrap();
        assert_eq!(
            over,
            [format!("predict takes 101 instructions, {FILE} allows 100"), format!("wire has no budget in {FILE}"),]
        );
        let whole: Vec<&str> = text.lines().last().unwrap().split_whitespace().collect();
        assert_eq!(whole, ["second-of-walking", "70", "70"]);
    }

    #[test]
    fn a_line_that_is_no_cost_is_refused() {
        assert!(table(&["predict ten"], &budgets(&[])).is_err());
    }

    #[test]
    fn the_budgets_that_are_kept_can_be_read() {
        assert!(read().unwrap().get(WHOLE.1).is_some_and(|&budget| budget <= 20_000_000));
    }
}
