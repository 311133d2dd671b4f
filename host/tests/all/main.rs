//! The program and the library from outside. One program for all of them: it is linked once.

mod building;
mod cli;
mod command;
mod evaluate;
mod fixes;
mod graph;
mod live;
mod map;
mod phone;
mod place;
mod window;
