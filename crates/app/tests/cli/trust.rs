//! Stored results that others could have changed.

use std::{
    fs,
    os::unix::fs::{MetadataExt as _, PermissionsExt as _, chown},
};

use super::{Place, SMALL, json_lines};

/// The places from which a run had its results.
fn origins(place: &Place, args: &[&str]) -> Vec<String> {
    let ran = place.run(&[&["run", "g.ron", "--json", "--cache", "kept"], args].concat()).done();
    let nodes = json_lines(&ran.out).into_iter().filter(|line| line["event"] == "node");
    nodes.map(|line| line["origin"].as_str().unwrap_or_default().to_owned()).collect()
}

#[test]
fn a_folder_into_which_everyone_may_write_is_not_used() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    assert!(origins(&place, &[]).iter().all(|origin| origin == "computed"));
    fs::set_permissions(place.path("kept"), fs::Permissions::from_mode(0o777)).expect("set");
    let ran = place.run(&["run", "g.ron", "--cache", "kept"]).done();
    assert_eq!(ran.err.matches("everyone may write").count(), 1, "{}", ran.err);
    assert!(origins(&place, &[]).iter().all(|origin| origin == "computed"));
    assert!(place.run(&["cache", "--cache", "kept"]).done().out.contains("unused"));
    assert!(origins(&place, &["--cache-trust"]).iter().all(|origin| origin == "disk"));
}

/// Only the superuser can give files away; for others the tests of the store cover this.
#[test]
fn results_of_another_user_are_ignored() {
    let place = Place::new();
    place.write("g.ron", SMALL);
    origins(&place, &[]);
    let shards = place.names("kept");
    for name in shards.iter().flat_map(|shard| {
        let shard = format!("kept/{shard}");
        place.names(&shard).into_iter().map(move |name| format!("{shard}/{name}"))
    }) {
        let path = place.path(&name);
        let owner = fs::metadata(&path).expect("there").uid();
        if chown(&path, Some(owner + 1), None).is_err() {
            return;
        }
    }
    let ran = place.run(&["run", "g.ron", "--cache", "kept"]).done();
    assert_eq!(ran.err.matches("belongs to another user").count(), 1, "{}", ran.err);
    // They were replaced by results of this user.
    assert!(origins(&place, &[]).iter().all(|origin| origin == "disk"));
}
