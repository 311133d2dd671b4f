//! Both ends of the wire, on good and bad lines.

use super::super::line::{Faults, Line};
use super::*;
use crate::simulation::random::{Purpose, Random};
use proptest::prelude::*;
use sohle_shared::calibration::Calibration;
use sohle_shared::tracker::{Order, Parameters};
use sohle_shared::wire::link::{Identity, Link, Request, ToShoeDecoder};
use sohle_shared::wire::message::{Ack, FromShoe, Outcome, Reply, SentStep, Status, TimeReply};
use sohle_shared::wire::outbox::{Outbox, Pace};
use sohle_shared::wire::port::Port;

const SESSION: u32 = 77;

fn hello(boot: u32, accepted: bool) -> Hello {
    let (firmware, board) = (text("1.2.3"), text("bench"));
    Hello { protocol: PROTOCOL, schema: SCHEMA, boot, accepted, firmware, board }
}

fn sent(boot: u32, id: u32) -> FromShoe {
    let step = sohle_shared::wire::packed::PackedStep::pack(&crate::link::endurance::step(
        id,
        Micros(1_000_000),
        &mut Random::new(u64::from(id), Purpose::MadeUpSteps),
    ));
    FromShoe::Step(SentStep { boot, id, oldest: 0, step })
}

fn hear(session: &mut Session, message: &FromShoe, millis: i64) {
    session.receive(encode(message, &mut [0; FRAME_MAX]).unwrap(), Micros(millis * 1_000));
}

fn said(session: &mut Session, millis: i64) -> Vec<ToShoe> {
    let now = Micros(millis * 1_000);
    let mut out = Vec::new();
    session.transmit(now, &mut out);
    assert!(session.deadline(now) > now, "all that was due has gone");
    let (mut decoder, mut bytes) = (ToShoeDecoder::new(), &out[..]);
    std::iter::from_fn(|| decoder.next(&mut bytes)).map(Result::unwrap).collect()
}

/// Times in milliseconds at which something is said until `end`, when asked only when due.
fn all_said(session: &mut Session, mut millis: i64, end: i64) -> Vec<(i64, ToShoe)> {
    let mut all = Vec::new();
    while millis < end {
        all.extend(said(session, millis).into_iter().map(|message| (millis, message)));
        millis = session.deadline(Micros(millis * 1_000)).0.div_euclid(1_000).max(millis + 1);
    }
    all
}

fn times(said: &[(i64, ToShoe)], kind: fn(&ToShoe) -> bool) -> Vec<i64> {
    said.iter().filter(|(_, message)| kind(message)).map(|&(millis, _)| millis).collect()
}

fn events(session: &mut Session) -> Vec<Event> {
    std::iter::from_fn(|| session.event()).collect()
}

fn ids(session: &mut Session) -> Vec<(u32, u32)> {
    let step = |event| match event {
        Event::Step { boot, id, .. } => Some((boot, id)),
        _ => None,
    };
    events(session).into_iter().filter_map(step).collect()
}

/// Answers the hello of the start; the questions of the burst have gone.
fn connected() -> Session {
    let mut session = Session::new(SESSION, "0.9");
    said(&mut session, 0);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 1);
    assert_eq!(events(&mut session), [Event::Connected(hello(1, true))]);
    all_said(&mut session, 1, 900);
    session
}

const IS_HELLO: fn(&ToShoe) -> bool = |message| matches!(message, ToShoe::Hello(_));
const IS_QUESTION: fn(&ToShoe) -> bool = |message| matches!(message, ToShoe::TimeRequest(_));
const IS_COMMAND: fn(&ToShoe) -> bool = |message| matches!(message, ToShoe::Command(_));

#[test]
fn hello_is_said_each_second_until_it_is_answered_and_again_on_a_line_opened_anew() {
    let mut session = Session::new(SESSION, "0.9");
    let all = all_said(&mut session, 0, 2_500);
    let own = LaptopHello { protocol: PROTOCOL, schema: SCHEMA, session: SESSION, software: text("0.9") };
    assert_eq!(all, [0, 1_000, 2_000].map(|millis| (millis, ToShoe::Hello(own.clone()))));
    // A shoe that has not heard it asks for it.
    hear(&mut session, &FromShoe::Hello(hello(1, false)), 2_500);
    assert_eq!(said(&mut session, 2_500), [ToShoe::Hello(own.clone())]);
    assert_eq!(events(&mut session), []);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 2_501);
    assert_eq!(times(&all_said(&mut session, 2_501, 5_000), IS_HELLO), [0; 0]);
    session.receive(&[0, 9, 9], Micros(5_000_000));
    session.reconnected();
    assert_eq!(said(&mut session, 5_001), [ToShoe::Hello(own)]);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 5_002);
    let connected = Event::Connected(hello(1, true));
    assert_eq!(events(&mut session), [connected.clone(), connected]);
}

