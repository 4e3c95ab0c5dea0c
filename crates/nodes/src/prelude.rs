//! What a node's file imports.

pub(crate) use orograph_graph::{
    ColourStops, CurvePoints, Field, FileName, Input, Job, Lane, Migration, Node, NodeError, Output, Outputs,
    ParamValues, PathPoints, PortType, Reach, Report, Resolution, Seed, Step, StepPoints, TimedStrokes, Unit, Window,
    choice, params,
};
