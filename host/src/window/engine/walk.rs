//! A recorded walk that can be gone through in any direction: what is known at a moment depends on the moment alone.
//!
//! Everything is computed from the beginning on, sample by sample, by the same tracker and follower as everywhere else. Some
//! moments are kept on the way, so that going back does not begin at the beginning. What somebody does meanwhile ([`Act`])
//! becomes part of the walk, at the moment at which it was done.

use super::kept::Kept;
pub use super::moment::{Anchor, Moment};
use super::signals::{History, Signals};
use crate::building::Building;
use crate::fixes::{Fusion, smoother};
use crate::follow;
use crate::recording::Recording;
use crate::track::Track;
use sohle_shared::calibration::Calibration;
use sohle_shared::time::Micros;
use sohle_shared::tracker::{Order, Parameters};
use std::sync::Arc;

/// How a walk is gone through.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Of the tracker.
    pub tracker: Parameters,
    /// Of who follows in the building.
    pub follow: follow::Settings,
    /// The samples are corrected by it before they are tracked.
    pub calibration: Option<Calibration>,
    /// How steps and positions of other sources are put together.
    pub positions: smoother::Parameters,
}

/// What somebody does while a walk goes on.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// Everything begins anew: the tracker, and who follows.
    Reset,
    /// An order to the tracker.
    Order(Order),
    /// Who is followed is here, in the words of [`follow::parse_start`].
    Start(String),
}

/// Two values of signals are at least so far apart. **Units:** microseconds.
const SIGNAL_PERIOD_US: i64 = 5_000;

/// The positions that a recording brings along, in the frame of the building. Those that are of no use there are left out.
fn positions(
    recording: &Recording,
    building: Option<&Building>,
    settings: &Settings,
) -> Result<Option<Fusion>, follow::Error> {
    if recording.fixes.is_empty() {
        return Ok(None);
    }
    let mut fusion = Fusion::new(building, &settings.positions)?;
    for fix in &recording.fixes {
        // It is counted there.
        let _ = fusion.take(fix);
    }
    Ok(Some(fusion))
}

/// A recorded walk and where one is in it.
pub struct Walk {
    recording: Arc<Recording>,
    building: Option<Building>,
    /// Positions of other sources, of which none was heard yet.
    fusion: Option<Fusion>,
    settings: Settings,
    /// What was done, each with the number of items before it; in order.
    acts: Vec<(usize, Act)>,
    /// When each item was; never falls.
    times: Vec<Micros>,
    now: Moment,
    kept: Kept,
    history: History,
}

impl Walk {
    /// A walk at its beginning.
    ///
    /// # Errors
    /// As [`follow::Follower::new`].
    pub fn new(
        recording: Arc<Recording>,
        building: Option<Building>,
        settings: Settings,
    ) -> Result<Self, follow::Error> {
        let samples = recording.samples.iter().map(|sample| sample.time);
        let steps = recording.steps.iter().map(|step| step.stance_end);
        let mut times: Vec<Micros> = if recording.samples.is_empty() { steps.collect() } else { samples.collect() };
        let mut latest = Micros(i64::MIN);
        for time in &mut times {
            latest = latest.max(*time);
            *time = latest;
        }
        let fusion = positions(&recording, building.as_ref(), &settings)?;
        let now = Moment::first(building.as_ref(), fusion.as_ref(), &settings)?;
        let history = History::default();
        Ok(Self { recording, building, fusion, settings, acts: Vec::new(), times, now, kept: Kept::default(), history })
    }

    /// What is gone through.
    pub fn recording(&self) -> &Arc<Recording> {
        &self.recording
    }

    /// Where.
    pub fn building(&self) -> Option<&Building> {
        self.building.as_ref()
    }

    /// How.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What is known now.
    pub fn now(&self) -> &Moment {
        &self.now
    }

    /// Number of items.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there is nothing to go through.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// From the first item to the last.
    pub fn span(&self) -> [Micros; 2] {
        [self.times.first(), self.times.last()].map(|time| time.copied().unwrap_or(Micros(0)))
    }

    /// The time one is at.
    pub fn time(&self) -> Micros {
        let index = self.now.index.saturating_sub(1).min(self.len().saturating_sub(1));
        self.times.get(index).copied().unwrap_or(Micros(0))
    }

    /// What was done so far, each with the time at which it was done.
    pub fn acts(&self) -> impl Iterator<Item = (Micros, &Act)> {
        let time = |index: usize| self.times.get(index.saturating_sub(1)).copied().unwrap_or(Micros(0));
        self.acts.iter().map(move |(index, act)| (time(*index), act))
    }

    /// How many items there are until a time.
    pub fn index_at(&self, time: Micros) -> usize {
        self.times.partition_point(|at| *at <= time)
    }

    /// All signals up to the farthest moment that was computed.
    pub fn signals(&self) -> Signals {
        self.history.share()
    }

