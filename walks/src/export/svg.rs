//! The picture of a walk as SVG: the tracks from above with equal axes, below them their height over the distance.

use super::pen::{Anchor, Lettering, Pen};
use super::picture::{Dot, Line, Picture, Role};
use super::scale::{Range, label, round_spacing};
use sohle_shared::step::FloorMode;

/// The page. **Units:** px.
const WIDTH: f64 = 1200.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = WIDTH - 28.0;
/// Bounds of the height of the plan, and the height of the strip below it. **Units:** px.
const PLAN_HEIGHT: (f64, f64) = (300.0, 700.0);
const STRIP_HEIGHT: f64 = 150.0;
/// One row of the table. **Units:** px.
const ROW: f64 = 24.0;

/// Between two arrows on a track, and the shortest stride that has room for one. **Units:** px.
const ARROW_SPACING: f64 = 130.0;
const SHORTEST_WITH_ARROW: f64 = 8.0;

/// A quarter of the Earth's circumference.
const FARTHEST_M: f64 = 1e7;

const PAPER: &str = "#ffffff";
const FIELD: &str = "#fafaf8";
const GRID: &str = "#e4e4df";
const INK: &str = "#20242a";
const FAINT: &str = "#565b63";
const STAIRS: &str = "#f3e7cf";
const ELEVATOR: &str = "#dcecea";

const TITLE: Lettering = Lettering { size: 25.0, colour: INK, anchor: Anchor::Start };
const NOTE: Lettering = Lettering { size: 15.0, colour: FAINT, anchor: Anchor::Start };
const WORD: Lettering = Lettering { size: 16.0, colour: INK, anchor: Anchor::Start };
const SMALL: Lettering = Lettering { size: 13.0, colour: FAINT, anchor: Anchor::Start };

/// Draws the picture.
pub fn draw(picture: &Picture) -> String {
    let mut pen = Pen::new();
    let mut earthly: Vec<Line> = picture.lines.iter().map(earthly).collect();
    // What matters most lies on top; the sort is stable.
    earthly.sort_by_key(|line| line.role);
    let lines: Vec<&Line> = earthly.iter().collect();
    let shades = Shades::of(&lines);

    let table = header(&mut pen, picture, &lines);
    let plan = Plan::of(&lines, table + 16.0);
    plan.grid(&mut pen);
    pen.clip("plan", [LEFT, plan.top], [RIGHT - LEFT, plan.bottom - plan.top]);
    for line in &lines {
        plan.line(&mut pen, line, &shades);
    }
    plan.marks(&mut pen, &lines);
    pen.unclip();
    plan.beyond(&mut pen, &lines);
    let strip = Strip::of(&lines, plan.bottom + 72.0);
    strip.grid(&mut pen, &lines, shades.0.is_some());
    pen.clip("strip", [LEFT, strip.top], [RIGHT - LEFT, strip.bottom - strip.top]);
    for line in &lines {
        strip.line(&mut pen, line, &shades);
    }
    pen.unclip();
    pen.finish(WIDTH, strip.bottom + 48.0, PAPER)
}

/// A line without the points that lie nowhere on Earth: grids and pixels have no numbers for them.
fn earthly(line: &Line) -> Line {
    let on_earth = |position: &[f64; 3]| position.iter().all(|value| value.abs() < FARTHEST_M);
    let mut line = line.clone();
    line.dots.retain(|dot| on_earth(&dot.position));
    line.foot.retain(on_earth);
    line
}

