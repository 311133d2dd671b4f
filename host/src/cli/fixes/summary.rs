//! What became of positions, and what they told: for people, for programs, and as a path in a file.

use super::Incoming;
use crate::cli::Error;
use crate::cli::table::Table;
use crate::export::file;
use crate::fixes::Method;
use serde_json::{Map, Value as Json, json};
use std::fmt::Write;
use std::path::Path;

/// The path that steps and positions give together.
const PATH: &str = "fixes.csv";

impl Incoming {
    /// Writes the path, if there is a folder for it, and returns what there is to tell.
    pub fn finish(mut self, folder: Option<&Path>) -> Result<String, Error> {
        let Some(folder) = folder else { return Ok(self.summary()) };
        file::folder(folder)?;
        let mut text = String::from("kind,time_s,x_m,y_m,sigma_m\n");
        let mut row = |kind: &str, time: f64, [x, y]: [f64; 2], sigma: Option<f64>| {
            let sigma = sigma.map_or_else(String::new, |sigma| format!("{sigma:.3}"));
            let _ = writeln!(text, "{kind},{time:.3},{x:.3},{y:.3},{sigma}");
        };
        for said in self.fusion.said() {
            row("said", said.time.as_seconds(), said.place, Some(said.sigma_m()));
        }
        for settled in self.fusion.smoother_mut().take_settled() {
            row("corrected", settled.time.as_seconds(), settled.place, None);
        }
        for open in self.fusion.smoother().open_part() {
            row("corrected", open.time.as_seconds(), open.place, Some(open.sigma_m()));
        }
        file::write(&folder.join(PATH), text.as_bytes())?;
        Ok(format!("{}Written to {}: {PATH}\n", self.summary(), folder.display()))
    }

    /// What became of the fixes, and what they told of the steps.
    fn summary(&self) -> String {
        let mut table = Table::new("positions of", &["all", "taken", "doubted", "too late", "refused", "because"]);
        for (source, tally) in self.fusion.intake().tallies() {
            let refused: usize = tally.refused.values().sum();
            let why: Vec<_> = tally.refused.iter().map(|(why, count)| format!("{why} {count}")).collect();
            let counts = [tally.count(), tally.taken, tally.doubted, tally.out_of_time, refused];
            let mut cells: Vec<_> = counts.iter().map(usize::to_string).collect();
            cells.push(why.join(", "));
            table.row(source.to_string(), cells);
        }
        let mut text = table.text();
        if self.fusion.intake().spoilt() > 0 {
            let _ = writeln!(text, "{} lines were no fixes", self.fusion.intake().spoilt());
        }
        if self.fusion.waiting() > 0 {
            let _ = writeln!(text, "{} came after the last step", self.fusion.waiting());
        }
        let smoother = self.fusion.smoother();
        if let (Some(estimate), Some(found)) = (smoother.estimate(), smoother.calibration()) {
            let [x, y] = estimate.place;
            let _ = writeln!(
                text,
                "at the end ({x:.2}, {y:.2}) m within {:.2} m; heading {:.0} deg within {:.0}, step scale {:.3} within {:.3}, \
                 heading drift {:.2} deg/min within {:.2}",
                estimate.sigma_m(),
                found.heading.0.to_degrees().rem_euclid(360.0),
                found.heading.1.to_degrees(),
                found.scale.0,
                found.scale.1,
                found.drift.0.to_degrees() * 60.0,
                found.drift.1.to_degrees() * 60.0
            );
        }
        text
    }

    /// What became of the fixes and what is known now, for programs.
    pub fn counts(&self) -> Json {
        let sources = self.fusion.intake().tallies().iter().map(|(source, tally)| {
            let counts = json!({
                "all": tally.count(), "taken": tally.taken, "doubted": tally.doubted, "out_of_time": tally.out_of_time,
                "refused": tally.refused,
            });
            (source.to_string(), counts)
        });
        json!({
            "sources": sources.collect::<Map<_, _>>(), "no_fixes": self.fusion.intake().spoilt(),
            "contradicting": self.fusion.intake().contradicting(), "at_end": self.object(None),
        })
    }
}
