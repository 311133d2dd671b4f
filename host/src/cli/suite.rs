//! The figures of the suites as tables, and pictures of them.

pub mod drawn;

use super::table::Table;
use crate::evaluation::building::suite::{Errors, KnownRow, OtherRow};
use crate::evaluation::building::unknown::{LostRow, UnknownRow};
use crate::evaluation::fixes::{Bounds, Figures, eight, mall, ranges, walks};
use crate::evaluation::graph;
use crate::evaluation::phone::suite::Row;

fn metres(errors: &Errors) -> String {
    format!("{:.3} / {:.3}", errors.mean_m, errors.worst_m)
}

/// Tables 7.2 and 7.3.
pub fn known(rows: &[KnownRow]) -> Table {
    let headings = ["stances", "way m", "steps alone m", "documented m", "default m", "while located m", "corrected m"];
    let mut table = Table::new("known start: mean / worst", &headings);
    for row in rows {
        let [documented, default] = &row.live;
        table.row(
            row.walk.clone(),
            vec![
                row.stances.to_string(),
                format!("{:.1}", row.length_m),
                metres(&row.steps_alone),
                metres(documented),
                metres(default),
                metres(&row.located),
                metres(&row.corrected),
            ],
        );
    }
    let mean = |pick: &dyn Fn(&KnownRow) -> Errors| {
        let count = rows.len().max(1) as f64;
        let mean_m = rows.iter().map(|row| pick(row).mean_m).sum::<f64>() / count;
        metres(&Errors {
            mean_m,
            worst_m: rows.iter().map(|row| pick(row).worst_m).fold(0.0, f64::max),
            ..Errors::default()
        })
    };
    table.row(
        "all",
        vec![
            String::new(),
            String::new(),
            mean(&|row| row.steps_alone),
            mean(&|row| row.live[0]),
            mean(&|row| row.live[1]),
            mean(&|row| row.located),
            mean(&|row| row.corrected),
        ],
    );
    table
}

/// The document's other tests.
pub fn others(rows: &[OtherRow]) -> Table {
    let headings =
        ["settings", "floor right %", "live m", "end m", "located s", "places", "particles after 0, 1, 2, 5, 10"];
    let mut table = Table::new("test: mean / worst", &headings);
    for row in rows {
        let particles: Vec<_> = row.particles.iter().map(usize::to_string).collect();
        table.row(
            row.test,
            vec![
                row.settings.to_owned(),
                format!("{:.1}", row.floor_right_percent),
                metres(&row.live),
                metres(&row.end),
                row.located_s.map_or_else(|| "-".to_owned(), |seconds| format!("{seconds:.0}")),
                row.clusters.to_string(),
                particles.join(" "),
            ],
        );
    }
    table
}

/// Unknown start.
pub fn unknown(rows: &[UnknownRow]) -> Table {
    let headings = [
        "walks",
        "located in 60 s %",
        "in 120 s %",
        "at all %",
        "wrongly %",
        "mean m",
        "75 % m",
        "95 % m",
        "worst m",
        "floor right %",
    ];
    let mut table = Table::new("unknown start, three floors", &headings);
    for row in rows {
        table.row(
            format!("{}, {}", row.site, row.settings),
            vec![
                row.walks.to_string(),
                format!("{:.1}", row.located_60_s_percent),
                format!("{:.1}", row.located_120_s_percent),
                format!("{:.1}", row.located_percent),
                format!("{:.1}", row.wrongly_percent),
                format!("{:.3}", row.located.mean_m),
                format!("{:.3}", row.located.p75_m),
                format!("{:.3}", row.located.p95_m),
                format!("{:.2}", row.located.worst_m),
                format!("{:.2}", row.floor_right_percent),
            ],
        );
    }
    table
}

/// How often a probability was right.
pub fn reliability(row: &UnknownRow) -> Table {
    let corner = format!("likeliest room, {}, {}", row.site, row.settings);
    let mut table = Table::new(corner, &["moments", "said %", "right %"]);
    for bin in &row.reliability {
        table.row(
            format!("{:.0} to {:.0} %", bin.from_percent, bin.to_percent),
            vec![bin.moments.to_string(), format!("{:.1}", bin.said_percent), format!("{:.1}", bin.right_percent)],
        );
    }
    table
}

/// Disturbed walks.
pub fn lost(rows: &[LostRow]) -> Table {
    let headings = ["settings", "walks", "back in 30 s %", "in 60 s %", "wrongly located after 60 s %"];
    let mut table = Table::new("disturbance", &headings);
    for row in rows {
        table.row(
            format!("{}, {}", row.site, row.disturbance),
            vec![
                row.settings.to_owned(),
                row.walks.to_string(),
                format!("{:.1}", row.back_30_s_percent),
                format!("{:.1}", row.back_60_s_percent),
                format!("{:.1}", row.wrongly_percent),
            ],
        );
    }
    table
}

/// Walks with a phone.
pub fn phone(rows: &[Row]) -> Table {
    let headings = [
        "way m",
        "steps",
        "documented",
        "laid best m",
        "default",
        "laid best m",
        "live m",
        "corrected m",
        "unknown: located s",
        "live m",
        "corrected m",
    ];
    let mut table = Table::new("phone, RMSE at way-points", &headings);
    let cell =
        |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"));
    for row in rows {
        table.row(
            row.walk,
            vec![
                format!("{:.1}", row.way_m),
                row.steps.to_string(),
                cell(row.documented_m[0], 2),
                cell(row.documented_m[1], 2),
                cell(row.first_leg_m, 2),
                cell(row.fitted_m, 2),
                cell(row.known.live_m, 2),
                cell(row.known.corrected_m, 2),
                cell(row.unknown.and_then(|found| found.located_s), 0),
                cell(row.unknown.and_then(|found| found.live_m), 2),
                cell(row.unknown.and_then(|found| found.corrected_m), 2),
            ],
        );
    }
    table
}