    /// Goes back, or ahead by what is kept: never beyond `index`, and as near to it as is possible at once.
    pub fn leap(&mut self, index: usize) {
        let time = self.times.get(index.saturating_sub(1)).copied().unwrap_or(Micros(0));
        let kept = self.kept.before(time, index);
        if let Some(kept) = kept.filter(|kept| self.now.index > index || kept.index > self.now.index) {
            self.now = kept.clone();
        } else if self.now.index > index {
            self.begin();
        }
    }

    /// Goes on until `index` items are taken in, or until it is `enough`. Whether it is there.
    pub fn go(&mut self, index: usize, mut enough: impl FnMut(&Moment) -> bool) -> bool {
        let end = index.min(self.len());
        while self.now.index < end {
            let steps = self.now.track.steps.len();
            self.advance();
            // A step costs far more than a sample.
            if (self.now.index.is_multiple_of(64) || steps != self.now.track.steps.len()) && enough(&self.now) {
                return self.now.index >= end;
            }
        }
        true
    }

    /// Does something at this moment of the walk.
    ///
    /// # Errors
    /// A start that means nothing in the building. Nothing changes then.
    pub fn act(&mut self, act: Act) -> Result<(), follow::Error> {
        let mut now = self.now.clone();
        self.apply(&act, &mut now)?;
        let index = self.now.index;
        let place = self.acts.partition_point(|(at, _)| *at <= index);
        self.acts.insert(place, (index, act));
        self.now = now;
        self.kept.forget_from(index);
        self.history.cut(self.time().as_seconds());
        Ok(())
    }

    /// Begins with other settings; whoever wants to be where one was goes there again.
    ///
    /// # Errors
    /// As [`follow::Follower::new`]. Nothing changes then.
    pub fn set(&mut self, settings: Settings) -> Result<(), follow::Error> {
        let first = Moment::first(self.building.as_ref(), self.fusion.as_ref(), &settings)?;
        self.settings = settings;
        self.kept = Kept::default();
        self.history = History::default();
        self.now = first;
        self.act_now();
        Ok(())
    }

    fn begin(&mut self) {
        // It was possible before, and nothing has changed.
        if let Ok(first) = Moment::first(self.building.as_ref(), self.fusion.as_ref(), &self.settings) {
            self.now = first;
            self.act_now();
        }
    }

    fn apply(&self, act: &Act, now: &mut Moment) -> Result<(), follow::Error> {
        let follower = now.follower.as_ref();
        let anew = |start: &str| follower.map(|follower| follower.anew(start)).transpose();
        match act {
            Act::Order(order) => {
                now.tracker.obey(*order);
                return Ok(());
            }
            Act::Reset => {
                now.follower = anew(&self.settings.follow.start)?;
                now.tracker.reset();
                now.track = Track::default();
                // Those that were heard are behind; steps count from here on.
                now.fusion = now.fusion.as_ref().map(Fusion::anew);
                now.stepped.clear();
                now.orders.forget_mode();
            }
            Act::Start(start) => now.follower = anew(start)?,
        }
        now.said = None;
        now.anchor = None;
        Ok(())
    }

    /// Does what was done at this moment before.
    fn act_now(&mut self) {
        let index = self.now.index;
        let first = self.acts.partition_point(|(at, _)| *at < index);
        let due = self.acts[first..].iter().take_while(|(at, _)| *at == index).map(|(_, act)| act.clone());
        for act in due.collect::<Vec<_>>() {
            let mut now = self.now.clone();
            // With other settings, what was possible may not be: then it has no effect.
            if self.apply(&act, &mut now).is_ok() {
                self.now = now;
            }
        }
    }

