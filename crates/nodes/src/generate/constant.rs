//! A constant field.

use crate::{
    prelude::*,
    quantity::{self, Quantity},
};

params! {
    /// The value, in metres for a height.
    value: f64 = 0.0, One, -1e9..=1e9, soft -1000..=1000;
    /// Quantity of the value, which decides where it may be wired.
    quantity: Quantity = Quantity::Height, One, ..;
}

outputs! {
    /// The value in every cell.
    value: Chosen(quantity::port_type);
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Constant",
    category: "generate",
    summary: "The same value everywhere.",
    doc: "A level plain, a full mask or a number shared by several nodes. Where one input needs one number, write the \
          number at that input instead.",
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    gpu: Some(&GPU),
    example: "value: 250",
    ..Node::DEFAULT
};

static GPU: GpuKernel = GpuKernel {
    shaders: &[&Shader {
        name: "generate/constant",
        source: wgsl!("generate/constant"),
        library: &[],
        values: &[],
        slots: &[Slot::output("value")],
    }],
    passes: Passes::POINT,
    covers: |params| {
        let params = Params::read(params);
        quantity::check(params.quantity, &[params.value]).is_ok()
    },
    tolerance: &[Tolerance::EXACT],
    ..GpuKernel::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let params = Params::read(job.params);
    quantity::check(params.quantity, &[params.value])?;
    Ok(Given { value: Some(Field::constant(job.window(), params.value as f32)) }.into())
}
