//! Two laptops at one shoe: what each of them may rely on, whatever the other does.

use super::golden;
use super::inbox::{Delivery, Inbox};
use super::outbox::{Outbox, Pace};
use super::packed::PackedStep;
use super::port::Port;
use crate::step::Step;
use crate::time::Micros;
use proptest::prelude::*;
use std::vec::Vec;

const BOOT: u32 = 5;
/// More steps than any of these walks has.
const ROOM: usize = 512;
/// Nothing is looked at more often.
const TICK_US: i64 = 5_000;

fn step(index: u32) -> PackedStep {
    PackedStep::pack(&Step { index, ..golden::step() })
}

/// A laptop and the way to it.
struct Laptop {
    port: Port,
    inbox: Inbox,
    /// In range.
    near: bool,
    /// Its connection is up: from the greeting until it is out of range.
    greeted: bool,
    /// One frame in so many is lost.
    loses: u32,
    random: u32,
    got: Vec<u32>,
    gaps: u32,
    /// The first step made after it had greeted, for the first time.
    since: Option<u32>,
}

impl Laptop {
    fn new(port: Port, seed: u32) -> Self {
        let (got, since) = (Vec::new(), None);
        Self {
            port,
            inbox: Inbox::new(BOOT),
            near: false,
            greeted: false,
            loses: u32::MAX,
            random: seed,
            got,
            gaps: 0,
            since,
        }
    }

    fn lost(&mut self) -> bool {
        self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        self.loses < u32::MAX && (self.random >> 8).is_multiple_of(self.loses)
    }

    /// What passes in a moment.
    fn meet<const N: usize, const PORTS: usize>(&mut self, outbox: &mut Outbox<N, PORTS>, made: u32, now: Micros) {
        if !self.near {
            self.greeted = false;
            return;
        }
        if !self.greeted && !self.lost() {
            outbox.hear(self.port, now);
            if self.since.is_none() {
                outbox.start_over(self.port, now);
                self.since = Some(made);
            }
            outbox.resend_all(self.port, now);
            self.greeted = true;
        }
        // Before it has greeted, nothing but hellos is sent.
        let Some(sent) = self.greeted.then(|| outbox.next(self.port, now)).flatten() else { return };
        if self.lost() {
            return;
        }
        self.inbox.push(&sent);
        while let Some(delivery) = self.inbox.pop() {
            match delivery {
                Delivery::Step { id, step } => {
                    assert_eq!(step.unpack().index, id);
                    self.got.push(id);
                }
                Delivery::Gap { count, .. } => self.gaps += count,
            }
        }
        if let Some(ack) = self.inbox.ack().filter(|_| !self.lost()) {
            outbox.hear(self.port, now);
            outbox.acknowledge(self.port, &ack, now);
        }
    }
}

/// What happens to a shoe with two laptops.
#[derive(Clone, Copy, Debug)]
enum Event {
    Step,
    Pass(i64),
    Near(bool, bool),
    Bad(bool, u32),
}

fn events() -> impl Strategy<Value = Vec<Event>> {
    let event = prop_oneof![
        4 => Just(Event::Step),
        4 => (0..400_i64).prop_map(Event::Pass),
        2 => any::<(bool, bool)>().prop_map(|(first, near)| Event::Near(first, near)),
        1 => any::<bool>().prop_flat_map(|first| (2..20_u32).prop_map(move |loses| Event::Bad(first, loses))),
    ];
    proptest::collection::vec(event, 1..120)
}

/// Two laptops, a shoe, and how many steps it has made.
struct Stage {
    outbox: Outbox<ROOM, 2>,
    laptops: [Laptop; 2],
    made: u32,
    now: Micros,
}

impl Stage {
    fn new(seed: u32) -> Self {
        let laptops = [(Port::Serial, 1), (Port::Radio, 2)].map(|(port, at)| Laptop::new(port, seed.wrapping_mul(at)));
        Self { outbox: Outbox::new(BOOT, Pace::SERIAL), laptops, made: 0, now: Micros(0) }
    }

    fn step(&mut self) {
        self.outbox.push(step(self.made));
        self.made += 1;
    }

    fn pass(&mut self, millis: i64) {
        let end = self.now + millis * 1_000;
        while self.now < end {
            self.now = self.now + TICK_US;
            self.laptops.iter_mut().for_each(|laptop| laptop.meet(&mut self.outbox, self.made, self.now));
        }
    }

    fn happen(&mut self, event: Event) {
        match event {
            Event::Step => self.step(),
            Event::Pass(millis) => self.pass(millis),
            Event::Near(first, near) => self.laptops[usize::from(!first)].near = near,
            Event::Bad(first, loses) => self.laptops[usize::from(!first)].loses = loses,
        }
    }
}