fn spread(figures: &Figures) -> Vec<String> {
    let errors = &figures.errors;
    [figures.rmse_m, errors.p75_m, errors.p95_m, errors.worst_m].map(|metres| format!("{metres:.2}")).to_vec()
}

/// The recorded walk with positions (Fix, 3.4).
pub fn eight(rows: &[eight::Row]) -> Table {
    let headings =
        ["start", "positions Hz", "RMSE m", "75 % m", "95 % m", "worst m", "stamped late s", "RMSE without m"];
    let mut table = Table::new("hcu eight, steps and positions", &headings);
    for row in rows {
        let mut cells = vec![row.start.to_owned(), format!("{:.3}", row.rate_hz)];
        cells.extend(spread(&row.figures));
        cells.extend([format!("{:.1}", row.late_s), format!("{:.2}", row.timed_m)]);
        table.row(row.method, cells);
    }
    table
}

/// Simulated walks with positions.
pub fn walks(rows: &[walks::Row]) -> Table {
    let headings = [
        "sigma m",
        "extended RMSE m",
        "smoother m",
        "95 % m",
        "corrected m",
        "innovation (95 %)",
        "estimation (95 %)",
        "outliers doubted %",
        "others %",
    ];
    let bounds = |bounds: &Bounds| format!("{:.2} ({:.2} - {:.2})", bounds.mean, bounds.low, bounds.high);
    let mut table = Table::new("simulated walks, wrong with the positions", &headings);
    for row in rows {
        table.row(
            row.wrong,
            vec![
                format!("{:.0}", row.sigma_m),
                format!("{:.2}", row.extended.rmse_m),
                format!("{:.2}", row.live.rmse_m),
                format!("{:.2}", row.live.errors.p95_m),
                format!("{:.2}", row.corrected.rmse_m),
                bounds(&row.innovation),
                bounds(&row.estimation),
                format!("{:.0}", row.outliers_doubted_percent),
                format!("{:.1}", row.others_doubted_percent),
            ],
        );
    }
    table
}

/// The methods on a walk graph and beside it, on simulated walks (Graph, 7.2 and 7.5).
pub fn graph_walks(rows: &[graph::suite::Row]) -> Table {
    let headings = [
        "building",
        "walks",
        "end right %",
        "without search %",
        "floor changes",
        "right %",
        "RMSE m",
        "median m",
        "95 % m",
    ];
    let mut table = Table::new("phone, simulated walks", &headings);
    for row in rows {
        table.row(
            row.method,
            vec![
                row.site.to_owned(),
                row.walks.to_string(),
                format!("{:.1}", row.end_right_percent),
                row.without_search_percent.map_or_else(|| "-".to_owned(), |percent| format!("{percent:.1}")),
                row.changes.to_string(),
                format!("{:.1}", row.changes_right_percent),
                format!("{:.2}", row.rmse_m),
                format!("{:.2}", row.median_m),
                format!("{:.2}", row.p95_m),
            ],
        );
    }
    table
}

/// The same on the recorded walk, at its way-points.
pub fn graph_eight(rows: &[graph::eight::Row]) -> Table {
    let mut table = Table::new("hcu eight, at way-points", &["step length", "RMSE m", "worst m"]);
    for row in rows {
        let figures = [row.rmse_m, row.worst_m].map(|metres| format!("{metres:.2}"));
        table.row(row.method, [vec![row.steps.to_owned()], figures.to_vec()].concat());
    }
    table
}

/// What a step took on this machine. Not part of what is kept.
pub fn graph_times(rows: &[graph::suite::Row]) -> Table {
    let mut table = Table::new("time of a step", &["building", "us"]);
    for row in rows {
        table.row(row.method, vec![row.site.to_owned(), format!("{:.1}", row.step_us)]);
    }
    table
}

/// Recorded walks with simulated positions.
pub fn mall(rows: &[mall::Row]) -> Table {
    let headings = ["extended RMSE m", "smoother m", "95 % m", "corrected m", "95 % m"];
    let mut table = Table::new("mall, simulated positions Hz", &headings);
    for row in rows {
        let (live, corrected) = (&row.live, &row.corrected);
        let figures = [row.extended.rmse_m, live.rmse_m, live.errors.p95_m, corrected.rmse_m, corrected.errors.p95_m];
        table.row(format!("{:.1}", row.rate_hz), figures.map(|metres| format!("{metres:.2}")).to_vec());
    }
    table
}

/// How far recorded ranges are off.
pub fn ranges(rows: &[ranges::Row]) -> Table {
    let headings = ["ranges", "offset m", "scale m", "beyond 3 scales %", "half of those beyond m"];
    let mut table = Table::new("UWB ranges at surveyed points", &headings);
    for row in rows {
        let mut cells = vec![row.count.to_string()];
        cells.extend([row.offset_m, row.scale_m].map(|metres| format!("{metres:.3}")));
        cells.extend([format!("{:.2}", row.tail_percent), format!("{:.2}", row.tail_m)]);
        table.row(row.of.clone(), cells);
    }
    table
}

/// Places that come of recorded ranges.
pub fn placed(rows: &[ranges::Placed]) -> Table {
    let headings = ["places", "mean m", "75 % m", "95 % m", "worst m"];
    let mut table = Table::new("place of one round of ranges", &headings);
    for ranges::Placed { ranges, errors } in rows {
        let mut cells = vec![errors.count.to_string()];
        cells.extend([errors.mean_m, errors.p75_m, errors.p95_m, errors.worst_m].map(|metres| format!("{metres:.2}")));
        table.row(*ranges, cells);
    }
    table
}