/// Title, figures, and the table that is the legend too. Returns where it ends.
fn header(pen: &mut Pen, picture: &Picture, lines: &[&Line]) -> f64 {
    pen.text([LEFT, 42.0], &picture.title, TITLE);
    pen.text([LEFT, 66.0], &picture.note, NOTE);
    let columns = picture.columns.len() as f64;
    let width = ((RIGHT - LEFT - 220.0) / columns.max(1.0)).min(140.0);
    let edge = |column: usize| LEFT + 220.0 + width * (column as f64 + 1.0);
    let mut y = 98.0;
    for (column, heading) in picture.columns.iter().enumerate() {
        pen.text([edge(column), y], heading, Lettering { anchor: Anchor::End, ..SMALL });
    }
    key(pen, picture, y);
    for line in lines.iter().rev() {
        y += ROW;
        let style = Style::of(line.role);
        pen.line([LEFT, y - 5.0], [LEFT + 34.0, y - 5.0], style.colour, style.width.max(2.0));
        pen.text([LEFT + 44.0, y], &line.label, WORD);
        for (column, cell) in line.cells.iter().enumerate() {
            pen.text([edge(column), y], cell, Lettering { anchor: Anchor::End, ..WORD });
        }
    }
    y
}

/// What the dots mean: only the modes that occur.
fn key(pen: &mut Pen, picture: &Picture, y: f64) {
    let mut x = LEFT;
    let dots = || picture.lines.iter().flat_map(|line| &line.dots);
    for (mode, name) in
        [(FloorMode::Level, "stance"), (FloorMode::Stairs, "on stairs"), (FloorMode::Elevator, "in an elevator")]
    {
        if dots().any(|dot| dot.mode == mode) {
            dot_mark(pen, [x + 5.0, y - 4.5], mode, 4.0, Style::of(Role::Chosen).colour);
            pen.text([x + 14.0, y], name, SMALL);
            x += 26.0 + 6.6 * name.len() as f64;
        }
    }
}

/// How a line looks.
struct Style {
    colour: &'static str,
    width: f64,
    opacity: f64,
}

impl Style {
    fn of(role: Role) -> Self {
        match role {
            Role::Truth => Self { colour: "#a9adb3", width: 6.0, opacity: 0.75 },
            Role::Documented => Self { colour: "#d9622b", width: 1.6, opacity: 1.0 },
            Role::Chosen => Self { colour: "#1f63b8", width: 1.8, opacity: 1.0 },
        }
    }
}

/// Shades of the chosen track's colour by height, so that floors can be told apart from above.
struct Shades(Option<Range>);

impl Shades {
    /// Lowest, middle and highest.
    const STOPS: [[f64; 3]; 3] = [[122.0, 190.0, 240.0], [31.0, 99.0, 184.0], [16.0, 27.0, 78.0]];

    /// Differences below a metre are not a floor and are not shown.
    fn of(lines: &[&Line]) -> Self {
        let chosen = lines.iter().filter(|line| line.role == Role::Chosen);
        Self(Range::of(chosen.flat_map(|line| heights(line))).filter(|range| range.length() > 1.0))
    }

    fn at(&self, height: f64) -> String {
        let share = self.0.map_or(0.5, |range| ((height - range.from) / range.length()).clamp(0.0, 1.0));
        let (low, part) = if share < 0.5 { (0, share * 2.0) } else { (1, share * 2.0 - 1.0) };
        let [red, green, blue] = [0, 1, 2].map(|channel| {
            let (from, to) = (Self::STOPS[low][channel], Self::STOPS[low + 1][channel]);
            (from + (to - from) * part).round() as u8
        });
        format!("#{red:02x}{green:02x}{blue:02x}")
    }
}

fn heights(line: &Line) -> impl Iterator<Item = f64> {
    line.dots.iter().map(|dot| dot.position[2])
}

/// A stance: a disc on the level, a triangle on stairs, a square in an elevator.
fn dot_mark(pen: &mut Pen, at: [f64; 2], mode: FloorMode, radius: f64, fill: &str) {
    let rim = (PAPER, (radius * 0.25).min(0.8));
    let r = radius * 1.15;
    match mode {
        FloorMode::Level => pen.circle(at, radius, fill, rim),
        FloorMode::Stairs => pen.outline(at, &[[0.0, -r * 1.2], [r * 1.05, r * 0.8], [-r * 1.05, r * 0.8]], fill, rim),
        FloorMode::Elevator => pen.outline(at, &[[-r, -r], [r, -r], [r, r], [-r, r]], fill, rim),
    }
}

/// A track may widen the picture by this share on each side. One that needs more has lost its way, and would crush the
/// others if it were shown whole.
const STRAY: f64 = 0.3;

