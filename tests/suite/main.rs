//! The tests over the whole registry and over the graphs that come with the program.

mod conformance;
mod golden;
mod graphs;
mod manual;
mod spec_lock;
mod tidy;
mod wanted;
