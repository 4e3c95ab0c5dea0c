//! Every shader of every node is valid and is translated to the languages of all drivers, without a device.

use std::collections::BTreeSet;

use naga::{
    back::{glsl, hlsl, msl, spv},
    proc::BoundsCheckPolicies,
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};
use orograph_graph::gpu::{Role, Shader};
use orograph_tests::gpu::nodes;

/// All shaders, each with the id of its node and its whole text.
fn shaders() -> Vec<(&'static str, &'static Shader, String)> {
    let of = |node: &'static orograph_graph::Node| {
        let kernel = node.gpu.expect("a kernel for the GPU");
        kernel.shaders.iter().map(|shader| (node.id, *shader, shader.text(node)))
    };
    nodes().into_iter().flat_map(of).collect()
}

fn parsed(id: &str, shader: &Shader, text: &str) -> (naga::Module, ModuleInfo) {
    let name = shader.name;
    let module = naga::front::wgsl::parse_str(text)
        .unwrap_or_else(|error| panic!("{id}, {name}: {}", error.emit_to_string_with_path(text, name)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|error| panic!("{id}, {name}: {}", error.emit_to_string_with_path(text, name)));
    (module, info)
}

#[test]
fn every_shader_is_valid_and_translates_to_spir_v_msl_hlsl_and_glsl() {
    let all = shaders();
    assert!(!all.is_empty());
    for (id, shader, text) in &all {
        let (module, info) = parsed(id, shader, text);
        let name = shader.name;
        assert!(!module.entry_points.is_empty(), "{name} has no entry point");
        let words = spv::write_vec(&module, &info, &spv::Options::default(), None);
        assert!(words.is_ok_and(|words| !words.is_empty()), "{name}: SPIR-V");
        let written = msl::write_string(&module, &info, &msl::Options::default(), &msl::PipelineOptions::default());
        assert!(written.is_ok(), "{name}: MSL: {:?}", written.err());
        let mut text = String::new();
        let (options, pipeline) = (hlsl::Options::default(), hlsl::PipelineOptions::default());
        let written = hlsl::Writer::new(&mut text, &options, &pipeline).write(&module, &info, None);
        assert!(written.is_ok(), "{name}: HLSL: {:?}", written.err());
        for entry in &module.entry_points {
            let options = glsl::Options { version: glsl::Version::Desktop(430), ..glsl::Options::default() };
            let pipeline = glsl::PipelineOptions {
                shader_stage: naga::ShaderStage::Compute,
                entry_point: entry.name.clone(),
                multiview: None,
            };
            let mut text = String::new();
            let policies = BoundsCheckPolicies::default();
            let writer = glsl::Writer::new(&mut text, &module, &info, &options, &pipeline, policies);
            let written = writer.and_then(|mut writer| writer.write());
            assert!(written.is_ok(), "{name}, {}: GLSL: {:?}", entry.name, written.err());
        }
    }
}

/// Each output that a shader declares is written through `checked`, so that a sample that is not finite is found; each
/// file of a shader belongs to a node, and has its name.
#[test]
fn outputs_are_checked_and_no_shader_is_left_over() {
    let mut names = BTreeSet::new();
    for (id, shader, _) in shaders() {
        names.insert(format!("{}.wgsl", shader.name));
        for slot in shader.slots.iter().filter(|slot| matches!(slot.role, Role::Output(_))) {
            let variable = slot.variable();
            let writes = shader.source.lines().filter(|line| line.contains(&format!("{variable}[")));
            let writes: Vec<&str> = writes.filter(|line| line.contains("] = ")).collect();
            assert!(!writes.is_empty(), "{id}, {}: `{variable}` is never written", shader.name);
            let unchecked = writes.iter().find(|line| !line.contains("= checked("));
            assert!(unchecked.is_none(), "{id}, {}: {unchecked:?} is not checked", shader.name);
        }
    }
    let root = orograph_tests::root().join("shaders");
    for folder in std::fs::read_dir(&root).expect("the shaders").map(|entry| entry.expect("an entry")) {
        let category = folder.file_name().to_string_lossy().into_owned();
        if matches!(category.as_str(), "lib" | "view") {
            continue;
        }
        for file in std::fs::read_dir(folder.path()).expect("a folder of shaders") {
            let name = format!("{category}/{}", file.expect("an entry").file_name().to_string_lossy());
            assert!(names.contains(&name), "shaders/{name} belongs to no node; delete it");
        }
    }
}
