//! Whether every step arrives, whatever the line does: both ends of the wire over a simulated line.
//!
//! Steps that nobody walked go into the shoe's [`Link`], one in about 1.1 s; a [`Session`] takes them out at the other end of
//! two [`Line`]s. Time is simulated, the shoe's clock with another start and a drift.

use super::line::{Faults, Line};
use super::session::{Event, Session};
use crate::simulation::random::{Purpose, Random};
use nalgebra::{Matrix4, Vector3, Vector4};
use sohle_shared::calibration::Calibration;
use sohle_shared::step::Step;
use sohle_shared::time::Micros;
use sohle_shared::tracker::Parameters;
use sohle_shared::wire::frame::FRAME_MAX;
use sohle_shared::wire::link::{Identity, Link};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::packed::PackedStep;
use sohle_shared::wire::port::Port;
use std::collections::BTreeMap;
use std::ops::Range;

/// Mean time from one step to the next. **Units:** microseconds.
const STRIDE_US: f64 = 1_100_000.0;
/// Length of the silence.
const SILENCE_US: i64 = 600_000_000;
/// Length of that before the program is started anew.
const SHORT_SILENCE_US: i64 = 60_000_000;
/// The program ends when fewer steps wait: half of what a minute brings.
const HALF_FETCHED: usize = 28;
/// How long the shoe or the program takes to start again.
const START_US: i64 = 2_000_000;
/// After the last step: enough to notice the end of a silence and to fetch what is missing.
const REST_US: i64 = 60_000_000;
/// Nothing is looked at more often.
const TICK_US: i64 = 200;
/// How much faster than the laptop's the shoe's clock runs. **Units:** s/s.
const DRIFT: f64 = 50e-6;

/// What befalls the line or its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Nothing.
    Clean,
    /// One byte in a hundred is damaged.
    Damaged,
    /// One frame in ten is lost.
    Lossy,
    /// Both, and one piece in twenty comes twice, another one late.
    Both,
    /// As [`Kind::Both`], with ten minutes of silence in the middle.
    Silence,
    /// As [`Kind::Both`]; in the middle the laptop's program is started anew, while it fetches the steps of a minute of
    /// silence.
    Restart,
    /// As [`Kind::Both`]; in the middle the shoe is.
    Reboot,
    /// One bit in a hundred is flipped: a step comes whole once in a hundred times.
    Flipped,
    /// As [`Kind::Flipped`], and one frame in ten is lost.
    FlippedLossy,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Clean,
        Self::Damaged,
        Self::Lossy,
        Self::Both,
        Self::Silence,
        Self::Restart,
        Self::Reboot,
        Self::Flipped,
        Self::FlippedLossy,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Clean => "clean line",
            Self::Damaged => "1 % of bytes damaged",
            Self::Lossy => "10 % of frames lost",
            Self::Both => "both, doubled and late pieces",
            Self::Silence => "these, and 10 min of silence",
            Self::Restart => "these, and the program restarted",
            Self::Reboot => "these, and the shoe rebooted",
            Self::Flipped => "1 % of bits flipped",
            Self::FlippedLossy => "these, and 10 % of frames lost",
        }
    }

    fn faults(self, middle: Micros) -> Faults {
        let clean = Faults { delay_us: 2_000, jitter_us: 3_000.0, ..Faults::default() };
        match self {
            Self::Clean => clean,
            Self::Damaged => Faults { damage: 0.01, ..clean },
            Self::Lossy => Faults { loss: 0.1, ..clean },
            Self::Flipped => Faults { flips: 0.01, ..clean },
            Self::FlippedLossy => Faults { flips: 0.01, loss: 0.1, ..clean },
            _ => {
                let silence = match self {
                    Self::Silence => middle..middle + SILENCE_US,
                    Self::Restart => middle + -SHORT_SILENCE_US..middle,
                    _ => Micros(0)..Micros(0),
                };
                Faults { damage: 0.01, loss: 0.1, doubling: 0.05, overtaking: 0.05, silence, ..clean }
            }
        }
    }
}