/// The range of `values` of what must be seen (the truth and the chosen track), and the rest if it does
/// not need more than `room` metres or [`STRAY`].
fn bounds(lines: &[&Line], room: f64, values: impl Fn(&Line) -> Vec<f64>) -> Range {
    let range = |wanted: &dyn Fn(Role) -> bool| {
        Range::of(lines.iter().filter(|line| wanted(line.role)).flat_map(|line| values(line)))
    };
    match (range(&|role| role != Role::Documented), range(&|_| true)) {
        (Some(must), Some(all)) => must.reaching(all, (STRAY * must.length()).max(room)),
        (_, all) => all.unwrap_or(Range { from: 0.0, to: 0.0 }),
    }
}

/// The walk from above.
struct Plan {
    top: f64,
    bottom: f64,
    /// What is shown, in metres; fills the field.
    x: Range,
    y: Range,
    /// Pixels for a metre, on both axes.
    scale: f64,
}

impl Plan {
    fn of(lines: &[&Line], top: f64) -> Self {
        let room = |axis: usize| {
            let range = bounds(lines, 1.0, |line| line.dots.iter().map(|dot| dot.position[axis]).collect());
            range.padded(0.3 + 0.05 * range.length()).at_least(2.0)
        };
        let (x, y) = (room(0), room(1));
        let width = RIGHT - LEFT;
        let height = (width * y.length() / x.length()).clamp(PLAN_HEIGHT.0, PLAN_HEIGHT.1);
        let scale = (width / x.length()).min(height / y.length());
        Self { top, bottom: top + height, x: x.at_least(width / scale), y: y.at_least(height / scale), scale }
    }

    fn at(&self, point: [f64; 3]) -> [f64; 2] {
        [LEFT + (point[0] - self.x.from) * self.scale, self.bottom - (point[1] - self.y.from) * self.scale]
    }

    fn grid(&self, pen: &mut Pen) {
        pen.rectangle([LEFT, self.top], [RIGHT - LEFT, self.bottom - self.top], FIELD);
        let spacing = round_spacing(60.0 / self.scale);
        for x in self.x.ticks(spacing) {
            let [at, _] = self.at([x, 0.0, 0.0]);
            pen.line([at, self.top], [at, self.bottom], GRID, 1.0);
            pen.text([at, self.bottom + 17.0], &label(x, spacing), Lettering { anchor: Anchor::Middle, ..SMALL });
        }
        for y in self.y.ticks(spacing) {
            let [_, at] = self.at([0.0, y, 0.0]);
            pen.line([LEFT, at], [RIGHT, at], GRID, 1.0);
            pen.text([LEFT - 8.0, at + 4.5], &label(y, spacing), Lettering { anchor: Anchor::End, ..SMALL });
        }
        pen.text([RIGHT, self.bottom + 34.0], "x, y in metres", Lettering { anchor: Anchor::End, ..SMALL });
    }

    fn line(&self, pen: &mut Pen, line: &Line, shades: &Shades) {
        let style = Style::of(line.role);
        pen.polyline(line.foot.iter().map(|&point| self.at(point)), style.colour, 1.0, 0.35);
        pen.polyline(line.dots.iter().map(|dot| self.at(dot.position)), style.colour, style.width, style.opacity);
        if line.role != Role::Truth {
            let radius = self.radius(line);
            for dot in &line.dots {
                let fill = if line.role == Role::Chosen { shades.at(dot.position[2]) } else { style.colour.to_owned() };
                dot_mark(pen, self.at(dot.position), dot.mode, radius, &fill);
            }
        }
        if line.role == Role::Chosen {
            self.arrows(pen, line);
        }
    }

