//! The tests of the whole registry and of the graphs that come with the program.

mod chains;
mod conformance;
mod generators;
mod golden;
mod gpu;
mod graphs;
mod ledger;
mod manual;
mod phrases;
mod spec_lock;
mod tidy;
mod wanted;
