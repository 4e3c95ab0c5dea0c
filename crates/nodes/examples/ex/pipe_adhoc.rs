//! ad hoc
use std::time::Instant;
use orograph_graph::*;
use orograph_nodes as nodes;
fn run(node: &'static Node, window: Window, changes: &[(&'static str, ParamValue)], inputs: &[(&str, InputValue)]) -> Outputs {
    let mut params = ParamValues::defaults(&node.specs());
    for (k, v) in changes { params.set(k, v.clone()); }
    let inputs = node.inputs.iter().map(|i| match inputs.iter().find(|(n, _)| *n == i.name) {
        Some((_, v)) => v.clone(),
        None => match i.fallback { Fallback::Constant { default, .. } => InputValue::Constant(default), _ => InputValue::Absent },
    }).collect();
    let job = Job { node, params: &params, inputs, window, folder: ".".into(), cancel: Cancel::default(), progress: &|_| () };
    (node.cpu)(&job).expect("result")
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: u32 = args[1].parse().unwrap();
    let size: f64 = args[2].parse().unwrap();
    let out = &args[3];
    let mut world = World { size: [size, size], cells: [n, n], ..World::default() };
    let mut changes = vec![];
    let mut inputs: Vec<(&str, InputValue)> = vec![];
    let mut source = String::from("perlin");
    for kv in &args[4..] {
        let (k, v) = kv.split_once('=').unwrap();
        if k == "source" { source = v.into(); continue; }
        if k == "edge" { world.boundary = Boundary::all(match v { "wall" => Edge::Wall, "open" => Edge::Open, _ => Edge::Periodic }); continue; }
        let k: &'static str = Box::leak(k.to_owned().into_boxed_str());
        let specs = nodes::erosion::hydraulic_pipe::NODE.specs();
        if let Some(s) = specs.iter().find(|s| s.name == k) {
            changes.push((k, match &s.kind { Kind::Choice { options, .. } => ParamValue::Choice(options.iter().find(|o| o.0 == v).unwrap().0), _ => ParamValue::Float(v.parse().unwrap()) }));
        } else { inputs.push((k, InputValue::Constant(v.parse().unwrap()))); }
    }
    let window = Window::whole(world);
    let height = if source == "perlin" {
        run(&nodes::generate::perlin::NODE, window, &[("amplitude", ParamValue::Float(size * 0.12)), ("wavelength", ParamValue::Float(size * 0.4)), ("octaves", ParamValue::Int(9))], &[]).take("height").unwrap().as_field().unwrap().clone()
    } else {
        let bytes = std::fs::read(&source).unwrap();
        let z: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        let m = (z.len() as f64).sqrt() as usize;
        let s: Vec<f32> = (0..window.len()).map(|at| { let [x, y] = [(at % n as usize) as f64, (at / n as usize) as f64].map(|v| ((v + 0.5) * m as f64 / n as f64 - 0.5).clamp(0.0, m as f64 - 1.001)); let (i, j) = (x as usize, y as usize); let (u, v) = ((x - i as f64) as f32, (y - j as f64) as f32); let g = |i: usize, j: usize| z[j * m + i]; (g(i, j) * (1.0 - u) + g(i + 1, j) * u) * (1.0 - v) + (g(i, j + 1) * (1.0 - u) + g(i + 1, j + 1) * u) * v }).collect();
        Field::new(window, s)
    };
    inputs.push(("height", InputValue::Value(height.clone().into())));
    let t = Instant::now();
    let mut o = run(&nodes::erosion::hydraulic_pipe::NODE, window, &changes, &inputs);
    let s = t.elapsed().as_secs_f64();
    let report = o.take("report").unwrap();
    let report = report.as_report().unwrap();
    for m in &report.measures { print!("{}={:.4e}{} ", m.name, m.value, m.unit); }
    println!("\n{s:.2} s, {:.3} ns per cell and step", s * 1e9 / window.len() as f64 / report.get("steps").unwrap());
    if out == "-" { return; }
    let after = o.take("height").unwrap().as_field().unwrap().clone();
    let shade = |f: &Field, name: &str| {
        let mut r = run(&nodes::render::hillshade::NODE, window, &[], &[("height", InputValue::Value(f.clone().into()))]);
        save(r.take(nodes::render::hillshade::NODE.outputs[0].name).unwrap().as_field().unwrap(), [0.0, 1.0], &format!("{out}_{name}.png"));
    };
    shade(&height, "before"); shade(&after, "after");
    let log = |f: &Field, lo: f32| Field::new(window, f.plane(0).iter().map(|v| v.max(lo).log10()).collect());
    save(&log(o.take("flow").unwrap().as_field().unwrap(), 1e-5), [-4.0, 1.5], &format!("{out}_flow.png"));
    save(&log(o.take("water").unwrap().as_field().unwrap(), 1e-4), [-3.0, 1.0], &format!("{out}_water.png"));
    let dep = o.take("deposition").unwrap(); let dep = dep.as_field().unwrap();
    println!("deposition {:?}", dep.range(0));
    save(dep, [-10.0, 10.0], &format!("{out}_dep.png"));
}
fn save(f: &Field, range: [f32; 2], name: &str) {
    let (w, h) = (f.window().nx() as u32, f.window().ny() as u32);
    let px: Vec<u8> = f.plane(0).iter().map(|v| ((v - range[0]) / (range[1] - range[0]) * 255.0).clamp(0.0, 255.0) as u8).collect();
    let mut e = png::Encoder::new(std::fs::File::create(name).unwrap(), w, h);
    e.set_color(png::ColorType::Grayscale); e.set_depth(png::BitDepth::Eight);
    e.write_header().unwrap().write_image_data(&px).unwrap();
}