    /// Which way the walk goes, between two stances now and then.
    fn arrows(&self, pen: &mut Pen, line: &Line) {
        let mut walked = ARROW_SPACING / 2.0;
        for pair in line.dots.windows(2) {
            let length = self.pixels(&pair[0], &pair[1]);
            walked += length;
            if walked < ARROW_SPACING || length < SHORTEST_WITH_ARROW {
                continue;
            }
            walked = 0.0;
            let ([x1, y1], [x2, y2]) = (self.at(pair[0].position), self.at(pair[1].position));
            let (ahead, left) = ((x2 - x1) / length, (y2 - y1) / length);
            let middle = [(x1 + x2) / 2.0, (y1 + y2) / 2.0];
            let corner = |along: f64, across: f64| {
                [middle[0] + along * ahead - across * left, middle[1] + along * left + across * ahead]
            };
            pen.polyline([corner(-3.0, 4.5), corner(3.0, 0.0), corner(-3.0, -4.5)], INK, 1.6, 1.0);
        }
    }

    /// As large as fits between two stances; nothing where they run into one another.
    fn radius(&self, line: &Line) -> f64 {
        let mut steps: Vec<f64> = line.dots.windows(2).map(|pair| self.pixels(&pair[0], &pair[1])).collect();
        steps.sort_by(f64::total_cmp);
        let largest = if line.role == Role::Chosen { 4.2 } else { 2.6 };
        steps.get(steps.len() / 2).map_or(largest, |middle| (middle * 0.22).clamp(0.8, largest))
    }

    fn pixels(&self, from: &Dot, to: &Dot) -> f64 {
        let ([x1, y1], [x2, y2]) = (self.at(from.position), self.at(to.position));
        (x2 - x1).hypot(y2 - y1)
    }

    /// Start and ends, on top of everything.
    fn marks(&self, pen: &mut Pen, lines: &[&Line]) {
        for line in lines {
            if let Some(last) = line.dots.last() {
                let diamond = [[0.0, -7.0], [7.0, 0.0], [0.0, 7.0], [-7.0, 0.0]];
                pen.outline(self.at(last.position), &diamond, Style::of(line.role).colour, (PAPER, 1.5));
            }
        }
        let Some((first, last)) = lines.last().and_then(|line| line.dots.first().zip(line.dots.last())) else {
            let middle = [(LEFT + RIGHT) / 2.0, (self.top + self.bottom) / 2.0];
            pen.text(middle, "no steps were found", Lettering { anchor: Anchor::Middle, ..WORD });
            return;
        };
        let (start, end) = (self.at(first.position), self.at(last.position));
        // Away from each other where the walk ends near its start, else away from the edge.
        let near = (start[0] - end[0]).hypot(start[1] - end[1]) < 70.0;
        let inward = |[x, _]: [f64; 2]| if x > RIGHT - 60.0 { -1.0 } else { 1.0 };
        let (start_side, end_side) = match (near, end[0] < start[0]) {
            (true, true) => (1.0, -1.0),
            (true, false) => (-1.0, 1.0),
            (false, _) => (inward(start), inward(end)),
        };
        self.name(pen, start, "start", start_side);
        self.name(pen, end, "end", end_side);
        pen.circle(start, 7.0, PAPER, (INK, 2.2));
    }

    /// Says which tracks leave the picture, and how far from the start they get.
    fn beyond(&self, pen: &mut Pen, lines: &[&Line]) {
        let outside = |dot: &Dot| !(self.x.contains(dot.position[0]) && self.y.contains(dot.position[1]));
        let mut y = self.bottom + 34.0;
        for line in lines.iter().filter(|line| line.dots.iter().any(outside)) {
            let from = line.dots[0].position;
            let far = |dot: &Dot| (dot.position[0] - from[0]).hypot(dot.position[1] - from[1]);
            let farthest = line.dots.iter().map(far).fold(0.0, f64::max);
            let told = format!("'{}' leaves the picture, up to {farthest:.0} m from the start", line.label);
            pen.text([LEFT, y], &told, Lettering { colour: Style::of(line.role).colour, ..SMALL });
            y += 16.0;
        }
    }

    fn name(&self, pen: &mut Pen, [x, y]: [f64; 2], name: &str, side: f64) {
        let anchor = if side > 0.0 { Anchor::Start } else { Anchor::End };
        pen.text_with_halo([x + 12.0 * side, y - 8.0], name, Lettering { anchor, ..WORD });
    }
}

