//! How the window is laid out: kept in a file from one run to the next.

use super::arrangement::Arrangement;
use super::cube::Cube;
use super::engine::Signal;
use super::map;
use crate::export::{ExportError, file};
use egui_dock::{DockState, NodeIndex, TabIndex};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// A part of the window that can be moved, closed and opened.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    /// The building with the person.
    Map,
    /// How the shoe lies.
    Attitude,
    /// What is known, and what is wrong.
    Status,
    /// Settings.
    Parameters,
    /// The plot of this number in [`Layout::plots`].
    Plot(usize),
}

/// A plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plot {
    /// Over it.
    pub title: String,
    /// What is plotted.
    pub signals: BTreeSet<Signal>,
    /// Logarithms of the values.
    pub logarithmic: bool,
    /// Goes with the time.
    pub follow: bool,
    /// How much is seen then. **Units:** s.
    pub seconds: f64,
}

impl Plot {
    /// A plot of some signals.
    pub fn of(title: &str, signals: &[Signal]) -> Self {
        let signals = signals.iter().copied().collect();
        Self { title: title.into(), signals, logarithmic: false, follow: true, seconds: 20.0 }
    }
}

/// Light or dark.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Look {
    /// As the system has it.
    #[default]
    System,
    /// Dark on light.
    Light,
    /// Light on dark.
    Dark,
}

/// All of it.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Light or dark.
    pub look: Look,
    /// Whether the list of views is shown.
    pub selector: bool,
    /// How the map is looked at.
    pub map: map::View,
    /// How the cube is looked at.
    pub cube: Cube,
    /// The plots there are, opened or not.
    pub plots: Vec<Plot>,
    /// Where the views are.
    pub dock: DockState<View>,
}

/// All of it, as it is written down.
#[derive(Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Kept {
    look: Look,
    selector: bool,
    map: map::View,
    cube: Cube,
    plots: Vec<Plot>,
    views: Arrangement,
}

impl Default for Kept {
    fn default() -> Self {
        Self::of(&Layout::default())
    }
}

impl Kept {
    fn of(layout: &Layout) -> Self {
        let Layout { look, selector, map, cube, plots, dock } = layout;
        let views = Arrangement::of(dock);
        Self { look: *look, selector: *selector, map: map.clone(), cube: *cube, plots: plots.clone(), views }
    }

    fn layout(self) -> Result<Layout, String> {
        let Self { look, selector, map, cube, plots, views } = self;
        let layout = Layout { look, selector, map, cube, plots, dock: views.dock()? };
        layout.check()?;
        Ok(layout)
    }
}

/// Why a layout is not as it was.
#[derive(Debug, thiserror::Error)]
pub enum LayoutError {
    /// The file cannot be read.
    #[error("the layout of the window {}: {source}; everything is where it was at first", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It holds something else.
    #[error("the layout of the window {}: {told}; everything is where it was at first", path.display())]
    Refused {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        told: String,
    },
}

impl Default for Layout {
    fn default() -> Self {
        let plots = vec![
            Plot::of("Acceleration", &[Signal::AccelNorm]),
            Plot::of("Rate", &[Signal::GyroNorm]),
            Plot { logarithmic: true, ..Plot::of("Stance", &[Signal::Statistic, Signal::Bound]) },
            Plot::of("Motion", &[Signal::Speed, Signal::Height]),
            Plot { logarithmic: true, ..Plot::of("Update", &[Signal::Innovation, Signal::VelocitySigma]) },
            Plot { logarithmic: true, ..Plot::of("Particles", &[Signal::Particles, Signal::Effective]) },
            Plot::of("Place", &[Signal::PlaceSigma, Signal::Probability, Signal::Fit]),
            Plot::of("Link", &[Signal::Delay, Signal::FramesBad, Signal::Waiting]),
            Plot::of("Load", &[Signal::Load]),
        ];
        let mut dock = DockState::new(vec![View::Map]);
        let tree = dock.main_surface_mut();
        let [map, side] = tree.split_right(NodeIndex::root(), 0.72, vec![View::Status, View::Parameters]);
        let bottom = (0..plots.len()).map(View::Plot).collect();
        tree.split_below(map, 0.72, bottom);
        tree.split_below(side, 0.6, vec![View::Attitude]);
        Self { look: Look::System, selector: true, map: map::View::default(), cube: Cube::default(), plots, dock }
    }
}

