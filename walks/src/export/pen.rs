//! SVG elements, written one after the other.

use std::fmt::Write;

/// Where a text is held.
#[derive(Clone, Copy)]
pub enum Anchor {
    /// At its left end.
    Start,
    /// In the middle.
    Middle,
    /// At its right end.
    End,
}

/// How a text looks.
#[derive(Clone, Copy)]
pub struct Lettering {
    /// **Units:** px.
    pub size: f64,
    /// As SVG has it.
    pub colour: &'static str,
    /// Held where.
    pub anchor: Anchor,
}

/// A drawing under way. Coordinates in px, y downwards.
pub struct Pen {
    body: String,
}

/// Lines closer than this to where the pen is are not worth a point. **Units:** px.
const FINEST: f64 = 0.35;

impl Pen {
    /// Nothing drawn yet.
    pub fn new() -> Self {
        Self { body: String::new() }
    }

    /// The drawing as a file.
    pub fn finish(self, width: f64, height: f64, background: &str) -> String {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} \
             {height}\" font-family=\"Ubuntu, 'Segoe UI', Helvetica, Arial, sans-serif\">\n<rect width=\"{width}\" \
             height=\"{height}\" fill=\"{background}\"/>\n{}</svg>\n",
            self.body
        )
    }

    /// One element as it stands. Writing to a string cannot fail.
    fn put(&mut self, element: std::fmt::Arguments<'_>) {
        let _ = self.body.write_fmt(element);
        self.body.push('\n');
    }

    /// What is drawn from here to [`Pen::unclip`] is shown inside a rectangle only; `name` is used once in a drawing.
    pub fn clip(&mut self, name: &str, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        self.put(format_args!(
            "<clipPath id=\"{name}\"><rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>\
             </clipPath>\n<g clip-path=\"url(#{name})\">"
        ));
    }

    /// Ends what [`Pen::clip`] began.
    pub fn unclip(&mut self) {
        self.put(format_args!("</g>"));
    }

    /// A filled rectangle from its upper left corner.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: &str) {
        self.put(format_args!(
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\"/>"
        ));
    }

    /// A straight line.
    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], colour: &str, width: f64) {
        self.put(format_args!(
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>"
        ));
    }

    /// A line through points; those that are not numbers or make no visible difference are left out.
    pub fn polyline(&mut self, points: impl IntoIterator<Item = [f64; 2]>, colour: &str, width: f64, opacity: f64) {
        let mut path = String::new();
        let mut last: Option<[f64; 2]> = None;
        let mut skipped = None;
        for point in points.into_iter().filter(|point| point.iter().all(|value| value.is_finite())) {
            if last.is_some_and(|[x, y]| (point[0] - x).hypot(point[1] - y) < FINEST) {
                skipped = Some(point);
                continue;
            }
            let _ = write!(path, "{:.1},{:.1} ", point[0], point[1]);
            (last, skipped) = (Some(point), None);
        }
        if let Some([x, y]) = skipped {
            let _ = write!(path, "{x:.1},{y:.1}");
        }
        self.put(format_args!(
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\" \
             stroke-linejoin=\"round\" stroke-linecap=\"round\"/>",
            path.trim_end()
        ));
    }

    /// A disc with a rim.
    pub fn circle(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str, rim: (&str, f64)) {
        let (colour, width) = rim;
        self.put(format_args!(
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"{fill}\" stroke=\"{colour}\" \
             stroke-width=\"{width}\"/>"
        ));
    }

    /// A filled outline with a rim, its corners relative to `[x, y]`.
    pub fn outline(&mut self, [x, y]: [f64; 2], corners: &[[f64; 2]], fill: &str, rim: (&str, f64)) {
        let (colour, width) = rim;
        let points: Vec<_> =
            corners.iter().map(|corner| format!("{:.1},{:.1}", x + corner[0], y + corner[1])).collect();
        self.put(format_args!(
            "<polygon points=\"{}\" fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>",
            points.join(" ")
        ));
    }

    /// A text on its base line.
    pub fn text(&mut self, [x, y]: [f64; 2], text: &str, lettering: Lettering) {
        self.lettered([x, y], text, lettering, "");
    }

    /// A text that stays legible on top of lines.
    pub fn text_with_halo(&mut self, [x, y]: [f64; 2], text: &str, lettering: Lettering) {
        self.lettered([x, y], text, lettering, " stroke=\"white\" stroke-width=\"4\" paint-order=\"stroke\"");
    }

    fn lettered(&mut self, [x, y]: [f64; 2], text: &str, lettering: Lettering, more: &str) {
        let Lettering { size, colour, anchor } = lettering;
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escaped(text);
        self.put(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" fill=\"{colour}\" text-anchor=\"{anchor}\"{more}>{text}</text>"
        ));
    }
}

/// Text as XML has it. Control characters, which XML 1.0 cannot hold at all, become spaces.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_break_out_of_its_element() {
        assert_eq!(escaped("a<b>&\"c\u{1}"), "a&lt;b&gt;&amp;&quot;c ");
    }

    #[test]
    fn a_line_keeps_its_end_and_drops_what_is_too_fine_or_no_number() {
        let mut pen = Pen::new();
        pen.polyline([[0.0, 0.0], [0.1, 0.0], [f64::NAN, 0.0], [5.0, 0.0], [5.1, 0.0]], "red", 1.0, 1.0);
        assert!(pen.finish(10.0, 10.0, "white").contains("points=\"0.0,0.0 5.0,0.0 5.1,0.0\""));
    }
}
