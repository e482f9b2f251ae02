//! Formatting the file, and its JSON Schema for editors.

use lexican_machine::{format, schema};

#[test]
fn the_usual_form_keeps_comments_and_order() {
    let text = "# a machine\n\n\n[bus]\nurl=\"can0\" # the adapter\nbit-rate   = \"500 kbit/s\"\n[node.b]\nid=6\nidentity={vendor=0x195,product=1}\n\n[node.a]\n# the feeder\nid = 5\noverlay=[ \"a.toml\",\"b.toml\" ]\n";
    let formatted = format(text).unwrap();
    assert_eq!(
        formatted,
        "# a machine\n\n[bus]\nurl = \"can0\"  # the adapter\nbit-rate = \"500 kbit/s\"\n[node.b]\nid = 6\nidentity = { vendor = 0x195, product = 1 }\n\n[node.a]\n# the feeder\nid = 5\noverlay = [\"a.toml\", \"b.toml\"]\n"
    );
    assert_eq!(format(&formatted).unwrap(), formatted);
    assert!(format("[bus").is_err());
}

#[test]
fn every_key_is_explained_to_editors() {
    let schema = schema().to_string();
    for words in ["boots-again", "Its heartbeat (1017h)", "cob-id", "\"maximum\":127", "in-a-row"] {
        assert!(schema.contains(words), "{words}");
    }
}