/// Height over the distance walked.
struct Strip {
    top: f64,
    bottom: f64,
    distance: Range,
    height: Range,
}

impl Strip {
    fn of(lines: &[&Line], top: f64) -> Self {
        let longest = bounds(lines, 1.0, |line| distances(line).collect()).to.max(1.0);
        let height = bounds(lines, 10.0, |line| heights(line).collect());
        Self {
            top,
            bottom: top + STRIP_HEIGHT,
            distance: Range { from: 0.0, to: longest },
            height: height.at_least(1.0).padded(0.1 * height.length().max(1.0)),
        }
    }

    fn at(&self, distance: f64, height: f64) -> [f64; 2] {
        [
            LEFT + distance / self.distance.length() * (RIGHT - LEFT),
            self.bottom - (height - self.height.from) / self.height.length() * (self.bottom - self.top),
        ]
    }

    fn grid(&self, pen: &mut Pen, lines: &[&Line], shaded: bool) {
        pen.rectangle([LEFT, self.top], [RIGHT - LEFT, self.bottom - self.top], FIELD);
        if let Some(chosen) = lines.last() {
            self.bands(pen, chosen);
        }
        let spacing = round_spacing(self.distance.length() * 60.0 / (RIGHT - LEFT));
        for x in self.distance.ticks(spacing) {
            let [at, _] = self.at(x, 0.0);
            pen.line([at, self.top], [at, self.bottom], GRID, 1.0);
            pen.text([at, self.bottom + 17.0], &label(x, spacing), Lettering { anchor: Anchor::Middle, ..SMALL });
        }
        let spacing = round_spacing(self.height.length() * 28.0 / STRIP_HEIGHT);
        for y in self.height.ticks(spacing) {
            let [_, at] = self.at(0.0, y);
            pen.line([LEFT, at], [RIGHT, at], GRID, 1.0);
            pen.text([LEFT - 8.0, at + 4.5], &label(y, spacing), Lettering { anchor: Anchor::End, ..SMALL });
        }
        let caption =
            if shaded { "height in metres; the darker a stance, the higher it is" } else { "height in metres" };
        pen.text([LEFT, self.top - 8.0], caption, SMALL);
        let end = Lettering { anchor: Anchor::End, ..SMALL };
        pen.text([RIGHT, self.bottom + 34.0], "distance walked in metres", end);
    }

    /// Where the ground was not level, as far as the tracker knew.
    fn bands(&self, pen: &mut Pen, line: &Line) {
        let walked: Vec<f64> = distances(line).collect();
        let mut first = 0;
        for run in line.dots.chunk_by(|a, b| a.mode == b.mode) {
            // A step belongs to the mode it ends in.
            let (from, to) = (walked[first.max(1) - 1], walked[first + run.len() - 1]);
            first += run.len();
            let (fill, name) = match run[0].mode {
                FloorMode::Level => continue,
                FloorMode::Stairs => (STAIRS, "stairs"),
                FloorMode::Elevator => (ELEVATOR, "elevator"),
            };
            let ([left, _], [right, _]) = (self.at(from, 0.0), self.at(to, 0.0));
            let width = (right - left).max(3.0);
            pen.rectangle([left, self.top], [width, self.bottom - self.top], fill);
            if width > 60.0 {
                // In the corner that the line does not pass.
                let climbs = run[run.len() - 1].position[2] > run[0].position[2];
                let y = if climbs { self.top + 16.0 } else { self.bottom - 7.0 };
                pen.text([left + 5.0, y], name, SMALL);
            }
        }
    }

    fn line(&self, pen: &mut Pen, line: &Line, shades: &Shades) {
        let style = Style::of(line.role);
        let points = || distances(line).zip(heights(line)).map(|(distance, height)| self.at(distance, height));
        pen.polyline(points(), style.colour, style.width, style.opacity);
        if line.role == Role::Chosen && line.dots.len() < 1000 {
            let radius = (0.45 * (RIGHT - LEFT) / line.dots.len().max(1) as f64).clamp(1.2, 3.2);
            for (at, dot) in points().zip(&line.dots) {
                dot_mark(pen, at, dot.mode, radius, &shades.at(dot.position[2]));
            }
        }
    }
}