impl Layout {
    /// Reads what was written; the default when there is no file yet.
    ///
    /// # Errors
    /// When the file cannot be read or does not make sense.
    pub fn read(path: &Path) -> Result<Self, LayoutError> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(LayoutError::Read { path: path.to_owned(), source: error }),
        };
        let refused = |told: String| LayoutError::Refused { path: path.to_owned(), told };
        let kept: Kept = serde_json::from_str(&text).map_err(|error| refused(error.to_string()))?;
        kept.layout().map_err(refused)
    }

    /// Whether each view is there once, and each plot that is opened exists.
    fn check(&self) -> Result<(), String> {
        let mut seen = BTreeSet::new();
        for (_, view) in self.dock.iter_all_tabs() {
            if let View::Plot(number) = view
                && *number >= self.plots.len()
            {
                return Err(format!("there is no plot {number}, only {}", self.plots.len()));
            }
            if !seen.insert(*view) {
                return Err(format!("{view:?} is there twice"));
            }
        }
        if let Some(plot) = self.plots.iter().find(|plot| !(plot.seconds > 0.0 && plot.seconds.is_finite())) {
            return Err(format!("the plot {} shows {} s", plot.title, plot.seconds));
        }
        Ok(())
    }

    /// Writes it down.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        if let Some(folder) = path.parent() {
            file::folder(folder)?;
        }
        let text = serde_json::to_string_pretty(&Kept::of(self)).expect("names and numbers can be written");
        file::write(path, text.as_bytes())
    }

    /// Opens a view, or brings it to the front.
    pub fn open(&mut self, view: View) {
        match self.dock.find_tab(&view) {
            Some(path) => {
                // It was just found.
                let _ = self.dock.set_active_tab(path);
                self.dock.set_focused_node_and_surface(path.node_path());
            }
            None => self.dock.push_to_first_leaf(view),
        }
    }

    /// Where a plot is in front that is of samples alone, and none of its signals is known, the first that knows one comes
    /// there: who tells no samples at first never does. Others may be known later.
    pub fn show_known(&mut self, is_known: impl Fn(Signal) -> bool) {
        let plot = |view: &View| match view {
            View::Plot(number) => self.plots.get(*number).filter(|plot| !plot.signals.is_empty()),
            _ => None,
        };
        let knows = |view: &View| plot(view).is_some_and(|plot| plot.signals.iter().any(|signal| is_known(*signal)));
        let never = |signal: &Signal| signal.is_of_samples() && !is_known(*signal);
        let stays_empty = |view: &View| plot(view).is_some_and(|plot| plot.signals.iter().all(never));
        for (_, leaf) in self.dock.iter_leaves_mut() {
            if leaf.tabs.get(leaf.active.0).is_some_and(stays_empty)
                && let Some(known) = leaf.tabs.iter().position(&knows)
            {
                leaf.active = TabIndex(known);
            }
        }
    }

    /// Whether a view is opened.
    pub fn is_open(&self, view: View) -> bool {
        self.dock.find_tab(&view).is_some()
    }

    /// What a view is called.
    pub fn title(&self, view: View) -> &str {
        match view {
            View::Map => "Map",
            View::Attitude => "Attitude",
            View::Status => "Status",
            View::Parameters => "Parameters",
            View::Plot(number) => self.plots.get(number).map_or("", |plot| &plot.title),
        }
    }
}

/// Where the layout of this user is kept, if the system has a place for it.
pub fn usual_file() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let folder = if cfg!(windows) {
        set("APPDATA")
    } else if cfg!(target_os = "macos") {
        set("HOME").map(|home| home.join("Library/Application Support"))
    } else {
        set("XDG_CONFIG_HOME").or_else(|| set("HOME").map(|home| home.join(".config")))
    };
    Some(folder?.join("sohle").join("window.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_of_which_nothing_is_known_gives_way_to_one_that_knows_something() {
        let shown = |layout: &Layout| -> Vec<View> {
            layout.dock.iter_leaves().map(|(_, leaf)| leaf.tabs[leaf.active.0]).collect()
        };
        let mut layout = Layout::default();
        let before = shown(&layout);
        assert!(before.contains(&View::Plot(0)));
        layout.show_known(|signal| signal == Signal::AccelNorm);
        layout.show_known(|_| false);
        assert_eq!(shown(&layout), before);
        // What a shoe tells that does not tell its samples.
        layout.show_known(|signal| matches!(signal, Signal::Height | Signal::Load));
        assert!(shown(&layout).contains(&View::Plot(3)), "{:?}", shown(&layout));
        // A place is known later.
        layout.open(View::Plot(6));
        layout.show_known(|signal| matches!(signal, Signal::Height | Signal::Load));
        assert!(shown(&layout).contains(&View::Plot(6)), "{:?}", shown(&layout));
    }

    #[test]
    fn what_is_written_is_read_back() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("deep/window.json");
        assert_eq!(Layout::read(&path).unwrap().plots, Layout::default().plots, "nothing was written yet");
        let mut layout = Layout { look: Look::Dark, selector: false, ..Layout::default() };
        layout.plots.push(Plot::of("mine", &[Signal::Climb, Signal::Load]));
        layout.open(View::Plot(layout.plots.len() - 1));
        layout.map.follow = true;
        layout.write(&path).unwrap();
        let read = Layout::read(&path).unwrap();
        assert_eq!((read.look, read.selector, &read.plots, &read.map), (Look::Dark, false, &layout.plots, &layout.map));
        let views = |layout: &Layout| layout.dock.iter_all_tabs().map(|(_, view)| *view).collect::<Vec<_>>();
        assert_eq!(views(&read), views(&layout));
    }

    #[test]
    fn a_broken_file_is_told_of() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("window.json");
        let told = |text: &str| {
            std::fs::write(&path, text).unwrap();
            Layout::read(&path).unwrap_err().to_string()
        };
        assert!(told("{").contains("where it was at first"));
        assert!(told("{\"colour\": 3}").contains("colour"));
        let written = |layout: &Layout| serde_json::to_string(&Kept::of(layout)).unwrap();
        let none = Layout { plots: Vec::new(), ..Layout::default() };
        assert!(told(&written(&none)).contains("no plot 0"));
        let mut twice = Layout::default();
        twice.dock.push_to_first_leaf(View::Map);
        assert!(told(&written(&twice)).contains("twice"));
        let mut still = Layout::default();
        still.plots[0].seconds = 0.0;
        assert!(told(&written(&still)).contains("Acceleration"));
    }

    #[test]
    fn views_are_opened_once() {
        let mut layout = Layout::default();
        let path = layout.dock.find_tab(&View::Status).unwrap();
        layout.dock.remove_tab(path);
        assert!(!layout.is_open(View::Status));
        layout.open(View::Status);
        layout.open(View::Status);
        assert!(layout.is_open(View::Status) && layout.check().is_ok());
    }
}