proptest! {
    #[test]
    fn each_laptop_gets_every_step_since_its_greeting_once_and_in_order(events in events(), seed in any::<u32>()) {
        let mut stage = Stage::new(seed);
        events.into_iter().for_each(|event| stage.happen(event));
        stage.laptops.iter_mut().for_each(|laptop| (laptop.near, laptop.loses) = (true, u32::MAX));
        stage.pass(20_000);
        for laptop in &stage.laptops {
            prop_assert!(laptop.got.is_sorted_by(|one, next| one + 1 == *next), "{:?}", laptop.got);
            prop_assert_eq!(laptop.gaps, 0);
            let since = laptop.since.unwrap();
            prop_assert!(since == stage.made || laptop.got.first().is_some_and(|&first| first <= since));
            prop_assert_eq!(laptop.got.last().copied(), stage.made.checked_sub(1).filter(|_| !laptop.got.is_empty()));
            prop_assert_eq!(stage.outbox.waiting(laptop.port), 0);
        }
        prop_assert!(stage.outbox.is_empty());
    }

    /// The steps and their times are those of a shoe that has no other laptop.
    #[test]
    fn a_laptop_does_not_notice_the_other(events in events(), seed in any::<u32>()) {
        let mut both = Stage::new(seed);
        let mut alone = Outbox::<ROOM>::new(BOOT, Pace::SERIAL);
        let mut laptop = Laptop::new(Port::Serial, seed);
        (both.laptops[0].near, laptop.near) = (true, true);
        for event in core::iter::once(Event::Pass(10)).chain(events) {
            both.happen(event);
            match event {
                Event::Step => alone.push(step(both.made - 1)),
                Event::Near(true, near) => laptop.near = near,
                Event::Bad(true, loses) => laptop.loses = loses,
                _ => {}
            }
            if let Event::Pass(millis) = event {
                let ticks = (millis * 1_000 + TICK_US - 1) / TICK_US;
                for tick in (0..ticks).rev() {
                    laptop.meet(&mut alone, both.made, both.now + -tick * TICK_US);
                }
            }
            prop_assert_eq!(&both.laptops[0].got, &laptop.got);
            prop_assert_eq!(both.laptops[0].random, laptop.random);
            prop_assert_eq!(both.outbox.waiting(Port::Serial), alone.waiting(Port::Serial));
            prop_assert_eq!(both.outbox.resent(Port::Serial), alone.resent(Port::Serial));
            prop_assert_eq!(both.outbox.deadline(Port::Serial, both.now), alone.deadline(Port::Serial, both.now));
        }
    }
}

#[test]
fn a_dead_laptop_is_waited_for_a_quarter_of_an_hour() {
    let mut stage = Stage::new(1);
    stage.laptops.iter_mut().for_each(|laptop| laptop.near = true);
    stage.pass(100);
    stage.laptops[1].near = false;
    // A step in two seconds: 450 in that time.
    let mut most = 0;
    for _ in 0..1_000 {
        stage.step();
        stage.pass(2_000);
        most = most.max(stage.outbox.len());
    }
    assert!((440..=460).contains(&most), "{most}");
    assert!(stage.outbox.is_empty(), "{}", stage.outbox.len());
    let [alive, _] = &stage.laptops;
    assert_eq!((alive.got.len(), alive.gaps), (1_000, 0));
    assert_eq!((stage.outbox.dropped(Port::Serial), stage.outbox.dropped(Port::Radio)), (0, 0));
    // It comes back, and gets what is made from then on.
    stage.laptops[1].near = true;
    stage.pass(100);
    stage.step();
    stage.pass(1_000);
    assert_eq!(stage.laptops[1].got, [1_000]);
}

#[test]
fn after_ten_minutes_out_of_range_nothing_is_missing() {
    let mut stage = Stage::new(1);
    stage.laptops.iter_mut().for_each(|laptop| laptop.near = true);
    stage.pass(100);
    stage.laptops[1].near = false;
    for _ in 0..400 {
        stage.step();
        stage.pass(1_500);
    }
    stage.laptops[1].near = true;
    stage.pass(10_000);
    for laptop in &stage.laptops {
        assert_eq!((laptop.got.len(), laptop.gaps), (400, 0));
    }
    assert!(stage.outbox.is_empty());
}

#[test]
fn what_nobody_has_is_kept_however_long_nobody_is_there() {
    let mut stage = Stage::new(1);
    stage.laptops[0].near = true;
    stage.pass(100);
    stage.laptops[0].near = false;
    for _ in 0..300 {
        stage.step();
        stage.pass(10_000);
    }
    stage.laptops[1].near = true;
    stage.pass(10_000);
    stage.laptops[0].near = true;
    stage.pass(10_000);
    assert_eq!(stage.laptops[1].got.len(), 300);
    assert!(stage.outbox.is_empty());
}