#[test]
fn another_protocol_is_refused_in_words_until_the_firmware_is_replaced() {
    let mut session = Session::new(SESSION, "0.9");
    said(&mut session, 0);
    let other = Hello { schema: SCHEMA ^ 1, ..hello(1, false) };
    for millis in [1, 1_000, 2_000] {
        hear(&mut session, &FromShoe::Hello(other.clone()), millis);
        hear(&mut session, &sent(1, 0), millis);
    }
    assert_eq!(events(&mut session), [Event::Refused(other.clone())]);
    let told = mismatch(&other);
    assert!(told.contains("1.2.3") && told.contains(env!("CARGO_PKG_VERSION")) && told.contains("flash"), "{told}");
    hear(&mut session, &FromShoe::Hello(hello(2, false)), 3_000);
    assert!(IS_HELLO(&said(&mut session, 3_000)[0]));
    hear(&mut session, &FromShoe::Hello(hello(2, true)), 3_001);
    assert_eq!(events(&mut session), [Event::Connected(hello(2, true))]);
}

#[test]
fn steps_are_acknowledged_at_once_and_again_but_not_too_often() {
    let mut session = connected();
    let ack = |next, later| ToShoe::Ack(Ack { boot: 1, next, later });
    hear(&mut session, &sent(1, 0), 1_000);
    assert_eq!(said(&mut session, 1_000), [ack(1, 0)]);
    hear(&mut session, &sent(1, 2), 1_003);
    hear(&mut session, &sent(1, 0), 1_004);
    assert_eq!(all_said(&mut session, 1_004, 1_100), [(1_020, ack(1, 0b1))]);
    hear(&mut session, &sent(1, 1), 1_200);
    assert_eq!(said(&mut session, 1_200), [ack(3, 0)]);
    assert_eq!(ids(&mut session), [(1, 0), (1, 1), (1, 2)]);
    let Counters { steps, repeated, gaps, .. } = session.counters();
    assert_eq!((steps, repeated, gaps), (3, 1, 0));
}

#[test]
fn what_cannot_be_read_is_answered_with_what_the_shoe_may_not_have_heard() {
    let garbage = |session: &mut Session, millis: i64| session.receive(&[0, 9, 9, 0], Micros(millis * 1_000));
    let mut session = Session::new(SESSION, "0.9");
    assert_eq!(times(&all_said(&mut session, 0, 300), IS_HELLO), [0]);
    for millis in [300, 310, 390] {
        garbage(&mut session, millis);
    }
    assert_eq!(times(&all_said(&mut session, 390, 700), IS_HELLO), [390, 490, 590, 690]);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 700);
    assert_eq!(times(&all_said(&mut session, 700, 900), IS_HELLO), [0; 0]);
    let mut session = connected();
    garbage(&mut session, 950);
    assert_eq!(all_said(&mut session, 950, 1_000), [], "no step has come that could be acknowledged");
    hear(&mut session, &sent(1, 0), 1_000);
    let ack = ToShoe::Ack(Ack { boot: 1, next: 1, later: 0 });
    assert_eq!(said(&mut session, 1_000), std::slice::from_ref(&ack));
    for millis in [1_010, 1_050] {
        garbage(&mut session, millis);
    }
    assert_eq!(all_said(&mut session, 1_050, 1_200), [(1_100, ack)]);
    session.leave_steps();
    garbage(&mut session, 1_300);
    assert!(all_said(&mut session, 1_300, 1_500).iter().all(|(_, message)| IS_QUESTION(message)));
}

