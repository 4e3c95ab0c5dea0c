//! Orograph's core: values, node declarations, the graph, its file and its evaluation. It is independent of terrain.
//!
//! - [`Value`] and [`Field`]: the values that wires carry, typed by meaning ([`PortType`]).
//! - [`Node`]: the declaration of one kind of node as plain data; a [`Registry`] holds them.
//! - [`Graph`]: node instances and wires, checked as they are connected.
//! - [`Document`]: the graph as a file; all its problems as [`Diagnostic`]s.
//! - [`Evaluator`]: builds outputs of a graph and caches results.
//! - [`gpu`]: kernels for a GPU as plain data; an executor for them is a [`Backend`].
//! - [`files`]: files that appear whole, and sets of files that appear together; [`input`]: opening files to read.
//! - [`memory`]: allocation of rasters; [`machine`]: how much memory there is.

mod averaging;
mod backend;
mod colour;
mod device;
mod diagnostic;
mod document;
mod eval;
mod field;
pub mod files;
mod given;
pub mod gpu;
mod graph;
pub mod input;
mod job;
mod lines;
pub mod machine;
pub mod memory;
mod migrate;
mod node;
mod param;
mod ports;
mod process;
mod registry;
mod report;
mod state;
mod stated;
mod strata;
mod suggest;
mod unit;
mod value;
mod world;

pub use averaging::Averaging;
pub use backend::{Backend, Cpu, Prefer};
pub use colour::{NoColour, Srgb, Stop};
pub use device::{DeviceError, DeviceSamples, WeakSamples};
pub use diagnostic::{Diagnostic, Severity, line_column};
pub use document::{
    Document, Edit, EditError, Expanded, Expectation, Expectations, Extract, Extracted, Frame, FrameEntry, History,
    Inlined, JournalEntry, JournalError, JournalWriter, LoadError, LooseWire, NamedInput, NamedParameter, NodeEntry,
    OutputDecl, Place, Recovered, Reroute, SUBGRAPH, Splice, Statistics, UsedGraph, diff, format_source, fresh_name,
    recover,
};
pub use eval::{
    Delivered, Delivery, EvalError, Evaluation, Evaluator, EvaluatorOptions, Event, KEY_SCHEME, Key, Live, LiveNode,
    Origin, Request, Store, StoreFolder, Trust, Usage, code_is_in,
};
pub use field::Field;
pub use given::Given;
pub use graph::{Graph, GraphError, Instance, Port, Wire};
pub use job::{
    Cancel, Coarser, Glimpses, InputValue, Job, Lane, LevelJob, NodeError, Outputs, Wanted, Warnings, mix, require_file,
};
pub use lines::{Area, Line, Lines, Vertex};
pub use migrate::{Migration, Step};
pub use node::{
    Begin, Below, Exactness, Fallback, Input, Kernel, Levels, MeasureSpec, Node, Output, OutputType, Reach, Resolution,
    Scratch, Sizing,
};
pub use param::{
    ColourStops, CurvePoints, FileName, Kind, Layer, LayerTable, OutlinePoints, ParamSpec, ParamType, ParamValue,
    ParamValues, PathPoints, Position, Seed, StepPoints, Stroke, Strokes, TimedStrokes, Tool, Waypoint, Waypoints,
    When, check_value, range_text,
};
pub use petgraph::stable_graph::NodeIndex;
pub use ports::{Carried, InputReader, ends};
pub use process::{Moment, Process};
pub use registry::{ExtentOf, Registry};
pub use report::{Amount, Axis, Balance, Measure, Report, Series};
pub use state::State;
pub use stated::{Feed, Stated};
pub use strata::{Column, Strata};
pub use suggest::closest;
pub use unit::{Unit, UnitError, plain};
pub use value::{PortType, Value};
pub use world::{Boundary, Edge, Extent, GeoPlace, Window, World, WorldError, bytes};