/// Horizontal distance walked at each stance. **Units:** m.
fn distances(line: &Line) -> impl Iterator<Item = f64> {
    let mut last: Option<[f64; 3]> = None;
    let mut walked = 0.0;
    line.dots.iter().map(move |dot| {
        let [x, y, _] = dot.position;
        walked += last.map_or(0.0, |from| (x - from[0]).hypot(y - from[1]));
        last = Some(dot.position);
        walked
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::{Named, picture::Placement, png, synthetic};
    use crate::track::Track;

    fn picture(track: &Track) -> Picture {
        let named = |role, label, turn| Named {
            role,
            label,
            track,
            parameters: "",
            placement: Placement { turn, ..Placement::default() },
        };
        let mut picture = Picture::new("A square & a flight of stairs");
        picture.note = "simulated".into();
        picture.columns = vec!["steps".into(), "distance, m".into()];
        for named in [
            named(Role::Truth, "truth", 0.0),
            named(Role::Documented, "documented", 0.04),
            named(Role::Chosen, "default", 0.005),
        ] {
            picture.lines.push(Line::of(&named, vec![track.strides().to_string(), format!("{:.1}", track.distance())]));
        }
        picture
    }

    #[test]
    fn the_same_walk_gives_the_same_bytes() {
        let track = synthetic::square_and_stairs(60);
        assert_eq!(draw(&picture(&track)), draw(&picture(&track)));
    }

    #[test]
    fn every_stance_on_stairs_is_a_triangle() {
        let track = synthetic::square_and_stairs(60);
        let drawing = draw(&picture(&track));
        // 12 on the plan for each tracked line, 12 in the strip, 1 in the key, 3 ends as diamonds.
        assert_eq!(drawing.matches("<polygon").count(), 2 * 12 + 12 + 1 + 3);
        assert!(drawing.contains("&amp; a flight"));
    }

    #[test]
    fn walks_without_steps_or_with_one_or_with_wild_values_are_drawn() {
        let mut wild = synthetic::square_and_stairs(3);
        wild.stances[2].position = [f64::NAN, f64::INFINITY, 0.0];
        for track in [Track::default(), synthetic::square_and_stairs(0), wild] {
            assert!(png::render(&draw(&picture(&track))).is_ok());
        }
        assert!(draw(&Picture::default()).contains("no steps were found"));
    }

    /// Of ordinary size, of the size of the Earth, and anything that a number can be.
    fn number() -> impl proptest::strategy::Strategy<Value = f64> {
        proptest::prop_oneof![-50.0..50.0_f64, -2e7..2e7_f64, proptest::num::f64::ANY]
    }

    proptest::proptest! {
        /// Law: whatever numbers a track holds, the picture is an SVG of ordinary size.
        #[test]
        fn any_numbers_are_drawn(
            places in proptest::collection::vec(proptest::array::uniform3(number()), 0..8),
        ) {
            let dots = places.into_iter().map(|position| Dot { position, mode: FloorMode::Level }).collect();
            let mut picture = Picture::new("Any");
            let (label, cells) = ("any".to_owned(), Vec::new());
            picture.lines.push(Line { role: Role::Chosen, label, cells, dots, foot: Vec::new() });
            let drawing = draw(&picture);
            proptest::prop_assert!(drawing.len() < 100_000, "{} bytes", drawing.len());
            proptest::prop_assert!(resvg::usvg::Tree::from_str(&drawing, &resvg::usvg::Options::default()).is_ok());
        }
    }

    #[test]
    fn both_axes_of_the_plan_have_one_scale() {
        let track = synthetic::square_and_stairs(60);
        let picture = picture(&track);
        let plan = Plan::of(&picture.lines.iter().collect::<Vec<_>>(), 0.0);
        let ([x0, y0], [x1, y1]) = (plan.at([0.0; 3]), plan.at([1.0, 1.0, 0.0]));
        // Rounding of differences between coordinates of some hundred pixels.
        assert!(((x1 - x0) - (y0 - y1)).abs() < 1e-9);
    }
}