/// What became of the steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Tally {
    /// Steps that the shoe made.
    pub made: u32,
    /// Of them arrived.
    pub arrived: u32,
    /// Did not arrive, though the shoe that made them ran on.
    pub lost: u32,
    /// Were in the memory of the shoe, not yet acknowledged, when it was rebooted, and did not arrive.
    pub erased: u32,
    /// Came again. Steps that the program of before had not yet acknowledged may come once more to the one after it.
    pub doubled: u32,
    /// Came with other bits, or were never made.
    pub wrong: u32,
    /// From the making to the arrival. **Units:** s.
    pub delay_median_s: f64,
    /// The longest. **Units:** s.
    pub delay_max_s: f64,
    /// Largest error of the shoe's clock as the laptop sees it when a step arrives. **Units:** s.
    pub clock_error_max_s: f64,
    /// Largest excess of that error over its bound. **Units:** s.
    pub clock_excess_max_s: f64,
    /// Written by the shoe. **Units:** bytes.
    pub bytes: u64,
}

/// A step that was made.
struct Made {
    step: PackedStep,
    time: Micros,
    arrival: Option<Micros>,
    /// May come once more.
    again: bool,
}

/// The shoe: its end of the wire and its clock.
struct Shoe {
    boot: u32,
    link: Link<1_024>,
    started: Micros,
}

impl Shoe {
    fn new(boot: u32, started: Micros) -> Self {
        let identity = Identity { boot, firmware: "endurance", board: "simulated" };
        let link =
            Link::new(identity, &Parameters::default(), &Calibration::default(), Outbox::new(boot, Pace::default()));
        Self { boot, link, started }
    }

    fn time(&self, now: Micros) -> Micros {
        let since = now - self.started;
        Micros(since + (since as f64 * DRIFT) as i64)
    }

    /// When the link is to be asked again, by the laptop's clock.
    fn deadline(&self, now: Micros) -> Option<Micros> {
        let due = self.link.deadline(Port::Serial, self.time(now));
        (due < Micros(i64::MAX)).then(|| now + ((due - self.time(now)) as f64 / (1.0 + DRIFT)).ceil() as i64)
    }
}

struct Run {
    now: Micros,
    shoe: Shoe,
    session: Session,
    to_shoe: Line,
    from_shoe: Line,
    steps: Random,
    /// By boot; the place is the number of the step.
    made: BTreeMap<u32, Vec<Made>>,
    erased: Option<(u32, Range<usize>)>,
    tally: Tally,
}

/// Lets so many steps be made. All that is random follows from `seed`.
pub fn run(kind: Kind, steps: u32, seed: u64) -> Tally {
    let middle = Micros((f64::from(steps) * STRIDE_US / 2.0) as i64);
    let line = |purpose| Line::new(kind.faults(middle), Random::new(seed, purpose));
    let mut run = Run {
        now: Micros(0),
        shoe: Shoe::new(1, Micros(0)),
        session: Session::new(1, "endurance"),
        to_shoe: line(Purpose::ToShoe),
        from_shoe: line(Purpose::FromShoe),
        steps: Random::new(seed, Purpose::MadeUpSteps),
        made: BTreeMap::new(),
        erased: None,
        tally: Tally::default(),
    };
    // Whether the program is off (its port is closed) or the shoe is, until then.
    let (mut program_off, mut shoe_off) = (None, None);
    let mut fate = matches!(kind, Kind::Restart | Kind::Reboot).then_some(middle);
    let mut step_due = Micros(STRIDE_US as i64);
    let mut end = Micros(i64::MAX);
    while run.now < end {
        let now = run.now;
        let ripe = kind == Kind::Reboot || run.shoe.link.waiting(Port::Serial) < HALF_FETCHED;
        if ripe && fate.is_some_and(|fate| fate <= now) {
            fate = None;
            if kind == Kind::Restart {
                run.restart_program();
                program_off = Some(now + START_US);
            } else {
                run.reboot_shoe();
                shoe_off = Some(now + START_US);
            }
        }
        program_off = program_off.filter(|&until| now < until);
        shoe_off = shoe_off.filter(|&until| now < until);
        if step_due <= now {
            if shoe_off.is_none() {
                run.make_step();
            }
            step_due = step_due + (STRIDE_US * (1.0 + 0.2 * run.steps.symmetric())) as i64;
            if run.tally.made == steps {
                step_due = Micros(i64::MAX);
                // A short run ends in the middle of the silence.
                let silence = if kind == Kind::Silence { middle + SILENCE_US } else { now };
                end = silence.max(now) + REST_US;
            }
        }
        run.shoe(shoe_off.is_none());
        run.laptop(program_off.is_none());
        let next = [
            Some(step_due),
            fate,
            program_off,
            shoe_off,
            run.to_shoe.arrival(),
            run.from_shoe.arrival(),
            shoe_off.is_none().then(|| run.shoe.deadline(now)).flatten(),
            program_off.is_none().then(|| run.session.deadline(now)),
        ];
        run.now = next.into_iter().flatten().fold(end, Micros::min).max(now + TICK_US);
    }
    run.finish()
}

