//! `docs/troubleshooting.md` against the code: every reason that the board gives has an entry there,
//! and every entry is of a reason that exists.
//!
//! The reasons on the wire are those of the protocol's schema, which another test compares with the
//! types; the others are read from the source. The anchor of an entry is `Enum.Variant`.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use stillpoint_shared::protocol::SCHEMA;
use stillpoint_shared::trajectory::{MAX_COEFFICIENTS, MAX_ENCODED_BYTES};

/// Enums of the schema whose variants are reasons.
const REASONS: [&str; 12] = [
    "AssemblyError",
    "ConfigError",
    "Denial",
    "DriveConfigError",
    "FaultCause",
    "Limit",
    "LimitsError",
    "Problem",
    "Refusal",
    "Rejection",
    "StoreError",
    "TrajectoryError",
];

/// Enums of the schema whose variants are none.
const OTHERS: [&str; 12] = [
    "Command",
    "CommsPolicy",
    "ConfigField",
    "DriveStatus",
    "HoldReason",
    "LimitName",
    "Mapping",
    "Message",
    "Quantity",
    "Request",
    "Response",
    "State",
];

/// Enums of reasons that do not cross the wire, and where they are.
const OFF_THE_WIRE: [(&str, &str); 3] = [
    ("FrameError", "shared/src/protocol/frame.rs"),
    ("GroupError", "firmware/src/cia402/group.rs"),
    ("Trouble", "firmware/src/cia402/trouble.rs"),
];

/// Where the codes are of what the board sees of a drive; each is explained by a `Trouble` of its name.
const SEEN: &str = "shared/src/drive_error.rs";

/// Where the limit flags are.
const FLAGS: (&str, &str) = ("LimitFlags", "shared/src/status/flags.rs");

/// What every entry says.
const PARTS: [&str; 3] = ["- **Means**: ", "- **Why**: ", "- **Do**: "];

type Names = BTreeSet<String>;

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The name at the beginning of a text.
fn name(text: &str) -> &str {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    &text[..end.unwrap_or(text.len())]
}

/// `Enum.Variant` of all enums of a schema.
fn on_the_wire(schema: &str) -> Names {
    let mut names = Names::new();
    let mut container = None;
    for line in schema.lines() {
        if !line.starts_with(' ') {
            container = line.strip_suffix(" enum");
        } else if let (Some(container), Some((_, variant))) =
            (container, line.trim_start().split_once(' '))
        {
            names.insert(format!("{container}.{}", name(variant)));
        }
    }
    names
}

/// The part of a name before its point.
fn container(name: &str) -> &str {
    name.split_once('.')
        .map_or(name, |(container, _)| container)
}

/// `Enum.Variant` of one enum, from formatted source.
fn declared(container: &str, source: &str) -> Names {
    source
        .lines()
        .skip_while(|line| *line != format!("pub enum {container} {{"))
        .skip(1)
        .take_while(|line| *line != "}")
        .filter_map(|line| line.strip_prefix("    "))
        .filter(|line| line.starts_with(|c: char| c.is_ascii_uppercase()))
        .map(|line| format!("{container}.{}", name(line)))
        .collect()
}

/// `LimitFlags.FLAG`, from source.
fn flags(source: &str) -> Names {
    source
        .lines()
        .filter_map(|line| line.trim_start().strip_prefix("pub const "))
        .filter_map(|line| line.split_once(": Self = Self("))
        .filter(|(flag, _)| *flag != "NONE")
        .map(|(flag, _)| format!("{}.{flag}", FLAGS.0))
        .collect()
}

/// `Trouble.Code` of the codes that the board gives itself, from source.
fn codes(source: &str) -> Names {
    let (_, module) = source.split_once("pub mod seen {\n").expect("the codes");
    let (module, _) = module.split_once("\n}").expect("their end");
    between(module, "pub const ", ": u16")
        .iter()
        .map(|code| {
            let words = code.split('_').map(|word| {
                let (first, rest) = word.split_at(1);
                first.to_owned() + &rest.to_lowercase()
            });
            format!("Trouble.{}", words.collect::<String>())
        })
        .collect()
}

/// All reasons there are, given the schema of the protocol.
fn reasons(schema: &str) -> Names {
    let mut all = on_the_wire(schema);
    all.retain(|name| REASONS.contains(&container(name)));
    for (container, path) in OFF_THE_WIRE {
        let found = declared(container, &read(path));
        assert!(!found.is_empty(), "{path} has no enum {container}");
        all.extend(found);
    }
    let found = codes(&read(SEEN));
    assert!(!found.is_empty(), "{SEEN} has no codes");
    all.extend(found);
    let found = flags(&read(FLAGS.1));
    assert!(!found.is_empty(), "{} has no flags", FLAGS.1);
    all.extend(found);
    all
}

