//! The area within a distance of lines; see [`crate::numerics::polylines`].

use orograph_graph::memory::filled;

use crate::{
    numerics::{math::smoothstep, par, polylines},
    prelude::*,
};

params! {
    /// Distance from the edge of the lines up to which the mask is 1.
    width: f64 = 100.0, Metres, 0.0..=1e6, soft 0..=2000;
    /// Distance beyond that over which the mask falls to 0; at least one cell.
    edge: f64 = 50.0, Metres, 0.0..=1e6, soft 0..=2000;
}

inputs! {
    /// Lines with widths, such as those of `Path`, `Route` and `Rivers`.
    lines: Lines;
}

outputs! {
    /// 1 on the lines and beside them, 0 away from them.
    mask: Mask;
}

/// The declaration.
pub static NODE: Node = Node {
    id: "Buffer",
    category: "select",
    summary: "The area within a distance of lines, with a soft edge: flood plains, verges, cleared strips.",
    doc: include_str!("buffer.md"),
    inputs: Inputs::PORTS,
    outputs: Given::PORTS,
    params: Params::specs,
    cpu: run,
    example: "lines: \"path.lines\", width: 800, edge: 600",
    ..Node::DEFAULT
};

fn run(job: &Job<'_>) -> Result<Outputs, NodeError> {
    let Inputs { lines } = Inputs::read(job)?;
    let params = Params::read(job.params);
    // a hard border runs through the middle of the cells that it crosses
    let edge = params.edge.max(job.cell_m());
    let width = params.width - 0.5 * (edge - params.edge);
    let mut mask = filled(job.window().len(), (width + edge) as f32)?;
    polylines::approach(job, lines, &mut mask)?;
    par::change(&mut mask, |distance| {
        *distance = smoothstep(1.0 - (f64::from(*distance) - width) / edge) as f32;
    });
    Ok(Given { mask: Some(Field::new(job.window(), mask)) }.into())
}

#[cfg(test)]
mod tests {
    use orograph_graph::{Cancel, Line, Lines, Value, Vertex, Wanted};

    use super::*;
    use crate::testing::{run_with, with_params, world};

    /// A line along y = 500 m, 40 m wide.
    fn mask(changes: &str) -> Field {
        let at = |x: f64| Vertex { position_m: [x, 500.0], width_m: 40.0, ..Vertex::default() };
        let line = Line { order: 1, downstream: None, vertices: vec![at(-100.0), at(1100.0)] };
        let value = |_: &str| Some(Value::from(Lines::open(vec![line.clone()])));
        let window = Window::whole(world(100, 100, 10.0));
        let (outputs, _) =
            run_with(Wanted::ALL, &Cancel::default(), window, &NODE, &with_params(&NODE, changes), &value);
        outputs.expect("a result").take("mask").expect("an output").as_field().expect("a field").clone()
    }

    #[test]
    fn the_mask_is_one_within_the_width_and_fades_over_the_edge() {
        let mask = mask("width=100,edge=80");
        for row in 0..100_u16 {
            let distance = (f64::from(row) * 10.0 + 5.0 - 500.0).abs() - 20.0;
            let expected = smoothstep(1.0 - (distance - 100.0) / 80.0);
            let found = f64::from(mask.samples()[usize::from(row) * 100 + 30]);
            assert!((found - expected).abs() < 1e-6, "{distance}: {found} {expected}");
        }
    }

    #[test]
    fn a_hard_edge_keeps_the_area() {
        let mask = mask("width=103,edge=0");
        let area: f32 = mask.samples().iter().sum::<f32>() * 100.0;
        let expected = 1000.0 * 2.0 * (20.0 + 103.0);
        assert!((area - expected).abs() < 0.01 * expected, "{area}");
        let alone = self::mask("width=0,edge=0");
        let area: f32 = alone.samples().iter().sum::<f32>() * 100.0;
        assert!((area - 40_000.0).abs() < 400.0, "{area}");
    }
}
