//! The message types in words, against the types themselves.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_reflection::{
    ContainerFormat, Format, FormatHolder, Named, Registry, Samples, Tracer, TracerConfig,
    VariantFormat,
};
use stillpoint_shared::assembly::AssemblyError;
use stillpoint_shared::drive_config::{
    AxisDrive, BusConfig, DriveConfig, DriveConfigError, Mapping, Problem,
};
use stillpoint_shared::protocol::{
    Denial, Message, Request, Response, SCHEMA, SCHEMA_HASH, StoreError,
};
use stillpoint_shared::status::{
    Command, CommsPolicy, ConfigError, ConfigField, DriveStatus, FaultCause, HoldReason, Limit,
    Quantity, Refusal, Rejection, State,
};
use stillpoint_shared::{LimitName, LimitsError, TrajectoryError};

fn registry() -> Registry {
    // Types that check their values would not be read from zeros.
    let config = TracerConfig::default().default_f32_value(1.0);
    let mut tracer = Tracer::new(config.record_samples_for_structs(true));
    let mut samples = Samples::new();
    let drive = AxisDrive {
        bus: 0,
        node: 1,
        counts_per_turn: 1.0,
        reversed: false,
        home_counts: 0,
        home_rad: 0.0,
        gear_ratio: 1.0,
        rated_torque_nm: 1.0,
        torque_limit_permille: 1,
        mapping: Mapping::Write,
        tells_following: true,
    };
    let drives = DriveConfig::new(BusConfig::default(), &[drive]).unwrap();
    tracer.trace_value(&mut samples, &drives).unwrap();

    macro_rules! trace {
        ($($name:ty),*) => {
            $(tracer.trace_type::<$name>(&samples).unwrap();)*
        };
    }
    trace!(
        State,
        Command, CommsPolicy, DriveStatus, HoldReason, Quantity, Limit, LimitName
    );
    trace!(
        ConfigField,
        ConfigError, FaultCause, Rejection, TrajectoryError, Refusal, LimitsError
    );
    trace!(
        Mapping,
        Problem, AssemblyError, DriveConfigError, StoreError, Denial
    );
    trace!(Request<'_>, Response, Message);
    tracer.registry().unwrap()
}

fn named(fields: &[Named<Format>]) -> String {
    let fields: Vec<_> = fields
        .iter()
        .map(|field| format!("{}: {}", field.name, words(&field.value)))
        .collect();
    format!("{{ {} }}", fields.join(", "))
}

fn tuple(fields: &[Format]) -> String {
    let fields: Vec<_> = fields.iter().map(words).collect();
    format!("({})", fields.join(", "))
}

fn words(format: &Format) -> String {
    match format {
        Format::TypeName(name) => name.clone(),
        Format::Option(inner) => format!("{}?", words(inner)),
        Format::Seq(inner) => format!("[{}]", words(inner)),
        Format::Tuple(fields) => tuple(fields),
        Format::TupleArray { content, size } => format!("[{}; {size}]", words(content)),
        simple => format!("{simple:?}").to_lowercase(),
    }
}

fn variants(variants: &BTreeMap<u32, Named<VariantFormat>>) -> String {
    let mut text = String::from("enum\n");
    for (index, variant) in variants {
        let content = match &variant.value {
            VariantFormat::Unit => String::new(),
            VariantFormat::NewType(inner) => format!("({})", words(inner)),
            VariantFormat::Tuple(fields) => tuple(fields),
            VariantFormat::Struct(fields) => format!(" {}", named(fields)),
            VariantFormat::Variable(_) => panic!("{} was not traced", variant.name),
        };
        writeln!(text, "    {index} {}{content}", variant.name).unwrap();
    }
    text
}

fn schema() -> String {
    let mut text = String::from("Message types as postcard writes them. Written by a test.\n");
    for (name, mut container) in registry() {
        container.normalize().unwrap();
        let content = match &container {
            ContainerFormat::UnitStruct => "()\n".into(),
            ContainerFormat::NewTypeStruct(inner) => format!("({})\n", words(inner)),
            ContainerFormat::TupleStruct(fields) => format!("{}\n", tuple(fields)),
            ContainerFormat::Struct(fields) => {
                let fields = fields
                    .iter()
                    .map(|field| format!("    {}: {}\n", field.name, words(&field.value)));
                format!("struct\n{}", fields.collect::<String>())
            }
            ContainerFormat::Enum(all) => variants(all),
        };
        write!(text, "{name} {content}").unwrap();
    }
    text
}

#[test]
fn the_schema_is_that_of_the_types() {
    let traced = schema();
    if std::env::var_os("STILLPOINT_WRITE_SCHEMA").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/protocol/schema.txt");
        std::fs::write(path, &traced).unwrap();
        return;
    }
    for (line, (written, traced)) in (1..).zip(SCHEMA.lines().zip(traced.lines())) {
        assert_eq!(
            written, traced,
            "line {line} of schema.txt: the messages have changed; count PROTOCOL up if they were \
             released, then write the schema anew (see protocol::SCHEMA)"
        );
    }
    assert_eq!(SCHEMA, traced);
    assert_ne!(SCHEMA_HASH, 0);
}