/// What stands between two marks, for every pair of them.
fn between(text: &str, before: &str, after: &str) -> Vec<String> {
    text.split(before)
        .skip(1)
        .filter_map(|rest| rest.split_once(after))
        .map(|(found, _)| found.to_owned())
        .collect()
}

fn anchors(page: &str) -> Vec<String> {
    between(page, "<a id=\"", "\">")
}

fn page() -> String {
    read("docs/troubleshooting.md")
}

#[test]
fn every_reason_has_an_entry_and_every_entry_a_reason() {
    let found = anchors(&page());
    let entries: Names = found.iter().cloned().collect();
    assert_eq!(entries.len(), found.len(), "an anchor is there twice");
    let reasons = reasons(SCHEMA);
    let missing: Vec<_> = reasons.difference(&entries).collect();
    assert!(
        missing.is_empty(),
        "docs/troubleshooting.md lacks {missing:?}"
    );
    let stale: Vec<_> = entries.difference(&reasons).collect();
    assert!(stale.is_empty(), "the code no longer has {stale:?}");
}

#[test]
fn every_enum_of_the_protocol_is_known_to_be_a_reason_or_none() {
    let found: BTreeSet<_> = on_the_wire(SCHEMA)
        .iter()
        .map(|name| container(name).to_owned())
        .collect();
    let known = REASONS.into_iter().chain(OTHERS);
    let known: BTreeSet<_> = known.map(str::to_owned).collect();
    assert_eq!(
        found, known,
        "add new enums to REASONS or OTHERS, and entries for reasons"
    );
}

#[test]
fn a_new_reason_without_an_entry_is_noticed() {
    let newer = SCHEMA.replacen(
        "FaultCause enum\n",
        "FaultCause enum\n    99 OnFire { axis: u8 }\n",
        1,
    );
    let entries: Names = anchors(&page()).into_iter().collect();
    let reasons = reasons(&newer);
    let missing: Vec<_> = reasons.difference(&entries).collect();
    assert_eq!(missing, ["FaultCause.OnFire"]);
}

#[test]
fn the_index_leads_to_every_entry_in_order() {
    let page = page();
    let (head, entries) = page
        .split_once("\n## Faults\n")
        .expect("the faults come first");
    // The first link leads to the symptoms.
    let links = between(head, "](#", ")");
    assert_eq!(links[1..], anchors(entries)[..]);
}

#[test]
fn links_within_the_page_lead_somewhere() {
    let page = page();
    let titles = page.lines().filter_map(|line| line.strip_prefix("## "));
    let mut places: Names = titles
        .map(|title| title.to_lowercase().replace(' ', "-"))
        .collect();
    places.extend(anchors(&page));
    for link in between(&page, "](#", ")") {
        assert!(places.contains(&link), "#{link}");
    }
}

/// A number with a comma between thousands.
fn with_comma(number: usize) -> String {
    match (number / 1000, number % 1000) {
        (0, rest) => rest.to_string(),
        (thousands, rest) => format!("{},{rest:03}", with_comma(thousands)),
    }
}

#[test]
fn sizes_on_the_page_are_those_of_the_code() {
    let page = page();
    let kib = MAX_COEFFICIENTS * size_of::<f32>() / 1024;
    for size in [
        format!("more than {} in all", with_comma(MAX_COEFFICIENTS)),
        format!("{kib} KiB of values each"),
        format!("`MAX_ENCODED_BYTES` ({})", with_comma(MAX_ENCODED_BYTES)),
    ] {
        assert!(
            page.contains(&size),
            "docs/troubleshooting.md lacks “{size}”"
        );
    }
}

#[test]
fn every_entry_says_what_it_means_why_there_is_a_rule_and_what_to_do() {
    let page = page();
    let (entries, _) = page
        .split_once("\n## Symptoms\n")
        .expect("the symptoms come last");
    let entries: Vec<_> = entries.split("\n### ").skip(1).collect();
    assert!(entries.len() > 100, "{} entries", entries.len());
    for entry in entries {
        let title = entry.lines().next().unwrap_or_default();
        for part in PARTS {
            let count = entry.lines().filter(|line| line.starts_with(part)).count();
            assert_eq!(count, 1, "{part:?} in “{title}”");
        }
    }
}
