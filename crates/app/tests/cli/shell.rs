//! Completions of shells and pages for `man`.

use super::Place;

/// The commands that the help lists.
fn commands(place: &Place) -> Vec<String> {
    let help = place.run(&["--help"]).done().out;
    let list = help.split("Commands:\n").nth(1).expect("a list").split("\n\n").next().expect("its lines").to_owned();
    let word = |line: &str| line.strip_prefix("  ").and_then(|line| line.split(' ').next()).map(str::to_owned);
    list.lines().filter_map(word).filter(|name| !name.is_empty() && name != "help").collect()
}

#[test]
fn every_shell_completes_every_command() {
    let place = Place::new();
    let commands = commands(&place);
    assert!(commands.len() >= 15, "{commands:?}");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = place.run(&["completions", shell]).done().out;
        for command in &commands {
            assert!(script.contains(command), "{shell} does not complete `{command}`");
        }
        assert!(script.contains("sweep"), "{shell} does not complete the options of `run`");
    }
    place.run(&["completions", "dos"]).ended(1, &["possible values"]);
}

#[test]
fn every_command_has_a_page() {
    let place = Place::new();
    for command in commands(&place) {
        let page = place.run(&["man", &command]).done().out;
        assert!(page.contains(&format!(".TH orograph-{command} 1")), "{command}:\n{page}");
    }
    let page = place.run(&["man"]).done().out;
    assert!(page.contains(".TH orograph 1") && page.contains("orograph\\-run"), "{page}");
    place.run(&["man", "fly"]).ended(1, &["the commands are edit, run"]);
}