impl Run {
    fn make_step(&mut self) {
        let number = self.made.get(&self.shoe.boot).map_or(0, Vec::len) as u32;
        let step = step(number, self.shoe.time(self.now), &mut self.steps);
        self.shoe.link.push(&step);
        let made = Made { step: PackedStep::pack(&step), time: self.now, arrival: None, again: false };
        self.made.entry(self.shoe.boot).or_default().push(made);
        self.tally.made += 1;
    }

    fn shoe(&mut self, on: bool) {
        let bytes = self.to_shoe.read(self.now);
        if !on {
            return;
        }
        let time = self.shoe.time(self.now);
        self.shoe.link.receive(Port::Serial, &bytes, time);
        let mut buffer = [0; FRAME_MAX];
        while let Some(frame) = self.shoe.link.transmit(Port::Serial, time, &mut buffer) {
            self.tally.bytes += frame.len() as u64;
            self.from_shoe.write(frame, self.now);
        }
    }

    fn laptop(&mut self, on: bool) {
        let bytes = self.from_shoe.read(self.now);
        if !on {
            return;
        }
        self.session.receive(&bytes, self.now);
        while let Some(event) = self.session.event() {
            if let Event::Step { boot, id, step } = event {
                self.arrive(boot, id, &step);
            }
        }
        let mut out = Vec::new();
        self.session.transmit(self.now, &mut out);
        self.to_shoe.write(&out, self.now);
    }

    fn arrive(&mut self, boot: u32, id: u32, step: &PackedStep) {
        let made = self.made.get_mut(&boot).and_then(|made| made.get_mut(id as usize));
        let Some(made) = made.filter(|made| made.step == *step) else {
            self.tally.wrong += 1;
            return;
        };
        if made.arrival.is_none() {
            made.arrival = Some(self.now);
        } else if !std::mem::take(&mut made.again) {
            self.tally.doubled += 1;
        }
        let clock = self.session.clock();
        // Steps of the boot before have another clock.
        if boot == self.shoe.boot
            && let (Some(host), Some(bound)) = (clock.to_host(self.shoe.time(self.now)), clock.error_bound())
        {
            let error = (host - self.now).abs() as f64 * 1e-6;
            self.tally.clock_error_max_s = self.tally.clock_error_max_s.max(error);
            self.tally.clock_excess_max_s = self.tally.clock_excess_max_s.max(error - bound);
        }
    }

    /// The numbers of the steps that the shoe keeps.
    fn kept(&self) -> Range<usize> {
        let made = self.made.get(&self.shoe.boot).map_or(0, Vec::len);
        made - self.shoe.link.waiting(Port::Serial)..made
    }

    fn restart_program(&mut self) {
        let kept = self.kept();
        for made in self.made.get_mut(&self.shoe.boot).into_iter().flat_map(|made| &mut made[kept.clone()]) {
            made.again = made.arrival.is_some();
        }
        self.session = Session::new(2, "endurance");
    }