    fn advance(&mut self) {
        let recorded = &self.recording.orders[..];
        let now = &mut self.now;
        let time = self.times[now.index];
        match self.recording.samples.get(now.index) {
            Some(sample) => {
                let sample = self.settings.calibration.as_ref().map_or(*sample, |known| known.apply(sample, None));
                for order in now.orders.before(recorded, now.index) {
                    now.tracker.obey(order);
                }
                let before = now.tracker.velocity();
                let output = now.tracker.push(&sample);
                now.corrected = output.stance.then(|| (now.tracker.velocity() - before).norm());
                now.track.take(sample.time, &output);
                now.sample = Some(sample);
                now.stands_since = output.stance.then(|| now.stands_since.unwrap_or(time));
                now.stance = output.stance;
                if output.step.is_some()
                    && let Some(order) = now.follow(recorded)
                {
                    now.tracker.obey(order);
                }
                if now.index + 1 == self.times.len()
                    && let Some(step) = now.tracker.finish()
                {
                    now.track.add(step);
                    now.follow(recorded);
                }
            }
            None => {
                now.track.add(self.recording.steps[now.index]);
                now.follow(recorded);
                now.stance = true;
            }
        }
        now.index += 1;
        let due = self.history.end().is_none_or(|end| time.as_seconds() - end >= SIGNAL_PERIOD_US as f64 * 1e-6);
        if due || now.index == self.times.len() {
            self.history.push(time.as_seconds(), &now.row(time));
        }
        self.act_now();
        self.kept.offer(time, &self.now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::{generate, route};
    use crate::simulation::{Route, Scenario, SensorModel, Simulation};

    /// A walk in the twin, up the stairs.
    fn recording() -> Arc<Recording> {
        let building = generate::twin(2);
        let stops = route::plan(&building, &["W02", "hall", "stairs-E", "E14"]).unwrap();
        let route = Route::through(&building, &stops).unwrap();
        let mut sensor = SensorModel::bmx055_calibrated();
        (sensor.accel.rate, sensor.gyro.rate) = (400.0, 400.0);
        let scenario = Scenario { route, seed: 4, sensor, ..Scenario::default() };
        let samples = Simulation::new(&scenario).unwrap().map(|moment| moment.sample).collect();
        Arc::new(Recording { samples, ..Recording::default() })
    }

    fn walk(start: &str) -> Walk {
        let follow = follow::Settings { start: start.into(), ..follow::Settings::default() };
        Walk::new(recording(), Some(generate::twin(2)), Settings { follow, ..Settings::default() }).unwrap()
    }

    /// All that is known at a moment, to the last bit.
    fn known(walk: &Walk) -> String {
        let Moment { index, tracker, track, follower, said, anchor, stance, .. } = walk.now();
        let follower = follower.as_ref().unwrap();
        let particles = follower.particles();
        format!(
            "{index} {tracker:?} {:?} {said:?} {anchor:?} {stance} {particles:?} {:?} {:?}",
            track.stances,
            follower.path(),
            follower.past()
        )
    }

    fn at(walk: &mut Walk, share: f64) -> String {
        let index = (walk.len() as f64 * share) as usize;
        walk.leap(index);
        assert!(walk.go(index, |_| false));
        assert_eq!(walk.now().index, index);
        known(walk)
    }

    #[test]
    fn back_and_forth_shows_the_same() {
        let mut once = walk("W02");
        let mut jumped = walk("W02");
        let late = at(&mut jumped, 0.9);
        let early = at(&mut jumped, 0.35);
        assert_eq!(at(&mut once, 0.35), early);
        assert_eq!(at(&mut jumped, 1.0), at(&mut walk("W02"), 1.0));
        assert_eq!(at(&mut once, 0.9), late);
        assert_eq!(at(&mut jumped, 0.0), known(&walk("W02")));
        let [first, last] = once.signals().span().unwrap();
        let period = SIGNAL_PERIOD_US as f64 * 1e-6;
        assert!(first == once.span()[0].as_seconds() && once.time().as_seconds() - last <= period);
    }

    #[test]
    fn what_was_done_is_part_of_the_walk() {
        let mut acted = walk("anywhere");
        at(&mut acted, 0.3);
        let searching = acted.now().follower.as_ref().unwrap().particles().len();
        acted.act(Act::Start("W02".into())).unwrap();
        assert!(acted.now().follower.as_ref().unwrap().particles().len() < searching);
        let after = at(&mut acted, 0.5);
        acted.act(Act::Order(Order::Init)).unwrap();
        let late = at(&mut acted, 0.7);
        let before = at(&mut acted, 0.2);
        assert_eq!(before, at(&mut walk("anywhere"), 0.2));
        assert_eq!((at(&mut acted, 0.7), acted.acts().count()), (late, 2));
        // At the moment of an order, it has been given.
        assert_ne!(at(&mut acted, 0.5), after);
        let told = acted.act(Act::Start("nowhere".into())).unwrap_err().to_string();
        assert!(told.contains("nowhere") && acted.acts().count() == 2);
    }

    #[test]
    fn other_settings_count_from_the_beginning() {
        let mut changed = walk("W02");
        let index = changed.len() / 2;
        at(&mut changed, 0.5);
        let mut settings = changed.settings().clone();
        settings.tracker.stance.velocity_sigma = 0.02;
        changed.set(settings.clone()).unwrap();
        changed.go(index, |_| false);
        let mut anew = Walk::new(recording(), Some(generate::twin(2)), settings).unwrap();
        anew.go(index, |_| false);
        assert_eq!(known(&changed), known(&anew));
    }

    #[test]
    fn it_stops_when_it_is_enough_and_goes_on_from_there() {
        let mut walk = walk("W02");
        let mut calls = 0;
        assert!(!walk.go(usize::MAX, |_| {
            calls += 1;
            calls == 3
        }));
        assert!(walk.now().index > 0 && walk.now().index < walk.len());
        assert!(walk.go(1_000, |_| false) && walk.now().index == 1_000);
    }

    #[test]
    fn steps_alone_can_be_gone_through_and_nothing_too() {
        let mut whole = walk("W02");
        whole.go(usize::MAX, |_| false);
        let steps = whole.now().track.steps.clone();
        let alone = Recording { steps, ..Recording::default() };
        let mut walk = Walk::new(Arc::new(alone), Some(generate::twin(2)), whole.settings().clone()).unwrap();
        assert!(walk.go(usize::MAX, |_| false) && walk.now().attitude().is_none());
        assert_eq!(walk.now().track.stances.len(), whole.now().track.stances.len());
        let mut nothing = Walk::new(Arc::default(), None, Settings::default()).unwrap();
        nothing.leap(5);
        assert!(nothing.go(5, |_| false) && nothing.is_empty() && nothing.time() == Micros(0));
    }
}
