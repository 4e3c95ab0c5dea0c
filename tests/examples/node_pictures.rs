//! Draws the pictures of the manual's node pages: `cargo run --release -p orograph-tests --example node_pictures --
//! [NODE ...]`. Without names, all of them.

use std::error::Error;

use orograph_nodes::registry;
use orograph_tests::{picture, pictures_folder};

fn main() -> Result<(), Box<dyn Error>> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let registry = registry();
    if let Some(unknown) = names.iter().find(|name| registry.get(name).is_none()) {
        return Err(format!("no node is called {unknown}; `orograph nodes` lists them").into());
    }
    let folder = pictures_folder();
    std::fs::create_dir_all(&folder)?;
    for node in registry.listed().filter(|node| names.is_empty() || names.iter().any(|name| name == node.id)) {
        if let Some(bytes) = picture(node) {
            println!("{} {} bytes", node.id, bytes.len());
            std::fs::write(folder.join(format!("{}.jpg", node.id)), bytes)?;
        }
    }
    Ok(())
}
