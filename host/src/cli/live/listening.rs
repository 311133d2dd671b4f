//! A shoe that is listened to: it is given what it is to have, and told its floor mode.

use super::places::Places;
use super::show::Show;
use crate::cli::Error;
use crate::link::Connection;
use crate::link::connection::Happening;
use crate::recording::live::{CALIBRATION, PARAMETERS};
use sohle_shared::tracker::Order;
use sohle_shared::wire::message::Action;
use sohle_shared::wire::transfer::{Item, Value};
use std::time::Duration;

/// A connection, and what is made of what comes over it.
pub struct Listening {
    connection: Connection,
    show: Show,
    /// What a shoe is given when it starts.
    values: Vec<Value>,
    /// Whether it is to tell the counts of its sensor.
    raw: bool,
    /// The boot that was given everything.
    prepared: Option<u32>,
}

impl Listening {
    /// Begins to listen. `values` are what a shoe is given when it starts; with `raw` it is to tell the counts of its sensor.
    pub fn new(connection: Connection, show: Show, values: Vec<Value>, raw: bool) -> Self {
        Self { connection, show, values, raw, prepared: None }
    }

    /// The connection.
    pub fn connection(&self) -> &Connection {
        &self.connection
    }

    /// What is made of it.
    pub fn show(&self) -> &Show {
        &self.show
    }

    /// The same, to be changed.
    pub fn show_mut(&mut self) -> &mut Show {
        &mut self.show
    }

    /// Gives the tracker of the shoe an order; the answer comes as an event with the number that is returned.
    pub fn order(&mut self, order: Order) -> u32 {
        if order == Order::Reset {
            self.show.shoe_forgot();
        }
        self.connection.tell(Action::Order(order))
    }

    /// Does what is due and takes in what happens next, if something does within `patience`; `watch` sees it before.
    pub fn turn(&mut self, patience: Duration, watch: impl FnOnce(&Happening, &Connection)) -> Result<(), Error> {
        let show = &mut self.show;
        if let Some(fault) = show.fault.take() {
            return Err(Error::new(fault));
        }
        if show.boot.is_some() && show.boot != self.prepared {
            self.prepared = show.boot;
            self.prepare()?;
            // What an earlier program told it, or the reset took away.
            self.show.shoe_forgot();
        }
        let Self { connection, show, .. } = self;
        if show.boot.is_some()
            && let Some(mode) = show.mode_due()
        {
            let number = connection.tell(Action::Order(Order::FloorMode(mode)));
            show.mode_sent(number, mode);
        }
        let happening = connection.next(patience);
        show.hear(connection);
        if let Some(happening) = happening {
            watch(&happening, connection);
            show.take(happening, connection);
        }
        Ok(())
    }

    /// Gives a shoe that has just started what it is to have, and turns raw counts on.
    fn prepare(&mut self) -> Result<(), Error> {
        let Self { connection, show, values, raw, .. } = self;
        for value in values {
            connection.write(value, &mut |happening, connection| show.take(happening, connection))?;
        }
        if !*raw {
            return Ok(());
        }
        for item in [Item::Parameters, Item::Calibration] {
            let value = connection.read(item, &mut |happening, connection| show.take(happening, connection))?;
            let (key, text) = match value {
                Value::Parameters(parameters) => (PARAMETERS, toml::to_string(&parameters)?),
                Value::Calibration(calibration) => (CALIBRATION, toml::to_string(&calibration)?),
            };
            if let Some(recorder) = &mut show.recorder {
                recorder.about(key, text);
            }
        }
        connection.ask(Action::Raw(true), &mut |happening, connection| show.take(happening, connection))?;
        Ok(())
    }

    /// Leaves the shoe to itself.
    pub fn take_leave(&mut self) {
        let Self { connection, show, raw, .. } = self;
        if show.places.as_ref().is_some_and(Places::holds_a_mode) {
            // Who is not followed any more decides alone; a shoe that does not hear it is freed by the next program.
            let free = Action::Order(Order::FloorMode(None));
            let _ = connection.ask(free, &mut |happening, connection| show.take(happening, connection));
        }
        if *raw && show.boot.is_some() {
            // If the shoe does not hear it, the next program that says hello ends it.
            let _ = connection.ask(Action::Raw(false), &mut |happening, connection| show.take(happening, connection));
        }
    }

    /// The connection, and what was made of it.
    pub fn into_parts(self) -> (Connection, Show) {
        (self.connection, self.show)
    }
}
