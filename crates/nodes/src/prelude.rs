//! What a node's file imports.

pub(crate) use orograph_graph::{
    ColourStops, CurvePoints, Field, FileName, Job, Lane, Node, NodeError, Outputs, ParamValues, PathPoints, PortType,
    Reach, Report, Resolution, Seed, StepPoints, TimedStrokes, Unit, Window, choice, inputs, outputs, params,
};
