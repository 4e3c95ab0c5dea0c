//! The imports of a node's file.

pub(crate) use orograph_graph::{
    Balance, ColourStops, CurvePoints, Field, FileName, Job, Lane, Migration, Node, NodeError, Outputs, ParamValues,
    PathPoints, PortType, Reach, Report, Resolution, Scratch, Seed, Sizing, Step, StepPoints, TimedStrokes, Unit,
    Window, choice, inputs, outputs, params,
};
