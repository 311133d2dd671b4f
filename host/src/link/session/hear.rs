//! What comes from the shoe.

use super::{ACK_US, BOOTS, Event, HELLO_US, SAID_AGAIN_US, Session};
use crate::link::clock::Clock;
use sohle_shared::time::Micros;
use sohle_shared::wire::inbox::{Delivery, Inbox};
use sohle_shared::wire::message::{Command, FromShoe, Hello, Reply, SentStep};
use sohle_shared::wire::{PROTOCOL, SCHEMA};

impl Session {
    /// Takes in bytes of the shoe, in whatever pieces they come.
    pub fn receive(&mut self, mut bytes: &[u8], now: Micros) {
        self.advance(now);
        while let Some(frame) = self.decoder.next(&mut bytes) {
            let Ok(message) = frame else {
                self.unreadable(now);
                continue;
            };
            (self.heard, self.garbled) = (Some(now), false);
            if std::mem::take(&mut self.silent) {
                self.events.push_back(Event::Back);
            }
            match message {
                FromShoe::Hello(hello) => self.greet(hello, now),
                FromShoe::Step(sent) => self.step(&sent, now),
                _ if !self.greeted => {}
                FromShoe::Reply(reply) => self.reply(reply, now),
                FromShoe::TimeReply(reply) => {
                    if let Some(asked) = self.questions.answered(reply.number) {
                        self.clock.exchange(asked, &reply, now);
                        self.counters.round_trips += 1;
                    }
                }
                FromShoe::Raw(raw) => self.events.push_back(Event::Raw(raw)),
                FromShoe::Attitude(attitude) => self.events.push_back(Event::Attitude(attitude)),
                FromShoe::Status(status) => {
                    if status.asleep != self.asleep {
                        self.asleep = status.asleep;
                        self.events.push_back(if status.asleep { Event::Asleep } else { Event::Woken });
                    }
                    self.events.push_back(Event::Status(status));
                }
                FromShoe::Log(log) => self.events.push_back(Event::Log(log)),
            }
        }
    }

    pub(super) fn advance(&mut self, now: Micros) {
        self.now = now;
        self.clock.advance(now);
        let heard = *self.heard.get_or_insert(now);
        if !self.silent && now - heard >= self.silence_us() {
            self.silent = true;
            self.events.push_back(Event::Silent);
        }
    }

    /// Whatever it was, the shoe may say it since it has not heard us.
    fn unreadable(&mut self, now: Micros) {
        self.garbled = true;
        if self.hello_due.is_some() {
            self.ask_for_hello(now, SAID_AGAIN_US);
        } else if self.greeted && self.takes_steps {
            let due = now.max(self.ack_sent + SAID_AGAIN_US);
            self.ack_due = Some(self.ack_due.map_or(due, |planned| planned.min(due)));
        }
    }

    fn greet(&mut self, hello: Hello, now: Micros) {
        if (hello.protocol, hello.schema) != (PROTOCOL, SCHEMA) {
            // Such a shoe goes on to say hello: we shall hear when it has another firmware.
            (self.greeted, self.hello_due) = (false, None);
            if self.refused.as_ref() != Some(&hello) {
                self.events.push_back(Event::Refused(hello.clone()));
                self.refused = Some(hello);
            }
            return;
        }
        let current = self.boots.back().map(Inbox::boot);
        if current != Some(hello.boot) {
            let known = self.boots.iter().position(|inbox| inbox.boot() == hello.boot);
            match known.map(|at| (at, self.reopened)) {
                // A hello that was long on its way: nothing boots twice by the same number.
                Some((_, false)) => return,
                // Another shoe that was there before.
                Some((at, true)) => self.boots.rotate_left(at + 1),
                None => self.meet(hello.boot, current.is_some()),
            }
            self.clock = Clock::default();
            (self.greeted, self.ack_due, self.asleep) = (false, None, false);
            self.questions.forget();
        }
        self.refused = None;
        if !hello.accepted {
            self.ask_for_hello(now, SAID_AGAIN_US);
            return;
        }
        (self.hello_due, self.reopened) = (None, false);
        if !self.greeted {
            self.greeted = true;
            self.questions.begin(now);
            self.command_due = now;
            self.events.push_back(Event::Connected(hello));
        }
    }

    fn meet(&mut self, boot: u32, rebooted: bool) {
        if self.boots.len() == BOOTS {
            self.boots.pop_front();
        }
        self.boots.push_back(Inbox::new(boot));
        if rebooted {
            self.counters.reboots += 1;
            self.events.push_back(Event::Rebooted { boot });
        }
    }

    /// Makes a hello due, so long after the last one.
    pub(super) fn ask_for_hello(&mut self, now: Micros, spacing_us: i64) {
        let due = self.hello_sent.map_or(now, |sent| now.max(sent + spacing_us));
        self.hello_due = Some(self.hello_due.map_or(due, |planned| planned.min(due)));
    }

    fn step(&mut self, sent: &SentStep, now: Micros) {
        let Some(inbox) = self.boots.iter_mut().find(|inbox| inbox.boot() == sent.boot) else {
            // The hello that told of this boot was lost. The step comes again.
            self.ask_for_hello(now, HELLO_US);
            return;
        };
        self.counters.repeated += u64::from(!inbox.push(sent));
        while let Some(delivery) = inbox.pop() {
            let boot = sent.boot;
            self.events.push_back(match delivery {
                Delivery::Step { id, step } => {
                    self.counters.steps += 1;
                    Event::Step { boot, id, step }
                }
                Delivery::Gap { first, count } => {
                    self.counters.gaps += u64::from(count);
                    Event::Gap { boot, first, count }
                }
            });
        }
        if self.takes_steps {
            self.ack_due.get_or_insert(now.max(self.ack_sent + ACK_US));
        }
    }

    fn reply(&mut self, reply: Reply, now: Micros) {
        let awaited = |command: &mut Command| (reply.session, reply.number) == (command.session, command.number);
        if self.tries > 0 && self.commands.pop_front_if(awaited).is_some() {
            self.events.push_back(Event::Reply { number: reply.number, outcome: reply.outcome });
            (self.command_due, self.tries) = (now, 0);
        }
    }
}
