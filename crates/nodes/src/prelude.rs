//! The imports of a node's file.

pub(crate) use orograph_graph::{
    Averaging, Balance, ColourStops, CurvePoints, Feed, Field, FileName, Job, Lane, Migration, Node, NodeError,
    OutlinePoints, Outputs, ParamValues, PathPoints, PortType, Position, Reach, Report, Resolution, Scratch, Seed,
    Sizing, Stated, Step, StepPoints, TimedStrokes, Unit, Waypoints, Window, choice,
    gpu::{Bind, GpuKernel, Number, Over, Pass, Passes, Ports, Recorder, Rows, Scalar, Shader, Slot, Tolerance},
    inputs, outputs, params, require_file,
};

pub(crate) use crate::wgsl::wgsl;