    fn reboot_shoe(&mut self) {
        self.erased = Some((self.shoe.boot, self.kept()));
        self.shoe = Shoe::new(self.shoe.boot + 1, self.now);
    }

    fn finish(self) -> Tally {
        let mut tally = self.tally;
        let mut delays = Vec::new();
        for (&boot, made) in &self.made {
            for (number, made) in made.iter().enumerate() {
                let erased = self.erased.as_ref().is_some_and(|(of, kept)| *of == boot && kept.contains(&number));
                match made.arrival {
                    Some(arrival) => delays.push((arrival - made.time) as f64 * 1e-6),
                    None if erased => tally.erased += 1,
                    None => tally.lost += 1,
                }
            }
        }
        delays.sort_by(f64::total_cmp);
        tally.arrived = delays.len() as u32;
        tally.delay_median_s = delays.get(delays.len() / 2).copied().unwrap_or(f64::NAN);
        tally.delay_max_s = delays.last().copied().unwrap_or(f64::NAN);
        tally
    }
}

/// A step that nobody walked.
pub(super) fn step(index: u32, stance_end: Micros, random: &mut Random) -> Step {
    let vary = |random: &mut Random, size: f64| (size * random.symmetric()) as f32;
    let displacement = Vector3::new(1.3 + vary(random, 0.2), vary(random, 0.1), vary(random, 0.2));
    let sigmas = Vector4::from_fn(|_, _| 1e-4 + vary(random, 5e-5));
    Step {
        index,
        stance_start: stance_end + -400_000,
        stance_end,
        displacement,
        turn: vary(random, 1.0),
        covariance: Matrix4::from_diagonal(&sigmas),
        mode: Default::default(),
        quality: Default::default(),
        clipped: Default::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_step_is_lost_doubled_or_wrong() {
        for kind in Kind::ALL {
            for seed in 0..8 {
                let tally = run(kind, 150, seed);
                let Tally { made, arrived, lost, erased, doubled, wrong, .. } = tally;
                assert_eq!((made, lost, doubled, wrong), (150, 0, 0, 0), "{kind:?} {seed}: {tally:?}");
                assert_eq!(arrived + erased, made);
                // One is on its way at a time, or two while the line is bad.
                assert!(erased <= if kind == Kind::Reboot { 2 } else { 0 }, "{kind:?} {seed}: {tally:?}");
                // Rounding of two clocks to microseconds.
                assert!(tally.clock_excess_max_s < 3e-6, "{kind:?} {seed}: {tally:?}");
            }
        }
    }

    #[test]
    fn an_hour_with_one_bit_in_a_hundred_flipped_loses_nothing() {
        for kind in [Kind::Flipped, Kind::FlippedLossy] {
            for seed in 1..=4 {
                let tally = run(kind, 3_273, seed);
                let Tally { arrived, lost, doubled, wrong, .. } = tally;
                assert_eq!((arrived, lost, doubled, wrong), (3_273, 0, 0, 0), "{kind:?} {seed}: {tally:?}");
                // Three copies, 100 ms from one to the next, and as many again where those do not do.
                assert!(tally.delay_median_s < 0.6, "{kind:?} {seed}: {tally:?}");
                assert!(tally.clock_excess_max_s < 3e-6, "{kind:?} {seed}: {tally:?}");
            }
        }
    }

    #[test]
    fn the_line_is_as_bad_as_told() {
        let [clean, lossy, silence] = [Kind::Clean, Kind::Lossy, Kind::Silence].map(|kind| run(kind, 100, 1));
        assert!(clean.delay_max_s < 0.1 && lossy.delay_max_s > 0.05 && silence.delay_max_s > 590.0);
        assert!(lossy.bytes > clean.bytes && clean.bytes > 100 * 50);
    }

    #[test]
    fn the_same_seed_gives_the_same() {
        assert_eq!(run(Kind::Both, 50, 4), run(Kind::Both, 50, 4));
        assert_ne!(run(Kind::Both, 50, 4), run(Kind::Both, 50, 5));
    }
}