#[test]
fn the_time_is_asked_for_in_a_burst_then_now_and_then() {
    let mut session = Session::new(SESSION, "0.9");
    said(&mut session, 0);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 1);
    let mut asked = Vec::new();
    for millis in 1..8_000 {
        for message in said(&mut session, millis) {
            let ToShoe::TimeRequest(number) = message else { panic!("{message:?}") };
            asked.push(millis);
            // The answers of a whole second are lost.
            if !(5_000..6_000).contains(&millis) {
                let time = Micros(millis * 1_000 - 500);
                hear(&mut session, &FromShoe::TimeReply(TimeReply { number, received: time, sent: time }), millis);
            }
        }
    }
    assert_eq!(asked, [1, 51, 101, 151, 201, 251, 301, 351, 2_351, 4_351, 6_351]);
    assert_eq!(session.counters().round_trips, 11);
    assert_eq!(session.clock().to_host(Micros(0)), Some(Micros(500)));
    assert_eq!(times(&all_said(&mut session, 8_351, 9_400), IS_QUESTION), [8_351, 8_851, 9_351]);
}

#[test]
fn a_command_is_repeated_until_its_reply_comes_and_the_next_one_waits() {
    let mut session = connected();
    let numbers = [Action::Order(Order::Init), Action::Raw(true)].map(|action| session.command(action));
    let command = |number, action| ToShoe::Command(Command { session: SESSION, number, action });
    let all = all_said(&mut session, 1_000, 1_850);
    assert_eq!(times(&all, IS_HELLO), [0; 0]);
    assert_eq!(times(&all, IS_COMMAND), [1_000, 1_300, 1_600]);
    assert!(all.contains(&(1_600, command(numbers[0], Action::Order(Order::Init)))));
    let reply = |session, number| FromShoe::Reply(Reply { session, number, outcome: Outcome::Done });
    for (of, number) in [(SESSION + 1, numbers[0]), (SESSION, numbers[1])] {
        hear(&mut session, &reply(of, number), 1_850);
    }
    assert_eq!(events(&mut session), []);
    hear(&mut session, &reply(SESSION, numbers[0]), 1_851);
    hear(&mut session, &reply(SESSION, numbers[0]), 1_851);
    assert_eq!(events(&mut session), [Event::Reply { number: numbers[0], outcome: Outcome::Done }]);
    assert!(said(&mut session, 1_851).contains(&command(numbers[1], Action::Raw(true))));
    // Who does not answer four times may have forgotten the session.
    assert_eq!(times(&all_said(&mut session, 1_852, 3_000), IS_HELLO), [2_751]);
}

#[test]
fn a_rebooted_shoe_begins_anew_and_its_late_bytes_do_no_harm() {
    let mut session = connected();
    let request = session.questions.ask(Micros(1_000_000));
    let time = FromShoe::TimeReply(TimeReply { number: request, received: Micros(5), sent: Micros(6) });
    hear(&mut session, &time, 1_001);
    hear(&mut session, &sent(1, 0), 1_002);
    assert_eq!(ids(&mut session), [(1, 0)]);
    // Its hello was lost: the step is not taken, but asked about.
    hear(&mut session, &sent(2, 0), 2_000);
    assert!(events(&mut session).is_empty() && said(&mut session, 2_000).iter().any(IS_HELLO));
    hear(&mut session, &FromShoe::Hello(hello(2, true)), 2_001);
    assert_eq!(events(&mut session), [Event::Rebooted { boot: 2 }, Event::Connected(hello(2, true))]);
    assert_eq!(session.clock().to_host(Micros(0)), None);
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 2_002);
    hear(&mut session, &sent(1, 1), 2_003);
    hear(&mut session, &sent(2, 0), 2_004);
    hear(&mut session, &sent(1, 0), 2_005);
    assert_eq!(ids(&mut session), [(1, 1), (2, 0)]);
    assert!(said(&mut session, 2_050).contains(&ToShoe::Ack(Ack { boot: 2, next: 1, later: 0 })));
    // The other shoe is put on again: it goes on where it was.
    session.reconnected();
    hear(&mut session, &FromShoe::Hello(hello(1, true)), 3_000);
    hear(&mut session, &sent(1, 2), 3_001);
    assert!(said(&mut session, 3_001).contains(&ToShoe::Ack(Ack { boot: 1, next: 3, later: 0 })));
    assert_eq!(ids(&mut session), [(1, 2)]);
    assert_eq!(session.counters().reboots, 1);
}

