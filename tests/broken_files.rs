//! Each file in `data/broken/` is broken in one way, and its message says which.

use std::collections::BTreeSet;
use std::path::Path;

use decimate::io::{self, ReadOptions};

/// `expected.tsv` has a line `file<TAB>message` for each file, and each file has a line.
#[test]
fn broken_files_give_the_message_that_they_ask_for() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/broken");
    let table = std::fs::read_to_string(folder.join("expected.tsv")).unwrap();
    let mut listed = BTreeSet::from(["expected.tsv".to_string()]);
    let mut wrong = String::new();
    for line in table.lines() {
        let (name, expected) = line.split_once('\t').expect("file<TAB>message");
        assert!(
            listed.insert(name.to_string()),
            "{name} stands twice in expected.tsv"
        );
        let found = match io::read(&folder.join(name), &ReadOptions::default()) {
            Ok(mesh) => format!("read {} triangles", mesh.triangle_count()),
            Err(error) => error.to_string(),
        };
        let prefix = format!("{}{}", folder.display(), std::path::MAIN_SEPARATOR);
        let found = found.strip_prefix(&prefix).unwrap_or(&found);
        if found != expected {
            wrong += &format!("{name}\t{found}\n");
        }
    }
    assert!(
        wrong.is_empty(),
        "messages that differ from expected.tsv:\n{wrong}"
    );
    let files = std::fs::read_dir(&folder).unwrap();
    let there: BTreeSet<String> = files
        .map(|file| file.unwrap().file_name().into_string().unwrap())
        .collect();
    assert_eq!(
        there, listed,
        "files in data/broken against lines in expected.tsv"
    );
}
