//! Verifies the outputs of a kernel against its declaration.

use super::{error::EvalError, plan::Step};
use crate::{
    field::Field,
    job::{Outputs, Wanted},
    memory::OutOfMemory,
    value::{PortType, Value},
    world::Window,
};

/// The requested outputs, each verified and cropped to the requested window; others are dropped.
pub(super) fn take(step: &Step<'_>, wanted: Wanted, mut outputs: Outputs) -> Result<Vec<Option<Value>>, EvalError> {
    let (node, id) = (step.instance.name.clone(), step.instance.node.id);
    let state = step.has_state.then(|| {
        if !wanted.contains(step.types.len()) {
            return Ok(None);
        }
        let wrong =
            |message: &str| EvalError::Output { node: node.clone(), id, output: "state", message: message.to_owned() };
        let state = outputs.take_state().ok_or_else(|| wrong("was not returned"))?;
        let state = Value::from(state);
        state.fault().map_or(Ok(Some(state)), |fault| Err(wrong(&fault)))
    });
    let declared = step.instance.node.outputs.iter().zip(&step.types).enumerate();
    declared
        .map(|(at, (output, ty))| {
            if !wanted.contains(at) {
                return Ok(None);
            }
            let (node, id) = (step.instance.name.clone(), step.instance.node.id);
            let value = outputs.take(output.name).ok_or_else(|| "was not returned".to_owned().into());
            let value = value.and_then(|value| fitting(value, *ty, &step.window, &step.wanted));
            let value = value.and_then(|value| value.fault().map_or(Ok(value), |fault| Err(fault.into())));
            value.map(Some).map_err(|fault| match fault {
                Fault::Wrong(message) => EvalError::Output { node, id, output: output.name, message },
                Fault::Memory(refused) => EvalError::OutOfMemory { node, id, refused },
            })
        })
        .chain(state)
        .collect()
}

/// Why an output is rejected.
enum Fault {
    /// It is not as declared.
    Wrong(String),
    /// There is no memory for the requested part.
    Memory(OutOfMemory),
}

impl From<String> for Fault {
    fn from(message: String) -> Self {
        Self::Wrong(message)
    }
}

fn fitting(value: Value, ty: PortType, window: &Window, wanted: &Window) -> Result<Value, Fault> {
    match (value, ty.planes()) {
        (Value::Strata(strata), None) if ty == PortType::Strata => {
            let offset = on_window(strata.offset(), window, wanted)?;
            Ok(strata.on(offset).into())
        }
        (Value::Lines(lines), None) if ty == PortType::Lines => Ok(Value::Lines(lines)),
        (Value::Report(report), None) if ty == PortType::Report => Ok(Value::Report(report)),
        (Value::Strata(_), _) => Err(format!("returned strata instead of a {ty}").into()),
        (Value::Lines(_), _) => Err(format!("returned lines instead of a {ty}").into()),
        (Value::Report(_), _) => Err(format!("returned a report instead of a {ty}").into()),
        (Value::State(_), _) => Err(format!("returned a state instead of a {ty}").into()),
        (Value::Field(_), None) => Err(format!("returned a raster instead of a {ty}").into()),
        (Value::Field(field), Some(planes)) => {
            if field.planes() != planes {
                return Err(format!("returned {} planes; a {ty} has {planes}", field.planes()).into());
            }
            on_window(&field, window, wanted).map(Value::Field)
        }
    }
}

/// The wanted part of a raster that must cover the window.
fn on_window(field: &Field, window: &Window, wanted: &Window) -> Result<Field, Fault> {
    if field.window() != window {
        let [given, asked] = [field.window(), window].map(describe);
        return Err(format!("returned the window {given} instead of the requested {asked}").into());
    }
    field.try_crop(wanted).map_err(Fault::Memory)
}

fn describe(window: &Window) -> String {
    let ([x, y], [nx, ny]) = (window.origin, window.cells);
    format!("{nx} x {ny} cells from ({x}, {y})")
}