#[test]
fn silence_is_told_and_its_end() {
    let mut session = connected();
    all_said(&mut session, 900, 3_000);
    assert_eq!(events(&mut session), []);
    all_said(&mut session, 3_000, 10_000);
    assert_eq!(events(&mut session), [Event::Silent]);
    session.receive(&[0, 1, 2, 3, 0], Micros(10_000_000));
    assert_eq!(events(&mut session), [], "garbage is nothing");
    hear(&mut session, &sent(1, 0), 10_001);
    assert!(matches!(events(&mut session)[..], [Event::Back, Event::Step { .. }]));
}

#[test]
fn a_shoe_that_sleeps_is_not_silent_and_one_that_is_gone_is() {
    let mut session = connected();
    let status = |asleep| Status { asleep, ..Status::default() };
    hear(&mut session, &FromShoe::Status(status(false)), 900);
    hear(&mut session, &FromShoe::Status(status(true)), 1_000);
    let told = events(&mut session);
    assert_eq!(told, [Event::Status(status(false)), Event::Asleep, Event::Status(status(true))]);
    // Two of three are lost.
    all_said(&mut session, 1_000, 16_000);
    hear(&mut session, &FromShoe::Status(status(true)), 16_000);
    assert_eq!(events(&mut session), [Event::Status(status(true))]);
    hear(&mut session, &FromShoe::Status(status(false)), 17_000);
    assert_eq!(events(&mut session), [Event::Woken, Event::Status(status(false))]);
    hear(&mut session, &FromShoe::Status(status(true)), 18_000);
    all_said(&mut session, 18_000, 40_000);
    let told = events(&mut session);
    assert_eq!(told, [Event::Asleep, Event::Status(status(true)), Event::Silent]);
}

#[test]
fn commands_are_carried_out_once_and_in_order_over_a_bad_line() {
    let faults =
        Faults { damage: 0.01, loss: 0.1, doubling: 0.1, overtaking: 0.1, delay_us: 2_000, ..Faults::default() };
    let line = |purpose| Line::new(faults.clone(), Random::new(5, purpose));
    let (mut to_shoe, mut from_shoe) = (line(Purpose::ToShoe), line(Purpose::FromShoe));
    let identity = Identity { boot: 1, firmware: "1.2.3", board: "bench" };
    let mut link: Link<4> =
        Link::new(identity, &Parameters::default(), &Calibration::default(), Outbox::new(0, Pace::default()));
    let mut session = Session::new(SESSION, "0.9");
    let orders = [Order::Init, Order::Track, Order::Reset, Order::FloorMode(None)].repeat(10);
    let numbers: Vec<_> = orders.iter().map(|&order| session.command(Action::Order(order))).collect();
    let (mut done, mut replied) = (Vec::new(), Vec::new());
    for now in (0..60_000_000).step_by(1_000).map(Micros) {
        link.receive(Port::Serial, &to_shoe.read(now), now);
        if let Some((_, Request::Order(order))) = link.request() {
            done.push(order);
            link.answer(Ok(()));
        }
        if let Some(frame) = link.transmit(Port::Serial, now, &mut [0; FRAME_MAX]) {
            from_shoe.write(frame, now);
        }
        session.receive(&from_shoe.read(now), now);
        replied.extend(events(&mut session).into_iter().filter_map(|event| match event {
            Event::Reply { number, .. } => Some(number),
            _ => None,
        }));
        let mut out = Vec::new();
        session.transmit(now, &mut out);
        to_shoe.write(&out, now);
    }
    assert_eq!((done, replied), (orders, numbers));
}

proptest! {
    #[test]
    fn nothing_that_comes_panics(
        chunks in proptest::collection::vec((proptest::collection::vec(any::<u8>(), 0..80), 0..4_u8, 0..10_000_i64), 0..60),
    ) {
        let mut session = connected();
        session.command(Action::Resend);
        for (bytes, kind, millis) in chunks {
            match (kind, bytes.first()) {
                (0, Some(&id)) => hear(&mut session, &sent(u32::from(id % 3), id.into()), millis),
                (1, Some(&boot)) => hear(&mut session, &FromShoe::Hello(hello(boot.into(), boot % 2 == 0)), millis),
                (2, _) => session.reconnected(),
                _ => session.receive(&bytes, Micros(millis * 1_000)),
            }
            said(&mut session, millis);
            events(&mut session);
        }
    }
}
